//! Scenes by hand, a seeded generator, and a rasterizer that is slow and obvious: all pixels of all triangles, one at a time, by
//! the scalar rules of `geometry::screen`.
#![allow(dead_code, reason = "each test binary uses a part of it")]

pub(crate) mod exact;
pub(crate) mod tiling;

use glam::{DMat4, DVec4};
use rayon::ThreadPool;
use specula::backend::software::{NO_TRIANGLE, SoftwareBackend};
use specula::backend::{Backend, Geometry};
use specula::geometry::screen::{
    self, EdgeFunction, PixelBox, TrianglePlanes, clip, doubled_area, snap,
};
use specula::output::Encoding;
use specula::parallel::Exec;
use specula::scene::{Eye, ReflectionModel, ShadingLight, ShadingMaterial, View, World};
use specula::simd::SimdLevel;
use std::sync::OnceLock;

/// The generator `splitmix64`.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    pub(crate) fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * ((self.bits() >> 40) as f32 / (1 << 24) as f32)
    }

    pub(crate) fn rgb(&mut self) -> [f32; 3] {
        [0; 3].map(|_| self.range(0.0, 1.0))
    }
}

pub(crate) fn material() -> ShadingMaterial {
    ShadingMaterial {
        ambient: [0.05, 0.04, 0.06],
        diffuse: [0.7, 0.5, 0.3],
        specular: [0.6; 3],
        shininess: 40.0,
        model: ReflectionModel::Phong,
    }
}

/// A world without triangles, with one material and four lights.
pub(crate) fn empty_world() -> World {
    let light = |vector, is_point| ShadingLight {
        vector,
        is_point,
        radiance: [0.5, 0.45, 0.4],
    };
    World {
        materials: vec![material()],
        lights: vec![
            light([3.0, 4.0, -5.0], true),
            light([-6.0, 1.0, 0.5], true),
            light([0.6, 0.0, -0.8], false),
            light([0.0, -0.6, -0.8], false),
        ],
        background: [0.02, 0.03, 0.05],
        ..World::default()
    }
}

/// Adds a triangle with vertices of its own.
pub(crate) fn add_triangle(world: &mut World, corners: [[f32; 3]; 3], normals: [[f32; 3]; 3]) {
    let first = world.positions.len() as u32;
    for (p, n) in corners.into_iter().zip(normals) {
        world.positions.push(p);
        world.normals.push(n);
        world.vertex_material.push(0);
    }
    world.triangles.push([first, first + 1, first + 2]);
    world.triangle_material.push(0);
}

/// Adds a triangle and the same turned round, so that it can be seen whichever way it turns.
pub(crate) fn add_both_sides(world: &mut World, corners: [[f32; 3]; 3], normals: [[f32; 3]; 3]) {
    let ([a, b, c], [l, m, n]) = (corners, normals);
    add_triangle(world, [a, b, c], [l, m, n]);
    add_triangle(world, [a, c, b], [l, n, m].map(|n| n.map(|v| -v)));
}

/// Eye at the origin, looking along +z, y down; the image plane at distance 1 is `zoom` pixels per unit.
pub(crate) fn perspective(width: u32, height: u32, zoom: f64, near: f64, far: f64) -> View {
    let (cx, cy) = (f64::from(width) / 2.0, f64::from(height) / 2.0);
    View {
        width,
        height,
        pixel_from_world: DMat4::from_cols(
            DVec4::new(zoom, 0.0, 0.0, 0.0),
            DVec4::new(0.0, zoom, 0.0, 0.0),
            DVec4::new(cx, cy, -near / (far - near), 1.0),
            DVec4::new(0.0, 0.0, near * far / (far - near), 0.0),
        ),
        eye: Eye::Point([0.0; 3]),
        encoding: Encoding::default(),
    }
}

/// World coordinates are pixels and reversed depth.
pub(crate) fn flat(width: u32, height: u32) -> View {
    View {
        width,
        height,
        pixel_from_world: DMat4::IDENTITY,
        eye: Eye::Direction([0.0, 0.0, 1.0]),
        encoding: Encoding::default(),
    }
}

/// How to run at every level of this machine, on one thread.
pub(crate) fn levels() -> Vec<Exec> {
    SimdLevel::available()
        .filter_map(SimdLevel::token)
        .map(|level| Exec { level, threads: 1 })
        .collect()
}

/// The strongest level.
pub(crate) fn best() -> Exec {
    *levels().last().expect("scalar is always there")
}

/// Runs `f` with two threads, inside a pool of its own.
pub(crate) fn with_two_threads<T: Send>(f: impl FnOnce(Exec) -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(2)
        .build()
        .expect("two threads");
    let exec = Exec {
        threads: 2,
        ..best()
    };
    pool.install(|| f(exec))
}

/// Runs `f` as `exec` says, but with two threads, inside a pool that all tests share.
pub(crate) fn on_two_threads<T: Send>(exec: Exec, f: impl FnOnce(Exec) -> T + Send) -> T {
    static POOL: OnceLock<ThreadPool> = OnceLock::new();
    let pool = POOL.get_or_init(|| {
        let builder = rayon::ThreadPoolBuilder::new().num_threads(2);
        builder.build().expect("two threads")
    });
    pool.install(|| f(Exec { threads: 2, ..exec }))
}

/// Runs `f` at every level of this machine, on one thread and on two.
pub(crate) fn on_each_exec(f: impl Fn(Exec) + Sync) {
    for exec in levels() {
        f(exec);
        on_two_threads(exec, &f);
    }
}

/// Owner and reversed depth of every pixel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Visibility {
    pub(crate) ids: Vec<u32>,
    pub(crate) depths: Vec<f32>,
}

