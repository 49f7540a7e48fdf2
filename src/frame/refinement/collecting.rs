//! Collecting pieces: every visible triangle of a new image becomes a root and a candidate.
//!
//! For each triangle that means the paper's sign tests at its corners, a first guess of its error from its colours and, if it is
//! not tiny, from one true colour at its centroid, and a rank. None of it depends on other triangles, so the pieces may be of any size and are
//! shared among threads. They come before all planning, so that the best candidates come first; they are
//! booked by the clock only, for without them nothing is known about the image.
//!
//! Triangles are taken in blocks of [`BLOCK`]. Inside a block what is needed of a vertex is worked out once, as a rule:
//! where two vertices share a place in a small table, some of it is done again, to the same result.

use super::memory::Memory;
use super::painting::piece_limit;
use super::ranking::{self, RootRanking};
use super::{PIECE_UNITS, Refinement, Root, Stage, drawn_once};
use crate::geometry::Vec3s;
use crate::highlight::{self, SignBits};
use crate::parallel::Exec;
use crate::refine::Curving;
use crate::refine::estimate::Samples;
use crate::scene::{View, World};
use crate::schedule::{Allowance, Rank, cost};

/// Triangles of a block. Pieces consist of whole blocks, so that sums over blocks do not depend on the pieces.
const BLOCK: usize = 512;

/// Shares of a piece per thread: a thread that comes late leaves some of its own to others.
const SHARES_PER_THREAD: usize = 4;

/// Blocks of a share, as a rule at most.
const BLOCKS_IN_SHARE: usize = 64;

/// Materials in a block, as a rule at most.
const MATERIALS_IN_BLOCK: usize = 4;

/// A triangle of so many pixels has its centroid sampled, whatever its corners say: it may hide a highlight.
const PIXELS_FOR_CENTROID: u32 = 64;

/// So has a smaller one where the corners let expect such a sum of squared errors. Nine tenths of the error of tiny triangles is in a
/// fifth of them, which the corners tell from the others; to sample all would cost as much as shading some of them.
const MASS_FOR_CENTROID: f32 = 0.125;

/// About as many triangles have so many pixels as are sampled: by that the cost of collecting is told in advance.
const PIXELS_AS_A_RULE: u32 = 8;

/// Most vertices of a block, and one more; a power of two, as no index is checked then.
const LISTED: usize = (3 * BLOCK + 1).next_power_of_two();

/// What blocks are collected from.
#[derive(Clone, Copy)]
struct Source<'a> {
    exec: Exec,
    world: &'a World,
    view: &'a View,
    /// Linear colours of the vertices.
    colours: &'a Vec3s,
    ranking: RootRanking<'a>,
    /// Triangles that are divided.
    curving: &'a Curving,
    /// No material lacks a specular term.
    all_specular: bool,
    /// What is remembered, if anything may be.
    memory: Option<&'a Memory>,
    /// Triangles of fewer pixels are no candidates.
    least_pixels: u32,
}

/// What a block has come to.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    /// Expected sum of squared errors, as in [`Refinement::error_mass`].
    error_mass: f64,
    pixels: u64,
    phts: u64,
    /// Triangles whose material has no specular term.
    matte: u64,
}

/// Workspace of a share of a piece.
#[derive(Debug)]
pub(super) struct Collector {
    /// Vertices of the block's triangles.
    vertices: Box<[u32; LISTED]>,
    /// The place in `vertices` of the last vertex with each remainder; of an older block where it does not hold it.
    table: Box<[u16; LISTED]>,
    /// Places in `vertices` of the triangles' corners.
    corners: Box<[[u16; 3]; BLOCK]>,
    /// What [`ranking::lightness`] says, by place.
    lightness: Box<[f32; LISTED]>,
    signs: SignBits,
    /// Whether the triangles' centroids are sampled.
    is_sampled: Box<[bool; BLOCK]>,
    samples: Samples,
    /// One for each block of the share.
    tallies: Vec<Tally>,
}

impl Collector {
    fn new() -> Self {
        Self {
            vertices: Box::new([0; LISTED]),
            table: Box::new([0; LISTED]),
            corners: Box::new([[0; 3]; BLOCK]),
            lightness: Box::new([0.0; LISTED]),
            signs: SignBits::default(),
            is_sampled: Box::new([false; BLOCK]),
            samples: Samples::default(),
            tallies: Vec::new(),
        }
    }

    /// Makes room, once for a world, for any block and as a rule any share.
    fn make_room(&mut self, world: &World) {
        self.signs.reserve(3 * BLOCK, world.lights.len());
        self.samples.clear();
        // Samples are kept by material.
        let materials = world.materials.len().clamp(1, MATERIALS_IN_BLOCK);
        self.samples.reserve(BLOCK * materials);
        self.tallies.clear();
        self.tallies.reserve(BLOCKS_IN_SHARE);
    }

