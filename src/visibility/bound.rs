//! What is known of a cluster, or of a set of clusters: a ball, a cone of normals and an altitude.
//!
//! A set is bounded by what bounds its members, so that one test serves both:
//!
//! * its ball holds their balls: `|C - C_i| + r_i <= r`;
//! * its cone holds their cones: with an angle `theta_i` between the axes and a half-angle `alpha_i` there,
//!   `cos(alpha) <= cos(theta_i + alpha_i) = cos(theta_i) cos(alpha_i) - sin(theta_i) sin(alpha_i)`, all three angles
//!   below 90° (otherwise there is no cone);
//! * its altitude is the smallest of theirs.
//!
//! A cluster **cannot turn away** if it has no cone narrower than 180°, or no altitude: it is never dropped for facing
//! away. A set that it is in has the altitude 0 and is not dropped either. But its cone is left out there, so that it
//! does not spoil the others': where all that can turn away face the viewer, the set is drawn as a whole.
//!
//! **Rounding.** Balls, axes and altitudes are `f32`. Radii of sets are rounded up; a cluster's numbers stay as they
//! are. An axis is a vector a with a length near 1, and cosine and sine are stored over |a|, which saves normalizing
//! it. The sine is the root of `(1 - cos) (1 + cos)`, without cancellation. So all is off by a few times 2^-53 of
//! itself, but for the cosine of a set, which is a difference; it is lowered by `CONE_PADDING`.
//!
//! **Odd numbers.** A cluster with NaN or infinity in its ball, or beyond `LARGEST_COORDINATE`, is *unbounded*: the ball
//! about the origin with an infinite radius, no cone, no altitude. No test drops it, nor a set that it is in.

use crate::geometry::Cluster;
use crate::math::Bounds;
use glam::{DVec3, Vec3};

/// Clusters that reach beyond this are always drawn.
const LARGEST_COORDINATE: f32 = 1e15;

/// More than ten roundings of 2^-53.
const CONE_PADDING: f64 = 1.0 / (1_u64 << 48) as f64;

/// The bounds of a cluster or of a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bound {
    pub(super) center: [f32; 3],
    pub(super) radius: f32,
    /// Zero if there is no cone, as are the cosine and the sine.
    pub(super) axis: [f32; 3],
    /// Cosine of the cone's half-angle, over the length of the axis.
    pub(super) cos: f64,
    /// Sine of the cone's half-angle, over the length of the axis.
    pub(super) sin: f64,
    /// No triangle with three different corners has a smaller altitude. 0 if there is a cluster that cannot turn away.
    pub(super) altitude: f32,
    /// Whether there is a cluster that can turn away.
    pub(super) can_turn_away: bool,
}

impl Bound {
    const UNBOUNDED: Self = Self {
        center: [0.0; 3],
        radius: f32::INFINITY,
        axis: [0.0; 3],
        cos: 0.0,
        sin: 0.0,
        altitude: 0.0,
        can_turn_away: false,
    };

    pub(super) fn of_cluster(cluster: &Cluster) -> Self {
        let (center, radius) = (Vec3::from(cluster.center), cluster.radius);
        let reach = center.abs() + radius;
        // False for NaN, as the comparisons below.
        let is_bounded = radius >= 0.0 && reach.cmple(Vec3::splat(LARGEST_COORDINATE)).all();
        if !is_bounded {
            return Self::UNBOUNDED;
        }
        let ball = Self {
            center: cluster.center,
            radius,
            ..Self::UNBOUNDED
        };
        let axis = wide(cluster.cone_axis);
        let cos = f64::from(cluster.cone_cos) / axis.length();
        let is_cone = cos > 0.0 && cos.is_finite() && axis.is_finite();
        if !(is_cone && cluster.min_altitude > 0.0) {
            return ball;
        }
        Self {
            altitude: cluster.min_altitude,
            can_turn_away: true,
            ..ball.with_cone(cluster.cone_axis, cos)
        }
    }

