//! What can be said on the command line.

use super::animate::{Animate, time};
use super::bench::Bench;
use super::inspect::Inspect;
use clap::{Args, Parser, Subcommand};
use specula::BackendKind;
use specula::frame::Method;
use specula::geometry::screen::MAX_IMAGE_SIDE;
use specula::simd::SimdLevel;
use std::path::PathBuf;

/// Most pixels of an image.
const MAX_PIXELS: u64 = 1 << 26;

/// Most threads: more than any machine has use for, and few enough to be started.
const MAX_THREADS: usize = 1024;

/// Renders scenes with specular highlights on the CPU, inside a millisecond budget per frame.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100, subcommand_required = true)]
#[command(after_help = "\
Examples:
  specula render scenes/teapot.ron -o teapot.png
  specula render scenes/teapot.ron -o teapot.png --budget 2 --frames 8
  specula animate scenes/turntable.ron -o turntable.apng --budget 4
  specula sweep scenes/teapot.ron --methods all --csv teapot.csv
  specula bench scenes/teapot.ron --budget 4
  specula inspect scenes/teapot.ron --budget 2 --overlay overlay.png

Exit status: 0 done, 1 failed (also: a file cannot be read or written), 2 bad usage or bad input.")]
pub(super) struct Arguments {
    #[command(subcommand)]
    pub(super) command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Render frames of a still view under a budget, and write the last one
    Render(Render),
    /// Render the scene's animation, each frame under a budget, as APNG, Y4M or numbered PNG files
    Animate(Animate),
    /// Measure error against time: methods x budgets, every row from a cold engine
    Sweep(Sweep),
    /// Measure frame times over views from all around a scene
    Bench(Bench),
    /// Say what a view consists of, and draw it over the image
    Inspect(Inspect),
}

/// `specula render`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each frame goes on refining where the last one stopped, until the image equals per-pixel Phong
shading. Without --budget and --work the first frame refines until then.

PHTs are potentially highlighted triangles: those that pass the paper's test for a highlight's centre.

Examples:
  Converge, and write the final image:
    specula render scenes/teapot.ron -o teapot.png
  Eight frames of at most 2 ms each, at full HD:
    specula render scenes/teapot.ron -o teapot.png --budget 2 --frames 8 --size 1920x1080
  The same image however fast the machine, compared with the Phong reference:
    specula render scenes/teapot.ron -o teapot.png --work 500000 --error
  Frame times for a script:
    specula render scenes/teapot.ron -o teapot.png --budget 2 --frames 100 --json | jq .frame_ms")]
pub(super) struct Render {
    /// Scene file (.ron), or a mesh (.obj), which gets a camera, lights and a material
    pub(super) scene: PathBuf,

    /// Image to write; its name ends in .png
    #[arg(short, long, value_name = "OUT.png")]
    pub(super) output: PathBuf,

    /// Wall-clock milliseconds for each frame; 0 buys the first, Gouraud-shaded image only
    #[arg(long, value_name = "MS", value_parser = milliseconds, allow_negative_numbers = true)]
    pub(super) budget: Option<f64>,

    /// Work units (nominal nanoseconds of refinement) for each frame: the result does not depend on the machine's
    /// speed or the number of threads
    #[arg(long, value_name = "UNITS", conflicts_with = "budget")]
    pub(super) work: Option<u64>,

    /// Show the scene's animation after this many seconds, as `specula animate` films it
    #[arg(long, value_name = "S", value_parser = time, allow_negative_numbers = true)]
    pub(super) time: Option<f64>,

    /// How many frames of the view to render
    #[arg(long, value_name = "N", default_value = "1", value_parser = count)]
    pub(super) frames: u32,

    /// How to shade: flat, gouraud, phong, adaptive or phong-area
    #[arg(long, default_value_t)]
    pub(super) method: Method,

    /// Compare the last frame with the Phong reference (which takes a while)
    #[arg(long)]
    pub(super) error: bool,

    /// Print one JSON object per frame
    #[arg(long)]
    pub(super) json: bool,

