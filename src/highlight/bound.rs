//! What a light can do on a triangle: intervals of its diffuse and specular factor, and how far they are from interpolation.
//!
//! All cosines come from the module `cone`, as an interval (from cones, and from corner values) and a deviation from linear
//! interpolation. On top of them:
//!
//! **Horizon.** Where all nine products of a corner's normal and a corner's vector to the light are negative, so is `n.l` everywhere: it
//! is a sum of them with positive weights. Lights behind are dismissed by this before anything is normalized. Where `n.l` has no positive value, both terms are absent. Where it changes sign, the specular factor jumps, and
//! only its interval `[0, hi]` holds.
//!
//! **Phong.** Reflecting about a fixed `n` keeps angles; reflecting one vector about `n` and about `n'` gives results at most
//! `2 ang(n, n')` apart, as two half-turns make a rotation by twice the angle of their axes. Hence the angle of `r` and `v` is that of the cones'
//! axes within `beta_l + beta_v + 2 alpha`. The greatest `r.v` comes from polynomials, too (module `quartic`), which is tighter where normals turn
//! by much. And `r.v = 2 (n.l)(n.v) - l.v` gives the deviation.
//!
//! **Blinn-Phong.** If unit vectors `l`, `v` are within chords `e_l`, `e_v` of the axes `L`, `V`, then `l + v` is within `e_l + e_v` of `L + V`,
//! so its direction turns by at most `asin((e_l + e_v) / |L + V|)`; no bound where that is not below 1 (light nearly opposite to
//! the viewer). And `n.h = (n.l + n.v) / sqrt(2 (1 + l.v))` gives the deviation.
//!
//! **Power.** `c^s` is monotonic in `c`. Its deviation from interpolation is at most `s c^(s-1)` times that of `c`, plus
//! `s (s-1) c^(s-2) / 8` times the square of the corner values' range (the variance of a quantity is at most a quarter of its squared
//! range), both at the greatest `c`; for `s >= 2`, where the clamped power has a continuous slope.
//!
//! Nothing here depends on the machine: decisions are based on it.

use super::cone::{Angle, Directions, PAD, Quantity, Varying, greatest, least};
use super::power::{power_above, power_below};
use super::quartic::greatest_reflection;
use crate::illumination::power::FLUSH;
use crate::illumination::reference::vector;
use crate::scene::{Eye, ReflectionModel, ShadingLight, ShadingMaterial};
use glam::DVec3;

/// A factor of the illumination equation on a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FactorBound {
    /// It is nowhere less.
    pub lo: f64,
    /// It is nowhere more.
    pub hi: f64,
    /// It nowhere differs more from what is interpolated between the corners.
    pub deviation: f64,
}

impl FactorBound {
    /// All that is known of any factor.
    pub(super) const TRIVIAL: Self = Self {
        lo: 0.0,
        hi: 1.0,
        deviation: 1.0,
    };
}

/// Both factors of a light on a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightBound {
    /// `max(0, n.l)`.
    pub diffuse: FactorBound,
    /// `S`; zero without a specular material.
    pub specular: FactorBound,
}

/// A triangle made ready for bounding one light after the other.
#[derive(Clone, Copy, Debug)]
pub struct TriangleBound {
    corners: [DVec3; 3],
    /// Size of rounding errors of interpolated positions.
    blur: f64,
    normal: Directions,
    /// The cosine between normal and viewer.
    n_v: Varying,
    to_viewer: Directions,
    specular: bool,
    model: ReflectionModel,
    exponent: f64,
}

impl TriangleBound {
    /// From world space corners and normals of any length.
    #[must_use]
    pub fn new(
        positions: [[f32; 3]; 3],
        normals: [[f32; 3]; 3],
        eye: &Eye,
        material: &ShadingMaterial,
    ) -> Self {
        let corners = triple(positions);
        let size = greatest(corners.map(|p| p.abs().max_element()));
        let blur = size * f64::from(f32::EPSILON);
        let to_viewer = match *eye {
            Eye::Point(eye) => Directions::new(from_corners(vector(eye), &corners), blur),
            Eye::Direction(direction) => Directions::constant(vector(direction)),
        };
        let normal = Directions::new(triple(normals), 0.0);
        let n_v = Varying::cosine(&normal, &to_viewer);
        Self {
            corners,
            blur,
            normal,
            n_v,
            to_viewer,
            specular: material.is_specular(),
            model: material.model,
            exponent: f64::from(material.shininess.max(0.0)),
        }
    }

