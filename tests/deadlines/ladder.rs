//! Images over several frames: whole, of one moment, and said to be as old as they are.

use crate::common::*;
use specula::frame::Outcome;
use specula::glam::DMat4;
use specula::schedule::FrameRecord;
use specula::{Budget, Frame, FrameStats, Method, Scene};

/// The budget is over after some eight readings, so an image takes several frames.
const STEP_US: f64 = 100.0;
const BUDGET: Budget = Budget::Millis(0.8);

/// How many frames ago the scene and camera were those of the image shown.
fn age(stats: &FrameStats) -> Option<u64> {
    match stats.outcome {
        Outcome::Stale { age } => age,
        _ => Some(0),
    }
}

/// A run of frames that are checked against new engines' images.
struct Run {
    method: Method,
    engine: specula::Engine,
    frame: Frame,
    /// The scene of every frame so far.
    scenes: Vec<Scene>,
    stale: usize,
    current: usize,
    background: usize,
}

impl Run {
    fn new(scene: &Scene, method: Method, threads: usize) -> Self {
        let clock = CountingClock::stepping(STEP_US);
        Self {
            method,
            engine: engine(scene, options(method, threads, clock)),
            frame: Frame::new(SIZE[0], SIZE[1]),
            scenes: Vec::new(),
            stale: 0,
            current: 0,
            background: 0,
        }
    }

    /// Renders a frame, now and then into memory that has not been there before.
    fn render(&mut self, scene: &Scene) -> FrameStats {
        let number = self.scenes.len();
        if number % 3 == 2 {
            self.frame = Frame::new(SIZE[0], SIZE[1]);
        }
        let stats = self.engine.render(scene, BUDGET, &mut self.frame);
        self.scenes.push(scene.clone());
        let what = format!("{}, frame {number}: {stats:?}", self.method);
        match age(&stats) {
            None => {
                self.background += 1;
                assert_eq!(self.stale + self.current, 0, "there was an image: {what}");
                let of = &self.scenes[0];
                assert!(
                    [of, scene]
                        .iter()
                        .any(|of| self.frame.pixels() == background(of, SIZE)),
                    "{what}"
                );
            }
            Some(age) => {
                let of = &self.scenes[number - age as usize];
                let want = fresh(of, self.method, SIZE, stats.divisor);
                assert!(self.frame.pixels() == want, "{what}");
                *if age > 0 {
                    &mut self.stale
                } else {
                    &mut self.current
                } += 1;
            }
        }
        stats
    }

    /// Renders until the image is final, which it has to be at full resolution.
    fn finish(&mut self, scene: &Scene) {
        for _ in 0..200 {
            let stats = self.render(scene);
            if stats.converged {
                assert_eq!((stats.divisor, age(&stats)), (1, Some(0)));
                return;
            }
        }
        panic!("{}: not final after 200 frames", self.method);
    }
}

#[test]
fn an_image_over_several_frames_is_of_one_moment_and_as_old_as_is_said() {
    let scene = mixed();
    for (method, threads) in [
        (Method::Gouraud, 1),
        (Method::Gouraud, 2),
        (Method::Phong, 1),
    ] {
        let mut run = Run::new(&scene, method, threads);
        for step in 0..60 {
            run.render(&turned(&scene, step));
        }
        assert!(
            run.background > 0 && run.stale > 5 && run.current + run.stale > 20,
            "{method}: {} without an image, {} with an old one, {} with the one asked for",
            run.background,
            run.stale,
            run.current
        );
        run.finish(&turned(&scene, 59));
    }
}

#[test]
fn ages_count_from_the_last_frame_that_an_image_was_right_for() {
    let scene = mixed();
    let mut run = Run::new(&scene, Method::Gouraud, 1);
    run.finish(&scene);
    for _ in 0..5 {
        run.render(&scene);
    }
    let stats = run.render(&turned(&scene, 7));
    assert_eq!(stats.outcome, Outcome::Stale { age: Some(1) }, "{stats:?}");
    // It goes on counting while the new image is in the making.
    for expected in 2..30 {
        let stats = run.render(&turned(&scene, 7));
        if age(&stats) == Some(0) {
            assert!(expected > 2, "the image took several frames");
            return;
        }
        assert_eq!(age(&stats), Some(expected), "{stats:?}");
    }
    panic!("the image does not come");
}

