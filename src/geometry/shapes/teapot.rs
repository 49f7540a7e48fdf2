//! The Utah teapot (Martin Newell, 1975) from its bicubic Bézier patches.
//!
//! The data set's 32 patches have two kinds of symmetry, so this module states the shape by what generates it:
//!
//! * rim, body, lid and bottom are profiles (a radius and a height per control point) revolved about the z axis,
//!   each as four quarter patches. A quarter circle of radius r has the control points (r, 0), (r, k r), (k r, r),
//!   (0, r), with the data set's own k = 0.56 (not 0.5523, the closest to a circle);
//! * handle and spout are tubes that mirror in y: each control row is half a ring, from its inner point in the plane
//!   y = 0 sideways to its outer point.
//!
//! Patches are `P(u, v)`, u across rows (along a profile or a tube) and v along a row. The normal is `P_u x P_v`.
//! Where a whole row is one point (the pole of the lid, and of the bottom), `P_v` vanishes; near it `P_v = (u - u0)
//! P_uv`, so that the limit of the normal from inside the patch is `± P_u x P_uv`. Triangles at a pole that have lost
//! their area are kept, so that n x n quads on each patch give `2 n n` triangles: 896 on the 28 patches without
//! bottom at n = 4, as in the paper.
//!
//! Patches meet at common borders with common tangent planes nearly everywhere; border vertices closer than
//! `WELD_DISTANCE` become one, with the mean of their normals, unless these are more than 60 degrees apart.

use crate::geometry::Mesh;
use glam::DVec3;
use std::collections::HashMap;

/// Control point distance of a quarter circle of radius 1, as the data set has it.
const CIRCLE: f64 = 0.56;

/// Border vertices within this distance are the same point; coordinates reach about 3.
const WELD_DISTANCE: f64 = 1e-5;

/// Normals that meet at a border are averaged when the cosine of their angle is larger than this.
const WELD_COSINE: f64 = 0.5;

/// (radius, height) of the control points of a revolved profile, outside on the left going down.
type Profile = [(f64, f64); 4];

/// Rim, upper body, lower body, knob, lid.
const PROFILES: [Profile; 5] = [
    [(1.4, 2.4), (1.3375, 2.53125), (1.4375, 2.53125), (1.5, 2.4)],
    [(1.5, 2.4), (1.75, 1.875), (2.0, 1.35), (2.0, 0.9)],
    [(2.0, 0.9), (2.0, 0.45), (1.5, 0.225), (1.5, 0.15)],
    [(0.0, 3.15), (0.8, 3.15), (0.0, 2.85), (0.2, 2.7)],
    [(0.2, 2.7), (0.4, 2.55), (1.3, 2.55), (1.3, 2.4)],
];

/// The bottom, which the data set of 1975 did not have.
const BOTTOM: Profile = [(1.5, 0.15), (1.5, 0.075), (1.425, 0.0), (0.0, 0.0)];

/// Half a ring of a tube's control net.
struct TubeRow {
    /// x and z of the innermost point, where y = 0.
    inner: (f64, f64),
    /// x and z of the outermost point, where y = 0.
    outer: (f64, f64),
    /// |y| of the two control points between them.
    half_width: f64,
}

const fn tube_row(inner: (f64, f64), outer: (f64, f64), half_width: f64) -> TubeRow {
    TubeRow {
        inner,
        outer,
        half_width,
    }
}

/// From the body outwards; two patches each side, which share the fourth row.
const HANDLE: [TubeRow; 7] = [
    tube_row((-1.6, 2.025), (-1.5, 2.25), 0.3),
    tube_row((-2.3, 2.025), (-2.5, 2.25), 0.3),
    tube_row((-2.7, 2.025), (-3.0, 2.25), 0.3),
    tube_row((-2.7, 1.8), (-3.0, 1.8), 0.3),
    tube_row((-2.7, 1.575), (-3.0, 1.35), 0.3),
    tube_row((-2.5, 1.125), (-2.65, 0.9375), 0.3),
    tube_row((-2.0, 0.9), (-1.9, 0.6), 0.3),
];

