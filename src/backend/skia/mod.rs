//! A backend on tiny-skia, a library that fills 2D paths.
//!
//! It knows neither depth nor triangle ids nor vertex colours, so it shows how little a device must be able to do:
//!
//! * **A Gouraud triangle is up to three linear gradients**, one for each channel: the first replaces what was there,
//!   the others, black in all channels but one, are added ([`BlendMode::Plus`](tiny_skia::BlendMode::Plus)). Colours
//!   are clamped and encoded at the corners; between them the *codes* are affine on the screen
//!   ([`Interpolation::EncodedAffine`]). Each channel is rounded once.
//! * **No anti-aliasing**, so that a pixel belongs to exactly one of two triangles that share an edge. Corners are
//!   rounded to 1/64 pixel.
//! * **Painter's algorithm**: triangles are painted from far to near by the mean of their corners' reversed depths, of
//!   equally deep ones the larger id first.
//! * Everything is **drawn once**, after refinement: see [`BasePaint::Refined`].
//!
//! # Where it differs from `software`
//!
//! * At silhouettes, borders and creases by up to a pixel, because corners are snapped to a coarser grid.
//! * Where triangles intersect, overlap cyclically, or are close to each other while very different in size: one
//!   depth for a whole triangle cannot tell which of two is nearer at every pixel. A teapot's spout meets its body in
//!   a jagged line. Refinement makes triangles smaller, and the sorting better; a floor of few triangles with small
//!   things on it is the worst case.
//! * In colour, by what refinement leaves: it ends when the estimate says half a code, or at triangles of a pixel. A
//!   few pixels along slivers, which following their neighbours has made of some leaves, are off by tens of codes.
//!
//! At 1280 x 720, refined to the end, `closeup` and `walls` are off by more than one code from per-pixel Phong
//! shading in 0.01 and 0.02 % of their pixels, `teapot`, `lights16`, `heavy` and `minimal`, in which objects
//! intersect or hide each other, in 0.5 to 0.8 %, `lights100` in 1.4 %.
//!
//! # Cost
//!
//! For each filled path tiny-skia compiles three pipelines and allocates a list of edges, and each gradient allocates
//! its stops. A small triangle costs about 2.7 microseconds on one thread (three gradients), or 0.9 if it has one
//! colour; a pixel about twenty nanoseconds. Tiles of 256 x 256 pixels are painted in parallel. Except for what
//! tiny-skia allocates inside, memory is kept from image to image.

mod gradient;
mod outline;
mod shape;
mod tile;

use super::{Backend, BasePaint, Capabilities, Geometry, Interpolation, RasterCounts, new_writer};
use crate::output::encode::encode_codes;
use crate::output::target::PIXEL_BYTES;
use crate::output::{ChannelOrder, Stamp, Target};
use crate::parallel::Exec;
use outline::Fate;
use shape::Shape;
use std::fmt;
use tile::{TILE_SIDE, Tile};

/// Draws with tiny-skia: Gouraud triangles only, no ids. See the [module](self).
pub struct SkiaBackend {
    writer: u64,
    /// Counts the images.
    serial: u64,
    width: u32,
    height: u32,
    tiles: Vec<Tile>,
    /// Triangles that may get pixels, ascending.
    visible: Vec<u32>,
    /// Estimated pixels of every triangle of the world.
    pixels: Vec<u32>,
    shapes: Vec<Shape>,
}

impl fmt::Debug for SkiaBackend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SkiaBackend")
            .field("writer", &self.writer)
            .field("serial", &self.serial)
            .field("size", &[self.width, self.height])
            .finish_non_exhaustive()
    }
}

impl Default for SkiaBackend {
    fn default() -> Self {
        Self::new()
    }
}

impl SkiaBackend {
    /// A backend without an image.
    #[must_use]
    pub fn new() -> Self {
        Self {
            writer: new_writer(),
            serial: 0,
            width: 0,
            height: 0,
            tiles: Vec::new(),
            visible: Vec::new(),
            pixels: Vec::new(),
            shapes: Vec::new(),
        }
    }

    fn columns(&self) -> usize {
        self.width.div_ceil(TILE_SIDE) as usize
    }

    /// Makes room for an image.
    fn fit(&mut self, width: u32, height: u32) {
        if [width, height] == [self.width, self.height] {
            return;
        }
        self.serial += 1;
        (self.width, self.height) = (width, height);
        self.tiles.clear();
        for y in (0..height).step_by(TILE_SIDE as usize) {
            for x in (0..width).step_by(TILE_SIDE as usize) {
                let size = [width - x, height - y].map(|left| left.min(TILE_SIDE));
                let tile = Tile::new([x, y], size[0], size[1], self.serial);
                self.tiles.extend(tile);
            }
        }
    }

