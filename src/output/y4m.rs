//! Films as YUV4MPEG2 streams (`.y4m`): raw video that encoders and players read from a pipe.
//!
//! A line of text, then for each frame the line `FRAME` and three planes of bytes, Y', Cb and Cr, each as large as the
//! image (4:4:4), so that no size is odd. Values are in the limited range of video (ITU-R BT.601 section 2.5, BT.709
//! items 3 and 4): with R', G', B' the encoded colour in 0 to 255 and K the weights of luma,
//!
//! ```text
//! L  = Kr R' + Kg G' + Kb B'
//! Y' =  16 + 219 L / 255
//! Cb = 128 + 112 (B' - L) / (255 (1 - Kb))
//! Cr = 128 + 112 (R' - L) / (255 (1 - Kr))
//! ```
//!
//! rounded to the nearest, in integers, hence exactly. The weights have four decimals, so everything is multiplied by
//! 10,000. The format cannot say which weights were used. Players go by the size (mpv does): BT.709's from 1280
//! pixels of width or 577 of height on, BT.601's below; so does this module. `ffmpeg` has to be told when it makes RGB of
//! a large film (`-colorspace bt709`).

use super::frame::{Frame, suits_film};
use super::png::{SaveError, Scratch, io_error};
use super::timing::Timing;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Weights of luma.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Matrix {
    /// ITU-R BT.601, for standard definition.
    Bt601,
    /// ITU-R BT.709, for high definition.
    Bt709,
}

impl Matrix {
    /// The weights that players assume for a film of this size.
    #[must_use]
    pub fn for_size(width: u32, height: u32) -> Self {
        if width >= 1280 || height > 576 {
            Self::Bt709
        } else {
            Self::Bt601
        }
    }
}

/// A YUV4MPEG2 stream being written.
#[derive(Debug)]
pub struct Y4mWriter<W> {
    writer: W,
    size: [u32; 2],
    matrix: Matrix,
    /// One frame as it is written.
    buffer: Vec<u8>,
}

/// What each frame starts with.
const FRAME_HEADER: &[u8] = b"FRAME\n";

impl<W: Write> Y4mWriter<W> {
    /// Starts a film of frames of `width` x `height` pixels. Their number is not stored.
    ///
    /// # Errors
    /// What the writer says.
    pub fn new(mut writer: W, width: u32, height: u32, timing: &Timing) -> io::Result<Self> {
        let rate = timing.rate();
        writeln!(
            writer,
            "YUV4MPEG2 W{width} H{height} F{}:{} Ip A1:1 C444 XYSCSS=444 XCOLORRANGE=LIMITED",
            rate.numerator(),
            rate.denominator()
        )?;
        let pixels = width as usize * height as usize;
        let mut buffer = Vec::with_capacity(FRAME_HEADER.len() + 3 * pixels);
        buffer.extend_from_slice(FRAME_HEADER);
        buffer.resize(FRAME_HEADER.len() + 3 * pixels, 0);
        Ok(Self {
            writer,
            size: [width, height],
            matrix: Matrix::for_size(width, height),
            buffer,
        })
    }

    /// Adds an sRGB frame; its alpha is left out.
    ///
    /// # Errors
    /// What the writer says, and when the frame is not of the film's size or not sRGB.
    pub fn write(&mut self, frame: &Frame) -> io::Result<()> {
        suits_film(frame, self.size)
            .map_err(|reason| io::Error::new(io::ErrorKind::InvalidInput, reason))?;
        let planes = &mut self.buffer[FRAME_HEADER.len()..];
        match self.matrix {
            Matrix::Bt601 => convert::<2990, 1140>(frame.pixels(), planes),
            Matrix::Bt709 => convert::<2126, 722>(frame.pixels(), planes),
        }
        self.writer.write_all(&self.buffer)?;
        self.writer.flush()
    }
}

/// Weights and colours are multiplied by this.
const SCALE: i32 = 10_000;

/// Writes the Y', Cb and Cr planes of `pixels`, the weights of red and blue being `KR` and `KB` ten-thousandths.
fn convert<const KR: i32, const KB: i32>(pixels: &[[u8; 4]], planes: &mut [u8]) {
    let (luma, chroma) = planes.split_at_mut(pixels.len());
    let (blue, red) = chroma.split_at_mut(pixels.len());
    for (((&[r, g, b, _], y), cb), cr) in pixels.iter().zip(luma).zip(blue).zip(red) {
        let [r, g, b] = [r, g, b].map(i32::from);
        let l = KR * r + (SCALE - KR - KB) * g + KB * b;
        *y = (16 + nearest(219 * l, 255 * SCALE)) as u8;
        *cb = (128 + nearest(112 * (SCALE * b - l), 255 * (SCALE - KB))) as u8;
        *cr = (128 + nearest(112 * (SCALE * r - l), 255 * (SCALE - KR))) as u8;
    }
}

