//! The leaves of all subdivided triangles, and which leaves meet at an edge.

use super::estimate::{self, SAMPLES_AT_ONCE, Samples};
use super::shown::Shown;
use super::split::{CHILDREN_AT_ONCE, Planner};
use super::vertices::VertexPool;
use crate::geometry::bary::blend;
use crate::geometry::{Bary, Vec3s};
use crate::output::Interpolation;
use crate::parallel::Exec;
use crate::scene::{View, World};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Number of a leaf in its [`Forest`].
pub type LeafId = u32;

/// No leaf, no half-edge or no vertex.
pub(super) const NONE: u32 = u32::MAX;

/// Most leaves a forest holds, split ones included. When it is full nothing is subdivided any more; per-pixel shading
/// finishes the image.
pub(super) const MAX_LEAVES: usize = 1 << 18;

/// Leaves that there is room for from the start, lest moving views make every list grow again and again. To make so many takes
/// longer than a frame of an animation lasts; only a view that stays refines further.
pub const FIRST_LEAVES: usize = 1 << 13;

/// What has become of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeafState {
    /// It may be refined.
    Open,
    /// Its pixels are right.
    Closed,
    /// Its children have taken its place.
    Split,
}

/// A part of a root triangle that is painted with interpolated colours.
#[derive(Clone, Debug)]
pub struct Leaf {
    /// The root: a triangle of the world.
    pub triangle: u32,
    /// Corners in the root, counter-clockwise like it.
    pub corners: [Bary; 3],
    /// Vertices at the corners, for [`Forest::colours`].
    pub vertices: [u32; 3],
    /// How many visible pixels it has; of an image that is [drawn once](Forest::draw_once), an estimate.
    pub pixels: u32,
    /// Estimated mean squared error in squared codes; see [`estimate`].
    pub error: f32,
    /// Share of its area that holds the error, in (0, 1]: small when samples found it in few places.
    pub spread: f32,
    /// What has become of it.
    pub state: LeafState,
    /// False when a split was found not to help. One that is asked for nevertheless is carried out.
    pub splittable: bool,
    /// Vertices in the middle of edge k, from corner k to corner k + 1; `NONE` where the barycentric grid ends.
    pub(super) midpoints: [u32; 3],
    /// The next half-edge (`4 * leaf + k`) on the same welded edge.
    next_on_edge: [u32; 3],
    /// It takes part in a split that is being planned, or has been planted and not been illuminated.
    pub(super) busy: bool,
}

/// A leaf-to-be: a root just planted, or a child of a planned split.
#[derive(Clone, Debug)]
pub(super) struct Seedling {
    pub(super) triangle: u32,
    pub(super) corners: [Bary; 3],
    pub(super) vertices: [u32; 3],
    pub(super) midpoints: [u32; 3],
    /// Pixels it probably has.
    pub(super) pixels: f32,
    /// Its samples in the forest's [`Samples`].
    pub(super) samples: Range<usize>,
}

/// All leaves. See the [module](super).
#[derive(Clone, Debug, Default)]
pub struct Forest {
    pub(super) leaves: Vec<Leaf>,
    pub(super) vertices: VertexPool,
    pub(super) samples: Samples,
    pub(super) planner: Planner,
    /// Roots planted since the last illumination.
    fresh: Vec<(LeafId, Range<usize>)>,
    /// First half-edge on each welded edge, or `NONE`. Edges stay until the next image: the marks that a hash table leaves in
    /// place of removed entries can make it grow though it was large enough for the same work before.
    edges: FxHashMap<[u32; 2], u32>,
    planted: FxHashMap<u32, LeafId>,
    open: usize,
    /// What will be shown, if that is drawn once.
    pub(super) shown: Option<Shown>,
}

impl Forest {
    /// Forgets all leaves and keeps the memory. Needed before the first use, and whenever the world or view changes.
    pub fn reset(&mut self, world: &World) {
        self.leaves.clear();
        self.vertices.reset(world);
        self.samples.clear();
        self.planner.clear();
        self.fresh.clear();
        self.edges.clear();
        self.planted.clear();
        self.open = 0;
        self.leaves.reserve(FIRST_LEAVES);
        self.samples.reserve(SAMPLES_AT_ONCE);
        self.planner.make_room();
        self.edges.reserve(2 * FIRST_LEAVES);
        self.planted.reserve(FIRST_LEAVES);
        self.fresh.reserve(CHILDREN_AT_ONCE);
        self.shown = None;
        self.samples.set_interpolation(Interpolation::default());
    }

