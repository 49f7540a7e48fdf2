//! Shading a large leaf part by part.
//!
//! A highlight may take up little of a leaf. Before all of it is shaded per pixel, it is cut into up to [`CUT`] parts, each
//! with an error of its own, estimated from a few samples. The parts become candidates; those with the highlight come
//! soon, and are cut again while they are large, the others when their turn comes. Nothing is painted by cutting: until
//! it is shaded, a part keeps the leaf's interpolated colours, and the leaf's edges are
//! [pinned](crate::refine::Forest::pin), so that there is no seam to its neighbours.

use super::shading::Shade;
use super::{Candidate, Refinement, Stage, ranking};
use crate::geometry::bary::{self, Bary, blend};
use crate::refine::LeafId;
use crate::schedule::cost;

/// A leaf or part of more than twice as many pixels is cut rather than shaded, but not into parts of fewer.
const PART_PIXELS: f32 = 256.0;

/// Most parts that are made at once, a power of four.
pub(super) const CUT: usize = 16;

/// Samples in a part: the centroids of its quarters.
pub(super) const SAMPLES_PER_PART: usize = 4;

/// Whether something of so many pixels is cut rather than shaded.
pub(super) fn is_large(pixels: f32) -> bool {
    pixels > 2.0 * PART_PIXELS
}

/// How many parts an image of so many pixels is cut into, as a rule at most: all have more than [`PART_PIXELS`]` / 4` pixels.
pub(super) fn most(pixels: usize) -> usize {
    pixels * 4 / PART_PIXELS as usize
}

/// A part of a leaf that is waiting to be shaded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub(super) leaf: LeafId,
    pub(super) piece: Piece,
    /// Estimated.
    pub(super) pixels: f32,
    /// Estimated mean squared error.
    error: f32,
    pub(super) state: PartState,
}

/// What has become of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PartState {
    /// It is a candidate.
    Waiting,
    /// Smaller parts have taken its place.
    Cut,
    /// It is on the list to be shaded, if it needs to be, or was shaded.
    Shaded(Shade),
}

impl Part {
    /// Its share of the expected sum of squared errors.
    fn mass(&self) -> f64 {
        f64::from(self.pixels) * f64::from(ranking::rounded_error(self.error))
    }
}

/// A triangle inside a root with interpolated colours at its corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) corners: [Bary; 3],
    pub(super) colours: [[f32; 3]; 3],
}

impl Piece {
    /// Its quarters, or `None` where the barycentric grid ends.
    fn quarters(&self) -> Option<[Self; 4]> {
        let corners = Bary::quarters(self.corners)?;
        let colours = bary::quarters(self.colours, bary::middles(self.colours));
        Some(std::array::from_fn(|i| Self {
            corners: corners[i],
            colours: colours[i],
        }))
    }
}

impl Refinement {
    /// Cuts an open leaf into parts, which the next [`rank_parts`](Self::rank_parts) makes candidates.
    pub(super) fn cut_into_parts(&mut self, stage: &Stage<'_>, id: LeafId) {
        self.error_mass -= self.leaf_mass(id);
        self.forest.pin(id);
        let leaf = self.forest.leaf(id);
        let (triangle, pixels) = (leaf.triangle, leaf.pixels as f32);
        let whole = Piece {
            corners: leaf.corners,
            colours: self.forest.colours(stage.base.colours(), id),
        };
        let parts = self.cut(stage, id, triangle, whole, pixels, CUT);
        let progress = self.leaf_progress(id);
        progress.patches = parts;
        progress.is_cut = true;
    }

