//! Timed frames, repeated from what is recorded of them.

use crate::common::*;
use specula::clock::SystemClock;
use specula::frame::Outcome;
use specula::glam::{DMat4, DVec3};
use specula::schedule::{CancelToken, CostModel, FrameRecord};
use specula::{BackendKind, Budget, Engine, EngineOptions, Frame, Method, Scene};
use std::collections::BTreeSet;
use std::sync::Arc;

/// What changes before a frame: the camera moves, stands, and cuts; a light changes; an object moves.
fn edit(scene: &mut Scene, number: u64) {
    match number {
        0..12 | 40..=43 | 62.. => *scene = turned(scene, 1),
        36 => *scene = turned(scene, 11),
        30 | 45 => {
            let mut light = scene.lights()[0];
            light.radiance = [0.2 + 0.01 * number as f64, 0.7, 0.5];
            scene.set_light(0, light);
        }
        50..54 => {
            let place = DVec3::new(0.0, 0.02 * number as f64, 0.4);
            scene.set_transform(1, DMat4::from_translation(place));
        }
        _ => {}
    }
}

/// What is compared.
#[derive(Clone, Debug, PartialEq)]
struct Seen {
    pixels: Pixels,
    work_units: u64,
    outcome: Outcome,
    record: FrameRecord,
}

/// Renders the frames, each with its budget. The engine sees one scene that is edited, as a program's is.
fn film(
    scene: &Scene,
    engine: &mut Engine,
    cancel: Option<&CancelToken>,
    budget: impl Fn(u64) -> Budget,
) -> Vec<Seen> {
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    let mut scene = scene.clone();
    let frames = (0..70).map(|number| {
        edit(&mut scene, number);
        let stats = engine.render(&scene, budget(number), &mut frame);
        if let Some(token) = cancel {
            token.reset();
        }
        Seen {
            pixels: frame.pixels().to_vec(),
            work_units: stats.work_units,
            outcome: stats.outcome,
            record: stats.record,
        }
    });
    frames.collect()
}

#[test]
fn timed_frames_are_repeated_bit_for_bit_by_other_engines() {
    let mut seen = BTreeSet::new();
    for method in [
        Method::Adaptive,
        Method::PhongArea,
        Method::PhongTiles,
        Method::PhongHalf,
        Method::Gouraud,
    ] {
        for (us, budget_ms, cancels_at, lighting) in [
            (100.0, 0.8, u64::MAX, 1.0),
            (20.0, 1.0, 300, 1.0),
            (2.0, 1.0, 2000, 1.0),
            (7.0, 0.5, 777, 1.0),
            (1.0, 9.0, u64::MAX, 1.0),
            (1.0, 0.4, u64::MAX, 10.0),
        ] {
            let token = CancelToken::new();
            let clock = CountingClock::cancelling(us, cancels_at, token.clone());
            let scene = mixed();
            let mut recorded_by = engine(
                &scene,
                EngineOptions {
                    cancel: token.clone(),
                    costs: Some(lighting_takes(lighting)),
                    ..options(method, 1, clock)
                },
            );
            let recorded = film(&scene, &mut recorded_by, Some(&token), |number| {
                // Some frames without a deadline in between.
                if number % 17 == 16 {
                    Budget::Work(30_000)
                } else {
                    Budget::Millis(budget_ms)
                }
            });
            seen.extend(recorded.iter().map(|frame| frame.outcome.name()));
            let lit = recorded.iter().flat_map(|frame| frame.record.lit);
            seen.extend(lit.map(|lit| match lit {
                0 => "not lit",
                FrameRecord::EVERYTHING => "lit as a whole",
                _ => "lit in part",
            }));
            let mut replayed_by = engine(
                &scene,
                EngineOptions {
                    method,
                    threads: Some(2),
                    clock: Arc::new(SystemClock::new()),
                    costs: Some(CostModel::default()),
                    ..EngineOptions::default()
                },
            );
            let replayed = film(&scene, &mut replayed_by, None, |number| {
                Budget::Replay(recorded[number as usize].record)
            });
            for (number, (got, want)) in replayed.iter().zip(&recorded).enumerate() {
                let what = format!(
                    "{method}, {us} us a reading, frame {number}: {:?}",
                    want.record
                );
                assert_eq!(got.work_units, want.work_units, "{what}");
                assert!(got.pixels == want.pixels, "{what}");
                assert_eq!(got.record, want.record, "{what}");
                assert_eq!(got.outcome, want.outcome, "{what}");
            }
        }
    }
    for name in [
        "stale",
        "reduced",
        "refined",
        "complete",
        "unchanged",
        "not lit",
        "lit in part",
        "lit as a whole",
    ] {
        assert!(
            seen.contains(name),
            "{name} is among what is repeated: {seen:?}"
        );
    }
}

