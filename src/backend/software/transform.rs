//! Vertices in homogeneous pixel space, each one transformed once.
//!
//! Only blocks of 16 consecutive vertices that some visible triangle uses are transformed; the meshes' vertex order makes
//! such blocks either wholly used or wholly unused for the most part. Within a block the same scalar rules
//! ([`transform_point`](crate::math::transform_point), [`outcode`], [`snap`]) run over arrays of fixed length, which the compiler
//! turns into vectors of the dispatched level; each operation is rounded by itself, so the bits are the same at all levels.

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

/// [`BLOCK`] consecutive vertices, one array per component.
#[derive(Clone, Debug)]
struct VertexBlock {
    /// Homogeneous pixel space.
    point: [[f64; BLOCK]; 4],
    /// Sub-pixel grid; valid where the outcode is zero.
    snapped: [[i32; BLOCK]; 2],
    /// Clipping planes that the vertex is outside of.
    outcode: [u8; BLOCK],
}

impl VertexBlock {
    const EMPTY: Self = Self {
        point: [[0.0; BLOCK]; 4],
        snapped: [[0; BLOCK]; 2],
        outcode: [u8::MAX; BLOCK],
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
            for triangle in share[0].triangles(geometry) {
                for vertex in geometry.world.triangles[triangle] {
                    wanted[vertex as usize / BLOCK].store(true, Ordering::Relaxed);
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
    #[inline]
    pub(super) fn point(&self, vertex: u32) -> PixelPoint {
        let (block, i) = self.locate(vertex);
        [
            block.point[0][i],
            block.point[1][i],
            block.point[2][i],
            block.point[3][i],
        ]
    }

    /// A vertex on the sub-pixel grid, if its outcode is zero.
    #[inline]
    pub(super) fn snapped(&self, vertex: u32) -> [i32; 2] {
        let (block, i) = self.locate(vertex);
        [block.snapped[0][i], block.snapped[1][i]]
    }

    /// The clipping planes that a vertex is outside of.
    #[inline]
    pub(super) fn outcode(&self, vertex: u32) -> u8 {
        let (block, i) = self.locate(vertex);
        block.outcode[i]
    }

    #[inline]
    fn locate(&self, vertex: u32) -> (&VertexBlock, usize) {
        let vertex = vertex as usize;
        (&self.blocks[vertex / BLOCK], vertex % BLOCK)
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
    for i in 0..BLOCK {
        let p = geometry.view.project([x[i], y[i], z[i]]);
        for (component, value) in block.point.iter_mut().zip(p) {
            component[i] = value;
        }
    }
    for i in 0..BLOCK {
        let p = [
            block.point[0][i],
            block.point[1][i],
            block.point[2][i],
            block.point[3][i],
        ];
        block.outcode[i] = outcode(p);
        [block.snapped[0][i], block.snapped[1][i]] = snap(p);
    }
}
