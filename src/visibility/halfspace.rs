//! Linear functions of a world point, bounded over boxes and balls.
//!
//! Clipping planes and the depth `w` are linear combinations of the rows of `pixel_from_world`, hence functions
//! `f(p) = n . p + d` of the world point. Over the box of centre c and half-size h, f lies within `|n| . h`
//! (componentwise) of `f(c)`; over the ball of centre c and radius r, within `|n| r`. Ranges are widened by `ROUNDING`
//! times the sum of the magnitudes of all terms, including those that cancelled when rows were combined. That covers
//! the rounding here as well as in what it is compared with: projecting a vertex (8 roundings), measuring its distance
//! from the clipping planes (2) and moving it along edges by clipping (3 for each of 6 planes, every result a convex
//! combination of vertices). So when a range over a set of triangles is negative, `f` is negative at every vertex that
//! clipping these triangles yields, as computed.

use glam::{DMat4, DVec3, DVec4};

/// At most 64 roundings of 2^-53 each, relative to the largest magnitude.
const ROUNDING: f64 = 1.0 / (1_u64 << 46) as f64;

/// A linear function of a world point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Linear {
    /// Its gradient.
    pub(super) gradient: DVec3,
    /// Its value at the origin.
    pub(super) offset: f64,
    /// Length of the gradient.
    length: f64,
    /// What gradient and offset would be without cancellation.
    magnitude: DVec4,
}

/// A closed interval that holds all values of a [`Linear`] function on some set. NaN compares false with everything.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub(super) min: f64,
    pub(super) max: f64,
}

impl Linear {
    /// The combination of the rows x w, y w, z and w of `pixel_from_world` with the given weights.
    pub(super) fn of_rows(pixel_from_world: &DMat4, weights: [f64; 4]) -> Self {
        let (mut sum, mut magnitude) = (DVec4::ZERO, DVec4::ZERO);
        for (i, weight) in weights.into_iter().enumerate() {
            let row = pixel_from_world.row(i) * weight;
            sum += row;
            magnitude += row.abs();
        }
        Self {
            gradient: sum.truncate(),
            offset: sum.w,
            length: sum.truncate().length(),
            magnitude,
        }
    }

    /// The value at `p`.
    pub(super) fn at(&self, p: DVec3) -> f64 {
        self.gradient.dot(p) + self.offset
    }

    /// What rounding may change at points whose components' magnitudes do not exceed those of `reach`.
    pub(super) fn rounding(&self, reach: DVec3) -> f64 {
        ROUNDING * (self.magnitude.truncate().dot(reach) + self.magnitude.w)
    }

    /// Bounds over the box of centre `center` and half-size `half`.
    pub(super) fn over_box(&self, center: DVec3, half: DVec3) -> Interval {
        let spread = self.gradient.abs().dot(half) + self.rounding(center.abs() + half);
        let value = self.at(center);
        Interval {
            min: value - spread,
            max: value + spread,
        }
    }

    /// Bounds over the ball of centre `center` and radius `radius`.
    pub(super) fn over_ball(&self, center: DVec3, radius: f64) -> Interval {
        let spread = self.length * radius + self.rounding(center.abs() + radius);
        let value = self.at(center);
        Interval {
            min: value - spread,
            max: value + spread,
        }
    }
}