impl Visibility {
    pub(crate) fn of(backend: &SoftwareBackend) -> Self {
        let (mut ids, mut depths) = (Vec::new(), Vec::new());
        backend.ids(&mut ids);
        backend.depths(&mut depths);
        Self { ids, depths }
    }

    /// Fails with the first pixel that differs.
    pub(crate) fn assert_same(&self, want: &Self, width: u32, what: &str) {
        assert_eq!(self.ids.len(), want.ids.len(), "{what}: size");
        for i in 0..self.ids.len() {
            let pixel = (i % width as usize, i / width as usize);
            assert_eq!(self.ids[i], want.ids[i], "{what}: id at {pixel:?}");
            // `==` lets -0 be 0, which the rules leave open.
            assert!(
                self.depths[i] == want.depths[i],
                "{what}: depth at {pixel:?}: {} instead of {}",
                self.depths[i],
                want.depths[i]
            );
        }
    }
}

/// The slow rasterizer.
pub(crate) fn reference(
    world: &World,
    view: &View,
    triangles: impl Iterator<Item = u32>,
) -> Visibility {
    let size = (view.width * view.height) as usize;
    let mut image = Visibility {
        ids: vec![NO_TRIANGLE; size],
        depths: vec![0.0; size],
    };
    for id in triangles {
        let triangle = world.triangles[id as usize];
        let corners = triangle.map(|v| view.project(world.positions.get(v as usize)));
        let polygon: Vec<_> = clip(corners).vertices().iter().map(|&v| snap(v)).collect();
        let fan: Vec<_> = (2..polygon.len())
            .map(|i| [polygon[0], polygon[i - 1], polygon[i]])
            .collect();
        let area: i64 = fan.iter().map(|&t| doubled_area(t)).sum();
        if area < 0 {
            continue;
        }
        let Some(bounds) = PixelBox::of_snapped(&polygon, view.width, view.height) else {
            continue;
        };
        let mut plane = TrianglePlanes::new(corners).depth([bounds.x0, bounds.y0]);
        if world.backs.contains(&id) {
            plane = plane.moved_back();
        }
        for [a, b, c] in fan {
            if doubled_area([a, b, c]) <= 0 {
                continue;
            }
            let edges = [(a, b), (b, c), (c, a)].map(|(p, q)| EdgeFunction::new(p, q));
            for y in bounds.y0..=bounds.y1 {
                for x in bounds.x0..=bounds.x1 {
                    if edges.iter().all(|e| e.at_pixel(x, y) >= 0) {
                        let at = y as usize * view.width as usize + x as usize;
                        let depth = plane.at_pixel(x, y);
                        let (owner, stored) = (&mut image.ids[at], &mut image.depths[at]);
                        // No triangle has the largest id.
                        if depth > *stored || (depth == *stored && id < *owner) {
                            (*owner, *stored) = (id, depth);
                        }
                    }
                }
            }
        }
    }
    image
}

/// Barycentric weights of a triangle at a pixel by the scalar rule.
pub(crate) fn scalar_weights(world: &World, view: &View, id: u32, x: i32, y: i32) -> [f32; 3] {
    let triangle = world.triangles[id as usize];
    let corners = triangle.map(|v| view.project(world.positions.get(v as usize)));
    let e = TrianglePlanes::new(corners).edges_at_pixel(x, y);
    screen::normalized_weights(e.map(|v| v.max(0.0))).map(|v| v as f32)
}

/// Rasterizes all triangles of a world.
pub(crate) fn rasterize(
    backend: &mut SoftwareBackend,
    exec: Exec,
    world: &World,
    view: &View,
) -> specula::backend::RasterCounts {
    let visible = 0..world.triangles.len() as u32;
    backend.rasterize(exec, geometry(world, view, std::slice::from_ref(&visible)))
}

pub(crate) fn geometry<'a>(
    world: &'a World,
    view: &'a View,
    visible: &'a [std::ops::Range<u32>],
) -> Geometry<'a> {
    Geometry {
        world,
        view,
        visible,
    }
}

/// A random triangle soup around the view volume: ordinary triangles, slivers, tiny and huge ones, some behind the eye or through
/// the near plane and the guard band, of both windings, some of them turned both ways. The last third count as
/// backs.
pub(crate) fn soup(random: &mut Random, count: usize) -> World {
    soup_of_sizes(random, count, &[0.02, 0.3, 1.0, 30.0, 3000.0])
}

/// The same with chosen sizes.
pub(crate) fn soup_of_sizes(random: &mut Random, count: usize, sizes: &[f32]) -> World {
    let mut world = empty_world();
    while world.triangles.len() < count {
        let size = sizes[random.below(sizes.len())];
        let center = [
            random.range(-4.0, 4.0),
            random.range(-3.0, 3.0),
            random.range(-0.5, 8.0),
        ];
        let mut corner = || center.map(|c| c + random.range(-size, size));
        let mut corners = [corner(), corner(), corner()];
        match random.below(8) {
            // A sliver.
            0 => {
                corners[2] = std::array::from_fn(|i| {
                    0.3 * corners[0][i] + 0.7 * corners[1][i] + random.range(-0.01, 0.01)
                });
            }
            // No area at all.
            1 => corners[2] = corners[1],
            _ => {}
        }
        let normals = [[0.0, 0.0, -1.0]; 3];
        if random.below(2) == 0 || world.triangles.len() + 2 > count {
            add_triangle(&mut world, corners, normals);
        } else {
            add_both_sides(&mut world, corners, normals);
        }
    }
    world.backs = count as u32 * 2 / 3..count as u32;
    world
}
