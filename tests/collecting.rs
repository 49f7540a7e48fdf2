//! Candidates are collected piece by piece: what the budget cuts short goes on in the next frame, and comes to the same.

use specula::clock::{Clock, ManualClock};
use specula::frame::Outcome;
use specula::schedule::CostModel;
use specula::{Budget, Engine, EngineOptions, Frame, FrameStats, Scene};
use std::sync::Arc;

const SIZE: (u32, u32) = (320, 180);

/// Some thousand visible triangles.
fn scene() -> Scene {
    Scene::parse(
        r#"(
            objects: [(shape: Teapot(tessellation: 20)), (shape: Sphere(slices: 120, stacks: 60), position: (1.5, 1, 1))],
        )"#,
        "collecting",
    )
    .expect("a valid scene")
}

fn engine(scene: &Scene, threads: usize, clock: &ManualClock) -> Engine {
    let options = EngineOptions {
        threads: Some(threads),
        clock: Arc::new(clock.clone()),
        costs: Some(CostModel::default()),
        ..EngineOptions::default()
    };
    Engine::with_options(scene, options).expect("an engine")
}

/// What a frame says about its image, apart from times.
fn described(stats: &FrameStats) -> (u64, u64, u64, u64, u64) {
    let s = stats;
    (
        s.pht,
        s.refined,
        s.leaves,
        s.phong_pixels,
        s.estimated_error.to_bits(),
    )
}

#[test]
fn an_image_under_a_budget_of_work_does_not_depend_on_threads() {
    let scene = scene();
    let mut images = Vec::new();
    for threads in [1, 2, 3] {
        let mut engine = engine(&scene, threads, &ManualClock::default());
        let mut frame = Frame::new(SIZE.0, SIZE.1);
        let described = [0, 400_000, 400_000].map(|work| {
            let stats = engine.render(&scene, Budget::Work(work), &mut frame);
            // All of it is always collected.
            assert!(stats.pht > 0 && stats.pht == stats.pht_visible);
            assert!(stats.estimated_error > 0.0);
            described(&stats)
        });
        images.push((described, frame.pixels().to_vec()));
    }
    assert!(images.iter().all(|image| *image == images[0]));
}

#[test]
fn an_image_under_a_budget_of_work_depends_on_nothing_that_was_found_before() {
    let mut scene = scene();
    let clock = ManualClock::default();
    let mut engine = engine(&scene, 1, &clock);
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    // The clock stands still, so that everything is looked at.
    engine.render(&scene, Budget::from_millis(1.0), &mut frame);
    let camera = *scene.camera();
    scene.set_camera(specula::scene::Camera {
        position: camera.position * 1.02,
        ..camera
    });
    let budget = Budget::Work(300_000);
    let stats = engine.render(&scene, budget, &mut frame);
    let mut fresh = Frame::new(SIZE.0, SIZE.1);
    let want = self::engine(&scene, 1, &clock).render(&scene, budget, &mut fresh);
    assert_eq!(described(&stats), described(&want));
    assert!(frame.pixels() == fresh.pixels());
}

#[test]
fn what_the_clock_cuts_short_goes_on_in_the_next_frame_and_comes_to_the_same() {
    let scene = scene();
    let budget = Budget::Work(500_000);
    let mut whole = Frame::new(SIZE.0, SIZE.1);
    let want = engine(&scene, 1, &ManualClock::default()).render(&scene, budget, &mut whole);

    // Each reading of the clock takes a tenth of a millisecond: a frame of ten has time for a piece or two.
    let short = Budget::from_millis(1.0);
    let clock = ManualClock::with_step_ns(100_000);
    let mut engine = engine(&scene, 1, &clock);
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    let first = engine.render(&scene, Budget::from_millis(0.0), &mut frame);
    assert_eq!((first.outcome, first.pht), (Outcome::BaseOnly, 0));
    assert!(!first.converged && first.estimated_error.is_nan());
    let mut leaves = 0;
    engine.for_each_leaf(|_| leaves += 1);
    assert_eq!(leaves, first.triangles_visible);

    let mut known = Vec::new();
    while known.last().is_none_or(|&pht| pht < want.pht) {
        let stats = engine.render(&scene, short, &mut frame);
        assert!(!stats.converged);
        assert!(known.last().is_none_or(|&pht| pht <= stats.pht));
        assert!(known.len() < 100, "it does not go on");
        known.push(stats.pht);
    }
    assert!(
        known[0] < want.pht,
        "the first frame had time for everything"
    );

    // Again, with what follows under a budget of work.
    engine.forget();
    engine.render(&scene, Budget::from_millis(0.0), &mut frame);
    let cut = engine.render(&scene, short, &mut frame);
    assert!(cut.pht < want.pht && cut.work_units == 0, "{cut:?}");
    let got = engine.render(&scene, budget, &mut frame);
    assert_eq!(described(&got), described(&want));
    assert!(frame.pixels() == whole.pixels());
}

#[test]
fn collecting_never_runs_past_the_deadline() {
    let scene = scene();
    let mut cut = 0;
    for step_ns in [3_000_u64, 20_000, 70_000] {
        let step_ms = step_ns as f64 * 1e-6;
        for tenths in 1..40 {
            let clock = ManualClock::with_step_ns(step_ns);
            let mut engine = engine(&scene, 1, &clock);
            let mut frame = Frame::new(64, 36);
            let budget_ms = f64::from(tenths) * 0.1;
            engine.render(&scene, Budget::from_millis(0.0), &mut frame);
            let before = clock.now_ms();
            let stats = engine.render(&scene, Budget::from_millis(budget_ms), &mut frame);
            let took = clock.now_ms() - before;
            cut += u32::from(stats.pht == 0 || stats.work_units == 0);
            // After the reading that finds the time gone come only those that end the frame.
            assert!(
                took <= budget_ms + 12.0 * step_ms,
                "{took} of {budget_ms} by {step_ms}"
            );
        }
    }
    assert!(cut > 5, "no deadline came while collecting");
}
