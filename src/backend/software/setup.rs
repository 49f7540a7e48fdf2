//! Triangle set-up: culling, clipping, and what the tiles need to draw and to colour a triangle; then binning.
//!
//! A triangle is dropped when all its corners are outside of one clipping plane, when its snapped area says that it faces
//! away, or when no pixel centre lies in its box, or in itself if the box holds few. That is found out for a batch of consecutive triangles at a time; the planes of
//! those left are worked out several at a time (see [`planes`](super::planes)).
//!
//! A triangle with a corner outside of some plane is clipped and becomes a
//! fan of pieces. The fan faces the way its whole snapped area says; single pieces that rounding
//! turned the other way are left out. Planes come from the unclipped triangle, anchored at the top left pixel of the box of
//! everything that is left of it, so that all pieces agree.
//!
//! Bins are made for each share of triangles by itself (a counting sort by tile), and a tile looks into every share's bin in
//! turn: nothing is merged, and each bin lists its triangles in ascending order.

use super::fit;
use super::planes::{Corners, TRIANGLES};
use super::shares::Share;
use super::tile::{Bounds, Grid};
use super::transform::{SnappedVertex, Vertices};
use crate::backend::Geometry;
use crate::geometry::screen::{
    DepthPlane, Interpolator, PixelBox, SUBPIXEL_BITS, TrianglePlanes, clip, doubled_area, snap,
};
use crate::math::PixelPoint;
use crate::simd::Simd;
use fearless_simd::prelude::*;

/// Boxes of fewer pixel centres than this along both axes are tested pixel by pixel: many such triangles lie between pixels.
const TINY: i32 = 2;
/// In sub-pixels, no such box is larger unless the image's border has cut it.
const TINY_EXTENT: i32 = (TINY + 1) << SUBPIXEL_BITS;

/// Triangles looked at together.
const BATCH: usize = 16;

/// A triangle, or a piece of a clipped one, ready to be drawn: one cache line.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct Piece {
    /// The triangle's slot.
    pub slot: u32,
    /// The pixels that may be covered.
    pub bounds: Bounds,
    /// Snapped corners, turned so that their area is positive.
    pub corners: [[i32; 2]; 3],
    /// Depth of the whole triangle.
    pub depth: DepthPlane,
}

/// What colouring the pixels of a drawn triangle takes: one cache line.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct Drawn {
    /// Slopes to the right and down, and value at the first pixel of `bounds`, of each corner's barycentric plane.
    planes: [[f32; 3]; 3],
    /// The pixels that may be covered.
    pub bounds: Bounds,
    /// The world's number of the triangle.
    pub id: u32,
    /// The world's vertices.
    pub vertices: [u32; 3],
    /// Whether it had to be clipped.
    pub is_clipped: bool,
}

impl Drawn {
    /// Its barycentric planes.
    #[inline(always)]
    pub(super) fn interpolator(&self) -> Interpolator {
        let [a, b, c] = self.planes;
        Interpolator {
            anchor: self.bounds.anchor(),
            a,
            b,
            c,
        }
    }
}

/// The corners of a triangle in homogeneous pixel space.
#[inline(always)]
pub(super) fn corners(vertices: &Vertices, triangle: [u32; 3]) -> [PixelPoint; 3] {
    [
        vertices.point(triangle[0]),
        vertices.point(triangle[1]),
        vertices.point(triangle[2]),
    ]
}

/// Sets up and bins a share's triangles.
#[inline(always)]
pub(super) fn set_up<S: Simd>(
    simd: S,
    share: &mut Share,
    geometry: Geometry<'_>,
    grid: Grid,
    vertices: &Vertices,
) {
    let setup = Setup {
        geometry,
        grid,
        vertices,
    };
    share.clear();
    let mut pending = Pending::new();
    for range in share.ranges(geometry) {
        let first = range.start;
        for (index, triangles) in geometry.world.triangles[range].chunks(BATCH).enumerate() {
            let first = (first + index * BATCH) as u32;
            setup.batch(simd, share, &mut pending, first, triangles);
        }
    }
    setup.flush(simd, share, &mut pending);
    bin(share, grid);
}

