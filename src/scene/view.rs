//! A camera at an image size, as the passes need it.

use crate::math::{PixelPoint, transform_point};
use glam::DMat4;

/// Where the viewer is, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Eye {
    /// At a point (perspective).
    Point([f32; 3]),
    /// In this direction, a unit vector towards the viewer, from everywhere (orthographic).
    Direction([f32; 3]),
}

/// Everything about a view that the passes need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// World space to [homogeneous pixel space](crate::math).
    pub pixel_from_world: DMat4,
    /// Where the viewer is.
    pub eye: Eye,
}

impl View {
    /// A world point in homogeneous pixel space.
    #[inline]
    #[must_use]
    pub fn project(&self, p: [f32; 3]) -> PixelPoint {
        transform_point(&self.pixel_from_world, p)
    }
}
