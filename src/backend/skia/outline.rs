//! Where a triangle is on the screen.
//!
//! Facing is decided by the sign of the exact corners' determinant, in `f64`, not by a snapped area: tiny-skia snaps
//! to a grid of its own, and a sliver that one grid turns around and leaves out the other may have pixels for. All
//! triangles that face the viewer are drawn, whichever way snapping turns them. Snapping moves shared corners
//! together, so what faces the viewer keeps covering all of its region.

use crate::backend::Geometry;
use crate::geometry::screen::{TrianglePlanes, clip, outcode};
use crate::geometry::viewport::{ScreenPolygon, ScreenRect};
use crate::math::PixelPoint;

/// A triangle without a pixel centre this close to its box cannot get a pixel, however corners are snapped: a 64th of a
/// pixel would do.
const SNAP_MARGIN_PX: f64 = 1.0 / 32.0;

/// The corners of one of the world's triangles in homogeneous pixel space.
pub(super) fn corners(geometry: Geometry<'_>, triangle: u32) -> [PixelPoint; 3] {
    let world = geometry.world;
    world.triangles[triangle as usize]
        .map(|v| geometry.view.project(world.positions.get(v as usize)))
}

/// What is left of a triangle inside of the near and far planes and the guard band, in homogeneous pixel space and on
/// the screen.
#[derive(Clone, Copy, Debug)]
pub(super) enum Outline {
    /// Nothing.
    Nothing,
    /// All of it.
    Whole(ScreenPolygon),
    /// A part.
    Clipped(ScreenPolygon),
}

impl Outline {
    /// Clips a triangle.
    pub(super) fn new(corners: [PixelPoint; 3]) -> Self {
        let codes = corners.map(outcode);
        if codes[0] & codes[1] & codes[2] != 0 {
            return Self::Nothing;
        }
        if codes == [0; 3] {
            // In front of the eye: w is positive.
            let points = corners.map(|[x, y, _, w]| [x / w, y / w]);
            return Self::Whole(ScreenPolygon::triangle(points));
        }
        let polygon = ScreenPolygon::of_clipped(&clip(corners));
        if polygon.points().is_empty() {
            Self::Nothing
        } else {
            Self::Clipped(polygon)
        }
    }
}

/// What becomes of one of the world's triangles in a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fate {
    /// It shows its back.
    FacesAway,
    /// No pixel centre is near it.
    OffScreen,
    /// It may get pixels.
    Drawn {
        /// Its area inside of the image, in pixels.
        area: f64,
        /// Whether it had to be clipped.
        clipped: bool,
    },
}

/// Decides whether a triangle is drawn.
pub(super) fn fate(geometry: Geometry<'_>, triangle: u32) -> Fate {
    let corners = corners(geometry, triangle);
    if TrianglePlanes::new(corners).facing() < 0.0 {
        return Fate::FacesAway;
    }
    let (polygon, clipped) = match Outline::new(corners) {
        Outline::Nothing => return Fate::OffScreen,
        Outline::Whole(polygon) => (polygon, false),
        Outline::Clipped(polygon) => (polygon, true),
    };
    let view = geometry.view;
    if !polygon
        .bounds()
        .is_some_and(|bounds| nears_a_centre(&bounds, view.width, view.height))
    {
        return Fate::OffScreen;
    }
    let image = ScreenRect::image(view.width, view.height);
    Fate::Drawn {
        area: polygon.cut_to(&image).area(),
        clipped,
    }
}

/// Whether the centre of some pixel lies in the rectangle or next to it.
fn nears_a_centre(rect: &ScreenRect, width: u32, height: u32) -> bool {
    let sizes = [f64::from(width), f64::from(height)];
    (0..2).all(|axis| {
        let first = (rect.min[axis] - SNAP_MARGIN_PX - 0.5).ceil().max(0.0);
        let last = (rect.max[axis] + SNAP_MARGIN_PX - 0.5)
            .floor()
            .min(sizes[axis] - 1.0);
        first <= last
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rectangle_between_pixel_centres_nears_none() {
        let rect = |min: f64, max: f64| ScreenRect {
            min: [min, 0.0],
            max: [max, 1.0],
        };
        assert!(!nears_a_centre(&rect(0.6, 1.4), 4, 4));
        assert!(nears_a_centre(&rect(0.6, 1.49), 4, 4));
        assert!(nears_a_centre(&rect(0.51, 0.6), 4, 4));
        assert!(!nears_a_centre(&rect(-9.0, 0.4), 4, 4));
        assert!(!nears_a_centre(&rect(3.6, 9.0), 4, 4));
        assert!(!nears_a_centre(&rect(-9.0, 9.0), 0, 4));
    }
}
