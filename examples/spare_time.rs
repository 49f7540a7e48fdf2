//! A viewer's loop: a frame when something changes, refinement while it waits, and only what changed is shown.
//!
//! `cargo run --release --example spare_time -- [FRAMES]`

use specula::glam::DQuat;
use specula::scene::Camera;
use specula::{Budget, Engine, Frame, Scene};
use std::error::Error;

/// A frame is due so often, and what of that is for rendering it.
const FRAME_MS: f64 = 1000.0 / 60.0;
const BUDGET_MS: f64 = 4.0;

/// The camera turns in every second stretch of so many frames, and stands still in the others.
const STRETCH: u32 = 10;
const DEGREES_PER_FRAME: f64 = 0.5;

fn main() -> Result<(), Box<dyn Error>> {
    let frames = match std::env::args().nth(1) {
        Some(count) => count.parse::<u32>()?.max(1),
        None => 40,
    };
    let mut scene = Scene::parse(include_str!("../scenes/walls.ron"), "walls.ron")?;
    let mut engine = Engine::new(&scene)?;
    let mut frame = Frame::new(1280, 720);
    engine.warm_up(&scene, frame.width(), frame.height());
    // A window's thread would cancel by this token when the user does something, and reset it.
    let _cancel = engine.cancel_token();

    for number in 0..frames {
        if (number / STRETCH).is_multiple_of(2) {
            turn_camera(&mut scene);
        }
        let due_ms = engine.now_ms() + FRAME_MS;
        let stats = engine.render(&scene, Budget::from_millis(BUDGET_MS), &mut frame);
        // A window would be told of these rectangles, and of nothing else.
        let damage = engine.changed().len();
        // Nothing else to do until the next frame is due: its image gets better meanwhile.
        let is_final = engine.refine_until(due_ms);
        println!(
            "frame {number:3}: {} in {:5.2} ms, about {:.2} codes of error, {damage} rectangles changed{}",
            stats.outcome,
            stats.frame_ms,
            stats.estimated_error,
            if is_final { "; final by now" } else { "" }
        );
    }
    frame.save_png("spare_time.png")?;
    println!("the last one is spare_time.png");
    Ok(())
}

/// Turns the camera about its target.
fn turn_camera(scene: &mut Scene) {
    let camera = *scene.camera();
    let turn = DQuat::from_axis_angle(camera.up.normalize(), DEGREES_PER_FRAME.to_radians());
    scene.set_camera(Camera {
        position: camera.target + turn * (camera.position - camera.target),
        ..camera
    });
}
