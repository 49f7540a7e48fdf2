//! Clusters: runs of at most [`MAX_TRIANGLES`] triangles that lie close together, with bounds by which a whole run
//! can be skipped at once.
//!
//! The triangles of an object are split recursively in the middle along the longest axis of the box about their
//! centroids, in proportion to a balanced number of clusters, until a part is one cluster; between 64 and 128
//! triangles each unless there are fewer in all. This reorders the triangles, since a cluster is a range of them.
//!
//! Bounds hold for the stored `f32` positions, rounding included:
//!
//! * every vertex of every triangle lies in the closed ball of `center` and `radius`;
//! * `n . cone_axis >= cone_cos` for the exact unit normal `n` of every triangle with an area;
//! * every triangle whose three corners are at different places has no altitude below `min_altitude`.
//!
//! Directions of face normals come from cross products in `f64`. A difference of two `f32` coordinates is rounded once
//! at most, so a cross product is off by less than 2^-50 |u||v|. Where |u x v| is below 2^-30 |u||v|, this may turn
//! the direction by more than 2^-20, and the cone is given up; otherwise `CONE_PADDING` covers it.

use super::Vec3s;
use glam::DVec3;
use std::ops::Range;

/// Most triangles of a run: what is left when a cluster is split on in the same way, into consecutive triangles that lie closer together still.
/// From its first triangle on a cluster consists of whole runs and, last of all, the rest.
pub const RUN: usize = 16;

/// Most triangles of a cluster.
pub const MAX_TRIANGLES: usize = 128;

/// What the cosine of a cone is lowered by: an angle of at least 2e-6, more than the 2^-20 that a face normal may be
/// off and the rounding of the axis to `f32`, whose length is not exactly 1.
const CONE_PADDING: f64 = 2e-6;

/// Consecutive triangles that lie close together, and bounds on them.
#[derive(Clone, Debug, PartialEq)]
pub struct Cluster {
    /// The triangles.
    pub triangles: Range<u32>,
    /// Centre of a ball about all vertices.
    pub center: [f32; 3],
    /// Its radius; infinite if a vertex is not finite.
    pub radius: f32,
    /// Axis of a cone about the geometric normals of all triangles with an area; a unit vector up to rounding.
    pub cone_axis: [f32; 3],
    /// Cosine of the cone's half-angle; -1, which means all directions, when there is no narrower cone or no triangle
    /// with an area.
    pub cone_cos: f32,
    /// Lower bound of the altitudes of all triangles with three different corners; 0 if there are none.
    pub min_altitude: f32,
}

impl Cluster {
    /// The same triangles seen from behind: with the opposite winding, and numbers greater by `shift`.
    #[must_use]
    pub fn turned(&self, shift: u32) -> Self {
        Self {
            triangles: self.triangles.start + shift..self.triangles.end + shift,
            cone_axis: self.cone_axis.map(|c| -c),
            ..*self
        }
    }
}

/// Reorders the triangles of one object so that consecutive ones are close together, and cuts them into clusters, whose
/// ranges begin at `first_triangle`.
///
/// # Panics
/// When a vertex index is out of range.
#[must_use]
pub fn build_clusters(
    positions: &Vec3s,
    triangles: &mut [[u32; 3]],
    first_triangle: u32,
) -> Vec<Cluster> {
    let mut items: Vec<Item> = triangles
        .iter()
        .map(|&corners| Item::new(positions, corners))
        .zip(0..)
        .map(|(item, index)| Item { index, ..item })
        .collect();
    let mut sizes = Vec::new();
    split(&mut items, &mut sizes);
    for (slot, item) in triangles.iter_mut().zip(&items) {
        *slot = item.corners;
    }
    let mut start = 0;
    sizes
        .into_iter()
        .map(|size| {
            let range = start..start + size;
            start += size;
            let first = first_triangle + range.start as u32;
            bound(positions, &triangles[range], first)
        })
        .collect()
}

/// Bounds a cluster anew after its vertices have moved. `triangles` are all there are.
///
/// # Panics
/// When the cluster's range or a vertex index is out of range.
pub fn bound_again(positions: &Vec3s, triangles: &[[u32; 3]], cluster: &mut Cluster) {
    let range = cluster.triangles.start as usize..cluster.triangles.end as usize;
    *cluster = bound(positions, &triangles[range], cluster.triangles.start);
}

