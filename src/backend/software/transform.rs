//! Vertices in homogeneous pixel space, each one transformed once.
//!
//! Vertices are transformed in blocks of 16 consecutive ones, when set-up asks for the first of them; the meshes' vertex order makes
//! such blocks either wholly used or wholly unused for the most part. So there is no list of vertices to be made first, nothing is
//! transformed that no submitted triangle uses, and what has just been transformed is still in the cache of the thread that needs it.
//! A thread that asks for a block which another one is transforming waits for that.
//!
//! Within a block the same scalar rules
//! ([`transform_point`](crate::math::transform_point), [`outcode`], [`snap`]) run over arrays of fixed length, which the compiler
//! turns into vectors of the dispatched level; each operation is rounded by itself, so the bits are the same at all levels.
//!
//! What comes out is stored vertex by vertex, since set-up picks vertices one at a time: what every submitted triangle needs of
//! its corners apart from what only those need that are drawn.

use crate::backend::Geometry;
use crate::geometry::screen::{outcode, snap};
use crate::math::PixelPoint;
use crate::parallel::Exec;
use crate::simd::{Level, Simd, dispatch};
use std::sync::OnceLock;

/// Vertices of a block.
const BLOCK: usize = 16;
/// Blocks that one task takes back to the start.
const BLOCKS_PER_TASK: usize = 1024;

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
            outcode: 0,
        }; BLOCK],
        point: [[0.0; 4]; BLOCK],
    };
}

/// All vertices of a world.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    blocks: Vec<OnceLock<VertexBlock>>,
}

impl Vertices {
    /// Forgets where vertices are, for a world of `count` vertices.
    pub(super) fn clear(&mut self, exec: Exec, count: usize) {
        self.blocks.resize_with(count.div_ceil(BLOCK), OnceLock::new);
        exec.for_each_chunk(&mut self.blocks, BLOCKS_PER_TASK, |_, blocks| {
            blocks.fill_with(OnceLock::new);
        });
    }

    /// The vertices of an image.
    pub(super) fn of<'a>(&'a self, level: Level, geometry: Geometry<'a>) -> VerticesOf<'a> {
        VerticesOf {
            blocks: &self.blocks,
            level,
            geometry,
        }
    }
}

/// The vertices of an image.
#[derive(Clone, Copy)]
pub(super) struct VerticesOf<'a> {
    blocks: &'a [OnceLock<VertexBlock>],
    level: Level,
    geometry: Geometry<'a>,
}

impl VerticesOf<'_> {
    /// A vertex in homogeneous pixel space.
    #[inline(always)]
    pub(super) fn point(&self, vertex: u32) -> PixelPoint {
        self.block(vertex).point[vertex as usize % BLOCK]
    }

    /// A vertex on the sub-pixel grid.
    #[inline(always)]
    pub(super) fn snapped(&self, vertex: u32) -> SnappedVertex {
        self.block(vertex).snapped[vertex as usize % BLOCK]
    }

    #[inline(always)]
    fn block(&self, vertex: u32) -> &VertexBlock {
        let index = vertex as usize / BLOCK;
        let block = &self.blocks[index];
        match block.get() {
            Some(block) => block,
            None => self.transform(block, index),
        }
    }

    #[inline(never)]
    fn transform<'b>(&self, block: &'b OnceLock<VertexBlock>, index: usize) -> &'b VertexBlock {
        block.get_or_init(|| {
            dispatch!(self.level, simd => transform_block(simd, self.geometry, index * BLOCK))
        })
    }
}

#[inline(always)]
fn transform_block<S: Simd>(
    _simd: S,
    geometry: Geometry<'_>,
    first: usize,
) -> VertexBlock {
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
    let mut block = VertexBlock::EMPTY;
    for i in 0..BLOCK {
        block.snapped[i] = SnappedVertex {
            position: [snapped[0][i], snapped[1][i]],
            outcode: u32::from(codes[i]),
        };
        block.point[i] = [point[0][i], point[1][i], point[2][i], point[3][i]];
    }
    block
}
