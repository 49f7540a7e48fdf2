//! A scene made ready for rendering: world space, `f32`, one array per component.
//!
//! Author space is re-centred on the scene and scaled by a power of two while everything is still `f64`, so that a
//! scene of any size, and far from its origin, keeps its digits when it becomes `f32`: with `o` the centre, `s`
//! the scale, and `A p + t` an object's transform, a vertex is at `s (A p + (t - o))`. The module
//! [`placement`](super::placement) puts objects there.

use super::limits::MAX_LIGHTS;
use super::placement::Placement;
use super::view::View;
use super::{Camera, Light, LightKind, Material, Projection, Rgb, Scene, defaults, unit};
use crate::geometry::Vec3s;
use crate::geometry::clusters::Cluster;
use crate::geometry::topology::Topology;
use glam::DVec3;
use std::ops::Range;

/// A point light farther away than this many scene radii shines like a directional one.
const FARTHEST_LIGHT: f64 = 1e6;

/// All triangles, lights and materials of a scene in [world space](crate::math).
///
/// First come the fronts of all objects, then the backs of those whose material is two-sided: triangles like any other,
/// with the opposite winding. Within each, vertices and triangles of one object are consecutive. A vertex belongs to one side of
/// one object, hence has one material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct World {
    /// Vertex positions.
    pub positions: Vec3s,
    /// Unit vertex normals.
    pub normals: Vec3s,
    /// Material index of each vertex.
    pub vertex_material: Vec<u16>,
    /// Vertex indices, counter-clockwise seen from where the triangle is drawn.
    pub triangles: Vec<[u32; 3]>,
    /// Those of the triangles that are backs; the last ones.
    pub backs: Range<u32>,
    /// First triangle of the front of each object, then those of the backs there are, ascending. Nothing but a hint at which
    /// triangles move together.
    pub object_starts: Vec<u32>,
    /// Material index of each triangle.
    pub triangle_material: Vec<u16>,
    /// Runs of neighbouring triangles, in order; together they are all triangles.
    pub clusters: Vec<Cluster>,
    /// Which triangles meet at which edges.
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
    /// All vertices lie within this distance of the origin.
    pub radius: f64,
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
}

impl ShadingMaterial {
    /// Whether the material has a specular term at all.
    #[must_use]
    pub fn is_specular(&self) -> bool {
        self.specular.iter().any(|&k| k > 0.0)
    }

    fn new(material: &Material, ambient_light: Rgb) -> Self {
        Self {
            ambient: std::array::from_fn(|i| {
                (ambient_light[i] * material.ambient[i] * material.diffuse[i]) as f32
            }),
            diffuse: material.diffuse.map(|c| c as f32),
            specular: material.specular.map(|c| c as f32),
            shininess: material.shininess as f32,
            model: material.model,
        }
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

impl World {
    /// Prepares a scene; see [`Placement::new`].
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        Placement::new(scene).1
    }

    /// The view of a camera, which is in author space, at an image size in pixels.
    ///
    /// Near and far planes that the camera leaves open are fitted to the scene.
    #[must_use]
    pub fn view(&self, camera: &Camera, width: u32, height: u32) -> View {
        let scale = self.world_from_author_scale;
        let camera = Camera {
            position: self.world_from_author(camera.position),
            target: self.world_from_author(camera.target),
            up: camera.up,
            projection: match camera.projection {
                Projection::Perspective { .. } => camera.projection,
                Projection::Orthographic { height } => Projection::Orthographic {
                    height: height * scale,
                },
            },
            near: camera.near.map(|near| near * scale),
            far: camera.far.map(|far| far * scale),
        };
        View::new(&camera, self.radius, width, height)
    }

    /// A point of author space in world space.
    #[must_use]
    pub fn world_from_author(&self, p: DVec3) -> DVec3 {
        (p - self.author_origin) * self.world_from_author_scale
    }

    /// Copies materials; without any, the default one.
    pub(super) fn set_materials(&mut self, materials: &[Material], ambient_light: Rgb) {
        let fallback = [defaults::MATERIAL];
        let materials = if materials.is_empty() {
            &fallback
        } else {
            materials
        };
        let shading = materials
            .iter()
            .map(|material| ShadingMaterial::new(material, ambient_light));
        self.materials.clear();
        self.materials.extend(shading);
    }

    /// Copies as many lights as there may be. Returns whether they are others than before.
    pub(super) fn set_lights(&mut self, lights: &[Light]) -> bool {
        let mut list = std::mem::take(&mut self.lights);
        let count = lights.len().min(MAX_LIGHTS);
        let mut are_others = count != list.len();
        list.truncate(count);
        for (index, light) in lights[..count].iter().enumerate() {
            let light = self.light(light);
            match list.get_mut(index) {
                Some(known) => {
                    are_others |= *known != light;
                    *known = light;
                }
                None => list.push(light),
            }
        }
        self.lights = list;
        are_others
    }

    /// Copies the background's colour.
    pub(super) fn set_background(&mut self, color: Rgb) {
        self.background = color.map(|c| c as f32);
    }

    fn light(&self, light: &Light) -> ShadingLight {
        let farthest = FARTHEST_LIGHT * if self.radius > 0.0 { self.radius } else { 1.0 };
        let (vector, is_point) = match light.kind {
            LightKind::Point { position } => {
                let p = self.world_from_author(position);
                if p.length() <= farthest {
                    (p, true)
                } else {
                    (unit(p).unwrap_or(DVec3::Z), false)
                }
            }
            LightKind::Directional { direction } => (unit(-direction).unwrap_or(DVec3::Z), false),
        };
        ShadingLight {
            vector: vector.to_array().map(|c| c as f32),
            is_point,
            radiance: light.radiance.map(|c| c as f32),
        }
    }
}
