//! What an image consists of, drawn over it: triangles, potentially highlighted ones, refinement, lights.
//!
//! The image is dimmed, areas are tinted pixel by pixel, and lines are drawn on top, anti-aliased. Nothing hidden is
//! shown: a tint colours only pixels that the triangle owns, and a line is drawn where one of the triangles it
//! belongs to owns a pixel next to it. Lines fade out where the mesh is finer than a few pixels, so that a dense mesh stays an
//! image; tints do not.
//!
//! | colour | layer | means |
//! |---|---|---|
//! | white lines | [`Wireframe`](Layer::Wireframe) | visible triangles |
//! | amber | [`Pht`](Layer::Pht) | a potentially highlighted triangle (PHT) that has not been refined |
//! | green | [`Pht`](Layer::Pht) | a PHT that has been subdivided, or shaded per pixel |
//! | light blue lines | [`Leaves`](Layer::Leaves) | leaves of subdivided triangles, and parts of large ones |
//! | violet | [`PerPixel`](Layer::PerPixel) | pixels shaded by the illumination equation |
//! | dark blue | [`Proved`](Layer::Proved) | triangles looked at and proved right as they were |
//! | discs | [`Lights`](Layer::Lights) | point lights in their colour, rings where they are hidden; squares: where directional light comes from |
//!
//! What is planned, but was not painted before the budget ended, is not in the image, and not shown.

mod lights;
mod lines;
mod tints;

use super::reference::owners;
use crate::frame::{Engine, Leaf, LeafKind};
use crate::geometry::Bary;
use crate::math::PixelPoint;
use crate::output::{Encoding, Frame};
use crate::scene::{Scene, View, World};
use lines::{Lines, Pen};
use std::fmt;
use std::str::FromStr;
use tiny_skia::{Color, IntSize, Pixmap};

/// Something to draw over an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Layer {
    /// Edges of visible triangles.
    Wireframe,
    /// Potentially highlighted triangles, refined and not.
    Pht,
    /// Edges of what triangles have been divided into.
    Leaves,
    /// Pixels shaded by the illumination equation.
    PerPixel,
    /// Triangles proved right as they were.
    Proved,
    /// Light sources within the image.
    Lights,
}

impl Layer {
    /// All layers.
    pub const ALL: [Self; 6] = [
        Self::Wireframe,
        Self::Pht,
        Self::Leaves,
        Self::PerPixel,
        Self::Proved,
        Self::Lights,
    ];

    /// The name used on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Wireframe => "wireframe",
            Self::Pht => "pht",
            Self::Leaves => "leaves",
            Self::PerPixel => "per-pixel",
            Self::Proved => "proved",
            Self::Lights => "lights",
        }
    }
}

impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Layer {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|layer| layer.name() == text)
            .ok_or_else(|| {
                let names = Self::ALL.map(Self::name).join(", ");
                format!("no layer is called '{text}'; there are {names}")
            })
    }
}

/// How bright the image is left below the overlay.
const DIMMED: f32 = 0.72;

/// Image height for which line widths are meant; on larger images lines are wider.
const NOMINAL_HEIGHT: f32 = 720.0;

/// Draws `layers` over `frame`, which holds the image that `engine` has just rendered of `scene`. What comes out is sRGB, as
/// the colours of the layers are.
pub fn draw_overlay(frame: &mut Frame, engine: &Engine, scene: &Scene, layers: &[Layer]) {
    let (width, height) = (frame.width(), frame.height());
    let Some(size) = IntSize::from_wh(width, height) else {
        return;
    };
    frame.convert(Encoding::Srgb);
    let world = engine.world();
    let view = world.view(scene.camera(), width, height);
    let picture = Picture::new(engine, &view);
    let shows = |layer| layers.contains(&layer);

    tints::apply(&picture, frame.pixels_mut(), shows);
    let Some(mut canvas) = Pixmap::from_vec(frame.as_bytes().to_vec(), size) else {
        return;
    };
    let scale = (height as f32 / NOMINAL_HEIGHT).max(1.0);
    if shows(Layer::Leaves) {
        picture.draw_leaves(shows(Layer::Wireframe), scale, &mut canvas);
    }
    picture.draw_triangles(shows, scale, &mut canvas);
    if shows(Layer::Lights) {
        lights::draw(&picture, scale, &mut canvas);
    }
    let pixels = frame.pixels_mut().as_flattened_mut();
    pixels.copy_from_slice(canvas.data());
}

