//! Images in which only some objects have moved since the image before: whatever they do not touch is kept.
//!
//! **Shares.** A share in which something has moved, or of which other triangles are visible now, is *new*: it is transformed, set up and
//! binned again. All others are kept as they are, for set-up would come to the same: their vertices and the view are those of
//! before.
//!
//! **Tiles.** A tile is drawn again if a new share has something in its bin for it, before set-up or after; in all others the
//! same pieces would be drawn as before. The pixels it had are taken off the counts of kept shares when it is drawn, and what it has
//! now is added. (Those of new shares start at zero, and no tile that is kept has any of them.)
//!
//! **Colours.** A tile has kept its colours if it has neither been drawn nor repainted since it got them.
//!
//! All of this needs the image before to be complete. One that has been given up is followed by one that is drawn as a whole.

use super::SoftwareBackend;
use super::drawing::Drawing;
use super::shares::Share;
use super::stages::Stage;
use super::tile::TILE_BLOCKS;
use crate::backend::{BasePaint, Geometry};
use crate::scene::View;
use std::ops::Range;

/// What an image was made of, as far as it has to be the same for the next one to keep anything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Origin {
    view: View,
    triangles: usize,
    vertices: usize,
}

impl Origin {
    pub(super) fn of(geometry: Geometry<'_>) -> Self {
        Self {
            view: *geometry.view,
            triangles: geometry.world.triangles.len(),
            vertices: geometry.world.positions.len(),
        }
    }
}

/// A kind of paint, as far as it tells what a tile's colours come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PaintKind {
    Gouraud,
    Mixed,
    Flat,
    Phong,
}

impl PaintKind {
    pub(super) fn of(paint: BasePaint<'_>) -> Self {
        match paint {
            // Parts are for backends that cannot repaint.
            BasePaint::Gouraud(_) | BasePaint::Refined { .. } => Self::Gouraud,
            BasePaint::Mixed { .. } => Self::Mixed,
            BasePaint::Flat(_) => Self::Flat,
            BasePaint::Phong => Self::Phong,
        }
    }
}

impl SoftwareBackend {
    /// Begins an image in which only the triangles in `moved` have moved since the last one. Returns false if that cannot be
    /// kept, so that another one has to be begun.
    pub(super) fn begin_moved(&mut self, geometry: Geometry<'_>, moved: &[Range<u32>]) -> bool {
        if self.stage != Stage::Complete || self.origin != Some(Origin::of(geometry)) {
            return false;
        }
        self.shares.keep_unmoved(geometry, moved);
        if self.shares.used().iter().all(|share| share.is_new) {
            return false;
        }
        for drawing in &mut self.drawings {
            *drawing = Drawing::Done;
        }
        self.mark_new();
        self.vertices.begin();
        self.stage = Stage::Mark;
        true
    }

    /// Marks the tiles for which new shares have something in their bins.
    pub(super) fn mark_new(&mut self) {
        for share in self.shares.used().iter().filter(|share| share.is_new) {
            for (tile, drawing) in self.drawings.iter_mut().enumerate() {
                if !share.bin(tile).is_empty() {
                    *drawing = Drawing::ToDo;
                }
            }
        }
    }

    /// Finds out what drawing the tiles that are marked will change: their colours, and the counts of shares.
    pub(super) fn note_changes(&mut self) {
        self.kept_tiles = 0;
        for (index, drawing) in self.drawings.iter().enumerate() {
            if matches!(drawing, Drawing::Done) {
                self.kept_tiles += u64::from(self.tiles[index].covered > 0);
            } else {
                self.resolved[index] = 0;
            }
        }
        let drawings = &self.drawings;
        let is_changed = |share: &Share| {
            let mut tiles = drawings.iter().enumerate();
            tiles.any(|(tile, drawing)| {
                matches!(drawing, Drawing::ToDo) && !share.bin(tile).is_empty()
            })
        };
        for share in self.shares.used_mut() {
            share.is_counted = share.is_new || is_changed(share);
        }
    }

    /// Begins colours. Those that tiles have kept stay if they are of the same kind, and nothing is said to have become of them.
    pub(super) fn begin_colours(&mut self, kind: PaintKind, are_kept: bool) {
        // What becomes of a triangle depends on its pixels, and others may have moved in front.
        let are_kept = are_kept && self.painted == Some(kind) && kind != PaintKind::Mixed;
        self.painted = Some(kind);
        for next in &mut self.resolved {
            if !are_kept || usize::from(*next) < TILE_BLOCKS {
                *next = 0;
            }
        }
    }
}
