//! First images of which some triangles, or all, are shaded per pixel as they get their colours: what a deadline decides, repeated here
//! by records, which need no clock.

use specula::frame::{LeafKind, Outcome};
use specula::measure::{ErrorReport, ReferenceImage};
use specula::schedule::{CostModel, FrameRecord};
use specula::{Budget, Engine, EngineOptions, Frame, FrameStats, Method, Scene};
use std::path::Path;

const SIZE: [u32; 2] = [320, 180];

const SCENES: [&str; 4] = ["teapot", "walls", "lights16", "closeup"];

fn load(name: &str) -> Scene {
    let path = format!("scenes/{name}.ron");
    Scene::load(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("a valid scene")
}

fn engine(scene: &Scene, method: Method, threads: usize) -> Engine {
    let options = EngineOptions {
        method,
        threads: Some(threads),
        costs: Some(CostModel::default()),
        ..EngineOptions::default()
    };
    Engine::with_options(scene, options).expect("the options are valid")
}

/// A first image with so many rounds of division and so many lit triangles, and nothing after it.
fn composed(rounds: u32, lit: u32) -> Budget {
    Budget::Replay(FrameRecord {
        is_timed: true,
        images: 1,
        divisions: rounds,
        lit: [lit, 0],
        ..FrameRecord::default()
    })
}

fn draw(scene: &Scene, method: Method, budget: Budget) -> (Frame, FrameStats, Engine) {
    let mut engine = engine(scene, method, 1);
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    let stats = engine.render(scene, budget, &mut frame);
    (frame, stats, engine)
}

#[test]
fn an_image_lit_as_a_whole_is_that_of_per_pixel_shading_and_final() {
    for name in SCENES {
        let scene = load(name);
        let (want, ..) = draw(&scene, Method::Phong, Budget::Unlimited);
        let budget = composed(0, FrameRecord::EVERYTHING);
        let (got, stats, mut engine) = draw(&scene, Method::Adaptive, budget);
        assert!(got.pixels() == want.pixels(), "{name}");
        assert_eq!(stats.outcome, Outcome::Complete, "{name}: {stats:?}");
        assert!(stats.converged && stats.phong_pixels == stats.covered_pixels);
        assert_eq!(stats.error_bound, Some(1.0 / 255.0), "{name}");
        assert_eq!(
            (stats.unproved_share, stats.estimated_error),
            (Some(0.0), 0.0)
        );
        let (mut pixels, mut others) = (0, 0);
        engine.for_each_leaf(|leaf| {
            pixels += u64::from(leaf.pixels);
            others += u32::from(leaf.kind != LeafKind::PerPixel);
        });
        assert_eq!((pixels, others), (stats.covered_pixels, 0), "{name}");

        let mut frame = got.clone();
        let again = engine.render(&scene, Budget::Unlimited, &mut frame);
        assert_eq!(again.outcome, Outcome::Unchanged, "{name}: {again:?}");
        assert!(frame.pixels() == want.pixels(), "{name}");
    }
}

/// Nothing of a refined image is left when the next one is lit as a whole.
#[test]
fn an_image_lit_after_a_refined_one_is_like_any_other() {
    let scene = load("lights100");
    let mut engine = engine(&scene, Method::Adaptive, 1);
    // Not curved, and under many lights, so that triangles are subdivided.
    let [width, height] = [640, 360];
    let mut frame = Frame::new(width, height);
    let mut refined = engine.render(&scene, composed(0, 0), &mut frame);
    while refined.leaves == 0 && !refined.converged {
        refined = engine.render(&scene, Budget::Work(50_000), &mut frame);
    }
    assert!(refined.leaves > 0 && refined.pht > 0, "{refined:?}");

    let mut moved = scene.clone();
    let mut camera = *scene.camera();
    camera.position.x += 0.1;
    moved.set_camera(camera);
    let everything = composed(0, FrameRecord::EVERYTHING);
    let stats = engine.render(&moved, everything, &mut frame);
    let mut want = Frame::new(width, height);
    let mut another = self::engine(&moved, Method::Adaptive, 1);
    let fresh = another.render(&moved, everything, &mut want);
    assert!(frame.pixels() == want.pixels());
    let of = |stats: &FrameStats| (stats.leaves, stats.pht, stats.refined, stats.phong_pixels);
    assert_eq!(of(&stats), of(&fresh));
    assert_eq!(of(&stats), (0, 0, 0, stats.covered_pixels));
}

#[test]
fn lit_triangles_are_those_of_per_pixel_shading_and_all_others_as_without() {
    for name in SCENES {
        let scene = load(name);
        let (phong, ..) = draw(&scene, Method::Phong, Budget::Unlimited);
        for rounds in [0, 2] {
            let (plain, ..) = draw(&scene, Method::Adaptive, composed(rounds, 0));
            let mut last: Option<(u64, f64)> = None;
            for lit in [1, 5, 25, 100, 100_000] {
                let (got, stats, engine) = draw(&scene, Method::Adaptive, composed(rounds, lit));
                let what = format!("{name}, {rounds} rounds, {lit} lit: {stats:?}");
                assert!(
                    stats.record.lit[0] <= lit && stats.phong_pixels > 0,
                    "{what}"
                );
                let pixels = got.pixels().iter().zip(phong.pixels());
                let (mut lit_pixels, mut other_pixels) = (0, 0);
                for ((got, phong), plain) in pixels.zip(plain.pixels()) {
                    lit_pixels += u64::from(got == phong && got != plain);
                    other_pixels += u64::from(got != phong && got != plain);
                }
                assert_eq!(other_pixels, 0, "{what}");
                assert!(lit_pixels <= stats.phong_pixels, "{what}");
                let mut leaves = 0;
                engine.for_each_leaf(|leaf| {
                    let is_lit = leaf.kind == LeafKind::PerPixel && leaf.is_painted;
                    leaves += if is_lit { u64::from(leaf.pixels) } else { 0 };
                });
                assert_eq!(leaves, stats.phong_pixels, "{what}");
                let error = rmse(&scene, &got);
                if let Some((pixels, before)) = last {
                    assert!(stats.phong_pixels >= pixels, "{what}");
                    assert!(error <= before + 1e-9, "from {before} to {error}: {what}");
                }
                last = Some((stats.phong_pixels, error));
            }
            let (_, error) = last.expect("some were lit");
            assert!(error < 0.2 * rmse(&scene, &plain), "{name}: {error}");
        }
    }
}

/// Of an image against the reference in double precision.
fn rmse(scene: &Scene, frame: &Frame) -> f64 {
    let world = specula::scene::World::new(scene);
    let view = world.view(scene.camera(), SIZE[0], SIZE[1]);
    let reference = ReferenceImage::render(&world, &view, 1);
    let report = ErrorReport::compare(frame, &reference).expect("the same size");
    report.rmse
}

#[test]
fn what_is_lit_does_not_depend_on_threads() {
    for name in SCENES {
        let scene = load(name);
        let render = |threads| {
            let mut engine = engine(&scene, Method::Adaptive, threads);
            let mut frame = Frame::new(SIZE[0], SIZE[1]);
            let stats = engine.render(&scene, composed(1, 40), &mut frame);
            let then = engine.render(&scene, Budget::Work(200_000), &mut frame);
            (
                frame.pixels().to_vec(),
                stats.phong_pixels,
                then.phong_pixels,
            )
        };
        assert!(render(1) == render(3), "{name}");
    }
}

#[test]
fn refinement_goes_on_from_a_lit_image_until_all_of_it_is_right() {
    for name in SCENES {
        let scene = load(name);
        let (phong, ..) = draw(&scene, Method::Phong, Budget::Unlimited);
        for (rounds, lit) in [(0, 30), (3, 10), (1, 100_000)] {
            let (mut frame, first, mut engine) =
                draw(&scene, Method::Adaptive, composed(rounds, lit));
            let mut bounds = (first.error_bound, first.unproved_share);
            let mut stats = first;
            while !stats.converged {
                stats = engine.render(&scene, Budget::Work(300_000), &mut frame);
                let now = (stats.error_bound, stats.unproved_share);
                assert!(now.0 <= bounds.0 && now.1 <= bounds.1, "{name}: {stats:?}");
                bounds = now;
            }
            assert_eq!(bounds, (Some(1.0 / 255.0), Some(0.0)), "{name}");
            let pixels = frame.pixels().iter().zip(phong.pixels());
            let most = pixels.flat_map(|(a, b)| (0..3).map(|c| a[c].abs_diff(b[c])));
            assert!(most.max() <= Some(1), "{name}, {rounds} rounds, {lit} lit");
        }
    }
}

/// On a backend that cannot shade per pixel, and at lower resolutions, nothing is lit, whatever a record says.
#[test]
fn nothing_is_lit_where_it_cannot_be() {
    let scene = load("teapot");
    let options = EngineOptions {
        backend: specula::BackendKind::Skia,
        threads: Some(1),
        ..EngineOptions::default()
    };
    let mut engine = Engine::with_options(&scene, options).expect("the options are valid");
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    let stats = engine.render(&scene, composed(0, FrameRecord::EVERYTHING), &mut frame);
    assert_eq!((stats.phong_pixels, stats.record.lit), (0, [0; 2]));

    let reduced = FrameRecord {
        is_timed: true,
        divisor: 2,
        images: 1,
        lit: [FrameRecord::EVERYTHING; 2],
        ..FrameRecord::default()
    };
    let (_, stats, _) = draw(&scene, Method::Adaptive, Budget::Replay(reduced));
    assert_eq!((stats.phong_pixels, stats.record.lit), (0, [0; 2]));
    assert_eq!((stats.error_bound, stats.converged), (None, false));
}