/// The corners of a batch of triangles on the sub-pixel grid.
struct Batch {
    /// By corner.
    x: [[i32; BATCH]; 3],
    /// By corner.
    y: [[i32; BATCH]; 3],
    /// Planes that some corner is outside of.
    some_outside: [i32; BATCH],
    /// Planes that all corners are outside of.
    all_outside: [i32; BATCH],
}

/// What becomes of the triangles of a batch: one bit each. Those in none of the sets are off the screen.
#[derive(Clone, Copy, Default)]
struct Verdicts {
    back_facing: u64,
    clip: u64,
    draw: u64,
}

/// First and last pixels along an axis.
#[derive(Clone, Copy)]
struct PixelRanges {
    first: [i32; BATCH],
    last: [i32; BATCH],
}

impl PixelRanges {
    const NONE: Self = Self {
        first: [0; BATCH],
        last: [0; BATCH],
    };
}

impl Batch {
    #[inline(always)]
    fn gather(snapped: &[SnappedVertex], triangles: &[[u32; 3]]) -> Self {
        let mut batch = Self {
            x: [[0; BATCH]; 3],
            y: [[0; BATCH]; 3],
            some_outside: [0; BATCH],
            all_outside: [0; BATCH],
        };
        for (i, triangle) in triangles.iter().enumerate().take(BATCH) {
            let [a, b, c] = [
                snapped[triangle[0] as usize],
                snapped[triangle[1] as usize],
                snapped[triangle[2] as usize],
            ];
            for (corner, vertex) in [a, b, c].into_iter().enumerate() {
                [batch.x[corner][i], batch.y[corner][i]] = vertex.position;
            }
            batch.some_outside[i] = a.outcode | b.outcode | c.outcode;
            batch.all_outside[i] = a.outcode & b.outcode & c.outcode;
        }
        batch
    }

    /// The corners of a triangle.
    #[inline(always)]
    fn corners(&self, i: usize) -> [[i32; 2]; 3] {
        [
            [self.x[0][i], self.y[0][i]],
            [self.x[1][i], self.y[1][i]],
            [self.x[2][i], self.y[2][i]],
        ]
    }

    /// What becomes of a vector's worth of triangles from `at` on, and the boxes of those that are drawn.
    #[inline(always)]
    fn judge<S: Simd>(
        &self,
        simd: S,
        grid: Grid,
        at: usize,
        boxes: &mut [PixelRanges; 2],
    ) -> Verdicts {
        let end = at + S::i32s::LEN;
        let load = |from: &[i32; BATCH]| S::i32s::from_slice(simd, &from[at..end]);
        let zero = S::i32s::splat(simd, 0);
        let inside = load(&self.some_outside).simd_eq(zero);
        let clip = !inside & load(&self.all_outside).simd_eq(zero);

        let x = [load(&self.x[0]), load(&self.x[1]), load(&self.x[2])];
        let y = [load(&self.y[0]), load(&self.y[1]), load(&self.y[2])];
        let [front, back] = self.facing(simd, at, &x, &y);
        let [x0, x1, across] = pixel_range(simd, x, grid.width);
        let [y0, y1, down] = pixel_range(simd, y, grid.height);
        let mut has_pixels = x0.simd_le(x1) & y0.simd_le(y1);
        let is_tiny = (x1 - x0).max(y1 - y0).simd_lt(TINY) & across.max(down).simd_lt(TINY_EXTENT);
        has_pixels &= !is_tiny | covers_some_of_four(simd, &x, &y, [x0, y0]);
        for (ranges, [first, last]) in boxes.iter_mut().zip([[x0, x1], [y0, y1]]) {
            first.store_slice(&mut ranges.first[at..end]);
            last.store_slice(&mut ranges.last[at..end]);
        }
        Verdicts {
            back_facing: (inside & back).to_bitmask() << at,
            clip: clip.to_bitmask() << at,
            draw: (inside & front & has_pixels).to_bitmask() << at,
        }
    }

