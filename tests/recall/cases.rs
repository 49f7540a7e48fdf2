//! Triangles, lights and eyes at random, most of them nasty.

use glam::DVec3;
use specula::highlight::{TriangleBound, TriangleLights, masks_of};
use specula::illumination::reference::{towards_viewer, vector};
use specula::output::Encoding;
use specula::scene::{Eye, ReflectionModel, ShadingLight, ShadingMaterial, World};

/// The generator `splitmix64`.
pub(crate) struct Random(u64);

impl Random {
    /// Different for different seeds from the first number on.
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0xd134_2543_de82_ef95))
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    fn once_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    /// Logarithmically even.
    pub(crate) fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo * (hi / lo).powf(self.unit())
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::from_array(std::array::from_fn(|_| 2.0 * self.unit() - 1.0));
            if (0.01..=1.0).contains(&v.length()) {
                return v.normalize();
            }
        }
    }

    fn rgb(&mut self) -> [f32; 3] {
        std::array::from_fn(|_| self.unit() as f32)
    }

    pub(crate) fn weights(&mut self) -> [f64; 3] {
        let w: [f64; 3] = std::array::from_fn(|_| -self.unit().max(1e-9).ln());
        let sum: f64 = w.iter().sum();
        w.map(|w| w / sum)
    }
}

/// A triangle, and all that illuminates it.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) positions: [[f32; 3]; 3],
    pub(crate) normals: [[f32; 3]; 3],
    pub(crate) eye: Eye,
    pub(crate) material: ShadingMaterial,
    pub(crate) lights: Vec<ShadingLight>,
}

impl Case {
    /// A triangle of a world under all of its lights.
    pub(crate) fn of_triangle(world: &World, eye: Eye, triangle: usize) -> Self {
        let corners = world.triangles[triangle].map(|v| v as usize);
        let material = usize::from(world.triangle_material[triangle]);
        Self {
            positions: corners.map(|v| world.positions.get(v)),
            normals: corners.map(|v| world.normals.get(v)),
            eye,
            material: world.materials[material],
            lights: world.lights.clone(),
        }
    }

    pub(crate) fn bounds(&self) -> TriangleBound {
        TriangleBound::new(self.positions, self.normals, &self.eye, &self.material)
    }

    pub(crate) fn masks(&self, encoding: Encoding) -> TriangleLights {
        masks_of(
            self.positions,
            self.normals,
            &self.eye,
            encoding,
            &self.material,
            &self.lights,
        )
    }
}

/// What is nasty about a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Nothing but chance.
    Any,
    /// The light is where it reflects towards the eye at some point of the triangle.
    Mirrored,
    /// The same from a triangle as fine as meshes are.
    Fine,
    /// The light sets on the triangle: it is in the plane of some normal, or near to it.
    Horizon,
    /// The light is near the triangle's plane, on either side.
    InPlane,
    /// The light is at a corner, on the triangle, or inside its bounding sphere.
    LightInside,
    /// The eye is.
    EyeInside,
    /// Normals are more than 90 degrees apart.
    Wild,
    /// Normals are zero or opposite at some corners.
    NoNormal,
    /// Corners coincide or lie on a line.
    Flat,
    /// The light is opposite to the eye, or in the same direction.
    Opposite,
}

impl Kind {
    pub(crate) const COUNT: usize = 11;
    pub(crate) const ALL: [Self; Self::COUNT] = [
        Self::Any,
        Self::Mirrored,
        Self::Fine,
        Self::Horizon,
        Self::InPlane,
        Self::LightInside,
        Self::EyeInside,
        Self::Wild,
        Self::NoNormal,
        Self::Flat,
        Self::Opposite,
    ];
}

pub(crate) fn single(v: DVec3) -> [f32; 3] {
    v.to_array().map(|c| c as f32)
}

/// The point or direction with such barycentric coordinates.
pub(crate) fn blend(corners: &[[f32; 3]; 3], w: [f64; 3]) -> DVec3 {
    corners.iter().zip(w).map(|(&c, w)| vector(c) * w).sum()
}

/// A triangle with one light. Of either side: what a two-sided material shows from behind is a triangle with opposite normals.
pub(crate) fn random_case(random: &mut Random, kind: Kind) -> Case {
    let size = if kind == Kind::Fine {
        random.between(1e-4, 0.1)
    } else {
        random.between(1e-4, 1e3)
    };
    // Meshes are curved in proportion to their size.
    let curve = match kind {
        Kind::Fine => size * random.between(0.1, 3.0),
        _ if random.once_in(4) => 0.0,
        _ => random.between(1e-4, 1.5),
    };
    let center = random.direction() * random.between(1e-3, 10.0);
    let main = random.direction();
    let positions = positions(random, kind, center, size, main);
    let normals = normals(random, kind, main, curve);
    let eye = eye(random, kind, &positions, main, size);
    let material = material(random);
    let light = light(random, kind, &positions, &normals, &eye, size);
    Case {
        positions,
        normals,
        eye,
        material,
        lights: vec![light],
    }
}

