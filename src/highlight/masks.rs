//! Which lights must be evaluated at every pixel of a triangle, so that the picture is right within half a code.
//!
//! A term of a light (its diffuse or its specular one) that is not evaluated per pixel is interpolated between the triangle's corners. Its
//! error is at most `e = radiance * coefficient * deviation` ([`bound`](super::bound)), per channel. With `lo` a lower
//! bound of the pixel's colour, by interpolation or not, all skipped terms together are harmless if
//!
//! ```text
//! encode(lo + sum e) - encode(lo) <= 0.5 codes.
//! ```
//!
//! As `encode` is concave, two colours above `lo` that differ by `sum e` differ by at most that in code, and it suffices that
//! `sum e <= 0.5 / encode'(lo)`. The right hand side is the budget of a channel (unlimited at white). It depends on the image's
//! [`Encoding`]: for a linear one it is half a code of light everywhere, less than for sRGB in bright colours. Terms are skipped in the
//! order of the share of the budget that they take, until it is spent.
//!
//! **Claims.** While a triangle is on its way to that, its pixels show less: colours interpolated over parts of it, or quadratics. How far those
//! may be off at most is a by-product. Write a factor as the linear interpolation of its values at the triangle's corners and a rest `d`,
//! `|d| <= D`. Linear functions are reproduced by all of these, so only the rest counts:
//!
//! | shown | error of the rest | error within `[lo, hi]` |
//! |---|---|---|
//! | linear over the triangle | `D` | `hi - lo` |
//! | linear over any part, right at its corners | `2 D` | `hi - lo` |
//! | the quadratic through corners and middles of edges | `(1 + 4/3) D` | `4/3 (hi - lo)` |
//! | the same over parts, and on an edge interpolated by another quadratic | `(1 + 5/3 * 5/4) D` | `(1 + 1/8 + 5/3 * 1/4) (hi - lo)` |
//!
//! (The Lebesgue constants of quadratic interpolation are 5/4 on an edge and 5/3 on a triangle: the greatest sum of the absolute values of its basis, of
//! which those of the corners are not less than -1/8 each.) The last line is `ANY_FORM` and holds for all of them, the third
//! `QUADRATIC`. Where light may be off by `e` either way and is at least `lo`, it is off by at most `encode(max(lo, e)) - encode(max(lo, e) - e)`
//! in code.
//!
//! A term that is absent has `hi = 0` and costs nothing. What [`shade_lanes`](crate::illumination::shade_lanes) itself errs is not part of it.

use super::bound::{FactorBound, LightBound, TriangleBound};
use super::cluster::{ClusterBound, ClusterShape};
use super::power::{power_above, power_below};
use crate::illumination::{ActiveLights, LightMask, MAX_LIGHTS};
use crate::output::Encoding;
use crate::scene::{Eye, ShadingLight, ShadingMaterial, World};

/// What is known of a triangle's highlights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Interpolation between its corners is proved right within half a code.
    Absent,
    /// Something may vary visibly.
    Lobe,
    /// And the vertices' signs say that a highlight's centre is near.
    Centre,
}

/// What must be evaluated at every pixel of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangleLights {
    /// The terms; all others may be interpolated between the corners.
    pub active: ActiveLights,
    /// Those of them that no smooth function follows: highlights, and diffuse terms of lights that set on the triangle.
    pub rough: ActiveLights,
    /// The same in one word.
    pub verdict: Verdict,
    /// How far the picture may be off while not all of it is evaluated.
    pub claim: Claim,
}

/// How far pixels of a triangle may be from per-pixel Phong shading at most, in 8-bit codes, rounding to codes included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Claim {
    /// However its colours are interpolated: linearly or by quadratics, over the whole of it or over parts.
    pub interpolated: u8,
    /// With the [rough](TriangleLights::rough) terms evaluated and all others interpolated by a quadratic over the whole; not more.
    pub rough_evaluated: u8,
}

impl Claim {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self {
        interpolated: u8::MAX,
        rough_evaluated: u8::MAX,
    };

    /// Half a code for all that is left out, and rounding.
    pub const RIGHT: Self = Self {
        interpolated: 1,
        rough_evaluated: 1,
    };
}

