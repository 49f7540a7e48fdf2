//! Memory of the caller that an image is handed over into.
//!
//! Pixels are four bytes each, in the engine's [encoding](super::Encoding) and opaque, rows from the top, a *stride* of bytes apart. So an engine
//! renders straight into what a window system, a shared memory segment or an image library offers, without a copy.
//!
//! A target says what it holds already, and pixels that are right are not written again: see [`Target::with_age`].

use crate::parallel::Exec;

/// Bytes of a pixel.
pub const PIXEL_BYTES: usize = 4;

/// Rows that one task fills.
const FILLED_ROWS: usize = 64;

/// Bytes of a row of pixels without a gap. Where that leaves `usize`, no memory is large enough for it either.
fn row_bytes(width: u32) -> usize {
    (width as usize).saturating_mul(PIXEL_BYTES)
}

/// The order of a pixel's bytes in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChannelOrder {
    /// Red, green, blue, 255.
    #[default]
    Rgba,
    /// Blue, green, red, 255: what most window systems want; as a little-endian `u32`, `0xffRRGGBB`.
    Bgra,
}

/// Why bytes cannot be a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// Rows would overlap.
    #[error(
        "rows of {width} pixels need {} bytes each, but the stride is {stride}", row_bytes(*width)
    )]
    StrideTooSmall {
        /// Pixels of a row.
        width: u32,
        /// Bytes from row to row.
        stride: usize,
    },
    /// The image does not fit.
    #[error(
        "an image of {width}x{height} pixels with a stride of {stride} bytes does not fit into {bytes} bytes"
    )]
    TooShort {
        /// Pixels of a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes from row to row.
        stride: usize,
        /// Bytes there are.
        bytes: usize,
    },
}

/// Which image somebody holds: which backend wrote it, and when by that backend's own count of images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Identity of the writer, unique in the process.
    pub writer: u64,
    /// The writer's count when it wrote.
    pub serial: u64,
}

/// Some pixels of an image, never empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// The leftmost column.
    pub x: u32,
    /// The topmost row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Memory that an image is handed over into.
///
/// ```
/// use specula::output::Target;
/// use specula::{Budget, Engine, Scene};
///
/// let scene = Scene::parse("(objects: [(shape: Teapot())])", "teapot.ron")?;
/// let mut engine = Engine::new(&scene)?;
/// // A window's buffer, 320 x 180 pixels in rows of 2048 bytes. Nothing is known about its contents.
/// let mut bytes = vec![0_u8; 2048 * 180];
/// engine.render_into(&scene, Budget::from_millis(2.0), Target::with_stride(&mut bytes, 320, 180, 2048)?);
/// // The next frame goes into the same buffer, which holds what was rendered one frame ago.
/// let target = Target::with_stride(&mut bytes, 320, 180, 2048)?.with_age(1);
/// engine.render_into(&scene, Budget::from_millis(2.0), target);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Target<'a> {
    bytes: &'a mut [u8],
    width: u32,
    height: u32,
    stride: usize,
    order: ChannelOrder,
    age: u32,
    stamp: Option<Stamp>,
}

impl<'a> Target<'a> {
    /// A target whose rows follow each other without a gap, of unknown contents.
    ///
    /// # Errors
    /// When there are too few bytes.
    pub fn new(bytes: &'a mut [u8], width: u32, height: u32) -> Result<Self, TargetError> {
        Self::with_stride(bytes, width, height, row_bytes(width))
    }

    /// A target whose rows begin `stride` bytes apart, of unknown contents. Bytes between rows are not touched.
    ///
    /// # Errors
    /// When the stride is shorter than a row, or there are too few bytes. The last row need not be followed by a gap.
    pub fn with_stride(
        bytes: &'a mut [u8],
        width: u32,
        height: u32,
        stride: usize,
    ) -> Result<Self, TargetError> {
        let row = row_bytes(width);
        if stride < row {
            return Err(TargetError::StrideTooSmall { width, stride });
        }
        // All rows but the last are a stride long; products that leave `usize` cannot fit either.
        let needed = (height as usize)
            .checked_sub(1)
            .map_or(Some(0), |rows| rows.checked_mul(stride)?.checked_add(row));
        if needed.is_none_or(|needed| needed > bytes.len()) {
            return Err(TargetError::TooShort {
                width,
                height,
                stride,
                bytes: bytes.len(),
            });
        }
        Ok(Self {
            bytes,
            width,
            height,
            stride,
            order: ChannelOrder::Rgba,
            age: 0,
            stamp: None,
        })
    }

