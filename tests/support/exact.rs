//! A rasterizer that knows no edge functions, boxes, tiles or lanes.
//!
//! Coverage is decided at every pixel by orientation in `i128` ([`covers`]), with the top-left rule as it is defined: a centre on
//! an edge belongs to the triangle if the edge is a left one, or a top one. What happens before, clipping and snapping, and
//! the depth of a pixel are definitions too, and are taken from `geometry::screen`.

use super::{Random, Visibility, add_both_sides, empty_world, rasterize};
use specula::backend::software::{NO_TRIANGLE, SoftwareBackend};
use specula::backend::{Backend, RasterCounts};
use specula::geometry::screen::{TrianglePlanes, clip, doubled_area, snap};
use specula::parallel::Exec;
use specula::scene::{View, World};

/// Sub-pixels per pixel.
pub(crate) const SUB: i32 = 256;

/// For triangles whose normals do not matter.
pub(crate) const NORMALS: [[f32; 3]; 3] = [[0.0, 0.0, 1.0]; 3];

/// Which side of the directed line from `p` to `q` the point `c` is on: positive to its left as seen, y pointing down.
fn side([px, py]: [i128; 2], [qx, qy]: [i128; 2], [cx, cy]: [i128; 2]) -> i128 {
    (qy - py) * (cx - px) - (qx - px) * (cy - py)
}

/// Whether a snapped triangle that turns counter-clockwise as seen covers a pixel.
fn covers(triangle: [[i32; 2]; 3], pixel: [i32; 2]) -> bool {
    let corners = triangle.map(|p| p.map(i128::from));
    let centre = pixel.map(|v| i128::from(v * SUB + SUB / 2));
    (0..3).all(|i| {
        let (p, q) = (corners[i], corners[(i + 1) % 3]);
        // Counter-clockwise, the left sides go down, and a top one goes to the left.
        let is_left = q[1] > p[1];
        let is_top = q[1] == p[1] && q[0] < p[0];
        match side(p, q, centre) {
            0 => is_left || is_top,
            side => side > 0,
        }
    })
}

/// The first of `size` pixels, if any, with its centre between the smallest and the largest coordinate.
fn first_pixel(coordinates: impl Iterator<Item = i32> + Clone, size: u32) -> Option<i32> {
    let (low, high) = (coordinates.clone().min()?, coordinates.max()?);
    (0..size as i32).find(|v| (low..=high).contains(&(v * SUB + SUB / 2)))
}

/// Draws one triangle into the image, pixel by pixel.
fn draw(image: &mut Visibility, world: &World, view: &View, id: u32) {
    let corners =
        world.triangles[id as usize].map(|v| view.project(world.positions.get(v as usize)));
    let outline: Vec<_> = clip(corners).vertices().iter().map(|&v| snap(v)).collect();
    let fan: Vec<_> = (2..outline.len())
        .map(|i| [outline[0], outline[i - 1], outline[i]])
        .collect();
    if fan.iter().map(|&piece| doubled_area(piece)).sum::<i64>() <= 0 {
        return;
    }
    let first = |axis: usize, size| first_pixel(outline.iter().map(move |p| p[axis]), size);
    let (Some(x0), Some(y0)) = (first(0, view.width), first(1, view.height)) else {
        return;
    };
    let mut plane = TrianglePlanes::new(corners).depth([x0, y0]);
    if world.backs.contains(&id) {
        plane = plane.moved_back();
    }
    let (width, height) = (view.width as i32, view.height as i32);
    for piece in fan.into_iter().filter(|&piece| doubled_area(piece) > 0) {
        for [x, y] in (0..height).flat_map(|y| (0..width).map(move |x| [x, y])) {
            if covers(piece, [x, y]) {
                let (at, depth) = ((y * width + x) as usize, plane.at_pixel(x, y));
                // Triangles come in ascending order, so of equal ones the first stays.
                if depth > image.depths[at] || image.ids[at] == NO_TRIANGLE {
                    (image.ids[at], image.depths[at]) = (id, depth);
                }
            }
        }
    }
}

/// What all of a world's triangles look like.
pub(crate) fn drawn(world: &World, view: &View) -> Visibility {
    let size = (view.width * view.height) as usize;
    let mut image = Visibility {
        ids: vec![NO_TRIANGLE; size],
        depths: vec![0.0; size],
    };
    for id in 0..world.triangles.len() as u32 {
        draw(&mut image, world, view, id);
    }
    image
}

/// What the backend says about its image agrees with the ids of the image.
fn assert_counted(backend: &SoftwareBackend, counts: RasterCounts, triangles: usize, what: &str) {
    let mut ids = Vec::new();
    backend.ids(&mut ids);
    let mut pixels = vec![0; triangles];
    for &id in ids.iter().filter(|&&id| id != NO_TRIANGLE) {
        pixels[id as usize] += 1;
    }
    let owners: Vec<_> = (0..triangles as u32)
        .filter(|&id| pixels[id as usize] > 0)
        .collect();
    assert_eq!(backend.visible_triangles(), owners, "{what}");
    let told: Vec<_> = (0..triangles as u32)
        .map(|id| backend.visible_pixels(id))
        .collect();
    assert_eq!(told, pixels, "{what}");
    assert_eq!(
        counts.covered_pixels,
        u64::from(pixels.iter().sum::<u32>()),
        "{what}"
    );
    assert_eq!(counts.submitted, triangles as u64, "{what}");
    let parts = counts.back_facing + counts.off_screen + counts.drawn;
    assert_eq!(counts.submitted, parts, "{what}: {counts:?}");
}

/// The backend draws an image, and speaks of it, as it should.
pub(crate) fn assert_drawn(
    backend: &mut SoftwareBackend,
    exec: Exec,
    world: &World,
    view: &View,
    want: &Visibility,
    what: &str,
) {
    let counts = rasterize(backend, exec, world, view);
    Visibility::of(backend).assert_same(want, view.width, what);
    assert_counted(backend, counts, world.triangles.len(), what);
}

/// How a soup's corners are made, given the size of the image in pixels; depth is between 0 and 1.
pub(crate) type Corners = fn(&mut Random, [f32; 2]) -> [[f32; 3]; 3];

/// A world of as many triangles, seen from both sides; the last ones are backs.
pub(crate) fn soup_of(random: &mut Random, count: usize, view: &View, corners: Corners) -> World {
    let mut world = empty_world();
    for _ in 0..count {
        let corners = corners(random, [view.width as f32, view.height as f32]);
        add_both_sides(&mut world, corners, NORMALS);
    }
    let triangles = world.triangles.len() as u32;
    world.backs = triangles * 3 / 4..triangles;
    world
}

/// A point of the image, or a little outside of it.
pub(crate) fn somewhere(random: &mut Random, size: [f32; 2]) -> [f32; 2] {
    size.map(|side| random.range(-4.0, side + 4.0))
}

/// Corners up to `reach` pixels from a point of the image.
pub(crate) fn around(random: &mut Random, size: [f32; 2], reach: f32) -> [[f32; 3]; 3] {
    let [x, y] = somewhere(random, size);
    [0; 3].map(|_| {
        let mut moved = |v: f32| v + random.range(-reach, reach);
        [moved(x), moved(y), random.range(0.0, 1.0)]
    })
}
