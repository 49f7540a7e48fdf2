//! From author space to pixels: nothing may be lost on the way, whatever the size and place of the scene.

use glam::{DMat3, DMat4, DVec3};
use specula::geometry::Mesh;
use specula::scene::{
    Camera, Eye, Light, LightKind, Material, Object, Projection, Revisions, Scene, World,
};
use std::sync::Arc;

const WIDTH: u32 = 640;
const HEIGHT: u32 = 360;

fn parse(text: &str) -> Scene {
    Scene::parse(text, "test").expect("a valid scene")
}

/// A scene of a teapot and a mirrored, stretched one, everything scaled by `size` and moved by `offset`.
fn placed(size: f64, offset: DVec3) -> Scene {
    let mut scene = parse(
        "(
            camera: Perspective(position: (3, -11, 6), target: (0.5, 0, 1.5), fov_degrees: 30),
            lights: [Point(position: (4, -5, 6)), Directional(direction: (1, 2, -3))],
            objects: [
                (shape: Teapot(tessellation: 2)),
                (shape: Teapot(tessellation: 3), scale: (-1, 0.5, 2), rotate_degrees: (20, 30, 40)),
            ],
        )",
    );
    let map = |p: DVec3| p * size + offset;
    let camera = *scene.camera();
    scene.set_camera(Camera {
        position: map(camera.position),
        target: map(camera.target),
        ..camera
    });
    for (index, mut light) in scene.lights().to_vec().into_iter().enumerate() {
        if let LightKind::Point { position } = &mut light.kind {
            *position = map(*position);
            scene.set_light(index, light);
        }
    }
    let moved = DMat4::from_translation(offset) * DMat4::from_scale(DVec3::splat(size));
    scene.set_objects(
        scene
            .objects()
            .iter()
            .map(|object| Object {
                author_from_mesh: moved * object.author_from_mesh,
                ..object.clone()
            })
            .collect(),
    );
    scene
}

fn position(world: &World, vertex: usize) -> DVec3 {
    DVec3::from(world.positions.get(vertex).map(f64::from))
}

fn normal(world: &World, vertex: usize) -> DVec3 {
    DVec3::from(world.normals.get(vertex).map(f64::from))
}

/// A point of author space in divided pixel coordinates and depth.
fn pixel(world: &World, camera: &Camera, p: DVec3) -> DVec3 {
    let view = world.view(camera, WIDTH, HEIGHT);
    let q = view.pixel_from_world * world.world_from_author(p).extend(1.0);
    q.truncate() / q.w
}

#[test]
fn world_space_leads_back_to_author_space() {
    let scene = placed(3.0, DVec3::new(10.0, -20.0, 5.0));
    let world = World::new(&scene);
    assert_eq!(world.world_from_author_scale.log2().fract(), 0.0);
    assert!((0.25..=1.0).contains(&world.radius), "{}", world.radius);
    let mut vertex = 0;
    for object in scene.objects() {
        // In the order in which triangles use them.
        let count = object.mesh.positions.len();
        let placed: Vec<DVec3> = (vertex..vertex + count)
            .map(|v| position(&world, v) / world.world_from_author_scale + world.author_origin)
            .collect();
        for &p in &object.mesh.positions {
            let expected = object.author_from_mesh.transform_point3(p);
            let is_there = placed.iter().any(|back| back.distance(expected) < 1e-5);
            assert!(is_there, "no vertex at {expected}");
        }
        vertex += count;
    }
    assert_eq!(vertex, world.positions.len());
}

