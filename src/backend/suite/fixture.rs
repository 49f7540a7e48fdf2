//! Worlds by hand, images by a backend, and the raster rules one pixel at a time.

use crate::backend::{Backend, BasePaint, Capabilities, Geometry};
use crate::geometry::Vec3s;
use crate::geometry::screen::{
    EdgeFunction, PixelBox, TrianglePlanes, clip, doubled_area, normalized_weights, snap,
};
use crate::output::{Encoding, Frame};
use crate::parallel::Exec;
use crate::scene::{Eye, ReflectionModel, ShadingLight, ShadingMaterial, View, World};
use crate::simd::{Level, SimdLevel};
use glam::{DMat4, DVec4};
use std::ops::Range;

/// Nothing drawn has this colour.
pub(super) const BACKGROUND: [f32; 3] = [0.9, 0.0, 0.9];

/// What checks need.
pub(super) struct Fixture<'a> {
    make: &'a dyn Fn() -> Box<dyn Backend>,
    pub(super) capabilities: Capabilities,
    pub(super) exec: Exec,
    /// How images store light.
    pub(super) encoding: Encoding,
}

impl<'a> Fixture<'a> {
    pub(super) fn new(make: &'a dyn Fn() -> Box<dyn Backend>, encoding: Encoding) -> Self {
        let level = SimdLevel::detect().token().unwrap_or(Level::new());
        Self {
            make,
            capabilities: make().capabilities(),
            exec: Exec { level, threads: 1 },
            encoding,
        }
    }

    pub(super) fn backend(&self) -> Box<dyn Backend> {
        (self.make)()
    }

    /// An empty world in which coordinates are pixels and reversed depth.
    pub(super) fn flat(&self, width: u32, height: u32) -> Picture {
        self.encoded(Picture::flat(width, height))
    }

    /// An empty world seen from the origin along +z, y down; near plane at 0.5, far plane at 100.
    pub(super) fn perspective(&self, width: u32, height: u32) -> Picture {
        self.encoded(Picture::perspective(width, height))
    }

    fn encoded(&self, picture: Picture) -> Picture {
        Picture {
            view: picture.view.with_encoding(self.encoding),
            ..picture
        }
    }

    /// What a new backend shows of a picture.
    pub(super) fn image(&self, picture: &Picture, paint: BasePaint<'_>) -> Frame {
        draw(&mut *self.backend(), self.exec, picture, paint)
    }
}

/// All steps of an image.
pub(super) fn draw(
    backend: &mut dyn Backend,
    exec: Exec,
    picture: &Picture,
    paint: BasePaint<'_>,
) -> Frame {
    let geometry = picture.geometry();
    backend.rasterize(exec, geometry);
    backend.resolve(exec, geometry, paint);
    let mut frame = Frame::new(picture.view.width, picture.view.height);
    frame.write(|target| backend.present(exec, target));
    frame
}

/// A world from somewhere.
pub(super) struct Picture {
    pub(super) world: World,
    pub(super) view: View,
    pub(super) visible: Vec<Range<u32>>,
}

impl Picture {
    /// An empty world in which coordinates are pixels and reversed depth.
    pub(super) fn flat(width: u32, height: u32) -> Self {
        let view = View {
            width,
            height,
            pixel_from_world: DMat4::IDENTITY,
            eye: Eye::Direction([0.0, 0.0, 1.0]),
            encoding: Encoding::default(),
        };
        Self::new(view)
    }

    /// An empty world seen from the origin along +z, y down; near plane at 0.5, far plane at 100.
    pub(super) fn perspective(width: u32, height: u32) -> Self {
        let (near, far) = (0.5, 100.0);
        let zoom = f64::from(width.max(height)) * 0.7;
        let center = [width, height].map(|size| f64::from(size) * 0.5);
        let view = View {
            width,
            height,
            pixel_from_world: DMat4::from_cols(
                DVec4::new(zoom, 0.0, 0.0, 0.0),
                DVec4::new(0.0, zoom, 0.0, 0.0),
                DVec4::new(center[0], center[1], -near / (far - near), 1.0),
                DVec4::new(0.0, 0.0, near * far / (far - near), 0.0),
            ),
            eye: Eye::Point([0.0; 3]),
            encoding: Encoding::default(),
        };
        Self::new(view)
    }

