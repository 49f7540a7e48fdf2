//! `specula bench`: frame times over views from all around a scene.

use super::args::{Machine, Paper, budget, count, milliseconds, name_of};
use super::console::{Output, Progress, note};
use super::report::list;
use super::{Failure, costs};
use clap::Args;
use specula::frame::Method;
use specula::measure::{BenchOptions, BenchPhase, BenchReport, PredictionErrors, bench};
use specula::output::{Encoding, png};
use specula::scene::Scene;
use std::path::PathBuf;

/// Most views, and most times each is rendered: enough for any purpose, and few enough to keep all times.
const MOST: u32 = 3600;

/// `specula bench`.
#[derive(Debug, Args)]
#[command(after_help = "\
This is the experiment of Cho, Neumann and Woo, section 4: the camera turns about the scene's
target around its up vector, in equal steps, and each view is rendered from cold. A first turn
warms up and does not count. Without --budget and --work each frame is rendered until it is final:
with adaptive shading until it equals per-pixel Phong shading.

Median and p99 are by nearest rank: the p99 of fewer than 100 frames is the longest. Times of
stages and numbers of triangles are means. The error is that of --error views, rendered once more
after all times have been taken; the Phong reference of one takes from a tenth of a second to many,
depending on its size and the number of lights.

Predictions are what the engine thought that a stage would take, given what it knew before: from them it
decides what fits into a budget. Their error is |predicted / measured - 1|, 'total' that of their sum.

Examples:
  The paper's experiment:
    specula bench scenes/teapot.ron --size 512x512 --method gouraud
  How often is a frame of 4 ms late, and what is its error?
    specula bench scenes/teapot.ron --budget 4 --repeat 5
  For a script:
    specula bench scenes/teapot.ron --method phong --error 0 --json | jq .frame_ms_median
  Find out once what work takes on this machine:
    specula bench scenes/teapot.ron --save-costs costs.ron
    specula animate scenes/turntable.ron -o turntable.apng --budget 4 --costs costs.ron")]
pub(super) struct Bench {
    /// Scene file (.ron), or a mesh (.obj), which gets a camera, lights and a material
    scene: PathBuf,

    /// Views around the scene
    #[arg(long, value_name = "N", default_value = "60", value_parser = limited_count)]
    views: u32,

    /// How to shade: flat, gouraud, phong, adaptive, phong-area, phong-tiles, phong-half, regular, highlight or hybrid
    #[arg(long, default_value_t)]
    method: Method,

    /// Wall-clock milliseconds for each frame; 0 buys the first, Gouraud-shaded image only
    #[arg(long, value_name = "MS", value_parser = milliseconds, allow_negative_numbers = true)]
    budget: Option<f64>,

    /// Work units (nominal nanoseconds of refinement) for each frame: the images do not depend on the machine
    #[arg(long, value_name = "UNITS", conflicts_with = "budget")]
    work: Option<u64>,

    /// How images store light, in codes of which errors are measured: srgb or linear
    #[arg(long, value_name = "NAME", default_value_t)]
    encoding: Encoding,

    /// How many turns to time; all frames count
    #[arg(long, value_name = "K", default_value = "1", value_parser = limited_count)]
    repeat: u32,

    /// How many of the views, evenly spaced, to compare with the Phong reference; 0 for none
    #[arg(long, value_name = "N", default_value = "4")]
    error: u32,

    /// Write what the engine has learned about the time that work takes, for --costs
    #[arg(long, value_name = "FILE")]
    save_costs: Option<PathBuf>,

    /// Print one JSON object
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    paper: Paper,

    #[command(flatten)]
    machine: Machine,
}

fn limited_count(text: &str) -> Result<u32, String> {
    match count(text) {
        Ok(count) if count <= MOST => Ok(count),
        _ => Err(format!("it must be a whole number from 1 to {MOST}")),
    }
}

