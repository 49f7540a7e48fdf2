//! `specula bench` and `specula inspect`, and the overlay that the latter draws.

mod program;

use program::{specula, text};
use serde_json::Value;
use specula::frame::LeafKind;
use specula::measure::{Layer, ReferenceImage, draw_overlay};
use specula::scene::World;
use specula::{Budget, Engine, EngineOptions, Frame, Method, Scene};
use std::fs;
use std::process::Output;

const SIZE: (u32, u32) = (200, 150);

const SCENE: &str = "(objects: [(shape: Teapot())], lights: [Point(position: (3, -4, 5)), \
    Point(position: (-4, -3, 4), intensity: 0.5)])\n";

// ---- The program ----

fn workplace() -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    fs::write(directory.path().join("teapot.ron"), SCENE).expect("writable");
    directory
}

/// The one JSON object on stdout of a run that succeeded.
#[track_caller]
fn json(output: &Output) -> Value {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let stdout = text(&output.stdout);
    assert_eq!(stdout.lines().count(), 1, "{stdout}");
    serde_json::from_str(stdout).expect("a JSON object")
}

#[test]
fn what_makes_no_sense_is_refused_in_a_sentence_and_nothing_is_written() {
    let directory = workplace();
    let place = directory.path();
    for (arguments, status, message) in [
        ("bench", 2, "SCENE"),
        ("bench teapot.ron --views 0", 2, "from 1 to 3600"),
        ("bench teapot.ron --views 9999999", 2, "from 1 to 3600"),
        ("bench teapot.ron --repeat -1", 2, "-1"),
        ("bench teapot.ron --error -1", 2, "-1"),
        ("bench teapot.ron --method magic", 2, "phong-area"),
        ("bench teapot.ron --budget nan", 2, "milliseconds"),
        (
            "bench teapot.ron --budget 1 --work 1",
            2,
            "cannot be used with",
        ),
        ("bench teapot.ron --size 0x5", 2, "at least one pixel"),
        ("bench none.ron", 1, "error: cannot read scene 'none.ron'"),
        ("inspect", 2, "SCENE"),
        ("inspect none.ron", 1, "error: cannot read scene 'none.ron'"),
        (
            "inspect teapot.ron --overlay a.jpg",
            2,
            "error: the output must be a .png file",
        ),
        (
            "inspect teapot.ron --overlay none/a.png",
            1,
            "error: cannot write none/a.png: No such file or directory",
        ),
        (
            "inspect teapot.ron --overlay a.png --show pht,magic",
            2,
            "no layer is called 'magic'; there are wireframe, pht,",
        ),
        ("inspect teapot.ron --show pht", 2, "--overlay"),
        ("inspect teapot.ron --frames 0", 2, "from 1"),
        (
            "inspect teapot.ron --budget 1 --work 1",
            2,
            "cannot be used with",
        ),
    ] {
        let words: Vec<&str> = arguments.split(' ').collect();
        let output = specula(place, &words);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{arguments}: {error}");
        assert!(error.contains(message), "{arguments}: {error}");
        assert!(output.stdout.is_empty(), "{arguments}");
    }
    let left = fs::read_dir(place).expect("readable").count();
    assert_eq!(left, 1, "only the scene is there");
}

