//! Bounds of many small triangles at once.
//!
//! A triangle of a few pixels is shaded before its bounds are found. But those of a **run** of up to [`RUN`] consecutive triangles of
//! a cluster cost hardly more than one's ([`ClusterShape`]), and where they prove it right as it is none of its triangles is shaded: of a
//! mesh of 57,000 triangles a quarter of those in view, of which seven tenths could be proved one by one, for more than shading them costs.
//! They are found when the first triangle of a run is asked for, once for an image.

use super::{NONE, Stage};
use crate::geometry::clusters::{MAX_TRIANGLES, RUN};
use crate::highlight::{self, ClusterShape, TriangleLights};
use crate::scene::World;
use crate::schedule::cost;
use std::ops::Range;

/// Runs of a cluster.
const RUNS: usize = MAX_TRIANGLES / RUN;

/// Runs that there is room for from the start.
const FIRST_RUNS: usize = 1 << 10;

/// What is known of the current image's runs.
#[derive(Debug, Default)]
pub(super) struct Runs {
    /// The place in `known` of each run, or [`NONE`].
    places: Vec<u32>,
    /// Runs that were asked for, by their numbers.
    known: Vec<(u32, TriangleLights)>,
}

impl Runs {
    /// Begins with an image of which nothing is known.
    pub(super) fn begin(&mut self, world: &World) {
        for &(run, _) in &self.known {
            self.places[run as usize] = NONE;
        }
        self.known.clear();
        self.known.reserve(FIRST_RUNS);
        self.places.resize(world.clusters.len() * RUNS, NONE);
    }

    /// Whether the bounds of the triangle's run are still to be found.
    pub(super) fn is_unknown(&self, world: &World, triangle: u32) -> bool {
        let (run, _) = run_of(world, triangle);
        self.places[run as usize] == NONE
    }

    /// The terms that some triangle of this one's run needs, and the run's triangles.
    pub(super) fn lights(
        &mut self,
        stage: &Stage<'_>,
        triangle: u32,
    ) -> (TriangleLights, Range<u32>) {
        let Stage { world, view, .. } = *stage;
        let (run, triangles) = run_of(world, triangle);
        let place = &mut self.places[run as usize];
        if *place == NONE {
            *place = self.known.len() as u32;
            let shape = ClusterShape::new(world, triangles.clone());
            let lights =
                highlight::cluster_masks(world, &view.eye, view.encoding, triangle, &shape);
            self.known.push((run, lights));
        }
        (self.known[*place as usize].1, triangles)
    }
}

/// The number of the run that a triangle belongs to, and its triangles.
fn run_of(world: &World, triangle: u32) -> (u32, Range<u32>) {
    let cluster = world
        .clusters
        .partition_point(|cluster| cluster.triangles.start <= triangle)
        .saturating_sub(1);
    let Range { start, end } = world.clusters[cluster].triangles;
    let run = (triangle - start) / RUN as u32;
    let first = start + run * RUN as u32;
    let number = (cluster * RUNS) as u32 + run;
    (number, first..end.min(first + RUN as u32))
}

/// Whether the bounds of a run save more than they cost, if half of its triangles have so many pixels and are proved.
pub(super) fn pay(pixels: u32, lights: usize) -> bool {
    let shading = cost::phong(pixels as f32, lights) * RUN as f32;
    shading * 0.5 >= cost::run_bounds(lights)
}
