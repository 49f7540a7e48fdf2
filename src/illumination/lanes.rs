//! The illumination equation in SIMD lanes: what the [reference](super::reference) says, in `f32`, many points at a time.
//!
//! A lane's result depends neither on the other lanes nor on the vector width, only on whether the machine has fused multiply-add.
//! Work that no lane needs (a light behind all of them, a highlight outside of all) is skipped, and would only have
//! added zeroes. The cosine of a highlight is `1 - d` with `d = |r - v|^2 / 2` (Phong) or `|n - h|^2 / 2` (Blinn-Phong), see
//! [`power`](super::power) for why and for the error; what is below 2^-24 of its peak is zero.
//!
//! Errors are below 0.05 codes per light of ordinary brightness away from the jump of the specular term at `n.l = 0`.
//!
//! Points, normals and lights are in world space, finite, and not farther than some 1e15 from the origin, so that squares stay in
//! range. A vector shorter than about 1e-19 counts as zero, with the consequences that the reference describes.

use super::power::{Power, rsqrt_lanes};
use super::{ActiveLights, LightMask};
use crate::scene::{Eye, ReflectionModel, ShadingLight, ShadingMaterial};
use crate::simd::Simd;
use fearless_simd::prelude::*;

/// Everything the equation needs besides the point: viewer, material and lights. Cheap to make.
#[derive(Clone, Copy, Debug)]
pub struct ShadingKit<'a> {
    /// Where the viewer is.
    pub eye: Eye,
    /// The material of all points.
    pub material: &'a ShadingMaterial,
    /// The scene's lights.
    pub lights: &'a [ShadingLight],
    power: Power,
    specular: LightMask,
}

impl<'a> ShadingKit<'a> {
    /// Makes a kit, with what depends on the material alone worked out.
    #[must_use]
    pub fn new(eye: Eye, material: &'a ShadingMaterial, lights: &'a [ShadingLight]) -> Self {
        Self {
            eye,
            material,
            lights,
            power: Power::new(material.shininess),
            specular: if material.is_specular() {
                LightMask::first(lights.len())
            } else {
                LightMask::NONE
            },
        }
    }
}

/// Three components in lanes. (They are written out one by one below: `array::map` and `from_fn` are not always inlined, and
/// a vector operation outside of the dispatched function is ten times slower.)
type Lanes3<S> = [<S as Simd>::f32s; 3];

#[inline(always)]
fn dot<S: Simd>(a: Lanes3<S>, b: Lanes3<S>) -> S::f32s {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

#[inline(always)]
fn sub<S: Simd>(a: Lanes3<S>, b: Lanes3<S>) -> Lanes3<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a * b + c`, component by component.
#[inline(always)]
fn madd3<S: Simd>(a: Lanes3<S>, b: Lanes3<S>, c: Lanes3<S>) -> Lanes3<S> {
    [
        a[0].mul_add(b[0], c[0]),
        a[1].mul_add(b[1], c[1]),
        a[2].mul_add(b[2], c[2]),
    ]
}

#[inline(always)]
fn splat3<S: Simd>(simd: S, v: [f32; 3]) -> Lanes3<S> {
    [
        S::f32s::splat(simd, v[0]),
        S::f32s::splat(simd, v[1]),
        S::f32s::splat(simd, v[2]),
    ]
}

/// The unit vector and the squared length; a zero vector stays zero.
#[inline(always)]
fn normalize<S: Simd>(simd: S, v: Lanes3<S>) -> (Lanes3<S>, S::f32s) {
    let squared = dot::<S>(v, v);
    let scale = rsqrt_lanes(simd, squared);
    ([v[0] * scale, v[1] * scale, v[2] * scale], squared)
}

/// Linear, unclamped colours: ambient light and the terms of the active lights. Normals may have any length.
///
/// Lights beyond the kit's are ignored.
#[inline(always)]
pub fn shade_lanes<S: Simd>(
    simd: S,
    kit: &ShadingKit<'_>,
    active: &ActiveLights,
    point: [S::f32s; 3],
    normal: [S::f32s; 3],
) -> [S::f32s; 3] {
    let splat = |v: f32| S::f32s::splat(simd, v);
    let zero = splat(0.0);
    let material = kit.material;
    let specular = LightMask(active.specular.0 & kit.specular.0);

    let (n, _) = normalize(simd, normal);
    // Without highlights nobody asks where the viewer is.
    let (v, seen) = if specular.is_empty() {
        ([zero; 3], S::mask32s::splat(simd, false))
    } else {
        let (v, squared) = match kit.eye {
            Eye::Point(eye) => normalize(simd, sub::<S>(splat3(simd, eye), point)),
            Eye::Direction(direction) => (splat3(simd, direction), splat(1.0)),
        };
        (v, squared.simd_gt(zero))
    };

    let mut diffuse_sum = [zero; 3];
    let mut specular_sum = [zero; 3];
    for (index, light) in active_lights(active, kit) {
        let to_light = splat3(simd, light.vector);
        let l = if light.is_point {
            normalize(simd, sub::<S>(to_light, point)).0
        } else {
            to_light
        };
        let cosine = dot::<S>(n, l);
        let lit = cosine.simd_gt(zero);
        if !lit.any_true() {
            continue;
        }
        let radiance = splat3(simd, light.radiance);
        let diffuse = lit.select(cosine, zero);
        diffuse_sum = madd3::<S>(radiance, [diffuse; 3], diffuse_sum);
        if !specular.contains(index) {
            continue;
        }
        let (d, defined) = match material.model {
            ReflectionModel::Phong => {
                let twice = cosine + cosine;
                let r = [
                    twice.mul_add(n[0], -l[0]),
                    twice.mul_add(n[1], -l[1]),
                    twice.mul_add(n[2], -l[2]),
                ];
                let r_minus_v = sub::<S>(r, v);
                (dot::<S>(r_minus_v, r_minus_v) * splat(0.5), lit & seen)
            }
            ReflectionModel::BlinnPhong => {
                let sum = [l[0] + v[0], l[1] + v[1], l[2] + v[2]];
                let (h, squared) = normalize(simd, sum);
                let n_minus_h = sub::<S>(n, h);
                let d = dot::<S>(n_minus_h, n_minus_h) * splat(0.5);
                (d, lit & seen & squared.simd_gt(zero))
            }
        };
        let visible = d.simd_lt(splat(kit.power.cut())) & defined;
        if !visible.any_true() {
            continue;
        }
        let power = visible.select(kit.power.lanes(simd, d), zero);
        specular_sum = madd3::<S>(radiance, [power; 3], specular_sum);
    }

    let matte = madd3::<S>(
        splat3(simd, material.diffuse),
        diffuse_sum,
        splat3(simd, material.ambient),
    );
    madd3::<S>(splat3(simd, material.specular), specular_sum, matte)
}

/// The lights that have an active term, ascending.
#[inline(always)]
fn active_lights<'a>(
    active: &ActiveLights,
    kit: &ShadingKit<'a>,
) -> impl Iterator<Item = (usize, &'a ShadingLight)> {
    let lights = kit.lights;
    active
        .diffuse
        .iter()
        .map_while(move |index| lights.get(index).map(|light| (index, light)))
}
