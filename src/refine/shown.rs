//! What a device will show of a refined triangle, where it is drawn once and cannot be asked.
//!
//! **Colour.** Between corners `i` with barycentric coordinates `b_i` a device that interpolates in perspective shows
//! `sum b_i c_i`, in linear light. One that interpolates [codes affinely on the
//! screen](Interpolation::EncodedAffine) shows codes weighted by the place on the screen: a point projects to the
//! weighted mean of the projected corners with weights `b_i w_i / sum b_j w_j`, `w` being the homogeneous coordinate.
//! So half way along an edge in space is not half way on the screen, and an edge has a surplus even where light is
//! linear.
//!
//! **Pixels.** Nobody counts them, so a triangle's are estimated by its area inside the image.

use super::estimate;
use super::{Forest, LeafId};
use crate::geometry::Vec3s;
use crate::geometry::bary::blend;
use crate::geometry::screen::{clip, outcode};
use crate::geometry::viewport::{ScreenPolygon, ScreenRect};
use crate::output::Interpolation;
use crate::scene::{View, World};
use crate::simd::Level;

/// How many times more densely leaves are sampled that are drawn once.
const DENSER: u32 = 4;

/// The view and the device of an image that is drawn once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shown {
    pub(super) view: View,
    pub(super) interpolation: Interpolation,
}

impl Shown {
    /// Whether colours are interpolated as codes.
    pub(super) fn is_encoded(&self) -> bool {
        self.interpolation == Interpolation::EncodedAffine
    }

    /// What is shown at a point inside a triangle: `weights` are its barycentric coordinates, `colours` those of the
    /// corners as they are interpolated (linear, or codes).
    pub(super) fn blend(
        &self,
        weights: [f32; 3],
        corners: [[f32; 3]; 3],
        colours: [[f32; 3]; 3],
    ) -> [f32; 3] {
        if !self.is_encoded() {
            return blend(weights, colours);
        }
        let w = corners.map(|p| self.view.project(p)[3]);
        let scaled: [f64; 3] = std::array::from_fn(|i| f64::from(weights[i]) * w[i]);
        let sum = scaled[0] + scaled[1] + scaled[2];
        // A corner behind the eye has no place on the screen; such a triangle is clipped, and finer than this estimate.
        if w.iter().all(|&w| w > 0.0) && sum > 0.0 && sum.is_finite() {
            blend(scaled.map(|v| (v / sum) as f32), colours)
        } else {
            blend(weights, colours)
        }
    }

    /// The longest edge of a triangle on the screen, in pixels; infinite when it reaches behind the eye, and zero when
    /// nothing of it is inside the image.
    pub(super) fn longest_edge(&self, corners: [[f32; 3]; 3]) -> f32 {
        if self.pixels(corners) <= 0.0 {
            return 0.0;
        }
        let points = corners.map(|p| {
            let [x, y, _, w] = self.view.project(p);
            if w > 0.0 {
                [x / w, y / w]
            } else {
                [f64::INFINITY; 2]
            }
        });
        let length = |k: usize| {
            let (a, b) = (points[k], points[(k + 1) % 3]);
            let length = (a[0] - b[0]).hypot(a[1] - b[1]);
            if length.is_nan() {
                f64::INFINITY
            } else {
                length
            }
        };
        length(0).max(length(1)).max(length(2)) as f32
    }

    /// Area of a triangle inside the image, in pixels.
    pub(super) fn pixels(&self, corners: [[f32; 3]; 3]) -> f32 {
        let corners = corners.map(|p| self.view.project(p));
        let codes = corners.map(outcode);
        if codes[0] & codes[1] & codes[2] != 0 {
            return 0.0;
        }
        let polygon = if codes == [0; 3] {
            ScreenPolygon::triangle(corners.map(|[x, y, _, w]| [x / w, y / w]))
        } else {
            ScreenPolygon::of_clipped(&clip(corners))
        };
        let image = ScreenRect::image(self.view.width, self.view.height);
        polygon.cut_to(&image).area() as f32
    }
}

impl Forest {
    /// Says, after [`reset`](Self::reset), that the image will be drawn once, by a device that interpolates so and
    /// neither counts pixels nor shades them: errors are measured against what it will show, pixels are estimated by
    /// area inside the image, large leaves are sampled more densely because nothing else will look into them, and a
    /// split that did not help is carried out when it is asked for again.
    pub fn draw_once(
        &mut self,
        level: Level,
        view: &View,
        interpolation: Interpolation,
        base_colours: &Vec3s,
    ) {
        let shown = Shown {
            view: *view,
            interpolation,
        };
        if shown.is_encoded() {
            self.vertices
                .encode_base(level, view.encoding, base_colours);
        }
        self.samples.set_interpolation(interpolation);
        self.shown = Some(shown);
    }

    /// The longest edge of a leaf on the screen, in pixels, for an image that is [drawn once](Self::draw_once); zero
    /// when nothing of it is inside the image.
    #[must_use]
    pub fn longest_edge_px(&self, world: &World, id: LeafId) -> f32 {
        let shown = self.shown.as_ref();
        shown.map_or(0.0, |shown| shown.longest_edge(self.positions(world, id)))
    }

