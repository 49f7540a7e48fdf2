//! Inverse square root and power function in SIMD lanes, the same bits on every machine with fused multiply-add.
//!
//! Hardware estimates differ between vendors, so both start from integers and use multiplications and additions only.
//!
//! **Power.** `c^s` for a cosine given as `c = 1 - d` is `exp2(s log2(1 - d))`. A caller forms `d = |a - b|^2 / 2` of unit
//! vectors by subtraction, which keeps its relative accuracy where `c` is near 1 and a large exponent needs it
//! (DESIGN.md, "Illumination"). `1 - d = 2^k m` with `m` in `[sqrt(1/2), sqrt(2))`; `log2(m) = f Q(f)` with `f = m - 1`,
//! but `f = -d`, exactly, where `k = 0`. `Q` has degree 8 (error 4.2e-8), `exp2` degree 5 (2.0e-7).
//!
//! **Error.** What is below [`FLUSH`] becomes zero, so the exponent `y = s log2(1 - d)` is above -24, and its relative
//! error of less than 4e-7 (in `Q`, three products and a sum) becomes one of at most 24 ln 2 x 4e-7 in the power: given `d`, the
//! relative error is below [`POWER_ERROR`], whatever `s` is. An error `e` of the unit vectors becomes one of `|a - b| e`
//! in `d`, hence of at most `0.61 sqrt(s) e` in the power (the maximum of `exp(-x) sqrt(2 x s)`), which is
//! 4e-6 at `s = 1000` for `e = 2e-7`. For `0 < s < 1` the slope of `c^s` at `c = 0` is infinite and so is the amplification there.

use crate::simd::Simd;
use fearless_simd::prelude::*;
use std::f32::consts::{LN_2, LOG2_E};

/// Powers below this are flushed to zero: with 255 codes and the slope of the sRGB curve they are far from visible.
pub const FLUSH: f64 = 1.0 / (1_u32 << 24) as f64;

/// Bound of the relative error of [`rsqrt_lanes`].
pub const RSQRT_ERROR: f64 = 2e-7;

/// Bound of the relative error of [`Power::lanes`], given `d`.
pub const POWER_ERROR: f64 = 7e-6;

/// `1 / sqrt(x)` for finite `x >= 0`, with a relative error below [`RSQRT_ERROR`] for normal numbers.
///
/// At zero it is a large finite number, so that a zero vector stays one when it is normalized. Infinity gives NaN.
#[inline(always)]
pub fn rsqrt_lanes<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let splat = |v: f32| S::f32s::splat(simd, v);
    let seed = S::u32s::splat(simd, 0x5f37_59df) - (x.bitcast::<S::u32s>() >> 1);
    let mut y: S::f32s = seed.bitcast();
    let minus_half = x * splat(-0.5);
    for _ in 0..2 {
        y = y * (minus_half * y).mul_add(y, splat(1.5));
    }
    // The same step in residual form: only the last addition rounds a large number.
    let residual = (minus_half * y).mul_add(y, splat(0.5));
    y.mul_add(residual, y)
}

/// A specular exponent made ready.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    exponent: f32,
    cut: f32,
}

impl Power {
    /// Makes an exponent ready; negative and NaN count as zero.
    #[must_use]
    pub fn new(exponent: f32) -> Self {
        let exponent = if exponent > 0.0 {
            exponent.min(f32::MAX)
        } else {
            0.0
        };
        // (1 - d)^s < 2^-24 beyond d = 1 - 2^(-24 / s); never reached for s = 0, where only d < 1 counts.
        let cut = if exponent > 0.0 {
            -libm::expm1(FLUSH.ln() / f64::from(exponent))
        } else {
            1.0
        };
        Self {
            exponent,
            cut: cut as f32,
        }
    }

    /// The power is zero exactly where `d` is not below this; at most 1.
    #[inline(always)]
    #[must_use]
    pub fn cut(self) -> f32 {
        self.cut
    }

    /// `(1 - d)^s` for `0 <= d < cut`; anything where `d` is outside of that.
    #[inline(always)]
    pub fn lanes<S: Simd>(self, simd: S, d: S::f32s) -> S::f32s {
        let splat = |v: f32| S::f32s::splat(simd, v);
        let c: S::i32s = (splat(1.0) - d).bitcast();
        // Exponent relative to sqrt(1/2); the shift is arithmetic.
        let k = (c - S::i32s::splat(simd, 0x3f35_04f3)) >> 23;
        let m: S::f32s = (c - (k << 23)).bitcast();
        let f = k
            .simd_eq(S::i32s::splat(simd, 0))
            .select(-d, m - splat(1.0));
        let q = splat(0.123_109_84)
            .mul_add(f, splat(-0.205_862_13))
            .mul_add(f, splat(0.216_078_28))
            .mul_add(f, splat(-0.239_169_85))
            .mul_add(f, splat(0.287_903_25))
            .mul_add(f, splat(-0.360_693_28))
            .mul_add(f, splat(0.480_910_75))
            .mul_add(f, splat(-0.721_347_45))
            .mul_add(f, splat(LOG2_E));
        let log2 = f.mul_add(q, k.to_float::<S::f32s>());
        exp2_lanes(simd, log2 * splat(self.exponent))
    }
}

