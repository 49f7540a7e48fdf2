//! `specula sweep`: error against time.

mod args;
mod axis;
mod chart;
mod charts;
mod report;
mod result;
mod style;

pub(super) use args::Sweep;

use super::Failure;
use super::args::name_of;
use super::console::{Output, Progress, note};
use super::machine::Facts;
use crate::cli::csv::Csv;
use charts::Charts;
use report::Report;
use result::SceneResult;
use serde_json::json;
use specula::measure::{self, Calibration, SweepBudget, SweepOptions};
use specula::output::png::check_writable;
use specula::output::save_whole;
use specula::scene::Scene;
use std::ops::ControlFlow;

pub(super) fn run(args: &Sweep) -> Result<(), Failure> {
    // All that can be wrong is found before a file is touched or a frame rendered.
    let scenes = args
        .scenes
        .iter()
        .map(|path| Ok((name_of(path), Scene::load(path)?)))
        .collect::<Result<Vec<_>, Failure>>()?;
    let options = args.options()?;
    if args.budgets.is_empty() && !can_shade_pixels(&options) {
        return Err(Failure::input(format!(
            "fractions are of the time of Phong shading, which the backend '{}' cannot do: give --budgets",
            options.backend
        )));
    }
    let names: Vec<&str> = scenes.iter().map(|(name, _)| name.as_str()).collect();
    let charts = args.svg.as_deref().map(|path| Charts::new(path, &names));
    let charts = charts.transpose()?;
    if let Some(path) = &args.json_file {
        check_writable(path)?;
    }
    if let Some(charts) = &charts {
        charts.prepare()?;
    }
    let mut job = Job {
        args,
        options,
        facts: Facts::new(&args.machine),
        report: Report {
            stdout: Output::new(),
            csv: args.csv.as_deref().map(Csv::create).transpose()?,
            json: args.json,
            scene_width: names
                .iter()
                .map(|name| name.chars().count())
                .fold("scene".len(), usize::max),
        },
        charts,
        results: Vec::new(),
    };
    job.run(&scenes)
}

fn can_shade_pixels(options: &SweepOptions) -> bool {
    options.backend.create().capabilities().per_pixel
}

/// A sweep of several scenes.
struct Job<'a> {
    args: &'a Sweep,
    options: SweepOptions,
    facts: Facts,
    report: Report,
    charts: Option<Charts>,
    /// Of the scenes that are done.
    results: Vec<SceneResult>,
}

impl Job<'_> {
    fn run(&mut self, scenes: &[(String, Scene)]) -> Result<(), Failure> {
        self.report
            .begin(&self.facts, self.args.frames, self.args.repeat)?;
        for (name, scene) in scenes {
            if let Some(result) = self.sweep_scene(name, scene)? {
                self.scene_done(result)?;
            }
            if !self.is_wanted() {
                return Ok(());
            }
        }
        self.report.areas(&self.results)
    }

    /// Whether anybody still takes the rows.
    fn is_wanted(&self) -> bool {
        self.report.stdout.is_open()
            || self.report.csv.is_some()
            || self.charts.is_some()
            || self.args.json_file.is_some()
    }

    /// Measures a scene; nothing comes of it when nobody takes the rows any more.
    fn sweep_scene(&mut self, name: &str, scene: &Scene) -> Result<Option<SceneResult>, Failure> {
        let preparing = Progress::new(0);
        preparing.doing(format!("{name}: rendering the Phong reference"));
        let mut sweep = measure::Sweep::new(name, scene, self.options.clone())?;
        let mut calibration = None;
        if can_shade_pixels(&self.options) {
            preparing.measuring(format!("{name}: measuring Gouraud and Phong frames"));
            calibration = Some(sweep.calibrate()?);
        }
        drop(preparing);
        if let Some(calibration) = &calibration {
            self.report.calibrated(name, calibration)?;
        }
        let budgets = self.budgets(name, calibration.as_ref());

        let progress = Progress::new(sweep.rows(budgets.len()));
        progress.measuring(name);
        let mut rows = Vec::new();
        let mut failure = None;
        sweep.run(&budgets, |row| {
            progress.step();
            let written = progress.suspend(|| self.report.row(&row));
            rows.push(row);
            match written {
                Ok(()) if self.is_wanted() => ControlFlow::Continue(()),
                Ok(()) => ControlFlow::Break(()),
                Err(error) => {
                    failure = Some(error);
                    ControlFlow::Break(())
                }
            }
        });
        if let Some(failure) = failure {
            return Err(failure);
        }
        if !self.is_wanted() {
            return Ok(None);
        }
        progress.measuring(format!("{name}: measuring Gouraud and Phong frames again"));
        let after = sweep.recalibrate();
        Ok(Some(SceneResult::new(name, calibration, after, rows)))
    }

    /// The budgets asked for. Fractions are of the times measured, which are there then.
    fn budgets(&self, name: &str, calibration: Option<&Calibration>) -> Vec<SweepBudget> {
        match calibration {
            Some(calibration) if self.args.budgets.is_empty() => {
                if calibration.phong_ms <= calibration.gouraud_ms {
                    note(&format!(
                        "{name}: Phong shading took no longer than Gouraud shading, so all fractions are the same budget"
                    ));
                }
                let fractions = self.args.fractions.iter();
                fractions.map(|&f| calibration.budget(f)).collect()
            }
            _ => {
                let budgets = self.args.budgets.iter();
                budgets.map(|&ms| SweepBudget::from_millis(ms)).collect()
            }
        }
    }

    /// Writes what can be written when a scene is done.
    fn scene_done(&mut self, result: SceneResult) -> Result<(), Failure> {
        if let Some(warning) = result.warning() {
            note(&format!("warning: {}: {warning}", result.scene));
        }
        self.report.scene_done(&result)?;
        if let Some(charts) = &self.charts {
            charts.save(&result, &self.facts, self.args.repeat)?;
        }
        self.results.push(result);
        if let Some(path) = &self.args.json_file {
            let document = json!({
                "machine": self.facts,
                "encoding": self.args.encoding.to_string(),
                "frames": self.args.frames,
                "repeats": self.args.repeat,
                "scenes": self.results,
            });
            save_whole(path, format!("{document:#}\n"))?;
        }
        Ok(())
    }
}