/// A triangle while it is being sorted.
struct Item {
    corners: [u32; 3],
    /// Sum of the corners; no need to divide by three.
    centroid: [f64; 3],
    /// Position in the input, which breaks ties.
    index: u32,
}

impl Item {
    fn new(positions: &Vec3s, corners: [u32; 3]) -> Self {
        let points = corners.map(|v| positions.get(v as usize));
        Self {
            corners,
            centroid: std::array::from_fn(|k| points.iter().map(|p| f64::from(p[k])).sum()),
            index: 0,
        }
    }
}

/// Sorts `items` into clusters and appends their sizes.
fn split(items: &mut [Item], sizes: &mut Vec<usize>) {
    let clusters = items.len().div_ceil(MAX_TRIANGLES);
    if clusters <= 1 {
        if !items.is_empty() {
            sort_into_runs(items);
            sizes.push(items.len());
        }
        return;
    }
    // In proportion to the clusters on each side, so that none gets more than its share.
    let middle = items.len() * (clusters / 2) / clusters;
    let (left, right) = halves(items, middle);
    split(left, sizes);
    split(right, sizes);
}

/// Sorts the items of a cluster into runs.
fn sort_into_runs(items: &mut [Item]) {
    let runs = items.len().div_ceil(RUN);
    if runs <= 1 {
        // Inside a run the author's order is as good as any, and often a strip.
        items.sort_unstable_by_key(|item| item.index);
        return;
    }
    let (left, right) = halves(items, runs / 2 * RUN);
    sort_into_runs(left);
    sort_into_runs(right);
}

/// Brings those with the least centroids along the longest axis of the box about all to the front, so many of them.
fn halves(items: &mut [Item], middle: usize) -> (&mut [Item], &mut [Item]) {
    let extent = |k: usize| {
        let values = items.iter().map(|item| item.centroid[k]);
        let min = values.clone().fold(f64::INFINITY, f64::min);
        values.fold(f64::NEG_INFINITY, f64::max) - min
    };
    let extents: [f64; 3] = std::array::from_fn(extent);
    let axis = (1..3).fold(
        0,
        |best, k| if extents[k] > extents[best] { k } else { best },
    );
    items.select_nth_unstable_by(middle, |a, b| {
        (a.centroid[axis].total_cmp(&b.centroid[axis])).then(a.index.cmp(&b.index))
    });
    items.split_at_mut(middle)
}

/// The bounds of one cluster.
fn bound(positions: &Vec3s, triangles: &[[u32; 3]], first: u32) -> Cluster {
    let corners = |t: &[u32; 3]| t.map(|v| DVec3::from(positions.get(v as usize).map(f64::from)));
    let (center, radius) = ball(triangles.iter().flat_map(corners));
    let mut faces = Faces::default();
    for triangle in triangles {
        faces.add(corners(triangle));
    }
    let (cone_axis, cone_cos) = faces.normal_cone();
    Cluster {
        triangles: first..first + triangles.len() as u32,
        center,
        radius,
        cone_axis,
        cone_cos,
        min_altitude: faces.min_altitude(),
    }
}

/// The ball about the middle of the points' box that holds them all.
fn ball(points: impl Iterator<Item = DVec3> + Clone) -> ([f32; 3], f32) {
    let mut bounds = crate::math::Bounds::EMPTY;
    points.clone().for_each(|p| bounds.grow(p));
    let center = bounds.center().as_vec3();
    let radius = points
        .map(|p| p.distance(center.as_dvec3()))
        // `f64::max` would lose a NaN.
        .fold(0.0, |max, d| if d <= max { max } else { d });
    if !(center.is_finite() && radius.is_finite()) {
        return ([0.0; 3], f32::INFINITY);
    }
    let radius = if radius > 0.0 {
        // One step of f32 above the nearest is more than the f64 distance may be off.
        (radius as f32).next_up()
    } else {
        0.0
    };
    (center.to_array(), radius)
}

