//! A camera at an image size, as the passes need it.
//!
//! With `r`, `u`, `f` the camera's unit vectors to the right, up and forward, `e` the eye, and `(x, y, t)` the
//! coordinates of `p - e` along them, the rows of [`View::pixel_from_world`] give
//!
//! | row | perspective | orthographic |
//! |---|---|---|
//! | x w | `k x + t width / 2` | `k x + width / 2` |
//! | y w | `-k y + t height / 2` | `-k y + height / 2` |
//! | z | `near (far - t) / (far - near)` | `(far - t) / (far - near)` |
//! | w | `t` | `1` |
//!
//! where `k` is pixels per unit at distance 1: `height / 2 / tan(fov / 2)`, or `height` in pixels over height in world
//! units. So `z / w` is 1 at the near plane and 0 at the far plane.

use super::{Camera, Projection, unit};
use crate::math::{PixelPoint, transform_point};
use crate::output::Encoding;
use glam::{DMat4, DVec3, DVec4};

/// Where the viewer is, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Eye {
    /// At a point (perspective).
    Point([f32; 3]),
    /// In this direction, a unit vector towards the viewer, from everywhere (orthographic).
    Direction([f32; 3]),
}

impl Eye {
    /// What tells it from others, bit for bit.
    fn bits(self) -> (bool, [u32; 3]) {
        match self {
            Self::Point(p) => (true, p.map(f32::to_bits)),
            Self::Direction(d) => (false, d.map(f32::to_bits)),
        }
    }
}

/// Everything about a view that the passes need.
///
/// Views are equal if they are bit for bit: so one of a camera at no number at all is equal to itself.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// World space to [homogeneous pixel space](crate::math).
    pub pixel_from_world: DMat4,
    /// Where the viewer is.
    pub eye: Eye,
    /// How the image stores light.
    pub encoding: Encoding,
}

impl PartialEq for View {
    fn eq(&self, other: &Self) -> bool {
        let bits = |view: &Self| view.pixel_from_world.to_cols_array().map(f64::to_bits);
        (self.width, self.height, self.encoding) == (other.width, other.height, other.encoding)
            && self.eye.bits() == other.eye.bits()
            && bits(self) == bits(other)
    }
}

impl Eq for View {}

/// A perspective eye farther away than this, in world units, is shaded as if it were infinitely far, like a light:
/// squares of its coordinates would leave the range of `f32`.
const FARTHEST_EYE: f64 = 1e15;

/// The fitted near plane is never nearer than this share of the far plane's distance.
const NEAREST_SHARE: f64 = 1e-5;

/// Fitted planes leave this much room, so that rounding does not clip what touches them.
const ROOM: f64 = 1e-3;

impl View {
    /// The view of `camera`, which is already in world space, where all geometry lies within `radius` of the origin.
    ///
    /// A camera that defines no direction (its eye at the target, or up parallel to the view) gets some direction.
    pub(super) fn new(camera: &Camera, radius: f64, width: u32, height: u32) -> Self {
        let [right, up, forward] = axes(camera);
        let eye = camera.position;
        let perspective = matches!(camera.projection, Projection::Perspective { .. });
        let (near, far) = depth_range(camera, -eye.dot(forward), radius, perspective);
        // `p - e` along an axis, as a row that takes `(p, 1)`.
        let row = |axis: DVec3| axis.extend(-axis.dot(eye));
        let (x, y, t) = (row(right), row(up), row(forward));
        let one = DVec4::W;
        let (half_width, half_height) = (f64::from(width) * 0.5, f64::from(height) * 0.5);
        let from_far = one * far - t;
        let (k, w, z) = match camera.projection {
            Projection::Perspective { fov_degrees } => {
                let tangent = libm::tan((fov_degrees * 0.5).to_radians());
                // Unequal numbers have a difference, so this is finite.
                let z = from_far * (near / (far - near));
                (half_height / tangent.max(1e-12), t, z)
            }
            Projection::Orthographic { height } => {
                let k = half_height * 2.0 / height.max(f64::MIN_POSITIVE);
                (
                    k,
                    one,
                    from_far * (1.0 / (far - near).max(f64::MIN_POSITIVE * 4.0)),
                )
            }
        };
        Self {
            width,
            height,
            pixel_from_world: DMat4::from_cols(
                x * k + w * half_width,
                w * half_height - y * k,
                z,
                w,
            )
            .transpose(),
            eye: shading_eye(eye, forward, perspective),
            encoding: Encoding::default(),
        }
    }

    /// The view with its image stored in another encoding than sRGB.
    #[must_use]
    pub fn with_encoding(self, encoding: Encoding) -> Self {
        Self { encoding, ..self }
    }

    /// The same view at a lower resolution: each pixel stands for `divisor` by `divisor` pixels, those of the last column and row
    /// perhaps for fewer. Zero counts as one.
    #[must_use]
    pub fn reduced(self, divisor: u32) -> Self {
        if divisor <= 1 {
            // A product with one would turn -0 into 0, which is another view.
            return self;
        }
        let shrink = DVec3::new(1.0 / f64::from(divisor), 1.0 / f64::from(divisor), 1.0);
        Self {
            width: self.width.div_ceil(divisor),
            height: self.height.div_ceil(divisor),
            pixel_from_world: DMat4::from_scale(shrink) * self.pixel_from_world,
            ..self
        }
    }

    /// A world point in homogeneous pixel space.
    #[inline]
    #[must_use]
    pub fn project(&self, p: [f32; 3]) -> PixelPoint {
        transform_point(&self.pixel_from_world, p)
    }
}

/// Unit vectors to the right, up and forward.
fn axes(camera: &Camera) -> [DVec3; 3] {
    let forward = unit(camera.target - camera.position).unwrap_or(DVec3::Y);
    let right = unit(camera.up)
        .and_then(|up| unit(forward.cross(up)))
        .unwrap_or_else(|| forward.any_orthonormal_vector());
    [right, right.cross(forward), forward]
}

/// Distances of the near and far planes: the camera's own, or fitted to a sphere about the origin, which is
/// `distance` away along the viewing direction. `near < far` always, and in perspective `0 < near`.
fn depth_range(camera: &Camera, distance: f64, radius: f64, perspective: bool) -> (f64, f64) {
    let room = ROOM * radius.max(f64::MIN_POSITIVE);
    let mut far = camera.far.unwrap_or(distance + radius + room);
    let mut near = camera.near.unwrap_or(distance - radius - room);
    if perspective {
        if camera.far.is_none() && far <= 0.0 {
            // Everything is behind the eye; any range will do.
            far = 1.0;
        }
        if camera.near.is_none() {
            near = near.max(far * NEAREST_SHARE);
        }
    }
    if near >= far {
        // One of them is the camera's, and the whole scene lies beyond it: the other one makes room.
        let some = near.abs().max(far.abs()).max(radius).max(f64::MIN_POSITIVE);
        if camera.far.is_none() {
            far = near + some;
        } else if perspective {
            near = far * NEAREST_SHARE;
        } else {
            near = far - some;
        }
    }
    (near, far)
}

/// Where shading takes the viewer to be.
fn shading_eye(eye: DVec3, forward: DVec3, perspective: bool) -> Eye {
    let to_f32 = |v: DVec3| v.to_array().map(|c| c as f32);
    if !perspective {
        Eye::Direction(to_f32(-forward))
    } else if eye.length() <= FARTHEST_EYE {
        Eye::Point(to_f32(eye))
    } else {
        Eye::Direction(to_f32(unit(eye).unwrap_or(-forward)))
    }
}
