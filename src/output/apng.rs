//! Films as animated PNG files (APNG), which browsers show and which repeat for ever.
//!
//! One frame is in memory at a time. The number of frames stands at the start of the file, so it must be known
//! beforehand. The file appears whole or not at all, as with [`png`](super::png).

use super::frame::{Frame, suits_film};
use super::png::{SaveError, Scratch, encode_error};
use super::timing::Timing;
use std::fs::File;
use std::path::{Path, PathBuf};

/// An animated PNG file being written.
pub struct ApngWriter {
    path: PathBuf,
    scratch: Scratch,
    /// It writes each chunk of the file in a few pieces; one chunk is a whole frame.
    writer: png::Writer<File>,
    size: [u32; 2],
    /// The pixels of one frame without alpha.
    rgb: Vec<u8>,
}

impl ApngWriter {
    /// Starts a film of `timing`'s frames, each of `width` x `height` pixels.
    ///
    /// # Errors
    /// When the file cannot be written, or the frames have no pixels.
    pub fn create(
        path: impl AsRef<Path>,
        width: u32,
        height: u32,
        timing: &Timing,
    ) -> Result<Self, SaveError> {
        let path = path.as_ref();
        let (scratch, file) = Scratch::beside(path)?;
        let writer = header(file, width, height, timing).map_err(|e| encode_error(path, e))?;
        Ok(Self {
            path: path.to_owned(),
            scratch,
            writer,
            size: [width, height],
            rgb: Vec::with_capacity(width as usize * height as usize * 3),
        })
    }

    /// Adds an sRGB frame; its alpha is left out.
    ///
    /// # Errors
    /// When the file cannot be written, the frame is not of the film's size or not sRGB, or it is one too many.
    pub fn write(&mut self, frame: &Frame) -> Result<(), SaveError> {
        suits_film(frame, self.size).map_err(|reason| SaveError::Encode {
            path: self.path.clone(),
            reason,
        })?;
        self.rgb.clear();
        self.rgb
            .extend(frame.pixels().iter().flat_map(|&[r, g, b, _]| [r, g, b]));
        self.writer
            .write_image_data(&self.rgb)
            .map_err(|error| encode_error(&self.path, error))
    }

    /// Completes the file and gives it its name.
    ///
    /// # Errors
    /// When the file cannot be written, or frames are missing.
    pub fn finish(self) -> Result<(), SaveError> {
        self.writer
            .finish()
            .map_err(|error| encode_error(&self.path, error))?;
        self.scratch.rename_to(&self.path)
    }
}

impl std::fmt::Debug for ApngWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ApngWriter")
            .field("path", &self.path)
            .field("size", &self.size)
            .finish_non_exhaustive()
    }
}

/// Writes what comes before the frames.
fn header(
    file: File,
    width: u32,
    height: u32,
    timing: &Timing,
) -> Result<png::Writer<File>, png::EncodingError> {
    let mut encoder = png::Encoder::new(file, width, height);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    // Finishing with frames missing is an error.
    encoder.validate_sequence(true);
    const FOR_EVER: u32 = 0;
    encoder.set_animated(timing.frames(), FOR_EVER)?;
    let (numerator, denominator) = timing.rate().delay();
    encoder.set_frame_delay(numerator, denominator)?;
    encoder.write_header()
}
