//! What a candidate is worth, as far as the order of work is concerned.

const OCTAVES: i32 = 64;
const BUCKETS_PER_OCTAVE: i32 = 4;

/// How many ranks there are, [`Rank::NEVER`] included.
pub(super) const BUCKETS: usize = (OCTAVES * BUCKETS_PER_OCTAVE) as usize;

/// Benefit per nominal cost on a scale of a quarter of an octave, over 64 octaves: as the values are estimates, that is as good as
/// an exact order. The greater comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Rank(u8);

impl Rank {
    /// Of something that is no candidate.
    pub const NEVER: Self = Self(0);

    /// The last one of a candidate: zero, negative and NaN.
    pub const LAST: Self = Self(1);

    /// The rank of a value; infinite ones come first.
    #[inline]
    #[must_use]
    pub fn new(value: f32) -> Self {
        if value.is_nan() || value <= 0.0 {
            return Self::LAST;
        }
        // The exponent and the two top bits of the mantissa.
        let quarter_octaves = (value.to_bits() >> 21) as i32;
        let of_one = (1.0_f32.to_bits() >> 21) as i32;
        let bucket = quarter_octaves - of_one + BUCKETS as i32 / 2;
        Self(bucket.clamp(1, BUCKETS as i32 - 1) as u8)
    }

    /// Its number, below [`BUCKETS`].
    pub(super) fn bucket(self) -> usize {
        usize::from(self.0)
    }
}

/// A set of ranks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RankSet([u64; BUCKETS / 64]);

impl RankSet {
    /// Adds a rank.
    pub(super) fn insert(&mut self, rank: Rank) {
        self.0[rank.bucket() / 64] |= 1 << (rank.bucket() % 64);
    }

    /// Takes a rank out.
    pub(super) fn remove(&mut self, rank: Rank) {
        self.0[rank.bucket() / 64] &= !(1 << (rank.bucket() % 64));
    }

    /// Whether it holds a rank.
    pub(super) fn contains(&self, rank: Rank) -> bool {
        self.0[rank.bucket() / 64] >> (rank.bucket() % 64) & 1 == 1
    }

    /// The greatest rank that it holds.
    pub(super) fn best(&self) -> Option<Rank> {
        let word = self.0.iter().rposition(|&bits| bits != 0)?;
        let index = word * 64 + 63 - self.0[word].leading_zeros() as usize;
        Some(Rank(index as u8))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_in_the_order_of_their_values() {
        let values = [-1.0, 1e-9, 1e-3, 0.9, 1.0, 1.3, 7.0, 1e9, f32::INFINITY];
        let ranks = values.map(Rank::new);
        assert!(ranks.is_sorted_by(|a, b| a < b), "{ranks:?}");
        assert_eq!(Rank::new(f32::NAN), Rank::LAST);
        assert_eq!(Rank::new(1e-30), Rank::LAST);
        assert!(Rank::NEVER < Rank::LAST);
    }

    #[test]
    fn a_set_knows_its_best_rank() {
        let mut set = RankSet::default();
        assert_eq!(set.best(), None);
        for value in [1.0, 1e9, 1e-9] {
            set.insert(Rank::new(value));
        }
        assert_eq!(set.best(), Some(Rank::new(1e9)));
        set.remove(Rank::new(1e9));
        assert_eq!(set.best(), Some(Rank::new(1.0)));
        assert!(set.contains(Rank::new(1e-9)) && !set.contains(Rank::new(1e9)));
    }
}
