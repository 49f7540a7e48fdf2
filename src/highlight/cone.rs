//! Cosines between directions that vary over a triangle, bounded in two ways.
//!
//! Normals, and vectors to a light or viewer at a point, are all of one kind: the direction of `X = sum w_i X_i` with
//! the barycentrics `w` of the point (for lights and viewers because `q - p` is linear in `p`). Write `X_i = p_i x_i`
//! with unit `x_i`.
//!
//! **Cone.** A circular cone of half-angle below 90 degrees is convex; holding the three `X_i` it holds every `X`. No bounding
//! sphere is needed. Angles between members of two cones differ from that of the axes by at most the sum of the half-angles.
//! This is first order in the triangle's size.
//!
//! **Deviation.** How far can `f = x.y` be from the interpolation `lin = sum w_i x_i.y_i` of its corner values? Let
//! `P = sum w_i p_i`, `Q` likewise for `y`, and `a_i = w_i p_i / P`, `b_i = w_i q_i / Q`, which are barycentrics too. Then
//!
//! ```text
//! X.Y / (P Q) - lin = sum_ij a_i b_j x_i.(y_j - y_i) + sum_i (a_i - w_i) x_i.y_i
//!                   = sum_{i<j} w_i w_j [ (p_i q_j x_i - p_j q_i x_j).(y_j - y_i) / (P Q)
//!                                       + (p_i - p_j) (f_i - f_j) / P ]
//! ```
//!
//! whose brackets are products of differences, hence of second order, and `sum_{i<j} w_i w_j <= 1/3`. The lengths obey
//! `1 >= (|X| / P)^2 = 1 - 2 sum_{i<j} a_i a_j (1 - x_i.x_j) >= 1 - 2/3 max (1 - x_i.x_j)`. With `z_x >= P / |X|` from this,
//! `f = X.Y / (P Q) * P/|X| * Q/|Y|` differs from `lin` by at most `max|f_i| (z_x z_y - 1) + z_x z_y e`, `e` being a third
//! of the largest bracket. On fine meshes that is thousands of times smaller than the cones' interval.
//!
//! **Padding.** Inputs are `f32` taken as exact, and this arithmetic is `f64` (angles from cosines are good to 3e-8). The
//! picture is interpolated in `f32`, though; cones are widened and deviations increased by [`PAD`], or more where the rounding of a
//! position (of the size of the scene) turns the direction to something near. Vectors without direction, cones that are too wide and
//! numbers that are not finite give the trivial interval.

use glam::DVec3;

/// Radians, or units of a cosine, that everything is padded with.
pub(super) const PAD: f64 = 1e-6;

/// An angle in `[0, pi]`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Angle {
    pub(super) cos: f64,
    sin: f64,
}

impl Angle {
    pub(super) const STRAIGHT: Self = Self {
        cos: -1.0,
        sin: 0.0,
    };

    #[inline]
    pub(super) fn from_cos(cos: f64) -> Self {
        let cos = cos.clamp(-1.0, 1.0);
        Self {
            cos,
            sin: ((1.0 - cos) * (1.0 + cos)).sqrt(),
        }
    }

    /// From a sine in `[0, 1]`, at most a right angle.
    #[inline]
    pub(super) fn from_sin(sin: f64) -> Self {
        let sin = sin.clamp(0.0, 1.0);
        Self {
            cos: ((1.0 - sin) * (1.0 + sin)).sqrt(),
            sin,
        }
    }

    /// An angle below 0.01; the error of its cosine is below 1e-9.
    #[inline]
    pub(super) fn small(angle: f64) -> Self {
        Self {
            cos: 1.0 - 0.5 * angle * angle,
            sin: angle,
        }
    }

    /// The sum, or a straight angle where that is more.
    #[inline]
    pub(super) fn plus(self, other: Self) -> Self {
        let sin = self.sin * other.cos + self.cos * other.sin;
        // Both are in [0, pi], so the sine is negative exactly where the sum is beyond pi. Two straight angles give 0.
        if sin < 0.0 || (self.cos < 0.0 && other.cos < 0.0) {
            return Self::STRAIGHT;
        }
        Self {
            cos: self.cos * other.cos - self.sin * other.sin,
            sin,
        }
    }

    /// The difference, or zero where that is less.
    #[inline]
    pub(super) fn minus(self, other: Self) -> Self {
        let sin = self.sin * other.cos - self.cos * other.sin;
        if sin < 0.0 || other.cos <= -1.0 {
            return Self { cos: 1.0, sin: 0.0 };
        }
        Self {
            cos: self.cos * other.cos + self.sin * other.sin,
            sin,
        }
    }
}

/// A direction as it varies over a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Directions {
    /// At the corners; zero where there is none.
    unit: [DVec3; 3],
    length: [f64; 3],
    /// One over the least length.
    per_length: f64,
    /// The cone.
    pub(super) axis: DVec3,
    pub(super) spread: Angle,
    /// Bound of the sum of weighted lengths over the length of the weighted sum; infinite when unknown.
    stretch: f64,
    /// Radians by which rounding may turn it.
    pub(super) pad: f64,
}

