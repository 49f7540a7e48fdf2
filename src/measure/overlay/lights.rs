//! Marks where lights are.

use super::{Picture, colour};
use crate::geometry::screen::TrianglePlanes;
use crate::math::PixelPoint;
use crate::output::encode::encode_u8;
use crate::scene::ShadingLight;
use glam::DVec4;
use tiny_skia::{FillRule, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, Transform};

/// Radius of a mark in pixels.
const RADIUS: f32 = 7.0;

/// Draws a mark for every light within the image: a disc for a point light, a ring if something hides it, a square for
/// the direction that light comes from.
pub(super) fn draw(picture: &Picture<'_>, scale: f32, canvas: &mut Pixmap) {
    for light in &picture.world.lights {
        let p = position(picture, light);
        let (x, y) = (p[0] / p[3], p[1] / p[3]);
        let [width, height] = [picture.view.width, picture.view.height].map(f64::from);
        // Not so for NaN.
        let is_inside = p[3] > 0.0 && x >= 0.0 && y >= 0.0 && x < width && y < height;
        if !is_inside {
            continue;
        }
        let is_hidden = is_hidden(picture, light, p, [x as i32, y as i32]);
        let (x, y, r) = (x as f32, y as f32, RADIUS * scale);
        let mark = if light.is_point {
            PathBuilder::from_circle(x, y, r)
        } else {
            Rect::from_xywh(x - r, y - r, 2.0 * r, 2.0 * r).map(PathBuilder::from_rect)
        };
        if let Some(mark) = mark {
            draw_mark(&mark, light.radiance, is_hidden, scale, canvas);
        }
    }
}

/// Where a light is; one infinitely far away has the place where lines in its direction meet.
fn position(picture: &Picture<'_>, light: &ShadingLight) -> PixelPoint {
    if light.is_point {
        return picture.view.project(light.vector);
    }
    let [x, y, z] = light.vector.map(f64::from);
    (picture.view.pixel_from_world * DVec4::new(x, y, z, 0.0)).to_array()
}

/// Whether the scene is in front of a light.
fn is_hidden(picture: &Picture<'_>, light: &ShadingLight, p: PixelPoint, [x, y]: [i32; 2]) -> bool {
    let id = picture.ids[y as usize * picture.view.width as usize + x as usize];
    if id as usize >= picture.world.triangles.len() {
        return false;
    }
    let depth = TrianglePlanes::new(picture.triangle(id))
        .depth([x, y])
        .at_pixel(x, y);
    !light.is_point || f64::from(depth) > p[2] / p[3]
}

fn draw_mark(mark: &Path, radiance: [f32; 3], is_hidden: bool, scale: f32, canvas: &mut Pixmap) {
    // As bright as it can be: the mark tells the hue.
    let brightest = radiance.into_iter().fold(f32::MIN_POSITIVE, f32::max);
    let rgb = radiance.map(|v| encode_u8(f64::from(v / brightest)));
    let mut paint = Paint::default();
    let place = Transform::identity();
    let wide = |width: f32| Stroke {
        width: width * scale,
        ..Stroke::default()
    };
    paint.set_color(colour([0; 3], 0.8));
    if is_hidden {
        canvas.stroke_path(mark, &paint, &wide(4.5), place, None);
        paint.set_color(colour(rgb, 0.9));
    } else {
        canvas.stroke_path(mark, &paint, &wide(5.0), place, None);
        paint.set_color(colour(rgb, 1.0));
        canvas.fill_path(mark, &paint, FillRule::Winding, place, None);
        paint.set_color(colour([255; 3], 1.0));
    }
    canvas.stroke_path(mark, &paint, &wide(2.0), place, None);
}
