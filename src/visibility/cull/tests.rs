use super::*;
use crate::geometry::screen::{PixelBox, clip, doubled_area, snap};
use crate::geometry::{Mesh, Vec3s, build_clusters, shapes};
use crate::scene::Eye;
use glam::{DMat4, DVec3, DVec4};
use proptest::prelude::*;

mod costs;
mod reference;

/// A mesh as the culler sees it.
struct Model {
    positions: Vec3s,
    triangles: Vec<[u32; 3]>,
    clusters: Vec<Cluster>,
}

impl Model {
    fn new(mesh: &Mesh, world_from_mesh: DMat4) -> Self {
        let mut positions = Vec3s::default();
        for p in &mesh.positions {
            positions.push(world_from_mesh.transform_point3(*p).as_vec3().to_array());
        }
        let mut triangles = mesh.triangles.clone();
        let clusters = build_clusters(&positions, &mut triangles, 0);
        Self {
            positions,
            triangles,
            clusters,
        }
    }

    /// The same and its back.
    fn with_back(mut self) -> Self {
        let count = self.triangles.len();
        self.triangles.extend_from_within(..);
        self.triangles[count..]
            .iter_mut()
            .for_each(|triangle| triangle.swap(1, 2));
        let backs: Vec<_> = self
            .clusters
            .iter()
            .map(|cluster| cluster.turned(count as u32))
            .collect();
        self.clusters.extend(backs);
        self
    }

    fn culler(&self) -> Culler {
        Culler::new(&self.clusters)
    }

    /// Whether a part of the triangle, as clipped and snapped, may have a pixel.
    fn is_visible(&self, view: &View, triangle: usize) -> bool {
        let corners =
            self.triangles[triangle].map(|v| view.project(self.positions.get(v as usize)));
        let polygon = clip(corners);
        let snapped: Vec<_> = polygon.vertices().iter().map(|&p| snap(p)).collect();
        (2..snapped.len()).any(|i| {
            let fan = [snapped[0], snapped[i - 1], snapped[i]];
            let area = doubled_area(fan);
            area > 0 && PixelBox::of_snapped(&fan, view.width, view.height).is_some()
        })
    }
}

/// A camera at `eye` that looks at `target`, x to the right and y down, reversed depth.
#[derive(Clone, Copy, Debug)]
struct Camera {
    eye: DVec3,
    target: DVec3,
    width: u32,
    height: u32,
    /// Pixels per unit at distance 1, or everywhere if parallel.
    scale: f64,
    near: f64,
    far: f64,
    parallel: bool,
}

impl Camera {
    fn view(&self) -> View {
        let forward = (self.target - self.eye).normalize_or(DVec3::Y);
        let right = forward.cross(DVec3::Z).normalize_or(DVec3::X);
        let down = forward.cross(right);
        let along = |axis: DVec3| axis.extend(-axis.dot(self.eye));
        let depth = along(forward);
        let (near, far) = (self.near, self.far);
        let w = if self.parallel { DVec4::W } else { depth };
        let z = if self.parallel {
            (DVec4::W * far - depth) / (far - near)
        } else {
            (DVec4::W * far - depth) * near / (far - near)
        };
        let x = along(right) * self.scale + w * (f64::from(self.width) / 2.0);
        let y = along(down) * self.scale + w * (f64::from(self.height) / 2.0);
        View {
            width: self.width,
            height: self.height,
            pixel_from_world: DMat4::from_cols(x, y, z, w).transpose(),
            eye: if self.parallel {
                Eye::Direction((-forward).as_vec3().to_array())
            } else {
                Eye::Point(self.eye.as_vec3().to_array())
            },
            encoding: Default::default(),
        }
    }
}

/// From the side, the whole unit sphere in the image.
const FROM_OUTSIDE: Camera = Camera {
    eye: DVec3::new(0.0, -4.0, 1.0),
    target: DVec3::ZERO,
    width: 400,
    height: 300,
    scale: 400.0,
    near: 1.0,
    far: 10.0,
    parallel: false,
};