/// What the faces of a cluster have in common, each looked at once.
struct Faces {
    /// Unit normals of the triangles with an area.
    normals: [DVec3; MAX_TRIANGLES],
    count: usize,
    sum: DVec3,
    /// Whether every triangle's normal is known well, or it has no area.
    are_certain: bool,
    /// The smallest altitude of a triangle with three different corners, less what it may be off.
    altitude: f64,
}

impl Default for Faces {
    fn default() -> Self {
        Self {
            normals: [DVec3::ZERO; MAX_TRIANGLES],
            count: 0,
            sum: DVec3::ZERO,
            are_certain: true,
            altitude: f64::INFINITY,
        }
    }
}

impl Faces {
    fn add(&mut self, [a, b, c]: [DVec3; 3]) {
        let (u, v) = (b - a, c - a);
        let (uu, vv, ww) = (
            u.length_squared(),
            v.length_squared(),
            b.distance_squared(c),
        );
        let cross = u.cross(v);
        let length = cross.length();
        if length * length > uu * vv * 2.0_f64.powi(-60) {
            let normal = cross / length;
            self.normals[self.count] = normal;
            self.count += 1;
            self.sum += normal;
        } else if length != 0.0 {
            // A needle whose normal is uncertain, or NaN.
            self.are_certain = false;
        }
        if a != b && b != c && c != a {
            let longest = uu.max(vv).max(ww).sqrt();
            // The area's error, at most 2^-50 |u||v|, over the longest edge.
            let altitude = length / longest - longest * 2.0_f64.powi(-50);
            // `f64::min` would lose a NaN.
            self.altitude = if altitude >= self.altitude {
                self.altitude
            } else {
                altitude
            };
        }
    }

    /// Axis and cosine of the half-angle of a cone about all face normals.
    fn normal_cone(&self) -> ([f32; 3], f32) {
        let everything = (DVec3::Z.as_vec3().to_array(), -1.0);
        let Some(axis) = self.sum.try_normalize().filter(|_| self.are_certain) else {
            return everything;
        };
        let axis = axis.as_vec3();
        let cos = self.normals[..self.count]
            .iter()
            .map(|normal| normal.dot(axis.as_dvec3()))
            .fold(1.0, f64::min);
        let padded = ((cos - CONE_PADDING) as f32).next_down();
        if padded.is_finite() && axis.is_finite() {
            (axis.to_array(), padded.max(-1.0))
        } else {
            everything
        }
    }

