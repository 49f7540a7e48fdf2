//! Nominal costs: what each kind of refinement work costs, in nanoseconds on one thread of the machine named in
//! `benches/record/`.
//!
//! They were measured (`cargo bench --bench nominal`) and compiled in. They only decide the *order* of work and what a
//! work unit is; a faster machine, or a wrong constant, changes neither the image a budget of work units gives from one
//! machine to the next, nor the image refinement converges to.
//!
//! What they say about subdivision against per-pixel shading: quartering a leaf of `p` pixels and repainting it costs
//! about `2465 + 5 l + 3.1 p` under `l` lights, shading it `210 + (4.8 + 0.84 l) p`. Quartering leaves about a sixteenth of
//! the error, so it buys more per cost from about 500 pixels up with 4 lights, 170 with 16, and 35 with 100. With one light
//! that is 1,000 pixels, where shading part by part mostly buys more still.

/// Illuminating a vertex: a fixed part, and a part for each light.
pub const VERTEX_NS: f32 = 0.8;
/// See [`VERTEX_NS`].
pub const VERTEX_LIGHT_NS: f32 = 0.85;
/// Making a leaf, as a root or by a split: edges, midpoints, estimate and bookkeeping, without illumination.
pub const LEAF_NS: f32 = 455.0;
/// Putting a triangle, leaf or part on the list of what is to be shaded.
pub const LIST_NS: f32 = 150.0;
/// Taking up a triangle only to find out whether it needs anything.
pub const LOOK_NS: f32 = 30.0;
/// Taking a sample inside a leaf, without its illumination.
pub const SAMPLE_NS: f32 = 40.0;
/// Repainting a patch with interpolated colours: a fixed part, and a part for each pixel.
pub const REPAINT_NS: f32 = 160.0;
/// See [`REPAINT_NS`].
pub const REPAINT_PIXEL_NS: f32 = 3.1;
/// Shading a patch by the illumination equation: a fixed part, a part for each pixel, and one for each pixel and active
/// light.
pub const PHONG_NS: f32 = 210.0;
/// See [`PHONG_NS`].
pub const PHONG_PIXEL_NS: f32 = 4.8;
/// See [`PHONG_NS`].
pub const PHONG_PIXEL_LIGHT_NS: f32 = 0.84;
/// Bounding the lights on a triangle: a fixed part, and a part for each light.
pub const BOUNDS_NS: f32 = 190.0;
/// See [`BOUNDS_NS`].
pub const BOUNDS_LIGHT_NS: f32 = 153.0;
/// Bounding the lights on a run of triangles of a cluster: a fixed part, and a part for each light.
pub const RUN_BOUNDS_NS: f32 = 750.0;
/// See [`RUN_BOUNDS_NS`].
pub const RUN_BOUNDS_LIGHT_NS: f32 = 95.0;
/// Making a visible triangle a candidate: a part for each triangle, and one for each light. They cost no work units.
pub const COLLECT_NS: f32 = 36.0;
/// See [`COLLECT_NS`].
pub const COLLECT_LIGHT_NS: f32 = 0.7;
/// Copying a pixel into the caller's frame, from which the [cost model](super::CostModel) starts.
pub const PRESENT_PIXEL_NS: f32 = 0.4;

/// Drawing a first image: a part for each triangle of the scene, whether it is seen or not.
pub const FIRST_TRIANGLE_NS: f32 = 20.0;
/// See [`FIRST_TRIANGLE_NS`]: a part for each pixel of the image, as if a quarter of them were covered.
pub const FIRST_PIXEL_NS: f32 = 0.75;

/// Stages of a first image, from which the [cost model](super::CostModel) starts: looking at a cluster.
pub const CULL_CLUSTER_NS: f32 = 10.0;
/// Rasterizing: a part for each triangle handed over.
pub const RASTER_TRIANGLE_NS: f32 = 60.0;
/// See [`RASTER_TRIANGLE_NS`]: a part for each pixel of the image.
pub const RASTER_PIXEL_NS: f32 = 0.2;
/// See [`RASTER_TRIANGLE_NS`]: a part for each pixel that something covers.
pub const RASTER_COVERED_NS: f32 = 1.5;
/// Finding out that a vertex is to be illuminated, and where it is.
pub const FIND_VERTEX_NS: f32 = 5.0;
/// Colouring a first image: a part for each triangle that owns a pixel.
pub const RESOLVE_TRIANGLE_NS: f32 = 30.0;
/// See [`RESOLVE_TRIANGLE_NS`]: a part for each pixel covered, unless it is shaded on its own.
pub const RESOLVE_PIXEL_NS: f32 = 1.8;
/// Curving a triangle before the first image is coloured: a fixed part, and one for each of its parts.
pub const CURVE_NS: f32 = 100.0;
/// See [`CURVE_NS`].
pub const CURVE_PART_NS: f32 = 25.0;
/// See [`CURVE_NS`]: a part for each node, without its illumination.
pub const CURVE_NODE_NS: f32 = 6.0;
/// What a pixel of a curved triangle takes beyond one of another: of a single part.
pub const CURVED_PIXEL_NS: f32 = 0.25;
/// The same of one with several parts.
pub const PARTED_PIXEL_NS: f32 = 0.6;
/// What a pixel takes beyond one that is interpolated if it is shaded while it gets its first colour: a fixed part, and one for each
/// light.
pub const LIT_PIXEL_NS: f32 = 1.2;
/// See [`LIT_PIXEL_NS`].
pub const LIT_PIXEL_LIGHT_NS: f32 = 0.4;
/// Enlarging an image: a part for each pixel written.
pub const ENLARGE_PIXEL_NS: f32 = 0.6;

