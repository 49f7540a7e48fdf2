//! When the frames of a film are shown.
//!
//! Frame `i`, counted from 0, is shown at `i / rate` seconds. Rates are fractions, because the common ones of video are
//! (30000/1001 is called 29.97) and file formats store them so; a decimal number would drift against the sound.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Longest film in seconds: a day.
pub const MAX_DURATION_S: f64 = 86_400.0;

/// Most frames of a film.
pub const MAX_FRAMES: u32 = 1_000_000;

/// Slowest and fastest rate in frames a second.
pub const FPS_RANGE: RangeInclusive<f64> = 0.001..=1000.0;

/// The rates of video that are not whole are 1000/1001 of these, and are written with two or three decimals.
const NTSC: [u32; 5] = [24, 30, 48, 60, 120];

/// Frames per second, as a fraction in lowest terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRate {
    numerator: u32,
    denominator: u32,
}

impl FrameRate {
    /// Thirty frames a second.
    pub const THIRTY: Self = Self {
        numerator: 30,
        denominator: 1,
    };

    /// `numerator / denominator` frames a second; `None` outside of [`FPS_RANGE`].
    #[must_use]
    pub fn new(numerator: u32, denominator: u32) -> Option<Self> {
        // False for NaN, which is 0 / 0.
        let fps = f64::from(numerator) / f64::from(denominator);
        if !FPS_RANGE.contains(&fps) {
            return None;
        }
        let divisor = greatest_common_divisor(numerator, denominator);
        Some(Self {
            numerator: numerator / divisor,
            denominator: denominator / divisor,
        })
    }

    /// The rate that a decimal number of frames a second stands for: 29.97 and its kin are 30000/1001 and so on, others are
    /// rounded to thousandths. `None` outside of [`FPS_RANGE`].
    #[must_use]
    pub fn from_fps(fps: f64) -> Option<Self> {
        if !FPS_RANGE.contains(&fps) {
            return None;
        }
        for whole in NTSC {
            if (fps - f64::from(whole) / 1.001).abs() < 5e-4 {
                return Self::new(whole * 1000, 1001);
            }
        }
        Self::new(libm::round(fps * 1000.0) as u32, 1000)
    }

    /// Frames in [`denominator`](Self::denominator) seconds.
    #[must_use]
    pub fn numerator(self) -> u32 {
        self.numerator
    }

    /// Seconds in which [`numerator`](Self::numerator) frames are shown.
    #[must_use]
    pub fn denominator(self) -> u32 {
        self.denominator
    }

    /// Frames a second.
    #[must_use]
    pub fn fps(self) -> f64 {
        f64::from(self.numerator) / f64::from(self.denominator)
    }

    /// When frame `index`, counted from 0, is shown, in seconds. The product is exact up to [`MAX_FRAMES`].
    #[must_use]
    pub fn seconds(self, index: u32) -> f64 {
        f64::from(index) * f64::from(self.denominator) / f64::from(self.numerator)
    }

    /// How long a frame is shown, in seconds, as the fraction nearest to it whose numerator and denominator have 16 bits.
    #[must_use]
    pub fn delay(self) -> (u16, u16) {
        if let (Ok(numerator), Ok(denominator)) = (
            u16::try_from(self.denominator),
            u16::try_from(self.numerator),
        ) {
            return (numerator, denominator);
        }
        let mut best = (f64::INFINITY, (1, 1));
        for numerator in 1..=u16::MAX {
            let frames = libm::round(f64::from(numerator) * self.fps());
            let denominator = frames.clamp(1.0, f64::from(u16::MAX)) as u16;
            let off = (f64::from(denominator) / f64::from(numerator) - self.fps()).abs();
            if off < best.0 {
                best = (off, (numerator, denominator));
            }
        }
        best.1
    }
}

impl fmt::Display for FrameRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.denominator {
            1 => write!(f, "{}", self.numerator),
            denominator => write!(f, "{}/{denominator}", self.numerator),
        }
    }
}

impl FromStr for FrameRate {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let rate = match text.split_once('/') {
            Some((numerator, denominator)) => numerator
                .parse()
                .ok()
                .zip(denominator.parse().ok())
                .and_then(|(numerator, denominator)| Self::new(numerator, denominator)),
            None => text.parse().ok().and_then(Self::from_fps),
        };
        rate.ok_or_else(|| {
            format!(
                "a frame rate is a number such as 30, 29.97 or 30000/1001, from {} to {}",
                FPS_RANGE.start(),
                FPS_RANGE.end()
            )
        })
    }
}

fn greatest_common_divisor(mut a: u32, mut b: u32) -> u32 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// How long a film is, and its frame rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    duration_s: f64,
    rate: FrameRate,
    frames: u32,
}

