//! Coverage and depth of one tile, in lanes.
//!
//! Edge functions are exact. An edge value `E` changes by a multiple of 256 sub-pixel units from pixel to pixel, so
//! `E >= 0` exactly where `E >> 8 >= 0` (the shift rounds down): `E` is found once per piece and tile in `i64`, shifted, and goes
//! on in `i32`. The step per pixel is then the edge's extent in sub-pixels, at most `2^23` along each axis by the guard band. An edge
//! that no pixel of the blocks in question violates is left out; if every pixel violates one, so are the blocks. Any other changes
//! its sign within 64 x 64 pixels, hence is nowhere larger than `63 * 2^24 < 2^30`: `i32` does not overflow.
//!
//! A [small](small_edges) piece that touches few blocks, in a tile that does not hang over the image, needs no such
//! questions: all numbers are small, and every block is tried. Others go through **rows of blocks**: for all blocks of a row at once, lanes tell
//! which of them an edge rules out, which lie inside of all edges, and in which the piece nowhere comes nearer than what is there
//! already. The latter is known by a depth for each block that none of its pixels is farther than. It rises when a piece covers
//! the block without a gap, which is what large occluders do.
//!
//! Depth is [`DepthPlane::at_pixel`](crate::geometry::screen::DepthPlane::at_pixel): products and sums rounded one by one, never fused. Rounding keeps order, so over the pixels of
//! a block it is least and largest at corners.
//! Pieces come in ascending order of slots, hence of ids, so "strictly nearer wins" leaves the smaller id in front at equal depth.

#![expect(
    clippy::needless_range_loop,
    reason = "loops run over several arrays of lanes at once"
)]

use super::brush::{Brush, MOST_PARTS, PixelPlaces};
use super::drawing::{Desk, Drawing, Next, Unfinished};
use super::edges::{BlockEdge, BlockRange, TileEdges, is_inner, small_edges};
use super::owners;
use super::setup::Piece;
use super::shares::Share;
use super::tile::{
    BLOCK_PIXELS, BLOCK_SIDE, BLOCKS_ACROSS, BlockSet, NO_DEPTH, NO_TRIANGLE, TILE_BLOCKS,
    TILE_PIXELS, Tile,
};
use crate::simd::Simd;
use fearless_simd::{Select, SimdBase, SimdInt, SimdMask};

/// A small piece touches at most so many blocks along each axis: they are tried one by one in less time than it takes to find
/// out which of them have a pixel. Of 3, 4, 5 and 7 measured, the last was fastest: frames of triangles of
/// 15 pixels took about 9 % less time than with 3.
const SMALL_BLOCKS: usize = 7;

/// What is drawn of a tile in one go, in [`effort`](Canvas::effort): about 10 microseconds.
const EFFORT_AT_ONCE: usize = 2048;

/// Effort of a piece besides its blocks.
const EFFORT_OF_PIECE: usize = 8;

/// Draws a tile's triangles and counts the pixels of each, or goes on with it, until it is told to stop.
#[inline(always)]
pub(super) fn draw_tile<S: Simd>(
    simd: S,
    tile: &mut Tile,
    index: usize,
    shares: &[Share],
    drawing: &mut Drawing,
    desk: &Desk<'_>,
) {
    let mut canvas = Canvas {
        depth: [NO_DEPTH; TILE_PIXELS],
        slot: [NO_TRIANGLE; TILE_PIXELS],
        farthest: [NO_DEPTH; TILE_BLOCKS],
        owned: BlockSet::default(),
        origin: tile.origin,
        size: [tile.width, tile.height],
        places: PixelPlaces::new(simd),
        effort: 0,
    };
    let mut next = Next::default();
    if let Drawing::Unfinished(unfinished) = drawing {
        canvas.take_up(unfinished);
        next = unfinished.next;
    }
    while let Some(share) = shares.get(next.share) {
        let bin = share.bin(index);
        for &entry in &bin[next.entry..] {
            canvas.draw(simd, &share.pieces[entry as usize]);
            next.entry += 1;
            if canvas.effort >= EFFORT_AT_ONCE {
                canvas.effort = 0;
                if !desk.watch.may_go_on() {
                    if let Some(unfinished) = drawing.set_aside(desk) {
                        canvas.leave(unfinished);
                        unfinished.next = next;
                    }
                    return;
                }
            }
        }
        next = Next {
            share: next.share + 1,
            entry: 0,
        };
    }
    owners::hand_over(simd, &canvas.slot, canvas.owned, tile, shares);
    drawing.finish(desk);
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
    places: PixelPlaces<S>,
    /// About what has been done: the number of blocks looked at, and [`EFFORT_OF_PIECE`] for each piece.
    effort: usize,
}

impl<S: Simd> Canvas<S> {
    /// Goes on with a tile that was set aside.
    fn take_up(&mut self, unfinished: &Unfinished) {
        self.depth.copy_from_slice(&unfinished.depth);
        self.slot.copy_from_slice(&unfinished.slot);
        self.farthest.copy_from_slice(&unfinished.farthest);
        self.owned = unfinished.owned;
    }

    /// Keeps what there is of a tile that is set aside.
    #[cold]
    fn leave(&self, unfinished: &mut Unfinished) {
        unfinished.depth.copy_from_slice(&self.depth);
        unfinished.slot.copy_from_slice(&self.slot);
        unfinished.farthest.copy_from_slice(&self.farthest);
        unfinished.owned = self.owned;
    }

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
        self.effort += (range.x1 - range.x0 + 1) * (range.y1 - range.y0 + 1) + EFFORT_OF_PIECE;
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
        let brush = Brush::new(simd, &self.places, piece, edges, self.origin);
        let (side, parts) = (BLOCK_SIDE as i32, PixelPlaces::<S>::parts());
        let zero = S::i32s::splat(simd, 0);
        let mut row_values = brush.inside_block;
        let mut columns = [S::f32s::splat(simd, 0.0); MOST_PARTS];
        for part in 0..parts {
            for k in 0..3 {
                row_values[k][part] += edges[k].start;
            }
            columns[part] = (self.places.column[part] + brush.column(range.x0)).to_float();
        }
        for y in range.y0..=range.y1 {
            let row_depths = brush.row_depths(simd, &self.places, y);
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

    /// Draws those pixels of some blocks that violate none of `N` edges, row of blocks by row of blocks. (One function, since all of
    /// its loops work on the same values.)
    #[inline(always)]
    fn draw_rows<const N: usize>(
        &mut self,
        simd: S,
        piece: &Piece,
        edges: [BlockEdge; N],
        range: BlockRange,
    ) {
        let (width, side) = (S::i32s::LEN, BLOCK_SIDE as i32);
        let brush = Brush::new(simd, &self.places, piece, edges, self.origin);
        for y in range.y0..=range.y1 {
            let row_depths = brush.row_depths(simd, &self.places, y);
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
                        corner[k] += (right + bit as i32 * side) * edges[k].dx;
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
        for part in 0..PixelPlaces::<S>::parts() {
            let column: S::f32s = (self.places.column[part] + brush.column(x)).to_float();
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
        for part in 0..PixelPlaces::<S>::parts() {
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
