//! A tiled software rasterizer in SIMD lanes.
//!
//! One image goes through passes, each parallel over pieces that have one owner:
//!
//! | pass | over | does |
//! |---|---|---|
//! | `transform` | blocks of vertices | pixel space, clipping planes, sub-pixel grid |
//! | `setup` | `shares` of triangles | culls (`judge`), clips (`outline`), works out `planes`, sorts into tiles |
//! | `raster` | tiles | by `edges` and a `brush`: coverage, depth and ids, exactly as [`geometry::screen`](crate::geometry::screen) defines them; counts owners' pixels |
//! | `visible` | shares | lists the owners |
//! | `resolve` | tiles | colours |
//! | `repaint` | tiles | colours of parts of triangles |
//! | `present` | bands of tiles | copies changed tiles to a frame |
//!
//! No pass's result depends on the number of threads, nor coverage, depth and ids on the SIMD level. All memory is kept from
//! image to image.

mod brush;
mod edges;
mod fill;
mod judge;
mod lanes;
mod outline;
mod patch;
mod pixel_batch;
mod planes;
mod present;
mod raster;
mod repaint;
mod resolve;
mod setup;
mod shares;
mod squares;
mod tile;
mod transform;
mod visible;

pub use tile::NO_TRIANGLE;

use super::{
    Backend, BasePaint, Capabilities, Geometry, Interpolation, Patch, RasterCounts, new_writer,
};
use crate::output::{Stamp, Target};
use crate::parallel::Exec;
use crate::simd::dispatch;
use repaint::Job;
use resolve::Painter;
use shares::Shares;
use std::fmt;
use tile::{Grid, TILE_SIDE, Tile};

// Its squares are our tiles.
const _: () = assert!(TILE_SIDE == super::SQUARE_SIDE as usize);
use transform::Vertices;
use visible::Visible;

/// The tiled software rasterizer: knows the owner of every pixel, and can illuminate every pixel.
///
/// Images are at most [`MAX_IMAGE_SIDE`](crate::geometry::screen::MAX_IMAGE_SIDE) pixels wide and high.
pub struct SoftwareBackend {
    writer: u64,
    /// Counts the passes that may change colours.
    serial: u64,
    grid: Grid,
    tiles: Vec<Tile>,
    shares: Shares,
    vertices: Vertices,
    visible: Visible,
    jobs: Vec<Job>,
}

impl fmt::Debug for SoftwareBackend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SoftwareBackend")
            .field("writer", &self.writer)
            .field("serial", &self.serial)
            .field("grid", &self.grid)
            .finish_non_exhaustive()
    }
}

impl Default for SoftwareBackend {
    fn default() -> Self {
        Self::new()
    }
}

/// Gives a list its length for this image, new elements being `value` and old ones whatever they were. When that takes more
/// memory, it is twice as much, so that the next views do well with it.
fn fit<T: Clone>(list: &mut Vec<T>, len: usize, value: T) {
    if list.capacity() < len {
        list.clear();
        list.reserve_exact(2 * len);
    }
    list.resize(len, value);
}

impl SoftwareBackend {
    /// A backend without an image.
    #[must_use]
    pub fn new() -> Self {
        Self {
            writer: new_writer(),
            serial: 0,
            grid: Grid::default(),
            tiles: Vec::new(),
            shares: Shares::default(),
            vertices: Vertices::default(),
            visible: Visible::default(),
            jobs: Vec::with_capacity(repaint::FIRST_JOBS),
        }
    }

    /// The owner of every pixel, row after row, [`NO_TRIANGLE`] where there is none; `out` is overwritten.
    pub fn ids(&self, out: &mut Vec<u32>) {
        out.clear();
        out.extend(self.slots().map(|(slot, _)| match slot {
            NO_TRIANGLE => NO_TRIANGLE,
            slot => self.shares.drawn(slot).id,
        }));
    }

    /// The reversed depth of every pixel, row after row, 0 where nothing is; `out` is overwritten.
    pub fn depths(&self, out: &mut Vec<f32>) {
        out.clear();
        out.extend(self.slots().map(|(slot, [x, y])| match slot {
            NO_TRIANGLE => 0.0,
            slot => self.shares.depth(slot).at_pixel(x, y),
        }));
    }

    /// Slots and places of all pixels, row after row.
    fn slots(&self) -> impl Iterator<Item = (u32, [i32; 2])> {
        let grid = self.grid;
        (0..grid.height as usize).flat_map(move |y| {
            (0..grid.width as usize).map(move |x| {
                let tile = &self.tiles[y / TILE_SIDE * grid.columns + x / TILE_SIDE];
                let slot = tile.slot_at(x % TILE_SIDE, y % TILE_SIDE);
                (slot, [x as i32, y as i32])
            })
        })
    }

    /// Makes room for a view's image.
    fn fit(&mut self, geometry: Geometry<'_>) {
        let grid = Grid::new(geometry.view.width, geometry.view.height);
        if grid != self.grid {
            self.serial += 1;
            self.tiles = grid.tiles(self.serial);
            self.grid = grid;
        }
    }

