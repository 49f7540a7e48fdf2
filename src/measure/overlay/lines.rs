//! Lines on surfaces: clipped, each drawn once, hidden where the surface is.
//!
//! An edge is cut into steps of about [`STEP_PX`]; a step is drawn when one of the triangles that the edge belongs to owns one of
//! the four pixels whose centres are next to the step's middle.

use super::{Picture, colour};
use crate::geometry::bary::Bary;
use crate::geometry::screen::clip;
use crate::math::PixelPoint;
use rustc_hash::FxHashMap;
use tiny_skia::{LineCap, Paint, PathBuilder, Pixmap, Stroke, Transform};

pub(super) const AMBER: [u8; 3] = [255, 170, 30];
pub(super) const GREEN: [u8; 3] = [60, 235, 130];

/// Pixels between looking whether a line is visible.
const STEP_PX: f64 = 1.5;

/// Lines are clipped to so many pixels outside of the image.
const MARGIN_PX: f64 = 4.0;

/// The size (square root of area, in pixels) of polygons whose edges are not drawn at all, and of those whose edges are
/// drawn in full.
const FADE_PX: [f64; 2] = [2.5, 14.0];

/// Opacities are rounded to so many steps, each drawn as one path.
const OPACITIES: usize = 12;

/// How a line is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pen {
    colour: [u8; 3],
    alpha: f32,
    width: f32,
    /// Where edges coincide the higher one is drawn; below [`PENS`].
    priority: usize,
}

/// How many pens there are.
const PENS: usize = 4;

impl Pen {
    pub(super) const LEAF: Self = Self {
        colour: [150, 225, 255],
        alpha: 0.48,
        width: 0.7,
        priority: 0,
    };
    pub(super) const WIREFRAME: Self = Self {
        colour: [255; 3],
        alpha: 0.42,
        width: 0.9,
        priority: 1,
    };
    pub(super) const PHT_REFINED: Self = Self {
        colour: GREEN,
        alpha: 0.9,
        width: 1.2,
        priority: 2,
    };
    pub(super) const PHT: Self = Self {
        colour: AMBER,
        alpha: 0.95,
        width: 1.2,
        priority: 3,
    };
}

/// An edge on the screen.
#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [[f64; 2]; 2],
    /// Triangles that it belongs to; twice the same for one.
    owners: [u32; 2],
    pen: Pen,
    /// In 0..=1.
    opacity: f64,
}

/// Edges waiting to be drawn.
pub(super) struct Lines<'a> {
    picture: &'a Picture<'a>,
    edges: Vec<Edge>,
    /// Place in `edges` by ends in eighths of a pixel.
    places: FxHashMap<[i32; 4], usize>,
}

impl<'a> Lines<'a> {
    pub(super) fn new(picture: &'a Picture<'a>) -> Self {
        Self {
            picture,
            edges: Vec::new(),
            places: FxHashMap::default(),
        }
    }

    /// Adds the edges of a part of a triangle that `wants` says are wanted.
    pub(super) fn add_polygon(
        &mut self,
        triangle: u32,
        corners: [Bary; 3],
        pen: Pen,
        wants: impl Fn([Bary; 2]) -> bool,
    ) {
        let points = self.picture.leaf_corners(triangle, corners);
        let opacity = opacity(size_px(points));
        if opacity <= 0.0 {
            return;
        }
        for k in 0..3 {
            let next = (k + 1) % 3;
            if !wants([corners[k], corners[next]]) {
                continue;
            }
            let size = [self.picture.view.width, self.picture.view.height];
            if let Some(ends) = clip_line(points[k], points[next], size) {
                self.add(Edge {
                    ends,
                    owners: [triangle; 2],
                    pen,
                    opacity,
                });
            }
        }
    }

    /// Adds an edge, or joins it with the one that is there.
    fn add(&mut self, edge: Edge) {
        let [[ax, ay], [bx, by]] = edge.ends.map(|p| p.map(|v| (v * 8.0).round() as i32));
        let place = *self.places.entry([ax, ay, bx, by]).or_insert_with(|| {
            self.edges.push(edge);
            self.edges.len() - 1
        });
        let there = &mut self.edges[place];
        there.owners[1] = edge.owners[0];
        there.opacity = there.opacity.max(edge.opacity);
        if edge.pen.priority > there.pen.priority {
            there.pen = edge.pen;
        }
    }

