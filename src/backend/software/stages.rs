//! The stages of an image, each of which can be stopped.
//!
//! Whatever a stage has done is noted where it was done: in shares, in marks of blocks of vertices, and in one entry for each tile.
//! Pieces are done by whichever thread comes to them, in any order. What comes out is the same, because each has a place
//! of its own for its results and only a stage that is complete is followed by the next.

use super::SoftwareBackend;
use super::drawing::{Desk, Drawing};
use super::moved::Origin;
use super::raster;
use super::resolve::{self, Painter};
use super::setup;
use super::shares::{Progress, Share};
use super::tile::{Grid, TILE_BLOCKS, Tile};
use crate::backend::{BasePaint, Geometry, RasterCounts};
use crate::parallel::{Exec, Turn, Watch, grow};
use crate::simd::dispatch;

/// Tiles in which nothing has to be done, in a row, after which it is asked nevertheless.
const EMPTY_TILES_AT_ONCE: usize = 16;

/// What comes next for an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Stage {
    /// Making room.
    Fit,
    /// Marking the vertices that are needed.
    Mark,
    /// Transforming them.
    Transform,
    /// Setting up and binning triangles.
    SetUp,
    /// Drawing tiles.
    Draw,
    /// Listing the owners of pixels.
    List,
    /// Nothing: all of it is known.
    #[default]
    Complete,
}

impl SoftwareBackend {
    /// Begins an image, whatever became of the one before.
    pub(super) fn begin_image(&mut self, geometry: Geometry<'_>) {
        let grid = Grid::new(geometry.view.width, geometry.view.height);
        if grid != self.grid {
            self.serial += 1;
            self.tiles.clear();
            self.grid = grid;
        }
        self.origin = Some(Origin::of(geometry));
        self.stage = Stage::Fit;
    }

    /// Goes through what is left of the stages until it is told to stop. Returns whether nothing is left.
    pub(super) fn run_stages(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        watch: &Watch<'_>,
    ) -> bool {
        while self.stage != Stage::Complete && !watch.is_over() {
            self.run_stage(exec, geometry, watch);
        }
        self.stage == Stage::Complete
    }

    /// Does what is left of the current stage until it is told to stop, and begins the next if nothing is left.
    fn run_stage(&mut self, exec: Exec, geometry: Geometry<'_>, watch: &Watch<'_>) {
        match self.stage {
            Stage::Fit => {
                if self.fit(geometry, watch) {
                    self.shares.cut(geometry);
                    self.vertices.begin();
                    self.stage = Stage::Mark;
                }
            }
            Stage::Mark => {
                let shares = self.shares.used_mut();
                self.vertices.mark(exec, geometry, shares, watch);
                if !watch.is_over() {
                    self.stage = Stage::Transform;
                }
            }
            Stage::Transform => {
                self.vertices.transform(exec, geometry, watch);
                if !watch.is_over() {
                    self.begin_set_up();
                }
            }
            Stage::SetUp => {
                self.set_up_shares(exec, geometry, watch);
                if self.is_set_up() {
                    self.begin_drawing(exec);
                }
            }
            Stage::Draw => {
                self.draw_tiles(exec, watch);
                if self.is_drawn() {
                    self.begin_list();
                }
            }
            Stage::List => {
                if self.visible.list(exec, &mut self.shares, watch) {
                    self.stage = Stage::Complete;
                }
            }
            Stage::Complete => {}
        }
    }

    /// Makes room for the image and for what is worked out for it; returns whether all of it is there.
    fn fit(&mut self, geometry: Geometry<'_>, watch: &Watch<'_>) -> bool {
        let (grid, serial) = (self.grid, self.serial);
        let tile = |index| Tile::new(grid, index, serial);
        self.resolved.resize(grid.len(), 0);
        self.drawings.resize_with(grid.len(), Drawing::default);
        grow(&mut self.tiles, grid.len(), watch, tile)
            && self.vertices.fit(geometry, watch)
            && self.visible.fit(geometry, watch)
    }

    fn begin_set_up(&mut self) {
        for share in self.shares.used_mut() {
            if share.is_new {
                share.begin_set_up();
            }
        }
        self.stage = Stage::SetUp;
    }

    fn set_up_shares(&mut self, exec: Exec, geometry: Geometry<'_>, watch: &Watch<'_>) {
        let (grid, vertices) = (self.grid, &self.vertices);
        exec.for_each_chunk(self.shares.used_mut(), 1, |_, share| {
            let share = &mut share[0];
            if share.progress == Progress::Done || watch.is_over() {
                return;
            }
            dispatch!(exec.level, simd => setup::set_up(simd, share, geometry, grid, vertices, watch));
            watch.may_go_on();
        });
    }

    fn is_set_up(&self) -> bool {
        let mut shares = self.shares.used().iter();
        shares.all(|share| share.progress == Progress::Done)
    }

    /// Forgets how far drawing came, unless there is something to keep.
    fn begin_drawing(&mut self, exec: Exec) {
        if self.shares.used().iter().all(|share| share.is_new) {
            for drawing in &mut self.drawings {
                if let Drawing::Unfinished(block) = std::mem::take(drawing) {
                    self.spare.put_back(block);
                }
            }
        } else {
            self.mark_new();
        }
        self.note_changes();
        self.spare.provide(exec.threads);
        self.stage = Stage::Draw;
    }

