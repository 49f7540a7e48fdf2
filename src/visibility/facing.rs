//! Proves that no triangle of a cluster turns its front to the viewer, or that no such proof will be found.
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
//! every triangle has `D >= |N| g`: all face away. No apex of a cone is needed, only the ball. Without a cone, axis,
//! cosine and sine are zero and g is not positive.
//!
//! **Facing the viewer.** Likewise `n . (E - e p)` is at least `A.Q cos(alpha) - |A x Q| sin(alpha) - |e| r`, as far as
//! that is positive (then `theta + alpha < 90°`). For a set of clusters it follows that each has its own axis within 90°
//! of its own Q, so that its own g is negative: none will be dropped, and testing them is pointless. This decides
//! nothing but the time.
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
//! `MIN_ALTITUDE_PX` leaves room for the rounding before that, if it is below 2^-12 pixels. What is computed is the
//! inequality times `w_max^3 G w_min^2 w_C`, without divisions.
//!
//! Corners must reach snapping as they are: this is for clusters inside the near and far planes and the guard band,
//! where nothing is clipped (and w > 0). Triangles with two equal corners are excepted from h; they have no area on
//! the screen either, snapped or not.
//!
//! **Sets** are tested by the same inequalities: a set's ball, cone and altitude bound every triangle in it. Each
//! member's own proof would then succeed as well, because Q, n, p and w range over less there, and the stretch's
//! bound shrinks too. (A member's centre is at a distance q from the set's, `|a'|` there is at most `1 + |c| q / w_C`
//! times as much, and with the member's `w_C`, `w_min` and r, `(1 + |c| q / w_C) (w_min + |c| r) / w_min^2` is
//! `(w_min + |c| (r + q)) / w_min^2`, where `r + q` is at most the set's radius and `w_min` at least the set's.) So a
//! hierarchy drops what its clusters' tests drop, up to rounding.
//!
//! **Underflow.** `w_min >= SMALLEST_W` and squared gradients of at least `SMALLEST_STRETCH` keep all factors of the
//! right side in range, so that it does not vanish. Whatever vanishes on the left, overflows on the right or becomes
//! NaN proves nothing.

use super::block::{AWAY, Balls, Block, FRONT, LANES, OUTSIDE, States, UNCLIPPED};
use super::halfspace::Linear;
use crate::geometry::screen::GUARD_BAND_PX;
use glam::{DMat4, DVec3};

/// No triangle of at least this altitude on the screen is turned around by snapping.
const MIN_ALTITUDE_PX: f64 = 1.0 / 128.0;

/// Rounding before snapping must be below this.
const MAX_ROUNDING_PX: f64 = 1.0 / 4096.0;

/// Bound of the relative error of the determinants below.
const ROUNDING: f64 = 1.0 / (1_u64 << 46) as f64;

/// Nearer than this to the eye, nothing is dropped.
const SMALLEST_W: f64 = 1e-30;

/// Smallest square of the stretch, times `w_C`, that is told from zero.
const SMALLEST_STRETCH: f64 = 1e-200;

