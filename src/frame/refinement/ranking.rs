//! What refining something is worth, per nominal cost.
//!
//! The benefit of a step is the expected drop of the sum of squared errors (squared codes times pixels), its cost comes
//! from [`cost`]. Two steps compete for every leaf:
//!
//! * *Splitting* edges whose surplus is at least half of the leaf's largest. Halving an edge quarters the surplus of a
//!   smooth function there, so the error left is that of the surpluses with the marked ones divided by four. All leaves
//!   that share a marked edge are repainted: they share benefit and cost.
//! * *Shading per pixel*, after which no error is left.

use super::drawn_once;
use super::parts::{self, CUT, SAMPLES_PER_PART};
use super::shading::{Shading, is_lookable, usual_lights};
use super::{NONE, Refinement, Root, Stage};
use crate::output::Encoding;
use crate::refine::{Forest, LeafId};
use crate::schedule::cost;

/// Smallest mean squared error that is believed. An estimate of zero is no proof, so everything that is not proved
/// right is shaded in the end; the floor puts it behind what is known to be wrong.
pub(super) const ERROR_FLOOR: f32 = 1e-3;

/// What was left out by [`prior_error`] because centroids show it: see [`unsampled_error`].
const UNSAMPLED_FACTOR: f32 = 8.0;

/// Share of the benefit of a split, as expected, that splits bring as a rule: surplus falls by less than a smooth function's
/// where there is a highlight.
const SPLIT_YIELD: f32 = 0.5;

/// A triangle that is to be planted comes so much sooner: planting costs little beside what it tells.
const CURIOSITY: f32 = 4.0;

/// Mean squared error, in squared codes, up to which a triangle is looked at before it is shaded.
pub(super) const LOOK_ERROR: f32 = 0.25;

/// It is looked at so much sooner than it would be shaded: that costs a fraction, and may be all there is to do.
const LOOK_FIRST: f32 = 8.0;

/// Share of what is guessed of a triangle that may be left when it is divided by 1.
const CURVED_GUESS: f32 = 0.5;

/// Points that a new leaf has to itself: three edge midpoints, most of them shared by two leaves.
const POINTS_PER_LEAF: f32 = 1.5;

/// What is to be done to a triangle or leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Action {
    /// Find out which lights matter, and whether it needs any refinement.
    Look,
    /// Evaluate the illumination equation at its pixels.
    Shade,
    /// Split its marked edges (bit k: from corner k to corner k + 1).
    Split(u8),
}

/// How light a linear colour is, in codes.
pub(super) fn lightness(encoding: Encoding, [r, g, b]: [f32; 3]) -> f32 {
    let light = ((r + g + b) / 3.0).clamp(0.0, 1.0);
    255.0
        * match encoding {
            // The square root is close enough to the sRGB curve.
            Encoding::Srgb => light.sqrt(),
            Encoding::Linear => light,
        }
}

/// First guess of a triangle's mean squared error, of which only the lightness of its corners is known: shading that changes by so many
/// codes between corners deviates from linear by a fraction of it, and a highlight inside by more. To be replaced by an
/// estimate when the triangle's turn comes.
///
/// Here and below constants are fitted, roughly, to the eight example scenes seen from three sides at two sizes: so that neither those expected to
/// be bad nor the others turn out much better or worse as a group, for what looks worst is refined first.
pub(super) fn prior_error([a, b, c]: [f32; 3], is_pht: bool) -> f32 {
    let contrast = a.max(b).max(c) - a.min(b).min(c);
    let square = contrast * contrast;
    ERROR_FLOOR
        + if is_pht {
            4.0 + square / 16.0
        } else {
            square / 256.0
        }
}

/// What the square of the deviation at the centroid adds to that guess: for a quadratic with equal surplus `m` at the three edge
/// midpoints, which deviates by `4/3 m` there, the mean square would be 0.6 times it. A centroid may just lie on the peak of a
/// highlight, or beside it.
pub(super) fn centroid_error(square: f32, is_pht: bool) -> f32 {
    square * if is_pht { 0.4 } else { 0.65 }
}

/// The prior error of a triangle divided by `n`, by what its nodes say, and by what would be guessed of it as a whole: nodes may have
/// missed something, the less likely the more there are.
pub(super) fn curved_error(guess: f32, n: u32, error: f32) -> f32 {
    let missed = (guess - ERROR_FLOOR) * CURVED_GUESS / n.pow(3) as f32;
    ERROR_FLOOR + error.max(missed)
}

