//! The vertices of some triangles illuminated, each once.
//!
//! Triangles mark their vertices, one bit each; then vertices are taken word by word of 64. Meshes keep neighbours together, so most
//! words are full or empty, and a full vector of consecutive vertices needs no gathering. Both steps are shared among
//! threads, and a vertex's colour depends on neither its neighbours nor on who marked it first.

use super::ActiveLights;
use super::batch::{MAX_LANES, gather};
use super::lanes::{ShadingKit, shade_lanes};
use crate::geometry::Vec3s;
use crate::parallel::{Exec, Pace, Turn, Watch, grow};
use crate::scene::{Eye, World};
use crate::simd::{Simd, dispatch};
use fearless_simd::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Triangles that one task marks the vertices of: about 10 microseconds.
const TRIANGLES_PER_TASK: usize = 2048;

/// Vertices of a word.
const WORD: usize = 64;

/// Words that one task illuminates: from 10 microseconds up, with four lights.
const WORDS_PER_TASK: usize = 8;

/// What is illuminated in one go: vertices times lights, and [`VERTEX_EFFORT`] for each vertex. About 10 microseconds.
const EFFORT_AT_ONCE: usize = 2048;

/// What a vertex takes besides its lights.
const VERTEX_EFFORT: usize = 1;

/// A set of vertices of a world; empty between calls, but for turns of the same work.
#[derive(Debug, Default)]
pub struct VertexSet {
    /// Vertices that have to be illuminated, one bit each.
    words: Vec<AtomicU64>,
    /// For each task of marking, whether it is done.
    marked: Vec<bool>,
    stage: Stage,
}

/// What comes next for a set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stage {
    /// Making room.
    Fit,
    /// Marking the triangles' vertices.
    Mark,
    /// Illuminating the vertices marked.
    Shade,
    /// Nothing: the set is empty.
    #[default]
    Complete,
}

impl VertexSet {
    /// Linear colours of the vertices of `triangles` under all lights: `colours[v]` for each such vertex `v`.
    ///
    /// # Panics
    /// When a triangle is not one of the world's.
    pub fn illuminate(
        &mut self,
        exec: Exec,
        world: &World,
        eye: Eye,
        triangles: &[u32],
        colours: &mut Vec3s,
    ) {
        self.illuminate_while(exec, world, eye, triangles, colours, Turn::WHOLE);
    }

    /// One turn of [`illuminate`](Self::illuminate). `false` if it was told to stop and has not got through; then others must
    /// follow with the same arguments, or the first of another set.
    ///
    /// # Panics
    /// When a triangle is not one of the world's.
    pub fn illuminate_while(
        &mut self,
        exec: Exec,
        world: &World,
        eye: Eye,
        triangles: &[u32],
        colours: &mut Vec3s,
        turn: Turn<'_>,
    ) -> bool {
        let watch = &Watch::new(turn.go_on);
        if turn.is_first {
            self.begin(triangles);
        }
        if self.stage == Stage::Fit && self.fit(world, colours, watch) {
            self.stage = Stage::Mark;
        }
        if self.stage == Stage::Mark && !watch.is_over() && self.mark(exec, world, triangles, watch)
        {
            self.stage = Stage::Shade;
        }
        if self.stage == Stage::Shade
            && !watch.is_over()
            && self.shade(exec, world, eye, colours, watch)
        {
            self.stage = Stage::Complete;
        }
        self.stage == Stage::Complete
    }

    fn begin(&mut self, triangles: &[u32]) {
        if self.stage != Stage::Complete {
            // It was given up.
            for word in &mut self.words {
                *word.get_mut() = 0;
            }
        }
        self.marked.clear();
        self.marked
            .resize(triangles.len().div_ceil(TRIANGLES_PER_TASK), false);
        self.stage = Stage::Fit;
    }

    /// Makes room for a world's vertices; returns whether all of it is there.
    fn fit(&mut self, world: &World, colours: &mut Vec3s, watch: &Watch<'_>) -> bool {
        let vertices = world.positions.len();
        grow(&mut self.words, vertices.div_ceil(WORD), watch, |_| {
            AtomicU64::default()
        }) && grow(&mut colours.x, vertices, watch, |_| 0.0)
            && grow(&mut colours.y, vertices, watch, |_| 0.0)
            && grow(&mut colours.z, vertices, watch, |_| 0.0)
    }