    /// Bounds of a light's factors.
    #[must_use]
    pub fn light(&self, light: &ShadingLight) -> LightBound {
        let at = vector(light.vector);
        let (vectors, blur) = if light.is_point {
            let size = at.abs().max_element() * f64::from(f32::EPSILON);
            (from_corners(at, &self.corners), self.blur.max(size))
        } else {
            ([at; 3], 0.0)
        };
        if self.normal.face_away_from(&vectors, blur) {
            return LightBound::default();
        }
        let to_light = Directions::new(vectors, blur);
        let n_l = Varying::cosine(&self.normal, &to_light);
        if n_l.hi <= 0.0 {
            return LightBound::default();
        }
        LightBound {
            diffuse: clamped(&n_l.quantity(), kink(n_l.at)),
            specular: if self.specular {
                self.specular(&to_light, &n_l)
            } else {
                FactorBound::default()
            },
        }
    }

    fn specular(&self, l: &Directions, n_l: &Varying) -> FactorBound {
        let (n, v, n_v) = (&self.normal, &self.to_viewer, &self.n_v);
        let [l_fan, n_fan, v_fan] = [l, n, v].map(|x| (x.axis, x.spread));
        let (lo, mut hi) = match self.model {
            ReflectionModel::Phong => reflected_cone(l_fan, n_fan, v_fan),
            ReflectionModel::BlinnPhong => halfway_cone(l_fan, n_fan, v_fan),
        };
        if hi <= 0.0 {
            return FactorBound::default();
        }
        if is_flushed(hi, self.exponent) {
            return FLUSHED;
        }
        if self.model == ReflectionModel::Phong {
            let padding = l.pad + v.pad + 2.0 * n.pad;
            hi = hi.min(greatest_reflection(l, n, v) + padding);
            if is_flushed(hi, self.exponent) {
                return FLUSHED;
            }
        }
        let l_v = Varying::cosine(l, v);
        let base = match self.model {
            ReflectionModel::Phong => phong_base(lo, hi, n_l, n_v, &l_v),
            ReflectionModel::BlinnPhong => blinn_base(lo, hi, n_l, n_v, &l_v),
        };
        power(&base.quantity(), n_l.lo > 0.0, self.exponent)
    }
}

/// In double precision. (Written out, here and elsewhere: `array::map` is not always inlined.)
fn triple([a, b, c]: [[f32; 3]; 3]) -> [DVec3; 3] {
    [vector(a), vector(b), vector(c)]
}

/// Vectors from the corners to a point.
fn from_corners(to: DVec3, [a, b, c]: &[DVec3; 3]) -> [DVec3; 3] {
    [to - a, to - b, to - c]
}

/// How far the positive parts of corner values, interpolated, are at most from the positive part of what is interpolated between the
/// values: nothing unless corners differ in sign.
fn kink(at: [f64; 3]) -> f64 {
    greatest(at).max(0.0).min((-least(at)).max(0.0))
}

/// The positive part.
pub(super) fn clamped(x: &Quantity, kink: f64) -> FactorBound {
    let (lo, hi) = (x.lo.max(0.0), x.hi.clamp(0.0, 1.0));
    FactorBound {
        lo: lo.min(hi),
        hi,
        deviation: (x.deviation + kink).min(hi - lo).max(0.0),
    }
}

/// A cone: its axis and half-angle.
type Cone = (DVec3, Angle);

/// Least and greatest `r.v` by the cones of light, normal and viewer.
pub(super) fn reflected_cone(l: Cone, n: Cone, v: Cone) -> (f64, f64) {
    let reflected = n.0 * (2.0 * n.0.dot(l.0)) - l.0;
    let apart = Angle::from_cos(reflected.dot(v.0));
    let spread = l.1.plus(v.1).plus(n.1).plus(n.1);
    (apart.plus(spread).cos, apart.minus(spread).cos)
}

/// Least and greatest `n.h` by the cones of light, normal and viewer.
pub(super) fn halfway_cone(l: Cone, n: Cone, v: Cone) -> (f64, f64) {
    let half = l.0 + v.0;
    let per_length = 1.0 / half.length();
    // The chord of an angle is 2 sin(angle / 2).
    let chord = |angle: Angle| (2.0 - 2.0 * angle.cos).max(0.0).sqrt();
    let turn = (chord(l.1) + chord(v.1)) * per_length;
    // False for NaN too: opposite axes.
    if turn < 1.0 {
        let apart = Angle::from_cos(n.0.dot(half) * per_length);
        let spread = Angle::from_sin(turn).plus(n.1);
        (apart.plus(spread).cos, apart.minus(spread).cos)
    } else {
        (-1.0, 1.0)
    }
}

/// `r.v`, given its interval by the cones.
fn phong_base(lo: f64, hi: f64, n_l: &Varying, n_v: &Varying, l_v: &Varying) -> Varying {
    let at = |i: usize| 2.0 * n_l.at[i] * n_v.at[i] - l_v.at[i];
    let deviation = phong_deviation(&n_l.quantity(), &n_v.quantity(), &l_v.quantity());
    Varying::new([at(0), at(1), at(2)], lo, hi, deviation)
}

