//! What time had to say about a frame.

use serde::{Deserialize, Serialize};

/// Everything about a frame that was decided by time. A frame of the same scene, after the same frames, is repeated bit for bit by
/// [`Budget::Replay`](super::Budget::Replay), on any machine and any number of threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameRecord {
    /// Whether it had a wall-clock budget.
    pub is_timed: bool,
    /// Divisor of the image's sides that a new first image was to be drawn at.
    pub divisor: u32,
    /// First images completed in the frame.
    pub images: u32,
    /// Whether a further one was begun.
    pub is_image_begun: bool,
    /// How finely triangles were divided before first images got their colours: four bits for each image, from the lowest up: the number
    /// of rounds of division in three of them, and whether the last round was taken back.
    #[serde(default)]
    pub divisions: u32,
    /// How many triangles were shaded per pixel as they got their first colours, those first that looked worst, in the first image of
    /// the frame and in those after it, of which at most one is lit; [`EVERYTHING`](Self::EVERYTHING) stands for the whole image.
    #[serde(default)]
    pub lit: [u32; 2],
    /// Steps of refinement that were admitted.
    pub steps: u64,
}

impl FrameRecord {
    /// See [`lit`](Self::lit).
    pub const EVERYTHING: u32 = u32::MAX;

    /// A timed frame that draws one first image, so much smaller and with so many triangles [lit](Self::lit), and does nothing else.
    #[must_use]
    pub fn of_first_image(divisor: u32, lit: u32) -> Self {
        Self {
            is_timed: true,
            divisor,
            images: 1,
            lit: [lit, 0],
            ..Self::default()
        }
    }
}

impl Default for FrameRecord {
    /// A frame in which nothing was done.
    fn default() -> Self {
        Self {
            is_timed: false,
            divisor: 1,
            images: 0,
            is_image_begun: false,
            divisions: 0,
            lit: [0; 2],
            steps: 0,
        }
    }
}
