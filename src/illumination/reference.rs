//! The illumination equation in `f64`, one point at a time: what everything faster is compared with.
//!
//! ```text
//! C = ambient + sum over lights  light * ( diffuse * max(0, n.l) + specular * S )
//! ```
//!
//! with `n`, `l`, `v` the unit surface normal and the unit vectors to light and viewer. `S` is zero where `n.l <= 0`,
//! else `max(0, r.v)^shininess` (Phong; `r = 2 (n.l) n - l`) or `max(0, n.h)^shininess` (Blinn-Phong; `h` half way
//! between `l` and `v`). The factor is 0, not `0^0`, where its base is not positive.
//!
//! A vector that is zero has no direction: a zero normal, or a point on a light, gets nothing from that light; a point at the
//! eye, or a viewer exactly opposite a light (`h` is zero), sees no highlight.

use crate::scene::{Eye, ReflectionModel, ShadingLight, ShadingMaterial};
use glam::DVec3;

/// What [`shade`] found at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaded {
    /// Unclamped linear colour.
    pub rgb: [f64; 3],
    /// The smallest `|n.l|` over all lights; infinite when there are none. The equation jumps where it is zero, so
    /// comparisons leave out points where this is below 1e-6.
    pub smallest_cosine: f64,
}

/// The factors by which a light's radiance is multiplied, besides the material's coefficients.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Factors {
    /// `n.l`, not clamped.
    pub cosine: f64,
    /// `max(0, n.l)`.
    pub diffuse: f64,
    /// `S`.
    pub specular: f64,
}

/// The unit vector towards the viewer, or zero at the eye.
#[must_use]
pub fn towards_viewer(point: DVec3, eye: &Eye) -> DVec3 {
    match *eye {
        Eye::Point(position) => vector(position) - point,
        Eye::Direction(direction) => vector(direction),
    }
    .normalize_or_zero()
}

/// The unit vector towards a light, or zero at the light.
#[must_use]
pub fn towards_light(point: DVec3, light: &ShadingLight) -> DVec3 {
    let to_light = vector(light.vector);
    if light.is_point {
        to_light - point
    } else {
        to_light
    }
    .normalize_or_zero()
}

/// The factors of one light. `normal` may have any length.
#[must_use]
pub fn factors(
    point: DVec3,
    normal: DVec3,
    eye: &Eye,
    material: &ShadingMaterial,
    light: &ShadingLight,
) -> Factors {
    let v = towards_viewer(point, eye);
    let l = towards_light(point, light);
    let n = normal.normalize_or_zero();
    let cosine = n.dot(l);
    if cosine <= 0.0 {
        return Factors {
            cosine,
            ..Factors::default()
        };
    }
    let base = match material.model {
        ReflectionModel::Phong => (2.0 * cosine * n - l).dot(v),
        ReflectionModel::BlinnPhong if v == DVec3::ZERO => 0.0,
        ReflectionModel::BlinnPhong => n.dot((l + v).normalize_or_zero()),
    };
    Factors {
        cosine,
        diffuse: cosine,
        specular: if base > 0.0 {
            libm::pow(base, f64::from(material.shininess))
        } else {
            0.0
        },
    }
}

/// The colour of a point under all lights. `normal` may have any length.
#[must_use]
pub fn shade(
    point: DVec3,
    normal: DVec3,
    eye: &Eye,
    material: &ShadingMaterial,
    lights: &[ShadingLight],
) -> Shaded {
    let mut shaded = Shaded {
        rgb: material.ambient.map(f64::from),
        smallest_cosine: f64::INFINITY,
    };
    for light in lights {
        let factors = factors(point, normal, eye, material, light);
        shaded.smallest_cosine = shaded.smallest_cosine.min(factors.cosine.abs());
        for (channel, sum) in shaded.rgb.iter_mut().enumerate() {
            *sum += f64::from(light.radiance[channel])
                * (f64::from(material.diffuse[channel]) * factors.diffuse
                    + f64::from(material.specular[channel]) * factors.specular);
        }
    }
    shaded
}

/// A world space vector in double precision.
#[must_use]
pub fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(model: ReflectionModel) -> ShadingMaterial {
        ShadingMaterial {
            ambient: [0.125, 0.0, 0.0],
            diffuse: [0.0, 0.5, 0.0],
            specular: [0.0, 0.0, 0.25],
            shininess: 2.0,
            model,
        }
    }

    fn light(vector: [f32; 3], is_point: bool) -> ShadingLight {
        ShadingLight {
            vector,
            is_point,
            radiance: [1.0, 2.0, 4.0],
        }
    }

    /// Light at 60 degrees to the normal, viewer along the normal: everything is known by hand.
    #[test]
    fn a_case_worked_by_hand() {
        let half = 0.5_f32;
        let high = 0.75_f32.sqrt();
        let eye = Eye::Direction([0.0, 0.0, 1.0]);
        for is_point in [false, true] {
            let lights = [light([high, 0.0, half], is_point)];
            let up = DVec3::Z * 7.0;
            let phong = shade(
                DVec3::ZERO,
                up,
                &eye,
                &material(ReflectionModel::Phong),
                &lights,
            );
            // r.v = cos 60 degrees; squared 1/4.
            let blinn = shade(
                DVec3::ZERO,
                up,
                &eye,
                &material(ReflectionModel::BlinnPhong),
                &lights,
            );
            // n.h = cos 30 degrees; squared 3/4.
            for (rgb, blue) in [(phong.rgb, 0.25), (blinn.rgb, 0.75)] {
                assert!((rgb[0] - 0.125).abs() < 1e-7, "{rgb:?}");
                assert!((rgb[1] - 0.5).abs() < 1e-7, "{rgb:?}");
                assert!((rgb[2] - blue).abs() < 1e-7, "{rgb:?}");
            }
            assert!((phong.smallest_cosine - 0.5).abs() < 1e-7);
        }
    }

    #[test]
    fn only_the_side_of_the_normal_is_lit() {
        let eye = Eye::Direction([0.0, 0.0, -1.0]);
        let lights = [light([0.0, 0.0, -1.0], false)];
        for model in [ReflectionModel::Phong, ReflectionModel::BlinnPhong] {
            let material = material(model);
            let dark = shade(DVec3::ZERO, DVec3::Z, &eye, &material, &lights);
            assert_eq!(dark.rgb, [0.125, 0.0, 0.0]);
            let lit = shade(DVec3::ZERO, -DVec3::Z, &eye, &material, &lights);
            assert_eq!(lit.rgb, [0.125, 1.0, 1.0]);
        }
    }

    #[test]
    fn vectors_without_a_direction_give_no_light() {
        let here = [light([0.0; 3], true)];
        let above = [light([0.0, 0.0, 1.0], true)];
        let eye = Eye::Point([0.0; 3]);
        for model in [ReflectionModel::Phong, ReflectionModel::BlinnPhong] {
            let material = material(model);
            let ambient = [0.125, 0.0, 0.0];
            assert_eq!(
                shade(DVec3::ZERO, DVec3::Z, &eye, &material, &here).rgb,
                ambient
            );
            assert_eq!(
                shade(DVec3::ZERO, DVec3::ZERO, &eye, &material, &above).rgb,
                ambient
            );
            assert_eq!(
                shade(DVec3::ZERO, DVec3::Z, &eye, &material, &above).rgb,
                [0.125, 1.0, 0.0]
            );
        }
    }
}
