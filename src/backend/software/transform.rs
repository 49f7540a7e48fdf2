//! Vertices in homogeneous pixel space, each one transformed once.
//!
//! Only blocks of 16 consecutive vertices that some visible triangle uses are transformed; the meshes' vertex order makes
//! such blocks either wholly used or wholly unused for the most part. Within a block the same scalar rules
//! ([`transform_point`](crate::math::transform_point), [`outcode`], [`snap`]) run over arrays of fixed length, which the compiler
//! turns into vectors of the dispatched level; each operation is rounded by itself, so the bits are the same at all levels.
//!
//! What comes out is stored vertex by vertex, since set-up picks vertices one at a time: what every submitted triangle needs of
//! its corners apart from what only those need that are drawn.

use super::shares::Share;
use crate::backend::Geometry;
use crate::geometry::screen::{outcode, snap};
use crate::math::PixelPoint;
use crate::parallel::Exec;
use crate::simd::{Simd, dispatch};
use std::sync::atomic::{AtomicBool, Ordering};

/// Vertices of a block.
const BLOCK: usize = 16;
/// Blocks that one task transforms: about 10 microseconds.
const BLOCKS_PER_TASK: usize = 64;

/// A vertex on the sub-pixel grid.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SnappedVertex {
    /// Where; valid if the outcode is zero.
    pub position: [i32; 2],
    /// Clipping planes that the vertex is outside of.
    pub outcode: u32,
}

/// [`BLOCK`] consecutive vertices.
#[derive(Clone, Debug)]
struct VertexBlock {
    snapped: [SnappedVertex; BLOCK],
    /// Homogeneous pixel space.
    point: [PixelPoint; BLOCK],
}

impl VertexBlock {
    const EMPTY: Self = Self {
        snapped: [SnappedVertex {
            position: [0; 2],
            outcode: u32::MAX,
        }; BLOCK],
        point: [[0.0; 4]; BLOCK],
    };
}

/// All vertices of a world; those used by visible triangles are valid.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    blocks: Vec<VertexBlock>,
    /// Blocks to be transformed; all false between passes. Several threads may set the same flag.
    wanted: Vec<AtomicBool>,
}

impl Vertices {
    /// Transforms the vertices of all triangles in `shares`.
    pub(super) fn transform(&mut self, exec: Exec, geometry: Geometry<'_>, shares: &mut [Share]) {
        let count = geometry.world.positions.len().div_ceil(BLOCK);
        self.blocks.resize(count, VertexBlock::EMPTY);
        self.wanted.resize_with(count, AtomicBool::default);
        let wanted = &self.wanted;
        exec.for_each_chunk(shares, 1, |_, share| {
            for range in share[0].ranges(geometry) {
                for &vertex in geometry.world.triangles[range].as_flattened() {
                    let flag = &wanted[vertex as usize / BLOCK];
                    // Looking first keeps the cache line shared between threads.
                    if !flag.load(Ordering::Relaxed) {
                        flag.store(true, Ordering::Relaxed);
                    }
                }
            }
        });
        exec.for_each_chunk(&mut self.blocks, BLOCKS_PER_TASK, |task, blocks| {
            dispatch!(exec.level, simd => {
                for (index, block) in (task * BLOCKS_PER_TASK..).zip(blocks) {
                    if wanted[index].load(Ordering::Relaxed) {
                        wanted[index].store(false, Ordering::Relaxed);
                        transform_block(simd, geometry, index * BLOCK, block);
                    }
                }
            });
        });
    }

    /// A vertex in homogeneous pixel space.
    #[inline(always)]
    pub(super) fn point(&self, vertex: u32) -> PixelPoint {
        self.blocks[vertex as usize / BLOCK].point[vertex as usize % BLOCK]
    }

    /// A vertex on the sub-pixel grid.
    #[inline(always)]
    pub(super) fn snapped(&self, vertex: u32) -> SnappedVertex {
        self.blocks[vertex as usize / BLOCK].snapped[vertex as usize % BLOCK]
    }
}

#[inline(always)]
fn transform_block<S: Simd>(
    _simd: S,
    geometry: Geometry<'_>,
    first: usize,
    block: &mut VertexBlock,
) {
    let positions = &geometry.world.positions;
    let used = BLOCK.min(positions.len() - first);
    let (mut x, mut y, mut z) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
    x[..used].copy_from_slice(&positions.x[first..first + used]);
    y[..used].copy_from_slice(&positions.y[first..first + used]);
    z[..used].copy_from_slice(&positions.z[first..first + used]);
    let mut point = [[0.0; BLOCK]; 4];
    for i in 0..BLOCK {
        let p = geometry.view.project([x[i], y[i], z[i]]);
        for (component, value) in point.iter_mut().zip(p) {
            component[i] = value;
        }
    }
    let mut codes = [0; BLOCK];
    let mut snapped = [[0; BLOCK]; 2];
    for i in 0..BLOCK {
        let p = [point[0][i], point[1][i], point[2][i], point[3][i]];
        codes[i] = outcode(p);
        [snapped[0][i], snapped[1][i]] = snap(p);
    }
    for i in 0..BLOCK {
        block.point[i] = [point[0][i], point[1][i], point[2][i], point[3][i]];
        block.snapped[i] = SnappedVertex {
            position: [snapped[0][i], snapped[1][i]],
            outcode: u32::from(codes[i]),
        };
    }
}
