//! The rectangles that a frame says it has changed.

use crate::common::*;
use specula::output::Rect;
use specula::{Budget, Engine, Frame, FrameStats, Method};

/// Checks the rectangles against the pixels before and after.
fn assert_covers(
    engine: &Engine,
    stats: &FrameStats,
    before: &[[u8; 4]],
    frame: &Frame,
    what: &str,
) {
    let mut times_covered = vec![0; before.len()];
    for &Rect {
        x,
        y,
        width,
        height,
    } in engine.changed()
    {
        assert!(width > 0 && height > 0, "{what}: an empty rectangle");
        assert!(
            x + width <= frame.width() && y + height <= frame.height(),
            "{what}: inside of the image"
        );
        for y in y..y + height {
            for x in x..x + width {
                times_covered[(y * frame.width() + x) as usize] += 1;
            }
        }
    }
    assert!(
        times_covered.iter().all(|&times| times < 2),
        "{what}: they overlap"
    );
    let covered = times_covered.iter().filter(|&&times| times > 0).count();
    assert_eq!(
        covered as u64, stats.pixels_written,
        "{what}: what is written is what is named"
    );
    for (i, (old, new)) in before.iter().zip(frame.pixels()).enumerate() {
        assert!(
            old == new || times_covered[i] == 1,
            "{what}: pixel {i} was {old:?} and is {new:?}"
        );
    }
}

#[test]
fn every_pixel_that_differs_lies_in_one_rectangle() {
    let scene = mixed();
    for (method, us) in [
        (Method::Adaptive, 2.0),
        (Method::Adaptive, 60.0),
        (Method::PhongTiles, 12.0),
    ] {
        let clock = CountingClock::stepping(us);
        let mut engine = engine(&scene, options(method, 1, clock));
        for size in [SIZE, [131, 77], [1, 1], [0, 3]] {
            let mut frame = Frame::new(size[0], size[1]);
            let (mut nothing, mut parts) = (0, 0);
            for number in 0..60_u64 {
                // Views stay for some frames, so all of reduced, stale, refined and unchanged occur.
                let scene = turned(&scene, number / 15);
                let budget = match number % 15 {
                    3 => first_image_at(2),
                    5 => Budget::Work(40_000),
                    12.. => Budget::Unlimited,
                    _ => Budget::Millis(0.6),
                };
                let before = frame.pixels().to_vec();
                let stats = engine.render(&scene, budget, &mut frame);
                let what = format!("{method}, {size:?}, frame {number}");
                assert_covers(&engine, &stats, &before, &frame, &what);
                let pixels = u64::from(size[0]) * u64::from(size[1]);
                nothing += usize::from(engine.changed().is_empty());
                parts += usize::from((1..pixels).contains(&stats.pixels_written));
            }
            assert!(
                nothing > 4,
                "{method}, {size:?}: final images change nothing"
            );
            assert!(
                parts > 0 || size != SIZE || us < 10.0,
                "{method}: {parts} frames changed a part"
            );
        }
    }
}

#[test]
fn a_frame_too_large_to_be_rendered_is_not_changed() {
    let scene = mixed();
    let mut engine = timeless(&scene, Method::Gouraud);
    engine.render(&scene, Budget::Unlimited, &mut Frame::new(16, 16));
    assert!(!engine.changed().is_empty());
    engine.render(&scene, Budget::Unlimited, &mut Frame::new(20_000, 1));
    assert!(engine.changed().is_empty());
}
