//! Cost of culling a view, serial: 917,504 triangles in 7,168 clusters, and what ten times as many add that cannot be
//! seen.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DMat4, DVec3, DVec4};
use specula::geometry::{Cluster, Vec3s, build_clusters, shapes};
use specula::scene::{Eye, View};
use specula::visibility::Culler;
use std::hint::black_box;

/// How many copies the large cases add.
const COPIES: usize = 10;

/// The whole teapot, from a little above.
const EYE: DVec3 = DVec3::new(1.0, -7.0, 4.0);

/// The view from `eye` towards `target`, `scale` pixels per unit at distance 1.
fn view(eye: DVec3, target: DVec3, scale: f64) -> View {
    let (width, height, near, far) = (1280, 720, 0.1, 100.0);
    let forward = (target - eye).normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let along = |axis: DVec3| axis.extend(-axis.dot(eye));
    let w = along(forward);
    let x = along(right) * scale + w * (f64::from(width) / 2.0);
    let y = along(forward.cross(right)) * scale + w * (f64::from(height) / 2.0);
    let z = (DVec4::W * far - w) * near / (far - near);
    View {
        width,
        height,
        pixel_from_world: DMat4::from_cols(x, y, z, w).transpose(),
        eye: Eye::Point(eye.as_vec3().to_array()),
        encoding: Default::default(),
    }
}

/// The middle of the teapot.
fn target() -> DVec3 {
    DVec3::new(0.0, 0.0, 1.5)
}

fn teapot() -> Vec<Cluster> {
    let mesh = shapes::teapot(128, false);
    let mut positions = Vec3s::default();
    for p in &mesh.positions {
        positions.push(p.as_vec3().to_array());
    }
    build_clusters(&positions, &mut mesh.triangles.clone(), 0)
}

/// Adds as many clusters as `COPIES` teapots have: copies of `sample`, moved by multiples of `step`.
fn add_copies(clusters: &mut Vec<Cluster>, sample: &[Cluster], step: DVec3) {
    let (count, mut next) = (
        clusters.len() * COPIES,
        clusters.last().map_or(0, |last| last.triangles.end),
    );
    for (index, cluster) in sample.iter().cycle().take(count).enumerate() {
        let shift = step * (1 + index / sample.len()) as f64;
        let length = cluster.triangles.len() as u32;
        clusters.push(Cluster {
            triangles: next..next + length,
            center: (DVec3::from(cluster.center.map(f64::from)) + shift)
                .as_vec3()
                .to_array(),
            ..cluster.clone()
        });
        next += length;
    }
}

fn culling(c: &mut Criterion) {
    let teapot = teapot();
    let whole = view(EYE, target(), 900.0);
    let forward = (target() - EYE).normalize();
    let mut off_screen = teapot.clone();
    add_copies(&mut off_screen, &teapot, -12.0 * forward);
    let far_side: Vec<Cluster> = teapot
        .iter()
        .filter(|cluster| {
            let axis = DVec3::from(cluster.cone_axis.map(f64::from));
            cluster.cone_cos > 0.95 && axis.dot(forward) > 0.8
        })
        .cloned()
        .collect();
    let mut facing_away = teapot.clone();
    add_copies(&mut facing_away, &far_side, forward * 0.5);

    let mut group = c.benchmark_group("cull");
    for (name, clusters, view) in [
        ("whole", &teapot, whole),
        (
            "close-up",
            &teapot,
            view(DVec3::new(0.3, -2.6, 1.4), target(), 2000.0),
        ),
        ("ten off screen", &off_screen, whole),
        ("ten facing away", &facing_away, whole),
    ] {
        let mut culler = Culler::new(clusters);
        let mut ranges = Vec::new();
        group.throughput(Throughput::Elements(clusters.len() as u64));
        group.bench_function(name, |b| {
            b.iter(|| culler.cull(black_box(&view), &mut ranges));
        });
    }
    group.finish();
}

criterion_group!(benches, culling);
criterion_main!(benches);
