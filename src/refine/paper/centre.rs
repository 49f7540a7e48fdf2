//! The centre of a highlight in a triangle: the paper's appendix.
//!
//! At the centre of a highlight the normal satisfies H1, `(PL x PV) . N = 0`, and H2, as far from the light as from the viewer. Along a
//! line `P(t)` both `PL x PV` (the term in `t^2` is a cross product of parallel vectors) and the interpolated `N` are linear, so H1 is a
//! quadratic in `t`, solved by [`roots`] in a form without cancellation. So:
//!
//! 1. **Q and R** are where H1 holds on the two edges at whose ends its sign differs. `A` is the corner that both have.
//! 2. **The estimate** on `QR`: the angles between reflected light and viewer at `Q` and `R` are taken as the distances from the centre;
//!    it lies between them if H2 has different signs there, else beyond the nearer one.
//! 3. **Interleaved**: the line from `A` through the estimate is followed to where H1 holds; by the sign of H2 that point replaces `Q` or `R`; and
//!    so on, until the estimate moves by less than the accuracy.
//!
//! Points are barycentric coordinates. What is not a number, or degenerate, gives no centre.

use crate::illumination::reference::vector;
use crate::scene::{Eye, ShadingLight};
use glam::DVec3;

/// Most steps of the iteration: it converges in a few, or not at all.
const MOST_STEPS: u32 = 32;

/// Real roots of `a t^2 + b t + c`, ascending as a rule. None where all coefficients are zero, or something is not a number.
///
/// With `q = -(b + sign(b) sqrt(b^2 - 4 a c)) / 2` they are `q / a` and `c / q`, neither of which subtracts numbers that are nearly equal.
#[must_use]
pub fn roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    let discriminant = b * b - 4.0 * a * c;
    // False for NaN.
    if discriminant < 0.0 || discriminant.is_nan() {
        return [None; 2];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    let finite = |t: f64| t.is_finite().then_some(t);
    let (t, u) = (finite(q / a), finite(c / q));
    match (t, u) {
        (Some(t), Some(u)) if u < t => [Some(u), Some(t)],
        _ => [t, u],
    }
}

/// What has been found out about the highlight of a light on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Centre {
    /// It is inside.
    Inside([f64; 3]),
    /// It is outside; this is the point of an edge that is nearest to it.
    OnEdge([f64; 3]),
}

/// A triangle under one light.
#[derive(Clone, Copy, Debug)]
pub struct Subject {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
    light: Place,
    eye: Place,
}

/// Where a light or the viewer is.
#[derive(Clone, Copy, Debug)]
enum Place {
    Point(DVec3),
    Direction(DVec3),
}

impl Place {
    fn seen_from(self, point: DVec3) -> DVec3 {
        match self {
            Self::Point(place) => place - point,
            Self::Direction(direction) => direction,
        }
    }
}

impl Subject {
    /// Of corners and normals in world space.
    #[must_use]
    pub fn new(
        positions: [[f32; 3]; 3],
        normals: [[f32; 3]; 3],
        light: &ShadingLight,
        eye: &Eye,
    ) -> Self {
        Self {
            corners: positions.map(vector),
            normals: normals.map(vector),
            light: if light.is_point {
                Place::Point(vector(light.vector))
            } else {
                Place::Direction(vector(light.vector))
            },
            eye: match *eye {
                Eye::Point(eye) => Place::Point(vector(eye)),
                Eye::Direction(direction) => Place::Direction(vector(direction)),
            },
        }
    }