    /// Which triangles turn their front to the viewer, and which their back; valid where all corners are inside. Twice the area
    /// in squared sub-pixels is exact in `i32` where the box is below `2^15` along both axes.
    #[inline(always)]
    fn facing<S: Simd>(
        &self,
        simd: S,
        at: usize,
        x: &[S::i32s; 3],
        y: &[S::i32s; 3],
    ) -> [S::mask32s; 2] {
        let ([ux, vx], [uy, vy]) = ([x[1] - x[0], x[2] - x[0]], [y[1] - y[0], y[2] - y[0]]);
        let zero = S::i32s::splat(simd, 0);
        let mut area = uy * vx - ux * vy;
        // A number is below 2^15 in magnitude where its upper 17 bits are all alike.
        let excess = |v: S::i32s| (v ^ (v >> 31)) >> 15;
        let large = (excess(ux) | excess(uy) | excess(vx) | excess(vy)).simd_ne(zero);
        if large.any_true() {
            // The sign is all that matters.
            for (lane, area) in area.as_mut_slice().iter_mut().enumerate() {
                *area = doubled_area(self.corners(at + lane)).signum() as i32;
            }
        }
        [area.simd_gt(zero), area.simd_lt(zero)]
    }
}

/// Whether triangles that turn their front to the viewer, and whose boxes hold the centres of at most 2 x 2 pixels, the first of
/// which is given, cover any of those. It is [`EdgeFunction`](crate::geometry::screen::EdgeFunction) at four places. Such boxes
/// are below three pixels, so that values are below `2^21`. Pixels outside of the box are not covered either, and do no harm.
#[inline(always)]
fn covers_some_of_four<S: Simd>(
    simd: S,
    x: &[S::i32s; 3],
    y: &[S::i32s; 3],
    first: [S::i32s; 2],
) -> S::mask32s {
    let half = 1 << (SUBPIXEL_BITS - 1);
    let [left, top] = [
        (first[0] << SUBPIXEL_BITS) + half,
        (first[1] << SUBPIXEL_BITS) + half,
    ];
    let (zero, one) = (S::i32s::splat(simd, 0), S::i32s::splat(simd, 1));
    // Or-ed together, at the four pixels: negative where one of the edges is violated.
    let mut signs = [zero; 4];
    for i in 0..3 {
        let next = (i + 1) % 3;
        let (dx, dy) = (x[next] - x[i], y[next] - y[i]);
        let top_left = dy.simd_gt(zero) | (dy.simd_eq(zero) & dx.simd_lt(zero));
        let bias = top_left.select(zero, one);
        let value = dy * (left - x[i]) - dx * (top - y[i]) - bias;
        let (right, below) = (dy << SUBPIXEL_BITS, dx << SUBPIXEL_BITS);
        signs[0] |= value;
        signs[1] |= value + right;
        signs[2] |= value - below;
        signs[3] |= value + right - below;
    }
    signs[0].simd_ge(zero)
        | signs[1].simd_ge(zero)
        | signs[2].simd_ge(zero)
        | signs[3].simd_ge(zero)
}

/// First and last pixel along an axis of `size` pixels whose centres lie in the triangles' boxes, as
/// [`PixelBox::of_snapped`] has them; and the boxes' extents in sub-pixels.
#[inline(always)]
fn pixel_range<S: Simd>(simd: S, v: [S::i32s; 3], size: u32) -> [S::i32s; 3] {
    let half = 1 << (SUBPIXEL_BITS - 1);
    let min = v[0].min(v[1]).min(v[2]);
    let max = v[0].max(v[1]).max(v[2]);
    [
        ((min + (half - 1)) >> SUBPIXEL_BITS).max(S::i32s::splat(simd, 0)),
        ((max - half) >> SUBPIXEL_BITS).min(S::i32s::splat(simd, size as i32 - 1)),
        max - min,
    ]
}

