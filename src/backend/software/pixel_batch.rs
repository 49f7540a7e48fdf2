//! Pixels of a patch collected into full vectors, coloured, and put back where they came from.
//!
//! A block of a small patch has few pixels, and colours are dear. So a batch of pixels that may belong to the patch
//! is collected from all its blocks first, one behind the other without gaps; then weights, the test of
//! ownership, colours and encoding run on full vectors; then the colours go back. What a lane
//! gets does not depend on its neighbours, hence not on the width of vectors.

use super::fill::PatchFill;
use super::lanes::weights_at;
use super::patch::{MAX_LANES, PatchEdges, Rows};
use super::tile::{
    BLOCK_PIXELS, BLOCK_SIDE, BLOCKS_ACROSS, TILE_SIDE, Tile, TileBox, block_corner,
};
use crate::geometry::screen::Interpolator;
use crate::output::Encoding;
use crate::output::encode::encode_lanes;
use crate::simd::Simd;
use fearless_simd::{Bytes, Select, SimdBase, SimdInt, SimdMask};

/// A bit for each pixel of a block.
const ALL_PIXELS: u32 = (1 << BLOCK_PIXELS) - 1;

/// Pixels of a batch, at most: as many as keep it in the first-level cache, cheap to clear.
const BATCH: usize = 256;

/// The colour of a pixel of a batch that does not belong to the patch. Painted ones are opaque.
const NOT_PAINTED: u32 = 0;

/// How far a patch has been searched for pixels: block after block, along rows of blocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    /// First and last row of pixels.
    rows: [usize; 2],
    /// The row of blocks.
    block_row: usize,
    /// The next block in it, and the one behind the last.
    next: usize,
    end: usize,
    /// The blocks in it, as the first and the one behind the last, all pixels of which are to be looked at.
    full: [usize; 2],
}

impl Search {
    #[inline(always)]
    pub(super) fn new(pixels: TileBox, rows: &Rows) -> Self {
        let [y0, y1] = [pixels.y0 as usize, pixels.y1 as usize];
        let mut search = Self {
            rows: [y0, y1],
            block_row: y0 / BLOCK_SIDE,
            next: 0,
            end: 0,
            full: [0; 2],
        };
        search.enter_row(rows);
        search
    }

    /// Whether there may be more pixels.
    #[inline(always)]
    pub(super) fn is_open(&self) -> bool {
        self.block_row <= self.rows[1] / BLOCK_SIDE
    }

    /// First and last row of pixels that are in the row of blocks.
    #[inline(always)]
    fn rows_here(&self) -> [usize; 2] {
        let top = self.block_row * BLOCK_SIDE;
        [
            self.rows[0].max(top),
            self.rows[1].min(top + BLOCK_SIDE - 1),
        ]
    }

    #[inline(always)]
    fn enter_row(&mut self, rows: &Rows) {
        let [y0, y1] = self.rows_here();
        [self.next, self.end] = rows.blocks(y0, y1);
        self.full = rows.full_blocks(y0, y1);
    }

    #[inline(always)]
    fn next_row(&mut self, rows: &Rows) {
        self.block_row += 1;
        if self.is_open() {
            self.enter_row(rows);
        }
    }
}

/// The columns and rows of pixels in their tile, given by their indices: the inverse of
/// [`pixel_index`](super::tile::pixel_index).
#[inline(always)]
fn place_of_index<S: Simd>(index: S::i32s) -> [S::i32s; 2] {
    let block_bits = BLOCK_PIXELS.trailing_zeros();
    let side_bits = BLOCK_SIDE.trailing_zeros();
    let in_block = BLOCK_SIDE as i32 - 1;
    let of_blocks = TILE_SIDE as i32 - BLOCK_SIDE as i32;
    let column = ((index >> (block_bits - side_bits)) & of_blocks) | (index & in_block);
    let across_bits = BLOCKS_ACROSS.trailing_zeros();
    let row = ((index >> (block_bits + across_bits - side_bits)) & of_blocks)
        | ((index >> side_bits) & in_block);
    [column, row]
}

/// Some lanes of consecutive pixels of a block.
#[derive(Clone, Copy, Debug, Default)]
struct Chunk {
    /// Index in the tile of the first lane.
    at: u16,
    /// One bit for each lane.
    lanes: u16,
}

/// Pixels of a tile that may belong to a patch.
#[derive(Clone, Debug)]
pub(super) struct Batch {
    /// Where they are.
    chunks: [Chunk; BATCH],
    chunks_len: usize,
    /// Their indices in the tile, chunk after chunk.
    index: [u32; BATCH + MAX_LANES],
    len: usize,
    /// Their encoded colours, or [`NOT_PAINTED`].
    colour: [u32; BATCH + MAX_LANES],
}

