//! Cost of classifying highlights: sign bits per vertex and light, light masks per triangle and light.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use specula::highlight::{SignBits, compute_signs, light_masks};
use specula::output::Encoding;
use specula::scene::{Eye, ReflectionModel, ShadingLight, ShadingMaterial, World};
use specula::simd::SimdLevel;
use std::hint::black_box;

const SIDE: usize = 33;

/// A bumpy patch facing the lights and the viewer.
fn patch(model: ReflectionModel, lights: usize) -> World {
    let mut world = World {
        materials: vec![ShadingMaterial {
            ambient: [0.01; 3],
            diffuse: [0.5, 0.4, 0.3],
            specular: [0.4; 3],
            shininess: 20.0,
            model,
        }],
        ..World::default()
    };
    for i in 0..SIDE * SIDE {
        let (x, y) = (
            (i % SIDE) as f32 / 32.0 - 0.5,
            (i / SIDE) as f32 / 32.0 - 0.5,
        );
        world.positions.push([x, y, 0.0]);
        let length = (0.25 * (x * x + y * y) + 1.0).sqrt();
        world
            .normals
            .push([0.5 * x / length, 0.5 * y / length, 1.0 / length]);
    }
    for row in 0..SIDE - 1 {
        for column in 0..SIDE - 1 {
            let a = (row * SIDE + column) as u32;
            let above = a + SIDE as u32;
            world.triangles.push([a, a + 1, above + 1]);
            world.triangles.push([a, above + 1, above]);
        }
    }
    world.vertex_material = vec![0; SIDE * SIDE];
    world.triangle_material = vec![0; world.triangles.len()];
    for i in 0..lights {
        world.lights.push(ShadingLight {
            vector: [(i % 4) as f32 - 1.5, (i / 4) as f32 - 1.5, 2.0],
            is_point: true,
            radiance: [0.5, 0.6, 0.7],
        });
    }
    world
}

fn classification(c: &mut Criterion) {
    let eye = Eye::Point([0.0, 0.0, 3.0]);
    let mut group = c.benchmark_group("masks");
    for (name, model) in [
        ("phong", ReflectionModel::Phong),
        ("blinn", ReflectionModel::BlinnPhong),
    ] {
        for count in [1, 4, 16] {
            let world = patch(model, count);
            let triangles = world.triangles.len();
            group.throughput(Throughput::Elements((triangles * count) as u64));
            group.bench_function(BenchmarkId::new(name, count), |b| {
                b.iter(|| {
                    for triangle in 0..triangles {
                        black_box(light_masks(
                            black_box(&world),
                            &eye,
                            Encoding::Srgb,
                            triangle as u32,
                        ));
                    }
                });
            });
        }
    }
    group.finish();

    let mut group = c.benchmark_group("signs");
    for count in [1, 4, 16] {
        let world = patch(ReflectionModel::Phong, count);
        let vertices: Vec<u32> = (0..world.positions.len() as u32).collect();
        let mut bits = SignBits::default();
        group.throughput(Throughput::Elements((vertices.len() * count) as u64));
        for level in SimdLevel::available() {
            let Some(token) = level.token() else { continue };
            group.bench_function(BenchmarkId::new(level.name(), count), |b| {
                b.iter(|| compute_signs(token, black_box(&world), eye, &vertices, &mut bits));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, classification);
criterion_main!(benches);
