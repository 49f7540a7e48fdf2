//! What a frame may cost, and how much of it is left.

use super::{CancelToken, DIVISORS, FrameRecord};
use crate::clock::Clock;

/// What one frame may cost.
///
/// # The promise
///
/// A frame under [`Millis`](Self::Millis) returns by its deadline, handing the image over included. The clock is looked at
/// between pieces of work of some 50 microseconds.
///
/// 1. When the first image, Gouraud-shaded, fits into the budget, it is drawn, and what is left of the time refines it; as far as that can be
///    foretold, before it gets its colours: if all of it can be shaded per pixel, it is. The next frame of a still view goes on from there.
/// 2. When it does not fit because of its pixels, it is drawn at a **lower resolution**, a half to a quarter of the width and height, and
///    enlarged ([`Outcome::Reduced`](crate::frame::Outcome::Reduced)). While the view stays, the following frames draw it at full
///    resolution.
/// 3. When it does not fit because of its triangles, it is drawn **over several frames**, each going on where the last one had to stop,
///    of the camera and scene as they were when it was begun. Until it is complete the image before it stays
///    ([`Outcome::Stale`](crate::frame::Outcome::Stale)); without one the frame shows the background.
///
/// Nothing is silently left out of the picture, and the outcome says which case it was. Not interrupted are: placing objects that have moved,
/// making ready for a replaced scene or another image size, culling (some 10 microseconds for a thousand clusters), colouring a first image in place of
/// the one shown, and handing an image over. The last two are predicted, and not begun when they would not end in time. A budget less than handing over takes cannot be
/// kept; the frame is as little late as can be, and draws a piece of the image all the same. Backends other than the software one draw a first image as a
/// whole, late if need be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// Wall-clock milliseconds from the call of `render` to its return, by the engine's clock. Of an image begun under such a budget,
    /// what refinement found out in the images before decides what is looked at first, and final images may differ by a code from those under other budgets,
    /// on which nothing that came before has any influence. Zero buys a first image at full resolution,
    /// however long that takes, and no refinement.
    Millis(f64),
    /// Work units: nominal nanoseconds of refinement (see [`cost`](super::cost)). The result is the same, bit for
    /// bit, for any number of threads and at any speed of the machine. The first image is always completed and costs none. A step is done whole or not at all, and the best
    /// one comes first: less than some 20,000 units a frame (100,000 with a hundred lights) may get nowhere.
    Work(u64),
    /// Refine until the estimated root mean square error is at most so many 8-bit codes; see
    /// [`FrameStats::estimated_error`](crate::frame::FrameStats::estimated_error).
    Error(f64),
    /// Refine until the image equals per-pixel Phong shading.
    Unlimited,
    /// What a frame with another budget did, as its [`FrameStats::record`](crate::frame::FrameStats::record) has it.
    Replay(FrameRecord),
}

impl Budget {
    /// A wall-clock budget in milliseconds. Negative and NaN count as zero: the first image only.
    #[must_use]
    pub fn from_millis(ms: f64) -> Self {
        Self::Millis(if ms > 0.0 { ms } else { 0.0 })
    }
}

/// A budget being spent.
#[derive(Clone, Debug)]
pub struct Allowance<'a> {
    budget: Budget,
    clock: &'a dyn Clock,
    cancel: &'a CancelToken,
    start_ms: f64,
    reserve_ms: f64,
    ms_per_unit: f64,
    is_first_image_bounded: bool,
    spent_units: u64,
    free_ns: u64,
    is_over: bool,
    /// What has been done so far.
    done: FrameRecord,
}

impl<'a> Allowance<'a> {
    /// Starts to spend `budget` at `start_ms` of `clock`.
    #[must_use]
    pub fn new(
        budget: Budget,
        clock: &'a dyn Clock,
        start_ms: f64,
        cancel: &'a CancelToken,
    ) -> Self {
        Self {
            budget,
            clock,
            cancel,
            start_ms,
            reserve_ms: 0.0,
            ms_per_unit: 1e-6,
            is_first_image_bounded: true,
            spent_units: 0,
            free_ns: 0,
            is_over: false,
            done: FrameRecord {
                is_timed: match budget {
                    Budget::Replay(record) => record.is_timed,
                    _ => matches!(budget, Budget::Millis(_)),
                },
                ..FrameRecord::default()
            },
        }
    }

