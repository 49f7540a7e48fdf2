//! Painting shapes into a tile with tiny-skia.
//!
//! A shape is cut to its tile, so that tiny-skia never clips: it clips some edges of neighbouring polygons and not
//! others, and rounds clipped ones differently. Uncut corners are in both neighbours the same bits, cut ones too
//! ([`viewport`](crate::geometry::viewport)); rounded to tiny-skia's grid of 1/64 pixel, they give both neighbours
//! the same edge, and without anti-aliasing every pixel centre along it goes to exactly one of the two.

use super::gradient::{Planes, Spread};
use super::shape::{Shape, snap};
use crate::geometry::viewport::{ScreenPolygon, ScreenRect};
use std::mem;
use tiny_skia::{BlendMode, Color, FillRule, Paint, Path, PathBuilder, Pixmap, Shader, Transform};

/// Side of a tile in pixels. tiny-skia counts in 16 bits with 6 of them for fractions, and tiles are drawn in parallel.
pub(super) const TILE_SIDE: u32 = 256;

/// A part of the image.
#[derive(Clone)]
pub(super) struct Tile {
    /// Its top left pixel in the image.
    pub(super) origin: [u32; 2],
    /// Its colours.
    pub(super) pixmap: Pixmap,
    /// The shapes that touch it, in the order of painting.
    pub(super) shapes: Vec<u32>,
    /// The colour it is filled with, if it holds nothing else.
    filled: Option<[f32; 3]>,
    /// The image in which it last changed.
    pub(super) serial: u64,
    /// Memory for outlines.
    builder: PathBuilder,
}

impl Tile {
    /// A tile, or `None` when it would have no pixels.
    pub(super) fn new(origin: [u32; 2], width: u32, height: u32, serial: u64) -> Option<Self> {
        Some(Self {
            origin,
            pixmap: Pixmap::new(width, height)?,
            shapes: Vec::new(),
            filled: None,
            serial,
            builder: PathBuilder::new(),
        })
    }

    /// Number of pixels.
    pub(super) fn pixels(&self) -> u64 {
        u64::from(self.pixmap.width()) * u64::from(self.pixmap.height())
    }

    /// Its rectangle in the image.
    fn rect(&self) -> ScreenRect {
        let [x, y] = self.origin.map(f64::from);
        ScreenRect {
            min: [x, y],
            max: [
                x + f64::from(self.pixmap.width()),
                y + f64::from(self.pixmap.height()),
            ],
        }
    }

    /// Paints the background (in codes) and all shapes of the tile over it. `serial` is the number of the image.
    pub(super) fn paint(&mut self, all: &[Shape], background: [f32; 3], serial: u64) {
        if self.shapes.is_empty() {
            if self.filled != Some(background) {
                self.pixmap.fill(colour(background));
                (self.filled, self.serial) = (Some(background), serial);
            }
            return;
        }
        (self.filled, self.serial) = (None, serial);
        self.pixmap.fill(colour(background));
        let shapes = mem::take(&mut self.shapes);
        for &index in &shapes {
            self.paint_shape(&all[index as usize]);
        }
        self.shapes = shapes;
    }

    fn paint_shape(&mut self, shape: &Shape) {
        let rect = self.rect();
        let polygon = ScreenPolygon::triangle(shape.points).cut_to(&rect);
        let Some(path) = self.path(&polygon, rect.min) else {
            return;
        };
        // Opaque, hence it replaces what was there; the other channels are added to it.
        let mut blend_mode = BlendMode::SourceOver;
        let center = mean(polygon.points());
        let planes = Planes::new(shape, center, rect.min);
        for shader in shaders(&planes.spreads()).into_iter().flatten() {
            let paint = Paint {
                shader,
                blend_mode: mem::replace(&mut blend_mode, BlendMode::Plus),
                anti_alias: false,
                ..Paint::default()
            };
            self.pixmap.fill_path(
                &path,
                &paint,
                FillRule::Winding,
                Transform::identity(),
                None,
            );
        }
        self.builder = path.clear();
    }

    /// The polygon as a path in the tile's own coordinates, rounded to the grid; `None` when no pixel centre is inside.
    fn path(&mut self, polygon: &ScreenPolygon, origin: [f64; 2]) -> Option<Path> {
        let limit = [self.pixmap.width(), self.pixmap.height()].map(f64::from);
        let mut builder = mem::take(&mut self.builder);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (index, point) in polygon.points().iter().enumerate() {
            let p: [f64; 2] = std::array::from_fn(|axis| {
                snap(point[axis] - origin[axis]).clamp(0.0, limit[axis])
            });
            for axis in 0..2 {
                low[axis] = low[axis].min(p[axis]);
                high[axis] = high[axis].max(p[axis]);
            }
            // Exact: multiples of 1/64 up to 256.
            let (x, y) = (p[0] as f32, p[1] as f32);
            if index == 0 {
                builder.move_to(x, y);
            } else {
                builder.line_to(x, y);
            }
        }
        builder.close();
        let has_centre = (0..2).all(|axis| (low[axis] - 0.5).ceil() < high[axis] - 0.5 + 1e-9);
        if !has_centre {
            builder.clear();
            self.builder = builder;
            return None;
        }
        builder.finish()
    }
}

/// What to paint a shape with, the first over what is there, the others added: a gradient for each channel that
/// varies; those that do not go with the first.
fn shaders(spreads: &[Spread; 3]) -> [Option<Shader<'static>>; 3] {
    let constant = spreads.map(|spread| match spread {
        Spread::Constant(code) => code,
        Spread::Gradient { .. } => 0.0,
    });
    let mut shaders = [const { None }; 3];
    let mut base = constant;
    let mut count = 0;
    for (channel, spread) in spreads.iter().enumerate() {
        if let Some(shader) = spread.shader(base, channel) {
            shaders[count] = Some(shader);
            count += 1;
            base = [0.0; 3];
        }
    }
    if count == 0 {
        shaders[0] = Some(Shader::SolidColor(colour(constant)));
    }
    shaders
}

/// An opaque colour by its codes.
pub(super) fn colour(codes: [f32; 3]) -> Color {
    let [r, g, b] = codes.map(|code| {
        let share = code / 255.0;
        // The comparison is false for NaN.
        if share > 0.0 { share.min(1.0) } else { 0.0 }
    });
    Color::from_rgba(r, g, b, 1.0).unwrap_or(Color::BLACK)
}

fn mean(points: &[[f64; 2]]) -> [f64; 2] {
    let count = points.len().max(1) as f64;
    let sum = points
        .iter()
        .fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
    sum.map(|v| v / count)
}
