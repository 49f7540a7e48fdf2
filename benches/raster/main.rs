//! Cost of each stage of the software backend by itself, on one thread.
//!
//! | group | measures | elements |
//! |---|---|---|
//! | `clear` | an image in which nothing is visible, after one that was covered and after one like it | pixels |
//! | `transform` | cutting a teapot's triangles into shares and transforming its vertices | vertices |
//! | `set_up` | culling, planes and binning of the same teapot, in two sizes of image | triangles submitted |
//! | `draw` | coverage, depth and owners of triangles of some area that cover the image once | triangles drawn |
//! | `draw_layers` | the same, four times over, each layer wholly in front of or behind the last | triangles drawn |
//! | `shade` | illuminating the vertices of the teapot under 1, 4 and 16 lights | vertices |
//! | `resolve` | colours of a covered image, interpolated or illuminated | pixels |
//! | `present` | copying a whole image | pixels |
//!
//! Images have 1920 x 1080 pixels unless a name says otherwise, so that the time of a `draw` over 2,073,600 is its time per
//! pixel. Names end in the SIMD level: the machine's strongest, AVX2 and SSE2. `clear` and `present` move memory, and are
//! measured at the strongest only.
//!
//! Every benchmark first makes sure that it measures what it says.
//!
//! The whole run takes about a minute; `--test` does everything once.

mod subject;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, Throughput};
use criterion::{criterion_group, criterion_main};
use specula::backend::software::SoftwareBackend;
use specula::backend::{Backend, BasePaint, Geometry};
use specula::geometry::Vec3s;
use specula::illumination::VertexSet;
use specula::output::{ChannelOrder, Encoding, Target};
use specula::parallel::Exec;
use specula::simd::SimdLevel;
use std::time::{Duration, Instant};
use subject::{BACKGROUND_BYTES, PIXELS, SIZE, Subject, TEAPOT_TRIANGLES};

/// Numbers of lights to compare.
const LIGHTS: [usize; 3] = [1, 4, 16];

/// How to run at the strongest level.
fn strongest() -> Exec {
    exec(SimdLevel::detect()).expect("detected")
}

fn exec(level: SimdLevel) -> Option<Exec> {
    let level = level.token()?;
    Some(Exec { level, threads: 1 })
}

/// The levels to compare, strongest first.
fn levels() -> impl Iterator<Item = (SimdLevel, Exec)> {
    let best = SimdLevel::detect();
    std::iter::once(best)
        .chain(
            [SimdLevel::Avx2, SimdLevel::Sse2]
                .into_iter()
                .filter(move |&level| level != best),
        )
        .filter_map(|level| Some((level, exec(level)?)))
}

/// An image, as a frame that knows nothing would get it.
fn presented(backend: &mut SoftwareBackend, order: ChannelOrder) -> Vec<[u8; 4]> {
    let mut bytes = vec![0; PIXELS as usize * 4];
    let target = Target::new(&mut bytes, SIZE.0, SIZE.1).expect("enough bytes");
    assert_eq!(
        backend.present(strongest(), &mut target.with_order(order)),
        PIXELS
    );
    bytes.as_chunks().0.to_vec()
}

fn clear(c: &mut Criterion) {
    let exec = strongest();
    let subject = Subject::lit_grid(4096, 1);
    let colours = subject.colours(exec);
    let paint = BasePaint::Gouraud(&colours);
    let mut backend = SoftwareBackend::new();
    let draw = |backend: &mut SoftwareBackend, geometry: Geometry<'_>| {
        let counts = backend.rasterize(exec, geometry);
        backend.resolve(exec, geometry, paint);
        counts.covered_pixels
    };

    let mut bytes = vec![0; PIXELS as usize * 4];
    let mut target = Target::new(&mut bytes, SIZE.0, SIZE.1).expect("enough bytes");
    assert_eq!(draw(&mut backend, subject.geometry()), PIXELS);
    backend.present(exec, &mut target);
    assert_eq!(draw(&mut backend, subject.nothing()), 0);
    assert_eq!(
        backend.present(exec, &mut target),
        PIXELS,
        "all has changed"
    );
    assert_eq!(draw(&mut backend, subject.nothing()), 0);
    assert_eq!(backend.present(exec, &mut target), 0, "nothing has changed");
    let shown = presented(&mut backend, ChannelOrder::Rgba);
    assert!(shown.iter().all(|&pixel| pixel == BACKGROUND_BYTES));

    let mut group = c.benchmark_group("clear");
    group.throughput(Throughput::Elements(PIXELS));
    group.bench_function("covered before", |b| {
        b.iter_custom(|rounds| {
            let mut total = Duration::ZERO;
            for _ in 0..rounds {
                draw(&mut backend, subject.geometry());
                let since = Instant::now();
                draw(&mut backend, subject.nothing());
                total += since.elapsed();
            }
            total
        });
    });
    group.bench_function("background before", |b| {
        b.iter(|| draw(&mut backend, subject.nothing()));
    });
}

