//! How many pixels each triangle owns: counted when a tile has been drawn.

use super::shares::{Share, add_pixels, subtract_pixels};
use super::tile::{BLOCK_PIXELS, BlockSet, NO_TRIANGLE, TILE_PIXELS, Tile};
use crate::simd::Simd;
use fearless_simd::{SimdBase, SimdMask};

/// Copies the owned blocks of what has been drawn to the tile, and counts the covered pixels and those of each triangle. Those of a tile that was kept
/// until now no longer count: in one step, so that counts are right at any time.
#[inline(always)]
pub(super) fn hand_over<S: Simd>(
    simd: S,
    slots: &[u32; TILE_PIXELS],
    owned: BlockSet,
    tile: &mut Tile,
    shares: &[Share],
) {
    if shares.iter().any(|share| !share.is_new) {
        let subtract = |slot, pixels| subtract_pixels(shares, slot, pixels);
        count_pixels(simd, &tile.slot, tile.owned, |_, _| (), subtract);
    }
    let stored = &mut tile.slot;
    let store = |at: usize, slots: S::u32s| slots.store_slice(&mut stored[at..at + S::u32s::LEN]);
    let add = |slot, pixels| add_pixels(shares, slot, pixels);
    tile.covered = count_pixels(simd, slots, owned, store, add);
    tile.owned = owned;
}

/// Calls `seen` with each vector of slots of some blocks and its place, and `found` with slots and how many pixels follow each other
/// that have them. Returns how many have any.
#[inline(always)]
fn count_pixels<S: Simd>(
    simd: S,
    slots: &[u32; TILE_PIXELS],
    blocks: BlockSet,
    mut seen: impl FnMut(usize, S::u32s),
    found: impl Fn(u32, u32),
) -> u32 {
    let width = S::u32s::LEN;
    let mut covered = 0;
    // A large triangle fills block after block.
    let (mut last, mut count) = (NO_TRIANGLE, 0);
    for block in blocks.iter() {
        for part in 0..BLOCK_PIXELS / width {
            let at = block * BLOCK_PIXELS + part * width;
            let slots = &slots[at..at + width];
            let vector = S::u32s::from_slice(simd, slots);
            seen(at, vector);
            let mut left = vector.simd_ne(NO_TRIANGLE).to_bitmask();
            covered += left.count_ones();
            while left != 0 {
                let slot = slots[left.trailing_zeros() as usize];
                let pixels = vector.simd_eq(slot).to_bitmask();
                if slot != last {
                    if count > 0 {
                        found(last, count);
                    }
                    (last, count) = (slot, 0);
                }
                count += pixels.count_ones();
                left &= !pixels;
            }
        }
    }
    if count > 0 {
        found(last, count);
    }
    covered
}
