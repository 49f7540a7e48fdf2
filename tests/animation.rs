//! What moves in a scene is at the right place at every time, whatever the times before, and films hold the frames that
//! were rendered.

use glam::{DQuat, DVec3};
use specula::frame::EngineOptions;
use specula::output::apng::ApngWriter;
use specula::output::y4m::Y4mFile;
use specula::output::{FrameRate, Timing};
use specula::scene::animation::Turn;
use specula::scene::{Animation, Light, LightKind, Revisions, Scene};
use specula::{Budget, Engine, Frame};
use std::fs;
use std::io::BufReader;
use std::path::Path;

/// Everything moves, about odd axes.
const MOVING: &str = r##"(
    camera: Perspective(position: (3, -9, 4), target: (0.5, 0, 1), up: (0.1, 0, 1)),
    animation: (
        duration: 4,
        fps: 10,
        orbit: (degrees_per_second: 50, axis: (0.2, -0.1, 2), center: (1, 1, 0)),
    ),
    lights: [
        Point(position: (4, -5, 6), orbit: (degrees_per_second: -70, center: (0, 0, 1))),
        Directional(direction: (1, 2, -2), orbit: (axis: (0, 3, 0))),
        Point(position: (-6, -5, 6), intensity: 0.4),
    ],
    materials: {"m": (specular: 0.8, shininess: 40)},
    objects: [
        (shape: Teapot(tessellation: 2), material: "m"),
        (
            shape: Torus(major_segments: 16, minor_segments: 8),
            material: "m",
            position: (2, -3, 1),
            rotate_degrees: (20, 0, 0),
            scale: (1, 0.5, 1),
            spin: (degrees_per_second: 200, axis: (1, 1, 0)),
        ),
        (shape: Box(), position: (-3, -2, 1), spin: (axis: (0, 0, -1), center: (0, 0, 0))),
    ],
)"##;

fn moving() -> Scene {
    Scene::parse(MOVING, "moving").expect("a valid scene")
}

fn at(seconds: f64) -> Scene {
    let mut scene = moving();
    scene.set_time(seconds);
    scene
}

fn assert_same(a: &Scene, b: &Scene) {
    assert_eq!(a.camera(), b.camera());
    assert_eq!(a.lights(), b.lights());
    for (a, b) in a.objects().iter().zip(b.objects()) {
        assert_eq!(a.author_from_mesh, b.author_from_mesh);
    }
}

/// `p` turned about an axis by the library's quaternions.
fn turned(p: DVec3, axis: DVec3, center: DVec3, degrees: f64) -> DVec3 {
    center + DQuat::from_axis_angle(axis.normalize(), degrees.to_radians()) * (p - center)
}

#[track_caller]
fn assert_near(a: DVec3, b: DVec3) {
    assert!(a.distance(b) < 1e-12 * (1.0 + b.length()), "{a} and {b}");
}

#[test]
fn everything_turns_as_the_scene_says() {
    let rest = moving();
    for seconds in [0.0, 0.1, 1.0, 2.7, 1e3, -3.3] {
        let scene = at(seconds);

        let (axis, center) = (DVec3::new(0.2, -0.1, 2.0), DVec3::new(1.0, 1.0, 0.0));
        let (camera, old) = (scene.camera(), rest.camera());
        let degrees = 50.0 * seconds;
        assert_near(camera.position, turned(old.position, axis, center, degrees));
        assert_near(camera.target, turned(old.target, axis, center, degrees));
        assert_near(camera.up, turned(old.up, axis, DVec3::ZERO, degrees));
        assert_eq!(camera.projection, old.projection);

        let LightKind::Point { position } = scene.lights()[0].kind else {
            panic!("a point light became a directional one");
        };
        let start = DVec3::new(4.0, -5.0, 6.0);
        assert_near(position, turned(start, DVec3::Z, DVec3::Z, -70.0 * seconds));
        let LightKind::Directional { direction } = scene.lights()[1].kind else {
            panic!("a directional light became a point light");
        };
        // Once around in the four seconds of the animation.
        let start = DVec3::new(1.0, 2.0, -2.0);
        assert_near(
            direction,
            turned(start, DVec3::Y, DVec3::ZERO, 90.0 * seconds),
        );
        assert_eq!(scene.lights()[2], rest.lights()[2]);

        assert_eq!(
            scene.objects()[0].author_from_mesh,
            rest.objects()[0].author_from_mesh
        );
        for (object, axis, center, speed) in [
            (
                1,
                DVec3::new(1.0, 1.0, 0.0),
                DVec3::new(2.0, -3.0, 1.0),
                200.0,
            ),
            (2, DVec3::NEG_Z, DVec3::ZERO, 90.0),
        ] {
            let (new, old) = (&scene.objects()[object], &rest.objects()[object]);
            for &p in &new.mesh.positions {
                let expected = old.author_from_mesh.transform_point3(p);
                assert_near(
                    new.author_from_mesh.transform_point3(p),
                    turned(expected, axis, center, speed * seconds),
                );
            }
        }
    }
}