    /// Marks vertices until it is told to stop; returns whether all are.
    fn mark(&mut self, exec: Exec, world: &World, triangles: &[u32], watch: &Watch<'_>) -> bool {
        let words = &self.words;
        exec.for_each_chunk(&mut self.marked, 1, |task, is_marked| {
            if is_marked[0] || watch.is_over() {
                return;
            }
            let first = task * TRIANGLES_PER_TASK;
            let end = triangles.len().min(first + TRIANGLES_PER_TASK);
            for &triangle in &triangles[first..end] {
                for vertex in world.triangles[triangle as usize] {
                    mark(words, vertex);
                }
            }
            is_marked[0] = true;
            watch.may_go_on();
        });
        self.marked.iter().all(|&is_marked| is_marked)
    }

    /// Illuminates marked vertices until it is told to stop; returns whether none are left.
    fn shade(
        &self,
        exec: Exec,
        world: &World,
        eye: Eye,
        colours: &mut Vec3s,
        watch: &Watch<'_>,
    ) -> bool {
        let (words, size) = (&self.words, WORD * WORDS_PER_TASK);
        let out = [&mut colours.x[..], &mut colours.y[..], &mut colours.z[..]];
        exec.for_each_chunk3(out, size, |task, out| {
            let first = task * WORDS_PER_TASK;
            let end = words.len().min(first + WORDS_PER_TASK);
            let words = &words[first..end];
            if watch.is_over() {
                return;
            }
            dispatch!(exec.level, simd => shade_words(simd, world, eye, words, first * WORD, out, watch));
        });
        !watch.is_over() || words.iter().all(|word| word.load(Ordering::Relaxed) == 0)
    }
}

fn mark(words: &[AtomicU64], vertex: u32) {
    let (word, bit) = (
        &words[vertex as usize / WORD],
        1 << (vertex as usize % WORD),
    );
    // Looking first saves most of the atomic operations: a vertex has six triangles as a rule.
    if word.load(Ordering::Relaxed) & bit == 0 {
        word.fetch_or(bit, Ordering::Relaxed);
    }
}