#[test]
fn bench_prints_what_scripts_rely_on() {
    let directory = workplace();
    let run = |rest: &str| {
        let words = format!("bench teapot.ron --size 96x64 --views 5 --threads 1 {rest}");
        specula(
            directory.path(),
            &words.split_whitespace().collect::<Vec<_>>(),
        )
    };
    let report = json(&run("--json"));
    let keys = "scene method width height threads views lights triangles frame_ms_min frame_ms_median \
        frame_ms_p99 triangles_drawn triangles_subdivided rmse psnr_db";
    for key in keys.split_whitespace() {
        assert!(!report[key].is_null(), "`{key}` in {report}");
    }
    for stage in [
        "cull", "shade", "classify", "raster", "refine", "resolve", "present",
    ] {
        assert!(
            report["stage_ms"][stage].is_number(),
            "`{stage}` in {report}"
        );
    }
    for key in ["prediction_error_median", "prediction_error_p95"] {
        let errors = report[key].as_object().expect("an object");
        let names: Vec<&str> = errors.keys().map(String::as_str).collect();
        let mut stages = vec!["cull", "shade", "classify", "raster", "refine", "resolve"];
        stages.extend(["present", "total"]);
        stages.sort_unstable();
        assert_eq!(names, stages, "{key}");
        for stage in ["raster", "resolve", "refine", "total"] {
            let error = errors[stage].as_f64().expect("it was predicted");
            assert!(error.is_finite() && error >= 0.0, "{stage}: {error}");
            let [median, p95] = ["prediction_error_median", "prediction_error_p95"]
                .map(|key| report[key][stage].as_f64());
            assert!(median <= p95, "{stage}: {report}");
        }
    }
    assert_eq!(
        (&report["scene"], &report["method"]),
        (&"teapot".into(), &"adaptive".into())
    );
    assert_eq!(
        (&report["views"], &report["lights"]),
        (&5.into(), &2.into())
    );
    assert_eq!(
        (&report["triangles"], &report["converged_frames"]),
        (&3584.into(), &5.into())
    );
    let ms = |key: &str| report[key].as_f64().expect("a number");
    assert!(0.0 < ms("frame_ms_min") && ms("frame_ms_min") <= ms("frame_ms_median"));
    assert!(ms("frame_ms_median") <= ms("frame_ms_p99"));
    assert!(ms("rmse") < 0.5, "it converged: {report}");
    assert!(report["late_frames"].is_null() && report["budget_ms"].is_null());

    let report = json(&run("--json --budget 0 --repeat 2 --error 0"));
    assert_eq!(report["late_frames"], 10, "no frame takes no time");
    assert!(report["rmse"].is_null() && report["overshoot_ms_max"].as_f64() > Some(0.0));

    let output = run("--work 20000 --error 1");
    let lines = text(&output.stdout);
    for part in [
        "frame      min",
        "1 views compared",
        "subdivided",
        "predicted  off by cull ",
        " % (medians)",
        " % (p95)",
    ] {
        assert!(lines.contains(part), "{lines}");
    }
}

#[test]
fn inspect_counts_everything_once() {
    let directory = workplace();
    let run = |rest: &str| {
        let words = format!("inspect teapot.ron --size 160x120 --threads 1 {rest}");
        specula(
            directory.path(),
            &words.split_whitespace().collect::<Vec<_>>(),
        )
    };
    for rest in ["--work 60000 --json", "--json", "--method phong --json"] {
        let report = json(&run(rest));
        let n = |value: &Value| {
            value
                .as_u64()
                .unwrap_or_else(|| panic!("{value} in {report}"))
        };
        let t = &report["triangles"];
        let parts = [
            "in_culled_clusters",
            "facing_away",
            "off_screen",
            "hidden",
            "visible",
        ];
        assert_eq!(
            parts.iter().map(|part| n(&t[part])).sum::<u64>(),
            n(&t["total"]),
            "{report}"
        );
        assert_eq!(n(&t["hidden"]) + n(&t["visible"]), n(&t["drawn"]));
        let c = &report["clusters"];
        let parts = ["off_screen", "facing_away", "visible"];
        assert_eq!(
            parts.iter().map(|part| n(&c[part])).sum::<u64>(),
            n(&c["total"])
        );
        let v = &report["verdicts"];
        let parts = ["absent", "lobe", "centre"];
        assert_eq!(
            parts.iter().map(|part| n(&v[part])).sum::<u64>(),
            n(&t["visible"])
        );
        let materials = report["materials"].as_array().expect("a list");
        let visible: u64 = materials.iter().map(|m| n(&m["visible_triangles"])).sum();
        assert_eq!(visible, n(&t["visible"]));
        assert_eq!(n(&report["lights"]["total"]), 2);
        let (per_pixel, covered) = (
            n(&report["refinement"]["per_pixel_pixels"]),
            n(&report["covered_pixels"]),
        );
        if report["method"] == "phong" {
            assert_eq!(per_pixel, covered);
            assert!(report["estimated_error"] == 0.0 && n(&report["pht"]["total"]) == 0);
        } else {
            assert!(0 < per_pixel && per_pixel <= covered, "{report}");
            assert!(n(&report["pht"]["refined"]) <= n(&report["pht"]["visible"]));
            assert!(n(&report["pht"]["pixels"]) < covered && n(&report["pht"]["pixels"]) > 0);
        }
    }
    let output = run("--overlay over.png");
    let lines = text(&output.stdout);
    for part in ["clusters ", "PHTs", "levels ", "light"] {
        assert!(lines.contains(part), "{lines}");
    }
    assert!(text(&output.stderr).contains("wrote over.png (160x120)"));
    let bytes = fs::read(directory.path().join("over.png")).expect("it was written");
    assert_eq!(&bytes[16..24], [0, 0, 0, 160, 0, 0, 0, 120]);
}

