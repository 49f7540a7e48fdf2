//! Painting parts of triangles anew: exactly the pixels that a triangle owns inside a patch of it.
//!
//! [`patch`](super::patch) says which pixels those are and where to look for them.
//!
//! **Full vectors.** A block of a small patch has few pixels, and colours are dear. So a batch of pixels that may belong to the patch
//! is collected from all its blocks first, one behind the other without gaps; then weights, the test of
//! ownership, colours and encoding run on full vectors; then the colours go back to where the pixels came from. What a lane
//! gets does not depend on its neighbours, hence not on the width of vectors.
//!
//! The work is a list of jobs, a patch in a tile each, sorted by tile and split between tiles.

use super::fill::{GouraudFill, PatchFill, PhongFill};
use super::lanes::{gather, weights_at};
use super::patch::{MAX_LANES, PatchEdges, Rows, patch_bounds, slack};
use super::resolve::Painter;
use super::setup::corners;
use super::tile::{
    BLOCK_PIXELS, BLOCK_SIDE, BLOCKS_ACROSS, Bounds, Grid, TILE_SIDE, Tile, TileBox, block_corner,
};
use super::transform::Vertices;
use super::visible::Visible;
use crate::backend::{Fill, Patch};
use crate::geometry::Bary;
use crate::geometry::screen::Interpolator;
use crate::illumination::ShadingKit;
use crate::output::Encoding;
use crate::output::encode::encode_lanes;
use crate::parallel::Exec;
use crate::simd::{Simd, dispatch};
use fearless_simd::{Bytes, Select, SimdBase, SimdInt, SimdMask};

/// Jobs are not split into fewer than these.
const JOBS_PER_TASK: usize = 4;

/// Jobs that there is room for from the start: many times what a piece of refinement needs as a rule.
pub(super) const FIRST_JOBS: usize = 4096;

/// Pixels of a batch, at most: as many as keep it in the first-level cache, cheap to clear.
const BATCH: usize = 256;

/// The colour of a pixel of a batch that does not belong to the patch. Painted ones are opaque.
const NOT_PAINTED: u32 = 0;

/// A patch in a tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Job {
    tile: u32,
    /// Index of the patch.
    pub patch: u32,
    /// Slot of the patch's triangle.
    slot: u32,
    bounds: Bounds,
    /// See [`slack`].
    slack: f32,
    /// How many pixels were painted.
    pub pixels: u32,
}

/// Whether jobs are shared out between threads.
fn are_shared(exec: Exec, jobs: &[Job]) -> bool {
    exec.threads > 1 && jobs.len() > JOBS_PER_TASK
}

/// Lists the jobs of all patches, by tile if they will be shared out. Patches that face the wrong way or have no area get
/// none.
pub(super) fn plan(
    exec: Exec,
    jobs: &mut Vec<Job>,
    painter: &Painter<'_>,
    visible: &Visible,
    grid: Grid,
    vertices: &Vertices,
    patches: &[Patch],
) {
    jobs.clear();
    // Patches of one triangle follow each other as a rule.
    let mut known = None;
    for (index, patch) in (0..).zip(patches) {
        let Some((owner, slot)) = visible.get(painter.shares, patch.triangle) else {
            continue;
        };
        if Bary::doubled_area(patch.corners) <= 0 {
            continue;
        }
        let (corners, slack) = match known {
            Some((triangle, corners, slack)) if triangle == patch.triangle => (corners, slack),
            _ => {
                let corners = corners(vertices, owner.vertices);
                let slack = slack(owner, &corners);
                known = Some((patch.triangle, corners, slack));
                (corners, slack)
            }
        };
        let Some(bounds) = patch_bounds(owner, slack, &corners, &patch.corners) else {
            continue;
        };
        jobs.extend(grid.touched(&bounds).map(|tile| Job {
            tile: tile as u32,
            patch: index,
            slot,
            bounds,
            slack,
            pixels: 0,
        }));
    }
    if are_shared(exec, jobs) {
        jobs.sort_unstable_by_key(|job| u64::from(job.tile) << 32 | u64::from(job.patch));
    }
}

