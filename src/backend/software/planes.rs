//! Depth and barycentric planes of several triangles at a time.
//!
//! What [`TrianglePlanes`](crate::geometry::screen::TrianglePlanes) says, operation by operation, in lanes of `f64`. Each operation
//! is rounded by itself, so the bits are the same at all levels, and those of the scalar rule: the tests compare them.

#![expect(
    clippy::needless_range_loop,
    reason = "loops run over several arrays of lanes at once"
)]

use crate::geometry::screen::DepthPlane;
use crate::math::PixelPoint;
use crate::simd::Simd;
use fearless_simd::prelude::*;

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
#[derive(Clone, Debug, Default)]
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
    pub(super) fn planes<S: Simd>(&self, simd: S) -> Planes {
        let mut planes = Planes::default();
        for first in (0..TRIANGLES).step_by(S::f64s::LEN) {
            let lanes = CornerLanes::<S>::load(simd, self, first);
            lanes.depth(simd, &mut planes, first);
            lanes.interpolators(simd, &mut planes, first);
        }
        planes
    }
}

/// As many triangles as a vector holds.
struct CornerLanes<S: Simd> {
    /// By corner, then by component of [`PixelPoint`].
    points: [[S::f64s; 4]; 3],
    /// The centre of the anchor.
    center: [S::f64s; 2],
    /// `v_j x v_k` for the edge opposite to each corner.
    edges: [[S::f64s; 3]; 3],
    /// `v_0 . (v_1 x v_2)`.
    determinant: S::f64s,
}

impl<S: Simd> CornerLanes<S> {
    #[inline(always)]
    fn load(simd: S, corners: &Corners, first: usize) -> Self {
        let load = |each: &Each<f64>| S::f64s::from_slice(simd, &each[first..first + S::f64s::LEN]);
        let [a, b, c] = &corners.points;
        let points = [
            [load(&a[0]), load(&a[1]), load(&a[2]), load(&a[3])],
            [load(&b[0]), load(&b[1]), load(&b[2]), load(&b[3])],
            [load(&c[0]), load(&c[1]), load(&c[2]), load(&c[3])],
        ];
        let [v0, v1, v2] = &points;
        let edges = [cross::<S>(v1, v2), cross::<S>(v2, v0), cross::<S>(v0, v1)];
        let determinant = v0[X] * edges[0][0] + v0[Y] * edges[0][1] + v0[W] * edges[0][2];
        Self {
            points,
            center: [
                load(&corners.anchor[0]) + 0.5,
                load(&corners.anchor[1]) + 0.5,
            ],
            edges,
            determinant,
        }
    }

    /// Least and largest depth of the corners. They are in front of the eye and between the near and far planes.
    #[inline(always)]
    fn depth_range(&self, simd: S) -> [S::f64s; 2] {
        let [v0, v1, v2] = &self.points;
        let (zero, one) = (S::f64s::splat(simd, 0.0), S::f64s::splat(simd, 1.0));
        let [a, b, c] = [v0[Z] / v0[W], v1[Z] / v1[W], v2[Z] / v2[W]];
        // Clamping keeps order, so it may come last.
        [
            a.min(b).min(c).max(zero).min(one),
            a.max(b).max(c).max(zero).min(one),
        ]
    }

    /// Depth at the anchor's centre, its change per pixel to the right and down, and its range.
    #[inline(always)]
    fn depth(&self, simd: S, planes: &mut Planes, first: usize) {
        let [v0, v1, v2] = &self.points;
        let mut plane = [v0[Z]; 3];
        for (k, plane) in plane.iter_mut().enumerate() {
            let [e0, e1, e2] = [self.edges[0][k], self.edges[1][k], self.edges[2][k]];
            *plane = (v0[Z] * e0 + v1[Z] * e1 + v2[Z] * e2) / self.determinant;
        }
        let [dx, dy, constant] = plane;
        let base = dx * self.center[0] + dy * self.center[1] + constant;
        let limit = S::f64s::splat(simd, 1e30);
        // False for what is not a number.
        let usable = dx.abs().simd_lt(limit) & dy.abs().simd_lt(limit) & base.abs().simd_lt(limit);
        let zero = S::f64s::splat(simd, 0.0);
        let [min, max] = self.depth_range(simd);
        narrow::<S>(usable.select(base, max), &mut planes.base, first);
        narrow::<S>(usable.select(dx, zero), &mut planes.dx, first);
        narrow::<S>(usable.select(dy, zero), &mut planes.dy, first);
        narrow::<S>(min, &mut planes.min, first);
        narrow::<S>(max, &mut planes.max, first);
    }

    /// The barycentric planes.
    #[inline(always)]
    fn interpolators(&self, simd: S, planes: &mut Planes, first: usize) {
        let (zero, one) = (S::f64s::splat(simd, 0.0), S::f64s::splat(simd, 1.0));
        let sign = self.determinant.simd_lt(zero).select(-one, one);
        let mut c = [zero; 3];
        for (c, edge) in c.iter_mut().zip(&self.edges) {
            *c = (edge[0] * self.center[0] + edge[1] * self.center[1] + edge[2]) * sign;
        }
        let mut largest = zero;
        for (c, edge) in c.iter().zip(&self.edges) {
            for value in [*c, edge[0], edge[1]] {
                let value = value.abs();
                // NaN does not take the place of a number.
                largest = value.simd_gt(largest).select(value, largest);
            }
        }
        let infinity = S::f64s::splat(simd, f64::INFINITY);
        let usable = largest.simd_gt(zero) & largest.simd_lt(infinity);
        let scale = usable.select(one / largest, zero);
        for corner in 0..3 {
            let edge = &self.edges[corner];
            narrow::<S>(edge[0] * sign * scale, &mut planes.a[corner], first);
            narrow::<S>(edge[1] * sign * scale, &mut planes.b[corner], first);
            narrow::<S>(c[corner] * scale, &mut planes.c[corner], first);
        }
    }
}

/// Indices of components.
const X: usize = 0;
const Y: usize = 1;
const Z: usize = 2;
const W: usize = 3;

/// The cross product of corners' `(x w, y w, w)`.
#[inline(always)]
fn cross<S: Simd>(a: &[S::f64s; 4], b: &[S::f64s; 4]) -> [S::f64s; 3] {
    [
        a[Y] * b[W] - a[W] * b[Y],
        a[W] * b[X] - a[X] * b[W],
        a[X] * b[Y] - a[Y] * b[X],
    ]
}

/// Rounds to `f32`, into the places from `first` on.
#[inline(always)]
fn narrow<S: Simd>(values: S::f64s, to: &mut Each<f32>, first: usize) {
    for (to, value) in to[first..].iter_mut().zip(values.as_slice()) {
        *to = *value as f32;
    }
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
    use crate::simd::{SimdLevel, dispatch};
    use proptest::prelude::*;

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
                let planes = dispatch!(level, simd => corners.planes(simd));
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
