//! Ready-made meshes: Newell's teapot, sphere, torus, plane and box.
//!
//! All are in `f64`, z up, with unit normals and counter-clockwise triangles seen from outside. Angles go through
//! `libm`, so that a mesh has the same bits on every machine. Counts that are too small for the shape are raised to
//! the smallest that makes sense, as each function says; large ones are the caller's to limit.

mod solids;
mod teapot;

pub use solids::{cuboid, plane, sphere, torus};
pub use teapot::teapot;

#[cfg(test)]
mod checks {
    //! Properties that every shape is tested for.

    use crate::geometry::Mesh;
    use glam::DVec3;
    use std::collections::HashMap;

    /// The cross product of a triangle's edges: twice its area along its outward normal.
    pub(super) fn doubled_area(mesh: &Mesh, triangle: [u32; 3]) -> DVec3 {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        (b - a).cross(c - a)
    }

    /// Every number is finite, every normal a unit vector, every index valid, and every triangle with an area agrees
    /// with the sum of its corners' normals about the outside. Returns the number of triangles without an area.
    pub(super) fn assert_sound(mesh: &Mesh) -> usize {
        assert_eq!(mesh.positions.len(), mesh.normals.len(), "one normal each");
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            assert!(p.is_finite(), "position {p}");
            assert!((n.length() - 1.0).abs() < 1e-12, "normal {n} at {p}");
        }
        let mut flat = 0;
        for &triangle in &mesh.triangles {
            let face = doubled_area(mesh, triangle);
            if face.length() < 1e-10 {
                flat += 1;
                continue;
            }
            let outside: DVec3 = triangle.iter().map(|&v| mesh.normals[v as usize]).sum();
            assert!(face.dot(outside) > 0.0, "{triangle:?} turned inwards");
        }
        flat
    }

    /// Every edge between welded positions has as many triangles in one direction as in the other, and just one.
    pub(super) fn assert_closed(mesh: &Mesh) {
        let key = |v: u32| {
            let p = mesh.positions[v as usize];
            p.to_array().map(|c| (c * 1e9).round() as i64)
        };
        let mut edges: HashMap<_, i32> = HashMap::new();
        for t in &mesh.triangles {
            for k in 0..3 {
                let (a, b) = (key(t[k]), key(t[(k + 1) % 3]));
                assert_ne!(a, b, "edge without length in {t:?}");
                *edges.entry((a, b)).or_default() += 1;
            }
        }
        for (&(a, b), &count) in &edges {
            assert_eq!(count, 1, "edge {a:?} {b:?} is used more than once");
            assert_eq!(edges.get(&(b, a)), Some(&1), "edge {a:?} {b:?} is open");
        }
    }
}
