//! The image in tiles of 64 x 64 pixels, each a block of memory of its own, and each of 16 x 16 blocks of 4 x 4 pixels.
//!
//! A pass hands every tile to exactly one thread as `&mut Tile`, so pixels need neither locks nor atomics and results
//! cannot depend on how many threads there are.
//!
//! **Blocks.** The 16 pixels of a block are consecutive in memory, row by row: one vector of the widest level, a whole number of
//! vectors at the others, and one cache line. Most triangles of a fine mesh are a few pixels wide *and* a few high. They touch one
//! to four blocks, where they would touch as many vectors as they have rows if vectors ran along rows.
//!
//! **What is kept.** Ids and colours persist from pass to pass. Depths do not: while a tile's triangles are drawn they live on
//! the drawing thread's stack, in its first-level cache, and never go to memory. Sets of blocks say where there is anything at all:
//! a block that shows nothing but background, and did so before, is not touched again. Nothing is cleared: a block that no triangle
//! has drawn into yet counts as empty, whatever it holds.
//!
//! Tiles at the right and the bottom may hang over the image; their pixels outside never get a triangle.

use crate::geometry::screen::{MAX_IMAGE_SIDE, PixelBox};

/// Width and height of a tile in pixels.
pub(super) const TILE_SIDE: usize = 64;
/// Pixels of a tile.
pub(super) const TILE_PIXELS: usize = TILE_SIDE * TILE_SIDE;
/// `log2` of [`TILE_SIDE`].
const TILE_BITS: u32 = TILE_SIDE.trailing_zeros();

/// Width and height of a block in pixels.
pub(super) const BLOCK_SIDE: usize = 4;
/// Pixels of a block.
pub(super) const BLOCK_PIXELS: usize = BLOCK_SIDE * BLOCK_SIDE;
/// Blocks side by side in a tile.
pub(super) const BLOCKS_ACROSS: usize = TILE_SIDE / BLOCK_SIDE;

/// Blocks of a tile.
pub(super) const TILE_BLOCKS: usize = BLOCKS_ACROSS * BLOCKS_ACROSS;

/// The id of a pixel that no triangle covers.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// The depth of a pixel that no triangle covers: behind everything, even the far plane (0), so that one comparison
/// decides.
pub(super) const NO_DEPTH: f32 = -1.0;

/// Where the pixel in column `x` and row `y` of a tile is in the tile's arrays.
#[inline(always)]
pub(super) fn pixel_index(x: usize, y: usize) -> usize {
    let block = y / BLOCK_SIDE * BLOCKS_ACROSS + x / BLOCK_SIDE;
    block * BLOCK_PIXELS + y % BLOCK_SIDE * BLOCK_SIDE + x % BLOCK_SIDE
}

/// The column and row of a block's first pixel in its tile.
#[inline(always)]
pub(super) fn block_corner(block: usize) -> [i32; 2] {
    let (column, row) = (block % BLOCKS_ACROSS, block / BLOCKS_ACROSS);
    [(column * BLOCK_SIDE) as i32, (row * BLOCK_SIDE) as i32]
}

/// Some of a tile's blocks, one bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct BlockSet([u64; 4]);

impl BlockSet {
    /// No blocks.
    pub(super) const EMPTY: Self = Self([0; 4]);

    /// Adds blocks of a row, one bit for each column.
    #[inline(always)]
    pub(super) fn insert_row(&mut self, row: usize, columns: u64) {
        let first = row * BLOCKS_ACROSS;
        self.0[first / 64 % 4] |= columns << (first % 64);
    }

    /// The blocks of a row, one bit for each column.
    #[inline(always)]
    pub(super) fn row(self, row: usize) -> u64 {
        let first = row * BLOCKS_ACROSS;
        self.0[first / 64 % 4] >> (first % 64) & ((1 << BLOCKS_ACROSS) - 1)
    }

    /// True when no block is in the set.
    #[inline]
    pub(super) fn is_empty(self) -> bool {
        self.0 == [0; 4]
    }

    /// Blocks of this set that are not in the other.
    #[inline]
    pub(super) fn without(self, other: Self) -> Self {
        Self(std::array::from_fn(|word| self.0[word] & !other.0[word]))
    }

    /// The blocks from number `first` on.
    #[inline]
    pub(super) fn from(self, first: usize) -> Self {
        Self(std::array::from_fn(|word| {
            let skipped = first.saturating_sub(word * 64);
            self.0[word] & u64::MAX.checked_shl(skipped as u32).unwrap_or(0)
        }))
    }

    /// The blocks, ascending.
    #[inline]
    pub(super) fn iter(self) -> impl Iterator<Item = usize> {
        self.0.into_iter().enumerate().flat_map(|(word, mut left)| {
            std::iter::from_fn(move || {
                let bit = left.trailing_zeros() as usize;
                (left != 0).then(|| {
                    left &= left - 1;
                    word * 64 + bit
                })
            })
        })
    }
}

/// 64 x 64 pixels, block after block.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Tile {
    /// The slot of the triangle that owns each pixel of an owned block (see [`shares`](super::shares)), or [`NO_TRIANGLE`]. What
    /// other blocks hold is left from older images.
    pub slot: [u32; TILE_PIXELS],
    /// Encoded colour of each pixel, RGBA from the lowest byte up.
    pub colour: [u32; TILE_PIXELS],
    /// The image pixel in its top left corner.
    pub origin: [i32; 2],
    /// Columns inside the image.
    pub width: i32,
    /// Rows inside the image.
    pub height: i32,
    /// Pixels that have a triangle.
    pub covered: u32,
    /// Blocks in which some pixel has a triangle.
    pub owned: BlockSet,
    /// Blocks that may show something else than the background.
    pub painted: BlockSet,
    /// The encoded background that all other blocks show; `None` before the first image.
    pub background: Option<u32>,
    /// The backend's serial number when `colour` changed last.
    pub serial: u64,
}

