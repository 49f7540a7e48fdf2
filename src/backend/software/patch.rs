//! Where the pixels of a patch are: tests of who owns a pixel, and where to look for pixels that pass.
//!
//! **Who owns a pixel.** A pixel's barycentric coordinates `(b1, b2)` in the root triangle are rounded to a grid of `2^-16`,
//! half as wide as that of the patches' corners, and moved off the root's border: `b1, b2 >= 1`, `b1 + b2 <= 2^16 - 1`
//! in grid units. Then an integer edge function decides on which side of each edge of the patch the point lies; the top-left rule, here
//! in the `(b1, b2)` plane, decides on the edges. It amounts to moving every point by one and the same infinitesimal step, and no point
//! is on the root's border, so any patches that partition the root own each pixel exactly once, whether or not
//! they meet edge to edge. (Points on the border could not be shared out by a rule that knows one patch at a time.)
//!
//! **Exactness.** An edge function is twice the area of the triangle of the edge and the point, in units of `2^-15` by `2^-16`.
//! All three lie in the root, the point strictly, so it is smaller in magnitude than the root's `2^31`; and `i32` arithmetic, which
//! wraps, is exact whenever the result fits, bias of the top-left rule included.
//!
//! **Where to look.** The coordinates that a pixel is found to have are off by the triangle's
//! [`slack`] at most. So the pixels of a patch lie in the box of its projection,
//! widened by that, and where each edge function is at least minus what the slack can change it by. Times the sum of the
//! root's edge planes, which is positive, an edge function is linear in the pixel: it bounds each row of pixels on the left or on
//! the right. Where the slack says nothing, all that the triangle may own is searched.

use super::lanes::Lanes3;
use super::setup::Drawn;
use super::tile::{BLOCK_SIDE, Bounds, TILE_SIDE, TileBox};
use crate::geometry::Bary;
use crate::geometry::screen::Interpolator;
use crate::math::PixelPoint;
use crate::simd::Simd;
use fearless_simd::{SimdBase, SimdFloat, SimdInt};

/// Where 1 lies on the grid of pixels' barycentric coordinates.
const GRID_UNIT: i32 = 2 * Bary::UNIT as i32;

/// Lanes of the widest vectors.
pub(super) const MAX_LANES: usize = 16;

/// Pixels by which boxes and rows are widened for rounding.
const MARGIN: f32 = 1.0 / 64.0;

/// A box that holds all pixels of a patch.
///
/// A corner `p = n / w` that moves by up to the slack along `b1` and `b2` moves by at most
/// `slack (|r1 - r0| + |r2 - r0|) / (w - slack (|w1 - w0| + |w2 - w0|))` along x, with `r = x w - p w` for each corner of
/// the root; likewise along y.
#[inline(always)]
pub(super) fn patch_bounds(
    owner: &Drawn,
    slack: f32,
    [a, b, c]: &[PixelPoint; 3],
    patch: &[Bary; 3],
) -> Option<Bounds> {
    if *patch == Bary::ROOT || slack == f32::INFINITY {
        return Some(owner.bounds);
    }
    let slack = f64::from(slack);
    let w_room = slack * ((b[3] - a[3]).abs() + (c[3] - a[3]).abs());
    let mut min = [f64::INFINITY; 2];
    let mut max = [f64::NEG_INFINITY; 2];
    for corner in patch {
        let [b0, b1, b2] = corner.weights().map(f64::from);
        let w = b0 * a[3] + b1 * b[3] + b2 * c[3];
        let least_w = w - w_room;
        if least_w <= 0.0 || least_w.is_nan() {
            return Some(owner.bounds);
        }
        let (scale, reach) = (1.0 / w, slack / least_w);
        for axis in 0..2 {
            let p = (b0 * a[axis] + b1 * b[axis] + b2 * c[axis]) * scale;
            let from_b = (b[axis] - a[axis]) - p * (b[3] - a[3]);
            let from_c = (c[axis] - a[axis]) - p * (c[3] - a[3]);
            let room = reach * (from_b.abs() + from_c.abs());
            min[axis] = min[axis].min(p - room);
            max[axis] = max[axis].max(p + room);
        }
    }
    // The pixels whose centres lie inside. Conversion cuts off behind the point, and saturates.
    let margin = f64::from(MARGIN);
    let first = |v: f64| (v + (0.5 - margin)).max(0.0) as u16;
    let end = |v: f64| (v + (0.5 + margin)).max(0.0) as u16;
    let ends = [end(max[0]), end(max[1])];
    if ends[0] == 0 || ends[1] == 0 {
        return None;
    }
    let bounds = Bounds {
        x0: owner.bounds.x0.max(first(min[0])),
        y0: owner.bounds.y0.max(first(min[1])),
        x1: owner.bounds.x1.min(ends[0] - 1),
        y1: owner.bounds.y1.min(ends[1] - 1),
    };
    (bounds.x0 <= bounds.x1 && bounds.y0 <= bounds.y1).then_some(bounds)
}

