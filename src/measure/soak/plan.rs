//! Which budget and which camera a frame has.

use super::SoakCalibration;
use crate::measure::bench::camera_around;
use crate::measure::sweep::SweepBudget;
use crate::scene::Camera;

/// Budgets as fractions of the way from Gouraud to Phong shading.
pub const FRACTIONS: [f64; 6] = [0.1, 0.2, 0.4, 0.6, 0.8, 1.0];

/// Budgets in milliseconds.
pub const MILLIS: [f64; 6] = [1.0, 2.0, 4.0, 8.0, 16.0, 33.0];

/// Frames of the camera's way there and back.
pub(super) const SWING_FRAMES: u64 = 400;

/// Frames of a whole turn: a tenth of a degree each.
const TURN_FRAMES: u32 = 3600;

/// The budgets of a soak, in shuffled rounds.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    budgets: Vec<SweepBudget>,
    /// Frames begun.
    frames: u64,
    random: u64,
}

impl Plan {
    /// Rounds of the budgets that such times make; they always come in the same order.
    pub(super) fn new(calibration: &SoakCalibration) -> Self {
        let fractions = FRACTIONS.map(|f| calibration.budget(f));
        let absolute = MILLIS.map(SweepBudget::from_millis);
        Self {
            budgets: [fractions, absolute].concat(),
            frames: 0,
            random: 1,
        }
    }

    /// The next frame's budget.
    pub(super) fn next_budget(&mut self) -> SweepBudget {
        let place = (self.frames % self.budgets.len() as u64) as usize;
        if place == 0 {
            self.shuffle();
        }
        self.frames += 1;
        self.budgets[place]
    }

    /// How many frames have been begun.
    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    /// Fisher and Yates' shuffle.
    fn shuffle(&mut self) {
        for left in (1..self.budgets.len()).rev() {
            let other = self.next_random() % (left as u64 + 1);
            self.budgets.swap(left, other as usize);
        }
    }

    /// Knuth's MMIX generator; the upper bits are the random ones.
    fn next_random(&mut self) -> u64 {
        self.random = self
            .random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        self.random >> 33
    }
}

/// The camera of a frame. It swings about its target, a tenth of a degree a frame and 10 degrees to either side: behind
/// some scenes there is nothing to see.
pub(super) fn swung_camera(camera: &Camera, frame: u64) -> Camera {
    let quarter = SWING_FRAMES / 4;
    // A triangle wave from 0 over `quarter` and `-quarter`, which is counted from a whole turn down.
    let phase = (frame + quarter) % SWING_FRAMES;
    let steps = phase.min(SWING_FRAMES - phase) as u32;
    let view = (steps + TURN_FRAMES - quarter as u32) % TURN_FRAMES;
    camera_around(camera, view, TURN_FRAMES)
}