    /// The centre of the highlight, if there is one near; it moves by less than `accuracy`, in barycentric coordinates, if the iteration went
    /// on.
    #[must_use]
    pub fn centre(&self, accuracy: f64) -> Option<Centre> {
        let signs = CORNERS.map(|corner| self.h1(corner) > 0.0);
        // The corner that is alone on its side.
        let a =
            (0..3).find(|&i| signs[i] != signs[(i + 1) % 3] && signs[i] != signs[(i + 2) % 3])?;
        let apex = CORNERS[a];
        let mut q = self.h1_between(apex, CORNERS[(a + 1) % 3])?;
        let mut r = self.h1_between(apex, CORNERS[(a + 2) % 3])?;
        let ends = [q, r];
        let mut estimate = self.estimate(q, r)?;
        for _ in 0..MOST_STEPS {
            // As far as the edge opposite.
            let Some(on_curve) = self.h1_beyond(apex, estimate) else {
                break;
            };
            if self.h2(on_curve) == self.h2(q) {
                q = on_curve;
            } else {
                r = on_curve;
            }
            let Some(next) = self.estimate(q, r) else {
                estimate = on_curve;
                break;
            };
            let moved = (0..3)
                .map(|i| (next[i] - on_curve[i]).abs())
                .fold(0.0, f64::max);
            estimate = next;
            if moved < accuracy {
                break;
            }
        }
        if !estimate.iter().all(|w| w.is_finite()) {
            return None;
        }
        if estimate.iter().all(|&w| w > 0.0) {
            return Some(Centre::Inside(estimate));
        }
        let angles = ends.map(|end| self.angle(end));
        Some(Centre::OnEdge(if angles[1] < angles[0] {
            ends[1]
        } else {
            ends[0]
        }))
    }

    fn point(&self, w: [f64; 3]) -> DVec3 {
        blend(w, self.corners)
    }

    fn normal(&self, w: [f64; 3]) -> DVec3 {
        blend(w, self.normals)
    }

    fn cross(&self, w: [f64; 3]) -> DVec3 {
        let point = self.point(w);
        self.light.seen_from(point).cross(self.eye.seen_from(point))
    }

    /// `(PL x PV) . N`.
    fn h1(&self, w: [f64; 3]) -> f64 {
        self.cross(w).dot(self.normal(w))
    }

    /// Whether the normal is nearer to the light than to the viewer.
    fn h2(&self, w: [f64; 3]) -> bool {
        let (point, normal) = (self.point(w), self.normal(w));
        let cosine = |place: Place| place.seen_from(point).normalize_or_zero().dot(normal);
        cosine(self.light) > cosine(self.eye)
    }

    /// The angle between the reflected light and the viewer.
    fn angle(&self, w: [f64; 3]) -> f64 {
        let point = self.point(w);
        let n = self.normal(w).normalize_or_zero();
        let l = self.light.seen_from(point).normalize_or_zero();
        let v = self.eye.seen_from(point).normalize_or_zero();
        (2.0 * n.dot(l) * n - l).dot(v).clamp(-1.0, 1.0).acos()
    }

    /// The quadratic of H1 along the line from `from` (0) to `to` (1).
    fn h1_along(&self, from: [f64; 3], to: [f64; 3]) -> [Option<f64>; 2] {
        let (c0, n0) = (self.cross(from), self.normal(from));
        let (c1, n1) = (self.cross(to) - c0, self.normal(to) - n0);
        roots(c1.dot(n1), c0.dot(n1) + c1.dot(n0), c0.dot(n0))
    }

    /// Where H1 holds between two points at which it has different signs.
    fn h1_between(&self, from: [f64; 3], to: [f64; 3]) -> Option<[f64; 3]> {
        let mut roots = self.h1_along(from, to).into_iter().flatten();
        let inside = roots.find(|t| (-1e-9..=1.0 + 1e-9).contains(t))?;
        Some(mix(from, to, inside.clamp(0.0, 1.0)))
    }

    /// Where H1 holds on the line from a corner through a point, nearest to that, inside the triangle.
    fn h1_beyond(&self, corner: [f64; 3], through: [f64; 3]) -> Option<[f64; 3]> {
        let roots = self.h1_along(corner, through).into_iter().flatten();
        let points = roots.map(|t| (t, mix(corner, through, t)));
        let inside = points.filter(|(t, w)| *t > 1e-9 && w.iter().all(|&w| w >= 0.0));
        let nearest = inside.min_by(|a, b| (a.0 - 1.0).abs().total_cmp(&(b.0 - 1.0).abs()));
        nearest.map(|(_, w)| w)
    }

    /// Where the highlight is on the line through `q` and `r`, by the angles there.
    fn estimate(&self, q: [f64; 3], r: [f64; 3]) -> Option<[f64; 3]> {
        let (at_q, at_r) = (self.angle(q), self.angle(r));
        let t = if self.h2(q) == self.h2(r) {
            at_q / (at_q - at_r)
        } else {
            at_q / (at_q + at_r)
        };
        t.is_finite().then(|| mix(q, r, t))
    }
}

