//! Regular subdivision before the first image is drawn: triangles get the colours of [curved] parts.
//!
//! Illuminating a point costs about as much as colouring a few pixels. So a large triangle is illuminated at the nodes of parts,
//! as many as its pixels [pay for](CurvingRule), and its first image is drawn with a quadratic over each part in place of one linear
//! function over all of it. That takes away most of its error and hardly costs more. It happens in two passes over triangles, shared among threads:
//!
//! 1. **Illuminate.** Every triangle that may be divided at all begins with one part, in place of a linear function. Where quadratics over fewer parts agree with the nodes that
//!    are left over, within [`TOLERANCE`], these do: down to none, which is Gouraud shading. Where even the next ones will not, as
//!    errors fall as a rule, it goes on with twice as many along each edge, if its pixels pay for them. Such a round is over all triangles.
//! 2. **Fit.** On an edge that it shares with a coarser triangle (same vertices, hence the same normals and colours) the finer one takes the
//!    coarser one's values, so that there is no step in colour; that is why subdivision need not spread. Then every part gets its quadratic.
//!
//! What becomes of a triangle depends on its pixels and its neighbours' alone, not on threads.

mod fitting;
mod nodes;

use crate::geometry::curved::{self, node_count};
use crate::geometry::{CurvedTriangles, Vec3s};
use crate::illumination::{ActiveLights, ShadingKit, shade_points};
use crate::output::Encoding;
use crate::parallel::Exec;
use crate::scene::{View, World};
use fitting::Fitting;
use nodes::Nodes;
use std::ops::Range;

/// Mean squared error, in squared codes, up to which fewer parts are good enough.
const TOLERANCE: f32 = 0.25;

/// What division by `n` takes the mean squared error of highlights down to, as a rule, from what the next coarser one leaves: this
/// over `n`. Once a highlight is resolved, the error of quadratics falls faster.
const GAIN: f32 = 1.0 / 3.0;

/// A triangle with more pixels to a node may hide a highlight between them, whatever the nodes say.
const PIXELS_PER_NODE: u32 = 64;

/// Shares that triangles are divided into for threads.
const SHARES: usize = 16;

/// Triangles, and parts of them, that a share has room for from the start; and four times as many nodes.
const ROOM: usize = 1 << 10;

/// How many pixels a triangle must have to be divided by 1, 2, 4 and 8.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CurvingRule(pub [u32; 4]);

impl CurvingRule {
    /// By how much a triangle of `pixels` pixels is divided; 0: not at all.
    #[must_use]
    pub fn divisions(&self, pixels: u32) -> u32 {
        let levels = self.0.iter().filter(|&&least| pixels >= least).count();
        (1 << levels) >> 1
    }
}

/// A triangle that might become curved.
#[derive(Clone, Copy, Debug, Default)]
struct Job {
    triangle: u32,
    pixels: u32,
    /// By how much its pixels allow it to be divided.
    most: u32,
    /// By how much its nodes divide it.
    finest: u32,
    /// By how much it is divided in the end.
    divisions: u32,
    first_node: usize,
    /// Estimated mean squared error, in squared codes.
    error: f32,
}

/// What curving has come to, or a round of it would.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CurvingCounts {
    /// Triangles that were looked at.
    pub triangles: u64,
    /// Nodes that were illuminated.
    pub nodes: u64,
    /// Parts that were found.
    pub parts: u64,
    /// Pixels of triangles with one part.
    pub curved_pixels: u64,
    /// Pixels of those with several.
    pub parted_pixels: u64,
}

/// Some consecutive visible triangles.
#[derive(Clone, Debug, Default)]
struct Share {
    jobs: Vec<Job>,
    points: Vec3s,
    normals: Vec3s,
    colours: Vec3s,
    /// Parts of its curved triangles.
    parts: usize,
}

/// Workspace of curving, and what has come of it.
#[derive(Clone, Debug, Default)]
pub struct Curving {
    shares: Vec<Share>,
    curved: CurvedTriangles,
    /// By place in `curved`.
    errors: Vec<f32>,
}

impl Curving {
    /// No triangle is curved.
    pub fn clear(&mut self) {
        self.curved.clear(0);
        self.errors.clear();
    }

    /// The triangles that are curved.
    #[must_use]
    pub fn curved(&self) -> &CurvedTriangles {
        &self.curved
    }

    /// Estimated mean squared error of a curved triangle, in squared codes; `None` of others.
    #[inline]
    #[must_use]
    pub fn error(&self, triangle: u32) -> Option<f32> {
        let place = self.curved.index().place(triangle)?;
        self.errors.get(place).copied()
    }