impl Directions {
    /// Of the vectors at the corners. `blur` is the size of rounding errors in them.
    pub(super) fn new(vectors: [DVec3; 3], blur: f64) -> Self {
        let [a, b, c] = vectors;
        let length = [a.length(), b.length(), c.length()];
        let inverse = [1.0 / length[0], 1.0 / length[1], 1.0 / length[2]];
        let per_length = greatest(inverse);
        if !(least(length) > 0.0 && per_length.is_finite() && greatest(length).is_finite()) {
            return Self::wide(vectors, length);
        }
        let unit = [a * inverse[0], b * inverse[1], c * inverse[2]];
        let sum = unit[0] + unit[1] + unit[2];
        let axis = sum * (1.0 / sum.length());
        let cos = least([unit[0].dot(axis), unit[1].dot(axis), unit[2].dot(axis)]);
        // Nearly 90 degrees is no better than wide; the comparison is false for an axis that is not a number.
        let pad = PAD + 2.0 * blur * per_length;
        if !(cos > 0.01 && pad < 0.01) {
            return Self::wide(vectors, length);
        }
        let farthest = 1.0
            - least([
                unit[0].dot(unit[1]),
                unit[0].dot(unit[2]),
                unit[1].dot(unit[2]),
            ]);
        Self {
            unit,
            length,
            per_length,
            axis,
            spread: Angle::from_cos(cos).plus(Angle::small(pad)),
            stretch: stretch(farthest),
            pad,
        }
    }

    /// The same unit vector everywhere.
    pub(super) fn constant(v: DVec3) -> Self {
        Self::new([v; 3], 0.0)
    }

    /// Whether the scalar product with `sum w_j Y_j` is proved negative everywhere, from the corners alone. `blur` is the size of
    /// rounding errors in `Y`.
    #[inline]
    pub(super) fn face_away_from(&self, vectors: &[DVec3; 3], blur: f64) -> bool {
        vectors.iter().all(|y| {
            let pad = PAD * (y.x.abs() + y.y.abs() + y.z.abs()) + 2.0 * blur;
            let greatest = greatest([
                self.unit[0].dot(*y),
                self.unit[1].dot(*y),
                self.unit[2].dot(*y),
            ]);
            greatest < -pad
        })
    }

    /// At the corners, with their lengths.
    #[inline]
    pub(super) fn vectors(&self) -> [DVec3; 3] {
        let [a, b, c] = self.unit;
        [a * self.length[0], b * self.length[1], c * self.length[2]]
    }

    fn wide(vectors: [DVec3; 3], length: [f64; 3]) -> Self {
        Self {
            unit: vectors.map(DVec3::normalize_or_zero),
            length,
            per_length: f64::INFINITY,
            axis: DVec3::Z,
            spread: Angle::STRAIGHT,
            stretch: f64::INFINITY,
            pad: PAD,
        }
    }
}

/// Bound of the sum of weighted lengths over the length of the weighted sum, `farthest` being the greatest `1 - x_i.x_j`.
#[inline]
pub(super) fn stretch(farthest: f64) -> f64 {
    let lost = (2.0 / 3.0 * farthest).max(0.0);
    // sqrt(1 - e) >= 1 - e/2 - e^2/2 for 0 <= e <= 1.
    let shrink = 1.0 - 0.5 * lost * (1.0 + lost);
    if lost < 0.9 {
        1.0 / shrink
    } else {
        f64::INFINITY
    }
}

/// A quantity as it varies over a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Varying {
    /// At the corners.
    pub(super) at: [f64; 3],
    /// Lower bound.
    pub(super) lo: f64,
    /// Upper bound.
    pub(super) hi: f64,
    /// Bound of the difference from the linear interpolation of `at`.
    pub(super) deviation: f64,
}

impl Varying {
    /// Tightens a first interval by what `deviation` implies, and the deviation by the interval.
    #[inline]
    pub(super) fn new(at: [f64; 3], lo: f64, hi: f64, deviation: f64) -> Self {
        let lo = lo.max(least(at) - deviation);
        let hi = hi.min(greatest(at) + deviation);
        Self {
            at,
            lo,
            hi,
            deviation: deviation.min(hi - lo),
        }
    }

    /// The cosine of the angle between two directions.
    #[inline]
    pub(super) fn cosine(x: &Directions, y: &Directions) -> Self {
        let apart = Angle::from_cos(x.axis.dot(y.axis));
        let spread = x.spread.plus(y.spread);
        let at = [
            x.unit[0].dot(y.unit[0]),
            x.unit[1].dot(y.unit[1]),
            x.unit[2].dot(y.unit[2]),
        ];
        Self::new(
            at,
            apart.plus(spread).cos,
            apart.minus(spread).cos,
            deviation(x, y, at),
        )
    }

    /// Without the corner values themselves.
    #[inline]
    pub(super) fn quantity(&self) -> Quantity {
        Quantity {
            lo: self.lo,
            hi: self.hi,
            deviation: self.deviation,
            range: greatest(self.at) - least(self.at),
            magnitude: magnitude(self.at),
        }
    }
}

