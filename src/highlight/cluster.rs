//! Bounds of a light's factors that hold on every triangle of a cluster.
//!
//! They follow the same plan as those of a single triangle (modules `cone` and [`bound`](super::bound)), but what is known of directions is
//! less: not the three at the corners, but, for `X = p x` with unit `x` anywhere on the cluster, a **fan**:
//!
//! * a cone that holds them all;
//! * a **step**, not less than `|x_i - x_j|` nor `|X_i - X_j| / p` for two corners of the same triangle;
//! * a **growth**, not less than `|p_i - p_j| / p` for them, zero where all have the same length;
//! * the **ratio** of the greatest length to the least.
//!
//! A point of the cluster is inside its ball, so vectors to a light or viewer at distance `d` of the centre are within `asin(R / d)` of the
//! centre's, and as long as `d - R` to `d + R`; steps and growths are at most that of the longest edge over `d - R` (normalizing vectors
//! longer than `m` shortens differences at least by `m`). Two quantities make the bracket of the module `cone`
//!
//! ```text
//! |p_i q_j x_i - p_j q_i x_j| / (P Q) <= q_j |X_i - X_j| / (P Q) + |q_j - q_i| p_j / (P Q)
//!                                     <= ratio_y step_x + growth_y ratio_x
//! |bracket| <= (ratio_y step_x + growth_y ratio_x) step_y + growth_x (step_x + step_y)
//! ```
//!
//! since `|f_i - f_j| <= |x_i - x_j| + |y_i - y_j|`. So deviations stay of second order in the size of **triangles**, however large the cluster
//! is; only the greatest cosine, on which a highlight depends exponentially, is first order in the size of the cluster. So clusters
//! near a highlight are not ruled out, though most of their triangles would be; runs of few triangles lose the least.

use super::bound::{
    FLUSHED, FactorBound, Halfway, LightBound, clamped, halfway_cone, is_flushed, phong_deviation,
    power, reflected_cone,
};
use super::cone::{Angle, PAD, Quantity, stretch};
use crate::illumination::reference::vector;
use crate::math::Bounds;
use crate::scene::{Eye, ReflectionModel, ShadingLight, ShadingMaterial, World};
use glam::DVec3;
use std::ops::Range;

/// A normal whose length differs more from 1 is not taken for a unit vector.
const UNIT_TOLERANCE: f64 = 1e-6;

/// What bounds need to know of a cluster, whatever the view.
#[derive(Clone, Copy, Debug)]
pub struct ClusterShape {
    center: DVec3,
    radius: f64,
    longest_edge: f64,
    normal: Fan,
}

/// Directions on a cluster; see the [module](self).
#[derive(Clone, Copy, Debug)]
struct Fan {
    axis: DVec3,
    spread: Angle,
    step: f64,
    growth: f64,
    ratio: f64,
    /// Bound of the sum of weighted lengths over the length of the weighted sum.
    stretch: f64,
    /// Radians by which rounding may turn it.
    pad: f64,
}

impl Fan {
    /// Nothing is known.
    const ANY: Self = Self {
        axis: DVec3::Z,
        spread: Angle::STRAIGHT,
        step: 2.0,
        growth: f64::INFINITY,
        ratio: f64::INFINITY,
        stretch: f64::INFINITY,
        pad: PAD,
    };

    /// The same unit vector everywhere.
    fn constant(direction: DVec3) -> Self {
        let Some(axis) = direction.try_normalize() else {
            return Self::ANY;
        };
        Self {
            axis,
            spread: Angle::small(PAD),
            step: 0.0,
            growth: 0.0,
            ratio: 1.0,
            stretch: 1.0,
            pad: PAD,
        }
    }

