//! Frames end by their deadline, however long it takes to look at the clock.

use crate::common::*;
use specula::clock::Clock;
use specula::frame::Outcome;
use specula::{Budget, Frame, Method};

/// Readings after the last one before the deadline, at most. The longest way from there: placing objects ends (one reading), beginning an
/// image is refused (one) and, since nothing has been drawn yet, done all the same; its clusters are culled (two), going on is refused
/// (one), the background or the image before is handed over (two), and the frame is reported (one). Each further thread asks
/// once more.
const MOST_READINGS: u64 = 8;

const METHODS: [Method; 4] = [
    Method::Adaptive,
    Method::PhongArea,
    Method::Phong,
    Method::Gouraud,
];

#[test]
fn no_frame_ends_more_than_a_few_readings_after_its_deadline() {
    let scene = mixed();
    let mut worst = 0;
    for method in METHODS {
        for (us, threads) in [(1.0, 1), (10.0, 2), (50.0, 1), (200.0, 1), (200.0, 2)] {
            for budget_ms in [0.3, 1.0, 4.0] {
                for is_moving in [false, true] {
                    let clock = CountingClock::stepping(us);
                    let mut engine = engine(&scene, options(method, threads, clock.clone()));
                    let mut frame = Frame::new(SIZE[0], SIZE[1]);
                    for number in 0..12 {
                        let scene = turned(&scene, if is_moving { number } else { 0 });
                        let before = clock.readings();
                        let stats = engine.render(&scene, Budget::Millis(budget_ms), &mut frame);
                        let taken = clock.readings() - before;
                        // The frame starts at its first reading.
                        let allowed = (budget_ms * 1e3 / us) as u64 + 1;
                        let beyond = taken.saturating_sub(allowed);
                        worst = worst.max(beyond);
                        assert!(
                            beyond < MOST_READINGS + threads as u64,
                            "{method}, {us} us a reading, {threads} threads, {budget_ms} ms, moving: {is_moving}, \
                             frame {number}: {taken} readings instead of {allowed}; {stats:?}"
                        );
                    }
                }
            }
        }
    }
    assert!(worst > 0, "some frames end a little late");
}

#[test]
fn a_still_view_gets_on_in_any_budget_that_is_not_over_at_once() {
    let scene = mixed();
    for method in METHODS {
        let want = converged(&scene, method);
        for (us, budget_ms) in [(1.0, 0.2), (50.0, 1.0), (100.0, 2.0)] {
            let clock = CountingClock::stepping(us);
            let mut engine = engine(&scene, options(method, 1, clock));
            let mut frame = Frame::new(SIZE[0], SIZE[1]);
            let stats = finish(&mut engine, &scene, Budget::Millis(budget_ms), &mut frame);
            let what = format!("{method}, {us} us a reading, {budget_ms} ms: {stats:?}");
            assert_eq!(
                (stats.outcome, stats.divisor),
                (Outcome::Complete, 1),
                "{what}"
            );
            assert!(largest_difference(frame.pixels(), &want) <= 1, "{what}");
            let pixels = frame.pixels().to_vec();
            let stats = engine.render(&scene, Budget::Millis(budget_ms), &mut frame);
            assert_eq!(stats.outcome, Outcome::Unchanged, "{what}");
            assert_eq!((stats.work_units, stats.pixels_written), (0, 0));
            assert!(frame.pixels() == pixels, "{what}");
        }
    }
}

#[test]
fn no_time_at_all_is_a_first_image() {
    let scene = mixed();
    let clock = CountingClock::stepping(1000.0);
    assert_eq!(clock.now_ms(), 0.0);
    for budget in [
        Budget::Millis(0.0),
        Budget::from_millis(-5.0),
        Budget::from_millis(f64::NAN),
    ] {
        let mut engine = engine(&scene, options(Method::Adaptive, 1, clock.clone()));
        let mut frame = Frame::new(SIZE[0], SIZE[1]);
        let stats = engine.render(&scene, budget, &mut frame);
        assert_eq!((stats.outcome, stats.work_units), (Outcome::BaseOnly, 0));
        assert!(frame.pixels() == fresh(&scene, Method::Gouraud, SIZE, 1));
    }
}
