//! Triangles on the screen with encoded colours, ready to be sorted and painted.

use super::outline::{Outline, corners};
use crate::backend::{BasePaint, Geometry};
use crate::geometry::bary::blend;
use crate::geometry::screen::{TrianglePlanes, normalized_weights};
use crate::geometry::viewport::ScreenPolygon;
use crate::math::PixelPoint;
use crate::output::Encoding;
use crate::output::encode::encode_codes;
use crate::simd::Level;
use std::cmp::Ordering;

/// A triangle on the screen: one of the world's, a part of one, or a piece of a clipped one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    /// Reversed depth by which it is sorted: what is smaller is painted first.
    pub(super) depth: f32,
    /// Place in the order of submission; of equally deep shapes the later ones are painted first, so that the smaller
    /// id is in front.
    pub(super) order: u32,
    /// Corners in pixels, within the guard band, on tiny-skia's [grid](GRID).
    pub(super) points: [[f64; 2]; 3],
    /// Colours of the corners in codes, clamped.
    pub(super) codes: [[f32; 3]; 3],
}

impl Shape {
    /// The order of painting.
    pub(super) fn painting_order(&self, other: &Self) -> Ordering {
        let depth = self.depth.total_cmp(&other.depth);
        depth.then_with(|| other.order.cmp(&self.order))
    }
}

/// Makes shapes of everything that a paint says, one after the other.
pub(super) fn collect(
    shapes: &mut Vec<Shape>,
    level: Level,
    geometry: Geometry<'_>,
    visible: &[u32],
    paint: BasePaint<'_>,
) {
    shapes.clear();
    let world = geometry.world;
    let mut collector = Collector {
        shapes,
        level,
        encoding: geometry.view.encoding,
    };
    match paint {
        BasePaint::Flat(colours) => {
            for &triangle in visible {
                let colour = colours.get(triangle as usize);
                collector.push(corners(geometry, triangle), [colour; 3]);
            }
        }
        BasePaint::Gouraud(colours) => {
            for &triangle in visible {
                let colours = world.triangles[triangle as usize].map(|v| colours.get(v as usize));
                collector.push(corners(geometry, triangle), colours);
            }
        }
        BasePaint::Refined { colours, parts } => {
            let mut parts = parts.iter().peekable();
            for &triangle in visible {
                let mut is_replaced = false;
                while let Some(part) = parts.next_if(|part| part.triangle == triangle) {
                    is_replaced = true;
                    let corners = part.corners.map(|p| geometry.view.project(p));
                    collector.push(corners, part.colours);
                }
                if !is_replaced {
                    let colours =
                        world.triangles[triangle as usize].map(|v| colours.get(v as usize));
                    collector.push(corners(geometry, triangle), colours);
                }
            }
        }
        // Never asked for: they are not among the capabilities.
        BasePaint::Phong | BasePaint::Mixed { .. } => {}
    }
}

struct Collector<'a> {
    shapes: &'a mut Vec<Shape>,
    level: Level,
    encoding: Encoding,
}

impl Collector<'_> {
    /// Adds a triangle with linear colours.
    fn push(&mut self, corners: [PixelPoint; 3], colours: [[f32; 3]; 3]) {
        match Outline::new(corners) {
            Outline::Nothing => {}
            Outline::Whole(polygon) => {
                let codes = self.encode(colours);
                self.push_pieces(corners, &polygon, |index| codes[index]);
            }
            Outline::Clipped(polygon) => self.push_clipped(corners, &polygon, colours),
        }
    }

    /// Adds the pieces of a clipped triangle. Its vertices get the linear colours that the whole one has there; between
    /// them encoded colours are affine, like everywhere.
    fn push_clipped(
        &mut self,
        corners: [PixelPoint; 3],
        polygon: &ScreenPolygon,
        colours: [[f32; 3]; 3],
    ) {
        let planes = TrianglePlanes::new(corners);
        let at = |[x, y]: [f64; 2]| {
            let weights = normalized_weights(planes.edges_at(x, y).map(|e| e.max(0.0)));
            blend(weights.map(|w| w as f32), colours)
        };
        let mut codes = [[0.0; 3]; MOST_VERTICES];
        for (codes, &point) in codes.iter_mut().zip(polygon.points()) {
            encode_codes(self.level, self.encoding, &at(point), codes);
        }
        self.push_pieces(corners, polygon, |index| codes[index]);
    }

    /// Adds the triangles of a polygon's fan, all at the depth of the triangle that it is left of.
    fn push_pieces(
        &mut self,
        corners: [PixelPoint; 3],
        polygon: &ScreenPolygon,
        codes: impl Fn(usize) -> [f32; 3],
    ) {
        let depth = sorting_depth(corners);
        let points = polygon.points();
        for i in 2..points.len() {
            let fan = [0, i - 1, i];
            self.shapes.push(Shape {
                depth,
                order: self.shapes.len() as u32,
                points: fan.map(|k| points[k].map(snap)),
                codes: fan.map(&codes),
            });
        }
    }

    fn encode(&self, colours: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
        let mut codes = [[0.0; 3]; 3];
        encode_codes(
            self.level,
            self.encoding,
            colours.as_flattened(),
            codes.as_flattened_mut(),
        );
        codes
    }
}

/// tiny-skia's sub-pixels.
pub(super) const GRID: f64 = 64.0;

/// Rounds a coordinate to tiny-skia's grid. Colours are interpolated between corners on the grid, too: a pixel is
/// inside of those. It may be outside of the exact ones, and a plane through the corners of a sliver rises steeply
/// there.
pub(super) fn snap(coordinate: f64) -> f64 {
    (coordinate * GRID).round() / GRID
}

/// Most vertices of a clipped triangle.
const MOST_VERTICES: usize = 9;

/// The depth that a triangle is sorted by: of a corner in front of the near plane, that of the near plane.
fn sorting_depth(corners: [PixelPoint; 3]) -> f32 {
    let depths = corners.map(|[_, _, z, w]| {
        if w > 0.0 {
            (z / w).clamp(0.0, 1.0)
        } else {
            1.0
        }
    });
    ((depths[0] + depths[1] + depths[2]) / 3.0) as f32
}