#[test]
fn a_time_gives_the_same_scene_whatever_came_before() {
    let mut scene = moving();
    for seconds in [
        3.0,
        0.25,
        -8.0,
        1e6,
        f64::NAN,
        0.25,
        0.0,
        f64::INFINITY,
        2.5,
        3.0,
    ] {
        scene.set_time(seconds);
        assert_same(&scene, &at(if seconds.is_finite() { seconds } else { 0.0 }));
    }
    scene.set_time(0.0);
    assert_same(&scene, &moving());
}

#[test]
fn after_whole_turns_everything_is_back_to_the_bit() {
    let text = MOVING.replace("degrees_per_second: 50", "degrees_per_second: 90");
    let text = text.replace("-70", "-180").replace("200", "360");
    let rest = Scene::parse(&text, "moving").expect("valid");
    let mut scene = rest.clone();
    for turns in [1.0, 3.0, 1000.0, -2.0] {
        scene.set_time(turns * 4.0);
        assert_same(&scene, &rest);
        scene.set_time(0.4);
        assert_ne!(scene.camera(), rest.camera());
    }
}

#[test]
fn only_what_moves_gets_a_new_revision() {
    let parts = |r: Revisions| {
        let Revisions {
            camera,
            objects,
            transforms,
            materials,
            lights,
            background,
        } = r;
        [camera, objects, transforms, materials, lights, background]
    };
    for (motions, expected) in [
        (
            r#"animation: (orbit: ()), lights: [Point(position: (1, 2, 3))], objects: [(shape: Box())]"#,
            [true, false, false, false, false, false],
        ),
        (
            r#"lights: [Point(position: (1, 2, 3), orbit: ())], objects: [(shape: Box())]"#,
            [false, false, false, false, true, false],
        ),
        (
            r#"lights: [], objects: [(shape: Box(), spin: ())]"#,
            [false, false, true, false, false, false],
        ),
        (
            r#"animation: (duration: 1), objects: [(shape: Box())]"#,
            [false; 6],
        ),
        // The axis goes through the light.
        (
            r#"lights: [Point(position: (0, 0, 3), orbit: ())], objects: [(shape: Box())]"#,
            [false; 6],
        ),
    ] {
        let mut scene = Scene::parse(&format!("({motions})"), "part").expect("valid");
        let before = parts(scene.revisions());
        scene.set_time(0.0);
        assert_eq!(parts(scene.revisions()), before, "{motions}");
        scene.set_time(0.7);
        let after = parts(scene.revisions());
        let changed: Vec<bool> = before.iter().zip(after).map(|(a, b)| *a != b).collect();
        assert_eq!(changed, expected, "{motions}");
        scene.set_time(0.7);
        assert_eq!(parts(scene.revisions()), after, "{motions}");
    }
}

#[test]
fn what_a_scene_file_leaves_out_has_defaults() {
    let parse = |text: &str| Scene::parse(text, "scene").expect("valid");
    assert!(parse("(objects: [(shape: Box())])").animation().is_none());

    let spun = parse("(objects: [(shape: Box(), spin: ())])");
    let animation = spun.animation().expect("it spins");
    assert!(animation.is_moving());
    assert_eq!(*animation.timing(), Timing::default());

    let timed = parse("(animation: (duration: 2, fps: 23.976), objects: [(shape: Box())])");
    let animation = timed.animation().expect("it has a duration");
    assert!(!animation.is_moving());
    assert_eq!(
        animation.timing().rate(),
        FrameRate::new(24_000, 1001).expect("a rate")
    );
    assert_eq!(animation.timing().frames(), 48);

    // By default the camera goes once about its target in the whole time, counter-clockwise from above.
    let mut orbit = parse(
        "(camera: Perspective(position: (5, 0, 2), target: (1, 0, 0)), animation: (duration: 8, orbit: ()),
          objects: [(shape: Box())])",
    );
    orbit.set_time(2.0);
    assert_eq!(orbit.camera().position, DVec3::new(1.0, 4.0, 2.0));
    assert_eq!(orbit.camera().target, DVec3::X);
}

