//! A turning teapot at less than 4 ms a frame, and what became of each frame.
//!
//! `cargo run --release --example animation_loop -- [FRAMES]`

use specula::glam::DMat4;
use specula::{Budget, Engine, Frame, Scene};
use std::error::Error;

/// What a frame may take, and what of it is for rendering: a window or an encoder wants its share.
const FRAME_MS: f64 = 4.0;
const BUDGET_MS: f64 = 3.5;
const DEGREES_PER_FRAME: f64 = 1.5;

fn main() -> Result<(), Box<dyn Error>> {
    let frames = match std::env::args().nth(1) {
        Some(count) => count.parse::<u32>()?.max(1),
        None => 240,
    };
    let mut scene = Scene::parse(include_str!("../scenes/teapot.ron"), "teapot.ron")?;
    let rest = scene.objects()[0].author_from_mesh;
    let mut engine = Engine::new(&scene)?;
    let mut frame = Frame::new(1280, 720);
    engine.warm_up(&scene, frame.width(), frame.height());

    let mut times = Vec::new();
    for number in 0..frames {
        let angle = (f64::from(number) * DEGREES_PER_FRAME).to_radians();
        scene.set_transform(0, DMat4::from_rotation_z(angle) * rest);

        let stats = engine.render(&scene, Budget::from_millis(BUDGET_MS), &mut frame);

        // Here the frame goes to a window, a video encoder or another machine.
        times.push(stats.frame_ms);
        if number % 30 == 0 {
            println!(
                "frame {number:4}: {} in {:.2} ms, {} of {} highlighted triangles refined, \
                 estimated error {:.2} codes",
                stats.outcome,
                stats.frame_ms,
                stats.refined,
                stats.pht_visible,
                stats.estimated_error
            );
        }
    }

    times.sort_by(f64::total_cmp);
    let late = times.iter().filter(|&&ms| ms > FRAME_MS).count();
    println!(
        "{frames} frames: median {:.2} ms, slowest {:.2} ms, {late} over {FRAME_MS} ms",
        times[times.len() / 2],
        times[times.len() - 1]
    );
    frame.save_png("animation_loop.png")?;
    println!("the last one is animation_loop.png");
    Ok(())
}