// ---- The overlay ----

/// A scene's image under a budget, and the same with layers drawn over it.
struct Drawn {
    scene: Scene,
    engine: Engine,
    frame: Frame,
}

impl Drawn {
    fn new(scene: &str, method: Method, budget: Budget) -> Self {
        let scene = Scene::parse(scene, "overlay.ron").expect("the scene is valid");
        let options = EngineOptions {
            method,
            threads: Some(1),
            ..EngineOptions::default()
        };
        let mut engine = Engine::with_options(&scene, options).expect("the options are valid");
        let mut frame = Frame::new(SIZE.0, SIZE.1);
        engine.render(&scene, budget, &mut frame);
        Self {
            scene,
            engine,
            frame,
        }
    }

    fn with(&self, layers: &[Layer]) -> Frame {
        let mut frame = self.frame.clone();
        draw_overlay(&mut frame, &self.engine, &self.scene, layers);
        frame
    }

    /// Indices of pixels that the layers change, beside dimming the image.
    fn changed_by(&self, layers: &[Layer]) -> Vec<usize> {
        let (plain, drawn) = (self.with(&[]), self.with(layers));
        let pixels = plain.pixels().iter().zip(drawn.pixels()).enumerate();
        pixels
            .filter(|(_, (a, b))| a != b)
            .map(|(index, _)| index)
            .collect()
    }
}

/// One triangle's worth of plane seen from above, and the camera that does so.
const PLATE: &str = "(camera: Orthographic(position: (0, 0, 9), target: (0, 0, 0), up: (0, 1, 0), height: 3), \
    objects: [(shape: Plane(width: 2, depth: 2, columns: 1, rows: 1)) OTHERS])";

#[test]
fn without_layers_the_image_is_only_dimmed() {
    let drawn = Drawn::new(SCENE, Method::Adaptive, Budget::Unlimited);
    for (before, after) in drawn.frame.pixels().iter().zip(drawn.with(&[]).pixels()) {
        for k in 0..3 {
            let dimmed = f32::from(before[k]) * 0.72;
            assert!(
                (f32::from(after[k]) - dimmed).abs() <= 0.51,
                "{before:?} {after:?}"
            );
        }
        assert_eq!(after[3], 255);
    }
}

#[test]
fn lines_are_where_edges_are_and_nowhere_else() {
    // 50 pixels per unit: the plate is 100 pixels wide, its diagonal goes one way or the other.
    let plate = PLATE.replace("OTHERS", "");
    let drawn = Drawn::new(&plate, Method::Gouraud, Budget::Unlimited);
    let changed = drawn.changed_by(&[Layer::Wireframe]);
    let (left, top, right, bottom) = (50.0, 25.0, 150.0, 125.0);
    let distance = |index: usize| {
        let (x, y) = ((index % 200) as f64 + 0.5, (index / 200) as f64 + 0.5);
        let outside = (left - x)
            .max(x - right)
            .max(top - y)
            .max(y - bottom)
            .max(0.0);
        let border = (x - left)
            .abs()
            .min((right - x).abs())
            .min((y - top).abs())
            .min((bottom - y).abs());
        let diagonals = [(x - left) - (y - top), (x - left) - (bottom - y)];
        let diagonal = diagonals.map(|d| d.abs() / f64::sqrt(2.0));
        outside.max(border.min(diagonal[0]).min(diagonal[1]))
    };
    for &index in &changed {
        assert!(
            distance(index) < 1.5,
            "pixel {index} is {} off",
            distance(index)
        );
    }
    let is_changed = |x: usize, y: usize| {
        let near = [(0, 0), (1, 0), (0, 1)].map(|(dx, dy)| (y - dy) * 200 + x - dx);
        near.iter().any(|index| changed.contains(index))
    };
    for at in 0..100 {
        assert!(
            is_changed(50 + at, 25) && is_changed(50 + at, 125),
            "horizontal, {at}"
        );
        assert!(
            is_changed(50, 25 + at) && is_changed(150, 25 + at),
            "vertical, {at}"
        );
        let (down, up) = (is_changed(51 + at, 26 + at), is_changed(50 + at, 124 - at));
        assert!(down || up, "diagonal, {at}");
    }
}

