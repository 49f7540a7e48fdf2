//! The Phong reference of a view: what every image is compared with.
//!
//! It is kept slow and obvious. Coverage and ownership follow the rules of [`geometry::screen`](crate::geometry::screen)
//! one pixel at a time; then, for each covered pixel, position and normal are interpolated perspective-correctly with
//! the owning triangle's unsnapped barycentrics, clamped to the triangle, and the illumination equation is evaluated,
//! all in `f64`; the result is clamped to `[0, 1]` and encoded as the view says.
//!
//! Triangles seen from behind are not drawn: what a two-sided material shows there are triangles of the world as well, with
//! normals of their own.
//!
//! A triangle that had to be clipped is drawn as a fan about the clipped polygon's first vertex. The fan faces the way
//! that its whole snapped area says (parts that rounding turned the other way are left out), and has the depth plane of
//! the whole triangle, anchored at the top left pixel of the box of everything that is left of it.

use crate::geometry::Vec3s;
use crate::geometry::screen::{
    EdgeFunction, PixelBox, TrianglePlanes, clip, doubled_area, normalized_weights, snap,
};
use crate::illumination::reference::{Shaded, shade};
use crate::math::PixelPoint;
use crate::output::Encoding;
use crate::scene::{View, World};
use glam::DVec3;

/// The id of pixels that nothing covers.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// Where the cosine between normal and light is smaller, the illumination equation may jump within a rounding error.
pub const GRAZING_COSINE: f64 = 1e-6;

/// A view shaded by Phong's method in `f64`, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceImage {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The triangle that owns each pixel, or [`NO_TRIANGLE`].
    pub ids: Vec<u32>,
    /// How light is stored.
    pub encoding: Encoding,
    /// Encoded colours.
    pub pixels: Vec<[u8; 3]>,
    /// Encoded colours in `0..=255`, not rounded.
    pub codes: Vec<[f64; 3]>,
    /// Covered pixels on which some cosine is below [`GRAZING_COSINE`]: left out of comparisons.
    pub grazing: Vec<bool>,
}

impl ReferenceImage {
    /// Renders `world` as seen in `view` on up to `threads` threads; the image does not depend on their number.
    #[must_use]
    pub fn render(world: &World, view: &View, threads: usize) -> Self {
        let corners: Vec<PixelPoint> = (0..world.positions.len())
            .map(|vertex| view.project(world.positions.get(vertex)))
            .collect();
        let ids = owners(world, view, &corners);
        let len = ids.len();
        let background = world.background.map(f64::from);
        let mut image = Self {
            width: view.width,
            height: view.height,
            ids,
            encoding: view.encoding,
            pixels: vec![background.map(|c| view.encoding.encode_u8(c)); len],
            codes: vec![background.map(|c| view.encoding.encode(c)); len],
            grazing: vec![false; len],
        };
        image.shade_covered(world, view, &corners, threads);
        image
    }

    /// Whether the scene covers the pixel at `index`.
    ///
    /// # Panics
    /// When `index` is out of range.
    #[must_use]
    pub fn is_covered(&self, index: usize) -> bool {
        self.ids[index] != NO_TRIANGLE
    }

    /// How many pixels the scene covers.
    #[must_use]
    pub fn covered_pixels(&self) -> u64 {
        self.ids.iter().filter(|&&id| id != NO_TRIANGLE).count() as u64
    }

    /// Gives the covered pixels their colours, rows in parallel.
    fn shade_covered(
        &mut self,
        world: &World,
        view: &View,
        corners: &[PixelPoint],
        threads: usize,
    ) {
        use rayon::prelude::*;
        let width = self.width as usize;
        if width == 0 {
            return;
        }
        let ids = &self.ids;
        let shade_row = |(y, pixels, codes, grazing): Row<'_>| {
            for x in 0..width {
                let id = ids[y * width + x];
                if id == NO_TRIANGLE {
                    continue;
                }
                let shaded = shade_pixel(world, view, corners, id as usize, [x as i32, y as i32]);
                pixels[x] = shaded.rgb.map(|c| view.encoding.encode_u8(c));
                codes[x] = shaded.rgb.map(|c| view.encoding.encode(c));
                grazing[x] = shaded.smallest_cosine < GRAZING_COSINE;
            }
        };
        let rows: Vec<Row<'_>> = self
            .pixels
            .chunks_mut(width)
            .zip(self.codes.chunks_mut(width))
            .zip(self.grazing.chunks_mut(width))
            .enumerate()
            .map(|(y, ((pixels, codes), grazing))| (y, pixels, codes, grazing))
            .collect();
        // A pool of its own, so that rayon's global one is left alone; where the system gives no threads, one must do.
        let pool = (threads > 1).then(|| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .thread_name(|index| format!("specula reference {index}"))
                .build()
        });
        match pool {
            Some(Ok(pool)) => pool.install(|| rows.into_par_iter().for_each(shade_row)),
            _ => rows.into_iter().for_each(shade_row),
        }
    }
}