/// Drawing everything once, on a backend that cannot repaint: a part for each triangle, until the engine has measured it.
pub const DRAW_TRIANGLE_NS: f32 = 2700.0;
/// See [`DRAW_TRIANGLE_NS`]: a part for each pixel that triangles cover, hidden ones included.
pub const DRAW_PIXEL_NS: f32 = 20.0;

/// Illuminating `vertices` points under `lights` lights.
#[must_use]
pub fn vertices(vertices: f32, lights: usize) -> f32 {
    vertices * (VERTEX_NS + VERTEX_LIGHT_NS * lights as f32)
}

/// Making `leaves` leaves, each with `points` points to illuminate under `lights` lights.
#[must_use]
pub fn leaves(leaves: f32, points: f32, lights: usize) -> f32 {
    leaves * (LEAF_NS + vertices(points, lights))
}

/// Taking `count` samples under `lights` lights.
#[must_use]
pub fn samples(count: usize, lights: usize) -> f32 {
    count as f32 * SAMPLE_NS + vertices(count as f32, lights)
}

/// Repainting `patches` patches of `pixels` pixels altogether.
#[must_use]
pub fn repaint(patches: f32, pixels: f32) -> f32 {
    patches * REPAINT_NS + pixels * REPAINT_PIXEL_NS
}

/// Shading a patch of `pixels` pixels under `lights` active lights.
#[must_use]
pub fn phong(pixels: f32, lights: usize) -> f32 {
    PHONG_NS + pixels * (PHONG_PIXEL_NS + PHONG_PIXEL_LIGHT_NS * lights as f32)
}

/// A first image of `pixels` pixels of a scene of `triangles` triangles, without its illumination.
#[must_use]
pub fn first_image(triangles: f32, pixels: f32) -> f32 {
    triangles * FIRST_TRIANGLE_NS + pixels * FIRST_PIXEL_NS
}

/// Curving triangles with so many nodes and parts under `lights` lights, their pixels aside.
#[must_use]
pub fn curved(triangles: f32, nodes: f32, parts: f32, lights: usize) -> f32 {
    triangles * CURVE_NS + nodes * CURVE_NODE_NS + vertices(nodes, lights) + parts * CURVE_PART_NS
}

/// What a pixel of a triangle divided by `n` takes beyond one that is not curved.
#[must_use]
pub fn curved_pixel(n: u32) -> f32 {
    match n {
        0 => 0.0,
        1 => CURVED_PIXEL_NS,
        _ => PARTED_PIXEL_NS,
    }
}

/// What a pixel under `lights` lights takes beyond one that is interpolated, if it is shaded while it gets its first colour.
#[must_use]
pub fn lit_pixel(lights: usize) -> f32 {
    LIT_PIXEL_NS + LIT_PIXEL_LIGHT_NS * lights as f32
}

/// Drawing `triangles` triangles of `pixels` pixels altogether on a backend that cannot repaint.
#[must_use]
pub fn drawing(triangles: f32, pixels: f32) -> f32 {
    triangles * DRAW_TRIANGLE_NS + pixels * DRAW_PIXEL_NS
}

/// Bounding `lights` lights on a triangle.
#[must_use]
pub fn bounds(lights: usize) -> f32 {
    BOUNDS_NS + BOUNDS_LIGHT_NS * lights as f32
}

/// Bounding `lights` lights on a run of triangles.
#[must_use]
pub fn run_bounds(lights: usize) -> f32 {
    RUN_BOUNDS_NS + RUN_BOUNDS_LIGHT_NS * lights as f32
}

/// Making `triangles` visible triangles candidates under `lights` lights, without samples at their centroids.
#[must_use]
pub fn collecting(triangles: f32, lights: usize) -> f32 {
    triangles * (COLLECT_NS + COLLECT_LIGHT_NS * lights as f32)
}

/// What leaving a light out of the shading of `pixels` pixels saves.
#[must_use]
pub fn light_saved(pixels: f32) -> f32 {
    pixels * PHONG_PIXEL_LIGHT_NS
}

/// Shading a pixel of a first image under `lights` lights.
#[must_use]
pub fn phong_pixel(lights: usize) -> f32 {
    PHONG_PIXEL_NS + PHONG_PIXEL_LIGHT_NS * lights as f32
}