const CORNERS: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn blend(w: [f64; 3], of: [DVec3; 3]) -> DVec3 {
    w[0] * of[0] + w[1] * of[1] + w[2] * of[2]
}

fn mix(from: [f64; 3], to: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|i| from[i] + t * (to[i] - from[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_accurate_where_the_textbook_formula_cancels() {
        // (t - 1e-9)(t - 1e9), and its reverse.
        for b in [-(1e9 + 1e-9), 1e9 + 1e-9] {
            let found = roots(1.0, b, 1.0).map(|t| t.expect("two roots").abs());
            let (small, large) = (found[0].min(found[1]), found[0].max(found[1]));
            assert!((small / 1e-9 - 1.0).abs() < 1e-12 && (large / 1e9 - 1.0).abs() < 1e-12);
        }
        assert_eq!(roots(0.0, 2.0, -1.0), [None, Some(0.5)]);
        assert_eq!(roots(1.0, 0.0, 1.0), [None; 2]);
        assert_eq!(roots(0.0, 0.0, 0.0), [None; 2]);
        assert_eq!(roots(f64::NAN, 1.0, 1.0), [None; 2]);
        assert_eq!(roots(1.0, 0.0, -4.0), [Some(-2.0), Some(2.0)]);
    }

    /// A patch of a sphere that the mirror direction crosses at a given point; light and viewer are far enough to be seen from
    /// about the same directions everywhere.
    fn patch(weights: [f64; 3], size: f32, distance: f32) -> Subject {
        let normals = [[-size, -size, 1.0], [size, -size, 1.0], [0.0, size, 1.0]];
        let n = blend(weights, normals.map(vector)).normalize();
        let point = blend(weights, normals.map(vector));
        let side = n.cross(DVec3::X).normalize();
        let l = (n + 0.4 * side).normalize();
        let v = (n - 0.4 * side).normalize();
        let single = |v: DVec3| v.to_array().map(|x| x as f32);
        let light = ShadingLight {
            vector: single(point + l * f64::from(distance)),
            is_point: true,
            radiance: [1.0; 3],
        };
        let eye = Eye::Point(single(point + v * f64::from(distance)));
        Subject::new(normals, normals, &light, &eye)
    }

    #[test]
    fn centres_are_found_where_they_are() {
        let mut found = 0;
        for i in 1..10 {
            for j in 1..10 - i {
                let want = [f64::from(10 - i - j), f64::from(i), f64::from(j)].map(|w| w / 10.0);
                let subject = patch(want, 0.1, 20.0);
                match subject.centre(1e-6) {
                    Some(Centre::Inside(got)) => {
                        for k in 0..3 {
                            assert!((got[k] - want[k]).abs() < 1e-3, "{got:?} {want:?}");
                        }
                        found += 1;
                    }
                    // The quadratic may have both of its roots on an edge.
                    other => assert!(other.is_none(), "{other:?} for {want:?}"),
                }
            }
        }
        assert!(found >= 30, "{found} of 36");
    }

    #[test]
    fn odd_input_has_no_centre_or_a_finite_one() {
        let light = ShadingLight {
            vector: [0.0, 0.0, 1.0],
            is_point: false,
            radiance: [1.0; 3],
        };
        for bad in [0.0, f32::NAN, f32::INFINITY, 1e30, -1e-30] {
            for k in 0..3 {
                let mut normals = [[0.1, 0.0, 1.0], [-0.1, 0.1, 1.0], [0.0, -0.1, 1.0]];
                normals[k] = [bad; 3];
                let positions = [[0.0; 3], [bad, 0.0, 0.0], [0.0, 1.0, 0.0]];
                let subject =
                    Subject::new(positions, normals, &light, &Eye::Point([0.3, 0.2, bad]));
                if let Some(Centre::Inside(w) | Centre::OnEdge(w)) = subject.centre(1e-3) {
                    assert!(w.iter().all(|w| w.is_finite()), "{w:?}");
                }
            }
        }
    }
}