/// What set-up reads.
struct Setup<'a> {
    geometry: Geometry<'a>,
    grid: Grid,
    vertices: &'a Vertices,
}

impl Setup<'_> {
    /// Sets up consecutive triangles, the first of which is number `first`.
    #[inline(always)]
    fn batch<S: Simd>(
        &self,
        simd: S,
        share: &mut Share,
        pending: &mut Pending,
        first: u32,
        triangles: &[[u32; 3]],
    ) {
        let batch = Batch::gather(self.vertices.snapped(), triangles);
        let mut boxes = [PixelRanges::NONE; 2];
        let mut verdicts = Verdicts::default();
        for at in (0..BATCH).step_by(S::i32s::LEN) {
            let some = batch.judge(simd, self.grid, at, &mut boxes);
            verdicts.back_facing |= some.back_facing;
            verdicts.clip |= some.clip;
            verdicts.draw |= some.draw;
        }
        // The last batch of a range may not be full.
        let submitted = triangles.len().min(BATCH);
        let meant = (1 << submitted) - 1;
        let back_facing = (verdicts.back_facing & meant).count_ones();
        let mut left = (verdicts.clip | verdicts.draw) & meant;
        let counts = &mut share.counts;
        counts.submitted += submitted as u64;
        counts.back_facing += u64::from(back_facing);
        counts.off_screen += (submitted as u32 - back_facing - left.count_ones()) as u64;
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            let (id, triangle) = (first + i as u32, triangles[i]);
            if verdicts.clip >> i & 1 == 1 {
                // In order.
                self.flush(simd, share, pending);
                self.clip(share, id, triangle);
                continue;
            }
            let bounds = PixelBox {
                x0: boxes[0].first[i],
                y0: boxes[1].first[i],
                x1: boxes[0].last[i],
                y1: boxes[1].last[i],
            };
            pending.push(self.vertices, id, triangle, batch.corners(i), bounds);
            if pending.len == TRIANGLES {
                self.flush(simd, share, pending);
            }
        }
    }

    /// Finishes the triangles that wait for their planes.
    #[inline(always)]
    fn flush<S: Simd>(&self, simd: S, share: &mut Share, pending: &mut Pending) {
        if pending.len == 0 {
            return;
        }
        let world = self.geometry.world;
        let planes = pending.corners.planes(simd);
        let waiting = &pending.triangles[..pending.len];
        let (first_slot, drawn, pieces) = share.extend(waiting.len());
        for (i, ((waiting, drawn), piece)) in waiting.iter().zip(drawn).zip(pieces).enumerate() {
            // Field by field: a record put together elsewhere would have to be copied.
            drawn.planes = planes.interpolator(i);
            drawn.bounds = waiting.bounds;
            drawn.id = waiting.id;
            drawn.vertices = waiting.vertices;
            piece.slot = first_slot + i as u32;
            piece.bounds = waiting.bounds;
            piece.corners = waiting.corners;
            piece.depth = planes.depth(i, waiting.bounds.anchor());
            if world.backs.contains(&waiting.id) {
                piece.depth = piece.depth.moved_back();
            }
        }
        for waiting in waiting {
            share.count_from_zero(waiting.bounds);
        }
        share.counts.drawn += pending.len as u64;
        pending.len = 0;
    }

    /// Sets up a triangle of which something is outside of a clipping plane.
    #[inline(never)]
    fn clip(&self, share: &mut Share, id: u32, triangle: [u32; 3]) {
        let world = self.geometry.world;
        let [width, height] = [self.grid.width, self.grid.height];
        let corners = corners(self.vertices, triangle);
        let outline = Outline::of_clipped(corners);
        let area = outline.doubled_area();
        if area < 0 {
            share.counts.back_facing += 1;
            return;
        }
        let Some(pixels) = outline.pixel_box(width, height).filter(|_| area != 0) else {
            share.counts.off_screen += 1;
            return;
        };
        share.counts.clipped += 1;
        share.counts.drawn += 1;
        let anchor = [pixels.x0, pixels.y0];
        let planes = TrianglePlanes::new(corners);
        let mut depth = planes.depth(anchor);
        if world.backs.contains(&id) {
            depth = depth.moved_back();
        }
        let interpolator = planes.interpolator(anchor);
        let slot = share.push(Drawn {
            planes: [interpolator.a, interpolator.b, interpolator.c],
            bounds: pixels.into(),
            id,
            vertices: triangle,
            is_clipped: true,
        });
        for corners in outline.fan() {
            let bounds = PixelBox::of_snapped(&corners, width, height);
            if let Some(bounds) = bounds.filter(|_| doubled_area(corners) > 0) {
                share.pieces.push(Piece {
                    slot,
                    bounds: bounds.into(),
                    corners,
                    depth,
                });
            }
        }
    }
}

