//! Images in linear light: right where those in sRGB are, measured in codes of their own.

use specula::geometry::screen::MAX_IMAGE_SIDE;
use specula::measure::{ErrorReport, ReferenceImage};
use specula::output::apng::ApngWriter;
use specula::output::y4m::Y4mWriter;
use specula::output::{Encoding, FrameRate, Target, Timing};
use specula::scene::World;
use specula::{BackendKind, Budget, Engine, EngineOptions, Frame, FrameStats, Method, Scene};

const SIZE: (u32, u32) = (240, 160);

/// Dark, bright and overexposed, smooth and with creases.
const SCENE: &str = r##"(
    camera: Perspective(position: (3.0, -7.0, 4.0), target: (0.0, 0.0, 0.7), fov_degrees: 40.0),
    background: "#4060a0",
    ambient: (0.02, 0.02, 0.03),
    lights: [
        Point(position: (4.0, -5.0, 6.0)),
        Point(position: (-4.0, 3.0, 5.0), intensity: 0.6),
        Directional(direction: (-0.3, 0.6, -1.0), intensity: 0.4),
    ],
    materials: {
        "dark": (diffuse: (0.03, 0.01, 0.02), specular: (0.3, 0.3, 0.3), shininess: 60.0),
        "bright": (diffuse: (0.8, 0.75, 0.6), specular: (0.6, 0.6, 0.6), shininess: 30.0),
    },
    objects: [
        (shape: Teapot(tessellation: 3), material: "dark"),
        (shape: Sphere(slices: 12, stacks: 8), material: "bright", position: (-2.0, -2.0, 0.8)),
        (shape: Plane(width: 12.0, depth: 12.0, columns: 2, rows: 2), material: "bright"),
    ],
)"##;

fn scene() -> Scene {
    Scene::parse(SCENE, "encoding.ron").expect("the scene is valid")
}

