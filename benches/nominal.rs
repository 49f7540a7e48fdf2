//! The nominal costs of `schedule/cost.rs`, measured: prints one CSV row per kind of work.
//!
//! `cargo bench --bench nominal` takes about ten seconds, on one thread at the machine's strongest SIMD level. Each figure
//! is the median of many rounds; where a cost has a fixed part and a part per pixel, light or patch, both come from a
//! least-squares line through measurements of several sizes. `--test` runs everything once.

use specula::backend::software::SoftwareBackend;
use specula::backend::{Backend, BasePaint, Fill, Geometry, Patch};
use specula::geometry::clusters::RUN;
use specula::geometry::{Bary, Quadratic, Vec3s};
use specula::highlight::{ClusterShape, SignBits, cluster_masks, compute_signs, light_masks};
use specula::illumination::{ActiveLights, PointBatch, shade_vertices};
use specula::parallel::Exec;
use specula::refine::Forest;
use specula::scene::{Scene, View, World};
use specula::simd::SimdLevel;
use specula::{Budget, Engine, EngineOptions, Frame};
use std::ops::Range;
use std::time::Instant;

const SIZE: (u32, u32) = (1280, 720);

fn main() {
    let is_test = std::env::args().any(|arg| arg == "--test");
    let rounds = if is_test { 1 } else { 31 };
    let level = SimdLevel::detect();
    let exec = Exec {
        level: level.token().expect("detected"),
        threads: 1,
    };
    println!(
        "# specula {} nominal costs, {level}, 1 thread, {}",
        env!("CARGO_PKG_VERSION"),
        cpu()
    );
    println!("what,fixed_ns,per,slope_ns");
    let report = |what: &str, per: &str, line: Line| {
        println!("{what},{:.2},{per},{:.3}", line.fixed, line.slope);
    };

    let lights = [1, 4, 16];
    let per_light = |cost: &dyn Fn(&Bench) -> f64| {
        fit(lights.map(|count| (count as f64, cost(&Bench::new(count, exec, rounds)))))
    };
    report("vertex", "light", per_light(&Bench::vertex));
    report("gouraud_pixel", "light", per_light(&Bench::gouraud_pixel));
    report("phong_pixel", "light", per_light(&Bench::phong_pixel));
    for count in lights {
        let bench = Bench::new(count, exec, rounds);
        println!("phong_pixel_{count}_lights,{:.2},-,0", bench.phong_pixel());
    }
    report("sign_test_vertex", "light", per_light(&Bench::signs));
    report("collect_triangle", "light", per_light(&Bench::collect));
    report("bounds_triangle", "light", per_light(&Bench::bounds));
    report("bounds_run", "light", per_light(&Bench::run_bounds));
    report("plan_leaf", "light", per_light(&Bench::plan_leaf));

    let bench = Bench::new(4, exec, rounds);
    let present = Line {
        fixed: bench.present_pixel(),
        slope: 0.0,
    };
    report("present_pixel", "-", present);
    for (what, count, gouraud) in [
        ("repaint_patch", 4, true),
        ("phong_patch_1_light", 1, false),
        ("phong_patch_4_lights", 4, false),
        ("phong_patch_16_lights", 16, false),
    ] {
        let sizes = Bench::new(count, exec, rounds).patches(gouraud);
        for (pixels, ns) in &sizes {
            println!("{what}_of_{pixels:.0}_pixels,{ns:.1},-,0");
        }
        report(what, "pixel", fit(sizes));
    }
}

/// A cost as a straight line.
struct Line {
    fixed: f64,
    slope: f64,
}

