//! A mesh put together by a program.

use super::import::{self, Normals};
use super::polygon::Polygons;
use glam::DVec3;

/// A triangle mesh in a space of its own.
///
/// One that is put together field by field is not checked: vertices without a normal, and triangles with an index out of
/// range, are not drawn. [`Mesh::new`] and [`Mesh::from_triangles`] check.
///
/// ```
/// use specula::geometry::Mesh;
/// use specula::geometry::import::Normals;
/// use specula::glam::{DMat4, DVec3};
/// use specula::scene::{Object, Scene};
/// use std::sync::Arc;
///
/// // A tetrahedron, whose faces shall be flat.
/// let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
/// let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
/// let mesh = Mesh::from_triangles(positions, &triangles, Normals::Flat)?;
/// assert!(mesh.is_closed() && mesh.triangles.len() == 4);
/// let object = Object {
///     mesh: Arc::new(mesh),
///     material: 0,
///     author_from_mesh: DMat4::IDENTITY,
/// };
/// // Without materials there is the default one; camera and lights are fitted to the objects.
/// let scene = Scene::new(Vec::new(), vec![object]);
/// # Ok::<(), specula::geometry::MeshError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<DVec3>,
    /// Unit vertex normals, one for each position.
    pub normals: Vec<DVec3>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// Why arrays do not make a mesh.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// Not as many normals as positions.
    #[error("there are {positions} positions, but {normals} normals")]
    NormalCount {
        /// Positions given.
        positions: usize,
        /// Normals given.
        normals: usize,
    },
    /// A vertex that does not exist.
    #[error("triangle {triangle} has the vertex {index}, but there are only {positions} positions")]
    Index {
        /// Which triangle, from 0.
        triangle: usize,
        /// Its vertex.
        index: u32,
        /// Positions given.
        positions: usize,
    },
    /// A position that is no place.
    #[error("position {vertex} is {position}, which is not finite")]
    Position {
        /// Which one, from 0.
        vertex: usize,
        /// The position.
        position: DVec3,
    },
    /// A normal without a direction.
    #[error("normal {vertex} is {normal}, which is no direction")]
    Normal {
        /// Which one, from 0.
        vertex: usize,
        /// The normal.
        normal: DVec3,
    },
    /// More corners than 32 bits can count.
    #[error("there are {triangles} triangles, more than can be indexed")]
    TooMany {
        /// Triangles given.
        triangles: usize,
    },
}

impl Mesh {
    /// A mesh of vertices with normals of any length.
    ///
    /// # Errors
    /// When there are not as many normals as positions, a position is not finite, a normal is zero or not finite, or a
    /// triangle's index is out of range.
    pub fn new(
        positions: Vec<DVec3>,
        mut normals: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshError> {
        if positions.len() != normals.len() {
            return Err(MeshError::NormalCount {
                positions: positions.len(),
                normals: normals.len(),
            });
        }
        check(&positions, &triangles)?;
        for (vertex, normal) in normals.iter_mut().enumerate() {
            *normal = crate::math::unit(*normal).ok_or(MeshError::Normal {
                vertex,
                normal: *normal,
            })?;
        }
        Ok(Self {
            positions,
            normals,
            triangles,
        })
    }

    /// A mesh whose normals are found from its triangles. Vertices at the same place count as one; where faces do not share
    /// a normal, there are more vertices than positions were given.
    ///
    /// # Errors
    /// When a position is not finite, or a triangle's index is out of range.
    pub fn from_triangles(
        positions: Vec<DVec3>,
        triangles: &[[u32; 3]],
        normals: Normals,
    ) -> Result<Self, MeshError> {
        check(&positions, triangles)?;
        Ok(import::mesh(
            Polygons {
                positions,
                corners: triangles.as_flattened().to_vec(),
                ends: (1..=triangles.len() as u32).map(|end| 3 * end).collect(),
                normals: Vec::new(),
            },
            normals,
        ))
    }
}

/// What must hold whatever the normals are.
fn check(positions: &[DVec3], triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    if u32::try_from(triangles.len().saturating_mul(3)).is_err() {
        return Err(MeshError::TooMany {
            triangles: triangles.len(),
        });
    }
    if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
        return Err(MeshError::Position {
            vertex,
            position: positions[vertex],
        });
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        for &index in corners {
            if index as usize >= positions.len() {
                return Err(MeshError::Index {
                    triangle,
                    index,
                    positions: positions.len(),
                });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_that_do_not_fit_together_are_refused() {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let normals = vec![DVec3::Z * 7.0; 3];
        let triangle = vec![[0, 1, 2]];
        let mesh = Mesh::new(positions.clone(), normals.clone(), triangle.clone());
        assert_eq!(mesh.expect("a mesh").normals, [DVec3::Z; 3]);
        let says = |result: Result<Mesh, MeshError>| result.expect_err("refused").to_string();
        assert_eq!(
            says(Mesh::new(positions.clone(), Vec::new(), triangle.clone())),
            "there are 3 positions, but 0 normals"
        );
        assert_eq!(
            says(Mesh::new(
                positions.clone(),
                normals.clone(),
                vec![[0, 1, 3]]
            )),
            "triangle 0 has the vertex 3, but there are only 3 positions"
        );
        assert_eq!(
            says(Mesh::new(
                positions.clone(),
                vec![DVec3::ZERO; 3],
                triangle.clone()
            )),
            "normal 0 is [0, 0, 0], which is no direction"
        );
        let mut odd = positions;
        odd[1].y = f64::INFINITY;
        assert_eq!(
            says(Mesh::from_triangles(odd, &triangle, Normals::Flat)),
            "position 1 is [1, inf, 0], which is not finite"
        );
    }

    #[test]
    fn faces_that_meet_softly_share_normals_and_others_do_not() {
        // A roof: two triangles that meet at a right angle.
        let positions = vec![
            DVec3::ZERO,
            DVec3::X,
            DVec3::new(0.5, 1.0, -1.0),
            DVec3::new(0.5, -1.0, -1.0),
        ];
        let roof = [[0, 1, 2], [1, 0, 3]];
        let smooth = |crease_degrees| Normals::Smooth {
            crease_degrees,
            weight: Default::default(),
        };
        let vertices = |normals| {
            let mesh = Mesh::from_triangles(positions.clone(), &roof, normals).expect("a mesh");
            mesh.positions.len()
        };
        assert_eq!(vertices(smooth(91.0)), 4);
        assert_eq!(vertices(smooth(89.0)), 6);
        assert_eq!(vertices(Normals::Flat), 6);
    }
}
