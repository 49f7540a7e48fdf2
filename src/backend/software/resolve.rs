//! Colours for every pixel of a tile.
//!
//! Only blocks in which some pixel has an owner are looked at; one that has lost all of them gets the background, and one that
//! had none before either is left alone.
//!
//! Each vector of pixels gets its linear colours from a [`Surface`], and is encoded once.

use super::lanes::splat3;
use super::setup::Drawn;
use super::shares::Shares;
use super::surface::{Flat, Gouraud, Mixed, Owners, Phong, Surface};
use super::tile::{
    BLOCK_PIXELS, BLOCK_SIDE, BlockSet, NO_TRIANGLE, TILE_BLOCKS, Tile, block_corner,
};
use crate::backend::{BasePaint, Geometry};
use crate::illumination::ShadingKit;
use crate::output::encode::encode_lanes;
use crate::parallel::{Pace, Watch};
use crate::scene::World;
use crate::simd::Simd;
use fearless_simd::{SimdBase, SimdInt, SimdMask};

/// What a pass over tiles reads.
#[derive(Clone, Copy)]
pub(super) struct Painter<'a> {
    /// What is drawn.
    pub geometry: Geometry<'a>,
    /// Who owns pixels.
    pub shares: &'a Shares,
    /// The number of this pass.
    pub serial: u64,
}

impl<'a> Painter<'a> {
    pub(super) fn world(&self) -> &'a World {
        self.geometry.world
    }

    /// A triangle's material, which may have changed since it was set up.
    #[inline(always)]
    pub(super) fn material(&self, drawn: &Drawn) -> u16 {
        self.world().triangle_material[drawn.id as usize]
    }

    /// What illuminating points of a material needs.
    pub(super) fn kit(&self, material: u16) -> ShadingKit<'a> {
        let world = self.world();
        ShadingKit::new(
            self.geometry.view.eye,
            &world.materials[usize::from(material)],
            &world.lights,
        )
    }
}

/// Blocks that are painted in one go: with interpolated colours about 10 microseconds on a fine mesh.
const BLOCKS_AT_ONCE: usize = 64;

/// Under so many lights a pixel that the illumination equation is evaluated at takes twice as long as without any.
const LIGHTS_PER_PIXEL: usize = 5;

/// Blocks that are painted in one go where the illumination equation is evaluated.
fn lit_blocks_at_once(painter: &Painter<'_>) -> usize {
    let lights = painter.world().lights.len();
    (BLOCKS_AT_ONCE * LIGHTS_PER_PIXEL / (LIGHTS_PER_PIXEL + lights)).max(1)
}

/// Paints a tile, or goes on with it, until it is told to stop. `next` is the block to go on with: 0 at first, [`TILE_BLOCKS`]
/// when the tile is complete.
#[inline(always)]
pub(super) fn resolve_tile<S: Simd>(
    simd: S,
    tile: &mut Tile,
    index: usize,
    painter: &Painter<'_>,
    paint: BasePaint<'_>,
    next: &mut u16,
    watch: &Watch<'_>,
) {
    if *next == 0 {
        fill_background(tile, background(simd, painter.geometry), painter.serial);
        if !tile.owned.is_empty() {
            painter.shares.prefetch(index);
        }
    }
    let left = tile.owned.from(usize::from(*next));
    if left.is_empty() {
        *next = TILE_BLOCKS as u16;
        return;
    }
    let end = match paint {
        // Parts are for backends that cannot repaint.
        BasePaint::Gouraud(colours) | BasePaint::Refined { colours, .. } => {
            let mut gouraud = Gouraud::new(painter, colours);
            let pace = Pace::new(watch, BLOCKS_AT_ONCE);
            paint_tile(simd, tile, painter, &mut gouraud, left, pace)
        }
        BasePaint::Mixed {
            colours,
            curved,
            lit,
        } => {
            let mut mixed = Mixed::new(painter, colours, curved, lit);
            let some = if lit.is_empty() {
                BLOCKS_AT_ONCE
            } else {
                lit_blocks_at_once(painter)
            };
            let pace = Pace::new(watch, some);
            paint_tile(simd, tile, painter, &mut mixed, left, pace)
        }
        BasePaint::Flat(colours) => {
            let pace = Pace::new(watch, BLOCKS_AT_ONCE);
            paint_tile(
                simd,
                tile,
                painter,
                &mut Flat { painter, colours },
                left,
                pace,
            )
        }
        BasePaint::Phong => {
            let pace = Pace::new(watch, lit_blocks_at_once(painter));
            paint_tile(simd, tile, painter, &mut Phong::new(painter), left, pace)
        }
    };
    *next = end as u16;
}

/// The background's colour as it is stored.
#[inline(always)]
pub(super) fn background<S: Simd>(simd: S, geometry: Geometry<'_>) -> u32 {
    let linear = splat3(simd, geometry.world.background);
    encode_lanes(simd, geometry.view.encoding, linear)[0]
}

/// Gives blocks that no triangle has a pixel of the background's colour, unless they have it already.
fn fill_background(tile: &mut Tile, background: u32, serial: u64) {
    if tile.background != Some(background) {
        tile.colour.fill(background);
        tile.background = Some(background);
        tile.serial = serial;
    } else {
        for block in tile.painted.without(tile.owned).iter() {
            let at = block * BLOCK_PIXELS;
            tile.colour[at..at + BLOCK_PIXELS].fill(background);
            tile.serial = serial;
        }
    }
    tile.painted = tile.owned;
}

/// Paints some blocks of a tile until it is told to stop. Returns the block to go on with, or [`TILE_BLOCKS`].
#[inline(always)]
fn paint_tile<S: Simd>(
    simd: S,
    tile: &mut Tile,
    painter: &Painter<'_>,
    surface: &mut impl Surface,
    blocks: BlockSet,
    mut pace: Pace<'_>,
) -> usize {
    let lanes = S::u32s::LEN;
    let background = splat3(simd, painter.world().background);
    let encoding = painter.geometry.view.encoding;
    let iota = S::i32s::from_fn(simd, |i| i as i32);
    let mut changed = S::mask32s::splat(simd, false);
    let mut next = TILE_BLOCKS;
    for block in blocks.iter() {
        let [x, y] = block_corner(block);
        let corner = [(tile.origin[0] + x) as f32, (tile.origin[1] + y) as f32];
        for part in 0..BLOCK_PIXELS / lanes {
            let at = block * BLOCK_PIXELS + part * lanes;
            let slice = &tile.slot[at..at + lanes];
            let slots = S::u32s::from_slice(simd, slice);
            let covered = slots.simd_ne(NO_TRIANGLE).to_bitmask();
            let pixel = iota + (part * lanes) as i32;
            let column: S::f32s = (pixel & (BLOCK_SIDE as i32 - 1)).to_float();
            let row: S::f32s = (pixel >> BLOCK_SIDE.trailing_zeros()).to_float();
            let owners = Owners {
                slots,
                slice,
                column: column + corner[0],
                row: row + corner[1],
            };
            let linear = surface.colours(simd, owners, covered, background);
            let colour = encode_lanes(simd, encoding, linear);
            let stored = &mut tile.colour[at..at + lanes];
            changed |= colour.simd_ne(S::u32s::from_slice(simd, stored));
            colour.store_slice(stored);
        }
        if !pace.did(1) {
            next = block + 1;
            break;
        }
    }
    if changed.any_true() {
        tile.serial = painter.serial;
    }
    next
}
