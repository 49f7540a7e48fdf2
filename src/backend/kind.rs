//! The backends by name.

use super::Backend;
use super::skia::SkiaBackend;
use super::software::SoftwareBackend;
use std::fmt;
use std::str::FromStr;

/// A backend that comes with this crate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum BackendKind {
    /// The tiled software rasterizer.
    #[default]
    Software,
    /// tiny-skia, which knows 2D paths and gradients only.
    Skia,
}

impl BackendKind {
    /// All backends.
    pub const ALL: [Self; 2] = [Self::Software, Self::Skia];

    /// The name used on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Software => "software",
            Self::Skia => "skia",
        }
    }

    /// A new backend without an image.
    #[must_use]
    pub fn create(self) -> Box<dyn Backend> {
        match self {
            Self::Software => Box::new(SoftwareBackend::new()),
            Self::Skia => Box::new(SkiaBackend::new()),
        }
    }
}

impl fmt::Display for BackendKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for BackendKind {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.name() == text)
            .ok_or_else(|| {
                let names = Self::ALL.map(Self::name).join(", ");
                format!("no backend is called '{text}'; there are {names}")
            })
    }
}
