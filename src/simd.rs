//! Which SIMD instructions to use, decided once per engine and at run time.
//!
//! Kernels are generic over `fearless_simd`'s `Simd` trait, marked `#[inline(always)]`, and entered
//! through [`dispatch!`] once per pass, never per pixel. All lanes run the same operations in the
//! same order whatever the vector width, and nothing is summed across lanes, so a result does not
//! depend on the width: levels with fused multiply-add agree to the last bit, the others differ from
//! them only by the rounding of `mul_add`.

pub use fearless_simd::dispatch;
pub use fearless_simd::{Level, Simd};

use std::fmt;
use std::str::FromStr;

/// A SIMD level by name, for command lines and tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SimdLevel {
    /// One lane at a time.
    Scalar,
    /// x86-64 baseline, 4 lanes.
    Sse2,
    /// x86-64-v2, 4 lanes.
    Sse42,
    /// x86-64-v3 with fused multiply-add, 8 lanes.
    Avx2,
    /// AVX-512 of Ice Lake and later, 16 lanes.
    Avx512,
    /// 64-bit ARM, 4 lanes.
    Neon,
}

impl SimdLevel {
    /// Every level there is, weakest first.
    pub const ALL: [Self; 6] = [
        Self::Scalar,
        Self::Sse2,
        Self::Sse42,
        Self::Avx2,
        Self::Avx512,
        Self::Neon,
    ];

    /// The strongest level of this machine.
    #[must_use]
    pub fn detect() -> Self {
        Self::ALL
            .into_iter()
            .rev()
            .find(|level| level.token().is_some())
            .unwrap_or(Self::Scalar)
    }

    /// The levels this machine can run, weakest first.
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL
            .into_iter()
            .filter(|level| level.token().is_some())
    }

    /// The dispatch token of this level, or `None` where the machine lacks it.
    #[must_use]
    pub fn token(self) -> Option<Level> {
        let machine = Level::new();
        match self {
            Self::Scalar => Some(Level::fallback()),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Sse2 => machine.as_sse2().map(Level::Sse2),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Sse42 => machine.as_sse4_2().map(Level::Sse4_2),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx2 => machine.as_avx2().map(Level::Avx2),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx512 => machine.as_avx512().map(Level::Avx512),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => machine.as_neon().map(Level::Neon),
            _ => {
                let _ = machine;
                None
            }
        }
    }

    /// The name used on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Sse2 => "sse2",
            Self::Sse42 => "sse4.2",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
            Self::Neon => "neon",
        }
    }
}

impl fmt::Display for SimdLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for SimdLevel {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let level = Self::ALL
            .into_iter()
            .find(|level| level.name() == text)
            .ok_or_else(|| {
                let names: Vec<_> = Self::available().map(Self::name).collect();
                format!(
                    "no SIMD level is called '{text}'; this machine has {}",
                    names.join(", ")
                )
            })?;
        if level.token().is_none() {
            return Err(format!(
                "this machine does not have the SIMD level '{text}'"
            ));
        }
        Ok(level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scalar_is_always_available_and_names_round_trip() {
        assert!(SimdLevel::available().any(|level| level == SimdLevel::Scalar));
        for level in SimdLevel::available() {
            assert_eq!(level.name().parse(), Ok(level));
        }
        assert!("mmx".parse::<SimdLevel>().is_err());
    }
}
