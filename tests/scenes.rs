//! The scenes that come along are valid, say what they claim to, and show what they contain.

use specula::geometry::screen::outcode;
use specula::scene::{Scene, View, World};
use std::fs;
use std::path::{Path, PathBuf};

const WIDTH: u32 = 1280;
const HEIGHT: u32 = 720;

/// Name, triangles, lights, and whether all of the scene must be inside the image.
const SCENES: &[(&str, usize, usize, bool)] = &[
    ("closeup", 896, 3, false),
    ("heavy", 57_344, 4, true),
    (
        "lights100",
        28 * 72 + 48 * 24 * 2 + 24 * 22 + 32 * 24 + 288,
        100,
        false,
    ),
    (
        "lights16",
        28 * 72 + 48 * 24 * 2 + 24 * 22 + 32 * 24 + 288,
        16,
        false,
    ),
    ("minimal", 3584, 2, true),
    ("teapot", 896, 4, true),
    ("turntable", 896 + 32 * 12 * 2 + 128, 3, true),
    ("walls", 72 + 36 + 36, 6, false),
];

fn directory() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

fn load(name: &str) -> Scene {
    Scene::load(directory().join(name).with_extension("ron")).expect(name)
}

fn view(scene: &Scene, world: &World) -> View {
    world.view(scene.camera(), WIDTH, HEIGHT)
}

/// Where a vertex appears, in pixels, if it is between the near and far planes.
fn pixel(view: &View, p: [f32; 3]) -> Option<[f64; 2]> {
    let projected = view.project(p);
    (outcode(projected) == 0).then(|| [projected[0] / projected[3], projected[1] / projected[3]])
}

fn in_image(p: [f64; 2]) -> bool {
    (0.0..f64::from(WIDTH)).contains(&p[0]) && (0.0..f64::from(HEIGHT)).contains(&p[1])
}

#[test]
fn all_scenes_are_listed_here_and_in_their_readme() {
    let mut found: Vec<_> = fs::read_dir(directory())
        .expect("the folder of scenes")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "ron"))
        .map(|path| {
            path.file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    found.sort_unstable();
    assert_eq!(found, SCENES.iter().map(|s| s.0).collect::<Vec<_>>());
    let readme = fs::read_to_string(directory().join("README.md")).expect("a README");
    for name in found {
        assert!(
            readme.contains(&format!("`{name}.ron`")),
            "{name} is not in the README"
        );
    }
}

#[test]
fn the_readme_s_example_is_a_valid_scene() {
    let readme = fs::read_to_string(directory().join("README.md")).expect("a README");
    let mut examples = 0;
    for block in readme.split("```ron\n").skip(1) {
        let (text, _) = block.split_once("```").expect("a closed block");
        Scene::parse(text, "README.md").expect("a valid example");
        examples += 1;
    }
    assert!(examples >= 2);
}

#[test]
fn scenes_have_the_triangles_and_lights_they_claim_and_finite_vertices() {
    for &(name, triangles, lights, _) in SCENES {
        let scene = load(name);
        let world = World::new(&scene);
        assert_eq!(world.triangles.len(), triangles, "{name}");
        assert_eq!(scene.triangle_count(), triangles, "{name}");
        assert_eq!(world.lights.len(), lights, "{name}");
        for vectors in [&world.positions, &world.normals] {
            for i in 0..vectors.len() {
                assert!(
                    vectors.get(i).iter().all(|c| c.is_finite()),
                    "{name} vertex {i}"
                );
            }
        }
    }
}

#[test]
fn scenes_are_in_view() {
    for &(name, _, _, entirely) in SCENES {
        let scene = load(name);
        let world = World::new(&scene);
        let view = view(&scene, &world);
        let visible = (0..world.positions.len())
            .filter_map(|i| pixel(&view, world.positions.get(i)))
            .filter(|&p| in_image(p))
            .count();
        if entirely {
            assert_eq!(
                visible,
                world.positions.len(),
                "{name} sticks out of the image"
            );
        } else {
            assert!(visible > 0, "{name} is out of sight");
        }
    }
}

#[test]
fn whole_objects_fill_much_of_the_image() {
    for &(name, _, _, entirely) in SCENES {
        if !entirely {
            continue;
        }
        let scene = load(name);
        let world = World::new(&scene);
        let view = view(&scene, &world);
        let rows: Vec<f64> = (0..world.positions.len())
            .filter_map(|i| pixel(&view, world.positions.get(i)))
            .map(|p| p[1])
            .collect();
        let low = rows.iter().copied().fold(f64::INFINITY, f64::min);
        let high = rows.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!(high - low > 0.5 * f64::from(HEIGHT), "{name} is small");
    }
}

#[test]
fn the_closeup_covers_every_pixel() {
    let scene = load("closeup");
    let world = World::new(&scene);
    let view = view(&scene, &world);
    let corners: Vec<Option<[[f64; 2]; 3]>> = world
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| pixel(&view, world.positions.get(v as usize)));
            Some([a?, b?, c?])
        })
        .collect();
    // Sampled on a grid that includes the corners; only triangles entirely in front of the eye count. With y down, the
    // inside of a triangle that is seen from outside, counter-clockwise, has a negative side of each edge.
    let side = |a: [f64; 2], b: [f64; 2], p: [f64; 2]| {
        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
    };
    for row in 0..=18 {
        for column in 0..=32 {
            let p = [f64::from(column) * 40.0, f64::from(row) * 40.0];
            let covered = corners.iter().flatten().any(|&[a, b, c]| {
                side(a, b, p) <= 0.0 && side(b, c, p) <= 0.0 && side(c, a, p) <= 0.0
            });
            assert!(covered, "nothing at pixel {p:?}");
        }
    }
}
