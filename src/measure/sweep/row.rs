//! What a sweep measures of a frame, and how files of comma-separated values tell it.

use crate::measure::ErrorReport;
use crate::measure::csv;
use serde::Serialize;

/// What was measured of one frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SweepRow {
    /// What the scene is called.
    pub scene: String,
    /// The method's name.
    pub method: &'static str,
    /// The budget in milliseconds.
    pub budget_ms: f64,
    /// The budget as a fraction of the way from Gouraud to Phong shading, if it was given so.
    pub fraction: Option<f64>,
    /// The threshold of a method of the paper: pixels for `regular`, a share of intensity for `highlight`.
    pub threshold: Option<f64>,
    /// The frame of the still view, counted from 1.
    pub frame: u32,
    /// How long the frame took.
    pub frame_ms: f64,
    /// `frame_ms - budget_ms`.
    pub overshoot_ms: f64,
    /// Its error.
    #[serde(flatten)]
    pub error: ErrorReport,
    /// Triangles subdivided so far.
    pub triangles_subdivided: u64,
    /// Whether the image is final.
    pub converged: bool,
}

impl SweepRow {
    /// Names of the columns of [`to_csv`](Self::to_csv).
    pub const CSV_HEADER: &'static str = "scene,method,budget_ms,fraction,frame,frame_ms,overshoot_ms,rmse,psnr_db,\
        max,p99,share_above_1,share_above_4,triangles_subdivided,converged,covered_pixels,excluded_pixels,\
        threshold";

    /// The row as a line of comma-separated values, without a line end; what is infinite or not there is empty.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let number = |value: f64| {
            if value.is_finite() {
                format!("{value:.4}")
            } else {
                String::new()
            }
        };
        let error = &self.error;
        [
            csv::quoted(&self.scene),
            self.method.to_owned(),
            number(self.budget_ms),
            self.fraction.map_or_else(String::new, number),
            self.frame.to_string(),
            number(self.frame_ms),
            number(self.overshoot_ms),
            number(error.rmse),
            number(error.psnr_db),
            error.max.to_string(),
            error.p99.to_string(),
            format!("{:.6}", error.share_above_1),
            format!("{:.6}", error.share_above_4),
            self.triangles_subdivided.to_string(),
            self.converged.to_string(),
            error.covered_pixels.to_string(),
            error.excluded_pixels.to_string(),
            self.threshold.map_or_else(String::new, number),
        ]
        .join(",")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_has_a_field_for_each_column() {
        let row = SweepRow {
            scene: "a, \"b\"".to_owned(),
            method: "phong",
            budget_ms: 2.0,
            fraction: None,
            threshold: None,
            frame: 1,
            frame_ms: 2.5,
            overshoot_ms: 0.5,
            error: crate::measure::ErrorHistogram::default().report(),
            triangles_subdivided: 7,
            converged: true,
        };
        let line = row.to_csv();
        assert!(line.starts_with("\"a, \"\"b\"\"\",phong,2.0000,,1,2.5000,0.5000,0.0000,,0,0,"));
        // One comma of the line is inside of the quotes.
        let columns = SweepRow::CSV_HEADER.split(',').count();
        assert_eq!(line.split(',').count(), columns + 1);
        let json = serde_json::to_value(&row).expect("plain numbers");
        for key in SweepRow::CSV_HEADER.split(',') {
            assert!(json.get(key).is_some(), "no {key} in {json}");
        }
    }
}
