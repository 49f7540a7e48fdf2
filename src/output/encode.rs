//! From linear light to codes of 0 to 255: by the sRGB transfer function (IEC 61966-2-1), or linearly.
//!
//! A **code** is the encoded value on the scale of a byte, before rounding; errors are measured in codes. There is a
//! reference in `f64` and the same in SIMD lanes. Everywhere light is clamped to `[0, 1]` first and NaN is black. An
//! image has one [`Encoding`], so lanes branch on it once and not within the arithmetic. Plain [`encode`], [`encode_u8`] and
//! [`decode`] are sRGB.
//!
//! The linear code of `x` is `255 x`: in lanes one multiplication and one addition, fused or not, hence two roundings.
//!
//! For sRGB, in lanes `x^(1/2.4)` is a polynomial of degree 5 in `t = x^(1/4)`, as `t^(5/3)` is smooth on `[0.236, 1]` where
//! `x^(1/2.4)` is steep. The root comes from an integer seed `y` of `x^(-1/4)`, good to 3.2 %: with `q = x y^4`,
//! which is within 13.5 % of 1, `t = x y^3 q^(-3/4)` exactly, and that power is a polynomial of degree 4 (relative error 1.1e-6, at
//! most 0.0005 codes). The error against the reference is below [`LANES_ERROR`] codes, with and without fused
//! multiply-add.

use super::Encoding;
use crate::simd::{Level, Simd, dispatch};
use fearless_simd::prelude::*;

/// Linear light up to which the curve is a straight line.
const TOE: f64 = 0.003_130_8;

/// Bound of the difference, in codes, between [`encode_codes_lanes`] of [`Encoding::Srgb`] and [`encode`].
pub const LANES_ERROR: f64 = 0.01;

/// The same of [`Encoding::Linear`]: two roundings of numbers below 256, each by at most 2^-17.
pub const LINEAR_LANES_ERROR: f64 = 1.0 / 65_536.0;

impl Encoding {
    /// The code, in `0..=255` and not rounded, of linear light.
    #[must_use]
    pub fn encode(self, linear: f64) -> f64 {
        match self {
            Self::Srgb => encode(linear),
            Self::Linear => 255.0 * clamped(linear),
        }
    }

    /// The byte for linear light: its code, halves rounded up.
    #[must_use]
    pub fn encode_u8(self, linear: f64) -> u8 {
        (self.encode(linear) + 0.5) as u8
    }

    /// The linear light that has the code; codes outside of `0..=255` are clamped, NaN is black.
    #[must_use]
    pub fn decode(self, code: f64) -> f64 {
        match self {
            Self::Srgb => decode(code),
            Self::Linear => clamped(code / 255.0),
        }
    }

    /// Bound of the difference, in codes, between [`encode_codes_lanes`] and [`encode`](Self::encode).
    #[must_use]
    pub fn lanes_error(self) -> f64 {
        match self {
            Self::Srgb => LANES_ERROR,
            Self::Linear => LINEAR_LANES_ERROR,
        }
    }
}

