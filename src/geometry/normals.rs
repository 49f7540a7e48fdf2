//! Vertex normals averaged from the faces that meet there.
//!
//! The faces around a position are divided into *fans*: two that share an edge are in one fan when their normals differ by
//! at most the crease angle. A corner's normal is the sum of its fan's face normals, each weighted by one of
//! * 1 (Gouraud 1971),
//! * the face's area,
//! * its angle at the corner (Thürmer and Wüthrich, *Computing Vertex Normals from Polygonal Facets*, Journal of Graphics Tools
//!   3(1), 1998), the only one that does not depend on how a surface is cut into faces, hence the default.
//!
//! So a vertex on a crease is split, one in the middle of a smooth surface is not, and surfaces that merely touch at a
//! point do not influence each other. Faces are whole polygons: how they are triangulated later does not matter.
//!
//! Invariants: every normal is a unit vector. A face without area contributes nothing and connects nothing. Time is
//! O(n log n) in the number of corners; at edges with more than eight faces there is always a crease.

use super::polygon::Polygons;
use crate::math::{Bounds, power_of_two_scale, unit};
use glam::DVec3;

/// How much a face counts for the normal at its corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weight {
    /// All alike.
    Equal,
    /// By its area.
    Area,
    /// By its angle at the corner.
    #[default]
    Angle,
}

/// Faces that meet at more than this many degrees do not share normals, unless said otherwise: noise in a scanned surface and
/// the bends of a coarse model stay smooth, the edges of machine parts stay sharp.
pub const CREASE_DEGREES: f64 = 60.0;

/// Where more faces than this share an edge, none is smooth across it.
const MOST_AT_AN_EDGE: usize = 8;

/// Faces that meet at the crease angle itself count as smooth in spite of rounding: the cosine may be this much less.
const ROUNDING: f64 = 1e-9;

/// A face whose area is below this share of the square of its size has no direction worth using.
const FLATTEST: f64 = 1e-12;

/// Which corners are at each position.
#[derive(Clone, Debug, Default)]
pub struct Incidence {
    /// Where in `corners` each position's begin; one more at the end.
    starts: Vec<u32>,
    /// Corner indices, ascending for each position.
    corners: Vec<u32>,
}

impl Incidence {
    /// Sorts the corners of `polygons` by position, in linear time.
    #[must_use]
    pub fn new(polygons: &Polygons) -> Self {
        let mut starts = vec![0; polygons.positions.len() + 1];
        for &position in &polygons.corners {
            starts[position as usize + 1] += 1;
        }
        for position in 1..starts.len() {
            starts[position] += starts[position - 1];
        }
        let mut free = starts.clone();
        let mut corners = vec![0; polygons.corners.len()];
        for (corner, &position) in (0_u32..).zip(&polygons.corners) {
            let place = &mut free[position as usize];
            corners[*place as usize] = corner;
            *place += 1;
        }
        Self { starts, corners }
    }

    /// The corners at each position, in the order of positions.
    pub fn groups(&self) -> impl Iterator<Item = &[u32]> {
        self.starts
            .windows(2)
            .map(|ends| &self.corners[ends[0] as usize..ends[1] as usize])
    }
}

/// What a corner contributes to the normals at its position.
#[derive(Clone, Copy, Debug, Default)]
struct Corner {
    /// Unit normal of the face; zero when that has none.
    normal: DVec3,
    weight: f64,
    /// The positions before and after it around the face.
    neighbours: [u32; 2],
}

/// The normal of every corner's face: all faces flat. A face without area gets a normal all the same.
#[must_use]
pub fn flat(polygons: &Polygons) -> Vec<DVec3> {
    corners(polygons, Weight::Equal)
        .iter()
        .map(|corner| some_normal(corner.normal))
        .collect()
}

/// The averaged normal of every corner. Positions have to be [welded](Polygons::weld), or nothing is shared.
///
/// `crease_degrees` is in 0..=180; 180 smooths everything.
#[must_use]
pub fn smooth(
    polygons: &Polygons,
    incidence: &Incidence,
    weight: Weight,
    crease_degrees: f64,
) -> Vec<DVec3> {
    let corners = corners(polygons, weight);
    let least_cosine = libm::cos(crease_degrees.to_radians()) - ROUNDING;
    let mut normals = vec![DVec3::Z; corners.len()];
    let mut fans = Fans::default();
    for group in incidence.groups() {
        fans.divide(&corners, group, least_cosine);
        fans.sum(&corners, group);
        let any = fans.sums.iter().find_map(|&sum| unit(sum));
        for (local, &corner) in group.iter().enumerate() {
            let sum = fans.sums[fans.parent[local] as usize];
            let own = corners[corner as usize].normal;
            normals[corner as usize] = unit(sum)
                .or(unit(own))
                .or(any)
                .unwrap_or(some_normal(DVec3::ZERO));
        }
    }
    normals
}

/// A normal for what has none.
fn some_normal(normal: DVec3) -> DVec3 {
    unit(normal).unwrap_or(DVec3::Z)
}

