//! Two-sided materials: the back of a triangle is a surface of its own, with its normals turned round, and the front looks
//! as if there were none.

use glam::{DMat4, DVec3};
use specula::geometry::{Mesh, shapes};
use specula::measure::reference::NO_TRIANGLE;
use specula::measure::{ErrorReport, ReferenceImage};
use specula::scene::{Camera, Material, Object, ReflectionModel, Scene, World};
use specula::{Budget, Engine, EngineOptions, Frame, Method};
use std::sync::Arc;

const SIZE: (u32, u32) = (200, 150);

fn material(two_sided: bool) -> Material {
    Material {
        ambient: [1.0; 3],
        diffuse: [0.6, 0.3, 0.2],
        specular: [0.6; 3],
        shininess: 30.0,
        model: ReflectionModel::BlinnPhong,
        two_sided,
    }
}

fn object(mesh: Mesh) -> Object {
    Object {
        mesh: Arc::new(mesh),
        material: 0,
        author_from_mesh: DMat4::IDENTITY,
    }
}

fn scene(mesh: Mesh, two_sided: bool) -> Scene {
    Scene::new(vec![material(two_sided)], vec![object(mesh)])
}

/// Looks at the origin from somewhere.
fn look(scene: &mut Scene, position: DVec3) {
    let camera = *scene.camera();
    scene.set_camera(Camera {
        position,
        target: DVec3::ZERO,
        ..camera
    });
}

fn directions(count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(|i| {
        let (a, z) = (f64::from(i) * 2.4, 0.9 * libm::sin(f64::from(i) * 1.7));
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * libm::cos(a), r * libm::sin(a), z)
    })
}

fn turned_round(mut mesh: Mesh) -> Mesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh.normals.iter_mut().for_each(|n| *n = -*n);
    mesh
}

/// A plane that is bent about the y axis, its normals those of the bent surface.
fn bent_plane(columns: u32) -> Mesh {
    let mut mesh = shapes::plane(2.0, 2.0, columns, columns);
    for (p, n) in mesh.positions.iter_mut().zip(&mut mesh.normals) {
        let angle = 1.3 * p.x;
        *n = DVec3::new(libm::sin(angle), 0.0, libm::cos(angle));
        *p = DVec3::new(n.x, p.y, n.z - 0.6);
    }
    mesh
}

/// A sphere without a third of its triangles.
fn open_sphere(slices: u32, stacks: u32) -> Mesh {
    let mut mesh = shapes::sphere(slices, stacks);
    let mut index = 0;
    mesh.triangles.retain(|_| {
        index += 1;
        index % 3 > 0
    });
    mesh
}

fn engine(scene: &Scene, method: Method) -> Engine {
    let options = EngineOptions {
        method,
        threads: Some(1),
        ..EngineOptions::default()
    };
    Engine::with_options(scene, options).expect("an engine")
}

fn image(scene: &Scene, method: Method, budget: Budget) -> Frame {
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    engine(scene, method).render(scene, budget, &mut frame);
    frame
}

/// The slow reference of a scene.
fn reference(scene: &Scene) -> (World, ReferenceImage) {
    let world = World::new(scene);
    let view = world.view(scene.camera(), SIZE.0, SIZE.1);
    let image = ReferenceImage::render(&world, &view, 2);
    (world, image)
}

/// At the start, in the middle of refinement, and at its end.
const BUDGETS: [Budget; 4] = [
    Budget::Work(0),
    Budget::Work(60_000),
    Budget::Work(400_000),
    Budget::Unlimited,
];

#[test]
fn seen_from_behind_a_surface_looks_as_if_it_were_turned_round() {
    for mesh in [shapes::plane(2.0, 2.0, 3, 3), bent_plane(5)] {
        let mut two_sided = scene(mesh.clone(), true);
        let mut turned = scene(turned_round(mesh.clone()), false);
        let mut front = scene(mesh, false);
        for from in [DVec3::new(0.4, -0.8, -4.0), DVec3::new(-0.9, 0.3, -3.0)] {
            look(&mut two_sided, from);
            look(&mut turned, from);
            look(&mut front, from);
            for method in [Method::Flat, Method::Phong, Method::Adaptive] {
                for budget in BUDGETS {
                    let got = image(&two_sided, method, budget);
                    let want = image(&turned, method, budget);
                    assert!(got.pixels() == want.pixels(), "{method:?}, {budget:?}");
                    let other = image(&front, method, budget);
                    assert!(got.pixels() != other.pixels(), "the back is to be seen");
                }
            }
        }
    }
}