/// What there is to draw.
struct Picture<'a> {
    world: &'a World,
    view: &'a View,
    /// By vertex.
    corners: Vec<PixelPoint>,
    /// The triangle that owns each pixel, rows from the top.
    ids: Vec<u32>,
    /// What the image shows of visible triangles, those of one triangle consecutive.
    leaves: Vec<Leaf>,
}

impl<'a> Picture<'a> {
    fn new(engine: &'a Engine, view: &'a View) -> Self {
        let world = engine.world();
        let corners: Vec<PixelPoint> = (0..world.positions.len())
            .map(|vertex| view.project(world.positions.get(vertex)))
            .collect();
        let mut leaves = Vec::new();
        engine.for_each_leaf(|leaf| leaves.push(*leaf));
        leaves.sort_by_key(|leaf| leaf.triangle);
        Self {
            world,
            view,
            ids: owners(world, view, &corners),
            corners,
            leaves,
        }
    }

    /// The corners of a triangle of the world.
    fn triangle(&self, triangle: u32) -> [PixelPoint; 3] {
        self.world.triangles[triangle as usize].map(|vertex| self.corners[vertex as usize])
    }

    /// The leaves of each visible triangle.
    fn roots(&self) -> impl Iterator<Item = &[Leaf]> {
        self.leaves.chunk_by(|a, b| a.triangle == b.triangle)
    }

    /// Edges of visible triangles, PHTs above the others.
    fn draw_triangles(&self, shows: impl Fn(Layer) -> bool, scale: f32, canvas: &mut Pixmap) {
        let mut lines = Lines::new(self);
        for leaves in self.roots() {
            let is_pht = leaves[0].is_pht && shows(Layer::Pht);
            let pen = match (is_pht, is_refined(leaves)) {
                (true, false) => Pen::PHT,
                (true, true) => Pen::PHT_REFINED,
                (false, _) if shows(Layer::Wireframe) => Pen::WIREFRAME,
                (false, _) => continue,
            };
            lines.add_polygon(leaves[0].triangle, Bary::ROOT, pen, |_| true);
        }
        lines.draw(scale, canvas);
    }

    /// Edges of leaves; where there is a wireframe, only those inside of their triangles.
    fn draw_leaves(&self, has_wireframe: bool, scale: f32, canvas: &mut Pixmap) {
        let mut lines = Lines::new(self);
        for leaf in self
            .leaves
            .iter()
            .filter(|leaf| leaf.level > 0 && leaf.is_painted)
        {
            lines.add_polygon(leaf.triangle, leaf.corners, Pen::LEAF, |ends| {
                !(has_wireframe && is_on_border(ends))
            });
        }
        lines.draw(scale, canvas);
    }
}

/// Whether the image shows more of a triangle with these leaves than its first interpolation.
fn is_refined(leaves: &[Leaf]) -> bool {
    leaves
        .iter()
        .any(|leaf| leaf.is_painted && (leaf.level > 0 || leaf.kind != LeafKind::Interpolated))
}

/// Whether an edge lies on the border of its root triangle.
fn is_on_border(ends: [Bary; 2]) -> bool {
    ends.iter().all(|end| end.b1 == 0)
        || ends.iter().all(|end| end.b2 == 0)
        || ends.iter().all(|end| end.b1 + end.b2 == Bary::UNIT)
}

/// An sRGB colour.
fn colour([r, g, b]: [u8; 3], alpha: f32) -> Color {
    let mut colour = Color::from_rgba8(r, g, b, 255);
    colour.set_alpha(alpha.clamp(0.0, 1.0));
    colour
}
