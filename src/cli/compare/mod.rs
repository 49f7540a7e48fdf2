//! `specula compare`: every method at the same time, side by side.

mod args;
mod canvas;
mod heat;
mod sheet;
mod thumbnail;

pub(super) use args::Compare;

use super::Failure;
use super::args::{name_of, require_png};
use super::console::{Output, Progress, note};
use super::machine::Facts;
use super::report::noise_warning;
use serde_json::json;
use sheet::{Cell, Sheet};
use specula::measure::{
    self, Calibration, Noise, ReferenceImage, SweepBudget, SweepRow, error_map,
};
use specula::output::Frame;
use specula::output::png::check_writable;
use specula::scene::Scene;

pub(super) fn run(args: &Compare) -> Result<(), Failure> {
    require_png(&args.output)?;
    let scene = Scene::load(&args.scene)?;
    let options = args.options()?;
    let can_calibrate = options.backend.create().capabilities().per_pixel;
    if args.budget.is_none() && !can_calibrate {
        return Err(Failure::input(format!(
            "the time of Phong shading, which the backend '{}' cannot do, is not known: give --budget",
            options.backend
        )));
    }
    check_writable(&args.output)?;

    let name = name_of(&args.scene);
    let preparing = Progress::new(0);
    preparing.doing(format!("{name}: rendering the Phong reference"));
    let methods = options.methods.len();
    let mut sweep = measure::Sweep::new(&name, &scene, options)?;
    preparing.measuring(format!("{name}: measuring Gouraud and Phong frames"));
    let (calibration, budget) = match args.budget {
        Some(ms) => (None, SweepBudget::from_millis(ms)),
        None => {
            let calibration = sweep.calibrate()?;
            (Some(calibration), calibration.budget(args.fraction))
        }
    };
    drop(preparing);
    let progress = Progress::new(methods as u64);
    progress.measuring(&name);
    let mut images = Vec::new();
    sweep.run_with_images(budget, |row, frame| {
        progress.step();
        images.push((row, frame));
    });
    let noise = (calibration.as_ref().zip(sweep.recalibrate()))
        .map(|(before, after)| Noise::between(before, &after));
    drop(progress);

    if let Some(warning) = noise.as_ref().and_then(noise_warning) {
        note(&format!("warning: {name}: {warning}"));
    }
    let comparison = Comparison {
        name,
        facts: Facts::new(&args.machine),
        budget,
        calibration,
        noise,
        images,
    };
    comparison.save_sheet(args, sweep.reference())?;
    comparison.print(args.json)?;
    note(&format!("wrote {}", args.output.display()));
    Ok(())
}

/// All that was measured.
struct Comparison {
    name: String,
    facts: Facts,
    budget: SweepBudget,
    /// `None` if the budget was given in milliseconds.
    calibration: Option<Calibration>,
    noise: Option<Noise>,
    /// Of each method.
    images: Vec<(SweepRow, Frame)>,
}

impl Comparison {
    fn save_sheet(&self, args: &Compare, reference: &ReferenceImage) -> Result<(), Failure> {
        let cells = self.images.iter().map(|(row, frame)| {
            let errors =
                error_map(frame, reference).map_err(|e| Failure::runtime(e.to_string()))?;
            Ok(Cell { row, frame, errors })
        });
        let sheet = Sheet {
            title: &self.name,
            reference,
            cells: cells.collect::<Result<_, Failure>>()?,
            budget: self.budget,
            calibration: self.calibration.as_ref(),
            facts: &self.facts,
            warning: self.noise.as_ref().and_then(noise_warning),
        };
        Ok(sheet.draw().save_png(&args.output)?)
    }

    fn print(&self, as_json: bool) -> Result<(), Failure> {
        let mut output = Output::new();
        let rows: Vec<&SweepRow> = self.images.iter().map(|(row, _)| row).collect();
        if as_json {
            let object = json!({
                "scene": self.name,
                "machine": self.facts,
                "budget_ms": self.budget.millis,
                "fraction": self.budget.fraction,
                "calibration": self.calibration,
                "noise": self.noise,
                "too_noisy": self.noise.is_some_and(|noise| noise.is_too_much()),
                "methods": rows,
            });
            return output.line(&object.to_string());
        }
        output.line(&format!("budget {:.3} ms", self.budget.millis))?;
        output.line(&format!(
            "{:<11} {:>9} {:>12} {:>8} {:>7} {:>4} {:>4}",
            "method", "frame_ms", "overshoot_ms", "rmse", "psnr_db", "max", "p99"
        ))?;
        for row in rows {
            let error = &row.error;
            let psnr = if error.psnr_db.is_finite() {
                format!("{:.2}", error.psnr_db)
            } else {
                "equal".to_owned()
            };
            output.line(&format!(
                "{:<11} {:>9.3} {:>+12.3} {:>8.3} {psnr:>7} {:>4} {:>4}",
                row.method, row.frame_ms, row.overshoot_ms, error.rmse, error.max, error.p99
            ))?;
        }
        Ok(())
    }
}