impl Tile {
    /// An empty tile.
    pub(super) fn new(grid: Grid, index: usize, serial: u64) -> Self {
        let (column, row) = (index % grid.columns, index / grid.columns);
        let origin = [(column * TILE_SIDE) as i32, (row * TILE_SIDE) as i32];
        let side = TILE_SIDE as i32;
        Self {
            slot: [NO_TRIANGLE; TILE_PIXELS],
            colour: [0; TILE_PIXELS],
            origin,
            width: side.min(grid.width as i32 - origin[0]),
            height: side.min(grid.height as i32 - origin[1]),
            covered: 0,
            owned: BlockSet::default(),
            painted: BlockSet::default(),
            background: None,
            serial,
        }
    }

    /// Notes that no triangle has any pixel.
    pub(super) fn set_empty(&mut self) {
        self.owned = BlockSet::EMPTY;
        self.covered = 0;
    }

    /// The slot of the pixel in column `x` and row `y`, or [`NO_TRIANGLE`].
    pub(super) fn slot_at(&self, x: usize, y: usize) -> u32 {
        if self.owned.row(y / BLOCK_SIDE) >> (x / BLOCK_SIDE) & 1 == 1 {
            self.slot[pixel_index(x, y)]
        } else {
            NO_TRIANGLE
        }
    }

    /// Pixels inside the image.
    pub(super) fn pixels(&self) -> u64 {
        self.width as u64 * self.height as u64
    }
}

/// How an image is cut into tiles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Grid {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Tiles side by side.
    pub columns: usize,
    /// Tiles one above the other.
    pub rows: usize,
}

impl Grid {
    /// The grid of an image, whose sides are cut off at [`MAX_IMAGE_SIDE`].
    pub(super) fn new(width: u32, height: u32) -> Self {
        let (width, height) = (width.min(MAX_IMAGE_SIDE), height.min(MAX_IMAGE_SIDE));
        Self {
            width,
            height,
            columns: (width as usize).div_ceil(TILE_SIDE),
            rows: (height as usize).div_ceil(TILE_SIDE),
        }
    }

    /// Number of tiles.
    pub(super) fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// Indices of the tiles that a box of pixels touches, row by row.
    #[inline]
    pub(super) fn touched(self, b: &Bounds) -> impl Iterator<Item = usize> + use<> {
        let [x0, y0, x1, y1] = [b.x0, b.y0, b.x1, b.y1].map(|v| usize::from(v >> TILE_BITS));
        (y0..=y1).flat_map(move |y| (x0..=x1).map(move |x| y * self.columns + x))
    }
}

/// An inclusive range of pixels of the image, in half the memory of a `PixelBox`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Bounds {
    /// First column.
    pub x0: u16,
    /// First row.
    pub y0: u16,
    /// Last column.
    pub x1: u16,
    /// Last row.
    pub y1: u16,
}

impl From<PixelBox> for Bounds {
    fn from(b: PixelBox) -> Self {
        // Pixel boxes lie inside the image, whose sides fit 16 bits.
        let [x0, y0, x1, y1] = [b.x0, b.y0, b.x1, b.y1].map(|v| v as u16);
        Self { x0, y0, x1, y1 }
    }
}

impl Bounds {
    /// The top left pixel.
    pub(super) fn anchor(&self) -> [i32; 2] {
        [i32::from(self.x0), i32::from(self.y0)]
    }

    /// Whether all pixels are in the same tile.
    #[inline(always)]
    pub(super) fn is_in_one_tile(&self) -> bool {
        (self.x0 >> TILE_BITS, self.y0 >> TILE_BITS) == (self.x1 >> TILE_BITS, self.y1 >> TILE_BITS)
    }

    /// The pixels inside a tile, counted from its corner; it must be one that the box touches.
    #[inline(always)]
    pub(super) fn within(&self, origin: [i32; 2]) -> TileBox {
        let last = TILE_SIDE as i32 - 1;
        TileBox {
            x0: (i32::from(self.x0) - origin[0]).max(0),
            y0: (i32::from(self.y0) - origin[1]).max(0),
            x1: (i32::from(self.x1) - origin[0]).min(last),
            y1: (i32::from(self.y1) - origin[1]).min(last),
        }
    }
}

/// An inclusive range of pixels of a tile, counted from the tile's corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct TileBox {
    /// First column.
    pub x0: i32,
    /// First row.
    pub y0: i32,
    /// Last column.
    pub x1: i32,
    /// Last row.
    pub y1: i32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_the_image_and_border_tiles_hang_over() {
        let grid = Grid::new(130, 64);
        let tiles: Vec<_> = (0..grid.len()).map(|i| Tile::new(grid, i, 0)).collect();
        assert_eq!((grid.columns, grid.rows, tiles.len()), (3, 1, 3));
        assert_eq!(tiles.iter().map(Tile::pixels).sum::<u64>(), 130 * 64);
        assert_eq!((tiles[2].origin, tiles[2].width), ([128, 0], 2));
        assert_eq!(Grid::new(0, 10).len(), 0);
    }

    #[test]
    fn a_box_touches_the_tiles_it_overlaps() {
        let grid = Grid::new(300, 200);
        let b = Bounds {
            x0: 63,
            y0: 64,
            x1: 128,
            y1: 127,
        };
        assert_eq!(grid.touched(&b).collect::<Vec<_>>(), [5, 6, 7]);
        let inside = b.within([64, 64]);
        assert_eq!([inside.x0, inside.y0, inside.x1, inside.y1], [0, 0, 63, 63]);
    }
}