/// What is known of a quantity on a triangle, or on each of several.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quantity {
    /// Lower bound.
    pub(super) lo: f64,
    /// Upper bound.
    pub(super) hi: f64,
    /// Bound of the difference from what is interpolated between a triangle's corners.
    pub(super) deviation: f64,
    /// How far apart the values at a triangle's corners are at most.
    pub(super) range: f64,
    /// The largest absolute value at a corner, or more.
    pub(super) magnitude: f64,
}

impl Quantity {
    /// Bound of the deviation of the product with another from the interpolation of its corner values: with both written as
    /// linear part and rest, `sum w_i a_i b_i - lin(a) lin(b) = sum_{i<j} w_i w_j (a_i - a_j) (b_i - b_j)`.
    #[inline]
    pub(super) fn product_deviation(&self, other: &Self) -> f64 {
        self.deviation * other.magnitude
            + other.deviation * self.magnitude
            + self.deviation * other.deviation
            + self.range * other.range / 3.0
    }
}

#[inline]
fn deviation(x: &Directions, y: &Directions, f: [f64; 3]) -> f64 {
    let stretch = x.stretch * y.stretch;
    if !stretch.is_finite() {
        return f64::INFINITY;
    }
    let (p, q) = (&x.length, &y.length);
    let per_product = x.per_length * y.per_length;
    let bracket = |i: usize, j: usize| {
        let turned = x.unit[i] * (p[i] * q[j]) - x.unit[j] * (p[j] * q[i]);
        turned.dot(y.unit[j] - y.unit[i]).abs() * per_product
            + ((p[i] - p[j]) * (f[i] - f[j])).abs() * x.per_length
    };
    let brackets = [bracket(0, 1), bracket(0, 2), bracket(1, 2)];
    magnitude(f) * (stretch - 1.0) + stretch * greatest(brackets) * (1.0 / 3.0) + x.pad + y.pad
}

#[inline]
fn magnitude([a, b, c]: [f64; 3]) -> f64 {
    greatest([a.abs(), b.abs(), c.abs()])
}

/// The least of numbers. Comparisons, as `f64::min` takes three times as long.
#[inline]
pub(super) fn least([a, b, c]: [f64; 3]) -> f64 {
    let ab = if b < a { b } else { a };
    if c < ab { c } else { ab }
}

/// The greatest, likewise.
#[inline]
pub(super) fn greatest([a, b, c]: [f64; 3]) -> f64 {
    let ab = if b > a { b } else { a };
    if c > ab { c } else { ab }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn angles_add_and_subtract_within_their_range() {
        let angle = |a: f64| Angle::from_cos(a.cos());
        for i in 0..=40 {
            for j in 0..=40 {
                let (a, b) = (PI * f64::from(i) / 40.0, PI * f64::from(j) / 40.0);
                let sum = angle(a).plus(angle(b)).cos;
                let difference = angle(a).minus(angle(b)).cos;
                assert!((sum - (a + b).min(PI).cos()).abs() < 1e-7, "{a} + {b}");
                assert!(
                    (difference - (a - b).max(0.0).cos()).abs() < 1e-7,
                    "{a} - {b}"
                );
            }
        }
    }

    /// Two directions of every kind: nearly constant to wide, of equal and of very different lengths.
    #[test]
    fn cosines_obey_interval_and_deviation() {
        let mut state = 3_u64;
        let mut unit = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut useful = 0;
        for case in 0..30_000 {
            let mut direction = |spread: f64, constant: bool| {
                let mut vector = || DVec3::new(unit() - 0.5, unit() - 0.5, unit() - 0.5);
                let main = vector() * 2.0;
                let corners = [vector(), vector(), vector()].map(|v| main + v * spread);
                if constant {
                    [main.normalize(); 3]
                } else {
                    corners.map(|v| v * 10_f64.powf(unit() * spread.min(1.0)))
                }
            };
            let spread = [3.0, 1.0, 0.1, 0.01][case % 4];
            let x = direction(spread, false);
            let y = direction(spread, case % 3 == 0);
            let bound = Varying::cosine(&Directions::new(x, 0.0), &Directions::new(y, 0.0));
            useful += usize::from(bound.deviation < 0.1);
            for _ in 0..20 {
                let w = [unit(), unit(), unit()];
                let sum: f64 = w.iter().sum();
                let mix = |v: &[DVec3; 3]| (v[0] * w[0] + v[1] * w[1] + v[2] * w[2]).normalize();
                let cosine = mix(&x).dot(mix(&y));
                let interpolated = (0..3).map(|i| bound.at[i] * w[i]).sum::<f64>() / sum;
                assert!(
                    (bound.lo..=bound.hi).contains(&cosine)
                        && (cosine - interpolated).abs() <= bound.deviation,
                    "{cosine}, interpolated {interpolated}, is outside of {bound:?}"
                );
            }
        }
        assert!(useful > 10_000, "only {useful} bounds say anything");
    }
}
