//! How light is stored in the bytes of an image.

use std::fmt;
use std::str::FromStr;

/// How an image stores linear light as bytes. What that means exactly is in [`encode`](super::encode).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Encoding {
    /// By the sRGB curve, close to uniform for the eye: what screens and most files expect.
    #[default]
    Srgb,
    /// In proportion to light, for programs that go on computing with it. Dark tones get few codes.
    Linear,
}

impl Encoding {
    /// All encodings.
    pub const ALL: [Self; 2] = [Self::Srgb, Self::Linear];

    /// The name used on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Srgb => "srgb",
            Self::Linear => "linear",
        }
    }
}

impl fmt::Display for Encoding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Encoding {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|encoding| encoding.name() == text)
            .ok_or_else(|| {
                let names = Self::ALL.map(Self::name).join(", ");
                format!("no encoding is called '{text}'; there are {names}")
            })
    }
}
