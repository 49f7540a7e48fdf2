//! What there is to draw: a teapot of small triangles, and grids of triangles of one area.
//!
//! **Grids.** Cells of `2h` by `h` pixels are cut along a diagonal that meets no pixel's centre, so each half owns exactly as
//! many pixels as its area says, `h^2`. The grid begins outside of the image, in the middle of blocks and tiles, as triangles
//! of a scene do.

use glam::DMat4;
use specula::backend::software::SoftwareBackend;
use specula::backend::{Backend, Geometry, RasterCounts};
use specula::geometry::Vec3s;
use specula::illumination::VertexSet;
use specula::output::Encoding;
use specula::parallel::Exec;
use specula::scene::{Eye, ReflectionModel, Scene, ShadingLight, ShadingMaterial, View, World};
use std::ops::Range;

/// Size of most images.
pub(crate) const SIZE: (u32, u32) = (1920, 1080);
/// Pixels of those.
pub(crate) const PIXELS: u64 = SIZE.0 as u64 * SIZE.1 as u64;

/// No triangle has this colour.
const BACKGROUND: [f32; 3] = [1.0, 0.0, 1.0];
/// The same in an image.
pub(crate) const BACKGROUND_BYTES: [u8; 4] = [255, 0, 255, 255];

/// Triangles of the teapot.
pub(crate) const TEAPOT_TRIANGLES: usize = 57_344;

/// Something to draw, all of it.
pub(crate) struct Subject {
    pub(crate) world: World,
    pub(crate) view: View,
    /// The ids of its triangles.
    pub(crate) all: Range<u32>,
}

impl Subject {
    fn new(world: World, view: View) -> Self {
        let all = 0..world.triangles.len() as u32;
        Self { world, view, all }
    }

