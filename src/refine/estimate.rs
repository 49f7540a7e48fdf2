//! How wrong a leaf is, estimated.
//!
//! All errors are mean squares over a leaf's area and the three channels, in squared 8-bit codes of the *encoded*
//! colour, clamped and encoded as the pixel will be.
//!
//! **At edge midpoints.** Let `d` be the deviation of the encoded interpolated colour from the encoded true one. Where
//! the true colour is smooth, `d` is close to a quadratic over the leaf; a quadratic is given by its values at the three
//! corners, `u_i`, and at the three edge midpoints, `m_k`, and its mean square is the quadratic form of the P2 finite
//! element's mass matrix, see [`mean_square`]. At a leaf's own corners `d` is zero and the form reduces to
//! `8/45 (sum m_k^2 + sum_{k<l} m_k m_l)`.
//!
//! **Inside.** A highlight may be smaller than the leaf and touch none of its edges. A leaf of more than
//! [`PIXELS_PER_SAMPLE`] pixels is sampled inside, and the mean over samples replaces the quadratic's when it is larger.

use crate::geometry::Vec3s;
use crate::illumination::PointBatch;
use crate::output::encode::encode_codes_lanes;
use crate::output::{Encoding, Interpolation};
use crate::parallel::Exec;
use crate::scene::{View, World};
use crate::simd::{Level, Simd, dispatch};
use fearless_simd::prelude::*;

/// A leaf gets one sample inside for so many pixels.
pub const PIXELS_PER_SAMPLE: u32 = 256;

/// Share of the summed squares of the three edges' surplus (over all channels) that is a leaf's mean squared error when
/// they are equally large and point the same way: `8/45 * 6/3`, averaged over three channels.
pub const EDGE_SHARE: f32 = 16.0 / 135.0;

/// Most samples inside one leaf.
pub const MAX_SAMPLES: usize = 8;

/// Samples that are evaluated together, as a rule at most: what fits into a piece of work.
pub const SAMPLES_AT_ONCE: usize = 2048;

/// Points that are illuminated to be compared with interpolated colours.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// Interpolated colours are linear, or codes.
    interpolation: Interpolation,
    batch: PointBatch,
    colours: Vec3s,
    interpolated: Vec3s,
    deviation: Vec3s,
}

impl Samples {
    /// Says how colours are interpolated, for samples added from now on: as linear light (the default), or as codes.
    pub(super) fn set_interpolation(&mut self, interpolation: Interpolation) {
        self.interpolation = interpolation;
    }

    /// Removes all samples and keeps the memory.
    pub fn clear(&mut self) {
        self.batch.clear();
        self.colours.clear();
        self.interpolated.clear();
        self.deviation.clear();
    }

    /// Makes room for `samples` samples.
    pub fn reserve(&mut self, samples: usize) {
        self.batch.reserve(samples);
        for array in [
            &mut self.colours,
            &mut self.interpolated,
            &mut self.deviation,
        ] {
            array.reserve(samples);
        }
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.batch.len()
    }

    /// True when there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.batch.is_empty()
    }

    /// Adds a point with its (unnormalized) normal, its material and the colour interpolation gives there.
    pub fn push(
        &mut self,
        point: [f32; 3],
        normal: [f32; 3],
        material: u16,
        interpolated: [f32; 3],
    ) {
        self.batch.push(point, normal, material);
        self.interpolated.push(interpolated);
    }

    /// Illuminates all points and compares, as the view has it.
    pub fn illuminate(&mut self, exec: Exec, world: &World, view: &View) {
        self.batch.illuminate(exec, world, view.eye);
        self.colours.clear();
        for sample in 0..self.batch.len() {
            self.colours.push(self.batch.colour(sample));
        }
        deviations(
            exec.level,
            view.encoding,
            &self.colours,
            &self.interpolated,
            self.interpolation,
            &mut self.deviation,
        );
    }

    /// True linear colour of a sample.
    #[must_use]
    pub fn colour(&self, sample: usize) -> [f32; 3] {
        self.colours.get(sample)
    }

    /// Encoded true colour less encoded interpolated colour of a sample, in codes.
    #[must_use]
    pub fn deviation(&self, sample: usize) -> [f32; 3] {
        self.deviation.get(sample)
    }
}

/// The codes of linear `colours` less those of `interpolated`, which are linear, or codes already.
pub fn deviations(
    level: Level,
    encoding: Encoding,
    colours: &Vec3s,
    interpolated: &Vec3s,
    interpolation: Interpolation,
    out: &mut Vec3s,
) {
    out.resize(colours.len());
    let is_encoded = interpolation == Interpolation::EncodedAffine;
    dispatch!(level, simd => {
        channel_deviations(simd, encoding, &colours.x, &interpolated.x, is_encoded, &mut out.x);
        channel_deviations(simd, encoding, &colours.y, &interpolated.y, is_encoded, &mut out.y);
        channel_deviations(simd, encoding, &colours.z, &interpolated.z, is_encoded, &mut out.z);
    });
}

#[inline(always)]
fn channel_deviations<S: Simd>(
    simd: S,
    encoding: Encoding,
    colours: &[f32],
    interpolated: &[f32],
    is_encoded: bool,
    out: &mut [f32],
) {
    let lanes = S::f32s::LEN;
    let mut done = 0;
    while done < out.len() {
        let count = lanes.min(out.len() - done);
        let load = |from: &[f32]| {
            let mut vector = S::f32s::splat(simd, 0.0);
            vector.as_mut_slice()[..count].copy_from_slice(&from[done..done + count]);
            vector
        };
        let shown = load(interpolated);
        let shown = if is_encoded {
            shown
        } else {
            encode_codes_lanes(simd, encoding, shown)
        };
        let difference = encode_codes_lanes(simd, encoding, load(colours)) - shown;
        out[done..done + count].copy_from_slice(&difference.as_slice()[..count]);
        done += count;
    }
}

