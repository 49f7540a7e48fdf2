//! Coverage and depth of one tile, in lanes.
//!
//! Edge functions are exact. An edge value `E` changes by a multiple of 256 sub-pixel units from pixel to pixel, so
//! `E >= 0` exactly where `E >> 8 >= 0` (the shift rounds down): `E` is found once per piece and tile in `i64`, shifted, and goes
//! on in `i32`. The step per pixel is then the edge's extent in sub-pixels, below `2^23` along each axis by the guard band. An edge
//! that no pixel of the blocks in question violates is left out; if every pixel violates one, so are the blocks. Any other changes
//! its sign within 64 x 64 pixels, hence is nowhere larger than `63 * 2^24 < 2^30`: `i32` does not overflow.
//!
//! A **small** piece, whose edges are shorter than [`SMALL`] and which touches few blocks, needs no such questions: all numbers are
//! small, and every block is tried. A piece that touches more than 4 x 4 blocks goes through **squares** of 16 x 16 pixels. Each is rejected, or entered with
//! those edges only that cross it. A square also knows a depth that none of its pixels is farther than: a piece that nowhere comes
//! nearer does not enter it. That depth rises when a piece covers the square without a gap, which is what large occluders do.
//!
//! Depth is [`DepthPlane::at_pixel`]: products and sums rounded one by one, never fused.
//! Pieces come in ascending order of slots, hence of ids, so "strictly nearer wins" leaves the smaller id in front at equal depth.

use super::setup::Piece;
use super::shares::{Share, add_pixels};
use super::tile::{
    BLOCK_PIXELS, BLOCK_SIDE, BLOCKS_ACROSS, NO_DEPTH, NO_TRIANGLE, TILE_PIXELS, TILE_SIDE, Tile,
};
use crate::geometry::screen::{DepthPlane, EdgeFunction, SUBPIXEL_BITS};
use crate::simd::Simd;
use fearless_simd::{Select, SimdBase, SimdInt, SimdMask};

/// Blocks side by side in a square.
const SQUARE_BLOCKS: usize = 4;
/// Squares side by side in a tile.
const SQUARES_ACROSS: usize = BLOCKS_ACROSS / SQUARE_BLOCKS;

/// Three edges, and the right and the lower border of the image.
const MOST_EDGES: usize = 5;

/// Edges shorter than this along both axes, in sub-pixels, have values that fit `i32` wherever a piece of at most 2 x 2 blocks looks.
const SMALL: i32 = 16 << SUBPIXEL_BITS;

/// Most vectors in a block: at four lanes.
const MOST_PARTS: usize = 4;

/// Draws a tile's triangles and counts the pixels of each.
#[inline(always)]
pub(super) fn draw_tile<S: Simd>(simd: S, tile: &mut Tile, index: usize, shares: &[Share]) {
    tile.clear();
    let mut pieces = shares.iter().flat_map(|share| share.bin(index)).peekable();
    if pieces.peek().is_none() {
        return;
    }
    let mut canvas = Canvas {
        depth: [NO_DEPTH; TILE_PIXELS],
        farthest: [NO_DEPTH; SQUARES_ACROSS * SQUARES_ACROSS],
        lanes: Lanes::new(simd),
        tile,
    };
    for piece in pieces {
        canvas.draw(simd, piece);
    }
    count_owners(simd, tile, shares);
}

/// Columns and rows of a block's pixels, from its corner, a vector for each part of the block.
#[derive(Clone, Copy)]
struct Lanes<S: Simd> {
    column: [S::i32s; MOST_PARTS],
    row: [S::i32s; MOST_PARTS],
}

impl<S: Simd> Lanes<S> {
    /// Vectors of a block.
    #[inline(always)]
    fn parts() -> usize {
        BLOCK_PIXELS / S::i32s::LEN
    }

