//! A scene that changes between frames: an engine that redoes only what has changed must come to the same as one that
//! starts with the changed scene.

use glam::{DMat4, DVec3};
use proptest::prelude::*;
use specula::backend::recording::{Call, RecordingBackend};
use specula::parallel::Exec;
use specula::scene::{
    Camera, Changes, GeometryChange, Light, LightKind, Material, Placement, Scene, World,
};
use specula::{BackendKind, Budget, Engine, EngineOptions, Frame, FrameStats, Method};

const SIZE: (u32, u32) = (120, 90);

/// Two cubes that touch, a teapot that touches nothing, and a plane.
fn scene() -> Scene {
    Scene::parse(
        r#"(
            materials: {
                "one": (diffuse: (0.7, 0.3, 0.2), shininess: 20),
                "two": (diffuse: (0.2, 0.4, 0.7), shininess: 60, two_sided: true),
            },
            objects: [
                (shape: Box(), material: "one"),
                (shape: Box(), material: "two", position: (1, 0, 0)),
                (shape: Teapot(tessellation: 2), material: "one", position: (-3, 0, 0)),
                (shape: Plane(width: 9, depth: 9, columns: 3, rows: 3), material: "two", position: (0, 0, -2)),
            ],
        )"#,
        "changes.ron",
    )
    .expect("a valid scene")
}

fn engine(scene: &Scene) -> Engine {
    let options = EngineOptions {
        threads: Some(1),
        ..EngineOptions::default()
    };
    Engine::with_options(scene, options).expect("an engine")
}

fn render(engine: &mut Engine, scene: &Scene) -> (Frame, FrameStats) {
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    let stats = engine.render(scene, Budget::Work(100_000), &mut frame);
    (frame, stats)
}

/// One change of a scene.
#[derive(Clone, Debug)]
enum Edit {
    Camera(f64),
    Lights(usize),
    Light(f64),
    Background(f64),
    Ambient(f64),
    Shininess(usize, f64),
    Sides(usize, bool),
    Assign(usize, usize),
    Move(usize, DVec3),
    Turn(usize, f64),
    Mirror(usize),
    Home(usize),
    FarAway(usize),
    Add,
    Remove,
}

impl Edit {
    fn apply(&self, scene: &mut Scene) {
        let index = |i: usize| i % scene.objects().len();
        match *self {
            Self::Camera(x) => {
                let camera = *scene.camera();
                scene.set_camera(Camera {
                    position: camera.position + DVec3::X * x,
                    ..camera
                });
            }
            Self::Lights(count) => {
                let light = |i: usize| Light {
                    kind: LightKind::Directional {
                        direction: DVec3::new(i as f64 - 1.0, 1.0, -1.0),
                    },
                    radiance: [0.4; 3],
                };
                scene.set_lights((0..count).map(light).collect());
            }
            Self::Light(x) => {
                if !scene.lights().is_empty() {
                    let kind = LightKind::Point {
                        position: DVec3::new(x, -4.0, 3.0),
                    };
                    let light = scene.lights()[0];
                    scene.set_light(0, Light { kind, ..light });
                }
            }
            Self::Background(c) => scene.set_background([c, 0.2, 0.1]),
            Self::Ambient(c) => scene.set_ambient([c; 3]),
            Self::Shininess(i, shininess) => {
                let material = scene.materials()[i];
                scene.set_material(
                    i,
                    Material {
                        shininess,
                        ..material
                    },
                );
            }
            Self::Sides(i, two_sided) => {
                let material = scene.materials()[i];
                scene.set_material(
                    i,
                    Material {
                        two_sided,
                        ..material
                    },
                );
            }
            Self::Assign(object, material) => scene.set_object_material(index(object), material),
            Self::Move(object, to) => {
                scene.set_transform(index(object), DMat4::from_translation(to));
            }
            Self::Turn(object, angle) => {
                let object = index(object);
                let place = scene.objects()[object].author_from_mesh;
                scene.set_transform(object, place * DMat4::from_rotation_z(angle));
            }
            Self::Mirror(object) => {
                let object = index(object);
                let place = scene.objects()[object].author_from_mesh;
                let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
                scene.set_transform(object, place * mirror);
            }
            Self::Home(object) => {
                let object = index(object);
                let rest = self::scene().objects().get(object).cloned();
                if let Some(rest) = rest {
                    scene.set_transform(object, rest.author_from_mesh);
                }
            }
            Self::FarAway(object) => {
                scene.set_transform(
                    index(object),
                    DMat4::from_translation(DVec3::new(0.0, 500.0, 0.0)),
                );
            }
            Self::Add => {
                let mut object = scene.objects()[0].clone();
                object.author_from_mesh = DMat4::from_translation(DVec3::new(0.0, 1.0, 0.0));
                scene.add_object(object);
            }
            Self::Remove => {
                if scene.objects().len() > 1 {
                    scene.set_objects(scene.objects()[1..].to_vec());
                }
            }
        }
    }
}

