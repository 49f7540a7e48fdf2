//! Flicker: how much the error of a moving image changes from frame to frame.
//!
//! An error that stays is seen as a slightly different surface, one that comes and goes as a flicker. With `e` the image less
//! its reference, in 8-bit codes with their signs, the **flicker** between two frames is the root mean square of
//! `e_now - e_before` over all channels of the pixels that the scene covers in both. What changes in both image and reference,
//! because something moves, is no flicker.

use super::metrics::{Mismatch, check_same_kind};
use super::{ReferenceImage, metrics::ratio};
use crate::output::Frame;

/// The flicker between two frames, each an image with its own reference, in codes; zero where no pixel is covered in both.
/// Pixels that are [grazing](ReferenceImage::grazing) in either are left out.
///
/// # Errors
/// When the sizes or the encodings differ.
pub fn flicker(
    before: (&Frame, &ReferenceImage),
    now: (&Frame, &ReferenceImage),
) -> Result<f64, Mismatch> {
    for (frame, reference) in [before, now, (now.0, before.1)] {
        check_same_kind(frame, reference)?;
    }
    let is_compared = |index: usize| {
        [before.1, now.1]
            .iter()
            .all(|reference| reference.is_covered(index) && !reference.grazing[index])
    };
    let (mut squares, mut channels) = (0, 0);
    for index in (0..now.1.pixels.len()).filter(|&index| is_compared(index)) {
        for channel in 0..3 {
            let error = |(frame, reference): (&Frame, &ReferenceImage)| {
                i64::from(frame.pixels()[index][channel])
                    - i64::from(reference.pixels[index][channel])
            };
            squares += (error(now) - error(before)).pow(2).unsigned_abs();
            channels += 1;
        }
    }
    Ok(ratio(squares, channels).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::metrics::tests::{frame_of, row};
    use crate::measure::reference::NO_TRIANGLE;

    /// A reference, and an image of it that is off by `error` everywhere.
    fn image(level: u8, error: i8) -> (Frame, ReferenceImage) {
        let mut reference = row(10);
        reference.pixels.fill([level; 3]);
        let mut frame = frame_of(&reference);
        let own = level.saturating_add_signed(error);
        frame.pixels_mut().fill([own, own, own, 255]);
        (frame, reference)
    }

    fn between(before: &(Frame, ReferenceImage), now: &(Frame, ReferenceImage)) -> f64 {
        flicker((&before.0, &before.1), (&now.0, &now.1)).expect("same kind")
    }

    #[test]
    fn an_error_that_stays_does_not_flicker() {
        // The scene itself gets brighter by 50 codes.
        assert_eq!(between(&image(100, 7), &image(150, 7)), 0.0);
        assert_eq!(between(&image(100, 0), &image(150, 0)), 0.0);
    }

    #[test]
    fn an_error_that_comes_and_goes_flickers_by_its_size() {
        let (without, with) = (image(100, 0), image(110, -9));
        assert_eq!(between(&without, &with), 9.0);
        assert_eq!(between(&with, &without), 9.0);
        // Signs count: from too dark to too bright.
        assert_eq!(between(&image(100, -4), &image(100, 4)), 8.0);
        let mut partly = image(100, 0);
        partly.0.pixels_mut()[3][1] = 106;
        let expected = f64::sqrt(36.0 / 30.0);
        assert!((between(&without, &partly) - expected).abs() < 1e-12);
    }

    #[test]
    fn only_pixels_covered_in_both_frames_count() {
        let (mut before, mut now) = (image(100, 0), image(100, 0));
        for index in 0..3 {
            now.0.pixels_mut()[index] = [0, 0, 0, 255];
        }
        before.1.ids[0] = NO_TRIANGLE;
        now.1.ids[1] = NO_TRIANGLE;
        now.1.grazing[2] = true;
        assert_eq!(between(&before, &now), 0.0);
        before.1.ids.fill(NO_TRIANGLE);
        now.0.pixels_mut().fill([0; 4]);
        assert_eq!(between(&before, &now), 0.0);
    }

    #[test]
    fn frames_must_be_of_one_size() {
        let small = (frame_of(&row(3)), row(3));
        let large = image(100, 0);
        assert!(flicker((&small.0, &small.1), (&large.0, &large.1)).is_err());
    }
}
