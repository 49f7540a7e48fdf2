//! Clocks that jump, stall, or run backwards do no harm that lasts.

use crate::common::*;
use specula::{Budget, Frame, FrameStats, Method};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What is wrong with the clock from a certain reading on.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// That reading is so many milliseconds later than it should be, and those after it.
    Jumps(f64),
    /// Time stands still.
    Stalls,
    /// Time runs backwards.
    RunsBackwards,
    /// Every other reading is long before the origin.
    Flickers,
}

const STEP_MS: f64 = 0.02;
const BUDGET: Budget = Budget::Millis(1.0);

/// A clock with a fault from reading number `at` on, until it is told that it is sane.
fn faulty(fault: Fault, at: u64) -> (Arc<CountingClock>, Arc<AtomicBool>) {
    let is_sane = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&is_sane);
    let clock = CountingClock::new(move |n| {
        let right = n as f64 * STEP_MS;
        let stop = at as f64 * STEP_MS;
        match fault {
            _ if n < at => right,
            Fault::Jumps(ms) => right + ms,
            _ if told.load(Ordering::Relaxed) => right,
            Fault::Stalls => stop,
            Fault::RunsBackwards => stop - 50.0 * (right - stop),
            Fault::Flickers if n % 2 == 0 => -1e6,
            Fault::Flickers => right,
        }
    });
    (clock, is_sane)
}

fn assert_finite(stats: &FrameStats, what: &str) {
    let stages = (stats.stage_ms.entries().into_iter()).chain(stats.predicted_ms.entries());
    for (name, ms) in stages.chain([("frame", stats.frame_ms)]) {
        assert!(ms.is_finite(), "{what}: {name} took {ms} ms");
    }
    assert!(stats.frame_ms >= 0.0, "{what}: {stats:?}");
    assert!(stats.overshoot_ms().is_some_and(f64::is_finite), "{what}");
}

#[test]
fn images_end_up_right_whatever_the_clock_did() {
    let scene = mixed();
    for (method, threads) in [
        (Method::Adaptive, 1),
        (Method::PhongArea, 2),
        (Method::Phong, 1),
    ] {
        let want = converged(&scene, method);
        for fault in [
            Fault::Jumps(5000.0),
            Fault::Stalls,
            Fault::RunsBackwards,
            Fault::Flickers,
        ] {
            // Every reading of the first frames is once the one that goes wrong.
            for at in (0..45).chain((45..130).step_by(9)) {
                let (clock, is_sane) = faulty(fault, at);
                let mut engine = engine(&scene, options(method, threads, clock.clone()));
                let mut frame = Frame::new(SIZE[0], SIZE[1]);
                let what = format!("{method}, {fault:?} at reading {at}");
                for number in 0..4 {
                    let moved = turned(&scene, number);
                    assert_finite(&engine.render(&moved, BUDGET, &mut frame), &what);
                }
                is_sane.store(true, Ordering::Relaxed);
                let stats = finish(&mut engine, &scene, BUDGET, &mut frame);
                assert_finite(&stats, &what);
                assert_eq!(stats.divisor, 1);
                assert!(
                    frame.pixels() == want,
                    "{what}: {}",
                    largest_difference(frame.pixels(), &want)
                );
            }
        }
    }
}
