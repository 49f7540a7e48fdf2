//! Frames as PNG files.
//!
//! A file appears whole or not at all: the image is written to a new file beside the destination, which then takes the
//! destination's name in one step. Whatever fails, nothing half-written stays, and an older image under that name is
//! kept.

use super::{Encoding, Frame};
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Why an image could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SaveError {
    /// The file system refused.
    #[error("cannot write {}: {}", path.display(), plain_reason(error))]
    Io {
        /// The destination.
        path: PathBuf,
        /// What it said.
        error: io::Error,
    },
    /// The PNG format cannot hold the image.
    #[error("cannot write {}: {reason}", path.display())]
    Encode {
        /// The destination.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

/// What an I/O error says, without the operating system's number for it.
#[must_use]
pub fn plain_reason(error: &io::Error) -> String {
    let text = error.to_string();
    match text.find(" (os error ") {
        Some(end) => text[..end].to_owned(),
        None => text,
    }
}

impl Frame {
    /// Writes the frame as an 8-bit PNG file, whole or not at all: RGB if every pixel is opaque, else RGBA. The file says
    /// what the frame's [encoding](Frame::encoding) is.
    ///
    /// # Errors
    /// When the file cannot be written, or the frame has no pixels.
    pub fn save_png(&self, path: impl AsRef<Path>) -> Result<(), SaveError> {
        let path = path.as_ref();
        let (scratch, file) = Scratch::beside(path)?;
        let mut writer = BufWriter::new(file);
        encode(self, &mut writer).map_err(|error| encode_error(path, error))?;
        // Dropping the writer would swallow the error of its last write.
        writer.flush().map_err(|error| io_error(path, error))?;
        drop(writer);
        scratch.rename_to(path)
    }
}

/// Finds out whether [`Frame::save_png`] to `path` can be expected to succeed, by creating a file beside it and
/// removing it again: a program had better ask before it renders for a minute.
///
/// # Errors
/// When the directory is missing or read-only, or `path` is a directory.
pub fn check_writable(path: impl AsRef<Path>) -> Result<(), SaveError> {
    let path = path.as_ref();
    if path.is_dir() {
        return Err(io_error(path, io::ErrorKind::IsADirectory.into()));
    }
    Scratch::beside(path).map(drop)
}

pub(super) fn io_error(path: &Path, error: io::Error) -> SaveError {
    SaveError::Io {
        path: path.to_owned(),
        error,
    }
}

pub(super) fn encode_error(path: &Path, error: png::EncodingError) -> SaveError {
    match error {
        png::EncodingError::IoError(error) => io_error(path, error),
        other => SaveError::Encode {
            path: path.to_owned(),
            reason: other.to_string(),
        },
    }
}

/// Encodes `frame` to the end of the PNG stream.
fn encode(frame: &Frame, writer: impl Write) -> Result<(), png::EncodingError> {
    let opaque = frame.pixels().iter().all(|pixel| pixel[3] == 255);
    let mut encoder = png::Encoder::new(writer, frame.width(), frame.height());
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_color(if opaque {
        png::ColorType::Rgb
    } else {
        png::ColorType::Rgba
    });
    match frame.encoding() {
        Encoding::Srgb => encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual),
        Encoding::Linear => {
            encoder.set_source_gamma(png::ScaledFloat::new(1.0));
            encoder.set_source_chromaticities(srgb_chromaticities());
        }
    }
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;
    if opaque {
        let mut row = Vec::with_capacity(frame.width() as usize * 3);
        for pixels in frame.pixels().chunks_exact(frame.width() as usize) {
            row.clear();
            row.extend(pixels.iter().flat_map(|&[r, g, b, _]| [r, g, b]));
            stream.write_all(&row)?;
        }
    } else {
        stream.write_all(frame.as_bytes())?;
    }
    stream.finish()?;
    writer.finish()
}

/// White and the primaries of sRGB (ITU-R BT.709), which a file without the chunk for sRGB has to give.
fn srgb_chromaticities() -> png::SourceChromaticities {
    png::SourceChromaticities::new((0.3127, 0.329), (0.64, 0.33), (0.3, 0.6), (0.15, 0.06))
}

/// A file that is removed again unless it is renamed.
#[derive(Debug)]
pub(super) struct Scratch {
    path: PathBuf,
    keep: bool,
}

impl Scratch {
    /// A new file in the directory of `path`.
    pub(super) fn beside(path: &Path) -> Result<(Self, File), SaveError> {
        /// Tells apart the files of threads that write to the same destination at once.
        static SERIAL: AtomicU64 = AtomicU64::new(0);
        let Some(name) = path.file_name() else {
            let error = io::Error::new(io::ErrorKind::InvalidInput, "it names no file");
            return Err(io_error(path, error));
        };
        let mut scratch_name = std::ffi::OsString::from(".");
        scratch_name.push(name);
        let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
        scratch_name.push(format!(".{}-{serial}.tmp", std::process::id()));
        let scratch = path.with_file_name(scratch_name);
        let file = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&scratch)
            .map_err(|error| io_error(path, error))?;
        Ok((
            Self {
                path: scratch,
                keep: false,
            },
            file,
        ))
    }

    /// Gives the file its final name, in place of whatever had it.
    pub(super) fn rename_to(mut self, path: &Path) -> Result<(), SaveError> {
        fs::rename(&self.path, path).map_err(|error| io_error(path, error))?;
        self.keep = true;
        Ok(())
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        if !self.keep {
            // There is nobody to tell when even that fails, and the caller already has an error.
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient(width: u32, height: u32) -> Frame {
        let mut frame = Frame::new(width, height);
        for (i, pixel) in frame.pixels_mut().iter_mut().enumerate() {
            *pixel = [i as u8, (i / 3) as u8, 200, 255];
        }
        frame
    }

    fn files_in(directory: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(directory)
            .expect("the directory is there")
            .map(|entry| {
                entry
                    .expect("readable")
                    .file_name()
                    .to_string_lossy()
                    .into()
            })
            .collect();
        names.sort();
        names
    }

    fn read(path: &Path) -> (png::OutputInfo, bool, Vec<u8>) {
        let file = io::BufReader::new(File::open(path).expect("written"));
        let mut reader = png::Decoder::new(file).read_info().expect("a PNG file");
        let is_srgb = reader.info().srgb.is_some();
        let mut pixels = vec![0; reader.output_buffer_size().expect("small")];
        let info = reader.next_frame(&mut pixels).expect("an image");
        (info, is_srgb, pixels)
    }

    #[test]
    fn what_is_written_reads_back() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("a.png");
        let mut frame = gradient(37, 11);
        frame.save_png(&path).expect("writable");
        let (info, is_srgb, pixels) = read(&path);
        assert_eq!((info.width, info.height), (37, 11));
        assert_eq!(info.color_type, png::ColorType::Rgb);
        assert!(is_srgb);
        let rgb: Vec<u8> = frame
            .pixels()
            .iter()
            .flat_map(|p| p[..3].to_vec())
            .collect();
        assert_eq!(pixels, rgb);

        // Over the older file, now with a transparent pixel.
        frame.pixels_mut()[5][3] = 7;
        frame.save_png(&path).expect("writable");
        let (info, _, pixels) = read(&path);
        assert_eq!(info.color_type, png::ColorType::Rgba);
        assert_eq!(pixels, frame.as_bytes());
        assert_eq!(files_in(directory.path()), ["a.png"]);
    }

    #[test]
    fn a_file_says_how_its_light_is_stored() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("a.png");
        let mut frame = gradient(5, 3);
        for (encoding, is_srgb) in [(Encoding::Srgb, true), (Encoding::Linear, false)] {
            frame.set_encoding(encoding);
            frame.save_png(&path).expect("writable");
            let file = io::BufReader::new(File::open(&path).expect("written"));
            let reader = png::Decoder::new(file).read_info().expect("a PNG file");
            let info = reader.info();
            assert_eq!(info.srgb.is_some(), is_srgb);
            if !is_srgb {
                assert_eq!(info.gama_chunk, Some(png::ScaledFloat::new(1.0)));
                assert_eq!(info.chrm_chunk, Some(srgb_chromaticities()));
            }
        }
    }

    #[test]
    fn failures_say_where_and_leave_nothing_behind() {
        let directory = tempfile::tempdir().expect("a directory");
        let missing = directory.path().join("missing").join("x.png");
        let message = format!(
            "cannot write {}: No such file or directory",
            missing.display()
        );
        for result in [gradient(2, 2).save_png(&missing), check_writable(&missing)] {
            assert_eq!(result.map_err(|e| e.to_string()), Err(message.clone()));
        }

        let taken = directory.path().join("taken.png");
        fs::create_dir(&taken).expect("writable");
        assert!(gradient(2, 2).save_png(&taken).is_err());
        assert!(check_writable(&taken).is_err());
        assert!(gradient(2, 2).save_png("/").is_err());

        let empty = directory.path().join("empty.png");
        assert!(matches!(
            Frame::new(0, 3).save_png(&empty),
            Err(SaveError::Encode { .. })
        ));
        check_writable(&empty).expect("writable");
        assert_eq!(files_in(directory.path()), ["taken.png"]);
    }
}
