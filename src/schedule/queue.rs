//! Candidates by rank, in buckets: within a bucket the first to come is the first to go. That makes pushing and popping
//! a few instructions each, whatever the number of candidates.
//!
//! Order depends only on the sequence of calls, never on addresses or time.

use super::Rank;
use super::rank::{BUCKETS, RankSet};

/// No node.
const NONE: u32 = u32::MAX;

/// A candidate in its bucket.
#[derive(Clone, Copy, Debug)]
struct Node<T> {
    candidate: T,
    /// The next one in the bucket, or in the list of free nodes.
    next: u32,
}

/// The ends of a bucket's list; valid while the bucket is not empty.
#[derive(Clone, Copy, Debug)]
struct Bucket {
    first: u32,
    last: u32,
}

/// A priority queue of candidates, best rank first.
#[derive(Clone, Debug)]
pub struct RankedQueue<T> {
    /// Those of all buckets together, so that the memory needed does not depend on how ranks are spread.
    nodes: Vec<Node<T>>,
    /// The first free node.
    free: u32,
    buckets: [Bucket; BUCKETS],
    /// Ranks of the buckets that are not empty.
    occupied: RankSet,
    len: usize,
}

impl<T> Default for RankedQueue<T> {
    fn default() -> Self {
        let empty = Bucket {
            first: NONE,
            last: NONE,
        };
        Self {
            nodes: Vec::new(),
            free: NONE,
            buckets: [empty; BUCKETS],
            occupied: RankSet::default(),
            len: 0,
        }
    }
}

impl<T: Copy> RankedQueue<T> {
    /// Removes all candidates and keeps the memory.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.free = NONE;
        self.occupied = RankSet::default();
        self.len = 0;
    }

    /// Makes room for `additional` more candidates.
    pub fn reserve(&mut self, additional: usize) {
        self.nodes.reserve(additional);
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
        let rank = Rank::new(rank);
        let node = self.new_node(candidate);
        let bucket = &mut self.buckets[rank.bucket()];
        if !self.occupied.contains(rank) {
            self.occupied.insert(rank);
            bucket.first = node;
        } else {
            self.nodes[bucket.last as usize].next = node;
        }
        bucket.last = node;
        self.len += 1;
    }

    /// The rank of the best candidate.
    #[must_use]
    pub fn best(&self) -> Option<Rank> {
        self.occupied.best()
    }

    /// Removes the best candidate; among equals the one that came first.
    pub fn pop(&mut self) -> Option<T> {
        let rank = self.best()?;
        let bucket = &mut self.buckets[rank.bucket()];
        let taken = bucket.first;
        let Node { candidate, next } = self.nodes[taken as usize];
        if taken == bucket.last {
            self.occupied.remove(rank);
        } else {
            bucket.first = next;
        }
        self.nodes[taken as usize].next = self.free;
        self.free = taken;
        self.len -= 1;
        Some(candidate)
    }

    /// A node without a successor.
    fn new_node(&mut self, candidate: T) -> u32 {
        let node = Node {
            candidate,
            next: NONE,
        };
        let index = self.free;
        if index == NONE {
            self.nodes.push(node);
            return (self.nodes.len() - 1) as u32;
        }
        self.free = self.nodes[index as usize].next;
        self.nodes[index as usize] = node;
        index
    }
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
    fn memory_is_that_of_the_most_candidates_at_once() {
        let mut queue = RankedQueue::default();
        for round in 0..1000_u32 {
            // Ranks in ever other buckets, put and taken in turns.
            let rank = |i: u32| f32::from_bits(0x3080_0000 + (round * 7 + i) % 200 * (1 << 21));
            for i in 0..10 {
                queue.push(rank(i), i);
            }
            let mut popped: Vec<_> = (0..10).filter_map(|_| queue.pop()).collect();
            popped.sort_unstable();
            assert_eq!(popped, (0..10).collect::<Vec<_>>());
        }
        assert_eq!((queue.len(), queue.nodes.len()), (0, 10));
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