    /// Notes in every tile which shapes touch it, in the order of painting.
    fn sort_into_tiles(&mut self) {
        for tile in &mut self.tiles {
            tile.shapes.clear();
        }
        let columns = self.columns();
        let last = [self.width, self.height].map(|size| size.saturating_sub(1) / TILE_SIDE);
        for (index, shape) in self.shapes.iter().enumerate() {
            let range = |axis: usize| {
                let along = shape.points.map(|p| p[axis] / f64::from(TILE_SIDE));
                let min = along[0].min(along[1]).min(along[2]);
                let max = along[0].max(along[1]).max(along[2]);
                // The conversions saturate; what lies to the left or above is cut away later.
                (min.max(0.0) as u32, (max.max(0.0) as u32).min(last[axis]))
            };
            let ((x0, x1), (y0, y1)) = (range(0), range(1));
            for y in y0..=y1 {
                for x in x0..=x1 {
                    if let Some(tile) = self.tiles.get_mut(y as usize * columns + x as usize) {
                        tile.shapes.push(index as u32);
                    }
                }
            }
        }
    }

    fn has_size_of(&self, target: &Target<'_>) -> bool {
        (target.width(), target.height()) == (self.width, self.height)
    }
}

/// The tiles that a target lacks which holds the image of serial `known`, or an unknown one.
fn stale(tiles: &[Tile], known: Option<u64>) -> impl Iterator<Item = &Tile> {
    tiles
        .iter()
        .filter(move |tile| known.is_none_or(|serial| tile.serial > serial))
}

impl Backend for SkiaBackend {
    fn capabilities(&self) -> Capabilities {
        Capabilities {
            ids: false,
            per_pixel: false,
            interpolation: Interpolation::EncodedAffine,
        }
    }

    fn rasterize(&mut self, _exec: Exec, geometry: Geometry<'_>) -> RasterCounts {
        self.fit(geometry.view.width, geometry.view.height);
        self.visible.clear();
        self.pixels.clear();
        self.pixels.resize(geometry.world.triangles.len(), 0);
        let mut counts = RasterCounts::default();
        for triangle in geometry.visible.iter().cloned().flatten() {
            counts.submitted += 1;
            match outline::fate(geometry, triangle) {
                Fate::FacesAway => counts.back_facing += 1,
                Fate::OffScreen => counts.off_screen += 1,
                Fate::Drawn { area, clipped } => {
                    let pixels = (area.round() as u32).max(1);
                    counts.drawn += 1;
                    counts.clipped += u64::from(clipped);
                    counts.covered_pixels += u64::from(pixels);
                    self.pixels[triangle as usize] = pixels;
                    self.visible.push(triangle);
                }
            }
        }
        let image = u64::from(self.width) * u64::from(self.height);
        counts.covered_pixels = counts.covered_pixels.min(image);
        counts
    }

    fn visible_triangles(&self) -> &[u32] {
        &self.visible
    }

    fn visible_pixels(&self, triangle: u32) -> u32 {
        self.pixels.get(triangle as usize).copied().unwrap_or(0)
    }

    fn resolve(&mut self, exec: Exec, geometry: Geometry<'_>, paint: BasePaint<'_>) {
        self.serial += 1;
        shape::collect(&mut self.shapes, exec.level, geometry, &self.visible, paint);
        self.shapes.sort_unstable_by(Shape::painting_order);
        self.sort_into_tiles();
        let mut background = [0.0; 3];
        encode_codes(
            exec.level,
            geometry.view.encoding,
            &geometry.world.background,
            &mut background,
        );
        let (shapes, serial) = (&self.shapes, self.serial);
        exec.for_each_chunk(&mut self.tiles, 1, |_, tile| {
            tile[0].paint(shapes, background, serial);
        });
    }

    fn pending_pixels(&self, target: &Target<'_>) -> u64 {
        if !self.has_size_of(target) {
            return 0;
        }
        let known = target.serial_by(self.writer);
        stale(&self.tiles, known).map(Tile::pixels).sum()
    }

    fn present(&mut self, exec: Exec, target: &mut Target<'_>) -> u64 {
        if !self.has_size_of(target) {
            return 0;
        }
        let written = self.pending_pixels(target);
        let known = target.serial_by(self.writer);
        target.mark(Some(Stamp {
            writer: self.writer,
            serial: self.serial,
        }));
        if written > 0 {
            let (columns, stride, order) = (self.columns(), target.stride(), target.order());
            let tiles = &self.tiles;
            let band_bytes = stride.saturating_mul(TILE_SIDE as usize);
            exec.for_each_chunk(target.bytes_mut(), band_bytes, |row, band| {
                // Behind the last row there may be more bytes.
                let Some(tiles) = tiles.get(row * columns..(row + 1) * columns) else {
                    return;
                };
                for tile in stale(tiles, known) {
                    copy(tile, stride, order, band);
                }
            });
        }
        written
    }

    fn sibling(&self) -> Option<Box<dyn Backend>> {
        Some(Box::new(Self::new()))
    }
}

/// Copies a tile into the rows that it takes part in. Pixels are opaque, so premultiplied ones are right.
fn copy(tile: &Tile, stride: usize, order: ChannelOrder, band: &mut [u8]) {
    let row_bytes = tile.pixmap.width() as usize * PIXEL_BYTES;
    let left = tile.origin[0] as usize * PIXEL_BYTES;
    let rows = tile.pixmap.data().chunks(row_bytes);
    for (to, from) in band.chunks_mut(stride).zip(rows) {
        let to = &mut to[left..left + row_bytes];
        to.copy_from_slice(from);
        if order == ChannelOrder::Bgra {
            let (pixels, _) = to.as_chunks_mut::<PIXEL_BYTES>();
            for pixel in pixels {
                pixel.swap(0, 2);
            }
        }
    }
}