#[test]
fn what_is_hidden_is_not_drawn() {
    let wires = |others: &str| {
        let scene = PLATE.replace("OTHERS", others);
        let drawn = Drawn::new(&scene, Method::Adaptive, Budget::Unlimited);
        drawn.changed_by(&[Layer::Wireframe])
    };
    let below = ", (shape: Sphere(slices: 9, stacks: 7), position: (0.1, 0.1, -2), scale: 0.5)";
    let (alone, hidden) = (wires(""), wires(below));
    assert!(alone == hidden, "the sphere below shows through");
    let visible = wires(&below.replace("-2", "2"));
    assert!(
        visible.len() > alone.len() + 200,
        "the sphere above is there"
    );

    // Larger than the plate, and turned: its edges end where the plate begins.
    let larger = ", (shape: Plane(width: 2.6, depth: 2.6, columns: 1, rows: 1), \
        position: (0, 0, -2), rotate_degrees: (0, 0, 15))";
    let partly_hidden = wires(larger);
    let inside = |wires: &[usize]| -> Vec<usize> {
        let is_inside = |index: &usize| {
            let (x, y) = (index % 200, index / 200);
            (53..147).contains(&x) && (28..122).contains(&y)
        };
        wires.iter().copied().filter(is_inside).collect()
    };
    assert!(
        inside(&alone) == inside(&partly_hidden),
        "its diagonal shows through"
    );
    assert!(
        partly_hidden.len() > alone.len() + 200,
        "its border is there"
    );
}

#[test]
fn lines_of_a_dense_mesh_fade_out() {
    let dense = "(objects: [(shape: Sphere(slices: 400, stacks: 200))])";
    let drawn = Drawn::new(dense, Method::Gouraud, Budget::Unlimited);
    assert!(
        drawn
            .changed_by(&[Layer::Wireframe, Layer::Leaves])
            .is_empty()
    );
    let coarse = "(objects: [(shape: Sphere(slices: 12, stacks: 6))])";
    let drawn = Drawn::new(coarse, Method::Gouraud, Budget::Unlimited);
    assert!(drawn.changed_by(&[Layer::Wireframe]).len() > 300);
}

#[test]
fn per_pixel_shading_is_tinted_exactly_where_it_was_done() {
    for units in [150_000, 400_000, 1_500_000] {
        let drawn = Drawn::new(SCENE, Method::Adaptive, Budget::Work(units));
        let mut shaded = 0;
        drawn.engine.for_each_leaf(|leaf| {
            if leaf.kind == LeafKind::PerPixel && leaf.is_painted && leaf.level == 0 {
                shaded += leaf.pixels as usize;
            }
        });
        let tinted = drawn.changed_by(&[Layer::PerPixel]);
        assert!(
            tinted.len() >= shaded && shaded > 100,
            "{shaded} {}",
            tinted.len()
        );
        let world = World::new(&drawn.scene);
        let view = world.view(drawn.scene.camera(), SIZE.0, SIZE.1);
        let reference = ReferenceImage::render(&world, &view, 1);
        for index in tinted {
            assert!(reference.is_covered(index), "background is tinted");
            let [r, g, b, _] = drawn.frame.pixels()[index];
            let off = (0..3)
                .map(|k| [r, g, b][k].abs_diff(reference.pixels[index][k]))
                .max();
            // A pixel on a leaf's border may be the neighbour's, which is nearly right there too.
            assert!(
                off <= Some(8),
                "pixel {index} is not shaded by Phong: off by {off:?}"
            );
        }
    }
}