    /// How many points inside a leaf of `pixels` pixels are sampled.
    #[must_use]
    pub fn sample_count(&self, pixels: u32) -> usize {
        estimate::sample_count(match self.shown {
            Some(_) => pixels.saturating_mul(DENSER),
            None => pixels,
        })
    }

    /// Colours of vertices as they are interpolated.
    pub(super) fn shown_colours(&self, base_colours: &Vec3s, vertices: [u32; 3]) -> [[f32; 3]; 3] {
        vertices.map(|v| {
            self.vertices
                .shown_colour(self.shown.as_ref(), base_colours, v)
        })
    }

    /// What is shown at a point inside a triangle, by its barycentric coordinates and the colours that are
    /// interpolated.
    pub(super) fn shown_blend(
        &self,
        weights: [f32; 3],
        corners: [[f32; 3]; 3],
        colours: [[f32; 3]; 3],
    ) -> [f32; 3] {
        match &self.shown {
            Some(shown) => shown.blend(weights, corners, colours),
            None => blend(weights, colours),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::Encoding;
    use crate::scene::Eye;
    use glam::{DMat4, DVec4};

    /// 100 x 80 pixels, an eye at the origin that looks along +z.
    fn shown(interpolation: Interpolation) -> Shown {
        let view = View {
            width: 100,
            height: 80,
            pixel_from_world: DMat4::from_cols(
                DVec4::new(60.0, 0.0, 0.0, 0.0),
                DVec4::new(0.0, 60.0, 0.0, 0.0),
                DVec4::new(50.0, 40.0, 0.0, 1.0),
                DVec4::new(0.0, 0.0, 0.5, 0.0),
            ),
            eye: Eye::Point([0.0; 3]),
            encoding: Encoding::Srgb,
        };
        Shown {
            view,
            interpolation,
        }
    }

    const CORNERS: [[f32; 3]; 3] = [[-1.0, -0.5, 2.0], [3.0, 0.0, 6.0], [0.0, 0.9, 3.0]];

    #[test]
    fn codes_are_affine_in_the_place_on_the_screen() {
        let shown = shown(Interpolation::EncodedAffine);
        // Any affine function of the screen, given at the corners, is found at every point between them.
        let place = |p: [f32; 3]| {
            let [x, y, _, w] = shown.view.project(p);
            [x / w, y / w]
        };
        let function = |[x, y]: [f64; 2]| (3.0 + 0.7 * x - 1.3 * y) as f32;
        let codes = CORNERS.map(|p| [function(place(p)), 0.0, 9.0]);
        for weights in [
            [0.5, 0.5, 0.0],
            [0.2, 0.3, 0.5],
            [0.0, 0.0, 1.0],
            [0.1, 0.8, 0.1],
        ] {
            let want = function(place(blend(weights, CORNERS)));
            let [got, zero, nine] = shown.blend(weights, CORNERS, codes);
            assert!((got - want).abs() < 1e-3, "{got} instead of {want}");
            assert!(zero == 0.0 && (nine - 9.0).abs() < 1e-5);
        }
    }

    #[test]
    fn light_is_blended_as_it_is_in_space_and_so_is_what_reaches_behind_the_eye() {
        let colours = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let weights = [0.2, 0.3, 0.5];
        let linear = shown(Interpolation::LinearPerspective);
        assert_eq!(linear.blend(weights, CORNERS, colours), weights);
        let mut behind = CORNERS;
        behind[1][2] = -1.0;
        let encoded = shown(Interpolation::EncodedAffine);
        assert_eq!(encoded.blend(weights, behind, colours), weights);
        behind[1][2] = f32::NAN;
        assert_eq!(encoded.blend(weights, behind, colours), weights);
    }

    #[test]
    fn pixels_are_the_area_inside_the_image() {
        let shown = shown(Interpolation::EncodedAffine);
        // At distance 6 a unit is ten pixels: the whole image is 10 x 8.
        let right = |size: f32| [[0.0, 0.0, 6.0], [size, 0.0, 6.0], [0.0, size, 6.0]];
        assert!((shown.pixels(right(2.0)) - 200.0).abs() < 1e-3);
        // Far beyond the image's lower right quarter.
        assert!((shown.pixels(right(1e4)) - 2000.0).abs() < 1e-2);
        assert_eq!(
            shown.pixels(right(2.0).map(|[x, y, z]| [x + 90.0, y, z])),
            0.0
        );
        assert_eq!(shown.pixels(right(2.0).map(|[x, y, z]| [x, y, -z])), 0.0);
        assert_eq!(shown.pixels([[f32::NAN; 3]; 3]), 0.0);
        // Twenty pixels are the legs of the first one.
        let diagonal = 20.0 * std::f32::consts::SQRT_2;
        assert!((shown.longest_edge(right(2.0)) - diagonal).abs() < 1e-3);
        assert_eq!(
            shown.longest_edge(right(2.0).map(|[x, y, z]| [x + 90.0, y, z])),
            0.0
        );
        let mut behind = right(2.0);
        behind[2][2] = -1.0;
        assert_eq!(shown.longest_edge(behind), f32::INFINITY);
    }
}