    /// From the points of a cluster to a point. `blur` is the size of rounding errors in its coordinates.
    fn towards(to: DVec3, shape: &ClusterShape, blur: f64) -> Self {
        let from_center = to - shape.center;
        let distance = from_center.length();
        let least = distance - shape.radius;
        let pad = PAD + 2.0 * blur / least;
        // False for what is not a number, too.
        if !(least > 0.0 && distance.is_finite() && pad > 0.0 && pad < 0.01) {
            return Self::ANY;
        }
        let step = shape.longest_edge / least;
        Self {
            axis: from_center / distance,
            spread: Angle::from_sin(shape.radius / distance).plus(Angle::small(pad)),
            step,
            growth: step,
            ratio: (distance + shape.radius) / least,
            stretch: stretch(0.5 * step * step),
            pad,
        }
    }

    fn cone(&self) -> (DVec3, Angle) {
        (self.axis, self.spread)
    }
}

/// The cosine of the angle between two directions.
fn cosine(x: &Fan, y: &Fan) -> Quantity {
    let apart = Angle::from_cos(x.axis.dot(y.axis));
    let spread = x.spread.plus(y.spread);
    let (lo, hi) = (apart.plus(spread).cos, apart.minus(spread).cos);
    let stretch = x.stretch * y.stretch;
    let range = x.step + y.step;
    let bracket = (y.ratio * x.step + y.growth * x.ratio) * y.step + x.growth * range;
    let deviation = if stretch.is_finite() && bracket.is_finite() {
        (stretch - 1.0) + stretch * bracket / 3.0 + x.pad + y.pad
    } else {
        f64::INFINITY
    };
    Quantity {
        lo,
        hi,
        deviation: deviation.min(hi - lo),
        range: range.min(hi - lo),
        magnitude: lo.abs().max(hi.abs()),
    }
}

impl ClusterShape {
    /// The shape of a cluster of the world, or of some of its triangles.
    ///
    /// # Panics
    /// When there are no such triangles.
    #[must_use]
    pub fn new(world: &World, triangles: Range<u32>) -> Self {
        let range = triangles.start as usize..triangles.end as usize;
        let corners = |t: &[u32; 3]| t.map(|v| vector(world.positions.get(v as usize)));
        let normals = |t: &[u32; 3]| t.map(|v| vector(world.normals.get(v as usize)));
        let triangles = &world.triangles[range];
        let mut sum = DVec3::ZERO;
        let (mut edge, mut step) = (0.0_f64, 0.0_f64);
        let mut are_unit = true;
        let mut bounds = Bounds::EMPTY;
        for triangle in triangles {
            let ([a, b, c], n) = (corners(triangle), normals(triangle));
            edge = edge.max(a.distance_squared(b));
            edge = edge.max(b.distance_squared(c)).max(c.distance_squared(a));
            [a, b, c].into_iter().for_each(|p| bounds.grow(p));
            step = step.max(n[0].distance_squared(n[1]));
            step = step.max(n[1].distance_squared(n[2]));
            step = step.max(n[2].distance_squared(n[0]));
            are_unit &= n
                .iter()
                .all(|n| (n.length_squared() - 1.0).abs() <= 2.0 * UNIT_TOLERANCE);
            sum += n[0] + n[1] + n[2];
        }
        let axis = sum.normalize_or_zero();
        let cos = triangles
            .iter()
            .flat_map(normals)
            .map(|n| n.dot(axis))
            .fold(1.0, f64::min);
        // A cone of less than a right angle is convex. Lengths are off by the tolerance, which the sums of two steps cover.
        let step = step.sqrt() + 2.0 * UNIT_TOLERANCE;
        let normal = if are_unit && cos > 0.01 {
            Fan {
                axis,
                spread: Angle::from_cos(cos - UNIT_TOLERANCE).plus(Angle::small(PAD)),
                step,
                growth: 2.0 * UNIT_TOLERANCE,
                ratio: 1.0 + 2.0 * UNIT_TOLERANCE,
                stretch: stretch(0.5 * step * step),
                pad: PAD,
            }
        } else {
            Fan::ANY
        };
        let center = bounds.center();
        let farthest = triangles.iter().flat_map(corners);
        // `f64::max` would lose what is not a number; normals are then none either, or nothing is drawn.
        let farthest = farthest.map(|p| p.distance_squared(center));
        Self {
            center,
            radius: farthest
                .fold(0.0, |most, d| if d <= most { most } else { d })
                .sqrt()
                * (1.0 + 1e-9),
            longest_edge: edge.sqrt(),
            normal,
        }
    }

