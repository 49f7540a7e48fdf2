//! Many candidates at once, of which few may ever be asked for.
//!
//! They are numbered as they come and are not sorted: a rank takes a byte, and the next one of the best rank is searched for when it
//! is wanted. Each block of [`BLOCK`] candidates has a bit for every rank that occurs in it, so that a search passes over those
//! that cannot hold it.

use super::Rank;
use super::rank::{BUCKETS, RankSet};

/// Candidates that share a set of ranks.
const BLOCK: usize = 256;

/// Candidates known by their numbers, best rank first, among equals the lowest number.
#[derive(Clone, Debug)]
pub struct RankedList {
    ranks: Vec<Rank>,
    /// Which ranks occur, block by block.
    blocks: Vec<RankSet>,
    /// How many candidates of each rank are left.
    left: [u32; BUCKETS],
    /// Ranks that have any.
    occupied: RankSet,
    /// Those of the best rank below this number are gone.
    next: usize,
}

impl Default for RankedList {
    fn default() -> Self {
        Self {
            ranks: Vec::new(),
            blocks: Vec::new(),
            left: [0; BUCKETS],
            occupied: RankSet::default(),
            next: 0,
        }
    }
}

impl RankedList {
    /// Removes all candidates and keeps the memory.
    pub fn clear(&mut self) {
        self.ranks.clear();
        self.blocks.clear();
        self.left = [0; BUCKETS];
        self.occupied = RankSet::default();
        self.next = 0;
    }

    /// Makes room for `count` candidates in all.
    pub fn reserve(&mut self, count: usize) {
        self.ranks.reserve(count.saturating_sub(self.ranks.len()));
        let blocks = count.div_ceil(BLOCK);
        self.blocks
            .reserve(blocks.saturating_sub(self.blocks.len()));
    }

    /// Numbers `count` candidates more, and returns their ranks, to be filled in before [`admit`](Self::admit) is called.
    pub fn extend(&mut self, count: usize) -> &mut [Rank] {
        let first = self.ranks.len();
        self.ranks.resize(first + count, Rank::NEVER);
        &mut self.ranks[first..]
    }

    /// Makes those numbered from `first` on candidates, except for those of the rank [`NEVER`](Rank::NEVER). To be called once
    /// for each number, and before anything has been taken.
    pub fn admit(&mut self, first: usize) {
        debug_assert_eq!(self.next, 0, "a candidate has been taken");
        self.blocks
            .resize(self.ranks.len().div_ceil(BLOCK), RankSet::default());
        for (&rank, number) in self.ranks[first..].iter().zip(first..) {
            if rank > Rank::NEVER {
                self.left[rank.bucket()] += 1;
                self.blocks[number / BLOCK].insert(rank);
                self.occupied.insert(rank);
            }
        }
    }

    /// The rank of the best candidate.
    #[must_use]
    pub fn best(&self) -> Option<Rank> {
        self.occupied.best()
    }

    /// Takes the best candidate; among equals the one with the lowest number.
    pub fn pop(&mut self) -> Option<u32> {
        let best = self.best()?;
        let number = self.find(best, self.next)?;
        let left = &mut self.left[best.bucket()];
        *left -= 1;
        self.next = number + 1;
        if *left == 0 {
            self.occupied.remove(best);
            self.next = 0;
        }
        Some(number as u32)
    }

    /// The first number from `start` on that has a rank.
    fn find(&self, rank: Rank, start: usize) -> Option<usize> {
        let first_block = start / BLOCK;
        let blocks = self.blocks.get(first_block..)?.iter().zip(first_block..);
        blocks
            .filter(|(ranks, _)| ranks.contains(rank))
            .find_map(|(_, block)| {
                let begin = (block * BLOCK).max(start);
                let end = ((block + 1) * BLOCK).min(self.ranks.len());
                let place = self.ranks[begin..end].iter().position(|&r| r == rank);
                place.map(|place| begin + place)
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ranks(count: u32) -> Vec<Rank> {
        let hash = |i: u32| (i.wrapping_mul(2_654_435_761) >> 16) % 97;
        let rank = |i| match hash(i) {
            0 => Rank::NEVER,
            value => Rank::new(1.1_f32.powi(value as i32 - 40)),
        };
        (0..count).map(rank).collect()
    }

    #[test]
    fn candidates_come_in_the_order_of_a_stable_sort() {
        let ranks = ranks(5000);
        let mut want: Vec<u32> = (0..5000)
            .filter(|&i| ranks[i as usize] > Rank::NEVER)
            .collect();
        want.sort_by_key(|&i| std::cmp::Reverse(ranks[i as usize]));
        assert!(want.len() < 5000);
        let mut list = RankedList::default();
        for piece in [1, 255, 700, 5000] {
            list.clear();
            let mut first = 0;
            for piece in ranks.chunks(piece) {
                list.extend(piece.len()).copy_from_slice(piece);
                list.admit(first);
                first += piece.len();
            }
            assert_eq!(list.best(), Some(ranks[want[0] as usize]));
            let got: Vec<u32> = std::iter::from_fn(|| list.pop()).collect();
            assert!(got == want, "in pieces of {piece}");
            assert_eq!(list.best(), None);
        }
    }

    #[test]
    fn without_candidates_there_is_no_best() {
        let mut list = RankedList::default();
        assert_eq!((list.best(), list.pop()), (None, None));
        list.extend(3);
        list.admit(0);
        assert_eq!((list.best(), list.pop()), (None, None));
    }
}
