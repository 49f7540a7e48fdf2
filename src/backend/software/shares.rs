//! The world's triangles cut into shares, the tasks of the passes over triangles.
//!
//! How they are cut depends on the world alone, neither on the view nor on the number of threads; and every consumer goes
//! through the shares in order. So the order of triangles in a tile is always ascending. And an image in which only some objects have
//! moved can keep the shares of all others, with what set-up has made of them; see [`moved`](super::moved).
//!
//! A triangle that is drawn gets a **slot**, a number that says where its share keeps what is known about it: the share in the
//! upper bits, the place in the lower ones. Slots ascend with ids. Pixels hold slots, because the world's number of a triangle
//! would have to be looked up first, in a list as long as the world has triangles.

#[cfg(test)]
mod tests;

use super::setup::{Drawn, Piece};
use super::tile::Bounds;
use super::triangles::{self, Triangles};
use crate::backend::{Geometry, RasterCounts};
use crate::geometry::screen::DepthPlane;
use crate::parallel::Watch;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

/// Bits of a slot that hold the place. Shares this large are as many as the other bits can tell apart, if a world has all the
/// triangles that 32 bits can number.
const PLACE_BITS: u32 = 24;

/// Set in a triangle's count of pixels if several tiles may add to it.
const IN_SEVERAL_TILES: u32 = 1 << 31;

/// How far the set-up of a share is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Progress {
    /// Triangles are set up.
    #[default]
    Triangles,
    /// Entries of the bins are counted; those of so many pieces have been.
    Counting(usize),
    /// Entries are put into the bins, likewise.
    Filling(usize),
    /// It is complete.
    Done,
}

/// Drawn triangles that are asked whether they own pixels in one go.
const LISTED_AT_ONCE: usize = 2048;

/// Some consecutive triangles of the world, and what set-up makes of those that are visible.
#[derive(Debug, Default)]
pub(super) struct Share {
    /// Its number.
    index: u32,
    /// Its triangles.
    all: Range<u32>,
    /// Those of them that are visible.
    triangles: Triangles,
    /// Whether this image sets it up anew. Otherwise all is as in the image before, but for counts of pixels.
    pub is_new: bool,
    /// Whether counts of pixels may be others than in the image before.
    pub is_counted: bool,
    /// How far set-up is.
    pub progress: Progress,
    /// How many of `drawn` have been asked whether they own pixels.
    listed: usize,
    /// Triangles to be drawn, ascending by id, each at its place.
    pub drawn: Vec<Drawn>,
    /// How many pixels each of them owns, once the tiles have been drawn; and [`IN_SEVERAL_TILES`].
    pixels: Vec<AtomicU32>,
    /// Ids of those of them that own pixels, ascending.
    pub visible: Vec<u32>,
    /// What to draw of them: each as a whole, or what clipping left.
    pub pieces: Vec<Piece>,
    /// Where each tile's entries in `bin_entries` start, and where the last one's end.
    pub bin_starts: Vec<u32>,
    /// Indices into `pieces`, tile by tile, ascending in each.
    pub bin_entries: Vec<u32>,
    /// What was counted.
    pub counts: RasterCounts,
}

impl Share {
    fn with_room(index: usize, triangles: usize) -> Self {
        Self {
            index: index as u32,
            triangles: Triangles::with_room(triangles),
            drawn: Vec::with_capacity(triangles),
            pixels: Vec::with_capacity(triangles),
            visible: Vec::with_capacity(triangles),
            pieces: Vec::with_capacity(triangles),
            ..Self::default()
        }
    }

    /// Begins its set-up: forgets what the last image made of its triangles.
    pub(super) fn begin_set_up(&mut self) {
        self.triangles.rewind();
        self.progress = Progress::Triangles;
        self.drawn.clear();
        self.pixels.clear();
        self.pieces.clear();
        self.counts = RasterCounts::default();
    }

    /// Takes the next visible triangles that the current pass has not yet come to, at most `most`; `None` when it has come to all.
    #[inline]
    pub(super) fn take(&mut self, most: usize) -> Option<Range<usize>> {
        self.triangles.take(most)
    }

