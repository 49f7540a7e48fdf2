//! The colours of a triangle as linear gradients.
//!
//! A channel's code is an affine function of the place on the screen, `f(p) = f_0 + g . (p - p_0)`, given by its values
//! at the three corners. A two-stop gradient runs along `g` from where `f` is the smallest corner's value to where it
//! is the largest's, `(max - min) / |g|` pixels. Both ends are computed about a point inside of what is painted, because
//! corners may be thousands of pixels away and tiny-skia computes in `f32`.
//!
//! Where a triangle is so thin that its corners span no area, or a channel varies by less than
//! [`LEAST_VARIATION`], the channel is constant: the mean of the corners.

use super::shape::Shape;
use super::tile::colour;
use tiny_skia::{GradientStop, LinearGradient, Point, Shader, SpreadMode, Transform};

/// A channel that varies by fewer codes is constant: its mean is off by less than half of that.
const LEAST_VARIATION: f32 = 0.25;

/// How a channel varies over a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Spread {
    /// Not at all, in codes.
    Constant(f32),
    /// From one code at one point to another at another.
    Gradient {
        /// Codes at both ends.
        codes: [f32; 2],
        /// The ends, in the tile's coordinates.
        ends: [[f32; 2]; 2],
    },
}

impl Spread {
    /// A shader that paints `base` (in codes) and, in one channel, this gradient; `None` for a constant.
    pub(super) fn shader(&self, base: [f32; 3], channel: usize) -> Option<Shader<'static>> {
        let Self::Gradient { codes, ends } = *self else {
            return None;
        };
        let stop = |position: f32, code: f32| {
            let mut codes = base;
            codes[channel] = code;
            GradientStop::new(position, colour(codes))
        };
        let [start, end] = ends.map(|[x, y]| Point::from_xy(x, y));
        LinearGradient::new(
            start,
            end,
            vec![stop(0.0, codes[0]), stop(1.0, codes[1])],
            SpreadMode::Pad,
            Transform::identity(),
        )
    }
}

/// The affine functions of a shape's three channels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planes<'a> {
    shape: &'a Shape,
    /// The inverse of the matrix with the edges from corner 0 as rows; `None` when they span nothing.
    inverse: Option<[[f64; 2]; 2]>,
    center: [f64; 2],
    origin: [f64; 2],
}

impl<'a> Planes<'a> {
    /// The functions of a shape, gradients about `center`, in coordinates relative to `origin`.
    pub(super) fn new(shape: &'a Shape, center: [f64; 2], origin: [f64; 2]) -> Self {
        let [p, q, r] = shape.points;
        let (u, v) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
        let determinant = u[0] * v[1] - u[1] * v[0];
        let inverse = [
            [v[1] / determinant, -u[1] / determinant],
            [-v[0] / determinant, u[0] / determinant],
        ];
        let is_finite = inverse.iter().flatten().all(|c| c.is_finite());
        Self {
            shape,
            inverse: is_finite.then_some(inverse),
            center,
            origin,
        }
    }

    /// How each channel varies.
    pub(super) fn spreads(&self) -> [Spread; 3] {
        std::array::from_fn(|channel| self.spread(channel))
    }

    fn spread(&self, channel: usize) -> Spread {
        let codes = self.shape.codes.map(|c| c[channel]);
        let low = codes[0].min(codes[1]).min(codes[2]);
        let high = codes[0].max(codes[1]).max(codes[2]);
        let constant = Spread::Constant((codes[0] + codes[1] + codes[2]) / 3.0);
        let Some(inverse) = self.inverse.filter(|_| high - low >= LEAST_VARIATION) else {
            return constant;
        };
        let [c0, c1, c2] = codes.map(f64::from);
        let gradient: [f64; 2] =
            std::array::from_fn(|axis| inverse[axis][0] * (c1 - c0) + inverse[axis][1] * (c2 - c0));
        let square = gradient[0] * gradient[0] + gradient[1] * gradient[1];
        let corner = self.shape.points[0];
        let here = c0
            + gradient[0] * (self.center[0] - corner[0])
            + gradient[1] * (self.center[1] - corner[1]);
        let ends = [low, high].map(|code| {
            let along = (f64::from(code) - here) / square;
            [0, 1]
                .map(|axis| (self.center[axis] + gradient[axis] * along - self.origin[axis]) as f32)
        });
        if ends.iter().flatten().all(|c| c.is_finite()) {
            Spread::Gradient {
                codes: [low, high],
                ends,
            }
        } else {
            constant
        }
    }
}