/// By what the deviation of a factor from linear interpolation, and its interval, are multiplied to bound the error of a way to show it.
type Form = [f64; 2];

/// However it is interpolated. See the [module](self).
const ANY_FORM: Form = [37.0 / 12.0, 37.0 / 24.0];

/// By a quadratic over the whole triangle.
const QUADRATIC: Form = [7.0 / 3.0, 4.0 / 3.0];

impl TriangleLights {
    /// Takes the vertices' signs into account: the lights for which the triangle is potentially highlighted.
    #[must_use]
    pub fn with_pht(mut self, pht: LightMask) -> Self {
        if pht.0 & self.active.specular.0 != 0 {
            self.verdict = Verdict::Centre;
        }
        self
    }
}

/// The terms that must be evaluated at every pixel of a triangle of the world.
///
/// # Panics
/// When there is no such triangle.
#[must_use]
pub fn light_masks(world: &World, eye: &Eye, encoding: Encoding, triangle: u32) -> TriangleLights {
    let vertices = world.triangles[triangle as usize].map(|vertex| vertex as usize);
    let material = usize::from(world.triangle_material[triangle as usize]);
    masks_of(
        vertices.map(|vertex| world.positions.get(vertex)),
        vertices.map(|vertex| world.normals.get(vertex)),
        eye,
        encoding,
        &world.materials[material],
        &world.lights,
    )
}

/// The terms that must be evaluated at some pixel of some triangle of a cluster, so that all that is said holds for each of its triangles.
///
/// # Panics
/// When there is no such cluster.
#[must_use]
pub fn cluster_masks(
    world: &World,
    eye: &Eye,
    encoding: Encoding,
    triangle: u32,
    shape: &ClusterShape,
) -> TriangleLights {
    // A cluster belongs to one side of one object.
    let material = usize::from(world.triangle_material[triangle as usize]);
    let material = &world.materials[material];
    let cluster = ClusterBound::new(shape, eye, material);
    with_room(encoding, material, &world.lights, |light| {
        cluster.light(light)
    })
}

/// The terms that must be evaluated at every pixel of a triangle with these corners and normals.
///
/// Lights beyond [`MAX_LIGHTS`] are ignored.
#[must_use]
pub fn masks_of(
    positions: [[f32; 3]; 3],
    normals: [[f32; 3]; 3],
    eye: &Eye,
    encoding: Encoding,
    material: &ShadingMaterial,
    lights: &[ShadingLight],
) -> TriangleLights {
    let triangle = TriangleBound::new(positions, normals, eye, material);
    with_room(encoding, material, lights, |light| triangle.light(light))
}

fn with_room(
    encoding: Encoding,
    material: &ShadingMaterial,
    lights: &[ShadingLight],
    bound: impl Fn(&ShadingLight) -> LightBound,
) -> TriangleLights {
    // Room for few lights is faster made than for many.
    match lights.len() {
        0..=8 => masks::<8>(encoding, material, lights, bound),
        9..=32 => masks::<32>(encoding, material, lights, bound),
        _ => masks::<MAX_LIGHTS>(encoding, material, lights, bound),
    }
}

fn masks<const ROOM: usize>(
    encoding: Encoding,
    material: &ShadingMaterial,
    lights: &[ShadingLight],
    bound_light: impl Fn(&ShadingLight) -> LightBound,
) -> TriangleLights {
    let lights = &lights[..lights.len().min(ROOM)];
    let mut bounds = [LightBound::default(); ROOM];
    let mut lo = material.ambient.map(f64::from);
    for (bound, light) in bounds.iter_mut().zip(lights) {
        *bound = bound_light(light);
        for (channel, lo) in lo.iter_mut().enumerate() {
            let [diffuse, specular] = amplitudes(material, light, channel);
            *lo += diffuse * bound.diffuse.lo + specular * bound.specular.lo;
        }
    }
    let rates = lo.map(|lo| budget(encoding, lo).recip());
    let mut terms = [[Term::default(); 2]; ROOM];
    for (index, ((bound, light), pair)) in bounds.iter().zip(lights).zip(&mut terms).enumerate() {
        let shares = |term: usize, deviation: f64| {
            std::array::from_fn(|channel| {
                amplitudes(material, light, channel)[term] * deviation * rates[channel]
            })
        };
        let specular = Term::new(index, true, shares(1, bound.specular.deviation));
        let mut diffuse = Term::new(index, false, shares(0, bound.diffuse.deviation));
        diffuse.is_rough = bound.diffuse.lo <= 0.0;
        // Where the specular term is evaluated the diffuse one costs next to nothing: it comes after.
        diffuse.order = diffuse.order.max(specular.order);
        *pair = [specular, diffuse];
    }
    let [active, rough] = spend(terms[..lights.len()].as_flattened_mut());
    let claimed = |form: Form, evaluated: ActiveLights| {
        let bounded = bounds.iter().zip(lights);
        claim(encoding, lo, material, bounded, form, evaluated)
    };
    TriangleLights {
        active,
        rough,
        verdict: if active.diffuse.is_empty() {
            Verdict::Absent
        } else {
            Verdict::Lobe
        },
        claim: Claim {
            interpolated: claimed(ANY_FORM, ActiveLights::default()),
            rough_evaluated: claimed(QUADRATIC, rough),
        },
    }
}

