//! Painting parts of triangles anew: exactly the pixels that a triangle owns inside a patch of it.
//!
//! **Who owns a pixel.** A pixel's barycentric coordinates `(b1, b2)` in the root triangle are rounded to a grid of `2^-16`,
//! half as wide as that of the patches' corners, and moved off the root's border: `b1, b2 >= 1`, `b1 + b2 <= 2^16 - 1`
//! in grid units. Then an integer edge function decides on which side of each edge of the patch the point lies; the top-left rule, here
//! in the `(b1, b2)` plane, decides on the edges. It amounts to moving every point by one and the same infinitesimal step, and no point
//! is on the root's border, so any patches that partition the root own each pixel exactly once, whether or not
//! they meet edge to edge. (Points on the border could not be shared out by a rule that knows one patch at a time.)
//!
//! **Exactness.** An edge function is twice the area of the triangle of the edge and the point, in units of `2^-15` by `2^-16`.
//! All three lie in the root, the point strictly, so it is smaller in magnitude than the root's `2^31`; and `i32` arithmetic, which
//! wraps, is exact whenever the result fits, bias of the top-left rule included.
//!
//! **Where to look.** A patch is sought in the box of its projection, widened in barycentric coordinates by the triangle's
//! [`slack`](super::visible::VisibleTriangle::slack), and in all that its triangle may own where that says nothing.
//!
//! The work is a list of jobs, a patch in a tile each, sorted by tile and split between tiles.

use super::lanes::{Corners3, Lanes3, gather, interpolate, weights};
use super::resolve::Painter;
use super::setup::corners;
use super::tile::{Bounds, Grid, TILE_SIDE, Tile};
use super::transform::Vertices;
use super::visible::VisibleTriangle;
use crate::backend::{Fill, Patch};
use crate::geometry::Bary;
use crate::illumination::{ActiveLights, ShadingKit, shade_lanes};
use crate::math::PixelPoint;
use crate::output::encode::encode_lanes;
use crate::parallel::Exec;
use crate::simd::{Simd, dispatch};
use fearless_simd::{Select, SimdBase, SimdFloat, SimdMask};

/// Jobs are not split into fewer than these.
const JOBS_PER_TASK: usize = 4;

/// Where 1 lies on the grid of pixels' barycentric coordinates.
const GRID_UNIT: i32 = 2 * Bary::UNIT as i32;

/// A patch in a tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Job {
    tile: u32,
    /// Index of the patch.
    pub patch: u32,
    bounds: Bounds,
    /// How many pixels were painted.
    pub pixels: u32,
}

/// Lists the jobs of all patches, by tile. Patches that face the wrong way or have no area get none.
pub(super) fn plan(
    jobs: &mut Vec<Job>,
    painter: &Painter<'_>,
    grid: Grid,
    vertices: &Vertices,
    patches: &[Patch],
) {
    jobs.clear();
    for (index, patch) in (0..).zip(patches) {
        let Some(owner) = painter.visible.get(patch.triangle) else {
            continue;
        };
        if Bary::doubled_area(patch.corners) <= 0 {
            continue;
        }
        let triangle = painter.geometry.world.triangles[patch.triangle as usize];
        let bounds = patch_bounds(owner, || corners(vertices, triangle), &patch.corners);
        let Some(bounds) = bounds else {
            continue;
        };
        jobs.extend(grid.touched(&bounds).map(|tile| Job {
            tile: tile as u32,
            patch: index,
            bounds,
            pixels: 0,
        }));
    }
    jobs.sort_unstable_by_key(|job| (job.tile, job.patch));
}

