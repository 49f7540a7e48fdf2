//! Tinted areas, pixel by pixel.

use super::{DIMMED, Layer, Picture, is_refined};
use crate::frame::{Leaf, LeafKind};
use crate::geometry::Bary;
use crate::geometry::screen::{TrianglePlanes, clip, normalized_weights};

/// A colour and how much of it.
type Tint = ([u8; 3], f32);

const PHT: Tint = (super::lines::AMBER, 0.34);
const PHT_REFINED: Tint = (super::lines::GREEN, 0.16);
const PER_PIXEL: Tint = ([176, 96, 255], 0.34);
const PROVED: Tint = ([40, 110, 255], 0.24);

/// How far outside of a leaf, in barycentric coordinates of its triangle, a pixel may be for rounding.
const ROOM: f64 = 1e-6;

/// Dims all pixels and tints those that belong to something that is to be shown.
pub(super) fn apply(picture: &Picture<'_>, pixels: &mut [[u8; 4]], shows: impl Fn(Layer) -> bool) {
    let tints = choose(picture, shows);
    for (pixel, tint) in pixels.iter_mut().zip(tints) {
        let (colour, share) = tint.unwrap_or(([0; 3], 0.0));
        for (value, of_tint) in pixel.iter_mut().zip(colour) {
            let image = f32::from(*value) * DIMMED;
            *value = (image + (f32::from(of_tint) - image) * share).round() as u8;
        }
    }
}

/// The tint of each pixel.
fn choose(picture: &Picture<'_>, shows: impl Fn(Layer) -> bool) -> Vec<Option<Tint>> {
    let mut whole: Vec<Option<Tint>> = vec![None; picture.world.triangles.len()];
    let mut divided: Vec<(&Leaf, Tint)> = Vec::new();
    for leaves in picture.roots() {
        let is_refined = is_refined(leaves);
        for leaf in leaves {
            let tint = match leaf.kind {
                LeafKind::PerPixel if leaf.is_painted && shows(Layer::PerPixel) => PER_PIXEL,
                LeafKind::Proved if shows(Layer::Proved) => PROVED,
                _ if !(leaf.is_pht && shows(Layer::Pht)) => continue,
                _ if is_refined => PHT_REFINED,
                _ => PHT,
            };
            if leaf.level == 0 {
                whole[leaf.triangle as usize] = Some(tint);
            } else {
                divided.push((leaf, tint));
            }
        }
    }
    let owner_tint = |&id: &u32| whole.get(id as usize).copied().flatten();
    let mut tints = picture.ids.iter().map(owner_tint).collect::<Vec<_>>();
    for (leaf, tint) in divided {
        for_each_pixel(picture, leaf, |index| tints[index] = Some(tint));
    }
    tints
}

/// Calls `f` with the index of every pixel that the leaf's triangle owns inside the leaf, borders included.
fn for_each_pixel(picture: &Picture<'_>, leaf: &Leaf, mut f: impl FnMut(usize)) {
    let root = picture.triangle(leaf.triangle);
    let planes = TrianglePlanes::new(root);
    let Some([[x0, x1], [y0, y1]]) = pixel_box(picture, leaf) else {
        return;
    };
    for y in y0..=y1 {
        for x in x0..=x1 {
            let index = y * picture.view.width as usize + x;
            if picture.ids[index] != leaf.triangle {
                continue;
            }
            let edges = planes.edges_at_pixel(x as i32, y as i32);
            let [_, b1, b2] = normalized_weights(edges.map(|e| e.max(0.0)));
            if is_inside(leaf.corners, [b1, b2]) {
                f(index);
            }
        }
    }
}

/// First and last column and row of the pixels that the leaf may have.
fn pixel_box(picture: &Picture<'_>, leaf: &Leaf) -> Option<[[usize; 2]; 2]> {
    let polygon = clip(picture.leaf_corners(leaf.triangle, leaf.corners));
    let range = |axis: usize, size: u32| {
        let positions = polygon.vertices().iter().map(|p| p[axis] / p[3]);
        let (min, max) = positions.fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), p| {
            (min.min(p), max.max(p))
        });
        let last = f64::from(size) - 1.0;
        let (first, last) = ((min - 1.0).max(0.0), max.min(last));
        // Not so for NaN, nor for an empty polygon.
        (first <= last).then_some([first as usize, last as usize])
    };
    Some([
        range(0, picture.view.width)?,
        range(1, picture.view.height)?,
    ])
}

fn is_inside(corners: [Bary; 3], [x, y]: [f64; 2]) -> bool {
    let corners = corners.map(|corner| {
        let [_, b1, b2] = corner.weights().map(f64::from);
        [b1, b2]
    });
    (0..3).all(|k| {
        let ([ax, ay], [bx, by]) = (corners[k], corners[(k + 1) % 3]);
        let length = (bx - ax).hypot(by - ay);
        (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= -ROOM * length
    })
}
