//! `specula sweep`: error against time.

use super::Failure;
use super::args::{Machine, count, milliseconds, name_of, not_negative};
use super::console::{Output, Progress, note};
use super::machine::cpu_model;
use clap::Args;
use specula::Method;
use specula::measure::{self, Calibration, SweepBudget, SweepOptions, SweepRow};
use specula::output::Encoding;
use specula::output::png::plain_reason;
use specula::scene::Scene;
use std::fs::File;
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// `specula sweep`.
#[derive(Debug, Args)]
#[command(after_help = "\
G and P are the medians of 30 Gouraud-shaded and 30 Phong-shaded frames, measured first. A budget of
fraction F is G + F (P - G) milliseconds: 0 buys Gouraud shading, 1 Phong shading of every pixel.

Examples:
  All methods at the default fractions:
    specula sweep scenes/teapot.ron --methods all
  Medians of five at two budgets, also as CSV:
    specula sweep scenes/*.ron --budgets 2,8 --repeat 5 --csv sweep.csv
  How an image gets better from frame to frame:
    specula sweep scenes/teapot.ron --methods adaptive --fractions 0.1 --frames 20")]
pub(super) struct Sweep {
    /// Scene files (.ron) or meshes (.obj)
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,

    /// Methods, separated by commas: flat, gouraud, phong, adaptive, phong-area, or all
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "adaptive,phong-area",
        value_parser = method_or_all
    )]
    methods: Vec<MethodOrAll>,

    /// How images store light, in codes of which errors are measured: srgb or linear
    #[arg(long, value_name = "NAME", default_value_t)]
    encoding: Encoding,

    /// Budgets in milliseconds, separated by commas
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        value_parser = milliseconds,
        allow_negative_numbers = true
    )]
    budgets: Vec<f64>,

    /// Budgets as fractions of the way from Gouraud to Phong shading, separated by commas
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "0,0.05,0.1,0.2,0.4,0.8,1",
        value_parser = fraction,
        allow_negative_numbers = true,
        conflicts_with = "budgets"
    )]
    fractions: Vec<f64>,

    /// Consecutive frames of the view at each budget
    #[arg(long, value_name = "N", default_value = "1", value_parser = count)]
    frames: u32,

    /// How often to measure each row; the one with the median frame time is kept
    #[arg(long, value_name = "K", default_value = "1", value_parser = count)]
    repeat: u32,

    /// Also write the rows to a CSV file, each as soon as it is measured
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// Print one JSON object per row
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    machine: Machine,
}

impl Sweep {
    /// The methods asked for, each once, in the order given.
    fn methods(&self) -> Vec<Method> {
        let mut methods = Vec::new();
        for item in &self.methods {
            let named = match item {
                MethodOrAll::All => &Method::ALL[..],
                MethodOrAll::One(method) => std::slice::from_ref(method),
            };
            for &method in named {
                if !methods.contains(&method) {
                    methods.push(method);
                }
            }
        }
        methods
    }
}

#[derive(Clone, Copy, Debug)]
enum MethodOrAll {
    All,
    One(Method),
}

fn method_or_all(text: &str) -> Result<MethodOrAll, String> {
    match text {
        "all" => Ok(MethodOrAll::All),
        _ => text.parse().map(MethodOrAll::One),
    }
}

fn fraction(text: &str) -> Result<f64, String> {
    not_negative(text).ok_or_else(|| "a fraction is a number, 0 or more".to_owned())
}

pub(super) fn run(args: &Sweep) -> Result<(), Failure> {
    // All that can be wrong is found before a file is touched or a frame rendered.
    let scenes = args
        .scenes
        .iter()
        .map(|path| Ok((name_of(path), Scene::load(path)?)))
        .collect::<Result<Vec<_>, Failure>>()?;
    let options = SweepOptions {
        width: args.machine.size.width,
        height: args.machine.size.height,
        methods: args.methods(),
        frames: args.frames,
        repeats: args.repeat,
        threads: args.machine.threads,
        backend: args.machine.backend,
        encoding: args.encoding,
        simd: args.machine.simd,
        ..SweepOptions::default()
    };
    let can_shade_pixels = options.backend.create().capabilities().per_pixel;
    if args.budgets.is_empty() && !can_shade_pixels {
        return Err(Failure::input(format!(
            "fractions are of the time of Phong shading, which the backend '{}' cannot do: give --budgets",
            options.backend
        )));
    }
    let mut report = Report {
        stdout: Output::new(),
        csv: args.csv.as_deref().map(Csv::create).transpose()?,
        json: args.json,
        scene_width: scenes
            .iter()
            .map(|(name, _)| name.chars().count())
            .fold("scene".len(), usize::max),
    };
    report.begin(args)?;
    for (name, scene) in &scenes {
        sweep_scene(name, scene, &options, args, &mut report)?;
        if !report.is_wanted() {
            break;
        }
    }
    Ok(())
}

fn sweep_scene(
    name: &str,
    scene: &Scene,
    options: &SweepOptions,
    args: &Sweep,
    report: &mut Report,
) -> Result<(), Failure> {
    let preparing = Progress::new(0);
    preparing.doing(format!("{name}: rendering the Phong reference"));
    let mut sweep = measure::Sweep::new(name, scene, options.clone())?;
    let budgets: Vec<SweepBudget> = if args.budgets.is_empty() {
        preparing.measuring(format!("{name}: measuring Gouraud and Phong frames"));
        let calibration = sweep.calibrate()?;
        drop(preparing);
        report.calibrated(name, &calibration, options.calibration_frames)?;
        if calibration.phong_ms <= calibration.gouraud_ms {
            note(&format!(
                "{name}: Phong shading took no longer than Gouraud shading, so all fractions are the same budget"
            ));
        }
        let fractions = args.fractions.iter();
        fractions.map(|&f| calibration.budget(f)).collect()
    } else {
        drop(preparing);
        args.budgets
            .iter()
            .map(|&ms| SweepBudget::from_millis(ms))
            .collect()
    };

    let progress = Progress::new(sweep.rows(budgets.len()));
    progress.measuring(name);
    let mut failure = None;
    sweep.run(&budgets, |row| {
        progress.step();
        match progress.suspend(|| report.row(&row)) {
            Ok(()) if report.is_wanted() => ControlFlow::Continue(()),
            Ok(()) => ControlFlow::Break(()),
            Err(error) => {
                failure = Some(error);
                ControlFlow::Break(())
            }
        }
    });
    failure.map_or(Ok(()), Err)
}

/// Where rows go.
#[derive(Debug)]
struct Report {
    stdout: Output,
    csv: Option<Csv>,
    json: bool,
    /// Width of the table's first column.
    scene_width: usize,
}

impl Report {
    /// Whether anybody still takes the rows.
    fn is_wanted(&self) -> bool {
        self.stdout.is_open() || self.csv.is_some()
    }

    /// Writes what comes before all rows.
    fn begin(&mut self, args: &Sweep) -> Result<(), Failure> {
        if let Some(csv) = &mut self.csv {
            csv.line(&format!("# specula {} sweep", env!("CARGO_PKG_VERSION")))?;
            csv.line(&format!("# cpu: {}", cpu_model()))?;
            csv.line(&format!(
                "# threads: {}, simd: {}, size: {}x{}, frames: {}, repeats: {}",
                args.machine.thread_count(),
                args.machine.simd_level(),
                args.machine.size.width,
                args.machine.size.height,
                args.frames,
                args.repeat
            ))?;
            csv.line(SweepRow::CSV_HEADER)?;
        }
        if !self.json {
            let header = format!(
                "{:<width$}  {:<10} {:>9} {:>5} {:>9} {:>12} {:>8} {:>7} {:>4} {:>4} {:>10}  converged",
                "scene",
                "method",
                "budget_ms",
                "frame",
                "frame_ms",
                "overshoot_ms",
                "rmse",
                "psnr_db",
                "max",
                "p99",
                "subdivided",
                width = self.scene_width
            );
            self.stdout.line(&header)?;
        }
        Ok(())
    }

    /// Notes the times by which a scene's budgets are scaled.
    fn calibrated(
        &mut self,
        name: &str,
        calibration: &Calibration,
        frames: u32,
    ) -> Result<(), Failure> {
        let text = format!(
            "# {name}: Gouraud {:.3} ms, Phong {:.3} ms (medians of {frames} alternating frames)",
            calibration.gouraud_ms, calibration.phong_ms
        );
        if let Some(csv) = &mut self.csv {
            csv.line(&text.replace(['\n', '\r'], " "))?;
        }
        if !self.json {
            self.stdout.line(&text)?;
        }
        Ok(())
    }

    fn row(&mut self, row: &SweepRow) -> Result<(), Failure> {
        if let Some(csv) = &mut self.csv {
            csv.line(&row.to_csv())?;
        }
        if self.json {
            let json = serde_json::to_string(row)
                .map_err(|error| Failure::runtime(format!("cannot print a row: {error}")))?;
            return self.stdout.line(&json);
        }
        let error = &row.error;
        let psnr = if error.psnr_db.is_finite() {
            format!("{:.2}", error.psnr_db)
        } else {
            "equal".to_owned()
        };
        self.stdout.line(&format!(
            "{:<width$}  {:<10} {:>9.3} {:>5} {:>9.3} {:>+12.3} {:>8.3} {psnr:>7} {:>4} {:>4} {:>10}  {}",
            row.scene,
            row.method,
            row.budget_ms,
            row.frame,
            row.frame_ms,
            row.overshoot_ms,
            error.rmse,
            error.max,
            error.p99,
            row.triangles_subdivided,
            if row.converged { "yes" } else { "no" },
            width = self.scene_width
        ))
    }
}

/// A file of comma-separated values that is complete up to the last row measured, whatever happens next.
#[derive(Debug)]
struct Csv {
    path: PathBuf,
    file: File,
}

impl Csv {
    fn create(path: &Path) -> Result<Self, Failure> {
        match File::create(path) {
            Ok(file) => Ok(Self {
                path: path.to_owned(),
                file,
            }),
            Err(error) => Err(cannot_write(path, &error)),
        }
    }

    fn line(&mut self, text: &str) -> Result<(), Failure> {
        // One unbuffered write for each line: nothing to flush.
        self.file
            .write_all(format!("{text}\n").as_bytes())
            .map_err(|error| cannot_write(&self.path, &error))
    }
}

fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    Failure::runtime(format!(
        "cannot write {}: {}",
        path.display(),
        plain_reason(error)
    ))
}
