//! Promises of the frame loop, kept on whole images.

use specula::clock::{Clock, ManualClock};
use specula::frame::{Outcome, Overrun};
use specula::measure::{ErrorReport, ReferenceImage};
use specula::simd::SimdLevel;
use specula::{Budget, Engine, EngineOptions, Frame, FrameStats, Method, Scene};
use std::sync::Arc;

const SIZE: (u32, u32) = (256, 144);

/// A scene with curvature, flat faces, creases, occlusion, two materials, point and directional lights.
const MIXED: &str = r##"(
    camera: Perspective(position: (3.0, -9.0, 4.5), target: (0.0, 0.0, 1.0), fov_degrees: 38.0),
    ambient: (0.05, 0.05, 0.06),
    lights: [
        Point(position: (5.0, -6.0, 7.0), intensity: 0.8),
        Point(position: (-6.0, -3.0, 5.0), color: (1.0, 0.8, 0.6), intensity: 0.6),
        Directional(direction: (-0.3, 0.6, -1.0), intensity: 0.4),
    ],
    materials: {
        "red": (diffuse: (0.6, 0.2, 0.1), specular: (0.7, 0.7, 0.7), shininess: 60.0),
        "blinn": (diffuse: (0.2, 0.3, 0.5), specular: (0.5, 0.5, 0.5), shininess: 120.0, model: BlinnPhong),
        "matte": (diffuse: (0.4, 0.4, 0.35), specular: (0.0, 0.0, 0.0)),
    },
    objects: [
        (shape: Teapot(tessellation: 4), material: "red"),
        (shape: Sphere(slices: 12, stacks: 8), material: "blinn", position: (-2.0, -3.0, 0.8)),
        (shape: Plane(width: 14.0, depth: 14.0, columns: 3, rows: 3), material: "blinn", position: (0.0, 0.0, -0.3)),
        (shape: Box(size: (1.0, 1.0, 1.6)), material: "matte", position: (2.8, -2.5, 0.5)),
    ],
)"##;

fn mixed() -> Scene {
    Scene::parse(MIXED, "mixed.ron").expect("the scene is valid")
}

fn options(method: Method, threads: usize) -> EngineOptions {
    EngineOptions {
        method,
        threads: Some(threads),
        ..EngineOptions::default()
    }
}

fn engine(scene: &Scene, options: EngineOptions) -> Engine {
    Engine::with_options(scene, options).expect("the options are valid")
}

fn render(
    scene: &Scene,
    method: Method,
    threads: usize,
    budgets: &[Budget],
) -> (Frame, FrameStats) {
    let mut engine = engine(scene, options(method, threads));
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    let mut stats = None;
    for &budget in budgets {
        stats = Some(engine.render(scene, budget, &mut frame));
    }
    (frame, stats.expect("at least one budget"))
}

fn reference(scene: &Scene) -> ReferenceImage {
    let world = specula::scene::World::new(scene);
    let view = world.view(scene.camera(), SIZE.0, SIZE.1);
    ReferenceImage::render(&world, &view, 2)
}

fn largest_difference(a: &Frame, b: &Frame) -> u8 {
    let bytes = a.as_bytes().iter().zip(b.as_bytes());
    bytes.map(|(x, y)| x.abs_diff(*y)).max().unwrap_or(0)
}

#[test]
fn phong_equals_the_reference_to_within_one_code() {
    let scene = mixed();
    let (frame, stats) = render(&scene, Method::Phong, 1, &[Budget::Unlimited]);
    let report = ErrorReport::compare(&frame, &reference(&scene)).expect("same size");
    assert!(
        report.covered_pixels > 5000 && report.max <= 1,
        "{report:?}"
    );
    assert!(
        report.share_above_1 == 0.0 && report.rmse < 0.2,
        "{report:?}"
    );
    assert_eq!(stats.outcome, Outcome::Complete);
}

#[test]
fn adaptive_converges_to_phong_and_then_does_nothing() {
    let scene = mixed();
    for method in [Method::Adaptive, Method::PhongArea] {
        let (phong, _) = render(&scene, Method::Phong, 1, &[Budget::Unlimited]);
        let mut engine = engine(&scene, options(method, 2));
        let mut frame = Frame::new(SIZE.0, SIZE.1);
        let first = engine.render(&scene, Budget::Unlimited, &mut frame);
        assert!(
            first.converged && first.outcome == Outcome::Complete,
            "{first:?}"
        );
        assert!(first.estimated_error < 1e-3, "{first:?}");
        assert!(
            first.phong_pixels <= first.covered_pixels,
            "none is shaded twice: {first:?}"
        );
        assert!(largest_difference(&frame, &phong) <= 1, "{method}");

        let second = engine.render(&scene, Budget::Unlimited, &mut frame);
        assert_eq!(second.outcome, Outcome::Unchanged);
        assert_eq!((second.work_units, second.pixels_written), (0, 0));
    }
}