    /// Collects the triangles of a share, of which the ids and pixels are known.
    fn collect(&mut self, source: &Source<'_>, roots: &mut [Root], ranks: &mut [Rank]) {
        self.tallies.clear();
        for (roots, ranks) in roots.chunks_mut(BLOCK).zip(ranks.chunks_mut(BLOCK)) {
            let tally = self.collect_block(source, roots, ranks);
            self.tallies.push(tally);
        }
    }

    fn collect_block(
        &mut self,
        source: &Source<'_>,
        roots: &mut [Root],
        ranks: &mut [Rank],
    ) -> Tally {
        let mut tally = Tally::default();
        let vertices = self.list_vertices(source.world, roots);
        self.guess_from_corners(source, vertices, roots, &mut tally);
        if !source.ranking.by_area {
            self.recall(source, roots);
            self.sample_centroids(source, roots);
        }
        for (root, rank) in roots.iter().zip(ranks) {
            tally.pixels += u64::from(root.pixels);
            tally.error_mass += root.mass();
            if root.pixels >= source.least_pixels {
                *rank = Rank::new(source.ranking.choose(root).0);
            }
        }
        tally
    }

    /// Lists the vertices of some triangles, and which of them are their corners. Says how many they are.
    fn list_vertices(&mut self, world: &World, roots: &[Root]) -> usize {
        let mut count = 0;
        for (root, corners) in roots.iter().zip(self.corners.iter_mut()) {
            for (vertex, corner) in world.triangles[root.triangle as usize].iter().zip(corners) {
                // Without branches: whether a vertex is known can hardly be predicted.
                let entry = &mut self.table[*vertex as usize % LISTED];
                let place = usize::from(*entry);
                let is_known = (place < count) & (self.vertices[place % LISTED] == *vertex);
                self.vertices[count % LISTED] = *vertex;
                *entry = if is_known { place } else { count } as u16;
                *corner = *entry;
                count += usize::from(!is_known);
            }
        }
        count
    }

    /// Tests for highlights, and guesses errors, by what is known at the corners.
    fn guess_from_corners(
        &mut self,
        source: &Source<'_>,
        vertices: usize,
        roots: &mut [Root],
        tally: &mut Tally,
    ) {
        let Source { world, view, .. } = *source;
        let vertices = &self.vertices[..vertices];
        for (&vertex, lightness) in vertices.iter().zip(self.lightness.iter_mut()) {
            *lightness = ranking::lightness(view.encoding, source.colours.get(vertex as usize));
        }
        let is_specular = |triangle: u32| {
            let material = world.triangle_material[triangle as usize];
            world.materials[usize::from(material)].is_specular()
        };
        let is_tested = |root: &Root| source.all_specular || is_specular(root.triangle);
        let tested = roots.iter().filter(|root| is_tested(root)).count();
        tally.matte = (roots.len() - tested) as u64;
        if tested > 0 {
            let signs = &mut self.signs;
            highlight::compute_signs(source.exec.level, world, view.eye, vertices, signs);
        }
        for (root, &corners) in roots.iter_mut().zip(self.corners.iter()) {
            let corners = corners.map(usize::from);
            root.is_pht = is_tested(root) && self.signs.is_pht(corners);
            let lightness = corners.map(|place| self.lightness[place % LISTED]);
            root.prior = ranking::prior_error(lightness, root.is_pht);
            tally.phts += u64::from(root.is_pht);
        }
    }

    /// Puts what is remembered in place of guesses, and chooses among the other triangles those whose centroids are sampled.
    fn recall(&mut self, source: &Source<'_>, roots: &mut [Root]) {
        for (root, is_sampled) in roots.iter_mut().zip(self.is_sampled.iter_mut()) {
            let mass = root.pixels as f32 * root.prior;
            *is_sampled = root.pixels >= PIXELS_FOR_CENTROID || mass >= MASS_FOR_CENTROID;
            root.is_curved = source.curving.error(root.triangle).is_some();
            if root.is_curved {
                // What the quadratics leave is known, as far as their nodes tell.
            } else if let Some(memory) = source.memory
                && let Some(error) = memory.recall(root.triangle)
            {
                root.prior = error.max(ranking::ERROR_FLOOR);
                *is_sampled = false;
            } else if !*is_sampled {
                root.prior = ranking::unsampled_error(root.prior);
            }
        }
    }

    /// Adds to the prior error of triangles what one true colour, at their centroids, has to say.
    fn sample_centroids(&mut self, source: &Source<'_>, roots: &mut [Root]) {
        let Source { world, view, .. } = *source;
        let Self {
            samples,
            is_sampled,
            ..
        } = self;
        samples.clear();
        let sampled = || (0..roots.len()).filter(|&index| is_sampled[index]);
        for index in sampled() {
            let root = &roots[index];
            let corners = world.triangles[root.triangle as usize].map(|v| v as usize);
            samples.push(
                mean(corners.map(|v| world.positions.get(v))),
                mean(corners.map(|v| world.normals.get(v))),
                world.triangle_material[root.triangle as usize],
                mean(corners.map(|v| source.colours.get(v))),
            );
        }
        let exec = source.exec.on_one_thread();
        samples.illuminate(exec, world, view);
        for (sample, index) in sampled().enumerate() {
            let [r, g, b] = samples.deviation(sample);
            let square = (r * r + g * g + b * b) / 3.0;
            roots[index].prior += ranking::centroid_error(square, roots[index].is_pht);
        }
        for root in roots.iter_mut().filter(|root| root.is_curved) {
            let (divisions, error) = source.curving.of(root.triangle);
            root.prior = ranking::curved_error(root.prior, divisions, error);
        }
    }
}