    #[inline(always)]
    fn new(simd: S) -> Self {
        let iota = S::i32s::from_fn(simd, |i| i as i32);
        let mut lanes = Self {
            column: [iota; MOST_PARTS],
            row: [iota; MOST_PARTS],
        };
        for part in 0..Self::parts() {
            let pixel = iota + (part * S::i32s::LEN) as i32;
            lanes.column[part] = pixel & (BLOCK_SIDE as i32 - 1);
            lanes.row[part] = pixel >> BLOCK_SIDE.trailing_zeros();
        }
        lanes
    }
}

/// A rectangle of blocks, inclusive.
#[derive(Clone, Copy)]
struct BlockRange {
    x0: usize,
    y0: usize,
    x1: usize,
    y1: usize,
}

/// One edge of a piece, in whole pixels.
#[derive(Clone, Copy, Default)]
struct TileEdge {
    /// Value at the tile's first pixel; may be outside of `i32`.
    origin: i64,
    /// Change per pixel to the right.
    dx: i32,
    /// Change per pixel down.
    dy: i32,
}

/// One edge of a piece in some blocks, in whole pixels.
#[derive(Clone, Copy, Default)]
struct BlockEdge {
    /// Value at the first pixel of the first block.
    start: i32,
    /// Change per pixel to the right.
    dx: i32,
    /// Change per pixel down.
    dy: i32,
}

/// The edges of a piece in a tile, of which the first `count` are meant.
#[derive(Clone, Copy)]
struct TileEdges {
    edges: [TileEdge; MOST_EDGES],
    count: usize,
}

impl TileEdges {
    #[inline(always)]
    fn new(piece: &Piece, tile: &Tile) -> Self {
        let mut edges = [TileEdge::default(); MOST_EDGES];
        for i in 0..3 {
            let edge = EdgeFunction::new(piece.corners[i], piece.corners[(i + 1) % 3]);
            edges[i] = TileEdge {
                origin: edge.at_pixel(tile.origin[0], tile.origin[1]) >> SUBPIXEL_BITS,
                dx: edge.a as i32,
                dy: edge.b as i32,
            };
        }
        // The borders of the image, which would not stop a block.
        edges[3] = TileEdge {
            origin: i64::from(tile.width) - 1,
            dx: -1,
            dy: 0,
        };
        edges[4] = TileEdge {
            origin: i64::from(tile.height) - 1,
            dx: 0,
            dy: -1,
        };
        Self {
            edges,
            count: if is_inner(tile) { 3 } else { MOST_EDGES },
        }
    }