/// The least-squares line through `(x, cost)`, relative errors weighing the same.
fn fit(points: impl IntoIterator<Item = (f64, f64)>) -> Line {
    let (mut w, mut wx, mut wy, mut wxx, mut wxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (x, y) in points {
        let weight = 1.0 / (y * y).max(1e-12);
        w += weight;
        wx += weight * x;
        wy += weight * y;
        wxx += weight * x * x;
        wxy += weight * x * y;
    }
    let slope = (w * wxy - wx * wy) / (w * wxx - wx * wx);
    Line {
        fixed: (wy - slope * wx) / w,
        slope,
    }
}

/// A teapot close to the camera, so that its triangles are large, under some lights.
struct Bench {
    exec: Exec,
    rounds: usize,
    world: World,
    view: View,
    colours: Vec3s,
    all: Vec<Range<u32>>,
}

impl Bench {
    /// The scene, the teapot that finely cut.
    fn scene(lights: usize, tessellation: u32) -> Scene {
        let light = |i: usize| {
            let angle = i as f64 * 2.4;
            let (x, y) = (6.0 * angle.cos(), 6.0 * angle.sin() - 6.0);
            format!(
                "Point(position: ({x}, {y}, {}), intensity: {}),",
                4 + i % 3,
                1.0 / lights as f64
            )
        };
        let list: String = (0..lights).map(light).collect();
        let text = format!(
            r#"(
                camera: Perspective(position: (0, -5, 3), target: (0, 0, 1.2), fov_degrees: 40),
                lights: [{list}],
                materials: {{ "m": (diffuse: (0.6, 0.3, 0.2), specular: (0.5, 0.5, 0.5), shininess: 50) }},
                objects: [(shape: Teapot(tessellation: {tessellation}), material: "m")],
            )"#
        );
        Scene::parse(&text, "bench").expect("a valid scene")
    }

    fn new(lights: usize, exec: Exec, rounds: usize) -> Self {
        let scene = Self::scene(lights, 4);
        let world = World::new(&scene);
        let view = world.view(scene.camera(), SIZE.0, SIZE.1);
        let mut colours = Vec3s::default();
        colours.resize(world.positions.len());
        let vertices: Vec<u32> = (0..world.positions.len() as u32).collect();
        shade_vertices(exec.level, &world, view.eye, &vertices, &mut colours);
        let all = std::iter::once(0..world.triangles.len() as u32).collect();
        Self {
            exec,
            rounds,
            world,
            view,
            colours,
            all,
        }
    }

    fn geometry(&self) -> Geometry<'_> {
        Geometry {
            world: &self.world,
            view: &self.view,
            visible: &self.all,
        }
    }

    /// Median nanoseconds of `work`, after one round that does not count.
    fn median_ns(&self, mut work: impl FnMut()) -> f64 {
        let mut times: Vec<f64> = (0..=self.rounds)
            .map(|_| {
                let since = Instant::now();
                work();
                since.elapsed().as_secs_f64() * 1e9
            })
            .skip(1)
            .collect();
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    }

    /// A backend that knows which triangle owns each pixel, and how many are covered.
    fn rasterized(&self) -> (SoftwareBackend, f64) {
        let mut backend = SoftwareBackend::new();
        let counts = backend.rasterize(self.exec, self.geometry());
        (backend, counts.covered_pixels as f64)
    }

    fn vertex(&self) -> f64 {
        let mut batch = PointBatch::default();
        let points = 4096;
        for i in 0..points {
            let v = i % self.world.positions.len();
            batch.push(self.world.positions.get(v), self.world.normals.get(v), 0);
        }
        let ns = self.median_ns(|| batch.illuminate(self.exec, &self.world, self.view.eye));
        ns / points as f64
    }

    fn gouraud_pixel(&self) -> f64 {
        let (mut backend, covered) = self.rasterized();
        let paint = BasePaint::Gouraud(&self.colours);
        self.median_ns(|| backend.resolve(self.exec, self.geometry(), paint)) / covered
    }

    fn phong_pixel(&self) -> f64 {
        let (mut backend, covered) = self.rasterized();
        self.median_ns(|| backend.resolve(self.exec, self.geometry(), BasePaint::Phong)) / covered
    }

    fn present_pixel(&self) -> f64 {
        let (mut backend, _) = self.rasterized();
        let mut frame = Frame::new(SIZE.0, SIZE.1);
        let ns = self.median_ns(|| {
            // Touching the frame makes all of it unknown.
            frame.pixels_mut();
            frame.write(|target| backend.present(self.exec, target));
        });
        ns / f64::from(SIZE.0 * SIZE.1)
    }

    fn signs(&self) -> f64 {
        let vertices: Vec<u32> = (0..self.world.positions.len() as u32).collect();
        let mut signs = SignBits::default();
        let ns = self.median_ns(|| {
            compute_signs(
                self.exec.level,
                &self.world,
                self.view.eye,
                &vertices,
                &mut signs,
            );
        });
        ns / vertices.len() as f64
    }

    /// Making a visible triangle a candidate, where triangles are too small for their centroids to be sampled.
    fn collect(&self) -> f64 {
        let scene = Self::scene(self.world.lights.len(), 32);
        let options = EngineOptions {
            threads: Some(1),
            ..EngineOptions::default()
        };
        let mut engine = Engine::with_options(&scene, options).expect("an engine");
        let mut frame = Frame::new(320, 180);
        let mut times: Vec<f64> = (0..=self.rounds)
            .map(|_| {
                engine.forget();
                let stats = engine.render(&scene, Budget::Work(0), &mut frame);
                stats.stage_ms.classify * 1e6 / stats.triangles_visible as f64
            })
            .skip(1)
            .collect();
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    }

    fn bounds(&self) -> f64 {
        let (backend, _) = self.rasterized();
        let triangles = backend.visible_triangles();
        let ns = self.median_ns(|| {
            for &triangle in triangles {
                std::hint::black_box(light_masks(
                    &self.world,
                    &self.view.eye,
                    self.view.encoding,
                    triangle,
                ));
            }
        });
        ns / triangles.len() as f64
    }

    /// Bounding runs of triangles, per run.
    fn run_bounds(&self) -> f64 {
        let (world, view) = (&self.world, &self.view);
        let runs = || {
            let clusters = world
                .clusters
                .iter()
                .map(|cluster| cluster.triangles.clone());
            clusters.flat_map(|triangles| {
                let end = triangles.end;
                triangles
                    .step_by(RUN)
                    .map(move |first| first..end.min(first + RUN as u32))
            })
        };
        let ns = self.median_ns(|| {
            for run in runs() {
                let first = run.start;
                let shape = ClusterShape::new(world, run);
                std::hint::black_box(cluster_masks(
                    world,
                    &view.eye,
                    view.encoding,
                    first,
                    &shape,
                ));
            }
        });
        ns / runs().count() as f64
    }

    /// Planting every visible triangle and splitting it in four, per leaf made, illumination included.
    fn plan_leaf(&self) -> f64 {
        let (backend, _) = self.rasterized();
        let triangles = backend.visible_triangles().to_vec();
        let mut forest = Forest::default();
        let (mut planted, mut outcomes) = (Vec::new(), Vec::new());
        let mut leaves = 1;
        let ns = self.median_ns(|| {
            forest.reset(&self.world);
            planted.clear();
            outcomes.clear();
            for &triangle in &triangles {
                forest.plant(&self.world, &self.colours, triangle, 100);
            }
            let (world, view) = (&self.world, &self.view);
            forest.illuminate(self.exec, world, view, &self.colours, &mut planted);
            for &leaf in &planted {
                forest.plan_split(world, &self.colours, leaf, 7, |t| backend.visible_pixels(t));
            }
            forest.illuminate(self.exec, world, view, &self.colours, &mut Vec::new());
            forest.conclude_splits(world, &mut outcomes);
            leaves = forest.open_leaves();
        });
        ns / leaves as f64
    }

    /// Pixels and nanoseconds per patch when every visible triangle is cut into quarters 0 to 4 times.
    fn patches(&self, gouraud: bool) -> Vec<(f64, f64)> {
        let (mut backend, covered) = self.rasterized();
        backend.resolve(
            self.exec,
            self.geometry(),
            BasePaint::Gouraud(&self.colours),
        );
        let lights = ActiveLights::all(self.world.lights.len());
        let fill = if gouraud {
            Fill::Gouraud([[0.1, 0.2, 0.3], [0.3, 0.2, 0.1], [0.2, 0.3, 0.1]])
        } else {
            Fill::Phong {
                lights,
                remainder: Quadratic::default(),
            }
        };
        let whole = |&triangle: &u32| Patch {
            triangle,
            corners: Bary::ROOT,
            fill,
            pixels: 0,
        };
        let mut patches: Vec<Patch> = backend.visible_triangles().iter().map(whole).collect();
        let mut sizes = Vec::new();
        for _ in 0..5 {
            // In pieces as refinement paints them.
            let ns = self.median_ns(|| {
                for piece in patches.chunks_mut(32) {
                    backend.repaint(self.exec, self.geometry(), piece);
                }
            });
            let count = patches.len() as f64;
            sizes.push((covered / count, ns / count));
            patches = patches.iter().flat_map(quarters).collect();
        }
        sizes
    }
}

fn quarters(patch: &Patch) -> [Patch; 4] {
    Bary::quarters(patch.corners)
        .expect("far above the grid")
        .map(|corners| Patch { corners, ..*patch })
}

/// What the operating system calls the processor.
fn cpu() -> String {
    std::fs::read_to_string("/proc/cpuinfo")
        .ok()
        .and_then(|text| {
            let line = text.lines().find(|line| line.starts_with("model name"))?;
            Some(line.split_once(':')?.1.trim().to_owned())
        })
        .unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}
