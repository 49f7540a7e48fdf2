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
//! A term that is absent has `hi = 0` and costs nothing. What [`shade_lanes`](crate::illumination::shade_lanes) itself errs is not part of it.

use super::bound::{LightBound, TriangleBound};
use super::power::power_below;
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
}

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
    // Room for few lights is faster made than for many.
    match lights.len() {
        0..=8 => masks_with_room::<8>(positions, normals, eye, encoding, material, lights),
        9..=32 => masks_with_room::<32>(positions, normals, eye, encoding, material, lights),
        _ => masks_with_room::<MAX_LIGHTS>(positions, normals, eye, encoding, material, lights),
    }
}

fn masks_with_room<const ROOM: usize>(
    positions: [[f32; 3]; 3],
    normals: [[f32; 3]; 3],
    eye: &Eye,
    encoding: Encoding,
    material: &ShadingMaterial,
    lights: &[ShadingLight],
) -> TriangleLights {
    let lights = &lights[..lights.len().min(ROOM)];
    let triangle = TriangleBound::new(positions, normals, eye, material);
    let mut bounds = [LightBound::default(); ROOM];
    let mut lo = material.ambient.map(f64::from);
    for (bound, light) in bounds.iter_mut().zip(lights) {
        *bound = triangle.light(light);
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
    TriangleLights {
        active,
        rough,
        verdict: if active.diffuse.is_empty() {
            Verdict::Absent
        } else {
            Verdict::Lobe
        },
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
    const HALF_CODE: f64 = 0.5 / 255.0;
    if lo >= 1.0 {
        // White is clamped.
        return f64::INFINITY;
    }
    match encoding {
        Encoding::Linear => HALF_CODE,
        Encoding::Srgb if lo <= 0.003_130_8 => HALF_CODE / 12.92,
        // encode' = 1.055 / 2.4 x^(-7/12)
        Encoding::Srgb => HALF_CODE * 2.4 / 1.055 * power_below(lo, 7.0 / 12.0),
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
}