#[test]
fn size_and_place_of_a_scene_do_not_change_its_image() {
    let reference_scene = placed(1.0, DVec3::ZERO);
    let reference = World::new(&reference_scene);
    let reference_view = reference.view(reference_scene.camera(), WIDTH, HEIGHT);
    for (size, offset) in [
        (1e-12, DVec3::ZERO),
        (1e12, DVec3::ZERO),
        (1.0, DVec3::new(1e9, -1e9, 1e9)),
        (1e-50, DVec3::ZERO),
        (1e50, DVec3::new(1e50, 0.0, 0.0)),
    ] {
        let scene = placed(size, offset);
        let world = World::new(&scene);
        let view = world.view(scene.camera(), WIDTH, HEIGHT);
        for vertex in 0..world.positions.len() {
            let (a, b) = (
                view.project(world.positions.get(vertex)),
                reference_view.project(reference.positions.get(vertex)),
            );
            for axis in 0..2 {
                let (a, b) = (a[axis] / a[3], b[axis] / b[3]);
                assert!(
                    (a - b).abs() < 1e-3,
                    "size {size}, offset {offset}: {a} for {b}"
                );
            }
            assert!(
                (a[2] / a[3] - b[2] / b[3]).abs() < 1e-4,
                "depth at size {size}"
            );
            assert!(normal(&world, vertex).distance(normal(&reference, vertex)) < 1e-6);
        }
        assert!(world.lights[0].is_point && !world.lights[1].is_point);
    }
}

#[test]
fn the_target_is_in_the_middle_up_is_up_and_right_is_right() {
    let scene = placed(1.0, DVec3::ZERO);
    let world = World::new(&scene);
    let mut camera = *scene.camera();
    for projection in [
        Projection::Perspective { fov_degrees: 30.0 },
        Projection::Orthographic { height: 8.0 },
    ] {
        camera.projection = projection;
        let target = pixel(&world, &camera, camera.target);
        assert!((target.x - 320.0).abs() < 1e-9 && (target.y - 180.0).abs() < 1e-9);
        let above = pixel(&world, &camera, camera.target + DVec3::Z);
        assert!(
            (above.x - 320.0).abs() < 1e-9 && above.y < 180.0,
            "y points down"
        );
        // The camera looks mostly along +y, so that +x is to its right.
        assert!(pixel(&world, &camera, camera.target + DVec3::X).x > 320.0);
    }
}

#[test]
fn the_opening_angle_and_the_height_reach_the_border_of_the_image() {
    let scene = placed(1.0, DVec3::ZERO);
    let world = World::new(&scene);
    let mut camera = *scene.camera();
    let forward = (camera.target - camera.position).normalize();
    let right = forward.cross(camera.up).normalize();
    let up = right.cross(forward);
    let distance = camera.target.distance(camera.position);
    camera.projection = Projection::Perspective { fov_degrees: 50.0 };
    let half = distance * 25_f64.to_radians().tan();
    let top = pixel(&world, &camera, camera.target + up * half);
    assert!(top.y.abs() < 1e-9, "{top}");
    let corner = pixel(
        &world,
        &camera,
        camera.target + (right * 16.0 / 9.0 - up) * half,
    );
    assert!(
        (corner.x - 640.0).abs() < 1e-9 && (corner.y - 360.0).abs() < 1e-9,
        "{corner}"
    );
    camera.projection = Projection::Orthographic { height: 5.0 };
    let top = pixel(&world, &camera, camera.target + up * 2.5);
    assert!(top.y.abs() < 1e-9, "{top}");
}

#[test]
fn reversed_depth_is_one_at_the_near_plane_and_zero_at_the_far_plane() {
    let scene = placed(1.0, DVec3::ZERO);
    let world = World::new(&scene);
    let mut camera = *scene.camera();
    let forward = (camera.target - camera.position).normalize();
    (camera.near, camera.far) = (Some(2.0), Some(50.0));
    for projection in [
        Projection::Perspective { fov_degrees: 30.0 },
        Projection::Orthographic { height: 8.0 },
    ] {
        camera.projection = projection;
        let depth = |distance: f64| pixel(&world, &camera, camera.position + forward * distance).z;
        assert!((depth(2.0) - 1.0).abs() < 1e-12);
        assert!(depth(50.0).abs() < 1e-12);
        assert!(depth(10.0) > depth(11.0), "larger is nearer");
    }
}