#[test]
fn odd_motions_stand_still_and_missing_parts_are_passed_over() {
    let rest = moving();
    let place = rest.objects()[0].author_from_mesh;
    let light: Light = rest.lights()[0];
    for (axis, degrees_per_second) in [
        (DVec3::ZERO, 50.0),
        (DVec3::NAN, 50.0),
        (DVec3::Z, f64::NAN),
        (DVec3::Z, f64::INFINITY),
    ] {
        let turn = Turn {
            axis,
            center: DVec3::ONE,
            degrees_per_second,
        };
        let mut scene = rest.clone();
        scene.set_animation(Some(
            Animation::new(Timing::default())
                .orbit_camera(*rest.camera(), turn)
                .orbit_light(0, light, turn)
                .orbit_light(99, light, turn)
                .spin(0, place, turn)
                .spin(99, place, turn),
        ));
        scene.set_time(1.0);
        assert_same(&scene, &rest);
        assert_eq!(scene.revisions(), rest.revisions());
    }
}

/// Renders frames at `numbers` tenths of a second with one engine, in that order.
fn film(numbers: &[u32], budget: Budget, size: [u32; 2]) -> Vec<Frame> {
    let mut scene = moving();
    let options = EngineOptions {
        threads: Some(1),
        ..EngineOptions::default()
    };
    let mut engine = Engine::with_options(&scene, options).expect("an engine");
    let frame = |&number: &u32| {
        let mut frame = Frame::new(size[0], size[1]);
        scene.set_time(f64::from(number) / 10.0);
        engine.forget();
        engine.render(&scene, budget, &mut frame);
        frame
    };
    numbers.iter().map(frame).collect()
}

#[test]
fn a_frame_is_the_same_whichever_came_before_it() {
    for budget in [Budget::Work(60_000), Budget::Unlimited] {
        let forward = film(&[0, 1, 2, 3, 4, 5], budget, [120, 80]);
        let backward = film(&[5, 4, 2, 2, 3, 1, 0], budget, [120, 80]);
        for (number, other) in [(5, 0), (4, 1), (2, 2), (2, 3), (3, 4), (1, 5), (0, 6)] {
            assert!(
                forward[number].pixels() == backward[other].pixels(),
                "{budget:?}: frame {number}"
            );
        }
        let distinct = forward
            .windows(2)
            .all(|pair| pair[0].pixels() != pair[1].pixels());
        assert!(distinct, "nothing moves");
    }
}

fn timing(frames: u32, fps: &str) -> Timing {
    let rate: FrameRate = fps.parse().expect("a rate");
    let timing = Timing::new(rate.seconds(frames), rate).expect("a film");
    assert_eq!(timing.frames(), frames);
    timing
}

fn rgb(frame: &Frame) -> Vec<u8> {
    frame
        .pixels()
        .iter()
        .flat_map(|p| p[..3].to_vec())
        .collect()
}

