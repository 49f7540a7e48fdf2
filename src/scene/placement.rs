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
//! left its place is welded to nothing but itself.

use super::{Extent, Object, Revisions, Scene, World, unit};
use crate::geometry::clusters::bound_again;
use crate::geometry::{Mesh, Topology, build_clusters};
use crate::math::{Bounds, power_of_two_scale};
use glam::{DMat3, DMat4, DVec3};
use std::ops::Range;

/// The scene may reach so many times as far as it does at rest before origin and scale change: two bits of the 24 of an
/// `f32` are spent on that.
const ROOM: f64 = 4.0;

/// What a change of the scene means for whoever uses its world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// What has become of vertices and triangles.
    pub geometry: GeometryChange,
    /// Materials or lights are others.
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
    /// Nothing is as it was, or triangles have become visible from other sides.
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
    /// How far from its origin the scene may reach before it is given another, in author units.
    room: f64,
}

/// An object's part of the world.
#[derive(Clone, Debug)]
struct Part {
    vertices: Range<usize>,
    triangles: Range<usize>,
    clusters: Range<usize>,
    material: u16,
    /// Whether both of its sides are drawn.
    two_sided: bool,
    /// Where it is now.
    place: DMat4,
    /// Whether that turns the mesh into its mirror image.
    mirrors: bool,
    /// Where it was when it came into the scene.
    rest: DMat4,
    /// Whether it shares a position with another object at rest.
    touches: bool,
    /// A ball about the mesh, in its own space.
    ball: (DVec3, f64),
    /// Distance of its farthest vertex from the world's origin.
    radius: f64,
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
        let reach = parts
            .iter()
            .map(|part| part.reach(&part.rest, at_rest.origin));
        let mut placement = Self {
            revisions: scene.revisions,
            room: ROOM * reach.fold(0.0, f64::max),
            at_rest,
            parts,
        };
        placement.weld(&mut world, scene);
        placement.move_parts(&mut world, scene);
        placement.assign_materials(&mut world, scene);
        world.set_lights(&scene.lights);
        world.set_background(scene.background);
        (placement, world)
    }

    /// Brings `world` from the state of the scene that was seen last to its present one.
    pub fn update(&mut self, world: &mut World, scene: &Scene) -> Changes {
        let (known, now) = (self.revisions, scene.revisions);
        let has_moved = now.transforms != known.transforms;
        if now.objects != known.objects || has_moved && !self.can_move(scene) {
            (*self, *world) = Self::new(scene);
            return Changes::EVERYTHING;
        }
        self.revisions = now;
        let mut changes = Changes::default();
        if has_moved {
            changes.geometry = self.move_parts(world, scene);
        }
        if now.materials != known.materials {
            changes.shading = true;
            if self.assign_materials(world, scene) {
                changes.geometry = GeometryChange::Replaced;
            }
        }
        // Which lights are far away depends on the size of the scene.
        if now.lights != known.lights || has_moved {
            changes.shading = true;
            world.set_lights(&scene.lights);
        }
        if now.background != known.background {
            changes.background = true;
            world.set_background(scene.background);
        }
        changes
    }

    /// Finds out which vertices are at the same place, and which objects touch. Positions must be those at rest.
    fn weld(&mut self, world: &mut World, scene: &Scene) {
        world.topology = Topology::new(&world.positions, &world.triangles);
        let mut part_of_vertex = vec![0_u32; world.positions.len()];
        for (index, part) in (0_u32..).zip(&self.parts) {
            part_of_vertex[part.vertices.clone()].fill(index);
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
                if apart[part as usize] { part + 1 } else { 0 }
            });
        }
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
    fn move_parts(&mut self, world: &mut World, scene: &Scene) -> GeometryChange {
        let anchor = self.anchor(scene);
        let is_new_anchor = anchor != Anchor::of(world);
        anchor.set(world);
        let mut change = GeometryChange::None;
        for (part, object) in self.parts.iter_mut().zip(&scene.objects) {
            if is_new_anchor || part.place != object.author_from_mesh {
                part.place = object.author_from_mesh;
                part.put(world, &object.mesh);
                change = GeometryChange::Moved;
            }
        }
        let radii = self.parts.iter().map(|part| part.radius);
        world.radius = radii.fold(0.0, f64::max);
        change
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

    /// Copies the materials, and gives each object its own. True when triangles become visible from other sides by that.
    fn assign_materials(&mut self, world: &mut World, scene: &Scene) -> bool {
        world.set_materials(&scene.materials, scene.ambient);
        let last = (world.materials.len() - 1).min(usize::from(u16::MAX));
        let mut has_other_sides = false;
        for (part, object) in self.parts.iter_mut().zip(&scene.objects) {
            let material = object.material.min(last) as u16;
            if part.material != material {
                part.material = material;
                world.vertex_material[part.vertices.clone()].fill(material);
                world.triangle_material[part.triangles.clone()].fill(material);
            }
            let two_sided = world.materials[usize::from(material)].two_sided;
            has_other_sides |= part.two_sided != two_sided;
            part.two_sided = two_sided;
        }
        has_other_sides
    }
}

