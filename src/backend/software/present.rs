//! Copies of the image into frames.
//!
//! A frame says which writer filled it and when. Every tile knows when it changed last; so a frame of ours lacks
//! exactly the tiles that changed after its stamp, and any other frame lacks all.

use super::tile::{Grid, TILE_SIDE, Tile};
use crate::output::Frame;
use crate::output::frame::Stamp;
use crate::parallel::Exec;

/// Brings `frame` from its own state to that of `now`. Returns the number of pixels written.
pub(super) fn present(
    exec: Exec,
    grid: Grid,
    tiles: &[Tile],
    now: Stamp,
    frame: &mut Frame,
) -> u64 {
    if (frame.width(), frame.height()) != (grid.width, grid.height) {
        return 0;
    }
    let known = known_serial(now.writer, frame);
    let written = stale_tiles(tiles, known).map(Tile::pixels).sum();
    let pixels = frame.pixels_stamped(now);
    if written > 0 {
        let width = grid.width as usize;
        exec.for_each_chunk(pixels, width * TILE_SIDE, |row, band| {
            let first = row * grid.columns;
            for tile in stale_tiles(&tiles[first..first + grid.columns], known) {
                copy_tile(tile, width, band);
            }
        });
    }
    written
}

/// The serial of the image that `frame` holds, if `writer` filled it last.
pub(super) fn known_serial(writer: u64, frame: &Frame) -> Option<u64> {
    let stamp = frame.stamp().filter(|stamp| stamp.writer == writer)?;
    Some(stamp.serial)
}

/// The tiles that a frame lacks which holds the image of serial `known`, or an unknown one.
pub(super) fn stale_tiles(tiles: &[Tile], known: Option<u64>) -> impl Iterator<Item = &Tile> {
    tiles
        .iter()
        .filter(move |tile| known.is_none_or(|serial| tile.serial > serial))
}

/// Copies a tile into the rows of the frame that it takes part in.
fn copy_tile(tile: &Tile, frame_width: usize, band: &mut [[u8; 4]]) {
    let (left, width) = (tile.origin[0] as usize, tile.width as usize);
    for (row, colours) in band
        .chunks_mut(frame_width)
        .zip(tile.colour.chunks(TILE_SIDE))
    {
        for (pixel, colour) in row[left..left + width].iter_mut().zip(colours) {
            *pixel = colour.to_le_bytes();
        }
    }
}
