//! Curves of error against time, and the areas under them.
//!
//! A curve joins what was measured of one method by straight lines: between two budgets lie all those that were not
//! tried. The **area** under it is taken over linear time from `G` to `P`, the times of Gouraud and Phong shading, and divided
//! by `P - G`: it is the mean RMSE, in codes, over all budgets between the two. Until a method has an image the error is
//! that of Gouraud shading, which could be had by then; after the last measurement it stays what it was.
//!
//! The paper's methods have no budget, but thresholds: their points are the images that these give, each after the time that it took.
//!
//! By this measure Gouraud and Phong shading themselves come out alike: at a budget short of `P` there is no Phong image.

use super::{Calibration, SweepRow};
use crate::frame::Method;
use serde::Serialize;

/// How the error of one method falls with time.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// The method's name.
    pub method: &'static str,
    /// Whether budgets or thresholds make a difference; else there is one point, that of the median frame time.
    pub has_a_curve: bool,
    /// In order of time.
    pub points: Vec<CurvePoint>,
}

/// An image, and when there was one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// Milliseconds that the frame took.
    pub frame_ms: f64,
    /// Its error: RMSE in codes.
    pub rmse: f64,
}

/// The area under the curve of a method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurveArea {
    /// The method's name.
    pub method: &'static str,
    /// The area from `G` to `P`, divided by `P - G`: a mean RMSE in codes.
    pub area_codes: f64,
    /// The area as a share of that under Gouraud shading's error; `None` where that has none.
    pub share_of_gouraud: Option<f64>,
}

impl Curve {
    /// The curves of rows of one scene, one for each method in the order in which they are met. Only first frames
    /// count: later ones go on from an image that took time before.
    #[must_use]
    pub fn of_rows(rows: &[SweepRow]) -> Vec<Self> {
        let mut curves: Vec<Self> = Vec::new();
        for row in rows.iter().filter(|row| row.frame == 1) {
            let point = CurvePoint {
                frame_ms: row.frame_ms,
                rmse: row.error.rmse,
            };
            match curves.iter_mut().find(|curve| curve.method == row.method) {
                Some(curve) => curve.points.push(point),
                None => curves.push(Self {
                    method: row.method,
                    has_a_curve: row.method.parse::<Method>().is_ok_and(Method::has_a_curve),
                    points: vec![point],
                }),
            }
        }
        for curve in &mut curves {
            curve
                .points
                .sort_by(|a, b| a.frame_ms.total_cmp(&b.frame_ms));
            if !curve.has_a_curve {
                let middle = (curve.points.len() - 1) / 2;
                curve.points = vec![curve.points[middle]];
            }
        }
        curves
    }

    /// The area under the curve; `None` where Phong shading took no longer than Gouraud shading.
    #[must_use]
    pub fn area(&self, calibration: &Calibration) -> Option<CurveArea> {
        let (from, to) = (calibration.gouraud_ms, calibration.phong_ms);
        let width = to - from;
        if width.is_nan() || width <= 0.0 {
            return None;
        }
        let waiting = CurvePoint {
            frame_ms: from,
            rmse: calibration.gouraud_rmse,
        };
        let first = self.points.first().unwrap_or(&waiting);
        let last = self.points.last().unwrap_or(&waiting);
        let flat = |start: f64, end: f64, rmse: f64| {
            let at = |frame_ms| CurvePoint { frame_ms, rmse };
            area_below(at(start), at(end), from, to)
        };
        let total = flat(from, first.frame_ms, waiting.rmse)
            + self
                .points
                .windows(2)
                .map(|pair| area_below(pair[0], pair[1], from, to))
                .sum::<f64>()
            + flat(last.frame_ms, to, last.rmse);
        let area_codes = total / width;
        Some(CurveArea {
            method: self.method,
            area_codes,
            share_of_gouraud: (waiting.rmse > 0.0).then(|| area_codes / waiting.rmse),
        })
    }
}

