//! Coverage and depth of one tile, in lanes.
//!
//! Edge functions are exact. An edge value `E` changes by a multiple of 256 sub-pixel units from pixel to pixel, so
//! `E >= 0` exactly where `E >> 8 >= 0` (the shift rounds down): `E` is found once per triangle and tile in `i64`, shifted, and goes
//! on in `i32`. The step per pixel is then the edge's extent in sub-pixels, below `2^23` along each axis by the guard band. An edge
//! that no pixel of the box (widened to whole vectors) violates is left out; if every pixel violates one, so is the
//! triangle. Any other changes its sign within 64 x 64 pixels, hence is nowhere larger than `63 * 2^24 < 2^30`: `i32` does not
//! overflow.
//!
//! Depth is [`DepthPlane::at_pixel`](crate::geometry::screen::DepthPlane::at_pixel): products and sums rounded one by one, never fused.
//! Triangles come in ascending order of ids, so "strictly nearer wins" leaves the smaller id in front at equal depth.

use super::setup::Prepared;
use super::shares::Share;
use super::tile::{NO_TRIANGLE, Run, TILE_PIXELS, TILE_SIDE, Tile, TileBox};
use crate::geometry::screen::{EdgeFunction, SUBPIXEL_BITS};
use crate::simd::Simd;
use fearless_simd::{Select, SimdBase, SimdInt, SimdMask};

/// Draws a tile's triangles and notes who owns how many pixels.
#[inline(always)]
pub(super) fn draw_tile<S: Simd>(simd: S, tile: &mut Tile, index: usize, shares: &[Share]) {
    let mut triangles = shares.iter().flat_map(|share| share.bin(index)).peekable();
    if triangles.peek().is_some() {
        tile.clear();
        for prepared in triangles {
            draw_triangle(simd, tile, prepared);
        }
        collect_runs(simd, tile);
    } else if tile.covered > 0 {
        tile.clear();
        tile.runs.clear();
        tile.covered = 0;
    }
}

/// One edge of a triangle inside a tile, in whole pixels.
#[derive(Clone, Copy, Default)]
struct TileEdge {
    /// Value at the first pixel of the (widened) box.
    start: i32,
    /// Change per pixel to the right.
    dx: i32,
    /// Change per pixel down.
    dy: i32,
}

#[inline(always)]
fn draw_triangle<S: Simd>(simd: S, tile: &mut Tile, prepared: &Prepared) {
    let pixels = prepared.bounds.within(tile.origin);
    let lanes = S::f32s::LEN as i32;
    let first = pixels.x0 & !(lanes - 1);
    let last = pixels.x1 | (lanes - 1);
    let mut edges = [TileEdge::default(); 4];
    let mut count = 0;
    for i in 0..3 {
        let edge = EdgeFunction::new(prepared.corners[i], prepared.corners[(i + 1) % 3]);
        let start = edge.at_pixel(tile.origin[0] + first, tile.origin[1] + pixels.y0);
        let start = start >> SUBPIXEL_BITS;
        let across = edge.a * i64::from(last - first);
        let down = edge.b * i64::from(pixels.y1 - pixels.y0);
        if start + across.max(0) + down.max(0) < 0 {
            return;
        }
        if start + across.min(0) + down.min(0) < 0 {
            edges[count] = TileEdge {
                start: start as i32,
                dx: edge.a as i32,
                dy: edge.b as i32,
            };
            count += 1;
        }
    }
    if last >= tile.width {
        // The right border of the image, which would not stop a vector.
        edges[count] = TileEdge {
            start: tile.width - 1 - first,
            dx: -1,
            dy: 0,
        };
        count += 1;
    }
    match count {
        0 => draw_box::<S, 0>(simd, tile, prepared, pixels, [edges[0]; 0]),
        1 => draw_box(simd, tile, prepared, pixels, [edges[0]]),
        2 => draw_box(simd, tile, prepared, pixels, [edges[0], edges[1]]),
        3 => draw_box(simd, tile, prepared, pixels, [edges[0], edges[1], edges[2]]),
        _ => draw_box(simd, tile, prepared, pixels, edges),
    }
}

