//! An object's part of a [`World`]: its front, and its back if its material is two-sided.
//!
//! The **back** of a triangle is a surface of its own, seen where the front is not: the same vertices once more, their
//! normals turned round, and the triangle with the opposite winding. Everything after that knows only fronts: which of the two
//! is seen is decided by the winding on the screen, as with OpenGL's `gl_FrontFacing`, and not by an interpolated normal, which on
//! coarse meshes turns away from the viewer before the triangle does.
//!
//! Triangles are ordered by clusters, and **vertices** by the first triangle that uses them: what is drawn together is together in
//! memory. Set-up of a fine mesh takes a third less time for it.

use super::{Object, World, unit};
use crate::geometry::clusters::bound_again;
use crate::geometry::{Mesh, build_clusters};
use crate::math::Bounds;
use crate::parallel::Exec;
use glam::{DMat3, DMat4, DVec3};
use std::ops::Range;

/// Clusters that one thread bounds anew: a task of about 50 microseconds.
const CLUSTERS_PER_TASK: usize = 8;

/// An object's part of the world.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub(super) front: Side,
    pub(super) back: Option<Side>,
    /// The mesh's vertex of each vertex of a side.
    mesh_vertices: Vec<u32>,
    material: u16,
    /// Where it is now.
    pub(super) place: DMat4,
    /// Whether that turns the mesh into its mirror image.
    pub(super) mirrors: bool,
    /// Whether the last change of the scene moved it.
    pub(super) has_moved: bool,
    /// Where it was when it came into the scene.
    pub(super) rest: DMat4,
    /// Whether it shares a position with another object at rest.
    pub(super) touches: bool,
    /// A ball about the mesh, in its own space.
    ball: (DVec3, f64),
    /// Distance of its farthest vertex from the world's origin.
    pub(super) radius: f64,
}

/// The front or the back of an object: what of the world it is.
#[derive(Clone, Debug)]
pub(super) struct Side {
    pub(super) vertices: Range<usize>,
    pub(super) triangles: Range<usize>,
    clusters: Range<usize>,
}

impl Part {
    /// Appends the front of an object at rest to the world. Its triangles turn as they do where it is now. It has the first
    /// material.
    pub(super) fn append(world: &mut World, object: &Object, rest: DMat4) -> Self {
        let mesh = &object.mesh;
        let (vertex, triangle) = (world.positions.len(), world.triangles.len());
        let cluster = world.clusters.len();
        let mirrors = mirrors(&object.author_from_mesh);
        // A valid scene's vertices can be indexed by 32 bits; an object that leads beyond has no triangles.
        let is_indexable = u32::try_from(vertex + mesh.positions.len()).is_ok();
        debug_assert!(is_indexable, "too many vertices");
        let count = if is_indexable {
            // A mesh put together by hand may lack normals; what uses such vertices is left out.
            mesh.positions.len().min(mesh.normals.len())
        } else {
            0
        };
        let vertices = append_vertices(world, count);
        let whole = |t: &&[u32; 3]| t.iter().all(|&i| (i as usize) < count);
        let triangles = mesh.triangles.iter().filter(whole).map(|t| {
            let [a, b, c] = t.map(|i| vertex as u32 + i);
            // A mirror image turns the other way round.
            if mirrors { [a, c, b] } else { [a, b, c] }
        });
        world.triangles.extend(triangles);
        world.triangle_material.resize(world.triangles.len(), 0);
        let mut part = Self {
            front: Side {
                vertices,
                triangles: triangle..world.triangles.len(),
                clusters: cluster..cluster,
            },
            back: None,
            mesh_vertices: (0..count as u32).collect(),
            material: 0,
            place: rest,
            mirrors,
            has_moved: false,
            rest,
            touches: false,
            ball: ball(mesh),
            radius: 0.0,
        };
        part.put(Exec::sequential(), world, mesh);
        world.clusters.extend(build_clusters(
            &world.positions,
            &mut world.triangles[triangle..],
            triangle as u32,
        ));
        part.front.clusters.end = world.clusters.len();
        part.order_vertices(world);
        part
    }

    /// Brings the front's vertices into the order in which its triangles use them; unused ones come last.
    fn order_vertices(&mut self, world: &mut World) {
        let Side {
            vertices,
            triangles,
            ..
        } = self.front.clone();
        const UNUSED: u32 = u32::MAX;
        let mut place_of = vec![UNUSED; vertices.len()];
        let mut order = Vec::with_capacity(vertices.len());
        for vertex in world.triangles[triangles].as_flattened_mut() {
            let old = *vertex as usize - vertices.start;
            if place_of[old] == UNUSED {
                place_of[old] = order.len() as u32;
                order.push(old as u32);
            }
            *vertex = vertices.start as u32 + place_of[old];
        }
        let unused = (0..).zip(&place_of).filter(|(_, place)| **place == UNUSED);
        order.extend(unused.map(|(old, _)| old));
        for list in [&mut world.positions, &mut world.normals] {
            for component in [&mut list.x, &mut list.y, &mut list.z] {
                let old = component[vertices.clone()].to_vec();
                for (to, &from) in component[vertices.clone()].iter_mut().zip(&order) {
                    *to = old[from as usize];
                }
            }
        }
        self.mesh_vertices = order;
    }

