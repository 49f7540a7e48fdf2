//! The visible triangles cut into shares of equal size, the tasks of the passes over triangles.
//!
//! How they are cut depends on the number of triangles alone, never on the number of threads; and every consumer goes
//! through the shares in order. So the order of triangles in a tile is always ascending.

use super::setup::Prepared;
use crate::backend::{Geometry, RasterCounts};
use std::ops::Range;

/// Fewest triangles of a share, but for the last: enough work to be worth a task.
const SMALLEST_SHARE: u64 = 1024;
/// Most shares: each costs every tile a look into its bins.
const MOST_SHARES: u64 = 64;

/// Some consecutive visible triangles, and what set-up makes of them.
#[derive(Debug, Default)]
pub(super) struct Share {
    /// The range in `Geometry::visible` that holds the first triangle.
    range: usize,
    /// Triangles of that range that belong to earlier shares.
    skip: u64,
    /// Number of triangles.
    count: u64,
    /// Triangles to be drawn, ascending by id.
    pub prepared: Vec<Prepared>,
    /// Where each tile's entries in `bin_entries` start, and where the last one's end.
    pub bin_starts: Vec<u32>,
    /// Indices into `prepared`, tile by tile, ascending in each.
    pub bin_entries: Vec<u32>,
    /// What was counted.
    pub counts: RasterCounts,
}

impl Share {
    fn with_room(triangles: usize) -> Self {
        Self {
            prepared: Vec::with_capacity(triangles),
            ..Self::default()
        }
    }

    /// The ids of its triangles, ascending.
    #[inline]
    pub(super) fn triangles<'a>(
        &self,
        geometry: Geometry<'a>,
    ) -> impl Iterator<Item = usize> + use<'a> {
        let (mut skip, mut left) = (self.skip, self.count);
        geometry.visible[self.range..]
            .iter()
            .flat_map(move |range| {
                let start = u64::from(range.start) + skip;
                let end = u64::from(range.end).min(start + left).max(start);
                (skip, left) = (0, left - (end - start));
                start as usize..end as usize
            })
    }

    /// The triangles in a tile's bin.
    #[inline]
    pub(super) fn bin(&self, tile: usize) -> impl Iterator<Item = &Prepared> {
        let (start, end) = (self.bin_starts[tile], self.bin_starts[tile + 1]);
        self.bin_entries[start as usize..end as usize]
            .iter()
            .map(|&entry| &self.prepared[entry as usize])
    }
}

/// The shares of an image. Views of fewer triangles leave some unused, which keep their memory for the views to come.
#[derive(Debug, Default)]
pub(super) struct Shares {
    all: Vec<Share>,
    used: usize,
}

impl Shares {
    /// Cuts the visible triangles into shares.
    pub(super) fn cut(&mut self, geometry: Geometry<'_>) {
        let total: u64 = geometry.visible.iter().map(length).sum();
        let size = share_size(total);
        self.used = total.div_ceil(size) as usize;
        if self.all.len() < self.used {
            // As many as any view's triangles may take, clipping aside, so that the next view does not need more.
            let room = share_size(geometry.world.triangles.len() as u64) as usize;
            self.all.resize_with(self.used, || Share::with_room(room));
        }
        cut_into(&mut self.all[..self.used], geometry, size, total);
    }

    /// Those of the current image, in the order of their triangles.
    pub(super) fn used(&self) -> &[Share] {
        &self.all[..self.used]
    }

    /// The same to be worked on.
    pub(super) fn used_mut(&mut self) -> &mut [Share] {
        &mut self.all[..self.used]
    }
}

/// How many triangles a share holds, but for the last, when there are `total`.
fn share_size(total: u64) -> u64 {
    SMALLEST_SHARE.max(total.div_ceil(MOST_SHARES))
}

/// Number of triangles in a range.
fn length(range: &Range<u32>) -> u64 {
    u64::from(range.end.saturating_sub(range.start))
}

fn cut_into(shares: &mut [Share], geometry: Geometry<'_>, size: u64, total: u64) {
    let (mut range, mut skip, mut left) = (0, 0, total);
    for share in shares {
        share.range = range;
        share.skip = skip;
        share.count = size.min(left);
        left -= share.count;
        let mut taken = share.count;
        while let Some(available) = geometry.visible.get(range).map(|r| length(r) - skip)
            && available <= taken
        {
            taken -= available;
            skip = 0;
            range += 1;
        }
        skip += taken;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Eye, View, World};
    use glam::DMat4;

    #[test]
    #[expect(clippy::reversed_empty_ranges, reason = "such a range holds nothing")]
    fn shares_hold_every_visible_triangle_once_and_in_order() {
        let (world, view) = (
            World::default(),
            View {
                width: 1,
                height: 1,
                pixel_from_world: DMat4::IDENTITY,
                eye: Eye::Point([0.0; 3]),
                encoding: Default::default(),
            },
        );
        // One after the other in the same memory.
        let mut shares = Shares::default();
        let many = (0..5000).map(|i| i * 10..i * 10 + i % 4).collect();
        let (none, few, large) = (3..3, 0..5, 0..200_000);
        for visible in [
            vec![],
            vec![none],
            vec![few],
            vec![0..1000, 1000..1024, 2000..2001, 7..3, 3000..9000],
            vec![large],
            many,
        ] {
            let geometry = Geometry {
                world: &world,
                view: &view,
                visible: &visible,
            };
            shares.cut(geometry);
            let used = shares.used();
            assert!(used.len() as u64 <= MOST_SHARES);
            let got: Vec<_> = used.iter().flat_map(|s| s.triangles(geometry)).collect();
            let want: Vec<_> = visible
                .iter()
                .cloned()
                .flatten()
                .map(|t| t as usize)
                .collect();
            assert_eq!(got, want);
        }
    }
}