    /// Takes a part up: cuts it again, or has its pixels shaded.
    pub(super) fn plan_part(&mut self, stage: &Stage<'_>, index: u32) {
        let part = self.parts[index as usize];
        self.error_mass -= part.mass();
        let triangle = self.forest.leaf(part.leaf).triangle;
        if is_large(part.pixels) && part.piece.quarters().is_some() {
            let parts = self.cut(stage, part.leaf, triangle, part.piece, part.pixels, CUT);
            self.leaf_progress(part.leaf).patches += parts;
            self.parts[index as usize].state = PartState::Cut;
        } else {
            let shade = self.shade_part(stage, &part, triangle);
            self.parts[index as usize].state = PartState::Shaded(shade);
        }
        let progress = self.leaf_progress(part.leaf);
        progress.patches -= 1;
        if progress.patches == 0 {
            self.forest.close(stage.world, part.leaf);
        }
    }

    /// Cuts a piece into at most `most` parts with samples, and counts them.
    fn cut(
        &mut self,
        stage: &Stage<'_>,
        leaf: LeafId,
        triangle: u32,
        piece: Piece,
        pixels: f32,
        most: usize,
    ) -> u32 {
        if most > 1
            && pixels > PART_PIXELS
            && let Some(quarters) = piece.quarters()
        {
            let quarters = quarters.into_iter();
            return quarters
                .map(|quarter| self.cut(stage, leaf, triangle, quarter, pixels * 0.25, most / 4))
                .sum();
        }
        self.parts.push(Part {
            leaf,
            piece,
            pixels,
            error: 0.0,
            state: PartState::Waiting,
        });
        let world = stage.world;
        let root = world.triangles[triangle as usize].map(|v| v as usize);
        let positions = root.map(|v| world.positions.get(v));
        let normals = root.map(|v| world.normals.get(v));
        let corners = piece.corners.map(Bary::weights);
        for weights in SAMPLE_WEIGHTS {
            let in_root = blend(weights, corners);
            self.samples.push(
                blend(in_root, positions),
                blend(in_root, normals),
                world.triangle_material[triangle as usize],
                blend(weights, piece.colours),
            );
        }
        1
    }

    /// Evaluates the samples of parts made since the last call, and makes the parts candidates.
    pub(super) fn rank_parts(&mut self, stage: &Stage<'_>) {
        if self.ranked_parts == self.parts.len() {
            return;
        }
        self.samples.illuminate(stage.exec, stage.world, stage.view);
        let fresh = std::mem::replace(&mut self.ranked_parts, self.parts.len());
        for (order, index) in (fresh..self.parts.len()).enumerate() {
            let first = order * SAMPLES_PER_PART;
            let square = |sample| {
                let [r, g, b] = self.samples.deviation(sample);
                (r * r + g * g + b * b) / 3.0
            };
            let sum: f32 = (first..first + SAMPLES_PER_PART).map(square).sum();
            self.parts[index].error = sum / SAMPLES_PER_PART as f32;
            self.error_mass += self.parts[index].mass();
            self.offer_part(stage, index as u32);
        }
        self.samples.clear();
    }

    /// Ranks a part and puts it on the queue.
    pub(super) fn offer_part(&mut self, stage: &Stage<'_>, index: u32) {
        let part = self.parts[index as usize];
        let triangle = self.forest.leaf(part.leaf).triangle;
        let active = self.active_lights(stage, triangle);
        let benefit = part.pixels * part.error.max(ranking::ERROR_FLOOR);
        let rank = benefit / cost::phong(part.pixels, active);
        self.queue.push(rank, Candidate::Part(index));
    }

    /// The root that a part belongs to.
    pub(super) fn root_of_part(&self, index: u32) -> Option<u32> {
        let leaf = self.parts[index as usize].leaf;
        self.root_of(self.forest.leaf(leaf).triangle)
    }

    fn shade_part(&mut self, stage: &Stage<'_>, part: &Part, triangle: u32) -> Shade {
        let root = self.root_of(triangle);
        root.map_or_else(Shade::default, |root| {
            let corners = part.piece.corners;
            self.shade_patch(stage, root, corners, part.pixels, part.mass())
        })
    }
}

/// The centroids of a triangle's quarters.
pub(super) const SAMPLE_WEIGHTS: [[f32; 3]; SAMPLES_PER_PART] = [
    [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0],
    [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0],
    [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0],
    [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
];
