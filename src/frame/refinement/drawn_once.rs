//! Refinement for a backend that cannot repaint: everything is drawn once, after it has been refined.
//!
//! Only subdivision is left. It differs from refinement in place in four ways:
//!
//! * Nothing is shaded per pixel, so nothing is ever right for certain. A leaf is **good enough** when its estimated
//!   error is below [`GOOD_MSE`] and it is small enough for the estimate to be believed, or when it is hardly a pixel
//!   and not long. (Following their neighbours, leaves become slivers, of little area, that show the colours of
//!   corners far away. Those that reach the end of the barycentric grid stay so.)
//! * **Every** leaf follows the splits of its neighbours, also those that are good enough and those off the screen:
//!   each is drawn, and a corner inside a neighbour's edge would be a crack. So leaves are never closed.
//! * A split that was found not to help is carried out when the leaf's turn comes again, later: there is nothing else
//!   to be done about it, and smaller leaves get there in the end.
//! * Pixels are estimated by area inside the image.
//!
//! Which of several good subdivisions comes out depends on the order of splits, hence on where frames ended: a converged image
//! may differ from one refined in a single frame by what the estimates tolerate.

use super::ranking::{self, Action};
use super::{Refinement, Stage};
use crate::backend::RefinedPart;
use crate::refine::LeafId;

/// Mean squared error, in squared codes, below which a leaf is good enough: half a code.
const GOOD_MSE: f32 = 0.25;

/// A leaf of more pixels is not believed to be good enough: a highlight inside may have escaped its samples.
const BELIEVED_PIXELS: u32 = 256;

/// A triangle of fewer pixels, or a leaf that is no longer than [`LEAST_LENGTH_PX`] either, is as good as it gets.
pub(super) const LEAST_PIXELS: u32 = 2;

/// See [`LEAST_PIXELS`].
const LEAST_LENGTH_PX: f32 = 16.0;

/// What a sliver without a whole pixel counts for.
pub(super) const SLIVER_PIXELS: f32 = 0.5;

/// A split that did not help is this much less urgent than one that might.
const INSISTENCE: f32 = 0.25;

/// The leaves of the current image, ready to be drawn. Memory is kept.
#[derive(Debug, Default)]
pub(in crate::frame) struct DrawnLeaves {
    order: Vec<(u32, LeafId)>,
    parts: Vec<RefinedPart>,
}

impl DrawnLeaves {
    /// Lists all leaves, those of one triangle next to each other, triangles ascending.
    pub(in crate::frame) fn list(
        &mut self,
        refinement: &Refinement,
        stage: &Stage<'_>,
    ) -> &[RefinedPart] {
        let forest = &refinement.forest;
        self.order.clear();
        self.order.extend(
            forest
                .current_leaves()
                .map(|(id, leaf)| (leaf.triangle, id)),
        );
        self.order.sort_unstable();
        self.parts.clear();
        self.parts
            .extend(self.order.iter().map(|&(triangle, id)| RefinedPart {
                triangle,
                corners: forest.positions(stage.world, id),
                colours: forest.colours(stage.base.colours(), id),
            }));
        &self.parts
    }
}

impl Refinement {
    /// Splits committed for the current image: when there are more, it looks different.
    pub(in crate::frame) fn commits(&self) -> u64 {
        self.commits
    }

    /// How many triangles there are to draw, and their pixels, hidden ones included.
    pub(in crate::frame) fn drawing_load(&self) -> (u64, u64) {
        let whole = self.visible.saturating_sub(self.forest.planted_roots());
        let triangles = (whole + self.forest.open_leaves()) as u64;
        (triangles, self.pixels_to_draw)
    }

    /// Whether an open leaf of an image that is drawn once is not good enough.
    pub(super) fn is_worth_splitting(&self, stage: &Stage<'_>, id: LeafId) -> bool {
        let leaf = self.forest.leaf(id);
        if leaf.error <= GOOD_MSE && leaf.pixels <= BELIEVED_PIXELS {
            return false;
        }
        leaf.pixels >= LEAST_PIXELS
            || self.forest.longest_edge_px(stage.world, id) > LEAST_LENGTH_PX
    }

    /// Rank of splitting a leaf of which the split has been found not to help.
    pub(super) fn choose_insisting(&self, stage: &Stage<'_>, id: LeafId) -> (f32, Action) {
        let leaf = self.forest.leaf(id);
        let surplus = self.forest.edge_surplus(id);
        let marks = (0..3)
            .filter(|&k| surplus[k] >= 0.0)
            .fold(0, |marks, k| marks | 1 << k);
        if marks == 0 {
            return (0.0, Action::Shade);
        }
        let pixels = (leaf.pixels as f32).max(SLIVER_PIXELS);
        let benefit = pixels * leaf.error.max(ranking::ERROR_FLOOR) * INSISTENCE;
        let cost = ranking::split_cost(pixels, 3, stage.world.lights.len());
        (benefit / cost, Action::Split(marks))
    }
}
