//! Where a sweep's rows go as they are measured: a table or JSON on standard output, and a file of comma-separated values.

use super::result::{SceneResult, calibration_line};
use crate::cli::Failure;
use crate::cli::console::Output;
use crate::cli::csv::Csv;
use crate::cli::machine::Facts;
use specula::measure::{Calibration, SweepRow};

/// Standard output and the CSV file.
#[derive(Debug)]
pub(super) struct Report {
    pub(super) stdout: Output,
    pub(super) csv: Option<Csv>,
    /// Whether standard output gets JSON, and nothing but rows.
    pub(super) json: bool,
    /// Width of the table's first column.
    pub(super) scene_width: usize,
}

impl Report {
    /// Writes what comes before all rows.
    pub(super) fn begin(
        &mut self,
        facts: &Facts,
        frames: u32,
        repeats: u32,
    ) -> Result<(), Failure> {
        if let Some(csv) = &mut self.csv {
            csv.line(&format!("# specula {} sweep", facts.specula))?;
            csv.line(&format!("# date: {}", facts.date))?;
            csv.line(&format!("# cpu: {}", facts.cpu))?;
            csv.line(&format!(
                "# threads: {}, simd: {}, backend: {}, size: {}x{}, frames: {frames}, repeats: {repeats}",
                facts.threads, facts.simd, facts.backend, facts.width, facts.height,
            ))?;
            csv.line(SweepRow::CSV_HEADER)?;
        }
        if !self.json {
            let header = format!(
                "{:<width$}  {:<11} {:>9} {:>5} {:>9} {:>12} {:>8} {:>7} {:>4} {:>4} {:>10}  converged",
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

    /// A line that is neither a row nor a header.
    fn comment(&mut self, text: &str) -> Result<(), Failure> {
        let line = format!("# {}", text.replace(['\n', '\r'], " "));
        if let Some(csv) = &mut self.csv {
            csv.line(&line)?;
        }
        if !self.json {
            self.stdout.line(&line)?;
        }
        Ok(())
    }

    /// Notes the times by which a scene's budgets are scaled.
    pub(super) fn calibrated(
        &mut self,
        name: &str,
        calibration: &Calibration,
    ) -> Result<(), Failure> {
        self.comment(&format!("{name}: {}", calibration_line(calibration)))
    }

    pub(super) fn row(&mut self, row: &SweepRow) -> Result<(), Failure> {
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
            "{:<width$}  {:<11} {:>9.3} {:>5} {:>9.3} {:>+12.3} {:>8.3} {psnr:>7} {:>4} {:>4} {:>10}  {}",
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

    /// Notes what is known of a scene only after its rows.
    pub(super) fn scene_done(&mut self, result: &SceneResult) -> Result<(), Failure> {
        let name = &result.scene;
        if let Some(after) = &result.calibration_after {
            let line = calibration_line(after);
            self.comment(&format!("{name}, during and after: {line}"))?;
        }
        if let Some(warning) = result.warning() {
            self.comment(&format!("{name}: {warning}"))?;
        }
        for area in &result.areas {
            if let Some(csv) = &mut self.csv {
                csv.line(&format!(
                    "# {}: area {} {:.4} codes",
                    name.replace(['\n', '\r'], " "),
                    area.method,
                    area.area_codes
                ))?;
            }
        }
        Ok(())
    }

    /// Prints the areas under all curves, a line for each scene.
    pub(super) fn areas(&mut self, results: &[SceneResult]) -> Result<(), Failure> {
        if self.json || results.iter().all(|result| result.areas.is_empty()) {
            return Ok(());
        }
        let mut methods: Vec<&str> = Vec::new();
        for area in results.iter().flat_map(|result| &result.areas) {
            if !methods.contains(&area.method) {
                methods.push(area.method);
            }
        }
        let width = self.scene_width;
        self.stdout.line(
            "\nAreas under the curves of error against time, from Gouraud's time to Phong's: mean RMSE in codes.",
        )?;
        let mut header = format!("{:<width$} {:>9} {:>9}", "scene", "gouraud_ms", "phong_ms");
        for method in &methods {
            header += &format!(" {method:>11}");
        }
        self.stdout.line(&header)?;
        for result in results {
            let mut line = format!("{:<width$}", result.scene);
            match &result.calibration {
                Some(times) => {
                    line += &format!(" {:>10.3} {:>9.3}", times.gouraud_ms, times.phong_ms);
                }
                None => line += &format!(" {:>10} {:>9}", "-", "-"),
            }
            for method in &methods {
                match result.area(method) {
                    Some(area) => line += &format!(" {:>11.3}", area.area_codes),
                    None => line += &format!(" {:>11}", "-"),
                }
            }
            self.stdout.line(&line)?;
        }
        Ok(())
    }
}
