//! Nominal costs: what each kind of refinement work costs, in nanoseconds on one thread of the machine named in
//! `benches/record/`.
//!
//! They were measured once (`cargo bench --bench nominal`) and compiled in. They only decide the *order* of work and
//! what a work unit is; a faster machine, or a wrong constant, changes neither the image a budget of work units gives
//! from one machine to the next, nor the image refinement converges to.

/// Illuminating a vertex: a fixed part, and a part for each light.
pub const VERTEX_NS: f32 = 4.0;
/// See [`VERTEX_NS`].
pub const VERTEX_LIGHT_NS: f32 = 3.0;
/// Repainting a pixel with interpolated colours.
pub const REPAINT_PIXEL_NS: f32 = 1.5;
/// Shading a pixel by the illumination equation: a fixed part, and a part for each active light.
pub const PHONG_PIXEL_NS: f32 = 3.0;
/// See [`PHONG_PIXEL_NS`].
pub const PHONG_PIXEL_LIGHT_NS: f32 = 2.0;
/// Bookkeeping and set-up for a leaf, whatever its size.
pub const LEAF_NS: f32 = 250.0;
/// Bounding one light on one triangle.
pub const BOUND_LIGHT_NS: f32 = 60.0;

/// Copying a pixel into the caller's frame.
pub const PRESENT_PIXEL_NS: f32 = 0.5;

/// Illuminating `vertices` points under `lights` lights.
#[must_use]
pub fn vertices(vertices: f32, lights: usize) -> f32 {
    vertices * (VERTEX_NS + VERTEX_LIGHT_NS * lights as f32)
}

/// Repainting a leaf of `pixels` pixels.
#[must_use]
pub fn repaint(pixels: f32) -> f32 {
    LEAF_NS + pixels * REPAINT_PIXEL_NS
}

/// Shading a leaf of `pixels` pixels under `lights` active lights.
#[must_use]
pub fn phong(pixels: f32, lights: usize) -> f32 {
    LEAF_NS + pixels * (PHONG_PIXEL_NS + PHONG_PIXEL_LIGHT_NS * lights as f32)
}

/// Copying `pixels` pixels into the caller's frame.
#[must_use]
pub fn present(pixels: u64) -> f32 {
    pixels as f32 * PRESENT_PIXEL_NS
}

/// Bounding `lights` lights on a triangle.
#[must_use]
pub fn bounds(lights: usize) -> f32 {
    BOUND_LIGHT_NS * lights as f32
}
