//! Costs learned while running.
//!
//! They tell how much of a wall-clock budget to keep for what must follow refinement. They never decide what is refined,
//! or in which order: nominal costs do that.

/// Weight of a measurement that is above what was thought, and of one below. Too low a prediction makes a frame late, too
/// high a one costs a little refinement; so predictions rise quickly and fall slowly.
const WEIGHT_ABOVE: f64 = 0.5;
const WEIGHT_BELOW: f64 = 0.1;

/// Nanoseconds per item of a kind of work, as a moving average of measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedRate {
    ns_per_item: f64,
    /// Measurements of fewer items say more about overheads than about the rate.
    least_items: u64,
}

impl LearnedRate {
    /// A rate to start from, and the fewest items that make a measurement count.
    #[must_use]
    pub fn new(ns_per_item: f32, least_items: u64) -> Self {
        Self {
            ns_per_item: f64::from(ns_per_item),
            least_items,
        }
    }

    /// Takes note that `items` items took `ms` milliseconds. Measurements that are not positive numbers are ignored.
    pub fn learn(&mut self, items: u64, ms: f64) {
        let measured = ms * 1e6 / items as f64;
        if items >= self.least_items && measured > 0.0 && measured.is_finite() {
            let difference = measured - self.ns_per_item;
            let weight = if difference > 0.0 {
                WEIGHT_ABOVE
            } else {
                WEIGHT_BELOW
            };
            self.ns_per_item += weight * difference;
        }
    }

    /// Milliseconds that `items` items will take.
    #[must_use]
    pub fn predict_ms(&self, items: u64) -> f64 {
        items as f64 * self.ns_per_item * 1e-6
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_approaches_what_is_measured_and_ignores_what_is_not_a_measurement() {
        let mut rate = LearnedRate::new(1.0, 100);
        for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            rate.learn(1000, odd);
        }
        rate.learn(0, 5.0);
        rate.learn(99, 5.0);
        assert_eq!(rate.predict_ms(1_000_000), 1.0);
        for _ in 0..20 {
            rate.learn(1_000_000, 3.0);
        }
        assert!((rate.predict_ms(1_000_000) - 3.0).abs() < 0.01);
        for _ in 0..80 {
            rate.learn(1_000_000, 2.0);
        }
        assert!((rate.predict_ms(1_000_000) - 2.0).abs() < 0.01);
        // As often above as below: it stays nearer to what is above.
        for _ in 0..40 {
            rate.learn(1_000_000, 1.0);
            rate.learn(1_000_000, 3.0);
        }
        assert!(rate.predict_ms(1_000_000) > 2.5);
    }
}