/// Does all jobs; each tile's stay together if they are shared out.
pub(super) fn run(
    exec: Exec,
    tiles: &mut [Tile],
    jobs: &mut [Job],
    painter: &Painter<'_>,
    patches: &[Patch],
) {
    run_from(exec, 0, tiles, jobs, painter, patches);
}

/// Does jobs whose tiles are all among `tiles`, the first of which has index `first`.
fn run_from(
    exec: Exec,
    first: usize,
    tiles: &mut [Tile],
    jobs: &mut [Job],
    painter: &Painter<'_>,
    patches: &[Patch],
) {
    let ends = [jobs.first(), jobs.last()].map(|job| job.map(|job| job.tile));
    if !are_shared(exec, jobs) || ends[0] == ends[1] {
        dispatch!(exec.level, simd => {
            let work = &mut Workspace::new();
            for job in jobs {
                let tile = &mut tiles[job.tile as usize - first];
                job.pixels = paint_job(simd, tile, job, painter, &patches[job.patch as usize], work);
            }
        });
        return;
    }
    // Cut in front of the middle job's tile, or behind it when it is the first.
    let mut middle = jobs[jobs.len() / 2].tile;
    if ends[0] == Some(middle) {
        middle += 1;
    }
    let cut = jobs.partition_point(|job| job.tile < middle);
    let (left_jobs, right_jobs) = jobs.split_at_mut(cut);
    let (left_tiles, right_tiles) = tiles.split_at_mut(middle as usize - first);
    exec.join(
        || run_from(exec, first, left_tiles, left_jobs, painter, patches),
        || {
            run_from(
                exec,
                middle as usize,
                right_tiles,
                right_jobs,
                painter,
                patches,
            );
        },
    );
}

/// Memory of one thread, used for one job after the other.
#[derive(Clone, Debug)]
struct Workspace<'a> {
    /// The material illuminated last: the next job shares it as a rule.
    kit: Option<(u16, ShadingKit<'a>)>,
    rows: Rows,
    batch: Batch,
}

impl<'a> Workspace<'a> {
    fn new() -> Self {
        Self {
            kit: None,
            rows: Rows::new(),
            batch: Batch::new(),
        }
    }

    /// What illuminating points of a material needs.
    #[inline(always)]
    fn kit(&mut self, painter: &Painter<'a>, material: u16) -> ShadingKit<'a> {
        match self.kit {
            Some((known, kit)) if known == material => kit,
            _ => {
                let kit = painter.kit(material);
                self.kit = Some((material, kit));
                kit
            }
        }
    }
}

/// Paints a patch's pixels in a tile and counts them.
#[inline(always)]
fn paint_job<'a, S: Simd>(
    simd: S,
    tile: &mut Tile,
    job: &Job,
    painter: &Painter<'a>,
    patch: &Patch,
    work: &mut Workspace<'a>,
) -> u32 {
    let world = painter.geometry.world;
    let owner = painter.shares.drawn(job.slot);
    let planes = owner.interpolator();
    match patch.fill {
        Fill::Gouraud(colours) => {
            let fill = GouraudFill::new(patch.corners, colours);
            paint_patch(simd, tile, job, painter, &planes, patch, &fill, work)
        }
        Fill::Phong { lights, remainder } => {
            let fill = PhongFill {
                kit: work.kit(painter, painter.material(owner)),
                lights,
                positions: gather(&world.positions, owner.vertices),
                normals: gather(&world.normals, owner.vertices),
                remainder,
            };
            paint_patch(simd, tile, job, painter, &planes, patch, &fill, work)
        }
    }
}

#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what a job consists of")]
fn paint_patch<S: Simd>(
    simd: S,
    tile: &mut Tile,
    job: &Job,
    painter: &Painter<'_>,
    planes: &Interpolator,
    patch: &Patch,
    fill: &impl PatchFill,
    work: &mut Workspace<'_>,
) -> u32 {
    let edges = (patch.corners != Bary::ROOT).then(|| PatchEdges::new(patch.corners));
    let pixels = job.bounds.within(tile.origin);
    work.rows
        .find(simd, tile.origin, pixels, planes, job.slack, edges.as_ref());
    let mut search = Search::new(pixels, &work.rows);
    let mut painted = 0;
    let mut changed = S::mask32s::splat(simd, false);
    while search.is_open() {
        let batch = &mut work.batch;
        batch.collect(simd, tile, job.slot, &work.rows, &mut search);
        painted += batch.colour(
            simd,
            painter.geometry.view.encoding,
            tile.origin,
            planes,
            edges.as_ref(),
            fill,
        );
        changed |= batch.put_back(simd, tile);
    }
    if changed.any_true() {
        tile.serial = painter.serial;
    }
    painted
}