    /// Puts a triangle at the next place, and returns its slot.
    pub(super) fn push(&mut self, drawn: Drawn) -> u32 {
        let slot = self.next_slot();
        self.count_from_zero(drawn.bounds);
        self.drawn.push(drawn);
        slot
    }

    /// Makes room for triangles, each with one piece, at the next places; the first of them has the slot returned. What they are
    /// is to be filled in, and [`count_from_zero`](Self::count_from_zero) to be called for each.
    #[inline(always)]
    pub(super) fn extend(&mut self, count: usize) -> (u32, &mut [Drawn], &mut [Piece]) {
        let slot = self.next_slot();
        let (triangles, pieces) = (self.drawn.len(), self.pieces.len());
        self.drawn.resize(triangles + count, Drawn::default());
        self.pieces.resize(pieces + count, Piece::default());
        (
            slot,
            &mut self.drawn[triangles..],
            &mut self.pieces[pieces..],
        )
    }

    /// Begins to count the pixels of the next triangle, which may have those in `bounds`.
    #[inline(always)]
    pub(super) fn count_from_zero(&mut self, bounds: Bounds) {
        let count = if bounds.is_in_one_tile() {
            0
        } else {
            IN_SEVERAL_TILES
        };
        self.pixels.push(AtomicU32::new(count));
    }

    /// The slot of the next place.
    #[inline(always)]
    fn next_slot(&self) -> u32 {
        self.index << PLACE_BITS | self.drawn.len() as u32
    }

    /// The pieces in a tile's bin, as indices.
    #[inline]
    pub(super) fn bin(&self, tile: usize) -> &[u32] {
        let (start, end) = (self.bin_starts[tile], self.bin_starts[tile + 1]);
        &self.bin_entries[start as usize..end as usize]
    }

    /// Begins to list the triangles that own pixels.
    pub(super) fn begin_list(&mut self) {
        self.visible.clear();
        self.listed = 0;
    }

    /// Lists the triangles that own pixels, and notes their slots by their ids, until it is told to stop.
    pub(super) fn list_visible(&mut self, slot_of: &[AtomicU32], watch: &Watch<'_>) {
        while !self.is_listed() && !watch.is_over() {
            let end = self.drawn.len().min(self.listed + LISTED_AT_ONCE);
            let some = self.listed..end;
            let slots = (self.index << PLACE_BITS | self.listed as u32)..;
            let counted = self.drawn[some.clone()].iter().zip(&self.pixels[some]);
            for ((drawn, pixels), slot) in counted.zip(slots) {
                if pixels.load(Ordering::Relaxed) & !IN_SEVERAL_TILES > 0 {
                    self.visible.push(drawn.id);
                    slot_of[drawn.id as usize].store(slot, Ordering::Relaxed);
                }
            }
            self.listed = end;
            watch.may_go_on();
        }
    }

    /// Whether all triangles that own pixels have been listed.
    pub(super) fn is_listed(&self) -> bool {
        self.listed == self.drawn.len()
    }
}

/// The place of a slot in its share.
#[inline(always)]
fn place(slot: u32) -> usize {
    (slot & ((1 << PLACE_BITS) - 1)) as usize
}

/// Adds to the number of pixels of a triangle; several tiles may do so at the same time.
#[inline(always)]
pub(super) fn add_pixels(shares: &[Share], slot: u32, pixels: u32) {
    let count = &shares[(slot >> PLACE_BITS) as usize].pixels[place(slot)];
    let known = count.load(Ordering::Relaxed);
    if known & IN_SEVERAL_TILES == 0 {
        // Nobody else does, so the cost of an atomic addition is saved.
        count.store(known + pixels, Ordering::Relaxed);
    } else {
        count.fetch_add(pixels, Ordering::Relaxed);
    }
}

/// Takes pixels of the image before off the number of those of a triangle; nothing if its share is new, since then counting
/// has begun at zero.
#[inline(always)]
pub(super) fn subtract_pixels(shares: &[Share], slot: u32, pixels: u32) {
    let share = &shares[(slot >> PLACE_BITS) as usize];
    if !share.is_new {
        // The tile has added as many before, so the count has them and stays clear of its mark.
        share.pixels[place(slot)].fetch_sub(pixels, Ordering::Relaxed);
    }
}

