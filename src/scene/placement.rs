//! From a scene to its world, and from a changed scene to a changed world.
//!
//! A [`Placement`] remembers which part of a [`World`] each object of a scene has become, and which [revisions](Revisions)
//! of the scene it has seen. So after a change it does again what depends on it and nothing else: an object that has
//! moved gets new positions, normals and cluster bounds; other materials or lights are copied; and only for other objects
//! everything is made anew.
//!
//! **The same scene gives the same world, whatever it has been before**, so that a film does not depend on where it was
//! started. Order of triangles, clusters and topology are those of the objects *at rest*: where they were when they
//! came into the scene. Origin and scale are those of the scene at rest as long as no object reaches farther than `ROOM`
//! times what the scene did then, else they are fitted to where the objects are.
//!
//! Objects that touch at rest are welded there, so that no seam shows between them while they are refined. One that has
//! left its place is welded to nothing but itself. A front is never welded to a back.
//!
//! The world holds the fronts of all objects and then the backs of those whose material is two-sided. So a front has the
//! same number whether there are backs or not.

use super::part::{Part, mirrors};
use super::{Extent, Material, Object, Revisions, Scene, World, defaults};
use crate::geometry::Topology;
use crate::math::power_of_two_scale;
use crate::parallel::Exec;
use glam::DVec3;
use std::ops::Range;

/// The scene may reach so many times as far as it does at rest before origin and scale change: two bits of the 24 of an
/// `f32` are spent on that.
const ROOM: f64 = 4.0;

/// What a change of the scene means for whoever uses its world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// What has become of vertices and triangles.
    pub geometry: GeometryChange,
    /// Materials or lights are others. What has moved is lit otherwise even where this is false.
    pub shading: bool,
    /// The background is another.
    pub background: bool,
}

/// What has become of vertices and triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GeometryChange {
    /// They are as they were.
    #[default]
    None,
    /// Vertices have moved; triangles, clusters and topology are the same.
    Moved,
    /// Nothing is as it was.
    Replaced,
}

impl Changes {
    const EVERYTHING: Self = Self {
        geometry: GeometryChange::Replaced,
        shading: true,
        background: true,
    };
}

/// Which part of a world each object of a scene is. See the [module](self).
#[derive(Clone, Debug)]
pub struct Placement {
    /// What has been seen of the scene.
    revisions: Revisions,
    parts: Vec<Part>,
    at_rest: Anchor,
    /// What the last update moved.
    moved: Vec<Range<u32>>,
    /// How far from its origin the scene may reach before it is given another, in author units.
    room: f64,
}

/// Origin and scale of a world.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Anchor {
    /// In author space.
    origin: DVec3,
    /// World units per author unit.
    scale: f64,
}

impl Placement {
    /// Prepares a scene. Triangles are reordered within each object, so that each cluster's are consecutive.
    ///
    /// A scene that was changed by hand cannot make this fail: a material index out of range means the last material, and
    /// triangles with a vertex index out of range are left out.
    #[must_use]
    pub fn new(scene: &Scene) -> (Self, World) {
        let extent = Extent::of_places(scene.objects.iter().zip(&scene.rest));
        let at_rest = Anchor::new(&extent);
        let mut world = World::default();
        at_rest.set(&mut world);
        let mut parts = Vec::with_capacity(scene.objects.len());
        for (object, &rest) in scene.objects.iter().zip(&scene.rest) {
            parts.push(Part::append(&mut world, object, rest));
        }
        let fronts = world.triangles.len() as u32;
        for (part, object) in parts.iter_mut().zip(&scene.objects) {
            if material(scene, object).1.two_sided {
                part.append_back(&mut world);
            }
        }
        world.backs = fronts..world.triangles.len() as u32;
        world.object_starts = sides_in_order(&parts).map(|(_, side)| side.start).collect();
        let reach = parts
            .iter()
            .map(|part| part.reach(&part.rest, at_rest.origin));
        let mut placement = Self {
            revisions: scene.revisions,
            room: ROOM * reach.fold(0.0, f64::max),
            at_rest,
            moved: Vec::with_capacity(world.object_starts.len()),
            parts,
        };
        placement.weld(&mut world, scene);
        placement.move_parts(Exec::sequential(), &mut world, scene);
        placement.assign_materials(&mut world, scene);
        world.set_lights(&scene.lights);
        world.set_background(scene.background);
        (placement, world)
    }

