//! The scene that the head of `gl_peer.c` states, made of our own parts.

use glam::{DMat4, DVec3};
use specula::geometry::{Mesh, shapes};
use specula::scene::{
    Camera, Light, LightKind, Material, Object, Projection, ReflectionModel, Scene,
};
use std::f64::consts::TAU;
use std::io::{Error, ErrorKind};
use std::path::Path;
use std::sync::Arc;

/// Specular exponent of all comparisons, the peers' own default.
const SHININESS: f64 = 50.0;

/// Why triangles are not seen.
#[derive(Clone, Copy, Debug)]
pub(super) enum Unseen {
    OffScreen,
    FacingAway,
}

/// A mesh about which the peers' cameras and lights are arranged.
#[derive(Debug)]
pub(super) struct Model {
    mesh: Arc<Mesh>,
    /// What there is besides, and cannot be seen.
    unseen: Vec<Object>,
    /// The middle of its bounding box.
    center: DVec3,
    /// Largest distance of a vertex from there.
    radius: f64,
}

impl Model {
    /// Reads what `make_mesh.py` writes: counts of vertices and triangles, positions and normals in turn, indices; all
    /// little endian, 32 bits each.
    pub(super) fn load(path: &Path) -> Result<Self, Error> {
        let bytes = std::fs::read(path)
            .map_err(|error| Error::new(error.kind(), format!("{}: {error}", path.display())))?;
        let (words, _) = bytes.as_chunks::<4>();
        let bad = |what: &str| {
            Error::new(
                ErrorKind::InvalidData,
                format!("{}: {what}", path.display()),
            )
        };
        let [vertices, triangles, data @ ..] = words else {
            return Err(bad("too short"));
        };
        let [vertices, triangles] = [vertices, triangles].map(|n| u32::from_le_bytes(*n) as usize);
        if data.len() != 6 * vertices + 3 * triangles {
            return Err(bad("not as long as it says"));
        }
        let (floats, indices) = data.split_at(6 * vertices);
        let vector = |v: &[[u8; 4]]| {
            DVec3::from_array([v[0], v[1], v[2]].map(|c| f32::from_le_bytes(c).into()))
        };
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        for vertex in floats.chunks_exact(6) {
            positions.push(vector(&vertex[..3]));
            normals.push(vector(&vertex[3..]));
        }
        let index = |t: &[[u8; 4]]| [t[0], t[1], t[2]].map(u32::from_le_bytes);
        let triangles = indices.chunks_exact(3).map(index).collect();
        let mesh =
            Mesh::new(positions, normals, triangles).map_err(|error| bad(&error.to_string()))?;
        Ok(Self::new(mesh))
    }

    /// Our own teapot of 896 triangles, for a test without the peers.
    pub(super) fn teapot() -> Self {
        Self::new(shapes::teapot(4, false))
    }

    fn new(mesh: Mesh) -> Self {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &p in &mesh.positions {
            (low, high) = (low.min(p), high.max(p));
        }
        let center = (low + high) * 0.5;
        let radius = mesh
            .positions
            .iter()
            .map(|p| p.distance(center))
            .fold(0.0, f64::max);
        Self {
            mesh: Arc::new(mesh),
            unseen: Vec::new(),
            center,
            radius,
        }
    }

    /// The same with `times` as many triangles more that no view sees.
    pub(super) fn with_unseen(&self, unseen: Unseen, times: usize) -> Self {
        let object = |mesh, offset: DVec3, turn| Object {
            mesh,
            material: 0,
            author_from_mesh: DMat4::from_translation(offset) * turn,
        };
        let objects = match unseen {
            // Far below: cameras look down, but not so steeply.
            Unseen::OffScreen => (0..times)
                .map(|i| DVec3::new(0.0, 0.0, -self.radius * (12.0 + 3.0 * i as f64)))
                .map(|offset| object(Arc::clone(&self.mesh), offset, DMat4::IDENTITY))
                .collect(),
            // A floor through the model that faces down, while cameras are above it.
            Unseen::FacingAway => {
                let quads = self.mesh.triangles.len() * times / 2;
                let columns = (quads as f64).sqrt().ceil() as u32;
                let floor = shapes::plane(self.radius, self.radius, columns, columns);
                vec![object(
                    Arc::new(floor),
                    self.center,
                    DMat4::from_rotation_x(std::f64::consts::PI),
                )]
            }
        };
        Self {
            mesh: Arc::clone(&self.mesh),
            unseen: objects,
            ..*self
        }
    }

    /// The scene under `count` lights.
    pub(super) fn scene(&self, count: usize) -> Scene {
        let material = Material {
            ambient: [1.0; 3],
            diffuse: [0.6, 0.3, 0.2],
            specular: [0.8; 3],
            shininess: SHININESS,
            model: ReflectionModel::Phong,
            two_sided: false,
        };
        let object = Object {
            mesh: Arc::clone(&self.mesh),
            material: 0,
            author_from_mesh: DMat4::IDENTITY,
        };
        let objects = std::iter::once(object).chain(self.unseen.iter().cloned());
        let mut scene = Scene::new(vec![material], objects.collect());
        scene.set_ambient([0.1; 3]);
        scene.set_background([0.0; 3]);
        scene.set_lights((0..count).map(|i| self.light(i, count)).collect());
        scene
    }

    fn light(&self, index: usize, count: usize) -> Light {
        let elevation: f64 = if index % 2 == 1 { 60.0 } else { 30.0 };
        let direction = direction(
            TAU * (index as f64 + 0.5) / count as f64,
            elevation.to_radians(),
        );
        Light {
            kind: LightKind::Point {
                position: self.center + 2.5 * self.radius * direction,
            },
            radiance: [(2.0 / count as f64).min(1.0); 3],
        }
    }

    /// View `k` of `views` of an image of that size.
    pub(super) fn camera(&self, k: u32, views: u32, [width, height]: [u32; 2]) -> Camera {
        let turn = TAU * f64::from(k) / f64::from(views);
        let elevation = (25.0 + 15.0 * (3.0 * turn).sin()).to_radians();
        let distance = self.radius * if width == height { 3.0 } else { 2.4 };
        Camera {
            position: self.center + distance * direction(turn, elevation),
            target: self.center,
            up: DVec3::Z,
            projection: Projection::Perspective { fov_degrees: 40.0 },
            near: Some(distance - 1.05 * self.radius),
            far: Some(distance + 1.05 * self.radius),
        }
    }
}

/// The unit vector at an azimuth and an elevation in radians, z up.
fn direction(azimuth: f64, elevation: f64) -> DVec3 {
    DVec3::new(
        elevation.cos() * azimuth.cos(),
        elevation.cos() * azimuth.sin(),
        elevation.sin(),
    )
}
