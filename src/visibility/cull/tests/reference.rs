//! The tests of one cluster at a time, written plainly: what culling did before it had sets and lanes.

use super::MARGIN_PX;
use crate::geometry::Cluster;
use crate::geometry::screen::GUARD_BAND_PX;
use crate::scene::View;
use glam::{DMat4, DVec3, DVec4};

/// Whether the cluster's ball is entirely outside of one of the half-spaces.
pub(super) fn is_outside(planes: &[Linear; 6], cluster: &Cluster) -> bool {
    let center = DVec3::from(cluster.center.map(f64::from));
    let radius = f64::from(cluster.radius);
    planes
        .iter()
        .any(|plane| plane.over_ball(center, radius).max < 0.0)
}

/// The six functions that are not negative anywhere in the image.
pub(super) fn frustum(view: &View) -> [Linear; 6] {
    let m = MARGIN_PX;
    let (right, bottom) = (f64::from(view.width) + m, f64::from(view.height) + m);
    [
        [0.0, 0.0, -1.0, 1.0],
        [0.0, 0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0, m],
        [-1.0, 0.0, 0.0, right],
        [0.0, 1.0, 0.0, m],
        [0.0, -1.0, 0.0, bottom],
    ]
    .map(|weights| Linear::of_rows(&view.pixel_from_world, weights))
}

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

/// No triangle of at least this altitude on the screen is turned around by snapping.
const MIN_ALTITUDE_PX: f64 = 1.0 / 128.0;

/// Rounding before snapping must be below this.
const MAX_ROUNDING_PX: f64 = 1.0 / 4096.0;

/// The facing test of one view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facing {
    /// `E` of the module header, and how far it may be off.
    eye: DVec3,
    eye_error: f64,
    /// `e` of the module header, and how far it may be off.
    eye_weight: f64,
    eye_weight_error: f64,
    x: Linear,
    y: Linear,
    w: Linear,
    /// Near, far, and the guard band's sides: no clipping where none is negative.
    unclipped: [Linear; 6],
}

impl Facing {
    pub(super) fn new(pixel_from_world: &DMat4) -> Self {
        let linear = |weights| Linear::of_rows(pixel_from_world, weights);
        let [x, y, w] = [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
        .map(linear);
        let (a, b, c) = (x.gradient, y.gradient, w.gradient);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let lengths =
            x.offset.abs() * lb * lc + y.offset.abs() * lc * la + w.offset.abs() * la * lb;
        let guard = GUARD_BAND_PX;
        Self {
            eye: -(x.offset * b.cross(c) + y.offset * c.cross(a) + w.offset * a.cross(b)),
            eye_error: ROUNDING * lengths,
            eye_weight: a.dot(b.cross(c)),
            eye_weight_error: ROUNDING * la * lb * lc,
            x,
            y,
            w,
            unclipped: [
                [0.0, 0.0, -1.0, 1.0],
                [0.0, 0.0, 1.0, 0.0],
                [1.0, 0.0, 0.0, guard],
                [-1.0, 0.0, 0.0, guard],
                [0.0, 1.0, 0.0, guard],
                [0.0, -1.0, 0.0, guard],
            ]
            .map(linear),
        }
    }

    /// True when no triangle of the cluster can have a pixel, by the proof above; false when in doubt.
    pub(super) fn is_away(&self, cluster: &Cluster) -> bool {
        let center = DVec3::from(cluster.center.map(f64::from));
        let radius = f64::from(cluster.radius);
        let away = self.away(cluster, center, radius);
        away > 0.0
            && self.reaches_snapping(center, radius)
            && self.min_altitude_px(cluster, center, radius, away) > MIN_ALTITUDE_PX
    }

    /// `g` of the module header, a lower bound; not positive when there is no proof.
    fn away(&self, cluster: &Cluster, center: DVec3, radius: f64) -> f64 {
        let stored_axis = DVec3::from(cluster.cone_axis.map(f64::from));
        // The stored axis is a unit vector up to rounding only.
        let cos = f64::from(cluster.cone_cos) / stored_axis.length();
        let Some(axis) = stored_axis.try_normalize().filter(|_| cos > 0.0) else {
            return 0.0;
        };
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let to_eye = self.eye - self.eye_weight * center;
        let reach = center.length() + radius;
        let error = self.eye_error
            + self.eye_weight_error * reach
            + ROUNDING * (self.eye.length() + self.eye_weight.abs() * reach);
        let toward = axis.dot(to_eye) * cos + axis.cross(to_eye).length() * sin;
        -(toward + self.eye_weight.abs() * radius + error)
    }

    /// Whether corners in the ball are in front of the eye and come to be snapped unclipped, off by less than
    /// [`MAX_ROUNDING_PX`].
    fn reaches_snapping(&self, center: DVec3, radius: f64) -> bool {
        let w_min = self.w.over_ball(center, radius).min;
        // The guard band's planes have the magnitudes of x w, y w and w as seen in the largest pixel coordinate.
        w_min > 0.0
            && self.unclipped.iter().all(|plane| {
                plane.over_ball(center, radius).min > 0.0
                    && plane.rounding(center.abs() + radius) < MAX_ROUNDING_PX * w_min
            })
    }

    /// A lower bound in pixels of the altitudes on the screen of triangles with three different corners that face away
    /// by `away`, which is positive; needs w > 0 throughout the ball.
    fn min_altitude_px(&self, cluster: &Cluster, center: DVec3, radius: f64, away: f64) -> f64 {
        let w = self.w.over_ball(center, radius);
        let at_center = self.w.at(center);
        let about_center =
            |row: &Linear| (row.gradient - self.w.gradient * (row.at(center) / at_center)).length();
        let (dx, dy) = (about_center(&self.x), about_center(&self.y));
        let perspective = (w.min + self.w.gradient.length() * radius) / (w.min * w.min);
        let stretch = dx.hypot(dy) * perspective;
        // The stretch is not zero: such a map would take all to one point, where nothing faces anywhere and `away` is
        // not positive.
        f64::from(cluster.min_altitude) * away / (w.max * w.max * w.max * stretch)
    }
}
