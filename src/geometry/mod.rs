//! What is rendered: meshes, their topology and clusters, shapes, and the rules by which a triangle becomes pixels.

pub mod bary;
mod closed;
pub mod clusters;
pub mod curved;
pub mod import;
mod mesh;
pub mod normals;
pub mod polygon;
pub mod quadratic;
pub mod screen;
pub mod shapes;
pub mod topology;
mod triangle_set;
pub mod viewport;

pub use bary::Bary;
pub use clusters::{Cluster, build_clusters};
pub use curved::CurvedTriangles;
pub use mesh::{Mesh, MeshError};
pub use quadratic::Quadratic;
pub use topology::Topology;
pub use triangle_set::TriangleSet;

/// Many three-component vectors, one array per component, ready for SIMD lanes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vec3s {
    /// First components.
    pub x: Vec<f32>,
    /// Second components.
    pub y: Vec<f32>,
    /// Third components.
    pub z: Vec<f32>,
}

impl Vec3s {
    /// No vectors, and room for `capacity`.
    #[must_use]
    pub fn with_capacity(capacity: usize) -> Self {
        Self {
            x: Vec::with_capacity(capacity),
            y: Vec::with_capacity(capacity),
            z: Vec::with_capacity(capacity),
        }
    }

    /// Number of vectors.
    #[must_use]
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// True when there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// The vector at `index`.
    ///
    /// # Panics
    /// When `index` is out of range.
    #[inline]
    #[must_use]
    pub fn get(&self, index: usize) -> [f32; 3] {
        [self.x[index], self.y[index], self.z[index]]
    }

    /// Overwrites the vector at `index`.
    ///
    /// # Panics
    /// When `index` is out of range.
    #[inline]
    pub fn set(&mut self, index: usize, v: [f32; 3]) {
        [self.x[index], self.y[index], self.z[index]] = v;
    }

    /// Appends a vector.
    pub fn push(&mut self, v: [f32; 3]) {
        self.x.push(v[0]);
        self.y.push(v[1]);
        self.z.push(v[2]);
    }

    /// Makes room for `additional` more vectors.
    pub fn reserve(&mut self, additional: usize) {
        self.x.reserve(additional);
        self.y.reserve(additional);
        self.z.reserve(additional);
    }

    /// Removes all vectors and keeps the memory.
    pub fn clear(&mut self) {
        self.x.clear();
        self.y.clear();
        self.z.clear();
    }

    /// Makes room for exactly `len` vectors, new ones zero.
    pub fn resize(&mut self, len: usize) {
        self.x.resize(len, 0.0);
        self.y.resize(len, 0.0);
        self.z.resize(len, 0.0);
    }
}
