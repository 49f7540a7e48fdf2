//! What is rendered, validated: camera, lights, materials, objects, and the world made of them.
//!
//! A [`Scene`] is read from a file in RON (Rusty Object Notation). Everything has a default but the objects, so this is
//! a whole scene file:
//!
//! ```
//! let scene = specula::scene::Scene::parse("(objects: [(shape: Teapot())])", "example.ron")?;
//! assert_eq!(scene.objects().len(), 1);
//! # Ok::<(), specula::scene::SceneError>(())
//! ```
//!
//! and this is one that says more; `scenes/README.md` describes every field:
//!
//! ```
//! # let text = r##"
//! (
//!     camera: Perspective(position: (0, -8, 4), target: (0, 0, 1), fov_degrees: 35),
//!     background: "#101418",
//!     ambient: 0.1,
//!     lights: [
//!         Point(position: (-5, -6, 7), color: "#fff4e0", intensity: 0.9),
//!         Directional(direction: (-1, 1, -2), intensity: 0.3),
//!     ],
//!     materials: {
//!         "copper": (diffuse: (0.5, 0.2, 0.1), specular: (0.8, 0.6, 0.5), shininess: 60),
//!     },
//!     objects: [
//!         (shape: Teapot(tessellation: 8), material: "copper", rotate_degrees: (0, 0, 30)),
//!         (shape: Plane(width: 20, depth: 20, columns: 8, rows: 8)),
//!     ],
//! )
//! # "##;
//! # assert_eq!(specula::scene::Scene::parse(text, "example.ron")?.lights().len(), 2);
//! # Ok::<(), specula::scene::SceneError>(())
//! ```

pub mod animation;
mod defaults;
mod edit;
mod error;
mod file;
pub mod limits;
mod mesh_file;
mod mesh_scene;
mod part;
pub mod placement;
mod read;
mod shape;
mod source;
mod syntax;
pub mod view;
pub mod world;

pub use animation::Animation;
pub use edit::Revisions;
pub use error::SceneError;
pub use mesh_file::{MeshUp, load_mesh};
pub use placement::{Changes, GeometryChange, Placement};
pub use view::{Eye, View};
pub use world::{ReflectionModel, ShadingLight, ShadingMaterial, World};

use crate::geometry::Mesh;
use crate::math::Bounds;
pub(crate) use crate::math::unit;
use glam::{DMat4, DVec3};
use std::path::Path;
use std::sync::Arc;

/// A linear RGB colour or coefficient; 1 is the display's white.
pub type Rgb = [f64; 3];

/// A scene in author space: validated when it comes from a file, and free to change between frames.
///
/// Its parts are read by getters and changed by setters, each of which gives the part that changes a new
/// [revision](Revisions), so that an engine redoes what depends on it and nothing else. A scene put together by hand
/// should keep to the [`limits`]; beyond them nothing panics, but what is drawn is not specified.
#[derive(Clone, Debug)]
pub struct Scene {
    camera: Camera,
    background: Rgb,
    ambient: Rgb,
    lights: Vec<Light>,
    materials: Vec<Material>,
    objects: Vec<Object>,
    /// Where each object was when it came into the scene.
    rest: Vec<DMat4>,
    animation: Option<Animation>,
    revisions: Revisions,
}

impl Scene {
    /// Reads a scene file, or a mesh file whose name ends in `.obj`, which is shown alone: seen from the front and above, under
    /// three lights, in a shiny material. Paths of mesh files in a scene file start from its folder.
    ///
    /// # Errors
    /// When the file cannot be read ([`SceneError::is_io`]), or does not hold a valid scene.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, SceneError> {
        let path = path.as_ref();
        if mesh_file::is_mesh(path) {
            return mesh_scene::load(path);
        }
        let text = file::read_text(path, limits::MAX_FILE_BYTES)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Self::parse_in(&text, &path.to_string_lossy(), folder)
    }

    /// Reads a scene from the text of a scene file. `file_name` is what messages call it; paths of mesh files start from the
    /// folder that it names, or from the current one when it names none.
    ///
    /// # Errors
    /// When the text is not a valid scene.
    pub fn parse(text: &str, file_name: &str) -> Result<Self, SceneError> {
        let folder = Path::new(file_name).parent().unwrap_or(Path::new(""));
        Self::parse_in(text, file_name, folder)
    }

    fn parse_in(text: &str, file_name: &str, folder: &Path) -> Result<Self, SceneError> {
        read::scene(&source::Source {
            text: text.strip_prefix('\u{feff}').unwrap_or(text),
            file: file_name,
            folder,
        })
    }

    /// A scene of objects, with the camera and lights that a scene file without them gets.
    #[must_use]
    pub fn new(materials: Vec<Material>, objects: Vec<Object>) -> Self {
        let extent = Extent::of(&objects);
        Self {
            camera: Camera::fitted(&extent),
            background: defaults::BACKGROUND,
            ambient: defaults::AMBIENT,
            lights: defaults::lights(&extent),
            materials,
            rest: places(&objects),
            objects,
            animation: None,
            revisions: Revisions::fresh(),
        }
    }

    /// Number of triangles of all objects.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.objects.iter().map(|o| o.mesh.triangles.len()).sum()
    }
}

/// Where the objects are.
fn places(objects: &[Object]) -> Vec<DMat4> {
    objects.iter().map(|o| o.author_from_mesh).collect()
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
    /// Whether backs are drawn, too. The back of a triangle is a surface of its own: seen from behind, it has its normals
    /// turned round, whatever their angle to the viewer is. (A normal that is interpolated may turn away from the viewer
    /// on a triangle that shows its front, which then stays the front.)
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

/// Where objects are in author space: a box that holds them.
///
/// It is found relative to the first object, so that a small scene far from the origin loses no digits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Middle of the box.
    pub center: DVec3,
    /// From the middle to the corner with the largest coordinates; zero without vertices.
    pub half_size: DVec3,
}

impl Extent {
    /// The extent of `objects`.
    #[must_use]
    pub fn of(objects: &[Object]) -> Self {
        Self::of_places(
            objects
                .iter()
                .map(|object| (object, &object.author_from_mesh)),
        )
    }

    /// The extent of objects that are at other places than their own.
    fn of_places<'a>(objects: impl Iterator<Item = (&'a Object, &'a DMat4)>) -> Self {
        let mut bounds = Bounds::EMPTY;
        let mut reference = None;
        for (object, place) in objects {
            let translation = place.w_axis.truncate();
            let offset = translation - *reference.get_or_insert(translation);
            for &p in &object.mesh.positions {
                bounds.grow(place.transform_vector3(p) + offset);
            }
        }
        Self {
            center: reference.unwrap_or(DVec3::ZERO) + bounds.center(),
            half_size: if bounds.is_empty() {
                DVec3::ZERO
            } else {
                bounds.max * 0.5 - bounds.min * 0.5
            },
        }
    }

    /// Radius of the sphere about the middle that holds the box.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.half_size.length()
    }
}
