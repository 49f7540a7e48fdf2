//! What a frame certifies is true: no pixel is further from per-pixel Phong shading than [`FrameStats::error_bound`] says, no more pixels
//! than it says by more than a code, on every scene that comes along and thousands of random ones, after any frames.

#[path = "support/random.rs"]
mod random;

use random::Random;
use rayon::prelude::*;
use specula::glam::{DMat4, DVec3};
use specula::measure::{ErrorReport, ReferenceImage};
use specula::scene::World;
use specula::{Budget, Engine, EngineOptions, Frame, FrameStats, Method, Scene};
use std::fmt::Write;
use std::path::{Path, PathBuf};

fn engine(scene: &Scene, method: Method) -> Engine {
    let options = EngineOptions {
        method,
        threads: Some(1),
        ..EngineOptions::default()
    };
    Engine::with_options(scene, options).expect("the options are valid")
}

/// What is promised of an image, against the image of per-pixel Phong shading.
fn check(stats: &FrameStats, frame: &Frame, phong: &Frame) -> Result<u8, String> {
    let (bound, share) = match (stats.error_bound, stats.unproved_share) {
        (Some(bound), Some(share)) => (bound, share),
        other => return Err(format!("{other:?} at full resolution")),
    };
    let bytes = frame.as_bytes().chunks(4).zip(phong.as_bytes().chunks(4));
    let off = bytes.map(|(a, b)| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0));
    let (mut most, mut beyond) = (0, 0_u64);
    for off in off {
        most = most.max(off);
        beyond += u64::from(off > 1);
    }
    if f64::from(most) > bound * 255.0 + 1e-9 {
        return Err(format!("{most} codes off, {} promised", bound * 255.0));
    }
    if beyond as f64 > share * stats.covered_pixels as f64 + 1e-6 {
        let promised = share * stats.covered_pixels as f64;
        return Err(format!("{beyond} pixels are off, {promised} promised"));
    }
    if stats.converged && !(bound <= 1.0 / 255.0 && share == 0.0) {
        return Err(format!("it ends at {} codes, {share}", bound * 255.0));
    }
    Ok(most)
}

/// Certificates along the refinement of a still view: true, and never growing.
#[derive(Debug)]
struct Chain {
    last: Option<(f64, f64)>,
    /// Whether some frame knew the bound of most of its pixels, or of all, before the last one.
    knows_most: bool,
    knows_all: bool,
}

impl Chain {
    fn follow(&mut self, stats: &FrameStats, frame: &Frame, phong: &Frame) -> Result<(), String> {
        check(stats, frame, phong)?;
        let now = stats.error_bound.zip(stats.unproved_share);
        if let (Some(now), Some(last)) = (now, self.last)
            && (now.0 > last.0 || now.1 > last.1)
        {
            return Err(format!("it grows from {last:?} to {now:?}"));
        }
        if let Some((bound, share)) = now.filter(|_| !stats.converged) {
            self.knows_most |= share < 0.5;
            self.knows_all |= bound < 1.0;
        }
        self.last = now;
        Ok(())
    }
}

fn scenes() -> Vec<PathBuf> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let entries = directory.read_dir().expect("the folder of scenes");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let mut paths: Vec<_> = paths
        .filter(|path| path.extension().is_some_and(|ending| ending == "ron"))
        .collect();
    paths.sort();
    assert!(paths.len() >= 8);
    paths
}