/// Checks everything that must hold for any view; returns the counts.
fn check(model: &Model, view: &View) -> CullCounts {
    let mut culler = model.culler();
    let mut ranges = vec![7..9, 2..3];
    let counts = culler.cull(view, &mut ranges);

    let mut kept = vec![false; model.triangles.len()];
    let mut end = None;
    for range in &ranges {
        assert!(range.start < range.end && end.is_none_or(|e| e < range.start));
        end = Some(range.end);
        kept[range.start as usize..range.end as usize].fill(true);
    }
    let visible = |t: usize| model.is_visible(view, t);
    for triangle in (0..kept.len()).filter(|&t| !kept[t]) {
        assert!(!visible(triangle), "{triangle} was dropped: {counts:?}");
    }

    // Sets change nothing but the time.
    assert_eq!(counts, one_by_one(&model.clusters, view));
    assert_eq!(kept.iter().filter(|k| **k).count() as u32, counts.triangles);
    counts
}

/// What testing each cluster by itself gives.
fn one_by_one(clusters: &[Cluster], view: &View) -> CullCounts {
    let planes = reference::frustum(view);
    let facing = reference::Facing::new(&view.pixel_from_world);
    let mut counts = CullCounts {
        clusters: clusters.len() as u32,
        ..CullCounts::default()
    };
    for cluster in clusters {
        if reference::is_outside(&planes, cluster) {
            counts.outside_frustum += 1;
        } else if facing.is_away(cluster) {
            counts.facing_away += 1;
        } else {
            counts.triangles += cluster.triangles.len() as u32;
        }
    }
    counts
}

fn meshes() -> impl Strategy<Value = Mesh> {
    let soup = prop::collection::vec(
        (
            prop::array::uniform3(-1.0..1.0),
            prop::array::uniform3(prop::array::uniform3(-1.0..1.0)),
            -4.0..0.5,
        ),
        1..300,
    )
    .prop_map(|triangles| {
        let mut mesh = Mesh::default();
        for (at, corners, exponent) in triangles {
            let first = mesh.positions.len() as u32;
            for c in corners {
                let offset = DVec3::from(c) * libm::exp10(exponent);
                mesh.positions.push(DVec3::from(at) + offset);
            }
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        mesh
    });
    prop_oneof![
        (3..80_u32, 2..60_u32).prop_map(|(i, j)| shapes::sphere(i, j)),
        (3..60_u32, 3..30_u32).prop_map(|(i, j)| shapes::torus(0.7, 0.3, i, j)),
        (1..8_u32).prop_map(|n| shapes::teapot(n, true)),
        (1..40_u32, 1..40_u32).prop_map(|(i, j)| shapes::plane(2.0, 2.0, i, j)),
        Just(shapes::cuboid(DVec3::ONE)),
        soup,
    ]
}

fn cameras() -> impl Strategy<Value = Camera> {
    let point = || prop::array::uniform3(-1.5_f64..1.5).prop_map(DVec3::from);
    (
        point(),
        // Far away, and as near as inside of things.
        -1.0..2.0,
        point(),
        (1..300_u32, 1..300_u32),
        // From a wide angle to a telephoto lens.
        1.0..4.0,
        (-3.0..0.5, 0.1..3.0),
        any::<bool>(),
    )
        .prop_map(|(eye, away, target, size, scale, (near, far), parallel)| {
            let near = libm::exp10(near);
            Camera {
                eye: eye * libm::exp10(away),
                target,
                width: size.0,
                height: size.1,
                scale: libm::exp10(scale),
                near,
                far: near + libm::exp10(far),
                parallel,
            }
        })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 600, ..ProptestConfig::default() })]

    #[test]
    fn nothing_visible_is_dropped(
        mesh in meshes(),
        stretch in prop::array::uniform3(prop::sample::select(vec![1.0, 0.3, 1e-3, 0.0])),
        camera in cameras(),
        has_back in any::<bool>(),
    ) {
        let model = Model::new(&mesh, DMat4::from_scale(DVec3::from(stretch)));
        let model = if has_back { model.with_back() } else { model };
        check(&model, &camera.view());
    }
}

