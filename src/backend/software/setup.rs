//! Triangle set-up: culling, clipping, and what the tiles need to draw and to colour a triangle; then [binning](super::bins).
//!
//! A triangle is dropped when all its corners are outside of one clipping plane, when its snapped area says that it faces
//! away, or when no pixel centre lies in its box, or in itself if the box holds few. That is found out (see [`judge`](super::judge)) for a batch of consecutive triangles at a time; the planes of
//! those left are worked out several at a time (see [`planes`](super::planes)).
//!
//! A triangle with a corner outside of some plane is clipped and becomes a
//! fan of pieces. The fan faces the way its whole snapped area says; single pieces that rounding
//! turned the other way are left out. Planes come from the unclipped triangle, anchored at the top left pixel of the box of
//! everything that is left of it, so that all pieces agree.

use super::bins;
use super::judge::{BATCH, Batch, PixelRanges, Verdicts};
use super::outline::Outline;
use super::planes::{Corners, TRIANGLES};
use super::shares::{Progress, Share};
use super::tile::{Bounds, Grid};
use super::transform::Vertices;
use crate::backend::Geometry;
use crate::geometry::screen::{DepthPlane, Interpolator, PixelBox, TrianglePlanes, doubled_area};
use crate::math::PixelPoint;
use crate::parallel::{Pace, Watch};
use crate::simd::Simd;
use fearless_simd::prelude::*;

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

/// Triangles that are set up in one go: about 10 microseconds.
const SET_UP_AT_ONCE: usize = 512;

/// Sets up and bins a share's triangles, or goes on with it, until it is told to stop.
#[inline(always)]
pub(super) fn set_up<S: Simd>(
    simd: S,
    share: &mut Share,
    geometry: Geometry<'_>,
    grid: Grid,
    vertices: &Vertices,
    watch: &Watch<'_>,
) {
    if share.progress == Progress::Triangles {
        let setup = Setup {
            geometry,
            grid,
            vertices,
        };
        if !setup.triangles(simd, share, watch) {
            return;
        }
        bins::begin(share, grid);
    }
    bins::fill(share, grid, watch);
}

/// What set-up reads.
struct Setup<'a> {
    geometry: Geometry<'a>,
    grid: Grid,
    vertices: &'a Vertices,
}

impl Setup<'_> {
    /// Sets up what is left of a share's triangles; returns whether nothing is left.
    #[inline(always)]
    fn triangles<S: Simd>(&self, simd: S, share: &mut Share, watch: &Watch<'_>) -> bool {
        let mut pending = Pending::new();
        let mut pace = Pace::new(watch, SET_UP_AT_ONCE);
        let mut goes_on = true;
        while goes_on && let Some(ids) = share.take(pace.left()) {
            let (first, count) = (ids.start, ids.len());
            let triangles = &self.geometry.world.triangles[ids];
            for (index, triangles) in triangles.chunks(BATCH).enumerate() {
                let first = (first + index * BATCH) as u32;
                self.batch(simd, share, &mut pending, first, triangles);
            }
            goes_on = pace.did(count);
        }
        self.flush(simd, share, &mut pending);
        goes_on
    }

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
