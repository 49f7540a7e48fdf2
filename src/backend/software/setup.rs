//! Triangle set-up: culling, clipping, and what the tiles need to draw a triangle; then binning.
//!
//! A triangle is dropped when all its corners are outside of one clipping plane, when its snapped area says that it faces
//! away, or when no pixel centre lies in its box. A triangle with a corner outside of some plane is clipped and becomes a
//! fan of triangles with the same id. The fan faces the way its whole snapped area says; single pieces that rounding
//! turned the other way are left out. Depth comes from the unclipped triangle, anchored at the top left pixel of the box of
//! everything that is left of it, so that all pieces agree.
//!
//! Bins are made for each share of triangles by itself (a counting sort by tile), and a tile looks into every share's bin in
//! turn: nothing is merged, and each bin lists its triangles in ascending order.

use super::fit;
use super::shares::Share;
use super::tile::{Bounds, Grid};
use super::transform::Vertices;
use crate::backend::{Geometry, RasterCounts};
use crate::geometry::screen::{DepthPlane, PixelBox, TrianglePlanes, clip, doubled_area, snap};
use crate::math::PixelPoint;

/// A triangle, or a piece of a clipped one, ready to be drawn: one cache line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prepared {
    /// The world's triangle.
    pub id: u32,
    /// The pixels that may be covered.
    pub bounds: Bounds,
    /// Snapped corners, turned so that their area is positive.
    pub corners: [[i32; 2]; 3],
    /// Depth of the whole triangle.
    pub depth: DepthPlane,
}

/// The snapped outline of a triangle: itself, or what clipping left of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    points: [[i32; 2]; 9],
    len: usize,
    /// Whether it had to be clipped.
    pub clipped: bool,
}

impl Outline {
    /// The outline of a triangle; `None` when clipping leaves nothing.
    #[inline(always)]
    pub(super) fn new(vertices: &Vertices, triangle: [u32; 3]) -> Option<Self> {
        let codes = triangle.map(|v| vertices.outcode(v));
        if codes[0] & codes[1] & codes[2] != 0 {
            return None;
        }
        let mut points = [[0; 2]; 9];
        if codes[0] | codes[1] | codes[2] == 0 {
            for (point, vertex) in points.iter_mut().zip(triangle) {
                *point = vertices.snapped(vertex);
            }
            return Some(Self {
                points,
                len: 3,
                clipped: false,
            });
        }
        let polygon = clip(triangle.map(|v| vertices.point(v)));
        for (point, &vertex) in points.iter_mut().zip(polygon.vertices()) {
            *point = snap(vertex);
        }
        let len = polygon.vertices().len();
        (len >= 3).then_some(Self {
            points,
            len,
            clipped: true,
        })
    }

    /// The triangles of its fan.
    #[inline]
    fn fan(&self) -> impl Iterator<Item = [[i32; 2]; 3]> {
        let points = &self.points[..self.len];
        points[1..].windows(2).map(|p| [points[0], p[0], p[1]])
    }

    /// Twice its signed area in squared sub-pixels, exactly.
    #[inline]
    fn doubled_area(&self) -> i64 {
        self.fan().map(doubled_area).sum()
    }

    /// The pixels that may be covered.
    #[inline]
    pub(super) fn pixel_box(&self, width: u32, height: u32) -> Option<PixelBox> {
        PixelBox::of_snapped(&self.points[..self.len], width, height)
    }
}

/// The corners of a triangle in homogeneous pixel space.
#[inline]
pub(super) fn corners(vertices: &Vertices, triangle: [u32; 3]) -> [PixelPoint; 3] {
    triangle.map(|v| vertices.point(v))
}

/// Sets up and bins a share's triangles.
pub(super) fn set_up(share: &mut Share, geometry: Geometry<'_>, grid: Grid, vertices: &Vertices) {
    share.prepared.clear();
    share.counts = RasterCounts::default();
    for triangle in share.triangles(geometry) {
        share.counts.submitted += 1;
        set_up_triangle(share, geometry, grid, vertices, triangle);
    }
    bin(share, grid);
}

fn set_up_triangle(
    share: &mut Share,
    geometry: Geometry<'_>,
    grid: Grid,
    vertices: &Vertices,
    id: usize,
) {
    let world = geometry.world;
    let triangle = world.triangles[id];
    let Some(outline) = Outline::new(vertices, triangle) else {
        share.counts.off_screen += 1;
        return;
    };
    let area = outline.doubled_area();
    if area < 0 {
        share.counts.back_facing += 1;
        return;
    }
    let pixels = outline
        .pixel_box(grid.width, grid.height)
        .filter(|_| area != 0);
    let Some(pixels) = pixels else {
        share.counts.off_screen += 1;
        return;
    };
    share.counts.clipped += u64::from(outline.clipped);
    share.counts.drawn += 1;
    let mut depth = TrianglePlanes::new(corners(vertices, triangle)).depth([pixels.x0, pixels.y0]);
    if world.backs.contains(&(id as u32)) {
        depth = depth.moved_back();
    }
    for corners in outline.fan() {
        let bounds = PixelBox::of_snapped(&corners, grid.width, grid.height);
        if let Some(bounds) = bounds.filter(|_| doubled_area(corners) > 0) {
            share.prepared.push(Prepared {
                id: id as u32,
                bounds: bounds.into(),
                corners,
                depth,
            });
        }
    }
}

/// Sorts a share's prepared triangles by the tiles that their boxes touch.
fn bin(share: &mut Share, grid: Grid) {
    let starts = &mut share.bin_starts;
    starts.clear();
    // Each tile's count goes one place to the right of its start, twice over: after summing up, a place holds its tile's
    // start, which filling then moves on to the end, that is, to the next tile's start.
    starts.resize(grid.len() + 2, 0);
    for prepared in &share.prepared {
        for tile in grid.touched(&prepared.bounds) {
            starts[tile + 2] += 1;
        }
    }
    for i in 2..starts.len() {
        starts[i] += starts[i - 1];
    }
    fit(&mut share.bin_entries, starts[starts.len() - 1] as usize, 0);
    for (index, prepared) in share.prepared.iter().enumerate() {
        for tile in grid.touched(&prepared.bounds) {
            let next = &mut starts[tile + 1];
            share.bin_entries[*next as usize] = index as u32;
            *next += 1;
        }
    }
}
