//! What is proved of the image while a still view is refined, beside the truth.
//!
//! ```text
//! cargo run --release --example certificate -- scenes/teapot.ron 640x360
//! ```
//!
//! Each line is a frame of a work budget: all work so far, the error as estimated and measured (root mean square, in codes), the
//! largest error of any pixel, the bound that the frame certifies for it, and the share of covered pixels that are not proved to be
//! right within a code, beside those that are not.

use specula::measure::{ErrorReport, ReferenceImage};
use specula::scene::World;
use specula::{Budget, Engine, Frame, Scene};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let path = args.next().unwrap_or_else(|| "scenes/teapot.ron".into());
    let size = args.next().unwrap_or_else(|| "640x360".into());
    let (width, height) = size.split_once('x').ok_or("a size is like 640x360")?;
    let (width, height) = (width.parse()?, height.parse()?);
    let scene = Scene::load(path)?;
    let world = World::new(&scene);
    let view = world.view(scene.camera(), width, height);
    let reference = ReferenceImage::render(&world, &view, 2);

    let mut engine = Engine::new(&scene)?;
    let mut frame = Frame::new(width, height);
    println!("     work  estimate     rmse   max  bound  unproved  not right");
    let mut work = 0;
    let mut units = 10_000;
    loop {
        let stats = engine.render(&scene, Budget::Work(units), &mut frame);
        work += stats.work_units;
        let report = ErrorReport::compare(&frame, &reference)?;
        let covered = stats.covered_pixels.max(1) as f64;
        let pixels = frame.as_bytes().chunks(4).zip(&reference.pixels);
        let wrong = pixels.filter(|(a, b)| (0..3).any(|c| a[c].abs_diff(b[c]) > 1));
        println!(
            "{work:9}  {:8.3} {:8.3}  {:4}  {:5.0}  {:7.2}%  {:8.2}%",
            stats.estimated_error,
            report.rmse,
            report.max,
            stats.error_bound.unwrap_or(1.0) * 255.0,
            stats.unproved_share.unwrap_or(1.0) * 100.0,
            wrong.count() as f64 / covered * 100.0,
        );
        if stats.converged {
            return Ok(());
        }
        units += units / 4;
    }
}