/// Why a film cannot be that long.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TimingError {
    /// The duration is not above zero, or too long, or not a number.
    #[error("a duration is a number of seconds above 0 and at most {MAX_DURATION_S}")]
    Duration,
    /// There would be more than [`MAX_FRAMES`].
    #[error(
        "{duration_s} seconds at {rate} frames a second are {frames} frames; at most {MAX_FRAMES} are possible"
    )]
    Frames {
        /// The duration asked for.
        duration_s: f64,
        /// The rate asked for.
        rate: FrameRate,
        /// The frames that makes.
        frames: f64,
    },
}

impl Timing {
    /// A film of `duration_s` seconds, rounded to whole frames, but at least one.
    ///
    /// # Errors
    /// When the duration is not above 0 and at most [`MAX_DURATION_S`], or there are more than [`MAX_FRAMES`] frames.
    pub fn new(duration_s: f64, rate: FrameRate) -> Result<Self, TimingError> {
        if !(duration_s > 0.0 && duration_s <= MAX_DURATION_S) {
            return Err(TimingError::Duration);
        }
        let frames = libm::round(duration_s * rate.fps()).max(1.0);
        if frames > f64::from(MAX_FRAMES) {
            return Err(TimingError::Frames {
                duration_s,
                rate,
                frames,
            });
        }
        Ok(Self {
            duration_s,
            rate,
            frames: frames as u32,
        })
    }

    /// Length in seconds, as it was asked for.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Frames per second.
    #[must_use]
    pub fn rate(&self) -> FrameRate {
        self.rate
    }

    /// Number of frames, at least one.
    #[must_use]
    pub fn frames(&self) -> u32 {
        self.frames
    }
}

impl Default for Timing {
    /// Six seconds of thirty frames each.
    fn default() -> Self {
        Self {
            duration_s: 6.0,
            rate: FrameRate::THIRTY,
            frames: 180,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rate(text: &str) -> FrameRate {
        text.parse().expect("a rate")
    }

    #[test]
    fn rates_are_fractions_in_lowest_terms() {
        for (text, expected) in [
            ("30", "30"),
            ("29.97", "30000/1001"),
            ("23.976", "24000/1001"),
            ("59.94", "60000/1001"),
            ("119.88", "120000/1001"),
            ("60000/1001", "60000/1001"),
            ("23.98", "1199/50"),
            ("12.5", "25/2"),
            ("60/4", "15"),
            ("0.001", "1/1000"),
            ("1000", "1000"),
        ] {
            assert_eq!(rate(text).to_string(), expected, "{text}");
        }
        for bad in [
            "", "0", "-1", "nan", "inf", "0/0", "1/0", "0/1", "1001", "0.0009", "1e9", "30:1", "/",
            "1/2/3",
        ] {
            assert!(bad.parse::<FrameRate>().is_err(), "{bad}");
        }
    }

    #[test]
    fn delays_fit_sixteen_bits_and_are_right_to_a_hundred_thousandth() {
        for text in [
            "30",
            "29.97",
            "59.94",
            "119.88",
            "999.992",
            "0.001",
            "4294966291/4294967",
        ] {
            let rate = rate(text);
            let (numerator, denominator) = rate.delay();
            let delay = f64::from(numerator) / f64::from(denominator);
            assert!((delay * rate.fps() - 1.0).abs() < 1e-5, "{text}: {delay}");
        }
        assert_eq!(rate("59.94").delay(), (1001, 60_000));
    }

    #[test]
    fn films_have_whole_frames() {
        let frames = |duration, text| Timing::new(duration, rate(text)).map(|t| t.frames());
        assert_eq!(frames(6.0, "30"), Ok(180));
        assert_eq!(frames(10.0, "29.97"), Ok(300));
        assert_eq!(frames(1e-9, "30"), Ok(1));
        assert_eq!(frames(86_400.0, "10"), Ok(864_000));
        assert_eq!(Timing::new(6.0, FrameRate::THIRTY), Ok(Timing::default()));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 86_400.1] {
            assert_eq!(frames(bad, "1"), Err(TimingError::Duration), "{bad}");
        }
        let error = Timing::new(86_400.0, rate("25")).expect_err("too many frames");
        assert_eq!(
            error.to_string(),
            "86400 seconds at 25 frames a second are 2160000 frames; at most 1000000 are possible"
        );
    }

    #[test]
    fn times_do_not_drift() {
        let ntsc = rate("29.97");
        assert_eq!(ntsc.seconds(30_000), 1001.0);
        assert_eq!(rate("30").seconds(7), 7.0 / 30.0);
    }
}
