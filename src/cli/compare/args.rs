//! What can be said to `specula compare`.

use crate::cli::Failure;
use crate::cli::args::{Machine, MethodOrAll, count, fraction, milliseconds, selected};
use clap::Args;
use specula::measure::SweepOptions;
use specula::output::Encoding;
use std::path::PathBuf;

/// `specula compare`.
#[derive(Debug, Args)]
#[command(after_help = "\
The sheet shows the Phong reference and, for each method, the cold frame with the median time of
--repeat, its error at each pixel, and its numbers. All maps of errors have one scale, which is
logarithmic. Without --budget all frames have G + F (P - G) milliseconds, where G and P are the
medians of 30 Gouraud-shaded and 30 Phong-shaded frames; methods that cannot stop in time are late.

Images wider than 640 pixels are shown smaller: light is averaged, errors by root mean square.

Examples:
  All methods with 0.3 of the time between Gouraud and Phong shading:
    specula compare scenes/closeup.ron -o sheet.png
  Two of them with 4 ms, at full HD:
    specula compare scenes/walls.ron -o sheet.png --methods adaptive,phong-area --budget 4 --size 1920x1080
  The numbers for a script:
    specula compare scenes/walls.ron -o sheet.png --json | jq '.methods[] | {method, frame_ms, rmse}'")]
pub(in crate::cli) struct Compare {
    /// Scene file (.ron), or a mesh (.obj), which gets a camera, lights and a material
    pub(super) scene: PathBuf,

    /// Sheet to write; its name ends in .png
    #[arg(short, long, value_name = "OUT.png")]
    pub(super) output: PathBuf,

    /// Methods, separated by commas: flat, gouraud, phong, adaptive, phong-area, phong-tiles, phong-half, regular, highlight, hybrid, or all
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "all"
    )]
    methods: Vec<MethodOrAll>,

    /// Wall-clock milliseconds for each frame
    #[arg(long, value_name = "MS", value_parser = milliseconds, allow_negative_numbers = true)]
    pub(super) budget: Option<f64>,

    /// The time for each frame as a fraction of the way from Gouraud to Phong shading
    #[arg(
        long,
        value_name = "F",
        default_value = "0.3",
        value_parser = fraction,
        allow_negative_numbers = true,
        conflicts_with = "budget"
    )]
    pub(super) fraction: f64,

    /// How often to render each frame; the one with the median time is shown
    #[arg(long, value_name = "K", default_value = "5", value_parser = count)]
    repeat: u32,

    /// How images store light, in codes of which errors are measured: srgb or linear
    #[arg(long, value_name = "NAME", default_value_t)]
    encoding: Encoding,

    /// Print the numbers as one JSON object
    #[arg(long)]
    pub(super) json: bool,

    #[command(flatten)]
    pub(super) machine: Machine,
}

impl Compare {
    pub(super) fn options(&self) -> Result<SweepOptions, Failure> {
        Ok(SweepOptions {
            width: self.machine.size.width,
            height: self.machine.size.height,
            methods: selected(&self.methods),
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
