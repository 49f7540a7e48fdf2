//! Polygons in space, and how one becomes triangles.
//!
//! A polygon's *area vector* is Newell's: half the sum of the cross products of neighbouring corners. It is the normal of a
//! flat polygon times its area, concave or not, and the best compromise for one that is not flat (Sutherland,
//! Evans et al.; Tampieri, *Newell's Method for Computing the Plane Equation of a Polygon*, Graphics Gems III).
//!
//! To be cut, a polygon is projected along the axis in which its area vector is longest, which keeps coordinates as
//! they are, so that corners exactly on a line stay there. A quadrilateral takes the diagonal that lies inside it, the shorter
//! one if both do; what has more corners is cut by the `earcut` library. That leaves out corners on the line between their
//! neighbours. In a mesh those are corners of other polygons too, and without them there would be T-junctions, hence
//! cracks; so they are put back. A polygon of n corners always gives n - 2 triangles: one that
//! crosses itself so badly that `earcut` gives up becomes a fan.

use earcut::Earcut;
use glam::DVec3;
use rustc_hash::FxHashMap;

/// Most corners of a polygon in a mesh file. Cutting takes time that grows, at worst, with the square of their number.
pub const MAX_CORNERS: usize = 10_000;

/// Polygons that share positions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Polygons {
    /// Positions that corners refer to.
    pub positions: Vec<DVec3>,
    /// The position index of each corner, polygon after polygon, counter-clockwise seen from outside.
    pub corners: Vec<u32>,
    /// Where in `corners` each polygon ends, ascending.
    pub ends: Vec<u32>,
    /// The normal given for each corner, of any length; zero or not finite where none is. Empty when there are none at all.
    pub normals: Vec<DVec3>,
}

impl Polygons {
    /// Where in `corners` each polygon's are.
    pub fn ranges(&self) -> impl Iterator<Item = std::ops::Range<usize>> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts
            .zip(&self.ends)
            .map(|(start, &end)| start as usize..end as usize)
    }

    /// Makes corners at equal positions refer to the same one. Coordinates are compared as numbers, exactly: files
    /// that repeat a position repeat its digits, and no thin feature is ever closed. Linear in time.
    pub fn weld(&mut self) {
        // Adding +0 turns -0 into +0 and leaves every other number as it is.
        let key = |p: DVec3| p.to_array().map(|c| (c + 0.0).to_bits());
        let mut first_at = FxHashMap::default();
        first_at.reserve(self.positions.len());
        let mut welded = Vec::with_capacity(self.positions.len());
        let new_index: Vec<u32> = self
            .positions
            .iter()
            .map(|&p| {
                *first_at.entry(key(p)).or_insert_with(|| {
                    welded.push(p);
                    welded.len() as u32 - 1
                })
            })
            .collect();
        self.positions = welded;
        for corner in &mut self.corners {
            *corner = new_index[*corner as usize];
        }
    }
}

/// Twice the area vector of a polygon; zero when it has less than three corners.
#[must_use]
pub fn doubled_area(points: &[DVec3]) -> DVec3 {
    let Some(&origin) = points.first() else {
        return DVec3::ZERO;
    };
    let mut sum = DVec3::ZERO;
    for pair in points[1..].windows(2) {
        sum += (pair[0] - origin).cross(pair[1] - origin);
    }
    sum
}

/// Cuts polygons into triangles, and keeps its memory between them.
#[derive(Default)]
pub struct Triangulator {
    earcut: Earcut<f64>,
    /// The polygon in its plane.
    flat: Vec<[f64; 2]>,
    /// Corner indices of the triangles that `earcut` found, three by three.
    cut: Vec<u32>,
    /// For each corner the next one that `earcut` used.
    next_used: Vec<u32>,
    /// Triangles that corners may have to be put back into.
    open: Vec<[u32; 3]>,
}

impl std::fmt::Debug for Triangulator {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Triangulator").finish_non_exhaustive()
    }
}