#[test]
fn small_budgets_add_up_to_convergence() {
    let scene = mixed();
    let (phong, _) = render(&scene, Method::Phong, 1, &[Budget::Unlimited]);
    let mut engine = engine(&scene, options(Method::Adaptive, 1));
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    let mut last = f64::INFINITY;
    for round in 0..2000 {
        let stats = engine.render(&scene, Budget::Work(50_000), &mut frame);
        assert!(stats.work_units <= 50_000, "{stats:?}");
        if stats.converged {
            assert!(
                round > 3,
                "the budget is small enough to need several frames"
            );
            assert!(largest_difference(&frame, &phong) <= 1);
            return;
        }
        assert!(
            stats.work_units > 0,
            "frame {round} makes progress: {stats:?}"
        );
        last = last.min(stats.estimated_error);
    }
    panic!("not converged after 2000 frames; estimated error {last}");
}

#[test]
fn work_budgets_give_the_same_bits_for_one_and_two_threads() {
    let scene = mixed();
    for work in [0, 30_000, 200_000, 1_000_000, 3_000_000] {
        let budgets = [Budget::Work(work), Budget::Work(work / 2)];
        let (one, a) = render(&scene, Method::Adaptive, 1, &budgets);
        let (two, b) = render(&scene, Method::Adaptive, 2, &budgets);
        assert!(one.pixels() == two.pixels(), "work {work}");
        assert_eq!(
            (
                a.work_units,
                a.refined,
                a.leaves,
                a.phong_pixels,
                a.estimated_error
            ),
            (
                b.work_units,
                b.refined,
                b.leaves,
                b.phong_pixels,
                b.estimated_error
            ),
            "work {work}"
        );
    }
}

#[test]
fn doubling_the_work_never_raises_the_error_by_more_than_two_percent() {
    let scene = mixed();
    let reference = reference(&scene);
    let mut last = f64::INFINITY;
    let mut first = 0.0;
    for doubling in 0..9 {
        let work = Budget::Work(20_000 << doubling);
        let (frame, _) = render(&scene, Method::Adaptive, 1, &[work]);
        let report = ErrorReport::compare(&frame, &reference).expect("same size");
        // Below a tenth of a code there is nothing but rounding.
        assert!(
            report.rmse <= (last * 1.02).max(0.1),
            "{work:?}: {} after {last}",
            report.rmse
        );
        last = report.rmse;
        if doubling == 0 {
            first = report.rmse;
        }
    }
    assert!(last < first / 4.0, "{last} after {first}");
}

#[test]
fn no_work_is_done_past_the_deadline() {
    let scene = mixed();
    // Each reading of the clock takes a quarter of a millisecond: the first image is late already.
    let clock = ManualClock::with_step_ns(250_000);
    let mut engine = engine(
        &scene,
        EngineOptions {
            clock: Arc::new(clock.clone()),
            overrun: Overrun::BeLate,
            ..options(Method::Adaptive, 1)
        },
    );
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    let late = engine.render(&scene, Budget::from_millis(0.5), &mut frame);
    assert_eq!((late.outcome, late.work_units), (Outcome::BaseOnly, 0));
    assert!(late.overshoot_ms().expect("a wall-clock budget") > 0.0);

    let before = clock.now_ms();
    let second = engine.render(&scene, Budget::from_millis(5.0), &mut frame);
    assert!(second.work_units > 0);
    // At most the reading that finds the time gone, and those that end the frame, come after the deadline.
    assert!(clock.now_ms() - before <= 5.0 + 2.0, "{second:?}");
}

