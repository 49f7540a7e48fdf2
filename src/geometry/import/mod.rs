//! Meshes from files: what a file says becomes [`Polygons`], those become a [`Mesh`].
//!
//! Positions are welded; every corner gets a normal, from the file or [averaged](super::normals); corners at the same position
//! with the same normal share a vertex; polygons are [triangulated](super::polygon). All of it takes O(n log n) time, gives
//! the same bits on every machine, and cannot fail.

pub mod obj;

pub use obj::{ObjError, ObjLimits};

use super::Mesh;
use super::normals::{self, CREASE_DEGREES, Incidence, Weight};
use super::polygon::{Polygons, Triangulator};
use crate::math::unit;
use glam::DVec3;

/// Where the normals of an imported mesh come from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Normals {
    /// From the file; where it has none, or zero or not a number, as in `Smooth` with the default crease angle and weight.
    #[default]
    File,
    /// Averaged from the adjacent faces.
    Smooth {
        /// Faces that meet at more than this angle share no normals; in 0..=180.
        crease_degrees: f64,
        /// How much each face counts.
        weight: Weight,
    },
    /// Those of the faces.
    Flat,
}

/// Makes a mesh of polygons. Those with less than three corners are left out.
///
/// # Panics
/// When a corner's position index is out of range, or there are 2^32 corners or more.
#[must_use]
pub fn mesh(mut polygons: Polygons, from: Normals) -> Mesh {
    polygons.weld();
    let incidence = Incidence::new(&polygons);
    let normals = corner_normals(&polygons, &incidence, from);

    let mut mesh = Mesh::default();
    let vertex_of_corner = share_vertices(&polygons, &incidence, &normals, &mut mesh);
    let mut triangulator = Triangulator::new();
    let mut points = Vec::new();
    let mut cut = Vec::new();
    mesh.triangles.reserve(
        polygons
            .corners
            .len()
            .saturating_sub(2 * polygons.ends.len()),
    );
    for range in polygons.ranges() {
        let vertices = &vertex_of_corner[range.clone()];
        points.clear();
        points.extend(
            polygons.corners[range]
                .iter()
                .map(|&position| polygons.positions[position as usize]),
        );
        cut.clear();
        triangulator.triangulate(&points, &mut cut);
        mesh.triangles
            .extend(cut.iter().map(|t| t.map(|k| vertices[k as usize])));
    }
    mesh
}

/// The unit normal of every corner.
fn corner_normals(polygons: &Polygons, incidence: &Incidence, from: Normals) -> Vec<DVec3> {
    let smooth = |weight, crease| normals::smooth(polygons, incidence, weight, crease);
    match from {
        Normals::Flat => normals::flat(polygons),
        Normals::Smooth {
            crease_degrees,
            weight,
        } => smooth(weight, crease_degrees),
        Normals::File => {
            let given: Vec<Option<DVec3>> = polygons.normals.iter().map(|&n| unit(n)).collect();
            if !given.is_empty() && given.iter().all(Option::is_some) {
                return given.into_iter().flatten().collect();
            }
            let mut normals = smooth(Weight::default(), CREASE_DEGREES);
            for (normal, given) in normals.iter_mut().zip(given) {
                *normal = given.unwrap_or(*normal);
            }
            normals
        }
    }
}

/// Makes one vertex for all corners with the same position and normal; returns the vertex of each corner.
fn share_vertices(
    polygons: &Polygons,
    incidence: &Incidence,
    normals: &[DVec3],
    mesh: &mut Mesh,
) -> Vec<u32> {
    let mut vertex_of_corner = vec![0; polygons.corners.len()];
    let mut sorted = Vec::new();
    for (group, &position) in incidence.groups().zip(&polygons.positions) {
        let key = |corner: u32| {
            normals[corner as usize]
                .to_array()
                .map(|c| (c + 0.0).to_bits())
        };
        sorted.clear();
        sorted.extend(group.iter().map(|&corner| (key(corner), corner)));
        sorted.sort_unstable();
        for same in sorted.chunk_by(|a, b| a.0 == b.0) {
            for &(_, corner) in same {
                vertex_of_corner[corner as usize] = mesh.positions.len() as u32;
            }
            mesh.positions.push(position);
            mesh.normals.push(normals[same[0].1 as usize]);
        }
    }
    vertex_of_corner
}