#[test]
fn a_cut_and_changes_of_the_scene_in_the_middle_of_an_image_do_no_harm() {
    let scene = mixed();
    let change = |number: usize, scene: &mut Scene| match number {
        0 => *scene = turned(scene, 20),
        1 => scene.set_transform(1, DMat4::from_translation((1.0, -4.0, 1.5).into())),
        2 => {
            let mut light = scene.lights()[0];
            light.radiance = [0.1, 0.9, 0.3];
            scene.set_light(0, light);
        }
        3 => {
            let mut object = scene.objects()[1].clone();
            object.author_from_mesh = DMat4::from_translation((2.5, -2.0, 0.5).into());
            scene.add_object(object);
        }
        4 => scene.set_background([0.9, 0.1, 0.1]),
        5 => scene.set_objects(scene.objects()[..2].to_vec()),
        _ => {
            let mut material = scene.materials()[0];
            material.shininess = 5.0;
            scene.set_material(0, material);
        }
    };
    for method in [Method::Gouraud, Method::Phong] {
        for number in 0..7 {
            // So many frames after the image has been begun.
            for delay in 0..5 {
                let mut run = Run::new(&scene, method, 1);
                let mut now = scene.clone();
                if delay != 4 {
                    run.finish(&now);
                    now = turned(&now, 3);
                }
                for _ in 0..delay {
                    run.render(&now);
                }
                change(number, &mut now);
                run.finish(&now);
            }
        }
    }
}

#[test]
fn refined_images_end_up_the_same_when_the_scene_changes_under_way() {
    let scene = mixed();
    for method in [Method::Adaptive, Method::PhongArea] {
        let mut changed = turned(&scene, 3);
        let mut light = changed.lights()[0];
        light.radiance = [0.1, 0.9, 0.3];
        changed.set_light(0, light);
        let want = converged(&changed, method);
        for delay in 0..12 {
            let clock = CountingClock::stepping(STEP_US);
            let mut engine = engine(&scene, options(method, 1, clock));
            let mut frame = Frame::new(SIZE[0], SIZE[1]);
            for _ in 0..delay {
                engine.render(&scene, BUDGET, &mut frame);
            }
            finish(&mut engine, &changed, BUDGET, &mut frame);
            assert!(frame.pixels() == want, "{method} after {delay} frames");
        }
    }
}

#[test]
fn an_old_image_of_another_size_is_not_shown() {
    let scene = mixed();
    let clock = CountingClock::stepping(STEP_US);
    let mut engine = engine(&scene, options(Method::Gouraud, 1, clock));
    for size in [SIZE, [131, 77], [1, 1], SIZE, [64, 200]] {
        let mut frame = Frame::new(size[0], size[1]);
        let mut stats = engine.render(&scene, BUDGET, &mut frame);
        if stats.divisor == 1 && age(&stats) != Some(0) {
            assert_eq!(
                stats.outcome,
                Outcome::Stale { age: None },
                "{size:?}: {stats:?}"
            );
            assert!(frame.pixels() == background(&scene, size), "{size:?}");
        }
        stats = finish(&mut engine, &scene, BUDGET, &mut frame);
        assert!(
            frame.pixels() == fresh(&scene, Method::Gouraud, size, 1),
            "{size:?}: {stats:?}"
        );
    }
    let mut none = Frame::new(0, 0);
    for _ in 0..20 {
        let stats = engine.render(&scene, BUDGET, &mut none);
        assert!(stats.frame_ms.is_finite());
    }
}

/// The picture of a view may still be there when another one has been shown in between, at another resolution.
#[test]
fn a_view_comes_back_after_another_one_at_a_lower_resolution() {
    let scene = mixed();
    let other = turned(&scene, 5);
    for divisors in [[1, 2, 1], [2, 1, 2], [1, 3, 2], [2, 2, 1]] {
        let mut engine = timeless(&scene, Method::Gouraud);
        let mut frame = Frame::new(SIZE[0], SIZE[1]);
        for (scene, divisor) in [&scene, &other, &scene].into_iter().zip(divisors) {
            let stats = engine.render(scene, first_image_at(divisor), &mut frame);
            assert_eq!(age(&stats), Some(0), "{divisors:?}: {stats:?}");
            let want = fresh(scene, Method::Gouraud, SIZE, stats.divisor);
            assert!(
                frame.pixels() == want,
                "{divisors:?}, by {divisor}: {stats:?}"
            );
        }
    }
}

