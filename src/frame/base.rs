//! The first image of a view: visibility, then illumination of what is visible, then colour.

use super::Method;
use super::stats::FrameStats;
use crate::backend::{Backend, BasePaint, Geometry, RasterCounts};
use crate::geometry::{TriangleSet, Vec3s};
use crate::illumination::{PointBatch, VertexSet};
use crate::parallel::{Exec, Turn};
use crate::refine::{Curving, CurvingRule};
use crate::scene::{View, World};
use crate::visibility::{CullCounts, Culler};
use std::ops::Range;

/// The first image of a view, and what was learned while drawing it.
#[derive(Debug, Default)]
pub(super) struct BaseImage {
    visible: Vec<Range<u32>>,
    /// Linear colours: of vertices, or of triangles if shading is flat. Those of visible triangles are valid.
    colours: Vec3s,
    /// Vertices of visible triangles while they are illuminated.
    corners: VertexSet,
    /// Centroids, likewise.
    batch: PointBatch,
    culled: CullCounts,
    raster: RasterCounts,
    /// Triangles that own a pixel.
    visible_triangles: u64,
    /// Which of them have curved colours.
    curving: Curving,
    /// Which of them are illuminated at every pixel, unless all are.
    lit: TriangleSet,
    is_lit: bool,
}