impl Batch {
    pub(super) fn new() -> Self {
        Self {
            chunks: [Chunk::default(); BATCH],
            chunks_len: 0,
            index: [0; BATCH + MAX_LANES],
            len: 0,
            colour: [NOT_PAINTED; BATCH + MAX_LANES],
        }
    }

    /// Starts anew with the next pixels of the triangle that has the slot, until there are no more or the batch is full.
    #[inline(always)]
    pub(super) fn collect<S: Simd>(
        &mut self,
        simd: S,
        tile: &Tile,
        slot: u32,
        rows: &Rows,
        search: &mut Search,
    ) {
        let lanes = S::u32s::LEN;
        let iota = S::u32s::from_fn(simd, |i| i as u32);
        let slot = S::u32s::splat(simd, slot);
        let (mut len, mut chunks_len) = (0, 0);
        while search.is_open() {
            let [y0, y1] = search.rows_here();
            let owned = tile.owned.row(search.block_row);
            while search.next < search.end {
                if len + BLOCK_PIXELS > BATCH {
                    (self.len, self.chunks_len) = (len, chunks_len);
                    return;
                }
                let column = search.next;
                search.next += 1;
                if owned >> column & 1 == 0 {
                    continue;
                }
                let block = search.block_row * BLOCKS_ACROSS + column;
                let within = if (search.full[0]..search.full[1]).contains(&column) {
                    ALL_PIXELS
                } else {
                    rows.within_block(block_corner(block), y0, y1)
                };
                for part in 0..BLOCK_PIXELS / lanes {
                    let at = block * BLOCK_PIXELS + part * lanes;
                    let slots = S::u32s::from_slice(simd, &tile.slot[at..at + lanes]);
                    let bits =
                        slots.simd_eq(slot).to_bitmask() & u64::from(within >> (part * lanes));
                    if bits == 0 {
                        continue;
                    }
                    let mask = S::mask32s::from_bitmask(simd, bits);
                    let index = (iota + at as u32).compress(mask);
                    index.store_slice(&mut self.index[len..len + lanes]);
                    self.chunks[chunks_len] = Chunk {
                        at: at as u16,
                        lanes: bits as u16,
                    };
                    chunks_len += 1;
                    len += bits.count_ones() as usize;
                }
            }
            search.next_row(rows);
        }
        (self.len, self.chunks_len) = (len, chunks_len);
    }

    /// Colours the pixels that belong to the patch, and counts them.
    #[inline(always)]
    pub(super) fn colour<S: Simd>(
        &mut self,
        simd: S,
        encoding: Encoding,
        origin: [i32; 2],
        planes: &Interpolator,
        edges: Option<&PatchEdges>,
        fill: &impl PatchFill,
    ) -> u32 {
        let lanes = S::u32s::LEN;
        let offset = [origin[0] - planes.anchor[0], origin[1] - planes.anchor[1]];
        let iota = S::i32s::from_fn(simd, |i| i as i32);
        let mut painted = 0;
        for at in (0..self.len).step_by(lanes) {
            let index = S::u32s::from_slice(simd, &self.index[at..at + lanes]);
            let index: S::i32s = index.bitcast();
            let [column, row] = place_of_index::<S>(index);
            let dx = (column + offset[0]).to_float();
            let dy = (row + offset[1]).to_float();
            let w = weights_at(simd, planes, dx, dy);
            let mut mask = iota.simd_lt((self.len - at) as i32);
            if let Some(edges) = edges {
                mask &= edges.signs(simd, w).simd_ge(0);
            }
            let bits = mask.to_bitmask();
            let mut colour = S::u32s::splat(simd, NOT_PAINTED);
            // Rare, except where the slack says nothing and a large triangle is searched for a small patch.
            if bits != 0 {
                colour = mask.select(encode_lanes(simd, encoding, fill.colours(simd, w)), colour);
            }
            colour.store_slice(&mut self.colour[at..at + lanes]);
            painted += bits.count_ones();
        }
        painted
    }

    /// Paints the tile and says where that changed it.
    #[inline(always)]
    pub(super) fn put_back<S: Simd>(&self, simd: S, tile: &mut Tile) -> S::mask32s {
        let lanes = S::u32s::LEN;
        let mut changed = S::mask32s::splat(simd, false);
        let mut next = 0;
        for chunk in &self.chunks[..self.chunks_len] {
            let at = usize::from(chunk.at);
            let mask = S::mask32s::from_bitmask(simd, u64::from(chunk.lanes));
            let colour = S::u32s::from_slice(simd, &self.colour[next..next + lanes]).expand(mask);
            let stored = S::u32s::from_slice(simd, &tile.colour[at..at + lanes]);
            let colour = colour.simd_ne(NOT_PAINTED).select(colour, stored);
            changed |= colour.simd_ne(stored);
            colour.store_slice(&mut tile.colour[at..at + lanes]);
            next += chunk.lanes.count_ones() as usize;
        }
        changed
    }
}