    fn new(view: View) -> Self {
        let material = ShadingMaterial {
            ambient: [0.05, 0.04, 0.06],
            diffuse: [0.7, 0.5, 0.3],
            specular: [0.6; 3],
            shininess: 40.0,
            model: ReflectionModel::Phong,
        };
        let light = |vector, is_point| ShadingLight {
            vector,
            is_point,
            radiance: [0.5, 0.45, 0.4],
        };
        Self {
            world: World {
                materials: vec![material],
                lights: vec![
                    light([30.0, 40.0, -50.0], true),
                    light([0.6, 0.0, -0.8], false),
                ],
                background: BACKGROUND,
                ..World::default()
            },
            view,
            visible: Vec::new(),
        }
    }

    /// Adds a triangle with vertices of its own, normals towards the viewer.
    pub(super) fn add(&mut self, corners: [[f32; 3]; 3]) {
        let first = self.world.positions.len() as u32;
        for corner in corners {
            self.add_vertex(corner);
        }
        self.add_indexed([first, first + 1, first + 2]);
    }

    /// The same, turned round if the viewer would see its back.
    pub(super) fn add_facing(&mut self, [a, b, c]: [[f32; 3]; 3]) {
        if self.shows_back([a, b, c]) {
            self.add([a, c, b]);
        } else {
            self.add([a, b, c]);
        }
    }

    pub(super) fn add_vertex(&mut self, position: [f32; 3]) {
        self.world.positions.push(position);
        self.world.normals.push([0.1, 0.0, -1.0]);
        self.world.vertex_material.push(0);
    }

    /// Adds a triangle of vertices that are there, turned round if the viewer would see its back.
    pub(super) fn add_indexed_facing(&mut self, [a, b, c]: [u32; 3]) {
        let corners = [a, b, c].map(|v| self.world.positions.get(v as usize));
        if self.shows_back(corners) {
            self.add_indexed([a, c, b]);
        } else {
            self.add_indexed([a, b, c]);
        }
    }

    fn shows_back(&self, corners: [[f32; 3]; 3]) -> bool {
        TrianglePlanes::new(corners.map(|p| self.view.project(p))).facing() < 0.0
    }

    fn add_indexed(&mut self, corners: [u32; 3]) {
        self.world.triangles.push(corners);
        self.world.triangle_material.push(0);
        self.visible = std::iter::once(0..self.world.triangles.len() as u32).collect();
    }

    /// The codes of a linear colour.
    pub(super) fn codes(&self, linear: [f32; 3]) -> [f64; 3] {
        linear.map(|c| self.view.encoding.encode(f64::from(c)))
    }

