//! Vertices in homogeneous pixel space, each one transformed once.
//!
//! Only blocks of 16 consecutive vertices that some submitted triangle uses are transformed; the meshes' vertex order makes
//! such blocks either wholly used or wholly unused for the most part. Triangles mark the blocks first, then blocks are
//! transformed in lanes of `f64`. Each operation is rounded by itself, so the bits are the same at all levels, and those of the scalar
//! rules ([`transform_point`](crate::math::transform_point), [`outcode`], [`snap`](crate::geometry::screen::snap)).
//!
//! What comes out is stored vertex by vertex, since set-up picks vertices one at a time: what every submitted triangle needs of
//! its corners apart from what only those need that are drawn.

use super::shares::Share;
use crate::backend::Geometry;
use crate::geometry::screen::{GUARD_BAND_PX, SUBPIXEL_BITS, outcode};
use crate::math::PixelPoint;
use crate::parallel::{Exec, Pace, Watch, grow};
use crate::scene::View;
use crate::simd::{Simd, dispatch};
use fearless_simd::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Vertices of a block.
const BLOCK: usize = 16;
/// Triangles whose blocks are marked in one go: about 10 microseconds.
const MARKED_AT_ONCE: usize = 2048;
/// Blocks that one task transforms: about 10 microseconds.
const BLOCKS_PER_TASK: usize = 128;

/// A vertex on the sub-pixel grid.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(16))]
pub(super) struct SnappedVertex {
    /// Where; the image's corner if the outcode is not zero.
    pub position: [i32; 2],
    /// Clipping planes that the vertex is outside of.
    pub outcode: i32,
}

/// All vertices of a world; those used by submitted triangles are valid.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    snapped: Vec<[SnappedVertex; BLOCK]>,
    /// Homogeneous pixel space.
    points: Vec<[PixelPoint; BLOCK]>,
    /// Blocks to be transformed. Several threads may set the same flag.
    wanted: Vec<AtomicBool>,
}

impl Vertices {
    /// Makes room for a world's vertices; returns whether all of it is there, or false if it was told to stop.
    pub(super) fn fit(&mut self, geometry: Geometry<'_>, watch: &Watch<'_>) -> bool {
        let count = geometry.world.positions.len().div_ceil(BLOCK);
        grow(&mut self.snapped, count, watch, |_| Default::default())
            && grow(&mut self.points, count, watch, |_| Default::default())
            && grow(&mut self.wanted, count, watch, |_| AtomicBool::default())
    }

    /// Wants none of the blocks. An image that was given up may have left some.
    pub(super) fn begin(&mut self) {
        for flag in &mut self.wanted {
            *flag.get_mut() = false;
        }
    }

    /// Marks the blocks of all triangles that are left in `shares`, until it is told to stop.
    pub(super) fn mark(
        &self,
        exec: Exec,
        geometry: Geometry<'_>,
        shares: &mut [Share],
        watch: &Watch<'_>,
    ) {
        exec.for_each_chunk(shares, 1, |_, share| {
            let mut pace = Pace::new(watch, MARKED_AT_ONCE);
            let mut goes_on = !watch.is_over();
            while goes_on && let Some(ids) = share[0].take(pace.left()) {
                goes_on = pace.did(ids.len());
                for &vertex in geometry.world.triangles[ids].as_flattened() {
                    let flag = &self.wanted[vertex as usize / BLOCK];
                    // Looking first keeps the cache line shared between threads.
                    if !flag.load(Ordering::Relaxed) {
                        flag.store(true, Ordering::Relaxed);
                    }
                }
            }
            pace.finish();
        });
    }