#[test]
fn highlights_are_marked_before_and_after_they_are_refined() {
    let before = Drawn::new(SCENE, Method::Adaptive, Budget::Work(0));
    let after = Drawn::new(SCENE, Method::Adaptive, Budget::Unlimited);
    let tinted = before.changed_by(&[Layer::Pht]);
    assert!(tinted.len() > 100, "{} pixels", tinted.len());
    let amber = |drawn: &Drawn| {
        let (plain, marked) = (drawn.with(&[]), drawn.with(&[Layer::Pht]));
        // Amber adds red, green takes it away.
        let change = |&index: &usize| {
            let (a, b) = (plain.pixels()[index], marked.pixels()[index]);
            i32::from(b[0]) - i32::from(a[0]) > i32::from(b[1]) - i32::from(a[1])
        };
        drawn
            .changed_by(&[Layer::Pht])
            .iter()
            .filter(|i| change(i))
            .count()
    };
    assert!(
        amber(&before) * 10 > tinted.len() * 9,
        "open PHTs are amber"
    );
    assert!(amber(&after) * 10 < tinted.len(), "refined ones are green");
    let flat = Drawn::new(SCENE, Method::Gouraud, Budget::Unlimited);
    assert!(
        flat.changed_by(&[Layer::Pht]).is_empty(),
        "nobody has tested"
    );
}

#[test]
fn lights_are_marked_where_they_are() {
    let scene = PLATE.replace(
        "objects",
        "lights: [Point(position: (0.5, 0.5, 3)), Point(position: (-0.5, 0.5, -3)), \
            Point(position: (50, 0, 3)), Directional(direction: (0, 0, -1))], objects",
    );
    let drawn = Drawn::new(
        &scene.replace("OTHERS", ""),
        Method::Gouraud,
        Budget::Unlimited,
    );
    let changed = drawn.changed_by(&[Layer::Lights]);
    let is_marked = |x: usize, y: usize| changed.contains(&(y * 200 + x));
    // (0.5, 0.5) is 25 pixels right of and above the middle.
    assert!(is_marked(125, 50), "a disc");
    assert!(
        !is_marked(75, 50) && is_marked(82, 50),
        "a ring: the plate hides it"
    );
    let near = |index: &usize| {
        let (x, y) = ((index % 200) as f64 - 99.5, (index / 200) as f64 - 49.5);
        (x.abs() - 25.0).hypot(y) < 11.0
    };
    assert!(
        changed.iter().all(near),
        "the others are nowhere in the image"
    );
}

#[test]
fn surfaces_that_reach_behind_the_eye_and_tiny_images_are_no_trouble() {
    let floor = "(camera: Perspective(position: (0, 0, 1), target: (0, 5, 0.9)), \
        objects: [(shape: Plane(width: 40, depth: 40, columns: 2, rows: 2))])";
    let drawn = Drawn::new(floor, Method::Adaptive, Budget::Unlimited);
    let wires = drawn.changed_by(&[Layer::Wireframe]);
    assert!(!wires.is_empty());
    let horizon = wires.iter().map(|index| index / 200).min();
    assert!(horizon > Some(60), "nothing above the horizon: {horizon:?}");
    drawn.with(&Layer::ALL);
    let scene = Scene::parse(SCENE, "tiny.ron").expect("the scene is valid");
    for (width, height) in [(1, 1), (1, 300), (300, 1), (0, 0)] {
        let mut engine = Engine::new(&scene).expect("threads start");
        let mut frame = Frame::new(width, height);
        engine.render(&scene, Budget::Unlimited, &mut frame);
        draw_overlay(&mut frame, &engine, &scene, &Layer::ALL);
    }
    // Before anything has been rendered.
    let engine = Engine::new(&scene).expect("threads start");
    draw_overlay(&mut Frame::new(20, 20), &engine, &scene, &Layer::ALL);
}
