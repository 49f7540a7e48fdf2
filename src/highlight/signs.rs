//! The paper's H1 and H2 tests by signs at the vertices (Cho, Neumann and Woo, section 2.3).
//!
//! A mirror-like highlight needs a normal that lies in the plane LVP of light, viewer and point (H1) and in the
//! halfway plane, which is orthogonal to it and holds the halfway vector (H2). A vertex stores, for every light, on which side of
//! both planes its normal is:
//!
//! * H1: the sign of `(L x V) . N`;
//! * H2: whether `cos(L, N) > cos(V, N)`. With `b = L.N`, `a = V.N` that is `b |b| |V|^2 > a |a| |L|^2`: the paper's
//!   comparison of squares, whose case distinction of signs is in `x |x|`, and without its divisions;
//! * *back*: both `a` and `b` are negative, hence neither light nor viewer is on the side of the normal.
//!
//! No vector is normalized. A triangle passes for a light when both H1 and H2 differ among its vertices, unless all three are *back*
//! (the paper leaves out a triangle whose vertex is; one with a corner beyond the horizon can still hold a highlight).
//!
//! **Zero** counts as the negative side. Where light and viewer are in the same direction (a headlight) both values are
//! zero everywhere, both planes are undefined, and no triangle passes; the [bound](super::bound) still sees the highlight.
//! Products and sums are rounded one by one and in the same order at every SIMD level, so the bits are the same on all machines,
//! and parallel vectors give exact zeroes. Where products leave the range of `f32` (lengths beyond 1e9, or below
//! 1e-10) a bit may be wrong; nothing relies on it but a classification.

use crate::illumination::batch::{MAX_LANES, gather};
use crate::illumination::{LightMask, MAX_LIGHTS};
use crate::scene::{Eye, ShadingLight, World};
use crate::simd::{Level, Simd, dispatch};
use fearless_simd::prelude::*;

/// Lights whose bits share a word: as many as there is room for with three bits each.
const WORD_LIGHTS: usize = 10;

/// Where in a word each test's bits begin, light by light.
const H1: usize = 0;
const H2: usize = WORD_LIGHTS;
const BACK: usize = 2 * WORD_LIGHTS;

/// The bits of one test.
const ONE_TEST: u32 = (1 << WORD_LIGHTS) - 1;

/// The sign bits of some vertices, by their places in the list they were computed for.
#[derive(Clone, Debug, Default)]
pub struct SignBits {
    /// For each [`WORD_LIGHTS`] lights, a word for each vertex.
    words: Vec<Vec<u32>>,
}

impl SignBits {
    /// Makes room for the bits of `vertices` vertices under `lights` lights.
    pub fn reserve(&mut self, vertices: usize, lights: usize) {
        let words = lights.min(MAX_LIGHTS).div_ceil(WORD_LIGHTS);
        self.words
            .resize_with(words.max(self.words.len()), Default::default);
        for words in &mut self.words {
            let room = vertices.next_multiple_of(MAX_LANES);
            words.reserve(room.saturating_sub(words.len()));
        }
    }

    /// Takes as many vertices under as many lights. Allocates only when there were never so many.
    fn resize(&mut self, vertices: usize, lights: usize) {
        let words = lights.min(MAX_LIGHTS).div_ceil(WORD_LIGHTS);
        self.words.resize_with(words, Default::default);
        for words in &mut self.words {
            // The last vector is stored whole.
            words.resize(vertices.next_multiple_of(MAX_LANES), 0);
        }
    }

    /// Lights for which both tests differ among three vertices, given by their places in the list: the triangle is a
    /// potentially highlighted one.
    ///
    /// # Panics
    /// When there is no such place.
    #[inline]
    #[must_use]
    pub fn pht_lights(&self, places: [usize; 3]) -> LightMask {
        let mut mask = 0;
        for (index, words) in self.words.iter().enumerate() {
            mask |= u128::from(passes(words, places)) << (index * WORD_LIGHTS);
        }
        LightMask(mask)
    }

    /// Whether there is any such light.
    ///
    /// # Panics
    /// When there is no such place.
    #[inline]
    #[must_use]
    pub fn is_pht(&self, places: [usize; 3]) -> bool {
        self.words.iter().any(|words| passes(words, places) != 0)
    }
}

