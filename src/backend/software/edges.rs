//! The edges of a piece in the blocks of a tile, in whole pixels; see [`raster`](super::raster) for why `i32` is enough.

#![expect(
    clippy::needless_range_loop,
    reason = "loops run over several arrays of lanes at once"
)]

use super::setup::Piece;
use super::tile::{BLOCK_SIDE, TILE_SIDE};
use crate::geometry::screen::{EdgeFunction, SUBPIXEL_BITS};

/// Three edges, and the right and the lower border of the image.
const MOST_EDGES: usize = 5;

/// A small piece's edges are shorter than this along both axes, in sub-pixels, so that their values fit `i32` wherever it is drawn.
const SMALL: i32 = 64 << SUBPIXEL_BITS;

/// A rectangle of blocks, inclusive.
#[derive(Clone, Copy)]
pub(super) struct BlockRange {
    pub(super) x0: usize,
    pub(super) y0: usize,
    pub(super) x1: usize,
    pub(super) y1: usize,
}

impl BlockRange {
    /// Those of 64 columns from `first` on that are in the range, one bit each.
    #[inline(always)]
    pub(super) fn columns_from(&self, first: usize) -> u64 {
        let from_start = u64::MAX << self.x0.saturating_sub(first);
        from_start & (u64::MAX >> (63 - (self.x1 - first)))
    }
}

/// One edge of a piece, in whole pixels.
#[derive(Clone, Copy, Default)]
pub(super) struct TileEdge {
    /// Value at the tile's first pixel; may be outside of `i32`.
    pub(super) origin: i64,
    /// Change per pixel to the right.
    pub(super) dx: i32,
    /// Change per pixel down.
    pub(super) dy: i32,
}

/// One edge of a piece in some blocks, in whole pixels.
#[derive(Clone, Copy, Default)]
pub(super) struct BlockEdge {
    /// Value at the first pixel of the first block.
    pub(super) start: i32,
    /// Change per pixel to the right.
    pub(super) dx: i32,
    /// Change per pixel down.
    pub(super) dy: i32,
}

/// The edges of a piece in a tile, of which the first `count` are meant.
#[derive(Clone, Copy)]
pub(super) struct TileEdges {
    pub(super) edges: [TileEdge; MOST_EDGES],
    pub(super) count: usize,
}

impl TileEdges {
    #[inline(always)]
    pub(super) fn new(piece: &Piece, origin: [i32; 2], size: [i32; 2]) -> Self {
        let mut edges = [TileEdge::default(); MOST_EDGES];
        for i in 0..3 {
            let edge = EdgeFunction::new(piece.corners[i], piece.corners[(i + 1) % 3]);
            edges[i] = TileEdge {
                origin: edge.at_pixel(origin[0], origin[1]) >> SUBPIXEL_BITS,
                dx: edge.a as i32,
                dy: edge.b as i32,
            };
        }
        // The borders of the image, which would not stop a block.
        edges[3] = TileEdge {
            origin: i64::from(size[0]) - 1,
            dx: -1,
            dy: 0,
        };
        edges[4] = TileEdge {
            origin: i64::from(size[1]) - 1,
            dx: 0,
            dy: -1,
        };
        Self {
            edges,
            count: if is_inner(size) { 3 } else { MOST_EDGES },
        }
    }

    /// Those that some but not all pixels of the blocks violate; `None` if all violate one.
    #[inline(always)]
    pub(super) fn crossing(&self, range: BlockRange) -> Option<BlockEdges> {
        let side = BLOCK_SIDE as i64;
        let [x0, y0] = [range.x0 as i64 * side, range.y0 as i64 * side];
        let [across, down] = [
            (range.x1 - range.x0 + 1) as i64 * side - 1,
            (range.y1 - range.y0 + 1) as i64 * side - 1,
        ];
        let mut crossing = BlockEdges::default();
        for edge in &self.edges[..self.count] {
            let [dx, dy] = [i64::from(edge.dx), i64::from(edge.dy)];
            let start = edge.origin + dx * x0 + dy * y0;
            if start + (dx * across).max(0) + (dy * down).max(0) < 0 {
                return None;
            }
            if start + (dx * across).min(0) + (dy * down).min(0) < 0 {
                crossing.edges[crossing.count] = BlockEdge {
                    start: start as i32,
                    dx: edge.dx,
                    dy: edge.dy,
                };
                crossing.count += 1;
            }
        }
        Some(crossing)
    }
}

/// Edges that cross some blocks; those from `count` on are zero, and stop nothing.
#[derive(Clone, Copy, Default)]
pub(super) struct BlockEdges {
    pub(super) edges: [BlockEdge; MOST_EDGES],
    pub(super) count: usize,
}

/// Whether no pixel of a tile is outside of the image, given how many columns and rows are inside.
#[inline(always)]
pub(super) fn is_inner(size: [i32; 2]) -> bool {
    size == [TILE_SIDE as i32; 2]
}

/// The edges of a small piece in the blocks from that on whose first pixel is `(x, y)` of the image; `None` if it is not small.
///
/// An edge shorter than [`SMALL`] along each axis, in sub-pixels, and seen from a pixel less than twice as far from its ends, has
/// values below `4 SMALL^2`.
#[inline(always)]
pub(super) fn small_edges(piece: &Piece, [x, y]: [i32; 2]) -> Option<[BlockEdge; 3]> {
    let center = |v: i32| (v << SUBPIXEL_BITS) + (1 << (SUBPIXEL_BITS - 1));
    let [x, y] = [center(x), center(y)];
    let mut edges = [BlockEdge::default(); 3];
    let mut longest = 0;
    for i in 0..3 {
        let ([px, py], [qx, qy]) = (piece.corners[i], piece.corners[(i + 1) % 3]);
        let [dx, dy] = [qx - px, qy - py];
        longest |= dx.abs() | dy.abs();
        let top_left = (dy > 0) | ((dy == 0) & (dx < 0));
        // Wraps only where it is not used.
        let value = dy
            .wrapping_mul(x - px)
            .wrapping_sub(dx.wrapping_mul(y - py))
            .wrapping_sub(i32::from(!top_left));
        edges[i] = BlockEdge {
            start: value >> SUBPIXEL_BITS,
            dx: dy,
            dy: -dx,
        };
    }
    (longest < SMALL).then_some(edges)
}
