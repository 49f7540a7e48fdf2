//! Whether a mesh encloses a volume.
//!
//! A surface does if at every edge as many triangles pass in one direction as in the other, positions being the same if
//! their coordinates are equal (see [`Topology`](super::Topology)): it has no border, and all triangles turn the same
//! way. By the divergence theorem, six times the enclosed volume is the sum of the triangles' determinants; it is
//! positive if they turn outwards. Nobody outside ever sees such a surface's back.
//!
//! A mesh may have several parts that do not touch, one of them inside out. So each part's volume is found by itself; parts are
//! what positions connect (union by the smaller id). The surface of a cavity counts as inside out, too.

use super::Mesh;
use super::normals::root;
use rustc_hash::FxHashMap;

impl Mesh {
    /// Whether the mesh encloses a volume, its triangles counter-clockwise seen from outside. Triangles with an index out of
    /// range are left out, as nobody draws them.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        let mut ids = FxHashMap::default();
        let mut place_of_id = Vec::new();
        let id_of_vertex: Vec<u32> = self
            .positions
            .iter()
            .map(|&p| {
                // Adding +0 turns -0 into +0.
                let key = p.to_array().map(|c| (c + 0.0).to_bits());
                *ids.entry(key).or_insert_with(|| {
                    place_of_id.push(p);
                    place_of_id.len() as u32 - 1
                })
            })
            .collect();
        // Passes from the smaller to the larger id, less those back.
        let mut passes: FxHashMap<(u32, u32), i32> = FxHashMap::default();
        let mut parent: Vec<u32> = (0..place_of_id.len() as u32).collect();
        let is_whole = |t: &&[u32; 3]| t.iter().all(|&v| (v as usize) < self.positions.len());
        let triangles = || self.triangles.iter().filter(is_whole);
        for triangle in triangles() {
            let corners = triangle.map(|v| id_of_vertex[v as usize]);
            for k in 0..3 {
                let (from, to) = (corners[k], corners[(k + 1) % 3]);
                if from != to {
                    let pass = if from < to { 1 } else { -1 };
                    *passes.entry((from.min(to), from.max(to))).or_default() += pass;
                    let (a, b) = (root(&mut parent, from), root(&mut parent, to));
                    parent[a.max(b) as usize] = a.min(b);
                }
            }
        }
        let mut volumes: FxHashMap<u32, f64> = FxHashMap::default();
        for triangle in triangles() {
            let part = root(&mut parent, id_of_vertex[triangle[0] as usize]);
            // Seen from a point of the part, so that a small one far away loses no digits.
            let reference = place_of_id[part as usize];
            let [a, b, c] = triangle.map(|v| self.positions[v as usize] - reference);
            *volumes.entry(part).or_default() += a.dot(b.cross(c));
        }
        // A part without a volume is flat: each of its faces is some other one's back.
        volumes.values().any(|&volume| volume > 0.0)
            && volumes.values().all(|&volume| volume >= 0.0)
            && passes.values().all(|&balance| balance == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;
    use glam::DVec3;

    #[test]
    fn solids_are_closed_and_what_has_a_border_is_not() {
        let solids = [
            shapes::cuboid(DVec3::ONE),
            shapes::sphere(12, 7),
            shapes::torus(1.0, 0.4, 9, 5),
        ];
        for mesh in solids {
            assert!(mesh.is_closed());
            let mut open = mesh.clone();
            open.triangles.pop();
            assert!(!open.is_closed());
            let mut inside_out = mesh.clone();
            inside_out.triangles.iter_mut().for_each(|t| t.reverse());
            assert!(!inside_out.is_closed());
            let mut one_turned = mesh;
            one_turned.triangles[0].reverse();
            assert!(!one_turned.is_closed());
        }
        assert!(!shapes::plane(1.0, 1.0, 2, 3).is_closed());
        assert!(!Mesh::default().is_closed());
    }

    #[test]
    fn every_part_must_be_closed_and_turn_outwards() {
        let large = shapes::sphere(12, 7);
        let mut small = shapes::cuboid(DVec3::splat(0.1));
        let with = |small: &Mesh, offset: f64| {
            let mut both = large.clone();
            let first = both.positions.len() as u32;
            let places = small.positions.iter().map(|&p| p + offset * DVec3::X);
            both.positions.extend(places);
            both.normals.extend(&small.normals);
            let triangles = small.triangles.iter().map(|t| t.map(|v| first + v));
            both.triangles.extend(triangles);
            both
        };
        assert!(with(&small, 5.0).is_closed());
        small.triangles.iter_mut().for_each(|t| t.reverse());
        assert!(!with(&small, 5.0).is_closed(), "inside out beside it");
        assert!(!with(&small, 0.0).is_closed(), "a cavity");
    }

    #[test]
    fn odd_meshes_are_not_closed() {
        let mut mesh = shapes::cuboid(DVec3::ONE);
        mesh.positions[0] = DVec3::NAN;
        assert!(!mesh.is_closed());
        mesh.triangles = vec![[0, 1, 999]];
        assert!(!mesh.is_closed());
    }
}