/// Illuminates the marked vertices of some words, the first of which begins at vertex `first`, and takes the marks off, until it is
/// told to stop.
#[inline(always)]
fn shade_words<S: Simd>(
    simd: S,
    world: &World,
    eye: Eye,
    words: &[AtomicU64],
    first: usize,
    mut out: [&mut [f32]; 3],
    watch: &Watch<'_>,
) {
    let lanes = S::f32s::LEN;
    let active = ActiveLights::all(world.lights.len());
    // The material illuminated last: neighbours share it as a rule.
    let mut known: Option<(u16, ShadingKit<'_>)> = None;
    let mut pace = Pace::new(watch, EFFORT_AT_ONCE);
    let effort = world.lights.len() + VERTEX_EFFORT;
    for (index, word) in words.iter().enumerate() {
        let bits = word.load(Ordering::Relaxed);
        if bits == 0 {
            continue;
        }
        word.store(0, Ordering::Relaxed);
        for part in (0..WORD).step_by(lanes) {
            let mut left = bits >> part & (u64::MAX >> (WORD - lanes));
            let start = first + index * WORD + part;
            while left != 0 {
                let material = world.vertex_material[start + left.trailing_zeros() as usize];
                let mask = same_material(world, start, left, material);
                left &= !mask;
                let kit = match known {
                    Some((last, kit)) if last == material => kit,
                    _ => {
                        let properties = &world.materials[usize::from(material)];
                        let kit = ShadingKit::new(eye, properties, &world.lights);
                        known = Some((material, kit));
                        kit
                    }
                };
                let group = Group { start, mask };
                let point = group.load(simd, &world.positions);
                let normal = group.load(simd, &world.normals);
                let colour = shade_lanes(simd, &kit, &active, point, normal);
                for (channel, out) in colour.iter().zip(&mut out) {
                    group.store::<S>(*channel, &mut out[start - first..]);
                }
            }
        }
        if !pace.did(bits.count_ones() as usize * effort) {
            return;
        }
    }
    pace.finish();
}

/// Those of some consecutive vertices that have a material.
#[inline(always)]
fn same_material(world: &World, start: usize, bits: u64, material: u16) -> u64 {
    let (mut left, mut mask) = (bits, 0);
    while left != 0 {
        let lane = left.trailing_zeros() as usize;
        mask |= u64::from(world.vertex_material[start + lane] == material) << lane;
        left &= left - 1;
    }
    mask
}

/// Some of a vector's worth of consecutive vertices.
#[derive(Clone, Copy)]
struct Group {
    /// The first of all.
    start: usize,
    /// One bit for each vertex that is meant.
    mask: u64,
}

impl Group {
    /// Whether all vertices are meant.
    #[inline(always)]
    fn is_full(self, lanes: usize) -> bool {
        self.mask == u64::MAX >> (WORD - lanes)
    }

    /// The vertices' vectors; spare lanes repeat the first.
    #[inline(always)]
    fn load<S: Simd>(self, simd: S, from: &Vec3s) -> [S::f32s; 3] {
        let lanes = S::f32s::LEN;
        if self.is_full(lanes) {
            let range = self.start..self.start + lanes;
            return [
                S::f32s::from_slice(simd, &from.x[range.clone()]),
                S::f32s::from_slice(simd, &from.y[range.clone()]),
                S::f32s::from_slice(simd, &from.z[range]),
            ];
        }
        let mut places = [self.start + self.mask.trailing_zeros() as usize; MAX_LANES];
        for (lane, place) in places.iter_mut().enumerate().take(lanes) {
            if self.mask >> lane & 1 == 1 {
                *place = self.start + lane;
            }
        }
        gather(simd, from, &places)
    }

    /// Stores a number of each vertex.
    #[inline(always)]
    fn store<S: Simd>(self, values: S::f32s, to: &mut [f32]) {
        let lanes = S::f32s::LEN;
        if self.is_full(lanes) {
            values.store_slice(&mut to[..lanes]);
            return;
        }
        let mut list = [0.0; MAX_LANES];
        values.store_slice(&mut list[..lanes]);
        let mut left = self.mask;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            to[lane] = list[lane];
            left &= left - 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::illumination::shade_vertices;
    use crate::scene::{ReflectionModel, ShadingLight, ShadingMaterial};
    use crate::simd::SimdLevel;

    /// Vertices of changing materials, and triangles that use some of them, some vertices often.
    fn world() -> World {
        let material = |red: f32| ShadingMaterial {
            ambient: [red, 0.0, 0.1],
            diffuse: [0.5, red, 0.3],
            specular: [0.4; 3],
            shininess: 20.0,
            model: ReflectionModel::Phong,
        };
        let mut world = World {
            materials: vec![material(0.25), material(0.75)],
            lights: vec![ShadingLight {
                vector: [3.0, 1.0, 4.0],
                is_point: true,
                radiance: [0.9, 0.8, 0.7],
            }],
            ..World::default()
        };
        for i in 0..300_u16 {
            let t = f32::from(i) * 0.37;
            world.positions.push([t.sin(), t.cos(), (1.7 * t).sin()]);
            world.normals.push([(0.3 * t).sin(), 0.2, 1.0]);
            world.vertex_material.push(u16::from(i % 23 > 11));
        }
        // Vertices 0 to 99 all, of the others every third; 298 and 299 are in no full word.
        world.triangles = (0..98).map(|i| [i, i + 1, i + 2]).collect();
        world.triangles.extend((34..100).map(|i| [3 * i, 3 * i, 0]));
        world
    }

    #[test]
    fn marked_vertices_get_the_colours_that_a_list_of_them_gets() {
        let world = world();
        let eye = Eye::Point([0.0, -4.0, 2.0]);
        for level in SimdLevel::available().filter_map(SimdLevel::token) {
            let exec = Exec { level, threads: 1 };
            let mut set = VertexSet::default();
            // Twice, with different triangles: marks are taken off.
            for triangles in [0..164, 100..164_u32] {
                let triangles: Vec<u32> = triangles.collect();
                let mut used: Vec<u32> = (triangles.iter())
                    .flat_map(|&t| world.triangles[t as usize])
                    .collect();
                used.sort_unstable();
                used.dedup();
                let mut want = Vec3s::default();
                want.resize(300);
                shade_vertices(level, &world, eye, &used, &mut want);
                let mut got = Vec3s::default();
                set.illuminate(exec, &world, eye, &triangles, &mut got);
                for v in 0..300 {
                    assert_eq!(got.get(v), want.get(v), "vertex {v}");
                }
            }
        }
    }
}
