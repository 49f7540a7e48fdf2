//! How much work fits in a time.
//!
//! An engine without a deadline cannot be asked how far it was at some time without becoming one that looks at a
//! clock. But frames under [`Budget::Work`](crate::Budget::Work) never look at it, and each is the beginning of any longer one.
//! So the answer is the largest of these budgets whose frames take no longer, found by bisection of medians.

/// Frames of each budget tried.
const REPEATS: usize = 3;

/// The factor between budgets while the answer is being hemmed in: guesses come from a frame that was about as long.
const STRIDE: f64 = 1.25;

/// Strides at most, to either side: more than enough for a guess of zero.
const MOST_STRIDES: u32 = 60;

/// The budget is halved in size so often between two strides: what is left is 1.5 % wide.
const BISECTIONS: u32 = 4;

/// Fewer units are not told apart.
const LEAST_UNITS: u64 = 1_000;

/// A frame under a work budget.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Trial {
    /// Milliseconds from call to return.
    pub(super) ms: f64,
    /// Units of work done.
    pub(super) units: u64,
    /// Whether there was no more to be done.
    pub(super) converged: bool,
}

/// The units done by the longest frame that takes at most `ms` milliseconds; `render` renders one of so many units. The
/// search begins at `guess`.
pub(super) fn most_units(ms: f64, guess: u64, mut render: impl FnMut(u64) -> Trial) -> u64 {
    let mut median = |units: u64| {
        let mut trials = [(); REPEATS].map(|()| render(units));
        trials.sort_unstable_by(|a, b| a.ms.total_cmp(&b.ms));
        trials[REPEATS / 2]
    };
    let mut best = 0;
    let mut low = guess.max(LEAST_UNITS);
    let mut high = low;
    for _ in 0..MOST_STRIDES {
        let trial = median(high);
        if trial.ms > ms {
            break;
        }
        best = best.max(trial.units);
        low = high;
        if trial.converged {
            return best;
        }
        high = (high as f64 * STRIDE) as u64;
    }
    while best == 0 && low > LEAST_UNITS {
        // Not even the guess fits.
        high = low;
        low = (low as f64 / STRIDE) as u64;
        let trial = median(low);
        if trial.ms <= ms {
            best = trial.units;
            break;
        }
    }
    for _ in 0..BISECTIONS {
        let middle = u64::midpoint(low, high);
        let trial = median(middle);
        if trial.ms <= ms {
            best = best.max(trial.units);
            low = middle;
        } else {
            high = middle;
        }
    }
    best
}