/// From the body to the tip.
const SPOUT: [TubeRow; 7] = [
    tube_row((1.7, 1.425), (1.7, 0.6), 0.66),
    tube_row((2.6, 1.425), (3.1, 0.825), 0.66),
    tube_row((2.3, 2.1), (2.4, 2.025), 0.25),
    tube_row((2.7, 2.4), (3.3, 2.4), 0.25),
    tube_row((2.8, 2.475), (3.525, 2.49375), 0.25),
    tube_row((2.9, 2.475), (3.45, 2.5125), 0.15),
    tube_row((2.8, 2.4), (3.2, 2.4), 0.15),
];

/// A bicubic Bézier patch.
struct Patch {
    /// Rows along v, one for each control point along u.
    control: [[DVec3; 4]; 4],
    /// Whether `P_u x P_v` points into the teapot.
    inward: bool,
}

/// Weights of the four control points of a cubic, and their derivatives.
struct Bernstein {
    value: [f64; 4],
    derivative: [f64; 4],
}

impl Bernstein {
    fn at(t: f64) -> Self {
        let s = 1.0 - t;
        Self {
            value: [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t],
            derivative: [
                -3.0 * s * s,
                3.0 * s * s - 6.0 * s * t,
                6.0 * s * t - 3.0 * t * t,
                3.0 * t * t,
            ],
        }
    }
}

impl Patch {
    /// Sum of the control points weighted by the products of `wu` and `wv`.
    fn combine(&self, wu: &[f64; 4], wv: &[f64; 4]) -> DVec3 {
        let row = |r: &[DVec3; 4]| r[0] * wv[0] + r[1] * wv[1] + r[2] * wv[2] + r[3] * wv[3];
        let c = &self.control;
        row(&c[0]) * wu[0] + row(&c[1]) * wu[1] + row(&c[2]) * wu[2] + row(&c[3]) * wu[3]
    }

    /// Position and outward unit normal at `(u, v)` in the unit square.
    fn at(&self, u: f64, v: f64) -> (DVec3, DVec3) {
        let (bu, bv) = (Bernstein::at(u), Bernstein::at(v));
        let along_u = self.combine(&bu.derivative, &bv.value);
        let along_v = self.combine(&bu.value, &bv.derivative);
        // P_v is of the order of the radius; it vanishes (up to rounding) in the rows that are one point only.
        let normal = if along_v.length() > 1e-9 {
            along_u.cross(along_v)
        } else {
            let twist = self.combine(&bu.derivative, &bv.derivative);
            let inwards = if u < 0.5 { 1.0 } else { -1.0 };
            along_u.cross(twist) * inwards
        };
        let outward = if self.inward { -normal } else { normal };
        let position = self.combine(&bu.value, &bv.value);
        // No patch has a point where the limit vanishes too; the fallback only rules out NaN.
        (position, outward.normalize_or(DVec3::Z))
    }
}

/// The four quarters of a surface of revolution.
fn revolved(profile: &Profile) -> impl Iterator<Item = Patch> {
    [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]
        .into_iter()
        .map(|(cos, sin)| Patch {
            control: profile.map(|(r, z)| {
                [(r, 0.0), (r, CIRCLE * r), (CIRCLE * r, r), (0.0, r)]
                    .map(|(x, y)| DVec3::new(cos * x - sin * y, sin * x + cos * y, z))
            }),
            // P_u = (dr, dz) goes down the profile, P_v around the axis: P_u x P_v = (-dz, dr) is on its left.
            inward: false,
        })
}