pub(super) fn run(args: &Bench) -> Result<(), Failure> {
    if let Some(path) = &args.save_costs {
        png::check_writable(path)?;
    }
    let scene = Scene::load(&args.scene)?;
    let options = BenchOptions {
        width: args.machine.size.width,
        height: args.machine.size.height,
        method: args.method,
        paper: args.paper.rule(),
        budget: budget(args.budget, args.work),
        views: args.views,
        repeats: args.repeat,
        compared_views: args.error,
        backend: args.machine.backend,
        encoding: args.encoding,
        threads: args.machine.threads,
        simd: args.machine.simd,
        costs: args.machine.costs()?,
        ..BenchOptions::default()
    };
    let name = name_of(&args.scene);
    let steps = BenchPhase::ALL.map(|phase| options.steps(phase));
    let progress = Progress::new(steps.into_iter().sum());
    progress.measuring(format!("{name}: warming up"));
    let mut now = BenchPhase::WarmingUp;
    let mut done = 0;
    let report = bench(&name, &scene, &options, |phase| {
        progress.step();
        (now, done) = (phase, if phase == now { done + 1 } else { 1 });
        // The next frame is another phase's when this was the last one.
        if done == options.steps(now) {
            match now {
                BenchPhase::WarmingUp => progress.measuring(format!("{name}: timing")),
                _ => progress.doing(format!("{name}: comparing with Phong")),
            }
        }
    })?;
    drop(progress);
    Output::new().line(&if args.json {
        serde_json::to_string(&report)
            .map_err(|error| Failure::runtime(format!("cannot print the report: {error}")))?
    } else {
        text(&report)
    })?;
    if let Some(path) = &args.save_costs {
        costs::save(path, &report.costs)?;
        note(&format!("wrote {}", path.display()));
    }
    Ok(())
}

/// Errors of predictions in percent.
fn percents(errors: &PredictionErrors) -> String {
    let known = errors.entries().into_iter();
    list(known.filter_map(|(name, error)| Some(format!("{name} {:.1}", error? * 100.0))))
}

/// A block of lines.
fn text(report: &BenchReport) -> String {
    let r = report;
    let mut lines = vec![
        format!(
            "{}: {}, {}x{}, {} threads, {} views, {} lights, {} triangles",
            r.scene, r.method, r.width, r.height, r.threads, r.views, r.lights, r.triangles
        ),
        format!(
            "  frame      min {:.3}, median {:.3}, mean {:.3}, p99 {:.3}, max {:.3} ms",
            r.frame_ms_min, r.frame_ms_median, r.frame_ms_mean, r.frame_ms_p99, r.frame_ms_max
        ),
        format!(
            "  stages     {} ms (means)",
            list(
                r.stage_ms
                    .entries()
                    .map(|(name, ms)| format!("{name} {ms:.3}"))
            )
        ),
        format!(
            "  predicted  off by {} % (medians)",
            percents(&r.prediction_error_median)
        ),
        format!(
            "             off by {} % (p95)",
            percents(&r.prediction_error_p95)
        ),
        format!(
            "  triangles  {:.1} drawn, {:.1} visible, {:.1} subdivided (means)",
            r.triangles_drawn, r.triangles_visible, r.triangles_subdivided
        ),
        format!(
            "  highlights {:.1} visible PHTs, {:.0} pixels shaded by Phong (means)",
            r.pht_visible, r.phong_pixels
        ),
        format!("  converged  {} of {} frames", r.converged_frames, r.frames),
    ];
    if let (Some(budget), Some(late)) = (r.budget_ms, r.late_frames) {
        lines.push(format!(
            "  budget     {budget:.3} ms: {late} of {} frames late; overshoot median {:+.3}, p99 {:+.3}, max {:+.3} ms",
            r.frames,
            r.overshoot_ms_median.unwrap_or(0.0),
            r.overshoot_ms_p99.unwrap_or(0.0),
            r.overshoot_ms_max.unwrap_or(0.0)
        ));
    }
    if let Some(rmse) = r.rmse {
        let psnr = r
            .psnr_db
            .map_or("equal to Phong".to_owned(), |db| format!("psnr {db:.2} dB"));
        lines.push(format!(
            "  error      rmse {rmse:.3} codes, {psnr} ({} views compared)",
            r.compared_views
        ));
    }
    lines.join("\n")
}
