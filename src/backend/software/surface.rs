//! How the pixels of a vector get their linear colours, for each kind of paint.
//!
//! A vector of pixels belongs to one triangle or to a few. The triangles in it are taken one after the other: each fills its lanes of
//! the linear colour; or, for per-pixel illumination, of the position and normal, which are then illuminated together, once for each
//! material. What a lane gets does not depend on its neighbours.

use super::lanes::{
    Corners3, Lanes3, PartHint, curved_colours, gather, interpolate, select3, splat3, weights_at,
};
use super::resolve::Painter;
use super::setup::Drawn;
use super::tile::NO_TRIANGLE;
use crate::geometry::curved::PartColours;
use crate::geometry::{CurvedTriangles, TriangleSet, Vec3s};
use crate::illumination::{ActiveLights, ShadingKit, shade_lanes};
use crate::simd::Simd;
use fearless_simd::{SimdBase, SimdMask};

/// The triangles in a vector of pixels.
#[derive(Clone, Copy)]
pub(super) struct Owners<'a, S: Simd> {
    pub(super) slots: S::u32s,
    /// The same in memory.
    pub(super) slice: &'a [u32],
    /// Columns and rows of the pixels in the image.
    pub(super) column: S::f32s,
    pub(super) row: S::f32s,
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
pub(super) trait Surface {
    /// Puts the colours of the pixels in the bit set `covered` over `background`.
    fn colours<S: Simd>(
        &mut self,
        simd: S,
        owners: Owners<'_, S>,
        covered: u64,
        background: Lanes3<S>,
    ) -> Lanes3<S>;
}

/// Vertex colours, interpolated.
pub(super) struct Gouraud<'a> {
    painter: &'a Painter<'a>,
    colours: &'a Vec3s,
    /// The slot painted last: as a rule the next vector begins with it.
    last: u32,
    /// Its corners' colours.
    corners: Corners3,
}

impl<'a> Gouraud<'a> {
    pub(super) fn new(painter: &'a Painter<'a>, colours: &'a Vec3s) -> Self {
        Self {
            painter,
            colours,
            last: NO_TRIANGLE,
            corners: Corners3::default(),
        }
    }
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

/// Vertex colours, interpolated, but for triangles that are curved or lit at every pixel.
pub(super) struct Mixed<'a> {
    gouraud: Gouraud<'a>,
    curved: &'a CurvedTriangles,
    /// Parts of the triangle painted last, if it is curved.
    parts: Option<(u32, &'a [PartColours])>,
    hint: PartHint,
    lit: &'a TriangleSet,
    /// Whether the triangle painted last is lit.
    is_lit: bool,
    phong: Phong<'a>,
}

impl<'a> Mixed<'a> {
    pub(super) fn new(
        painter: &'a Painter<'a>,
        colours: &'a Vec3s,
        curved: &'a CurvedTriangles,
        lit: &'a TriangleSet,
    ) -> Self {
        Self {
            gouraud: Gouraud::new(painter, colours),
            curved,
            parts: None,
            hint: PartHint::FIRST,
            lit,
            is_lit: false,
            phong: Phong::new(painter),
        }
    }
}

impl Surface for Mixed<'_> {
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
            let drawn = self.gouraud.painter.shares.drawn(slot);
            if slot != self.gouraud.last {
                self.is_lit = self.lit.contains(drawn.id);
                self.parts = self.curved.get(drawn.id);
                self.hint = PartHint::FIRST;
                self.gouraud.corners = gather(self.gouraud.colours, drawn.vertices);
                self.gouraud.last = slot;
            }
            if self.is_lit {
                let lit = self.lit;
                let is_lit = |drawn: &Drawn| lit.contains(drawn.id);
                let (alike, colour) = self.phong.light_alike(simd, owners, left, is_lit);
                out = select3::<S>(alike, colour, out);
                left &= !alike.to_bitmask();
                continue;
            }
            let w = owners.weights(simd, drawn);
            out = match self.parts {
                Some((n, parts)) => curved_colours(simd, w, n, parts, &mut self.hint, mask, out),
                None => select3::<S>(mask, interpolate(simd, w, &self.gouraud.corners), out),
            };
            left &= !mask.to_bitmask();
        }
        out
    }
}

/// One colour for each triangle.
pub(super) struct Flat<'a> {
    pub(super) painter: &'a Painter<'a>,
    pub(super) colours: &'a Vec3s,
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
pub(super) struct Phong<'a> {
    painter: &'a Painter<'a>,
    active: ActiveLights,
    /// The material illuminated last: neighbours share it as a rule.
    kit: Option<(u16, ShadingKit<'a>)>,
}

impl<'a> Phong<'a> {
    pub(super) fn new(painter: &'a Painter<'a>) -> Self {
        Self {
            painter,
            active: ActiveLights::all(painter.world().lights.len()),
            kit: None,
        }
    }

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

    /// Of the pixels in the bit set `left`, those that have the material of the first, as far as their triangles are meant: which they
    /// are, and their colours. The first is meant.
    #[inline(always)]
    fn light_alike<S: Simd>(
        &mut self,
        simd: S,
        owners: Owners<'_, S>,
        left: u64,
        is_meant: impl Fn(&Drawn) -> bool,
    ) -> (S::mask32s, Lanes3<S>) {
        let world = self.painter.world();
        let first = self.painter.shares.drawn(owners.first(left).0);
        let material = self.painter.material(first);
        let mut alike = S::mask32s::splat(simd, false);
        let zero = S::f32s::splat(simd, 0.0);
        let (mut point, mut normal) = ([zero; 3], [zero; 3]);
        let mut unseen = left;
        while unseen != 0 {
            let (slot, mask) = owners.first(unseen);
            let drawn = self.painter.shares.drawn(slot);
            if self.painter.material(drawn) == material && is_meant(drawn) {
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
        (alike, shade_lanes(simd, &kit, &self.active, point, normal))
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
        let (mut left, mut out) = (covered, background);
        while left != 0 {
            let (alike, colour) = self.light_alike(simd, owners, left, |_| true);
            out = select3::<S>(alike, colour, out);
            left &= !alike.to_bitmask();
        }
        out
    }
}