/// A box that holds all pixels of a patch.
fn patch_bounds(
    owner: &VisibleTriangle,
    corners: impl FnOnce() -> [PixelPoint; 3],
    patch: &[Bary; 3],
) -> Option<Bounds> {
    if *patch == Bary::ROOT || owner.slack == f32::INFINITY {
        return Some(owner.bounds);
    }
    let corners = corners();
    let slack = f64::from(owner.slack);
    let mut min = [f64::INFINITY; 2];
    let mut max = [f64::NEG_INFINITY; 2];
    for corner in patch {
        let [_, b1, b2] = corner.weights().map(f64::from);
        for (d1, d2) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let (b1, b2) = (b1 + d1 * slack, b2 + d2 * slack);
            let weights = [1.0 - b1 - b2, b1, b2];
            let at = |k: usize| -> f64 { (0..3).map(|i| weights[i] * corners[i][k]).sum() };
            let w = at(3);
            if w <= 0.0 {
                return Some(owner.bounds);
            }
            for axis in 0..2 {
                let position = at(axis) / w;
                min[axis] = min[axis].min(position);
                max[axis] = max[axis].max(position);
            }
        }
    }
    // The pixels whose centres lie inside, with a margin for rounding. The conversion saturates.
    let first = min.map(|v| (v - 0.5 - 1.0 / 256.0).ceil().max(0.0) as u16);
    let last = max.map(|v| (v - 0.5 + 1.0 / 256.0).floor());
    if last[0] < 0.0 || last[1] < 0.0 {
        return None;
    }
    let bounds = Bounds {
        x0: owner.bounds.x0.max(first[0]),
        y0: owner.bounds.y0.max(first[1]),
        x1: owner.bounds.x1.min(last[0] as u16),
        y1: owner.bounds.y1.min(last[1] as u16),
    };
    (bounds.x0 <= bounds.x1 && bounds.y0 <= bounds.y1).then_some(bounds)
}

