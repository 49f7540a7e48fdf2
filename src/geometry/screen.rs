//! The rules by which a triangle becomes pixels, in scalar arithmetic.
//!
//! They are the definition that every rasterizer here must reproduce bit for bit:
//!
//! 1. [`clip`] against the near and far planes and a guard band of ±[`GUARD_BAND_PX`] pixels, in `f64`. The
//!    point where an edge leaves is always computed from the inside end to the outside end, so that two
//!    triangles sharing the edge get the same bits.
//! 2. [`snap`] the vertices to 1/256 pixel, once. Everything after is integer arithmetic.
//! 3. A pixel is covered when its centre lies inside by [`EdgeFunction`], the top-left rule deciding on
//!    the edges: triangles that share an edge never both take a pixel, nor leave one out.
//! 4. [`DepthPlane`] gives the reversed depth (larger is nearer); the nearer triangle owns the pixel, and of
//!    two equally near ones that with the smaller id. A triangle that is the back of another is
//!    [moved back](DepthPlane::moved_back) a little first.
//! 5. [`Interpolator`] gives perspective-correct barycentrics of the *unsnapped*, unclipped triangle, clamped
//!    to it, by homogeneous edge planes (Olano and Greer, "Triangle scan conversion using 2D homogeneous
//!    coordinates", 1997): `e_i(X, Y) = (v_j x v_k) . (X, Y, 1)` with `v = (x w, y w, w)`, and the weight of
//!    corner i is `e_i / (e_0 + e_1 + e_2)`. No division by a vertex's `w` happens, so vertices behind the
//!    eye need no care.
//!
//! Positions are in [homogeneous pixel space](crate::math).

use crate::math::PixelPoint;

/// Fraction bits of a snapped coordinate.
pub const SUBPIXEL_BITS: u32 = 8;

/// Snapped coordinates reach this many pixels left, right, up and down from the image's top left corner.
/// With 8 sub-pixel bits an edge function changes by less than 2^31 within a tile of 64 pixels once it has been
/// shifted down to whole pixels.
pub const GUARD_BAND_PX: f64 = 16384.0;

/// Largest image width or height: what the guard band covers.
pub const MAX_IMAGE_SIDE: u32 = 16384;

const SUBPIXEL: f64 = (1 << SUBPIXEL_BITS) as f64;

/// Signed distances, scaled by positive factors, from the six clipping planes; inside where not negative.
#[inline]
#[must_use]
fn plane_distances(p: PixelPoint) -> [f64; 6] {
    let [x, y, z, w] = p;
    let guard = GUARD_BAND_PX * w;
    [w - z, z, guard + x, guard - x, guard + y, guard - y]
}

/// A bit for each clipping plane that `p` is outside of: near, far, left, right, top, bottom; and one more for a point that is
/// not in front of the eye, which says nothing about the planes. NaN is outside of everything. A triangle whose corners share a
/// bit has no visible point.
#[inline]
#[must_use]
pub fn outcode(p: PixelPoint) -> u8 {
    let mut code = u8::from(p[3] <= 0.0 || p[3].is_nan()) << 6;
    for (bit, distance) in plane_distances(p).into_iter().enumerate() {
        let inside = distance >= 0.0;
        code |= u8::from(!inside) << bit;
    }
    code
}

/// A convex polygon left over from clipping: up to three vertices and one more for each of six planes.
#[derive(Clone, Copy, Debug)]
pub struct ClippedPolygon {
    vertices: [PixelPoint; 9],
    len: usize,
}

impl ClippedPolygon {
    /// Its vertices, in the triangle's order; fewer than three when nothing is left.
    #[must_use]
    pub fn vertices(&self) -> &[PixelPoint] {
        &self.vertices[..self.len]
    }
}

/// Clips a triangle against the near and far planes and the guard band (Sutherland and Hodgman).
#[must_use]
pub fn clip(triangle: [PixelPoint; 3]) -> ClippedPolygon {
    let mut polygon = ClippedPolygon {
        vertices: [[0.0; 4]; 9],
        len: 3,
    };
    polygon.vertices[..3].copy_from_slice(&triangle);
    for plane in 0..6 {
        let input = polygon;
        polygon.len = 0;
        for i in 0..input.len {
            let (a, b) = (input.vertices[i], input.vertices[(i + 1) % input.len]);
            let (da, db) = (plane_distances(a)[plane], plane_distances(b)[plane]);
            if da >= 0.0 {
                polygon.vertices[polygon.len] = a;
                polygon.len += 1;
            }
            if (da >= 0.0) != (db >= 0.0) && polygon.len < 9 {
                polygon.vertices[polygon.len] = if da >= 0.0 {
                    leave(a, b, da, db)
                } else {
                    leave(b, a, db, da)
                };
                polygon.len += 1;
            }
        }
        if polygon.len < 3 {
            polygon.len = 0;
            return polygon;
        }
    }
    polygon
}

