//! Images of lower resolution, enlarged while they are handed over.
//!
//! A pixel of an image of divisor `d` stands for `d x d` pixels of the target. Between their centres codes are interpolated linearly along
//! both axes; outside of the outermost centres they stay the same. Pixel `y` of the target lies at
//! `y / d + (2 (y mod d) + 1 - d) / 2d` in pixels of the small image, so there are `d` pairs of weights, in 256ths.

use super::target::{PIXEL_BYTES, Target};
use crate::parallel::Exec;
use crate::simd::dispatch;

/// Largest divisor.
pub const MOST_DIVISOR: u32 = 4;

/// Rows of the target that one task fills.
const ROWS_PER_TASK: usize = 16;

/// Pixels that are interpolated together, one more on either side.
const RUN: usize = 256;

/// Every other byte of a pixel.
const ODD_BYTES: u32 = 0x00ff_00ff;

/// Fills `target` with the image `small`, rows of `width` pixels in the target's order of bytes, each pixel standing for
/// `divisor` by `divisor`.
///
/// Nothing happens when there are too few pixels for the target, or the divisor is not one from 1 to [`MOST_DIVISOR`].
pub fn enlarge(exec: Exec, small: &[[u8; 4]], width: u32, divisor: u32, target: &mut Target<'_>) {
    match divisor {
        1 => enlarge_by::<1>(exec, small, width as usize, target),
        2 => enlarge_by::<2>(exec, small, width as usize, target),
        3 => enlarge_by::<3>(exec, small, width as usize, target),
        MOST_DIVISOR => enlarge_by::<4>(exec, small, width as usize, target),
        _ => {}
    }
}

fn enlarge_by<const D: usize>(
    exec: Exec,
    small: &[[u8; 4]],
    width: usize,
    target: &mut Target<'_>,
) {
    let (columns, rows) = (target.width() as usize, target.height() as usize);
    let needed = width.checked_mul(rows.div_ceil(D));
    if columns == 0
        || rows == 0
        || width < columns.div_ceil(D)
        || needed.is_none_or(|n| n > small.len())
    {
        return;
    }
    let height = rows.div_ceil(D);
    let stride = target.stride();
    let size = stride.saturating_mul(ROWS_PER_TASK);
    exec.for_each_chunk(target.bytes_mut(), size, |task, band| {
        let first = task * ROWS_PER_TASK;
        for (y, row) in (first..rows).zip(band.chunks_mut(stride)) {
            let at = Between::new::<D>(y % D);
            let [a, b] = at
                .neighbours(y / D, height)
                .map(|y| &small[y * width..][..width]);
            let (pixels, _) = row[..columns * PIXEL_BYTES].as_chunks_mut();
            dispatch!(exec.level, _simd => fill_row::<D>(a, b, at.weight, pixels));
        }
    });
}

/// Fills a row of the target between two rows of the small image.
#[inline(always)]
fn fill_row<const D: usize>(a: &[[u8; 4]], b: &[[u8; 4]], weight: u32, row: &mut [[u8; 4]]) {
    let places: [Between; D] = std::array::from_fn(Between::new::<D>);
    let mut run = [0; RUN + 2];
    let mut parts = [[0; RUN]; D];
    for (index, out) in row.chunks_mut(RUN * D).enumerate() {
        let first = index * RUN;
        let count = out.len().div_ceil(D);
        blend_rows(a, b, weight, first, &mut run[..count + 2]);
        // Loops over consecutive pixels, which become vectors.
        for (part, place) in parts.iter_mut().zip(places) {
            let skip = usize::from(!place.is_before);
            let pairs = run[skip..].iter().zip(&run[skip + 1..]);
            for (to, (&a, &b)) in part[..count].iter_mut().zip(pairs) {
                *to = mix(a, b, place.weight);
            }
        }
        let (whole, rest) = out.as_chunks_mut::<D>();
        for (i, pixels) in whole.iter_mut().enumerate() {
            *pixels = std::array::from_fn(|k| parts[k][i].to_le_bytes());
        }
        for (pixel, part) in rest.iter_mut().zip(&parts) {
            *pixel = part[count - 1].to_le_bytes();
        }
    }
}

/// Pixels between two rows, from the one before `first` on; at the ends of the rows the outermost are repeated.
#[inline(always)]
fn blend_rows(a: &[[u8; 4]], b: &[[u8; 4]], weight: u32, first: usize, out: &mut [u32]) {
    let blend = |a: [u8; 4], b: [u8; 4]| mix(u32::from_le_bytes(a), u32::from_le_bytes(b), weight);
    let last = first + out.len() - 2;
    if first > 0 && last < a.len() {
        let inside = first - 1..last + 1;
        for ((to, &a), &b) in out.iter_mut().zip(&a[inside.clone()]).zip(&b[inside]) {
            *to = blend(a, b);
        }
    } else {
        for (i, to) in out.iter_mut().enumerate() {
            let x = (first + i).saturating_sub(1).min(a.len() - 1);
            *to = blend(a[x], b[x]);
        }
    }
}

