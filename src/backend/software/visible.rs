//! Which triangles own pixels, and where to find what is known about them.
//!
//! Triangles that own no pixel, usually the most, are never touched: of the list that has an entry for each triangle of the world,
//! only the entries of visible ones are written. What an older image left in the others is recognized, because the triangle that
//! has the slot now is another, or owns nothing.

use super::setup::Drawn;
use super::shares::{Share, Shares};
use crate::backend::Geometry;
use crate::parallel::{Exec, Watch, grow};
use std::sync::atomic::{AtomicU32, Ordering};

/// The triangles that own pixels.
#[derive(Debug, Default)]
pub(super) struct Visible {
    /// The slot that each triangle of the world had when it owned pixels last.
    slot_of: Vec<AtomicU32>,
    /// Ids, ascending.
    pub ids: Vec<u32>,
    /// Shares whose owners are among `ids`.
    joined: usize,
}

impl Visible {
    /// Makes room for a world's triangles; returns whether all of it is there, or false if it was told to stop.
    pub(super) fn fit(&mut self, geometry: Geometry<'_>, watch: &Watch<'_>) -> bool {
        let triangles = geometry.world.triangles.len();
        grow(&mut self.slot_of, triangles, watch, |_| {
            AtomicU32::default()
        })
    }

    /// Begins the list. Shares whose counts of pixels are those of the image before keep theirs.
    pub(super) fn begin(&mut self, shares: &mut Shares) {
        for share in shares
            .used_mut()
            .iter_mut()
            .filter(|share| share.is_counted)
        {
            share.begin_list();
        }
        self.ids.clear();
        self.joined = 0;
    }

    /// Lists the owners, or goes on with it, until it is told to stop. Returns whether the list is complete.
    pub(super) fn list(&mut self, exec: Exec, shares: &mut Shares, watch: &Watch<'_>) -> bool {
        let slot_of = &self.slot_of;
        exec.for_each_chunk(shares.used_mut(), 1, |_, share| {
            share[0].list_visible(slot_of, watch);
        });
        if !shares.used().iter().all(Share::is_listed) {
            return false;
        }
        if self.joined == 0 {
            let count = shares.used().iter().map(|share| share.visible.len()).sum();
            self.ids.reserve(count);
        }
        while let Some(share) = shares.used().get(self.joined) {
            if watch.is_over() {
                return false;
            }
            self.ids.extend_from_slice(&share.visible);
            self.joined += 1;
            watch.may_go_on();
        }
        true
    }

    /// A triangle and its slot, or `None` if it owns no pixel.
    #[inline]
    pub(super) fn get<'a>(&self, shares: &'a Shares, id: u32) -> Option<(&'a Drawn, u32)> {
        let slot = self.slot(id)?;
        let (drawn, _) = shares.visible(id, slot)?;
        Some((drawn, slot))
    }

    /// How many pixels a triangle owns.
    pub(super) fn pixels(&self, shares: &Shares, id: u32) -> u32 {
        let owner = self.slot(id).and_then(|slot| shares.visible(id, slot));
        owner.map_or(0, |(_, pixels)| pixels)
    }

    /// The slot that a triangle had when it owned pixels last, or any.
    fn slot(&self, id: u32) -> Option<u32> {
        let slot = self.slot_of.get(id as usize)?;
        Some(slot.load(Ordering::Relaxed))
    }
}
