//! A scene around a mesh that is opened by itself: something good to look at for any mesh of any size.
//!
//! The camera looks from the front, from the right and above. It is as near as it can be with every vertex inside the image, and
//! looks at its middle: along the camera's axes (x right, y up, z backward) the eye `e` sees a point `p` if
//! `|p.x - e.x| <= w (e.z - p.z)`, `w` being the tangent of half the opening angle. Hence, with `a` the largest `p.x + w p.z`
//! and `b` the largest `-p.x + w p.z` of all points, `e.x = (a - b) / 2` sees all of them from `e.z = (a + b) / (2 w)` on, and
//! not from nearer by; likewise for y.
//! In the other direction the eye is then moved to the middle of what it sees, by a few steps that each balance the two outermost
//! points.
//!
//! A key light from the upper left, a weak fill light from the right and a rim light from behind are
//! placed relative to the view and the size of the mesh.

use super::error::SceneError;
use super::mesh_file::{MeshUp, load_mesh};
use super::{
    Camera, Extent, Light, LightKind, Material, Object, Projection, ReflectionModel, Rgb, Scene,
};
use crate::geometry::Mesh;
use crate::geometry::import::Normals;
use crate::math::Bounds;
use glam::{DMat3, DMat4, DVec3};
use std::path::Path;
use std::sync::Arc;

/// Vertical opening angle in degrees: narrow, so that near parts are not much larger than far ones.
const FOV_DEGREES: f64 = 28.0;

/// Width over height of the narrowest image that everything is in.
const ASPECT: f64 = 4.0 / 3.0;

/// The share of the image that the mesh may fill in each direction.
const FILL: f64 = 0.86;

/// Steps by which the mesh is centred; each brings it several times nearer to the middle.
const CENTERINGS: usize = 4;

/// From the mesh to the eye: in front, somewhat from the right and from above.
const TOWARDS_EYE: DVec3 = DVec3::new(0.50, -0.78, 0.40);

/// Lights: where from the middle of the mesh along the camera's axes (right, up, backward), in radii of the mesh, and colour.
const LIGHTS: [(DVec3, Rgb); 3] = [
    (DVec3::new(-2.4, 2.8, 3.2), [1.10, 1.06, 1.00]),
    (DVec3::new(4.0, 0.4, 2.2), [0.20, 0.24, 0.32]),
    (DVec3::new(2.4, 2.2, -3.0), [0.80, 0.90, 1.00]),
];

const AMBIENT: Rgb = [0.16, 0.17, 0.19];

const BACKGROUND: Rgb = [0.022, 0.026, 0.034];

const MATERIAL: Material = Material {
    ambient: [1.0; 3],
    diffuse: [0.46, 0.17, 0.085],
    specular: [0.42, 0.40, 0.38],
    shininess: 70.0,
    model: ReflectionModel::BlinnPhong,
    // The faces of many files turn either way, and many are open.
    two_sided: true,
};

/// The material of a mesh: of one that is closed nobody sees the back.
fn material(mesh: &Mesh) -> Material {
    Material {
        two_sided: !mesh.is_closed(),
        ..MATERIAL
    }
}

/// Loads a mesh file and puts it into a scene.
pub(super) fn load(path: &Path) -> Result<Scene, SceneError> {
    let mesh = load_mesh(path, Normals::default())?;
    let material = material(&mesh);
    let object = Object {
        mesh: Arc::new(mesh),
        material: 0,
        author_from_mesh: DMat4::from_mat3(MeshUp::default().scene_from_file()),
    };
    let stage = Stage::of(&object);
    let mut scene = Scene::new(vec![material], vec![object]);
    scene.set_camera(stage.camera());
    scene.set_lights(stage.lights());
    scene.set_ambient(AMBIENT);
    scene.set_background(BACKGROUND);
    Ok(scene)
}

