//! How far an image is from the reference.
//!
//! Differences are taken between encoded 8-bit channels (which are close to uniform for the eye where the image is sRGB),
//! over the pixels that the scene covers: background is right by construction and would only dilute the numbers. Pixels on which the
//! illumination equation itself jumps ([`ReferenceImage::grazing`]) are left out and counted.
//!
//! With `d` ranging over all channels of all compared pixels:
//! `rmse = sqrt(mean d^2)`, `psnr_db = 20 log10(255 / rmse)`, `max = max d`, and `p99` is the smallest code that at least
//! 99 % of the channels do not exceed. A pixel is off by more than `k` codes when any of its channels is.

use super::ReferenceImage;
use crate::output::{Encoding, Frame};
use serde::{Serialize, Serializer};

/// The difference between an image and the reference, in 8-bit codes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorReport {
    /// Root mean square difference of a channel.
    pub rmse: f64,
    /// Peak signal-to-noise ratio in decibels, the peak being 255; infinite, and `null` when serialized, where images
    /// are equal.
    #[serde(serialize_with = "null_if_infinite")]
    pub psnr_db: f64,
    /// Largest difference of a channel.
    pub max: u8,
    /// The difference that 99 % of all channels do not exceed.
    pub p99: u8,
    /// Share of pixels, in `0..=1`, with a channel off by more than 1 code.
    pub share_above_1: f64,
    /// Share of pixels, in `0..=1`, with a channel off by more than 4 codes.
    pub share_above_4: f64,
    /// Pixels that the scene covers.
    pub covered_pixels: u64,
    /// Those of them that were left out of the comparison.
    pub excluded_pixels: u64,
}

fn null_if_infinite<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    value.is_finite().then_some(*value).serialize(serializer)
}

/// Why an image and a reference cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Mismatch {
    /// They have different sizes.
    #[error("an image of {}x{} pixels cannot be compared with a reference of {}x{}", frame[0], frame[1], reference[0], reference[1])]
    Size {
        /// Width and height of the image.
        frame: [u32; 2],
        /// Width and height of the reference.
        reference: [u32; 2],
    },
    /// They store light differently, so that their codes mean different things.
    #[error("an image stored as {frame} cannot be compared with a reference stored as {reference}")]
    Encoding {
        /// That of the image.
        frame: Encoding,
        /// That of the reference.
        reference: Encoding,
    },
}

impl ErrorReport {
    /// Compares `frame` with the reference, over the pixels that the scene covers.
    ///
    /// # Errors
    /// When the sizes or the encodings differ.
    pub fn compare(frame: &Frame, reference: &ReferenceImage) -> Result<Self, Mismatch> {
        check_same_kind(frame, reference)?;
        Ok(Self::of_same_kind(frame, reference))
    }

    /// [`compare`](Self::compare) of images that are known to have the same size and encoding.
    pub(super) fn of_same_kind(frame: &Frame, reference: &ReferenceImage) -> Self {
        let mut histogram = ErrorHistogram::default();
        histogram.add_image(frame, reference);
        histogram.report()
    }
}

/// Whether `frame` can be compared with `reference`.
pub(super) fn check_same_kind(frame: &Frame, reference: &ReferenceImage) -> Result<(), Mismatch> {
    let [own, other] = [
        [frame.width(), frame.height()],
        [reference.width, reference.height],
    ];
    if own != other {
        return Err(Mismatch::Size {
            frame: own,
            reference: other,
        });
    }
    let [own, other] = [frame.encoding(), reference.encoding];
    if own != other {
        return Err(Mismatch::Encoding {
            frame: own,
            reference: other,
        });
    }
    Ok(())
}

/// Collects differences pixel by pixel, in constant memory.
#[derive(Clone, Debug)]
pub struct ErrorHistogram {
    /// How many channels differ by how much.
    channels: [u64; 256],
    /// How many pixels differ by how much in their worst channel.
    pixels: [u64; 256],
    excluded: u64,
}

impl Default for ErrorHistogram {
    fn default() -> Self {
        Self {
            channels: [0; 256],
            pixels: [0; 256],
            excluded: 0,
        }
    }
}

impl ErrorHistogram {
    /// Adds all pixels of an image of the reference's size and encoding that the scene covers.
    pub(super) fn add_image(&mut self, frame: &Frame, reference: &ReferenceImage) {
        debug_assert_eq!(frame.pixels().len(), reference.pixels.len(), "sizes differ");
        debug_assert_eq!(frame.encoding(), reference.encoding, "encodings differ");
        for (index, &[r, g, b, _]) in frame.pixels().iter().enumerate() {
            if !reference.is_covered(index) {
                continue;
            }
            if reference.grazing[index] {
                self.exclude();
            } else {
                self.add([r, g, b], reference.pixels[index]);
            }
        }
    }

    /// Adds a covered pixel.
    pub fn add(&mut self, image: [u8; 3], reference: [u8; 3]) {
        let differences: [u8; 3] = std::array::from_fn(|c| image[c].abs_diff(reference[c]));
        let mut worst = 0;
        for difference in differences {
            self.channels[usize::from(difference)] += 1;
            worst = worst.max(difference);
        }
        self.pixels[usize::from(worst)] += 1;
    }

    /// Counts a covered pixel that is not compared.
    pub fn exclude(&mut self) {
        self.excluded += 1;
    }

