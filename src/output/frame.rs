//! The image an engine renders into.

use super::Encoding;
use super::target::{ChannelOrder, PIXEL_BYTES, Stamp, Target};

/// An 8-bit RGBA image, rows from the top, opaque.
#[derive(Clone, Debug)]
pub struct Frame {
    width: u32,
    height: u32,
    pixels: Vec<[u8; 4]>,
    encoding: Encoding,
    stamp: Option<Stamp>,
}

impl Frame {
    /// A black sRGB frame of `width` x `height` pixels.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            pixels: vec![[0, 0, 0, 255]; width as usize * height as usize],
            encoding: Encoding::default(),
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

    /// How the pixels store light. An engine that renders into the frame sets it.
    #[must_use]
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// Says how the pixels store light; they stay as they are.
    pub fn set_encoding(&mut self, encoding: Encoding) {
        self.encoding = encoding;
    }

    /// Stores the same light in another encoding, to the nearest code. From linear to sRGB, dark tones come in steps.
    pub fn convert(&mut self, encoding: Encoding) {
        let from = std::mem::replace(&mut self.encoding, encoding);
        if from == encoding {
            return;
        }
        let codes: [u8; 256] =
            std::array::from_fn(|code| encoding.encode_u8(from.decode(code as f64)));
        for [r, g, b, _] in self.pixels_mut() {
            for channel in [r, g, b] {
                *channel = codes[usize::from(*channel)];
            }
        }
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
        self.write_in_order(ChannelOrder::default(), write)
    }

    /// As [`write`](Self::write), the bytes of a pixel being in another order.
    pub(crate) fn write_in_order<T>(
        &mut self,
        order: ChannelOrder,
        write: impl FnOnce(&mut Target<'_>) -> T,
    ) -> T {
        let stride = self.width as usize * PIXEL_BYTES;
        let bytes = self.pixels.as_flattened_mut();
        let mut target = Target::with_stride(bytes, self.width, self.height, stride)
            .expect("a frame has as many bytes as its size says")
            .with_order(order)
            .with_stamp(self.stamp);
        let result = write(&mut target);
        self.stamp = target.stamp();
        result
    }
}

/// Films are sRGB, and their frames have one size; else the reason why this one is no frame of it.
pub(super) fn suits_film(frame: &Frame, size: [u32; 2]) -> Result<(), String> {
    let own = [frame.width, frame.height];
    if own != size {
        return Err(format!("a frame of {own:?} pixels in a film of {size:?}"));
    }
    if frame.encoding != Encoding::Srgb {
        let encoding = frame.encoding;
        return Err(format!(
            "a frame stored as {encoding} in a film, which is srgb"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conversion_keeps_the_light_and_alpha() {
        let mut frame = Frame::new(256, 1);
        for (code, pixel) in (0..=255).zip(frame.pixels_mut()) {
            *pixel = [code, 255 - code, 7, code];
        }
        let before = frame.clone();
        frame.convert(Encoding::Srgb);
        assert_eq!(frame.pixels(), before.pixels());
        frame.convert(Encoding::Linear);
        assert_eq!(frame.encoding(), Encoding::Linear);
        // sRGB 188 is half of full light.
        assert_eq!(frame.pixels()[188], [128, 14, 1, 188]);
        assert_eq!(frame.pixels()[255], [255, 0, 1, 255]);
        frame.convert(Encoding::Srgb);
        // Bright tones come back, where the curve is flatter than a straight line.
        for (after, before) in frame.pixels().iter().zip(before.pixels()).skip(128) {
            assert_eq!(after[0], before[0]);
        }
    }
}