    /// Whether nothing of the scene has changed since it was seen last.
    #[must_use]
    pub fn is_up_to_date(&self, scene: &Scene) -> bool {
        self.revisions == scene.revisions
    }

    /// Brings `world` from the state of the scene that was seen last to its present one.
    pub fn update(&mut self, exec: Exec, world: &mut World, scene: &Scene) -> Changes {
        let (known, now) = (self.revisions, scene.revisions);
        let has_moved = now.transforms != known.transforms;
        let has_other_materials = now.materials != known.materials;
        if now.objects != known.objects
            || has_moved && !self.can_move(scene)
            || has_other_materials && !self.has_the_backs_of(scene)
        {
            (*self, *world) = Self::new(scene);
            return Changes::EVERYTHING;
        }
        self.revisions = now;
        let mut changes = Changes::default();
        if has_moved {
            changes.geometry = self.move_parts(exec, world, scene);
        }
        if has_other_materials {
            changes.shading = true;
            self.assign_materials(world, scene);
        }
        // Which lights are far away depends on the size of the scene, and where they are on its origin.
        if now.lights != known.lights || changes.geometry != GeometryChange::None {
            let are_others = world.set_lights(&scene.lights);
            changes.shading |= are_others || now.lights != known.lights;
        }
        if now.background != known.background {
            changes.background = true;
            world.set_background(scene.background);
        }
        changes
    }

    /// The triangles of the objects that the last [update](Self::update) moved, ascending, if it [moved](GeometryChange::Moved)
    /// any: those of each object's front, and those of each one's back.
    #[must_use]
    pub fn moved(&self) -> &[Range<u32>] {
        &self.moved
    }

    /// Finds out which vertices are at the same place, and which objects touch. Positions must be those at rest.
    fn weld(&mut self, world: &mut World, scene: &Scene) {
        let fronts = self.parts.last().map_or(0, |part| part.front.vertices.end);
        let side = |vertex: usize| u32::from(vertex >= fronts);
        world.topology = Topology::in_groups(&world.positions, &world.triangles, side);
        let mut part_of_vertex = vec![0_u32; world.positions.len()];
        for (index, part) in (0_u32..).zip(&self.parts) {
            for side in part.sides() {
                part_of_vertex[side.vertices.clone()].fill(index);
            }
        }
        // Position ids count from 0 in the order of first appearance, so the first part that has one comes first.
        let mut first_part: Vec<u32> = Vec::new();
        for (&part, &position) in part_of_vertex
            .iter()
            .zip(&world.topology.position_of_vertex)
        {
            match first_part.get(position as usize) {
                None => first_part.push(part),
                Some(&first) if first != part => {
                    self.parts[first as usize].touches = true;
                    self.parts[part as usize].touches = true;
                }
                Some(_) => {}
            }
        }
        let is_apart =
            |(part, object): (&Part, &Object)| part.touches && object.author_from_mesh != part.rest;
        let parts = || self.parts.iter().zip(&scene.objects);
        if parts().any(is_apart) {
            let apart: Vec<bool> = parts().map(is_apart).collect();
            world.topology = Topology::in_groups(&world.positions, &world.triangles, |vertex| {
                let part = part_of_vertex[vertex];
                let group = if apart[part as usize] { part + 1 } else { 0 };
                2 * group + side(vertex)
            });
        }
    }