/// Mean square over a triangle of the quadratic with values `corners` at its corners and `midpoints` at the middles of
/// its edges, edge `k` running from corner `k` to corner `k + 1`; summed over channels and divided by three.
///
/// This is `1/180 (6 sum u_i^2 - 2 sum_{i<j} u_i u_j + 32 sum m_k^2 + 32 sum_{k<l} m_k m_l - 8 sum u_i m_opposite(i))`,
/// the mass matrix of the quadratic (P2) triangle.
#[must_use]
pub fn mean_square(corners: [[f32; 3]; 3], midpoints: [[f32; 3]; 3]) -> f32 {
    let mut sum = 0.0;
    for channel in 0..3 {
        let u = corners.map(|c| c[channel]);
        let m = midpoints.map(|c| c[channel]);
        let squares = |v: [f32; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        let pairs = |v: [f32; 3]| v[0] * v[1] + v[1] * v[2] + v[2] * v[0];
        // Edge 1, from corner 1 to corner 2, is opposite to corner 0, and so on around.
        let opposite = u[0] * m[1] + u[1] * m[2] + u[2] * m[0];
        sum += 6.0 * squares(u) - 2.0 * pairs(u) + 32.0 * (squares(m) + pairs(m)) - 8.0 * opposite;
    }
    // The form is positive definite; rounding may leave a tiny negative sum.
    (sum / (180.0 * 3.0)).max(0.0)
}

/// The square of a small difference of two linear colours, in squared codes and as a mean over the channels, one of them being `colour`.
#[must_use]
pub fn squared_codes(encoding: Encoding, colour: [f32; 3], difference: [f32; 3]) -> f32 {
    let squares = (0..3).map(|channel| {
        let squared_slope = match encoding {
            // That of the square root, as above, and not of black. White is white.
            Encoding::Srgb => 127.5 * 127.5 / colour[channel].clamp(0.002, 1.0),
            Encoding::Linear => 255.0 * 255.0,
        };
        squared_slope * difference[channel] * difference[channel]
    });
    squares.sum::<f32>() / 3.0
}

/// How many points inside a leaf of `pixels` pixels are sampled.
#[must_use]
pub fn sample_count(pixels: u32) -> usize {
    ((pixels / PIXELS_PER_SAMPLE) as usize).min(MAX_SAMPLES)
}

/// Weights of the three corners for sample `index` of a leaf: the R2 sequence (the plane's generalization of the golden
/// ratio), folded from the unit square into the triangle. Any number of its first points is evenly spread.
#[must_use]
pub fn sample_weights(index: usize) -> [f32; 3] {
    // The inverse, and its square, of the real root of x^3 = x + 1.
    const STEP: [f32; 2] = [0.754_877_7, 0.569_840_3];
    let n = index as f32 + 0.5;
    let (mut a, mut b) = ((n * STEP[0]).fract(), (n * STEP[1]).fract());
    if a + b > 1.0 {
        (a, b) = (1.0 - a, 1.0 - b);
    }
    [1.0 - a - b, a, b]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_square_of_a_quadratic_matches_dense_sampling() {
        let corners = [[1.0, 0.0, -2.0], [0.5, 0.0, 3.0], [-1.0, 0.0, 1.0]];
        let midpoints = [[2.0, 4.0, 0.0], [-1.0, 0.0, 1.5], [0.25, -3.0, -2.0]];
        let steps = 400;
        let (mut sum, mut count) = (0.0_f64, 0.0);
        for i in 0..steps {
            for j in 0..steps - i {
                // Centroids of the upright cells are enough for a smooth integrand.
                let l1 = (f64::from(i) + 1.0 / 3.0) / f64::from(steps);
                let l2 = (f64::from(j) + 1.0 / 3.0) / f64::from(steps);
                let l = [1.0 - l1 - l2, l1, l2];
                for channel in 0..3 {
                    let mut value = 0.0;
                    for k in 0..3 {
                        let next = (k + 1) % 3;
                        value += l[k] * (2.0 * l[k] - 1.0) * corners[k][channel] as f64
                            + 4.0 * l[k] * l[next] * midpoints[k][channel] as f64;
                    }
                    sum += value * value;
                }
                count += 3.0;
            }
        }
        let expected = sum / count;
        let got = f64::from(mean_square(corners, midpoints));
        assert!(
            (got / expected - 1.0).abs() < 0.01,
            "{got} against {expected}"
        );
    }

    #[test]
    fn samples_lie_inside_and_spread_out() {
        let mut quarters = [0; 4];
        for index in 0..64 {
            let w = sample_weights(index);
            assert!(w.iter().all(|&v| (0.0..=1.0).contains(&v)), "{w:?}");
            assert!((w.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            let quarter = w.iter().position(|&v| v > 0.5).unwrap_or(3);
            quarters[quarter] += 1;
        }
        assert!(
            quarters.iter().all(|&n| (8..=24).contains(&n)),
            "each quarter of the triangle has about a quarter of the samples: {quarters:?}"
        );
    }
}