/// Does all jobs; each tile's stay together.
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
    if exec.threads < 2 || jobs.len() <= JOBS_PER_TASK || ends[0] == ends[1] {
        dispatch!(exec.level, simd => {
            for job in jobs {
                let tile = &mut tiles[job.tile as usize - first];
                job.pixels = paint_job(simd, tile, job, painter, &patches[job.patch as usize]);
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

/// Paints a patch's pixels in a tile and counts them.
#[inline(always)]
fn paint_job<S: Simd>(
    simd: S,
    tile: &mut Tile,
    job: &Job,
    painter: &Painter<'_>,
    patch: &Patch,
) -> u32 {
    let world = painter.geometry.world;
    match patch.fill {
        Fill::Gouraud(colors) => {
            let fill = GouraudFill::new(patch.corners, colors);
            paint_patch(simd, tile, job, painter, patch, &fill)
        }
        Fill::Phong { lights, remainder } => {
            let triangle = world.triangles[patch.triangle as usize];
            let fill = PhongFill {
                kit: painter.kit(world.triangle_material[patch.triangle as usize]),
                lights,
                positions: gather(&world.positions, triangle),
                normals: gather(&world.normals, triangle),
                remainder,
            };
            paint_patch(simd, tile, job, painter, patch, &fill)
        }
    }
}

#[inline(always)]
fn paint_patch<S: Simd>(
    simd: S,
    tile: &mut Tile,
    job: &Job,
    painter: &Painter<'_>,
    patch: &Patch,
    fill: &impl PatchFill,
) -> u32 {
    let lanes = S::u32s::LEN;
    let owner = painter.visible.owner(patch.triangle);
    let inside = (patch.corners != Bary::ROOT).then(|| PatchEdges::new(patch.corners));
    let pixels = job.bounds.within(tile.origin);
    let first = pixels.x0 as usize & !(lanes - 1);
    let mut painted = 0;
    let mut changed = S::mask32s::splat(simd, false);
    for y in pixels.y0..=pixels.y1 {
        for x in (first..=pixels.x1 as usize).step_by(lanes) {
            let at = y as usize * TILE_SIDE + x;
            let ids = S::u32s::from_slice(simd, &tile.id[at..at + lanes]);
            let mut mask = ids.simd_eq(patch.triangle);
            if !mask.any_true() {
                continue;
            }
            let pixel = [tile.origin[0] + x as i32, tile.origin[1] + y];
            let w = weights(simd, &owner.planes, pixel[0], pixel[1]);
            if let Some(edges) = &inside {
                mask &= edges.contain(simd, w);
                if !mask.any_true() {
                    continue;
                }
            }
            painted += mask.to_bitmask().count_ones();
            let stored = S::u32s::from_slice(simd, &tile.color[at..at + lanes]);
            let color = encode_lanes(simd, fill.colors(simd, w));
            let color = mask.select(color, stored);
            changed |= color.simd_ne(stored);
            color.store_slice(&mut tile.color[at..at + lanes]);
        }
    }
    if changed.any_true() {
        tile.serial = painter.serial;
    }
    painted
}

/// The edges of a patch as `a b1 + b b2 + c >= 0` on the grid of pixels' barycentric coordinates, the top-left rule
/// folded into `c`.
#[derive(Clone, Copy, Debug)]
struct PatchEdges([[i32; 3]; 3]);

impl PatchEdges {
    fn new(corners: [Bary; 3]) -> Self {
        let edge = |i: usize| {
            let [p, q] = [corners[i], corners[(i + 1) % 3]];
            let [p1, p2, q1, q2] = [p.b1, p.b2, q.b1, q.b2].map(i64::from);
            let (dx, dy) = (q1 - p1, q2 - p2);
            let top_left = dy < 0 || (dy == 0 && dx > 0);
            // Twice: the pixels' grid is half as wide.
            let c = 2 * (dy * p1 - dx * p2) - i64::from(!top_left);
            // Only the low 32 bits matter, since the values of the edge function fit.
            [-dy as i32, dx as i32, c as i32]
        };
        Self([edge(0), edge(1), edge(2)])
    }

    /// Which pixels with these weights belong to the patch.
    #[inline(always)]
    fn contain<S: Simd>(&self, simd: S, w: Lanes3<S>) -> S::mask32s {
        let one = S::i32s::splat(simd, 1);
        let b1 = on_grid::<S>(w[1]).max(one).min(GRID_UNIT - 2);
        let most = S::i32s::splat(simd, GRID_UNIT - 1) - b1;
        let b2 = on_grid::<S>(w[2]).max(one).min(most);
        let mut signs = S::i32s::splat(simd, 0);
        for [a, b, c] in self.0 {
            signs |= b1 * a + b2 * b + c;
        }
        signs.simd_ge(0)
    }
}

/// A weight rounded to the grid.
#[inline(always)]
fn on_grid<S: Simd>(weight: S::f32s) -> S::i32s {
    (weight * GRID_UNIT as f32 + 0.5).to_int()
}

/// How a patch gets its linear colours.
trait PatchFill {
    /// The colours at the weights of the root triangle's corners.
    fn colors<S: Simd>(&self, simd: S, w: Lanes3<S>) -> Lanes3<S>;
}

/// Corner colours, interpolated in the patch: never beyond what lies between them, however small the patch and however
/// roundly a pixel belongs to it.
struct GouraudFill {
    /// Second and third weight of the patch's first corner.
    origin: [f32; 2],
    /// The patch's weights of its second and third corner from the root's, less the origin.
    local_from_root: [[f32; 2]; 2],
    colors: Corners3,
}

impl GouraudFill {
    /// Needs a patch with positive area.
    fn new(corners: [Bary; 3], colors: Corners3) -> Self {
        let [p, q, r] = corners.map(|c| {
            let [_, b1, b2] = c.weights();
            [b1, b2]
        });
        // Exact, as is the area before it is rounded once.
        let (u, v) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
        let unit = f64::from(Bary::UNIT);
        let area = (f64::from(Bary::doubled_area(corners)) / (unit * unit)) as f32;
        Self {
            origin: p,
            local_from_root: [[v[1] / area, -v[0] / area], [-u[1] / area, u[0] / area]],
            colors,
        }
    }
}

impl PatchFill for GouraudFill {
    #[inline(always)]
    fn colors<S: Simd>(&self, simd: S, w: Lanes3<S>) -> Lanes3<S> {
        let (u, v) = (w[1] - self.origin[0], w[2] - self.origin[1]);
        let [to_second, to_third] = self.local_from_root;
        let one = S::f32s::splat(simd, 1.0);
        let second = u.mul_add(to_second[0], v * to_second[1]).max(0.0).min(one);
        let most = one - second;
        let third = u.mul_add(to_third[0], v * to_third[1]).max(0.0).min(most);
        interpolate(simd, [most - third, second, third], &self.colors)
    }
}

/// The illumination equation under some lights, and an interpolated rest.
struct PhongFill<'a> {
    kit: ShadingKit<'a>,
    lights: ActiveLights,
    positions: Corners3,
    normals: Corners3,
    remainder: Corners3,
}

impl PatchFill for PhongFill<'_> {
    #[inline(always)]
    fn colors<S: Simd>(&self, simd: S, w: Lanes3<S>) -> Lanes3<S> {
        let point = interpolate(simd, w, &self.positions);
        let normal = interpolate(simd, w, &self.normals);
        let shaded = shade_lanes(simd, &self.kit, &self.lights, point, normal);
        let rest = interpolate(simd, w, &self.remainder);
        [
            shaded[0] + rest[0],
            shaded[1] + rest[1],
            shaded[2] + rest[2],
        ]
    }
}
