//! What the rows of a soak come to.

use super::SoakRow;
use serde::Serialize;
use std::collections::BTreeMap;

/// Our overshoot may exceed the null engine's by so many milliseconds, at the median, p95 and p99.
const MOST_EXCESS_MS: f64 = 0.02;

/// The same at p99.9.
const MOST_RARE_EXCESS_MS: f64 = 0.1;

/// A budgeted frame does so much of the work that an unhurried one does.
const LEAST_WORK_SHARE: f64 = 0.9;

/// Overshoot in milliseconds, negative when early. Quantiles are by nearest rank.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct OvershootMs {
    /// Half of the frames overshoot no more.
    pub p50: f64,
    /// 95 % of them.
    pub p95: f64,
    /// 99 % of them.
    pub p99: f64,
    /// 99.9 % of them.
    pub p99_9: f64,
    /// The latest of all.
    pub max: f64,
}

impl OvershootMs {
    fn of(overshoots: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = overshoots.collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let at = |per_mille| quantile(&sorted, per_mille);
        Self {
            p50: at(500),
            p95: at(950),
            p99: at(990),
            p99_9: at(999),
            max: at(1000),
        }
    }

    fn less(self, other: Self) -> Self {
        Self {
            p50: self.p50 - other.p50,
            p95: self.p95 - other.p95,
            p99: self.p99 - other.p99,
            p99_9: self.p99_9 - other.p99_9,
            max: self.max - other.max,
        }
    }
}

/// The smallest of ascending values that at least `per_mille` thousandths of them do not exceed; zero of nothing.
pub(super) fn quantile(ascending: &[f64], per_mille: usize) -> f64 {
    let rank = (ascending.len() * per_mille).div_ceil(1000).max(1);
    ascending.get(rank - 1).copied().unwrap_or(0.0)
}

/// Frames with something in common, and how many of them were late.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LateFrames {
    /// All of them.
    pub frames: u64,
    /// Those that returned after their deadline.
    pub late: u64,
    /// Those that returned after it by more than the null engine beside them.
    pub later_than_null: u64,
}

impl LateFrames {
    fn add(&mut self, row: &SoakRow) {
        self.frames += 1;
        self.late += u64::from(row.overshoot_ms() > 0.0);
        self.later_than_null += u64::from(row.overshoot_ms() > row.null_overshoot_ms().max(0.0));
    }
}

/// The work of frames that did not finish their image, beside what they could have done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct WorkDone {
    /// Frames compared.
    pub frames: u64,
    /// Their work units.
    pub units: u64,
    /// Those of frames without a clock in the same time.
    pub unhurried_units: u64,
    /// The ratio of both; zero of nothing.
    pub share: f64,
}

impl WorkDone {
    fn of<'a>(rows: impl Iterator<Item = &'a SoakRow>) -> Option<Self> {
        let mut work = Self::default();
        for row in rows.filter(|row| !row.converged) {
            if let Some(unhurried) = row.unhurried_units {
                work.frames += 1;
                work.units += row.work_units;
                work.unhurried_units += unhurried;
            }
        }
        work.share = work.units as f64 / work.unhurried_units.max(1) as f64;
        (work.frames > 0).then_some(work)
    }
}

/// Which targets are met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Verdicts {
    /// Median overshoot at most the null engine's and 0.02 ms.
    pub p50: bool,
    /// The same at p95.
    pub p95: bool,
    /// The same at p99.
    pub p99: bool,
    /// At p99.9 at most the null engine's and 0.1 ms.
    pub p99_9: bool,
    /// At least 0.9 of the work; `None` where none was compared.
    pub work: Option<bool>,
}

impl Verdicts {
    /// Names and verdicts, in the order of the fields, for reports.
    #[must_use]
    pub fn entries(&self) -> [(&'static str, Option<bool>); 5] {
        [
            ("p50", Some(self.p50)),
            ("p95", Some(self.p95)),
            ("p99", Some(self.p99)),
            ("p99.9", Some(self.p99_9)),
            ("work", self.work),
        ]
    }
}

/// What a number of frames come to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SoakSummary {
    /// How many there are, and how many of them are late.
    #[serde(flatten)]
    pub frames: LateFrames,
    /// How many frames of the null engine are late.
    pub null_late: u64,
    /// Ours.
    pub overshoot_ms: OvershootMs,
    /// The null engine's.
    pub null_overshoot_ms: OvershootMs,
    /// The first less the second.
    pub excess_ms: OvershootMs,
    /// The work done in time.
    pub work: Option<WorkDone>,
    /// Whether all that is good enough.
    pub verdicts: Verdicts,
    /// Frames by their outcome's name.
    pub outcomes: BTreeMap<&'static str, LateFrames>,
    /// Late frames by the stage that took longest.
    pub late_in: BTreeMap<&'static str, u64>,
}

impl SoakSummary {
    /// Sums up rows; `None` if there are none.
    pub fn of<'a>(rows: impl IntoIterator<Item = &'a SoakRow>) -> Option<Self> {
        let rows: Vec<&SoakRow> = rows.into_iter().collect();
        if rows.is_empty() {
            return None;
        }
        let (mut frames, mut null_late) = (LateFrames::default(), 0);
        let mut outcomes = BTreeMap::<_, LateFrames>::new();
        let mut late_in = BTreeMap::new();
        for row in &rows {
            frames.add(row);
            outcomes.entry(row.outcome).or_default().add(row);
            null_late += u64::from(row.null_overshoot_ms() > 0.0);
            if row.overshoot_ms() > 0.0 {
                *late_in.entry(longest_stage(row)).or_default() += 1;
            }
        }
        let ours = OvershootMs::of(rows.iter().map(|row| row.overshoot_ms()));
        let null = OvershootMs::of(rows.iter().map(|row| row.null_overshoot_ms()));
        let excess = ours.less(null);
        let work = WorkDone::of(rows.iter().copied());
        Some(Self {
            frames,
            null_late,
            overshoot_ms: ours,
            null_overshoot_ms: null,
            excess_ms: excess,
            work,
            verdicts: Verdicts {
                p50: excess.p50 <= MOST_EXCESS_MS,
                p95: excess.p95 <= MOST_EXCESS_MS,
                p99: excess.p99 <= MOST_EXCESS_MS,
                p99_9: excess.p99_9 <= MOST_RARE_EXCESS_MS,
                work: work.map(|work| work.share >= LEAST_WORK_SHARE),
            },
            outcomes,
            late_in,
        })
    }
}

/// The name of the stage that took longest.
fn longest_stage(row: &SoakRow) -> &'static str {
    let stages = row.stage_ms.entries();
    let longest = stages.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
    longest.map_or("", |(name, _)| name)
}
