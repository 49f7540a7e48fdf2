//! Consecutive visible triangles, which are taken away piece by piece.

use crate::backend::Geometry;
use std::ops::Range;

/// Some consecutive visible triangles.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Triangles {
    /// The range in `Geometry::visible` that holds the first triangle.
    range: usize,
    /// Triangles of that range that come before it.
    skip: u64,
    /// Number of triangles.
    count: u64,
}

impl Triangles {
    /// Takes away the first of them, at most `most`, and returns their ids; `None` when there are none.
    #[inline]
    pub(super) fn take(&mut self, geometry: Geometry<'_>, most: usize) -> Option<Range<usize>> {
        while self.count > 0 {
            let range = geometry.visible.get(self.range)?;
            let available = length(range).saturating_sub(self.skip);
            if available == 0 {
                self.range += 1;
                self.skip = 0;
                continue;
            }
            let taken = available.min(self.count).min(most as u64);
            let start = u64::from(range.start) + self.skip;
            self.skip += taken;
            self.count -= taken;
            return Some(start as usize..(start + taken) as usize);
        }
        None
    }
}

/// The visible triangles cut into runs of `size`, the last of which may be shorter.
pub(super) fn cut(geometry: Geometry<'_>, size: u64) -> impl Iterator<Item = Triangles> {
    let (mut range, mut skip, mut left) = (0, 0, total(geometry));
    std::iter::from_fn(move || {
        let count = size.min(left);
        let run = Triangles { range, skip, count };
        left -= count;
        let mut taken = count;
        while let Some(available) = geometry.visible.get(range).map(|r| length(r) - skip)
            && available <= taken
        {
            taken -= available;
            skip = 0;
            range += 1;
        }
        skip += taken;
        (count > 0).then_some(run)
    })
}

/// How many triangles are visible.
pub(super) fn total(geometry: Geometry<'_>) -> u64 {
    geometry.visible.iter().map(length).sum()
}

/// Number of triangles in a range.
fn length(range: &Range<u32>) -> u64 {
    u64::from(range.end.saturating_sub(range.start))
}
