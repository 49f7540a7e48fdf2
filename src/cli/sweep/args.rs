//! What can be said to `specula sweep`.

use crate::cli::Failure;
use crate::cli::args::{Machine, MethodOrAll, count, fraction, milliseconds, selected};
use clap::Args;
use specula::measure::SweepOptions;
use specula::output::Encoding;
use std::path::PathBuf;

/// `specula sweep`.
#[derive(Debug, Args)]
#[command(after_help = "\
G and P are the medians of 30 Gouraud-shaded and 30 Phong-shaded frames, measured first. A budget of
fraction F is G + F (P - G) milliseconds: 0 buys Gouraud shading, 1 Phong shading of every pixel.

The area under a method's curve is its mean RMSE over the time from G to P; until it has an image, the
error is Gouraud shading's. G and P are measured again between the rows and at the end: a warning says
when the quartiles of their times lie more than 10 % of the median apart, or a median has changed by
more than 5 %.

Examples:
  All methods at the default fractions, as a chart:
    specula sweep scenes/teapot.ron --methods all --repeat 9 --svg teapot.svg
  All scenes, with a chart of each in one folder and everything measured in one file:
    specula sweep scenes/*.ron --methods all --repeat 9 --svg charts/ --json-file sweep.json
  Medians of five at two budgets, also as CSV:
    specula sweep scenes/*.ron --budgets 2,8 --repeat 5 --csv sweep.csv
  How an image gets better from frame to frame:
    specula sweep scenes/teapot.ron --methods adaptive --fractions 0.1 --frames 20")]
pub(in crate::cli) struct Sweep {
    /// Scene files (.ron) or meshes (.obj)
    #[arg(required = true, value_name = "SCENE")]
    pub(super) scenes: Vec<PathBuf>,

    /// Methods, separated by commas: flat, gouraud, phong, adaptive, phong-area, phong-tiles, phong-half, regular, highlight, hybrid, or all
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "adaptive,phong-area"
    )]
    methods: Vec<MethodOrAll>,

    /// How images store light, in codes of which errors are measured: srgb or linear
    #[arg(long, value_name = "NAME", default_value_t)]
    pub(super) encoding: Encoding,

    /// Budgets in milliseconds, separated by commas
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        value_parser = milliseconds,
        allow_negative_numbers = true
    )]
    pub(super) budgets: Vec<f64>,

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
    pub(super) fractions: Vec<f64>,

    /// Consecutive frames of the view at each budget; charts and areas show the first
    #[arg(long, value_name = "N", default_value = "1", value_parser = count)]
    pub(super) frames: u32,

    /// How often to measure each row; the one with the median frame time is kept
    #[arg(long, value_name = "K", default_value = "1", value_parser = count)]
    pub(super) repeat: u32,

    /// Also write the rows to a CSV file, each as soon as it is measured
    #[arg(long, value_name = "FILE")]
    pub(super) csv: Option<PathBuf>,

    /// Draw a chart of error against time: an .svg file, or a folder that gets one for each scene
    #[arg(long, value_name = "FILE.svg|DIR")]
    pub(super) svg: Option<PathBuf>,

    /// Write machine, calibrations, rows and areas to a JSON file, anew after each scene
    #[arg(long, value_name = "FILE")]
    pub(super) json_file: Option<PathBuf>,

    /// Print one JSON object per row, and nothing else
    #[arg(long)]
    pub(super) json: bool,

    #[command(flatten)]
    pub(super) machine: Machine,
}

impl Sweep {
    pub(super) fn options(&self) -> Result<SweepOptions, Failure> {
        Ok(SweepOptions {
            width: self.machine.size.width,
            height: self.machine.size.height,
            methods: selected(&self.methods),
            frames: self.frames,
            repeats: self.repeat,
            threads: self.machine.threads,
            backend: self.machine.backend,
            encoding: self.encoding,
            simd: self.machine.simd,
            costs: self.machine.costs()?,
            ..SweepOptions::default()
        })
    }
}
