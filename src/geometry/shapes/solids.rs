//! Sphere, torus, plane and box.

use crate::geometry::Mesh;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Cosine and sine of an angle in radians, the same bits everywhere.
fn unit_circle(angle: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(angle);
    DVec2::new(cos, sin)
}

/// The two triangles of the quad `a b c d` (counter-clockwise), split from `a` to `c`.
fn quad(a: u32, b: u32, c: u32, d: u32) -> [[u32; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

/// The unit sphere about the origin, its poles on the z axis, with its exact normals.
///
/// `2 * slices * (stacks - 1)` triangles. At least 3 `slices` around the axis and 2 `stacks` from pole to pole.
#[must_use]
pub fn sphere(slices: u32, stacks: u32) -> Mesh {
    let (slices, stacks) = (slices.max(3), stacks.max(2));
    let mut positions = vec![DVec3::Z];
    for i in 1..stacks {
        let ring = unit_circle(PI * f64::from(i) / f64::from(stacks));
        for j in 0..slices {
            let around = unit_circle(TAU * f64::from(j) / f64::from(slices));
            positions.push((around * ring.y).extend(ring.x));
        }
    }
    positions.push(DVec3::NEG_Z);

    let south = positions.len() as u32 - 1;
    let vertex = |ring: u32, j: u32| 1 + (ring - 1) * slices + j % slices;
    let mut triangles = Vec::with_capacity(2 * slices as usize * (stacks as usize - 1));
    for j in 0..slices {
        triangles.push([0, vertex(1, j), vertex(1, j + 1)]);
        for i in 1..stacks - 1 {
            triangles.extend(quad(
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            ));
        }
        triangles.push([vertex(stacks - 1, j), south, vertex(stacks - 1, j + 1)]);
    }
    // cos² + sin² is 1 only up to rounding.
    let normals = positions.iter().map(|p| p.normalize()).collect();
    Mesh {
        positions,
        normals,
        triangles,
    }
}

/// A torus around the z axis, with its exact normals: a tube of `minor_radius` whose centre line is the circle of
/// `major_radius` in the plane z = 0.
///
/// `2 * major_segments * minor_segments` triangles. At least 3 segments each way. Radii that are not positive, or a
/// minor radius above the major one, give a torus that goes through itself or has no volume.
#[must_use]
pub fn torus(
    major_radius: f64,
    minor_radius: f64,
    major_segments: u32,
    minor_segments: u32,
) -> Mesh {
    let (major, minor) = (major_segments.max(3), minor_segments.max(3));
    let mut mesh = Mesh::default();
    for i in 0..major {
        let around = unit_circle(TAU * f64::from(i) / f64::from(major));
        for j in 0..minor {
            let tube = unit_circle(TAU * f64::from(j) / f64::from(minor));
            let normal = (around * tube.x).extend(tube.y);
            let center = (around * major_radius).extend(0.0);
            mesh.positions.push(center + normal * minor_radius);
            mesh.normals.push(normal.normalize());
        }
    }
    let vertex = |i: u32, j: u32| (i % major) * minor + j % minor;
    for i in 0..major {
        for j in 0..minor {
            mesh.triangles.extend(quad(
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            ));
        }
    }
    mesh
}

/// A rectangle in the plane z = 0 about the origin that faces +z, `width` along x and `depth` along y.
///
/// `2 * columns * rows` triangles; at least one column and one row.
#[must_use]
pub fn plane(width: f64, depth: f64, columns: u32, rows: u32) -> Mesh {
    let (columns, rows) = (columns.max(1), rows.max(1));
    let mut mesh = Mesh::default();
    for j in 0..=rows {
        for i in 0..=columns {
            let x = (f64::from(i) / f64::from(columns) - 0.5) * width;
            let y = (f64::from(j) / f64::from(rows) - 0.5) * depth;
            mesh.positions.push(DVec3::new(x, y, 0.0));
        }
    }
    mesh.normals = vec![DVec3::Z; mesh.positions.len()];
    let vertex = |i: u32, j: u32| j * (columns + 1) + i;
    for j in 0..rows {
        for i in 0..columns {
            mesh.triangles.extend(quad(
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            ));
        }
    }
    mesh
}

/// A box of full edge lengths `size` about the origin: 12 triangles, and 24 vertices because every face has its own
/// four with its own flat normal. The sign of `size` does not matter.
#[must_use]
pub fn cuboid(size: DVec3) -> Mesh {
    let half = size.abs() * 0.5;
    let mut mesh = Mesh::default();
    // Each face: its normal and the directions of its first and second edge, a right-handed triple.
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    for k in 0..3 {
        let (normal, u, v) = (axes[k], axes[(k + 1) % 3], axes[(k + 2) % 3]);
        for (normal, u, v) in [(normal, u, v), (-normal, v, u)] {
            let first = mesh.positions.len() as u32;
            for corner in [-u - v, u - v, u + v, v - u] {
                mesh.positions.push((normal + corner) * half);
                mesh.normals.push(normal);
            }
            mesh.triangles
                .extend(quad(first, first + 1, first + 2, first + 3));
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes::checks::{assert_closed, assert_sound, doubled_area};

    /// Volume inside a closed mesh, by the divergence theorem.
    fn volume(mesh: &Mesh) -> f64 {
        let sixfold: f64 = mesh
            .triangles
            .iter()
            .map(|&t| mesh.positions[t[0] as usize].dot(doubled_area(mesh, t)))
            .sum();
        sixfold / 6.0
    }

    #[test]
    fn spheres_are_closed_and_round() {
        for (slices, stacks) in [(0, 0), (3, 2), (7, 5), (64, 32)] {
            let mesh = sphere(slices, stacks);
            let (n, m) = (slices.max(3), stacks.max(2));
            assert_eq!(mesh.triangles.len() as u32, 2 * n * (m - 1));
            assert_eq!(assert_sound(&mesh), 0);
            assert_closed(&mesh);
            for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
                assert!((p.length() - 1.0).abs() < 1e-15 && p.distance(*n) < 1e-15);
            }
        }
        let ball = 4.0 / 3.0 * PI;
        assert!((volume(&sphere(256, 128)) / ball - 1.0).abs() < 1e-3);
    }

    #[test]
    fn tori_are_closed_and_have_the_right_volume() {
        for (i, j) in [(0, 0), (3, 3), (12, 5)] {
            let mesh = torus(2.0, 0.5, i, j);
            assert_eq!(mesh.triangles.len() as u32, 2 * i.max(3) * j.max(3));
            assert_closed(&mesh);
        }
        let mesh = torus(2.0, 0.5, 200, 100);
        assert_eq!(assert_sound(&mesh), 0);
        let exact = 2.0 * PI * PI * 2.0 * 0.25;
        assert!((volume(&mesh) / exact - 1.0).abs() < 2e-3);
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            let to_center_line = *p - n * 0.5;
            assert!(to_center_line.z.abs() < 1e-12);
            assert!((to_center_line.length() - 2.0).abs() < 1e-12);
        }
    }

    #[test]
    fn planes_face_up_and_cover_their_rectangle() {
        for (columns, rows) in [(0, 0), (1, 1), (5, 3)] {
            let mesh = plane(4.0, 2.0, columns, rows);
            assert_eq!(assert_sound(&mesh), 0);
            assert_eq!(
                mesh.triangles.len() as u32,
                2 * columns.max(1) * rows.max(1)
            );
            let area: DVec3 = mesh.triangles.iter().map(|&t| doubled_area(&mesh, t)).sum();
            assert!((area * 0.5).distance(DVec3::new(0.0, 0.0, 8.0)) < 1e-12);
            let sum: DVec3 = mesh.positions.iter().sum();
            assert!(sum.length() < 1e-12, "centred");
        }
    }

    #[test]
    fn boxes_have_flat_faces_and_are_closed() {
        for size in [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 2.0, -3.0)] {
            let mesh = cuboid(size);
            assert_eq!((mesh.positions.len(), mesh.triangles.len()), (24, 12));
            assert_eq!(assert_sound(&mesh), 0);
            assert_closed(&mesh);
            assert!((volume(&mesh) - 6.0).abs() < 1e-12);
            for &t in &mesh.triangles {
                let face = doubled_area(&mesh, t).normalize();
                for v in t {
                    assert!(face.distance(mesh.normals[v as usize]) < 1e-15);
                }
            }
        }
    }
}
