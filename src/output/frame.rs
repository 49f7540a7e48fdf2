//! The image an engine renders into.

use super::target::{PIXEL_BYTES, Stamp, Target};

/// An 8-bit RGBA image, rows from the top, sRGB encoded, opaque.
#[derive(Clone, Debug)]
pub struct Frame {
    width: u32,
    height: u32,
    pixels: Vec<[u8; 4]>,
    stamp: Option<Stamp>,
}

impl Frame {
    /// A black frame of `width` x `height` pixels.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            pixels: vec![[0, 0, 0, 255]; width as usize * height as usize],
            stamp: None,
        }
    }

    /// Width in pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The pixels as `[red, green, blue, alpha]`, row after row from the top.
    #[must_use]
    pub fn pixels(&self) -> &[[u8; 4]] {
        &self.pixels
    }

    /// The pixels for writing by anybody: what an engine knew of the frame's contents is void.
    pub fn pixels_mut(&mut self) -> &mut [[u8; 4]] {
        self.stamp = None;
        &mut self.pixels
    }

    /// The pixels as bytes.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.pixels.as_flattened()
    }

    /// Who wrote the frame last, unless somebody has touched it since.
    #[must_use]
    pub fn stamp(&self) -> Option<Stamp> {
        self.stamp
    }

    /// Lets `write` bring the frame up to date. What it [marks](Target::mark) the target with is what the frame holds
    /// from then on.
    pub fn write<T>(&mut self, write: impl FnOnce(&mut Target<'_>) -> T) -> T {
        let stride = self.width as usize * PIXEL_BYTES;
        let bytes = self.pixels.as_flattened_mut();
        let mut target = Target::with_stride(bytes, self.width, self.height, stride)
            .expect("a frame has as many bytes as its size says")
            .with_stamp(self.stamp);
        let result = write(&mut target);
        self.stamp = target.stamp();
        result
    }
}