    /// Draws what is visible of the edges.
    pub(super) fn draw(&self, scale: f32, canvas: &mut Pixmap) {
        let mut paths: [[PathBuilder; OPACITIES]; PENS] = Default::default();
        let mut pens = [Pen::LEAF; PENS];
        for edge in &self.edges {
            let bucket = (edge.opacity * (OPACITIES - 1) as f64).round() as usize;
            pens[edge.pen.priority] = edge.pen;
            let path = &mut paths[edge.pen.priority][bucket.min(OPACITIES - 1)];
            self.visible_parts(edge, |from, to| {
                path.move_to(from[0] as f32, from[1] as f32);
                path.line_to(to[0] as f32, to[1] as f32);
            });
        }
        for (pen, paths) in pens.into_iter().zip(paths) {
            for (bucket, path) in paths.into_iter().enumerate() {
                let opacity = bucket as f32 / (OPACITIES - 1) as f32;
                if let Some(path) = path.finish() {
                    let stroke = Stroke {
                        width: pen.width * scale,
                        line_cap: LineCap::Butt,
                        ..Stroke::default()
                    };
                    let mut paint = Paint::default();
                    paint.set_color(colour(pen.colour, pen.alpha * opacity));
                    canvas.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
                }
            }
        }
    }

    /// Calls `f` with the ends of each stretch of the edge that is visible.
    fn visible_parts(&self, edge: &Edge, mut f: impl FnMut([f64; 2], [f64; 2])) {
        let [a, b] = edge.ends;
        let at = |t: f64| [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let steps = (length / STEP_PX).ceil().max(1.0);
        let mut start = None;
        for step in 0..steps as u32 {
            let step = f64::from(step);
            match (start, self.is_visible(edge, at((step + 0.5) / steps))) {
                (None, true) => start = Some(step),
                (Some(from), false) => {
                    f(at(from / steps), at(step / steps));
                    start = None;
                }
                _ => {}
            }
        }
        if let Some(from) = start {
            f(at(from / steps), b);
        }
    }

    fn is_visible(&self, edge: &Edge, [x, y]: [f64; 2]) -> bool {
        let (width, height) = (
            self.picture.view.width as i32,
            self.picture.view.height as i32,
        );
        // Of these four the point is within one pixel's width.
        let (x, y) = ((x - 0.5).floor() as i32, (y - 0.5).floor() as i32);
        let rows = y.max(0)..(y + 2).min(height);
        rows.into_iter().any(|y| {
            let columns = x.max(0)..(x + 2).min(width);
            columns.into_iter().any(|x| {
                let id = self.picture.ids[y as usize * width as usize + x as usize];
                edge.owners.contains(&id)
            })
        })
    }
}

impl Picture<'_> {
    /// The corners of a part of a triangle.
    pub(super) fn leaf_corners(&self, triangle: u32, corners: [Bary; 3]) -> [PixelPoint; 3] {
        let root = self.triangle(triangle);
        if corners == Bary::ROOT {
            // The same bits as in the neighbours.
            return root;
        }
        corners.map(|corner| {
            let weights = corner.weights().map(f64::from);
            std::array::from_fn(|k| (0..3).map(|i| weights[i] * root[i][k]).sum())
        })
    }
}

/// Square root of a triangle's area on the screen, in pixels.
fn size_px(triangle: [PixelPoint; 3]) -> f64 {
    let polygon = clip(triangle);
    let points: Vec<[f64; 2]> = polygon
        .vertices()
        .iter()
        .map(|p| [p[0] / p[3], p[1] / p[3]])
        .collect();
    let doubled_area: f64 = (0..points.len())
        .map(|k| {
            let ([ax, ay], [bx, by]) = (points[k], points[(k + 1) % points.len()]);
            (ax - points[0][0]) * (by - points[0][1]) - (bx - points[0][0]) * (ay - points[0][1])
        })
        .sum();
    (doubled_area.abs() * 0.5).sqrt()
}

/// How opaque the edges of a polygon of this size are. None for NaN.
fn opacity(size_px: f64) -> f64 {
    let [none, full] = FADE_PX;
    ((size_px - none) / (full - none)).clamp(0.0, 1.0).max(0.0)
}

/// The part of a line that is between the near and far planes and not far outside of the image, the same from
/// both ends.
fn clip_line(a: PixelPoint, b: PixelPoint, [width, height]: [u32; 2]) -> Option<[[f64; 2]; 2]> {
    let [a, b] = if a.partial_cmp(&b)?.is_le() {
        [a, b]
    } else {
        [b, a]
    };
    let distances = |[x, y, z, w]: PixelPoint| {
        let (right, bottom) = (f64::from(width) + MARGIN_PX, f64::from(height) + MARGIN_PX);
        [
            w - z,
            z,
            x + MARGIN_PX * w,
            right * w - x,
            y + MARGIN_PX * w,
            bottom * w - y,
        ]
    };
    let (mut from, mut to) = (0.0, 1.0);
    for (da, db) in distances(a).into_iter().zip(distances(b)) {
        match (da >= 0.0, db >= 0.0) {
            (true, true) => {}
            (false, false) => return None,
            (false, true) => from = f64::max(from, da / (da - db)),
            (true, false) => to = f64::min(to, da / (da - db)),
        }
    }
    let point = |t: f64| {
        let at = |k: usize| a[k] + (b[k] - a[k]) * t;
        [at(0) / at(3), at(1) / at(3)]
    };
    let ends = [point(from), point(to)];
    (from < to && ends.as_flattened().iter().all(|v| v.is_finite())).then_some(ends)
}
