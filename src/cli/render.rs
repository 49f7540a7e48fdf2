//! `specula render`: frames of a still view under a budget.

use super::args::{
    Machine, Paper, budget, count, milliseconds, name_of, require_png, rmse, size, time,
};
use super::console::{Output, Progress, note};
use super::log::{Log, LoggedFrame, checksum};
use super::report::FrameReport;
use super::{Failure, animate};
use clap::Args;
use specula::BackendKind;
use specula::frame::{Engine, EngineOptions, Method};
use specula::measure::{ErrorReport, ReferenceImage};
use specula::output::{Encoding, Frame, png};
use specula::scene::Scene;
use specula::schedule::Budget;
use std::path::{Path, PathBuf};

/// `specula render`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each frame goes on refining where the last one stopped, until the image equals per-pixel Phong
shading. Without --budget, --work and --until-error the first frame refines until then.

A frame keeps its --budget even if a first image does not fit into it: the image is then drawn at a
lower resolution ('reduced'), or over several frames ('stale' until it is complete).

PHTs are potentially highlighted triangles: those that pass the paper's test for a highlight's centre.

Examples:
  Converge, and write the final image:
    specula render scenes/teapot.ron -o teapot.png
  Eight frames of at most 2 ms each, at full HD:
    specula render scenes/teapot.ron -o teapot.png --budget 2 --frames 8 --size 1920x1080
  The same image however fast the machine, compared with the Phong reference:
    specula render scenes/teapot.ron -o teapot.png --work 500000 --error
  As good as half a code of error, by the engine's own estimate:
    specula render scenes/teapot.ron -o teapot.png --until-error 0.5
  Record a timed run, and repeat it bit for bit:
    specula render scenes/teapot.ron -o a.png --budget 2 --frames 8 --record run.json
    specula render scenes/teapot.ron -o b.png --replay run.json --threads 1
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

    /// Refine until the estimated error is at most so many 8-bit codes (root mean square)
    #[arg(long, value_name = "RMSE", conflicts_with_all = ["budget", "work"], value_parser = rmse,
        allow_negative_numbers = true)]
    until_error: Option<f64>,

    /// Write down what time decided in each frame, for --replay
    #[arg(long, value_name = "LOG.json", conflicts_with = "replay")]
    record: Option<PathBuf>,

    /// Repeat a recorded run, bit for bit, with its size, method and number of frames
    #[arg(long, value_name = "LOG.json",
        conflicts_with_all = ["budget", "work", "until_error", "frames", "size", "method", "backend", "encoding", "time"])]
    replay: Option<PathBuf>,

    /// Show the scene's animation after this many seconds, as `specula animate` films it
    #[arg(long, value_name = "S", value_parser = time, allow_negative_numbers = true)]
    time: Option<f64>,

    /// How many frames of the view to render
    #[arg(long, value_name = "N", default_value = "1", value_parser = count)]
    frames: u32,

    /// How to shade: flat, gouraud, phong, adaptive, phong-area, phong-tiles, phong-half, regular, highlight or hybrid
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
    paper: Paper,

    #[command(flatten)]
    machine: Machine,
}

