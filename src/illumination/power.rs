//! Inverse square root and power function in SIMD lanes, the same bits on every machine with fused multiply-add.
//!
//! Hardware estimates differ between vendors, so all start from integers and use multiplications and additions only.
//!
//! **Inverse square root.** The seed is within 3.5 %; a Newton step turns an error `e` into at most `1.5 e^2`. [`rsqrt_lanes`] takes three, the last
//! in residual form, so that little more than rounding the result is left. [`rsqrt_quick`] takes two with tuned constants: seed and first step
//! are Jan Kadlec's (error 6.6e-4 with either sign), the second errs to one side by at most 6.4e-7, half of which is made good by scaling
//! its constants. Rounding adds 1.6e-7 with fused operations (4.7e-7 is the worst for all `f32` of two binades, hence for all normal ones) and 2.2e-7 without.
//!
//! **Power.** `c^s` for a cosine given by `q = |a - b|^2` of unit vectors, `c = 1 - q / 2`, is `exp2(s log2(c))`. A caller forms `a - b`
//! by subtraction, which keeps the relative accuracy of `q` where `c` is near 1 and a large exponent needs it
//! (DESIGN.md, "Illumination"). `c = 2^k m` with `m` in `[sqrt(1/2), sqrt(2))`; `log2(m) = f Q(f)` with `f = m - 1`, formed as
//! `2^-k (1 - q / 2) - 1` by one fused operation, and `f = -q / 2`, exactly, where `k = 0`. For exponents of `STEEP` and more,
//! `c > 0.594` wherever the power is not flushed, and `log2(c) = q R(q)` saves that reduction. `Q` has degree 6, `R`
//! degree 5, `exp2` degree 4: minimax polynomials of the relative error, found by Remez's exchange in double precision and rounded to `f32`
//! coefficient by coefficient. Their errors are 1.1e-6, 1.2e-6 and 3.6e-6.
//!
//! **Error.** What is below [`FLUSH`] becomes zero, so the exponent `y = s log2(c)` is above -24, and its relative
//! error of 1.2e-6 in the polynomial and less than 4e-7 by rounding (in the polynomial, three products and a sum) becomes one of at most
//! 24 ln 2 x 1.6e-6 = 2.7e-5 in the power, to which `exp2` adds 4e-6: given `q`, the relative error is below [`POWER_ERROR`],
//! whatever `s` is. That is at most 0.01 codes of 8 bits, linear or sRGB: relative errors count most at white, where a code is 0.4 % or more.
//! An error `e` of the unit vectors across `a - b` is harmless; in general it becomes one of `2 |a - b| e`
//! in `q`, hence of at most `0.61 sqrt(s) e` in the power (the maximum of `exp(-x) sqrt(2 x s)`), which is
//! 4e-6 at `s = 1000` for `e = 2e-7`. An error of length alone of `a` or `b` counts less: it changes `q` by
//! `e q` to first order, and the power by at most `24 ln 2 e`. For `0 < s < 1` the slope of `c^s` at `c = 0` is infinite and so is the amplification there.

use crate::simd::Simd;
use fearless_simd::prelude::*;

/// Powers below this are flushed to zero: with 255 codes and the slope of the sRGB curve they are far from visible.
pub const FLUSH: f64 = 1.0 / (1_u32 << 24) as f64;

/// Bound of the relative error of [`rsqrt_lanes`].
pub const RSQRT_ERROR: f64 = 2e-7;

/// Bound of the relative error of [`rsqrt_quick`].
pub const QUICK_RSQRT_ERROR: f64 = 6e-7;

/// Bound of the relative error of [`Power::lanes`], given the squared distance.
pub const POWER_ERROR: f64 = 4e-5;

/// From this exponent on, powers above [`FLUSH`] have `c > 2^(-24/32) = 0.594`: a logarithm without reduction of the range.
const STEEP: f32 = 32.0;

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

/// `1 / sqrt(x)` like [`rsqrt_lanes`] in nine operations instead of twelve, with a relative error below [`QUICK_RSQRT_ERROR`].
#[inline(always)]
pub fn rsqrt_quick<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let splat = |v: f32| S::f32s::splat(simd, v);
    let seed = S::u32s::splat(simd, 0x5f1f_fff9) - (x.bitcast::<S::u32s>() >> 1);
    let y: S::f32s = seed.bitcast();
    // 1 / (k sqrt(x)) for k = 0.703952253, within 6.6e-4.
    let y = y * (x * -y).mul_add(y, splat(2.389_244_6));
    // With 3/2 k and k^3 / 2, times 1 + 3.17e-7: half of what the step falls short at most.
    y * (x * splat(-0.174_421_4) * y).mul_add(y, splat(1.055_928_7))
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
            -2.0 * libm::expm1(FLUSH.ln() / f64::from(exponent))
        } else {
            2.0
        };
        Self {
            exponent,
            cut: cut as f32,
        }
    }

    /// Whether the square of [`QUICK_RSQRT_ERROR`] matters: from 1e7 on it changes a power by more than 5e-6.
    #[inline(always)]
    #[must_use]
    pub fn is_extreme(self) -> bool {
        self.exponent >= 1e7
    }

    /// The power is zero exactly where the squared distance is not below this; at most 2.
    #[inline(always)]
    #[must_use]
    pub fn cut(self) -> f32 {
        self.cut
    }

    /// `c^s = (1 - q/2)^s` for a squared distance `0 <= q < cut`; anything where `q` is outside of that.
    #[inline(always)]
    pub fn lanes<S: Simd>(self, simd: S, q: S::f32s) -> S::f32s {
        let splat = |v: f32| S::f32s::splat(simd, v);
        if self.exponent >= STEEP {
            let slope = splat(-0.013_086_62)
                .mul_add(q, splat(0.001_727_276_8))
                .mul_add(q, splat(-0.027_618_18))
                .mul_add(q, splat(-0.059_076_65))
                .mul_add(q, splat(-0.180_412_35))
                .mul_add(q, splat(-0.721_346_6));
            return exp2_lanes(simd, q * splat(self.exponent) * slope);
        }
        let c: S::i32s = q.mul_add(splat(-0.5), splat(1.0)).bitcast();
        // Exponent relative to sqrt(1/2); the shift is arithmetic.
        let k = (c - S::i32s::splat(simd, 0x3f35_04f3)) >> 23;
        // -2^-k / 2, so that f = 2^-k (1 - q/2) - 1 is rounded once, and not at all where k = 0.
        let scale: S::f32s = (S::i32s::splat(simd, 0xbf00_0000_u32 as i32) - (k << 23)).bitcast();
        let f = q.mul_add(scale, scale.mul_add(splat(-2.0), splat(-1.0)));
        let slope = splat(0.171_624_56)
            .mul_add(f, splat(-0.269_320_22))
            .mul_add(f, splat(0.295_699_5))
            .mul_add(f, splat(-0.359_371_63))
            .mul_add(f, splat(0.480_626_76))
            .mul_add(f, splat(-0.721_363_6))
            .mul_add(f, splat(1.442_696_5));
        let log2 = f.mul_add(slope, k.to_float::<S::f32s>());
        exp2_lanes(simd, log2 * splat(self.exponent))
    }
}