impl BaseImage {
    /// What there is to draw of the view last culled.
    pub(super) fn geometry<'a>(&'a self, world: &'a World, view: &'a View) -> Geometry<'a> {
        Geometry {
            world,
            view,
            visible: &self.visible,
        }
    }

    /// Linear colours of the vertices of visible triangles.
    pub(super) fn colours(&self) -> &Vec3s {
        &self.colours
    }

    /// Triangles that are divided in the first image.
    pub(super) fn curving(&self) -> &Curving {
        &self.curving
    }

    pub(super) fn curving_mut(&mut self) -> &mut Curving {
        &mut self.curving
    }

    /// Triangles that are illuminated at every pixel, empty at first.
    pub(super) fn lit_mut(&mut self) -> &mut TriangleSet {
        &mut self.lit
    }

    /// Has all pixels illuminated.
    pub(super) fn light_everything(&mut self) {
        self.is_lit = true;
    }

    /// Whether all pixels are illuminated.
    pub(super) fn is_lit(&self) -> bool {
        self.is_lit
    }

    /// Whether some triangles have other colours than interpolated ones.
    pub(super) fn is_mixed(&self) -> bool {
        self.is_lit || !self.lit.is_empty() || !self.curving.curved().is_empty()
    }

    /// Has all colours interpolated.
    pub(super) fn unmix(&mut self, triangles: usize) {
        self.curving.clear();
        self.lit.clear(triangles);
        self.is_lit = false;
    }

    /// Begins to divide large triangles, by a rule.
    pub(super) fn begin_curving(&mut self, backend: &dyn Backend, rule: CurvingRule) {
        let pixels = |triangle| backend.visible_pixels(triangle);
        self.curving
            .begin(backend.visible_triangles(), &pixels, rule);
    }

    /// Completes that.
    pub(super) fn finish_curving(&mut self, exec: Exec, world: &World, backend: &dyn Backend) {
        let pixels = |triangle| backend.visible_pixels(triangle);
        self.curving.finish(exec, world, &pixels);
    }

    pub(super) fn cull(&mut self, culler: &mut Culler, view: &View) {
        self.culled = culler.cull(view, &mut self.visible);
    }

    /// One turn of finding the owner of every pixel. `moved` are the triangles that have moved since that was done for the last
    /// image, if its other pixels may keep theirs. False if it was told to stop.
    pub(super) fn rasterize(
        &mut self,
        exec: Exec,
        world: &World,
        view: &View,
        backend: &mut dyn Backend,
        moved: Option<&[Range<u32>]>,
        turn: Turn<'_>,
    ) -> bool {
        let geometry = self.geometry(world, view);
        let counts = match moved {
            Some(moved) => backend.rasterize_moved(exec, geometry, moved, turn),
            None => backend.rasterize_while(exec, geometry, turn),
        };
        let Some(counts) = counts else {
            return false;
        };
        self.raster = counts;
        self.visible_triangles = backend.visible_triangles().len() as u64;
        true
    }

    /// Triangles in clusters that were not culled.
    pub(super) fn triangles_handed_over(&self) -> u64 {
        u64::from(self.culled.triangles)
    }

    /// Whether nothing has been kept of the image before.
    pub(super) fn is_whole(&self) -> bool {
        self.raster.kept_tiles == 0
    }

    /// Triangles that own a pixel.
    pub(super) fn visible_triangles(&self) -> u64 {
        self.visible_triangles
    }

    /// Pixels that some triangle owns.
    pub(super) fn covered_pixels(&self) -> u64 {
        self.raster.covered_pixels
    }

    /// One turn of illuminating what the method needs for its first image. False if it was told to stop.
    pub(super) fn shade(
        &mut self,
        exec: Exec,
        method: Method,
        world: &World,
        view: &View,
        backend: &dyn Backend,
        turn: Turn<'_>,
    ) -> bool {
        match method {
            method if method.shades_first_image_per_pixel() => true,
            Method::Flat => {
                self.shade_triangles(exec, world, view, backend);
                true
            }
            _ => {
                let triangles = backend.visible_triangles();
                let colours = &mut self.colours;
                self.corners
                    .illuminate_while(exec, world, view.eye, triangles, colours, turn)
            }
        }
    }

    /// One colour per triangle, at its centroid with its geometric normal.
    fn shade_triangles(&mut self, exec: Exec, world: &World, view: &View, backend: &dyn Backend) {
        self.batch.clear();
        for &triangle in backend.visible_triangles() {
            let corners = world.triangles[triangle as usize].map(|v| {
                let p = world.positions.get(v as usize);
                glam::Vec3::from(p)
            });
            let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let material = world.triangle_material[triangle as usize];
            // Scaled up, because the cross product of a small triangle's edges may be too short to normalize.
            self.batch.push(
                centroid.to_array(),
                normal.normalize_or_zero().to_array(),
                material,
            );
        }
        self.batch.illuminate(exec, world, view.eye);
        self.colours.resize(world.triangles.len());
        for (index, &triangle) in backend.visible_triangles().iter().enumerate() {
            self.colours
                .set(triangle as usize, self.batch.colour(index));
        }
    }

    /// One turn of giving the image its colours, or those parts of it that have changed if it `has_its_light`. False if it was told to
    /// stop.
    #[expect(
        clippy::too_many_arguments,
        reason = "what is painted, how, and on what"
    )]
    pub(super) fn resolve(
        &mut self,
        exec: Exec,
        method: Method,
        world: &World,
        view: &View,
        backend: &mut dyn Backend,
        has_its_light: bool,
        turn: Turn<'_>,
    ) -> bool {
        let paint = match method {
            method if self.is_lit || method.shades_first_image_per_pixel() => BasePaint::Phong,
            Method::Flat => BasePaint::Flat(&self.colours),
            _ if self.is_mixed() => BasePaint::Mixed {
                colours: &self.colours,
                curved: self.curving.curved(),
                lit: &self.lit,
            },
            _ => BasePaint::Gouraud(&self.colours),
        };
        let geometry = self.geometry(world, view);
        if has_its_light {
            backend.resolve_moved(exec, geometry, paint, turn)
        } else {
            backend.resolve_while(exec, geometry, paint, turn)
        }
    }

    /// Fills in what the first image had to do and what it did not.
    pub(super) fn report(&self, stats: &mut FrameStats) {
        stats.triangles_drawn = self.raster.drawn;
        stats.triangles_visible = self.visible_triangles;
        stats.covered_pixels = self.raster.covered_pixels;
        let skipped = &mut stats.skipped;
        skipped.clusters_off_screen = u64::from(self.culled.outside_frustum);
        skipped.clusters_facing_away = u64::from(self.culled.facing_away);
        skipped.triangles_facing_away = self.raster.back_facing;
        skipped.triangles_off_screen = self.raster.off_screen;
        skipped.triangles_hidden = self.raster.drawn.saturating_sub(self.visible_triangles);
        skipped.background_tiles = self.raster.background_tiles;
        skipped.tiles_unmoved = self.raster.kept_tiles;
    }
}