#[test]
fn an_apng_file_holds_the_frames() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("film.apng");
    let frames = film(&[0, 3, 6, 9, 12], Budget::from_millis(0.0), [61, 37]);
    let mut film = ApngWriter::create(&path, 61, 37, &timing(5, "29.97")).expect("writable");
    for frame in &frames {
        assert!(!path.exists(), "it has its name before it is finished");
        film.write(frame).expect("writable");
    }
    film.finish().expect("writable");

    let file = BufReader::new(fs::File::open(&path).expect("written"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG file");
    let control = reader.info().animation_control.expect("animated");
    assert_eq!((control.num_frames, control.num_plays), (5, 0));
    let mut pixels = vec![0; reader.output_buffer_size().expect("small")];
    for frame in &frames {
        reader.next_frame(&mut pixels).expect("a frame");
        let control = reader.info().frame_control.expect("timed");
        assert_eq!((control.delay_num, control.delay_den), (1001, 30_000));
        assert!(pixels == rgb(frame));
    }
    assert!(reader.next_frame(&mut pixels).is_err(), "a frame too many");
}

#[test]
fn unfinished_films_leave_nothing_and_keep_what_was_there() {
    let directory = tempfile::tempdir().expect("a directory");
    let names = || -> Vec<_> {
        fs::read_dir(directory.path())
            .expect("readable")
            .map(|e| e.expect("readable").file_name())
            .collect()
    };
    let path = directory.path().join("film");
    fs::write(&path, "older").expect("writable");
    let (frame, timing) = (Frame::new(8, 6), timing(3, "25"));
    let create = || ApngWriter::create(&path, 8, 6, &timing).expect("writable");

    let mut dropped = create();
    dropped.write(&frame).expect("writable");
    drop(dropped);
    let mut short = create();
    short.write(&frame).expect("writable");
    assert!(short.finish().is_err(), "two frames are missing");
    let mut long = create();
    for _ in 0..3 {
        long.write(&frame).expect("writable");
    }
    assert!(long.write(&frame).is_err(), "one frame too many");
    drop(long);
    assert!(create().write(&Frame::new(6, 8)).is_err(), "another size");
    let mut y4m = Y4mFile::create(&path, 8, 6, &timing).expect("writable");
    y4m.write(&frame).expect("writable");
    drop(y4m);

    assert_eq!(fs::read(&path).expect("readable"), b"older");
    assert_eq!(names(), ["film"]);
}

/// Header and frames of a YUV4MPEG2 file, each frame its three planes.
fn read_y4m(path: &Path, plane: usize) -> (String, Vec<[Vec<u8>; 3]>) {
    let bytes = fs::read(path).expect("written");
    let end = bytes.iter().position(|&b| b == b'\n').expect("a header");
    let mut rest = &bytes[end + 1..];
    let mut frames = Vec::new();
    while !rest.is_empty() {
        rest = rest.strip_prefix(b"FRAME\n").expect("a frame");
        frames.push([0, 1, 2].map(|i| rest[i * plane..][..plane].to_vec()));
        rest = &rest[3 * plane..];
    }
    let header = String::from_utf8(bytes[..end].to_vec());
    (header.expect("text"), frames)
}

#[test]
fn a_y4m_file_holds_the_frames() {
    let directory = tempfile::tempdir().expect("a directory");
    // Odd sizes, one with the weights of small films, one with those of large films.
    for (width, height, [kr, kb]) in [(61, 37, [0.299, 0.114]), (1281, 3, [0.2126, 0.0722])] {
        let path = directory.path().join("film.y4m");
        let frames = film(&[0, 5, 9], Budget::from_millis(0.0), [width, height]);
        let mut film =
            Y4mFile::create(&path, width, height, &timing(3, "29.97")).expect("writable");
        for frame in &frames {
            film.write(frame).expect("writable");
        }
        film.finish().expect("writable");

        let (header, read) = read_y4m(&path, (width * height) as usize);
        assert_eq!(
            header,
            format!(
                "YUV4MPEG2 W{width} H{height} F30000:1001 Ip A1:1 C444 XYSCSS=444 XCOLORRANGE=LIMITED"
            )
        );
        assert_eq!(read.len(), 3);
        for (planes, frame) in read.iter().zip(&frames) {
            // Back to R'G'B' as a player does it. Half a code of rounding in each plane is at most two codes.
            let pixels = frame.pixels().iter().enumerate();
            for (i, &[r, g, b, _]) in pixels {
                let [y, cb, cr] = [0, 1, 2].map(|p| f64::from(planes[p][i]));
                let luma = (y - 16.0) / 219.0 * 255.0;
                let blue = luma + (cb - 128.0) / 112.0 * 255.0 * (1.0 - kb);
                let red = luma + (cr - 128.0) / 112.0 * 255.0 * (1.0 - kr);
                let green = (luma - kr * red - kb * blue) / (1.0 - kr - kb);
                for (decoded, code) in [(red, r), (green, g), (blue, b)] {
                    let off = decoded - f64::from(code);
                    assert!(off.abs() <= 2.0, "pixel {i}: {off}");
                }
            }
        }
    }
}