    /// The target with its bytes in another order.
    #[must_use]
    pub fn with_order(self, order: ChannelOrder) -> Self {
        Self { order, ..self }
    }

    /// The target with what is known about its contents: `age` 0 means nothing, so that every pixel is written; `n` that
    /// it holds, untouched, what the same engine handed over `n` frames ago, in the same order of bytes. This is what
    /// window systems call the age of a buffer. With an age too great to remember every pixel is written.
    #[must_use]
    pub fn with_age(self, age: u32) -> Self {
        Self { age, ..self }
    }

    /// The target with its contents known by their stamp.
    pub(crate) fn with_stamp(self, stamp: Option<Stamp>) -> Self {
        Self { stamp, ..self }
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

    /// Bytes from the beginning of one row to that of the next.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// The order of a pixel's bytes.
    #[must_use]
    pub fn order(&self) -> ChannelOrder {
        self.order
    }

    /// The age given to [`with_age`](Self::with_age).
    #[must_use]
    pub fn age(&self) -> u32 {
        self.age
    }

    /// Which image the target holds, as far as that is known.
    #[must_use]
    pub fn stamp(&self) -> Option<Stamp> {
        self.stamp
    }

    /// For backends: which of its images the target holds, if `writer` was the last to fill it.
    #[must_use]
    pub fn serial_by(&self, writer: u64) -> Option<u64> {
        let stamp = self.stamp.filter(|stamp| stamp.writer == writer)?;
        Some(stamp.serial)
    }

    /// For backends: notes that the target now holds the image `stamp`, or one that is not known.
    pub fn mark(&mut self, stamp: Option<Stamp>) {
        self.stamp = stamp;
    }

    /// All of its pixels; `None` when it has none.
    #[must_use]
    pub fn rect(&self) -> Option<Rect> {
        let whole = Rect {
            x: 0,
            y: 0,
            width: self.width,
            height: self.height,
        };
        (self.width > 0 && self.height > 0).then_some(whole)
    }

    /// Gives all pixels one colour, in the target's order of bytes. What it holds is nobody's image then.
    pub fn fill(&mut self, exec: Exec, colour: [u8; 4]) {
        self.stamp = None;
        let (width, stride) = (row_bytes(self.width), self.stride);
        if self.rect().is_none() {
            return;
        }
        let size = stride.saturating_mul(FILLED_ROWS);
        let rows = self.height as usize;
        exec.for_each_chunk(self.bytes, size, |task, band| {
            let left = rows.saturating_sub(task * FILLED_ROWS);
            for row in band.chunks_mut(stride).take(left) {
                let (pixels, _) = row[..width].as_chunks_mut();
                pixels.fill(colour);
            }
        });
    }

    /// For backends: all bytes. Row `y` begins at `y * stride`.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_needs_room_for_its_rows_and_no_more() {
        let mut bytes = [0; 100];
        // Two rows of three pixels, 40 bytes apart: 52 bytes.
        assert!(Target::with_stride(&mut bytes[..52], 3, 2, 40).is_ok());
        assert_eq!(
            Target::with_stride(&mut bytes[..51], 3, 2, 40)
                .expect_err("a byte is missing")
                .to_string(),
            "an image of 3x2 pixels with a stride of 40 bytes does not fit into 51 bytes"
        );
        assert_eq!(
            Target::with_stride(&mut bytes, 3, 2, 11)
                .expect_err("rows would overlap")
                .to_string(),
            "rows of 3 pixels need 12 bytes each, but the stride is 11"
        );
        assert!(Target::new(&mut [], 0, 0).is_ok() && Target::new(&mut [], 5, 0).is_ok());
        assert!(Target::with_stride(&mut bytes, 1, u32::MAX, usize::MAX / 2).is_err());
        assert!(Target::new(&mut bytes, u32::MAX, u32::MAX).is_err());
    }
}
