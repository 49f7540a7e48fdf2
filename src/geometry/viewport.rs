//! Clipped triangles as polygons on the screen, cut to a rectangle, and how many pixels they cover.
//!
//! [`screen::clip`](super::screen::clip) leaves coordinates of up to ±16384 pixels. A device that draws polygons by
//! itself, and an estimate of the visible area, need what is left of them inside a rectangle of the image. The cut is
//! Sutherland and Hodgman's in two dimensions; the point where an edge leaves is computed from its inside end to its
//! outside end, so that two polygons sharing the edge get the same bits from both sides.
//!
//! Units are pixels, the origin is the image's top left corner.

use super::screen::ClippedPolygon;

/// Nine vertices of a clipped triangle and one more for each side of a rectangle.
const MOST_VERTICES: usize = 13;

/// A rectangle of the image, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenRect {
    /// Left and top.
    pub min: [f64; 2],
    /// Right and bottom.
    pub max: [f64; 2],
}

impl ScreenRect {
    /// All of an image.
    #[must_use]
    pub fn image(width: u32, height: u32) -> Self {
        Self {
            min: [0.0; 2],
            max: [f64::from(width), f64::from(height)],
        }
    }

    /// Signed distances from the four sides; inside where not negative.
    #[inline]
    fn side_distances(&self, p: [f64; 2]) -> [f64; 4] {
        [
            p[0] - self.min[0],
            self.max[0] - p[0],
            p[1] - self.min[1],
            self.max[1] - p[1],
        ]
    }
}

/// A convex polygon on the screen.
#[derive(Clone, Copy, Debug)]
pub struct ScreenPolygon {
    points: [[f64; 2]; MOST_VERTICES],
    len: usize,
}

impl ScreenPolygon {
    /// Nothing.
    pub const EMPTY: Self = Self {
        points: [[0.0; 2]; MOST_VERTICES],
        len: 0,
    };

    /// A triangle.
    #[must_use]
    pub fn triangle(corners: [[f64; 2]; 3]) -> Self {
        let mut polygon = Self::EMPTY;
        polygon.points[..3].copy_from_slice(&corners);
        polygon.len = 3;
        polygon
    }

    /// What clipping left of a triangle, projected. Nothing when a vertex has no finite place on the screen.
    #[must_use]
    pub fn of_clipped(clipped: &ClippedPolygon) -> Self {
        let mut polygon = Self::EMPTY;
        for &[x, y, _, w] in clipped.vertices() {
            let point = [x / w, y / w];
            if !(point[0].is_finite() && point[1].is_finite()) {
                return Self::EMPTY;
            }
            polygon.push(point);
        }
        polygon
    }

    /// Its vertices in order; fewer than three when there is nothing.
    #[must_use]
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points[..self.len]
    }

    /// The smallest rectangle around it, or `None` when there is nothing.
    #[must_use]
    pub fn bounds(&self) -> Option<ScreenRect> {
        let (first, rest) = self.points().split_first()?;
        let start = ScreenRect {
            min: *first,
            max: *first,
        };
        Some(rest.iter().fold(start, |rect, p| ScreenRect {
            min: [rect.min[0].min(p[0]), rect.min[1].min(p[1])],
            max: [rect.max[0].max(p[0]), rect.max[1].max(p[1])],
        }))
    }

    /// What of it lies inside the rectangle.
    #[must_use]
    pub fn cut_to(self, rect: &ScreenRect) -> Self {
        let mut polygon = self;
        for side in 0..4 {
            let distance = |p: [f64; 2]| rect.side_distances(p)[side];
            if polygon.points().iter().all(|&p| distance(p) >= 0.0) {
                continue;
            }
            let input = polygon;
            polygon.len = 0;
            for i in 0..input.len {
                let (a, b) = (input.points[i], input.points[(i + 1) % input.len]);
                let (da, db) = (distance(a), distance(b));
                if da >= 0.0 {
                    polygon.push(a);
                }
                if (da >= 0.0) != (db >= 0.0) {
                    polygon.push(if da >= 0.0 {
                        leave(a, b, da, db)
                    } else {
                        leave(b, a, db, da)
                    });
                }
            }
        }
        if polygon.len < 3 {
            polygon.len = 0;
        }
        polygon
    }

    /// Its area in square pixels, never negative.
    #[must_use]
    pub fn area(&self) -> f64 {
        let points = self.points();
        let Some(&o) = points.first() else {
            return 0.0;
        };
        let doubled: f64 = points[1..]
            .windows(2)
            .map(|p| (p[0][0] - o[0]) * (p[1][1] - o[1]) - (p[0][1] - o[1]) * (p[1][0] - o[0]))
            .sum();
        (doubled * 0.5).abs()
    }

    fn push(&mut self, point: [f64; 2]) {
        // Rounding cannot make a convex polygon cross a side more than twice; it would be cut short then.
        if self.len < MOST_VERTICES {
            self.points[self.len] = point;
            self.len += 1;
        }
    }
}

