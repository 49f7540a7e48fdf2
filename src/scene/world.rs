//! A scene made ready for rendering: world space, `f32`, one array per component.

use crate::geometry::Vec3s;
use crate::geometry::topology::Topology;
use glam::DVec3;

/// All triangles, lights and materials of a scene in [world space](crate::math).
///
/// Vertices and triangles of one object are consecutive. A vertex belongs to one object, hence has one material.
#[derive(Clone, Debug, Default)]
pub struct World {
    /// Vertex positions.
    pub positions: Vec3s,
    /// Unit vertex normals.
    pub normals: Vec3s,
    /// Material index of each vertex.
    pub vertex_material: Vec<u16>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Material index of each triangle.
    pub triangle_material: Vec<u16>,
    /// Welded.
    pub topology: Topology,
    /// Materials.
    pub materials: Vec<ShadingMaterial>,
    /// Lights.
    pub lights: Vec<ShadingLight>,
    /// Linear colour of pixels that nothing covers.
    pub background: [f32; 3],
    /// Author space point that is the origin of world space.
    pub author_origin: DVec3,
    /// World units per author unit, a power of two.
    pub world_from_author_scale: f64,
}

/// A light in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadingLight {
    /// Position of a point light, or unit vector towards a directional one.
    pub vector: [f32; 3],
    /// Whether `vector` is a position.
    pub is_point: bool,
    /// Linear colour times intensity.
    pub radiance: [f32; 3],
}

/// A material as the illumination equation needs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadingMaterial {
    /// Ambient light times ambient factor times diffuse reflectance.
    pub ambient: [f32; 3],
    /// Diffuse reflectance.
    pub diffuse: [f32; 3],
    /// Specular coefficient.
    pub specular: [f32; 3],
    /// Specular exponent, not negative.
    pub shininess: f32,
    /// Which specular term.
    pub model: ReflectionModel,
    /// Both sides are drawn, and the normal is turned towards the viewer.
    pub two_sided: bool,
}

impl ShadingMaterial {
    /// Whether the material has a specular term at all.
    #[must_use]
    pub fn is_specular(&self) -> bool {
        self.specular.iter().any(|&k| k > 0.0)
    }
}

/// The specular term of the illumination equation; `n`, `l`, `v`, `h` are the unit normal, and the unit vectors
/// to the light, to the viewer and half way between, `r` the reflection of `l` about `n`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReflectionModel {
    /// `max(0, r.v)^shininess` (Phong 1975).
    #[default]
    Phong,
    /// `max(0, n.h)^shininess` (Blinn 1977).
    BlinnPhong,
}