    /// A lower bound of the altitudes of all triangles with three different corners, 0 if there are none.
    fn min_altitude(&self) -> f32 {
        if self.altitude > 0.0 && self.altitude.is_finite() {
            (self.altitude as f32).next_down().max(0.0)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Mesh, shapes};
    use proptest::prelude::*;

    fn positions_of(mesh: &Mesh) -> Vec3s {
        let mut out = Vec3s::default();
        for p in &mesh.positions {
            out.push(p.as_vec3().to_array());
        }
        out
    }

    /// Clusters tile the range, keep all triangles with their winding, and hold what they claim to.
    fn check(positions: &Vec3s, triangles: &[[u32; 3]]) -> (Vec<[u32; 3]>, Vec<Cluster>) {
        let mut sorted = triangles.to_vec();
        let clusters = build_clusters(positions, &mut sorted, 1000);
        let (mut before, mut after) = (triangles.to_vec(), sorted.clone());
        before.sort_unstable();
        after.sort_unstable();
        assert_eq!(before, after, "the same triangles");
        let mut next = 1000;
        for cluster in &clusters {
            assert_eq!(cluster.triangles.start, next, "consecutive");
            next = cluster.triangles.end;
            let size = cluster.triangles.len();
            assert!(size <= MAX_TRIANGLES && (size >= 64 || clusters.len() == 1));
            let range = cluster.triangles.start - 1000..cluster.triangles.end - 1000;
            for t in &sorted[range.start as usize..range.end as usize] {
                check_triangle(cluster, t.map(|v| positions.get(v as usize)));
            }
        }
        assert_eq!(next as usize, 1000 + triangles.len());
        (sorted, clusters)
    }

    fn check_triangle(cluster: &Cluster, corners: [[f32; 3]; 3]) {
        let [a, b, c] = corners.map(|p| DVec3::from(p.map(f64::from)));
        let center = DVec3::from(cluster.center.map(f64::from));
        for p in [a, b, c] {
            assert!(p.distance_squared(center) <= f64::from(cluster.radius).powi(2));
        }
        let cross = (b - a).cross(c - a);
        if let Some(n) = cross.try_normalize() {
            let cos = n.dot(DVec3::from(cluster.cone_axis.map(f64::from)));
            let inside = cos >= f64::from(cluster.cone_cos) || cluster.cone_cos == -1.0;
            assert!(inside, "{cos} {cluster:?}");
        }
        if a != b && b != c && c != a {
            for (p, q) in [(a, b), (b, c), (c, a)] {
                let altitude = cross.length() / p.distance(q);
                assert!(altitude >= f64::from(cluster.min_altitude));
            }
        }
    }

    #[test]
    fn shapes_are_bounded() {
        for mesh in [
            shapes::teapot(8, true),
            shapes::sphere(100, 50),
            shapes::cuboid(DVec3::new(1.0, 1e-3, 1e3)),
            shapes::plane(3.0, 4.0, 64, 64),
        ] {
            check(&positions_of(&mesh), &mesh.triangles);
        }
    }

    #[test]
    fn clusters_of_a_sphere_are_compact() {
        let mesh = shapes::sphere(128, 64);
        let (_, clusters) = check(&positions_of(&mesh), &mesh.triangles);
        let mean = clusters.iter().map(|c| c.radius).sum::<f32>() / clusters.len() as f32;
        // 127 patches of a sphere have an area of 4 pi / 127 each: discs of radius 0.18.
        assert!(mean < 0.27, "mean radius {mean}");
        assert!(clusters.iter().all(|c| c.cone_cos > 0.8), "narrow cones");
        assert!(clusters.iter().all(|c| c.min_altitude > 1e-4));
    }

    #[test]
    fn triangles_without_area_do_not_widen_the_cone() {
        let mut positions = Vec3s::default();
        for p in [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0]] {
            positions.push(p);
        }
        let (_, clusters) = check(&positions, &[[0, 1, 2], [0, 0, 1], [2, 2, 2]]);
        assert!(clusters[0].cone_cos > 0.9999);
        assert!(clusters[0].min_altitude > 0.7);
        // Three different corners on a line have no altitude at all.
        let (_, clusters) = check(&positions, &[[0, 1, 2], [0, 1, 3]]);
        assert!(clusters[0].cone_cos > 0.9999);
        assert_eq!(clusters[0].min_altitude, 0.0);
        let (_, clusters) = check(&positions, &[[0, 0, 1]]);
        assert_eq!(clusters[0].cone_cos, -1.0);
    }

    #[test]
    fn odd_numbers_give_unbounded_clusters() {
        for odd in [f32::NAN, f32::INFINITY] {
            let mut positions = Vec3s::default();
            for p in [[0.0; 3], [odd, 0.0, 0.0], [0.0, odd, -odd]] {
                positions.push(p);
            }
            let clusters = build_clusters(&positions, &mut [[0, 1, 2]], 0);
            assert!(clusters[0].radius == f32::INFINITY, "{clusters:?}");
            assert!(!clusters[0].min_altitude.is_nan());
        }
        assert!(build_clusters(&Vec3s::default(), &mut [], 0).is_empty());
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, cases: 64, ..ProptestConfig::default() })]

        /// Needles, specks and triangles without area among others, at every scale.
        #[test]
        fn random_soups_are_bounded(
            points in prop::collection::vec(prop::array::uniform3(-1.0_f32..1.0), 3..40),
            squeeze in prop::array::uniform3(prop::sample::select(vec![1.0_f32, 1e-3, 1e-7, 0.0])),
            offset in prop::sample::select(vec![0.0_f32, 1.0, 1e4]),
            corners in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 1..400),
        ) {
            let mut positions = Vec3s::default();
            for p in &points {
                positions.push(std::array::from_fn(|k| p[k] * squeeze[k] + offset));
            }
            let triangles: Vec<[u32; 3]> = corners
                .iter()
                .map(|t| t.map(|i| i.index(points.len()) as u32))
                .collect();
            let once = check(&positions, &triangles);
            prop_assert_eq!(once, check(&positions, &triangles));
        }
    }
}
