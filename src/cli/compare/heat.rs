//! Errors as colours, on one logarithmic scale for all maps of a sheet.
//!
//! The colours are matplotlib's inferno, which is uniform to the eye and gets brighter all the way. Errors of a code and of
//! fifty are both to be seen, hence the logarithm. Below half a code nothing is shown: no channel can be off by less than one, and a
//! pixel with one channel off by one has an error of 0.58.

use super::canvas::Rgb;

/// The error, in codes, that is shown in the darkest colour.
const LEAST: f64 = 0.5;

/// The least that the brightest colour stands for.
const LEAST_TOP: f64 = 8.0;

/// What is not compared: the background, and pixels left out.
pub(super) const NOTHING: Rgb = [58, 58, 64];

/// A scale from half a code to a power of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// The error, in codes, that is shown in the brightest colour.
    top: f64,
}

impl Scale {
    /// A scale on which all the errors have a place.
    pub(super) fn of<'a>(errors: impl IntoIterator<Item = &'a Option<f64>>) -> Self {
        let most = errors.into_iter().flatten().copied().fold(0.0, f64::max);
        let mut top = LEAST_TOP;
        while top < most {
            top *= 2.0;
        }
        Self { top }
    }

    /// The colour of an error.
    pub(super) fn color(&self, error: Option<f64>) -> Rgb {
        let Some(error) = error else {
            return NOTHING;
        };
        let share = (error.max(LEAST) / LEAST).log2() / (self.top / LEAST).log2();
        self.color_at(share)
    }

    /// The colour at a share of the scale's length.
    pub(super) fn color_at(&self, share: f64) -> Rgb {
        let color = colorous::INFERNO.eval_continuous(share);
        [color.r, color.g, color.b]
    }

    /// What to write along the scale, and where, as shares of its length: every power of two.
    pub(super) fn ticks(&self) -> Vec<(f64, String)> {
        let steps = (self.top / LEAST).log2().round() as u32;
        (0..=steps)
            .map(|step| {
                let value = LEAST * f64::from(step).exp2();
                // The darkest colour is also that of what is less.
                let sign = if step == 0 { "<" } else { "" };
                (f64::from(step) / f64::from(steps), format!("{sign}{value}"))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brightness(color: Rgb) -> u32 {
        color.map(u32::from).iter().sum()
    }

    #[test]
    fn greater_errors_are_brighter() {
        let scale = Scale::of(&[Some(3.0), None, Some(40.0)]);
        assert_eq!(scale.top, 64.0);
        let found: Vec<u32> = [0.58, 1.0, 4.0, 16.0, 63.0]
            .map(|error| brightness(scale.color(Some(error))))
            .to_vec();
        assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "{found:?}");
        assert_eq!(scale.color(Some(0.0)), scale.color(Some(0.4)));
        assert_eq!(scale.color(None), NOTHING);
    }

    #[test]
    fn powers_of_two_are_marked() {
        let labels: Vec<String> = Scale::of(&[])
            .ticks()
            .into_iter()
            .map(|tick| tick.1)
            .collect();
        assert_eq!(labels, ["<0.5", "1", "2", "4", "8"]);
    }
}
