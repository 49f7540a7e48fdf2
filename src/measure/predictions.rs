//! How far predictions of what work takes were off.

use super::bench::quantile;
use crate::frame::StageTimes;
use serde::ser::{Serialize, SerializeMap, Serializer};

/// What the sum over stages is called.
const TOTAL: &str = "total";

/// Stages, and their sum.
const KINDS: usize = 8;

/// Errors of predictions by stage, and of their sum: `|predicted / measured - 1|`.
///
/// As an object with a key for each stage and `total`; null where nothing was predicted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredictionErrors([(&'static str, Option<f64>); KINDS]);

impl PredictionErrors {
    /// Names and errors, in the order of [`StageTimes`], the sum last.
    #[must_use]
    pub fn entries(&self) -> [(&'static str, Option<f64>); KINDS] {
        self.0
    }
}

impl Serialize for PredictionErrors {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(KINDS))?;
        for (name, error) in self.0 {
            map.serialize_entry(name, &error)?;
        }
        map.end()
    }
}

/// Errors of many frames.
#[derive(Clone, Debug, Default)]
pub(super) struct Predictions {
    errors: [Vec<f64>; KINDS],
}

impl Predictions {
    /// Adds a frame. Stages that nothing was predicted of, or that took no time, are left out, also of the sum.
    pub(super) fn add(&mut self, predicted: &StageTimes, measured: &StageTimes) {
        let mut total = [0.0; 2];
        let stages = predicted.entries().into_iter().zip(measured.entries());
        for (stage, ((_, predicted), (_, measured))) in stages.enumerate() {
            if predicted > 0.0 && measured > 0.0 {
                self.errors[stage].push(error(predicted, measured));
                total = [total[0] + predicted, total[1] + measured];
            }
        }
        let [predicted, measured] = total;
        if measured > 0.0 {
            self.errors[KINDS - 1].push(error(predicted, measured));
        }
    }

    /// The errors that `percent` of the frames do not exceed, of each stage and of the sum.
    pub(super) fn quantile(&mut self, percent: usize) -> PredictionErrors {
        let stages = StageTimes::default().entries().map(|(name, _)| name);
        PredictionErrors(std::array::from_fn(|kind| {
            let name = stages.get(kind).copied().unwrap_or(TOTAL);
            let errors = &mut self.errors[kind];
            errors.sort_unstable_by(f64::total_cmp);
            let error = (!errors.is_empty()).then(|| quantile(errors, percent));
            (name, error)
        }))
    }
}

fn error(predicted: f64, measured: f64) -> f64 {
    (predicted / measured - 1.0).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_shares_of_what_was_measured() {
        let mut predictions = Predictions::default();
        let times = |cull, raster, refine| StageTimes {
            cull,
            raster,
            refine,
            ..StageTimes::default()
        };
        // Refinement takes time that nobody predicted, and a prediction without a measurement says nothing.
        predictions.add(&times(3.0, 1.0, 0.0), &times(2.0, 2.0, 100.0));
        predictions.add(&times(3.0, 1.0, 0.0), &times(0.0, 4.0, 0.0));
        predictions.add(&StageTimes::default(), &times(1.0, 1.0, 1.0));
        let named = |errors: PredictionErrors| {
            let entries = errors.entries().into_iter();
            entries
                .filter_map(|(name, error)| Some((name, error?)))
                .collect::<Vec<_>>()
        };
        let low = named(predictions.quantile(50));
        assert_eq!(low, [("cull", 0.5), ("raster", 0.5), ("total", 0.0)]);
        let high = named(predictions.quantile(95));
        assert_eq!(high, [("cull", 0.5), ("raster", 0.75), ("total", 0.75)]);
        assert_eq!(
            serde_json::to_string(&Predictions::default().quantile(50)).expect("JSON"),
            r#"{"cull":null,"shade":null,"classify":null,"raster":null,"refine":null,"resolve":null,"present":null,"total":null}"#
        );
    }
}
