//! Drops clusters of triangles that cannot have a pixel.
//!
//! **Outside of the view.** Take six functions, linear in the world point, with a margin m of `MARGIN_PX`: `w - z`,
//! `z`, `x w + m w`, `(width + m) w - x w`, `y w + m w` and `(height + m) w - y w`. A vertex that clipping leaves is
//! a convex combination of its triangle's corners. So if one of the functions is negative on a ball that holds all
//! corners, it is negative at every such vertex. For the first two this contradicts what clipping leaves, `w >= z >=
//! 0`: there is no vertex. For the others it means that all vertices are beyond one side of the image by more than m,
//! and still beyond it after the rounding to sub-pixels, so that the triangle's box holds no pixel centre. The bounds
//! over the ball, and over the boxes of a bounding volume hierarchy about the balls, include all rounding: see the
//! module `halfspace`.
//!
//! **Facing away**: see the module `facing`. Backs that are drawn have clusters of their own.
//!
//! A subtree that lies inside of one of the six half-spaces is not tested against it any more. Results do not depend
//! on threads or SIMD: this is scalar `f64` arithmetic.

use super::facing::Facing;
use super::halfspace::Linear;
use crate::geometry::Cluster;
use crate::scene::View;
use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use std::fmt;
use std::ops::Range;

/// How far outside of the image something must be to be dropped.
const MARGIN_PX: f64 = 1.0;

/// A bit for each of the six half-spaces.
const ALL_PLANES: u8 = 0b11_1111;

/// Coordinates up to this go into the hierarchy, whose builder squares them; clusters that reach beyond are always
/// drawn.
const LARGEST_COORDINATE: f32 = 1e15;

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
    /// The hierarchy, its root first; a leaf holds one cluster, by its index in `clusters`.
    hierarchy: Bvh2,
    /// Clusters that are not in the hierarchy.
    unbounded: Vec<u32>,
    /// Nodes still to visit, and the half-spaces that they may stick out of.
    stack: Vec<(u32, u8)>,
    /// For each cluster, whether it is left.
    kept: Vec<bool>,
}

impl fmt::Debug for Culler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Culler")
            .field("clusters", &self.clusters.len())
            .finish_non_exhaustive()
    }
}

impl Culler {
    /// Prepares culling of `clusters`, whose triangle ranges must be disjoint.
    #[must_use]
    pub fn new(clusters: &[Cluster]) -> Self {
        let mut clusters = clusters.to_vec();
        clusters.sort_by_key(|cluster| cluster.triangles.start);
        let (mut boxes, mut bounded, mut unbounded) = (Vec::new(), Vec::new(), Vec::new());
        for (index, cluster) in (0_u32..).zip(&clusters) {
            if let Some(aabb) = bounding_box(cluster) {
                boxes.push(aabb);
                bounded.push(index);
            } else {
                unbounded.push(index);
            }
        }
        let hierarchy = PlocBuilder::new().build(
            PlocSearchDistance::Medium,
            &boxes,
            bounded,
            SortPrecision::U64,
            0,
        );
        Self {
            kept: vec![false; clusters.len()],
            // Taking one node off and putting two on adds one for each level.
            stack: Vec::with_capacity(hierarchy.max_depth + 2),
            hierarchy,
            clusters,
            unbounded,
        }
    }

    /// Takes over the bounds of the same clusters, in ascending order of their triangles, after some of them have moved:
    /// the hierarchy keeps its shape, and its boxes grow or shrink. Allocates only if a cluster's coordinates have become
    /// reasonable or ceased to be so.
    ///
    /// # Panics
    /// When the clusters' triangles are not those of before.
    pub fn refit(&mut self, clusters: &[Cluster]) {
        assert_eq!(clusters.len(), self.clusters.len(), "the same clusters");
        for (old, new) in self.clusters.iter_mut().zip(clusters) {
            assert_eq!(old.triangles, new.triangles, "the same clusters");
            old.clone_from(new);
        }
        let indices = (0_u32..).zip(&self.clusters);
        let unbounded = indices.filter(|(_, cluster)| bounding_box(cluster).is_none());
        if !unbounded
            .map(|(index, _)| index)
            .eq(self.unbounded.iter().copied())
        {
            *self = Self::new(clusters);
            return;
        }
        for node in &mut self.hierarchy.nodes {
            if node.is_leaf()
                && let Some(aabb) = bounding_box(&self.clusters[node.first_index as usize])
            {
                node.set_aabb(aabb);
            }
        }
        self.hierarchy.refit_all();
    }