/// Triangles to be drawn that wait for their planes.
struct Pending {
    corners: Corners,
    triangles: [Waiting; TRIANGLES],
    len: usize,
}

/// A triangle that waits for its planes.
#[derive(Clone, Copy, Default)]
struct Waiting {
    id: u32,
    vertices: [u32; 3],
    corners: [[i32; 2]; 3],
    bounds: Bounds,
}

impl Pending {
    fn new() -> Self {
        Self {
            corners: Corners::NONE,
            triangles: [Waiting::default(); TRIANGLES],
            len: 0,
        }
    }

    #[inline(always)]
    fn push(
        &mut self,
        all: &Vertices,
        id: u32,
        vertices: [u32; 3],
        snapped: [[i32; 2]; 3],
        bounds: PixelBox,
    ) {
        self.corners
            .set(self.len, corners(all, vertices), [bounds.x0, bounds.y0]);
        self.triangles[self.len] = Waiting {
            id,
            vertices,
            corners: snapped,
            bounds: bounds.into(),
        };
        self.len += 1;
    }
}

/// The snapped outline of what clipping left of a triangle.
#[derive(Clone, Copy, Debug)]
struct Outline {
    points: [[i32; 2]; 9],
    len: usize,
}

impl Outline {
    /// Empty when clipping leaves nothing.
    fn of_clipped(corners: [PixelPoint; 3]) -> Self {
        let polygon = clip(corners);
        let mut points = [[0; 2]; 9];
        for (point, &vertex) in points.iter_mut().zip(polygon.vertices()) {
            *point = snap(vertex);
        }
        Self {
            points,
            len: polygon.vertices().len(),
        }
    }

    /// The triangles of its fan.
    fn fan(&self) -> impl Iterator<Item = [[i32; 2]; 3]> {
        let points = &self.points[..self.len];
        let rest = points.get(1..).unwrap_or_default();
        rest.windows(2).map(|p| [points[0], p[0], p[1]])
    }

    /// Twice its signed area in squared sub-pixels, exactly.
    fn doubled_area(&self) -> i64 {
        self.fan().map(doubled_area).sum()
    }

    /// The pixels that may be covered.
    fn pixel_box(&self, width: u32, height: u32) -> Option<PixelBox> {
        PixelBox::of_snapped(&self.points[..self.len], width, height)
    }
}

/// Sorts a share's pieces by the tiles that their boxes touch.
fn bin(share: &mut Share, grid: Grid) {
    let starts = &mut share.bin_starts;
    starts.clear();
    // Each tile's count goes one place to the right of its start, twice over: after summing up, a place holds its tile's
    // start, which filling then moves on to the end, that is, to the next tile's start.
    starts.resize(grid.len() + 2, 0);
    for piece in &share.pieces {
        for tile in grid.touched(&piece.bounds) {
            starts[tile + 2] += 1;
        }
    }
    for i in 2..starts.len() {
        starts[i] += starts[i - 1];
    }
    fit(&mut share.bin_entries, starts[starts.len() - 1] as usize, 0);
    for (index, piece) in share.pieces.iter().enumerate() {
        for tile in grid.touched(&piece.bounds) {
            let next = &mut starts[tile + 1];
            share.bin_entries[*next as usize] = index as u32;
            *next += 1;
        }
    }
}