#[test]
fn certificates_hold_while_the_scenes_that_come_along_are_refined() {
    const SIZE: (u32, u32) = (320, 180);
    let checked: Vec<(PathBuf, Chain)> = scenes()
        .into_par_iter()
        .map(|path| {
            let scene = Scene::load(&path).expect("a scene that comes along is valid");
            let mut phong = Frame::new(SIZE.0, SIZE.1);
            let stats = engine(&scene, Method::Phong).render(&scene, Budget::Unlimited, &mut phong);
            assert_eq!(stats.error_bound, Some(1.0 / 255.0));
            let world = World::new(&scene);
            let view = world.view(scene.camera(), SIZE.0, SIZE.1);
            let reference = ReferenceImage::render(&world, &view, 1);
            let mut chain = Chain {
                last: None,
                knows_most: false,
                knows_all: false,
            };
            let mut engine = engine(&scene, Method::Adaptive);
            let mut frame = Frame::new(SIZE.0, SIZE.1);
            for number in 0.. {
                let stats = engine.render(&scene, Budget::Work(20_000 << (number / 4)), &mut frame);
                let report = ErrorReport::compare(&frame, &reference).expect("the same size");
                let bound = stats.error_bound.expect("at full resolution");
                assert!(
                    f64::from(report.max) <= bound * 255.0 + 1e-9,
                    "{stats:?} {report:?}"
                );
                let followed = chain.follow(&stats, &frame, &phong);
                followed.unwrap_or_else(|what| panic!("{}: {what}\n{stats:?}", path.display()));
                if stats.converged {
                    break;
                }
            }
            (path, chain)
        })
        .collect();
    let count = |of: fn(&Chain) -> bool| checked.iter().filter(|(_, chain)| of(chain)).count();
    assert!(
        count(|chain| chain.knows_most) == checked.len(),
        "{checked:?}"
    );
    assert!(count(|chain| chain.knows_all) >= 3, "{checked:?}");
}

/// Evenly from `lo` to `hi`.
fn between(random: &mut Random, lo: f64, hi: f64) -> f64 {
    lo + (hi - lo) * (random.bits() >> 11) as f64 / (1_u64 << 53) as f64
}

/// A scene of some shapes under some lights, as chance has it.
fn random_scene(random: &mut Random) -> String {
    let mut text = String::from("(\n");
    let w = &mut text;
    let camera = if random.below(3) == 0 {
        "Orthographic(position: (2.0, -8.0, 3.0), target: (0.0, 0.0, 0.5), height: 4.0)"
    } else {
        "Perspective(position: (2.0, -8.0, 3.0), target: (0.0, 0.0, 0.5), fov_degrees: 32.0)"
    };
    let _ = writeln!(
        w,
        "camera: {camera}, ambient: (0.03, 0.03, 0.03), lights: ["
    );
    let many = if random.below(4) == 0 { 24 } else { 4 };
    for _ in 0..1 + random.below(many) {
        let [x, y, z] = [0, 1, 2].map(|_| between(random, -1.0, 1.0));
        let bright = between(random, 0.1, 1.5);
        let _ = if random.below(3) == 0 {
            writeln!(
                w,
                "Directional(direction: ({x}, {}, {z}), intensity: {bright}),",
                y + 0.01
            )
        } else {
            let far = between(random, 1.5, 9.0);
            let [x, y, z] = [x, y - 0.5, z + 0.5].map(|c| c * far);
            writeln!(w, "Point(position: ({x}, {y}, {z}), intensity: {bright}),")
        };
    }
    let _ = writeln!(w, "], materials: {{");
    for name in ["a", "b"] {
        let [r, g, b] = [0, 1, 2].map(|_| between(random, 0.0, 0.9));
        let specular = if random.below(5) == 0 {
            0.0
        } else {
            between(random, 0.1, 0.9)
        };
        let shininess = 10_f64.powf(between(random, 0.0, 3.0));
        let model = ["Phong", "BlinnPhong"][random.below(2) as usize];
        let two_sided = random.below(3) == 0;
        let _ = writeln!(
            w,
            "\"{name}\": (diffuse: ({r}, {g}, {b}), specular: ({specular}, {specular}, {specular}), \
             shininess: {shininess}, model: {model}, two_sided: {two_sided}),"
        );
    }
    let _ = writeln!(w, "}}, objects: [");
    for _ in 0..1 + random.below(3) {
        let shape = match random.below(5) {
            0 => format!("Teapot(tessellation: {})", 1 + random.below(3)),
            1 => {
                let slices = 5 + random.below(60);
                format!("Sphere(slices: {slices}, stacks: {})", slices.div_ceil(2))
            }
            2 => format!(
                "Plane(width: 4.0, depth: 4.0, columns: {0}, rows: {0})",
                1 + random.below(12)
            ),
            3 => "Box(size: (1.5, 1.0, 0.7))".to_owned(),
            _ => format!("Sphere(slices: {}, stacks: 4)", 3 + random.below(6)),
        };
        let [x, y, z] = [1.5, 2.0, 1.0].map(|far| between(random, -far, far));
        let material = ["a", "b"][random.below(2) as usize];
        let _ = writeln!(
            w,
            "(shape: {shape}, material: \"{material}\", position: ({x}, {y}, {z})),"
        );
    }
    text.push_str("])");
    text
}

