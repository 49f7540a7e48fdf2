//! What several commands take on the command line.

use super::{Failure, costs};
use clap::Args;
use specula::BackendKind;
use specula::frame::{Engine, EngineOptions, Method};
use specula::geometry::screen::MAX_IMAGE_SIDE;
use specula::output::Encoding;
use specula::output::timing::MAX_DURATION_S;
use specula::refine::paper::PaperRule;
use specula::scene::Scene;
use specula::schedule::{Budget, CostModel};
use specula::simd::SimdLevel;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Most pixels of an image.
const MAX_PIXELS: u64 = 1 << 26;

/// Most threads: more than any machine has use for, and few enough to be started.
const MAX_THREADS: usize = 1024;

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

    /// What work takes on this machine, as `bench --save-costs` wrote it; found out in 20 ms if not given
    #[arg(long, value_name = "FILE")]
    costs: Option<PathBuf>,
}

impl Machine {
    /// An engine for `scene` that uses the machine so.
    pub(super) fn engine(
        &self,
        scene: &Scene,
        method: Method,
        encoding: Encoding,
    ) -> Result<Engine, Failure> {
        Ok(Engine::with_options(
            scene,
            self.options(method, encoding)?,
        )?)
    }

    /// Options of an engine that uses the machine so.
    pub(super) fn options(
        &self,
        method: Method,
        encoding: Encoding,
    ) -> Result<EngineOptions, Failure> {
        Ok(EngineOptions {
            method,
            backend: self.backend,
            encoding,
            threads: self.threads,
            simd: self.simd,
            costs: self.costs()?,
            ..EngineOptions::default()
        })
    }

    /// What is known about costs.
    pub(super) fn costs(&self) -> Result<Option<CostModel>, Failure> {
        self.costs.as_deref().map(costs::load).transpose()
    }

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

/// How far the paper's methods go.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct Paper {
    /// For the method regular: how many rings of neighbours are subdivided with a highlighted triangle
    #[arg(
        long,
        value_name = "N",
        default_value = "1",
        help_heading = "Methods of the paper"
    )]
    rings: u32,

    /// For the method regular: triangles are split until they have fewer pixels, but not below one
    #[arg(long, value_name = "PX", default_value = "32", value_parser = threshold, allow_negative_numbers = true, help_heading = "Methods of the paper")]
    area_threshold: f32,

    /// For the method highlight: an edge is divided where the intensity in its middle is off by more than this share
    #[arg(long, value_name = "SHARE", default_value = "0.3", value_parser = threshold, allow_negative_numbers = true, help_heading = "Methods of the paper")]
    intensity_threshold: f32,
}

impl Paper {
    pub(super) fn rule(self) -> PaperRule {
        PaperRule {
            rings: self.rings,
            area_px: self.area_threshold,
            difference: self.intensity_threshold,
            ..PaperRule::default()
        }
    }
}

fn threshold(text: &str) -> Result<f32, String> {
    let value = not_negative(text).filter(|&value| value > 0.0);
    let value = value.map(|value| value as f32);
    value.ok_or_else(|| "a threshold is a number above 0".to_owned())
}

/// An image size in pixels, not empty and not too large.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Size {
    pub(super) width: u32,
    pub(super) height: u32,
}

pub(super) fn size(text: &str) -> Result<Size, String> {
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

/// The budget that `--budget` and `--work` ask for; clap takes one of them at most.
pub(super) fn budget(ms: Option<f64>, units: Option<u64>) -> Budget {
    match (ms, units) {
        (Some(ms), _) => Budget::from_millis(ms),
        (None, Some(units)) => Budget::Work(units),
        (None, None) => Budget::Unlimited,
    }
}

pub(super) fn milliseconds(text: &str) -> Result<f64, String> {
    not_negative(text).ok_or_else(|| "a budget is a number of milliseconds, 0 or more".to_owned())
}

/// An error in codes.
pub(super) fn rmse(text: &str) -> Result<f64, String> {
    not_negative(text).ok_or_else(|| "an error is a number of 8-bit codes, 0 or more".to_owned())
}

/// A finite number, 0 or more.
pub(super) fn not_negative(text: &str) -> Option<f64> {
    let value: f64 = text.parse().ok()?;
    (value.is_finite() && value >= 0.0).then_some(value)
}

pub(super) fn count(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(0) | Err(_) => Err(format!("it must be a whole number from 1 to {}", u32::MAX)),
        Ok(count) => Ok(count),
    }
}

/// A fraction of the way from one time to another, or beyond.
pub(super) fn fraction(text: &str) -> Result<f64, String> {
    not_negative(text).ok_or_else(|| "a fraction is a number, 0 or more".to_owned())
}

/// A method, or all of them.
#[derive(Clone, Copy, Debug)]
pub(super) enum MethodOrAll {
    All,
    One(Method),
}

impl FromStr for MethodOrAll {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "all" => Ok(Self::All),
            _ => text.parse().map(Self::One),
        }
    }
}

/// The methods named, each once, in the order given.
pub(super) fn selected(named: &[MethodOrAll]) -> Vec<Method> {
    let mut methods = Vec::new();
    for item in named {
        let group = match item {
            MethodOrAll::All => &Method::ALL[..],
            MethodOrAll::One(method) => std::slice::from_ref(method),
        };
        for &method in group {
            if !methods.contains(&method) {
                methods.push(method);
            }
        }
    }
    methods
}

fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count @ 1..=MAX_THREADS) => Ok(count),
        _ => Err(format!("it must be a whole number from 1 to {MAX_THREADS}")),
    }
}

/// A point of time, not negative.
pub(super) fn time(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|seconds| (0.0..=MAX_DURATION_S).contains(seconds))
        .ok_or_else(|| format!("a time is a number of seconds from 0 to {MAX_DURATION_S}"))
}

/// What reports call a scene: the file's name without directories and ending.
pub(super) fn name_of(path: &Path) -> String {
    path.file_stem()
        .map_or_else(|| path.to_string_lossy(), |stem| stem.to_string_lossy())
        .into_owned()
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

#[cfg(test)]
mod tests {
    use super::*;

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