    /// Transforms the blocks that are marked and takes the marks off, until it is told to stop.
    pub(super) fn transform(&mut self, exec: Exec, geometry: Geometry<'_>, watch: &Watch<'_>) {
        let wanted = &self.wanted;
        let (snapped, points) = (&mut self.snapped[..], &mut self.points[..]);
        exec.for_each_chunk2(snapped, points, BLOCKS_PER_TASK, |task, snapped, points| {
            if watch.is_over() {
                return;
            }
            let first = task * BLOCKS_PER_TASK;
            let wanted = &wanted[first..first + snapped.len()];
            let mut is_any_wanted = false;
            dispatch!(exec.level, simd => {
                for (index, (snapped, points)) in snapped.iter_mut().zip(points).enumerate() {
                    let flag = &wanted[index];
                    if flag.load(Ordering::Relaxed) {
                        is_any_wanted = true;
                        flag.store(false, Ordering::Relaxed);
                        transform_block(simd, geometry, (first + index) * BLOCK, snapped, points);
                    }
                }
            });
            if is_any_wanted {
                watch.may_go_on();
            }
        });
    }

    /// A vertex in homogeneous pixel space.
    #[inline(always)]
    pub(super) fn point(&self, vertex: u32) -> PixelPoint {
        self.points.as_flattened()[vertex as usize]
    }

    /// All vertices on the sub-pixel grid.
    #[inline(always)]
    pub(super) fn snapped(&self) -> &[SnappedVertex] {
        self.snapped.as_flattened()
    }
}

/// Transforms a block whose first vertex is `first`. Behind the world's last vertex its last one is repeated.
#[inline(always)]
fn transform_block<S: Simd>(
    simd: S,
    geometry: Geometry<'_>,
    first: usize,
    snapped: &mut [SnappedVertex; BLOCK],
    points: &mut [PixelPoint; BLOCK],
) {
    let positions = &geometry.world.positions;
    let used = BLOCK.min(positions.len() - first);
    let widen = |from: &[f32]| {
        let from = &from[first..first + used];
        let mut out = [f64::from(from[used - 1]); BLOCK];
        for (out, &value) in out.iter_mut().zip(from) {
            *out = f64::from(value);
        }
        out
    };
    let position = [
        widen(&positions.x),
        widen(&positions.y),
        widen(&positions.z),
    ];
    let mut point = [[0.0; BLOCK]; 4];
    let mut grid = [[0.0; BLOCK]; 2];
    let mut inside = true;
    for at in (0..BLOCK).step_by(S::f64s::LEN) {
        inside &= transform_lanes(simd, geometry.view, at, &position, &mut point, &mut grid);
    }
    for i in 0..BLOCK {
        points[i] = [point[0][i], point[1][i], point[2][i], point[3][i]];
        snapped[i] = SnappedVertex {
            // The integer is in the low bits of the mantissa.
            position: [grid[0][i].to_bits() as i32, grid[1][i].to_bits() as i32],
            outcode: 0,
        };
    }
    if !inside {
        for (snapped, point) in snapped.iter_mut().zip(points) {
            snapped.outcode = i32::from(outcode(*point));
            if snapped.outcode != 0 {
                // It may have been no number.
                snapped.position = [0; 2];
            }
        }
    }
}

/// Added to a number of less than `2^51`, leaves its nearest integer, ties to even, in the low bits of the sum's mantissa.
const TO_INTEGER: f64 = 6_755_399_441_055_744.0;