/// For which lights of a word both tests differ among three vertices.
#[inline]
fn passes(words: &[u32], places: [usize; 3]) -> u32 {
    let [a, b, c] = places.map(|place| words[place]);
    let all = a & b & c;
    let differ = (a | b | c) & !all;
    (differ >> H1) & (differ >> H2) & !(all >> BACK) & ONE_TEST
}

/// Computes the bits of vertices given by index: `bits` then holds those of the vertices in this list, in its order.
///
/// # Panics
/// When a vertex is not one of the world's.
pub fn compute_signs(level: Level, world: &World, eye: Eye, vertices: &[u32], bits: &mut SignBits) {
    bits.resize(vertices.len(), world.lights.len());
    dispatch!(level, simd => signs_of_list(simd, world, eye, vertices, bits));
}

#[inline(always)]
fn signs_of_list<S: Simd>(simd: S, world: &World, eye: Eye, vertices: &[u32], bits: &mut SignBits) {
    let lanes = S::f32s::LEN;
    for (group, first) in vertices.chunks(lanes).zip((0..).step_by(lanes)) {
        let mut places = [group[0] as usize; MAX_LANES];
        for (place, &vertex) in places.iter_mut().zip(group) {
            *place = vertex as usize;
        }
        let point = gather(simd, &world.positions, &places);
        let normal = gather(simd, &world.normals, &places);
        let to_viewer = match eye {
            Eye::Point(eye) => towards(simd, eye, point),
            Eye::Direction(direction) => splat3(simd, direction),
        };
        for (words, lights) in bits.words.iter_mut().zip(world.lights.chunks(WORD_LIGHTS)) {
            let word = signs_of_lights(simd, lights, point, normal, to_viewer);
            word.store_slice(&mut words[first..first + lanes]);
        }
    }
}

/// The word of up to [`WORD_LIGHTS`] lights.
#[inline(always)]
fn signs_of_lights<S: Simd>(
    simd: S,
    lights: &[ShadingLight],
    point: [S::f32s; 3],
    n: [S::f32s; 3],
    v: [S::f32s; 3],
) -> S::u32s {
    let zero = S::f32s::splat(simd, 0.0);
    let none = S::u32s::splat(simd, 0);
    let mut word = none;
    let a = dot::<S>(v, n);
    let (a_signed_square, v_square) = (a * a.abs(), dot::<S>(v, v));
    for (index, light) in lights.iter().enumerate() {
        let l = if light.is_point {
            towards(simd, light.vector, point)
        } else {
            splat3(simd, light.vector)
        };
        let cross = [
            l[1] * v[2] - l[2] * v[1],
            l[2] * v[0] - l[0] * v[2],
            l[0] * v[1] - l[1] * v[0],
        ];
        let b = dot::<S>(l, n);
        let tests = [
            dot::<S>(cross, n).simd_gt(zero),
            (b * b.abs() * v_square).simd_gt(a_signed_square * dot::<S>(l, l)),
            a.simd_lt(zero) & b.simd_lt(zero),
        ];
        for (test, first) in tests.into_iter().zip([H1, H2, BACK]) {
            let bit = S::u32s::splat(simd, 1 << (first + index));
            word |= test.select(bit, none);
        }
    }
    word
}

