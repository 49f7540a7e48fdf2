//! The rival that shades squares of the image: what it shows is Gouraud shading here and Phong shading there.

use specula::backend::SQUARE_SIDE;
use specula::clock::ManualClock;
use specula::{BackendKind, Budget, Engine, EngineOptions, Frame, FrameStats, Method, Scene};
use std::sync::Arc;

const SCENE: &str = "(
    lights: [Point(position: (-5, -8, 8)), Point(position: (6, -3, 5))],
    objects: [(shape: Teapot(tessellation: 4)), (shape: Torus(), position: (3, -3, 1))],
)";

/// Squares at the right and lower edges are cut.
const SIZE: (u32, u32) = (413, 290);

fn scene() -> Scene {
    Scene::parse(SCENE, "tiles.ron").expect("the scene is valid")
}

fn engine(scene: &Scene, method: Method, threads: usize) -> Engine {
    let options = EngineOptions {
        method,
        threads: Some(threads),
        ..EngineOptions::default()
    };
    Engine::with_options(scene, options).expect("few threads")
}

fn render(method: Method, threads: usize, budget: Budget) -> (Frame, FrameStats) {
    let scene = scene();
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    let stats = engine(&scene, method, threads).render(&scene, budget, &mut frame);
    (frame, stats)
}

/// For each square whether it shows the first image, the second, both or neither.
fn squares(frame: &Frame, images: [&Frame; 2]) -> Vec<[bool; 2]> {
    let columns = SIZE.0.div_ceil(SQUARE_SIDE);
    let mut all = vec![[true; 2]; (columns * SIZE.1.div_ceil(SQUARE_SIDE)) as usize];
    for y in 0..SIZE.1 {
        for x in 0..SIZE.0 {
            let index = (y * SIZE.0 + x) as usize;
            let square = &mut all[(y / SQUARE_SIDE * columns + x / SQUARE_SIDE) as usize];
            for (same, image) in square.iter_mut().zip(images) {
                *same &= frame.pixels()[index] == image.pixels()[index];
            }
        }
    }
    all
}

#[test]
fn all_squares_together_are_phong_shading() {
    let (phong, _) = render(Method::Phong, 1, Budget::Unlimited);
    for threads in [1, 3] {
        let (tiles, stats) = render(Method::PhongTiles, threads, Budget::Unlimited);
        assert!(stats.converged && stats.estimated_error == 0.0, "{stats:?}");
        assert_eq!(stats.phong_pixels, stats.covered_pixels);
        assert!(tiles.pixels() == phong.pixels());
    }
}

#[test]
fn a_square_is_shaded_as_a_whole_or_not_at_all_whatever_the_threads() {
    let (gouraud, _) = render(Method::Gouraud, 1, Budget::Unlimited);
    let (phong, whole) = render(Method::Phong, 1, Budget::Unlimited);
    let (_, all) = render(Method::PhongTiles, 1, Budget::Unlimited);
    let mut last = 0;
    for share in 0..5 {
        let budget = Budget::Work(all.work_units * share / 4);
        let (frame, stats) = render(Method::PhongTiles, 1, budget);
        assert!(stats.work_units <= all.work_units * share / 4, "{stats:?}");
        let squares = squares(&frame, [&gouraud, &phong]);
        assert!(squares.iter().all(|same| same[0] || same[1]), "{squares:?}");
        let shaded = squares.iter().filter(|same| !same[0]).count();
        assert!(share == 0 || shaded > last, "{shaded} squares after {last}");
        last = shaded;
        if share == 0 {
            assert_eq!((shaded, stats.phong_pixels), (0, 0));
        } else if share < 4 {
            assert!(stats.phong_pixels < whole.covered_pixels && !stats.converged);
        }
        let (other, other_stats) = render(Method::PhongTiles, 3, budget);
        assert!(other.pixels() == frame.pixels(), "{share}");
        assert_eq!(other_stats.phong_pixels, stats.phong_pixels);
    }
}

#[test]
fn small_budgets_add_up_and_a_final_image_costs_nothing() {
    let scene = scene();
    let mut engine = engine(&scene, Method::PhongTiles, 2);
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    let (_, all) = render(Method::PhongTiles, 1, Budget::Unlimited);
    let mut spent = 0;
    let frames = (1..100)
        .find(|_| {
            let budget = Budget::Work(all.work_units / 3);
            let stats = engine.render(&scene, budget, &mut frame);
            spent += stats.work_units;
            stats.converged
        })
        .expect("it comes to an end");
    assert!(frames > 2, "{frames}");
    assert_eq!(spent, all.work_units);
    let (phong, _) = render(Method::Phong, 1, Budget::Unlimited);
    assert!(frame.pixels() == phong.pixels());
    let after = engine.render(&scene, Budget::Unlimited, &mut frame);
    assert_eq!((after.work_units, after.pixels_written), (0, 0));
}

#[test]
fn no_square_is_begun_past_the_deadline() {
    let scene = scene();
    // Each look at the clock takes 10 microseconds, and nothing else takes any time.
    let clock = || Arc::new(ManualClock::with_step_ns(10_000));
    let render = |method, budget: Budget| {
        let options = EngineOptions {
            method,
            threads: Some(1),
            clock: clock(),
            ..EngineOptions::default()
        };
        let mut engine = Engine::with_options(&scene, options).expect("one thread");
        engine.render(&scene, budget, &mut Frame::new(SIZE.0, SIZE.1))
    };
    let none = render(Method::PhongTiles, Budget::from_millis(0.0));
    assert_eq!(none.phong_pixels, 0);
    // As long as the first image takes, with all looks at the clock, and some squares.
    let first = render(Method::Gouraud, Budget::from_millis(1000.0));
    let budget = Budget::from_millis(first.frame_ms + 0.15);
    let some = render(Method::PhongTiles, budget);
    assert!(some.phong_pixels > 0 && !some.converged, "{some:?}");
    assert!(some.overshoot_ms() <= Some(0.05), "{some:?}");
}

#[test]
fn nothing_is_shaded_where_there_is_nothing() {
    let text = "(camera: Perspective(position: (9, 0, 0), target: (99, 0, 0)), objects: [(shape: Teapot())])";
    let empty = Scene::parse(text, "away.ron").expect("valid");
    for (width, height) in [(0, 0), (100, 70)] {
        let mut frame = Frame::new(width, height);
        let stats =
            engine(&empty, Method::PhongTiles, 2).render(&empty, Budget::Unlimited, &mut frame);
        assert!(stats.converged && stats.work_units == 0, "{stats:?}");
    }
}

#[test]
fn a_backend_without_pixels_refuses() {
    let scene = scene();
    let options = EngineOptions {
        method: Method::PhongTiles,
        backend: BackendKind::Skia,
        ..EngineOptions::default()
    };
    assert!(Engine::with_options(&scene, options).is_err());
}