    /// What was collected; images without a compared pixel are equal.
    #[must_use]
    pub fn report(&self) -> ErrorReport {
        let compared: u64 = self.pixels.iter().sum();
        let channels: u64 = self.channels.iter().sum();
        let squares: u64 = (0u64..)
            .zip(&self.channels)
            .map(|(difference, count)| difference * difference * count)
            .sum();
        let mean_square = ratio(squares, channels);
        let above = |code: usize| ratio(self.pixels[code + 1..].iter().sum(), compared);
        ErrorReport {
            rmse: mean_square.sqrt(),
            psnr_db: if squares == 0 {
                f64::INFINITY
            } else {
                10.0 * (255.0 * 255.0 / mean_square).log10()
            },
            max: (0..=255)
                .rev()
                .find(|&code| self.channels[usize::from(code)] > 0)
                .unwrap_or(0),
            p99: self.percentile_99(channels),
            share_above_1: above(1),
            share_above_4: above(4),
            covered_pixels: compared + self.excluded,
            excluded_pixels: self.excluded,
        }
    }

    /// The smallest code that at least 99 % of `total` channels do not exceed.
    fn percentile_99(&self, total: u64) -> u8 {
        let mut below = 0;
        for (code, count) in (0..=255).zip(&self.channels) {
            below += count;
            if below * 100 >= total * 99 {
                return code;
            }
        }
        255
    }
}

/// `part / whole`, or zero when there is no whole.
pub(super) fn ratio(part: u64, whole: u64) -> f64 {
    if whole == 0 {
        0.0
    } else {
        part as f64 / whole as f64
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::measure::reference::NO_TRIANGLE;

    /// A reference of `width` covered pixels in one row, all of colour (100, 100, 100).
    pub(in crate::measure) fn row(width: u32) -> ReferenceImage {
        let len = width as usize;
        ReferenceImage {
            width,
            height: 1,
            ids: vec![0; len],
            encoding: Encoding::Srgb,
            pixels: vec![[100; 3]; len],
            codes: vec![[100.0; 3]; len],
            grazing: vec![false; len],
        }
    }

    pub(in crate::measure) fn frame_of(reference: &ReferenceImage) -> Frame {
        let mut frame = Frame::new(reference.width, reference.height);
        for (pixel, &[r, g, b]) in frame.pixels_mut().iter_mut().zip(&reference.pixels) {
            *pixel = [r, g, b, 255];
        }
        frame
    }

    #[test]
    fn equal_images_have_no_error() {
        let reference = row(10);
        let report = ErrorReport::compare(&frame_of(&reference), &reference).expect("same size");
        assert_eq!((report.rmse, report.max, report.p99), (0.0, 0, 0));
        assert_eq!((report.share_above_1, report.share_above_4), (0.0, 0.0));
        assert_eq!(report.psnr_db, f64::INFINITY);
        assert_eq!((report.covered_pixels, report.excluded_pixels), (10, 0));
        let json = serde_json::to_value(report).expect("plain numbers");
        assert!(json["psnr_db"].is_null() && json["rmse"] == 0.0, "{json}");
    }

    #[test]
    fn known_differences_give_known_numbers() {
        let reference = row(10);
        let mut frame = frame_of(&reference);
        // Differences: one channel by 6, one by 2, both signs; a pixel by 1, which is not above 1.
        frame.pixels_mut()[0][1] = 106;
        frame.pixels_mut()[3][2] = 98;
        frame.pixels_mut()[7][0] = 101;
        let report = ErrorReport::compare(&frame, &reference).expect("same size");
        let mean_square = (36.0 + 4.0 + 1.0) / 30.0;
        assert!((report.rmse - f64::sqrt(mean_square)).abs() < 1e-12);
        let psnr = 20.0 * (255.0 / f64::sqrt(mean_square)).log10();
        assert!((report.psnr_db - psnr).abs() < 1e-9);
        assert_eq!((report.max, report.p99), (6, 6));
        assert_eq!((report.share_above_1, report.share_above_4), (0.2, 0.1));
    }

    #[test]
    fn p99_leaves_out_the_worst_hundredth() {
        let reference = row(100);
        let mut frame = frame_of(&reference);
        // 3 of 300 channels is exactly a hundredth; a fourth is more.
        frame.pixels_mut()[0] = [110, 110, 110, 255];
        let report = ErrorReport::compare(&frame, &reference).expect("same size");
        assert_eq!((report.max, report.p99), (10, 0));
        frame.pixels_mut()[1][0] = 103;
        let report = ErrorReport::compare(&frame, &reference).expect("same size");
        assert_eq!((report.max, report.p99), (10, 3));
    }

    #[test]
    fn background_and_grazing_pixels_do_not_count() {
        let mut reference = row(4);
        reference.ids[1] = NO_TRIANGLE;
        reference.grazing[2] = true;
        let mut frame = frame_of(&reference);
        frame.pixels_mut()[1] = [0, 0, 0, 255];
        frame.pixels_mut()[2] = [0, 0, 0, 255];
        let report = ErrorReport::compare(&frame, &reference).expect("same size");
        assert_eq!(report.rmse, 0.0);
        assert_eq!((report.covered_pixels, report.excluded_pixels), (3, 1));
        frame.pixels_mut()[0] = [0, 0, 0, 255];
        let report = ErrorReport::compare(&frame, &reference).expect("same size");
        assert_eq!((report.max, report.share_above_4), (100, 0.5));
    }

    #[test]
    fn encodings_must_agree() {
        let mut frame = frame_of(&row(3));
        frame.set_encoding(Encoding::Linear);
        let error = ErrorReport::compare(&frame, &row(3)).expect_err("encodings differ");
        assert_eq!(
            error.to_string(),
            "an image stored as linear cannot be compared with a reference stored as srgb"
        );
    }

    #[test]
    fn sizes_must_agree() {
        let error = ErrorReport::compare(&Frame::new(2, 1), &row(3)).expect_err("sizes differ");
        assert_eq!(
            error.to_string(),
            "an image of 2x1 pixels cannot be compared with a reference of 3x1"
        );
    }
}
