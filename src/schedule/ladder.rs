//! Which resolution a first image gets when it does not fit into the budget.
//!
//! An image of divisor `d` has a `d`-th of the width and of the height. The rungs of the ladder are the [`DIVISORS`].
//!
//! * The **step down** is taken at once: as soon as the image at the present divisor is predicted not to fit, the smallest divisor is taken
//!   that fits with [`ROOM`] to spare. After an image that was not there in time, against the prediction, the present one has to fit with room
//!   to spare, too.
//! * The **step up** is taken when a smaller divisor has been predicted to fit, with room to spare, for some images in a row. If
//!   it has to be taken back soon after, the next one is waited for twice as long. So noise in predictions does not
//!   make the resolution flicker. One that is predicted to take at most [`DOUBTLESS`] of the budget is not waited for: a larger budget
//!   counts at once.
//! * When **no** divisor helps, because triangles and not pixels take the time, the image is drawn over several frames, at the smallest
//!   divisor that at least its last steps fit with, which cannot be interrupted.
//!
//! The ladder is asked in every frame that has a first image to draw; one drawn over several frames counts in each of them.

/// Divisors of the image's sides, the full resolution first.
pub const DIVISORS: [u32; 4] = [1, 2, 3, 4];

/// Of the budget, what an image may take that has not been tried at its divisor.
const ROOM: f64 = 0.85;

/// Of the budget, what an image may take that is taken without waiting. Predictions are not that far off.
const DOUBTLESS: f64 = 0.7;

/// Images in a row that a smaller divisor has to fit before it is taken.
const LEAST_PATIENCE: u32 = 8;

/// The longest that a step up is waited for, in images.
const MOST_PATIENCE: u32 = 256;

/// What an image is predicted to take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Milliseconds for the whole of it, handing over included.
    pub whole_ms: f64,
    /// Milliseconds for what cannot be interrupted: colouring, and handing over.
    pub ending_ms: f64,
}

/// The divisor of the image drawn last, and how long it will stay.
#[derive(Clone, Debug)]
pub struct Ladder {
    /// Index in [`DIVISORS`].
    rung: usize,
    /// Images in a row for which a step up seemed possible.
    fitting: u32,
    /// How many of them there have to be.
    patience: u32,
    /// Images since the last step up.
    since_up: u32,
    /// The last image was not there in time.
    has_missed: bool,
}

impl Default for Ladder {
    fn default() -> Self {
        Self {
            rung: 0,
            fitting: 0,
            patience: LEAST_PATIENCE,
            since_up: u32::MAX,
            has_missed: false,
        }
    }
}

impl Ladder {
    /// The divisor for the next image, which has to be drawn within `budget_ms`.
    pub fn choose(&mut self, budget_ms: f64, forecast: impl Fn(u32) -> Forecast) -> u32 {
        self.since_up = self.since_up.saturating_add(1);
        // A forecast that is no number fits nothing.
        let fits = |rung: usize, share: f64| forecast(DIVISORS[rung]).whole_ms <= budget_ms * share;
        let ends = |rung: usize| forecast(DIVISORS[rung]).ending_ms <= budget_ms * ROOM;
        let last = DIVISORS.len() - 1;
        let rungs = || 0..DIVISORS.len();
        let wanted = rungs()
            .find(|&rung| fits(rung, ROOM))
            .or_else(|| rungs().find(|&rung| ends(rung)))
            .unwrap_or(last);
        let share = if std::mem::take(&mut self.has_missed) {
            ROOM
        } else {
            1.0
        };
        let is_enough = fits(self.rung, share) || wanted <= self.rung && ends(self.rung);
        if !is_enough && wanted > self.rung {
            self.step_down(wanted);
        } else if let Some(rung) = (0..self.rung).find(|&rung| fits(rung, DOUBTLESS)) {
            self.rung = rung;
            self.fitting = 0;
        } else if wanted < self.rung {
            self.consider_step_up(wanted);
        } else {
            self.fitting = 0;
        }
        DIVISORS[self.rung]
    }

    /// Takes note that the last image was not there in time.
    pub fn note_missed(&mut self) {
        self.has_missed = true;
    }

    fn step_down(&mut self, rung: usize) {
        if self.since_up <= self.patience.saturating_mul(2) {
            self.patience = self.patience.saturating_mul(2).min(MOST_PATIENCE);
        }
        self.rung = rung;
        self.fitting = 0;
    }

