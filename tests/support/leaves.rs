//! What an image consists of, leaf by leaf and pixel by pixel.

use specula::frame::Leaf;
use specula::geometry::screen::{TrianglePlanes, normalized_weights};
use specula::measure::ReferenceImage;
use specula::scene::World;
use specula::{Engine, Scene};
use std::collections::HashMap;

/// The leaves of each triangle.
pub(crate) fn leaves(engine: &Engine) -> HashMap<u32, Vec<Leaf>> {
    let mut all: HashMap<u32, Vec<Leaf>> = HashMap::new();
    engine.for_each_leaf(|leaf| all.entry(leaf.triangle).or_default().push(*leaf));
    all
}

/// Barycentric coordinates in the leaf, of a point of its triangle.
pub(crate) fn inside(leaf: &Leaf, point: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = leaf
        .corners
        .map(|corner| corner.weights().map(f64::from))
        .map(|[_, b1, b2]| glam::DVec2::new(b1, b2));
    let p = glam::DVec2::new(point[1], point[2]);
    let area = (b - a).perp_dot(c - a);
    [
        (b - p).perp_dot(c - p) / area,
        (c - p).perp_dot(a - p) / area,
        (a - p).perp_dot(b - p) / area,
    ]
}

/// A pixel's owner, and where in it the pixel is.
pub(crate) type Place = (u32, [f64; 3]);

/// The reference of the scene's view, and the places of the covered pixels.
pub(crate) fn pixels(scene: &Scene, size: (u32, u32)) -> (ReferenceImage, Vec<Option<Place>>) {
    let world = World::new(scene);
    let view = world.view(scene.camera(), size.0, size.1);
    let reference = ReferenceImage::render(&world, &view, 2);
    let points = reference.ids.iter().zip(0i32..).map(|(&id, index)| {
        let triangle = world.triangles.get(id as usize)?;
        let corners = triangle.map(|v| view.project(world.positions.get(v as usize)));
        let (x, y) = (index % size.0 as i32, index / size.0 as i32);
        let edges = TrianglePlanes::new(corners).edges_at_pixel(x, y);
        Some((id, normalized_weights(edges.map(|e| e.max(0.0)))))
    });
    let points = points.collect();
    (reference, points)
}