    /// By how much a triangle is divided, and its estimated mean squared error; zero for one that is not curved.
    #[must_use]
    pub fn of(&self, triangle: u32) -> (u32, f32) {
        let error = self.error(triangle).unwrap_or_default();
        (self.curved.index().divisions(triangle), error)
    }

    /// Begins with the visible triangles whose pixels pay for division. `pixels` tells how many a triangle owns.
    pub fn begin(
        &mut self,
        visible: &[u32],
        pixels: &(dyn Fn(u32) -> u32 + Sync),
        rule: CurvingRule,
    ) {
        self.make_room();
        let each = visible.len().div_ceil(SHARES).max(1);
        let mut chunks = visible.chunks(each);
        for share in &mut self.shares {
            share.clear();
            for &triangle in chunks.next().unwrap_or_default() {
                let pixels = pixels(triangle);
                let most = rule.divisions(pixels);
                if most > 0 {
                    share.jobs.push(Job {
                        triangle,
                        pixels,
                        most,
                        ..Job::default()
                    });
                }
            }
        }
    }

    /// What it would come to as a rule if another round divided by `n`: 1 in the first round, and twice as much in each that follows.
    #[must_use]
    pub fn with_round(&self, n: u32) -> CurvingCounts {
        let mut counts = CurvingCounts::default();
        for job in self.jobs() {
            let (mut divisions, goes_on) = (job.divisions, job.goes_on_with(n));
            // Where one only looks, nothing is found as a rule.
            if goes_on && (n == 1 || job.is_rough()) {
                divisions = n;
            }
            counts.count(divisions, job.pixels);
            counts.nodes += if goes_on { node_count(n) as u64 } else { 0 };
        }
        self.count_nodes(&mut counts);
        counts
    }

    /// Pixels of the triangles that can be divided most finely.
    #[must_use]
    pub fn finest_pixels(&self) -> u64 {
        let finest = self.jobs().filter(|job| job.most == curved::MOST_DIVISIONS);
        finest.map(|job| u64::from(job.pixels)).sum()
    }

    /// What it has come to.
    #[must_use]
    pub fn counts(&self) -> CurvingCounts {
        let mut counts = CurvingCounts::default();
        for job in self.jobs() {
            counts.count(job.divisions, job.pixels);
        }
        self.count_nodes(&mut counts);
        counts
    }

    /// Divides nothing by more than `n` after all.
    pub fn retreat(&mut self, n: u32) {
        for job in self.shares.iter_mut().flat_map(|share| &mut share.jobs) {
            job.divisions = job.divisions.min(n);
        }
    }

    /// Makes room, once, for as much as images need as a rule.
    fn make_room(&mut self) {
        if self.shares.is_empty() {
            self.shares.resize_with(SHARES, Share::with_room);
            self.curved.reserve(SHARES * ROOM, SHARES * ROOM);
            self.errors.reserve(SHARES * ROOM);
        }
    }

    fn jobs(&self) -> impl Iterator<Item = &Job> {
        self.shares.iter().flat_map(|share| &share.jobs)
    }

    fn count_nodes(&self, counts: &mut CurvingCounts) {
        for share in &self.shares {
            counts.triangles += share.jobs.len() as u64;
            counts.nodes += share.points.len() as u64;
        }
    }

    /// Divides by `n` what that is worth it for.
    pub fn round(&mut self, exec: Exec, world: &World, view: &View, n: u32) {
        exec.for_each_chunk(&mut self.shares, 1, |_, shares| {
            for share in shares {
                share.round(exec, world, view, n);
            }
        });
    }

    /// Finds the quadratics of all parts.
    pub fn finish(&mut self, exec: Exec, world: &World, pixels: &(dyn Fn(u32) -> u32 + Sync)) {
        self.curved.clear(world.triangles.len());
        self.errors.clear();
        for share in &mut self.shares {
            share.jobs.retain(|job| job.divisions > 0);
            share.parts = 0;
            for job in &share.jobs {
                self.curved.push(job.triangle, job.divisions);
                self.errors.push(job.error);
                share.parts += curved::part_count(job.divisions);
            }
        }
        let (index, parts) = self.curved.split_mut();
        let fitting = Fitting {
            exec,
            world,
            index,
            pixels,
        };
        fitting.fit(&self.shares, parts);
    }
}

impl CurvingCounts {
    fn count(&mut self, divisions: u32, pixels: u32) {
        self.parts += curved::part_count(divisions) as u64;
        match divisions {
            0 => {}
            1 => self.curved_pixels += u64::from(pixels),
            _ => self.parted_pixels += u64::from(pixels),
        }
    }
}

impl Share {
    fn with_room() -> Self {
        let [points, normals, colours] = std::array::from_fn(|_| Vec3s::with_capacity(4 * ROOM));
        Self {
            jobs: Vec::with_capacity(ROOM),
            points,
            normals,
            colours,
            parts: 0,
        }
    }