/// `2^y` for `-125 <= y <= 127`, with a relative error below 4e-6 besides that of `y`.
#[inline(always)]
fn exp2_lanes<S: Simd>(simd: S, y: S::f32s) -> S::f32s {
    let splat = |v: f32| S::f32s::splat(simd, v);
    // Adding 1.5 x 2^23 rounds to an integer and leaves it in the low mantissa bits.
    let magic = splat(12_582_912.0);
    let rounded = y + magic;
    let f = y - (rounded - magic);
    // The last coefficient is 1, so that 2^0 is.
    let p = splat(0.009_782_913)
        .mul_add(f, splat(0.055_976_883))
        .mul_add(f, splat(0.240_207_1))
        .mul_add(f, splat(0.693_113_6))
        .mul_add(f, splat(1.0));
    (p.bitcast::<S::u32s>() + (rounded.bitcast::<S::u32s>() << 23)).bitcast()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{SimdLevel, dispatch};

    #[derive(Clone, Copy)]
    enum Function {
        Power(Power),
        Rsqrt,
        QuickRsqrt,
    }

    fn map(level: SimdLevel, xs: &[f32], function: Function) -> Vec<f32> {
        #[inline(always)]
        fn kernel<S: Simd>(simd: S, xs: &mut [f32], function: Function) {
            for chunk in xs.chunks_exact_mut(S::f32s::LEN) {
                let x = S::f32s::from_slice(simd, chunk);
                match function {
                    Function::Power(power) => power.lanes(simd, x),
                    Function::Rsqrt => rsqrt_lanes(simd, x),
                    Function::QuickRsqrt => rsqrt_quick(simd, x),
                }
                .store_slice(chunk);
            }
        }
        let mut padded = xs.to_vec();
        padded.resize(xs.len().next_multiple_of(16), 0.25);
        let level = level.token().expect("available");
        dispatch!(level, simd => kernel(simd, &mut padded, function));
        padded.truncate(xs.len());
        padded
    }

    #[test]
    fn inverse_roots_are_accurate_at_every_magnitude() {
        let xs: Vec<f32> = (f32::MIN_POSITIVE.to_bits()..f32::MAX.to_bits())
            .step_by(10_007)
            .map(f32::from_bits)
            .collect();
        for (function, bound) in [
            (Function::Rsqrt, RSQRT_ERROR),
            (Function::QuickRsqrt, QUICK_RSQRT_ERROR),
        ] {
            for level in SimdLevel::available() {
                let mut worst = 0.0_f64;
                for (&x, y) in xs.iter().zip(map(level, &xs, function)) {
                    worst = worst.max((f64::from(y) * f64::from(x).sqrt() - 1.0).abs());
                }
                assert!(worst < bound, "{level}: error {worst:e}");
                let at_zero = map(level, &[0.0], function)[0];
                assert!(at_zero.is_finite() && at_zero * 0.0 == 0.0);
            }
        }
    }

    #[test]
    fn powers_are_accurate_for_every_exponent() {
        for exponent in [
            0.01, 0.5, 1.0, 2.0, 7.3, 24.0, 31.99, 32.0, 50.0, 300.0, 1e3, 1e4, 1e6, 1e9,
        ] {
            let power = Power::new(exponent);
            let squares: Vec<f32> = (0..20_000)
                .map(|i| power.cut() * (i as f32 / 20_000.0).powi(3))
                .collect();
            for level in SimdLevel::available() {
                let mut worst = 0.0_f64;
                for (&q, p) in squares
                    .iter()
                    .zip(map(level, &squares, Function::Power(power)))
                {
                    let exact = (f64::from(exponent) * libm::log1p(-0.5 * f64::from(q))).exp();
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
            let there = (f64::from(exponent) * libm::log1p(-0.5 * cut)).exp();
            // Rounding 1 - 2^-24 to f32 may move it by half.
            assert!(
                (0.4..=1.6).contains(&(there / FLUSH)),
                "{exponent}: {there:e}"
            );
        }
        for odd in [0.0, -1.0, f32::NAN] {
            assert_eq!(Power::new(odd).cut(), 2.0);
            assert_eq!(
                map(SimdLevel::Scalar, &[0.75], Function::Power(Power::new(odd))),
                [1.0]
            );
        }
    }
}