    /// How many triangles were ever made leaves.
    #[must_use]
    pub fn planted_roots(&self) -> usize {
        self.planted.len()
    }

    /// Positions of the leaf's corners in world space.
    #[must_use]
    pub fn positions(&self, world: &World, id: LeafId) -> [[f32; 3]; 3] {
        self.leaves[id as usize]
            .vertices
            .map(|v| self.vertices.position(world, v))
    }

    /// A leaf.
    ///
    /// # Panics
    /// When there is no such leaf.
    #[must_use]
    pub fn leaf(&self, id: LeafId) -> &Leaf {
        &self.leaves[id as usize]
    }

    /// The leaves that have not been split, with their numbers, in the order in which they were made.
    pub fn current_leaves(&self) -> impl Iterator<Item = (LeafId, &Leaf)> {
        (0..)
            .zip(&self.leaves)
            .filter(|(_, leaf)| leaf.state != LeafState::Split)
    }

    /// Whether the leaf takes part in a split that has been planned and not concluded, or has been planted and not been
    /// illuminated: it must be left alone until then.
    #[must_use]
    pub fn is_in_plan(&self, id: LeafId) -> bool {
        self.leaves[id as usize].busy
    }

    /// Leaves that are neither closed nor split.
    #[must_use]
    pub fn open_leaves(&self) -> usize {
        self.open
    }

    /// Whether `more` leaves still fit beside those that are planned.
    pub(super) fn has_room(&self, more: usize) -> bool {
        self.leaves.len() + self.planner.planned_leaves() + more <= MAX_LEAVES
    }

    /// Makes the triangle itself a leaf of `pixels` visible pixels, unless it has been planted before. Its error is known
    /// after the next [`illuminate`](Self::illuminate). Nothing happens when the forest is full.
    pub fn plant(
        &mut self,
        world: &World,
        base_colours: &Vec3s,
        triangle: u32,
        pixels: u32,
    ) -> Option<LeafId> {
        if self.planted.contains_key(&triangle) || !self.has_room(1) {
            return None;
        }
        let mut root = Seedling {
            triangle,
            corners: Bary::ROOT,
            vertices: world.triangles[triangle as usize],
            midpoints: [NONE; 3],
            pixels: pixels as f32,
            samples: 0..0,
        };
        self.prepare(world, base_colours, &mut root);
        let samples = root.samples.clone();
        let id = self.insert(world, &root, LeafError::NONE);
        let leaf = &mut self.leaves[id as usize];
        leaf.pixels = pixels;
        // No split may use its midpoints before they are illuminated.
        leaf.busy = true;
        self.planted.insert(triangle, id);
        self.fresh.push((id, samples));
        Some(id)
    }

    /// Whether the triangle was ever made a leaf.
    #[must_use]
    pub fn is_planted(&self, triangle: u32) -> bool {
        self.planted.contains_key(&triangle)
    }

    /// Illuminates all vertices and samples that planting and planning have made, and estimates errors from them.
    /// Appends the roots planted since the last call to `planted`.
    pub fn illuminate(
        &mut self,
        exec: Exec,
        world: &World,
        view: &View,
        base_colours: &Vec3s,
        planted: &mut Vec<LeafId>,
    ) {
        self.vertices
            .illuminate(exec, world, view, base_colours, self.shown.as_ref());
        self.samples.illuminate(exec, world, view);
        let mut fresh = std::mem::take(&mut self.fresh);
        for (id, samples) in fresh.drain(..) {
            let error = self.own_error(self.leaves[id as usize].midpoints, samples);
            let leaf = &mut self.leaves[id as usize];
            (leaf.error, leaf.spread) = (error.mean_square, error.spread);
            leaf.busy = false;
            planted.push(id);
        }
        self.fresh = fresh;
        self.estimate_planned(exec, world, view.encoding, base_colours);
        self.samples.clear();
    }