    /// Writes the triangles that may be visible to `out`, as ascending, disjoint and never adjacent ranges.
    ///
    /// Every triangle with a pixel is among them, by the rules of [`geometry::screen`](crate::geometry::screen).
    /// Allocates only where `out` is too small to hold a range for every second cluster.
    pub fn cull(&mut self, view: &View, out: &mut Vec<Range<u32>>) -> CullCounts {
        let facing = Facing::new(&view.pixel_from_world);
        let planes = frustum(view);
        let mut counts = CullCounts {
            clusters: self.clusters.len() as u32,
            ..CullCounts::default()
        };
        self.kept.fill(false);
        for &index in &self.unbounded {
            self.kept[index as usize] = true;
        }
        let mut inside = self.unbounded.len() as u32;
        self.stack.clear();
        if !self.hierarchy.nodes.is_empty() {
            self.stack.push((0, ALL_PLANES));
        }
        while let Some((index, candidates)) = self.stack.pop() {
            let node = self.hierarchy.nodes[index as usize];
            let Some(crossed) = crossed_by_box(&planes, node.aabb(), candidates) else {
                continue;
            };
            if !node.is_leaf() {
                self.stack.push((node.first_index + 1, crossed));
                self.stack.push((node.first_index, crossed));
                continue;
            }
            let index = node.first_index as usize;
            let cluster = &self.clusters[index];
            if is_outside(&planes, cluster, crossed) {
                continue;
            }
            inside += 1;
            if facing.is_away(cluster) {
                counts.facing_away += 1;
            } else {
                self.kept[index] = true;
            }
        }
        counts.outside_frustum = counts.clusters - inside;
        counts.triangles = self.collect(out);
        counts
    }

    /// Writes the kept clusters' triangles to `out`, adjacent ranges joined; returns how many triangles.
    fn collect(&self, out: &mut Vec<Range<u32>>) -> u32 {
        out.clear();
        // Enough for any view, so that a later one does not allocate.
        out.reserve(self.clusters.len().div_ceil(2));
        let mut triangles = 0;
        let kept = self
            .clusters
            .iter()
            .zip(&self.kept)
            .filter(|(_, kept)| **kept);
        for (cluster, _) in kept {
            let range = cluster.triangles.clone();
            triangles += range.len() as u32;
            match out.last_mut() {
                Some(last) if last.end == range.start => last.end = range.end,
                _ => out.push(range),
            }
        }
        triangles
    }
}

/// The six functions that are not negative anywhere in the image.
fn frustum(view: &View) -> [Linear; 6] {
    let m = MARGIN_PX;
    let (right, bottom) = (f64::from(view.width) + m, f64::from(view.height) + m);
    [
        [0.0, 0.0, -1.0, 1.0],
        [0.0, 0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0, m],
        [-1.0, 0.0, 0.0, right],
        [0.0, 1.0, 0.0, m],
        [0.0, -1.0, 0.0, bottom],
    ]
    .map(|weights| Linear::of_rows(&view.pixel_from_world, weights))
}

/// The half-spaces among `candidates` that the box is not entirely inside of, or `None` if it is entirely outside of
/// one.
fn crossed_by_box(planes: &[Linear; 6], aabb: &Aabb, candidates: u8) -> Option<u8> {
    let (min, max) = (aabb.min.as_dvec3(), aabb.max.as_dvec3());
    let (center, half) = ((min + max) * 0.5, (max - min) * 0.5);
    let mut crossed = candidates;
    for (bit, plane) in planes.iter().enumerate() {
        if candidates >> bit & 1 == 0 {
            continue;
        }
        let range = plane.over_box(center, half);
        if range.max < 0.0 {
            return None;
        }
        if range.min > 0.0 {
            crossed &= !(1 << bit);
        }
    }
    Some(crossed)
}

/// Whether the cluster's ball is entirely outside of one of the `candidates`.
fn is_outside(planes: &[Linear; 6], cluster: &Cluster, candidates: u8) -> bool {
    let center = DVec3::from(cluster.center.map(f64::from));
    let radius = f64::from(cluster.radius);
    planes
        .iter()
        .enumerate()
        .any(|(bit, plane)| candidates >> bit & 1 == 1 && plane.over_ball(center, radius).max < 0.0)
}

/// The box about a cluster's ball, rounded outwards, if it is of reasonable size.
fn bounding_box(cluster: &Cluster) -> Option<Aabb> {
    let corner = |sign: f32| {
        Vec3A::from(cluster.center.map(|c| {
            let bound = c + sign * cluster.radius;
            // The sum is the nearest f32, so that the next one is beyond the exact sum.
            if sign < 0.0 {
                bound.next_down()
            } else {
                bound.next_up()
            }
        }))
    };
    let (min, max) = (corner(-1.0), corner(1.0));
    let reasonable = |v: Vec3A| v.is_finite() && v.abs().max_element() <= LARGEST_COORDINATE;
    (reasonable(min) && reasonable(max)).then_some(Aabb { min, max })
}

#[cfg(test)]
mod tests;
