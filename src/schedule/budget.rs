//! What a frame may cost, and how much of it is left.

use crate::clock::Clock;

/// What one frame may cost.
///
/// The first image of a frame, the Gouraud-shaded one, is always completed; the budget decides how much refinement
/// follows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// Wall-clock milliseconds from the call of `render` to its return, by the engine's clock. Refinement stops in time;
    /// a first image that takes longer is completed late, and the outcome says so. Of an image begun under such a budget,
    /// what refinement found out in the images before decides what is looked at first; under any other budget it has no influence.
    Millis(f64),
    /// Work units: nominal nanoseconds of refinement (see [`cost`](super::cost)). The result is the same, bit for
    /// bit, for any number of threads and at any speed of the machine. A step is done whole or not at all, and the best
    /// one comes first: less than some 20,000 units a frame (100,000 with a hundred lights) may get nowhere.
    Work(u64),
    /// Refine until the image equals per-pixel Phong shading.
    Unlimited,
}

impl Budget {
    /// A wall-clock budget in milliseconds. Negative and NaN count as zero: the first image only.
    #[must_use]
    pub fn from_millis(ms: f64) -> Self {
        Self::Millis(if ms > 0.0 { ms } else { 0.0 })
    }
}

/// A budget being spent.
#[derive(Clone, Copy, Debug)]
pub struct Allowance<'a> {
    budget: Budget,
    clock: &'a dyn Clock,
    start_ms: f64,
    reserve_ms: f64,
    spent_units: u64,
    steps: u64,
    is_over: bool,
}

impl<'a> Allowance<'a> {
    /// Starts to spend `budget` at `start_ms` of `clock`.
    #[must_use]
    pub fn new(budget: Budget, clock: &'a dyn Clock, start_ms: f64) -> Self {
        Self {
            budget,
            clock,
            start_ms,
            reserve_ms: 0.0,
            spent_units: 0,
            steps: 0,
            is_over: false,
        }
    }

    /// Keeps `ms` of a wall-clock budget for what comes after refinement.
    pub fn reserve_ms(&mut self, ms: f64) {
        self.reserve_ms = ms.max(0.0);
    }

    /// Admits a step of `units` nominal nanoseconds, or ends the frame's refinement: a wall-clock budget admits it while
    /// the deadline, less the reserve and the step's nominal time, lies ahead.
    ///
    /// **After the first refusal nothing is admitted any more.** So what a frame does is the beginning of what an unlimited
    /// one does, whatever the clock said, and the number of [`steps`](Self::steps) says how much of it.
    #[must_use]
    pub fn admit(&mut self, units: u64) -> bool {
        self.is_over = self.is_over || !self.has_room_for(units);
        self.steps += u64::from(!self.is_over);
        !self.is_over
    }

    /// Admits work of about `nominal_ns` nanoseconds that costs no work units and is no [step](Self::steps), or ends the
    /// frame's refinement like [`admit`](Self::admit): only a wall-clock budget can refuse it.
    #[must_use]
    pub fn admit_free(&mut self, nominal_ns: u64) -> bool {
        if self.has_deadline() {
            self.is_over = self.is_over || !self.has_room_for(nominal_ns);
        }
        !self.is_over
    }

    fn has_room_for(&self, units: u64) -> bool {
        match self.budget {
            Budget::Unlimited => true,
            Budget::Work(total) => self.spent_units.saturating_add(units) <= total,
            Budget::Millis(ms) => {
                let needed = units as f64 * 1e-6 + self.reserve_ms;
                self.elapsed_ms() + needed <= ms
            }
        }
    }

    /// Whether the budget is one of wall-clock time.
    #[must_use]
    pub fn has_deadline(&self) -> bool {
        matches!(self.budget, Budget::Millis(_))
    }

    /// Nominal nanoseconds that are left.
    #[must_use]
    pub fn units_left(&self) -> u64 {
        match self.budget {
            Budget::Unlimited => u64::MAX,
            Budget::Work(total) => total.saturating_sub(self.spent_units),
            // The conversion saturates at zero.
            Budget::Millis(ms) => ((ms - self.elapsed_ms() - self.reserve_ms) * 1e6) as u64,
        }
    }

    /// How many steps were admitted.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Books `units` of finished work.
    pub fn spend(&mut self, units: u64) {
        self.spent_units = self.spent_units.saturating_add(units);
    }

    /// Work units booked so far.
    #[must_use]
    pub fn spent_units(&self) -> u64 {
        self.spent_units
    }

    /// Milliseconds since the start; zero when the clock has run backwards.
    #[must_use]
    pub fn elapsed_ms(&self) -> f64 {
        (self.clock.now_ms() - self.start_ms).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::ManualClock;

    #[test]
    fn no_work_is_admitted_past_the_deadline_or_into_the_reserve() {
        let clock = ManualClock::default();
        let mut allowance = Allowance::new(Budget::from_millis(2.0), &clock, clock.now_ms());
        allowance.reserve_ms(0.5);
        assert!(allowance.admit(1_500_000));
        clock.advance_ms(1.5);
        assert!(allowance.admit(0));
        clock.advance_ms(0.001);
        assert!(!allowance.admit(0));
        assert_eq!(allowance.steps(), 2);
    }

    #[test]
    fn the_first_refusal_is_the_last_word() {
        let clock = ManualClock::default();
        clock.advance_ms(10.0);
        let mut allowance = Allowance::new(Budget::from_millis(2.0), &clock, clock.now_ms());
        assert!(!allowance.admit(2_000_001));
        assert!(!allowance.admit(1));
        allowance = Allowance::new(Budget::Work(100), &clock, 0.0);
        assert!(!allowance.admit(101));
        assert!(!allowance.admit(1));
        assert_eq!(allowance.steps(), 0);
    }

    #[test]
    fn what_is_free_is_refused_by_the_clock_only() {
        let clock = ManualClock::default();
        let mut allowance = Allowance::new(Budget::Work(0), &clock, 0.0);
        assert!(allowance.admit_free(1_000_000));
        allowance = Allowance::new(Budget::from_millis(1.0), &clock, 0.0);
        assert!(allowance.admit_free(1_000_000));
        assert_eq!((allowance.steps(), allowance.spent_units()), (0, 0));
        clock.advance_ms(0.5);
        assert!(!allowance.admit_free(500_001));
        assert!(!allowance.admit(0), "the first refusal is the last word");
    }

    #[test]
    fn work_budgets_do_not_look_at_the_clock() {
        let clock = ManualClock::default();
        let mut allowance = Allowance::new(Budget::Work(100), &clock, 0.0);
        clock.advance_ms(1e6);
        assert!(allowance.admit(100));
        allowance.spend(60);
        assert!(!allowance.admit(41));
        assert_eq!(allowance.units_left(), 40);
    }

    #[test]
    fn odd_milliseconds_are_no_time_at_all() {
        assert_eq!(Budget::from_millis(f64::NAN), Budget::Millis(0.0));
        assert_eq!(Budget::from_millis(-3.0), Budget::Millis(0.0));
    }
}