/// What each corner contributes.
fn corners(polygons: &Polygons, weight: Weight) -> Vec<Corner> {
    let mut bounds = Bounds::EMPTY;
    for &p in &polygons.positions {
        bounds.grow(p);
    }
    // Scaled to about 1 and moved to the origin, products neither overflow nor lose digits.
    let origin = bounds.center();
    let scale = power_of_two_scale((bounds.max * 0.5 - bounds.min * 0.5).length());
    let place = |position: u32| (polygons.positions[position as usize] - origin) * scale;

    let mut corners = vec![Corner::default(); polygons.corners.len()];
    let mut ring = Vec::new();
    let mut points = Vec::new();
    for range in polygons.ranges() {
        // Corners at the same position as the one before add nothing to the shape.
        ring.clear();
        ring.extend(polygons.corners[range.clone()].iter().copied());
        ring.dedup();
        if ring.len() > 1 && ring[0] == ring[ring.len() - 1] {
            ring.pop();
        }
        points.clear();
        points.extend(ring.iter().map(|&position| place(position)));
        let (normal, area) = direction(&points);
        let weight_at = |before: usize, k: usize, after: usize| match weight {
            Weight::Equal => 1.0,
            Weight::Area => area,
            Weight::Angle => angle([points[before], points[k], points[after]], normal),
        };
        let (mut k, mut is_first) = (0, true);
        for corner in range {
            if polygons.corners[corner] != ring[k] {
                k = (k + 1) % ring.len();
                is_first = k > 0;
            }
            let before = (k + ring.len() - 1) % ring.len();
            let after = (k + 1) % ring.len();
            corners[corner] = Corner {
                normal,
                // A repeated corner is of the same fan, which counts the face once.
                weight: if is_first {
                    weight_at(before, k, after)
                } else {
                    0.0
                },
                neighbours: [ring[before], ring[after]],
            };
            is_first = false;
        }
    }
    corners
}

/// Unit normal and doubled area of a polygon, both zero when it has none to speak of.
fn direction(points: &[DVec3]) -> (DVec3, f64) {
    let doubled_area = super::polygon::doubled_area(points);
    let size = points.iter().fold(0.0, |size: f64, &p| {
        size.max((p - points[0]).length_squared())
    });
    match unit(doubled_area) {
        Some(normal) if doubled_area.length() > FLATTEST * size => (normal, doubled_area.length()),
        _ => (DVec3::ZERO, 0.0),
    }
}

/// The angle inside a polygon with that normal at the middle one of three corners, in 0..=2 pi; beyond pi where it is concave.
fn angle([before, at, after]: [DVec3; 3], normal: DVec3) -> f64 {
    let (to_after, to_before) = (after - at, before - at);
    let sine = normal.dot(to_after.cross(to_before));
    let angle = libm::atan2(sine, to_after.dot(to_before));
    if angle < 0.0 {
        angle + std::f64::consts::TAU
    } else {
        angle
    }
}

/// The fans at one position, and the memory to find them.
#[derive(Debug, Default)]
struct Fans {
    /// Position at the other end of an edge, and the corner of the group whose face has that edge.
    edges: Vec<(u32, u32)>,
    /// For each corner of the group one of the same fan: at last the fan's first.
    parent: Vec<u32>,
    /// At each fan's first corner the weighted sum of its normals.
    sums: Vec<DVec3>,
}

impl Fans {
    /// Finds the first corner of each corner's fan.
    fn divide(&mut self, corners: &[Corner], group: &[u32], least_cosine: f64) {
        self.parent.clear();
        self.parent.extend(0..group.len() as u32);
        self.edges.clear();
        for (local, &corner) in (0_u32..).zip(group) {
            let Corner {
                normal, neighbours, ..
            } = corners[corner as usize];
            if normal != DVec3::ZERO {
                self.edges.extend(neighbours.map(|other| (other, local)));
            }
        }
        self.edges.sort_unstable();
        let parent = &mut self.parent;
        for edge in self.edges.chunk_by(|a, b| a.0 == b.0) {
            if edge.len() > MOST_AT_AN_EDGE {
                continue;
            }
            for (i, &(_, a)) in edge.iter().enumerate() {
                for &(_, b) in &edge[..i] {
                    let normal = |local: u32| corners[group[local as usize] as usize].normal;
                    if normal(a).dot(normal(b)) >= least_cosine {
                        let (a, b) = (root(parent, a), root(parent, b));
                        parent[a.max(b) as usize] = a.min(b);
                    }
                }
            }
        }
        for local in 0..group.len() as u32 {
            parent[local as usize] = root(parent, local);
        }
    }

    /// Adds up the normals of each fan.
    fn sum(&mut self, corners: &[Corner], group: &[u32]) {
        self.sums.clear();
        self.sums.resize(group.len(), DVec3::ZERO);
        for (&corner, &fan) in group.iter().zip(&self.parent) {
            let Corner { normal, weight, .. } = corners[corner as usize];
            self.sums[fan as usize] += normal * weight;
        }
    }
}

/// The first member of the set of `member`, as far as it is known; halves the way there for the next time.
pub(super) fn root(parent: &mut [u32], mut member: u32) -> u32 {
    while parent[member as usize] != member {
        let above = parent[parent[member as usize] as usize];
        parent[member as usize] = above;
        member = above;
    }
    member
}
