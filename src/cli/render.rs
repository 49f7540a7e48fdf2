//! `specula render`: frames of a still view under a budget.

use super::args::Render;
use super::console::{Output, Progress, note};
use super::{Failure, animate};
use serde_json::{Map, Value, json};
use specula::frame::{Engine, EngineOptions, FrameStats, StageTimes};
use specula::measure::{ErrorReport, ReferenceImage};
use specula::output::{Frame, png};
use specula::scene::Scene;
use specula::schedule::Budget;
use std::path::Path;

pub(super) fn run(args: &Render) -> Result<(), Failure> {
    require_png(&args.output)?;
    png::check_writable(&args.output)?;
    let mut scene = Scene::load(&args.scene)?;
    if let Some(seconds) = args.time {
        animate::go_to_time(&mut scene, seconds);
    }
    let options = EngineOptions {
        method: args.method,
        backend: args.machine.backend,
        threads: args.machine.threads,
        simd: args.machine.simd,
        ..EngineOptions::default()
    };
    let size = args.machine.size;
    let mut engine = Engine::with_options(&scene, options)?;
    let mut frame = Frame::new(size.width, size.height);
    let budget = match (args.budget, args.work) {
        (Some(ms), _) => Budget::from_millis(ms),
        (None, Some(units)) => Budget::Work(units),
        (None, None) => Budget::Unlimited,
    };

    let mut output = Output::new();
    for number in 1..=args.frames {
        let stats = engine.render(&scene, budget, &mut frame);
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
    note(&format!(
        "wrote {} ({}x{})",
        args.output.display(),
        size.width,
        size.height
    ));
    Ok(())
}

/// Other names would promise other formats.
pub(super) fn require_png(path: &Path) -> Result<(), Failure> {
    let is_png = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
    if is_png {
        Ok(())
    } else {
        Err(Failure::input(format!(
            "the output must be a .png file, which '{}' is not",
            path.display()
        )))
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
    let view = world.view(scene.camera(), frame.width(), frame.height());
    let reference = ReferenceImage::render(world, &view, args.machine.thread_count());
    ErrorReport::compare(frame, &reference).map_err(|error| Failure::runtime(error.to_string()))
}

/// What a counter of skipped things is called on the screen.
pub(super) fn label(name: &str) -> String {
    match name {
        "triangles_off_screen" => "triangles off screen or between pixels".to_owned(),
        _ => name.replace('_', " "),
    }
}

/// What is printed of a frame.
#[derive(Debug)]
struct FrameReport {
    /// Counted from 1.
    number: u32,
    stats: FrameStats,
    /// The difference from the reference, if it was asked for.
    error: Option<ErrorReport>,
}

/// The statistics of a frame as one object; what it does not have is null.
pub(super) fn frame_json(number: u32, stats: &FrameStats) -> Value {
    let (budget_ms, budget_work) = match stats.budget {
        Budget::Millis(ms) => (Some(ms), None),
        Budget::Work(units) => (None, Some(units)),
        Budget::Unlimited => (None, None),
    };
    let stages: Map<String, Value> = stages(&stats.stage_ms)
        .into_iter()
        .map(|(name, ms)| (name.to_owned(), json!(ms)))
        .collect();
    let skipped: Map<String, Value> = stats
        .skipped
        .entries()
        .into_iter()
        .map(|(name, count)| (name.to_owned(), json!(count)))
        .collect();
    json!({
        "frame": number,
        "frame_ms": stats.frame_ms,
        "budget_ms": budget_ms,
        "budget_work": budget_work,
        "overshoot_ms": stats.overshoot_ms(),
        "outcome": stats.outcome.name(),
        "converged": stats.converged,
        "estimated_error": stats.estimated_error,
        "triangles": stats.triangles,
        "triangles_drawn": stats.triangles_drawn,
        "triangles_visible": stats.triangles_visible,
        "pht": stats.pht,
        "pht_visible": stats.pht_visible,
        "refined": stats.refined,
        "triangles_subdivided": stats.triangles_subdivided,
        "leaves": stats.leaves,
        "phong_pixels": stats.phong_pixels,
        "work_units": stats.work_units,
        "pixels_written": stats.pixels_written,
        "stage_ms": stages,
        "skipped": skipped,
    })
}

impl FrameReport {
    /// One object.
    fn json(&self) -> Value {
        let mut object = frame_json(self.number, &self.stats);
        if let (Some(error), Some(object)) = (self.error, object.as_object_mut()) {
            object.insert("error".to_owned(), json!(error));
        }
        object
    }

    /// A block of lines.
    fn text(&self) -> String {
        let stats = &self.stats;
        let mut lines = vec![
            self.headline(),
            format!(
                "  stages     {}",
                list(stages(&stats.stage_ms).map(|(name, ms)| format!("{name} {ms:.2}"))) + " ms"
            ),
            format!(
                "  triangles  {} in the scene, {} drawn, {} visible, {} subdivided; {} leaves open",
                stats.triangles,
                stats.triangles_drawn,
                stats.triangles_visible,
                stats.triangles_subdivided,
                stats.leaves
            ),
            format!(
                "  highlights {} PHTs found, {} visible, {} refined; {} pixels shaded by Phong",
                stats.pht, stats.pht_visible, stats.refined, stats.phong_pixels
            ),
            format!("  skipped    {}", self.skipped()),
        ];
        if stats.estimated_error.is_finite() {
            lines.push(format!(
                "  error      about {:.2} codes (estimate)",
                stats.estimated_error
            ));
        }
        if let Some(error) = &self.error {
            lines.push(measured(error));
        }
        lines.join("\n")
    }

    fn headline(&self) -> String {
        let stats = &self.stats;
        let budget = match stats.budget {
            Budget::Millis(ms) => {
                let late = stats.frame_ms - ms;
                let verdict = if late > 0.0 {
                    format!("{late:.2} ms late")
                } else {
                    "in time".to_owned()
                };
                format!(", budget {ms:.2} ms: {verdict}")
            }
            Budget::Work(units) => format!(", {} of {units} work units", stats.work_units),
            Budget::Unlimited => String::new(),
        };
        let converged = if stats.converged { ", converged" } else { "" };
        format!(
            "frame {}: {} in {:.2} ms{budget}{converged}",
            self.number,
            stats.outcome.name().replace('_', " "),
            stats.frame_ms
        )
    }

    /// The counters that are not zero.
    fn skipped(&self) -> String {
        let counted = self
            .stats
            .skipped
            .entries()
            .into_iter()
            .filter(|&(_, count)| count > 0)
            .map(|(name, count)| format!("{} {count}", label(name)));
        let text = list(counted);
        if text.is_empty() {
            "nothing".to_owned()
        } else {
            text
        }
    }
}

/// Names and milliseconds of the stages.
fn stages(stages: &StageTimes) -> [(&'static str, f64); 6] {
    let StageTimes {
        cull,
        shade,
        classify,
        raster,
        refine,
        resolve,
    } = *stages;
    [
        ("cull", cull),
        ("shade", shade),
        ("classify", classify),
        ("raster", raster),
        ("refine", refine),
        ("resolve", resolve),
    ]
}

/// The line about a comparison with the reference.
fn measured(error: &ErrorReport) -> String {
    let psnr = if error.psnr_db.is_finite() {
        format!("psnr {:.2} dB", error.psnr_db)
    } else {
        "equal to the reference".to_owned()
    };
    format!(
        "  measured   rmse {:.3} codes, {psnr}, max {}, p99 {}, {:.2} % of {} pixels off by more than 1 code, \
         {:.2} % by more than 4, {} pixels left out",
        error.rmse,
        error.max,
        error.p99,
        error.share_above_1 * 100.0,
        error.covered_pixels,
        error.share_above_4 * 100.0,
        error.excluded_pixels
    )
}

pub(super) fn list(items: impl IntoIterator<Item = String>) -> String {
    items.into_iter().collect::<Vec<_>>().join(", ")
}
