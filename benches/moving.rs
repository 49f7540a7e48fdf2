//! What a frame costs in which little has changed since the one before, against whole frames.
//!
//! Ten teapots of 5,600 triangles each stand in two rows. Frames of four kinds take turns: everything drawn anew though nothing has
//! changed, all teapots moved, one teapot moved, and a light moved. Medians are printed in milliseconds, and as parts of those of the
//! first two kinds. Nothing is refined.
//!
//! `--rounds N` draws so many frames of each kind (100 by default); `--test` two.

use glam::{DMat4, DVec3};
use specula::scene::{Light, LightKind, Scene};
use specula::{Budget, Engine, EngineOptions, Frame, FrameStats, Method};
use std::fmt::Write;

const SIZES: [(u32, u32); 2] = [(1280, 720), (1920, 1080)];

/// Objects, and how many of them stand side by side.
const OBJECTS: usize = 10;
const COLUMNS: usize = 5;

/// What has changed since the frame before.
#[derive(Clone, Copy, Debug)]
enum Change {
    Nothing,
    All,
    One,
    Light,
}

const CHANGES: [(Change, &str); 4] = [
    (Change::Nothing, "everything anew"),
    (Change::All, "all ten moved"),
    (Change::One, "one moved"),
    (Change::Light, "light moved"),
];

fn place(object: usize, round: u32) -> DMat4 {
    let column = (object % COLUMNS) as f64 - 2.0;
    let row = (object / COLUMNS) as f64 - 0.5;
    let sway = 0.1 * f64::from(round).sin();
    DMat4::from_translation(DVec3::new(column * 7.5 + sway, 0.0, row * 7.0))
        * DMat4::from_rotation_z(0.05 * f64::from(round))
}

fn scene() -> Scene {
    let objects =
        "(shape: Teapot(tessellation: 10, bottom: false), material: \"glaze\"),".repeat(OBJECTS);
    let text = format!(
        r#"(
            camera: Perspective(position: (0, -40, 6), target: (0, 0, 1), fov_degrees: 28),
            lights: [
                Point(position: (-15, -30, 25), intensity: 0.7),
                Point(position: (20, -25, 10), intensity: 0.3),
                Point(position: (5, -10, 30), intensity: 0.2),
                Point(position: (-10, 20, 20), intensity: 0.4),
            ],
            materials: {{ "glaze": (diffuse: (0.4, 0.09, 0.035), specular: 0.9, shininess: 50) }},
            objects: [{objects}],
        )"#
    );
    let mut scene = Scene::parse(&text, "moving.ron").expect("a valid scene");
    let mut objects = scene.objects().to_vec();
    for (index, object) in objects.iter_mut().enumerate() {
        object.author_from_mesh = place(index, 0);
    }
    scene.set_objects(objects);
    scene
}

/// Frames of each kind, one after the other.
fn measure(method: Method, threads: usize, (width, height): (u32, u32), rounds: u32) {
    let mut scene = scene();
    let options = EngineOptions {
        method,
        threads: Some(threads),
        ..EngineOptions::default()
    };
    let mut engine = Engine::with_options(&scene, options).expect("an engine");
    let mut frame = Frame::new(width, height);
    let light = scene.lights()[0];
    let mut frames: [Vec<FrameStats>; CHANGES.len()] = Default::default();
    // The first round warms up.
    for round in 0..=rounds {
        for ((change, _), frames) in CHANGES.iter().zip(&mut frames) {
            match change {
                Change::Nothing => engine.forget(),
                Change::All => {
                    for object in 0..OBJECTS {
                        scene.set_transform(object, place(object, round));
                    }
                }
                Change::One => scene.set_transform(2, place(2, round + 1)),
                Change::Light => {
                    let position = DVec3::new(f64::from(round).cos() * 20.0, -30.0, 25.0);
                    let kind = LightKind::Point { position };
                    scene.set_light(0, Light { kind, ..light });
                }
            }
            let stats = engine.render(&scene, Budget::Work(0), &mut frame);
            if round > 0 {
                frames.push(stats);
            }
        }
    }
    println!("{method}, {width} x {height}, {threads} threads:");
    let medians = frames
        .each_ref()
        .map(|frames| median(frames, |stats| stats.frame_ms));
    for ((_, name), (ms, frames)) in CHANGES.iter().zip(medians.iter().zip(&frames)) {
        let mut row = format!("  {name:<16} {ms:7.3} ms");
        for whole in &medians[..2] {
            let _ = write!(row, " {:4.0} %", 100.0 * ms / whole);
        }
        row += "  of which";
        for (stage, (name, _)) in frames[0].stage_ms.entries().iter().enumerate() {
            let ms = median(frames, |stats| stats.stage_ms.entries()[stage].1);
            let _ = write!(row, " {name} {ms:.3}");
        }
        let last = frames[frames.len() - 1];
        println!("{row}; {} tiles kept", last.skipped.tiles_unmoved);
    }
}

fn median(frames: &[FrameStats], of: impl Fn(&FrameStats) -> f64) -> f64 {
    let mut values: Vec<f64> = frames.iter().map(of).collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let rounds = (arguments.iter())
        .position(|argument| argument == "--rounds")
        .and_then(|at| arguments.get(at + 1)?.parse().ok())
        .unwrap_or(100);
    let is_test = arguments.iter().any(|argument| argument == "--test");
    let rounds = if is_test { 2 } else { rounds };
    for method in [Method::Gouraud, Method::Adaptive] {
        for size in SIZES {
            for threads in [1, 2] {
                measure(method, threads, size, rounds);
            }
        }
    }
}
