//! The illumination equation at every pixel of some tiles.

use super::resolve::{Painter, resolve_tile};
use super::tile::Tile;
use crate::backend::BasePaint;
use crate::parallel::{Exec, Watch};
use crate::simd::dispatch;

/// Tiles that are shared among threads at once.
const TILES_AT_ONCE: usize = 64;

/// Shades the tiles of those numbers, as resolving the whole image would.
pub(super) fn shade(exec: Exec, tiles: &mut [Tile], painter: &Painter<'_>, numbers: &[u32]) {
    for numbers in numbers.chunks(TILES_AT_ONCE) {
        // Put side by side, so that each thread gets its share of them.
        let mut chosen: [Option<(usize, &mut Tile)>; TILES_AT_ONCE] =
            [const { None }; TILES_AT_ONCE];
        let named =
            (tiles.iter_mut().enumerate()).filter(|(index, _)| numbers.contains(&(*index as u32)));
        for (place, tile) in chosen.iter_mut().zip(named) {
            *place = Some(tile);
        }
        exec.for_each_chunk(&mut chosen[..numbers.len()], 1, |_, place| {
            if let Some((index, tile)) = &mut place[0] {
                dispatch!(exec.level, simd => resolve_tile(simd, tile, *index, painter, BasePaint::Phong, &mut 0, &Watch::new(&|| true)));
            }
        });
    }
}