/// Where the edge from `inside` to `outside` leaves the half-space; distances `di >= 0 > d_o`.
fn leave(inside: PixelPoint, outside: PixelPoint, di: f64, d_o: f64) -> PixelPoint {
    let t = di / (di - d_o);
    std::array::from_fn(|k| inside[k] + (outside[k] - inside[k]) * t)
}

/// Rounds a vertex in front of the eye to the sub-pixel grid. Needs `w > 0`; far outside of the guard band (only
/// rounding after clipping brings a vertex there) it stays on its border.
#[inline]
#[must_use]
pub fn snap(p: PixelPoint) -> [i32; 2] {
    let grid = |v: f64| {
        let limit = GUARD_BAND_PX * SUBPIXEL;
        ((v / p[3]) * SUBPIXEL)
            .round_ties_even()
            .clamp(-limit, limit) as i32
    };
    [grid(p[0]), grid(p[1])]
}

/// Twice the signed area of a snapped triangle in squared sub-pixels: positive for front faces, which turn
/// counter-clockwise as seen on the screen (see [`math`](crate::math)).
#[inline]
#[must_use]
pub fn doubled_area([a, b, c]: [[i32; 2]; 3]) -> i64 {
    let d = |p: [i32; 2], q: [i32; 2]| [i64::from(q[0] - p[0]), i64::from(q[1] - p[1])];
    let (u, v) = (d(a, b), d(a, c));
    // The other way round than usual, because y points down.
    u[1] * v[0] - u[0] * v[1]
}

/// One edge of a front-facing snapped triangle as `a x + b y + c >= 0`, `x` and `y` in sub-pixels, with the
/// top-left rule folded into `c`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeFunction {
    /// Change per sub-pixel to the right.
    pub a: i64,
    /// Change per sub-pixel down.
    pub b: i64,
    /// Value at the image's top left corner.
    pub c: i64,
}

impl EdgeFunction {
    /// The edge from `p` to `q`, with the triangle's inside on its left hand as seen on the screen.
    #[inline]
    #[must_use]
    pub fn new(p: [i32; 2], q: [i32; 2]) -> Self {
        let [px, py] = p.map(i64::from);
        let (dx, dy) = (i64::from(q[0]) - px, i64::from(q[1]) - py);
        let top_left = dy > 0 || (dy == 0 && dx < 0);
        Self {
            a: dy,
            b: -dx,
            c: dx * py - dy * px - i64::from(!top_left),
        }
    }

    /// The value at the centre of pixel `(x, y)`; covered where no edge's is negative.
    #[inline]
    #[must_use]
    pub fn at_pixel(&self, x: i32, y: i32) -> i64 {
        let center = |v: i32| (i64::from(v) << SUBPIXEL_BITS) + (1 << (SUBPIXEL_BITS - 1));
        self.a * center(x) + self.b * center(y) + self.c
    }
}

/// An inclusive, non-empty range of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelBox {
    /// First column.
    pub x0: i32,
    /// First row.
    pub y0: i32,
    /// Last column.
    pub x1: i32,
    /// Last row.
    pub y1: i32,
}

impl PixelBox {
    /// The pixels of a `width` x `height` image whose centres lie in the bounding box of snapped points, or `None`
    /// when there are none.
    #[inline]
    #[must_use]
    pub fn of_snapped(points: &[[i32; 2]], width: u32, height: u32) -> Option<Self> {
        let range = |axis: usize, size: u32| {
            let min = points.iter().map(|p| p[axis]).min()?;
            let max = points.iter().map(|p| p[axis]).max()?;
            // First and last v with min <= 256 v + 128 <= max.
            let half = 1 << (SUBPIXEL_BITS - 1);
            let first = ((min - half + (1 << SUBPIXEL_BITS) - 1) >> SUBPIXEL_BITS).max(0);
            let last = ((max - half) >> SUBPIXEL_BITS).min(size as i32 - 1);
            (first <= last).then_some((first, last))
        };
        let ((x0, x1), (y0, y1)) = (range(0, width)?, range(1, height)?);
        Some(Self { x0, y0, x1, y1 })
    }
}

