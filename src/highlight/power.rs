//! A power function for bounds: quick, the same on every machine, with a known error.
//!
//! The same method as [`illumination::power`](crate::illumination::power), one number at a time in `f64`:
//! `c^s = exp2(s log2 c)` with `c = 2^k m`, `log2 m = f Q(f)` for `f = m - 1` (`Q` of degree 8, relative error 3e-8) and
//! `exp2` of degree 5 (1e-7). The exponent of two is cut off at -60, so the relative error is below
//! `60 ln 2 * 3e-8 + 1e-7 < 2e-6`.

/// Bound of the relative error of [`power`] for powers above 2^-60.
const ERROR: f64 = 2e-6;

/// Least exponent of two.
const CUT: f64 = -60.0;

/// Not less than `base^exponent`, for a base in `(0, 1]` and an exponent that is not negative.
#[inline]
pub(super) fn power_above(base: f64, exponent: f64) -> f64 {
    power(base, exponent) * (1.0 + ERROR)
}

/// Not more than `base^exponent`, for a base in `(0, 1]` and an exponent that is not negative.
#[inline]
pub(super) fn power_below(base: f64, exponent: f64) -> f64 {
    // What was cut off is less than what is subtracted.
    (power(base, exponent) * (1.0 - ERROR) - 1e-17).max(0.0)
}

#[inline]
fn power(base: f64, exponent: f64) -> f64 {
    // The bits of sqrt(1/2): m is in [sqrt(1/2), sqrt(2)).
    const LEAST: i64 = 0x3fe6_a09e_667f_3bcd;
    let bits = base.to_bits() as i64;
    let k = (bits - LEAST) >> 52;
    let f = f64::from_bits((bits - (k << 52)) as u64) - 1.0;
    // Even and odd parts side by side: the chain of dependent operations is half as long.
    let f2 = f * f;
    let f4 = f2 * f2;
    let low = (1.442_695_004 - 0.721_347_468_2 * f) + f2 * (0.480_910_753_7 - 0.360_693_269 * f);
    let high = (0.287_903_252_2 - 0.239_169_853_2 * f)
        + f2 * (0.216_078_288_8 - 0.205_862_135_2 * f)
        + f4 * 0.123_109_839_4;
    let y = exponent * (k as f64 + f * (low + f4 * high));
    let y = if y > CUT { y } else { CUT };
    // Adding 1.5 x 2^52 rounds to an integer, left in the low bits.
    const MAGIC: f64 = 6_755_399_441_055_744.0;
    let rounded = y + MAGIC;
    let f = y - (rounded - MAGIC);
    let f2 = f * f;
    let p = (1.000_000_075 + 0.693_147_188 * f)
        + f2 * (0.240_221_074_9 + 0.055_503_571_14 * f)
        + f2 * f2 * (0.009_676_031_918 + 0.001_339_086_336 * f);
    f64::from_bits(p.to_bits().wrapping_add(rounded.to_bits() << 52))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_enclosed() {
        for exponent in [0.0, 0.3, 1.0, 2.0, 17.5, 300.0, 1e4, 1e30] {
            for i in 1..=20_000 {
                let base = if i % 2 == 0 {
                    f64::from(i) / 20_000.0
                } else {
                    (-f64::from(i) * 1e-3).exp()
                };
                let exact = libm::pow(base, exponent);
                let (below, above) = (power_below(base, exponent), power_above(base, exponent));
                assert!(
                    below <= exact && exact <= above,
                    "{base}^{exponent}: {below:e} {exact:e} {above:e}"
                );
                assert!(above - below < 5e-6 * exact + 1e-16, "{base}^{exponent}");
            }
        }
    }
}