/// Within `[0, 1]`; NaN is 0.
fn clamped(x: f64) -> f64 {
    // The comparison is false for NaN.
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

/// The sRGB code, in `0..=255` and not rounded, of linear light.
#[must_use]
pub fn encode(linear: f64) -> f64 {
    let x = clamped(linear);
    255.0
        * if x <= TOE {
            12.92 * x
        } else {
            1.055 * libm::pow(x, 1.0 / 2.4) - 0.055
        }
}

/// The linear light that has the sRGB code; codes outside of `0..=255` are clamped, NaN is black.
#[must_use]
pub fn decode(code: f64) -> f64 {
    let c = clamped(code / 255.0);
    if c <= 12.92 * TOE {
        c / 12.92
    } else {
        libm::pow((c + 0.055) / 1.055, 2.4)
    }
}

/// The sRGB byte for linear light: its code, halves rounded up.
#[must_use]
pub fn encode_u8(linear: f64) -> u8 {
    Encoding::Srgb.encode_u8(linear)
}

/// The codes, in `0..=255` and not rounded, of linear light.
#[inline(always)]
pub fn encode_codes_lanes<S: Simd>(simd: S, encoding: Encoding, linear: S::f32s) -> S::f32s {
    match encoding {
        Encoding::Srgb => srgb_codes(simd, linear, 0.0).min(S::f32s::splat(simd, 255.0)),
        Encoding::Linear => linear_codes(simd, linear, 0.0),
    }
}

/// The codes, in `0..=255` and not rounded, of all of `linear`; `codes` has the same length.
pub fn encode_codes(level: Level, encoding: Encoding, linear: &[f32], codes: &mut [f32]) {
    dispatch!(level, simd => encode_codes_slice(simd, encoding, linear, codes));
}

#[inline(always)]
fn encode_codes_slice<S: Simd>(simd: S, encoding: Encoding, linear: &[f32], codes: &mut [f32]) {
    let lanes = S::f32s::LEN;
    for (linear, codes) in linear.chunks(lanes).zip(codes.chunks_mut(lanes)) {
        let count = linear.len().min(codes.len());
        let mut vector = S::f32s::splat(simd, 0.0);
        vector.as_mut_slice()[..count].copy_from_slice(&linear[..count]);
        let encoded = encode_codes_lanes(simd, encoding, vector);
        codes[..count].copy_from_slice(&encoded.as_slice()[..count]);
    }
}

/// Light within `[0, 1]`; NaN is 0.
#[inline(always)]
fn clamped_lanes<S: Simd>(simd: S, linear: S::f32s) -> S::f32s {
    let zero = S::f32s::splat(simd, 0.0);
    // The comparison is false for NaN; after it `min` meets none.
    let x = linear.simd_gt(zero).select(linear, zero);
    x.min(S::f32s::splat(simd, 1.0))
}

/// Linear codes of light plus `shift`.
#[inline(always)]
fn linear_codes<S: Simd>(simd: S, linear: S::f32s, shift: f32) -> S::f32s {
    let x = clamped_lanes(simd, linear);
    x.mul_add(S::f32s::splat(simd, 255.0), S::f32s::splat(simd, shift))
}

/// sRGB codes of light plus `shift`; of full light, up to 0.01 more.
#[inline(always)]
fn srgb_codes<S: Simd>(simd: S, linear: S::f32s, shift: f32) -> S::f32s {
    let splat = |v: f32| S::f32s::splat(simd, v);
    let x = clamped_lanes(simd, linear);

    let seed = S::u32s::splat(simd, 0x4f58_8300) - (x.bitcast::<S::u32s>() >> 2);
    let y: S::f32s = seed.bitcast();
    let near = (x * y) * (y * y);
    let q = near * y;
    // q^(-3/4), interpolated at Chebyshev's points of [0.883, 1.1345].
    let correction = splat(0.550_977_6)
        .mul_add(q, splat(-2.815_646_4))
        .mul_add(q, splat(5.797_552_6))
        .mul_add(q, splat(-6.102_037_4))
        .mul_add(q, splat(3.569_153_3));
    let t = near * correction;

    // 255 (1.055 t^(5/3) - 0.055), Chebyshev fit on [TOE^(1/4), 1], error 0.0025.
    let curve = splat(-16.003_542)
        .mul_add(t, splat(69.551_82))
        .mul_add(t, splat(-142.176_7))
        .mul_add(t, splat(317.274_57))
        .mul_add(t, splat(42.068_37))
        .mul_add(t, splat(shift - 15.715_575));
    let line = x.mul_add(splat(12.92 * 255.0), splat(shift));
    x.simd_le(splat(TOE as f32)).select(line, curve)
}

/// Opaque pixels of linear colours: `to_le_bytes` of a lane is `[red, green, blue, 255]`.
#[inline(always)]
pub fn encode_lanes<S: Simd>(simd: S, encoding: Encoding, rgb: [S::f32s; 3]) -> S::u32s {
    let [r, g, b] = rgb;
    let (r, g, b) = match encoding {
        Encoding::Srgb => (
            srgb_codes(simd, r, 0.5),
            srgb_codes(simd, g, 0.5),
            srgb_codes(simd, b, 0.5),
        ),
        Encoding::Linear => (
            linear_codes(simd, r, 0.5),
            linear_codes(simd, g, 0.5),
            linear_codes(simd, b, 0.5),
        ),
    };
    let (r, g, b) = (byte_lanes::<S>(r), byte_lanes::<S>(g), byte_lanes::<S>(b));
    r | (g << 8) | (b << 16) | S::u32s::splat(simd, 0xff00_0000)
}

/// Codes in `[0.5, 255.51]`, rounded down: through i32, which every instruction set converts to.
#[inline(always)]
fn byte_lanes<S: Simd>(code: S::f32s) -> S::u32s {
    code.to_int::<S::i32s>().bitcast()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::SimdLevel;

    #[inline(always)]
    fn codes_of<S: Simd>(
        simd: S,
        encoding: Encoding,
        xs: &[f32],
        codes: &mut [f32],
        pixels: &mut [u32],
    ) {
        let n = S::f32s::LEN;
        for ((x, code), pixel) in xs
            .chunks_exact(n)
            .zip(codes.chunks_exact_mut(n))
            .zip(pixels.chunks_exact_mut(n))
        {
            let x = S::f32s::from_slice(simd, x);
            encode_codes_lanes(simd, encoding, x).store_slice(code);
            encode_lanes(simd, encoding, [x, x * 0.5, x * 0.25]).store_slice(pixel);
        }
    }

    fn run(level: Level, encoding: Encoding, xs: &[f32]) -> (Vec<f32>, Vec<u32>) {
        let mut padded = xs.to_vec();
        padded.resize(xs.len().next_multiple_of(16), 0.0);
        let (mut codes, mut pixels) = (vec![0.0; padded.len()], vec![0; padded.len()]);
        dispatch!(level, simd => codes_of(simd, encoding, &padded, &mut codes, &mut pixels));
        (codes[..xs.len()].to_vec(), pixels[..xs.len()].to_vec())
    }

    fn levels_and_encodings() -> impl Iterator<Item = (SimdLevel, Encoding)> {
        SimdLevel::available().flat_map(|level| Encoding::ALL.map(|encoding| (level, encoding)))
    }

    /// Every 97th float of `[0, 1.1)` near and beyond the toe, and fewer below it.
    fn inputs() -> Vec<f32> {
        let (low, high) = (0.003_f32.to_bits(), 1.1_f32.to_bits());
        (0..low)
            .step_by(100_003)
            .chain((low..high).step_by(97))
            .map(f32::from_bits)
            .collect()
    }

    #[test]
    fn the_reference_goes_there_and_back() {
        assert_eq!(encode(0.0), 0.0);
        assert!((encode(1.0) - 255.0).abs() < 1e-12);
        // Mid-grey by the standard's own table: 0.2140 <-> 127.5.
        assert!((encode(0.214_041_14) - 127.5).abs() < 1e-4);
        for encoding in Encoding::ALL {
            for byte in 0..=255_u8 {
                let light = encoding.decode(f64::from(byte));
                assert_eq!(encoding.encode_u8(light), byte);
            }
            for odd in [f64::NAN, -1.0, f64::NEG_INFINITY] {
                assert_eq!((encoding.encode_u8(odd), encoding.decode(odd)), (0, 0.0));
            }
            assert_eq!(encoding.encode_u8(f64::INFINITY), 255);
            assert_eq!(encoding.decode(256.0), 1.0);
        }
    }

    #[test]
    fn linear_codes_are_in_proportion_and_halves_are_rounded_up() {
        let linear = Encoding::Linear;
        assert_eq!((linear.encode(0.0), linear.encode(0.2)), (0.0, 51.0));
        assert_eq!((linear.encode(1.0), linear.encode(7.0)), (255.0, 255.0));
        for (light, byte) in [(0.499, 0), (0.5, 1), (1.499, 1), (253.5, 254), (254.5, 255)] {
            assert_eq!(linear.encode_u8(light / 255.0), byte, "{light} of 255");
        }
    }

    #[test]
    fn encodings_are_found_by_their_names() {
        for encoding in Encoding::ALL {
            assert_eq!(encoding.to_string().parse(), Ok(encoding));
        }
        assert_eq!(
            "gamma".parse::<Encoding>(),
            Err("no encoding is called 'gamma'; there are srgb, linear".to_owned())
        );
    }

    #[test]
    fn lanes_stay_within_the_stated_error_and_round_like_the_reference() {
        let xs = inputs();
        for (level, encoding) in levels_and_encodings() {
            let bound = encoding.lanes_error();
            let (codes, pixels) = run(level.token().expect("available"), encoding, &xs);
            let mut worst = 0.0_f64;
            for ((&x, &code), &pixel) in xs.iter().zip(&codes).zip(&pixels) {
                worst = worst.max((f64::from(code) - encoding.encode(f64::from(x))).abs());
                let bytes = pixel.to_le_bytes();
                assert_eq!(bytes[3], 255);
                for (byte, factor) in bytes.into_iter().zip([1.0, 0.5, 0.25]) {
                    let exact = encoding.encode(f64::from(x) * factor);
                    let off = (f64::from(byte) - exact).abs() - 0.5;
                    assert!(
                        off <= bound,
                        "{level}, {encoding}: {x} * {factor} became {byte}"
                    );
                }
            }
            assert!(worst < bound, "{level}, {encoding}: error {worst}");
        }
    }

    #[test]
    fn slices_of_any_length_are_encoded_as_single_lanes_are() {
        let xs = inputs();
        for (level, encoding) in levels_and_encodings() {
            let token = level.token().expect("available");
            let (want, _) = run(token, encoding, &xs[..100]);
            for len in [0, 1, 3, 16, 17, 100] {
                let mut codes = vec![-1.0; len];
                encode_codes(token, encoding, &xs[..len], &mut codes);
                assert_eq!(codes, want[..len], "{level}, {encoding}");
            }
        }
    }

    #[test]
    fn light_out_of_range_is_clamped() {
        let odd = [
            f32::NAN,
            f32::NEG_INFINITY,
            -1.0,
            -0.0,
            f32::INFINITY,
            f32::MAX,
            1.0,
        ];
        for (level, encoding) in levels_and_encodings() {
            let (codes, pixels) = run(level.token().expect("available"), encoding, &odd);
            assert_eq!(codes[..4], [0.0; 4], "{level}, {encoding}");
            assert_eq!(pixels[..4], [0xff00_0000; 4], "{level}, {encoding}");
            for (&code, &pixel) in codes[4..].iter().zip(&pixels[4..]) {
                let off = (f64::from(code) - 255.0).abs();
                assert!(off < encoding.lanes_error(), "{level}, {encoding}");
                assert_eq!(pixel & 0xff, 255, "{level}, {encoding}");
            }
        }
    }

    #[test]
    fn levels_with_fused_multiply_add_agree_to_the_bit() {
        let xs = inputs();
        for encoding in Encoding::ALL {
            let fused: Vec<_> = [SimdLevel::Avx2, SimdLevel::Avx512]
                .into_iter()
                .filter_map(SimdLevel::token)
                .map(|level| run(level, encoding, &xs))
                .collect();
            for pair in fused.windows(2) {
                assert!(
                    pair[0] == pair[1],
                    "AVX2 and AVX-512 encode the same light differently ({encoding})"
                );
            }
        }
    }
}