/// The facing test of one view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facing {
    /// `E` of the module header.
    eye: DVec3,
    /// `e` of the module header.
    eye_weight: f64,
    /// What `n . (E - e p)` may be off, for each unit of reach and in any case.
    error: [f64; 2],
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
        let (la, lb, lc) = (x.length, y.length, w.length);
        let lengths =
            x.offset.abs() * lb * lc + y.offset.abs() * lc * la + w.offset.abs() * la * lb;
        let eye = -(x.offset * b.cross(c) + y.offset * c.cross(a) + w.offset * a.cross(b));
        let eye_weight = a.dot(b.cross(c));
        let guard = GUARD_BAND_PX;
        Self {
            eye,
            eye_weight,
            error: [
                ROUNDING * (la * lb * lc + eye_weight.abs()),
                ROUNDING * (lengths + eye.length()),
            ],
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

    /// Adds to `states` which way the lanes of a block face, as far as that can be told.
    pub(super) fn test(&self, block: &Block, balls: &Balls, states: &mut States) {
        let away = self.sides(block, balls, states);
        let may_be_away = (0..LANES)
            .any(|i| away[i] > 0.0 && states[i] & (OUTSIDE | AWAY) == 0 && block.altitude[i] > 0.0);
        if may_be_away {
            if states.iter().any(|state| state & UNCLIPPED == 0) {
                self.find_unclipped(balls, states);
            }
            self.drop_what_stays_away(block, balls, &away, states);
        }
    }

    /// Adds what faces the viewer to `states`. Returns a lower bound of `g` of the module header, not positive where
    /// there is no proof.
    fn sides(&self, block: &Block, balls: &Balls, states: &mut States) -> [f64; LANES] {
        let (eye, e) = (self.eye, self.eye_weight);
        let mut away = [0.0; LANES];
        for i in 0..LANES {
            let [cx, cy, cz] = balls.center(i);
            let (qx, qy, qz) = (eye.x - e * cx, eye.y - e * cy, eye.z - e * cz);
            let [ax, ay, az] = [0, 1, 2].map(|k| f64::from(block.axis[k][i]));
            let along = (ax * qx + ay * qy + az * qz) * block.cos[i];
            let (nx, ny, nz) = (ay * qz - az * qy, az * qx - ax * qz, ax * qy - ay * qx);
            let across = (nx * nx + ny * ny + nz * nz).sqrt() * block.sin[i];
            let spread =
                e.abs() * balls.radius[i] + (self.error[0] * balls.reach[i] + self.error[1]);
            away[i] = -(along + across + spread);
            let is_front = along - across - spread > 0.0;
            states[i] |= block.known[i] | if is_front { FRONT } else { 0 };
        }
        away
    }

    /// Adds to `states` whether corners are in front of the eye and come to be snapped unclipped, off by less than
    /// [`MAX_ROUNDING_PX`].
    pub(super) fn find_unclipped(&self, balls: &Balls, states: &mut States) {
        let mut is_unclipped = [UNCLIPPED; LANES];
        for plane in &self.unclipped {
            for (i, lane) in is_unclipped.iter_mut().enumerate() {
                let (center, radius, reach) = (balls.center(i), balls.radius[i], balls.reach[i]);
                let w_min = self.w.over_ball(center, radius, reach).min;
                let distance = plane.over_ball(center, radius, reach).min;
                // The guard band's planes have the magnitudes of x w, y w and w as seen in the largest pixel coordinate.
                let is_exact = plane.rounding(reach) < MAX_ROUNDING_PX * w_min;
                let is_inside = (distance > 0.0) & (w_min >= SMALLEST_W) & is_exact;
                *lane &= if is_inside { UNCLIPPED } else { 0 };
            }
        }
        for i in 0..LANES {
            states[i] |= is_unclipped[i];
        }
    }

    /// Adds [`AWAY`] to the states of lanes that face away, by `away`, with altitudes on the screen that snapping cannot
    /// turn around.
    fn drop_what_stays_away(
        &self,
        block: &Block,
        balls: &Balls,
        away: &[f64; LANES],
        states: &mut States,
    ) {
        let (a, b, c) = (self.x.gradient, self.y.gradient, self.w.gradient);
        for i in 0..LANES {
            let (center, radius) = (balls.center(i), balls.radius[i]);
            let w = self.w.over_ball(center, radius, balls.reach[i]);
            let (xw, yw, at) = (self.x.at(center), self.y.at(center), self.w.at(center));
            let (dx, dy) = (a * at - c * xw, b * at - c * yw);
            let square = dx.length_squared() + dy.length_squared();
            let stretch = square.sqrt() * (w.min + self.w.length * radius);
            let altitude = f64::from(block.altitude[i]) * away[i] * (w.min * w.min * at);
            let is_steady = (altitude > MIN_ALTITUDE_PX * (w.max * w.max * w.max * stretch))
                & (away[i] > 0.0)
                & (square >= SMALLEST_STRETCH)
                & (states[i] & UNCLIPPED != 0);
            states[i] |= if is_steady { AWAY } else { 0 };
        }
    }
}
