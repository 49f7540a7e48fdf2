//! Colours for every pixel of a tile.
//!
//! A vector of pixels belongs to one triangle or to a few. The triangles in it are taken one after the other,
//! each fills its lanes of the linear colour (or, for per-pixel illumination, of the position and normal, which are then
//! illuminated together, once for each material), and the vector is encoded once. What a lane gets does not depend on its
//! neighbours.

use super::lanes::{Corners3, Lanes3, gather, interpolate, select3, splat3, weights};
use super::tile::{NO_TRIANGLE, TILE_SIDE, Tile};
use super::visible::Visible;
use crate::backend::{BasePaint, Geometry};
use crate::geometry::Vec3s;
use crate::illumination::{ActiveLights, ShadingKit, shade_lanes};
use crate::output::encode::encode_lanes;
use crate::scene::World;
use crate::simd::Simd;
use fearless_simd::{SimdBase, SimdMask};

/// What a pass over tiles reads.
#[derive(Clone, Copy, Debug)]
pub(super) struct Painter<'a> {
    /// What is drawn.
    pub geometry: Geometry<'a>,
    /// Who owns pixels.
    pub visible: &'a Visible,
    /// The number of this pass.
    pub serial: u64,
}

impl<'a> Painter<'a> {
    fn world(&self) -> &'a World {
        self.geometry.world
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

    /// Weights of a visible triangle's corners at the pixels of a row that start at `(x, y)`.
    #[inline(always)]
    fn weights<S: Simd>(&self, simd: S, id: u32, [x, y]: [i32; 2]) -> Lanes3<S> {
        weights(simd, &self.visible.owner(id).planes, x, y)
    }
}

/// Paints a tile.
#[inline(always)]
pub(super) fn resolve_tile<S: Simd>(
    simd: S,
    tile: &mut Tile,
    painter: &Painter<'_>,
    paint: BasePaint<'_>,
) {
    let background = splat3(simd, painter.world().background);
    if tile.covered == 0 {
        let encoding = painter.geometry.view.encoding;
        let colour = encode_lanes(simd, encoding, background)[0];
        fill(tile, colour, painter.serial);
        return;
    }
    match paint {
        // Parts are for backends that cannot repaint.
        BasePaint::Gouraud(colours) | BasePaint::Refined { colours, .. } => {
            let mut gouraud = Gouraud {
                painter,
                colours,
                last: NO_TRIANGLE,
                corners: Corners3::default(),
            };
            paint_tile(simd, tile, painter, &mut gouraud);
        }
        BasePaint::Flat(colours) => paint_tile(simd, tile, painter, &mut Flat { colours }),
        BasePaint::Phong => {
            let active = ActiveLights::all(painter.world().lights.len());
            let mut phong = Phong {
                painter,
                active,
                kit: None,
            };
            paint_tile(simd, tile, painter, &mut phong);
        }
    }
}

/// Fills a tile without triangles.
fn fill(tile: &mut Tile, colour: u32, serial: u64) {
    if tile.filled != Some(colour) {
        tile.colour.fill(colour);
        tile.filled = Some(colour);
        tile.serial = serial;
    }
}

/// The triangles in a vector of pixels.
#[derive(Clone, Copy)]
struct Owners<'a, S: Simd> {
    ids: S::u32s,
    /// The same in memory.
    slice: &'a [u32],
    /// The first pixel in the image.
    pixel: [i32; 2],
}

impl<S: Simd> Owners<'_, S> {
    /// The owner of the first pixel in a bit set, and all pixels that it owns.
    #[inline(always)]
    fn first(&self, pixels: u64) -> (u32, S::mask32s) {
        let id = self.slice[pixels.trailing_zeros() as usize];
        (id, self.ids.simd_eq(id))
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

#[inline(always)]
fn paint_tile<S: Simd>(
    simd: S,
    tile: &mut Tile,
    painter: &Painter<'_>,
    surface: &mut impl Surface,
) {
    let lanes = S::u32s::LEN;
    let background = splat3(simd, painter.world().background);
    let encoding = painter.geometry.view.encoding;
    let encoded_background = encode_lanes(simd, encoding, background);
    let mut changed = S::mask32s::splat(simd, false);
    for y in 0..tile.height {
        for x in (0..tile.width).step_by(lanes) {
            let at = y as usize * TILE_SIDE + x as usize;
            let slice = &tile.id[at..at + lanes];
            let ids = S::u32s::from_slice(simd, slice);
            let covered = ids.simd_ne(NO_TRIANGLE).to_bitmask();
            let colour = if covered == 0 {
                encoded_background
            } else {
                let owners = Owners {
                    ids,
                    slice,
                    pixel: [tile.origin[0] + x, tile.origin[1] + y],
                };
                let linear = surface.colours(simd, owners, covered, background);
                encode_lanes(simd, encoding, linear)
            };
            let stored = &mut tile.colour[at..at + lanes];
            changed |= colour.simd_ne(S::u32s::from_slice(simd, stored));
            colour.store_slice(stored);
        }
    }
    tile.filled = None;
    if changed.any_true() {
        tile.serial = painter.serial;
    }
}

/// Vertex colours, interpolated.
struct Gouraud<'a> {
    painter: &'a Painter<'a>,
    colours: &'a Vec3s,
    /// The triangle painted last: as a rule the next vector begins with it.
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
            let (id, mask) = owners.first(left);
            let w = self.painter.weights(simd, id, owners.pixel);
            if id != self.last {
                let triangle = self.painter.world().triangles[id as usize];
                self.corners = gather(self.colours, triangle);
                self.last = id;
            }
            let colour = interpolate(simd, w, &self.corners);
            out = select3::<S>(mask, colour, out);
            left &= !mask.to_bitmask();
        }
        out
    }
}

/// One colour for each triangle.
struct Flat<'a> {
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
            let (id, mask) = owners.first(left);
            let colour = splat3(simd, self.colours.get(id as usize));
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
            let material = world.triangle_material[owners.first(left).0 as usize];
            let mut alike = S::mask32s::splat(simd, false);
            let (mut point, mut normal) = (background, background);
            let mut unseen = left;
            while unseen != 0 {
                let (id, mask) = owners.first(unseen);
                if world.triangle_material[id as usize] == material {
                    let w = self.painter.weights(simd, id, owners.pixel);
                    let triangle = world.triangles[id as usize];
                    let p = interpolate(simd, w, &gather(&world.positions, triangle));
                    let n = interpolate(simd, w, &gather(&world.normals, triangle));
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
