//! A scene made ready for rendering: world space, `f32`, one array per component.
//!
//! Author space is re-centred on the scene and scaled by a power of two while everything is still `f64`, so that a
//! scene of any size, and far from its origin, keeps its digits when it becomes `f32`: with `o` the centre, `s`
//! the scale, and `A p + t` an object's transform, a vertex is at `s (A p + (t - o))`.
//!
//! Normals are transformed by the inverse transpose of `A`. Its cofactor matrix is `det A` times that, hence the same but
//! for length and sign, and needs no division.

use super::view::View;
use super::{
    Camera, Extent, Light, LightKind, Material, Object, Projection, Rgb, Scene, defaults, unit,
};
use crate::geometry::Vec3s;
use crate::geometry::clusters::{Cluster, build_clusters};
use crate::geometry::topology::Topology;
use crate::math::power_of_two_scale;
use glam::{DMat3, DVec3};

/// A point light farther away than this many scene radii shines like a directional one.
const FARTHEST_LIGHT: f64 = 1e6;

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
    /// Both sides are drawn, and the normal is turned towards the viewer.
    pub two_sided: bool,
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
            two_sided: material.two_sided,
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
    /// Prepares a scene. Triangles are reordered within each object, so that each cluster's are consecutive.
    ///
    /// A scene that was changed by hand cannot make this fail: a material index out of range means the last material, and
    /// triangles with a vertex index out of range are left out.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let extent = Extent::of(&scene.objects);
        let mut world = Self {
            background: scene.background.map(|c| c as f32),
            author_origin: extent.center,
            world_from_author_scale: power_of_two_scale(extent.radius()),
            ..Self::default()
        };
        let fallback = [defaults::MATERIAL];
        let materials: &[Material] = match scene.materials.as_slice() {
            [] => &fallback,
            materials => materials,
        };
        world.materials = materials
            .iter()
            .map(|material| ShadingMaterial::new(material, scene.ambient))
            .collect();
        for object in &scene.objects {
            world.add_object(object);
        }
        world.radius = (0..world.positions.len())
            .map(|i| DVec3::from(world.positions.get(i).map(f64::from)).length())
            .fold(0.0, f64::max);
        world.topology = Topology::new(&world.positions, &world.triangles);
        world.lights = scene
            .lights
            .iter()
            .map(|light| world.light(light))
            .collect();
        world
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

    fn add_object(&mut self, object: &Object) {
        let mesh = &object.mesh;
        let (Ok(first_vertex), Ok(first_triangle), Ok(_)) = (
            u32::try_from(self.positions.len()),
            u32::try_from(self.triangles.len()),
            u32::try_from(self.positions.len() + mesh.positions.len()),
        ) else {
            debug_assert!(false, "a valid scene's vertices can be indexed by 32 bits");
            return;
        };
        let last = self
            .materials
            .len()
            .saturating_sub(1)
            .min(usize::from(u16::MAX));
        let material = object.material.min(last) as u16;
        let place = object.author_from_mesh;
        let linear = DMat3::from_mat4(place);
        let offset = place.w_axis.truncate() - self.author_origin;
        let normal_matrix = NormalMatrix::new(linear);
        for (&position, &normal) in mesh.positions.iter().zip(&mesh.normals) {
            let p = (linear * position + offset) * self.world_from_author_scale;
            self.positions.push(p.to_array().map(|c| c as f32));
            let n = normal_matrix.transform(normal);
            self.normals.push(n.to_array().map(|c| c as f32));
            self.vertex_material.push(material);
        }
        let start = self.triangles.len();
        let vertices = self.positions.len() as u32 - first_vertex;
        let whole = |t: &&[u32; 3]| t.iter().all(|&i| i < vertices);
        self.triangles
            .extend(mesh.triangles.iter().filter(whole).map(|t| {
                let [a, b, c] = t.map(|i| first_vertex + i);
                // A mirror image turns the other way round.
                if normal_matrix.mirrors {
                    [a, c, b]
                } else {
                    [a, b, c]
                }
            }));
        self.triangle_material
            .resize(self.triangles.len(), material);
        self.clusters.extend(build_clusters(
            &self.positions,
            &mut self.triangles[start..],
            first_triangle,
        ));
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

/// Transforms normals as `linear` transforms surfaces.
struct NormalMatrix {
    /// The inverse transpose, up to a positive factor.
    matrix: DMat3,
    /// Whether `linear` mirrors.
    mirrors: bool,
}

impl NormalMatrix {
    fn new(linear: DMat3) -> Self {
        let largest = |m: &DMat3| {
            m.to_cols_array()
                .iter()
                .fold(0.0, |a: f64, c| a.max(c.abs()))
        };
        // Brought near 1, products of its elements stay in range.
        let m = linear * (1.0 / largest(&linear).max(f64::MIN_POSITIVE));
        let cofactors = DMat3::from_cols(
            m.y_axis.cross(m.z_axis),
            m.z_axis.cross(m.x_axis),
            m.x_axis.cross(m.y_axis),
        );
        let mirrors = m.x_axis.dot(cofactors.x_axis) < 0.0;
        let sign = if mirrors { -1.0 } else { 1.0 };
        Self {
            matrix: cofactors * (sign / largest(&cofactors).max(f64::MIN_POSITIVE)),
            mirrors,
        }
    }

    /// The unit normal; straight up for one without a direction.
    fn transform(&self, normal: DVec3) -> DVec3 {
        unit(self.matrix * normal).unwrap_or(DVec3::Z)
    }
}