/// The area below the straight line from `a` to `b`, as far as it lies within the times `from..to`; none if `b` comes first.
fn area_below(a: CurvePoint, b: CurvePoint, from: f64, to: f64) -> f64 {
    let (start, end) = (a.frame_ms.max(from), b.frame_ms.min(to));
    // Also where both points have the same time, so that nothing is divided by zero.
    if end.is_nan() || start >= end {
        return 0.0;
    }
    let at = |ms: f64| a.rmse + (b.rmse - a.rmse) * (ms - a.frame_ms) / (b.frame_ms - a.frame_ms);
    (end - start) * (at(start) + at(end)) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::ErrorHistogram;

    /// G = 2 ms, P = 10 ms, and Gouraud shading is off by 6 codes.
    fn calibration() -> Calibration {
        Calibration {
            gouraud_ms: 2.0,
            phong_ms: 10.0,
            gouraud_spread: 0.0,
            phong_spread: 0.0,
            gouraud_rmse: 6.0,
            frames: 30,
        }
    }

    fn curve(points: &[(f64, f64)]) -> Curve {
        Curve {
            method: "adaptive",
            has_a_curve: true,
            points: points
                .iter()
                .map(|&(frame_ms, rmse)| CurvePoint { frame_ms, rmse })
                .collect(),
        }
    }

    fn area(points: &[(f64, f64)]) -> f64 {
        let area = curve(points).area(&calibration()).expect("P is above G");
        area.area_codes
    }

    #[test]
    fn areas_are_those_found_by_hand() {
        // Nothing measured: Gouraud's error all the way.
        assert_eq!(area(&[]), 6.0);
        // One image in the middle: 4 ms of Gouraud, 4 ms of that.
        assert_eq!(area(&[(6.0, 1.0)]), (4.0 * 6.0 + 4.0) / 8.0);
        // Waiting 1 ms, a slope of 2 ms from 4 to 2, of 4 ms from 2 to 0, and 1 ms without error.
        let by_hand = (6.0 + 2.0 * 3.0 + 4.0 * 1.0) / 8.0;
        assert_eq!(area(&[(3.0, 4.0), (5.0, 2.0), (9.0, 0.0)]), by_hand);
        // Two images at the same time.
        assert_eq!(area(&[(3.0, 4.0), (3.0, 2.0)]), (6.0 + 2.0 * 7.0) / 8.0);
    }

    #[test]
    fn only_time_between_gouraud_and_phong_counts() {
        // An image before G counts from G on; the slope from 8 ms to 12 ms only until 10.
        assert_eq!(area(&[(1.0, 5.0)]), 5.0);
        assert_eq!(
            area(&[(1.0, 4.0), (8.0, 4.0), (12.0, 0.0)]),
            (6.0 * 4.0 + 2.0 * 3.0) / 8.0
        );
        // Phong shading that comes too late is no better than Gouraud shading.
        assert_eq!(area(&[(11.0, 0.0)]), 6.0);
        let share = curve(&[(6.0, 0.0)]).area(&calibration());
        assert_eq!(share.and_then(|area| area.share_of_gouraud), Some(0.5));
    }

    #[test]
    fn there_is_no_area_where_phong_is_not_slower() {
        for phong_ms in [2.0, 1.0, f64::NAN] {
            let calibration = Calibration {
                phong_ms,
                ..calibration()
            };
            assert_eq!(curve(&[(3.0, 1.0)]).area(&calibration), None);
        }
        let perfect = Calibration {
            gouraud_rmse: 0.0,
            ..calibration()
        };
        let area = curve(&[(3.0, 0.0)]).area(&perfect).expect("P is above G");
        assert_eq!((area.area_codes, area.share_of_gouraud), (0.0, None));
    }

    #[test]
    fn rows_become_curves_in_order_of_time() {
        let row = |method, frame_ms, rmse, frame| {
            let mut error = ErrorHistogram::default().report();
            error.rmse = rmse;
            SweepRow {
                scene: "a".to_owned(),
                method,
                budget_ms: 1.0,
                fraction: None,
                threshold: None,
                frame,
                frame_ms,
                overshoot_ms: 0.0,
                error,
                triangles_subdivided: 0,
                converged: false,
            }
        };
        let curves = Curve::of_rows(&[
            row("adaptive", 3.0, 1.0, 1),
            row("adaptive", 1.0, 0.5, 2),
            row("phong", 9.0, 0.0, 1),
            row("adaptive", 2.0, 4.0, 1),
            row("phong", 7.0, 0.0, 1),
            row("phong", 8.0, 0.0, 1),
        ]);
        let found: Vec<(&str, Vec<f64>)> = curves
            .iter()
            .map(|curve| {
                (
                    curve.method,
                    curve.points.iter().map(|p| p.frame_ms).collect(),
                )
            })
            .collect();
        // Second frames are left out, and methods that no budget changes are a point.
        assert_eq!(found, [("adaptive", vec![2.0, 3.0]), ("phong", vec![8.0])]);
        assert!(Curve::of_rows(&[]).is_empty());
    }
}
