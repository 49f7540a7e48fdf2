//! Depth and barycentric planes of several triangles at a time.
//!
//! What [`TrianglePlanes`](crate::geometry::screen::TrianglePlanes) says, operation by operation, over arrays of fixed length, which
//! the compiler turns into vectors of the dispatched level. Each operation is rounded by itself, so the bits are the same at all
//! levels, and those of the scalar rule: the tests compare them.

use crate::geometry::screen::DepthPlane;
use crate::math::PixelPoint;

/// Triangles worked on together: a vector of `f64` at the widest level.
pub(super) const TRIANGLES: usize = 8;

/// A number of each triangle.
type Each<T> = [T; TRIANGLES];

/// Corners of [`TRIANGLES`] triangles, none of which has to be clipped.
#[derive(Clone, Debug)]
pub(super) struct Corners {
    /// By corner, then by component of [`PixelPoint`].
    points: [[Each<f64>; 4]; 3],
    /// The pixel that planes are anchored at.
    anchor: [Each<f64>; 2],
}

/// The planes of [`TRIANGLES`] triangles.
#[derive(Clone, Debug)]
pub(super) struct Planes {
    base: Each<f32>,
    dx: Each<f32>,
    dy: Each<f32>,
    min: Each<f32>,
    max: Each<f32>,
    /// By corner.
    a: [Each<f32>; 3],
    b: [Each<f32>; 3],
    c: [Each<f32>; 3],
}

impl Corners {
    pub(super) const NONE: Self = Self {
        points: [[[0.0; TRIANGLES]; 4]; 3],
        anchor: [[0.0; TRIANGLES]; 2],
    };

    /// Sets one triangle. The anchor is the top left pixel of its box.
    #[inline(always)]
    pub(super) fn set(&mut self, index: usize, corners: [PixelPoint; 3], anchor: [i32; 2]) {
        for (to, from) in self.points.iter_mut().zip(corners) {
            for (to, from) in to.iter_mut().zip(from) {
                to[index] = from;
            }
        }
        for (to, from) in self.anchor.iter_mut().zip(anchor) {
            to[index] = f64::from(from);
        }
    }

    /// The planes of all triangles; meaningless for those that have not been set.
    #[inline(always)]
    pub(super) fn planes(&self) -> Planes {
        let [v0, v1, v2] = &self.points;
        let edges = [cross(v1, v2), cross(v2, v0), cross(v0, v1)];
        let mut determinant = [0.0; TRIANGLES];
        for i in 0..TRIANGLES {
            determinant[i] =
                v0[X][i] * edges[0][0][i] + v0[Y][i] * edges[0][1][i] + v0[W][i] * edges[0][2][i];
        }
        let mut center = [[0.0; TRIANGLES]; 2];
        for i in 0..TRIANGLES {
            center[0][i] = self.anchor[0][i] + 0.5;
            center[1][i] = self.anchor[1][i] + 0.5;
        }
        let [min, max] = self.depth_range();
        let [base, dx, dy] = self.depth(&edges, &determinant, &center, &max);
        let [a, b, c] = interpolators(&edges, &determinant, &center);
        Planes {
            base,
            dx,
            dy,
            min: narrow(&min),
            max: narrow(&max),
            a,
            b,
            c,
        }
    }

    /// Least and largest depth of the corners. They are in front of the eye and between the near and far planes.
    #[inline(always)]
    fn depth_range(&self) -> [Each<f64>; 2] {
        let (mut min, mut max) = ([f64::INFINITY; TRIANGLES], [f64::NEG_INFINITY; TRIANGLES]);
        for corner in &self.points {
            for i in 0..TRIANGLES {
                let depth = (corner[Z][i] / corner[W][i]).clamp(0.0, 1.0);
                min[i] = if depth < min[i] { depth } else { min[i] };
                max[i] = if depth > max[i] { depth } else { max[i] };
            }
        }
        [min, max]
    }

    /// Depth at the anchor's centre, and its change per pixel to the right and down.
    #[inline(always)]
    fn depth(
        &self,
        edges: &[[Each<f64>; 3]; 3],
        determinant: &Each<f64>,
        center: &[Each<f64>; 2],
        max: &Each<f64>,
    ) -> [Each<f32>; 3] {
        let [v0, v1, v2] = &self.points;
        let mut plane = [[0.0; TRIANGLES]; 3];
        for (k, plane) in plane.iter_mut().enumerate() {
            for i in 0..TRIANGLES {
                let sum = v0[Z][i] * edges[0][k][i]
                    + v1[Z][i] * edges[1][k][i]
                    + v2[Z][i] * edges[2][k][i];
                plane[i] = sum / determinant[i];
            }
        }
        let [mut base, mut dx, mut dy] = [[0.0; TRIANGLES]; 3];
        for i in 0..TRIANGLES {
            let at_anchor = plane[0][i] * center[0][i] + plane[1][i] * center[1][i] + plane[2][i];
            let usable =
                (plane[0][i].abs() < 1e30) & (plane[1][i].abs() < 1e30) & (at_anchor.abs() < 1e30);
            dx[i] = if usable { plane[0][i] } else { 0.0 };
            dy[i] = if usable { plane[1][i] } else { 0.0 };
            base[i] = if usable { at_anchor } else { max[i] };
        }
        [narrow(&base), narrow(&dx), narrow(&dy)]
    }
}

