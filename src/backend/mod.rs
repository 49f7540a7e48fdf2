//! A device that can draw Gouraud-shaded triangles.
//!
//! The engine asks a [`Backend`] for an image in two steps, [`rasterize`](Backend::rasterize) (which pixels does each
//! triangle own?) and [`resolve`](Backend::resolve) (what colour are they?), so that vertices of triangles without a
//! visible pixel are never illuminated. A backend that has the [capability](Capabilities) then repaints parts of
//! single triangles as they are refined.

pub mod software;

use crate::geometry::{Bary, Vec3s};
use crate::illumination::ActiveLights;
use crate::output::Target;
use crate::parallel::Exec;
use crate::scene::{View, World};
use std::fmt::Debug;
use std::ops::Range;

/// What a backend can do beyond drawing Gouraud triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capabilities {
    /// It knows which triangle owns each pixel, hence counts visible pixels, and repaints by id.
    pub ids: bool,
    /// It can evaluate the illumination equation at every pixel.
    pub per_pixel: bool,
}

/// What there is to draw.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<'a> {
    /// The scene.
    pub world: &'a World,
    /// From where.
    pub view: &'a View,
    /// Ranges of triangles that may be visible, ascending and disjoint.
    pub visible: &'a [Range<u32>],
}

/// Counts of one [`Backend::rasterize`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RasterCounts {
    /// Triangles handed in.
    pub submitted: u64,
    /// Those that faced away and were not two-sided.
    pub back_facing: u64,
    /// Those outside of the view, or between pixel centres.
    pub off_screen: u64,
    /// Those that had to be clipped.
    pub clipped: u64,
    /// Those sent to tiles.
    pub drawn: u64,
    /// Pixels covered by anything.
    pub covered_pixels: u64,
    /// Tiles without any covered pixel.
    pub background_tiles: u64,
}

/// How the whole image gets its colours.
#[derive(Clone, Copy, Debug)]
pub enum BasePaint<'a> {
    /// Linear colours of the world's vertices, interpolated (those of visible triangles are valid).
    Gouraud(&'a Vec3s),
    /// One linear colour for each of the world's triangles (those of visible triangles are valid).
    Flat(&'a Vec3s),
    /// The illumination equation at every pixel, all lights.
    Phong,
}

/// A part of one of the world's triangles, to be painted anew.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// The world's triangle.
    pub triangle: u32,
    /// The part's corners in it, counter-clockwise like the triangle itself.
    pub corners: [Bary; 3],
    /// Its colours.
    pub fill: Fill,
    /// Set by the backend: how many pixels were painted.
    pub pixels: u32,
}

/// The colours of a [`Patch`].
#[derive(Clone, Copy, Debug)]
pub enum Fill {
    /// Linear colours at the patch's corners, interpolated.
    Gouraud([[f32; 3]; 3]),
    /// The illumination equation at every pixel.
    Phong {
        /// Terms that are evaluated, besides ambient light.
        lights: ActiveLights,
        /// What to add, interpolated between the corners of the *whole* triangle: the share of all other terms.
        remainder: [[f32; 3]; 3],
    },
}

/// A device that draws Gouraud-shaded triangles, pixel coverage and ownership being those of
/// [`geometry::screen`](crate::geometry::screen) if it has ids.
///
/// Results do not depend on `exec`'s threads.
pub trait Backend: Debug + Send {
    /// What it can do.
    fn capabilities(&self) -> Capabilities;

    /// Starts a new image and finds out who owns which pixel.
    fn rasterize(&mut self, exec: Exec, geometry: Geometry<'_>) -> RasterCounts;

    /// With ids: the triangles that own a pixel, ascending.
    fn visible_triangles(&self) -> &[u32];

    /// With ids: how many pixels the triangle owns.
    fn visible_pixels(&self, triangle: u32) -> u32;

    /// Gives every pixel of the image its colour.
    fn resolve(&mut self, exec: Exec, geometry: Geometry<'_>, paint: BasePaint<'_>);

    /// With ids: paints exactly the pixels that each patch's triangle owns inside the patch, and counts them. Patches
    /// of one call must not overlap. A pixel on the border of two adjacent patches belongs to exactly one.
    fn repaint(&mut self, exec: Exec, geometry: Geometry<'_>, patches: &mut [Patch]);

    /// How many pixels [`present`](Self::present) would have to write to `target` now.
    fn pending_pixels(&self, target: &Target<'_>) -> u64;

    /// Brings `target` up to the current image and marks it with its stamp; pixels known to be right already are not
    /// touched. Returns the number of pixels written: none if the target has another size than the image.
    fn present(&mut self, exec: Exec, target: &mut Target<'_>) -> u64;
}
