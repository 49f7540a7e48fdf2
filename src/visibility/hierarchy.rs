//! Clusters in blocks of eight, and blocks in blocks of eight, up to one.
//!
//! Level 0 holds the bounds of clusters in their [`order`], which comes from hierarchies of boxes; level k holds those of
//! sets of `8^k` consecutive ones, so that no block needs to store where its children are, nor how many clusters are
//! below.
//!
//! A set's bounds come from all clusters below, not from the sets between, which keeps them tight.

use super::block::{Block, LANES};
use super::bound::Bound;
use super::order::order;
use crate::geometry::Cluster;
use std::ops::Range;

/// The hierarchy. Its shape depends on the clusters it was built from, its bounds on where they are now.
#[derive(Clone)]
pub(super) struct Hierarchy {
    /// For each position on level 0, the index of its cluster.
    order: Vec<u32>,
    /// Level by level, from clusters upwards.
    blocks: Vec<Block>,
    /// Where each level begins among `blocks`; the last one has one block. Empty if there is no cluster.
    levels: Vec<usize>,
    /// For each block of level 0, whether one of its clusters has moved.
    moved: Vec<bool>,
}

/// A bound: its level and its position there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) level: usize,
    pub(super) position: usize,
}

impl Hierarchy {
    pub(super) fn new(clusters: &[Cluster]) -> Self {
        let bounds: Vec<Bound> = clusters.iter().map(Bound::of_cluster).collect();
        let (mut levels, mut total, mut count) = (Vec::new(), 0, clusters.len());
        while count > 0 && levels.last().is_none_or(|_| count > 1) {
            levels.push(total);
            count = count.div_ceil(LANES);
            total += count;
        }
        let mut hierarchy = Self {
            order: order(&bounds),
            blocks: vec![Block::EMPTY; total],
            levels,
            moved: vec![true; clusters.len().div_ceil(LANES)],
        };
        for position in 0..clusters.len() {
            let bound = &bounds[hierarchy.order[position] as usize];
            hierarchy.blocks[position / LANES].set(position % LANES, bound);
        }
        hierarchy.bound_sets();
        hierarchy
    }

    /// Takes over the bounds of the clusters for which `has_moved`, by index.
    pub(super) fn refit(&mut self, clusters: &[Cluster], has_moved: impl Fn(usize) -> bool) {
        self.moved.fill(false);
        for position in 0..self.order.len() {
            let index = self.order[position] as usize;
            if has_moved(index) {
                let bound = Bound::of_cluster(&clusters[index]);
                self.blocks[position / LANES].set(position % LANES, &bound);
                self.moved[position / LANES] = true;
            }
        }
        self.bound_sets();
    }

    /// Bounds every set anew in which something has moved.
    fn bound_sets(&mut self) {
        for level in 1..self.levels.len() {
            for position in 0..self.len(level) {
                let place = Place { level, position };
                let below = self.below(place);
                let blocks = below.start / LANES..below.end.div_ceil(LANES);
                if self.moved[blocks].contains(&true) {
                    let bound = Bound::of_set(below.map(|i| self.cluster_bound(i)));
                    let block = self.levels[level] + position / LANES;
                    self.blocks[block].set(position % LANES, &bound);
                }
            }
        }
    }

    fn cluster_bound(&self, position: usize) -> Bound {
        self.blocks[position / LANES].get(position % LANES)
    }

    /// How many bounds a level has.
    fn len(&self, level: usize) -> usize {
        self.order.len().div_ceil(size(level))
    }

    /// The level of the single block that everything is below, if there is anything.
    pub(super) fn top(&self) -> Option<usize> {
        self.levels.len().checked_sub(1)
    }

    /// The block on `level` that holds a bound.
    pub(super) fn block(&self, Place { level, position }: Place) -> &Block {
        &self.blocks[self.levels[level] + position / LANES]
    }

    /// The positions of the bounds in the block that begins at `first`.
    pub(super) fn lanes(&self, first: Place) -> Range<usize> {
        first.position..self.len(first.level).min(first.position + LANES)
    }

    /// The positions on level 0 of all clusters below a bound.
    pub(super) fn below(&self, Place { level, position }: Place) -> Range<usize> {
        let size = size(level);
        position * size..self.order.len().min((position + 1) * size)
    }

    /// The index of a cluster by its position.
    pub(super) fn cluster(&self, position: usize) -> u32 {
        self.order[position]
    }
}

/// How many clusters are below a bound.
fn size(level: usize) -> usize {
    LANES.pow(level as u32)
}