#[test]
fn a_clock_that_stands_still_or_jumps_back_does_no_harm() {
    #[derive(Debug)]
    struct Backwards(std::sync::atomic::AtomicU64);
    impl Clock for Backwards {
        fn now_ms(&self) -> f64 {
            -(self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed) as f64)
        }
    }
    let scene = mixed();
    let clocks: [Arc<dyn Clock>; 2] = [
        Arc::new(ManualClock::default()),
        Arc::new(Backwards(0.into())),
    ];
    for clock in clocks {
        let mut engine = engine(
            &scene,
            EngineOptions {
                clock,
                ..options(Method::Adaptive, 1)
            },
        );
        let mut frame = Frame::new(64, 36);
        let stats = engine.render(&scene, Budget::from_millis(1.0), &mut frame);
        assert!(stats.frame_ms >= 0.0 && stats.frame_ms.is_finite());
    }
}

#[test]
fn forgetting_makes_the_next_frame_cold() {
    let scene = mixed();
    let (cold, _) = render(&scene, Method::Adaptive, 1, &[Budget::Work(300_000)]);
    let mut engine = engine(&scene, options(Method::Adaptive, 1));
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    engine.render(&scene, Budget::Unlimited, &mut frame);
    engine.forget();
    engine.render(&scene, Budget::Work(300_000), &mut frame);
    assert!(cold.pixels() == frame.pixels());
}

#[test]
fn any_frame_passed_in_holds_the_current_image_afterwards() {
    let scene = mixed();
    let mut engine = engine(&scene, options(Method::Adaptive, 1));
    let mut frames = [Frame::new(SIZE.0, SIZE.1), Frame::new(SIZE.0, SIZE.1)];
    let mut single = self::engine(&scene, options(Method::Adaptive, 1));
    let mut expected = Frame::new(SIZE.0, SIZE.1);
    for round in 0..6 {
        engine.render(&scene, Budget::Work(150_000), &mut frames[round % 2]);
        single.render(&scene, Budget::Work(150_000), &mut expected);
        if round == 3 {
            // Somebody draws over the frame that comes next.
            frames[0].pixels_mut().fill([1, 2, 3, 4]);
        }
        assert!(
            frames[round % 2].pixels() == expected.pixels(),
            "frame {round}"
        );
    }
}

#[test]
fn another_camera_size_or_scene_starts_anew() {
    let mut scene = mixed();
    let mut engine = engine(&scene, options(Method::Adaptive, 1));
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    engine.render(&scene, Budget::Unlimited, &mut frame);
    let mut camera = *scene.camera();
    camera.position.x += 1.0;
    scene.set_camera(camera);
    let moved = engine.render(&scene, Budget::Unlimited, &mut frame);
    assert_eq!(moved.outcome, Outcome::Complete);
    let (expected, _) = render(&scene, Method::Adaptive, 1, &[Budget::Unlimited]);
    assert!(frame.pixels() == expected.pixels());

    let mut small = Frame::new(40, 30);
    let resized = engine.render(&scene, Budget::Unlimited, &mut small);
    assert!(resized.pixels_written > 0);

    let other = Scene::parse("(objects: [(shape: Sphere())])", "sphere.ron").expect("valid");
    engine.render(&other, Budget::Unlimited, &mut frame);
    let (expected, _) = render(&other, Method::Adaptive, 1, &[Budget::Unlimited]);
    assert!(frame.pixels() == expected.pixels());
}

#[test]
fn levels_with_fused_multiply_add_agree_to_the_last_bit() {
    let scene = mixed();
    let image = |level| {
        let mut engine = engine(
            &scene,
            EngineOptions {
                simd: Some(level),
                ..options(Method::Adaptive, 1)
            },
        );
        let mut frame = Frame::new(SIZE.0, SIZE.1);
        engine.render(&scene, Budget::Work(500_000), &mut frame);
        frame
    };
    let fused = [SimdLevel::Avx2, SimdLevel::Avx512, SimdLevel::Neon];
    let images: Vec<_> = SimdLevel::available()
        .filter(|level| fused.contains(level))
        .map(image)
        .collect();
    for pair in images.windows(2) {
        assert!(pair[0].pixels() == pair[1].pixels());
    }
}

#[test]
fn every_level_converges_to_the_same_image_within_one_code() {
    let scene = mixed();
    let (expected, _) = render(&scene, Method::Phong, 1, &[Budget::Unlimited]);
    for level in SimdLevel::available() {
        let mut engine = engine(
            &scene,
            EngineOptions {
                simd: Some(level),
                ..options(Method::Adaptive, 1)
            },
        );
        let mut frame = Frame::new(SIZE.0, SIZE.1);
        engine.render(&scene, Budget::Unlimited, &mut frame);
        assert!(largest_difference(&frame, &expected) <= 1, "{level}");
    }
}