    /// The first step of [`rasterize`](Backend::rasterize), public for benchmarks only, as are the others: makes room for the
    /// image, cuts triangles into shares, and transforms their vertices. None may be left out.
    #[doc(hidden)]
    pub fn transform(&mut self, exec: Exec, geometry: Geometry<'_>) {
        self.fit(geometry);
        self.shares.cut(geometry);
        self.vertices
            .transform(exec, geometry, self.shares.used_mut());
    }

    /// The second step: what there is to draw, sorted into tiles.
    #[doc(hidden)]
    pub fn set_up(&mut self, exec: Exec, geometry: Geometry<'_>) {
        let (grid, vertices) = (self.grid, &self.vertices);
        exec.for_each_chunk(self.shares.used_mut(), 1, |_, share| {
            dispatch!(exec.level, simd => setup::set_up(simd, &mut share[0], geometry, grid, vertices));
        });
    }

    /// The third step: who owns which pixel. Each time it adds to the counts of pixels, which the second step begins anew.
    #[doc(hidden)]
    pub fn draw(&mut self, exec: Exec) {
        let shares = self.shares.used();
        exec.for_each_chunk(&mut self.tiles, 1, |index, tile| {
            dispatch!(exec.level, simd => raster::draw_tile(simd, &mut tile[0], index, shares));
        });
    }

    /// The last step: who owns any.
    #[doc(hidden)]
    pub fn list_owners(&mut self, exec: Exec, geometry: Geometry<'_>) {
        let triangles = geometry.world.triangles.len();
        self.visible.list(exec, &mut self.shares, triangles);
    }

    fn counts(&self) -> RasterCounts {
        let mut counts = RasterCounts::default();
        for share in self.shares.used() {
            counts.submitted += share.counts.submitted;
            counts.back_facing += share.counts.back_facing;
            counts.off_screen += share.counts.off_screen;
            counts.clipped += share.counts.clipped;
            counts.drawn += share.counts.drawn;
        }
        for tile in &self.tiles {
            counts.covered_pixels += u64::from(tile.covered);
            counts.background_tiles += u64::from(tile.covered == 0);
        }
        counts
    }
}

impl Backend for SoftwareBackend {
    fn capabilities(&self) -> Capabilities {
        Capabilities {
            ids: true,
            per_pixel: true,
            interpolation: Interpolation::LinearPerspective,
        }
    }

    fn rasterize(&mut self, exec: Exec, geometry: Geometry<'_>) -> RasterCounts {
        self.transform(exec, geometry);
        self.set_up(exec, geometry);
        self.draw(exec);
        self.list_owners(exec, geometry);
        self.counts()
    }

    fn visible_triangles(&self) -> &[u32] {
        &self.visible.ids
    }

    fn visible_pixels(&self, triangle: u32) -> u32 {
        self.visible.pixels(&self.shares, triangle)
    }

    fn resolve(&mut self, exec: Exec, geometry: Geometry<'_>, paint: BasePaint<'_>) {
        self.serial += 1;
        let painter = Painter {
            geometry,
            shares: &self.shares,
            serial: self.serial,
        };
        exec.for_each_chunk(&mut self.tiles, 1, |index, tile| {
            dispatch!(exec.level, simd => resolve::resolve_tile(simd, &mut tile[0], index, &painter, paint));
        });
    }

    fn repaint(&mut self, exec: Exec, geometry: Geometry<'_>, patches: &mut [Patch]) {
        self.serial += 1;
        let painter = Painter {
            geometry,
            shares: &self.shares,
            serial: self.serial,
        };
        repaint::plan(
            exec,
            &mut self.jobs,
            &painter,
            &self.visible,
            self.grid,
            &self.vertices,
            patches,
        );
        repaint::run(exec, &mut self.tiles, &mut self.jobs, &painter, patches);
        for patch in patches.iter_mut() {
            patch.pixels = 0;
        }
        for job in &self.jobs {
            patches[job.patch as usize].pixels += job.pixels;
        }
    }

    fn square_pixels(&self, square: u32) -> u32 {
        self.tiles
            .get(square as usize)
            .map_or(0, |tile| tile.covered)
    }

    fn shade_squares(&mut self, exec: Exec, geometry: Geometry<'_>, squares: &[u32]) {
        self.serial += 1;
        let painter = Painter {
            geometry,
            shares: &self.shares,
            serial: self.serial,
        };
        squares::shade(exec, &mut self.tiles, &painter, squares);
    }

    fn pending_pixels(&self, target: &Target<'_>) -> u64 {
        if (target.width(), target.height()) != (self.grid.width, self.grid.height) {
            return 0;
        }
        let known = target.serial_by(self.writer);
        present::stale_tiles(&self.tiles, known)
            .map(Tile::pixels)
            .sum()
    }

    fn present(&mut self, exec: Exec, target: &mut Target<'_>) -> u64 {
        let now = Stamp {
            writer: self.writer,
            serial: self.serial,
        };
        present::present(exec, self.grid, &self.tiles, now, target)
    }
}