/// How far a back is moved, in pixels along its slope. Snapping moves an edge by less than 1/256 of a pixel, so this makes up for
/// a front more than twenty times as steep.
const BACK_OFFSET_PX: f32 = 0.125;

/// The reversed depth of a triangle, as a function of the pixel alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DepthPlane {
    /// The pixel that `base` belongs to.
    pub anchor: [i32; 2],
    /// Depth at the centre of the anchor.
    pub base: f32,
    /// Change per pixel to the right.
    pub dx: f32,
    /// Change per pixel down.
    pub dy: f32,
    /// Smallest depth of the triangle.
    pub min: f32,
    /// Largest depth of the triangle.
    pub max: f32,
}

impl DepthPlane {
    /// The plane of a back: farther from the viewer by what it changes over an eighth of a pixel in both directions, within
    /// the triangle's range as ever.
    ///
    /// On the outline of a surface a front and a back meet in an edge. Coverage goes to where that has been snapped to and
    /// depth does not, so a pixel centre between the two would see the back before the front, as a speck.
    #[inline]
    #[must_use]
    pub fn moved_back(self) -> Self {
        Self {
            base: self.base - BACK_OFFSET_PX * (self.dx.abs() + self.dy.abs()),
            ..self
        }
    }

    /// Depth at the centre of pixel `(x, y)`: two products and two sums, each rounded by itself in this order, then
    /// clamped to the triangle's range, so that an edge-on triangle cannot shoot out of its vertices' depths.
    #[inline]
    #[must_use]
    pub fn at_pixel(&self, x: i32, y: i32) -> f32 {
        let row = self.base + self.dy * (y - self.anchor[1]) as f32;
        let depth = row + self.dx * (x - self.anchor[0]) as f32;
        depth.max(self.min).min(self.max)
    }
}

/// The homogeneous edge planes of a triangle in `f64`: what depth and barycentrics are made from.
#[derive(Clone, Copy, Debug)]
pub struct TrianglePlanes {
    corners: [PixelPoint; 3],
    /// `v_j x v_k` for the edge opposite to each corner.
    edges: [[f64; 3]; 3],
    /// `v_0 . (v_1 x v_2)`: negative for faces seen from the front, because y points down.
    determinant: f64,
}

