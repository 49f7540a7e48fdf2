//! Vertices that refinement adds to the world's.
//!
//! Vertex numbers below the world's vertex count are the world's own; the others index this pool. Each has a
//! *welded* position number besides: two vertices with the same one are at the same place.

use super::estimate::{SAMPLES_AT_ONCE, Samples};
use super::forest::FIRST_LEAVES;
use super::shown::Shown;
use crate::geometry::Vec3s;
use crate::output::Encoding;
use crate::output::encode::encode_codes;
use crate::parallel::Exec;
use crate::scene::{View, World};
use crate::simd::Level;
use rustc_hash::FxHashMap;

/// Colour, linear RGB.
pub(super) type Colour = [f32; 3];

/// Vertices that there is room for from the start.
const FIRST_VERTICES: usize = 2 * FIRST_LEAVES;

/// The refined vertices, in order of creation.
#[derive(Clone, Debug, Default)]
pub(super) struct VertexPool {
    first: u32,
    positions: Vec3s,
    normals: Vec3s,
    colours: Vec3s,
    /// The colours' codes, if those are what is interpolated.
    codes: Vec3s,
    /// The same of the world's own vertices.
    base_codes: Vec3s,
    /// Encoded colour less encoded interpolated colour of the parents, in codes.
    surplus: Vec3s,
    material: Vec<u16>,
    weld: Vec<u32>,
    parents: Vec<[u32; 2]>,
    /// How many have been illuminated.
    lit: usize,
    by_vertices: FxHashMap<[u32; 2], u32>,
    by_weld: FxHashMap<[u32; 2], u32>,
    next_weld: u32,
    scratch: Samples,
}

impl VertexPool {
    /// Forgets all vertices and keeps the memory.
    pub(super) fn reset(&mut self, world: &World) {
        self.first = world.positions.len() as u32;
        for array in [
            &mut self.positions,
            &mut self.normals,
            &mut self.colours,
            &mut self.codes,
            &mut self.base_codes,
            &mut self.surplus,
        ] {
            array.clear();
        }
        self.material.clear();
        self.weld.clear();
        self.parents.clear();
        self.lit = 0;
        self.by_vertices.clear();
        self.by_weld.clear();
        // Welded numbers of the world are below its vertex count.
        self.next_weld = self.first;
        self.make_room();
    }

    /// Makes room for [`FIRST_VERTICES`], once.
    fn make_room(&mut self) {
        for array in [
            &mut self.positions,
            &mut self.normals,
            &mut self.colours,
            &mut self.surplus,
        ] {
            array.reserve(FIRST_VERTICES);
        }
        self.material.reserve(FIRST_VERTICES);
        self.weld.reserve(FIRST_VERTICES);
        self.parents.reserve(FIRST_VERTICES);
        self.by_vertices.reserve(FIRST_VERTICES);
        self.by_weld.reserve(FIRST_VERTICES);
        self.scratch.clear();
        self.scratch.reserve(SAMPLES_AT_ONCE);
    }

    fn index(&self, vertex: u32) -> Option<usize> {
        vertex.checked_sub(self.first).map(|index| index as usize)
    }

    pub(super) fn position(&self, world: &World, vertex: u32) -> [f32; 3] {
        match self.index(vertex) {
            Some(index) => self.positions.get(index),
            None => world.positions.get(vertex as usize),
        }
    }

    pub(super) fn normal(&self, world: &World, vertex: u32) -> [f32; 3] {
        match self.index(vertex) {
            Some(index) => self.normals.get(index),
            None => world.normals.get(vertex as usize),
        }
    }

    pub(super) fn colour(&self, base_colours: &Vec3s, vertex: u32) -> Colour {
        match self.index(vertex) {
            Some(index) => self.colours.get(index),
            None => base_colours.get(vertex as usize),
        }
    }

    /// Encodes the colours of the world's own vertices.
    pub(super) fn encode_base(&mut self, level: Level, encoding: Encoding, base_colours: &Vec3s) {
        encode_all(level, encoding, base_colours, 0, &mut self.base_codes);
    }

    /// A vertex's colour as it is interpolated.
    pub(super) fn shown_colour(
        &self,
        shown: Option<&Shown>,
        base_colours: &Vec3s,
        vertex: u32,
    ) -> Colour {
        if !shown.is_some_and(Shown::is_encoded) {
            return self.colour(base_colours, vertex);
        }
        match self.index(vertex) {
            Some(index) => self.codes.get(index),
            None => self.base_codes.get(vertex as usize),
        }
    }

