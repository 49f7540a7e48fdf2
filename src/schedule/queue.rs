//! Candidates by rank, in buckets.
//!
//! A candidate's rank is benefit per nominal cost. Ranks are sorted into buckets of a quarter of an octave over 64
//! octaves; within a bucket the first to come is the first to go. That is as good as an exact order (the ranks are
//! estimates) and makes pushing and popping a few instructions each, whatever the number of candidates.
//!
//! Order depends only on the sequence of calls, never on addresses or time.

use std::collections::VecDeque;

const OCTAVES: i32 = 64;
const BUCKETS_PER_OCTAVE: i32 = 4;
const BUCKETS: usize = (OCTAVES * BUCKETS_PER_OCTAVE) as usize;

/// A priority queue of candidates, best rank first.
#[derive(Clone, Debug)]
pub struct RankedQueue<T> {
    buckets: Vec<VecDeque<T>>,
    /// A bit for each bucket that is not empty.
    occupied: [u64; BUCKETS / 64],
    len: usize,
}

impl<T> Default for RankedQueue<T> {
    fn default() -> Self {
        Self {
            buckets: (0..BUCKETS).map(|_| VecDeque::new()).collect(),
            occupied: [0; BUCKETS / 64],
            len: 0,
        }
    }
}

impl<T> RankedQueue<T> {
    /// Removes all candidates and keeps the memory.
    pub fn clear(&mut self) {
        for bucket in &mut self.buckets {
            bucket.clear();
        }
        self.occupied = [0; BUCKETS / 64];
        self.len = 0;
    }

    /// Number of candidates.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// True when there are no candidates.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds a candidate. Ranks that are zero, negative or NaN go last, infinite ones first.
    pub fn push(&mut self, rank: f32, candidate: T) {
        let index = bucket_of(rank);
        self.buckets[index].push_back(candidate);
        self.occupied[index / 64] |= 1 << (index % 64);
        self.len += 1;
    }

    /// Removes the best candidate; among equals the one that came first.
    pub fn pop(&mut self) -> Option<T> {
        let word = self.occupied.iter().rposition(|&bits| bits != 0)?;
        let index = word * 64 + 63 - self.occupied[word].leading_zeros() as usize;
        let candidate = self.buckets[index].pop_front();
        if self.buckets[index].is_empty() {
            self.occupied[word] &= !(1 << (index % 64));
        }
        self.len -= 1;
        candidate
    }
}

/// A quarter-octave scale read off the exponent and the two top mantissa bits of the rank.
fn bucket_of(rank: f32) -> usize {
    if rank.is_nan() || rank <= 0.0 {
        return 0;
    }
    let quarter_octaves = (rank.to_bits() >> 21) as i32;
    let of_one = (1.0_f32.to_bits() >> 21) as i32;
    (quarter_octaves - of_one + BUCKETS as i32 / 2).clamp(0, BUCKETS as i32 - 1) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn better_ranks_come_first_and_equals_in_order_of_arrival() {
        let mut queue = RankedQueue::default();
        for (rank, name) in [
            (1.0, 'c'),
            (0.0, 'e'),
            (8.0, 'b'),
            (f32::INFINITY, 'a'),
            (1.01, 'd'),
        ] {
            queue.push(rank, name);
        }
        let order: String = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(order, "abcde");
        assert!(queue.is_empty());
    }

    #[test]
    fn popped_ranks_never_rise_by_more_than_a_bucket() {
        let mut queue = RankedQueue::default();
        let mut state = 1_u32;
        for _ in 0..10_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            // Between 2^-30 and 2^30: what the buckets tell apart.
            let rank = f32::from_bits(0x3080_0000 + (state >> 3) % 0x1e00_0000);
            queue.push(rank, rank);
        }
        let mut last = f32::INFINITY;
        while let Some(rank) = queue.pop() {
            assert!(rank <= last * 1.25, "{rank} after {last}");
            last = rank;
        }
    }

    #[test]
    fn nan_goes_last() {
        let mut queue = RankedQueue::default();
        queue.push(f32::NAN, 1);
        queue.push(1e-30, 2);
        queue.push(-5.0, 3);
        assert_eq!(queue.len(), 3);
        assert_eq!(queue.pop(), Some(1), "1e-30 shares the last bucket");
    }
}