fn edits() -> impl Strategy<Value = Edit> {
    let object = 0..4_usize;
    prop_oneof![
        (-1.0..1.0).prop_map(Edit::Camera),
        (0..4_usize).prop_map(Edit::Lights),
        (-5.0..5.0).prop_map(Edit::Light),
        (0.0..1.0).prop_map(Edit::Background),
        (0.0..0.5).prop_map(Edit::Ambient),
        (0..2_usize, 1.0..90.0).prop_map(|(i, s)| Edit::Shininess(i, s)),
        (0..2_usize, any::<bool>()).prop_map(|(i, b)| Edit::Sides(i, b)),
        (object.clone(), 0..3_usize).prop_map(|(o, m)| Edit::Assign(o, m)),
        (object.clone(), prop::array::uniform3(-2.0..2.0))
            .prop_map(|(o, p)| Edit::Move(o, DVec3::from(p))),
        (object.clone(), -3.0..3.0).prop_map(|(o, a)| Edit::Turn(o, a)),
        object.clone().prop_map(Edit::Mirror),
        object.clone().prop_map(Edit::Home),
        object.prop_map(Edit::FarAway),
        Just(Edit::Add),
        Just(Edit::Remove),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn after_any_changes_world_and_image_are_those_of_a_fresh_start(
        edits in prop::collection::vec(edits(), 1..12),
        frames in prop::collection::vec(any::<bool>(), 12),
    ) {
        let mut scene = scene();
        let mut tested = engine(&scene);
        let (mut placement, mut world) = Placement::new(&scene);
        for (edit, is_frame) in edits.iter().zip(frames) {
            edit.apply(&mut scene);
            // Not every state is looked at, so that changes come together.
            if is_frame {
                placement.update(Exec::sequential(), &mut world, &scene);
                prop_assert!(world == World::new(&scene), "{edit:?}");
                let (frame, _) = render(&mut tested, &scene);
                let (expected, _) = render(&mut engine(&scene), &scene);
                prop_assert!(frame.pixels() == expected.pixels(), "{edit:?}");
            }
        }
    }
}

#[test]
fn each_change_costs_what_depends_on_it() {
    let mut scene = scene();
    let (mut placement, mut world) = Placement::new(&scene);
    let mut update = |edit: Edit| {
        edit.apply(&mut scene);
        placement.update(Exec::sequential(), &mut world, &scene)
    };
    let (none, moved, replaced) = (
        GeometryChange::None,
        GeometryChange::Moved,
        GeometryChange::Replaced,
    );
    let changes = |geometry, shading, background| Changes {
        geometry,
        shading,
        background,
    };
    assert_eq!(update(Edit::Camera(0.5)), changes(none, false, false));
    assert_eq!(update(Edit::Light(2.0)), changes(none, true, false));
    assert_eq!(update(Edit::Background(0.5)), changes(none, false, true));
    assert_eq!(update(Edit::Ambient(0.5)), changes(none, true, false));
    assert_eq!(update(Edit::Shininess(0, 5.0)), changes(none, true, false));
    let teapot = 2;
    assert_eq!(
        update(Edit::Turn(teapot, 0.5)),
        changes(moved, false, false)
    );
    assert_eq!(update(Edit::Home(teapot)), changes(moved, false, false));
    // What shows its back has to be drawn.
    assert_eq!(update(Edit::Sides(0, true)).geometry, replaced);
    assert_eq!(update(Edit::Assign(teapot, 1)), changes(none, true, false));
    assert_eq!(update(Edit::Sides(0, false)).geometry, replaced);
    assert_eq!(update(Edit::Sides(0, false)).geometry, none);
    assert_eq!(update(Edit::Assign(teapot, 0)).geometry, replaced);
    assert_eq!(update(Edit::Assign(teapot, 0)).geometry, none);
    assert_eq!(update(Edit::Assign(teapot, 1)).geometry, replaced);
    // A cube is welded to its neighbour only where it was at first.
    assert_eq!(update(Edit::Turn(0, 0.5)).geometry, replaced);
    assert_eq!(update(Edit::Turn(0, 0.5)).geometry, moved);
    assert_eq!(update(Edit::Home(0)).geometry, replaced);
    assert_eq!(update(Edit::Mirror(teapot)).geometry, replaced);
    assert_eq!(update(Edit::Home(teapot)).geometry, replaced);
    assert_eq!(update(Edit::FarAway(teapot)).geometry, moved);
    assert_eq!(update(Edit::Add).geometry, replaced);
}

#[test]
fn the_owners_of_pixels_stay_known_while_only_light_changes() {
    let mut scene = scene();
    let mut engine = engine(&scene);
    let skipped = |engine: &mut Engine, scene: &Scene| {
        let (_, stats) = render(engine, scene);
        assert!(stats.covered_pixels > 0);
        stats.skipped.visibility_pixels == stats.covered_pixels
    };
    assert!(!skipped(&mut engine, &scene), "the first frame");
    for (edit, is_known) in [
        (Edit::Light(1.0), true),
        (Edit::Shininess(1, 9.0), true),
        (Edit::Background(0.9), true),
        (Edit::Camera(0.1), false),
        (Edit::Turn(2, 0.1), false),
        (Edit::Lights(3), true),
    ] {
        edit.apply(&mut scene);
        assert_eq!(skipped(&mut engine, &scene), is_known, "{edit:?}");
    }
}

#[test]
fn a_device_hears_of_a_change_only_what_depends_on_it() {
    let mut scene = scene();
    let (backend, log) = RecordingBackend::new(BackendKind::Software.create());
    let options = EngineOptions {
        method: Method::Gouraud,
        threads: Some(1),
        ..EngineOptions::default()
    };
    let mut engine = Engine::with_backend(&scene, options, Box::new(backend)).expect("an engine");
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    // Whether pixels got new owners, new colours, and were handed over.
    let mut heard = |scene: &Scene| {
        engine.render(scene, Budget::Unlimited, &mut frame);
        let calls = log.take();
        let is_any = |f: fn(&Call) -> bool| calls.iter().any(f);
        [
            is_any(|call| matches!(call, Call::Rasterize { .. })),
            is_any(|call| matches!(call, Call::Resolve(_))),
            is_any(|call| matches!(call, Call::Present { pixels } if *pixels > 0)),
        ]
    };
    assert_eq!(heard(&scene), [true; 3], "the first frame");
    assert_eq!(heard(&scene), [false; 3], "a still view");
    for (edit, expected) in [
        (Edit::Light(1.0), [false, true, true]),
        (Edit::Shininess(0, 7.0), [false, true, true]),
        (Edit::Background(0.9), [false, true, true]),
        (Edit::Turn(2, 0.2), [true; 3]),
        (Edit::Camera(0.3), [true; 3]),
        (Edit::Camera(0.0), [false; 3]),
    ] {
        edit.apply(&mut scene);
        assert_eq!(heard(&scene), expected, "{edit:?}");
    }
}

#[test]
fn odd_transforms_and_too_many_lights_do_no_harm() {
    let mut scene = scene();
    let mut engine = engine(&scene);
    for place in [
        DMat4::NAN,
        DMat4::ZERO,
        DMat4::from_scale(DVec3::splat(1e200)),
        DMat4::from_translation(DVec3::splat(f64::INFINITY)),
        DMat4::IDENTITY,
    ] {
        scene.set_transform(0, place);
        render(&mut engine, &scene);
    }
    Edit::Lights(500).apply(&mut scene);
    let (frame, _) = render(&mut engine, &scene);
    Edit::Lights(128).apply(&mut scene);
    let (expected, _) = render(&mut engine, &scene);
    assert!(frame.pixels() == expected.pixels());
    // Every method takes the changed scene over.
    for method in Method::ALL {
        let options = EngineOptions {
            method,
            ..EngineOptions::default()
        };
        let mut engine = Engine::with_options(&scene, options).expect("an engine");
        render(&mut engine, &scene);
        Edit::Light(3.0).apply(&mut scene);
        render(&mut engine, &scene);
    }
}
