//! Colours for every pixel of a tile.
//!
//! Only blocks in which some pixel has an owner are looked at; one that has lost all of them gets the background, and one that
//! had none before either is left alone.
//!
//! A vector of pixels belongs to one triangle or to a few. The triangles in it are taken one after the other,
//! each fills its lanes of the linear colour (or, for per-pixel illumination, of the position and normal, which are then
//! illuminated together, once for each material), and the vector is encoded once. What a lane gets does not depend on its
//! neighbours.

use super::lanes::{
    Corners3, Lanes3, PartHint, curved_colours, gather, interpolate, select3, splat3, weights_at,
};
use super::setup::Drawn;
use super::shares::Shares;
use super::tile::{
    BLOCK_PIXELS, BLOCK_SIDE, BlockSet, NO_TRIANGLE, TILE_BLOCKS, Tile, block_corner,
};
use crate::backend::{BasePaint, Geometry};
use crate::geometry::curved::PartColours;
use crate::geometry::{CurvedTriangles, Vec3s};
use crate::illumination::{ActiveLights, ShadingKit, shade_lanes};
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
    fn world(&self) -> &'a World {
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

/// The same with the illumination equation at every pixel, times lights.
const LIT_BLOCKS_AT_ONCE: usize = 96;

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
        let encoding = painter.geometry.view.encoding;
        let background = encode_lanes(simd, encoding, splat3(simd, painter.world().background));
        fill_background(tile, background[0], painter.serial);
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
            let mut gouraud = Gouraud {
                painter,
                colours,
                last: NO_TRIANGLE,
                corners: Corners3::default(),
            };
            let pace = Pace::new(watch, BLOCKS_AT_ONCE);
            paint_tile(simd, tile, painter, &mut gouraud, left, pace)
        }
        BasePaint::Curved { colours, curved } => {
            let mut surface = Curved {
                painter,
                colours,
                curved,
                last: NO_TRIANGLE,
                corners: Corners3::default(),
                parts: None,
                hint: PartHint::FIRST,
            };
            let pace = Pace::new(watch, BLOCKS_AT_ONCE);
            paint_tile(simd, tile, painter, &mut surface, left, pace)
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
            let lights = painter.world().lights.len();
            let mut phong = Phong {
                painter,
                active: ActiveLights::all(lights),
                kit: None,
            };
            let some = BLOCKS_AT_ONCE.min(LIT_BLOCKS_AT_ONCE / (1 + lights));
            paint_tile(
                simd,
                tile,
                painter,
                &mut phong,
                left,
                Pace::new(watch, some),
            )
        }
    };
    *next = end as u16;
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

/// The triangles in a vector of pixels.
#[derive(Clone, Copy)]
struct Owners<'a, S: Simd> {
    slots: S::u32s,
    /// The same in memory.
    slice: &'a [u32],
    /// Columns and rows of the pixels in the image.
    column: S::f32s,
    row: S::f32s,
}

impl<S: Simd> Owners<'_, S> {
    /// The slot of the owner of the first pixel in a bit set, and all pixels that it owns.
    #[inline(always)]
    fn first(&self, pixels: u64) -> (u32, S::mask32s) {
        let slot = self.slice[pixels.trailing_zeros() as usize];
        (slot, self.slots.simd_eq(slot))
    }

    /// Weights of a triangle's corners at the pixels.
    #[inline(always)]
    fn weights(&self, simd: S, drawn: &Drawn) -> Lanes3<S> {
        let planes = drawn.interpolator();
        let [x, y] = planes.anchor.map(|v| v as f32);
        weights_at(simd, &planes, self.column - x, self.row - y)
    }
}

/// How the pixels of one vector get their linear colours.
trait Surface {
    /// Puts the colours of the pixels in the bit set `covered` over `background`.
    fn colours<S: Simd>(
        &mut self,
        simd: S,
        owners: Owners<'_, S>,
        covered: u64,
        background: Lanes3<S>,
    ) -> Lanes3<S>;
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

/// Vertex colours, interpolated.
struct Gouraud<'a> {
    painter: &'a Painter<'a>,
    colours: &'a Vec3s,
    /// The slot painted last: as a rule the next vector begins with it.
    last: u32,
    /// Its corners' colours.
    corners: Corners3,
}