/// The number of a row, its bytes, codes and grazing marks.
type Row<'a> = (usize, &'a mut [[u8; 3]], &'a mut [[f64; 3]], &'a mut [bool]);

/// Who owns each pixel: the nearest triangle, and of equally near ones that with the smallest id.
pub(super) fn owners(world: &World, view: &View, corners: &[PixelPoint]) -> Vec<u32> {
    let len = view.width as usize * view.height as usize;
    let mut ids = vec![NO_TRIANGLE; len];
    let mut depths = vec![f32::NEG_INFINITY; len];
    for (id, triangle) in (0u32..).zip(&world.triangles) {
        let triangle = triangle.map(|vertex| corners[vertex as usize]);
        let planes = TrianglePlanes::new(triangle);
        let polygon = clip(triangle);
        let snapped: Vec<[i32; 2]> = polygon.vertices().iter().map(|&p| snap(p)).collect();
        let Some(pixels) = PixelBox::of_snapped(&snapped, view.width, view.height) else {
            continue;
        };
        let parts = front_parts(&snapped);
        let mut plane = planes.depth([pixels.x0, pixels.y0]);
        if world.backs.contains(&id) {
            plane = plane.moved_back();
        }
        for (y, x) in
            (pixels.y0..=pixels.y1).flat_map(|y| (pixels.x0..=pixels.x1).map(move |x| (y, x)))
        {
            let index = y as usize * view.width as usize + x as usize;
            let depth = plane.at_pixel(x, y);
            let is_covered = |part: &[EdgeFunction; 3]| part.iter().all(|e| e.at_pixel(x, y) >= 0);
            // Ids ascend, so an equally near triangle met later never takes the pixel.
            if depth > depths[index] && parts.iter().any(is_covered) {
                (depths[index], ids[index]) = (depth, id);
            }
        }
    }
    ids
}

/// The edges of each part of a snapped polygon's fan; none when it is seen from behind.
fn front_parts(polygon: &[[i32; 2]]) -> Vec<[EdgeFunction; 3]> {
    let fan: Vec<[[i32; 2]; 3]> = polygon
        .get(1..)
        .unwrap_or_default()
        .windows(2)
        .map(|pair| [polygon[0], pair[0], pair[1]])
        .collect();
    let area: i64 = fan.iter().map(|&part| doubled_area(part)).sum();
    if area <= 0 {
        return Vec::new();
    }
    fan.into_iter()
        .filter(|&part| doubled_area(part) > 0)
        .map(|[a, b, c]| {
            [
                EdgeFunction::new(a, b),
                EdgeFunction::new(b, c),
                EdgeFunction::new(c, a),
            ]
        })
        .collect()
}

/// The illumination equation at the centre of a pixel that `triangle` owns.
fn shade_pixel(
    world: &World,
    view: &View,
    corners: &[PixelPoint],
    triangle: usize,
    [x, y]: [i32; 2],
) -> Shaded {
    let vertices = world.triangles[triangle].map(|vertex| vertex as usize);
    let planes = TrianglePlanes::new(vertices.map(|vertex| corners[vertex]));
    let weights = normalized_weights(planes.edges_at_pixel(x, y).map(|e| e.max(0.0)));
    let material = usize::from(world.triangle_material[triangle]);
    shade(
        weighted(&world.positions, vertices, weights),
        weighted(&world.normals, vertices, weights),
        &view.eye,
        &world.materials[material],
        &world.lights,
    )
}