/// Where the edge from `inside` to `outside` leaves the half-plane; distances `di >= 0 > d_o`.
fn leave(inside: [f64; 2], outside: [f64; 2], di: f64, d_o: f64) -> [f64; 2] {
    let t = di / (di - d_o);
    std::array::from_fn(|k| inside[k] + (outside[k] - inside[k]) * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::screen::clip;
    use proptest::prelude::*;

    fn inside(corners: [[f64; 2]; 3], p: [f64; 2]) -> bool {
        let side = |a: [f64; 2], b: [f64; 2]| {
            (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) >= 0.0
        };
        let [a, b, c] = corners;
        let sides = [side(a, b), side(b, c), side(c, a)];
        sides == [true; 3] || sides == [false; 3]
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Against counting the points of a fine grid.
        #[test]
        fn the_area_of_a_cut_triangle_is_what_counting_finds(
            corners in prop::array::uniform3(prop::array::uniform2(-12.0..20.0_f64)),
        ) {
            let rect = ScreenRect { min: [1.0, 2.0], max: [9.0, 7.0] };
            let cut = ScreenPolygon::triangle(corners).cut_to(&rect);
            let steps = 20;
            let mut hits = 0;
            for i in 0..8 * steps {
                for j in 0..5 * steps {
                    let at = |first: f64, i: i32| first + (f64::from(i) + 0.5) / f64::from(steps);
                    hits += i32::from(inside(corners, [at(1.0, i), at(2.0, j)]));
                }
            }
            let counted = f64::from(hits) / f64::from(steps * steps);
            // A line through the rectangle passes some 13 * 20 cells, half of which may be counted wrong; three lines.
            prop_assert!((cut.area() - counted).abs() < 0.6, "{} {counted}", cut.area());
            if let Some(bounds) = cut.bounds() {
                let slack = 1e-9;
                prop_assert!(bounds.min[0] >= 1.0 - slack && bounds.max[0] <= 9.0 + slack);
                prop_assert!(bounds.min[1] >= 2.0 - slack && bounds.max[1] <= 7.0 + slack);
            }
        }

        #[test]
        fn an_edge_is_cut_to_the_same_bits_from_both_sides(
            p in prop::array::uniform4(prop::array::uniform2(-30.0..30.0_f64)),
        ) {
            let rect = ScreenRect::image(10, 10);
            let [a, b, c, d] = p;
            let on_edge = |third: [f64; 2], first: [f64; 2], second: [f64; 2]| {
                let cut = ScreenPolygon::triangle([first, second, third]).cut_to(&rect);
                let is_on = |q: &&[f64; 2]| {
                    let cross = (b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0]);
                    cross.abs() < 1e-9
                };
                let mut bits: Vec<_> = cut.points().iter().filter(is_on).map(|q| q.map(f64::to_bits)).collect();
                bits.sort_unstable();
                bits
            };
            // Unless the third corner hides the edge's ends, both sides find the same points of it.
            let (left, right) = (on_edge(c, a, b), on_edge(d, b, a));
            if left.len() == 2 && right.len() == 2 {
                prop_assert_eq!(left, right);
            }
        }
    }

    #[test]
    fn places_that_are_no_numbers_leave_nothing() {
        let corner = |x: f64| [x, 1.0, 0.5, 1.0];
        for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let polygon = ScreenPolygon::of_clipped(&clip([corner(0.0), corner(odd), corner(2.0)]));
            assert!(polygon.points().iter().flatten().all(|c| c.is_finite()));
        }
        assert_eq!(ScreenPolygon::EMPTY.area(), 0.0);
        assert_eq!(ScreenPolygon::EMPTY.bounds(), None);
        let nothing = ScreenPolygon::EMPTY.cut_to(&ScreenRect::image(3, 3));
        assert!(nothing.points().is_empty());
    }
}