#[test]
fn fitted_planes_hold_the_scene_wherever_the_camera_is() {
    let scene = placed(1.0, DVec3::ZERO);
    let world = World::new(&scene);
    for camera in [
        *scene.camera(),
        Camera {
            position: DVec3::new(0.0, -1e7, 0.0),
            ..*scene.camera()
        },
        Camera {
            projection: Projection::Orthographic { height: 8.0 },
            ..*scene.camera()
        },
    ] {
        let view = world.view(&camera, WIDTH, HEIGHT);
        for vertex in 0..world.positions.len() {
            let [_, _, z, w] = view.project(world.positions.get(vertex));
            assert!(w > 0.0 && (0.0..=1.0).contains(&(z / w)), "depth {}", z / w);
        }
    }
    // From inside, and looking away, there is still a sensible range.
    for target in [DVec3::new(5.0, 0.0, 0.0), DVec3::new(0.0, -1e6, 0.0)] {
        for eye in [DVec3::new(0.0, -2.5, 1.0), DVec3::new(0.0, -90.0, 1.0)] {
            let camera = Camera {
                position: eye,
                target,
                ..*scene.camera()
            };
            let matrix = world.view(&camera, WIDTH, HEIGHT).pixel_from_world;
            assert!(matrix.is_finite() && matrix.determinant() != 0.0);
            let forward = (target - eye).normalize();
            let depth = |distance: f64| pixel(&world, &camera, eye + forward * distance).z;
            if eye.length() < world.radius / world.world_from_author_scale {
                assert!(depth(0.01) < 1.0 && depth(0.01) > depth(1.0) && depth(1.0) > 0.0);
            }
        }
    }
}

#[test]
fn one_given_plane_never_contradicts_the_fitted_other() {
    let scene = placed(1.0, DVec3::ZERO);
    let world = World::new(&scene);
    for projection in [
        Projection::Perspective { fov_degrees: 30.0 },
        Projection::Orthographic { height: 8.0 },
    ] {
        for (near, far) in [
            (Some(1e6), None),
            (None, Some(1e-6)),
            (Some(1e-9), None),
            (None, Some(1e9)),
        ] {
            let camera = Camera {
                projection,
                near,
                far,
                ..*scene.camera()
            };
            let forward = (camera.target - camera.position).normalize();
            let depth =
                |distance: f64| pixel(&world, &camera, camera.position + forward * distance).z;
            if let Some(near) = near {
                assert!((depth(near) - 1.0).abs() < 1e-6 && depth(near * 1.01) < 1.0);
            }
            if let Some(far) = far {
                assert!(depth(far).abs() < 1e-6 && depth(far * 0.99) > 0.0);
            }
        }
    }
}

#[test]
fn a_view_without_a_direction_or_a_size_is_still_finite() {
    let scene = placed(1.0, DVec3::ZERO);
    let world = World::new(&scene);
    let mut camera = *scene.camera();
    camera.target = camera.position;
    assert!(
        world
            .view(&camera, WIDTH, HEIGHT)
            .pixel_from_world
            .is_finite()
    );
    camera = *scene.camera();
    camera.up = camera.target - camera.position;
    assert!(
        world
            .view(&camera, WIDTH, HEIGHT)
            .pixel_from_world
            .is_finite()
    );
    assert!(
        world
            .view(scene.camera(), 0, 0)
            .pixel_from_world
            .is_finite()
    );
    let mut empty = scene.clone();
    empty.set_objects(Vec::new());
    let world = World::new(&empty);
    assert!(world.triangles.is_empty());
    assert!(
        world
            .view(&camera, WIDTH, HEIGHT)
            .pixel_from_world
            .is_finite()
    );
}