/// The weighted sum of three of the vectors.
fn weighted(vectors: &Vec3s, vertices: [usize; 3], weights: [f64; 3]) -> DVec3 {
    (0..3).fold(DVec3::ZERO, |sum, i| {
        sum + weights[i] * DVec3::from_array(vectors.get(vertices[i]).map(f64::from))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::encode::{encode, encode_u8};
    use crate::scene::{Eye, ReflectionModel, ShadingLight, ShadingMaterial};
    use glam::{DMat4, DVec4};

    const NEAR: f64 = 0.5;
    const FOCAL_PX: f64 = 40.0;

    /// An eye at the origin that looks along -z, y up; 1 unit at distance 1 is `FOCAL_PX` pixels.
    fn view(width: u32, height: u32) -> View {
        let center = [f64::from(width) / 2.0, f64::from(height) / 2.0];
        View {
            width,
            height,
            // w = -z, and z / w = NEAR / w: 1 at the near plane, 0 infinitely far away.
            pixel_from_world: DMat4::from_cols(
                DVec4::new(FOCAL_PX, 0.0, 0.0, 0.0),
                DVec4::new(0.0, -FOCAL_PX, 0.0, 0.0),
                DVec4::new(-center[0], -center[1], 0.0, -1.0),
                DVec4::new(0.0, 0.0, NEAR, 0.0),
            ),
            eye: Eye::Point([0.0; 3]),
            encoding: Encoding::Srgb,
        }
    }

    fn material(diffuse: [f32; 3]) -> ShadingMaterial {
        ShadingMaterial {
            ambient: [0.05, 0.02, 0.01],
            diffuse,
            specular: [0.4; 3],
            shininess: 20.0,
            model: ReflectionModel::Phong,
        }
    }

    /// Corners, normals and material.
    type Triangle = ([[f32; 3]; 3], [[f32; 3]; 3], u16);

    /// A world of single triangles.
    fn world(triangles: &[Triangle]) -> World {
        let mut world = World {
            materials: vec![material([0.6, 0.1, 0.1]), material([0.1, 0.1, 0.6])],
            lights: vec![ShadingLight {
                vector: [1.0, 2.0, 1.0],
                is_point: true,
                radiance: [0.9, 0.8, 0.7],
            }],
            background: [0.0, 1.0, 0.5],
            world_from_author_scale: 1.0,
            ..World::default()
        };
        for &(corners, normals, material) in triangles {
            let first = world.positions.len() as u32;
            for (position, normal) in corners.into_iter().zip(normals) {
                world.positions.push(position);
                world.normals.push(normal);
                world.vertex_material.push(material);
            }
            world.triangles.push([first, first + 1, first + 2]);
            world.triangle_material.push(material);
        }
        world
    }

    const TOWARDS_EYE: [[f32; 3]; 3] = [[0.0, 0.0, 1.0]; 3];

    /// A front-facing triangle parallel to the image that fills a good part of it.
    fn facing(z: f32, material: u16) -> Triangle {
        let s = -z / 2.0;
        (
            [[-s, -s, z], [s, -s, z], [0.0, s, z]],
            TOWARDS_EYE,
            material,
        )
    }

    #[test]
    fn colours_are_those_at_the_points_that_rays_through_the_pixels_hit() {
        // Slanted, with differing normals; and a floor that reaches behind the eye, so that it is clipped.
        let slanted = (
            [[-2.0, -1.0, -6.0], [1.0, -0.5, -1.5], [0.5, 2.0, -4.0]],
            [[-0.6, 0.0, 0.8], [0.0, -0.6, 0.8], [0.0, 0.8, 0.6]],
            0,
        );
        let floor = (
            [[-9.0, -1.0, -9.0], [0.0, -1.0, 9.0], [9.0, -1.0, -9.0]],
            [[0.0, 1.0, 0.0]; 3],
            1,
        );
        let (world, view) = (world(&[slanted, floor]), view(64, 48));
        let image = ReferenceImage::render(&world, &view, 1);
        let mut seen = [0, 0];
        for (index, &id) in image.ids.iter().enumerate() {
            if id == NO_TRIANGLE {
                assert_eq!(
                    image.pixels[index],
                    world.background.map(|v| encode_u8(v.into()))
                );
                continue;
            }
            let (x, y) = (index % 64, index / 64);
            let ray = DVec3::new(
                (x as f64 + 0.5 - 32.0) / FOCAL_PX,
                -(y as f64 + 0.5 - 24.0) / FOCAL_PX,
                -1.0,
            );
            // Cramer's rule for t ray = a + u (b - a) + v (c - a).
            let [a, b, c] = world.triangles[id as usize].map(|vertex| {
                DVec3::from_array(world.positions.get(vertex as usize).map(f64::from))
            });
            let (ab, ac) = (b - a, c - a);
            let determinant = ray.dot(ac.cross(ab));
            let t = a.dot(ac.cross(ab)) / determinant;
            let u = (ray * t - a).cross(ac).dot(ab.cross(ac)) / ab.cross(ac).length_squared();
            let v = ab.cross(ray * t - a).dot(ab.cross(ac)) / ab.cross(ac).length_squared();
            if [u, v, 1.0 - u - v].iter().any(|&w| w < 0.0) {
                // Covered by the snapped triangle only: clamped, which a ray knows nothing of.
                continue;
            }
            let normal = [1.0 - u - v, u, v]
                .into_iter()
                .zip(world.triangles[id as usize])
                .fold(DVec3::ZERO, |sum, (w, vertex)| {
                    let n = world.normals.get(vertex as usize).map(f64::from);
                    sum + w * DVec3::from_array(n)
                });
            let material = &world.materials[usize::from(world.triangle_material[id as usize])];
            let expected = shade(ray * t, normal, &view.eye, material, &world.lights);
            for channel in 0..3 {
                let code = encode(expected.rgb[channel]);
                let found = image.codes[index][channel];
                assert!(
                    (code - found).abs() < 1e-6,
                    "pixel {x} {y}: {found}, not {code}"
                );
            }
            seen[id as usize] += 1;
        }
        assert!(seen.iter().all(|&count| count > 100), "{seen:?}");
    }

    #[test]
    fn the_nearer_triangle_owns_a_pixel_and_the_first_of_equals() {
        let view = view(32, 32);
        for (triangles, owner) in [
            ([facing(-2.0, 0), facing(-3.0, 0)], 0),
            ([facing(-3.0, 0), facing(-2.0, 0)], 1),
            ([facing(-2.0, 0), facing(-2.0, 0)], 0),
        ] {
            let image = ReferenceImage::render(&world(&triangles), &view, 1);
            assert!(image.covered_pixels() > 100);
            assert!(image.ids.iter().all(|&id| id == owner || id == NO_TRIANGLE));
        }
    }

    #[test]
    fn triangles_seen_from_behind_are_not_drawn() {
        let mut turned = facing(-2.0, 0);
        turned.0.swap(1, 2);
        let view = view(32, 32);
        assert_eq!(
            ReferenceImage::render(&world(&[turned]), &view, 1).covered_pixels(),
            0
        );
        turned.0.swap(0, 1);
        let covered = ReferenceImage::render(&world(&[turned]), &view, 1).covered_pixels();
        assert!(covered > 100);
    }

    #[test]
    fn a_plane_seen_along_a_light_ray_is_grazing() {
        let mut world = world(&[facing(-2.0, 0)]);
        world.lights[0].is_point = false;
        world.lights[0].vector = [1.0, 0.0, 0.0];
        let image = ReferenceImage::render(&world, &view(32, 32), 1);
        let grazing = image.grazing.iter().filter(|&&grazing| grazing).count();
        assert!(grazing > 100);
        assert_eq!(grazing as u64, image.covered_pixels());
    }

    #[test]
    fn nothing_depends_on_the_number_of_threads() {
        let world = world(&[facing(-2.0, 0), facing(-1.5, 1)]);
        let image = ReferenceImage::render(&world, &view(33, 17), 1);
        assert_eq!(image, ReferenceImage::render(&world, &view(33, 17), 3));
        assert!(
            ReferenceImage::render(&world, &view(0, 5), 2)
                .ids
                .is_empty()
        );
    }
}
