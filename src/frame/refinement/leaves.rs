//! What the current image consists of: every visible triangle, or the leaves and parts it has been divided into.
//!
//! Each pixel that a visible triangle owns belongs to exactly one of them. They describe the image as planned; those
//! [not painted](Leaf::is_painted) yet, because the budget ended first, still show what they were divided from.

use super::parts::PartState;
use super::shading::{Shade, ShadeKind, Shading};
use super::{Progress, Refinement, Root};
use crate::backend::Backend;
use crate::frame::Method;
use crate::frame::base::BaseImage;
use crate::geometry::{Bary, Vec3s};
use crate::refine::{self, LeafId, LeafState};
use crate::scene::World;

/// How the pixels of a [`Leaf`] get their colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeafKind {
    /// Colours are interpolated between the corners; it may be refined further.
    Interpolated,
    /// It was divided before the first image was drawn, and has a quadratic over each part.
    Curved,
    /// The illumination equation is evaluated at every pixel.
    PerPixel,
    /// Its highlights, and lights that set on it, are evaluated at every pixel; the rest is interpolated as a quadratic. It may be shaded
    /// per pixel later.
    Highlights,
    /// Colours are interpolated between the corners, which is proved to be right.
    Proved,
}

/// A part of a visible triangle, or the whole of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaf {
    /// The triangle of the world that it belongs to.
    pub triangle: u32,
    /// Its corners in that triangle, counter-clockwise like it.
    pub corners: [Bary; 3],
    /// Linear, unclamped colours at its corners by which it is interpolated, or was before it was shaded per pixel. Zero
    /// for [`Method::Phong`], which has none.
    pub colours: [[f32; 3]; 3],
    /// Pixels that it owns. An estimate where it has not been painted, for parts of a large leaf that is shaded per
    /// pixel part by part, and for whatever a backend draws that does not know owners.
    pub pixels: u32,
    /// How often the triangle has been quartered to get a leaf of this area; halves count as quarters.
    pub level: u32,
    /// How it is coloured.
    pub kind: LeafKind,
    /// Whether the image shows it already; always true on a backend that draws everything once.
    pub is_painted: bool,
    /// Whether its triangle passes the paper's test for some light. False with methods that do not test.
    pub is_pht: bool,
}

impl Leaf {
    /// A whole triangle.
    pub(in crate::frame) fn root(triangle: u32, colours: [[f32; 3]; 3], pixels: u32) -> Self {
        Self {
            triangle,
            corners: Bary::ROOT,
            colours,
            pixels,
            level: 0,
            kind: LeafKind::Interpolated,
            is_painted: true,
            is_pht: false,
        }
    }
}

/// Calls `f` with everything that the image of a method that refines triangles consists of, or else with its visible triangles.
pub(in crate::frame) fn for_each_leaf(
    method: Method,
    world: &World,
    base: &BaseImage,
    backend: &dyn Backend,
    refinement: &Refinement,
    mut f: impl FnMut(&Leaf),
) {
    if method.refines_triangles() {
        let visible = backend.visible_triangles();
        let rest = visible.get(refinement.roots.len()..).unwrap_or_default();
        refinement.for_each_leaf(world, base.colours(), &mut f);
        // Those that have not been collected are as they were drawn.
        for &triangle in rest {
            let colours = corner_colours(world, base.colours(), triangle);
            let pixels = backend.visible_pixels(triangle);
            f(&Leaf::root(triangle, colours, pixels));
        }
        return;
    }
    for &triangle in backend.visible_triangles() {
        let colours = match method {
            method if method.shades_first_image_per_pixel() => [[0.0; 3]; 3],
            Method::Flat => [base.colours().get(triangle as usize); 3],
            _ => corner_colours(world, base.colours(), triangle),
        };
        let mut leaf = Leaf::root(triangle, colours, backend.visible_pixels(triangle));
        if method.shades_first_image_per_pixel() {
            leaf.kind = LeafKind::PerPixel;
        }
        f(&leaf);
    }
}