/// A place between the centres of two neighbouring pixels of the small image.
#[derive(Clone, Copy, Debug)]
struct Between {
    /// The pixel that it lies in is the second of the two.
    is_before: bool,
    /// Weight of the second, in 256ths.
    weight: u32,
}

impl Between {
    /// The place of the centre of part `k` of `D` of a pixel.
    fn new<const D: usize>(k: usize) -> Self {
        let (twice, parts) = (2 * k + 1, 2 * D);
        let is_before = twice < D;
        // In parts of 2 D, from the centre of the first of the two.
        let offset = if is_before { twice + D } else { twice - D };
        Self {
            is_before,
            weight: ((offset * 256 + D) / parts) as u32,
        }
    }

    /// The two neighbours, the pixel being number `i` of `len`.
    fn neighbours(self, i: usize, len: usize) -> [usize; 2] {
        if self.is_before {
            [i.saturating_sub(1), i]
        } else {
            [i, (i + 1).min(len - 1)]
        }
    }
}

/// `a + (b - a) weight / 256`, rounded, of each byte; two bytes at a time, 16 bits apart, where nothing carries over:
/// `255 * 256 + 128 < 2^16`.
#[inline(always)]
fn mix(a: u32, b: u32, weight: u32) -> u32 {
    let half = |a: u32, b: u32| {
        ((a & ODD_BYTES) * (256 - weight) + (b & ODD_BYTES) * weight + 0x0080_0080) >> 8 & ODD_BYTES
    };
    half(a, b) | half(a >> 8, b >> 8) << 8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the definition, in floating point.
    fn slow(small: &[[u8; 4]], size: [usize; 2], divisor: usize, x: usize, y: usize) -> [f64; 4] {
        let place = |x: usize, len: usize| {
            let at = (x as f64 + 0.5) / divisor as f64 - 0.5;
            at.clamp(0.0, (len - 1) as f64)
        };
        let (u, v) = (place(x, size[0]), place(y, size[1]));
        std::array::from_fn(|channel| {
            let at = |x: usize, y: usize| {
                let [x, y] = [x.min(size[0] - 1), y.min(size[1] - 1)];
                f64::from(small[y * size[0] + x][channel])
            };
            let (i, j) = (u as usize, v as usize);
            let row = |j| at(i, j) * (1.0 - u.fract()) + at(i + 1, j) * u.fract();
            row(j) * (1.0 - v.fract()) + row(j + 1) * v.fract()
        })
    }

    #[test]
    fn every_pixel_lies_between_its_neighbours_as_the_definition_has_it() {
        let exec = Exec::sequential();
        for (columns, rows) in [(1, 1), (5, 3), (7, 9), (64, 2), (1031, 5), (2100, 3)] {
            for divisor in 1..=MOST_DIVISOR as usize {
                let size = [columns, rows].map(|side: usize| side.div_ceil(divisor));
                let small: Vec<[u8; 4]> = (0..size[0] * size[1])
                    .map(|i| [i * 97, i * i, 255 - i % 256, i * 31].map(|c| c as u8))
                    .collect();
                let stride = columns * 4 + 12;
                let mut bytes = vec![7; stride * rows];
                let mut target =
                    Target::with_stride(&mut bytes, columns as u32, rows as u32, stride)
                        .expect("it has room");
                enlarge(exec, &small, size[0] as u32, divisor as u32, &mut target);
                for (y, row) in bytes.chunks(stride).enumerate() {
                    for x in 0..columns {
                        let expected = slow(&small, size, divisor, x, y);
                        for channel in 0..4 {
                            let got = f64::from(row[x * 4 + channel]);
                            // Rounded twice, weights to 256ths.
                            assert!(
                                (got - expected[channel]).abs() <= 2.0,
                                "{columns}x{rows} by {divisor} at {x}, {y}: {got} for {expected:?}"
                            );
                        }
                    }
                    assert!(row[columns * 4..].iter().all(|&byte| byte == 7));
                }
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_left_alone() {
        let mut bytes = [7; 64];
        let mut target = Target::new(&mut bytes, 4, 4).expect("it has room");
        let exec = Exec::sequential();
        enlarge(exec, &[[0; 4]; 3], 2, 2, &mut target);
        enlarge(exec, &[[0; 4]; 4], 1, 2, &mut target);
        enlarge(exec, &[[0; 4]; 16], 4, 5, &mut target);
        enlarge(exec, &[], u32::MAX, 4, &mut target);
        assert_eq!(bytes, [7; 64]);
        enlarge(
            exec,
            &[],
            0,
            2,
            &mut Target::new(&mut [], 0, 0).expect("it is empty"),
        );
    }

    #[test]
    fn equal_colours_stay_equal() {
        for code in 0..=255 {
            for weight in 0..=256 {
                let pixel = u32::from_le_bytes([code, 255 - code, code, 255]);
                assert_eq!(mix(pixel, pixel, weight), pixel);
            }
        }
    }
}
