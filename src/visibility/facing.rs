//! Proves that no triangle of a cluster turns its front to the viewer.
//!
//! Let `L p + t` be the rows x w, y w and w of the projection, with rows a, b, c of `L`. For a triangle `p0 p1 p2`
//! with `N = (p1 - p0) x (p2 - p0)`, the determinant of its three homogeneous corners is `D = -N . (E - e p0)` where
//! `E = -adj(L) t` and `e = det L`: `E = e * eye` for an eye at a point; for a parallel projection `e = 0` and `E` is
//! a multiple of the direction towards the viewer. D is the doubled area in pixel space, where y points down, times
//! the product of the corners' w, so that fronts have `N . (E - e p0) > 0`. Eye and scale come from the matrix, not
//! from the view's rounded eye, because it is the matrix that decides what is drawn.
//!
//! **Facing away.** Let the unit normals n of all triangles lie within the angle `alpha < 90°` of the axis A, all
//! points p within r of the centre C, and `Q = E - e C`. Then `n . (E - e p) <= n . Q + |e| r`, and over the cone
//! `n . Q` is at most `|Q| cos(max(0, theta - alpha))` with theta the angle between A and Q. Where the cosine is
//! negative, this equals `A.Q cos(alpha) + |A x Q| sin(alpha)`, and conversely that expression is negative only if
//! `theta - alpha > 90°`. So with
//!
//! `g = -(A.Q cos(alpha) + |A x Q| sin(alpha) + |e| r) > 0`
//!
//! every triangle has `D >= |N| g`: all face away. No apex of a cone is needed, only the ball.
//!
//! **Snapping.** What is drawn is decided after corners were rounded to the sub-pixel grid, which can turn a small or
//! thin triangle around. Corners that move by at most s each turn a triangle only if they pass through a straight
//! line on the way; all of them are then within s of it, so the triangle fits into a strip of width 2 s, and its
//! smallest altitude is at most 2 s. On the screen the triangle has an altitude of at least
//!
//! `|D| / (w0 w1 w2) / (longest edge there) >= |N| g / (w_max^3 G l) >= h g / (w_max^3 G)`,
//!
//! h being the cluster's smallest altitude, `l` the longest edge (`|N| >= h l`), `w_max` the largest w in the ball, and
//! G the largest stretch of the projection in it. With the screen's origin moved to the image of C, `a' = a - x_C c`:
//! `|dx| = |(a' - x c) . dp| / w` and `|x| <= |a'| r / w_min`, hence `|dx| <= |a'| (w_min + |c| r) / w_min^2 |dp|`, y
//! likewise. Rounding moves a corner by at most half a sub-pixel along each axis, 2 s = 0.0056 pixels; asking for
//! `MIN_ALTITUDE_PX` leaves room for the rounding before that, if it is below 2^-12 pixels.
//!
//! Corners must reach snapping as they are: this is for clusters inside the near and far planes and the guard band,
//! where nothing is clipped (and w > 0). Triangles with two equal corners are excepted from h; they have no area on
//! the screen either, snapped or not.

use super::halfspace::Linear;
use crate::geometry::Cluster;
use crate::geometry::screen::GUARD_BAND_PX;
use glam::{DMat4, DVec3};

/// No triangle of at least this altitude on the screen is turned around by snapping.
const MIN_ALTITUDE_PX: f64 = 1.0 / 128.0;

/// Rounding before snapping must be below this.
const MAX_ROUNDING_PX: f64 = 1.0 / 4096.0;

/// Bound of the relative error of the determinants below.
const ROUNDING: f64 = 1.0 / (1_u64 << 46) as f64;

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
