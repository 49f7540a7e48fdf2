//! Points of mixed materials, collected and then illuminated together.

use super::batch::shade_points;
use super::lanes::{ShadingKit, shade_lanes};
use super::lights::ActiveLights;
use crate::geometry::Vec3s;
use crate::parallel::Exec;
use crate::scene::{Eye, World};
use crate::simd::{Level, Simd, dispatch};
use fearless_simd::prelude::*;

/// Points in a chunk: enough to amortize a dispatch, few enough to share among threads.
const CHUNK: usize = 256;

/// Points of one material.
#[derive(Clone, Debug)]
struct Chunk {
    material: u16,
    points: Vec3s,
    normals: Vec3s,
    colours: Vec3s,
}

impl Chunk {
    /// A chunk that never has to grow.
    fn new() -> Self {
        let [points, normals, colours] = std::array::from_fn(|_| Vec3s::with_capacity(CHUNK));
        Self {
            material: 0,
            points,
            normals,
            colours,
        }
    }
}

/// A batch of points to be illuminated under all lights. Points of the same material share SIMD lanes, wherever in the
/// batch they were added; results do not depend on the threads.
#[derive(Clone, Debug, Default)]
pub struct PointBatch {
    chunks: Vec<Chunk>,
    used: usize,
    /// The chunk of each material that is being filled.
    open: Vec<Option<usize>>,
    /// Where each point is: chunk times [`CHUNK`] plus place.
    places: Vec<u32>,
}

impl PointBatch {
    /// Removes all points and keeps the memory.
    pub fn clear(&mut self) {
        self.used = 0;
        self.open.fill(None);
        self.places.clear();
    }

    /// Makes room for `points` points of one material.
    pub fn reserve(&mut self, points: usize) {
        let chunks = points.div_ceil(CHUNK).max(self.chunks.len());
        self.chunks.resize_with(chunks, Chunk::new);
        self.places.reserve(points);
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// True when there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Adds a point with its normal (of any length) and material.
    pub fn push(&mut self, point: [f32; 3], normal: [f32; 3], material: u16) {
        let slot = usize::from(material);
        if self.open.len() <= slot {
            self.open.resize(slot + 1, None);
        }
        let index = match self.open[slot] {
            Some(index) if self.chunks[index].points.len() < CHUNK => index,
            _ => self.open_chunk(material),
        };
        let chunk = &mut self.chunks[index];
        self.places
            .push((index * CHUNK + chunk.points.len()) as u32);
        chunk.points.push(point);
        chunk.normals.push(normal);
    }

    fn open_chunk(&mut self, material: u16) -> usize {
        let index = self.used;
        self.used += 1;
        if self.chunks.len() == index {
            self.chunks.push(Chunk::new());
        }
        let chunk = &mut self.chunks[index];
        chunk.material = material;
        chunk.points.clear();
        chunk.normals.clear();
        self.open[usize::from(material)] = Some(index);
        index
    }

    /// Evaluates the illumination equation at all points.
    pub fn illuminate(&mut self, exec: Exec, world: &World, eye: Eye) {
        let active = ActiveLights::all(world.lights.len());
        exec.for_each_chunk(&mut self.chunks[..self.used], 1, |_, chunks| {
            for chunk in chunks {
                let material = &world.materials[usize::from(chunk.material)];
                let kit = ShadingKit::new(eye, material, &world.lights);
                let range = 0..chunk.points.len();
                chunk.colours.resize(range.end);
                shade_points(
                    exec.level,
                    &kit,
                    &active,
                    range,
                    &chunk.points,
                    &chunk.normals,
                    &mut chunk.colours,
                );
            }
        });
    }

    /// Linear colour of the `index`-th point added, after [`illuminate`](Self::illuminate).
    ///
    /// # Panics
    /// When there is no such point, or it was never illuminated.
    #[inline]
    #[must_use]
    pub fn colour(&self, index: usize) -> [f32; 3] {
        let place = self.places[index] as usize;
        self.chunks[place / CHUNK].colours.get(place % CHUNK)
    }
}

/// Linear colours of a few points under some of the lights.
#[must_use]
pub fn shade_few<const N: usize>(
    level: Level,
    kit: &ShadingKit<'_>,
    active: &ActiveLights,
    points: &[[f32; 3]; N],
    normals: &[[f32; 3]; N],
) -> [[f32; 3]; N] {
    dispatch!(level, simd => shade_few_lanes(simd, kit, active, points, normals))
}

#[inline(always)]
fn shade_few_lanes<S: Simd, const N: usize>(
    simd: S,
    kit: &ShadingKit<'_>,
    active: &ActiveLights,
    points: &[[f32; 3]; N],
    normals: &[[f32; 3]; N],
) -> [[f32; 3]; N] {
    let mut colours = [[0.0; 3]; N];
    for first in (0..N).step_by(S::f32s::LEN) {
        let point = few_lanes(simd, points, first);
        let normal = few_lanes(simd, normals, first);
        let [r, g, b] = shade_lanes(simd, kit, active, point, normal);
        for (lane, colour) in colours[first..].iter_mut().take(S::f32s::LEN).enumerate() {
            *colour = [r[lane], g[lane], b[lane]];
        }
    }
    colours
}

/// The vectors from `first` on, in lanes; spare lanes repeat the last.
#[inline(always)]
fn few_lanes<S: Simd, const N: usize>(simd: S, v: &[[f32; 3]; N], first: usize) -> [S::f32s; 3] {
    let last = N - 1;
    [
        S::f32s::from_fn(simd, |lane| v[(first + lane).min(last)][0]),
        S::f32s::from_fn(simd, |lane| v[(first + lane).min(last)][1]),
        S::f32s::from_fn(simd, |lane| v[(first + lane).min(last)][2]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ShadingLight, ShadingMaterial};
    use crate::simd::SimdLevel;

    #[test]
    fn mixed_materials_keep_their_colours() {
        let material = |red: f32| ShadingMaterial {
            ambient: [red, 0.0, 0.0],
            diffuse: [0.5; 3],
            specular: [0.0; 3],
            shininess: 1.0,
            model: crate::scene::ReflectionModel::Phong,
        };
        let world = World {
            materials: vec![material(0.25), material(0.75)],
            lights: vec![ShadingLight {
                vector: [0.0, 0.0, 1.0],
                is_point: false,
                radiance: [0.0, 1.0, 0.0],
            }],
            ..World::default()
        };
        let exec = Exec {
            level: SimdLevel::detect().token().expect("detected"),
            threads: 1,
        };
        let mut batch = PointBatch::default();
        // Twice, because memory is reused.
        for _ in 0..2 {
            batch.clear();
            for i in 0..1000_u16 {
                batch.push([0.0; 3], [0.0, 0.0, 2.0], i % 2);
            }
            batch.illuminate(exec, &world, Eye::Direction([0.0, 0.0, 1.0]));
            for i in 0..1000 {
                let red = if i % 2 == 0 { 0.25 } else { 0.75 };
                let [r, g, _] = batch.colour(i);
                assert_eq!(r, red, "point {i}");
                assert!((g - 0.5).abs() < 1e-5, "point {i}: {g}");
            }
        }
    }
}