    pub(super) fn geometry(&self) -> Geometry<'_> {
        Geometry {
            world: &self.world,
            view: &self.view,
            visible: &self.visible,
        }
    }

    pub(super) fn triangles(&self) -> u32 {
        self.world.triangles.len() as u32
    }

    /// Weights of a triangle's corners at the centre of a pixel, in perspective and on the screen.
    pub(super) fn weights(&self, triangle: u32, x: i32, y: i32) -> [[f64; 3]; 2] {
        let corners = self.world.triangles[triangle as usize]
            .map(|v| self.view.project(self.world.positions.get(v as usize)));
        let perspective = normalized_weights(TrianglePlanes::new(corners).edges_at_pixel(x, y));
        // b_i w_i, normalized: how far the pixel is from the projected corners.
        let scaled = std::array::from_fn(|i| perspective[i] * corners[i][3]);
        [perspective, normalized_weights(scaled)]
    }

    /// Who owns each pixel, by the raster rules.
    pub(super) fn owners(&self) -> Owners {
        let (width, height) = (self.view.width, self.view.height);
        let size = width as usize * height as usize;
        let mut owners = Owners {
            width: width as usize,
            ids: vec![None; size],
        };
        let mut depths = vec![f32::NEG_INFINITY; size];
        for id in self.visible.iter().cloned().flatten() {
            self.cover(id, |at, depth| {
                if depth > depths[at] {
                    (depths[at], owners.ids[at]) = (depth, Some(id));
                }
            });
        }
        owners
    }

    /// Calls `found` with the place and depth of each pixel that a triangle covers.
    fn cover(&self, id: u32, mut found: impl FnMut(usize, f32)) {
        let (width, height) = (self.view.width, self.view.height);
        let corners = self.world.triangles[id as usize]
            .map(|v| self.view.project(self.world.positions.get(v as usize)));
        let polygon: Vec<_> = clip(corners).vertices().iter().map(|&v| snap(v)).collect();
        let fan: Vec<_> = (2..polygon.len())
            .map(|i| [polygon[0], polygon[i - 1], polygon[i]])
            .collect();
        let turned = fan.iter().map(|&t| doubled_area(t)).sum::<i64>() < 0;
        let Some(bounds) = PixelBox::of_snapped(&polygon, width, height) else {
            return;
        };
        if turned {
            return;
        }
        let mut depth = TrianglePlanes::new(corners).depth([bounds.x0, bounds.y0]);
        if self.world.backs.contains(&id) {
            depth = depth.moved_back();
        }
        for [a, b, c] in fan {
            let edges = [(a, b), (b, c), (c, a)].map(|(p, q)| EdgeFunction::new(p, q));
            for y in bounds.y0..=bounds.y1 {
                for x in bounds.x0..=bounds.x1 {
                    if doubled_area([a, b, c]) > 0 && edges.iter().all(|e| e.at_pixel(x, y) >= 0) {
                        found(
                            y as usize * width as usize + x as usize,
                            depth.at_pixel(x, y),
                        );
                    }
                }
            }
        }
    }
}

/// Who owns each pixel.
pub(super) struct Owners {
    width: usize,
    pub(super) ids: Vec<Option<u32>>,
}

impl Owners {
    /// Pixels with their owners; without those next to a pixel of another owner, unless `with_edges`.
    pub(super) fn pixels(
        &self,
        with_edges: bool,
    ) -> impl Iterator<Item = (usize, [i32; 2], Option<u32>)> {
        let width = self.width as i32;
        let height = (self.ids.len() / self.width.max(1)) as i32;
        let is_inside = move |x: i32, y: i32| {
            let id = self.ids[(y * width + x) as usize];
            (-1..=1).all(|dy| {
                (-1..=1).all(|dx| {
                    let (x, y) = (x + dx, y + dy);
                    let is_beyond = x < 0 || y < 0 || x >= width || y >= height;
                    is_beyond || self.ids[(y * width + x) as usize] == id
                })
            })
        };
        self.ids.iter().enumerate().filter_map(move |(at, &id)| {
            let (x, y) = (at as i32 % width, at as i32 / width);
            (with_edges || is_inside(x, y)).then_some((at, [x, y], id))
        })
    }
}

/// The generator `splitmix64`.
pub(super) struct Random(pub(super) u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(super) fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    pub(super) fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * ((self.bits() >> 40) as f32 / (1 << 24) as f32)
    }

    pub(super) fn rgb(&mut self) -> [f32; 3] {
        [0; 3].map(|_| self.range(0.0, 1.0))
    }

    /// So many random colours.
    pub(super) fn colours(&mut self, count: usize) -> Vec3s {
        let mut colours = Vec3s::default();
        for _ in 0..count {
            colours.push(self.rgb());
        }
        colours
    }
}

/// Fails unless a pixel is opaque and within `tolerance` codes of what is expected.
pub(super) fn assert_near(pixel: [u8; 4], codes: [f64; 3], tolerance: f64, what: &str) {
    let [r, g, b, a] = pixel;
    let is_near = [r, g, b]
        .into_iter()
        .zip(codes)
        .all(|(got, want)| (f64::from(got) - want).abs() <= tolerance + 0.5);
    assert!(
        a == 255 && is_near,
        "{what}: {pixel:?} instead of codes {codes:?} (tolerance {tolerance})"
    );
}
