//! Coverage and depth of one tile, in lanes.
//!
//! Edge functions are exact. An edge value `E` changes by a multiple of 256 sub-pixel units from pixel to pixel, so
//! `E >= 0` exactly where `E >> 8 >= 0` (the shift rounds down): `E` is found once per piece and tile in `i64`, shifted, and goes
//! on in `i32`. The step per pixel is then the edge's extent in sub-pixels, below `2^23` along each axis by the guard band. An edge
//! that no pixel of the blocks in question violates is left out; if every pixel violates one, so are the blocks. Any other changes
//! its sign within 64 x 64 pixels, hence is nowhere larger than `63 * 2^24 < 2^30`: `i32` does not overflow.
//!
//! A **small** piece, whose edges are shorter than [`SMALL`] and which touches at most
//! 3 x 3 blocks, needs no such questions: all
//! numbers are small, and every block is tried. Others go through **rows of blocks**: for all blocks of a row at once, lanes tell
//! which of them an edge rules out, which lie inside of all edges, and in which the piece nowhere comes nearer than what is there
//! already. The latter is known by a depth for each block that none of its pixels is farther than. It rises when a piece covers
//! the block without a gap, which is what large occluders do.
//!
//! Depth is [`DepthPlane::at_pixel`]: products and sums rounded one by one, never fused. Rounding keeps order, so over the pixels of
//! a block it is least and largest at corners.
//! Pieces come in ascending order of slots, hence of ids, so "strictly nearer wins" leaves the smaller id in front at equal depth.

#![expect(
    clippy::needless_range_loop,
    reason = "loops run over several arrays of lanes at once"
)]

use super::setup::Piece;
use super::shares::{Share, add_pixels};
use super::tile::{
    BLOCK_PIXELS, BLOCK_SIDE, BLOCKS_ACROSS, BlockSet, NO_DEPTH, NO_TRIANGLE, TILE_BLOCKS,
    TILE_PIXELS, TILE_SIDE, Tile,
};
use crate::geometry::screen::{DepthPlane, EdgeFunction, SUBPIXEL_BITS};
use crate::simd::Simd;
use fearless_simd::{Select, SimdBase, SimdInt, SimdMask};

/// Three edges, and the right and the lower border of the image.
const MOST_EDGES: usize = 5;

/// A small piece touches at most so many blocks along each axis: they are tried one by one in less time than it takes to find
/// out which of them have a pixel.
const SMALL_BLOCKS: usize = 3;

/// A small piece's edges are shorter than this along both axes, in sub-pixels, so that their values fit `i32` wherever it is drawn.
const SMALL: i32 = 16 << SUBPIXEL_BITS;

/// Most vectors in a block: at four lanes.
const MOST_PARTS: usize = 4;