    /// Surplus of a midpoint over its parents; the world's own vertices have none.
    pub(super) fn surplus(&self, vertex: u32) -> [f32; 3] {
        self.index(vertex)
            .map_or([0.0; 3], |index| self.surplus.get(index))
    }

    pub(super) fn weld(&self, world: &World, vertex: u32) -> u32 {
        match self.index(vertex) {
            Some(index) => self.weld[index],
            None => world.topology.position_of_vertex[vertex as usize],
        }
    }

    /// The vertex half way between two of the same object, made if there is none yet.
    pub(super) fn midpoint(&mut self, world: &World, material: u16, a: u32, b: u32) -> u32 {
        let key = [a.min(b), a.max(b)];
        if let Some(&vertex) = self.by_vertices.get(&key) {
            return vertex;
        }
        // Commutative, hence the same bits from both sides of the edge.
        let half = |p: [f32; 3], q: [f32; 3]| std::array::from_fn(|k| (p[k] + q[k]) * 0.5);
        let vertex = self.first + self.positions.len() as u32;
        let position = half(self.position(world, a), self.position(world, b));
        let normal = half(self.normal(world, a), self.normal(world, b));
        let weld = self.welded_midpoint(self.weld(world, a), self.weld(world, b));
        self.positions.push(position);
        self.normals.push(normal);
        self.colours.push([0.0; 3]);
        self.surplus.push([0.0; 3]);
        self.material.push(material);
        self.weld.push(weld);
        self.parents.push([a, b]);
        self.by_vertices.insert(key, vertex);
        vertex
    }

    fn welded_midpoint(&mut self, a: u32, b: u32) -> u32 {
        if a == b {
            return a;
        }
        let next = self.next_weld;
        let weld = *self.by_weld.entry([a.min(b), a.max(b)]).or_insert(next);
        self.next_weld += u32::from(weld == next);
        weld
    }

    /// Illuminates the vertices made since the last call, and finds their surplus.
    pub(super) fn illuminate(
        &mut self,
        exec: Exec,
        world: &World,
        view: &View,
        base_colours: &Vec3s,
        shown: Option<&Shown>,
    ) {
        let range = self.lit..self.positions.len();
        self.lit = range.end;
        let mut scratch = std::mem::take(&mut self.scratch);
        scratch.clear();
        scratch.set_interpolation(shown.map_or_else(Default::default, |shown| shown.interpolation));
        for index in range.clone() {
            let parents = self.parents[index];
            scratch.push(
                self.positions.get(index),
                self.normals.get(index),
                self.material[index],
                self.half_way(world, base_colours, shown, parents),
            );
        }
        scratch.illuminate(exec, world, view);
        for (sample, index) in range.clone().enumerate() {
            self.colours.set(index, scratch.colour(sample));
            self.surplus.set(index, scratch.deviation(sample));
        }
        if shown.is_some_and(Shown::is_encoded) {
            encode_all(
                exec.level,
                view.encoding,
                &self.colours,
                range.start,
                &mut self.codes,
            );
        }
        self.scratch = scratch;
    }

    /// What interpolation shows half way between two vertices.
    fn half_way(
        &self,
        world: &World,
        base_colours: &Vec3s,
        shown: Option<&Shown>,
        [a, b]: [u32; 2],
    ) -> Colour {
        let [p, q] = [a, b].map(|v| self.shown_colour(shown, base_colours, v));
        match shown {
            Some(shown) if shown.is_encoded() => {
                let [at, bt] = [a, b].map(|v| self.position(world, v));
                shown.blend([0.5, 0.5, 0.0], [at, bt, bt], [p, q, q])
            }
            _ => std::array::from_fn(|k| (p[k] + q[k]) * 0.5),
        }
    }
}

/// Encodes colours from the one at `first` on.
fn encode_all(level: Level, encoding: Encoding, colours: &Vec3s, first: usize, codes: &mut Vec3s) {
    codes.resize(colours.len());
    encode_codes(level, encoding, &colours.x[first..], &mut codes.x[first..]);
    encode_codes(level, encoding, &colours.y[first..], &mut codes.y[first..]);
    encode_codes(level, encoding, &colours.z[first..], &mut codes.z[first..]);
}
