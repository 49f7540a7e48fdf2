//! Spare time between frames, and being stopped by somebody else.

use crate::common::*;
use specula::frame::Outcome;
use specula::schedule::CancelToken;
use specula::{Budget, EngineOptions, Frame, Method};

const STEP_US: f64 = 50.0;
const BUDGET: Budget = Budget::Millis(0.6);

/// Readings after the last one that admits work: as of a [frame](crate::timing), but that nothing is handed over; and those that tell
/// the time now.
const MOST_READINGS: u64 = 6;

#[test]
fn spare_time_goes_on_with_the_image_and_ends_in_time() {
    let scene = mixed();
    for (method, threads) in [
        (Method::Adaptive, 1),
        (Method::PhongArea, 2),
        (Method::Gouraud, 1),
    ] {
        let want = converged(&scene, method);
        for frames in 1..6 {
            let clock = CountingClock::stepping(STEP_US);
            let mut engine = engine(&scene, options(method, threads, clock.clone()));
            let mut frame = Frame::new(SIZE[0], SIZE[1]);
            for _ in 0..frames {
                engine.render(&scene, BUDGET, &mut frame);
            }
            let mut is_final = false;
            for _ in 0..4000 {
                let before = clock.readings();
                let deadline_ms = engine.now_ms() + 0.6;
                is_final = engine.refine_until(deadline_ms);
                let allowed = (0.6e3 / STEP_US) as u64 + 1 + MOST_READINGS + threads as u64;
                assert!(clock.readings() - before <= allowed, "{method}");
                if is_final {
                    break;
                }
            }
            assert!(is_final, "{method}: it gets on");
            assert!(engine.refine_until(f64::INFINITY), "nothing is left to do");
            let stats = engine.render(&scene, BUDGET, &mut frame);
            assert_eq!(
                (stats.work_units, stats.record.images, stats.divisor),
                (0, 0, 1),
                "{method}: {stats:?}"
            );
            assert!(frame.pixels() == want, "{method} after {frames} frames");
        }
    }
}

#[test]
fn spare_time_completes_the_resolution_of_a_still_view() {
    let scene = mixed();
    for method in [Method::Adaptive, Method::Phong] {
        let mut engine = timeless(&scene, method);
        let mut frame = Frame::new(SIZE[0], SIZE[1]);
        let stats = engine.render(&scene, first_image_at(2), &mut frame);
        assert_eq!(stats.outcome, Outcome::Reduced);
        assert!(engine.refine_until(f64::INFINITY));
        let stats = engine.render(&scene, Budget::Work(0), &mut frame);
        assert_eq!(
            (stats.work_units, stats.record.images, stats.divisor),
            (0, 0, 1),
            "{stats:?}"
        );
        assert!(
            stats.converged && frame.pixels() == converged(&scene, method),
            "{method}"
        );
    }
}

#[test]
fn without_an_image_or_time_spare_time_does_nothing() {
    let scene = mixed();
    let clock = CountingClock::stepping(STEP_US);
    let mut engine = engine(&scene, options(Method::Adaptive, 1, clock));
    assert!(!engine.refine_until(1e9), "there is no view to be drawn");
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    engine.render(&scene, Budget::Work(0), &mut frame);
    for deadline_ms in [f64::NAN, -1.0, 0.0, f64::NEG_INFINITY] {
        assert!(!engine.refine_until(deadline_ms), "{deadline_ms}");
    }
    let stats = engine.render(&scene, Budget::Work(0), &mut frame);
    assert_eq!(stats.outcome, Outcome::Unchanged);
}

/// The last frame asked for a view that there was no time to begin: that one is what is to be final.
#[test]
fn an_image_of_another_view_is_not_final() {
    let scene = mixed();
    let mut engine = timeless(&scene, Method::Gouraud);
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    engine.render(&scene, Budget::Unlimited, &mut frame);
    let moved = turned(&scene, 5);
    engine.cancel_token().cancel();
    let stats = engine.render(&moved, BUDGET, &mut frame);
    assert_eq!(stats.outcome, Outcome::Stale { age: Some(1) });
    assert!(!engine.refine_until(1e9), "it is cancelled");
    engine.cancel_token().reset();
    // The camera is the only thing that moved, so spare time knows all that it takes.
    assert!(engine.refine_until(1e9));
    // It was right for the last frame, whenever it was drawn.
    engine.cancel_token().cancel();
    let stats = engine.render(&turned(&scene, 6), BUDGET, &mut frame);
    assert_eq!(stats.outcome, Outcome::Stale { age: Some(1) });
    assert!(frame.pixels() == fresh(&moved, Method::Gouraud, SIZE, 1));
}

#[test]
fn a_cancelled_engine_returns_soon_keeps_its_image_and_goes_on_later() {
    let scene = mixed();
    // Enough for everything, but not to light pixels where that seems to take long.
    let budget = Budget::Millis(20.0);
    for (method, threads, refines) in [
        (Method::Adaptive, 1, true),
        (Method::Adaptive, 2, true),
        (Method::Adaptive, 1, false),
        (Method::Phong, 1, false),
    ] {
        let options = |clock| match refines {
            true => refining_options(threads, clock),
            false => options(method, threads, clock),
        };
        let want = converged(&scene, method);
        let (mut stopped, mut refining) = (0, 0);
        // Readings of a frame that nobody stops.
        let clock = CountingClock::stepping(1.0);
        let mut undisturbed = engine(&scene, options(clock.clone()));
        let mut frame = Frame::new(SIZE[0], SIZE[1]);
        undisturbed.render(&scene, budget, &mut frame);
        let readings = clock.readings();
        for at in (1..readings).step_by((readings / 80).max(1) as usize) {
            let token = CancelToken::new();
            let clock = CountingClock::cancelling(1.0, at, token.clone());
            let mut engine = engine(
                &scene,
                EngineOptions {
                    cancel: token.clone(),
                    ..options(clock.clone())
                },
            );
            let mut frame = Frame::new(SIZE[0], SIZE[1]);
            let stats = engine.render(&scene, budget, &mut frame);
            let what = format!("{method}, {threads} threads, reading {at}: {stats:?}");
            if token.is_cancelled() && !stats.converged {
                stopped += 1;
                refining += u64::from(stats.record.images > 0);
                let beyond = clock.readings() - (at + 1);
                assert!(
                    // Two more where the refinement of a first image begins.
                    beyond < MOST_READINGS + 2 + threads as u64,
                    "{beyond} after it; {what}"
                );
            }
            // While it is cancelled nothing changes.
            let pixels = frame.pixels().to_vec();
            token.cancel();
            let again = engine.render(&scene, budget, &mut frame);
            assert_eq!((again.work_units, again.record.images), (0, 0), "{what}");
            assert!(frame.pixels() == pixels, "{what}");
            assert!(
                !engine.refine_until(f64::INFINITY) || stats.converged,
                "{what}"
            );
            token.reset();
            finish(&mut engine, &scene, budget, &mut frame);
            assert!(frame.pixels() == want, "{what}");
        }
        let least = if refines { 3 } else { 0 };
        assert!(
            stopped > 5 && refining >= least,
            "{method}: {stopped} frames were stopped, {refining} of them while refining"
        );
    }
}