/// How far a patch has been searched for pixels: block after block, along rows of blocks.
#[derive(Clone, Copy, Debug)]
struct Search {
    /// First and last row of pixels.
    rows: [usize; 2],
    /// The row of blocks.
    block_row: usize,
    /// The next block in it, and the one behind the last.
    next: usize,
    end: usize,
}

impl Search {
    #[inline(always)]
    fn new(pixels: TileBox, rows: &Rows) -> Self {
        let [y0, y1] = [pixels.y0 as usize, pixels.y1 as usize];
        let mut search = Self {
            rows: [y0, y1],
            block_row: y0 / BLOCK_SIDE,
            next: 0,
            end: 0,
        };
        search.enter_row(rows);
        search
    }

    /// Whether there may be more pixels.
    #[inline(always)]
    fn is_open(&self) -> bool {
        self.block_row <= self.rows[1] / BLOCK_SIDE
    }

    /// First and last row of pixels that are in the row of blocks.
    #[inline(always)]
    fn rows_here(&self) -> [usize; 2] {
        let top = self.block_row * BLOCK_SIDE;
        [
            self.rows[0].max(top),
            self.rows[1].min(top + BLOCK_SIDE - 1),
        ]
    }

    #[inline(always)]
    fn enter_row(&mut self, rows: &Rows) {
        let [y0, y1] = self.rows_here();
        [self.next, self.end] = rows.blocks(y0, y1);
    }

    #[inline(always)]
    fn next_row(&mut self, rows: &Rows) {
        self.block_row += 1;
        if self.is_open() {
            self.enter_row(rows);
        }
    }
}

/// The columns and rows of pixels in their tile, given by their indices: the inverse of
/// [`pixel_index`](super::tile::pixel_index).
#[inline(always)]
fn place_of_index<S: Simd>(index: S::i32s) -> [S::i32s; 2] {
    let block_bits = BLOCK_PIXELS.trailing_zeros();
    let side_bits = BLOCK_SIDE.trailing_zeros();
    let in_block = BLOCK_SIDE as i32 - 1;
    let of_blocks = TILE_SIDE as i32 - BLOCK_SIDE as i32;
    let column = ((index >> (block_bits - side_bits)) & of_blocks) | (index & in_block);
    let across_bits = BLOCKS_ACROSS.trailing_zeros();
    let row = ((index >> (block_bits + across_bits - side_bits)) & of_blocks)
        | ((index >> side_bits) & in_block);
    [column, row]
}

/// Some lanes of consecutive pixels of a block.
#[derive(Clone, Copy, Debug, Default)]
struct Chunk {
    /// Index in the tile of the first lane.
    at: u16,
    /// One bit for each lane.
    lanes: u16,
}

/// Pixels of a tile that may belong to a patch.
#[derive(Clone, Debug)]
struct Batch {
    /// Where they are.
    chunks: [Chunk; BATCH],
    chunks_len: usize,
    /// Their indices in the tile, chunk after chunk.
    index: [u32; BATCH + MAX_LANES],
    len: usize,
    /// Their encoded colours, or [`NOT_PAINTED`].
    colour: [u32; BATCH + MAX_LANES],
}

impl Batch {
    fn new() -> Self {
        Self {
            chunks: [Chunk::default(); BATCH],
            chunks_len: 0,
            index: [0; BATCH + MAX_LANES],
            len: 0,
            colour: [NOT_PAINTED; BATCH + MAX_LANES],
        }
    }

