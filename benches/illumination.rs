//! Cost of shading a point under 1, 4 and 16 point lights, at every SIMD level (throughput is in point-lights), and of encoding a pixel.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fearless_simd::prelude::*;
use specula::geometry::Vec3s;
use specula::illumination::{ActiveLights, ShadingKit, shade_points};
use specula::output::Encoding;
use specula::output::encode::encode_lanes;
use specula::scene::{Eye, ReflectionModel, ShadingLight, ShadingMaterial};
use specula::simd::{Simd, SimdLevel, dispatch};
use std::hint::black_box;

const POINTS: usize = 1024;

/// A bumpy patch facing the lights and the viewer: every light is in front, highlights cover a part.
fn patch() -> (Vec3s, Vec3s) {
    let (mut points, mut normals) = (Vec3s::default(), Vec3s::default());
    for i in 0..POINTS {
        let (x, y) = ((i % 32) as f32 / 32.0 - 0.5, (i / 32) as f32 / 32.0 - 0.5);
        points.push([x, y, 0.0]);
        normals.push([0.5 * x, 0.5 * y, 1.0]);
    }
    (points, normals)
}

fn shading(c: &mut Criterion) {
    let (points, normals) = patch();
    let mut out = Vec3s::default();
    out.resize(POINTS);
    for (name, shininess, model) in [
        ("phong_10", 10.0, ReflectionModel::Phong),
        ("phong_50", 50.0, ReflectionModel::Phong),
        ("blinn_10", 10.0, ReflectionModel::BlinnPhong),
    ] {
        let material = ShadingMaterial {
            ambient: [0.01; 3],
            diffuse: [0.5, 0.4, 0.3],
            specular: [0.4; 3],
            shininess,
            model,
        };
        let mut group = c.benchmark_group(name);
        for count in [1, 4, 16] {
            let lights: Vec<_> = (0..count)
                .map(|i| ShadingLight {
                    vector: [(i % 4) as f32 - 1.5, (i / 4) as f32 - 1.5, 2.0],
                    is_point: true,
                    radiance: [0.5, 0.6, 0.7],
                })
                .collect();
            let kit = ShadingKit::new(Eye::Point([0.0, 0.0, 3.0]), &material, &lights);
            let active = ActiveLights::all(count);
            group.throughput(Throughput::Elements((POINTS * count) as u64));
            for level in SimdLevel::available() {
                let Some(token) = level.token() else { continue };
                group.bench_function(BenchmarkId::new(level.name(), count), |b| {
                    b.iter(|| {
                        let points = black_box(&points);
                        shade_points(token, &kit, &active, 0..POINTS, points, &normals, &mut out);
                        black_box(&mut out);
                    });
                });
            }
        }
        group.finish();
    }
}

#[inline(always)]
fn encode_all<S: Simd>(simd: S, encoding: Encoding, rgb: &Vec3s, out: &mut [u32]) {
    for (index, chunk) in out.chunks_exact_mut(S::f32s::LEN).enumerate() {
        let at = index * S::f32s::LEN;
        let end = at + S::f32s::LEN;
        let lanes = [
            S::f32s::from_slice(simd, &rgb.x[at..end]),
            S::f32s::from_slice(simd, &rgb.y[at..end]),
            S::f32s::from_slice(simd, &rgb.z[at..end]),
        ];
        encode_lanes(simd, encoding, lanes).store_slice(chunk);
    }
}

fn encoding(c: &mut Criterion) {
    let (rgb, _) = patch();
    let mut out = vec![0; POINTS];
    let mut group = c.benchmark_group("encode");
    group.throughput(Throughput::Elements(POINTS as u64));
    for level in SimdLevel::available() {
        let Some(token) = level.token() else { continue };
        for encoding in Encoding::ALL {
            group.bench_function(BenchmarkId::new(encoding.name(), level.name()), |b| {
                b.iter(|| {
                    let (rgb, encoding) = black_box((&rgb, encoding));
                    dispatch!(token, simd => encode_all(simd, encoding, rgb, &mut out));
                    black_box(&mut out);
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, shading, encoding);
criterion_main!(benches);