impl Refinement {
    fn for_each_leaf(&self, world: &World, base_colours: &Vec3s, mut f: impl FnMut(&Leaf)) {
        for root in &self.roots {
            if root.progress == Progress::Planted {
                continue;
            }
            let colours = corner_colours(world, base_colours, root.triangle);
            let mut leaf = Leaf {
                is_pht: root.is_pht,
                ..Leaf::root(root.triangle, colours, root.pixels)
            };
            if root.is_curved {
                leaf.kind = LeafKind::Curved;
            }
            if root.progress == Progress::Done {
                let shade = self.root_shading(root).map(|known| known.shade);
                self.shade(&mut leaf, root, shade.unwrap_or_default());
            }
            f(&leaf);
        }
        for (id, leaf) in self.forest.current_leaves() {
            if !self.is_cut(id)
                && let Some(root) = self.root_at(leaf.triangle)
            {
                f(&self.forest_leaf(root, base_colours, id, leaf));
            }
        }
        for part in &self.parts {
            let triangle = self.forest.leaf(part.leaf).triangle;
            let Some(root) = self.root_at(triangle) else {
                continue;
            };
            let mut leaf = Leaf {
                corners: part.piece.corners,
                level: level(part.piece.corners),
                is_pht: root.is_pht,
                ..Leaf::root(triangle, part.piece.colours, part.pixels.round() as u32)
            };
            match part.state {
                PartState::Cut => continue,
                PartState::Waiting => {}
                PartState::Shaded(shade) => self.shade(&mut leaf, root, shade),
            }
            f(&leaf);
        }
    }

    fn forest_leaf(
        &self,
        root: &Root,
        base_colours: &Vec3s,
        id: LeafId,
        leaf: &refine::Leaf,
    ) -> Leaf {
        let progress = self.progressing.get(id as usize);
        let shade = progress.map_or_else(Shade::default, |p| p.shade);
        let mut drawn = Leaf {
            corners: leaf.corners,
            level: level(leaf.corners),
            is_painted: self.is_painted(shade.last_paint),
            is_pht: root.is_pht,
            ..Leaf::root(
                leaf.triangle,
                self.forest.colours(base_colours, id),
                leaf.pixels,
            )
        };
        // One without pixels was closed when it was painted.
        if leaf.state == LeafState::Closed && leaf.pixels > 0 {
            self.shade(&mut drawn, root, shade);
        }
        drawn
    }

    /// Makes it a leaf that is shaded as its root is shaded.
    fn shade(&self, leaf: &mut Leaf, root: &Root, shade: Shade) {
        match self.root_shading(root).map(|s| s.shading) {
            Some(Shading::PerPixel(..)) => {
                let (kind, is_painted) = self.shade_shown(shade);
                leaf.kind = match kind {
                    ShadeKind::Exact => LeafKind::PerPixel,
                    ShadeKind::FirstStep => LeafKind::Highlights,
                };
                leaf.is_painted = is_painted;
            }
            // It keeps the colours it has.
            Some(Shading::Proved) => leaf.kind = LeafKind::Proved,
            None => debug_assert!(false, "triangle {} was shaded unasked", leaf.triangle),
        }
    }

    fn root_at(&self, triangle: u32) -> Option<&Root> {
        self.root_of(triangle)
            .map(|index| &self.roots[index as usize])
    }

    /// Whether the parts of the leaf have taken its place.
    fn is_cut(&self, id: LeafId) -> bool {
        let progress = self.progressing.get(id as usize);
        progress.is_some_and(|progress| progress.is_cut)
    }

    /// Whether the patch of that number, counted from 1, is off the list; 0 for what needed none.
    pub(super) fn is_painted(&self, last_paint: u32) -> bool {
        last_paint as usize + self.paints.len() <= self.enqueued as usize || last_paint == 0
    }
}

/// Colours of a triangle's corners.
fn corner_colours(world: &World, colours: &Vec3s, triangle: u32) -> [[f32; 3]; 3] {
    world.triangles[triangle as usize].map(|v| colours.get(v as usize))
}

/// How often the root was quartered; its area is a power of two on the barycentric grid.
fn level(corners: [Bary; 3]) -> u32 {
    let root = Bary::doubled_area(Bary::ROOT).ilog2();
    let halvings = root - Bary::doubled_area(corners).max(1).ilog2().min(root);
    halvings.div_ceil(2)
}
