//! Painting parts of triangles anew: exactly the pixels that a triangle owns inside a patch of it.
//!
//! [`patch`](super::patch) says which pixels those are and where to look for them.
//!
//! Pixels are coloured in full vectors, see [`pixel_batch`](super::pixel_batch).
//!
//! The work is a list of jobs, a patch in a tile each, sorted by tile and split between tiles.

use super::fill::{GouraudFill, PatchFill, PhongFill};
use super::lanes::gather;
use super::patch::{PatchEdges, Rows, patch_bounds, slack};
use super::pixel_batch::{Batch, Search};
use super::resolve::Painter;
use super::setup::corners;
use super::tile::{Bounds, Grid, Tile};
use super::transform::Vertices;
use super::visible::Visible;
use crate::backend::{Fill, Patch};
use crate::geometry::Bary;
use crate::geometry::screen::Interpolator;
use crate::illumination::ShadingKit;
use crate::parallel::Exec;
use crate::simd::{Simd, dispatch};
use fearless_simd::SimdMask;

/// Jobs are not split into fewer than these.
const JOBS_PER_TASK: usize = 4;

/// Jobs that there is room for from the start: many times what a piece of refinement needs as a rule.
pub(super) const FIRST_JOBS: usize = 4096;

/// A patch in a tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Job {
    pub tile: u32,
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