/// A frame that ends while triangles are collected has taken up no candidate, unlike its replay, which collects them all and is
/// refused the first one.
#[test]
fn frames_that_end_while_collecting_are_repeated() {
    let text =
        "(lights: [Point(position: (3, -4, 6))], objects: [(shape: Teapot(tessellation: 12))])";
    let scene = Scene::parse(text, "fine teapot").expect("a valid scene");
    let render = |engine: &mut Engine, budgets: &[Budget]| {
        let mut frame = Frame::new(SIZE[0], SIZE[1]);
        let records: Vec<_> = budgets
            .iter()
            .map(|&budget| {
                let stats = engine.render(&scene, budget, &mut frame);
                (stats.record, stats.pht, stats.triangles_visible)
            })
            .collect();
        (frame.pixels().to_vec(), records)
    };
    let mut cut = 0;
    for hundredths in 10..100 {
        let clock = CountingClock::stepping(20.0);
        let known = EngineOptions {
            costs: Some(CostModel::default()),
            ..options(Method::Adaptive, 1, clock)
        };
        let mut recorded_by = engine(&scene, known);
        let second = Budget::Millis(f64::from(hundredths) * 0.01);
        let (pixels, records) = render(
            &mut recorded_by,
            &[Budget::Millis(0.0), second, Budget::Millis(20.0)],
        );
        let phts = records[2].1;
        cut += u32::from(records[1].0.steps == 0 && (1..phts).contains(&records[1].1));
        let budgets = [0, 1, 2].map(|i| Budget::Replay(records[i].0));
        let (got, again) = render(&mut timeless(&scene, Method::Adaptive), &budgets);
        assert!(records[2].0.steps > 100, "{records:?}");
        assert_eq!(again[2].0, records[2].0);
        assert!(got == pixels, "{hundredths} hundredths, {records:?}");
    }
    assert!(cut > 1, "{cut} frames ended while collecting");
}

/// An error that is not estimated is no reason to stop.
#[test]
fn squares_are_shaded_to_the_end_whatever_the_error_asked_for() {
    let scene = mixed();
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    let mut engine = timeless(&scene, Method::PhongTiles);
    let stats = engine.render(&scene, Budget::Error(4.0), &mut frame);
    assert!(stats.converged && stats.phong_pixels > 0, "{stats:?}");
}

/// It refines first, and then draws everything once.
#[test]
fn timed_frames_of_a_backend_that_cannot_repaint_are_repeated_too() {
    let scene = mixed();
    for (us, budget_ms) in [(20.0, 1.0), (100.0, 0.8), (2.0, 6.0)] {
        let options = |clock: Arc<CountingClock>| EngineOptions {
            backend: BackendKind::Skia,
            ..options(Method::Adaptive, 1, clock)
        };
        let mut recorded_by = engine(&scene, options(CountingClock::stepping(us)));
        let recorded = film(&scene, &mut recorded_by, None, |_| {
            Budget::Millis(budget_ms)
        });
        let mut replayed_by = engine(&scene, options(CountingClock::stepping(0.0)));
        let replayed = film(&scene, &mut replayed_by, None, |number| {
            Budget::Replay(recorded[number as usize].record)
        });
        for (number, (got, want)) in replayed.iter().zip(&recorded).enumerate() {
            assert!(
                got == want,
                "{us} us a reading, frame {number}: {:?}",
                want.record
            );
        }
    }
}

#[test]
fn a_replay_cannot_be_stopped() {
    let scene = mixed();
    let clock = CountingClock::stepping(1.0);
    let mut recorded_by = engine(&scene, refining_options(1, clock));
    let mut want = Frame::new(SIZE[0], SIZE[1]);
    let stats = recorded_by.render(&scene, Budget::Millis(1.0), &mut want);
    assert!(stats.record.steps > 0, "{stats:?}");
    let mut engine = timeless(&scene, Method::Adaptive);
    engine.cancel_token().cancel();
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    engine.render(&scene, Budget::Replay(stats.record), &mut frame);
    assert!(frame.pixels() == want.pixels());
}

/// A record of another scene, or one that has been tampered with, is no reason to hang or to panic.
#[test]
fn records_of_something_else_do_no_harm() {
    let scene = mixed();
    for method in [Method::Adaptive, Method::PhongHalf, Method::PhongTiles] {
        let mut engine = timeless(&scene, method);
        for (divisor, images, steps) in [
            (4, 0, 0),
            (2, 5, u64::MAX),
            (3, u32::MAX, 3),
            (1, 0, u64::MAX),
            (0, 1, 1),
        ] {
            for is_image_begun in [false, true] {
                let record = FrameRecord {
                    is_timed: true,
                    divisor,
                    images,
                    is_image_begun,
                    divisions: images.wrapping_mul(0x9e37),
                    lit: [images.wrapping_mul(0x51), divisor],
                    steps,
                };
                let scene = turned(&scene, steps % 7);
                let mut frame = Frame::new(64, 48);
                let stats = engine.render(&scene, Budget::Replay(record), &mut frame);
                assert!(stats.frame_ms.is_finite(), "{record:?}");
            }
        }
    }
}