    /// Size of rounding errors of interpolated positions.
    fn blur(&self) -> f64 {
        (self.center.abs().max_element() + self.radius) * f64::from(f32::EPSILON)
    }
}

/// A cluster made ready for bounding one light after the other.
#[derive(Clone, Copy, Debug)]
pub struct ClusterBound {
    shape: ClusterShape,
    to_viewer: Fan,
    n_v: Quantity,
    specular: bool,
    model: ReflectionModel,
    exponent: f64,
}

impl ClusterBound {
    /// A cluster of this shape, all of one material.
    #[must_use]
    pub fn new(shape: &ClusterShape, eye: &Eye, material: &ShadingMaterial) -> Self {
        let to_viewer = match *eye {
            Eye::Point(eye) => {
                let eye = vector(eye);
                let blur = eye.abs().max_element() * f64::from(f32::EPSILON);
                Fan::towards(eye, shape, shape.blur().max(blur))
            }
            Eye::Direction(direction) => Fan::constant(vector(direction)),
        };
        Self {
            shape: *shape,
            n_v: cosine(&shape.normal, &to_viewer),
            to_viewer,
            specular: material.is_specular(),
            model: material.model,
            exponent: f64::from(material.shininess.max(0.0)),
        }
    }

    /// Bounds of a light's factors on each triangle.
    #[must_use]
    pub fn light(&self, light: &ShadingLight) -> LightBound {
        let at = vector(light.vector);
        let to_light = if light.is_point {
            let blur = at.abs().max_element() * f64::from(f32::EPSILON);
            Fan::towards(at, &self.shape, self.shape.blur().max(blur))
        } else {
            Fan::constant(at)
        };
        let n_l = cosine(&self.shape.normal, &to_light);
        if n_l.hi <= 0.0 {
            return LightBound::default();
        }
        // Corners may differ in sign by no more than their range.
        let kink = (-n_l.lo).max(0.0).min(0.5 * n_l.range);
        LightBound {
            diffuse: clamped(&n_l, kink),
            specular: if self.specular {
                self.specular(&to_light, &n_l)
            } else {
                FactorBound::default()
            },
        }
    }

    fn specular(&self, l: &Fan, n_l: &Quantity) -> FactorBound {
        let (n, v, n_v) = (&self.shape.normal, &self.to_viewer, &self.n_v);
        let (lo, hi) = match self.model {
            ReflectionModel::Phong => reflected_cone(l.cone(), n.cone(), v.cone()),
            ReflectionModel::BlinnPhong => halfway_cone(l.cone(), n.cone(), v.cone()),
        };
        if hi <= 0.0 {
            return FactorBound::default();
        }
        if is_flushed(hi, self.exponent) {
            return FLUSHED;
        }
        let l_v = cosine(l, v);
        let (deviation, range) = match self.model {
            ReflectionModel::Phong => (
                phong_deviation(n_l, n_v, &l_v),
                2.0 * (n_l.range * n_v.magnitude + n_v.range * n_l.magnitude) + l_v.range,
            ),
            ReflectionModel::BlinnPhong => match Halfway::new(n_l, n_v, &l_v) {
                Some(half) => (half.deviation(), half.range()),
                None => (f64::INFINITY, f64::INFINITY),
            },
        };
        let base = Quantity {
            lo,
            hi,
            deviation: deviation.min(hi - lo),
            range: range.min(hi - lo),
            magnitude: lo.abs().max(hi.abs()),
        };
        power(&base, n_l.lo > 0.0, self.exponent)
    }
}
