//! Copies of the image into targets.
//!
//! A target says which writer filled it and when. Every tile knows when it changed last; so a target of ours lacks
//! exactly the tiles that changed after its stamp, and any other target lacks all.

use super::tile::{BLOCK_PIXELS, BLOCK_SIDE, BLOCKS_ACROSS, Grid, TILE_SIDE, Tile};
use crate::output::target::PIXEL_BYTES;
use crate::output::{ChannelOrder, Rect, Stamp, Target};
use crate::parallel::Exec;

/// Bytes of a row of a block.
const BLOCK_ROW_BYTES: usize = BLOCK_SIDE * PIXEL_BYTES;

/// Brings `target` from its own state to that of `now`. Returns the number of pixels written.
pub(super) fn present(
    exec: Exec,
    grid: Grid,
    tiles: &[Tile],
    now: Stamp,
    target: &mut Target<'_>,
) -> u64 {
    if (target.width(), target.height()) != (grid.width, grid.height) {
        return 0;
    }
    let known = target.serial_by(now.writer);
    let written = stale_tiles(tiles, known).map(Tile::pixels).sum();
    target.mark(Some(now));
    if written > 0 {
        let (stride, order) = (target.stride(), target.order());
        exec.for_each_chunk(
            target.bytes_mut(),
            stride.saturating_mul(TILE_SIDE),
            |row, band| {
                let first = row * grid.columns;
                // Behind the last row there may be more bytes.
                let Some(row_of_tiles) = tiles.get(first..first + grid.columns) else {
                    return;
                };
                for tile in stale_tiles(row_of_tiles, known) {
                    match order {
                        ChannelOrder::Rgba => copy_tile(tile, stride, band, u32::to_le_bytes),
                        ChannelOrder::Bgra => copy_tile(tile, stride, band, bgra),
                    }
                }
            },
        );
    }
    written
}

/// The tiles that a target lacks which holds the image of serial `known`, or an unknown one.
pub(super) fn stale_tiles(tiles: &[Tile], known: Option<u64>) -> impl Iterator<Item = &Tile> {
    tiles
        .iter()
        .filter(move |tile| known.is_none_or(|serial| tile.serial > serial))
}

/// The tiles that such a target may lack once all have got new colours: those as well that show a triangle, have shown one, or will have
/// another background.
pub(super) fn after_resolve(
    tiles: &[Tile],
    known: Option<u64>,
    background: u32,
) -> impl Iterator<Item = &Tile> {
    let stays = move |tile: &Tile| {
        tile.owned.is_empty() && tile.painted.is_empty() && tile.background == Some(background)
    };
    tiles
        .iter()
        .filter(move |tile| known.is_none_or(|serial| tile.serial > serial) || !stays(tile))
}

/// Appends the rectangles that such a target lacks: neighbours in a row of tiles are one, and so are equal ones in rows that
/// follow each other.
pub(super) fn changes(grid: Grid, tiles: &[Tile], known: Option<u64>, out: &mut Vec<Rect>) {
    let is_stale = |tile: &Tile| known.is_none_or(|serial| tile.serial > serial);
    let first = out.len();
    for row in tiles.chunks(grid.columns.max(1)) {
        // No look further back: it is no harm if some that could be one are two.
        let recent = out.len().saturating_sub(2 * row.len()).max(first);
        for run in row.chunk_by(|a, b| is_stale(a) == is_stale(b)) {
            if !is_stale(&run[0]) {
                continue;
            }
            let rect = Rect {
                x: run[0].origin[0] as u32,
                y: run[0].origin[1] as u32,
                width: run.iter().map(|tile| tile.width as u32).sum(),
                height: run[0].height as u32,
            };
            let below = |above: &&mut Rect| {
                (above.x, above.width, above.y + above.height) == (rect.x, rect.width, rect.y)
            };
            match out[recent..].iter_mut().find(below) {
                Some(above) => above.height += rect.height,
                None => out.push(rect),
            }
        }
    }
}

/// Copies a tile into the rows of the target that it takes part in.
#[inline(always)]
fn copy_tile(tile: &Tile, stride: usize, band: &mut [u8], bytes_of: impl Fn(u32) -> [u8; 4]) {
    let left = tile.origin[0] as usize * PIXEL_BYTES;
    let width = tile.width as usize * PIXEL_BYTES;
    let (blocks, _) = tile.colour.as_chunks::<BLOCK_PIXELS>();
    for (y, row) in band
        .chunks_mut(stride)
        .enumerate()
        .take(tile.height as usize)
    {
        // The same row of each block; blocks follow each other.
        let first = y % BLOCK_SIDE * BLOCK_SIDE;
        let blocks = &blocks[y / BLOCK_SIDE * BLOCKS_ACROSS..];
        let (whole, part) = row[left..left + width].as_chunks_mut::<BLOCK_ROW_BYTES>();
        let behind = &blocks[whole.len().min(blocks.len() - 1)];
        for (to, block) in whole.iter_mut().zip(blocks) {
            // Four pixels at a time, which become one load and one store.
            let (rows, _) = block.as_chunks::<BLOCK_SIDE>();
            let [a, b, c, d] = rows[y % BLOCK_SIDE].map(&bytes_of);
            *to = [
                a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3], c[0], c[1], c[2], c[3], d[0], d[1],
                d[2], d[3],
            ];
        }
        let (part, _) = part.as_chunks_mut::<PIXEL_BYTES>();
        for (pixel, &colour) in part.iter_mut().zip(&behind[first..]) {
            *pixel = bytes_of(colour);
        }
    }
}

/// The bytes of a colour that is stored as red, green, blue, 255.
fn bgra(colour: u32) -> [u8; 4] {
    let [r, g, b, a] = colour.to_le_bytes();
    [b, g, r, a]
}