/// Indices of components.
const X: usize = 0;
const Y: usize = 1;
const Z: usize = 2;
const W: usize = 3;

/// The cross product of corners' `(x w, y w, w)`.
#[inline(always)]
fn cross(a: &[Each<f64>; 4], b: &[Each<f64>; 4]) -> [Each<f64>; 3] {
    let mut out = [[0.0; TRIANGLES]; 3];
    for (out, [j, k]) in out.iter_mut().zip([[Y, W], [W, X], [X, Y]]) {
        for i in 0..TRIANGLES {
            out[i] = a[j][i] * b[k][i] - a[k][i] * b[j][i];
        }
    }
    out
}

/// The barycentric planes `a`, `b` and `c`, each by corner.
#[inline(always)]
fn interpolators(
    edges: &[[Each<f64>; 3]; 3],
    determinant: &Each<f64>,
    center: &[Each<f64>; 2],
) -> [[Each<f32>; 3]; 3] {
    let mut sign = [0.0; TRIANGLES];
    for i in 0..TRIANGLES {
        sign[i] = if determinant[i] < 0.0 { -1.0 } else { 1.0 };
    }
    let mut at_anchor = [[0.0; TRIANGLES]; 3];
    let mut largest = [0.0; TRIANGLES];
    for (c, edge) in at_anchor.iter_mut().zip(edges) {
        for i in 0..TRIANGLES {
            c[i] = (edge[0][i] * center[0][i] + edge[1][i] * center[1][i] + edge[2][i]) * sign[i];
            for value in [c[i], edge[0][i], edge[1][i]] {
                // NaN does not take the place of a number.
                largest[i] = if value.abs() > largest[i] {
                    value.abs()
                } else {
                    largest[i]
                };
            }
        }
    }
    let mut scale = [0.0; TRIANGLES];
    for i in 0..TRIANGLES {
        let usable = (largest[i] > 0.0) & (largest[i] < f64::INFINITY);
        scale[i] = if usable { 1.0 / largest[i] } else { 0.0 };
    }
    let mut out = [[[0.0; TRIANGLES]; 3]; 3];
    for corner in 0..3 {
        for i in 0..TRIANGLES {
            out[0][corner][i] = (edges[corner][0][i] * sign[i] * scale[i]) as f32;
            out[1][corner][i] = (edges[corner][1][i] * sign[i] * scale[i]) as f32;
            out[2][corner][i] = (at_anchor[corner][i] * scale[i]) as f32;
        }
    }
    out
}

#[inline(always)]
fn narrow(values: &Each<f64>) -> Each<f32> {
    let mut out = [0.0; TRIANGLES];
    for i in 0..TRIANGLES {
        out[i] = values[i] as f32;
    }
    out
}

impl Planes {
    /// The depth of a triangle.
    #[inline(always)]
    pub(super) fn depth(&self, index: usize, anchor: [i32; 2]) -> DepthPlane {
        DepthPlane {
            anchor,
            base: self.base[index],
            dx: self.dx[index],
            dy: self.dy[index],
            min: self.min[index],
            max: self.max[index],
        }
    }

    /// The barycentric planes of a triangle: the slopes to the right and down, and the value at the anchor, each by corner.
    #[inline(always)]
    pub(super) fn interpolator(&self, index: usize) -> [[f32; 3]; 3] {
        let by_corner =
            |planes: &[Each<f32>; 3]| [planes[0][index], planes[1][index], planes[2][index]];
        [by_corner(&self.a), by_corner(&self.b), by_corner(&self.c)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::screen::{TrianglePlanes, outcode};
    use crate::simd::{Simd, SimdLevel, dispatch};
    use proptest::prelude::*;

    #[inline(always)]
    fn planes_of<S: Simd>(_simd: S, corners: &Corners) -> Planes {
        corners.planes()
    }

    fn corner() -> impl Strategy<Value = PixelPoint> {
        let w = prop_oneof![0.1..10.0_f64, 1e-6..1e6_f64];
        (-2000.0..4000.0_f64, -2000.0..4000.0_f64, 0.0..=1.0_f64, w)
            .prop_map(|(x, y, z, w)| [x * w, y * w, z * w, w])
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn planes_have_the_bits_of_the_scalar_rule(
            triangles in prop::array::uniform8((prop::array::uniform3(corner()), -64..4096_i32, -64..4096_i32, 0..3_usize)),
        ) {
            let mut corners = Corners::NONE;
            let triangles = triangles.map(|([a, b, c], x, y, degenerate)| {
                // Some without an area.
                let corners = match degenerate {
                    0 => [a, a, c],
                    _ => [a, b, c],
                };
                (corners, [x, y])
            });
            for (i, (points, anchor)) in triangles.iter().enumerate() {
                prop_assert!(points.iter().all(|p| outcode(*p) == 0));
                corners.set(i, *points, *anchor);
            }
            for level in SimdLevel::available().filter_map(SimdLevel::token) {
                let planes = dispatch!(level, simd => planes_of(simd, &corners));
                for (i, &(points, anchor)) in triangles.iter().enumerate() {
                    let scalar = TrianglePlanes::new(points);
                    prop_assert_eq!(planes.depth(i, anchor), scalar.depth(anchor));
                    let want = scalar.interpolator(anchor);
                    prop_assert_eq!(planes.interpolator(i), [want.a, want.b, want.c]);
                }
            }
        }
    }
}