    fn consider_step_up(&mut self, rung: usize) {
        self.fitting += 1;
        if self.fitting < self.patience {
            return;
        }
        if self.since_up > self.patience.saturating_mul(4) {
            self.patience = LEAST_PATIENCE;
        }
        self.rung = rung;
        self.fitting = 0;
        self.since_up = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of so many milliseconds by triangles and by pixels at full resolution.
    fn frame(triangles_ms: f64, pixels_ms: f64) -> impl Fn(u32) -> Forecast {
        move |divisor| {
            let share = 1.0 / f64::from(divisor * divisor);
            Forecast {
                whole_ms: triangles_ms + pixels_ms * share + 0.5,
                ending_ms: pixels_ms * share * 0.4 + 0.5,
            }
        }
    }

    #[test]
    fn full_resolution_is_kept_while_it_fits() {
        let mut ladder = Ladder::default();
        for _ in 0..100 {
            assert_eq!(ladder.choose(8.0, frame(2.0, 5.0)), 1);
        }
    }

    #[test]
    fn the_smallest_divisor_that_fits_is_taken_at_once() {
        assert_eq!(Ladder::default().choose(6.0, frame(1.0, 12.0)), 2);
        assert_eq!(Ladder::default().choose(3.0, frame(1.0, 12.0)), 4);
    }

    #[test]
    fn triangles_are_no_reason_for_a_lower_resolution() {
        let mut ladder = Ladder::default();
        assert_eq!(ladder.choose(4.0, frame(20.0, 3.0)), 1);
        // Unless not even the end of the image would fit.
        assert_eq!(ladder.choose(4.0, frame(20.0, 20.0)), 2);
    }

    #[test]
    fn it_steps_up_when_there_has_been_room_for_a_while() {
        let mut ladder = Ladder::default();
        assert_eq!(ladder.choose(6.0, frame(1.0, 12.0)), 2);
        let images: Vec<u32> = (0..20)
            .map(|_| ladder.choose(17.0, frame(1.0, 12.0)))
            .collect();
        assert_eq!(images[..7], [2; 7]);
        assert_eq!(images[7..], [1; 13]);
        // Or at once, when there is plenty.
        assert_eq!(ladder.choose(6.0, frame(1.0, 12.0)), 2);
        assert_eq!(ladder.choose(33.0, frame(1.0, 12.0)), 1);
    }

    #[test]
    fn after_a_miss_there_has_to_be_room() {
        let mut ladder = Ladder::default();
        // 5.5 ms.
        assert_eq!(ladder.choose(6.0, frame(1.0, 4.0)), 1);
        ladder.note_missed();
        assert_eq!(ladder.choose(6.0, frame(1.0, 4.0)), 2);
        // Where triangles take the time, the next image will not be there in time either.
        let mut ladder = Ladder::default();
        for _ in 0..10 {
            assert_eq!(ladder.choose(4.0, frame(20.0, 3.0)), 1);
            ladder.note_missed();
        }
    }

    #[test]
    fn noise_does_not_make_it_oscillate() {
        // At full resolution the frame takes 6 ms in the mean, as the budget is, and up to a quarter more or less.
        let mut ladder = Ladder::default();
        let mut state = 7_u64;
        let mut changes = 0;
        let mut last = 1;
        for _ in 0..20_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let noise = 0.75 + 0.5 * (state >> 40) as f64 / f64::from(1 << 24);
            let divisor = ladder.choose(6.0, frame(1.0 * noise, 4.5 * noise));
            changes += u32::from(divisor != last);
            last = divisor;
        }
        assert!(changes < 20_000 / 100, "{changes} changes");
    }

    #[test]
    fn a_budget_that_flips_or_a_forecast_that_is_no_number_does_no_harm() {
        let mut ladder = Ladder::default();
        for _ in 0..1000 {
            assert!(ladder.choose(2.0, frame(0.5, 8.0)) > 1);
            assert_eq!(ladder.choose(100.0, frame(0.5, 8.0)), 1);
        }
        let unknown = |_| Forecast {
            whole_ms: f64::NAN,
            ending_ms: f64::NAN,
        };
        assert_eq!(Ladder::default().choose(1.0, unknown), 4);
        assert_eq!(Ladder::default().choose(f64::NAN, frame(1.0, 1.0)), 4);
    }
}
