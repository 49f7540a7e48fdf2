//! The snapped outline of what clipping left of a triangle.

use crate::geometry::screen::{PixelBox, clip, doubled_area, snap};
use crate::math::PixelPoint;

/// The snapped outline of what clipping left of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    points: [[i32; 2]; 9],
    len: usize,
}

impl Outline {
    /// Empty when clipping leaves nothing.
    pub(super) fn of_clipped(corners: [PixelPoint; 3]) -> Self {
        let polygon = clip(corners);
        let mut points = [[0; 2]; 9];
        for (point, &vertex) in points.iter_mut().zip(polygon.vertices()) {
            *point = snap(vertex);
        }
        Self {
            points,
            len: polygon.vertices().len(),
        }
    }

    /// The triangles of its fan.
    pub(super) fn fan(&self) -> impl Iterator<Item = [[i32; 2]; 3]> {
        let points = &self.points[..self.len];
        let rest = points.get(1..).unwrap_or_default();
        rest.windows(2).map(|p| [points[0], p[0], p[1]])
    }

    /// Twice its signed area in squared sub-pixels, exactly.
    pub(super) fn doubled_area(&self) -> i64 {
        self.fan().map(doubled_area).sum()
    }

    /// The pixels that may be covered.
    pub(super) fn pixel_box(&self, width: u32, height: u32) -> Option<PixelBox> {
        PixelBox::of_snapped(&self.points[..self.len], width, height)
    }
}