/// Frames of any budgets, now and then of something that has moved.
fn check_random(seed: u64) -> Result<u64, String> {
    const SIZE: (u32, u32) = (60, 45);
    let mut random = Random(seed.wrapping_mul(0xd134_2543_de82_ef95));
    let text = random_scene(&mut random);
    let mut scene =
        Scene::parse(&text, "random.ron").map_err(|error| format!("{error}\n{text}"))?;
    let mut shading = engine(&scene, Method::Phong);
    let mut refining = engine(&scene, Method::Adaptive);
    let mut phong = Frame::new(SIZE.0, SIZE.1);
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    let mut frames = 0;
    for turn in 0..2 {
        if turn > 0 {
            let object = random.below(scene.objects().len() as u64) as usize;
            let by = DVec3::new(
                between(&mut random, -0.3, 0.3),
                between(&mut random, -0.3, 0.3),
                0.1,
            );
            let moved = DMat4::from_translation(by) * scene.objects()[object].author_from_mesh;
            scene.set_transform(object, moved);
        }
        shading.render(&scene, Budget::Unlimited, &mut phong);
        let mut chain = Chain {
            last: None,
            knows_most: false,
            knows_all: false,
        };
        let patience = 1 + random.below(12);
        for _ in 0..patience {
            let units = 10_f64.powf(between(&mut random, 3.0, 5.0)) as u64;
            let stats = refining.render(&scene, Budget::Work(units), &mut frame);
            chain
                .follow(&stats, &frame, &phong)
                .map_err(|what| format!("seed {seed}, turn {turn}: {what}\n{stats:?}\n{text}"))?;
            frames += 1;
            if stats.converged {
                break;
            }
        }
    }
    let stats = refining.render(&scene, Budget::Unlimited, &mut frame);
    let most =
        check(&stats, &frame, &phong).map_err(|what| format!("seed {seed}: {what}\n{text}"))?;
    if !stats.converged || most > 1 {
        return Err(format!("seed {seed}: {most} codes at the end"));
    }
    Ok(frames)
}

#[test]
fn certificates_hold_on_thousands_of_random_scenes() {
    let scenes = if cfg!(debug_assertions) { 100 } else { 2000 };
    let frames = (0..scenes).into_par_iter().map(check_random);
    let frames = frames.try_reduce(|| 0, |a, b| Ok(a + b));
    let frames = frames.unwrap_or_else(|what| panic!("{what}"));
    assert!(frames > 3 * scenes, "{frames} frames");
}

#[test]
fn nothing_is_certified_of_an_image_that_is_not_the_one_asked_for() {
    let scene = Scene::load(&scenes()[0]).expect("a scene that comes along is valid");
    let mut frame = Frame::new(160, 90);
    let half = engine(&scene, Method::PhongHalf).render(&scene, Budget::Unlimited, &mut frame);
    assert_eq!((half.error_bound, half.unproved_share), (None, None));
    for (method, bound) in [
        (Method::Gouraud, 1.0),
        (Method::Flat, 1.0),
        (Method::Regular, 1.0),
        (Method::PhongArea, 1.0 / 255.0),
        (Method::PhongTiles, 1.0 / 255.0),
    ] {
        let stats = engine(&scene, method).render(&scene, Budget::Unlimited, &mut frame);
        let share = if bound < 1.0 { 0.0 } else { 1.0 };
        let certified = (stats.error_bound, stats.unproved_share);
        assert_eq!(certified, (Some(bound), Some(share)), "{method}");
    }
}
