//! Which triangles a share of the world's has, and which of them are visible.

use crate::scene::World;
use std::ops::Range;

/// Fewest triangles of a share, but for the last and for small objects: enough work to be worth a task.
const SMALLEST_SHARE: u32 = 1024;
/// About how many shares there are: each costs every tile a look into its bins.
const ABOUT_SO_MANY_SHARES: u32 = 64;

/// Some visible triangles, as ranges, which are gone through piece by piece.
#[derive(Debug, Default)]
pub(super) struct Triangles {
    /// Ascending; none is empty.
    ranges: Vec<Range<u32>>,
    /// The range that holds the next triangle.
    range: usize,
    /// Triangles of that range that come before it.
    skip: u32,
}

impl Triangles {
    /// None, with room for those of a share of so many: every second triangle at worst, every second cluster as a rule.
    pub(super) fn with_room(triangles: usize) -> Self {
        Self {
            ranges: Vec::with_capacity(triangles / 32 + 1),
            ..Self::default()
        }
    }

    /// Whether they are those of these ranges.
    pub(super) fn are(&self, ranges: impl Iterator<Item = Range<u32>>) -> bool {
        self.ranges.iter().cloned().eq(ranges)
    }

    /// Replaces them by those of some ranges, of which none is empty.
    pub(super) fn set(&mut self, ranges: impl Iterator<Item = Range<u32>>) {
        self.ranges.clear();
        self.ranges.extend(ranges);
        self.rewind();
    }

    /// Begins again with the first.
    pub(super) fn rewind(&mut self) {
        (self.range, self.skip) = (0, 0);
    }

    /// Goes past the next ones, at most `most`, and returns their ids; `None` when there are none.
    #[inline]
    pub(super) fn take(&mut self, most: usize) -> Option<Range<usize>> {
        let range = self.ranges.get(self.range)?;
        let start = range.start + self.skip;
        let taken = (range.end - start).min(u32::try_from(most).unwrap_or(u32::MAX));
        self.skip += taken;
        if start + taken == range.end {
            (self.range, self.skip) = (self.range + 1, 0);
        }
        Some(start as usize..(start + taken) as usize)
    }
}

/// Those of some ascending ranges that lie in `within`, cut off where it ends. `first` is a range before which none does, and is moved
/// on; so each of several ascending `within` goes on where the one before ended.
pub(super) fn clipped<'a>(
    ranges: &'a [Range<u32>],
    first: &mut usize,
    within: &Range<u32>,
) -> impl Iterator<Item = Range<u32>> + Clone + use<'a> {
    let (start, end) = (within.start, within.end);
    let before = ranges[*first..].iter().take_while(|r| r.end <= start);
    *first += before.count();
    (ranges[*first..].iter())
        .take_while(move |range| range.start < end)
        .map(move |range| range.start.max(start)..range.end.min(end))
        .filter(|range| !range.is_empty())
}

/// Cuts a world's triangles into shares of at most `largest`, and calls `found` with each.
///
/// Shares end where objects do, as far as that leaves them large enough: what has moved are whole objects.
pub(super) fn cut(world: &World, largest: u32, mut found: impl FnMut(Range<u32>)) {
    let total = world.triangles.len() as u32;
    let size = SMALLEST_SHARE
        .max(total.div_ceil(ABOUT_SO_MANY_SHARES))
        .min(largest);
    // In a world that large there is no room for more shares than need be.
    let starts: &[u32] = if size < largest {
        &world.object_starts
    } else {
        &[]
    };
    let ends = (starts.iter().copied().filter(|&end| end < total)).chain([total]);
    let (mut start, mut object) = (0, 0);
    for end in ends {
        if end - start > size && object > start {
            found(start..object);
            start = object;
        }
        let count = (end - start).div_ceil(size);
        if count > 1 {
            let equal = (end - start).div_ceil(count);
            while end - start > equal {
                found(start..start + equal);
                start += equal;
            }
        }
        object = end;
    }
    if start < total {
        found(start..total);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shares(triangles: u32, object_starts: Vec<u32>, largest: u32) -> Vec<Range<u32>> {
        let world = World {
            triangles: vec![[0; 3]; triangles as usize],
            object_starts,
            ..World::default()
        };
        let mut shares = Vec::new();
        cut(&world, largest, |share| shares.push(share));
        shares
    }

    #[test]
    fn shares_are_all_triangles_in_order_and_not_too_many() {
        for (triangles, starts) in [
            (0, vec![]),
            (1, vec![]),
            (1024, vec![0]),
            (200_000, vec![]),
            (57_344, (0..10).map(|i| i * 5734).collect()),
            (200_000, (0..100_000).map(|i| 2 * i).collect()),
            (200_000, vec![0, 5, 100_000, 100_000, 100_007, 200_000]),
        ] {
            for largest in [1 << 24, 700] {
                let shares = shares(triangles, starts.clone(), largest);
                let size = (triangles.div_ceil(64)).max(1024).min(largest);
                let mut next = 0;
                for share in &shares {
                    assert_eq!(share.start, next);
                    assert!((1..=size).contains(&(share.end - share.start)), "{share:?}");
                    next = share.end;
                }
                assert_eq!(next, triangles);
                assert!(shares.len() as u32 <= 2 * triangles.div_ceil(size) + 1);
            }
        }
    }

    #[test]
    fn objects_of_some_size_have_shares_of_their_own() {
        let starts: Vec<u32> = (0..10).map(|i| i * 6000).collect();
        let shares = shares(60_000, starts.clone(), 1 << 24);
        for start in starts {
            assert!(shares.iter().any(|share| share.start == start), "{start}");
        }
    }
}
