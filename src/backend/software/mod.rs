//! A tiled software rasterizer in SIMD lanes.
//!
//! One image goes through passes, each parallel over pieces that have one owner:
//!
//! | pass | over | does |
//! |---|---|---|
//! | `transform` | blocks of vertices | pixel space, clipping planes, sub-pixel grid |
//! | `setup` | `shares` of triangles | culls (`judge`), clips (`outline`), works out `planes`, sorts into `bins` |
//! | `raster` | tiles | by `edges` and a `brush`: coverage, depth and ids, exactly as [`geometry::screen`](crate::geometry::screen) defines them; counts owners' pixels |
//! | `visible` | shares | lists the owners |
//! | `resolve` | tiles | colours |
//! | `repaint` | tiles | colours of parts of triangles |
//! | `present` | bands of tiles | copies changed tiles to a frame |
//!
//! All but the last two can be stopped after any piece of their work, and go on from there (`stages`, `drawing`). Where only some
//! objects have moved, those that find visibility and colours do so for what these touch (`moved`).
//!
//! No pass's result depends on the number of threads, nor coverage, depth and ids on the SIMD level. All memory is kept from
//! image to image.

mod bins;
mod brush;
mod drawing;
mod edges;
mod fill;
mod judge;
mod lanes;
mod moved;
mod outline;
mod owners;
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
mod stages;
mod surface;
mod tile;
mod transform;
mod triangles;
mod visible;

pub use tile::NO_TRIANGLE;

use super::{
    Backend, BasePaint, Capabilities, Geometry, Interpolation, Patch, RasterCounts, new_writer,
};
use crate::output::{Rect, Stamp, Target};
use crate::parallel::{Exec, Turn, Watch};
use crate::simd::dispatch;
use drawing::{Drawing, Spare};
use moved::{Origin, PaintKind};
use repaint::Job;
use resolve::Painter;
use shares::Shares;
use stages::Stage;
use std::fmt;
use std::ops::Range;
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
    /// What comes next for the image.
    stage: Stage,
    /// What the image is made of.
    origin: Option<Origin>,
    /// Covered tiles that it has kept from the image before.
    kept_tiles: u64,
    /// How far the drawing of each tile is.
    drawings: Vec<Drawing>,
    spare: Spare,
    /// For each tile the block that gets its colours next, or [`TILE_BLOCKS`](tile::TILE_BLOCKS) if all have them and nothing has
    /// been painted over them.
    resolved: Vec<u16>,
    /// Where those colours come from.
    painted: Option<PaintKind>,
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
            stage: Stage::default(),
            origin: None,
            kept_tiles: 0,
            drawings: Vec::new(),
            spare: Spare::default(),
            resolved: Vec::new(),
            painted: None,
            shares: Shares::default(),
            vertices: Vertices::default(),
            visible: Visible::default(),
            jobs: Vec::with_capacity(repaint::FIRST_JOBS),
        }
    }

    /// The owner of every pixel, row after row, [`NO_TRIANGLE`] where there is none; `out` is overwritten. Nothing while an image
    /// is not complete.
    pub fn ids(&self, out: &mut Vec<u32>) {
        out.clear();
        out.extend(self.slots().map(|(slot, _)| match slot {
            NO_TRIANGLE => NO_TRIANGLE,
            slot => self.shares.drawn(slot).id,
        }));
    }

    /// The reversed depth of every pixel, row after row, 0 where nothing is; `out` is overwritten. Nothing while an image is not
    /// complete.
    pub fn depths(&self, out: &mut Vec<f32>) {
        out.clear();
        out.extend(self.slots().map(|(slot, [x, y])| match slot {
            NO_TRIANGLE => 0.0,
            slot => self.shares.depth(slot).at_pixel(x, y),
        }));
    }

    /// Slots and places of all pixels, row after row.
    fn slots(&self) -> impl Iterator<Item = (u32, [i32; 2])> {
        let grid = match self.stage {
            Stage::Complete => self.grid,
            _ => Grid::default(),
        };
        (0..grid.height as usize).flat_map(move |y| {
            (0..grid.width as usize).map(move |x| {
                let tile = &self.tiles[y / TILE_SIDE * grid.columns + x / TILE_SIDE];
                let slot = tile.slot_at(x % TILE_SIDE, y % TILE_SIDE);
                (slot, [x as i32, y as i32])
            })
        })
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
        self.rasterize_while(exec, geometry, Turn::WHOLE)
            .unwrap_or_default()
    }

    fn rasterize_while(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        turn: Turn<'_>,
    ) -> Option<RasterCounts> {
        if turn.is_first {
            self.begin_image(geometry);
        }
        let is_complete = self.run_stages(exec, geometry, &Watch::new(turn.go_on));
        is_complete.then(|| self.counts())
    }

    fn rasterize_moved(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        moved: &[Range<u32>],
        turn: Turn<'_>,
    ) -> Option<RasterCounts> {
        let begins = turn.is_first && !self.begin_moved(geometry, moved);
        let turn = Turn {
            is_first: begins,
            ..turn
        };
        self.rasterize_while(exec, geometry, turn)
    }

    fn visible_triangles(&self) -> &[u32] {
        &self.visible.ids
    }

    fn visible_pixels(&self, triangle: u32) -> u32 {
        self.visible.pixels(&self.shares, triangle)
    }

    fn resolve(&mut self, exec: Exec, geometry: Geometry<'_>, paint: BasePaint<'_>) {
        self.resolve_while(exec, geometry, paint, Turn::WHOLE);
    }

    fn resolve_while(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        paint: BasePaint<'_>,
        turn: Turn<'_>,
    ) -> bool {
        if turn.is_first {
            self.begin_colours(PaintKind::of(paint), false);
        }
        self.colour_tiles(exec, geometry, paint, &Watch::new(turn.go_on))
    }

    fn resolve_moved(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        paint: BasePaint<'_>,
        turn: Turn<'_>,
    ) -> bool {
        if turn.is_first {
            self.begin_colours(PaintKind::of(paint), true);
        }
        self.colour_tiles(exec, geometry, paint, &Watch::new(turn.go_on))
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
            if job.pixels > 0 {
                self.resolved[job.tile as usize] = 0;
            }
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
        for &square in squares {
            if let Some(next) = self.resolved.get_mut(square as usize) {
                *next = 0;
            }
        }
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

    fn pending_after_resolve(
        &self,
        exec: Exec,
        geometry: Geometry<'_>,
        target: &Target<'_>,
    ) -> u64 {
        let view = geometry.view;
        let size = (target.width(), target.height());
        if size != (view.width, view.height) || size != (self.grid.width, self.grid.height) {
            return 0;
        }
        let background = dispatch!(exec.level, simd => resolve::background(simd, geometry));
        let known = target.serial_by(self.writer);
        present::after_resolve(&self.tiles, known, background)
            .map(Tile::pixels)
            .sum()
    }

    fn changes(&self, target: &Target<'_>, out: &mut Vec<Rect>) {
        if (target.width(), target.height()) == (self.grid.width, self.grid.height) {
            let known = target.serial_by(self.writer);
            present::changes(self.grid, &self.tiles, known, out);
        }
    }

    fn present(&mut self, exec: Exec, target: &mut Target<'_>) -> u64 {
        let now = Stamp {
            writer: self.writer,
            serial: self.serial,
        };
        present::present(exec, self.grid, &self.tiles, now, target)
    }

    fn sibling(&self) -> Option<Box<dyn Backend>> {
        Some(Box::new(Self::new()))
    }
}
