//! The times that budgets are scaled by, and whether the machine was quiet enough to believe them.

use super::{LEAD_FRAMES, SweepBudget, SweepOptions};
use crate::frame::{Engine, EngineError, Method};
use crate::output::Frame;
use crate::scene::Scene;
use crate::schedule::Budget;
use serde::Serialize;

/// Gouraud and Phong shading of a view, as fast as they were measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// Median time `G` of a Gouraud-shaded frame, in milliseconds.
    pub gouraud_ms: f64,
    /// Median time `P` of a Phong-shaded frame, in milliseconds.
    pub phong_ms: f64,
    /// Distance of the quartiles of the Gouraud times, as a share of their median.
    pub gouraud_spread: f64,
    /// Distance of the quartiles of the Phong times, as a share of their median.
    pub phong_spread: f64,
    /// Error of the Gouraud-shaded image: RMSE in codes.
    pub gouraud_rmse: f64,
    /// Frames of each.
    pub frames: u32,
}

impl Calibration {
    /// The budget `G + f (P - G)`; `G` where Phong shading was not slower.
    #[must_use]
    pub fn budget(&self, fraction: f64) -> SweepBudget {
        let extra = (self.phong_ms - self.gouraud_ms).max(0.0);
        SweepBudget {
            millis: self.gouraud_ms + fraction * extra,
            fraction: Some(fraction),
        }
    }
}

/// How far times of the same work differ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Noise {
    /// The largest spread of the calibrations: distance of the quartiles as a share of the median.
    pub spread: f64,
    /// How much a median changed from the first calibration to the second, as a share of the first.
    pub drift: f64,
}

impl Noise {
    /// With quartiles farther apart, single rows say little.
    pub const MOST_SPREAD: f64 = 0.10;
    /// With medians that changed more, the budgets of early and late rows are fractions of different times.
    pub const MOST_DRIFT: f64 = 0.05;

    /// What two calibrations of the same view, one before and one during and after a sweep, tell.
    #[must_use]
    pub fn between(before: &Calibration, after: &Calibration) -> Self {
        let drift = |before: f64, after: f64| {
            if before > 0.0 {
                (after / before - 1.0).abs()
            } else {
                0.0
            }
        };
        Self {
            spread: [before, after]
                .into_iter()
                .flat_map(|times| [times.gouraud_spread, times.phong_spread])
                .fold(0.0, f64::max),
            drift: drift(before.gouraud_ms, after.gouraud_ms)
                .max(drift(before.phong_ms, after.phong_ms)),
        }
    }

    /// Whether what was measured is not to be trusted.
    #[must_use]
    pub fn is_too_much(&self) -> bool {
        self.spread > Self::MOST_SPREAD || self.drift > Self::MOST_DRIFT
    }
}

/// Measures cold Gouraud and Phong frames in alternation, so that a change of the machine's speed meets both.
#[derive(Debug)]
pub(super) struct Calibrator {
    /// Gouraud and Phong.
    engines: [Engine; 2],
    /// Of each, in milliseconds.
    times: [Vec<f64>; 2],
    /// Of the Gouraud-shaded image.
    pub(super) gouraud_rmse: f64,
}

impl Calibrator {
    pub(super) fn new(options: &SweepOptions, scene: &Scene) -> Result<Self, EngineError> {
        Ok(Self {
            engines: [
                options.engine(scene, Method::Gouraud)?,
                options.engine(scene, Method::Phong)?,
            ],
            times: [Vec::new(), Vec::new()],
            gouraud_rmse: 0.0,
        })
    }

    /// Renders the Gouraud image.
    pub(super) fn render_gouraud(&mut self, scene: &Scene, frame: &mut Frame) {
        self.engines[0].forget();
        self.engines[0].render(scene, Budget::Unlimited, frame);
    }