impl TrianglePlanes {
    /// The planes of an unclipped triangle.
    #[must_use]
    pub fn new(corners: [PixelPoint; 3]) -> Self {
        let v = corners.map(|[x, y, _, w]| [x, y, w]);
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [
                a[1] * b[2] - a[2] * b[1],
                a[2] * b[0] - a[0] * b[2],
                a[0] * b[1] - a[1] * b[0],
            ]
        };
        let edges = [cross(v[1], v[2]), cross(v[2], v[0]), cross(v[0], v[1])];
        let determinant = v[0][0] * edges[0][0] + v[0][1] * edges[0][1] + v[0][2] * edges[0][2];
        Self {
            corners,
            edges,
            determinant,
        }
    }

    /// The edge planes at the centre of pixel `(x, y)`, turned so that they are positive inside.
    #[must_use]
    pub fn edges_at_pixel(&self, x: i32, y: i32) -> [f64; 3] {
        self.edges_at(f64::from(x) + 0.5, f64::from(y) + 0.5)
    }

    /// The edge planes at a point of the screen, turned so that they are positive inside.
    #[must_use]
    pub fn edges_at(&self, x: f64, y: f64) -> [f64; 3] {
        let sign = if self.determinant < 0.0 { -1.0 } else { 1.0 };
        self.edges.map(|e| (e[0] * x + e[1] * y + e[2]) * sign)
    }

    /// Whether the triangle turns its front to the viewer: positive if it does, negative if it shows its back, zero if it
    /// is seen edge-on; NaN if a coordinate is.
    #[must_use]
    pub fn facing(&self) -> f64 {
        -self.determinant
    }

    /// The depth plane about `anchor`, the top left pixel of the triangle's [`PixelBox`]. Depth is `z / w`, linear on the
    /// screen: `sum z_i e_i / determinant`. A triangle seen exactly edge-on has no such plane; it gets the
    /// nearest depth of its vertices throughout.
    #[must_use]
    pub fn depth(&self, anchor: [i32; 2]) -> DepthPlane {
        let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
        for [_, _, z, w] in self.corners {
            let depth = if w > 0.0 {
                (z / w).clamp(0.0, 1.0)
            } else {
                1.0
            };
            (min, max) = (min.min(depth), max.max(depth));
        }
        if self.corners.iter().any(|p| !(p[3] > 0.0 && p[2] <= p[3])) {
            // Some corner is nearer than the near plane, so what is left may be anywhere.
            (min, max) = (0.0, 1.0);
        }
        let plane: [f64; 3] = std::array::from_fn(|k| {
            (0..3)
                .map(|i| self.corners[i][2] * self.edges[i][k])
                .sum::<f64>()
                / self.determinant
        });
        let (x, y) = (f64::from(anchor[0]) + 0.5, f64::from(anchor[1]) + 0.5);
        let base = plane[0] * x + plane[1] * y + plane[2];
        let usable = [plane[0], plane[1], base].iter().all(|v| v.abs() < 1e30);
        let [dx, dy, base] = if usable {
            [plane[0], plane[1], base]
        } else {
            [0.0, 0.0, max]
        };
        DepthPlane {
            anchor,
            base: base as f32,
            dx: dx as f32,
            dy: dy as f32,
            min: min as f32,
            max: max as f32,
        }
    }

    /// The barycentric planes about `anchor`, in `f32` and scaled so that no coefficient exceeds 1.
    #[must_use]
    pub fn interpolator(&self, anchor: [i32; 2]) -> Interpolator {
        let c = self.edges_at_pixel(anchor[0], anchor[1]);
        let sign = if self.determinant < 0.0 { -1.0 } else { 1.0 };
        let largest = (0..3)
            .flat_map(|i| [c[i].abs(), self.edges[i][0].abs(), self.edges[i][1].abs()])
            .fold(0.0, f64::max);
        let scale = if largest > 0.0 && largest.is_finite() {
            1.0 / largest
        } else {
            0.0
        };
        Interpolator {
            anchor,
            a: std::array::from_fn(|i| (self.edges[i][0] * sign * scale) as f32),
            b: std::array::from_fn(|i| (self.edges[i][1] * sign * scale) as f32),
            c: std::array::from_fn(|i| (c[i] * scale) as f32),
        }
    }
}

/// Perspective-correct barycentrics of a triangle by pixel, for SIMD lanes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interpolator {
    /// The pixel that `c` belongs to.
    pub anchor: [i32; 2],
    /// Change of each corner's plane per pixel to the right.
    pub a: [f32; 3],
    /// Change of each corner's plane per pixel down.
    pub b: [f32; 3],
    /// Each corner's plane at the centre of the anchor.
    pub c: [f32; 3],
}

impl Interpolator {
    /// The weights of the three corners at the centre of pixel `(x, y)`, clamped to the triangle; a third each where
    /// nothing better can be said (a triangle seen edge-on). The scalar twin of what the backends do in lanes.
    #[must_use]
    pub fn at_pixel(&self, x: i32, y: i32) -> [f32; 3] {
        let (dx, dy) = ((x - self.anchor[0]) as f32, (y - self.anchor[1]) as f32);
        let e: [f32; 3] = std::array::from_fn(|i| {
            self.a[i]
                .mul_add(dx, self.b[i].mul_add(dy, self.c[i]))
                .max(0.0)
        });
        normalized_weights(e.map(f64::from)).map(|v| v as f32)
    }
}