#[test]
fn normals_stay_unit_and_perpendicular_to_the_transformed_surface() {
    // A slanted plane: its normal must be that of the transformed triangle, not the transformed normal.
    let scene = parse(
        "(objects: [(
            shape: Box(size: (3, 0.001, 5)),
            scale: (2, -7, 0.1),
            rotate_degrees: (10, 200, -70),
            position: (1, 2, 3),
        )])",
    );
    let world = World::new(&scene);
    for t in &world.triangles {
        let [a, b, c] = t.map(|v| position(&world, v as usize));
        let face = (b - a).cross(c - a).normalize();
        for &vertex in t {
            let n = normal(&world, vertex as usize);
            assert!((n.length() - 1.0).abs() < 1e-6);
            // Right-handed: the triangle turns counter-clockwise about its normal although one axis is mirrored.
            assert!(face.dot(n) > 0.999, "{face} against {n}");
        }
    }
}

#[test]
fn a_mirrored_object_keeps_its_outside() {
    let scene = placed(1.0, DVec3::ZERO);
    let world = World::new(&scene);
    let mut checked = 0;
    for t in &world.triangles {
        let [a, b, c] = t.map(|v| position(&world, v as usize));
        let face = (b - a).cross(c - a);
        let outside: DVec3 = t.iter().map(|&v| normal(&world, v as usize)).sum();
        if face.length() > 1e-6 {
            assert!(face.dot(outside) > 0.0, "{t:?} was turned inside out");
            checked += 1;
        }
    }
    assert!(checked > 500);
}

#[test]
fn rotations_are_about_x_then_y_then_z() {
    let scene = parse(
        "(objects: [(shape: Box(), rotate_degrees: (90, 90, 0)), (shape: Box(), rotate_degrees: (0, 450, -90))])",
    );
    let turn = |object: &Object, v: DVec3| object.author_from_mesh.transform_vector3(v);
    // z goes to -y under x, where the turn about y leaves it; y goes to z, then to x.
    assert_eq!(turn(&scene.objects()[0], DVec3::Z), -DVec3::Y);
    assert_eq!(turn(&scene.objects()[0], DVec3::Y), DVec3::X);
    // 450 degrees are 90: z goes to x, and then under z by -90 to -y.
    assert_eq!(turn(&scene.objects()[1], DVec3::Z), -DVec3::Y);
    let any = parse("(objects: [(shape: Box(), rotate_degrees: (12, -345, 678.9))])");
    let m = DMat3::from_mat4(any.objects()[0].author_from_mesh);
    let z_y_x = DMat3::from_rotation_z(678.9_f64.to_radians())
        * DMat3::from_rotation_y((-345_f64).to_radians())
        * DMat3::from_rotation_x(12_f64.to_radians());
    assert!(m.abs_diff_eq(z_y_x, 1e-12));
}

#[test]
fn far_lights_become_directional_and_all_point_towards_their_source() {
    let scene = parse(
        "(
            lights: [
                Point(position: (0, 0, 100)),
                Point(position: (0, 3e9, 4e9), color: (1, 0.5, 0), intensity: 2),
                Directional(direction: (0, 0, -1e-30)),
            ],
            objects: [(shape: Sphere())],
        )",
    );
    let world = World::new(&scene);
    assert!(world.lights[0].is_point);
    let scale = world.world_from_author_scale as f32;
    assert_eq!(world.lights[0].vector, [0.0, 0.0, 100.0 * scale]);
    assert!(!world.lights[1].is_point);
    assert_eq!(world.lights[1].radiance, [2.0, 1.0, 0.0]);
    let towards = DVec3::from(world.lights[1].vector.map(f64::from));
    assert!(towards.distance(DVec3::new(0.0, 0.6, 0.8)) < 1e-6);
    assert_eq!(world.lights[2].vector, [0.0, 0.0, 1.0]);
}