/// The mean of a triangle's corners.
fn mean(v: [[f32; 3]; 3]) -> [f32; 3] {
    std::array::from_fn(|k| (v[0][k] + v[1][k] + v[2][k]) / 3.0)
}

/// Into how many shares a piece is cut.
fn shares(exec: Exec) -> usize {
    match exec.threads {
        1 => 1,
        threads => threads * SHARES_PER_THREAD,
    }
}

impl Refinement {
    /// Whether visible triangles are left that are not candidates yet.
    pub(super) fn is_collecting(&self) -> bool {
        self.roots.len() < self.visible
    }

    /// Makes room for collecting in pieces.
    pub(super) fn make_collectors(&mut self, exec: Exec, world: &World) {
        let shares = shares(exec).max(self.collectors.len());
        self.collectors.resize_with(shares, Collector::new);
        for collector in &mut self.collectors {
            collector.make_room(world);
        }
    }

    /// Makes the next visible triangles candidates. False when the budget does not admit it.
    pub(super) fn collect_piece(
        &mut self,
        stage: &Stage<'_>,
        allowance: &mut Allowance<'_>,
    ) -> bool {
        let limit = piece_limit(stage, allowance).min(allowance.units_left().max(PIECE_UNITS));
        let lights = stage.world.lights.len();
        let each = cost::collecting(1.0, lights) + cost::samples(1, lights);
        let left = (self.visible - self.roots.len()) as f32 * each;
        // A block is taken as a whole.
        let least = (BLOCK as f32 * each) as u64;
        if !allowance.admit_free(limit.max(least).min(left as u64)) {
            return false;
        }
        let first = self.roots.len();
        let nominal_ns = self.take_up(stage, limit as f32);
        self.collect_from(stage, first);
        allowance.note_free(nominal_ns as u64);
        true
    }

    /// Makes the next visible triangles roots of which only ids and pixels are known, block by block until collecting them will take
    /// so many nominal nanoseconds, or somewhat more. Returns how many.
    pub(super) fn take_up(&mut self, stage: &Stage<'_>, limit: f32) -> f32 {
        let lights = stage.world.lights.len();
        let (each, sample) = (cost::collecting(1.0, lights), cost::samples(1, lights));
        let visible = stage.backend.visible_triangles();
        let left = visible.get(self.roots.len()..).unwrap_or_default();
        let mut units = 0.0;
        for block in left.chunks(BLOCK) {
            for &triangle in block {
                let pixels = stage.backend.visible_pixels(triangle);
                let is_sampled = pixels >= PIXELS_AS_A_RULE && !self.by_area;
                units += each + if is_sampled { sample } else { 0.0 };
                self.places.push(triangle);
                self.roots.push(Root::new(triangle, pixels));
            }
            if units >= limit {
                break;
            }
        }
        units
    }

    /// Collects the roots from `first` on.
    pub(super) fn collect_from(&mut self, stage: &Stage<'_>, first: usize) {
        let roots = &mut self.roots[first..];
        let ranks = self.ranked_roots.extend(roots.len());
        // A still view may go on with more threads.
        let shares = shares(stage.exec).min(self.collectors.len());
        let share = (roots.len().div_ceil(BLOCK).div_ceil(shares) * BLOCK).max(BLOCK);
        let source = Source {
            exec: stage.exec,
            world: stage.world,
            view: stage.view,
            colours: stage.base.colours(),
            curving: stage.base.curving(),
            ranking: RootRanking {
                forest: &self.forest,
                lights: stage.world.lights.len(),
                by_area: self.by_area,
                is_drawn_once: self.is_drawn_once,
            },
            memory: self.remembers.then_some(&self.memory),
            all_specular: stage.world.materials.iter().all(|m| m.is_specular()),
            least_pixels: if self.is_drawn_once {
                drawn_once::LEAST_PIXELS
            } else {
                0
            },
        };
        let collectors = &mut self.collectors[..shares];
        let exec = stage.exec;
        exec.for_each_chunk_with(collectors, roots, ranks, share, |own, roots, ranks| {
            own.collect(&source, roots, ranks);
        });
        let used = roots.len().div_ceil(share);
        let tallies = self.collectors[..used].iter().flat_map(|own| &own.tallies);
        for tally in tallies {
            self.pixels += tally.pixels;
            self.error_mass += tally.error_mass;
            self.counters.phts += tally.phts;
            self.counters.matte += tally.matte;
        }
        self.ranked_roots.admit(first);
    }
}

#[cfg(test)]
mod tests;
