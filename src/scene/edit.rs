//! Reading and changing a scene, and telling what has changed.
//!
//! Every part of a scene has a revision: a number that no other state of that part has had in this process. A setter
//! that changes a part gives it a new one; a setter that is given what is there already does nothing. So two scenes
//! whose revisions of a part are equal have equal parts, also when one is a clone of the other and both have been
//! changed since, and whoever remembers the revisions of what it has seen knows what to do again.

use super::{Camera, Light, Material, Object, Rgb, Scene, places};
use glam::DMat4;
use std::sync::atomic::{AtomicU64, Ordering};

/// Revisions of the parts of a [`Scene`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Revisions {
    /// From where it is seen.
    pub camera: u64,
    /// Which objects there are, and their meshes.
    pub objects: u64,
    /// Where the objects are.
    pub transforms: u64,
    /// Materials, which object has which, and ambient light.
    pub materials: u64,
    /// Light sources.
    pub lights: u64,
    /// The background.
    pub background: u64,
}

impl Revisions {
    /// Those of a new scene.
    pub(super) fn fresh() -> Self {
        Self {
            camera: fresh(),
            objects: fresh(),
            transforms: fresh(),
            materials: fresh(),
            lights: fresh(),
            background: fresh(),
        }
    }
}

/// A number that has not been used before in this process.
fn fresh() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// Puts `new` in place of `old`, with a new revision if they differ.
fn replace<T: PartialEq>(old: &mut T, new: T, revision: &mut u64) {
    if *old != new {
        *old = new;
        *revision = fresh();
    }
}

impl Scene {
    /// Revisions of the scene's parts.
    #[must_use]
    pub fn revisions(&self) -> Revisions {
        self.revisions
    }

    /// From where the scene is seen.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Changes from where the scene is seen.
    pub fn set_camera(&mut self, camera: Camera) {
        replace(&mut self.camera, camera, &mut self.revisions.camera);
    }

    /// Linear colour of pixels that nothing covers.
    #[must_use]
    pub fn background(&self) -> Rgb {
        self.background
    }

    /// Changes the colour of pixels that nothing covers.
    pub fn set_background(&mut self, color: Rgb) {
        replace(&mut self.background, color, &mut self.revisions.background);
    }

    /// Linear ambient light.
    #[must_use]
    pub fn ambient(&self) -> Rgb {
        self.ambient
    }

    /// Changes the ambient light.
    pub fn set_ambient(&mut self, light: Rgb) {
        replace(&mut self.ambient, light, &mut self.revisions.materials);
    }

    /// Light sources.
    #[must_use]
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// Changes one light source.
    ///
    /// # Panics
    /// When there is no light `index`.
    pub fn set_light(&mut self, index: usize, light: Light) {
        let slot = &mut self.lights[index];
        replace(slot, light, &mut self.revisions.lights);
    }

    /// Puts other light sources in place of all there are. Those beyond [`MAX_LIGHTS`](super::limits::MAX_LIGHTS) do not
    /// shine.
    pub fn set_lights(&mut self, lights: Vec<Light>) {
        replace(&mut self.lights, lights, &mut self.revisions.lights);
    }

    /// Materials, which objects refer to by index.
    #[must_use]
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Changes one material, for all objects that have it.
    ///
    /// # Panics
    /// When there is no material `index`.
    pub fn set_material(&mut self, index: usize, material: Material) {
        let slot = &mut self.materials[index];
        replace(slot, material, &mut self.revisions.materials);
    }

    /// Adds a material and returns its index.
    pub fn add_material(&mut self, material: Material) -> usize {
        self.materials.push(material);
        self.revisions.materials = fresh();
        self.materials.len() - 1
    }

    /// Meshes in place.
    #[must_use]
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// Moves one object: `author_from_mesh` is the affine transform from its mesh's space to author space.
    ///
    /// # Panics
    /// When there is no object `index`.
    pub fn set_transform(&mut self, index: usize, author_from_mesh: DMat4) {
        let slot = &mut self.objects[index].author_from_mesh;
        replace(slot, author_from_mesh, &mut self.revisions.transforms);
    }

    /// Gives one object another material. One that does not exist means the last there is.
    ///
    /// # Panics
    /// When there is no object `index`.
    pub fn set_object_material(&mut self, index: usize, material: usize) {
        let slot = &mut self.objects[index].material;
        replace(slot, material, &mut self.revisions.materials);
    }

    /// Adds an object and returns its index.
    pub fn add_object(&mut self, object: Object) -> usize {
        self.rest.push(object.author_from_mesh);
        self.objects.push(object);
        self.objects_changed();
        self.objects.len() - 1
    }

    /// Puts other objects in place of all there are. Camera and lights stay as they are.
    pub fn set_objects(&mut self, objects: Vec<Object>) {
        self.rest = places(&objects);
        self.objects = objects;
        self.objects_changed();
    }

    fn objects_changed(&mut self) {
        self.revisions.objects = fresh();
        self.revisions.transforms = fresh();
        self.revisions.materials = fresh();
    }
}
