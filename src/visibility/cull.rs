//! Drops clusters of triangles that cannot have a pixel.
//!
//! **Outside of the view.** Take six functions, linear in the world point, with a margin m of `MARGIN_PX`: `w - z`,
//! `z`, `x w + m w`, `(width + m) w - x w`, `y w + m w` and `(height + m) w - y w`. A vertex that clipping leaves is
//! a convex combination of its triangle's corners. So if one of the functions is negative on a ball that holds all
//! corners, it is negative at every such vertex. For the first two this contradicts what clipping leaves, `w >= z >=
//! 0`: there is no vertex. For the others it means that all vertices are beyond one side of the image by more than m,
//! and still beyond it after the rounding to sub-pixels, so that the triangle's box holds no pixel centre. The bounds
//! over the ball include all rounding: see the module `halfspace`.
//!
//! **Facing away**: see the module `facing`. Backs that are drawn have clusters of their own.
//!
//! **Sets** of clusters in a hierarchy are tested like clusters, eight at once, from the largest downwards. What was
//! proved of a set holds below: half-spaces that it does not stick out of, and which way it faces, are not tested
//! again. A set is dropped as a whole if it is outside of the view; within the view also if it faces away (at the
//! border its clusters are still told apart, so that those outside are counted as such), and is taken as a whole if
//! nothing in it faces away. So time goes to what is along the borders of the image and along silhouettes.
//! Results are those of testing each cluster by itself, up to rounding, and do not depend on threads or SIMD.

use super::block::{AWAY, Balls, Block, CROSSING, FRONT, LANES, OUTSIDE, State, States, UNCLIPPED};
use super::facing::Facing;
use super::halfspace::Linear;
use super::hierarchy::{Hierarchy, Place};
use super::runs::Runs;
use crate::geometry::Cluster;
use crate::scene::View;
use std::fmt;
use std::ops::Range;

/// How far outside of the image something must be to be dropped.
const MARGIN_PX: f64 = 1.0;

/// What one [`Culler::cull`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CullCounts {
    /// Clusters there are.
    pub clusters: u32,
    /// Those dropped because they are outside of the view.
    pub outside_frustum: u32,
    /// Those dropped because they face away.
    pub facing_away: u32,
    /// Triangles in the clusters that are left.
    pub triangles: u32,
}

/// Finds the clusters that may be visible. Built once for a scene; keeps its memory between frames.
#[derive(Clone)]
pub struct Culler {
    /// Ascending by triangles.
    clusters: Vec<Cluster>,
    hierarchy: Hierarchy,
    /// The clusters that are left, by their indices.
    kept: Runs,
    /// Blocks still to visit, by their first bounds, and what is known of all that is in them.
    stack: Vec<(Place, State)>,
    /// How many blocks were visited for the last view.
    visited: usize,
}

impl fmt::Debug for Culler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Culler")
            .field("clusters", &self.clusters.len())
            .field("visited", &self.visited)
            .finish_non_exhaustive()
    }
}

impl Culler {
    /// Prepares culling of `clusters`, whose triangle ranges must be disjoint.
    #[must_use]
    pub fn new(clusters: &[Cluster]) -> Self {
        let mut clusters = clusters.to_vec();
        clusters.sort_by_key(|cluster| cluster.triangles.start);
        let hierarchy = Hierarchy::new(&clusters);
        let depth = hierarchy.top().map_or(0, |top| top + 1);
        Self {
            kept: Runs::new(clusters.iter().map(|cluster| cluster.triangles.clone())),
            // Taking one block off and putting eight on adds seven for each level.
            stack: Vec::with_capacity(LANES * depth),
            hierarchy,
            clusters,
            visited: 0,
        }
    }

    /// Takes over the bounds of the same clusters, in ascending order of their triangles, after some of them have moved:
    /// the hierarchy keeps its shape, and the bounds of sets in which something has moved grow or shrink. Allocates
    /// nothing.
    ///
    /// # Panics
    /// When the clusters' triangles are not those of before.
    pub fn refit(&mut self, clusters: &[Cluster]) {
        assert_eq!(clusters.len(), self.clusters.len(), "the same clusters");
        for (old, new) in self.clusters.iter().zip(clusters) {
            assert_eq!(old.triangles, new.triangles, "the same clusters");
        }
        let old = &self.clusters;
        self.hierarchy.refit(clusters, |i| old[i] != clusters[i]);
        self.clusters.clone_from_slice(clusters);
    }

