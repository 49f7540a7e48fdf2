//! Shading whole arrays of points: one dispatch, then lanes.

use super::ActiveLights;
use super::lanes::{ShadingKit, shade_lanes};
use crate::geometry::Vec3s;
use crate::scene::{Eye, World};
use crate::simd::{Level, Simd, dispatch};
use fearless_simd::prelude::*;
use std::ops::Range;

/// Most lanes a vector of `f32` has at any level.
pub(crate) const MAX_LANES: usize = 16;

/// Colours of the points in `range`, into the same places of `out`.
///
/// # Panics
/// When `range` is not inside of all three arrays.
pub fn shade_points(
    level: Level,
    kit: &ShadingKit<'_>,
    active: &ActiveLights,
    range: Range<usize>,
    points: &Vec3s,
    normals: &Vec3s,
    out: &mut Vec3s,
) {
    dispatch!(level, simd => shade_range(simd, kit, active, range.clone(), points, normals, out));
}

/// Colours of vertices, given by ascending index, under all lights: `out[v]` for each vertex `v` in `vertices`.
///
/// # Panics
/// When a vertex is not one of the world's, or `out` is too short.
pub fn shade_vertices(level: Level, world: &World, eye: Eye, vertices: &[u32], out: &mut Vec3s) {
    dispatch!(level, simd => shade_list(simd, world, eye, vertices, out));
}

#[inline(always)]
fn shade_range<S: Simd>(
    simd: S,
    kit: &ShadingKit<'_>,
    active: &ActiveLights,
    range: Range<usize>,
    points: &Vec3s,
    normals: &Vec3s,
    out: &mut Vec3s,
) {
    let n = S::f32s::LEN;
    let mut start = range.start;
    while start + n <= range.end {
        let chunk = start..start + n;
        let rgb = shade_lanes(
            simd,
            kit,
            active,
            load(simd, points, chunk.clone()),
            load(simd, normals, chunk.clone()),
        );
        rgb[0].store_slice(&mut out.x[chunk.clone()]);
        rgb[1].store_slice(&mut out.y[chunk.clone()]);
        rgb[2].store_slice(&mut out.z[chunk]);
        start += n;
    }
    if start < range.end {
        let rest: [u32; MAX_LANES] = std::array::from_fn(|i| (start + i).min(range.end - 1) as u32);
        shade_gathered(
            simd,
            kit,
            active,
            &rest[..range.end - start],
            points,
            normals,
            out,
        );
    }
}

#[inline(always)]
fn shade_list<S: Simd>(simd: S, world: &World, eye: Eye, vertices: &[u32], out: &mut Vec3s) {
    let active = ActiveLights::all(world.lights.len());
    let material_of = |vertex: &u32| world.vertex_material[*vertex as usize];
    for run in vertices.chunk_by(|a, b| material_of(a) == material_of(b)) {
        let material = &world.materials[usize::from(material_of(&run[0]))];
        let kit = ShadingKit::new(eye, material, &world.lights);
        for group in run.chunks(S::f32s::LEN) {
            let (points, normals) = (&world.positions, &world.normals);
            shade_gathered(simd, &kit, &active, group, points, normals, out);
        }
    }
}

/// Shades at most one vector's worth of points; spare lanes repeat the last.
#[inline(always)]
fn shade_gathered<S: Simd>(
    simd: S,
    kit: &ShadingKit<'_>,
    active: &ActiveLights,
    indices: &[u32],
    points: &Vec3s,
    normals: &Vec3s,
    out: &mut Vec3s,
) {
    let Some(&last) = indices.last() else {
        return;
    };
    let mut places = [last as usize; MAX_LANES];
    for (place, &index) in places.iter_mut().zip(indices) {
        *place = index as usize;
    }
    let rgb = shade_lanes(
        simd,
        kit,
        active,
        gather(simd, points, &places),
        gather(simd, normals, &places),
    );
    for (channel, out) in rgb.iter().zip([&mut out.x, &mut out.y, &mut out.z]) {
        let mut values = [0.0; MAX_LANES];
        channel.store_slice(&mut values[..S::f32s::LEN]);
        for (&index, &value) in indices.iter().zip(&values) {
            out[index as usize] = value;
        }
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, v: &Vec3s, chunk: Range<usize>) -> [S::f32s; 3] {
    [
        S::f32s::from_slice(simd, &v.x[chunk.clone()]),
        S::f32s::from_slice(simd, &v.y[chunk.clone()]),
        S::f32s::from_slice(simd, &v.z[chunk]),
    ]
}

/// The vectors at the given places, one per lane.
#[inline(always)]
pub(crate) fn gather<S: Simd>(simd: S, v: &Vec3s, places: &[usize; MAX_LANES]) -> [S::f32s; 3] {
    [
        gather_component(simd, &v.x, places),
        gather_component(simd, &v.y, places),
        gather_component(simd, &v.z, places),
    ]
}

/// Through memory: vector operations must stay out of closures, which are not always inlined.
#[inline(always)]
fn gather_component<S: Simd>(simd: S, from: &[f32], places: &[usize; MAX_LANES]) -> S::f32s {
    let mut values = [0.0; MAX_LANES];
    for (value, &place) in values.iter_mut().zip(&places[..S::f32s::LEN]) {
        *value = from[place];
    }
    S::f32s::from_slice(simd, &values[..S::f32s::LEN])
}
