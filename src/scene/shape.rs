//! The shapes a scene file may name: how many triangles they have, and their meshes.

use crate::geometry::{Mesh, shapes};
use glam::DVec3;

/// A shape with its parameters, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    /// Newell's teapot.
    Teapot { tessellation: u32, bottom: bool },
    /// The unit sphere.
    Sphere { slices: u32, stacks: u32 },
    /// A ring about the z axis, its centre line of radius 1.
    Torus {
        minor_radius: f64,
        major_segments: u32,
        minor_segments: u32,
    },
    /// A unit square facing up.
    Plane { columns: u32, rows: u32 },
    /// The unit cube.
    Cube,
}

impl Shape {
    /// Number of triangles, without making them.
    pub(super) fn triangles(&self) -> u64 {
        match *self {
            Self::Teapot {
                tessellation,
                bottom,
            } => {
                let patches = if bottom { 32 } else { 28 };
                patches * 2 * u64::from(tessellation) * u64::from(tessellation)
            }
            Self::Sphere { slices, stacks } => 2 * u64::from(slices) * (u64::from(stacks) - 1),
            Self::Torus {
                major_segments,
                minor_segments,
                ..
            } => 2 * u64::from(major_segments) * u64::from(minor_segments),
            Self::Plane { columns, rows, .. } => 2 * u64::from(columns) * u64::from(rows),
            Self::Cube => 12,
        }
    }

    /// Makes the mesh.
    pub(super) fn mesh(&self) -> Mesh {
        match *self {
            Self::Teapot {
                tessellation,
                bottom,
            } => shapes::teapot(tessellation, bottom),
            Self::Sphere { slices, stacks } => shapes::sphere(slices, stacks),
            Self::Torus {
                minor_radius,
                major_segments,
                minor_segments,
            } => shapes::torus(1.0, minor_radius, major_segments, minor_segments),
            Self::Plane { columns, rows } => shapes::plane(1.0, 1.0, columns, rows),
            Self::Cube => shapes::cuboid(DVec3::ONE),
        }
    }

    /// A key under which equal shapes share one mesh.
    pub(super) fn key(&self) -> [u64; 4] {
        match *self {
            Self::Teapot {
                tessellation,
                bottom,
            } => [0, tessellation.into(), bottom.into(), 0],
            Self::Sphere { slices, stacks } => [1, slices.into(), stacks.into(), 0],
            Self::Torus {
                minor_radius,
                major_segments,
                minor_segments,
            } => [
                2,
                minor_radius.to_bits(),
                major_segments.into(),
                minor_segments.into(),
            ],
            Self::Plane { columns, rows } => [3, columns.into(), rows.into(), 0],
            Self::Cube => [4, 0, 0, 0],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_counted_right_before_they_exist() {
        let (tessellation, slices, stacks) = (3, 5, 4);
        for shape in [
            Shape::Teapot {
                tessellation,
                bottom: false,
            },
            Shape::Teapot {
                tessellation,
                bottom: true,
            },
            Shape::Sphere { slices, stacks },
            Shape::Torus {
                minor_radius: 0.5,
                major_segments: 7,
                minor_segments: 5,
            },
            Shape::Plane {
                columns: 4,
                rows: 5,
            },
            Shape::Cube,
        ] {
            assert_eq!(
                shape.triangles(),
                shape.mesh().triangles.len() as u64,
                "{shape:?}"
            );
        }
    }
}