/// A cluster of a few triangles whose normals are near `axis`: places, tilts, lengths and relative heights are random,
/// from needles to equilateral.
fn bundles() -> impl Strategy<Value = Mesh> {
    let unit = || prop::array::uniform3(-1.0_f64..1.0).prop_map(DVec3::from);
    let height = prop_oneof![-6.0..0.0, -0.5..0.5];
    let triangle = (unit(), unit(), unit(), -2.0..0.0, height, -1.0..2.0);
    (unit(), prop::collection::vec(triangle, 1..4)).prop_map(|(axis, triangles)| {
        let mut mesh = Mesh::default();
        for (at, tilt, along, length, height, skew) in triangles {
            let normal = (axis + 0.3 * axis.length() * tilt).normalize_or(DVec3::X);
            let base = along.cross(normal).normalize_or(DVec3::Y) * libm::exp10(length);
            let apex = base * skew + normal.cross(base) * libm::exp10(height);
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([at, at + base, at + apex]);
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        mesh
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 4000, ..ProptestConfig::default() })]

    /// The facing test where it is close: few triangles, a near eye, a near plane that may cut off a corner by a hair.
    #[test]
    fn nothing_that_faces_the_eye_is_dropped(
        mesh in bundles(),
        camera in cameras(),
        eye in prop::array::uniform3(-3.0_f64..3.0),
        cut in prop::option::of(-7.0..-1.0),
    ) {
        let model = Model::new(&mesh, DMat4::IDENTITY);
        let mut camera = Camera {
            eye: DVec3::from(eye),
            target: DVec3::ZERO,
            width: 4000,
            height: 4000,
            far: 100.0,
            ..camera
        };
        camera.near = 1e-2;
        if let (Some(exponent), false) = (cut, camera.parallel) {
            // Cuts off the nearest corner.
            let view = camera.view();
            let depth = (0..model.positions.len())
                .map(|v| view.project(model.positions.get(v))[3])
                .fold(f64::INFINITY, f64::min);
            camera.near = (depth * (1.0 + libm::exp10(exponent))).max(1e-2);
        }
        check(&model, &camera.view());
    }
}