/// A bright floor under many weak lights: each can be left out by itself, and their sum cannot.
fn many_weak_lights() -> Scene {
    let lights: String = (0..40)
        .map(|i| {
            let angle = f64::from(i) * 0.4;
            let (x, y, z) = (
                6.0 * angle.cos(),
                6.0 * angle.sin(),
                1.5 + 0.1 * f64::from(i),
            );
            format!("Point(position: ({x}, {y}, {z}), intensity: 0.03),")
        })
        .collect();
    let text = format!(
        "(
            camera: Perspective(position: (0.0, -9.0, 6.0), target: (0.0, 0.0, 0.0)),
            ambient: (0.3, 0.3, 0.3),
            lights: [{lights}],
            materials: {{\"floor\": (diffuse: (0.9, 0.9, 0.9), specular: (0.3, 0.3, 0.3), shininess: 8.0)}},
            objects: [(shape: Plane(width: 10.0, depth: 10.0, columns: 9, rows: 9), material: \"floor\")],
        )"
    );
    Scene::parse(&text, "lights.ron").expect("the scene is valid")
}

fn options(method: Method, encoding: Encoding) -> EngineOptions {
    EngineOptions {
        method,
        encoding,
        threads: Some(1),
        ..EngineOptions::default()
    }
}

fn render(scene: &Scene, options: EngineOptions) -> (Frame, FrameStats) {
    let mut engine = Engine::with_options(scene, options).expect("the options are valid");
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    let stats = engine.render(scene, Budget::Unlimited, &mut frame);
    (frame, stats)
}

fn reference(scene: &Scene, encoding: Encoding) -> ReferenceImage {
    let world = World::new(scene);
    let view = world.view(scene.camera(), SIZE.0, SIZE.1);
    ReferenceImage::render(&world, &view.with_encoding(encoding), 2)
}

#[test]
fn phong_and_converged_images_are_within_a_linear_code_of_the_reference() {
    for scene in [scene(), many_weak_lights()] {
        let reference = reference(&scene, Encoding::Linear);
        for method in [Method::Phong, Method::Adaptive, Method::PhongArea] {
            let (frame, stats) = render(&scene, options(method, Encoding::Linear));
            assert!(stats.converged && frame.encoding() == Encoding::Linear);
            let error = ErrorReport::compare(&frame, &reference).expect("both linear");
            assert!(
                error.covered_pixels > 5000 && error.max <= 1,
                "{method}: {error:?}"
            );
            for (index, &[r, g, b, _]) in frame.pixels().iter().enumerate() {
                if !reference.is_covered(index) {
                    assert_eq!([r, g, b], reference.pixels[index], "{method}");
                }
            }
        }
    }
}

#[test]
fn something_is_proved_right_in_linear_light_too() {
    let (_, stats) = render(
        &many_weak_lights(),
        options(Method::Adaptive, Encoding::Linear),
    );
    assert!(stats.skipped.light_terms > 0, "{stats:?}");
}

#[test]
fn skia_converges_in_linear_light_as_it_does_in_srgb() {
    let scene = scene();
    let shares = Encoding::ALL.map(|encoding| {
        let options = EngineOptions {
            backend: BackendKind::Skia,
            ..options(Method::Adaptive, encoding)
        };
        let (frame, stats) = render(&scene, options);
        assert!(stats.converged);
        let error = ErrorReport::compare(&frame, &reference(&scene, encoding)).expect("alike");
        error.share_above_4
    });
    assert!(shares.iter().all(|&share| share < 0.02), "{shares:?}");
}

/// What is interpolated is light, so the encoding changes how it is stored and nothing else.
#[test]
fn images_in_both_encodings_hold_the_same_light() {
    let scene = scene();
    for method in [Method::Flat, Method::Gouraud, Method::Phong] {
        let [srgb, linear] =
            Encoding::ALL.map(|encoding| render(&scene, options(method, encoding)).0);
        let mut levels = [false; 256];
        for (srgb, linear) in srgb.as_bytes().iter().zip(linear.as_bytes()) {
            // Half a code of rounding, and what encoding itself errs.
            let half = 0.5 + Encoding::Srgb.lanes_error();
            let [low, high] = [-half, half].map(|by| {
                let light = Encoding::Srgb.decode(f64::from(*srgb) + by);
                Encoding::Linear.encode(light)
            });
            let code = f64::from(*linear);
            assert!(
                (low - half..=high + half).contains(&code),
                "{method}: {srgb} in sRGB and {linear} in linear light"
            );
            levels[usize::from(*linear)] = true;
        }
        let levels = levels.iter().filter(|&&is_used| is_used).count();
        assert!(levels > 50, "{method}: {levels} levels");
    }
}

#[test]
fn work_units_buy_the_same_linear_image_for_any_number_of_threads() {
    let scene = scene();
    let images = [1, 3].map(|threads| {
        let options = EngineOptions {
            threads: Some(threads),
            ..options(Method::Adaptive, Encoding::Linear)
        };
        let mut engine = Engine::with_options(&scene, options).expect("a few threads");
        let mut frame = Frame::new(SIZE.0, SIZE.1);
        let units = [0, 300_000, 100_000, 700_000].map(|units| {
            let stats = engine.render(&scene, Budget::Work(units), &mut frame);
            stats.work_units
        });
        (frame.pixels().to_vec(), units)
    });
    assert!(images[0] == images[1]);
}

#[test]
fn a_frame_knows_what_was_rendered_into_it() {
    let scene = scene();
    let engine = |encoding| {
        Engine::with_options(&scene, options(Method::Gouraud, encoding)).expect("one thread")
    };
    let (mut srgb, mut linear) = (engine(Encoding::Srgb), engine(Encoding::Linear));
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    assert_eq!(frame.encoding(), Encoding::Srgb);
    linear.render(&scene, Budget::Unlimited, &mut frame);
    assert_eq!(frame.encoding(), linear.encoding());
    let stored = frame.clone();

    // The same into memory of the caller.
    let mut bytes = vec![0; stored.as_bytes().len()];
    let target = Target::new(&mut bytes, SIZE.0, SIZE.1).expect("large enough");
    linear.render_into(&scene, Budget::Unlimited, target);
    assert!(bytes == stored.as_bytes());

    // Engines take turns; and what somebody has converted is written anew.
    srgb.render(&scene, Budget::Unlimited, &mut frame);
    assert_eq!(frame.encoding(), Encoding::Srgb);
    assert!(frame.pixels() != stored.pixels());
    linear.render(&scene, Budget::Unlimited, &mut frame);
    frame.convert(Encoding::Srgb);
    linear.render(&scene, Budget::Unlimited, &mut frame);
    assert_eq!(frame.encoding(), Encoding::Linear);
    assert!(frame.pixels() == stored.pixels());

    // A frame that is too large stays as it is.
    let mut large = Frame::new(MAX_IMAGE_SIDE + 1, 1);
    linear.render(&scene, Budget::Unlimited, &mut large);
    assert_eq!(large.encoding(), Encoding::Srgb);
}

#[test]
fn films_take_srgb_frames_only() {
    let directory = tempfile::tempdir().expect("a directory");
    let rate: FrameRate = "10".parse().expect("a rate");
    let timing = Timing::new(0.2, rate).expect("two frames");
    let mut frame = Frame::new(4, 2);
    frame.set_encoding(Encoding::Linear);
    let reason = "a frame stored as linear in a film, which is srgb";

    let path = directory.path().join("film.apng");
    let mut apng = ApngWriter::create(&path, 4, 2, &timing).expect("writable");
    let error = apng.write(&frame).expect_err("it is linear").to_string();
    assert_eq!(error, format!("cannot write {}: {reason}", path.display()));
    let mut y4m = Y4mWriter::new(Vec::new(), 4, 2, &timing).expect("memory");
    let error = y4m.write(&frame).expect_err("it is linear").to_string();
    assert_eq!(error, reason);
}