/// A bound of the error of a pixel's barycentric coordinates: how far, in barycentric coordinates, those that a pixel is found
/// to have can be from those of a point that projects to its centre. For a triangle in front of the eye; infinite for a clipped one,
/// and when nothing better is known.
///
/// With `s` the smallest sum of the edge planes over the triangle (it is linear, so at a corner), `M` the largest magnitude in
/// evaluating one inside the box, and `G` the largest slope per pixel:
/// * rounding coefficients and operations to `f32` costs at most `8 * 2^-24 M` per plane, four times that over `s` per weight;
/// * snapping brings in pixels up to `2^-9` outside along each axis, and clamping moves them back: `4 * 2^-9 G / s`, taken twice;
/// * rounding to the grid of the pixels' coordinates and clamping to its inside costs at most `2.5 * 2^-16`, taken as `2^-14`.
///
/// Above a quarter the bound is not worth having, and `s` itself may be nothing but rounding: infinity.
pub(super) fn slack(owner: &Drawn, corners: &[PixelPoint; 3]) -> f32 {
    if owner.is_clipped {
        return f32::INFINITY;
    }
    let (planes, bounds) = (owner.interpolator(), &owner.bounds);
    let sum_at = |x: f64, y: f64| -> f64 {
        let dx = x - 0.5 - f64::from(planes.anchor[0]);
        let dy = y - 0.5 - f64::from(planes.anchor[1]);
        (0..3)
            .map(|i| {
                let [a, b, c] = [planes.a[i], planes.b[i], planes.c[i]].map(f64::from);
                a * dx + b * dy + c
            })
            .sum()
    };
    let smallest_sum = corners
        .iter()
        .map(|[x, y, _, w]| sum_at(x / w, y / w))
        .fold(f64::INFINITY, f64::min);
    let extent = [bounds.x1 - bounds.x0, bounds.y1 - bounds.y0].map(f64::from);
    let (mut largest, mut slope) = (0.0, 0.0);
    for i in 0..3 {
        let [a, b, c] = [planes.a[i], planes.b[i], planes.c[i]].map(|v| f64::from(v.abs()));
        largest = f64::max(largest, a * extent[0] + b * extent[1] + c);
        slope = f64::max(slope, a + b);
    }
    let bound = 1.0 / 16384.0 + (largest / f64::from(1 << 19) + slope / 64.0) / smallest_sum;
    // Not so for NaN either.
    if smallest_sum > 0.0 && bound < 0.25 {
        bound as f32
    } else {
        f32::INFINITY
    }
}

/// The edges of a patch as `a b1 + b b2 + c >= 0` on the grid of pixels' barycentric coordinates, the top-left rule
/// folded into `c`.
#[derive(Clone, Copy, Debug)]
pub(super) struct PatchEdges([[i64; 3]; 3]);