    /// Writes the triangles that may be visible to `out`, as ascending, disjoint and never adjacent ranges.
    ///
    /// Every triangle with a pixel is among them, by the rules of [`geometry::screen`](crate::geometry::screen).
    /// Allocates only where `out` is too small to hold a range for every second cluster.
    pub fn cull(&mut self, view: &View, out: &mut Vec<Range<u32>>) -> CullCounts {
        let tests = Tests::new(view);
        self.kept.clear();
        let mut facing_away = 0;
        self.visited = 0;
        self.stack.clear();
        if let Some(level) = self.hierarchy.top() {
            self.stack.push((Place { level, position: 0 }, CROSSING));
        }
        while let Some((first, state)) = self.stack.pop() {
            self.visited += 1;
            let is_set = first.level > 0;
            let states = tests.states(self.hierarchy.block(first), state, is_set);
            facing_away += if is_set {
                self.visit_sets(first, &states)
            } else {
                self.visit_clusters(first, &states)
            };
        }
        let clusters = self.clusters.len() as u32;
        let kept = self.kept.count();
        CullCounts {
            clusters,
            outside_frustum: clusters - kept - facing_away,
            facing_away,
            triangles: self.kept.write(out),
        }
    }

    /// Drops or keeps each set of a block, or puts what it consists of on the stack. Returns how many clusters were
    /// dropped because they face away.
    fn visit_sets(&mut self, first: Place, states: &States) -> u32 {
        let mut away = 0;
        for (position, &state) in self.hierarchy.lanes(first).zip(states) {
            let place = Place { position, ..first };
            if state & OUTSIDE != 0 {
                continue;
            }
            let is_inside = state & CROSSING == 0;
            if is_inside && state & AWAY != 0 {
                away += self.hierarchy.below(place).len() as u32;
            } else if is_inside && state & FRONT != 0 {
                for position in self.hierarchy.below(place) {
                    self.kept.insert(self.hierarchy.cluster(position));
                }
            } else {
                let children = Place {
                    level: first.level - 1,
                    position: position * LANES,
                };
                self.stack.push((children, state));
            }
        }
        away
    }

    /// Drops or keeps each cluster of a block. Returns how many were dropped because they face away.
    fn visit_clusters(&mut self, first: Place, states: &States) -> u32 {
        let mut away = 0;
        for (position, &state) in self.hierarchy.lanes(first).zip(states) {
            if state & (OUTSIDE | AWAY) == 0 {
                self.kept.insert(self.hierarchy.cluster(position));
            }
            away += u32::from(state & (OUTSIDE | AWAY) == AWAY);
        }
        away
    }
}

/// The tests of one view.
struct Tests {
    /// The six functions that are not negative anywhere in the image.
    frustum: [Linear; 6],
    facing: Facing,
}

impl Tests {
    fn new(view: &View) -> Self {
        let m = MARGIN_PX;
        let (right, bottom) = (f64::from(view.width) + m, f64::from(view.height) + m);
        let frustum = [
            [0.0, 0.0, -1.0, 1.0],
            [0.0, 0.0, 1.0, 0.0],
            [1.0, 0.0, 0.0, m],
            [-1.0, 0.0, 0.0, right],
            [0.0, 1.0, 0.0, m],
            [0.0, -1.0, 0.0, bottom],
        ]
        .map(|weights| Linear::of_rows(&view.pixel_from_world, weights));
        Self {
            frustum,
            facing: Facing::new(&view.pixel_from_world),
        }
    }

    /// What is known of the bounds in a block, of all of which `known` is. Sets are worth a closer look, because what is
    /// found out about them need not be for their members.
    fn states(&self, block: &Block, known: State, is_set: bool) -> States {
        let balls = block.balls();
        let mut states = [known & !CROSSING; LANES];
        for (bit, plane) in self.frustum.iter().enumerate() {
            if known >> bit & 1 == 1 {
                cross(plane, 1 << bit, &balls, &mut states);
            }
        }
        if known & (AWAY | FRONT) == 0 && states.iter().any(|state| state & OUTSIDE == 0) {
            if is_set && known & UNCLIPPED == 0 {
                self.facing.find_unclipped(&balls, &mut states);
            }
            self.facing.test(block, &balls, &mut states);
        }
        states
    }
}

/// Adds `crossing` to the states of balls that stick out of a half-space, or [`OUTSIDE`] where all of the ball does.
fn cross(plane: &Linear, crossing: State, balls: &Balls, states: &mut States) {
    for (i, state) in states.iter_mut().enumerate() {
        let range = plane.over_ball(balls.center(i), balls.radius[i], balls.reach[i]);
        let is_inside = range.min > 0.0;
        let is_outside = range.max < 0.0;
        *state |= if is_inside { 0 } else { crossing } | if is_outside { OUTSIDE } else { 0 };
    }
}

#[cfg(test)]
mod tests;
