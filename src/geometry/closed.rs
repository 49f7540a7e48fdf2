//! Whether a mesh encloses a volume.
//!
//! A surface does if at every edge as many triangles pass in one direction as in the other, positions being the same if
//! their coordinates are equal (see [`Topology`](super::Topology)): it has no border, and all triangles turn the same
//! way. By the divergence theorem, six times the enclosed volume is the sum of the triangles' determinants; it is
//! positive if they turn outwards. Nobody outside ever sees such a surface's back.

use super::Mesh;
use glam::DVec3;
use rustc_hash::FxHashMap;

impl Mesh {
    /// Whether the mesh encloses a volume, its triangles counter-clockwise seen from outside. Triangles with an index out of
    /// range are left out, as nobody draws them.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        let mut ids = FxHashMap::default();
        let id_of_vertex: Vec<u32> = self
            .positions
            .iter()
            .map(|p| {
                // Adding +0 turns -0 into +0.
                let key = p.to_array().map(|c| (c + 0.0).to_bits());
                let next = ids.len() as u32;
                *ids.entry(key).or_insert(next)
            })
            .collect();
        // Passes from the smaller to the larger id, less those back.
        let mut passes: FxHashMap<(u32, u32), i32> = FxHashMap::default();
        let mut volume = 0.0;
        let reference = self.positions.first().copied().unwrap_or(DVec3::ZERO);
        let is_whole = |t: &&[u32; 3]| t.iter().all(|&v| (v as usize) < self.positions.len());
        for triangle in self.triangles.iter().filter(is_whole) {
            let [a, b, c] = triangle.map(|v| self.positions[v as usize] - reference);
            volume += a.dot(b.cross(c));
            for k in 0..3 {
                let from = id_of_vertex[triangle[k] as usize];
                let to = id_of_vertex[triangle[(k + 1) % 3] as usize];
                if from != to {
                    let pass = if from < to { 1 } else { -1 };
                    *passes.entry((from.min(to), from.max(to))).or_default() += pass;
                }
            }
        }
        volume > 0.0 && passes.values().all(|&balance| balance == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;

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
    fn odd_meshes_are_not_closed() {
        let mut mesh = shapes::cuboid(DVec3::ONE);
        mesh.positions[0] = DVec3::NAN;
        assert!(!mesh.is_closed());
        mesh.triangles = vec![[0, 1, 999]];
        assert!(!mesh.is_closed());
    }
}