    /// The bounds of all of `members`.
    pub(super) fn of_set(members: impl Iterator<Item = Self> + Clone) -> Self {
        let altitude = members.clone().map(|m| m.altitude).fold(f32::MAX, f32::min);
        let (center, radius) = ball(members.clone());
        let turning = members.filter(|member| member.can_turn_away);
        let set = Self {
            center,
            radius,
            altitude,
            can_turn_away: turning.clone().next().is_some(),
            ..Self::UNBOUNDED
        };
        match cone(turning) {
            Some((axis, cos)) => set.with_cone(axis, cos),
            None => set,
        }
    }

    pub(super) fn is_bounded(&self) -> bool {
        self.radius < f32::INFINITY
    }

    /// The axis as a unit vector; zero if there is no cone.
    fn direction(&self) -> DVec3 {
        wide(self.axis).normalize_or_zero()
    }

    fn with_cone(self, axis: [f32; 3], cos: f64) -> Self {
        let length = wide(axis).length();
        let cos = cos.min(1.0);
        Self {
            axis,
            cos: cos / length,
            sin: sine(cos) / length,
            ..self
        }
    }
}

/// The ball about the middle of the centres' box that holds all the balls.
fn ball(members: impl Iterator<Item = Bound> + Clone) -> ([f32; 3], f32) {
    let mut bounds = Bounds::EMPTY;
    members.clone().for_each(|m| bounds.grow(wide(m.center)));
    let center = bounds.center().as_vec3();
    let radius = members
        .map(|m| wide(m.center).distance(center.as_dvec3()) + f64::from(m.radius))
        .fold(0.0, f64::max);
    // One step of f32 above the nearest is more than the f64 sum may be off.
    (center.to_array(), (radius as f32).next_up())
}

/// Axis and cosine of the half-angle of a cone about all cones of `members`, each of which has one, unless it is too
/// wide or there are none.
fn cone(members: impl Iterator<Item = Bound> + Clone) -> Option<([f32; 3], f64)> {
    let sum: DVec3 = members.clone().map(|m| m.direction()).sum();
    let axis = sum.try_normalize()?.as_vec3();
    let direction = axis.as_dvec3().normalize();
    let mut least: f64 = 1.0;
    for member in members {
        let stored = wide(member.axis);
        let length = stored.length();
        let (cos, sin) = (member.cos * length, member.sin * length);
        let (cos_between, sin_between) = (
            direction.dot(stored) / length,
            direction.cross(stored).length() / length,
        );
        if cos_between <= 0.0 {
            return None;
        }
        least = least.min(cos_between * cos - sin_between * sin);
    }
    let padded = least - CONE_PADDING;
    (padded > 0.0).then_some((axis.to_array(), padded))
}