pub(super) fn run(args: &Render) -> Result<(), Failure> {
    require_png(&args.output)?;
    png::check_writable(&args.output)?;
    if let Some(path) = &args.record {
        png::check_writable(path)?;
    }
    let run = match &args.replay {
        Some(path) => Run::replayed(args, path)?,
        None => Run::asked_for(args),
    };
    let mut scene = Scene::load(&args.scene)?;
    if let Some(seconds) = run.time_s {
        animate::go_to_time(&mut scene, seconds);
    }
    let [width, height] = run.size;
    let mut engine = Engine::with_options(&scene, run.options(args)?)?;
    let mut frame = Frame::new(width, height);
    if run.is_warmed_up {
        engine.warm_up(&scene, width, height);
    }
    let mut log = run.log(args);
    let mut output = Output::new();
    let mut is_empty = false;
    for (number, budget) in (1..).zip(run.budgets()) {
        let stats = engine.render(&scene, budget, &mut frame);
        is_empty = stats.covered_pixels == 0;
        run.check(number, &frame)?;
        if args.record.is_some() {
            log.frames.push(LoggedFrame {
                record: stats.record,
                frame_ms: stats.frame_ms,
                outcome: stats.outcome.name().to_owned(),
                image: checksum(&frame),
            });
        }
        let is_last = number == run.count();
        let error = (args.error && is_last)
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
    if let Some(path) = &args.record {
        log.save(path)?;
        note(&format!("wrote {}", path.display()));
    }
    if run.expected.is_some() {
        note(&format!("all {} images are the recorded ones", run.count()));
    }
    if is_empty {
        note("nothing of the scene is in the image");
    }
    note(&format!(
        "wrote {} ({width}x{height})",
        args.output.display()
    ));
    Ok(())
}

/// What is to be rendered: as the arguments say, or as a log does.
struct Run {
    size: [u32; 2],
    method: Method,
    backend: BackendKind,
    encoding: Encoding,
    time_s: Option<f64>,
    is_warmed_up: bool,
    budget: Budget,
    frames: u32,
    /// The frames that are repeated.
    expected: Option<Vec<LoggedFrame>>,
}

impl Run {
    fn asked_for(args: &Render) -> Self {
        let size = args.machine.size;
        Self {
            size: [size.width, size.height],
            method: args.method,
            backend: args.machine.backend,
            encoding: args.encoding,
            time_s: args.time,
            is_warmed_up: args.budget.is_some(),
            budget: match args.until_error {
                Some(rmse) => Budget::Error(rmse),
                None => budget(args.budget, args.work),
            },
            frames: args.frames,
            expected: None,
        }
    }

    fn replayed(args: &Render, path: &Path) -> Result<Self, Failure> {
        let log = Log::load(path)?;
        let bad =
            |what: &str, why: String| Failure::input(format!("{}: {what}: {why}", path.display()));
        let size =
            size(&format!("{}x{}", log.width, log.height)).map_err(|why| bad("size", why))?;
        let time_s = log.time_s.map(|seconds| time(&seconds.to_string()));
        let name = name_of(&args.scene);
        if log.scene != name {
            note(&format!(
                "the log is of the scene '{}', not of '{name}'",
                log.scene
            ));
        }
        Ok(Self {
            size: [size.width, size.height],
            method: log.method.parse().map_err(|why| bad("method", why))?,
            backend: log.backend.parse().map_err(|why| bad("backend", why))?,
            encoding: log.encoding.parse().map_err(|why| bad("encoding", why))?,
            time_s: time_s.transpose().map_err(|why| bad("time_s", why))?,
            is_warmed_up: log.is_warmed_up,
            budget: Budget::Unlimited,
            frames: log.frames.len() as u32,
            expected: Some(log.frames),
        })
    }

    fn options(&self, args: &Render) -> Result<EngineOptions, Failure> {
        Ok(EngineOptions {
            backend: self.backend,
            paper: args.paper.rule(),
            ..args.machine.options(self.method, self.encoding)?
        })
    }

    fn count(&self) -> u32 {
        self.frames
    }

    /// The budget of each frame.
    fn budgets(&self) -> impl Iterator<Item = Budget> {
        (0..self.frames as usize).map(|index| match &self.expected {
            Some(frames) => Budget::Replay(frames[index].record),
            None => self.budget,
        })
    }

    /// Compares a replayed image with the recorded one.
    fn check(&self, number: u32, frame: &Frame) -> Result<(), Failure> {
        let Some(frames) = &self.expected else {
            return Ok(());
        };
        if frames[number as usize - 1].image == checksum(frame) {
            return Ok(());
        }
        Err(Failure::runtime(format!(
            "frame {number} is not the recorded one: another scene, another version of the program, or a processor without \
             fused multiply-add"
        )))
    }

    fn log(&self, args: &Render) -> Log {
        Log {
            method: self.method.to_string(),
            backend: self.backend.to_string(),
            encoding: self.encoding.to_string(),
            time_s: self.time_s,
            is_warmed_up: self.is_warmed_up,
            ..Log::new(name_of(&args.scene), self.size)
        }
    }
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
