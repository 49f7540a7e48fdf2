//! What becomes of a batch of triangles: which turn their back, lie off the screen or between pixels, have to be clipped, or are
//! drawn; in lanes, by their corners on the sub-pixel grid.

use super::tile::Grid;
use super::transform::SnappedVertex;
use crate::geometry::screen::{SUBPIXEL_BITS, doubled_area};
use crate::simd::Simd;
use fearless_simd::prelude::*;

/// Boxes of fewer pixel centres than this along both axes are tested pixel by pixel: many such triangles lie between pixels.
const TINY: i32 = 2;
/// In sub-pixels, no such box is larger unless the image's border has cut it.
const TINY_EXTENT: i32 = (TINY + 1) << SUBPIXEL_BITS;

/// Triangles looked at together.
pub(super) const BATCH: usize = 16;

/// The corners of a batch of triangles on the sub-pixel grid.
pub(super) struct Batch {
    /// By corner.
    pub(super) x: [[i32; BATCH]; 3],
    /// By corner.
    pub(super) y: [[i32; BATCH]; 3],
    /// Planes that some corner is outside of.
    pub(super) some_outside: [i32; BATCH],
    /// Planes that all corners are outside of.
    pub(super) all_outside: [i32; BATCH],
}

/// What becomes of the triangles of a batch: one bit each. Those in none of the sets are off the screen.
#[derive(Clone, Copy, Default)]
pub(super) struct Verdicts {
    pub(super) back_facing: u64,
    pub(super) clip: u64,
    pub(super) draw: u64,
}

/// First and last pixels along an axis.
#[derive(Clone, Copy)]
pub(super) struct PixelRanges {
    pub(super) first: [i32; BATCH],
    pub(super) last: [i32; BATCH],
}

impl PixelRanges {
    pub(super) const NONE: Self = Self {
        first: [0; BATCH],
        last: [0; BATCH],
    };
}

impl Batch {
    #[inline(always)]
    pub(super) fn gather(snapped: &[SnappedVertex], triangles: &[[u32; 3]]) -> Self {
        let mut batch = Self {
            x: [[0; BATCH]; 3],
            y: [[0; BATCH]; 3],
            some_outside: [0; BATCH],
            all_outside: [0; BATCH],
        };
        for (i, triangle) in triangles.iter().enumerate().take(BATCH) {
            let [a, b, c] = [
                snapped[triangle[0] as usize],
                snapped[triangle[1] as usize],
                snapped[triangle[2] as usize],
            ];
            for (corner, vertex) in [a, b, c].into_iter().enumerate() {
                [batch.x[corner][i], batch.y[corner][i]] = vertex.position;
            }
            batch.some_outside[i] = a.outcode | b.outcode | c.outcode;
            batch.all_outside[i] = a.outcode & b.outcode & c.outcode;
        }
        batch
    }

    /// The corners of a triangle.
    #[inline(always)]
    pub(super) fn corners(&self, i: usize) -> [[i32; 2]; 3] {
        [
            [self.x[0][i], self.y[0][i]],
            [self.x[1][i], self.y[1][i]],
            [self.x[2][i], self.y[2][i]],
        ]
    }

    /// What becomes of a vector's worth of triangles from `at` on, and the boxes of those that are drawn.
    #[inline(always)]
    pub(super) fn judge<S: Simd>(
        &self,
        simd: S,
        grid: Grid,
        at: usize,
        boxes: &mut [PixelRanges; 2],
    ) -> Verdicts {
        let end = at + S::i32s::LEN;
        let load = |from: &[i32; BATCH]| S::i32s::from_slice(simd, &from[at..end]);
        let zero = S::i32s::splat(simd, 0);
        let inside = load(&self.some_outside).simd_eq(zero);
        let clip = !inside & load(&self.all_outside).simd_eq(zero);

        let x = [load(&self.x[0]), load(&self.x[1]), load(&self.x[2])];
        let y = [load(&self.y[0]), load(&self.y[1]), load(&self.y[2])];
        let [front, back] = self.facing(simd, at, &x, &y);
        let [x0, x1, across] = pixel_range(simd, x, grid.width);
        let [y0, y1, down] = pixel_range(simd, y, grid.height);
        let mut has_pixels = x0.simd_le(x1) & y0.simd_le(y1);
        let is_tiny = (x1 - x0).max(y1 - y0).simd_lt(TINY) & across.max(down).simd_lt(TINY_EXTENT);
        has_pixels &= !is_tiny | covers_some_of_four(simd, &x, &y, [x0, y0]);
        for (ranges, [first, last]) in boxes.iter_mut().zip([[x0, x1], [y0, y1]]) {
            first.store_slice(&mut ranges.first[at..end]);
            last.store_slice(&mut ranges.last[at..end]);
        }
        Verdicts {
            back_facing: (inside & back).to_bitmask() << at,
            clip: clip.to_bitmask() << at,
            draw: (inside & front & has_pixels).to_bitmask() << at,
        }
    }

