//! How soon the software backend returns when it is told to stop.
//!
//! Images are drawn in turns of random length, from 50 to 500 microseconds. For each turn that was stopped, the time is taken from when
//! a thread was first told so to when the call has returned; percentiles of these, in microseconds, are printed for each
//! of the three steps. "late" is the same from the moment at which time was up, which somebody then had to find out.
//!
//! `--rounds N` draws each image so many times (20 by default); `--test` once.

use rayon::ThreadPoolBuilder;
use specula::backend::software::SoftwareBackend;
use specula::backend::{Backend, BasePaint, Geometry};
use specula::geometry::Vec3s;
use specula::illumination::VertexSet;
use specula::parallel::{Exec, Turn};
use specula::scene::{Scene, World};
use specula::simd::SimdLevel;
use specula::visibility::Culler;
use std::path::Path;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Scenes, and the sizes they are drawn in.
const IMAGES: [(&str, u32, u32); 4] = [
    ("heavy", 1280, 720),
    ("heavy", 1920, 1080),
    ("closeup", 3840, 2160),
    ("lights100", 1920, 1080),
];

/// Turns of one step that were stopped.
#[derive(Default)]
struct Stops {
    /// From the first answer of no, in microseconds.
    answered: Vec<f64>,
    /// From when time was up.
    late: Vec<f64>,
    /// All turns together, in milliseconds.
    total_ms: f64,
}

impl Stops {
    /// Takes turns until the work is complete.
    fn take_turns(&mut self, lengths: &mut Lengths, mut turn: impl FnMut(Turn<'_>) -> bool) {
        let mut is_first = true;
        loop {
            let told = OnceLock::new();
            let since = Instant::now();
            let end = since + lengths.next();
            let go_on = || {
                let now = Instant::now();
                if now >= end {
                    told.get_or_init(|| now);
                }
                now < end
            };
            let is_complete = turn(Turn {
                is_first,
                go_on: &go_on,
            });
            let returned = Instant::now();
            self.total_ms += (returned - since).as_secs_f64() * 1e3;
            if let Some(&told) = told.get() {
                self.answered.push((returned - told).as_secs_f64() * 1e6);
                self.late.push((returned - end).as_secs_f64() * 1e6);
            }
            if is_complete {
                return;
            }
            is_first = false;
        }
    }

    fn print(mut self, step: &str, rounds: u32) {
        let mut row = format!(
            "  {step:<10} {:6.2} ms, {:5} stops",
            self.total_ms / f64::from(rounds),
            self.answered.len()
        );
        for (name, times) in [("told", &mut self.answered), ("late", &mut self.late)] {
            times.sort_by(f64::total_cmp);
            let at = |part: f64| {
                let index = (times.len() as f64 * part) as usize;
                times.get(index.min(times.len().saturating_sub(1))).copied()
            };
            row += &format!(", {name}");
            for part in [0.5, 0.9, 0.99, 1.0] {
                row += &format!(" {:6.1}", at(part).unwrap_or(0.0));
            }
        }
        println!("{row}");
    }
}

/// Random lengths of turns: `splitmix64`.
struct Lengths(u64);

impl Lengths {
    fn next(&mut self) -> Duration {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        Duration::from_micros(50 + (z >> 32) % 450)
    }
}

fn measure(exec: Exec, geometry: Geometry<'_>, rounds: u32) {
    let (world, view) = (geometry.world, geometry.view);
    let (mut backend, mut set) = (SoftwareBackend::new(), VertexSet::default());
    let (mut colours, mut lengths) = (Vec3s::default(), Lengths(1));
    let mut first = [Stops::default(), Stops::default(), Stops::default()];
    let mut later = [Stops::default(), Stops::default(), Stops::default()];
    for round in 0..=rounds {
        let [drawing, lighting, colouring] = if round == 0 { &mut first } else { &mut later };
        drawing.take_turns(&mut lengths, |turn| {
            backend.rasterize_while(exec, geometry, turn).is_some()
        });
        let visible = backend.visible_triangles();
        lighting.take_turns(&mut lengths, |turn| {
            set.illuminate_while(exec, world, view.eye, visible, &mut colours, turn)
        });
        colouring.take_turns(&mut lengths, |turn| {
            backend.resolve_while(exec, geometry, BasePaint::Gouraud(&colours), turn)
        });
    }
    let mut phong = Stops::default();
    phong.take_turns(&mut lengths, |turn| {
        backend.resolve_while(exec, geometry, BasePaint::Phong, turn)
    });
    let [a, b, c] = first;
    println!("  the first image, in new memory:");
    a.print("rasterize", 1);
    b.print("illuminate", 1);
    c.print("resolve", 1);
    println!("  later ones:");
    let [a, b, c] = later;
    a.print("rasterize", rounds);
    b.print("illuminate", rounds);
    c.print("resolve", rounds);
    phong.print("phong", 1);
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let rounds = arguments
        .iter()
        .position(|argument| argument == "--rounds")
        .and_then(|at| arguments.get(at + 1)?.parse().ok())
        .unwrap_or(20);
    let rounds = match arguments.iter().any(|argument| argument == "--test") {
        true => 1,
        false => rounds,
    };
    println!("microseconds: 50th, 90th, 99th percentile and longest");
    for (name, width, height) in IMAGES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.ron"));
        let scene = Scene::load(&path).expect("a shipped scene");
        let world = World::new(&scene);
        let view = world.view(scene.camera(), width, height);
        let mut visible = Vec::new();
        Culler::new(&world.clusters).cull(&view, &mut visible);
        let geometry = Geometry {
            world: &world,
            view: &view,
            visible: &visible,
        };
        let level = SimdLevel::detect().token().expect("detected");
        for threads in [1, 2] {
            println!("{name} {width}x{height}, {threads} threads:");
            let exec = Exec { level, threads };
            let pool = ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads")
                .install(|| measure(exec, geometry, rounds));
        }
    }
}