/// How far a pixel of at least `lo` may be off, in codes, if all terms are shown in a form but those `evaluated`.
fn claim<'a>(
    encoding: Encoding,
    lo: [f64; 3],
    material: &ShadingMaterial,
    bounded: impl Iterator<Item = (&'a LightBound, &'a ShadingLight)>,
    form: Form,
    evaluated: ActiveLights,
) -> u8 {
    let error = |bound: &FactorBound, is_evaluated: bool| {
        if is_evaluated {
            0.0
        } else {
            (form[0] * bound.deviation).min(form[1] * (bound.hi - bound.lo))
        }
    };
    let mut light_off = [0.0; 3];
    for (index, (bound, light)) in bounded.enumerate() {
        let diffuse = error(&bound.diffuse, evaluated.diffuse.contains(index));
        let specular = error(&bound.specular, evaluated.specular.contains(index));
        for (channel, sum) in light_off.iter_mut().enumerate() {
            let [k_d, k_s] = amplitudes(material, light, channel);
            *sum += k_d * diffuse + k_s * specular;
        }
    }
    let codes = light_off.iter().zip(lo).map(|(&off, lo)| {
        // Two codes that differ by less than a whole number before rounding differ by at most that after it.
        (codes_off(encoding, lo, off) + ROUNDING).ceil()
    });
    codes.fold(1, |most, codes| {
        if codes <= 254.0 {
            most.max(codes as u8)
        } else {
            u8::MAX
        }
    })
}

/// What the arithmetic of pictures, in `f32`, may add, in codes.
const ROUNDING: f64 = 0.1;

/// Not less than the difference in code of two colours, one of them at least `lo`, that differ by at most `off` in light; infinite
/// where nothing is known.
fn codes_off(encoding: Encoding, lo: f64, off: f64) -> f64 {
    if off.is_nan() || lo.is_nan() {
        return f64::INFINITY;
    }
    // Beyond white everything is white.
    let off = off - (lo - 1.0).max(0.0);
    if off <= 0.0 {
        return 0.0;
    }
    let lo = lo.min(1.0);
    let least = lo - off;
    if least >= 0.5 * lo {
        slope(encoding, least) * off
    } else {
        // The second is about the first.
        encode_above(encoding, lo.max(off))
    }
}

/// What the factors of a light are multiplied with: diffuse, specular.
fn amplitudes(material: &ShadingMaterial, light: &ShadingLight, channel: usize) -> [f64; 2] {
    let radiance = f64::from(light.radiance[channel]);
    [material.diffuse, material.specular].map(|k| radiance * f64::from(k[channel]))
}

/// A term that might be skipped.
#[derive(Clone, Copy, Debug, Default)]
struct Term {
    light: usize,
    specular: bool,
    /// Whether it belongs to [`TriangleLights::rough`] if it is active.
    is_rough: bool,
    /// Of the budget of each channel.
    shares: [f64; 3],
    order: f64,
}

impl Term {
    fn new(light: usize, specular: bool, shares: [f64; 3]) -> Self {
        Self {
            light,
            specular,
            is_rough: specular,
            shares,
            order: shares[0].max(shares[1]).max(shares[2]),
        }
    }
}