    /// Starts anew with the next pixels of the triangle that has the slot, until there are no more or the batch is full.
    #[inline(always)]
    fn collect<S: Simd>(
        &mut self,
        simd: S,
        tile: &Tile,
        slot: u32,
        rows: &Rows,
        search: &mut Search,
    ) {
        let lanes = S::u32s::LEN;
        let iota = S::u32s::from_fn(simd, |i| i as u32);
        let slot = S::u32s::splat(simd, slot);
        let (mut len, mut chunks_len) = (0, 0);
        while search.is_open() {
            let [y0, y1] = search.rows_here();
            let owned = tile.owned.row(search.block_row);
            while search.next < search.end {
                if len + BLOCK_PIXELS > BATCH {
                    (self.len, self.chunks_len) = (len, chunks_len);
                    return;
                }
                let column = search.next;
                search.next += 1;
                if owned >> column & 1 == 0 {
                    continue;
                }
                let block = search.block_row * BLOCKS_ACROSS + column;
                let within = rows.within_block(block_corner(block), y0, y1);
                for part in 0..BLOCK_PIXELS / lanes {
                    let at = block * BLOCK_PIXELS + part * lanes;
                    let slots = S::u32s::from_slice(simd, &tile.slot[at..at + lanes]);
                    let bits =
                        slots.simd_eq(slot).to_bitmask() & u64::from(within >> (part * lanes));
                    if bits == 0 {
                        continue;
                    }
                    let mask = S::mask32s::from_bitmask(simd, bits);
                    let index = (iota + at as u32).compress(mask);
                    index.store_slice(&mut self.index[len..len + lanes]);
                    self.chunks[chunks_len] = Chunk {
                        at: at as u16,
                        lanes: bits as u16,
                    };
                    chunks_len += 1;
                    len += bits.count_ones() as usize;
                }
            }
            search.next_row(rows);
        }
        (self.len, self.chunks_len) = (len, chunks_len);
    }

    /// Colours the pixels that belong to the patch, and counts them.
    #[inline(always)]
    fn colour<S: Simd>(
        &mut self,
        simd: S,
        encoding: Encoding,
        origin: [i32; 2],
        planes: &Interpolator,
        edges: Option<&PatchEdges>,
        fill: &impl PatchFill,
    ) -> u32 {
        let lanes = S::u32s::LEN;
        let offset = [origin[0] - planes.anchor[0], origin[1] - planes.anchor[1]];
        let iota = S::i32s::from_fn(simd, |i| i as i32);
        let mut painted = 0;
        for at in (0..self.len).step_by(lanes) {
            let index = S::u32s::from_slice(simd, &self.index[at..at + lanes]);
            let index: S::i32s = index.bitcast();
            let [column, row] = place_of_index::<S>(index);
            let dx = (column + offset[0]).to_float();
            let dy = (row + offset[1]).to_float();
            let w = weights_at(simd, planes, dx, dy);
            let mut mask = iota.simd_lt((self.len - at) as i32);
            if let Some(edges) = edges {
                mask &= edges.signs(simd, w).simd_ge(0);
            }
            let bits = mask.to_bitmask();
            let mut colour = S::u32s::splat(simd, NOT_PAINTED);
            // Rare, except where the slack says nothing and a large triangle is searched for a small patch.
            if bits != 0 {
                colour = mask.select(encode_lanes(simd, encoding, fill.colours(simd, w)), colour);
            }
            colour.store_slice(&mut self.colour[at..at + lanes]);
            painted += bits.count_ones();
        }
        painted
    }

    /// Paints the tile and says where that changed it.
    #[inline(always)]
    fn put_back<S: Simd>(&self, simd: S, tile: &mut Tile) -> S::mask32s {
        let lanes = S::u32s::LEN;
        let mut changed = S::mask32s::splat(simd, false);
        let mut next = 0;
        for chunk in &self.chunks[..self.chunks_len] {
            let at = usize::from(chunk.at);
            let mask = S::mask32s::from_bitmask(simd, u64::from(chunk.lanes));
            let colour = S::u32s::from_slice(simd, &self.colour[next..next + lanes]).expand(mask);
            let stored = S::u32s::from_slice(simd, &tile.colour[at..at + lanes]);
            let colour = colour.simd_ne(NOT_PAINTED).select(colour, stored);
            changed |= colour.simd_ne(stored);
            colour.store_slice(&mut tile.colour[at..at + lanes]);
            next += chunk.lanes.count_ones() as usize;
        }
        changed
    }
}