/// Transforms a vector's worth of a block from place `at` on. What is written to `grid` is snapped and has [`TO_INTEGER`] added.
/// Says whether all of them are inside of all clipping planes.
#[inline(always)]
fn transform_lanes<S: Simd>(
    simd: S,
    view: &View,
    at: usize,
    position: &[[f64; BLOCK]; 3],
    point: &mut [[f64; BLOCK]; 4],
    grid: &mut [[f64; BLOCK]; 2],
) -> bool {
    let end = at + S::f64s::LEN;
    let [px, py, pz] = [
        S::f64s::from_slice(simd, &position[0][at..end]),
        S::f64s::from_slice(simd, &position[1][at..end]),
        S::f64s::from_slice(simd, &position[2][at..end]),
    ];
    let m = &view.pixel_from_world;
    let mut rows = [px; 4];
    for (i, row) in rows.iter_mut().enumerate() {
        *row = px * m.x_axis[i] + py * m.y_axis[i] + pz * m.z_axis[i] + m.w_axis[i];
    }
    let [x, y, z, w] = rows;
    x.store_slice(&mut point[0][at..end]);
    y.store_slice(&mut point[1][at..end]);
    z.store_slice(&mut point[2][at..end]);
    w.store_slice(&mut point[3][at..end]);

    let zero = S::f64s::splat(simd, 0.0);
    let guard = w * GUARD_BAND_PX;
    let inside = w.simd_gt(zero)
        & (w - z).simd_ge(zero)
        & z.simd_ge(zero)
        & (guard + x).simd_ge(zero)
        & (guard - x).simd_ge(zero)
        & (guard + y).simd_ge(zero)
        & (guard - y).simd_ge(zero);

    let subpixel = f64::from(1 << SUBPIXEL_BITS);
    let limit = S::f64s::splat(simd, GUARD_BAND_PX * subpixel);
    for (v, grid) in [x, y].into_iter().zip(grid) {
        // Limits are integers, so rounding may come last.
        let snapped = (v / w * subpixel).max(-limit).min(limit) + TO_INTEGER;
        snapped.store_slice(&mut grid[at..end]);
    }
    inside.all_true()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::screen::snap;
    use crate::scene::{Eye, World};
    use crate::simd::SimdLevel;
    use glam::{DMat4, DVec4};
    use proptest::prelude::*;
    use std::ops::Range;

    fn coordinate() -> impl Strategy<Value = f32> {
        prop_oneof![
            8 => -2.0..2.0_f32,
            1 => prop_oneof![Just(f32::NAN), Just(f32::INFINITY), Just(1e30_f32), Just(0.0)],
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn lanes_have_the_bits_of_the_scalar_rules(
            corners in prop::collection::vec(prop::array::uniform3(coordinate()), 1..70),
            near in 0.01..1.0_f64,
        ) {
            let mut world = World::default();
            for &p in &corners {
                world.positions.push(p);
            }
            let count = corners.len() as u32;
            world.triangles = (0..count).map(|v| [v, v, 0]).collect();
            let view = View {
                width: 640,
                height: 480,
                pixel_from_world: DMat4::from_cols(
                    DVec4::new(700.0, 1.0, 0.1, 0.0),
                    DVec4::new(0.0, 650.0, 0.0, 0.3),
                    DVec4::new(320.0, 240.0, -near, 1.0),
                    DVec4::new(0.0, 0.0, near * 3.0, 0.5),
                ),
                eye: Eye::Point([0.0; 3]),
                encoding: Default::default(),
            };
            let visible: [Range<u32>; 1] = std::array::from_fn(|_| 0..count);
            let geometry = Geometry { world: &world, view: &view, visible: &visible };
            for level in SimdLevel::available().filter_map(SimdLevel::token) {
                let mut shares = super::super::shares::Shares::default();
                shares.cut(geometry);
                let mut vertices = Vertices::default();
                let (exec, watch) = (Exec { level, threads: 1 }, Watch::new(&|| true));
                vertices.fit(geometry, &watch);
                vertices.mark(exec, geometry, shares.used_mut(), &watch);
                vertices.transform(exec, geometry, &watch);
                for (v, &p) in corners.iter().enumerate() {
                    let want = view.project(p);
                    let point = vertices.point(v as u32);
                    for (got, want) in point.into_iter().zip(want) {
                        // What is no number may be so in different ways.
                        let are_nan = got.is_nan() && want.is_nan();
                        prop_assert!(are_nan || got.to_bits() == want.to_bits(), "{got} {want}");
                    }
                    let got = vertices.snapped()[v];
                    prop_assert_eq!(got.outcode, i32::from(outcode(want)));
                    if got.outcode == 0 {
                        prop_assert_eq!(got.position, snap(want));
                    }
                }
            }
        }
    }
}