impl Triangulator {
    /// A triangulator without memory yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends the `points.len() - 2` triangles of a polygon to `triangles`, as indices into `points`, turning the way that
    /// the polygon does.
    pub fn triangulate(&mut self, points: &[DVec3], triangles: &mut Vec<[u32; 3]>) {
        match points.len() {
            0..3 => {}
            3 => triangles.push([0, 1, 2]),
            4 => triangles.extend(quadrilateral([points[0], points[1], points[2], points[3]])),
            _ => self.polygon(points, triangles),
        }
    }

    fn polygon(&mut self, points: &[DVec3], triangles: &mut Vec<[u32; 3]>) {
        self.project(points);
        self.earcut.earcut_slice(&self.flat, &[], &mut self.cut);
        let first = triangles.len();
        self.put_back(points.len(), triangles);
        if triangles.len() - first != points.len() - 2 {
            triangles.truncate(first);
            triangles.extend((2..points.len() as u32).map(|k| [0, k - 1, k]));
        }
    }

    /// Drops the coordinate in which the polygon's area vector is longest; what is left turns counter-clockwise. It is moved to
    /// the first corner and scaled to about 1, so that products do not vanish.
    fn project(&mut self, points: &[DVec3]) {
        let origin = points[0];
        let size = points.iter().fold(0.0, |size: f64, &p| {
            size.max((p - origin).abs().max_element())
        });
        let scale = crate::math::power_of_two_scale(size);
        let local = |p: DVec3| (p - origin) * scale;
        let area = doubled_area(points);
        let axis = area.abs().max_position();
        let (u, v) = if area[axis] < 0.0 {
            ((axis + 2) % 3, (axis + 1) % 3)
        } else {
            ((axis + 1) % 3, (axis + 2) % 3)
        };
        self.flat.clear();
        self.flat
            .extend(points.iter().map(|&p| [local(p)[u], local(p)[v]]));
    }

    /// Appends the triangles found for a polygon of `count` corners, with the corners that were left out put back.
    ///
    /// Corners in ascending order turn the way that the polygon does. An edge from one corner to the next one used that
    /// passes over others is on the border; the first that it passes over splits its triangle in two.
    fn put_back(&mut self, count: usize, triangles: &mut Vec<[u32; 3]>) {
        let count = count as u32;
        self.next_used.clear();
        self.next_used.resize(count as usize, count);
        for &corner in &self.cut {
            let before = (corner + count - 1) % count;
            self.next_used[before as usize] = corner;
        }
        // Twice around, backwards: the second time the last corners know what comes after the first.
        for at in (0..2 * count).rev().map(|i| (i % count) as usize) {
            if self.next_used[at] == count {
                self.next_used[at] = self.next_used[(at + 1) % count as usize];
            }
        }
        self.open.clear();
        self.open.extend(self.cut.chunks_exact(3).map(|t| {
            let mut sorted = [t[0], t[1], t[2]];
            sorted.sort_unstable();
            sorted
        }));
        while let Some(triangle) = self.open.pop() {
            let passes_over = |k: usize| {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                b != (a + 1) % count && self.next_used[a as usize] == b
            };
            if let Some(k) = (0..3).find(|&k| passes_over(k)) {
                let [a, b, c] = [triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]];
                let left_out = (a + 1) % count;
                self.open.push([left_out, b, c]);
                self.open.push([a, left_out, c]);
            } else {
                triangles.push(triangle);
            }
        }
    }
}

/// The two triangles of a quadrilateral.
fn quadrilateral(p: [DVec3; 4]) -> [[u32; 3]; 2] {
    let area = doubled_area(&p);
    let inside = |[a, b, c]: [usize; 3]| (p[b] - p[a]).cross(p[c] - p[a]).dot(area) > 0.0;
    let first = inside([0, 1, 2]) && inside([0, 2, 3]);
    let second = inside([0, 1, 3]) && inside([1, 2, 3]);
    let second_is_shorter = (p[3] - p[1]).length_squared() < (p[2] - p[0]).length_squared();
    if second && (!first || second_is_shorter) {
        [[0, 1, 3], [1, 2, 3]]
    } else {
        [[0, 1, 2], [0, 2, 3]]
    }
}
