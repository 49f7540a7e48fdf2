//! What a scene may contain. Beyond these bounds a scene is refused when it is read, so that everything after may
//! rely on them: indices fit their types, and squares and products of lengths and colours stay finite.

/// Most lights a scene may have: a set of lights is one 128-bit word.
pub const MAX_LIGHTS: usize = 128;

/// Most materials a scene may have: a material index is 16 bits wide.
pub const MAX_MATERIALS: usize = 65_535;

/// Most triangles a scene may have, counted before any is made.
pub const MAX_TRIANGLES: u64 = 16_000_000;

/// Most bytes of a scene file.
pub const MAX_FILE_BYTES: u64 = 64 << 20;

/// Most bytes of a mesh file.
pub const MAX_MESH_BYTES: u64 = 1 << 30;

/// Largest magnitude of a coordinate or length. Products of four lengths still fit an `f64`.
pub const MAX_LENGTH: f64 = 1e60;

/// Smallest length or scale factor that is told from zero.
pub const MIN_LENGTH: f64 = 1e-60;

/// Largest component of a colour, and largest intensity of a light. The sum over all lights still fits an `f32`.
pub const MAX_COLOR: f64 = 1e6;

/// Largest specular exponent: that highlight has faded to half at 0.07 degrees from its middle.
pub const MAX_SHININESS: f64 = 1e6;

/// Most subdivisions of a shape in one direction.
pub const MAX_SEGMENTS: u32 = 8192;
