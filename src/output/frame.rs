//! The image an engine renders into.

/// An 8-bit RGBA image, rows from the top, sRGB encoded, opaque.
#[derive(Clone, Debug)]
pub struct Frame {
    width: u32,
    height: u32,
    pixels: Vec<[u8; 4]>,
    stamp: Option<Stamp>,
}

/// Which backend wrote a frame last, and when by that backend's own count of images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Identity of the writer, unique in the process.
    pub writer: u64,
    /// The writer's count when it wrote.
    pub serial: u64,
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

    /// The pixels for a writer that leaves the frame marked with `stamp`.
    pub fn pixels_stamped(&mut self, stamp: Stamp) -> &mut [[u8; 4]] {
        self.stamp = Some(stamp);
        &mut self.pixels
    }
}