    /// The budget with its first images completed even if they are late.
    #[must_use]
    pub fn with_whole_first_images(self) -> Self {
        Self {
            is_first_image_bounded: false,
            ..self
        }
    }

    /// Keeps `ms` of a wall-clock budget for what comes afterwards.
    pub fn reserve_ms(&mut self, ms: f64) {
        self.reserve_ms = ms.max(0.0);
    }

    /// Says how long a nominal nanosecond of refinement will take from now on.
    pub fn set_ms_per_unit(&mut self, ms: f64) {
        self.ms_per_unit = ms.max(0.0);
    }

    /// The wall-clock milliseconds within which a first image has to be drawn; `None` where it may take as long as it takes.
    #[must_use]
    pub fn first_image_ms(&self) -> Option<f64> {
        match self.budget {
            Budget::Millis(ms) if ms > 0.0 && self.is_first_image_bounded => Some(ms),
            _ => None,
        }
    }

    /// The divisor for a first image that a replayed frame has to have.
    #[must_use]
    pub fn replayed_divisor(&self) -> Option<u32> {
        match self.budget {
            // Records come from files, too.
            Budget::Replay(record) => Some(
                record
                    .divisor
                    .clamp(DIVISORS[0], DIVISORS[DIVISORS.len() - 1]),
            ),
            _ => None,
        }
    }

    /// In how many rounds the triangles of the first image in hand are to be divided in a replayed frame, and whether the last of them is to
    /// be taken back.
    #[must_use]
    pub fn replayed_rounds(&self) -> Option<(u32, bool)> {
        match self.budget {
            Budget::Replay(record) => {
                let bits = record.divisions >> self.place_of_rounds();
                Some((bits & 7, bits & 8 != 0))
            }
            _ => None,
        }
    }

    /// Notes in how many rounds the triangles of the first image in hand have been divided, and whether the last was taken back.
    pub fn note_rounds(&mut self, rounds: u32, taken_back: bool) {
        let bits = rounds.min(7) | u32::from(taken_back) << 3;
        self.done.divisions |= bits << self.place_of_rounds();
    }

    /// Where the record has the rounds of the image in hand. Nobody completes more than eight in a frame.
    fn place_of_rounds(&self) -> u32 {
        4 * self.done.images.min(7)
    }

    /// How many triangles of the first image in hand are to be lit in a replayed frame; see [`FrameRecord::lit`].
    #[must_use]
    pub fn replayed_lit(&self) -> Option<u32> {
        match self.budget {
            Budget::Replay(record) => Some(record.lit[self.place_of_lit()]),
            _ => None,
        }
    }

    /// Notes how many triangles of the first image in hand have been lit.
    pub fn note_lit(&mut self, triangles: u32) {
        let place = self.place_of_lit();
        self.done.lit[place] = self.done.lit[place].max(triangles);
    }

    /// Where the record has that of the image in hand.
    fn place_of_lit(&self) -> usize {
        usize::from(self.done.images > 0)
    }

    /// Whether there is room for `units` of work that, with what has to come after it, will take `ms` milliseconds. Unlike
    /// [`admit`](Self::admit) it may be asked again, for less.
    #[must_use]
    pub fn affords(&self, units: u64, ms: f64) -> bool {
        if self.is_over || self.is_cancelled() {
            return false;
        }
        match self.budget {
            Budget::Unlimited | Budget::Error(_) => true,
            Budget::Work(total) => self.spent_units.saturating_add(units) <= total,
            Budget::Replay(_) => false,
            Budget::Millis(budget_ms) => self.elapsed_ms() + ms <= budget_ms,
        }
    }

    /// When the frame has to end, in milliseconds since its start; `None` under any other budget than one of wall-clock time, and when it
    /// has been cancelled.
    #[must_use]
    pub fn deadline_ms(&self) -> Option<f64> {
        match self.budget {
            Budget::Millis(ms) if !self.is_over && !self.is_cancelled() => Some(ms),
            _ => None,
        }
    }