    /// A finely tessellated teapot that fills most of the image's height.
    pub(crate) fn teapot((width, height): (u32, u32)) -> Self {
        let text = r#"(
            camera: Perspective(position: (3.2, -11, 6), target: (0.35, 0, 1.42), fov_degrees: 23),
            materials: { "m": (diffuse: (0.6, 0.3, 0.2), specular: 0.5, shininess: 50) },
            objects: [(shape: Teapot(tessellation: 32, bottom: false), material: "m")],
        )"#;
        let scene = Scene::parse(text, "bench").expect("a valid scene");
        let world = World::new(&scene);
        assert_eq!(world.triangles.len(), TEAPOT_TRIANGLES, "teapot");
        let view = world.view(scene.camera(), width, height);
        Self::new(world, view)
    }

    /// Triangles of `area` pixels that cover the image once for each of `depths`, one layer after the other.
    pub(crate) fn grid(area: u32, depths: &[f32]) -> Self {
        let mut world = World {
            materials: vec![ShadingMaterial {
                ambient: [0.01; 3],
                diffuse: [0.5, 0.4, 0.3],
                specular: [0.4; 3],
                shininess: 20.0,
                model: ReflectionModel::Phong,
            }],
            background: BACKGROUND,
            ..World::default()
        };
        for &depth in depths {
            add_layer(&mut world, area, depth);
        }
        world.vertex_material = vec![0; world.positions.len()];
        world.triangle_material = vec![0; world.triangles.len()];
        // World coordinates are pixels and reversed depth.
        let view = View {
            width: SIZE.0,
            height: SIZE.1,
            pixel_from_world: DMat4::IDENTITY,
            eye: Eye::Direction([0.0, 0.0, 1.0]),
            encoding: Encoding::default(),
        };
        Self::new(world, view)
    }

    /// One layer, with lights in front of the middle of the image.
    pub(crate) fn lit_grid(area: u32, lights: usize) -> Self {
        let [x, y] = [SIZE.0, SIZE.1].map(|side| side as f32 / 2.0);
        Self::grid(area, &[0.5]).with_lights(lights, [x, y, 0.0], 600.0)
    }

    /// With point lights around an axis through `center` that points to +z.
    pub(crate) fn with_lights(mut self, count: usize, center: [f32; 3], distance: f32) -> Self {
        let light = |i: usize| {
            let (sin, cos) = (i as f32 * 2.4).sin_cos();
            let offset = [cos, sin, 1.0].map(|v| v * distance);
            ShadingLight {
                vector: std::array::from_fn(|axis| center[axis] + offset[axis]),
                is_point: true,
                radiance: [1.0 / count as f32; 3],
            }
        };
        self.world.lights = (0..count).map(light).collect();
        self
    }

    pub(crate) fn geometry(&self) -> Geometry<'_> {
        Geometry {
            world: &self.world,
            view: &self.view,
            visible: std::slice::from_ref(&self.all),
        }
    }

    /// The same without anything in it.
    pub(crate) fn nothing(&self) -> Geometry<'_> {
        Geometry {
            visible: &[],
            ..self.geometry()
        }
    }

    pub(crate) fn rasterized(&self, exec: Exec) -> (SoftwareBackend, RasterCounts) {
        let mut backend = SoftwareBackend::new();
        let counts = backend.rasterize(exec, self.geometry());
        (backend, counts)
    }

    /// Colours of all vertices.
    pub(crate) fn colours(&self, exec: Exec) -> Vec3s {
        let mut colours = Vec3s::default();
        let all: Vec<u32> = self.all.clone().collect();
        VertexSet::default().illuminate(exec, &self.world, self.view.eye, &all, &mut colours);
        colours
    }

    /// Fails unless a grid's triangles have `area` pixels each, and those in `front` cover the image once.
    pub(crate) fn assert_covers(
        &self,
        backend: &SoftwareBackend,
        counts: RasterCounts,
        area: u32,
        front: Range<u32>,
    ) {
        assert_eq!((counts.back_facing, counts.clipped), (0, 0), "{area} px");
        assert_eq!(counts.covered_pixels, PIXELS, "{area} px");
        let mut owned = 0;
        for &id in backend.visible_triangles() {
            assert!(front.contains(&id), "{area} px: {id} is seen");
            owned += u64::from(backend.visible_pixels(id));
        }
        assert_eq!(owned, PIXELS, "{area} px: each pixel once");
        for id in front {
            let corners = self.world.triangles[id as usize];
            let is_inside = corners
                .map(|v| self.world.positions.get(v as usize))
                .iter()
                .all(|p| {
                    p[0] >= 0.0 && p[1] >= 0.0 && p[0] <= SIZE.0 as f32 && p[1] <= SIZE.1 as f32
                });
            if is_inside {
                assert_eq!(backend.visible_pixels(id), area, "pixels of triangle {id}");
            }
        }
    }
}

/// Adds triangles of `area` pixels, a square number, that cover the image once.
fn add_layer(world: &mut World, area: u32, depth: f32) {
    let height = area.isqrt();
    assert_eq!(height * height, area, "area");
    let width = 2 * height;
    let [left, top] = [3, 1];
    let columns = (SIZE.0 + left).div_ceil(width);
    let rows = (SIZE.1 + top).div_ceil(height);
    let first = world.positions.len() as u32;
    for row in 0..=rows {
        for column in 0..=columns {
            let x = (column * width) as f32 - left as f32;
            let y = (row * height) as f32 - top as f32;
            world
                .positions
                .push([x, y, depth + 0.1 * x / SIZE.0 as f32]);
            // Bumps of some hundred pixels.
            let [u, v] = [0.4 * (x / 90.0).sin(), 0.4 * (y / 70.0).sin()];
            let length = (1.0 + u * u + v * v).sqrt();
            world.normals.push([u, v, 1.0].map(|n| n / length));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = first + row * (columns + 1) + column;
            let below = a + columns + 1;
            world.triangles.push([a, below, a + 1]);
            world.triangles.push([a + 1, below, below + 1]);
        }
    }
}