    /// Whether those objects have backs in the world that have two sides now.
    fn has_the_backs_of(&self, scene: &Scene) -> bool {
        (self.parts.iter().zip(&scene.objects))
            .all(|(part, object)| part.back.is_some() == material(scene, object).1.two_sided)
    }

    /// Whether triangles and topology stay what they are when objects move to where the scene has them now.
    fn can_move(&self, scene: &Scene) -> bool {
        self.parts.iter().zip(&scene.objects).all(|(part, object)| {
            let place = &object.author_from_mesh;
            let is_apart = *place != part.rest;
            let was_apart = part.place != part.rest;
            *place == part.place
                || mirrors(place) == part.mirrors && (!part.touches || is_apart == was_apart)
        })
    }

    /// Moves objects to where the scene has them now.
    fn move_parts(&mut self, exec: Exec, world: &mut World, scene: &Scene) -> GeometryChange {
        let anchor = self.anchor(scene);
        let is_new_anchor = anchor != Anchor::of(world);
        anchor.set(world);
        for part in &mut self.parts {
            part.has_moved = false;
        }
        for (part, object) in self.parts.iter_mut().zip(&scene.objects) {
            if is_new_anchor || part.place != object.author_from_mesh {
                part.place = object.author_from_mesh;
                part.put(exec, world, &object.mesh);
                part.has_moved = true;
            }
        }
        self.moved.clear();
        let moved = sides_in_order(&self.parts).filter(|(part, _)| part.has_moved);
        self.moved.extend(moved.map(|(_, side)| side));
        let radii = self.parts.iter().map(|part| part.radius);
        world.radius = radii.fold(0.0, f64::max);
        match self.parts.iter().any(|part| part.has_moved) {
            true => GeometryChange::Moved,
            false => GeometryChange::None,
        }
    }

    /// Origin and scale for where the scene's objects are now.
    fn anchor(&self, scene: &Scene) -> Anchor {
        let origin = self.at_rest.origin;
        let reaches_too_far = |(part, object): (&Part, &Object)| {
            part.reach(&object.author_from_mesh, origin) > self.room
        };
        if self.parts.iter().zip(&scene.objects).any(reaches_too_far) {
            Anchor::new(&Extent::of(&scene.objects))
        } else {
            self.at_rest
        }
    }

    /// Copies the materials, and gives each object its own.
    fn assign_materials(&mut self, world: &mut World, scene: &Scene) {
        world.set_materials(&scene.materials, scene.ambient);
        for (part, object) in self.parts.iter_mut().zip(&scene.objects) {
            part.set_material(world, material(scene, object).0);
        }
    }
}

/// The triangles of all fronts, then of all backs, in order, with the part that each belongs to.
fn sides_in_order(parts: &[Part]) -> impl Iterator<Item = (&Part, Range<u32>)> {
    let fronts = parts.iter().map(|part| (part, &part.front));
    let backs = (parts.iter()).filter_map(|part| Some((part, part.back.as_ref()?)));
    fronts.chain(backs).map(|(part, side)| {
        let [start, end] = [side.triangles.start, side.triangles.end].map(|t| t as u32);
        (part, start..end)
    })
}

/// An object's material and its index: the last there is if that does not exist, and without any the default one.
fn material<'a>(scene: &'a Scene, object: &Object) -> (u16, &'a Material) {
    let last = scene.materials.len().saturating_sub(1);
    let index = object.material.min(last).min(usize::from(u16::MAX));
    let material = scene.materials.get(index);
    (index as u16, material.unwrap_or(&defaults::MATERIAL))
}

impl Anchor {
    /// In the middle of `extent`, which it scales to about 1.
    fn new(extent: &Extent) -> Self {
        Self {
            origin: extent.center,
            scale: power_of_two_scale(extent.radius()),
        }
    }

    fn of(world: &World) -> Self {
        Self {
            origin: world.author_origin,
            scale: world.world_from_author_scale,
        }
    }

    fn set(self, world: &mut World) {
        world.author_origin = self.origin;
        world.world_from_author_scale = self.scale;
    }
}
