//! What is rendered, validated: camera, lights, materials, objects, and the world made of them.

pub mod view;
pub mod world;

pub use view::{Eye, View};
pub use world::{ReflectionModel, ShadingLight, ShadingMaterial, World};

use crate::geometry::Mesh;
use glam::{DMat4, DVec3};
use std::sync::Arc;

/// A linear RGB colour or coefficient; 1 is the display's white.
pub type Rgb = [f64; 3];

/// A validated scene in author space.
#[derive(Clone, Debug)]
pub struct Scene {
    /// From where it is seen.
    pub camera: Camera,
    /// Colour of pixels that nothing covers.
    pub background: Rgb,
    /// Ambient light.
    pub ambient: Rgb,
    /// Light sources.
    pub lights: Vec<Light>,
    /// Materials that objects refer to by index.
    pub materials: Vec<Material>,
    /// Meshes in place.
    pub objects: Vec<Object>,
}

/// A camera in author space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position of the eye.
    pub position: DVec3,
    /// The point that appears in the middle of the image.
    pub target: DVec3,
    /// The direction that points up in the image.
    pub up: DVec3,
    /// Perspective or orthographic.
    pub projection: Projection,
    /// Distance of the near plane; `None` fits it to the scene.
    pub near: Option<f64>,
    /// Distance of the far plane; `None` fits it to the scene.
    pub far: Option<f64>,
}

/// How the camera projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Full vertical opening angle in degrees.
    Perspective {
        /// In (0, 180).
        fov_degrees: f64,
    },
    /// Parallel projection.
    Orthographic {
        /// Height of the image in author units.
        height: f64,
    },
}

/// A light source in author space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Where it is.
    pub kind: LightKind,
    /// Linear colour times intensity.
    pub radiance: Rgb,
}

/// Where a light is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// At a point.
    Point {
        /// Author space.
        position: DVec3,
    },
    /// Infinitely far away.
    Directional {
        /// The direction in which the light travels; need not be a unit vector.
        direction: DVec3,
    },
}

/// A surface material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Factor of `diffuse` under ambient light.
    pub ambient: Rgb,
    /// Diffuse reflectance.
    pub diffuse: Rgb,
    /// Specular coefficient.
    pub specular: Rgb,
    /// Specular exponent.
    pub shininess: f64,
    /// Which specular term.
    pub model: ReflectionModel,
    /// Both sides are drawn, and the normal is turned towards the viewer.
    pub two_sided: bool,
}

/// A mesh in place.
#[derive(Clone, Debug)]
pub struct Object {
    /// Shared geometry.
    pub mesh: Arc<Mesh>,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Affine transform from the mesh's space to author space.
    pub author_from_mesh: DMat4,
}