/// Where a mesh is and how it is looked at.
#[derive(Clone, Copy, Debug)]
struct Stage {
    center: DVec3,
    radius: f64,
    /// The camera's axes: right, up and backward.
    axes: DMat3,
    /// The eye, from the centre along the axes.
    eye: DVec3,
}

impl Stage {
    fn of(object: &Object) -> Self {
        let extent = Extent::of(std::slice::from_ref(object));
        let center = extent.center;
        let backward = TOWARDS_EYE.normalize();
        let right = DVec3::Z.cross(backward).normalize();
        let axes = DMat3::from_cols(right, backward.cross(right), backward);
        // A mesh that is a single point is looked at as if it had a size.
        let radius = if extent.radius() > 0.0 {
            extent.radius()
        } else {
            1.0
        };
        // In units of the radius, so that no size is too small or too large.
        let points: Vec<DVec3> = object
            .mesh
            .positions
            .iter()
            .map(|&p| object.author_from_mesh.transform_point3(p) - center)
            .map(|p| axes.transpose() * (p / radius))
            .collect();
        let eye = eye(&points) * radius;
        Self {
            center,
            radius,
            axes,
            eye,
        }
    }

    /// The point at a place given along the camera's axes.
    fn at(&self, place: DVec3) -> DVec3 {
        self.center + self.axes * place
    }

    fn camera(&self) -> Camera {
        Camera {
            position: self.at(self.eye),
            target: self.at(self.eye.with_z(0.0)),
            up: DVec3::Z,
            projection: Projection::Perspective {
                fov_degrees: FOV_DEGREES,
            },
            near: None,
            far: None,
        }
    }

    fn lights(&self) -> Vec<Light> {
        LIGHTS
            .iter()
            .map(|&(place, radiance)| Light {
                kind: LightKind::Point {
                    position: self.at(place * self.radius),
                },
                radiance,
            })
            .collect()
    }
}

/// The nearest eye that sees all points, which are given along the camera's axes.
fn eye(points: &[DVec3]) -> DVec3 {
    let height = libm::tan((FOV_DEGREES * 0.5).to_radians()) * FILL;
    let width = height * ASPECT;
    // Largest p.x + w p.z and p.y + h p.z; smallest p.x - w p.z and p.y - h p.z.
    let mut bounds = Bounds::EMPTY;
    for p in points {
        let (w, h) = (width * p.z, height * p.z);
        bounds.max = bounds.max.max(DVec3::new(p.x + w, p.y + h, p.z));
        bounds.min = bounds.min.min(DVec3::new(p.x - w, p.y - h, p.z));
    }
    if bounds.is_empty() {
        return DVec3::Z;
    }
    let size = bounds.max - bounds.min;
    let distance = (size.x / (2.0 * width)).max(size.y / (2.0 * height));
    // All in one place: any distance will do.
    let distance = if distance > bounds.max.z {
        distance
    } else {
        bounds.max.z + 1.0
    };
    let mut eye = bounds.center().with_z(distance);
    for _ in 0..CENTERINGS {
        eye.x = centered(points, eye, |p| p.x);
        eye.y = centered(points, eye, |p| p.y);
    }
    eye
}

/// Where the eye has to be along one axis for the two points seen farthest to either side, `a` and `b`, to be equally far from
/// the middle of the image: `(e - a) / depth a = (b - e) / depth b`. Depths are positive.
fn centered(points: &[DVec3], eye: DVec3, along: impl Fn(DVec3) -> f64) -> f64 {
    let seen = |p: DVec3| (along(p) - along(eye)) / (eye.z - p.z);
    let mut ends = [points[0]; 2];
    for &p in points {
        if seen(p) < seen(ends[0]) {
            ends[0] = p;
        }
        if seen(p) > seen(ends[1]) {
            ends[1] = p;
        }
    }
    let [a, b] = ends;
    let depths = [eye.z - a.z, eye.z - b.z];
    (along(a) * depths[1] + along(b) * depths[0]) / (depths[0] + depths[1])
}