/// Expected squared difference between two codes, in squared codes, when the two colours differ by a mean square of `error` before they
/// are rounded. Where they hardly differ, they are rounded alike as a rule, and now and then to neighbouring codes: as often
/// as their difference is large, which for a normal distribution is 0.8 times its root mean square. Else each of both is off by 1/12.
pub(super) fn rounded_error(error: f32) -> f32 {
    error + (0.8 * error.sqrt()).min(1.0 / 6.0)
}

/// The prior error of a triangle of which the centroid is not looked at, because by `prior` alone it hardly matters.
pub(super) fn unsampled_error(prior: f32) -> f32 {
    ERROR_FLOOR + UNSAMPLED_FACTOR * (prior - ERROR_FLOOR)
}

/// Nominal cost of cutting a leaf or part of `pixels` pixels into parts, or of putting it on the list if it is small.
pub(super) fn cutting_cost(pixels: f32, lights: usize) -> f32 {
    if parts::is_large(pixels) {
        cost::samples(CUT * SAMPLES_PER_PART, lights)
    } else {
        cost::LIST_NS
    }
}

/// What is known of an image that ranks triangles which have not been looked at.
#[derive(Clone, Copy)]
pub(super) struct RootRanking<'a> {
    pub(super) forest: &'a Forest,
    /// How many lights there are.
    pub(super) lights: usize,
    /// See [`Refinement::by_area`].
    pub(super) by_area: bool,
    /// See [`Refinement::is_drawn_once`].
    pub(super) is_drawn_once: bool,
}

impl RootRanking<'_> {
    /// What to do with a triangle, and its rank: shade it, or make it the root of a subdivision, whose first split is
    /// assumed to be into four.
    #[inline]
    pub(super) fn choose(&self, root: &Root) -> (f32, Action) {
        let pixels = root.pixels as f32;
        if self.by_area {
            return (pixels, Action::Shade);
        }
        let benefit = pixels * root.prior;
        let shade = if self.is_drawn_once {
            0.0
        } else {
            benefit / cost::phong(pixels, usual_lights(self.lights))
        };
        let planting = self.planting_cost(root.pixels);
        let splitting = planting + split_cost(pixels, 3, self.lights);
        let split = SPLIT_YIELD * benefit * (15.0 / 16.0) / splitting;
        // What is curved already would not gain by linear parts.
        if split > shade && !root.is_curved {
            (CURIOSITY * split, Action::Split(7))
        } else if self.is_looked_at(root) {
            (LOOK_FIRST * shade, Action::Look)
        } else {
            (shade, Action::Shade)
        }
    }

    /// Whether it is to be found out whether a triangle needs any refinement before it gets some.
    fn is_looked_at(&self, root: &Root) -> bool {
        let is_right_by_guess = root.prior <= LOOK_ERROR && !self.is_drawn_once;
        is_right_by_guess && root.shading == NONE && is_lookable(root.pixels, self.lights)
    }

    /// Nominal cost of making a triangle of `pixels` pixels a leaf that can be split.
    pub(super) fn planting_cost(&self, pixels: u32) -> f32 {
        let samples = self.forest.sample_count(pixels);
        cost::leaves(1.0, POINTS_PER_LEAF, self.lights) + cost::samples(samples, self.lights)
    }
}