    /// Measures `rounds` frames of each, after some that do not count.
    pub(super) fn measure(&mut self, rounds: usize, scene: &Scene, frame: &mut Frame) {
        for _ in 0..rounds {
            for (engine, times) in self.engines.iter_mut().zip(&mut self.times) {
                for number in 0..=LEAD_FRAMES {
                    engine.forget();
                    // Every pixel is handed over anew.
                    frame.pixels_mut();
                    let stats = engine.render(scene, Budget::Unlimited, frame);
                    if number == LEAD_FRAMES {
                        times.push(stats.frame_ms);
                    }
                }
            }
        }
    }

    /// How many frames of each have been measured since the last [`take`](Self::take).
    pub(super) fn rounds(&self) -> usize {
        self.times[0].len()
    }

    /// Sums up the frames measured since the last time.
    pub(super) fn take(&mut self) -> Calibration {
        let frames = self.rounds() as u32;
        let [gouraud, phong] = self.times.each_mut().map(|times| {
            let summary = Quartiles::of(times);
            times.clear();
            summary
        });
        Calibration {
            gouraud_ms: gouraud.median,
            phong_ms: phong.median,
            gouraud_spread: gouraud.spread(),
            phong_spread: phong.spread(),
            gouraud_rmse: self.gouraud_rmse,
            frames,
        }
    }
}

/// Quartiles by nearest rank: each is one of the values; zeros of nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Quartiles {
    lower: f64,
    median: f64,
    upper: f64,
}

impl Quartiles {
    /// Sorts `values`.
    fn of(values: &mut [f64]) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        let at = |quarter: usize| {
            let rank = (values.len() * quarter).div_ceil(4).max(1);
            values.get(rank - 1).copied().unwrap_or(0.0)
        };
        Self {
            lower: at(1),
            median: at(2),
            upper: at(3),
        }
    }

    /// Distance of the outer quartiles as a share of the median.
    fn spread(&self) -> f64 {
        if self.median > 0.0 {
            (self.upper - self.lower) / self.median
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn calibration(gouraud_ms: f64, phong_ms: f64) -> Calibration {
        Calibration {
            gouraud_ms,
            phong_ms,
            gouraud_spread: 0.02,
            phong_spread: 0.03,
            gouraud_rmse: 5.0,
            frames: 30,
        }
    }

    #[test]
    fn budgets_lie_between_gouraud_and_phong() {
        let normal = calibration(2.0, 10.0);
        let millis = [0.0, 0.25, 1.0].map(|fraction| normal.budget(fraction).millis);
        assert_eq!(millis, [2.0, 4.0, 10.0]);
        assert_eq!(calibration(3.0, 2.0).budget(0.5).millis, 3.0);
    }

    #[test]
    fn quartiles_are_values_and_their_spread_is_relative() {
        let found = Quartiles::of(&mut [8.0, 1.0, 4.0, 2.0, 5.0, 3.0, 7.0, 6.0]);
        assert_eq!((found.lower, found.median, found.upper), (2.0, 4.0, 6.0));
        assert_eq!(found.spread(), 1.0);
        assert_eq!(Quartiles::of(&mut [3.0]).spread(), 0.0);
        assert_eq!(Quartiles::of(&mut []).spread(), 0.0);
    }

    #[test]
    fn noise_is_the_worst_of_spreads_and_of_drifts() {
        let before = calibration(2.0, 10.0);
        let noise = Noise::between(&before, &calibration(2.0, 10.0));
        assert_eq!((noise.spread, noise.drift), (0.03, 0.0));
        assert!(!noise.is_too_much());

        // The faster of the two became slower by 6 %, the other faster by 5 %.
        let drifted = Noise::between(&before, &calibration(2.12, 9.5));
        assert!((drifted.drift - 0.06).abs() < 1e-12);
        assert!(drifted.is_too_much());

        let unsteady = Calibration {
            gouraud_spread: 0.11,
            ..before
        };
        assert!(Noise::between(&before, &unsteady).is_too_much());
        assert_eq!(Noise::between(&calibration(0.0, 0.0), &before).drift, 0.0);
    }
}