/// Rounded term by term, so that no level differs.
#[inline(always)]
fn dot<S: Simd>(a: [S::f32s; 3], b: [S::f32s; 3]) -> S::f32s {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn towards<S: Simd>(simd: S, target: [f32; 3], from: [S::f32s; 3]) -> [S::f32s; 3] {
    let target = splat3(simd, target);
    [
        target[0] - from[0],
        target[1] - from[1],
        target[2] - from[2],
    ]
}

#[inline(always)]
fn splat3<S: Simd>(simd: S, v: [f32; 3]) -> [S::f32s; 3] {
    [
        S::f32s::splat(simd, v[0]),
        S::f32s::splat(simd, v[1]),
        S::f32s::splat(simd, v[2]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::illumination::reference::{towards_light, towards_viewer, vector};
    use crate::scene::{ReflectionModel, ShadingMaterial};
    use crate::simd::SimdLevel;
    use glam::DVec3;

    /// Section 2.3 in double precision, with normalized vectors and cosines: `[h1, h2]` as signed values, and *back*.
    fn by_angles(point: DVec3, n: DVec3, eye: &Eye, light: &ShadingLight) -> ([f64; 2], bool) {
        let (l, v) = (towards_light(point, light), towards_viewer(point, eye));
        let n = n.normalize_or_zero();
        let (cos_phi, cos_theta) = (l.dot(n), v.dot(n));
        (
            [l.cross(v).dot(n), cos_phi - cos_theta],
            cos_phi < 0.0 && cos_theta < 0.0,
        )
    }

    fn world(lights: usize) -> World {
        let mut state = 7_u64;
        let mut next = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f32 / (1 << 23) as f32 - 1.0
        };
        let mut world = World {
            materials: vec![ShadingMaterial {
                ambient: [0.0; 3],
                diffuse: [1.0; 3],
                specular: [1.0; 3],
                shininess: 10.0,
                model: ReflectionModel::Phong,
            }],
            ..World::default()
        };
        for _ in 0..301 {
            world.positions.push([next(), next(), next()]);
            world.normals.push([next(), next(), next()]);
            world.vertex_material.push(0);
        }
        for index in 0..lights {
            world.lights.push(ShadingLight {
                vector: [3.0 * next(), 3.0 * next(), 3.0 * next()],
                is_point: index % 3 > 0,
                radiance: [1.0; 3],
            });
        }
        world
    }

    #[test]
    fn bits_are_those_of_the_angles_at_every_level() {
        for lights in [1, 5, 33, 128] {
            let world = world(lights);
            let list: Vec<u32> = (0..301).filter(|v| v % 5 != 1).collect();
            for eye in [
                Eye::Point([0.5, -2.0, 1.0]),
                Eye::Direction([0.0, 0.6, 0.8]),
            ] {
                for level in SimdLevel::available() {
                    let mut bits = SignBits::default();
                    compute_signs(
                        level.token().expect("available"),
                        &world,
                        eye,
                        &list,
                        &mut bits,
                    );
                    for (place, &v) in list.iter().enumerate() {
                        for (index, light) in world.lights.iter().enumerate() {
                            let point = vector(world.positions.get(v as usize));
                            let normal = vector(world.normals.get(v as usize));
                            let (values, back) = by_angles(point, normal, &eye, light);
                            let bit = |test: usize| {
                                let word = bits.words[index / WORD_LIGHTS][place];
                                word >> (test + index % WORD_LIGHTS) & 1 == 1
                            };
                            for (value, test) in values.into_iter().zip([H1, H2]) {
                                if value.abs() > 1e-5 {
                                    assert_eq!(bit(test), value > 0.0, "{level} {v} {index}");
                                }
                            }
                            assert_eq!(bit(BACK), back, "{level} {v} {index}");
                        }
                    }
                }
            }
        }
    }

    /// Fig. 7 of the paper: a flat triangle around the point where light reflects towards the viewer passes.
    #[test]
    fn a_triangle_around_a_mirror_point_passes_and_one_far_off_does_not() {
        let mut world = world(1);
        world.positions.clear();
        world.normals.clear();
        for shift in [0.0, 5.0] {
            for corner in [[-1.0, -0.9, 0.0], [1.2, -0.8, 0.0], [0.1, 1.1, 0.0]] {
                world
                    .positions
                    .push([corner[0] + shift, corner[1] + shift, 0.0]);
                world.normals.push([0.0, 0.0, 1.0]);
            }
        }
        world.vertex_material = vec![0; 6];
        world.lights[0] = ShadingLight {
            vector: [-2.0, 0.1, 2.0],
            is_point: true,
            radiance: [1.0; 3],
        };
        let mut bits = SignBits::default();
        let level = SimdLevel::detect().token().expect("detected");
        compute_signs(
            level,
            &world,
            Eye::Point([2.0, -0.1, 2.0]),
            &[0, 1, 2, 3, 4, 5],
            &mut bits,
        );
        assert!(bits.pht_lights([0, 1, 2]).contains(0));
        assert!(bits.pht_lights([3, 4, 5]).is_empty());
        // Seen and lit from below nothing is potentially highlighted.
        world.lights[0].vector[2] = -2.0;
        compute_signs(
            level,
            &world,
            Eye::Point([2.0, -0.1, -2.0]),
            &[0, 1, 2],
            &mut bits,
        );
        assert!(bits.pht_lights([0, 1, 2]).is_empty());
    }
}
