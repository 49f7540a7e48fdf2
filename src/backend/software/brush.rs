//! Coverage and depth of a piece at the pixels of a block, and at the corners of a row of blocks, in lanes.

#![expect(
    clippy::needless_range_loop,
    reason = "loops run over several arrays of lanes at once"
)]

use super::edges::BlockEdge;
use super::setup::Piece;
use super::tile::{BLOCK_PIXELS, BLOCK_SIDE};
use crate::geometry::screen::DepthPlane;
use crate::simd::Simd;
use fearless_simd::{SimdBase, SimdInt, SimdMask};

/// Most vectors in a block: at four lanes.
pub(super) const MOST_PARTS: usize = 4;

/// Columns and rows of a block's pixels, from its corner, a vector for each part of the block.
#[derive(Clone, Copy)]
pub(super) struct PixelPlaces<S: Simd> {
    pub(super) column: [S::i32s; MOST_PARTS],
    pub(super) row: [S::i32s; MOST_PARTS],
}

impl<S: Simd> PixelPlaces<S> {
    /// Vectors of a block.
    #[inline(always)]
    pub(super) fn parts() -> usize {
        BLOCK_PIXELS / S::i32s::LEN
    }

    #[inline(always)]
    pub(super) fn new(simd: S) -> Self {
        let iota = S::i32s::from_fn(simd, |i| i as i32);
        let mut places = Self {
            column: [iota; MOST_PARTS],
            row: [iota; MOST_PARTS],
        };
        for part in 0..Self::parts() {
            let pixel = iota + (part * S::i32s::LEN) as i32;
            places.column[part] = pixel & (BLOCK_SIDE as i32 - 1);
            places.row[part] = pixel >> BLOCK_SIDE.trailing_zeros();
        }
        places
    }
}

/// What drawing the blocks of a piece takes, under `N` edges.
pub(super) struct Brush<S: Simd, const N: usize> {
    pub(super) edges: [BlockEdge; N],
    /// Of each edge, the difference of the value at a pixel of a block from that at the block's first.
    pub(super) inside_block: [[S::i32s; MOST_PARTS]; N],
    pub(super) plane: DepthPlane,
    pub(super) slot: S::u32s,
    /// The tile's first pixel, from the depth's anchor.
    pub(super) from_anchor: [i32; 2],
}

impl<S: Simd, const N: usize> Brush<S, N> {
    #[inline(always)]
    pub(super) fn new(
        simd: S,
        places: &PixelPlaces<S>,
        piece: &Piece,
        edges: [BlockEdge; N],
        origin: [i32; 2],
    ) -> Self {
        let mut inside_block = [[S::i32s::splat(simd, 0); MOST_PARTS]; N];
        for k in 0..N {
            for part in 0..PixelPlaces::<S>::parts() {
                inside_block[k][part] =
                    places.column[part] * edges[k].dx + places.row[part] * edges[k].dy;
            }
        }
        let plane = piece.depth;
        Self {
            edges,
            inside_block,
            plane,
            slot: S::u32s::splat(simd, piece.slot),
            from_anchor: [origin[0] - plane.anchor[0], origin[1] - plane.anchor[1]],
        }
    }

    /// The first column of a block, from the depth's anchor.
    #[inline(always)]
    pub(super) fn column(&self, x: usize) -> i32 {
        self.from_anchor[0] + (x * BLOCK_SIDE) as i32
    }

    /// The first row of a block, from the depth's anchor.
    #[inline(always)]
    pub(super) fn row(&self, y: usize) -> i32 {
        self.from_anchor[1] + (y * BLOCK_SIDE) as i32
    }

    /// The part of the depth that depends on the row, for the pixels of a block.
    #[inline(always)]
    pub(super) fn row_depths(
        &self,
        simd: S,
        places: &PixelPlaces<S>,
        y: usize,
    ) -> [S::f32s; MOST_PARTS] {
        let mut depths = [S::f32s::splat(simd, 0.0); MOST_PARTS];
        for part in 0..PixelPlaces::<S>::parts() {
            let row: S::f32s = (places.row[part] + self.row(y)).to_float();
            depths[part] = row * self.plane.dy + self.plane.base;
        }
        depths
    }

    /// Depths in the columns given from the anchor, given the part that depends on the row.
    #[inline(always)]
    pub(super) fn depths(&self, simd: S, row_depth: S::f32s, column: S::f32s) -> S::f32s {
        let depth = row_depth + column * self.plane.dx;
        let (near, far) = (self.plane.max, self.plane.min);
        depth
            .max(S::f32s::splat(simd, far))
            .min(S::f32s::splat(simd, near))
    }

    /// For a vector of blocks of a row, the first of them in column `x` of the tile: the least and the largest depth of each.
    #[inline(always)]
    pub(super) fn depth_ranges(&self, simd: S, [x, y]: [usize; 2]) -> [S::f32s; 2] {
        let last = BLOCK_SIDE as i32 - 1;
        let corners = |slope: f32| if slope < 0.0 { [last, 0] } else { [0, last] };
        let (columns, rows) = (corners(self.plane.dx), corners(self.plane.dy));
        let first = S::i32s::from_fn(simd, |i| (i * BLOCK_SIDE) as i32) + self.column(x);
        let mut ranges = [S::f32s::splat(simd, 0.0); 2];
        for (range, (column, row)) in ranges.iter_mut().zip(columns.into_iter().zip(rows)) {
            let row = (self.row(y) + row) as f32;
            let row_depth = S::f32s::splat(simd, self.plane.base + self.plane.dy * row);
            *range = self.depths(simd, row_depth, (first + column).to_float());
        }
        ranges
    }

    /// Which pixels of a block violate no edge, given the values at its first pixel.
    #[inline(always)]
    pub(super) fn inside(&self, simd: S, corner: &[i32; N]) -> [S::mask32s; MOST_PARTS] {
        let zero = S::i32s::splat(simd, 0);
        let mut inside = [S::mask32s::splat(simd, true); MOST_PARTS];
        for part in 0..PixelPlaces::<S>::parts() {
            let mut signs = zero;
            for k in 0..N {
                signs |= self.inside_block[k][part] + corner[k];
            }
            inside[part] = signs.simd_ge(zero);
        }
        inside
    }

    /// For a vector of blocks of a row, the first of them `right` pixels to the right of where the edges have the given
    /// values: which have a pixel that violates no edge as far as the corners tell, and which have no other.
    #[inline(always)]
    pub(super) fn coverage(&self, simd: S, values: &[i32; N], right: i32) -> [S::mask32s; 2] {
        let last = BLOCK_SIDE as i32 - 1;
        let across = S::i32s::from_fn(simd, |i| (i * BLOCK_SIDE) as i32) + right;
        let zero = S::i32s::splat(simd, 0);
        let (mut some, mut all) = (zero, zero);
        for k in 0..N {
            let BlockEdge { dx, dy, .. } = self.edges[k];
            let value = across * dx + values[k];
            some |= value + ((last * dx).max(0) + (last * dy).max(0));
            all |= value + ((last * dx).min(0) + (last * dy).min(0));
        }
        [some.simd_ge(zero), all.simd_ge(zero)]
    }
}