/// Scales non-negative edge values to weights that sum to 1, or a third each when all of them are zero.
#[must_use]
pub fn normalized_weights(e: [f64; 3]) -> [f64; 3] {
    let sum = e[0] + e[1] + e[2];
    if sum > 0.0 && sum.is_finite() {
        e.map(|v| v / sum)
    } else {
        [1.0 / 3.0; 3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(x: f64, y: f64, w: f64) -> PixelPoint {
        [x * w, y * w, 0.5 * w, w]
    }

    #[test]
    fn barycentrics_are_perspective_correct() {
        // Half way on the screen between w = 1 and w = 3 lies a quarter of the way along the edge.
        let planes = TrianglePlanes::new([
            corner(0.5, 0.5, 1.0),
            corner(10.5, 0.5, 3.0),
            corner(0.5, 10.5, 1.0),
        ]);
        let weights = planes.interpolator([0, 0]).at_pixel(5, 0);
        assert!((weights[0] - 0.75).abs() < 1e-6, "{weights:?}");
        assert!((weights[1] - 0.25).abs() < 1e-6, "{weights:?}");
    }

    #[test]
    fn clipping_keeps_an_inside_triangle_and_drops_an_outside_one() {
        let inside = [
            corner(0.0, 0.0, 1.0),
            corner(9.0, 0.0, 1.0),
            corner(0.0, 9.0, 1.0),
        ];
        assert_eq!(clip(inside).vertices(), &inside);
        let behind = inside.map(|[x, y, z, w]| [-x, -y, -z, -w]);
        assert!(clip(behind).vertices().is_empty());
        assert!(behind.iter().all(|&p| outcode(p) != 0));
        assert_eq!(outcode([f64::NAN; 4]), 0x7f);
        assert_ne!(outcode([0.0; 4]), 0);
    }

    #[test]
    fn corners_that_share_an_outcode_leave_nothing_to_clip() {
        // The first corner is behind the eye, yet on the inner side of the plane that the others are outside of.
        let far_right = 2.0 * GUARD_BAND_PX;
        let triangle = [
            [far_right, 0.0, 1.0, -1.0],
            [-far_right, 1.0, 0.5, 1.0],
            [-far_right, -1.0, 0.5, 1.0],
        ];
        let codes = triangle.map(outcode);
        assert_eq!(codes[0] & codes[1] & codes[2], 0);
        // Any mixture of coordinates: where a bit is shared, clipping agrees.
        let values = [-2.0, -0.5, 0.0, 0.25, 1.5];
        let mut state = 1_u32;
        let mut next = |scale: f64| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            values[(state >> 24) as usize % values.len()] * scale
        };
        let mut shared = 0;
        for _ in 0..100_000 {
            let mut p = || {
                [
                    next(GUARD_BAND_PX),
                    next(GUARD_BAND_PX),
                    next(1.0),
                    next(1.0),
                ]
            };
            let triangle = [p(), p(), p()];
            let codes = triangle.map(outcode);
            if codes[0] & codes[1] & codes[2] != 0 {
                shared += 1;
                let left = clip(triangle);
                let seen = left.vertices().iter().any(|p| p[3] > 0.0);
                assert!(!seen, "{triangle:?} left {left:?}");
            }
        }
        assert!(shared > 1000, "{shared}");
    }

    #[test]
    fn a_triangle_that_faces_the_eye_has_a_positive_area() {
        // The eye at the origin looks along -z, y up: a triangle at z = -1 whose normal is +z faces it.
        let project = |x: f64, y: f64| snap(corner(50.0 + 10.0 * x, 50.0 - 10.0 * y, 1.0));
        let front = [project(0.0, 0.0), project(1.0, 0.0), project(0.0, 1.0)];
        let [a, b, c] = front;
        assert_eq!(doubled_area(front), 100 << (2 * SUBPIXEL_BITS));
        assert_eq!(doubled_area([a, c, b]), -(100 << (2 * SUBPIXEL_BITS)));
        let inside = |t: [[i32; 2]; 3]| {
            (0..3).all(|i| EdgeFunction::new(t[i], t[(i + 1) % 3]).at_pixel(52, 46) >= 0)
        };
        assert!(inside(front) && !inside([a, c, b]));
    }

    #[test]
    fn a_shared_edge_gives_each_pixel_to_one_side() {
        let (a, b, c, d) = ([128, 128], [2688, 128], [128, 2688], [2688, 2688]);
        let covered = |t: [[i32; 2]; 3], x, y| {
            (0..3).all(|i| EdgeFunction::new(t[i], t[(i + 1) % 3]).at_pixel(x, y) >= 0)
        };
        for y in 0..10 {
            for x in 0..10 {
                let sides = u8::from(covered([a, c, b], x, y)) + u8::from(covered([b, c, d], x, y));
                assert_eq!(sides, 1, "pixel {x} {y}");
            }
        }
    }

    #[test]
    fn a_triangle_without_area_has_finite_planes() {
        let p = corner(3.0, 4.0, 2.0);
        let planes = TrianglePlanes::new([p, p, p]);
        let depth = planes.depth([3, 4]);
        assert_eq!(depth.at_pixel(100, 100), 0.5);
        assert_eq!(planes.interpolator([3, 4]).at_pixel(7, 7), [1.0 / 3.0; 3]);
    }
}
