//! Which triangles own pixels, how many, and what is needed to paint them.
//!
//! Triangles that own no pixel, usually the most, are never touched: a bit per triangle says whether it is visible, and only the
//! entries of those that are, are valid in the arrays that have one for each.

use super::fit;
use super::setup::{Outline, corners};
use super::tile::{Bounds, Grid, Tile};
use super::transform::Vertices;
use crate::backend::Geometry;
use crate::geometry::screen::{Interpolator, TrianglePlanes};
use crate::math::PixelPoint;
use crate::parallel::Exec;

/// Visible triangles that one task prepares: about 10 to 50 microseconds.
const TRIANGLES_PER_TASK: usize = 512;

/// A triangle that owns pixels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct VisibleTriangle {
    /// Its barycentric planes.
    pub planes: Interpolator,
    /// The pixels that it may own.
    pub bounds: Bounds,
    /// How far, in barycentric coordinates, the coordinates that a pixel is found to have can be from those of a point
    /// that projects to the pixel's centre; infinite when nothing better is known. See [`slack`].
    pub slack: f32,
}

/// The triangles that own pixels.
#[derive(Debug, Default)]
pub(super) struct Visible {
    /// One bit per triangle of the world.
    owned: Vec<u64>,
    /// Pixels of each triangle of the world; valid where `owned`.
    pixels: Vec<u32>,
    /// Index of each triangle of the world in `triangles`; valid where `owned`.
    slot: Vec<u32>,
    /// Ids, ascending.
    pub ids: Vec<u32>,
    /// In the same order.
    triangles: Vec<VisibleTriangle>,
}

impl Visible {
    /// Forgets everything, for a world of `triangles` triangles.
    pub(super) fn clear(&mut self, triangles: usize) {
        self.owned.clear();
        self.owned.resize(triangles.div_ceil(64), 0);
        self.pixels.resize(triangles, 0);
        self.slot.resize(triangles, 0);
        self.ids.clear();
    }

    /// Adds up the runs of all tiles and lists the owners.
    pub(super) fn count(&mut self, tiles: &[Tile]) {
        for run in tiles.iter().flat_map(|tile| &tile.runs) {
            let (word, bit) = (run.id as usize / 64, 1 << (run.id % 64));
            let pixels = &mut self.pixels[run.id as usize];
            if self.owned[word] & bit == 0 {
                self.owned[word] |= bit;
                *pixels = 0;
            }
            *pixels += run.pixels;
        }
        for (word, &bits) in (0..).zip(&self.owned) {
            let mut left: u64 = bits;
            while left != 0 {
                let id: u32 = word * 64 + left.trailing_zeros();
                self.slot[id as usize] = self.ids.len() as u32;
                self.ids.push(id);
                left &= left - 1;
            }
        }
    }

    /// Works out what is needed to paint the visible triangles.
    pub(super) fn prepare(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        grid: Grid,
        vertices: &Vertices,
    ) {
        let ids = &self.ids;
        fit(&mut self.triangles, ids.len(), VisibleTriangle::default());
        exec.for_each_chunk(&mut self.triangles, TRIANGLES_PER_TASK, |task, chunk| {
            for (&id, triangle) in ids[task * TRIANGLES_PER_TASK..].iter().zip(chunk) {
                *triangle = prepare_triangle(geometry, grid, vertices, id);
            }
        });
    }

    /// A visible triangle, or `None` if it is not.
    #[inline]
    pub(super) fn get(&self, id: u32) -> Option<&VisibleTriangle> {
        let word = self.owned.get(id as usize / 64)?;
        (word >> (id % 64) & 1 == 1).then(|| self.owner(id))
    }

    /// A triangle that is known to be visible.
    #[inline]
    pub(super) fn owner(&self, id: u32) -> &VisibleTriangle {
        &self.triangles[self.slot[id as usize] as usize]
    }

    /// How many pixels a triangle owns.
    pub(super) fn pixels(&self, id: u32) -> u32 {
        self.get(id).map_or(0, |_| self.pixels[id as usize])
    }
}

fn prepare_triangle(
    geometry: Geometry<'_>,
    grid: Grid,
    vertices: &Vertices,
    id: u32,
) -> VisibleTriangle {
    let triangle = geometry.world.triangles[id as usize];
    let outline = Outline::new(vertices, triangle);
    // It has an outline and a box, since it was drawn.
    let bounds: Bounds = outline
        .and_then(|outline| outline.pixel_box(grid.width, grid.height))
        .map(Bounds::from)
        .unwrap_or_default();
    let corners = corners(vertices, triangle);
    let planes = TrianglePlanes::new(corners).interpolator(bounds.anchor());
    let clipped = outline.is_none_or(|outline| outline.clipped);
    let slack = if clipped {
        f32::INFINITY
    } else {
        slack(&corners, &planes, &bounds)
    };
    VisibleTriangle {
        planes,
        bounds,
        slack,
    }
}

/// A bound of the error of a pixel's barycentric coordinates, for a triangle in front of the eye.
///
/// With `s` the smallest sum of the edge planes over the triangle (it is linear, so at a corner), `M` the largest magnitude in
/// evaluating one inside the box, and `G` the largest slope per pixel:
/// * rounding coefficients and operations to `f32` costs at most `8 * 2^-24 M` per plane, four times that over `s` per weight;
/// * snapping brings in pixels up to `2^-9` outside along each axis, and clamping moves them back: `4 * 2^-9 G / s`, taken twice;
/// * rounding to the grid of [`repaint`](super::repaint) and clamping to its inside costs at most `2.5 * 2^-16`, taken as `2^-14`.
///
/// Above a quarter the bound is not worth having, and `s` itself may be nothing but rounding: infinity.
fn slack(corners: &[PixelPoint; 3], planes: &Interpolator, bounds: &Bounds) -> f32 {
    let sum_at = |x: f64, y: f64| -> f64 {
        let dx = x - 0.5 - f64::from(planes.anchor[0]);
        let dy = y - 0.5 - f64::from(planes.anchor[1]);
        (0..3)
            .map(|i| {
                let [a, b, c] = [planes.a[i], planes.b[i], planes.c[i]].map(f64::from);
                a * dx + b * dy + c
            })
            .sum()
    };
    let smallest_sum = corners
        .iter()
        .map(|[x, y, _, w]| sum_at(x / w, y / w))
        .fold(f64::INFINITY, f64::min);
    let extent = [bounds.x1 - bounds.x0, bounds.y1 - bounds.y0].map(f64::from);
    let (mut largest, mut slope) = (0.0, 0.0);
    for i in 0..3 {
        let [a, b, c] = [planes.a[i], planes.b[i], planes.c[i]].map(|v| f64::from(v.abs()));
        largest = f64::max(largest, a * extent[0] + b * extent[1] + c);
        slope = f64::max(slope, a + b);
    }
    let bound = 1.0 / 16384.0 + (largest / f64::from(1 << 19) + slope / 64.0) / smallest_sum;
    // Not so for NaN either.
    if smallest_sum > 0.0 && bound < 0.25 {
        bound as f32
    } else {
        f32::INFINITY
    }
}
