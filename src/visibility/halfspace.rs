//! Linear functions of a world point, bounded over balls.
//!
//! Clipping planes and the depth `w` are linear combinations of the rows of `pixel_from_world`, hence functions
//! `f(p) = n . p + d` of the world point. Over the ball of centre c and radius r, f lies within `|n| r` of `f(c)`.
//! Ranges are widened by `ROUNDING` times the sum of the magnitudes of all terms, including those that cancelled when
//! rows were combined. That covers the rounding here as well as in what it is compared with: projecting a vertex (8
//! roundings), measuring its distance from the clipping planes (2) and moving it along edges by clipping (3 for each
//! of 6 planes, every result a convex combination of vertices). So when a range over a set of triangles is negative,
//! `f` is negative at every vertex that clipping these triangles yields, as computed.
//!
//! With `m_k` the magnitudes of n and the ball's [`reach`](super::block::Balls) `R = |c_x| + |c_y| + |c_z| + 3 r`, the
//! sum of the terms' magnitudes in the ball is at most `sum m_k (|c_k| + r) + m_d <= max(m_k) R + m_d`: two constants
//! for a view.

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
    pub(super) length: f64,
    /// What rounding may change, for each unit of reach and in any case.
    rounding: [f64; 2],
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
        let steepest = magnitude.x + magnitude.y + magnitude.z;
        Self {
            gradient: sum.truncate(),
            offset: sum.w,
            length: sum.truncate().length(),
            rounding: [ROUNDING * steepest, ROUNDING * magnitude.w],
        }
    }

    /// The value at `p`.
    #[inline(always)]
    pub(super) fn at(&self, [x, y, z]: [f64; 3]) -> f64 {
        let n = self.gradient;
        n.x * x + n.y * y + n.z * z + self.offset
    }

    /// What rounding may change in a ball of that reach.
    #[inline(always)]
    pub(super) fn rounding(&self, reach: f64) -> f64 {
        self.rounding[0] * reach + self.rounding[1]
    }

    /// Bounds over the ball about `center`.
    #[inline(always)]
    pub(super) fn over_ball(&self, center: [f64; 3], radius: f64, reach: f64) -> Interval {
        let spread = self.length * radius + self.rounding(reach);
        let value = self.at(center);
        Interval {
            min: value - spread,
            max: value + spread,
        }
    }
}
