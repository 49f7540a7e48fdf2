//! Images made to fit into a cell: averaged over squares of pixels.

use super::canvas::Rgb;
use specula::output::{Encoding, Frame};

/// Widest image that is shown as it is.
const WIDEST: u32 = 640;

/// How images of a size are made to fit: each pixel shown stands for a square of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reduction {
    /// Of the image itself.
    size: [u32; 2],
    /// Side of the squares.
    pub(super) side: u32,
}

impl Reduction {
    pub(super) fn of(size: [u32; 2]) -> Self {
        Self {
            size,
            side: size[0].div_ceil(WIDEST).max(1),
        }
    }

    /// The size shown. Squares at the right and lower edges may be cut.
    pub(super) fn shown(self) -> [u32; 2] {
        self.size.map(|length| length.div_ceil(self.side))
    }

    /// Indices of the pixels that the shown pixel at `x`, `y` stands for.
    fn pixels(self, x: u32, y: u32) -> impl Iterator<Item = usize> {
        let [width, height] = self.size;
        let range = move |from: u32, end: u32| from * self.side..((from + 1) * self.side).min(end);
        range(y, height).flat_map(move |y| {
            range(x, width).map(move |x| y as usize * width as usize + x as usize)
        })
    }

    /// An image made smaller, row by row: the mean of light.
    pub(super) fn image(self, frame: &Frame) -> Vec<Rgb> {
        let light: Vec<f64> = (0..=255)
            .map(|code| frame.encoding().decode(f64::from(code)))
            .collect();
        self.map(|indices| {
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for index in indices {
                for (sum, &code) in sum.iter_mut().zip(&frame.pixels()[index]) {
                    *sum += light[usize::from(code)];
                }
                count += 1.0;
            }
            sum.map(|sum| Encoding::Srgb.encode_u8(sum / f64::max(count, 1.0)))
        })
    }

    /// A map of errors made smaller, row by row: the root mean square of those that there are.
    pub(super) fn errors(self, errors: &[Option<f64>]) -> Vec<Option<f64>> {
        self.map(|indices| {
            let (mut squares, mut count) = (0.0, 0.0);
            for error in indices.filter_map(|index| errors[index]) {
                squares += error * error;
                count += 1.0;
            }
            (count > 0.0).then(|| f64::sqrt(squares / count))
        })
    }

    /// What `value` makes of each square's pixels.
    fn map<T>(self, value: impl Fn(&mut dyn Iterator<Item = usize>) -> T) -> Vec<T> {
        let [width, height] = self.shown();
        (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| value(&mut self.pixels(x, y)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_images_stay_as_they_are_and_large_ones_fit() {
        for (size, shown) in [
            ([640, 3], [640, 3]),
            ([641, 3], [321, 2]),
            ([1280, 720], [640, 360]),
            ([1920, 1080], [640, 360]),
            ([0, 0], [0, 0]),
        ] {
            assert_eq!(Reduction::of(size).shown(), shown, "{size:?}");
        }
    }

    #[test]
    fn light_and_squared_errors_are_averaged() {
        // Squares of 2 x 2; at the right edge there is only half of one.
        let reduction = Reduction {
            size: [3, 2],
            side: 2,
        };
        let mut frame = Frame::new(3, 2);
        frame.set_encoding(Encoding::Linear);
        for index in [0, 1, 2] {
            frame.pixels_mut()[index] = [255, 0, 0, 255];
        }
        let half = Encoding::Srgb.encode_u8(0.5);
        assert_eq!(reduction.image(&frame), [[half, 0, 0], [half, 0, 0]]);

        let errors = [Some(6.0), Some(2.0), None, None, Some(2.0), None];
        let found = reduction.errors(&errors);
        let expected = f64::sqrt((36.0 + 4.0 + 4.0) / 3.0);
        assert!(found[0].is_some_and(|found| (found - expected).abs() < 1e-12));
        assert_eq!(found[1], None);
    }
}
