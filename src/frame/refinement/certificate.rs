//! How far each pixel of the image may be from per-pixel Phong shading: a proof, not an estimate.
//!
//! Pixels are counted by their bound in codes. Of a triangle that has not been looked at nothing is known: 255. Its
//! [bounds](crate::highlight) make a [`Claim`] that holds however it is interpolated, so it need not be made anew when the triangle is
//! subdivided; pixels whose rough terms have been evaluated have a smaller one, and those that are proved or shaded have one code: half
//! a code for what was left out, and rounding. No step of refinement raises a pixel's bound, and so the image's never grows.

use crate::highlight::Claim;

/// The bound, in codes, of what is right.
pub(super) const RIGHT: u8 = Claim::RIGHT.interpolated;

/// Covered pixels by their bound in codes.
#[derive(Clone, Debug)]
pub(super) struct Certificate {
    pixels: [u64; 256],
}

impl Default for Certificate {
    fn default() -> Self {
        Self { pixels: [0; 256] }
    }
}

impl Certificate {
    /// Begins with an image of which nothing is known.
    pub(super) fn begin(&mut self, covered_pixels: u64) {
        self.pixels = [0; 256];
        self.pixels[usize::from(u8::MAX)] = covered_pixels;
    }

    /// Notes that the bound of so many pixels has fallen from the first to the second.
    pub(super) fn lower(&mut self, [from, to]: [u8; 2], pixels: u32) {
        debug_assert!(to <= from, "a bound grows from {from} to {to}");
        let from = &mut self.pixels[usize::from(from)];
        debug_assert!(*from >= u64::from(pixels), "pixels have been counted twice");
        *from = from.saturating_sub(u64::from(pixels));
        self.pixels[usize::from(to)] += u64::from(pixels);
    }

    /// Notes that the bound of all pixels has fallen to so much.
    pub(super) fn lower_all(&mut self, to: u8) {
        let pixels = self.pixels.iter().sum();
        self.pixels = [0; 256];
        self.pixels[usize::from(to)] = pixels;
    }

    /// The greatest bound of any pixel, in codes; 0 if there is none.
    pub(super) fn most(&self) -> u8 {
        let most = self.pixels.iter().rposition(|&pixels| pixels > 0);
        most.unwrap_or_default() as u8
    }

    /// How many pixels have a bound of more than a code.
    pub(super) fn unproved_pixels(&self) -> u64 {
        self.pixels[usize::from(RIGHT) + 1..].iter().sum()
    }
}
