//! The first image of a view: visibility, then illumination of what is visible, then colour.

use super::Method;
use super::stats::FrameStats;
use crate::backend::{Backend, BasePaint, Geometry, RasterCounts};
use crate::geometry::Vec3s;
use crate::illumination::{PointBatch, VertexSet};
use crate::parallel::Exec;
use crate::scene::{View, World};
use crate::visibility::{CullCounts, Culler};
use std::ops::Range;

/// The first image of a view, and what was learned while drawing it.
#[derive(Debug)]
pub(super) struct BaseImage {
    culler: Culler,
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
}

impl BaseImage {
    pub(super) fn new(world: &World) -> Self {
        Self {
            culler: Culler::new(&world.clusters),
            visible: Vec::new(),
            colours: Vec3s::default(),
            corners: VertexSet::default(),
            batch: PointBatch::default(),
            culled: CullCounts::default(),
            raster: RasterCounts::default(),
            visible_triangles: 0,
        }
    }

    /// Takes over where the clusters are after some of them have moved.
    pub(super) fn refit(&mut self, world: &World) {
        self.culler.refit(&world.clusters);
    }

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

    pub(super) fn cull(&mut self, view: &View) {
        self.culled = self.culler.cull(view, &mut self.visible);
    }

    pub(super) fn rasterize(
        &mut self,
        exec: Exec,
        world: &World,
        view: &View,
        backend: &mut dyn Backend,
    ) {
        self.raster = backend.rasterize(exec, self.geometry(world, view));
        self.visible_triangles = backend.visible_triangles().len() as u64;
    }

    /// Illuminates what the method needs for its first image.
    pub(super) fn shade(
        &mut self,
        exec: Exec,
        method: Method,
        world: &World,
        view: &View,
        backend: &dyn Backend,
    ) {
        match method {
            Method::Phong => {}
            Method::Flat => self.shade_triangles(exec, world, view, backend),
            _ => self.shade_vertices(exec, world, view, backend),
        }
    }

    fn shade_vertices(&mut self, exec: Exec, world: &World, view: &View, backend: &dyn Backend) {
        let triangles = backend.visible_triangles();
        self.corners
            .illuminate(exec, world, view.eye, triangles, &mut self.colours);
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

    pub(super) fn resolve(
        &mut self,
        exec: Exec,
        method: Method,
        world: &World,
        view: &View,
        backend: &mut dyn Backend,
    ) {
        let paint = match method {
            Method::Phong => BasePaint::Phong,
            Method::Flat => BasePaint::Flat(&self.colours),
            _ => BasePaint::Gouraud(&self.colours),
        };
        backend.resolve(exec, self.geometry(world, view), paint);
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
    }
}