/// `dividend / divisor` rounded to the nearest, halves away from zero. The divisor is a positive constant; twice the
/// dividend is at most 219 * 255 * `SCALE` * 2, which 32 bits hold.
#[inline(always)]
fn nearest(dividend: i32, divisor: i32) -> i32 {
    (2 * dividend + dividend.signum() * divisor) / (2 * divisor)
}

/// A YUV4MPEG2 file being written, which appears whole or not at all.
#[derive(Debug)]
pub struct Y4mFile {
    path: PathBuf,
    scratch: Scratch,
    stream: Y4mWriter<File>,
}

impl Y4mFile {
    /// Starts a film of frames of `width` x `height` pixels.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn create(
        path: impl AsRef<Path>,
        width: u32,
        height: u32,
        timing: &Timing,
    ) -> Result<Self, SaveError> {
        let path = path.as_ref();
        let (scratch, file) = Scratch::beside(path)?;
        let stream =
            Y4mWriter::new(file, width, height, timing).map_err(|error| io_error(path, error))?;
        Ok(Self {
            path: path.to_owned(),
            scratch,
            stream,
        })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// When the file cannot be written, or the frame is not of the film's size.
    pub fn write(&mut self, frame: &Frame) -> Result<(), SaveError> {
        self.stream
            .write(frame)
            .map_err(|error| io_error(&self.path, error))
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// When it cannot be renamed.
    pub fn finish(self) -> Result<(), SaveError> {
        drop(self.stream);
        self.scratch.rename_to(&self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Y', Cb and Cr by the definition, not rounded.
    fn reference([r, g, b]: [u8; 3], [kr, kb]: [f64; 2]) -> [f64; 3] {
        let [r, g, b] = [r, g, b].map(|c| f64::from(c) / 255.0);
        let l = kr * r + (1.0 - kr - kb) * g + kb * b;
        [
            16.0 + 219.0 * l,
            128.0 + 224.0 * (b - l) / (2.0 * (1.0 - kb)),
            128.0 + 224.0 * (r - l) / (2.0 * (1.0 - kr)),
        ]
    }

    #[test]
    fn planes_are_the_definition_rounded_to_the_nearest() {
        // A grid over the cube of colours, its corners included.
        let steps: Vec<u8> = (0..=255).step_by(5).collect();
        let pixels: Vec<[u8; 4]> = steps
            .iter()
            .flat_map(|&r| steps.iter().map(move |&g| (r, g)))
            .flat_map(|(r, g)| steps.iter().map(move |&b| [r, g, b, 255]))
            .collect();
        let n = pixels.len();
        let check = |convert: fn(&[[u8; 4]], &mut [u8]), weights: [f64; 2]| {
            let mut planes = vec![0; 3 * n];
            convert(&pixels, &mut planes);
            for (i, &[r, g, b, _]) in pixels.iter().enumerate() {
                let expected = reference([r, g, b], weights);
                for (plane, exact) in expected.into_iter().enumerate() {
                    let off = f64::from(planes[plane * n + i]) - exact;
                    assert!(
                        off.abs() <= 0.5 + 1e-9,
                        "{:?} plane {plane}: {off}",
                        [r, g, b]
                    );
                }
            }
            // The ends of the range are reached: black and white, and the purest blue and red.
            let [y, cb, cr] = [0, 1, 2].map(|p| &planes[p * n..][..n]);
            for (plane, low, high) in [(y, 16, 235), (cb, 16, 240), (cr, 16, 240)] {
                let range = (plane.iter().min(), plane.iter().max());
                assert_eq!(range, (Some(&low), Some(&high)));
            }
        };
        check(convert::<2990, 1140>, [0.299, 0.114]);
        check(convert::<2126, 722>, [0.2126, 0.0722]);
    }

    #[test]
    fn players_guess_the_matrix_by_the_size() {
        for (size, matrix) in [
            ((720, 576), Matrix::Bt601),
            ((1279, 1), Matrix::Bt601),
            ((1280, 1), Matrix::Bt709),
            ((1, 577), Matrix::Bt709),
        ] {
            assert_eq!(Matrix::for_size(size.0, size.1), matrix, "{size:?}");
        }
    }

    #[test]
    fn frames_of_another_size_are_refused() {
        let mut writer = Y4mWriter::new(Vec::new(), 3, 2, &Timing::default()).expect("memory");
        let start = writer.writer.len();
        assert!(writer.write(&Frame::new(2, 3)).is_err());
        assert_eq!(writer.writer.len(), start);
        writer.write(&Frame::new(3, 2)).expect("memory");
        let black = [&[16; 6][..], &[128; 12]].concat();
        assert_eq!(writer.writer[start..], [FRAME_HEADER, &black].concat());
    }
}
