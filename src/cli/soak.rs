//! `specula soak`: does the engine keep its deadlines?

use super::Failure;
use super::args::{Machine, count, name_of};
use super::console::{Output, Progress};
use super::csv::Csv;
use super::machine::cpu_model;
use super::report::list;
use clap::Args;
use serde_json::json;
use specula::measure::soak::{LateFrames, OvershootMs, SoakCalibration};
use specula::measure::{self, SoakOptions, SoakRow, SoakSummary};
use specula::scene::Scene;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// What is soaked if no scene is given: cost in vertices, in lights, and in pixels.
const SHIPPED: [(&str, &str); 3] = [
    ("walls", include_str!("../../scenes/walls.ron")),
    ("lights16", include_str!("../../scenes/lights16.ron")),
    ("closeup", include_str!("../../scenes/closeup.ron")),
];

/// Most frames: more than a day's, and few enough to keep all rows.
const MOST_FRAMES: u32 = 10_000_000;

/// `specula soak`.
#[derive(Debug, Args)]
#[command(after_help = "\
The camera moves a tenth of a degree between frames, so that every frame is a new view. Budgets come
in shuffled rounds of twelve: G + F (P - G) for F of 0.1, 0.2, 0.4, 0.6, 0.8 and 1, with G and P the
times of Gouraud and Phong frames, measured first; and 1, 2, 4, 8, 16 and 33 ms. Just before or just
after each frame a null engine, as many threads that only look at the clock, has the same budget:
what it overshoots, the machine does.

Targets: p50, p95 and p99 of overshoot at most the null engine's and 0.02 ms, p99.9 at most the null
engine's and 0.1 ms; 0.9 of the work units that a frame without a clock does in the same time. Budgets
shorter than a first image are reported apart from the others.

Results of a scene are printed as soon as it is done; --csv keeps each frame as soon as it is.

Examples:
  Twenty thousand frames of three shipped scenes, about six minutes:
    specula soak
  A shorter one of your own:
    specula soak my.ron --frames 3000 --csv soak.csv")]
pub(super) struct Soak {
    /// Scene files (.ron) or meshes (.obj); if there are none, the shipped walls, lights16 and closeup
    #[arg(value_name = "SCENE")]
    scenes: Vec<PathBuf>,

    /// Frames of all scenes together
    #[arg(long, value_name = "N", default_value = "20000", value_parser = frames)]
    frames: u32,

    /// Compare the work done at one in N frames; 0 for none
    #[arg(long, value_name = "N", default_value = "50")]
    work_every: u32,

    /// Also write all frames to a CSV file, each as soon as it is measured
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// Print one JSON object per scene, and one of all
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    machine: Machine,
}

fn frames(text: &str) -> Result<u32, String> {
    match count(text) {
        Ok(count) if count <= MOST_FRAMES => Ok(count),
        _ => Err(format!("it must be a whole number from 1 to {MOST_FRAMES}")),
    }
}

impl Soak {
    fn scenes(&self) -> Result<Vec<(String, Scene)>, Failure> {
        if self.scenes.is_empty() {
            let parse = |(name, text): (&str, &str)| {
                Ok((name.to_owned(), Scene::parse(text, &format!("{name}.ron"))?))
            };
            return SHIPPED.into_iter().map(parse).collect();
        }
        self.scenes
            .iter()
            .map(|path| Ok((name_of(path), Scene::load(path)?)))
            .collect()
    }

    fn options(&self) -> SoakOptions {
        SoakOptions {
            width: self.machine.size.width,
            height: self.machine.size.height,
            work_every: self.work_every,
            threads: self.machine.threads,
            backend: self.machine.backend,
            simd: self.machine.simd,
            ..SoakOptions::default()
        }
    }
}

pub(super) fn run(args: &Soak) -> Result<(), Failure> {
    // All that can be wrong is found before a file is touched or a frame rendered.
    let scenes = args.scenes()?;
    let options = args.options();
    let mut report = Report {
        stdout: Output::new(),
        csv: args.csv.as_deref().map(Csv::create).transpose()?,
        json: args.json,
        rows: Vec::new(),
    };
    report.begin(args)?;
    let progress = Progress::new(u64::from(args.frames));
    let mut left = u64::from(args.frames);
    for (index, (name, scene)) in scenes.iter().enumerate() {
        let share = left / (scenes.len() - index) as u64;
        left -= share;
        progress.measuring(format!("{name}: measuring what budgets are made from"));
        let mut soak = measure::Soak::new(name, scene, options.clone())?;
        progress.measuring(name);
        let first = report.rows.len();
        let mut failure = None;
        soak.run(share, |row| {
            progress.step();
            match report.row(row) {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    failure = Some(error);
                    ControlFlow::Break(())
                }
            }
        });
        if let Some(failure) = failure {
            return Err(failure);
        }
        progress.suspend(|| report.sum(name, Some(soak.calibration()), first))?;
        if !report.is_wanted() {
            return Ok(());
        }
    }
    drop(progress);
    if scenes.len() > 1 {
        report.sum("all scenes", None, 0)?;
    }
    Ok(())
}

