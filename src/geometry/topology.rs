//! Which vertices are at the same place, and which triangles share an edge.
//!
//! A mesh repeats a position wherever normals or materials differ (creases, seams, borders of objects), so that vertex
//! indices do not say who is whose neighbour. Here vertices with equal coordinates get one *position id*, and an
//! edge is an unordered pair of position ids. Half-edge `3 t + k` goes from corner `k` to corner `(k + 1) % 3` of
//! triangle `t`. The half-edges on the same edge form a ring: two on an ordinary edge, one on a border, more
//! where the surface is not a manifold, in ascending order.
//!
//! Building sorts twice, O(n log n), and depends on nothing but the input.

use super::Vec3s;

/// Position ids and edge rings of a set of triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// The position id of each vertex: ids count from 0 in the order of first appearance.
    pub position_of_vertex: Vec<u32>,
    /// For each half-edge the next one on the same edge, the first after the last; itself when alone.
    pub next_on_edge: Vec<u32>,
}

impl Topology {
    /// Finds the position ids of all `positions` and the edge rings of all `triangles`.
    ///
    /// Coordinates are compared as numbers (-0 equals 0), NaN by its bits. An edge without length, both of whose ends
    /// have the same position, is in a ring by itself.
    ///
    /// # Panics
    /// When a triangle's vertex index is out of range, or there are 2^32 half-edges or more.
    #[must_use]
    pub fn new(positions: &Vec3s, triangles: &[[u32; 3]]) -> Self {
        Self::in_groups(positions, triangles, |_| 0)
    }

    /// As [`new`](Self::new), but vertices of different groups are never at the same place, whatever their positions.
    ///
    /// # Panics
    /// As [`new`](Self::new).
    #[must_use]
    pub fn in_groups(
        positions: &Vec3s,
        triangles: &[[u32; 3]],
        group_of_vertex: impl Fn(usize) -> u32,
    ) -> Self {
        assert!(
            u32::try_from(triangles.len() * 3).is_ok(),
            "too many triangles to number their half-edges"
        );
        let position_of_vertex = weld(positions, group_of_vertex);
        let next_on_edge = link(&position_of_vertex, triangles);
        Self {
            position_of_vertex,
            next_on_edge,
        }
    }

    /// All half-edges on the edge of `half_edge`: itself, then the others in ring order.
    ///
    /// # Panics
    /// When `half_edge` is out of range.
    #[inline]
    pub fn ring(&self, half_edge: u32) -> impl Iterator<Item = u32> {
        let mut next = Some(half_edge);
        std::iter::from_fn(move || {
            let current = next?;
            let following = self.next_on_edge[current as usize];
            next = (following != half_edge).then_some(following);
            Some(current)
        })
    }
}

/// The position id of each vertex.
fn weld(positions: &Vec3s, group_of_vertex: impl Fn(usize) -> u32) -> Vec<u32> {
    let key = |i: usize| {
        // Adding +0 turns -0 into +0 and leaves every other number as it is.
        let [x, y, z] = positions.get(i).map(|c| (c + 0.0).to_bits());
        [x, y, z, group_of_vertex(i)]
    };
    let mut order: Vec<([u32; 4], u32)> =
        (0..positions.len()).map(|i| (key(i), i as u32)).collect();
    order.sort_unstable();
    // First every vertex learns the first one at its place, ...
    let mut ids = vec![0; order.len()];
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        for &(_, vertex) in same {
            ids[vertex as usize] = same[0].1;
        }
    }
    // ... then those are numbered; they come before all others that refer to them.
    let mut count = 0;
    for vertex in 0..ids.len() {
        let first = ids[vertex] as usize;
        if first == vertex {
            ids[vertex] = count;
            count += 1;
        } else {
            ids[vertex] = ids[first];
        }
    }
    ids
}

