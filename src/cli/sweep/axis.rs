//! Logarithmic axes: ranges and round numbers to mark.

use std::ops::Range;

/// Room beyond the outermost values, as a factor.
const MARGIN: f64 = 1.2;

/// Fewest marks that let a reader interpolate.
const FEWEST_TICKS: usize = 4;

/// An axis from the smallest to the largest of the positive values, with some room at both ends.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LogAxis {
    pub(super) range: Range<f64>,
    /// Ascending, all inside the range.
    pub(super) ticks: Vec<f64>,
}

impl LogAxis {
    /// An axis for `values`; those that are not positive or not finite are passed over.
    pub(super) fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let (least, most) = values
            .into_iter()
            .filter(|value| value.is_normal() && *value > 0.0)
            .fold((f64::INFINITY, 0.0_f64), |(least, most), value| {
                (least.min(value), most.max(value))
            });
        let range = if least <= most {
            least / MARGIN..most * MARGIN
        } else {
            // Nothing to show, on an axis that can be drawn all the same.
            0.1..10.0
        };
        let ticks = [
            &[1.0, 2.0, 5.0][..],
            &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
        ]
        .into_iter()
        .map(|steps| ticks(&range, steps))
        .find(|ticks| ticks.len() >= FEWEST_TICKS)
        .unwrap_or_else(|| even_ticks(&range));
        Self { range, ticks }
    }

    /// The value itself, or the axis's end nearest to it.
    pub(super) fn clamp(&self, value: f64) -> f64 {
        value.clamp(self.range.start, self.range.end)
    }
}

/// The multiples of powers of ten that lie in the range.
fn ticks(range: &Range<f64>, steps: &[f64]) -> Vec<f64> {
    let decades = range.start.log10().floor() as i32..=range.end.log10().ceil() as i32;
    decades
        .flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)))
        .filter(|value| range.contains(value))
        .collect()
}

/// Equal steps of a power of ten, or of twice or five times one: for a range so short that it is almost linear.
fn even_ticks(range: &Range<f64>) -> Vec<f64> {
    let wanted = (range.end - range.start) / FEWEST_TICKS as f64;
    let power = 10f64.powf(wanted.log10().floor());
    let step = [5.0, 2.0, 1.0]
        .map(|factor| factor * power)
        .into_iter()
        .find(|&step| step <= wanted)
        .unwrap_or(power);
    let first = (range.start / step).ceil() as i64;
    (first..)
        .map(|count| count as f64 * step)
        .take_while(|value| *value < range.end)
        .collect()
}

/// A tick's number, without zeros that say nothing.
pub(super) fn label(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_holds_its_values_and_marks_round_numbers() {
        let labels = |values: &[f64]| {
            let axis = LogAxis::of(values.iter().copied());
            assert!(values.iter().all(|v| axis.range.contains(v) || *v <= 0.0));
            assert!(axis.ticks.is_sorted());
            assert!(axis.ticks.iter().all(|tick| axis.range.contains(tick)));
            axis.ticks
                .into_iter()
                .map(label)
                .collect::<Vec<_>>()
                .join(" ")
        };
        assert_eq!(labels(&[0.04, 11.0, 0.0]), "0.05 0.1 0.2 0.5 1 2 5 10");
        assert_eq!(labels(&[2.0, 7.0]), "2 3 4 5 6 7 8");
        assert_eq!(labels(&[2.1, 2.5]), "1.8 2 2.2 2.4 2.6 2.8");
        assert_eq!(labels(&[]), "0.1 0.2 0.5 1 2 5");
    }

    #[test]
    fn what_is_off_the_axis_goes_to_its_end() {
        let axis = LogAxis::of([1.0, 10.0]);
        assert_eq!(axis.clamp(0.0), axis.range.start);
        assert_eq!(axis.clamp(3.0), 3.0);
    }
}
