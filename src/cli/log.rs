//! Logs of timed runs: `render --record` writes one, `render --replay` repeats it bit for bit.
//!
//! A log holds what a run was asked for, and of each frame what time decided, with a checksum of the image. So a replay knows whether it
//! shows the same.

use super::Failure;
use serde::{Deserialize, Serialize};
use specula::output::{Frame, save_whole};
use specula::schedule::FrameRecord;
use std::path::Path;

/// The version of the format.
const VERSION: u32 = 1;

/// Longest log that is read: some hundred thousand frames.
const MOST_BYTES: u64 = 1 << 26;

/// A run.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Log {
    pub(super) specula_log: u32,
    /// What the scene is called, for people.
    pub(super) scene: String,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) method: String,
    pub(super) backend: String,
    pub(super) encoding: String,
    /// Seconds into the scene's animation.
    pub(super) time_s: Option<f64>,
    /// Whether the engine was warmed up.
    pub(super) is_warmed_up: bool,
    pub(super) frames: Vec<LoggedFrame>,
}

/// A frame of a run.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LoggedFrame {
    /// What time decided.
    pub(super) record: FrameRecord,
    /// For people: how long the frame took.
    pub(super) frame_ms: f64,
    /// For people: how far it came.
    pub(super) outcome: String,
    /// FNV-1a of the pixels, in hexadecimal.
    pub(super) image: String,
}

impl Log {
    /// A log without frames.
    pub(super) fn new(scene: String, [width, height]: [u32; 2]) -> Self {
        Self {
            specula_log: VERSION,
            scene,
            width,
            height,
            method: String::new(),
            backend: String::new(),
            encoding: String::new(),
            time_s: None,
            is_warmed_up: false,
            frames: Vec::new(),
        }
    }

    /// Reads a log.
    pub(super) fn load(path: &Path) -> Result<Self, Failure> {
        let name = path.display();
        let cannot =
            |error: std::io::Error| Failure::runtime(format!("cannot read '{name}': {error}"));
        let length = std::fs::metadata(path).map_err(cannot)?.len();
        if length > MOST_BYTES {
            return Err(Failure::input(format!(
                "{name}: a log has at most {MOST_BYTES} bytes, not {length}"
            )));
        }
        let text = std::fs::read_to_string(path).map_err(cannot)?;
        let log: Self = serde_json::from_str(&text).map_err(|error| {
            let (line, column) = (error.line(), error.column());
            let text = error.to_string();
            let what = text.split(" at line ").next().unwrap_or_default();
            Failure::input(format!(
                "{name}:{line}:{column}: this is no log of a run: {what}"
            ))
        })?;
        if log.specula_log != VERSION {
            return Err(Failure::input(format!(
                "{name}: a log of version {}, and this program reads version {VERSION}",
                log.specula_log
            )));
        }
        if log.frames.is_empty() {
            return Err(Failure::input(format!("{name}: a log without frames")));
        }
        Ok(log)
    }

    /// Writes the log, as a whole or not at all.
    pub(super) fn save(&self, path: &Path) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(self)
            .map_err(|error| Failure::runtime(format!("cannot write the log: {error}")))?;
        Ok(save_whole(path, text + "\n")?)
    }
}

/// The checksum of an image: 64-bit FNV-1a (Fowler, Noll and Vo) of its bytes, in hexadecimal.
pub(super) fn checksum(frame: &Frame) -> String {
    let hash = frame
        .as_bytes()
        .iter()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_tell_images_apart() {
        let mut frame = Frame::new(3, 2);
        let black = checksum(&frame);
        frame.pixels_mut()[4][1] = 1;
        assert_ne!(checksum(&frame), black);
        // The published value of nothing at all.
        assert_eq!(checksum(&Frame::new(0, 0)), "cbf29ce484222325");
    }
}