/// The four patches of a tube: two lengths with two sides each.
fn tube(rows: &[TubeRow; 7]) -> impl Iterator<Item = Patch> {
    [(0, -1.0), (0, 1.0), (3, -1.0), (3, 1.0)]
        .into_iter()
        .map(|(first, side)| Patch {
            control: std::array::from_fn(|i| {
                let row = &rows[first + i];
                let ((xi, zi), (xo, zo), y) = (row.inner, row.outer, side * row.half_width);
                [(xi, 0.0, zi), (xi, y, zi), (xo, y, zo), (xo, 0.0, zo)].map(DVec3::from)
            }),
            // Handle and spout alike, P_u x P_v points to +y: outwards on that side only.
            inward: side < 0.0,
        })
}

/// Finds border vertices again, so that neighbouring patches share them.
#[derive(Default)]
struct Welder {
    /// Vertices by grid cell of size [`WELD_DISTANCE`].
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Welder {
    fn cell(p: DVec3) -> [i64; 3] {
        p.to_array().map(|c| (c / WELD_DISTANCE).floor() as i64)
    }

    /// A vertex of `mesh` at `p` whose summed normal is close enough to `normal`.
    fn find(&self, mesh: &Mesh, p: DVec3, normal: DVec3) -> Option<u32> {
        let center = Self::cell(p);
        // The point itself may lie on either side of a cell's wall.
        (0..27)
            .map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1])
            .filter_map(|d| self.cells.get(&std::array::from_fn(|k| center[k] + d[k])))
            .flatten()
            .copied()
            .find(|&v| {
                let (q, sum) = (mesh.positions[v as usize], mesh.normals[v as usize]);
                p.distance(q) < WELD_DISTANCE && sum.dot(normal) > WELD_COSINE * sum.length()
            })
    }

    fn insert(&mut self, p: DVec3, vertex: u32) {
        self.cells.entry(Self::cell(p)).or_default().push(vertex);
    }
}