#[test]
fn the_front_of_a_closed_mesh_looks_as_if_it_had_no_back() {
    for (slices, stacks) in [(6, 4), (12, 8), (32, 16)] {
        let mesh = shapes::sphere(slices, stacks);
        let mut two_sided = scene(mesh.clone(), true);
        let mut one_sided = scene(mesh, false);
        for direction in directions(12) {
            look(&mut two_sided, direction * 4.0);
            look(&mut one_sided, direction * 4.0);
            for budget in BUDGETS {
                let got = image(&two_sided, Method::Adaptive, budget);
                let want = image(&one_sided, Method::Adaptive, budget);
                assert!(got.pixels() == want.pixels(), "{direction}, {budget:?}");
            }
        }
    }
}

/// On the outline of a closed mesh its front and its back meet, and coverage is rounded there while depth is not.
#[test]
fn no_pixel_on_the_outline_of_a_closed_mesh_shows_its_back() {
    for mesh in [
        shapes::sphere(6, 4),
        shapes::sphere(16, 8),
        shapes::torus(1.0, 0.4, 12, 8),
    ] {
        let mut scene = scene(mesh, true);
        for direction in directions(60) {
            look(&mut scene, direction * 3.0);
            let (world, owners) = reference(&scene);
            assert!(owners.covered_pixels() > 1000);
            let is_back = |&id: &u32| id != NO_TRIANGLE && world.backs.contains(&id);
            assert_eq!(owners.ids.iter().filter(|id| is_back(id)).count(), 0);
        }
    }
}

#[test]
fn open_shapes_converge_to_the_reference() {
    for mesh in [bent_plane(4), open_sphere(10, 6)] {
        let mut scene = scene(mesh, true);
        for direction in directions(8) {
            look(&mut scene, direction * 4.0);
            let (world, reference) = reference(&scene);
            let frame = image(&scene, Method::Adaptive, Budget::Unlimited);
            let error = ErrorReport::compare(&frame, &reference).expect("same size");
            assert!(error.max <= 1, "{direction}: {error:?}");
            let phong = image(&scene, Method::Phong, Budget::Unlimited);
            let error = ErrorReport::compare(&phong, &reference).expect("same size");
            assert!(error.max <= 1, "{direction}: {error:?}");
            assert_eq!(world.triangles.len(), 2 * scene.triangle_count());
        }
    }
}

/// By the definition: every back is a front turned round, and they have nothing in common that could be refined together.
#[test]
fn a_world_holds_fronts_then_backs_that_are_not_welded_to_them() {
    let mut scene = Scene::new(
        vec![material(true), material(false)],
        vec![
            object(bent_plane(12)),
            object(shapes::sphere(6, 4)),
            object(turned_round(bent_plane(12))),
        ],
    );
    scene.set_object_material(1, 1);
    for place in [DMat4::IDENTITY, DMat4::from_rotation_x(0.4)] {
        scene.set_transform(0, place);
        let world = World::new(&scene);
        let counts = [0, 1, 2].map(|i| scene.objects()[i].mesh.triangles.len());
        let fronts: usize = counts.iter().sum();
        assert_eq!(world.triangles.len(), fronts + counts[0] + counts[2]);
        assert_eq!(world.backs, fronts as u32..world.triangles.len() as u32);
        let of_first = (0..counts[0]).map(|t| (t, fronts + t));
        let of_last = (0..counts[2]).map(|t| (fronts - counts[2] + t, fronts + counts[0] + t));
        for (front, back) in of_first.chain(of_last) {
            assert_eq!(
                world.triangle_material[front],
                world.triangle_material[back]
            );
            let [a, b, c] = world.triangles[front].map(|v| v as usize);
            let [d, e, f] = world.triangles[back].map(|v| v as usize);
            for (v, w) in [(a, d), (b, f), (c, e)] {
                assert_eq!(world.positions.get(v), world.positions.get(w));
                assert_eq!(world.normals.get(v).map(|n| -n), world.normals.get(w));
                assert_eq!(world.vertex_material[v], world.vertex_material[w]);
            }
        }
        let is_front = |half_edge: u32| (half_edge as usize) < 3 * fronts;
        let (mut shared, mut between_objects) = (0, 0);
        for half_edge in 0..3 * world.triangles.len() as u32 {
            for other in world.topology.ring(half_edge) {
                assert_eq!(is_front(half_edge), is_front(other));
                shared += usize::from(other != half_edge);
                let object = |h: u32| (h as usize) < 3 * (fronts - counts[2]);
                between_objects +=
                    usize::from(is_front(other) && object(half_edge) != object(other));
            }
        }
        assert!(shared > world.triangles.len());
        // The first and the last object are at the same place, and welded, as long as the first stays there.
        assert_eq!(between_objects > 0, place == DMat4::IDENTITY);
        // Clusters are all triangles, in order, each cluster on one side.
        let mut next = 0;
        for cluster in &world.clusters {
            assert_eq!(cluster.triangles.start, next);
            next = cluster.triangles.end;
            assert!(next <= fronts as u32 || cluster.triangles.start >= fronts as u32);
        }
        assert_eq!(next as usize, world.triangles.len());
    }
}