fn sine(cos: f64) -> f64 {
    ((1.0 - cos) * (1.0 + cos)).sqrt()
}

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vectors(range: std::ops::Range<f32>) -> impl Strategy<Value = [f32; 3]> {
        prop::array::uniform3(range)
    }

    /// Clusters around one direction, most of them with a cone.
    fn clusters() -> impl Strategy<Value = Vec<Cluster>> {
        let spread = prop::sample::select(vec![0.0_f32, 1e-4, 0.1, 0.5, 2.0]);
        let members = prop::collection::vec(
            (
                vectors(-10.0..10.0),
                prop_oneof![Just(0.0_f32), 1e-6..3.0_f32],
                vectors(-1.0..1.0),
                prop_oneof![0.9_f32..0.999_998, -1.0..1.0_f32],
                prop_oneof![1e-6..1.0_f32, Just(0.0_f32)],
            ),
            1..20,
        );
        (vectors(-1.0..1.0), spread, members).prop_map(|(mean, spread, members)| {
            let mean = wide(mean).normalize_or(DVec3::Z);
            let cluster = |(center, radius, tilt, cone_cos, min_altitude)| Cluster {
                triangles: 0..1,
                center,
                radius,
                cone_axis: (mean + wide(tilt) * f64::from(spread))
                    .normalize_or(DVec3::Z)
                    .as_vec3()
                    .to_array(),
                cone_cos,
                min_altitude,
            };
            members.into_iter().map(cluster).collect()
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, cases: 1000, ..ProptestConfig::default() })]

        /// The ball, the cone and the altitude of a set hold those of its members.
        #[test]
        fn sets_hold_their_members(clusters in clusters(), turns in prop::collection::vec(0.0..6.3_f64, 8)) {
            let members: Vec<Bound> = clusters.iter().map(Bound::of_cluster).collect();
            let set = Bound::of_set(members.iter().copied());
            let length = wide(set.axis).length();
            for (cluster, member) in clusters.iter().zip(&members) {
                let distance = wide(set.center).distance(wide(cluster.center));
                prop_assert!(distance + f64::from(cluster.radius) <= f64::from(set.radius));
                prop_assert!(set.altitude <= member.altitude);
                if !member.can_turn_away {
                    prop_assert_eq!(set.altitude, 0.0);
                    continue;
                }
                prop_assert!(set.can_turn_away);
                if set.cos == 0.0 {
                    continue;
                }
                // Directions on the border of the member's cone.
                let axis = member.direction();
                let cos = f64::from(cluster.cone_cos) / wide(cluster.cone_axis).length();
                let side = axis.any_orthonormal_vector();
                for &turn in &turns {
                    let (s, c) = libm::sincos(turn);
                    let around = side * c + axis.cross(side) * s;
                    let border = axis * cos + around * (1.0 - cos * cos).sqrt();
                    let inside = border.dot(set.direction());
                    prop_assert!(inside >= set.cos * length - 1e-14, "{} {:?}", inside, set);
                }
            }
        }
    }

    fn plain(cone_axis: [f32; 3]) -> Cluster {
        Cluster {
            triangles: 0..1,
            center: [1.0, 2.0, 3.0],
            radius: 0.5,
            cone_axis,
            cone_cos: 0.9,
            min_altitude: 0.1,
        }
    }

    #[test]
    fn what_cannot_turn_away_spoils_no_cone() {
        let cluster = Bound::of_cluster(&plain([0.0, 0.0, 1.0]));
        let still = Bound::of_cluster(&Cluster {
            cone_cos: -1.0,
            ..plain([1.0, 0.0, 0.0])
        });
        assert!(cluster.can_turn_away && !still.can_turn_away);
        let set = Bound::of_set([cluster, still].into_iter());
        assert!(set.can_turn_away && set.altitude == 0.0 && set.cos > 0.89);
        let opposite = Bound::of_cluster(&plain([0.0, 0.0, -1.0]));
        let set = Bound::of_set([cluster, opposite].into_iter());
        assert!(set.can_turn_away && set.cos == 0.0 && set.axis == [0.0; 3]);
    }

    #[test]
    fn odd_numbers_are_unbounded() {
        for odd in [f32::NAN, f32::INFINITY, 1e30] {
            let base = plain([0.0, 0.0, 1.0]);
            for cluster in [
                Cluster {
                    radius: odd,
                    ..base.clone()
                },
                Cluster {
                    center: [0.0, odd, 0.0],
                    ..base.clone()
                },
            ] {
                let bound = Bound::of_cluster(&cluster);
                assert_eq!(bound, Bound::UNBOUNDED);
                let set = Bound::of_set([bound, Bound::of_cluster(&base)].into_iter());
                assert!(set.radius == f32::INFINITY && set.altitude == 0.0);
            }
        }
        for axis in [[f32::NAN; 3], [0.0; 3], [f32::INFINITY, 0.0, 0.0]] {
            assert!(!Bound::of_cluster(&plain(axis)).can_turn_away);
        }
    }
}
