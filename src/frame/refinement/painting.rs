//! Painting pieces: patches off the list, in order, and what they teach about the leaves they belong to.

use super::{Owner, PIECE_UNITS, Paint, Progressing, Refinement, Stage};
use crate::backend::{Fill, Patch};
use crate::geometry::bary::{self, Bary};
use crate::refine::{LeafId, LeafState};
use crate::schedule::{Allowance, cost};

/// A piece of several threads is at most so many times as long, per thread, as one of a single thread.
const MOST_PIECES_AT_ONCE: u64 = 8;

/// Most nominal nanoseconds of one patch: a fraction of a piece.
const PATCH_UNITS: f32 = 12_000.0;

impl Refinement {
    /// Paints the next patches on the list. False when the budget admits none.
    pub(super) fn paint_piece(
        &mut self,
        stage: &mut Stage<'_>,
        allowance: &mut Allowance<'_>,
    ) -> bool {
        let limit = piece_limit(stage, allowance);
        let mut units = 0;
        self.piece.clear();
        self.owners.clear();
        while let Some(paint) = self.paints.front() {
            let with_next = units + u64::from(paint.units);
            let fits = units == 0 || with_next <= limit;
            if !(fits && allowance.admit(with_next)) {
                break;
            }
            units = with_next;
            self.piece.push(paint.patch);
            self.owners.push((paint.owner, paint.claims));
            self.benefit_to_paint -= paint.benefit;
            self.paints.pop_front();
        }
        if self.paints.is_empty() {
            // Whatever rounding has left.
            self.benefit_to_paint = 0.0;
        }
        if self.piece.is_empty() {
            return false;
        }
        let geometry = stage.base.geometry(stage.world, stage.view);
        stage.backend.repaint(stage.exec, geometry, &mut self.piece);
        allowance.spend(units);
        for index in 0..self.piece.len() {
            let patch = self.piece[index];
            let (owner, claims) = self.owners[index];
            self.certificate.lower(claims, patch.pixels);
            let is_polish = matches!(owner, Owner::Polish);
            if matches!(patch.fill, Fill::Phong { .. }) && !is_polish {
                self.counters.phong_pixels += u64::from(patch.pixels);
            }
            if let Owner::Leaf(leaf) = owner {
                self.note_painted(stage, leaf, patch.pixels);
            }
        }
        true
    }

    /// Counts a patch of a leaf. The last one makes the leaf a candidate again, its pixels now known exactly.
    fn note_painted(&mut self, stage: &Stage<'_>, leaf: LeafId, pixels: u32) {
        let progress = &mut self.progressing[leaf as usize];
        progress.pixels += pixels;
        progress.patches -= 1;
        if progress.patches > 0 {
            return;
        }
        let pixels = std::mem::take(&mut progress.pixels);
        if self.forest.leaf(leaf).state == LeafState::Open {
            self.error_mass -= self.leaf_mass(leaf);
            self.forest.set_pixels(leaf, pixels);
            self.error_mass += self.leaf_mass(leaf);
            self.offer_leaf(stage, leaf);
        }
    }

    /// What is still to be painted of a leaf.
    pub(super) fn leaf_progress(&mut self, leaf: LeafId) -> &mut Progressing {
        let index = leaf as usize;
        if self.progressing.len() <= index {
            self.progressing.resize(index + 1, Progressing::default());
        }
        &mut self.progressing[index]
    }

    /// Puts a patch of about `pixels` pixels on the list, cut into quarters until each is small enough. Its cost is found here.
    pub(super) fn enqueue(&mut self, paint: Paint, pixels: f32) {
        let units = match paint.patch.fill {
            Fill::Gouraud(_) => cost::repaint(1.0, pixels),
            Fill::Phong { lights, .. } => cost::phong(pixels, lights.diffuse.len()),
        };
        if units > PATCH_UNITS
            && let Some(quarters) = quarter(&paint.patch)
        {
            let benefit = paint.benefit * 0.25;
            for patch in quarters {
                let part = Paint {
                    patch,
                    benefit,
                    ..paint
                };
                self.enqueue(part, pixels * 0.25);
            }
            return;
        }
        self.enqueued += 1;
        let number = self.enqueued;
        if let Owner::Leaf(leaf) = paint.owner {
            let progress = self.leaf_progress(leaf);
            progress.patches += 1;
            progress.shade.last_paint = number;
        }
        self.benefit_to_paint += paint.benefit;
        self.paints.push_back(Paint {
            units: units as u32,
            ..paint
        });
    }
}

/// Most nominal nanoseconds of a piece that threads share. How much goes into one decides when the clock is looked at, and
/// nothing else. Waking threads costs tens of microseconds, so pieces are longer for several of
/// them while the deadline is far away: a quarter of what is left.
pub(super) fn piece_limit(stage: &Stage<'_>, allowance: &Allowance<'_>) -> u64 {
    let threads = stage.exec.threads as u64;
    if threads == 1 {
        return PIECE_UNITS;
    }
    (allowance.units_left() / 4)
        .clamp(PIECE_UNITS, MOST_PIECES_AT_ONCE * PIECE_UNITS)
        .saturating_mul(threads)
}

/// The patch as four quarters that paint the same, or `None` where the barycentric grid ends.
fn quarter(patch: &Patch) -> Option<[Patch; 4]> {
    let fills = match patch.fill {
        Fill::Gouraud(colours) => {
            bary::quarters(colours, bary::middles(colours)).map(Fill::Gouraud)
        }
        phong @ Fill::Phong { .. } => [phong; 4],
    };
    let corners = Bary::quarters(patch.corners)?;
    Some(std::array::from_fn(|i| Patch {
        corners: corners[i],
        fill: fills[i],
        ..*patch
    }))
}