    fn clear(&mut self) {
        self.jobs.clear();
        self.points.clear();
        self.normals.clear();
        self.colours.clear();
        self.parts = 0;
    }

    /// Illuminates the nodes of a round, and finds out how many parts are needed.
    fn round(&mut self, exec: Exec, world: &World, view: &View, n: u32) {
        let first = self.points.len();
        for job in self.jobs.iter_mut().filter(|job| job.goes_on_with(n)) {
            job.finest = n;
            job.first_node = self.points.len();
            let vertices = world.triangles[job.triangle as usize].map(|v| v as usize);
            let corners = vertices.map(|v| world.positions.get(v));
            push_nodes(n, corners, &mut self.points);
            let corners = vertices.map(|v| world.normals.get(v));
            push_nodes(n, corners, &mut self.normals);
        }
        self.illuminate_from(first, exec, world, view);
        let is_new = |job: &&mut Job| job.finest > 0 && job.first_node >= first;
        for job in self.jobs.iter_mut().filter(is_new) {
            job.coarsen(view.encoding, &self.colours);
        }
    }

    /// Illuminates the nodes from `first` on, one run of a material after the other.
    fn illuminate_from(&mut self, first: usize, exec: Exec, world: &World, view: &View) {
        let active = ActiveLights::all(world.lights.len());
        self.colours.resize(self.points.len());
        let (points, normals, colours) = (&self.points, &self.normals, &mut self.colours);
        let mut illuminate = |material: usize, range: Range<usize>| {
            let kit = ShadingKit::new(view.eye, &world.materials[material], &world.lights);
            shade_points(exec.level, &kit, &active, range, points, normals, colours);
        };
        let (mut run, mut run_material) = (first..first, 0);
        for job in self
            .jobs
            .iter()
            .filter(|job| job.finest > 0 && job.first_node >= first)
        {
            let material = usize::from(world.triangle_material[job.triangle as usize]);
            if material != run_material {
                illuminate(run_material, run);
                (run, run_material) = (job.first_node..job.first_node, material);
            }
            run.end = job.first_node + node_count(job.finest);
        }
        illuminate(run_material, run);
    }
}

/// Appends the values at the nodes of a triangle divided by `n`, linear between its corners.
fn push_nodes(n: u32, [o, p, q]: [[f32; 3]; 3], to: &mut Vec3s) {
    let m = 2 * n;
    let scale = 1.0 / m as f32;
    for (k, to) in [&mut to.x, &mut to.y, &mut to.z].into_iter().enumerate() {
        let (across, down) = ((p[k] - o[k]) * scale, (q[k] - o[k]) * scale);
        for a in 0..=m {
            let start = o[k] + across * a as f32;
            to.extend((0..=m - a).map(|b| start + down * b as f32));
        }
    }
}

impl Job {
    /// Its nodes.
    fn nodes<'a>(&self, colours: &'a Vec3s) -> Nodes<'a> {
        Nodes::new(colours, self.first_node, self.finest)
    }

    /// Whether it is to be divided by `n`: in the first round, or where less is not enough, or too little to tell.
    fn goes_on_with(&self, n: u32) -> bool {
        if n == 1 {
            return true;
        }
        let is_unseen = || self.pixels > PIXELS_PER_NODE * node_count(n / 2) as u32;
        self.finest == n / 2 && self.most >= n && (self.is_rough() || is_unseen())
    }

    /// Whether what its nodes have divided it into is too coarse.
    fn is_rough(&self) -> bool {
        self.divisions == self.finest && self.error > TOLERANCE
    }

    /// Divides it by no more than it takes, and estimates the error that is left.
    fn coarsen(&mut self, encoding: Encoding, colours: &Vec3s) {
        let nodes = self.nodes(colours);
        self.divisions = self.finest;
        while self.divisions > 0 {
            let coarser = self.divisions / 2;
            let error = match coarser {
                0 => nodes.linear_error(encoding),
                n => nodes.error_of(encoding, n),
            };
            if self.divisions == self.finest {
                self.error = error * GAIN / self.finest as f32;
            }
            // Not so for NaN.
            let is_enough = error <= TOLERANCE;
            if !is_enough {
                return;
            }
            self.error = error;
            self.divisions = coarser;
        }
    }
}

/// Calls `f` with row and column of each part, and whether it is upright.
#[inline(always)]
fn for_each_part(n: u32, mut f: impl FnMut([u32; 2], bool)) {
    for i in 0..n {
        for j in 0..n - i {
            f([i, j], true);
            if i + j < n - 1 {
                f([i, j], false);
            }
        }
    }
}

#[cfg(test)]
mod tests;