/// Appends a patch of `n` x `n` quads. Normals of shared vertices are summed, not normalized.
fn append(mesh: &mut Mesh, welder: &mut Welder, patch: &Patch, n: u32) {
    let mut ids = Vec::with_capacity((n as usize + 1).pow(2));
    for i in 0..=n {
        for j in 0..=n {
            let (p, normal) = patch.at(f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
            let border = i % n == 0 || j % n == 0;
            let shared = border.then(|| welder.find(mesh, p, normal)).flatten();
            ids.push(shared.unwrap_or(mesh.positions.len() as u32));
            if let Some(vertex) = shared {
                mesh.normals[vertex as usize] += normal;
                continue;
            }
            if border {
                welder.insert(p, mesh.positions.len() as u32);
            }
            mesh.positions.push(p);
            mesh.normals.push(normal);
        }
    }
    let id = |i: u32, j: u32| ids[(i * (n + 1) + j) as usize];
    for i in 0..n {
        for j in 0..n {
            let (a, b, c, d) = (id(i, j), id(i, j + 1), id(i + 1, j + 1), id(i + 1, j));
            // Always the same diagonal: from (0, 0) to (1, 1).
            mesh.triangles.extend(if patch.inward {
                [[a, c, d], [a, b, c]]
            } else {
                [[a, d, c], [a, c, b]]
            });
        }
    }
}

/// Newell's teapot, z up, standing on the plane z = 0 (its bottom edge at 0.15), 3.15 high, the spout towards +x.
///
/// Each of its 28 patches (32 with `bottom`) is `tessellation` x `tessellation` quads of two triangles, at least one
/// quad; triangles at the poles that have no area are among them.
#[must_use]
pub fn teapot(tessellation: u32, bottom: bool) -> Mesh {
    let n = tessellation.max(1);
    let mut mesh = Mesh::default();
    let mut welder = Welder::default();
    let patches = PROFILES
        .iter()
        .flat_map(revolved)
        .chain([&HANDLE, &SPOUT].into_iter().flat_map(tube))
        .chain(bottom.then_some(&BOTTOM).into_iter().flat_map(revolved));
    for patch in patches {
        append(&mut mesh, &mut welder, &patch, n);
    }
    for normal in &mut mesh.normals {
        // Summands are within 60 degrees of the running sum, so it never vanishes.
        *normal = normal.normalize();
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes::checks::assert_sound;

    fn all_patches() -> Vec<Patch> {
        let mut patches: Vec<_> = PROFILES.iter().flat_map(revolved).collect();
        patches.extend(tube(&HANDLE).chain(tube(&SPOUT)).chain(revolved(&BOTTOM)));
        patches
    }

    #[test]
    fn counts_are_those_of_the_paper() {
        for (n, bottom, triangles, flat) in [
            (4, false, 896, 16),
            (4, true, 1024, 32),
            (32, false, 57_344, 128),
        ] {
            let mesh = teapot(n, bottom);
            assert_eq!(mesh.triangles.len(), triangles, "n = {n}");
            assert_eq!(assert_sound(&mesh), flat, "n = {n}");
        }
        assert_eq!(teapot(0, true), teapot(1, true));
        assert_eq!(teapot(1, true).triangles.len(), 64);
    }

    #[test]
    fn normals_agree_with_finite_differences() {
        let h = 1e-5;
        for (k, patch) in all_patches().iter().enumerate() {
            for i in 0..=16 {
                for j in 0..=16 {
                    // Poles are approached, not sampled: differences say nothing in them.
                    let u = 0.01 + 0.98 * f64::from(i) / 16.0;
                    let v = 0.01 + 0.98 * f64::from(j) / 16.0;
                    let at = |u: f64, v: f64| patch.at(u, v).0;
                    let du = at(u + h, v) - at(u - h, v);
                    let dv = at(u, v + h) - at(u, v - h);
                    let sign = if patch.inward { -1.0 } else { 1.0 };
                    let expected = du.cross(dv).normalize() * sign;
                    let error = patch.at(u, v).1.distance(expected);
                    assert!(error < 1e-6, "patch {k} at ({u}, {v}): {error}");
                }
            }
        }
    }

    #[test]
    fn poles_have_the_limit_normal() {
        for patch in revolved(&PROFILES[3]).chain(revolved(&BOTTOM)) {
            let (u, near) = if patch.at(0.0, 0.5).0.z > 3.0 {
                (0.0, 1e-7)
            } else {
                (1.0, 1.0 - 1e-7)
            };
            for v in [0.0, 0.3, 1.0] {
                assert!(patch.at(u, v).1.distance(patch.at(near, v).1) < 1e-5);
                assert!(patch.at(u, v).1.z.abs() > 1.0 - 1e-12);
            }
        }
    }

    #[test]
    fn seams_are_welded() {
        // Interiors, the borders they share, and where tubes end: counted by hand for the body's 20 patches (5 rings
        // of 4 n columns; profiles meet in 3 rings: rim and body, both halves of the body, knob and lid).
        let n = 4;
        let mesh = teapot(n, false);
        let rings = (n + 1) + n + n; // rim and body
        let lid = n + n; // knob and lid without the pole
        let tubes = 2 * (2 * n + 1) * (2 * n); // handle and spout
        assert_eq!(
            mesh.positions.len() as u32,
            (rings + lid) * 4 * n + 1 + tubes
        );
    }

    #[test]
    fn nothing_but_the_named_openings_is_open() {
        // Edges with one triangle only lie on the rim's inner circle, the lid's edge, the bottom circle, the tubes'
        // ends. Counted: 3 circles of 4 n edges, 4 tube ends of 2 n.
        let n = 8;
        let mesh = teapot(n, false);
        let mut sides: HashMap<[u32; 2], u32> = HashMap::new();
        for t in &mesh.triangles {
            if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
                continue; // at the pole
            }
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                *sides.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        let open = sides.values().filter(|&&count| count == 1).count() as u32;
        assert_eq!(open, 3 * 4 * n + 4 * 2 * n);
        assert!(sides.values().all(|&count| count <= 2));
    }
}
