//! What a sweep has found out about a scene.

use crate::cli::report::noise_warning;
use serde::Serialize;
use specula::measure::{Calibration, Curve, CurveArea, Noise, SweepRow};

/// All that was measured of a scene.
#[derive(Debug, Serialize)]
pub(super) struct SceneResult {
    pub(super) scene: String,
    /// Gouraud and Phong times before all rows; `None` for a backend that cannot shade pixels.
    pub(super) calibration: Option<Calibration>,
    /// The same during and after the rows.
    pub(super) calibration_after: Option<Calibration>,
    pub(super) noise: Option<Noise>,
    /// Whether the times are not to be trusted.
    pub(super) too_noisy: bool,
    pub(super) areas: Vec<CurveArea>,
    pub(super) rows: Vec<SweepRow>,
}

impl SceneResult {
    pub(super) fn new(
        scene: &str,
        calibration: Option<Calibration>,
        calibration_after: Option<Calibration>,
        rows: Vec<SweepRow>,
    ) -> Self {
        let noise = calibration
            .zip(calibration_after)
            .map(|(before, after)| Noise::between(&before, &after));
        let areas = calibration.map_or_else(Vec::new, |calibration| {
            Curve::of_rows(&rows)
                .iter()
                .filter_map(|curve| curve.area(&calibration))
                .collect()
        });
        Self {
            scene: scene.to_owned(),
            calibration,
            calibration_after,
            too_noisy: noise.is_some_and(|noise| noise.is_too_much()),
            noise,
            areas,
            rows,
        }
    }

    /// The area under a method's curve.
    pub(super) fn area(&self, method: &str) -> Option<&CurveArea> {
        self.areas.iter().find(|area| area.method == method)
    }

    /// Why the times are not to be trusted, if so.
    pub(super) fn warning(&self) -> Option<String> {
        self.noise.as_ref().and_then(noise_warning)
    }
}

/// A line about G and P.
pub(super) fn calibration_line(calibration: &Calibration) -> String {
    format!(
        "Gouraud {:.3} ms, Phong {:.3} ms (medians of {} alternating frames; quartiles {:.1} % and {:.1} % apart)",
        calibration.gouraud_ms,
        calibration.phong_ms,
        calibration.frames,
        calibration.gouraud_spread * 100.0,
        calibration.phong_spread * 100.0
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn calibration(phong_ms: f64, spread: f64) -> Calibration {
        Calibration {
            gouraud_ms: 2.0,
            phong_ms,
            gouraud_spread: spread,
            phong_spread: 0.0,
            gouraud_rmse: 6.0,
            frames: 30,
        }
    }

    #[test]
    fn a_warning_names_what_was_too_noisy() {
        let warning = |before: Calibration, after: Calibration| {
            SceneResult::new("a", Some(before), Some(after), Vec::new()).warning()
        };
        let quiet = calibration(10.0, 0.02);
        assert_eq!(warning(quiet, quiet), None);
        let slower = warning(quiet, calibration(11.0, 0.02)).expect("too much drift");
        assert_eq!(
            slower,
            "machine too noisy to trust these times: medians changed by 10.0 % (limit 5 %)"
        );
        let both = warning(quiet, calibration(11.0, 0.2)).expect("too much of both");
        assert!(
            both.contains("quartiles 20 % apart (limit 10 %), medians"),
            "{both}"
        );
        // Without a calibration nothing is known.
        assert_eq!(
            SceneResult::new("a", None, None, Vec::new()).warning(),
            None
        );
    }
}