#[test]
fn the_viewer_is_a_point_or_a_direction() {
    let scene = parse(
        "(camera: Orthographic(position: (0, -9, 0), target: (0, 0, 0)), objects: [(shape: Sphere())])",
    );
    let world = World::new(&scene);
    let Eye::Direction(towards) = world.view(scene.camera(), WIDTH, HEIGHT).eye else {
        panic!("an orthographic viewer is in a direction");
    };
    assert!(DVec3::from(towards.map(f64::from)).distance(-DVec3::Y) < 1e-6);
    let mut camera = *scene.camera();
    camera.projection = Projection::Perspective { fov_degrees: 1.0 };
    let expected = world
        .world_from_author(camera.position)
        .to_array()
        .map(|c| c as f32);
    assert_eq!(world.view(&camera, WIDTH, HEIGHT).eye, Eye::Point(expected));
    camera.position = DVec3::new(0.0, -1e30, 0.0);
    assert!(matches!(
        world.view(&camera, WIDTH, HEIGHT).eye,
        Eye::Direction(_)
    ));
}

#[test]
fn clusters_partition_each_object_and_keep_its_triangles() {
    let scene = placed(1.0, DVec3::ZERO);
    let world = World::new(&scene);
    let mut next = 0;
    for cluster in &world.clusters {
        assert_eq!(cluster.triangles.start, next);
        next = cluster.triangles.end;
    }
    assert_eq!(next as usize, world.triangles.len());
    // Reordering keeps the set of triangles: each object's vertices stay its own.
    let split = scene.objects()[0].mesh.triangles.len();
    let vertices = scene.objects()[0].mesh.positions.len() as u32;
    for (index, t) in world.triangles.iter().enumerate() {
        assert!(t.iter().all(|&v| (v < vertices) == (index < split)));
    }
    assert_eq!(world.triangle_material.len(), world.triangles.len());
}

#[test]
fn materials_are_premultiplied_and_default_ones_are_shared() {
    let scene = parse(
        r##"(
            ambient: (0.5, 1, 2),
            materials: {"red": (diffuse: "#ff0000", ambient: 0.5, specular: 0, shininess: 7, model: BlinnPhong)},
            objects: [(shape: Box()), (shape: Box(), material: "red"), (shape: Box())],
        )"##,
    );
    assert_eq!(scene.materials().len(), 2);
    assert_eq!(
        scene
            .objects()
            .iter()
            .map(|o| o.material)
            .collect::<Vec<_>>(),
        [1, 0, 1]
    );
    assert!(Arc::ptr_eq(
        &scene.objects()[0].mesh,
        &scene.objects()[2].mesh
    ));
    let world = World::new(&scene);
    let red = world.materials[0];
    assert_eq!(
        (red.ambient, red.diffuse),
        ([0.25, 0.0, 0.0], [1.0, 0.0, 0.0])
    );
    assert!(!red.is_specular() && world.materials[1].is_specular());
}

#[test]
fn each_setter_gives_its_part_a_new_revision_and_no_other() {
    let mut scene = parse("(objects: [(shape: Box()), (shape: Box())])");
    let other = parse("(objects: [(shape: Box()), (shape: Box())])");
    assert_ne!(scene.revisions().objects, other.revisions().objects);
    let copy = scene.clone();
    assert_eq!(scene.revisions(), copy.revisions());

    // Every setter, with what has to change besides the parts it leaves alone.
    type Change = (fn(&mut Scene), fn(&mut Revisions, Revisions));
    let changes: [Change; 9] = [
        (
            |scene| {
                let camera = *scene.camera();
                scene.set_camera(Camera {
                    position: camera.position * 2.0,
                    ..camera
                });
            },
            |old, new| old.camera = new.camera,
        ),
        (
            |scene| scene.set_background([0.5; 3]),
            |old, new| old.background = new.background,
        ),
        (
            |scene| scene.set_ambient([0.0; 3]),
            |old, new| old.materials = new.materials,
        ),
        (
            |scene| {
                let light = scene.lights()[0];
                scene.set_light(
                    1,
                    Light {
                        radiance: [0.25; 3],
                        ..light
                    },
                );
            },
            |old, new| old.lights = new.lights,
        ),
        (
            |scene| scene.set_lights(Vec::new()),
            |old, new| old.lights = new.lights,
        ),
        (
            |scene| {
                let material = scene.materials()[0];
                scene.set_material(
                    0,
                    Material {
                        shininess: 3.0,
                        ..material
                    },
                );
            },
            |old, new| old.materials = new.materials,
        ),
        (
            |scene| {
                let material = scene.materials()[0];
                assert_eq!(scene.add_material(material), 1);
            },
            |old, new| old.materials = new.materials,
        ),
        (
            |scene| scene.set_transform(1, DMat4::from_scale(DVec3::splat(2.0))),
            |old, new| old.transforms = new.transforms,
        ),
        (
            |scene| scene.set_object_material(0, 1),
            |old, new| old.materials = new.materials,
        ),
    ];
    for (index, (change, allowed)) in changes.into_iter().enumerate() {
        let mut before = scene.revisions();
        change(&mut scene);
        let after = scene.revisions();
        assert_ne!(before, after, "change {index}");
        allowed(&mut before, after);
        assert_eq!(before, after, "change {index}");
    }
    assert_eq!(copy.revisions().camera, copy.clone().revisions().camera);
}