impl PatchEdges {
    #[inline(always)]
    pub(super) fn new(corners: [Bary; 3]) -> Self {
        let edge = |p: Bary, q: Bary| {
            let [p1, p2, q1, q2] = [p.b1, p.b2, q.b1, q.b2].map(i64::from);
            let (dx, dy) = (q1 - p1, q2 - p2);
            let top_left = dy < 0 || (dy == 0 && dx > 0);
            // Twice: the pixels' grid is half as wide.
            let c = 2 * (dy * p1 - dx * p2) - i64::from(!top_left);
            [-dy, dx, c]
        };
        let [a, b, c] = corners;
        Self([edge(a, b), edge(b, c), edge(c, a)])
    }

    /// Edge functions at these weights, or-ed together: negative where a pixel does not belong to the patch.
    #[inline(always)]
    pub(super) fn signs<S: Simd>(&self, simd: S, w: Lanes3<S>) -> S::i32s {
        let one = S::i32s::splat(simd, 1);
        let b1 = on_grid::<S>(w[1]).max(one).min(GRID_UNIT - 2);
        let most = S::i32s::splat(simd, GRID_UNIT - 1) - b1;
        let b2 = on_grid::<S>(w[2]).max(one).min(most);
        // Only the low 32 bits matter, since the values of the edge functions fit; their sum is the same everywhere.
        let [[a0, d0, c0], [a1, d1, c1], [_, _, c2]] = self.0.map(|edge| edge.map(|v| v as i32));
        let first = b1 * a0 + b2 * d0 + c0;
        let second = b1 * a1 + b2 * d1 + c1;
        let sum = c0.wrapping_add(c1).wrapping_add(c2);
        let third = S::i32s::splat(simd, sum) - first - second;
        first | second | third
    }

    /// An edge as a line of a tile's pixels, widened by the slack.
    #[inline(always)]
    fn line(
        &self,
        edge: usize,
        planes: &Interpolator,
        slack: f64,
        origin: [i32; 2],
    ) -> Option<Line> {
        let [a, b, c] = self.0[edge].map(|v| v as f64);
        let c = c * (1.0 / f64::from(GRID_UNIT)) + (a.abs() + b.abs()) * slack;
        // `a b1 + b b2 + c (b0 + b1 + b2)`, each `b` a plane.
        let (a, b) = (a + c, b + c);
        let combine = |v: [f32; 3]| {
            let [v0, v1, v2] = v.map(f64::from);
            c * v0 + a * v1 + b * v2
        };
        let (x, y) = (combine(planes.a), combine(planes.b));
        let at_origin = combine(planes.c)
            + x * f64::from(origin[0] - planes.anchor[0])
            + y * f64::from(origin[1] - planes.anchor[1]);
        let scale = -1.0 / x;
        let (start, slope) = ((at_origin * scale) as f32, (y * scale) as f32);
        // Numbers so small keep rounding below half of the margin. What is nearly level, and NaN, bounds no row.
        (start.abs() < 16384.0 && slope.abs() < 256.0).then_some(Line {
            is_left: x > 0.0,
            start,
            slope,
        })
    }
}

/// A weight rounded to the grid.
#[inline(always)]
fn on_grid<S: Simd>(weight: S::f32s) -> S::i32s {
    (weight * GRID_UNIT as f32 + 0.5).to_int()
}

/// A bound of rows: a pixel of row `y` is not to the left (or not to the right) of `start + slope y`.
#[derive(Clone, Copy, Debug)]
struct Line {
    is_left: bool,
    start: f32,
    slope: f32,
}

/// The columns of each row of a tile in which a patch's pixels lie; none where the last is less than the first.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    /// First column.
    pub first: [i32; TILE_SIDE + MAX_LANES],
    /// Last column.
    pub last: [i32; TILE_SIDE + MAX_LANES],
}