/// The successor of each half-edge in its ring.
fn link(position_of_vertex: &[u32], triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut next: Vec<u32> = (0..3 * triangles.len() as u32).collect();
    let mut edges = Vec::with_capacity(next.len());
    for (triangle, corners) in (0_u32..).zip(triangles) {
        let ids = corners.map(|v| position_of_vertex[v as usize]);
        for k in 0..3 {
            let (a, b) = (ids[k], ids[(k + 1) % 3]);
            if a != b {
                edges.push(([a.min(b), a.max(b)], 3 * triangle + k as u32));
            }
        }
    }
    edges.sort_unstable();
    for ring in edges.chunk_by(|a, b| a.0 == b.0) {
        for (i, &(_, half_edge)) in ring.iter().enumerate() {
            next[half_edge as usize] = ring[(i + 1) % ring.len()].1;
        }
    }
    next
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;
    use proptest::prelude::*;

    fn vec3s(points: &[[f32; 3]]) -> Vec3s {
        let mut out = Vec3s::default();
        points.iter().for_each(|&p| out.push(p));
        out
    }

    /// Compares everything with everything.
    fn check_against_brute_force(points: &[[f32; 3]], triangles: &[[u32; 3]]) {
        let topology = Topology::new(&vec3s(points), triangles);
        let id = &topology.position_of_vertex;
        for i in 0..points.len() {
            for j in 0..points.len() {
                assert_eq!(id[i] == id[j], points[i] == points[j], "vertices {i} {j}");
            }
            let highest = id[..i].iter().max().map_or(0, |m| m + 1);
            assert!(id[i] <= highest, "ids are numbered in order of appearance");
        }
        let ends = |h: u32| {
            let t = triangles[h as usize / 3];
            let k = h as usize % 3;
            [t[k], t[(k + 1) % 3]].map(|v| points[v as usize])
        };
        let count = 3 * triangles.len() as u32;
        assert_eq!(topology.next_on_edge.len(), count as usize);
        for h in 0..count {
            let [a, b] = ends(h);
            let mut expected: Vec<u32> = (0..count)
                .filter(|&g| g == h || (a != b && (ends(g) == [a, b] || ends(g) == [b, a])))
                .collect();
            // Ascending, but beginning with h.
            let at = expected.iter().position(|&g| g == h).expect("contains h");
            expected.rotate_left(at);
            assert_eq!(topology.ring(h).collect::<Vec<_>>(), expected, "edge {h}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Few places, so that creases, fans and triangles without area abound.
        #[test]
        fn random_soups_agree_with_brute_force(
            points in prop::collection::vec(
                prop::array::uniform3(prop::sample::select(vec![0.0_f32, -0.0, 1.0])), 1..24),
            corners in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 0..24),
        ) {
            let triangles: Vec<[u32; 3]> = corners
                .iter()
                .map(|t| t.map(|i| i.index(points.len()) as u32))
                .collect();
            check_against_brute_force(&points, &triangles);
        }
    }

    #[test]
    fn a_fan_of_three_triangles_shares_one_ring() {
        let points = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        let triangles = [[0, 1, 2], [1, 0, 3], [0, 1, 4]];
        check_against_brute_force(&points, &triangles);
        let topology = Topology::new(&vec3s(&points), &triangles);
        assert_eq!(topology.ring(3).collect::<Vec<_>>(), [3, 6, 0]);
    }

    #[test]
    fn the_creases_of_a_box_are_ordinary_edges() {
        let mesh = shapes::cuboid(glam::DVec3::ONE);
        let points: Vec<_> = mesh
            .positions
            .iter()
            .map(|p| p.as_vec3().to_array())
            .collect();
        check_against_brute_force(&points, &mesh.triangles);
        let topology = Topology::new(&vec3s(&points), &mesh.triangles);
        assert_eq!(topology.position_of_vertex.iter().max(), Some(&7));
        assert!((0..36).all(|h| topology.ring(h).count() == 2), "closed");
    }

    #[test]
    fn nothing_has_no_topology() {
        assert_eq!(Topology::new(&Vec3s::default(), &[]), Topology::default());
    }
}