fn transform(c: &mut Criterion) {
    let subject = Subject::teapot(SIZE);
    let mut group = c.benchmark_group("transform");
    let vertices = subject.world.positions.len();
    group.throughput(Throughput::Elements(vertices as u64));
    for (level, exec) in levels() {
        let (mut backend, _) = subject.rasterized(exec);
        let seen = backend.visible_triangles().to_vec();
        group.bench_function(level.name(), |b| {
            b.iter(|| backend.transform(exec, subject.geometry()));
        });
        backend.set_up(exec, subject.geometry());
        backend.draw(exec);
        backend.list_owners(exec, subject.geometry());
        assert_eq!(backend.visible_triangles(), seen, "still the same image");
    }
}

fn set_up(c: &mut Criterion) {
    let mut group = c.benchmark_group("set_up");
    group.throughput(Throughput::Elements(TEAPOT_TRIANGLES as u64));
    for size in [SIZE, (512, 512)] {
        let subject = Subject::teapot(size);
        for (level, exec) in levels() {
            let (mut backend, counts) = subject.rasterized(exec);
            assert_eq!(counts.submitted, TEAPOT_TRIANGLES as u64);
            assert_eq!(counts.clipped, 0, "all is inside of the view");
            // About half of it faces away.
            let half = TEAPOT_TRIANGLES as u64 / 2;
            assert!(counts.back_facing.abs_diff(half) < half / 4, "{counts:?}");
            let seen = backend.visible_triangles().to_vec();
            let name = format!("{}x{}", size.0, size.1);
            group.bench_function(BenchmarkId::new(name, level.name()), |b| {
                b.iter(|| backend.set_up(exec, subject.geometry()));
            });
            backend.draw(exec);
            backend.list_owners(exec, subject.geometry());
            assert_eq!(backend.visible_triangles(), seen, "still the same image");
        }
    }
}

/// Measures drawing a grid, the layer `front` of which is in front.
fn draw_grid(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    area: u32,
    depths: &[f32],
    front: usize,
) {
    let subject = Subject::grid(area, depths);
    let of_layer = subject.all.end / depths.len() as u32;
    let first = of_layer * front as u32;
    for (level, exec) in levels() {
        let (mut backend, counts) = subject.rasterized(exec);
        subject.assert_covers(&backend, counts, area, first..first + of_layer);
        let seen = backend.visible_triangles().to_vec();
        group.throughput(Throughput::Elements(counts.drawn));
        group.bench_function(BenchmarkId::new(name, level.name()), |b| {
            b.iter(|| backend.draw(exec));
        });
        backend.list_owners(exec, subject.geometry());
        assert_eq!(backend.visible_triangles(), seen, "still the same image");
    }
}

fn draw(c: &mut Criterion) {
    let mut group = c.benchmark_group("draw");
    for area in [4, 16, 64, 256, 1024, 4096] {
        draw_grid(&mut group, &format!("{area} px"), area, &[0.5], 0);
    }
    group.finish();

    let mut group = c.benchmark_group("draw_layers");
    for area in [64, 1024] {
        let name = |order| format!("{area} px {order}");
        let (rising, falling) = ([0.2, 0.4, 0.6, 0.8], [0.8, 0.6, 0.4, 0.2]);
        draw_grid(&mut group, &name("back to front"), area, &rising, 3);
        draw_grid(&mut group, &name("front to back"), area, &falling, 0);
    }
}