    /// Appends the back to the world, cut into clusters as the front is.
    pub(super) fn append_back(&mut self, world: &mut World) {
        let front = &self.front;
        let (vertex, triangle) = (world.positions.len(), world.triangles.len());
        let cluster = world.clusters.len();
        // Vertices that 32 bits cannot index have no triangles, as with the front.
        let is_indexable = u32::try_from(vertex + front.vertices.len()).is_ok();
        debug_assert!(is_indexable, "too many vertices");
        if is_indexable {
            let shift = (vertex - front.vertices.start) as u32;
            append_vertices(world, front.vertices.len());
            world.triangles.extend_from_within(front.triangles.clone());
            for [a, b, c] in &mut world.triangles[triangle..] {
                [*a, *b, *c] = [*a + shift, *c + shift, *b + shift];
            }
            world.triangle_material.resize(world.triangles.len(), 0);
            world.clusters.extend_from_within(front.clusters.clone());
        }
        self.back = Some(Side {
            vertices: vertex..world.positions.len(),
            triangles: triangle..world.triangles.len(),
            clusters: cluster..world.clusters.len(),
        });
        self.turn(world);
    }

    /// Its front, and its back if it has one.
    pub(super) fn sides(&self) -> impl Iterator<Item = &Side> {
        std::iter::once(&self.front).chain(&self.back)
    }

    /// Gives it a material by its index.
    pub(super) fn set_material(&mut self, world: &mut World, material: u16) {
        if self.material != material {
            self.material = material;
            for side in self.sides() {
                world.vertex_material[side.vertices.clone()].fill(material);
                world.triangle_material[side.triangles.clone()].fill(material);
            }
        }
    }

    /// Transforms positions and normals to where the object is, and bounds its clusters anew.
    pub(super) fn put(&mut self, exec: Exec, world: &mut World, mesh: &Mesh) {
        let linear = DMat3::from_mat4(self.place);
        let offset = self.place.w_axis.truncate() - world.author_origin;
        let normal_matrix = NormalMatrix::new(linear);
        let scale = world.world_from_author_scale;
        let mut farthest = 0.0_f64;
        for (vertex, &from) in self.front.vertices.clone().zip(&self.mesh_vertices) {
            let (position, normal) = (mesh.positions[from as usize], mesh.normals[from as usize]);
            let p = ((linear * position + offset) * scale).as_vec3();
            let n = normal_matrix.transform(normal).as_vec3();
            world.positions.set(vertex, p.to_array());
            world.normals.set(vertex, n.to_array());
            farthest = farthest.max(p.as_dvec3().length_squared());
        }
        self.radius = farthest.sqrt();
        let (positions, triangles) = (&world.positions, &world.triangles);
        let clusters = &mut world.clusters[self.front.clusters.clone()];
        exec.for_each_chunk(clusters, CLUSTERS_PER_TASK, |_, clusters| {
            for cluster in clusters {
                bound_again(positions, triangles, cluster);
            }
        });
        self.turn(world);
    }

    /// Makes the back, if there is one, from the front: the same positions, opposite normals.
    fn turn(&self, world: &mut World) {
        let Some(back) = &self.back else {
            return;
        };
        for (to, from) in back.vertices.clone().zip(self.front.vertices.clone()) {
            world.positions.set(to, world.positions.get(from));
            world.normals.set(to, world.normals.get(from).map(|c| -c));
        }
        for (to, from) in back.clusters.clone().zip(self.front.clusters.clone()) {
            let shift = (back.triangles.start - self.front.triangles.start) as u32;
            world.clusters[to] = world.clusters[from].turned(shift);
        }
    }

    /// Upper bound of the distance from `origin` to the object's farthest vertex if it were at `place`.
    pub(super) fn reach(&self, place: &DMat4, origin: DVec3) -> f64 {
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

/// Appends so many vertices, of the first material, that are still to be set.
fn append_vertices(world: &mut World, count: usize) -> Range<usize> {
    let vertices = world.positions.len()..world.positions.len() + count;
    world.positions.resize(vertices.end);
    world.normals.resize(vertices.end);
    world.vertex_material.resize(vertices.end, 0);
    vertices
}

/// Centre and radius of a ball about all vertices.
fn ball(mesh: &Mesh) -> (DVec3, f64) {
    let mut bounds = Bounds::EMPTY;
    mesh.positions.iter().for_each(|&p| bounds.grow(p));
    (bounds.center(), bounds.radius())
}

/// Whether a transform turns things into their mirror images.
pub(super) fn mirrors(place: &DMat4) -> bool {
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
