//! A film of the turntable on standard output, for a video encoder to read while it is rendered:
//!
//! `cargo run --release --example y4m_stream -- 90 | ffmpeg -i - turntable.mp4`
//!
//! The argument is the number of frames; without it the film is as long as the scene says. Frames have a fixed budget, so
//! that rendering keeps up with the rate of the film however the scene grows. Messages go to standard error. When the
//! reader goes away, the program ends.

use specula::output::y4m::Y4mWriter;
use specula::{Budget, Engine, Frame, Scene};
use std::error::Error;
use std::io::{ErrorKind, stdout};

const WIDTH: u32 = 1280;
const HEIGHT: u32 = 720;
const BUDGET_MS: f64 = 10.0;

fn main() -> Result<(), Box<dyn Error>> {
    let mut scene = Scene::parse(include_str!("../scenes/turntable.ron"), "turntable.ron")?;
    let timing = *scene
        .animation()
        .ok_or("nothing moves in this scene")?
        .timing();
    let frames = match std::env::args().nth(1) {
        Some(count) => count.parse()?,
        None => timing.frames(),
    };
    let mut engine = Engine::new(&scene)?;
    let mut frame = Frame::new(WIDTH, HEIGHT);
    let mut film = Y4mWriter::new(stdout().lock(), WIDTH, HEIGHT, &timing)?;

    let mut rendering_ms = 0.0;
    for number in 0..frames {
        scene.set_time(timing.rate().seconds(number));
        let stats = engine.render(&scene, Budget::from_millis(BUDGET_MS), &mut frame);
        rendering_ms += stats.frame_ms;
        match film.write(&frame) {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => return Ok(()),
            result => result?,
        }
    }
    let mean_ms = rendering_ms / f64::from(frames.max(1));
    eprintln!("{frames} frames, {mean_ms:.2} ms each to render");
    Ok(())
}