/// The deviation of `r.v = 2 (n.l)(n.v) - l.v`.
pub(super) fn phong_deviation(n_l: &Quantity, n_v: &Quantity, l_v: &Quantity) -> f64 {
    2.0 * n_l.product_deviation(n_v) + l_v.deviation + PAD
}

/// `n.h`, given its interval by the cones.
fn blinn_base(lo: f64, hi: f64, n_l: &Varying, n_v: &Varying, l_v: &Varying) -> Varying {
    let Some(half) = Halfway::new(&n_l.quantity(), &n_v.quantity(), &l_v.quantity()) else {
        // The corner values may be anything in the interval.
        return Varying {
            at: [lo, hi, hi],
            lo,
            hi,
            deviation: hi - lo,
        };
    };
    let at = |i: usize| (n_l.at[i] + n_v.at[i]) / (2.0 + 2.0 * l_v.at[i]).sqrt();
    Varying::new([at(0), at(1), at(2)], lo, hi, half.deviation())
}

/// The factors of `n.h = (n.l + n.v) psi(1 + l.v)` with `psi(u) = (2 u)^(-1/2)`.
pub(super) struct Halfway {
    sum: Quantity,
    psi: Quantity,
}

impl Halfway {
    /// `None` where light and viewer may be nearly opposite.
    pub(super) fn new(n_l: &Quantity, n_v: &Quantity, l_v: &Quantity) -> Option<Self> {
        let u_lo = 1.0 + l_v.lo;
        if u_lo < 0.01 {
            return None;
        }
        // Its slope and curvature are greatest at the least u.
        let root = 1.0 / (2.0 * u_lo).sqrt();
        let cube = root * root * root;
        Some(Self {
            sum: Quantity {
                lo: n_l.lo + n_v.lo,
                hi: n_l.hi + n_v.hi,
                deviation: n_l.deviation + n_v.deviation,
                range: n_l.range + n_v.range,
                magnitude: n_l.magnitude + n_v.magnitude,
            },
            psi: Quantity {
                lo: 0.5,
                hi: root,
                deviation: cube * l_v.deviation
                    + 3.0 / 8.0 * cube * root * root * l_v.range * l_v.range,
                range: cube * l_v.range,
                magnitude: root,
            },
        })
    }

    /// How far it is from interpolation.
    pub(super) fn deviation(&self) -> f64 {
        self.sum.product_deviation(&self.psi) + PAD
    }

    /// How far apart its values at corners are.
    pub(super) fn range(&self) -> f64 {
        self.sum.range * self.psi.magnitude + self.psi.range * self.sum.magnitude
    }
}

/// A power that is below the flush everywhere is nothing in the picture.
pub(super) const FLUSHED: FactorBound = FactorBound {
    lo: 0.0,
    hi: FLUSH,
    deviation: FLUSH,
};

/// Whether `c^s <= exp(-s (1 - c))` is below the flush.
#[inline]
pub(super) fn is_flushed(c: f64, exponent: f64) -> bool {
    const DEPTH: f64 = 24.0 * std::f64::consts::LN_2;
    exponent * (1.0 - c) > DEPTH
}

/// The base to the exponent, zero where the base is negative or the light is behind; `is_lit` says that it is in front everywhere.
pub(super) fn power(base: &Quantity, is_lit: bool, exponent: f64) -> FactorBound {
    let c = base.hi.min(1.0);
    if c <= 0.0 {
        return FactorBound::default();
    }
    if is_flushed(c, exponent) {
        return FLUSHED;
    }
    let smooth = exponent >= 2.0 && is_lit;
    let (hi, mut deviation) = if smooth {
        let curved = power_above(c, exponent - 2.0);
        let slope = exponent * curved * c;
        let curvature = exponent * (exponent - 1.0) * curved;
        (
            curved * c * c,
            slope * base.deviation + curvature * base.range * base.range * 0.125,
        )
    } else {
        (power_above(c, exponent), f64::INFINITY)
    };
    let hi = hi.min(1.0);
    // A lower bound is only worth its cost where there is something to see.
    let visible = hi > 1.0 / 4096.0 && is_lit && base.lo > 0.0;
    let lo = if visible && !is_flushed(base.lo, exponent) {
        power_below(base.lo.min(c), exponent)
    } else {
        0.0
    };
    deviation = deviation.min(hi - lo);
    let bound = FactorBound { lo, hi, deviation };
    // NaN from numbers that were not finite.
    if deviation >= 0.0 {
        bound
    } else {
        FactorBound::TRIVIAL
    }
}