    #[command(flatten)]
    pub(super) machine: Machine,
}

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
    pub(super) scenes: Vec<PathBuf>,

    /// Methods, separated by commas: flat, gouraud, phong, adaptive, phong-area, or all
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "adaptive,phong-area",
        value_parser = method_or_all
    )]
    methods: Vec<MethodOrAll>,

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

    /// Consecutive frames of the view at each budget
    #[arg(long, value_name = "N", default_value = "1", value_parser = count)]
    pub(super) frames: u32,

    /// How often to measure each row; the one with the median frame time is kept
    #[arg(long, value_name = "K", default_value = "1", value_parser = count)]
    pub(super) repeat: u32,

    /// Also write the rows to a CSV file, each as soon as it is measured
    #[arg(long, value_name = "FILE")]
    pub(super) csv: Option<PathBuf>,

    /// Print one JSON object per row
    #[arg(long)]
    pub(super) json: bool,

    #[command(flatten)]
    pub(super) machine: Machine,
}

impl Sweep {
    /// The methods asked for, each once, in the order given.
    pub(super) fn methods(&self) -> Vec<Method> {
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

/// Image size, and what of the machine to use.
#[derive(Debug, Args)]
pub(super) struct Machine {
    /// Image size in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    pub(super) size: Size,

    /// Threads to use; as many as the machine has processors if not given
    #[arg(long, value_name = "N", value_parser = threads)]
    pub(super) threads: Option<usize>,

    /// What draws: software, or skia (tiny-skia: refines first, then draws everything once)
    #[arg(long, value_name = "NAME", default_value_t)]
    pub(super) backend: BackendKind,

    /// SIMD level to use, such as scalar, sse2, avx2 or neon; the machine's strongest if not given
    #[arg(long, value_name = "LEVEL")]
    pub(super) simd: Option<SimdLevel>,
}

impl Machine {
    /// The number of threads that will be used.
    pub(super) fn thread_count(&self) -> usize {
        self.threads.unwrap_or_else(|| {
            std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
        })
    }

    /// The SIMD level that will be used.
    pub(super) fn simd_level(&self) -> SimdLevel {
        self.simd.unwrap_or_else(SimdLevel::detect)
    }
}

/// An image size in pixels, not empty and not too large.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Size {
    pub(super) width: u32,
    pub(super) height: u32,
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

fn size(text: &str) -> Result<Size, String> {
    let (width, height) = text
        .split_once(['x', 'X'])
        .and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)))
        .ok_or("a size is two whole numbers such as 1280x720")?;
    if width == 0 || height == 0 {
        return Err("an image needs at least one pixel".to_owned());
    }
    if width > MAX_IMAGE_SIDE || height > MAX_IMAGE_SIDE {
        return Err(format!("no side may exceed {MAX_IMAGE_SIDE} pixels"));
    }
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(format!("an image may have at most {MAX_PIXELS} pixels"));
    }
    Ok(Size { width, height })
}

pub(super) fn milliseconds(text: &str) -> Result<f64, String> {
    not_negative(text).ok_or_else(|| "a budget is a number of milliseconds, 0 or more".to_owned())
}

fn fraction(text: &str) -> Result<f64, String> {
    not_negative(text).ok_or_else(|| "a fraction is a number, 0 or more".to_owned())
}

fn not_negative(text: &str) -> Option<f64> {
    let value: f64 = text.parse().ok()?;
    (value.is_finite() && value >= 0.0).then_some(value)
}

pub(super) fn count(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(0) | Err(_) => Err(format!("it must be a whole number from 1 to {}", u32::MAX)),
        Ok(count) => Ok(count),
    }
}

fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count @ 1..=MAX_THREADS) => Ok(count),
        _ => Err(format!("it must be a whole number from 1 to {MAX_THREADS}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_grammar_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn sizes_are_checked_before_anything_is_allocated() {
        assert_eq!(
            size("16384x4096"),
            Ok(Size {
                width: 16384,
                height: 4096
            })
        );
        for bad in [
            "",
            "5",
            "0x5",
            "5x0",
            "16385x1",
            "16384x4097",
            "-1x5",
            "axb",
            "1x2x3",
            "9999999999x1",
        ] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn budgets_are_finite_and_not_negative() {
        assert_eq!(milliseconds("0.5"), Ok(0.5));
        assert_eq!(milliseconds("0"), Ok(0.0));
        for bad in ["", "-1", "nan", "inf", "1e999", "two"] {
            assert!(milliseconds(bad).is_err(), "{bad}");
        }
    }
}