/// Draws a tile's triangles and counts the pixels of each.
#[inline(always)]
pub(super) fn draw_tile<S: Simd>(simd: S, tile: &mut Tile, index: usize, shares: &[Share]) {
    tile.owned = BlockSet::default();
    tile.covered = 0;
    let mut pieces = shares.iter().flat_map(|share| share.bin(index)).peekable();
    if pieces.peek().is_none() {
        return;
    }
    let mut canvas = Canvas {
        depth: [NO_DEPTH; TILE_PIXELS],
        slot: [NO_TRIANGLE; TILE_PIXELS],
        farthest: [NO_DEPTH; TILE_BLOCKS],
        owned: BlockSet::default(),
        origin: tile.origin,
        size: [tile.width, tile.height],
        lanes: Lanes::new(simd),
    };
    for piece in pieces {
        canvas.draw(simd, piece);
    }
    hand_over(simd, &canvas, tile, shares);
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

impl BlockRange {
    /// Those of 64 columns from `first` on that are in the range, one bit each.
    #[inline(always)]
    fn columns_from(&self, first: usize) -> u64 {
        let from_start = u64::MAX << self.x0.saturating_sub(first);
        from_start & (u64::MAX >> (63 - (self.x1 - first)))
    }
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
    fn new(piece: &Piece, origin: [i32; 2], size: [i32; 2]) -> Self {
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

/// Whether no pixel of a tile is outside of the image, given how many columns and rows are inside.
#[inline(always)]
fn is_inner(size: [i32; 2]) -> bool {
    size == [TILE_SIDE as i32; 2]
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

/// What drawing the blocks of a piece takes, under `N` edges.
struct Brush<S: Simd, const N: usize> {
    edges: [BlockEdge; N],
    /// Of each edge, the difference of the value at a pixel of a block from that at the block's first.
    inside_block: [[S::i32s; MOST_PARTS]; N],
    plane: DepthPlane,
    slot: S::u32s,
    /// The tile's first pixel, from the depth's anchor.
    from_anchor: [i32; 2],
}

impl<S: Simd, const N: usize> Brush<S, N> {
    #[inline(always)]
    fn new(
        simd: S,
        lanes: &Lanes<S>,
        piece: &Piece,
        edges: [BlockEdge; N],
        origin: [i32; 2],
    ) -> Self {
        let mut inside_block = [[S::i32s::splat(simd, 0); MOST_PARTS]; N];
        for k in 0..N {
            for part in 0..Lanes::<S>::parts() {
                inside_block[k][part] =
                    lanes.column[part] * edges[k].dx + lanes.row[part] * edges[k].dy;
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
    fn column(&self, x: usize) -> i32 {
        self.from_anchor[0] + (x * BLOCK_SIDE) as i32
    }

    /// The first row of a block, from the depth's anchor.
    #[inline(always)]
    fn row(&self, y: usize) -> i32 {
        self.from_anchor[1] + (y * BLOCK_SIDE) as i32
    }

    /// The part of the depth that depends on the row, for the pixels of a block.
    #[inline(always)]
    fn row_depths(&self, simd: S, lanes: &Lanes<S>, y: usize) -> [S::f32s; MOST_PARTS] {
        let mut depths = [S::f32s::splat(simd, 0.0); MOST_PARTS];
        for part in 0..Lanes::<S>::parts() {
            let row: S::f32s = (lanes.row[part] + self.row(y)).to_float();
            depths[part] = row * self.plane.dy + self.plane.base;
        }
        depths
    }

    /// Depths in the columns given from the anchor, given the part that depends on the row.
    #[inline(always)]
    fn depths(&self, simd: S, row_depth: S::f32s, column: S::f32s) -> S::f32s {
        let depth = row_depth + column * self.plane.dx;
        let (near, far) = (self.plane.max, self.plane.min);
        depth
            .max(S::f32s::splat(simd, far))
            .min(S::f32s::splat(simd, near))
    }

    /// For a vector of blocks of a row, the first of them in column `x` of the tile: the least and the largest depth of each.
    #[inline(always)]
    fn depth_ranges(&self, simd: S, [x, y]: [usize; 2]) -> [S::f32s; 2] {
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
    fn inside(&self, simd: S, corner: &[i32; N]) -> [S::mask32s; MOST_PARTS] {
        let zero = S::i32s::splat(simd, 0);
        let mut inside = [S::mask32s::splat(simd, true); MOST_PARTS];
        for part in 0..Lanes::<S>::parts() {
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
    fn coverage(&self, simd: S, values: &[i32; N], right: i32) -> [S::mask32s; 2] {
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

/// A tile that is being drawn, on the stack of the thread that draws it and in its caches: waiting for the tile's own memory
/// would take longer than drawing.
struct Canvas<S: Simd> {
    /// Reversed depth of each pixel, or [`NO_DEPTH`].
    depth: [f32; TILE_PIXELS],
    /// The slot of the triangle that owns each pixel, or [`NO_TRIANGLE`].
    slot: [u32; TILE_PIXELS],
    /// A depth that no pixel of a block is farther than.
    farthest: [f32; TILE_BLOCKS],
    /// Blocks in which some pixel has a triangle.
    owned: BlockSet,
    /// The image pixel in the top left corner.
    origin: [i32; 2],
    /// Columns and rows inside the image.
    size: [i32; 2],
    lanes: Lanes<S>,
}

impl<S: Simd> Canvas<S> {
    #[inline(always)]
    fn draw(&mut self, simd: S, piece: &Piece) {
        let pixels = piece.bounds.within(self.origin);
        let block = |pixel: i32| pixel as usize / BLOCK_SIDE;
        let range = BlockRange {
            x0: block(pixels.x0),
            y0: block(pixels.y0),
            x1: block(pixels.x1),
            y1: block(pixels.y1),
        };
        let is_small = range.x1 - range.x0 < SMALL_BLOCKS && range.y1 - range.y0 < SMALL_BLOCKS;
        if is_small && is_inner(self.size) {
            let [left, top] = [range.x0, range.y0].map(|block| (block * BLOCK_SIDE) as i32);
            let first = [self.origin[0] + left, self.origin[1] + top];
            if let Some(edges) = small_edges(piece, first) {
                self.draw_each(simd, piece, edges, range);
                return;
            }
        }
        let Some(crossing) = TileEdges::new(piece, self.origin, self.size).crossing(range) else {
            return;
        };
        let all = &crossing.edges;
        match crossing.count {
            0 => self.draw_rows(simd, piece, [], range),
            1 => self.draw_rows(simd, piece, [all[0]], range),
            2 => self.draw_rows(simd, piece, [all[0], all[1]], range),
            3 => self.draw_rows(simd, piece, [all[0], all[1], all[2]], range),
            _ => self.draw_rows(simd, piece, *all, range),
        }
    }

    /// Draws those pixels of a few blocks that violate none of a small piece's edges. What changes from block to block is kept in
    /// lanes and stepped.
    #[inline(always)]
    fn draw_each(&mut self, simd: S, piece: &Piece, edges: [BlockEdge; 3], range: BlockRange) {
        let brush = Brush::new(simd, &self.lanes, piece, edges, self.origin);
        let (side, parts) = (BLOCK_SIDE as i32, Lanes::<S>::parts());
        let zero = S::i32s::splat(simd, 0);
        let mut row_values = brush.inside_block;
        let mut columns = [S::f32s::splat(simd, 0.0); MOST_PARTS];
        for part in 0..parts {
            for k in 0..3 {
                row_values[k][part] += edges[k].start;
            }
            columns[part] = (self.lanes.column[part] + brush.column(range.x0)).to_float();
        }
        for y in range.y0..=range.y1 {
            let row_depths = brush.row_depths(simd, &self.lanes, y);
            let mut owned = self.owned.row(y);
            let (mut values, mut columns) = (row_values, columns);
            for x in range.x0..=range.x1 {
                let mut inside = [S::mask32s::splat(simd, true); MOST_PARTS];
                let mut depths = columns;
                for part in 0..parts {
                    let mut signs = zero;
                    for k in 0..3 {
                        signs |= values[k][part];
                        values[k][part] += edges[k].dx * side;
                    }
                    inside[part] = signs.simd_ge(zero);
                    depths[part] = brush.depths(simd, row_depths[part], columns[part]);
                    columns[part] += side as f32;
                }
                self.put(simd, brush.slot, [x, y], inside, depths, &mut owned);
            }
            self.owned.insert_row(y, owned);
            for k in 0..3 {
                for part in 0..parts {
                    row_values[k][part] += edges[k].dy * side;
                }
            }
        }
    }

    /// Draws those pixels of some blocks that violate none of `N` edges, row of blocks by row of blocks.
    #[inline(always)]
    fn draw_rows<const N: usize>(
        &mut self,
        simd: S,
        piece: &Piece,
        edges: [BlockEdge; N],
        range: BlockRange,
    ) {
        let (width, side) = (S::i32s::LEN, BLOCK_SIDE as i32);
        let brush = Brush::new(simd, &self.lanes, piece, edges, self.origin);
        for y in range.y0..=range.y1 {
            let row_depths = brush.row_depths(simd, &self.lanes, y);
            let below = (y - range.y0) as i32 * side;
            let mut values = [0; N];
            for k in 0..N {
                values[k] = edges[k].start + below * edges[k].dy;
            }
            for first in ((range.x0 & !(width - 1))..=range.x1).step_by(width) {
                let right = (first as i32 - range.x0 as i32) * side;
                let [some, all] = brush.coverage(simd, &values, right);
                let [least, most] = brush.depth_ranges(simd, [first, y]);
                let at = y * BLOCKS_ACROSS + first;
                let farthest = S::f32s::from_slice(simd, &self.farthest[at..at + width]);
                // What is nowhere strictly nearer loses.
                let drawn =
                    (some & most.simd_gt(farthest)).to_bitmask() & range.columns_from(first);
                let full = all.to_bitmask() & drawn;
                if full != 0 {
                    let filled = S::mask32s::from_bitmask(simd, full);
                    filled
                        .select(least.max(farthest), farthest)
                        .store_slice(&mut self.farthest[at..at + width]);
                }
                let mut owned = self.owned.row(y);
                // One kind after the other, so that branches can be predicted.
                let mut left = drawn & !full;
                while left != 0 {
                    let bit = left.trailing_zeros() as usize;
                    left &= left - 1;
                    let mut corner = values;
                    for k in 0..N {
                        corner[k] += (right + bit as i32 * side).wrapping_mul(edges[k].dx);
                    }
                    let place = [first + bit, y];
                    let inside = brush.inside(simd, &corner);
                    self.draw_block(simd, &brush, &row_depths, place, inside, &mut owned);
                }
                let mut left = full;
                while left != 0 {
                    let bit = left.trailing_zeros() as usize;
                    left &= left - 1;
                    let place = [first + bit, y];
                    let inside = [S::mask32s::splat(simd, true); MOST_PARTS];
                    self.draw_block(simd, &brush, &row_depths, place, inside, &mut owned);
                }
                self.owned.insert_row(y, owned);
            }
        }
    }

    /// Draws a block's pixels that are inside of the triangle.
    #[inline(always)]
    fn draw_block<const N: usize>(
        &mut self,
        simd: S,
        brush: &Brush<S, N>,
        row_depths: &[S::f32s; MOST_PARTS],
        [x, y]: [usize; 2],
        inside: [S::mask32s; MOST_PARTS],
        owned: &mut u64,
    ) {
        let mut depths = *row_depths;
        for part in 0..Lanes::<S>::parts() {
            let column: S::f32s = (self.lanes.column[part] + brush.column(x)).to_float();
            depths[part] = brush.depths(simd, row_depths[part], column);
        }
        self.put(simd, brush.slot, [x, y], inside, depths, owned);
    }

    /// Gives a triangle those of a block's pixels that are inside of it and where it is nearest, and sets the block's bit in the
    /// row's if there are any. Without a branch: whether there are cannot be predicted on a fine mesh.
    #[inline(always)]
    fn put(
        &mut self,
        simd: S,
        slot: S::u32s,
        [x, y]: [usize; 2],
        inside: [S::mask32s; MOST_PARTS],
        depths: [S::f32s; MOST_PARTS],
        owned: &mut u64,
    ) {
        let width = S::i32s::LEN;
        let first = (y * BLOCKS_ACROSS + x) * BLOCK_PIXELS;
        let nothing = S::f32s::splat(simd, NO_DEPTH);
        let mut any = 0;
        for part in 0..Lanes::<S>::parts() {
            let at = first + part * width;
            let depth = &mut self.depth[at..at + width];
            let owner = &mut self.slot[at..at + width];
            let stored = S::f32s::from_slice(simd, depth);
            // A maximum, since compilers make a masked store of a selection, which some processors take ten times as long for.
            let offered = inside[part].select(depths[part], nothing);
            let wins = offered.simd_gt(stored);
            stored.max(offered).store_slice(depth);
            let old = S::u32s::from_slice(simd, owner);
            wins.select(slot, old).store_slice(owner);
            any |= u64::from(wins.any_true());
        }
        *owned |= any << x;
    }
}

/// Copies the owned blocks to the tile, and counts the covered pixels and those of each triangle.
#[inline(always)]
fn hand_over<S: Simd>(simd: S, canvas: &Canvas<S>, tile: &mut Tile, shares: &[Share]) {
    let width = S::u32s::LEN;
    let mut covered = 0;
    // A large triangle fills block after block.
    let (mut last, mut count) = (NO_TRIANGLE, 0);
    for block in canvas.owned.iter() {
        for part in 0..BLOCK_PIXELS / width {
            let at = block * BLOCK_PIXELS + part * width;
            let slots = &canvas.slot[at..at + width];
            let vector = S::u32s::from_slice(simd, slots);
            vector.store_slice(&mut tile.slot[at..at + width]);
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
    tile.owned = canvas.owned;
}
