//! Conventions, in one place.
//!
//! * **Author space**: what a scene file says. Right-handed, z up by default, `f64`.
//! * **World space**: author space re-centred on the scene and scaled by a power of two, `f32`.
//!   All shading happens here. A power of two changes no mantissa, so scaling loses nothing.
//! * **Pixel space**: homogeneous `(x w, y w, z, w)`, `f64`; after division x is to the right and y
//!   down in pixels from the top left corner of the image (the centre of the first pixel is
//!   `(0.5, 0.5)`), and `z / w` is the **reversed depth**: 1 at the near plane, 0 at the far plane.
//!   A larger depth is nearer. `w` is the distance along the viewing direction (1 if orthographic).
//! * Transforms are named destination-from-source (`pixel_from_world`), so that products read as
//!   cancellation. Vectors are columns.
//! * Counter-clockwise triangles, seen from outside, face front. They turn counter-clockwise as seen on the
//!   screen too; since y points down in pixel space, the usual formula gives them a negative area there.

use glam::{DMat4, DVec3};

/// A point in homogeneous pixel space: `[x w, y w, z, w]`.
pub type PixelPoint = [f64; 4];

/// Transforms a world point to homogeneous pixel space.
///
/// Every product and sum is rounded by itself, in the order written, at every SIMD level: coverage,
/// depth order and triangle ids must not depend on the machine.
#[inline]
#[must_use]
pub fn transform_point(pixel_from_world: &DMat4, p: [f32; 3]) -> PixelPoint {
    let [x, y, z] = p.map(f64::from);
    let m = pixel_from_world;
    let row = |i: usize| m.x_axis[i] * x + m.y_axis[i] * y + m.z_axis[i] * z + m.w_axis[i];
    [row(0), row(1), row(2), row(3)]
}

/// The power of two that brings `radius` into `[0.5, 1)`, or 1 when `radius` is zero or not finite.
#[must_use]
pub fn power_of_two_scale(radius: f64) -> f64 {
    if !(radius.is_finite() && radius > 0.0) {
        return 1.0;
    }
    let (_, exponent) = libm::frexp(radius);
    // Beyond these the scale itself, or what it multiplies, would leave the range of f64.
    libm::ldexp(1.0, -exponent.clamp(-1000, 1000))
}

/// `v` scaled to length 1 however long it is; `None` when it is zero or not finite.
#[must_use]
pub fn unit(v: DVec3) -> Option<DVec3> {
    let largest = v.abs().max_element();
    if !(largest > 0.0 && v.is_finite()) {
        return None;
    }
    // Squares of the scaled components neither overflow nor vanish all; the division is by at least 1 ulp above zero.
    Some((v / largest).normalize())
}

/// Sine and cosine of an angle in degrees, exact at right angles, the same on every machine.
#[must_use]
pub fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let turned = libm::fmod(degrees, 360.0);
    let quarter = libm::round(turned / 90.0);
    let rest = (turned - quarter * 90.0).to_radians();
    let (s, c) = (libm::sin(rest), libm::cos(rest));
    match (quarter as i32).rem_euclid(4) {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// An axis-aligned box in author or world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub min: DVec3,
    /// Largest corner.
    pub max: DVec3,
}

impl Bounds {
    /// The box that holds nothing: growing it by a point gives that point.
    pub const EMPTY: Self = Self {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    /// Grows the box to hold `p`.
    pub fn grow(&mut self, p: DVec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// True when nothing was ever put in.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.min.x > self.max.x
    }

    /// The middle of the box, or the origin when it is empty.
    #[must_use]
    pub fn center(&self) -> DVec3 {
        if self.is_empty() {
            DVec3::ZERO
        } else {
            // Halving first cannot overflow.
            self.min * 0.5 + self.max * 0.5
        }
    }

    /// Half the diagonal: the radius of the sphere about [`center`](Self::center) that holds the box.
    #[must_use]
    pub fn radius(&self) -> f64 {
        if self.is_empty() {
            0.0
        } else {
            (self.max * 0.5 - self.min * 0.5).length()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_brings_radius_into_half_open_unit_interval() {
        for radius in [1e-300, 1e-9, 0.3, 0.5, 0.999, 1.0, 7.0, 1e9, 1e300] {
            let scaled = radius * power_of_two_scale(radius);
            assert!((0.5..1.0).contains(&scaled), "{radius} became {scaled}");
        }
        for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(power_of_two_scale(odd), 1.0);
        }
    }

    #[test]
    fn bounds_of_nothing_are_a_point_at_the_origin() {
        assert_eq!(Bounds::EMPTY.center(), DVec3::ZERO);
        assert_eq!(Bounds::EMPTY.radius(), 0.0);
    }
}
