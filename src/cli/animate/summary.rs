//! What is said of a film when it is done.

use super::error::Measured;
use specula::schedule::Budget;
use std::time::Duration;

/// What the frames rendered had in common.
#[derive(Debug, Default)]
pub(super) struct Summary {
    /// Of each frame rendered.
    frame_ms: Vec<f64>,
    late: u32,
    /// Sum and number of the estimated errors that are known.
    error: (f64, u32),
    /// Sums of squares of measured errors and of flickers, in codes, and how many there are of each.
    squared_errors: (f64, u32),
    squared_flickers: (f64, u32),
    /// Frames that were there already.
    kept: u32,
    budget_ms: Option<f64>,
}

impl Summary {
    /// Takes in a frame that was rendered. Its error may be unknown, not finite.
    pub(super) fn rendered(&mut self, frame_ms: f64, budget: Budget, estimated_error: f64) {
        self.frame_ms.push(frame_ms);
        if let Budget::Millis(ms) = budget {
            self.budget_ms = Some(ms);
            self.late += u32::from(frame_ms > ms);
        }
        if estimated_error.is_finite() {
            self.error.0 += estimated_error;
            self.error.1 += 1;
        }
    }

    /// Takes in what was measured of a frame.
    pub(super) fn measured(&mut self, measured: &Measured) {
        self.squared_errors.0 += measured.error.rmse.powi(2);
        self.squared_errors.1 += 1;
        if let Some(flicker) = measured.flicker {
            self.squared_flickers.0 += flicker.powi(2);
            self.squared_flickers.1 += 1;
        }
    }

    /// Takes in a frame that was there already.
    pub(super) fn kept(&mut self) {
        self.kept += 1;
    }

    /// A few lines. `elapsed` is all the time that was spent, also on encoding and writing.
    pub(super) fn text(&self, size: [u32; 2], elapsed: Duration) -> String {
        let mut lines = vec![self.headline(size, elapsed.as_secs_f64())];
        if let Some([median, p99, longest]) = self.times() {
            let late = match self.budget_ms {
                Some(ms) => format!("; budget {ms:.2} ms: {} late", self.late),
                None => String::new(),
            };
            lines.push(format!(
                "  rendering  median {median:.2} ms, p99 {p99:.2} ms, longest {longest:.2} ms a frame{late}"
            ));
        }
        if self.error.1 > 0 {
            let mean = self.error.0 / f64::from(self.error.1);
            lines.push(format!(
                "  error      about {mean:.2} codes (mean of the estimates)"
            ));
        }
        let root_mean = |(sum, count): (f64, u32)| (sum / f64::from(count)).sqrt();
        if self.squared_errors.1 > 0 {
            let flicker = if self.squared_flickers.1 > 0 {
                format!(", flicker {:.3} codes", root_mean(self.squared_flickers))
            } else {
                String::new()
            };
            lines.push(format!(
                "  measured   rmse {:.3} codes{flicker} (root mean squares over the frames)",
                root_mean(self.squared_errors)
            ));
        }
        if self.kept > 0 {
            let were = if self.kept == 1 { "was" } else { "were" };
            lines.push(format!(
                "  kept       {} that {were} there already (--overwrite renders them anew)",
                frames(self.kept as usize)
            ));
        }
        lines.join("\n")
    }

    fn headline(&self, [width, height]: [u32; 2], seconds: f64) -> String {
        let count = self.frame_ms.len();
        if count == 0 {
            return "no frames to render".to_owned();
        }
        let rate = if seconds > 0.0 {
            format!(", {:.1} a second", count as f64 / seconds)
        } else {
            String::new()
        };
        format!(
            "{} of {width}x{height} in {seconds:.1} s{rate}",
            frames(count)
        )
    }

    /// Median, 99th percentile and maximum of the frame times, by nearest rank.
    fn times(&self) -> Option<[f64; 3]> {
        let mut sorted = self.frame_ms.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        let rank = |percent: usize| (sorted.len() * percent).div_ceil(100).saturating_sub(1);
        Some([sorted[rank(50)], sorted[rank(99)], sorted[last]])
    }
}

fn frames(count: usize) -> String {
    match count {
        1 => "1 frame".to_owned(),
        _ => format!("{count} frames"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_by_nearest_rank() {
        let of = |frame_ms: Vec<f64>| {
            Summary {
                frame_ms,
                ..Summary::default()
            }
            .times()
        };
        assert_eq!(of(vec![]), None);
        assert_eq!(of(vec![3.0]), Some([3.0; 3]));
        assert_eq!(of(vec![4.0, 1.0]), Some([1.0, 4.0, 4.0]));
        let hundred: Vec<f64> = (1..=200).rev().map(f64::from).collect();
        assert_eq!(of(hundred), Some([100.0, 198.0, 200.0]));
    }

    #[test]
    fn late_frames_and_errors_are_those_that_are_known() {
        let mut summary = Summary::default();
        for (frame_ms, estimated_error) in [(3.0, 0.5), (5.0, f64::NAN), (4.0, 1.5)] {
            summary.rendered(frame_ms, Budget::Millis(4.0), estimated_error);
        }
        for (rmse, flicker) in [(3.0, None), (4.0, Some(1.0))] {
            let mut error = specula::measure::ErrorHistogram::default().report();
            error.rmse = rmse;
            summary.measured(&Measured { error, flicker });
        }
        summary.kept();
        assert_eq!(
            summary.text([8, 6], Duration::from_secs(2)),
            "3 frames of 8x6 in 2.0 s, 1.5 a second\n  \
             rendering  median 4.00 ms, p99 5.00 ms, longest 5.00 ms a frame; budget 4.00 ms: 1 late\n  \
             error      about 1.00 codes (mean of the estimates)\n  \
             measured   rmse 3.536 codes, flicker 1.000 codes (root mean squares over the frames)\n  \
             kept       1 frame that was there already (--overwrite renders them anew)"
        );
        assert_eq!(
            Summary::default().text([8, 6], Duration::ZERO),
            "no frames to render"
        );
    }
}