/// Skips terms until the budget of a channel is spent; the rest is active. And the same as if there were only rough terms.
fn spend(terms: &mut [Term]) -> [ActiveLights; 2] {
    // Stable order: a light's specular term stays before its diffuse one.
    let key = |term: &Term| (term.order, term.light, !term.specular);
    terms.sort_unstable_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2)))
    });
    let [mut all, mut rough] = [Spending::default(); 2];
    for term in terms {
        all.take(term);
        if term.is_rough {
            rough.take(term);
        }
    }
    [all.active, rough.active]
}

/// How much of the budget has been spent, and what did not fit in.
#[derive(Clone, Copy, Debug, Default)]
struct Spending {
    active: ActiveLights,
    spent: [f64; 3],
}

impl Spending {
    /// Skips a term if the budget allows that. Not the diffuse term of a light whose specular one is active.
    fn take(&mut self, term: &Term) {
        if self.active.specular.contains(term.light) {
            return;
        }
        let after: [f64; 3] = std::array::from_fn(|i| self.spent[i] + term.shares[i]);
        if after.iter().all(|&sum| sum <= 1.0) {
            self.spent = after;
            return;
        }
        self.active.diffuse.insert(term.light);
        if term.specular {
            self.active.specular.insert(term.light);
        }
    }
}

/// How much linear light may be added to a channel that is at least `lo`: half a code at the slope there.
fn budget(encoding: Encoding, lo: f64) -> f64 {
    if lo >= 1.0 {
        // White is clamped.
        return f64::INFINITY;
    }
    0.5 / slope(encoding, lo)
}

/// Linear light up to which the sRGB curve is a straight line, and its slope.
const TOE: (f64, f64) = (0.003_130_8, 12.92);

/// Codes per linear light at `x`, or more, for `x` up to 1.
fn slope(encoding: Encoding, x: f64) -> f64 {
    255.0
        * match encoding {
            Encoding::Linear => 1.0,
            Encoding::Srgb if x <= TOE.0 => TOE.1,
            // encode' = 1.055 / 2.4 x^(-7/12)
            Encoding::Srgb => 1.055 / 2.4 / power_below(x, 7.0 / 12.0),
        }
}

/// The code of linear light `x >= 0`, or more.
fn encode_above(encoding: Encoding, x: f64) -> f64 {
    if x >= 1.0 {
        return 255.0;
    }
    255.0
        * match encoding {
            Encoding::Linear => x,
            Encoding::Srgb if x <= TOE.0 => TOE.1 * x,
            Encoding::Srgb => 1.055 * power_above(x, 1.0 / 2.4) - 0.055,
        }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_budget_is_at_most_half_a_code_and_not_much_less() {
        for encoding in Encoding::ALL {
            for i in 0..=1000 {
                let lo = (f64::from(i) / 1000.0).powi(2) * 0.98;
                let codes = encoding.encode(lo + budget(encoding, lo)) - encoding.encode(lo);
                assert!(
                    (0.45..=0.500_001).contains(&codes),
                    "{encoding}: {codes} codes at {lo}"
                );
            }
            assert_eq!(budget(encoding, 1.0), f64::INFINITY);
        }
    }

    #[test]
    fn codes_are_off_by_no_more_than_is_said() {
        for encoding in Encoding::ALL {
            for i in 0..=60 {
                let lo = 1.2 * (f64::from(i) / 60.0).powi(3);
                for j in 0..=60 {
                    let off = 1.5 * (f64::from(j) / 60.0).powi(4);
                    let said = codes_off(encoding, lo, off);
                    let mut most = 0.0_f64;
                    for k in 0..=200 {
                        let colour = lo + f64::from(k) / 100.0;
                        let codes = encoding.encode(colour);
                        most = most.max(codes - encoding.encode(colour - off));
                        most = most.max(encoding.encode(colour + off) - codes);
                    }
                    assert!(most <= said + 1e-9, "{encoding} {lo} {off}: {most} {said}");
                    let loose = 2.0 * most + encoding.encode(lo) + 1e-9;
                    assert!(said <= loose, "{encoding} {lo} {off}: {most} {said}");
                }
            }
            assert_eq!(codes_off(encoding, 0.5, f64::NAN), f64::INFINITY);
        }
    }
}