impl Part {
    /// Appends an object at rest to the world. Its triangles turn as they do where it is now. It has the first material.
    fn append(world: &mut World, object: &Object, rest: DMat4) -> Self {
        let mesh = &object.mesh;
        let (vertex, triangle) = (world.positions.len(), world.triangles.len());
        let cluster = world.clusters.len();
        let mirrors = mirrors(&object.author_from_mesh);
        // A valid scene's vertices can be indexed by 32 bits; an object that leads beyond has no triangles.
        let is_indexable = u32::try_from(vertex + mesh.positions.len()).is_ok();
        debug_assert!(is_indexable, "too many vertices");
        let count = if is_indexable {
            mesh.positions.len()
        } else {
            0
        };
        let vertices = vertex..vertex + count;
        world.positions.resize(vertices.end);
        world.normals.resize(vertices.end);
        world.vertex_material.resize(vertices.end, 0);
        let whole = |t: &&[u32; 3]| t.iter().all(|&i| (i as usize) < count);
        let triangles = mesh.triangles.iter().filter(whole).map(|t| {
            let [a, b, c] = t.map(|i| vertex as u32 + i);
            // A mirror image turns the other way round.
            if mirrors { [a, c, b] } else { [a, b, c] }
        });
        world.triangles.extend(triangles);
        world.triangle_material.resize(world.triangles.len(), 0);
        let mut part = Self {
            vertices,
            triangles: triangle..world.triangles.len(),
            clusters: cluster..cluster,
            material: 0,
            two_sided: false,
            place: rest,
            mirrors,
            rest,
            touches: false,
            ball: ball(mesh),
            radius: 0.0,
        };
        part.put(world, mesh);
        world.clusters.extend(build_clusters(
            &world.positions,
            &mut world.triangles[triangle..],
            triangle as u32,
        ));
        part.clusters.end = world.clusters.len();
        part
    }

    /// Transforms positions and normals to where the object is, and bounds its clusters anew.
    fn put(&mut self, world: &mut World, mesh: &Mesh) {
        let linear = DMat3::from_mat4(self.place);
        let offset = self.place.w_axis.truncate() - world.author_origin;
        let normal_matrix = NormalMatrix::new(linear);
        let scale = world.world_from_author_scale;
        let mut farthest = 0.0_f64;
        for (vertex, (&position, &normal)) in self
            .vertices
            .clone()
            .zip(mesh.positions.iter().zip(&mesh.normals))
        {
            let p = ((linear * position + offset) * scale).as_vec3();
            let n = normal_matrix.transform(normal).as_vec3();
            world.positions.set(vertex, p.to_array());
            world.normals.set(vertex, n.to_array());
            farthest = farthest.max(p.as_dvec3().length_squared());
        }
        self.radius = farthest.sqrt();
        for cluster in &mut world.clusters[self.clusters.clone()] {
            bound_again(&world.positions, &world.triangles, cluster);
        }
    }

    /// Upper bound of the distance from `origin` to the object's farthest vertex if it were at `place`.
    fn reach(&self, place: &DMat4, origin: DVec3) -> f64 {
        let (center, radius) = self.ball;
        let linear = DMat3::from_mat4(*place);
        let offset = place.w_axis.truncate() - origin;
        // The Frobenius norm is no less than what a unit vector is stretched to.
        let columns = [linear.x_axis, linear.y_axis, linear.z_axis];
        let stretch = columns
            .map(DVec3::length_squared)
            .iter()
            .sum::<f64>()
            .sqrt();
        (linear * center + offset).length() + stretch * radius
    }
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

/// Centre and radius of a ball about all vertices.
fn ball(mesh: &Mesh) -> (DVec3, f64) {
    let mut bounds = Bounds::EMPTY;
    mesh.positions.iter().for_each(|&p| bounds.grow(p));
    (bounds.center(), bounds.radius())
}

/// Whether a transform turns things into their mirror images.
fn mirrors(place: &DMat4) -> bool {
    NormalMatrix::new(DMat3::from_mat4(*place)).mirrors
}

/// Transforms normals as `linear` transforms surfaces.
///
/// Normals are transformed by the inverse transpose. The cofactor matrix of `A` is `det A` times that, hence the same but
/// for length and sign, and needs no division.
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
