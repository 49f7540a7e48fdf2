//! An engine whose scene moves: it comes to the images of one that starts with the scene as it is, and keeps what nothing touches.

use glam::{DMat4, DVec3};
use specula::clock::ManualClock;
use specula::scene::Light;
use specula::{Budget, Engine, EngineOptions, Frame, Method, Scene};
use std::sync::Arc;

const SIZE: (u32, u32) = (640, 360);

/// Ten spheres in two rows in front of a wall that nothing reaches beyond: so whatever moves, planes fitted to the scene stay.
fn scene() -> Scene {
    let place = |i: i32| format!("({}, -2, {})", (i % 5 - 2) * 3, (i / 5) * 4 - 2);
    let spheres: String = (0..10)
        .map(|i| {
            format!(
                "(shape: Sphere(radius: 0.8, slices: 48, stacks: 24), material: \"m\", position: {}),",
                place(i)
            )
        })
        .collect();
    let text = format!(
        r#"(
            camera: Perspective(position: (0, -16, 0), target: (0, 0, 0), fov_degrees: 40),
            lights: [Point(position: (-5, -8, 8)), Point(position: (7, -9, 2), intensity: 0.4)],
            materials: {{ "m": (diffuse: (0.7, 0.3, 0.2), specular: 0.5, shininess: 40) }},
            objects: [
                {spheres}
                (shape: Box(size: (20, 0.1, 1)), material: "m", position: (0, 1, 0)),
            ],
        )"#
    );
    Scene::parse(&text, "moving_objects.ron").expect("a valid scene")
}

fn engine(scene: &Scene, method: Method, clock: ManualClock) -> Engine {
    let options = EngineOptions {
        method,
        threads: Some(1),
        clock: Arc::new(clock),
        ..EngineOptions::default()
    };
    Engine::with_options(scene, options).expect("an engine")
}

/// The image of an engine that has seen nothing before.
fn fresh(scene: &Scene, method: Method, budget: Budget) -> Frame {
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    engine(scene, method, ManualClock::default()).render(scene, budget, &mut frame);
    frame
}

/// Moves an object by about its size.
fn nudge(scene: &mut Scene, object: usize, step: u32) {
    let place = scene.objects()[object].author_from_mesh;
    let (sin, cos) = f64::from(step).sin_cos();
    let by = DVec3::new(0.3 * sin, 0.5 * cos, 0.2);
    scene.set_transform(object, DMat4::from_translation(by) * place);
}

#[test]
fn one_small_object_of_ten_costs_a_third_of_the_covered_tiles_at_most() {
    let tiles = u64::from(SIZE.0.div_ceil(64) * SIZE.1.div_ceil(64));
    for method in Method::ALL {
        // Where a first image is followed by refinement, in the same frame and in one of its own.
        for work in [0, 200_000] {
            let mut scene = scene();
            let mut engine = engine(&scene, method, ManualClock::default());
            let mut frame = Frame::new(SIZE.0, SIZE.1);
            let budget = Budget::Work(work);
            let first = engine.render(&scene, budget, &mut frame);
            assert_eq!(first.skipped.tiles_unmoved, 0, "{method}: the first frame");
            for step in 0..6 {
                let what = format!("{method}, {work} units, step {step}");
                nudge(&mut scene, step as usize * 2 % 10, step);
                if step == 3 {
                    let light = scene.lights()[0];
                    let radiance = [0.3; 3];
                    scene.set_light(0, Light { radiance, ..light });
                }
                let stats = engine.render(&scene, budget, &mut frame);
                let want = fresh(&scene, method, budget);
                assert!(frame.pixels() == want.pixels(), "{what}");
                if method != Method::PhongHalf {
                    let covered = tiles - stats.skipped.background_tiles;
                    let kept = stats.skipped.tiles_unmoved;
                    assert!(covered > 20, "{what}: {covered} covered tiles");
                    assert!(
                        kept * 3 >= covered * 2,
                        "{what}: {kept} of {covered} tiles kept"
                    );
                }
                if step % 2 == 0 {
                    engine.render(&scene, budget, &mut frame);
                }
            }
        }
    }
}

#[test]
fn frames_that_end_early_and_views_given_up_leave_no_trace() {
    for method in [Method::Gouraud, Method::Adaptive, Method::PhongTiles] {
        let mut scene = scene();
        let mut engine = engine(&scene, method, ManualClock::with_step_ns(50_000));
        let mut frame = Frame::new(SIZE.0, SIZE.1);
        let (camera, mut stopped) = (*scene.camera(), 0);
        for step in 0..40_u32 {
            let what = format!("{method}, step {step}");
            nudge(&mut scene, step as usize * 7 % 10, step);
            if step % 9 == 4 {
                let mut other = camera;
                other.position.x += f64::from(step % 2);
                scene.set_camera(other);
            }
            // So much time is over after so many questions.
            let ms = [0.1, 0.6, 2.0, 5.0][step as usize % 4];
            let stats = engine.render(&scene, Budget::from_millis(ms), &mut frame);
            stopped += u32::from(stats.outcome.name() == "stale");
            if step % 5 == 0 {
                let budget = Budget::Unlimited;
                // Once for what is in hand, and once for what is asked for.
                engine.render(&scene, budget, &mut frame);
                engine.render(&scene, budget, &mut frame);
                let want = fresh(&scene, method, budget);
                assert!(frame.pixels() == want.pixels(), "{what}");
            }
        }
        assert!(stopped > 5, "{method}: {stopped} frames ended early");
    }
}
