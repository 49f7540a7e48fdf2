//! A set of clusters, as ranges of triangles.

use std::ops::Range;

const BITS: usize = u64::BITS as usize;

/// Some of the clusters of a scene, a bit for each.
#[derive(Clone)]
pub(super) struct Runs {
    /// All clusters' triangles, ascending.
    triangles: Vec<Range<u32>>,
    /// Those whose triangles begin where those of the cluster before end.
    joined: Vec<u64>,
    members: Vec<u64>,
}

impl Runs {
    /// Of the clusters with the given triangles, ascending, none.
    pub(super) fn new(triangles: impl Iterator<Item = Range<u32>>) -> Self {
        let triangles: Vec<_> = triangles.collect();
        let mut joined = vec![0; triangles.len().div_ceil(BITS)];
        for (index, pair) in (1..).zip(triangles.windows(2)) {
            if pair[0].end == pair[1].start {
                joined[index / BITS] |= 1 << (index % BITS);
            }
        }
        Self {
            members: vec![0; joined.len()],
            triangles,
            joined,
        }
    }

    pub(super) fn clear(&mut self) {
        self.members.fill(0);
    }

    pub(super) fn insert(&mut self, cluster: u32) {
        let index = cluster as usize;
        self.members[index / BITS] |= 1 << (index % BITS);
    }

    /// How many clusters there are in the set.
    pub(super) fn count(&self) -> u32 {
        self.members.iter().map(|word| word.count_ones()).sum()
    }

    /// Writes the triangles of the set to `out`, adjacent ranges joined; returns how many triangles.
    pub(super) fn write(&self, out: &mut Vec<Range<u32>>) -> u32 {
        out.clear();
        // Enough for any set, so that a later one does not allocate.
        out.reserve(self.triangles.len().div_ceil(2));
        let (mut count, mut end) = (0, 0);
        while let Some(first) = self.find(end, |word| self.members[word]) {
            end = self
                .find(first + 1, |word| !(self.members[word] & self.joined[word]))
                .unwrap_or(self.triangles.len());
            let range = self.triangles[first].start..self.triangles[end - 1].end;
            count += range.end - range.start;
            out.push(range);
        }
        count
    }

    /// The first cluster from `start` on whose bit is set, given words of bits.
    fn find(&self, start: usize, words: impl Fn(usize) -> u64) -> Option<usize> {
        let mut word = start / BITS;
        let mut mask = u64::MAX << (start % BITS);
        while word < self.members.len() {
            let bits = words(word) & mask;
            if bits != 0 {
                let index = word * BITS + bits.trailing_zeros() as usize;
                return (index < self.triangles.len()).then_some(index);
            }
            mask = u64::MAX;
            word += 1;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adjacent_clusters_become_one_range_across_words() {
        // A gap before cluster 100.
        let triangles = (0..200).map(|i| {
            let start = 2 * i + u32::from(i >= 100);
            start..start + 2
        });
        let mut runs = Runs::new(triangles);
        let mut out = vec![1..2, 4..7];
        assert_eq!(runs.write(&mut out), 0);
        assert!(out.is_empty());
        (0..200).for_each(|i| runs.insert(i));
        assert_eq!((runs.count(), runs.write(&mut out)), (200, 400));
        assert_eq!(out, [0..200, 201..401]);
        runs.clear();
        for i in [0, 63, 64, 66, 98, 99, 100, 199] {
            runs.insert(i);
        }
        assert_eq!(runs.write(&mut out), 16);
        assert_eq!(
            out,
            [0..2, 126..130, 132..134, 196..200, 201..203, 399..401]
        );
    }
}
