//! What a scene gets that its file leaves out: a view of everything from the front and above, and two lamps.

use super::{Camera, Extent, Light, LightKind, Material, Projection, ReflectionModel, Rgb};
use glam::DVec3;

/// Nearly black, so that a dark silhouette is still told from it.
pub(super) const BACKGROUND: Rgb = [0.01, 0.01, 0.015];

/// A tenth of full light from everywhere.
pub(super) const AMBIENT: Rgb = [0.1; 3];

/// Vertical opening angle in degrees.
pub(super) const FOV_DEGREES: f64 = 35.0;

/// Up in author space.
pub(super) const UP: DVec3 = DVec3::Z;

/// Light grey with a moderately sharp highlight.
pub(super) const MATERIAL: Material = Material {
    ambient: [1.0; 3],
    diffuse: [0.6; 3],
    specular: [0.5; 3],
    shininess: 50.0,
    model: ReflectionModel::Phong,
    two_sided: false,
};

/// Width over height of the narrowest image that a fitted view is made for.
const ASPECT: f64 = 4.0 / 3.0;

/// A fitted eye is this many times as far away as it has to be.
const MARGIN: f64 = 1.03;

/// From the scene to the eye: in front (towards -y) and above.
const TOWARDS_EYE: DVec3 = DVec3::new(0.25, -0.86, 0.45);

/// Lamps about the scene: direction from its centre in scene radii, and brightness.
const LAMPS: [(DVec3, f64); 2] = [
    (DVec3::new(-2.0, -2.5, 3.0), 0.8),
    (DVec3::new(3.0, -2.0, 1.5), 0.3),
];

impl Camera {
    /// A camera in front of the scene and above it, that sees all of it in an image of 4:3 or wider.
    #[must_use]
    pub fn fitted(extent: &Extent) -> Self {
        Self {
            position: eye(extent, extent.center, FOV_DEGREES),
            target: extent.center,
            up: UP,
            projection: Projection::Perspective {
                fov_degrees: FOV_DEGREES,
            },
            near: None,
            far: None,
        }
    }
}

/// Where to look from at `target` such that the scene's box, with its middle there, fits into an image that is at
/// least [`ASPECT`] times as wide as high: a corner at `(x, y, t)` from the middle along the camera's axes is inside
/// from the distance on where `|y| <= (distance + t) tan(fov / 2)`, and likewise for x.
pub(super) fn eye(extent: &Extent, target: DVec3, fov_degrees: f64) -> DVec3 {
    let backward = TOWARDS_EYE.normalize();
    let right = UP.cross(backward).normalize();
    let up = backward.cross(right);
    let half_height = libm::tan((fov_degrees * 0.5).to_radians()).max(1e-6);
    let half = box_size(extent);
    let mut distance = 0.0_f64;
    for signs in 0..8 {
        let sign = |bit: i32| if signs >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let corner = half * DVec3::new(sign(0), sign(1), sign(2));
        let y = corner.dot(up).abs() / half_height;
        let x = corner.dot(right).abs() / (half_height * ASPECT);
        distance = distance.max(x.max(y) + corner.dot(backward));
    }
    target + backward * (distance * MARGIN)
}

/// Height of an orthographic image that holds the scene.
pub(super) fn orthographic_height(extent: &Extent) -> f64 {
    box_size(extent).length() * 2.0
}

/// Two lamps near the scene.
pub(super) fn lights(extent: &Extent) -> Vec<Light> {
    LAMPS
        .iter()
        .map(|&(direction, brightness)| Light {
            kind: LightKind::Point {
                position: extent.center + direction * box_size(extent).length(),
            },
            radiance: [brightness; 3],
        })
        .collect()
}

/// From the middle of the scene to a corner; a unit cube's if all of the scene is one point.
fn box_size(extent: &Extent) -> DVec3 {
    if extent.radius() > 0.0 {
        extent.half_size
    } else {
        DVec3::ONE
    }
}