#[test]
fn setting_what_is_there_already_changes_nothing() {
    let mut scene = placed(1.0, DVec3::ZERO);
    let before = scene.revisions();
    scene.set_camera(*scene.camera());
    scene.set_background(scene.background());
    scene.set_ambient(scene.ambient());
    scene.set_lights(scene.lights().to_vec());
    scene.set_light(0, scene.lights()[0]);
    scene.set_material(0, scene.materials()[0]);
    scene.set_transform(1, scene.objects()[1].author_from_mesh);
    scene.set_object_material(0, scene.objects()[0].material);
    assert_eq!(scene.revisions(), before);
}

#[test]
fn a_material_index_out_of_range_does_no_harm() {
    let mut scene = parse("(objects: [(shape: Box())])");
    scene.set_object_material(0, 99);
    assert!(World::new(&scene).vertex_material.iter().all(|&m| m == 0));
    let bare = Scene::new(Vec::new(), scene.objects().to_vec());
    assert_eq!(World::new(&bare).materials.len(), 1);
}

#[test]
fn a_face_seen_from_outside_turns_counter_clockwise_on_the_screen() {
    let scene = parse("(objects: [(shape: Sphere(slices: 12, stacks: 6))])");
    let world = World::new(&scene);
    let view = world.view(scene.camera(), WIDTH, HEIGHT);
    let Eye::Point(eye) = view.eye else {
        panic!("the default camera is a perspective one");
    };
    let eye = DVec3::from(eye.map(f64::from));
    for t in &world.triangles {
        let [a, b, c] = t.map(|v| position(&world, v as usize));
        let towards_eye = (b - a).cross(c - a).dot(eye - a);
        let [p, q, r] = t.map(|v| {
            let [x, y, _, w] = view.project(world.positions.get(v as usize));
            [x / w, y / w]
        });
        let (u, v) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
        // The y axis points down, so that a counter-clockwise turn has a negative area.
        let area = u[0] * v[1] - u[1] * v[0];
        if area.abs() > 1e-3 {
            assert_eq!(towards_eye > 0.0, area < 0.0, "{t:?}");
        }
    }
}

#[test]
fn a_mesh_put_together_by_hand_may_lack_normals() {
    let mesh = Mesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
        normals: vec![DVec3::Z; 3],
        triangles: vec![[0, 1, 2], [1, 2, 3]],
    };
    let object = Object {
        mesh: Arc::new(mesh),
        material: 0,
        author_from_mesh: DMat4::IDENTITY,
    };
    let world = World::new(&Scene::new(Vec::new(), vec![object]));
    // What uses the vertex without a normal is left out.
    assert_eq!(world.triangles, [[0, 1, 2]]);
    assert_eq!(world.positions.len(), 3);
}