/// The shares of a world. Smaller worlds leave some unused, which keep their memory.
#[derive(Debug, Default)]
pub(super) struct Shares {
    all: Vec<Share>,
    used: usize,
}

impl Shares {
    /// Cuts the world's triangles into shares, all of which are new.
    pub(super) fn cut(&mut self, geometry: Geometry<'_>) {
        let Self { all, used } = self;
        *used = 0;
        triangles::cut(geometry.world, 1 << PLACE_BITS, |triangles| {
            if all.len() == *used {
                all.push(Share::with_room(*used, triangles.len()));
            }
            all[*used].all = triangles;
            *used += 1;
        });
        self.update(geometry, |_| true);
    }

    /// Keeps the shares of the image before that hold none of the triangles in `moved`, which ascend, and of which the same
    /// triangles are visible. All others are new.
    pub(super) fn keep_unmoved(&mut self, geometry: Geometry<'_>, moved: &[Range<u32>]) {
        self.update(geometry, |share| {
            let next = moved.partition_point(|range| range.end <= share.start);
            moved.get(next).is_some_and(|range| range.start < share.end)
        });
    }

    /// Tells the shares which triangles are visible.
    fn update(&mut self, geometry: Geometry<'_>, has_moved: impl Fn(&Range<u32>) -> bool) {
        let mut first = 0;
        for share in self.used_mut() {
            let visible = triangles::clipped(geometry.visible, &mut first, &share.all);
            share.is_new = has_moved(&share.all) || !share.triangles.are(visible.clone());
            share.is_counted = share.is_new;
            if share.is_new {
                share.triangles.set(visible);
            }
        }
    }

    /// Those of the current image, in the order of their triangles.
    pub(super) fn used(&self) -> &[Share] {
        &self.all[..self.used]
    }

    /// The triangle that has a slot.
    #[inline(always)]
    pub(super) fn drawn(&self, slot: u32) -> &Drawn {
        &self.all[(slot >> PLACE_BITS) as usize].drawn[place(slot)]
    }

    /// Brings what is known about a tile's triangles into the cache.
    ///
    /// Colouring asks for one triangle after the other, in the order of their pixels, and waits for memory each time: half of
    /// its time on a fine mesh. In the order of the bins they lie next to each other for the most part, and loads
    /// that do not wait for one another overlap.
    #[inline(always)]
    pub(super) fn prefetch(&self, tile: usize) {
        let mut sum = 0_u32;
        for share in self.used() {
            for &entry in share.bin(tile) {
                let slot = share.pieces[entry as usize].slot;
                sum = sum.wrapping_add(share.drawn[place(slot)].id);
            }
        }
        // Otherwise nothing would be loaded.
        std::hint::black_box(sum);
    }

    /// The depth of the triangle that has a slot.
    pub(super) fn depth(&self, slot: u32) -> DepthPlane {
        let pieces = &self.all[(slot >> PLACE_BITS) as usize].pieces;
        // They ascend by slots, and those of one triangle agree.
        pieces[pieces.partition_point(|piece| piece.slot < slot)].depth
    }

    /// The drawn triangle `id`, whose slot was `slot` when it was last visible, and the pixels it owns; `None` if it owns
    /// none now.
    pub(super) fn visible(&self, id: u32, slot: u32) -> Option<(&Drawn, u32)> {
        let share = self.used().get((slot >> PLACE_BITS) as usize)?;
        let drawn = share
            .drawn
            .get(place(slot))
            .filter(|drawn| drawn.id == id)?;
        let pixels = share.pixels[place(slot)].load(Ordering::Relaxed) & !IN_SEVERAL_TILES;
        (pixels > 0).then_some((drawn, pixels))
    }

    /// The same to be worked on.
    pub(super) fn used_mut(&mut self) -> &mut [Share] {
        &mut self.all[..self.used]
    }
}