/// Draws the pixels of a box that violate none of `N` edges.
#[inline(always)]
fn draw_box<S: Simd, const N: usize>(
    simd: S,
    tile: &mut Tile,
    prepared: &Prepared,
    pixels: TileBox,
    edges: [TileEdge; N],
) {
    let lanes = S::f32s::LEN;
    let first = pixels.x0 as usize & !(lanes - 1);
    let iota = S::i32s::from_fn(simd, |i| i as i32);
    let plane = &prepared.depth;
    let column = S::i32s::splat(simd, tile.origin[0] + first as i32 - plane.anchor[0]) + iota;
    let column: S::f32s = column.to_float();
    let slope = S::f32s::splat(simd, plane.dx);
    let (near, far) = (
        S::f32s::splat(simd, plane.max),
        S::f32s::splat(simd, plane.min),
    );
    let id = S::u32s::splat(simd, prepared.id);
    let zero = S::i32s::splat(simd, 0);
    let mut row_start = [zero; N];
    for k in 0..N {
        row_start[k] = iota * edges[k].dx + edges[k].start;
    }
    for y in pixels.y0..=pixels.y1 {
        let row_depth = plane.base + plane.dy * (tile.origin[1] + y - plane.anchor[1]) as f32;
        let row_depth = S::f32s::splat(simd, row_depth);
        let mut edge = row_start;
        let mut column = column;
        let mut x = first;
        while x <= pixels.x1 as usize {
            let mut signs = zero;
            for e in edge {
                signs |= e;
            }
            let inside = signs.simd_ge(zero);
            if N == 0 || inside.any_true() {
                let at = y as usize * TILE_SIDE + x;
                let stored = S::f32s::from_slice(simd, &tile.depth[at..at + lanes]);
                let depth = row_depth + slope * column;
                let depth = depth.max(far).min(near);
                let wins = inside & depth.simd_gt(stored);
                if wins.any_true() {
                    let owner = S::u32s::from_slice(simd, &tile.id[at..at + lanes]);
                    wins.select(depth, stored)
                        .store_slice(&mut tile.depth[at..at + lanes]);
                    wins.select(id, owner)
                        .store_slice(&mut tile.id[at..at + lanes]);
                }
            }
            for k in 0..N {
                edge[k] += edges[k].dx * lanes as i32;
            }
            column += lanes as f32;
            x += lanes;
        }
        for k in 0..N {
            row_start[k] += edges[k].dy;
        }
    }
}

/// Cuts the tile's ids, row after row, into runs, and counts the covered pixels.
#[inline(always)]
fn collect_runs<S: Simd>(simd: S, tile: &mut Tile) {
    let lanes = S::u32s::LEN;
    tile.runs.clear();
    let (mut start, mut id) = (0, tile.id[0]);
    let (runs, covered) = (&mut tile.runs, &mut tile.covered);
    *covered = 0;
    let mut end_run = |id: u32, pixels: usize| {
        if id != NO_TRIANGLE {
            let pixels = pixels as u32;
            *covered += pixels;
            runs.push(Run { id, pixels });
        }
    };
    for at in (0..TILE_PIXELS - 1).step_by(lanes) {
        // A run ends behind each pixel that differs from the next. The last vector has its neighbours one to the left.
        let neighbour = (at + 1).min(TILE_PIXELS - lanes);
        let left = S::u32s::from_slice(simd, &tile.id[neighbour - 1..neighbour - 1 + lanes]);
        let right = S::u32s::from_slice(simd, &tile.id[neighbour..neighbour + lanes]);
        let mut ends = left.simd_ne(right).to_bitmask();
        // Boundaries that the vector before has seen already.
        ends &= u64::MAX << (at + 1 - neighbour);
        while ends != 0 {
            let next = neighbour + ends.trailing_zeros() as usize;
            end_run(id, next - start);
            (start, id) = (next, tile.id[next]);
            ends &= ends - 1;
        }
    }
    end_run(id, TILE_PIXELS - start);
}