    /// Notes the divisor chosen.
    pub fn note_divisor(&mut self, divisor: u32) {
        self.done.divisor = divisor;
    }

    /// Whether a first image may be begun, or gone on with: notes that it is.
    ///
    /// The first one of a frame may be even if time is up, unless the token says otherwise. What cannot be interrupted may take all of
    /// every frame's time, and yet a piece of the image is drawn in each, so that it comes about.
    #[must_use]
    pub fn begins_image(&mut self) -> bool {
        let may_begin = match self.budget {
            Budget::Replay(record) => record.images > self.done.images || record.is_image_begun,
            _ => {
                let is_first = self.done.images == 0 && !self.done.is_image_begun;
                self.goes_on() || is_first && !self.cancel.is_cancelled()
            }
        };
        self.done.is_image_begun |= may_begin;
        may_begin
    }

    /// Whether the first image in hand may be gone on with: asked between pieces of work, by any thread.
    #[must_use]
    pub fn goes_on(&self) -> bool {
        match (self.budget, self.first_image_ms()) {
            (Budget::Replay(record), _) => record.images > self.done.images,
            (_, Some(ms)) => {
                !self.cancel.is_cancelled() && self.elapsed_ms() + self.reserve_ms <= ms
            }
            _ => true,
        }
    }

    /// Whether something of the first image in hand that takes `ms` milliseconds, and cannot be interrupted, may be begun.
    #[must_use]
    pub fn has_time_for(&self, ms: f64) -> bool {
        match self.first_image_ms() {
            Some(budget) => self.goes_on() && self.elapsed_ms() + ms <= budget,
            None => self.goes_on(),
        }
    }

    /// Whether the first image in hand is to be completed in this frame, as far as a replay has a say in it.
    #[must_use]
    pub fn completes_image(&self) -> bool {
        !matches!(self.budget, Budget::Replay(record) if record.images <= self.done.images)
    }

    /// Notes that the first image in hand is complete.
    pub fn note_image(&mut self) {
        self.done.images += 1;
        self.done.is_image_begun = false;
    }

    /// Admits a step of `units` nominal nanoseconds, or ends the frame's refinement: a wall-clock budget admits it while
    /// the deadline, less the reserve and what the step will take, lies ahead.
    ///
    /// **After the first refusal nothing is admitted any more.** So what a frame does is the beginning of what an unlimited
    /// one does, whatever the clock said, and the number of steps says how much of it.
    #[must_use]
    pub fn admit(&mut self, units: u64) -> bool {
        self.is_over = self.is_over || !self.has_room_for(units);
        self.done.steps += u64::from(!self.is_over);
        !self.is_over
    }

    /// Admits work of about `nominal_ns` nanoseconds that costs no work units and is no step, or ends the frame's refinement like
    /// [`admit`](Self::admit): only a wall-clock budget, or a token, can refuse it.
    #[must_use]
    pub fn admit_free(&mut self, nominal_ns: u64) -> bool {
        let is_bounded = self.has_deadline() || self.is_cancelled();
        self.is_over = self.is_over || is_bounded && !self.has_room_for(nominal_ns);
        !self.is_over
    }

    /// Whether the budget is one of wall-clock time.
    #[must_use]
    pub fn has_deadline(&self) -> bool {
        matches!(self.budget, Budget::Millis(_))
    }

    /// Whether there is a deadline, less the reserve, that has not come yet: if work was refused, then because it would take too long.
    #[must_use]
    pub fn is_before_deadline(&self) -> bool {
        match self.budget {
            Budget::Millis(ms) => !self.is_cancelled() && self.elapsed_ms() + self.reserve_ms < ms,
            _ => false,
        }
    }

    /// Whether the frame, or the one that is replayed, has a wall-clock budget.
    #[must_use]
    pub fn is_timed(&self) -> bool {
        match self.budget {
            Budget::Replay(record) => record.is_timed,
            _ => self.has_deadline(),
        }
    }