/// Where results go.
#[derive(Debug)]
struct Report {
    stdout: Output,
    csv: Option<Csv>,
    json: bool,
    rows: Vec<SoakRow>,
}

impl Report {
    /// Whether anybody still takes results.
    fn is_wanted(&self) -> bool {
        self.stdout.is_open() || self.csv.is_some()
    }

    /// Writes what comes before all rows.
    fn begin(&mut self, args: &Soak) -> Result<(), Failure> {
        let Some(csv) = &mut self.csv else {
            return Ok(());
        };
        csv.line(&format!("# specula {} soak", env!("CARGO_PKG_VERSION")))?;
        csv.line(&format!("# cpu: {}", cpu_model()))?;
        csv.line(&format!(
            "# threads: {}, simd: {}, size: {}x{}",
            args.machine.thread_count(),
            args.machine.simd_level(),
            args.machine.size.width,
            args.machine.size.height,
        ))?;
        csv.line(&SoakRow::csv_header())
    }

    fn row(&mut self, row: SoakRow) -> Result<(), Failure> {
        if let Some(csv) = &mut self.csv {
            csv.line(&row.to_csv())?;
        }
        self.rows.push(row);
        Ok(())
    }

    /// Prints what the rows from `first` on come to.
    fn sum(
        &mut self,
        name: &str,
        calibration: Option<&SoakCalibration>,
        first: usize,
    ) -> Result<(), Failure> {
        let rows = &self.rows[first..];
        let fitting = SoakSummary::of(rows.iter().filter(|row| !row.is_tight));
        let tight = SoakSummary::of(rows.iter().filter(|row| row.is_tight));
        let all = SoakSummary::of(rows);
        let text = if self.json {
            json!({
                "scene": name,
                "calibration": calibration,
                "all": all,
                "fitting": fitting,
                "tight": tight,
            })
            .to_string()
        } else {
            let mut lines = vec![headline(name, calibration)];
            for (what, summary) in [
                ("budgets that the first image fits in", fitting),
                ("tight budgets", tight),
                ("all budgets", all),
            ] {
                if let Some(summary) = summary {
                    lines.push(block(what, &summary));
                }
            }
            lines.join("\n")
        };
        self.stdout.line(&text)
    }
}

fn headline(name: &str, calibration: Option<&SoakCalibration>) -> String {
    calibration.map_or_else(
        || format!("{name}:"),
        |c| {
            format!(
                "{name}: Gouraud {:.3} ms, Phong {:.3} ms, first image {:.3} ms (medians)",
                c.gouraud_ms, c.phong_ms, c.first_image_ms
            )
        },
    )
}

/// A block of lines about a number of frames.
fn block(what: &str, summary: &SoakSummary) -> String {
    let frames = &summary.frames;
    let share = |count: u64| 100.0 * count as f64 / frames.frames as f64;
    let mut lines = vec![
        format!(
            "  {what}: {} frames, {:.2} % late ({:.2} % of the null engine's)",
            frames.frames,
            share(frames.late),
            share(summary.null_late),
        ),
        "    overshoot        p50       p95       p99     p99.9       max  (ms)".to_owned(),
        overshoot("ours", &summary.overshoot_ms),
        overshoot("null", &summary.null_overshoot_ms),
        overshoot("excess", &summary.excess_ms),
    ];
    if let Some(work) = &summary.work {
        lines.push(format!(
            "    work       {:.3} of what a frame without a clock does in the same time ({} frames)",
            work.share, work.frames
        ));
    }
    let verdicts = summary.verdicts.entries().into_iter();
    let verdicts = verdicts.filter_map(|(name, is_met)| {
        is_met.map(|is_met| format!("{name} {}", if is_met { "met" } else { "MISSED" }))
    });
    lines.push(format!("    targets    {}", list(verdicts)));
    let outcome = |(name, counts): (&&str, &LateFrames)| {
        format!("{name} {} ({} late)", counts.frames, counts.late)
    };
    lines.push(format!(
        "    outcomes   {}",
        list(summary.outcomes.iter().map(outcome))
    ));
    if !summary.late_in.is_empty() {
        let stages = summary.late_in.iter();
        let stages = list(stages.map(|(name, count)| format!("{name} {count}")));
        lines.push(format!("    late, by longest stage: {stages}"));
    }
    lines.join("\n")
}

fn overshoot(name: &str, o: &OvershootMs) -> String {
    format!(
        "    {name:<10} {:>+9.3} {:>+9.3} {:>+9.3} {:>+9.3} {:>+9.3}",
        o.p50, o.p95, o.p99, o.p99_9, o.max
    )
}
