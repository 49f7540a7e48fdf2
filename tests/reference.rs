//! The rasterizer and the Phong method against the slow reference, on the shipped scenes: ownership of pixels must be
//! the same, colours within one code.

use specula::backend::software::SoftwareBackend;
use specula::backend::{Backend, Geometry};
use specula::frame::{Engine, EngineOptions, Method};
use specula::measure::reference::NO_TRIANGLE;
use specula::measure::{ErrorReport, ReferenceImage};
use specula::output::Frame;
use specula::parallel::Exec;
use specula::scene::{Scene, World};
use specula::schedule::Budget;
use specula::simd::SimdLevel;
use std::path::Path;

const SIZE: [u32; 2] = [150, 85];

/// The shipped scenes, each as it is and with the eye moved close to its target, where triangles are clipped.
fn scenes() -> Vec<(String, Scene)> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut scenes = Vec::new();
    for entry in std::fs::read_dir(directory).expect("the scenes are there") {
        let path = entry.expect("readable").path();
        if path.extension().is_none_or(|extension| extension != "ron") {
            continue;
        }
        let scene = Scene::load(&path).expect("a shipped scene is valid");
        let mut close = scene.clone();
        let mut camera = *scene.camera();
        camera.position = camera.target + (camera.position - camera.target) * 0.2;
        close.set_camera(camera);
        let name = path.display().to_string();
        scenes.push((format!("{name}, close"), close));
        scenes.push((name, scene));
    }
    assert!(scenes.len() > 2, "no scenes");
    scenes
}

#[test]
fn the_rasterizer_gives_each_triangle_the_pixels_that_the_rules_give_it() {
    for (name, scene) in scenes() {
        let world = World::new(&scene);
        let view = world.view(scene.camera(), SIZE[0], SIZE[1]);
        let reference = ReferenceImage::render(&world, &view, 2);
        let mut expected = vec![0; world.triangles.len()];
        for &id in reference.ids.iter().filter(|&&id| id != NO_TRIANGLE) {
            expected[id as usize] += 1;
        }

        let mut backend = SoftwareBackend::new();
        let level = SimdLevel::detect().token().expect("detected");
        let counts = backend.rasterize(
            Exec { level, threads: 1 },
            Geometry {
                world: &world,
                view: &view,
                visible: std::slice::from_ref(&(0..world.triangles.len() as u32)),
            },
        );
        assert_eq!(counts.covered_pixels, reference.covered_pixels(), "{name}");
        assert!(counts.covered_pixels > 0, "{name} shows nothing");
        for (id, &pixels) in (0u32..).zip(&expected) {
            assert_eq!(backend.visible_pixels(id), pixels, "{name}: triangle {id}");
        }
    }
}

#[test]
fn phong_shading_is_within_a_code_of_the_reference() {
    for (name, scene) in scenes() {
        let options = EngineOptions {
            method: Method::Phong,
            threads: Some(1),
            ..EngineOptions::default()
        };
        let mut engine = Engine::with_options(&scene, options).expect("one thread");
        let mut frame = Frame::new(SIZE[0], SIZE[1]);
        engine.render(&scene, Budget::Unlimited, &mut frame);
        let view = engine.world().view(scene.camera(), SIZE[0], SIZE[1]);
        let reference = ReferenceImage::render(engine.world(), &view, 2);
        let error = ErrorReport::compare(&frame, &reference).expect("same size");
        assert!(error.max <= 1, "{name}: {error:?}");
        // Background is no part of the comparison, and must be right as well.
        for (index, &[r, g, b, _]) in frame.pixels().iter().enumerate() {
            if !reference.is_covered(index) {
                assert_eq!([r, g, b], reference.pixels[index], "{name}: pixel {index}");
            }
        }
    }
}