#[test]
fn an_image_that_is_old_or_not_there_is_not_final() {
    let scene = mixed();
    for method in Method::ALL {
        let mut engine = timeless(&scene, method);
        let mut frame = Frame::new(SIZE[0], SIZE[1]);
        engine.cancel_token().cancel();
        let stats = engine.render(&scene, BUDGET, &mut frame);
        assert_eq!(
            (stats.outcome, stats.converged),
            (Outcome::Stale { age: None }, false)
        );
        engine.cancel_token().reset();
        assert!(
            engine
                .render(&scene, Budget::Unlimited, &mut frame)
                .converged
        );
        engine.cancel_token().cancel();
        for age in 1..4 {
            let stats = engine.render(&turned(&scene, age), BUDGET, &mut frame);
            let what = format!("{method}: {stats:?}");
            assert_eq!(stats.outcome, Outcome::Stale { age: Some(age) }, "{what}");
            assert!(!stats.converged, "{what}");
        }
    }
}

/// Looking at the clock takes longer than there is time, as placing objects may.
#[test]
fn images_come_about_even_if_every_frame_is_late_from_the_start() {
    let scene = mixed();
    for method in [Method::Gouraud, Method::Phong, Method::Adaptive] {
        for (us, budget_ms) in [(500.0, 0.8), (1000.0, 0.5), (3000.0, 0.001)] {
            for is_moving in [false, true] {
                let clock = CountingClock::stepping(us);
                let mut engine = engine(&scene, options(method, 1, clock));
                let mut frame = Frame::new(SIZE[0], SIZE[1]);
                let mut images = 0;
                let mut now = scene.clone();
                for step in 0..600 {
                    if is_moving {
                        let place =
                            DMat4::from_translation((1.0, -4.0, 0.01 * f64::from(step)).into());
                        now.set_transform(1, place);
                    }
                    images += engine
                        .render(&now, Budget::Millis(budget_ms), &mut frame)
                        .record
                        .images;
                }
                let least = if is_moving { 2 } else { 1 };
                assert!(
                    images >= least,
                    "{method}, {us} us a reading, moving: {is_moving}: {images} images"
                );
            }
        }
    }
}

/// Along an axis the view's matrix has zeros of both signs.
#[test]
fn a_camera_along_an_axis_has_a_view_like_any_other() {
    let scene = mixed();
    for position in [
        (0.0, -8.0, 1.0),
        (8.0, 0.0, 1.0),
        (0.0, 8.0, 1.0),
        (0.0, 0.0, 9.0),
    ] {
        let mut scene = scene.clone();
        let mut camera = *scene.camera();
        camera.position = position.into();
        scene.set_camera(camera);
        for divisor in 1..=4 {
            let mut engine = timeless(&scene, Method::Adaptive);
            let mut frame = Frame::new(SIZE[0], SIZE[1]);
            let stats = engine.render(&scene, first_image_at(divisor), &mut frame);
            assert_eq!(age(&stats), Some(0), "{position:?}, {divisor}: {stats:?}");
            let stats = engine.render(&scene, Budget::Unlimited, &mut frame);
            assert!(stats.converged, "{position:?}, {divisor}: {stats:?}");
        }
    }
}

/// A resolution that changes from frame to frame, while no image is completed in one.
#[test]
fn another_divisor_leaves_the_image_before_where_it_is() {
    let scene = mixed();
    let mut engine = timeless(&scene, Method::Gouraud);
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    for (number, divisor) in (0..).zip([4, 3, 2, 3, 3, 4, 1, 2, 2, 1]) {
        let now = turned(&scene, number);
        // What is in hand may be completed first.
        let both = Budget::Replay(FrameRecord {
            divisor,
            images: 2,
            ..FrameRecord::default()
        });
        engine.render(&now, both, &mut frame);
        let want = fresh(&now, Method::Gouraud, SIZE, divisor);
        assert!(frame.pixels() == want, "{number}");
        for (age, begun) in (1..).zip([3, 2, 4, 1]) {
            let budget = Budget::Replay(FrameRecord {
                divisor: begun,
                is_image_begun: true,
                ..FrameRecord::default()
            });
            let mut other = Frame::new(SIZE[0], SIZE[1]);
            let stats = engine.render(&turned(&scene, 30 + age), budget, &mut other);
            assert_eq!(
                stats.outcome,
                Outcome::Stale { age: Some(age) },
                "{number}, {begun}"
            );
            assert_eq!(stats.divisor, divisor);
            assert!(other.pixels() == want, "{number}, {begun}");
        }
    }
}
