//! `specula render`: frames of a still view under a budget.

use super::args::{Machine, budget, count, milliseconds, require_png, time};
use super::console::{Output, Progress, note};
use super::report::FrameReport;
use super::{Failure, animate};
use clap::Args;
use specula::frame::{Engine, Method};
use specula::measure::{ErrorReport, ReferenceImage};
use specula::output::{Encoding, Frame, png};
use specula::scene::Scene;
use std::path::PathBuf;

/// `specula render`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each frame goes on refining where the last one stopped, until the image equals per-pixel Phong
shading. Without --budget and --work the first frame refines until then.

PHTs are potentially highlighted triangles: those that pass the paper's test for a highlight's centre.

Examples:
  Converge, and write the final image:
    specula render scenes/teapot.ron -o teapot.png
  Eight frames of at most 2 ms each, at full HD:
    specula render scenes/teapot.ron -o teapot.png --budget 2 --frames 8 --size 1920x1080
  The same image however fast the machine, compared with the Phong reference:
    specula render scenes/teapot.ron -o teapot.png --work 500000 --error
  Frame times for a script:
    specula render scenes/teapot.ron -o teapot.png --budget 2 --frames 100 --json | jq .frame_ms")]
pub(super) struct Render {
    /// Scene file (.ron), or a mesh (.obj), which gets a camera, lights and a material
    scene: PathBuf,

    /// Image to write; its name ends in .png
    #[arg(short, long, value_name = "OUT.png")]
    output: PathBuf,

    /// Wall-clock milliseconds for each frame; 0 buys the first, Gouraud-shaded image only
    #[arg(long, value_name = "MS", value_parser = milliseconds, allow_negative_numbers = true)]
    budget: Option<f64>,

    /// Work units (nominal nanoseconds of refinement) for each frame: the result does not depend on the machine's
    /// speed or the number of threads
    #[arg(long, value_name = "UNITS", conflicts_with = "budget")]
    work: Option<u64>,

    /// Show the scene's animation after this many seconds, as `specula animate` films it
    #[arg(long, value_name = "S", value_parser = time, allow_negative_numbers = true)]
    time: Option<f64>,

    /// How many frames of the view to render
    #[arg(long, value_name = "N", default_value = "1", value_parser = count)]
    frames: u32,

    /// How to shade: flat, gouraud, phong, adaptive, phong-area or phong-tiles
    #[arg(long, default_value_t)]
    method: Method,

    /// How the image stores light: srgb, or linear (codes in proportion to light, for further computation)
    #[arg(long, value_name = "NAME", default_value_t)]
    encoding: Encoding,

    /// Compare the last frame with the Phong reference (which takes a while)
    #[arg(long)]
    error: bool,

    /// Print one JSON object per frame
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    machine: Machine,
}

pub(super) fn run(args: &Render) -> Result<(), Failure> {
    require_png(&args.output)?;
    png::check_writable(&args.output)?;
    let mut scene = Scene::load(&args.scene)?;
    if let Some(seconds) = args.time {
        animate::go_to_time(&mut scene, seconds);
    }
    let size = args.machine.size;
    let mut engine = args.machine.engine(&scene, args.method, args.encoding)?;
    let mut frame = Frame::new(size.width, size.height);
    let budget = budget(args.budget, args.work);

    if args.budget.is_some() {
        engine.warm_up(&scene, size.width, size.height);
    }
    let mut output = Output::new();
    let mut is_empty = false;
    for number in 1..=args.frames {
        let stats = engine.render(&scene, budget, &mut frame);
        is_empty = stats.covered_pixels == 0;
        let error = (args.error && number == args.frames)
            .then(|| compare(&engine, &scene, &frame, args))
            .transpose()?;
        let report = FrameReport {
            number,
            stats,
            error,
        };
        output.line(&if args.json {
            report.json().to_string()
        } else {
            report.text()
        })?;
    }
    frame.save_png(&args.output)?;
    if is_empty {
        note("nothing of the scene is in the image");
    }
    note(&format!(
        "wrote {} ({}x{})",
        args.output.display(),
        size.width,
        size.height
    ));
    Ok(())
}

fn compare(
    engine: &Engine,
    scene: &Scene,
    frame: &Frame,
    args: &Render,
) -> Result<ErrorReport, Failure> {
    let progress = Progress::new(0);
    progress.doing("rendering the Phong reference");
    let world = engine.world();
    let view = world
        .view(scene.camera(), frame.width(), frame.height())
        .with_encoding(engine.encoding());
    let reference = ReferenceImage::render(world, &view, args.machine.thread_count());
    ErrorReport::compare(frame, &reference).map_err(|error| Failure::runtime(error.to_string()))
}