fn positions(
    random: &mut Random,
    kind: Kind,
    center: DVec3,
    size: f64,
    main: DVec3,
) -> [[f32; 3]; 3] {
    let along = main.any_orthonormal_vector();
    let across = main.cross(along);
    // Mostly with a normal that is about the vertices', as meshes have it.
    let is_level = !random.once_in(4);
    let mut corners = [DVec3::ZERO; 3].map(|_| {
        let d = random.direction();
        let d = if is_level {
            along * d.x + across * d.y + main * (0.1 * d.z)
        } else {
            d
        };
        center + d * size
    });
    if kind == Kind::Flat {
        corners[2] = match random.below(3) {
            0 => corners[0],
            1 => corners[0].lerp(corners[1], random.unit()),
            _ => corners[0] + random.direction() * size * random.between(1e-8, 1e-3),
        };
    }
    corners.map(single)
}

fn normals(random: &mut Random, kind: Kind, main: DVec3, curve: f64) -> [[f32; 3]; 3] {
    let mut normals =
        [DVec3::ZERO; 3].map(|_| (main + random.direction() * curve).normalize_or_zero());
    match kind {
        Kind::Wild => normals = normals.map(|_| random.direction()),
        Kind::NoNormal => {
            for normal in normals.iter_mut().take(1 + random.below(3)) {
                *normal = [DVec3::ZERO, -*normal, -main][random.below(3)];
            }
            normals.rotate_left(random.below(3));
        }
        _ => {}
    }
    if random.once_in(8) {
        // Of any length, as after a subdivision.
        normals = normals.map(|n| n * random.between(0.2, 3.0));
    }
    normals.map(single)
}

/// A point on the triangle, at a corner of it, or nearer to it than it is large.
fn near(random: &mut Random, positions: &[[f32; 3]; 3], size: f64) -> DVec3 {
    let inside = blend(positions, random.weights());
    match random.below(4) {
        0 => vector(positions[random.below(3)]),
        1 => inside,
        _ => inside + random.direction() * size * random.between(1e-4, 1.0),
    }
}

fn eye(random: &mut Random, kind: Kind, positions: &[[f32; 3]; 3], main: DVec3, size: f64) -> Eye {
    if kind == Kind::EyeInside {
        return Eye::Point(single(near(random, positions, size)));
    }
    let mut direction = random.direction();
    if direction.dot(main) < 0.0 && !random.once_in(6) {
        direction = -direction;
    }
    if random.once_in(4) {
        return Eye::Direction(single(direction));
    }
    let from = blend(positions, [1.0 / 3.0; 3]);
    Eye::Point(single(from + direction * size * random.between(0.3, 1e4)))
}

fn material(random: &mut Random) -> ShadingMaterial {
    let dark = random.unit() as f32;
    ShadingMaterial {
        ambient: random.rgb().map(|c| c * 0.1 * dark),
        diffuse: random.rgb(),
        specular: random.rgb(),
        shininess: match random.below(16) {
            0 => 0.0,
            1 => random.unit() as f32,
            2 => [1.0, 2.0][random.below(2)],
            _ => random.between(1.0, 1e5) as f32,
        },
        model: [ReflectionModel::Phong, ReflectionModel::BlinnPhong][random.below(2)],
    }
}

fn light(
    random: &mut Random,
    kind: Kind,
    positions: &[[f32; 3]; 3],
    normals: &[[f32; 3]; 3],
    eye: &Eye,
    size: f64,
) -> ShadingLight {
    let w = random.weights();
    let (point, normal) = (
        blend(positions, w),
        blend(normals, w).normalize_or(DVec3::Z),
    );
    let to_viewer = towards_viewer(point, eye).normalize_or(normal);
    let mirrored = 2.0 * normal.dot(to_viewer) * normal - to_viewer;
    let off = |random: &mut Random, from: DVec3, least: f64| {
        let away = if random.once_in(3) {
            0.0
        } else {
            random.between(least, 1.0)
        };
        (from + random.direction() * away).normalize_or(from)
    };
    let direction = match kind {
        Kind::Any => random.direction(),
        Kind::Horizon => {
            let level = random.direction().cross(normal).normalize_or(mirrored);
            off(random, level, 1e-7)
        }
        Kind::InPlane => {
            let [a, b, c] = positions.map(vector);
            let up = (b - a).cross(c - a).normalize_or(normal);
            let level = random.direction().cross(up).normalize_or(mirrored);
            off(random, level, 1e-7)
        }
        Kind::Opposite => {
            let main = if random.once_in(3) {
                to_viewer
            } else {
                -to_viewer
            };
            off(random, main, 1e-6)
        }
        _ => off(random, mirrored, 1e-3),
    };
    let is_point = kind == Kind::LightInside || !random.once_in(3);
    let at = if kind == Kind::LightInside {
        near(random, positions, size)
    } else {
        point + direction * size * random.between(0.01, 1e5)
    };
    let brightness = random.between(0.1, 10.0) as f32;
    ShadingLight {
        vector: single(if is_point { at } else { direction }),
        is_point,
        radiance: random.rgb().map(|c| c * brightness),
    }
}