    /// Whether refinement is to stop: a replay has been stopped already, when it was recorded.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled() && !matches!(self.budget, Budget::Replay(_))
    }

    fn has_room_for(&self, units: u64) -> bool {
        if self.is_cancelled() {
            return false;
        }
        match self.budget {
            Budget::Unlimited | Budget::Error(_) => true,
            Budget::Work(total) => self.spent_units.saturating_add(units) <= total,
            Budget::Replay(record) => self.done.steps < record.steps,
            Budget::Millis(ms) => {
                let needed = units as f64 * self.ms_per_unit + self.reserve_ms;
                self.elapsed_ms() + needed <= ms
            }
        }
    }

    /// Whether an image whose estimated error is `rmse` codes is good enough.
    #[must_use]
    pub fn is_satisfied_by(&self, rmse: f64) -> bool {
        matches!(self.budget, Budget::Error(target) if rmse <= target)
    }

    /// Nominal nanoseconds that are left.
    #[must_use]
    pub fn units_left(&self) -> u64 {
        match self.budget {
            Budget::Unlimited | Budget::Error(_) | Budget::Replay(_) => u64::MAX,
            Budget::Work(total) => total.saturating_sub(self.spent_units),
            // The conversion saturates, and makes zero of NaN.
            Budget::Millis(ms) => {
                ((ms - self.elapsed_ms() - self.reserve_ms) / self.ms_per_unit) as u64
            }
        }
    }

    /// Books `units` of finished work.
    pub fn spend(&mut self, units: u64) {
        self.spent_units = self.spent_units.saturating_add(units);
    }

    /// Takes note of `nominal_ns` of finished work that costs no units.
    pub fn note_free(&mut self, nominal_ns: u64) {
        self.free_ns = self.free_ns.saturating_add(nominal_ns);
    }

    /// Nominal nanoseconds of all work so far, work units or not.
    #[must_use]
    pub fn nominal_ns(&self) -> u64 {
        self.spent_units.saturating_add(self.free_ns)
    }

    /// Work units booked so far.
    #[must_use]
    pub fn spent_units(&self) -> u64 {
        self.spent_units
    }

    /// What has been done so far, for [`Budget::Replay`].
    #[must_use]
    pub fn record(&self) -> FrameRecord {
        self.done
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

    fn start<'a>(budget: Budget, clock: &'a ManualClock, cancel: &'a CancelToken) -> Allowance<'a> {
        Allowance::new(budget, clock, clock.now_ms(), cancel)
    }

    #[test]
    fn no_work_is_admitted_past_the_deadline_or_into_the_reserve() {
        let (clock, cancel) = (ManualClock::default(), CancelToken::new());
        let mut allowance = start(Budget::from_millis(2.0), &clock, &cancel);
        allowance.reserve_ms(0.5);
        assert!(allowance.admit(1_500_000));
        clock.advance_ms(1.5);
        assert!(allowance.admit(0) && allowance.goes_on());
        clock.advance_ms(0.001);
        assert!(!allowance.admit(0) && !allowance.goes_on());
        assert_eq!(allowance.record().steps, 2);
    }

    #[test]
    fn units_take_as_long_as_they_were_found_to() {
        let (clock, cancel) = (ManualClock::default(), CancelToken::new());
        let mut allowance = start(Budget::from_millis(2.0), &clock, &cancel);
        allowance.set_ms_per_unit(0.5e-6);
        assert_eq!(allowance.units_left(), 4_000_000);
        assert!(allowance.admit(4_000_000) && !allowance.admit(4_000_001));
    }

    #[test]
    fn the_first_refusal_is_the_last_word() {
        let (clock, cancel) = (ManualClock::default(), CancelToken::new());
        clock.advance_ms(10.0);
        let mut allowance = start(Budget::from_millis(2.0), &clock, &cancel);
        assert!(!allowance.admit(2_000_001));
        assert!(!allowance.admit(1));
        allowance = start(Budget::Work(100), &clock, &cancel);
        assert!(!allowance.admit(101));
        assert!(!allowance.admit(1));
        assert_eq!(allowance.record().steps, 0);
    }

    #[test]
    fn what_is_free_is_refused_by_the_clock_only() {
        let (clock, cancel) = (ManualClock::default(), CancelToken::new());
        let mut allowance = start(Budget::Work(0), &clock, &cancel);
        assert!(allowance.admit_free(1_000_000));
        allowance = start(Budget::from_millis(1.0), &clock, &cancel);
        assert!(allowance.admit_free(1_000_000));
        assert_eq!((allowance.record().steps, allowance.spent_units()), (0, 0));
        clock.advance_ms(0.5);
        assert!(!allowance.admit_free(500_001));
        assert!(!allowance.admit(0), "the first refusal is the last word");
    }

    #[test]
    fn a_frame_that_is_late_already_begins_one_image_unless_it_is_cancelled() {
        let (clock, cancel) = (ManualClock::default(), CancelToken::new());
        let mut allowance = start(Budget::from_millis(1.0), &clock, &cancel);
        clock.advance_ms(2.0);
        assert!(!allowance.goes_on() && allowance.begins_image() && !allowance.begins_image());
        allowance.note_image();
        assert!(!allowance.begins_image());
        allowance = start(Budget::from_millis(1.0), &clock, &cancel);
        cancel.cancel();
        assert!(!allowance.begins_image());
    }

    #[test]
    fn work_budgets_do_not_look_at_the_clock() {
        let (clock, cancel) = (ManualClock::default(), CancelToken::new());
        let mut allowance = start(Budget::Work(100), &clock, &cancel);
        clock.advance_ms(1e6);
        assert!(allowance.begins_image() && allowance.has_time_for(1e9));
        assert!(allowance.admit(100));
        allowance.spend(60);
        assert_eq!(allowance.units_left(), 40);
        assert!(!allowance.admit(41));
    }

    #[test]
    fn a_cancelled_token_ends_refinement_of_any_budget_and_first_images_under_a_deadline() {
        let (clock, cancel) = (ManualClock::default(), CancelToken::new());
        for budget in [
            Budget::Unlimited,
            Budget::Work(100),
            Budget::Millis(1.0),
            Budget::Error(0.1),
        ] {
            let mut allowance = start(budget, &clock, &cancel);
            assert!(allowance.admit(1) && allowance.goes_on());
            cancel.cancel();
            assert!(!allowance.admit(1));
            assert_eq!(allowance.goes_on(), !matches!(budget, Budget::Millis(_)));
            cancel.reset();
        }
    }

    #[test]
    fn a_replay_does_as_much_as_was_done() {
        let (clock, cancel) = (ManualClock::default(), CancelToken::new());
        let mut timed = start(Budget::Millis(2.0), &clock, &cancel);
        timed.note_divisor(2);
        assert!(timed.begins_image());
        timed.note_image();
        assert!(timed.admit(10) && timed.admit(10));
        clock.advance_ms(5.0);
        assert!(!timed.admit(1) && !timed.begins_image());
        let record = timed.record();
        let mut replay = start(Budget::Replay(record), &clock, &cancel);
        replay.note_divisor(replay.replayed_divisor().expect("it is a replay"));
        assert!(replay.begins_image() && replay.goes_on());
        replay.note_image();
        assert!(!replay.begins_image() && !replay.goes_on());
        assert!(replay.admit(u64::MAX) && replay.admit(1) && !replay.admit(0));
        assert_eq!(replay.record(), record);
    }

    #[test]
    fn odd_milliseconds_are_no_time_at_all() {
        assert_eq!(Budget::from_millis(f64::NAN), Budget::Millis(0.0));
        assert_eq!(Budget::from_millis(-3.0), Budget::Millis(0.0));
        let (clock, cancel) = (ManualClock::default(), CancelToken::new());
        // But for a first image.
        assert!(start(Budget::Millis(0.0), &clock, &cancel).begins_image());
        for odd in [f64::NAN, -1.0] {
            let mut allowance = start(Budget::Millis(odd), &clock, &cancel);
            assert!(!allowance.admit(1));
            assert_eq!(allowance.units_left(), 0);
        }
    }
}
