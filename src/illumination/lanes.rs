//! The illumination equation in SIMD lanes: what the [reference](super::reference) says, in `f32`, many points at a time.
//!
//! A lane's result depends neither on the other lanes nor on the vector width, only on whether the machine has fused multiply-add.
//! Work that no lane needs (a light behind all of them, a highlight outside of all) is skipped, and would only have
//! added zeroes. The cosine of a highlight is `1 - q / 2` with `q = |r - v|^2` (Phong) or `|n - h|^2` (Blinn-Phong), see
//! [`power`](super::power) for why and for the error; what is below 2^-24 of its peak is zero.
//!
//! **Fewer operations.** A reflection keeps distances and is its own inverse, so `|r - v|` is `|l - w|` with the *viewer* reflected, `w = 2 (n.v) n - v`, once
//! for all lights. And `l = i L` is never formed: with `L` the vector to the light and `i = 1 / |L|`, `n.l` is `i (n.L)` (the sign
//! of `n.L` shows whether `i` is needed at all) and `l - w` is one fused operation `i L - w`, rounded once. `i` has an error of at most 6e-7. It is one of the
//! length of `l`: relative in the diffuse term, and relative in `q` to first order, as `l` and `w` have nearly the same length.
//! To second order it adds its square to `q`, which exponents above 1e7 would show: they get the slower root,
//! and so does `i` for Blinn-Phong, where `l + v` must vanish when the viewer is opposite the light.
//! An error of `n`, in contrast, turns `w` by up to four times as much; so what is normalized once per point is normalized more accurately.
//! Where all lights are grey, one channel of the sums is worked out and stands for all three, which have the same bits.
//!
//! Errors are below 0.05 codes per light of ordinary brightness away from the jump of the specular term at `n.l = 0`.
//!
//! Points, normals and lights are in world space, finite, and not farther than some 1e15 from the origin, so that squares stay in
//! range. A vector shorter than about 1e-19 counts as zero, with the consequences that the reference describes.

use super::power::{Power, rsqrt_lanes, rsqrt_quick};
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
    /// Each light has the same radiance in all channels.
    grey: bool,
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
            grey: lights.iter().all(|light| {
                let [r, g, b] = light.radiance;
                r == g && g == b
            }),
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

/// `a * b - c`, component by component.
#[inline(always)]
fn msub3<S: Simd>(a: Lanes3<S>, b: S::f32s, c: Lanes3<S>) -> Lanes3<S> {
    [
        a[0].mul_sub(b, c[0]),
        a[1].mul_sub(b, c[1]),
        a[2].mul_sub(b, c[2]),
    ]
}

/// `1 / sqrt(squared)`, slower where it must be accurate.
#[inline(always)]
fn inverse_length<S: Simd>(simd: S, accurate: bool, squared: S::f32s) -> S::f32s {
    if accurate {
        rsqrt_lanes(simd, squared)
    } else {
        rsqrt_quick(simd, squared)
    }
}

/// Adds a light's radiance times a factor, to one channel where it stands for all.
#[inline(always)]
fn add_light<S: Simd>(
    simd: S,
    kit: &ShadingKit<'_>,
    light: &ShadingLight,
    factor: S::f32s,
    sum: &mut Lanes3<S>,
) {
    let [r, g, b] = splat3(simd, light.radiance);
    sum[0] = r.mul_add(factor, sum[0]);
    if !kit.grey {
        sum[1] = g.mul_add(factor, sum[1]);
        sum[2] = b.mul_add(factor, sum[2]);
    }
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

    let twice = dot::<S>(n, v) * splat(2.0);
    let mirrored = msub3::<S>(n, twice, v);

    let extreme = kit.power.is_extreme();
    let accurate = extreme || material.model == ReflectionModel::BlinnPhong;

    let mut diffuse_sum = [zero; 3];
    let mut specular_sum = [zero; 3];
    for (index, light) in active_lights(active, kit) {
        let mut to_light = splat3(simd, light.vector);
        if light.is_point {
            to_light = sub::<S>(to_light, point);
        }
        let facing = dot::<S>(n, to_light);
        let lit = facing.simd_gt(zero);
        if !lit.any_true() {
            continue;
        }
        let scale = if light.is_point {
            inverse_length(simd, accurate, dot::<S>(to_light, to_light))
        } else {
            splat(1.0)
        };
        let diffuse = lit.select(facing * scale, zero);
        add_light(simd, kit, light, diffuse, &mut diffuse_sum);
        if !specular.contains(index) {
            continue;
        }
        let (q, defined) = match material.model {
            ReflectionModel::Phong => {
                let difference = msub3::<S>(to_light, scale, mirrored);
                (dot::<S>(difference, difference), lit & seen)
            }
            ReflectionModel::BlinnPhong => {
                let sum = madd3::<S>(to_light, [scale; 3], v);
                let squared = dot::<S>(sum, sum);
                let difference = msub3::<S>(sum, inverse_length(simd, extreme, squared), n);
                let defined = lit & seen & squared.simd_gt(zero);
                (dot::<S>(difference, difference), defined)
            }
        };
        let visible = q.simd_lt(splat(kit.power.cut())) & defined;
        if !visible.any_true() {
            continue;
        }
        let power = visible.select(kit.power.lanes(simd, q), zero);
        add_light(simd, kit, light, power, &mut specular_sum);
    }
    if kit.grey {
        diffuse_sum = [diffuse_sum[0]; 3];
        specular_sum = [specular_sum[0]; 3];
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