impl Refinement {
    /// How triangles that have not been looked at are ranked.
    pub(super) fn root_ranking(&self, lights: usize) -> RootRanking<'_> {
        RootRanking {
            forest: &self.forest,
            lights,
            by_area: self.by_area,
            is_drawn_once: self.is_drawn_once,
        }
    }

    /// The better of the two steps for an open leaf, and its rank.
    pub(super) fn choose(&self, stage: &Stage<'_>, id: LeafId) -> (f32, Action) {
        let leaf = self.forest.leaf(id);
        let lights = stage.world.lights.len();
        let error = leaf.error.max(ERROR_FLOOR);
        let mut pixels = leaf.pixels as f32;
        if self.is_drawn_once {
            if !leaf.splittable {
                return self.choose_insisting(stage, id);
            }
            pixels = pixels.max(drawn_once::SLIVER_PIXELS);
        }

        // A large leaf is shaded part by part, those first that hold the error.
        let active = self.active_lights(stage, leaf.triangle);
        let share = if parts::is_large(pixels) {
            leaf.spread
        } else {
            1.0
        };
        let shade_cost = cutting_cost(pixels, lights) + cost::phong(pixels * share, active);
        let shade = if self.is_drawn_once {
            0.0
        } else {
            pixels * error / shade_cost
        };
        if !leaf.splittable {
            return (shade, Action::Shade);
        }

        let (marks, kept) = self.marks(id);
        if marks == 0 {
            return (shade, Action::Shade);
        }
        let mut benefit = pixels * error * (1.0 - kept);
        let mut splitting = split_cost(pixels, marks.count_ones(), lights);
        for k in (0..3).filter(|k| marks >> k & 1 == 1) {
            for (neighbour, edge) in self.forest.neighbours(stage.world, id, k) {
                let other = self.forest.leaf(neighbour);
                let surplus = self.forest.edge_surplus(neighbour).map(|s| s.max(0.0));
                let total: f32 = surplus.iter().map(|s| s * s).sum();
                if total > 0.0 {
                    let share = surplus[edge] * surplus[edge] / total;
                    benefit += other.pixels as f32 * other.error * share * (15.0 / 16.0);
                }
                splitting += split_cost(other.pixels as f32, 1, lights);
            }
        }
        let split = SPLIT_YIELD * benefit / splitting;
        if split >= shade {
            (split, Action::Split(marks))
        } else {
            (shade, Action::Shade)
        }
    }

    /// Nominal cost of planning to split marked edges of a leaf: of the children it will have, and of those of the leaves
    /// at these edges.
    pub(super) fn splitting_cost(&self, stage: &Stage<'_>, id: LeafId, marks: u8) -> f32 {
        let lights = stage.world.lights.len();
        let mut children = marks.count_ones() + 1;
        let mut samples = self.forest.sample_count(self.forest.leaf(id).pixels);
        for k in (0..3).filter(|k| marks >> k & 1 == 1) {
            for (neighbour, _) in self.forest.neighbours(stage.world, id, k) {
                children += 2;
                samples += self.forest.sample_count(self.forest.leaf(neighbour).pixels);
            }
        }
        cost::leaves(children as f32, POINTS_PER_LEAF, lights) + cost::samples(samples, lights)
    }

    /// How many lights a triangle's pixels are shaded under, as far as is known.
    pub(super) fn active_lights(&self, stage: &Stage<'_>, triangle: u32) -> usize {
        let root = self.root_of(triangle).map(|i| self.roots[i as usize]);
        match root.and_then(|root| self.root_shading(&root).map(|s| s.shading)) {
            Some(Shading::Proved) => 0,
            Some(Shading::PerPixel(shading)) => shading.lights(),
            None => usual_lights(stage.world.lights.len()),
        }
    }

    /// Which edges of a leaf to split, and the share of its error that is expected to remain.
    fn marks(&self, id: LeafId) -> (u8, f32) {
        let surplus = self.forest.edge_surplus(id);
        let squares = surplus.map(|s| s.max(0.0) * s.max(0.0));
        let (total, largest) = (
            squares.iter().sum::<f32>(),
            squares.iter().copied().fold(0.0, f32::max),
        );
        let known = crate::refine::estimate::EDGE_SHARE * total;
        if known < 0.5 * self.forest.leaf(id).error {
            // The error is inside, not at the edges: quarter the leaf and look again.
            let splittable = (0..3).filter(|&k| surplus[k] >= 0.0);
            let marks = splittable.fold(0, |marks, k| marks | 1 << k);
            return (marks, 0.5);
        }
        let mut marks = 0;
        let mut left = 0.0;
        for k in 0..3 {
            if surplus[k] >= 0.0 && squares[k] >= 0.25 * largest {
                marks |= 1 << k;
                left += squares[k] / 16.0;
            } else {
                left += squares[k];
            }
        }
        (marks, if total > 0.0 { left / total } else { 0.0 })
    }
}

/// Nominal cost of splitting `edges` edges of a leaf of `pixels` pixels, and painting its children.
pub(super) fn split_cost(pixels: f32, edges: u32, lights: usize) -> f32 {
    let children = (edges + 1) as f32;
    cost::leaves(children, POINTS_PER_LEAF, lights) + cost::repaint(children, pixels)
}
