//! The illumination equation: a scalar reference in `f64` and the same in SIMD lanes.

pub mod batch;
pub mod lanes;
pub mod lights;
pub mod points;
pub mod power;
pub mod reference;
pub mod vertices;

pub use batch::{shade_points, shade_vertices};
pub use lanes::{ShadingKit, shade_lanes};
pub use lights::{ActiveLights, LightMask, MAX_LIGHTS};
pub use points::{PointBatch, shade_few};
pub use vertices::VertexSet;
