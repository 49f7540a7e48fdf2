//! The subdivisions of Cho, Neumann and Woo, *Improved Specular Highlights with Adaptive Shading*, as baselines.
//!
//! * [`regular`] (section 3.2): potentially highlighted triangles and their neighbours are split in four until the parts are small on the
//!   screen.
//! * [`highlight`] (section 3.1): a vertex is put on the [centre] of each highlight, and more of them on the edges that meet there.
//!
//! Each triangle is subdivided on its own, so T-junctions arise, and with them steps in colour; the paper has them, too. Parts never
//! overlap and leave nothing out: corners are on the [grid](Bary) of the root's barycentric coordinates, to which a vertex that is
//! not on it is rounded.

pub mod centre;
pub mod highlight;
pub mod regular;

use crate::geometry::Bary;

/// How far the paper's methods go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperRule {
    /// `regular`: how many rings of neighbours, that share a vertex, are subdivided with a potentially highlighted triangle.
    pub rings: u32,
    /// `regular`: triangles are split until they have less than this area on the screen, in pixels.
    pub area_px: f32,
    /// `highlight`: an edge gets a vertex in its middle if the intensity there differs from the interpolated one by more than this
    /// share of the larger of both.
    pub difference: f32,
    /// `highlight`: the last step to a centre is shorter than this, in barycentric coordinates.
    pub accuracy: f64,
}

impl Default for PaperRule {
    /// The paper's (section 4); it does not say how accurate centres are.
    fn default() -> Self {
        Self {
            rings: 1,
            area_px: 32.0,
            difference: 0.3,
            accuracy: 1e-3,
        }
    }
}

/// A part of a root triangle that takes its place, between linear colours at the corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperPart {
    /// The root, a triangle of the world.
    pub triangle: u32,
    /// Corners in it, counter-clockwise like it.
    pub corners: [Bary; 3],
    /// Linear colours there.
    pub colours: [[f32; 3]; 3],
}