    /// Those that some but not all pixels of the blocks violate; `None` if all violate one.
    #[inline(always)]
    fn crossing(&self, range: BlockRange) -> Option<BlockEdges> {
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
struct BlockEdges {
    edges: [BlockEdge; MOST_EDGES],
    count: usize,
}

/// Whether no pixel of the tile is outside of the image.
#[inline(always)]
fn is_inner(tile: &Tile) -> bool {
    tile.width == TILE_SIDE as i32 && tile.height == TILE_SIDE as i32
}

/// The edges of a small piece in the blocks from that on whose first pixel is `(x, y)` of the image; `None` if it is not small.
///
/// An edge shorter than [`SMALL`] along each axis, in sub-pixels, and seen from a pixel less than twice as far from its ends, has
/// values below `4 SMALL^2`.
#[inline(always)]
fn small_edges(piece: &Piece, [x, y]: [i32; 2]) -> Option<[BlockEdge; 3]> {
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

/// A tile that is being drawn.
struct Canvas<'a, S: Simd> {
    tile: &'a mut Tile,
    /// Reversed depth of each pixel, or [`NO_DEPTH`].
    depth: [f32; TILE_PIXELS],
    /// A depth that no pixel of a square is farther than.
    farthest: [f32; SQUARES_ACROSS * SQUARES_ACROSS],
    lanes: Lanes<S>,
}

impl<S: Simd> Canvas<'_, S> {
    #[inline(always)]
    fn draw(&mut self, simd: S, piece: &Piece) {
        let pixels = piece.bounds.within(self.tile.origin);
        let block = |pixel: i32| pixel as usize / BLOCK_SIDE;
        let range = BlockRange {
            x0: block(pixels.x0),
            y0: block(pixels.y0),
            x1: block(pixels.x1),
            y1: block(pixels.y1),
        };
        let blocks = [range.x1 - range.x0, range.y1 - range.y0];
        if blocks[0] < 2 && blocks[1] < 2 && is_inner(self.tile) {
            let [left, top] = [range.x0, range.y0].map(|block| (block * BLOCK_SIDE) as i32);
            let first = [self.tile.origin[0] + left, self.tile.origin[1] + top];
            if let Some(edges) = small_edges(piece, first) {
                self.draw_inside(simd, piece, edges, range);
                return;
            }
        }
        let edges = TileEdges::new(piece, self.tile);
        if blocks[0] < SQUARE_BLOCKS && blocks[1] < SQUARE_BLOCKS {
            if let Some(edges) = edges.crossing(range) {
                self.draw_blocks(simd, piece, &edges, range);
            }
            return;
        }
        for y in range.y0 / SQUARE_BLOCKS..=range.y1 / SQUARE_BLOCKS {
            for x in range.x0 / SQUARE_BLOCKS..=range.x1 / SQUARE_BLOCKS {
                self.draw_square(simd, piece, &edges, range, [x, y]);
            }
        }
    }

    /// Draws what of a large piece is in a square.
    #[inline(always)]
    fn draw_square(
        &mut self,
        simd: S,
        piece: &Piece,
        edges: &TileEdges,
        range: BlockRange,
        [x, y]: [usize; 2],
    ) {
        let square = y * SQUARES_ACROSS + x;
        // What is not strictly nearer loses.
        if piece.depth.max <= self.farthest[square] {
            return;
        }
        let [first_x, first_y] = [x * SQUARE_BLOCKS, y * SQUARE_BLOCKS];
        let inner = BlockRange {
            x0: range.x0.max(first_x),
            y0: range.y0.max(first_y),
            x1: range.x1.min(first_x + SQUARE_BLOCKS - 1),
            y1: range.y1.min(first_y + SQUARE_BLOCKS - 1),
        };
        let Some(edges) = edges.crossing(inner) else {
            return;
        };
        self.draw_blocks(simd, piece, &edges, inner);
        let blocks = (inner.x1 - inner.x0 + 1) * (inner.y1 - inner.y0 + 1);
        if edges.count == 0 && blocks == SQUARE_BLOCKS * SQUARE_BLOCKS {
            let nearest = self.farthest_of(&piece.depth, [first_x, first_y]);
            self.farthest[square] = self.farthest[square].max(nearest);
        }
    }

    /// The least depth of a plane over the pixels of a square. Rounding keeps order, so it is that of a corner.
    #[inline(always)]
    fn farthest_of(&self, depth: &DepthPlane, blocks: [usize; 2]) -> f32 {
        let side = BLOCK_SIDE as i32;
        let [x, y] = [
            self.tile.origin[0] + blocks[0] as i32 * side,
            self.tile.origin[1] + blocks[1] as i32 * side,
        ];
        let last = SQUARE_BLOCKS as i32 * side - 1;
        let corners = [[x, y], [x + last, y], [x, y + last], [x + last, y + last]];
        corners
            .into_iter()
            .map(|[x, y]| depth.at_pixel(x, y))
            .fold(f32::INFINITY, f32::min)
    }

    #[inline(always)]
    fn draw_blocks(
        &mut self,
        simd: S,
        piece: &Piece,
        edges: &BlockEdges,
        range: BlockRange,
    ) {
        let all = &edges.edges;
        match edges.count {
            0 => self.draw_inside(simd, piece, [], range),
            1 => self.draw_inside(simd, piece, [all[0]], range),
            2 => self.draw_inside(simd, piece, [all[0], all[1]], range),
            3 => self.draw_inside(simd, piece, [all[0], all[1], all[2]], range),
            _ => self.draw_inside(simd, piece, *all, range),
        }
    }

    /// Draws the pixels of some blocks that violate none of `N` edges.
    #[inline(always)]
    fn draw_inside<const N: usize>(
        &mut self,
        simd: S,
        piece: &Piece,
        edges: [BlockEdge; N],
        range: BlockRange,
    ) {
        let lanes = self.lanes;
        let (width, parts) = (S::i32s::LEN, Lanes::<S>::parts());
        let side = BLOCK_SIDE as i32;
        let zero = S::i32s::splat(simd, 0);
        // Values at the pixels of the first block of a row of blocks.
        let mut row_values = [[zero; MOST_PARTS]; N];
        for k in 0..N {
            for part in 0..parts {
                row_values[k][part] =
                    lanes.column[part] * edges[k].dx + lanes.row[part] * edges[k].dy + edges[k].start;
            }
        }
        let plane = &piece.depth;
        let slope = S::f32s::splat(simd, plane.dx);
        let (near, far) = (
            S::f32s::splat(simd, plane.max),
            S::f32s::splat(simd, plane.min),
        );
        let slot = S::u32s::splat(simd, piece.slot);
        let left = self.tile.origin[0] + range.x0 as i32 * side - plane.anchor[0];
        let top = self.tile.origin[1] + range.y0 as i32 * side - plane.anchor[1];
        for y in range.y0..=range.y1 {
            let above = top + (y - range.y0) as i32 * side;
            for part in 0..parts {
                let row: S::f32s = (lanes.row[part] + above).to_float();
                let row_depth = row * plane.dy + plane.base;
                let mut column: S::f32s = (lanes.column[part] + left).to_float();
                let mut values = [zero; N];
                for k in 0..N {
                    values[k] = row_values[k][part];
                    row_values[k][part] += edges[k].dy * side;
                }
                for x in range.x0..=range.x1 {
                    let mut signs = zero;
                    for k in 0..N {
                        signs |= values[k];
                        values[k] += edges[k].dx * side;
                    }
                    let inside = signs.simd_ge(zero);
                    let depth = (row_depth + slope * column).max(far).min(near);
                    column += side as f32;
                    let block = y * BLOCKS_ACROSS + x;
                    let at = block * BLOCK_PIXELS + part * width;
                    let stored = S::f32s::from_slice(simd, &self.depth[at..at + width]);
                    let wins = inside & depth.simd_gt(stored);
                    if wins.any_true() {
                        let owner = S::u32s::from_slice(simd, &self.tile.slot[at..at + width]);
                        wins.select(depth, stored)
                            .store_slice(&mut self.depth[at..at + width]);
                        wins.select(slot, owner)
                            .store_slice(&mut self.tile.slot[at..at + width]);
                        self.tile.owned.insert(block);
                    }
                }
            }
        }
    }
}

/// Counts the covered pixels, and those of each triangle.
#[inline(always)]
fn count_owners<S: Simd>(simd: S, tile: &mut Tile, shares: &[Share]) {
    let width = S::u32s::LEN;
    let mut covered = 0;
    // A large triangle fills block after block.
    let (mut last, mut count) = (NO_TRIANGLE, 0);
    for block in tile.owned.iter() {
        for part in 0..BLOCK_PIXELS / width {
            let at = block * BLOCK_PIXELS + part * width;
            let slots = &tile.slot[at..at + width];
            let vector = S::u32s::from_slice(simd, slots);
            let mut left = vector.simd_ne(NO_TRIANGLE).to_bitmask();
            covered += left.count_ones();
            while left != 0 {
                let slot = slots[left.trailing_zeros() as usize];
                let pixels = vector.simd_eq(slot).to_bitmask();
                if slot != last {
                    if count > 0 {
                        add_pixels(shares, last, count);
                    }
                    (last, count) = (slot, 0);
                }
                count += pixels.count_ones();
                left &= !pixels;
            }
        }
    }
    if count > 0 {
        add_pixels(shares, last, count);
    }
    tile.covered = covered;
}
