//! The illumination equation: a scalar reference in `f64` and the same in SIMD lanes.

pub mod lights;

pub use lights::{ActiveLights, LightMask, MAX_LIGHTS};