fn shade(c: &mut Criterion) {
    let mut group = c.benchmark_group("shade");
    for count in LIGHTS {
        let subject = Subject::teapot(SIZE);
        let radius = subject.world.radius as f32;
        let subject = subject.with_lights(count, [0.0; 3], 2.0 * radius);
        let (world, eye) = (&subject.world, subject.view.eye);
        let all: Vec<u32> = subject.all.clone().collect();
        group.throughput(Throughput::Elements(world.positions.len() as u64));
        for (level, exec) in levels() {
            let (mut set, mut colours) = (VertexSet::default(), Vec3s::default());
            for _ in 0..world.positions.len() {
                colours.push([f32::NAN; 3]);
            }
            set.illuminate(exec, world, eye, &all, &mut colours);
            assert!(colours.x.iter().all(|red| *red >= 0.0), "every vertex");
            assert!(colours.x.iter().any(|red| *red > 0.1), "lights reach it");
            group.bench_function(BenchmarkId::new(count.to_string(), level.name()), |b| {
                b.iter(|| set.illuminate(exec, world, eye, &all, &mut colours));
            });
        }
    }
}

/// Measures colouring a covered image.
fn resolve_grid(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    subject: &Subject,
    is_phong: bool,
) {
    for (level, exec) in levels() {
        let (mut backend, counts) = subject.rasterized(exec);
        assert_eq!(counts.covered_pixels, PIXELS, "{name}");
        let colours = subject.colours(exec);
        let paint = if is_phong {
            BasePaint::Phong
        } else {
            BasePaint::Gouraud(&colours)
        };
        backend.resolve(exec, subject.geometry(), paint);
        let shown = presented(&mut backend, ChannelOrder::Rgba);
        assert!(!shown.contains(&BACKGROUND_BYTES), "{name}: all is painted");
        assert!(shown.iter().any(|pixel| *pixel != shown[0]), "{name}");
        group.bench_function(BenchmarkId::new(name, level.name()), |b| {
            b.iter(|| backend.resolve(exec, subject.geometry(), paint));
        });
    }
}

fn resolve(c: &mut Criterion) {
    let mut group = c.benchmark_group("resolve");
    group.throughput(Throughput::Elements(PIXELS));
    let mut large = Subject::lit_grid(4096, 1);
    for encoding in Encoding::ALL {
        large.view = large.view.with_encoding(encoding);
        let name = format!("gouraud {}", encoding.name());
        resolve_grid(&mut group, &name, &large, false);
    }
    resolve_grid(&mut group, "gouraud 4 px", &Subject::lit_grid(4, 1), false);
    for count in LIGHTS {
        let name = format!("phong {count}");
        resolve_grid(&mut group, &name, &Subject::lit_grid(4096, count), true);
    }
}

fn present(c: &mut Criterion) {
    let exec = strongest();
    let subject = Subject::lit_grid(4096, 1);
    let (mut backend, _) = subject.rasterized(exec);
    let colours = subject.colours(exec);
    backend.resolve(exec, subject.geometry(), BasePaint::Gouraud(&colours));
    let [rgba, bgra] =
        [ChannelOrder::Rgba, ChannelOrder::Bgra].map(|order| presented(&mut backend, order));
    assert!(
        rgba.iter()
            .zip(&bgra)
            .all(|([r, g, b, a], there)| [*b, *g, *r, *a] == *there)
    );

    let mut group = c.benchmark_group("present");
    group.throughput(Throughput::Elements(PIXELS));
    let mut bytes = vec![0; PIXELS as usize * 4];
    for (name, order) in [("rgba", ChannelOrder::Rgba), ("bgra", ChannelOrder::Bgra)] {
        group.bench_function(name, |b| {
            b.iter(|| {
                // Nothing is known about a new target, so all of it is written.
                let target = Target::new(&mut bytes, SIZE.0, SIZE.1).expect("enough bytes");
                backend.present(exec, &mut target.with_order(order))
            });
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500));
    targets = clear, transform, set_up, draw, shade, resolve, present
}
criterion_main!(benches);