    /// Notes how many pixels painting has found the leaf to have.
    pub fn set_pixels(&mut self, id: LeafId, pixels: u32) {
        self.leaves[id as usize].pixels = pixels;
    }

    /// Notes that the leaf's pixels are right: it has been shaded per pixel, has none, or is proved right as it is.
    pub fn close(&mut self, world: &World, id: LeafId) {
        debug_assert!(!self.is_in_plan(id), "leaf {id} is about to be split");
        self.retire(world, id, LeafState::Closed);
        self.leaves[id as usize].error = 0.0;
    }

    /// Notes that splitting the leaf does not help, or not right away, and what its error was found to be.
    pub fn forbid_splitting(&mut self, id: LeafId, error: f32) {
        let leaf = &mut self.leaves[id as usize];
        leaf.splittable = false;
        leaf.error = error;
    }

    /// The other open leaves at edge `k` of a leaf, each with the number of that edge in it.
    pub fn neighbours(
        &self,
        world: &World,
        id: LeafId,
        k: usize,
    ) -> impl Iterator<Item = (LeafId, usize)> + '_ {
        self.half_edges(world, id, k)
            .filter(move |&(other, _)| other != id)
    }

    /// Notes that the leaf will be shaded part by part: until it is [closed](Self::close), neither it nor its edges are
    /// split, so that what is not shaded yet keeps matching its neighbours.
    pub fn pin(&mut self, id: LeafId) {
        let leaf = &mut self.leaves[id as usize];
        leaf.splittable = false;
        leaf.midpoints = [NONE; 3];
        leaf.error = 0.0;
    }

    /// Linear colours at the leaf's corners.
    #[must_use]
    pub fn colours(&self, base_colours: &Vec3s, id: LeafId) -> [[f32; 3]; 3] {
        self.leaves[id as usize]
            .vertices
            .map(|v| self.vertices.colour(base_colours, v))
    }

    /// Length, in codes, of the surplus at the middle of each edge; negative where the edge cannot be split.
    #[must_use]
    pub fn edge_surplus(&self, id: LeafId) -> [f32; 3] {
        self.leaves[id as usize].midpoints.map(|vertex| {
            if vertex == NONE {
                return -1.0;
            }
            let [r, g, b] = self.vertices.surplus(vertex);
            (r * r + g * g + b * b).sqrt()
        })
    }

    /// Finds or makes the midpoints of a seedling's edges, and samples its inside if it is large.
    pub(super) fn prepare(&mut self, world: &World, base_colours: &Vec3s, leaf: &mut Seedling) {
        let material = world.triangle_material[leaf.triangle as usize];
        for k in 0..3 {
            let next = (k + 1) % 3;
            leaf.midpoints[k] = match Bary::midpoint(leaf.corners[k], leaf.corners[next]) {
                Some(_) => {
                    self.vertices
                        .midpoint(world, material, leaf.vertices[k], leaf.vertices[next])
                }
                None => NONE,
            };
        }
        let first = self.samples.len();
        let positions = leaf.vertices.map(|v| self.vertices.position(world, v));
        let normals = leaf.vertices.map(|v| self.vertices.normal(world, v));
        let colours = self.shown_colours(base_colours, leaf.vertices);
        for index in 0..self.sample_count(leaf.pixels as u32) {
            let weights = estimate::sample_weights(index);
            self.samples.push(
                blend(weights, positions),
                blend(weights, normals),
                material,
                self.shown_blend(weights, positions, colours),
            );
        }
        leaf.samples = first..self.samples.len();
    }

    /// Error of a leaf by the surplus at its edges and the deviations at its samples.
    pub(super) fn own_error(&self, midpoints: [u32; 3], samples: Range<usize>) -> LeafError {
        let surplus = midpoints.map(|v| {
            if v == NONE {
                [0.0; 3]
            } else {
                self.vertices.surplus(v)
            }
        });
        let at_edges = LeafError {
            mean_square: estimate::mean_square([[0.0; 3]; 3], surplus),
            spread: 1.0,
        };
        let inside = LeafError::of_samples(samples.map(|sample| self.samples.deviation(sample)));
        if inside.mean_square > at_edges.mean_square {
            inside
        } else {
            at_edges
        }
    }

    /// Adds a leaf and hooks its edges up.
    pub(super) fn insert(
        &mut self,
        world: &World,
        seedling: &Seedling,
        error: LeafError,
    ) -> LeafId {
        let id = self.leaves.len() as LeafId;
        self.leaves.push(Leaf {
            triangle: seedling.triangle,
            corners: seedling.corners,
            vertices: seedling.vertices,
            pixels: seedling.pixels as u32,
            error: error.mean_square,
            spread: error.spread,
            state: LeafState::Open,
            splittable: true,
            midpoints: seedling.midpoints,
            next_on_edge: [NONE; 3],
            busy: false,
        });
        for k in 0..3 {
            let key = self.edge_key(world, id, k);
            let half_edge = id * 4 + k as u32;
            let next = self.edges.insert(key, half_edge).unwrap_or(NONE);
            self.leaves[id as usize].next_on_edge[k] = next;
        }
        self.open += 1;
        id
    }

    /// Takes an open leaf's edges off the lists.
    pub(super) fn retire(&mut self, world: &World, id: LeafId, state: LeafState) {
        if self.leaves[id as usize].state != LeafState::Open {
            return;
        }
        for k in 0..3 {
            self.unhook(world, id, k);
        }
        self.leaves[id as usize].state = state;
        self.open -= 1;
    }

    fn unhook(&mut self, world: &World, id: LeafId, k: usize) {
        let key = self.edge_key(world, id, k);
        let gone = id * 4 + k as u32;
        let after = self.leaves[id as usize].next_on_edge[k];
        let Some(head) = self.edges.get_mut(&key) else {
            return;
        };
        if *head == gone {
            *head = after;
            return;
        }
        let mut at = *head;
        while at != NONE {
            let next = &mut self.leaves[(at / 4) as usize].next_on_edge[(at % 4) as usize];
            if *next == gone {
                *next = after;
                return;
            }
            at = *next;
        }
    }

    /// The half-edges of open leaves on edge `k` of leaf `id`, itself included.
    pub(super) fn half_edges(
        &self,
        world: &World,
        id: LeafId,
        k: usize,
    ) -> impl Iterator<Item = (LeafId, usize)> + '_ {
        let key = self.edge_key(world, id, k);
        let mut at = self.edges.get(&key).copied().unwrap_or(NONE);
        std::iter::from_fn(move || {
            (at != NONE).then(|| {
                let (leaf, edge) = (at / 4, (at % 4) as usize);
                at = self.leaves[leaf as usize].next_on_edge[edge];
                (leaf, edge)
            })
        })
    }

    fn edge_key(&self, world: &World, id: LeafId, k: usize) -> [u32; 2] {
        let vertices = self.leaves[id as usize].vertices;
        let a = self.vertices.weld(world, vertices[k]);
        let b = self.vertices.weld(world, vertices[(k + 1) % 3]);
        [a.min(b), a.max(b)]
    }
}

/// An estimated error, and how it is spread over a leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LeafError {
    /// Mean square, in squared codes.
    pub(super) mean_square: f32,
    /// Share of the area that holds it, in (0, 1].
    pub(super) spread: f32,
}

impl LeafError {
    /// No error, anywhere.
    pub(super) const NONE: Self = Self {
        mean_square: 0.0,
        spread: 1.0,
    };

    /// By deviations at evenly spread samples. The spread is the participation ratio `(sum e)^2 / (n sum e^2)` of the
    /// squared deviations `e`: 1 when all are the same, `k / n` when `k` of `n` are and the others zero.
    pub(super) fn of_samples(deviations: impl Iterator<Item = [f32; 3]>) -> Self {
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        for [r, g, b] in deviations {
            let e = (r * r + g * g + b * b) / 3.0;
            sum += e;
            squares += e * e;
            count += 1.0;
        }
        if squares > 0.0 {
            Self {
                mean_square: sum / count,
                spread: sum * sum / (count * squares),
            }
        } else {
            Self::NONE
        }
    }
}