    /// Which triangles turn their front to the viewer, and which their back; valid where all corners are inside. Twice the area
    /// in squared sub-pixels is exact in `i32` where differences of coordinates lie in `-2^15..2^15`.
    #[inline(always)]
    fn facing<S: Simd>(
        &self,
        simd: S,
        at: usize,
        x: &[S::i32s; 3],
        y: &[S::i32s; 3],
    ) -> [S::mask32s; 2] {
        let ([ux, vx], [uy, vy]) = ([x[1] - x[0], x[2] - x[0]], [y[1] - y[0], y[2] - y[0]]);
        let zero = S::i32s::splat(simd, 0);
        let mut area = uy * vx - ux * vy;
        // A number lies in -2^15..2^15 where its upper 17 bits are all alike.
        let excess = |v: S::i32s| (v ^ (v >> 31)) >> 15;
        let large = (excess(ux) | excess(uy) | excess(vx) | excess(vy)).simd_ne(zero);
        if large.any_true() {
            // The sign is all that matters.
            for (lane, area) in area.as_mut_slice().iter_mut().enumerate() {
                *area = doubled_area(self.corners(at + lane)).signum() as i32;
            }
        }
        [area.simd_gt(zero), area.simd_lt(zero)]
    }
}

/// Whether triangles that turn their front to the viewer, and whose boxes hold the centres of at most 2 x 2 pixels, the first of
/// which is given, cover any of those. It is [`EdgeFunction`](crate::geometry::screen::EdgeFunction) at four places. Such boxes
/// are below three pixels, so that values are below `2^21`. Pixels outside of the box are not covered either, and do no harm.
#[inline(always)]
fn covers_some_of_four<S: Simd>(
    simd: S,
    x: &[S::i32s; 3],
    y: &[S::i32s; 3],
    first: [S::i32s; 2],
) -> S::mask32s {
    let half = 1 << (SUBPIXEL_BITS - 1);
    let [left, top] = [
        (first[0] << SUBPIXEL_BITS) + half,
        (first[1] << SUBPIXEL_BITS) + half,
    ];
    let (zero, one) = (S::i32s::splat(simd, 0), S::i32s::splat(simd, 1));
    // Or-ed together, at the four pixels: negative where one of the edges is violated.
    let mut signs = [zero; 4];
    for i in 0..3 {
        let next = (i + 1) % 3;
        let (dx, dy) = (x[next] - x[i], y[next] - y[i]);
        let top_left = dy.simd_gt(zero) | (dy.simd_eq(zero) & dx.simd_lt(zero));
        let bias = top_left.select(zero, one);
        let value = dy * (left - x[i]) - dx * (top - y[i]) - bias;
        let (right, below) = (dy << SUBPIXEL_BITS, dx << SUBPIXEL_BITS);
        signs[0] |= value;
        signs[1] |= value + right;
        signs[2] |= value - below;
        signs[3] |= value + right - below;
    }
    signs[0].simd_ge(zero)
        | signs[1].simd_ge(zero)
        | signs[2].simd_ge(zero)
        | signs[3].simd_ge(zero)
}

/// First and last pixel along an axis of `size` pixels whose centres lie in the triangles' boxes, as
/// [`PixelBox::of_snapped`] has them; and the boxes' extents in sub-pixels.
#[inline(always)]
fn pixel_range<S: Simd>(simd: S, v: [S::i32s; 3], size: u32) -> [S::i32s; 3] {
    let half = 1 << (SUBPIXEL_BITS - 1);
    let min = v[0].min(v[1]).min(v[2]);
    let max = v[0].max(v[1]).max(v[2]);
    [
        ((min + (half - 1)) >> SUBPIXEL_BITS).max(S::i32s::splat(simd, 0)),
        ((max - half) >> SUBPIXEL_BITS).min(S::i32s::splat(simd, size as i32 - 1)),
        max - min,
    ]
}