impl Surface for Gouraud<'_> {
    #[inline(always)]
    fn colours<S: Simd>(
        &mut self,
        simd: S,
        owners: Owners<'_, S>,
        covered: u64,
        background: Lanes3<S>,
    ) -> Lanes3<S> {
        let (mut left, mut out) = (covered, background);
        while left != 0 {
            let (slot, mask) = owners.first(left);
            let drawn = self.painter.shares.drawn(slot);
            let w = owners.weights(simd, drawn);
            if slot != self.last {
                self.corners = gather(self.colours, drawn.vertices);
                self.last = slot;
            }
            let colour = interpolate(simd, w, &self.corners);
            out = select3::<S>(mask, colour, out);
            left &= !mask.to_bitmask();
        }
        out
    }
}

/// Vertex colours, interpolated, but for triangles that are curved.
struct Curved<'a> {
    painter: &'a Painter<'a>,
    colours: &'a Vec3s,
    curved: &'a CurvedTriangles,
    /// The slot painted last, its corners' colours, and its parts.
    last: u32,
    corners: Corners3,
    parts: Option<(u32, &'a [PartColours])>,
    hint: PartHint,
}

impl Surface for Curved<'_> {
    #[inline(always)]
    fn colours<S: Simd>(
        &mut self,
        simd: S,
        owners: Owners<'_, S>,
        covered: u64,
        background: Lanes3<S>,
    ) -> Lanes3<S> {
        let (mut left, mut out) = (covered, background);
        while left != 0 {
            let (slot, mask) = owners.first(left);
            let drawn = self.painter.shares.drawn(slot);
            let w = owners.weights(simd, drawn);
            if slot != self.last {
                self.parts = self.curved.get(drawn.id);
                self.corners = gather(self.colours, drawn.vertices);
                self.hint = PartHint::FIRST;
                self.last = slot;
            }
            out = match self.parts {
                Some((n, parts)) => curved_colours(simd, w, n, parts, &mut self.hint, mask, out),
                None => select3::<S>(mask, interpolate(simd, w, &self.corners), out),
            };
            left &= !mask.to_bitmask();
        }
        out
    }
}

/// One colour for each triangle.
struct Flat<'a> {
    painter: &'a Painter<'a>,
    colours: &'a Vec3s,
}

impl Surface for Flat<'_> {
    #[inline(always)]
    fn colours<S: Simd>(
        &mut self,
        simd: S,
        owners: Owners<'_, S>,
        covered: u64,
        background: Lanes3<S>,
    ) -> Lanes3<S> {
        let (mut left, mut out) = (covered, background);
        while left != 0 {
            let (slot, mask) = owners.first(left);
            let drawn = self.painter.shares.drawn(slot);
            let colour = splat3(simd, self.colours.get(drawn.id as usize));
            out = select3::<S>(mask, colour, out);
            left &= !mask.to_bitmask();
        }
        out
    }
}

/// The illumination equation at every pixel.
struct Phong<'a> {
    painter: &'a Painter<'a>,
    active: ActiveLights,
    /// The material illuminated last: neighbours share it as a rule.
    kit: Option<(u16, ShadingKit<'a>)>,
}

impl<'a> Phong<'a> {
    #[inline(always)]
    fn kit(&mut self, material: u16) -> ShadingKit<'a> {
        match self.kit {
            Some((known, kit)) if known == material => kit,
            _ => {
                let kit = self.painter.kit(material);
                self.kit = Some((material, kit));
                kit
            }
        }
    }
}

impl Surface for Phong<'_> {
    #[inline(always)]
    fn colours<S: Simd>(
        &mut self,
        simd: S,
        owners: Owners<'_, S>,
        covered: u64,
        background: Lanes3<S>,
    ) -> Lanes3<S> {
        let world = self.painter.world();
        let (mut left, mut out) = (covered, background);
        while left != 0 {
            // All pixels with the material of the first.
            let first = self.painter.shares.drawn(owners.first(left).0);
            let material = self.painter.material(first);
            let mut alike = S::mask32s::splat(simd, false);
            let (mut point, mut normal) = (background, background);
            let mut unseen = left;
            while unseen != 0 {
                let (slot, mask) = owners.first(unseen);
                let drawn = self.painter.shares.drawn(slot);
                if self.painter.material(drawn) == material {
                    let w = owners.weights(simd, drawn);
                    let p = interpolate(simd, w, &gather(&world.positions, drawn.vertices));
                    let n = interpolate(simd, w, &gather(&world.normals, drawn.vertices));
                    point = select3::<S>(mask, p, point);
                    normal = select3::<S>(mask, n, normal);
                    alike |= mask;
                }
                unseen &= !mask.to_bitmask();
            }
            let kit = self.kit(material);
            let colour = shade_lanes(simd, &kit, &self.active, point, normal);
            out = select3::<S>(alike, colour, out);
            left &= !alike.to_bitmask();
        }
        out
    }
}