/// Seen through its narrow end, the inside of a steep funnel shows although its axis points away and passes through the
/// eye: what faces the eye is off the axis.
#[test]
fn the_inside_of_a_funnel_is_kept() {
    let mut mesh = Mesh::default();
    for i in 0..6 {
        let (sin, cos) = libm::sincos(f64::from(i) * std::f64::consts::TAU / 6.0);
        let outwards = DVec3::new(cos, sin, 0.0);
        let normal = (-0.906 * outwards - 0.423 * DVec3::Z).normalize();
        let side = outwards.cross(DVec3::Z) * 0.2;
        let first = mesh.positions.len() as u32;
        for corner in [DVec3::ZERO, side, normal.cross(side)] {
            mesh.positions.push(outwards + corner);
        }
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    let model = Model::new(&mesh, DMat4::IDENTITY);
    let camera = Camera {
        eye: DVec3::Z * 2.0,
        near: 0.1,
        scale: 200.0,
        ..FROM_OUTSIDE
    };
    let view = camera.view();
    assert!((0..6).any(|t| model.is_visible(&view, t)));
    check(&model, &view);
}

#[test]
fn specks_at_the_border_of_the_image_are_kept() {
    // One unit is one pixel; world x and z are pixel x and, upwards, y about the image's middle.
    let camera = Camera {
        eye: DVec3::NEG_Y * 5.0,
        target: DVec3::ZERO,
        width: 20,
        height: 16,
        scale: 1.0,
        parallel: true,
        ..FROM_OUTSIDE
    };
    let view = camera.view();
    let (mut drawn, mut dropped) = (0, 0);
    let upright = DMat4::from_rotation_x(std::f64::consts::FRAC_PI_2);
    for step in 0..200 {
        let outwards = f64::from(step) * 0.03 - 3.0;
        for (side, half) in [
            (DVec3::X, 10.0),
            (DVec3::NEG_X, 10.0),
            (DVec3::Z, 8.0),
            (DVec3::NEG_Z, 8.0),
        ] {
            let at = DMat4::from_translation(side * (half + outwards)) * upright;
            let model = Model::new(&shapes::plane(1.2, 1.2, 1, 1), at);
            let counts = check(&model, &view);
            drawn += u32::from((0..2).any(|t| model.is_visible(&view, t)));
            dropped += counts.outside_frustum;
        }
    }
    assert!(drawn > 200 && dropped > 100, "{drawn} {dropped}");
}

/// Fine meshes seen so small, or so flat, that snapping turns triangles around. Clusters that face away by less than
/// that must stay.
#[test]
fn triangles_that_snapping_turns_around_are_kept() {
    let mut turned = 0;
    for step in 0..60 {
        let distance = 4.0 + 3.0 * f64::from(step);
        for tilt in [0.0, 0.002, 0.02, 0.3] {
            let eye = DVec3::new(distance, 0.1 * distance, -tilt * distance);
            let camera = Camera {
                eye,
                far: 2.0 * distance,
                ..FROM_OUTSIDE
            };
            let view = camera.view();
            for mesh in [shapes::plane(2.0, 2.0, 32, 32), shapes::sphere(48, 48)] {
                let model = Model::new(&mesh, DMat4::IDENTITY);
                check(&model, &view);
                turned += (0..model.triangles.len())
                    .filter(|&t| {
                        let [a, b, c] = model.triangles[t]
                            .map(|v| DVec3::from(model.positions.get(v as usize).map(f64::from)));
                        let faces_away = (b - a).cross(c - a).dot(eye - a) < 0.0;
                        faces_away && model.is_visible(&view, t)
                    })
                    .count();
            }
        }
    }
    assert!(
        turned > 0,
        "the views are not nasty enough to test anything"
    );
}

#[test]
fn what_is_outside_is_dropped() {
    let model = Model::new(&shapes::sphere(192, 96), DMat4::IDENTITY);
    for parallel in [false, true] {
        let at = |eye: DVec3, target: DVec3| Camera {
            eye,
            target,
            parallel,
            scale: 100.0,
            ..FROM_OUTSIDE
        };
        let eye = FROM_OUTSIDE.eye;
        let mut cameras = vec![at(eye, 2.0 * eye)]; // behind
        for side in [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z] {
            let aside = 12.0 * side;
            cameras.push(at(DVec3::NEG_Y * 4.0 + aside, aside));
        }
        cameras.push(at(eye * 10.0, DVec3::ZERO)); // beyond far
        for camera in cameras {
            let counts = check(&model, &camera.view());
            assert_eq!(counts.outside_frustum, counts.clusters, "{camera:?}");
            assert_eq!(counts.triangles, 0);
        }
        // The image's left edge goes through the sphere's middle.
        let aside = DVec3::X * 2.0;
        let camera = Camera {
            scale: if parallel { 100.0 } else { 400.0 },
            ..at(DVec3::NEG_Y * 4.0 + aside, aside)
        };
        let counts = check(&model, &camera.view());
        let share = f64::from(counts.outside_frustum) / f64::from(counts.clusters);
        assert!(share > 0.25 && share <= 0.5, "{share}");
    }
}

#[test]
fn the_far_side_of_a_sphere_is_dropped() {
    let model = Model::new(&shapes::sphere(128, 64), DMat4::IDENTITY);
    for parallel in [false, true] {
        let camera = Camera {
            parallel,
            scale: if parallel { 120.0 } else { 400.0 },
            ..FROM_OUTSIDE
        };
        let counts = check(&model, &camera.view());
        assert_eq!(counts.outside_frustum, 0);
        let share = f64::from(counts.facing_away) / f64::from(counts.clusters);
        // Half of it less the clusters along the silhouette; (1 + 1 / d) / 2 with the eye at a distance of d = 4.1
        // radii.
        let limit = if parallel { 0.5 } else { 0.625 };
        assert!(share > limit - 0.2 && share <= limit, "{share}");
    }
}

#[test]
fn of_each_triangle_one_side_or_the_other_is_left() {
    let model = Model::new(&shapes::sphere(128, 64), DMat4::IDENTITY).with_back();
    let counts = check(&model, &FROM_OUTSIDE.view());
    assert!(counts.facing_away > counts.clusters / 4, "{counts:?}");
    assert!(counts.triangles as usize >= model.triangles.len() / 2);
}

#[test]
fn a_visible_whole_is_one_range() {
    let toward_viewer = DMat4::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let model = Model::new(&shapes::plane(1.0, 1.0, 40, 40), toward_viewer);
    assert!(model.clusters.len() > 20);
    let mut ranges = Vec::new();
    model.culler().cull(&FROM_OUTSIDE.view(), &mut ranges);
    assert_eq!(ranges.len(), 1);
    assert_eq!(ranges[0], 0..model.triangles.len() as u32);
}

#[test]
fn the_order_of_clusters_does_not_matter() {
    let model = Model::new(&shapes::sphere(128, 64), DMat4::IDENTITY);
    let view = FROM_OUTSIDE.view();
    let mut expected = Vec::new();
    let counts = model.culler().cull(&view, &mut expected);
    assert!(counts.facing_away > 0);
    let reversed: Vec<Cluster> = model.clusters.iter().rev().cloned().collect();
    let mut ranges = Vec::new();
    assert_eq!(Culler::new(&reversed).cull(&view, &mut ranges), counts);
    assert_eq!(ranges, expected);
}

#[test]
fn unbounded_clusters_and_odd_matrices_drop_nothing() {
    let model = Model::new(&shapes::sphere(64, 32), DMat4::IDENTITY);
    let mut clusters = model.clusters.clone();
    clusters[3].radius = f32::INFINITY;
    let behind = Camera {
        target: FROM_OUTSIDE.eye * 2.0,
        ..FROM_OUTSIDE
    };
    let mut culler = Culler::new(&clusters);
    let mut ranges = Vec::new();
    culler.cull(&behind.view(), &mut ranges);
    assert_eq!(ranges, [clusters[3].triangles.clone()]);

    for odd in [
        DMat4::ZERO,
        DMat4::NAN,
        DMat4::from_diagonal(DVec4::INFINITY),
    ] {
        let view = View {
            pixel_from_world: odd,
            ..FROM_OUTSIDE.view()
        };
        let counts = culler.cull(&view, &mut ranges);
        assert_eq!(counts.triangles as usize, model.triangles.len(), "{odd}");
    }
}

#[test]
fn degenerate_sets_of_clusters_work() {
    let mut ranges = Vec::new();
    let counts = Culler::new(&[]).cull(&FROM_OUTSIDE.view(), &mut ranges);
    assert_eq!(counts, CullCounts::default());
    // Many equal balls at one point: a hierarchy without any extent.
    let dots: Vec<Cluster> = (0..100)
        .map(|i| Cluster {
            triangles: 2 * i..2 * i + 1,
            center: [0.0; 3],
            radius: 0.0,
            cone_axis: [0.0, 0.0, 1.0],
            cone_cos: -1.0,
            min_altitude: 0.0,
        })
        .collect();
    let counts = Culler::new(&dots).cull(&FROM_OUTSIDE.view(), &mut ranges);
    assert_eq!((counts.triangles, ranges.len()), (100, 100));
}

#[test]
fn culling_again_allocates_nothing() {
    let model = Model::new(&shapes::teapot(16, true), DMat4::IDENTITY);
    let mut culler = model.culler();
    let mut ranges = Vec::new();
    let behind = Camera {
        target: FROM_OUTSIDE.eye * 2.0,
        ..FROM_OUTSIDE
    };
    culler.cull(&behind.view(), &mut ranges);
    let memory = |culler: &Culler, ranges: &Vec<_>| (ranges.capacity(), culler.stack.capacity());
    let before = memory(&culler, &ranges);
    for i in 0..50 {
        let camera = Camera {
            eye: DVec3::new(f64::from(i) * 0.2 - 5.0, -5.0, 2.0),
            ..FROM_OUTSIDE
        };
        culler.cull(&camera.view(), &mut ranges);
        assert_eq!(memory(&culler, &ranges), before);
    }
}
