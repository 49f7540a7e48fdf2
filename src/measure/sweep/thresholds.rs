//! Thresholds of the paper's methods, which take the place of budgets: from coarse to fine in equal ratios.

use crate::frame::Method;
use crate::refine::paper::PaperRule;

/// The coarsest and the finest area of `regular`, in pixels.
const AREAS_PX: [f64; 2] = [512.0, 2.0];

/// The largest and the smallest difference of `highlight`.
const DIFFERENCES: [f64; 2] = [0.9, 0.03];

/// The threshold at step `step` of `steps`; the paper's own if there is but one, none for methods that have no threshold.
pub(super) fn of_step(method: Method, step: usize, steps: usize) -> Option<f64> {
    let ([coarse, fine], usual) = match method {
        Method::Regular => (AREAS_PX, f64::from(PaperRule::default().area_px)),
        Method::Highlight => (DIFFERENCES, f64::from(PaperRule::default().difference)),
        _ => return None,
    };
    if steps <= 1 {
        return Some(usual);
    }
    let t = step as f64 / (steps - 1) as f64;
    Some(coarse * (fine / coarse).powf(t))
}

/// The rule with that threshold.
pub(super) fn rule(method: Method, threshold: Option<f64>) -> PaperRule {
    let mut rule = PaperRule::default();
    match (method, threshold) {
        (Method::Regular, Some(area)) => rule.area_px = area as f32,
        (Method::Highlight, Some(difference)) => rule.difference = difference as f32,
        _ => {}
    }
    rule
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_go_from_coarse_to_fine() {
        let of = |method, steps| (0..steps).filter_map(move |step| of_step(method, step, steps));
        let areas: Vec<f64> = of(Method::Regular, 5).collect();
        assert_eq!((areas[0], areas[4]), (512.0, 2.0));
        assert!((areas[2] - 32.0).abs() < 1e-9, "the paper's is half way");
        assert!(of(Method::Highlight, 7).is_sorted_by(|a, b| a > b));
        assert!(of(Method::Regular, 1).eq([32.0]) && of(Method::Hybrid, 3).next().is_none());
        assert_eq!(rule(Method::Regular, Some(8.0)).area_px, 8.0);
        assert_eq!(rule(Method::Hybrid, None), PaperRule::default());
    }
}