impl Rows {
    pub(super) fn new() -> Self {
        Self {
            first: [0; TILE_SIDE + MAX_LANES],
            last: [0; TILE_SIDE + MAX_LANES],
        }
    }

    /// Finds the rows of `pixels`; others become meaningless.
    #[inline(always)]
    pub(super) fn find<S: Simd>(
        &mut self,
        simd: S,
        origin: [i32; 2],
        pixels: TileBox,
        planes: &Interpolator,
        slack: f32,
        edges: Option<&PatchEdges>,
    ) {
        let mut lines = [None; 3];
        if let Some(edges) = edges.filter(|_| slack < f32::INFINITY) {
            for (index, line) in lines.iter_mut().enumerate() {
                *line = edges.line(index, planes, f64::from(slack), origin);
            }
        }
        let lanes = S::i32s::LEN;
        let zero = S::f32s::splat(simd, 0.0);
        let iota = S::i32s::from_fn(simd, |i| i as i32);
        for y in (pixels.y0..=pixels.y1).step_by(lanes) {
            let mut first = S::i32s::splat(simd, pixels.x0);
            let mut last = S::i32s::splat(simd, pixels.x1);
            let row: S::f32s = (iota + y).to_float();
            for line in lines.iter().flatten() {
                let start = S::f32s::splat(simd, line.start);
                let x = row.mul_add(S::f32s::splat(simd, line.slope), start);
                // Rounded down, being positive.
                if line.is_left {
                    first = first.max((x + (1.0 - MARGIN)).max(zero).to_int::<S::i32s>());
                } else {
                    let end = (x + (1.0 + MARGIN)).max(zero).to_int::<S::i32s>();
                    last = last.min(end - 1);
                }
            }
            let at = y as usize;
            first.store_slice(&mut self.first[at..at + lanes]);
            last.store_slice(&mut self.last[at..at + lanes]);
        }
    }

    /// The blocks across in which a row of blocks has pixels of rows `y0..=y1`, as the first and the one behind the last.
    #[inline(always)]
    pub(super) fn blocks(&self, y0: usize, y1: usize) -> [usize; 2] {
        let (mut first, mut end) = (TILE_SIDE as i32, 0);
        for y in y0..=y1 {
            if self.first[y] <= self.last[y] {
                first = first.min(self.first[y]);
                end = end.max(self.last[y] + 1);
            }
        }
        [
            first as usize / BLOCK_SIDE,
            (end as usize).div_ceil(BLOCK_SIDE),
        ]
    }

    /// The blocks across in which all pixels of rows `y0..=y1` of a row of blocks are in the columns found, as the first and the one
    /// behind the last; none unless these are all rows of the blocks.
    #[inline(always)]
    pub(super) fn full_blocks(&self, y0: usize, y1: usize) -> [usize; 2] {
        if y1 - y0 + 1 < BLOCK_SIDE {
            return [0, 0];
        }
        let (mut first, mut end) = (0, TILE_SIDE as i32);
        for y in y0..=y1 {
            first = first.max(self.first[y]);
            end = end.min(self.last[y] + 1);
        }
        let side = BLOCK_SIDE as i32;
        [
            ((first + side - 1) / side) as usize,
            (end / side).max(0) as usize,
        ]
    }

    /// Which pixels of a block, whose corner is at `(x, y)`, lie in the rows `y0..=y1` and in the columns found; one bit each.
    #[inline(always)]
    pub(super) fn within_block(&self, [x, y]: [i32; 2], y0: usize, y1: usize) -> u32 {
        let side = BLOCK_SIDE as i32;
        let mut bits = 0;
        for row in y0..=y1 {
            let first = (self.first[row] - x).max(0).min(side);
            let end = (self.last[row] + 1 - x).min(side).max(first);
            bits |= ((1 << end) - (1 << first)) << (side * (row as i32 - y));
        }
        bits
    }
}