    /// Draws the tiles, those first that have been set aside: so there are never more of them than threads.
    fn draw_tiles(&mut self, exec: Exec, watch: &Watch<'_>) {
        let is_set_aside = |drawing: &Drawing| matches!(drawing, Drawing::Unfinished(_));
        if self.drawings.iter().any(is_set_aside) {
            self.draw_tiles_that(exec, watch, is_set_aside);
        }
        if !watch.is_over() {
            self.spare.provide(exec.threads);
            self.draw_tiles_that(exec, watch, |drawing| matches!(drawing, Drawing::ToDo));
        }
    }

    fn draw_tiles_that(
        &mut self,
        exec: Exec,
        watch: &Watch<'_>,
        is_meant: impl Fn(&Drawing) -> bool + Sync,
    ) {
        let shares = self.shares.used();
        let desk = &Desk {
            watch,
            spare: &self.spare,
        };
        let (tiles, drawings) = (&mut self.tiles[..], &mut self.drawings[..]);
        exec.for_each_chunk2(tiles, drawings, 1, |index, tile, drawing| {
            let (tile, drawing) = (&mut tile[0], &mut drawing[0]);
            if watch.is_over() || !is_meant(drawing) {
                return;
            }
            if shares.iter().all(|share| share.bin(index).is_empty()) {
                tile.set_empty();
                *drawing = Drawing::Done;
                if index % EMPTY_TILES_AT_ONCE != 0 {
                    return;
                }
            } else {
                draw_tile(exec, tile, index, shares, drawing, desk);
            }
            watch.may_go_on();
        });
    }

    fn is_drawn(&self) -> bool {
        let mut drawings = self.drawings.iter();
        drawings.all(|drawing| matches!(drawing, Drawing::Done))
    }

    fn begin_list(&mut self) {
        self.visible.begin(&mut self.shares);
        self.stage = Stage::List;
    }

    /// Gives the tiles that lack them their colours, until it is told to stop. Returns whether all have them.
    pub(super) fn colour_tiles(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        paint: BasePaint<'_>,
        watch: &Watch<'_>,
    ) -> bool {
        self.serial += 1;
        let painter = &Painter {
            geometry,
            shares: &self.shares,
            serial: self.serial,
        };
        let is_done = |next: u16| usize::from(next) == TILE_BLOCKS;
        let (tiles, resolved) = (&mut self.tiles[..], &mut self.resolved[..]);
        exec.for_each_chunk2(tiles, resolved, 1, |index, tile, next| {
            let (tile, next) = (&mut tile[0], &mut next[0]);
            if is_done(*next) || watch.is_over() {
                return;
            }
            dispatch!(exec.level, simd => resolve::resolve_tile(simd, tile, index, painter, paint, next, watch));
            if !tile.owned.is_empty() || index % EMPTY_TILES_AT_ONCE == 0 {
                watch.may_go_on();
            }
        });
        resolved.iter().all(|&next| is_done(next))
    }

    pub(super) fn counts(&self) -> RasterCounts {
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
        counts.kept_tiles = self.kept_tiles;
        counts
    }
}

/// Draws a tile. (Not inlined: with its memory on the stack, passing over a tile would take as long as ten lines of memory.)
#[inline(never)]
fn draw_tile(
    exec: Exec,
    tile: &mut Tile,
    index: usize,
    shares: &[Share],
    drawing: &mut Drawing,
    desk: &Desk<'_>,
) {
    dispatch!(exec.level, simd => raster::draw_tile(simd, tile, index, shares, drawing, desk));
}

/// Single stages, for benchmarks only. None may be left out.
impl SoftwareBackend {
    /// Makes room for the image, cuts triangles into shares, and transforms their vertices.
    #[doc(hidden)]
    pub fn transform(&mut self, exec: Exec, geometry: Geometry<'_>) {
        self.begin_image(geometry);
        self.run_until(Stage::SetUp, exec, geometry);
    }

    /// Then: what there is to draw, sorted into tiles.
    #[doc(hidden)]
    pub fn set_up(&mut self, exec: Exec, geometry: Geometry<'_>) {
        self.begin_set_up();
        self.run_until(Stage::Draw, exec, geometry);
    }

    /// Then: who owns which pixel. Each time it adds to the counts of pixels, which the second step begins anew.
    #[doc(hidden)]
    pub fn draw(&mut self, exec: Exec) {
        self.begin_drawing(exec);
        self.draw_tiles(exec, &Watch::new(Turn::WHOLE.go_on));
        self.begin_list();
    }

    /// At last: who owns any.
    #[doc(hidden)]
    pub fn list_owners(&mut self, exec: Exec, geometry: Geometry<'_>) {
        self.begin_list();
        self.run_until(Stage::Complete, exec, geometry);
    }

    fn run_until(&mut self, end: Stage, exec: Exec, geometry: Geometry<'_>) {
        let watch = &Watch::new(Turn::WHOLE.go_on);
        while self.stage != end {
            self.run_stage(exec, geometry, watch);
        }
    }
}