/// `2^y` for `-125 <= y <= 127`, with a relative error below 4e-7 besides that of `y`.
#[inline(always)]
fn exp2_lanes<S: Simd>(simd: S, y: S::f32s) -> S::f32s {
    let splat = |v: f32| S::f32s::splat(simd, v);
    // Adding 1.5 x 2^23 rounds to an integer and leaves it in the low mantissa bits.
    let magic = splat(12_582_912.0);
    let rounded = y + magic;
    let f = y - (rounded - magic);
    // The last coefficient is 1, so that 2^0 is.
    let p = splat(0.001_338_130_2)
        .mul_add(f, splat(0.009_666_368))
        .mul_add(f, splat(0.055_503_81))
        .mul_add(f, splat(0.240_223_5))
        .mul_add(f, splat(LN_2))
        .mul_add(f, splat(1.0));
    (p.bitcast::<S::u32s>() + (rounded.bitcast::<S::u32s>() << 23)).bitcast()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{SimdLevel, dispatch};

    fn map(level: SimdLevel, xs: &[f32], power: Option<Power>) -> Vec<f32> {
        #[inline(always)]
        fn kernel<S: Simd>(simd: S, xs: &mut [f32], power: Option<Power>) {
            for chunk in xs.chunks_exact_mut(S::f32s::LEN) {
                let x = S::f32s::from_slice(simd, chunk);
                match power {
                    Some(power) => power.lanes(simd, x),
                    None => rsqrt_lanes(simd, x),
                }
                .store_slice(chunk);
            }
        }
        let mut padded = xs.to_vec();
        padded.resize(xs.len().next_multiple_of(16), 0.25);
        let level = level.token().expect("available");
        dispatch!(level, simd => kernel(simd, &mut padded, power));
        padded.truncate(xs.len());
        padded
    }

    #[test]
    fn inverse_roots_are_accurate_at_every_magnitude() {
        let xs: Vec<f32> = (f32::MIN_POSITIVE.to_bits()..f32::MAX.to_bits())
            .step_by(10_007)
            .map(f32::from_bits)
            .collect();
        for level in SimdLevel::available() {
            let mut worst = 0.0_f64;
            for (&x, y) in xs.iter().zip(map(level, &xs, None)) {
                worst = worst.max((f64::from(y) * f64::from(x).sqrt() - 1.0).abs());
            }
            assert!(worst < RSQRT_ERROR, "{level}: error {worst:e}");
            let at_zero = map(level, &[0.0], None)[0];
            assert!(at_zero.is_finite() && at_zero * 0.0 == 0.0);
        }
    }

    #[test]
    fn powers_are_accurate_for_every_exponent() {
        for exponent in [0.01, 0.5, 1.0, 2.0, 7.3, 50.0, 300.0, 1e3, 1e4, 1e6] {
            let power = Power::new(exponent);
            let ds: Vec<f32> = (0..20_000)
                .map(|i| power.cut() * (i as f32 / 20_000.0).powi(3))
                .collect();
            for level in SimdLevel::available() {
                let mut worst = 0.0_f64;
                for (&d, p) in ds.iter().zip(map(level, &ds, Some(power))) {
                    let exact = (f64::from(exponent) * libm::log1p(-f64::from(d))).exp();
                    worst = worst.max((f64::from(p) / exact - 1.0).abs());
                }
                assert!(
                    worst < POWER_ERROR,
                    "{level}: error {worst:e} for exponent {exponent}"
                );
            }
        }
    }

    #[test]
    fn the_cut_is_where_powers_fall_below_the_flush() {
        for exponent in [1.0_f32, 10.0, 1e3, 1e5] {
            let cut = f64::from(Power::new(exponent).cut());
            let there = (f64::from(exponent) * libm::log1p(-cut)).exp();
            // Rounding 1 - 2^-24 to f32 may move it by half.
            assert!(
                (0.4..=1.6).contains(&(there / FLUSH)),
                "{exponent}: {there:e}"
            );
        }
        for odd in [0.0, -1.0, f32::NAN] {
            assert_eq!(Power::new(odd).cut(), 1.0);
            assert_eq!(
                map(SimdLevel::Scalar, &[0.75], Some(Power::new(odd))),
                [1.0]
            );
        }
    }
}
