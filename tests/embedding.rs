//! Rendering into memory, pools and threads of the caller.

use specula::frame::Outcome;
use specula::geometry::screen::MAX_IMAGE_SIDE;
use specula::output::{ChannelOrder, Target};
use specula::scene::Camera;
use specula::{BackendKind, Budget, Engine, EngineOptions, Frame, FrameStats, Method, Scene};
use std::sync::{Arc, Barrier, mpsc};
use std::time::Duration;

const WIDTH: u32 = 150;
const HEIGHT: u32 = 100;

fn scene() -> Scene {
    Scene::parse(
        "(
            objects: [
                (shape: Teapot(tessellation: 3)),
                (shape: Plane(width: 4, depth: 4)),
            ],
        )",
        "embedding.ron",
    )
    .expect("a valid scene")
}

fn options(threads: usize) -> EngineOptions {
    EngineOptions {
        threads: Some(threads),
        ..EngineOptions::default()
    }
}

fn engine(scene: &Scene, options: EngineOptions) -> Engine {
    Engine::with_options(scene, options).expect("an engine")
}

/// A camera that is somewhere else in every frame.
fn turned(camera: &Camera, frame: usize) -> Camera {
    let mut camera = *camera;
    camera.position.x += frame as f64 * 0.05;
    camera
}

/// What the frame shows, as bytes in rows.
fn expected(scene: &Scene, budget: Budget) -> Frame {
    let mut frame = Frame::new(WIDTH, HEIGHT);
    engine(scene, options(1)).render(scene, budget, &mut frame);
    frame
}

#[test]
fn a_callers_buffer_gets_the_same_pixels_and_its_gaps_are_left_alone() {
    let scene = scene();
    let frame = expected(&scene, Budget::Work(100_000));
    let stride = WIDTH as usize * 4 + 37;
    for threads in [1, 2] {
        for order in [ChannelOrder::Rgba, ChannelOrder::Bgra] {
            // The last row has no gap behind it, and the buffer begins and ends in guarded bytes.
            let needed = stride * (HEIGHT as usize - 1) + WIDTH as usize * 4;
            let mut bytes = vec![0xA5_u8; needed + 200];
            let target = Target::with_stride(&mut bytes[100..], WIDTH, HEIGHT, stride)
                .expect("there is room")
                .with_order(order);
            let stats =
                engine(&scene, options(threads)).render_into(&scene, Budget::Work(100_000), target);
            assert_eq!(stats.pixels_written, u64::from(WIDTH * HEIGHT));
            let (before, rest) = bytes.split_at(100);
            let (image, after) = rest.split_at(needed);
            assert!(before.iter().chain(after).all(|&byte| byte == 0xA5));
            for (row, pixels) in image
                .chunks(stride)
                .zip(frame.pixels().chunks(WIDTH as usize))
            {
                let (row, gap) = row.split_at(WIDTH as usize * 4);
                assert!(gap.iter().all(|&byte| byte == 0xA5));
                for (bytes, &[r, g, b, a]) in row.chunks(4).zip(pixels) {
                    match order {
                        ChannelOrder::Rgba => assert_eq!(bytes, [r, g, b, a]),
                        ChannelOrder::Bgra => assert_eq!(bytes, [b, g, r, a]),
                    }
                }
            }
        }
    }
}

#[test]
fn a_buffer_of_any_age_ends_up_with_the_current_image() {
    let mut scene = scene();
    let camera = *scene.camera();
    // As a window system does it: a ring of buffers, each used again when it is so many frames old.
    for ring in [1_usize, 2, 3, 15, 16, 17, 20] {
        let mut tested = engine(&scene, options(1));
        let mut twin = engine(&scene, options(1));
        let mut buffers = vec![vec![0_u8; (WIDTH * HEIGHT * 4) as usize]; ring];
        let mut written = 0;
        for frame in 0..2 * ring + 5 {
            // Still for three frames, moved, still again.
            scene.set_camera(turned(&camera, frame / 4));
            let age = if frame < ring { 0 } else { ring as u32 };
            let buffer = &mut buffers[frame % ring];
            let target = Target::new(buffer, WIDTH, HEIGHT)
                .expect("there is room")
                .with_age(age);
            let stats = tested.render_into(&scene, Budget::Work(30_000), target);
            written += stats.pixels_written;
            let mut whole = Frame::new(WIDTH, HEIGHT);
            twin.render(&scene, Budget::Work(30_000), &mut whole);
            assert!(*buffer == whole.as_bytes(), "ring {ring}, frame {frame}");
        }
        let all = u64::from(WIDTH * HEIGHT) * (2 * ring as u64 + 5);
        if ring <= 3 {
            assert!(written < all, "ring {ring}: {written} of {all}");
        }
        if ring > 16 {
            assert_eq!(written, all, "ring {ring}");
        }
    }
}

#[test]
fn only_what_a_buffer_lacks_is_written() {
    let mut scene = scene();
    let camera = *scene.camera();
    let mut engine = engine(&scene, options(1));
    let mut bytes = vec![0_u8; (WIDTH * HEIGHT * 4) as usize];
    let mut render = |scene: &Scene, bytes: &mut [u8], age: u32| {
        let target = Target::new(bytes, WIDTH, HEIGHT)
            .expect("there is room")
            .with_age(age);
        let stats = engine.render_into(scene, Budget::Unlimited, target);
        stats.pixels_written
    };
    let all = u64::from(WIDTH * HEIGHT);
    assert_eq!(render(&scene, &mut bytes, 0), all);
    assert_eq!(render(&scene, &mut bytes, 1), 0, "a converged image");
    assert_eq!(render(&scene, &mut bytes, 2), 0, "the same two frames ago");
    assert_eq!(render(&scene, &mut bytes, 0), all, "nothing is known");
    for _ in 0..20 {
        assert_eq!(render(&scene, &mut bytes, 1), 0);
    }
    assert_eq!(render(&scene, &mut bytes, 16), 0);
    assert_eq!(render(&scene, &mut bytes, 17), all, "older than remembered");
    scene.set_camera(turned(&camera, 1));
    assert!(render(&scene, &mut bytes, 1) > 0);
    let converged = expected(&scene, Budget::Unlimited);
    assert!(bytes == converged.as_bytes());
}

#[test]
fn an_engine_may_move_between_threads_and_run_in_the_callers_pool() {
    fn is_send<T: Send>(_: &T) {}
    let scene = scene();
    let wanted = expected(&scene, Budget::Work(200_000));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
    let pool = Arc::new(pool.expect("a pool"));
    let mut engine = engine(
        &scene,
        EngineOptions {
            pool: Some(Arc::clone(&pool)),
            method: Method::Adaptive,
            ..EngineOptions::default()
        },
    );
    is_send(&engine);
    assert_eq!(engine.threads(), 2);
    let outside = {
        let mut frame = Frame::new(WIDTH, HEIGHT);
        engine.render(&scene, Budget::Work(200_000), &mut frame);
        frame
    };
    assert!(outside.pixels() == wanted.pixels());
    engine.forget();
    // From another thread, and from inside the pool.
    let inside = std::thread::scope(|scope| {
        let render = || {
            let mut frame = Frame::new(WIDTH, HEIGHT);
            pool.install(|| engine.render(&scene, Budget::Work(200_000), &mut frame));
            frame
        };
        scope.spawn(render).join().expect("no panic")
    });
    assert!(inside.pixels() == wanted.pixels());
}

#[test]
fn warming_up_changes_nothing_but_time() {
    let scene = scene();
    let film = |engine: &mut Engine, bytes: &mut [u8], age: u32| -> Vec<(u64, u64)> {
        let frame = |number: u32| {
            let age = if number == 0 { age } else { 1 };
            let target = Target::new(bytes, WIDTH, HEIGHT).expect("there is room");
            let stats = engine.render_into(&scene, Budget::Work(50_000), target.with_age(age));
            (stats.frame, stats.work_units)
        };
        (0..3).map(frame).collect()
    };
    let blank = vec![0_u8; (WIDTH * HEIGHT * 4) as usize];
    let (mut expected, mut bytes) = (blank.clone(), blank);
    let frames = film(&mut engine(&scene, options(1)), &mut expected, 0);
    let mut warm = engine(&scene, options(1));
    warm.warm_up(&scene, WIDTH, HEIGHT);
    assert_eq!(film(&mut warm, &mut bytes, 0), frames);
    assert!(bytes == expected);
    // The buffer does not hold what was rendered to warm up.
    bytes.fill(0);
    warm.warm_up(&scene, WIDTH, HEIGHT);
    let again = film(&mut warm, &mut bytes, 1);
    assert_eq!(again[0], (frames[2].0 + 1, frames[0].1));
    assert!(bytes == expected);
}

#[test]
fn a_frame_that_is_too_large_is_left_alone_by_every_backend() {
    let scene = scene();
    for backend in BackendKind::ALL {
        let options = EngineOptions {
            backend,
            ..options(1)
        };
        let mut engine = engine(&scene, options);
        let most = MAX_IMAGE_SIDE;
        for (width, height, is_drawn) in [
            (most, 2, true),
            (most + 1, 2, false),
            (2, u32::from(u16::MAX), false),
        ] {
            let mut frame = Frame::new(width, height);
            frame.pixels_mut().fill([1, 2, 3, 4]);
            engine.render(&scene, Budget::Work(0), &mut frame);
            let is_untouched = frame.pixels().iter().all(|&pixel| pixel == [1, 2, 3, 4]);
            assert_eq!(is_untouched, !is_drawn, "{backend}, {width}x{height}");
        }
    }
}

/// What `render` does while all threads of its pool are busy with something else; `None` if it waits for them.
fn while_the_pool_is_busy(
    pool: &Arc<rayon::ThreadPool>,
    render: impl FnOnce() -> FrameStats + Send + 'static,
) -> Option<FrameStats> {
    let threads = pool.current_num_threads();
    // Everybody but the pool's threads has to say when they may go on.
    let all_busy = Arc::new(Barrier::new(threads + 1));
    let go_on = Arc::new(Barrier::new(threads + 1));
    for _ in 0..threads {
        let (all_busy, go_on) = (Arc::clone(&all_busy), Arc::clone(&go_on));
        pool.spawn(move || {
            all_busy.wait();
            go_on.wait();
        });
    }
    all_busy.wait();
    let (send, receive) = mpsc::channel();
    let thread = std::thread::spawn(move || send.send(render()).is_ok());
    // Long enough for any machine; it is waited for only when the test fails.
    let stats = receive.recv_timeout(Duration::from_secs(20)).ok();
    go_on.wait();
    let _ = thread.join();
    stats
}

#[test]
fn frames_with_nothing_to_share_do_not_wait_for_the_pool() {
    let scene = scene();
    for (method, size) in [
        (Method::Gouraud, [400, 300]),
        (Method::Adaptive, [400, 300]),
        // So small that even drawing it is not shared.
        (Method::Gouraud, [32, 32]),
    ] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
        let pool = Arc::new(pool.expect("a pool"));
        let options = EngineOptions {
            method,
            pool: Some(Arc::clone(&pool)),
            ..EngineOptions::default()
        };
        let mut engine = engine(&scene, options);
        let mut frame = Frame::new(size[0], size[1]);
        let is_tiny = size == [32, 32];
        if !is_tiny {
            while !engine
                .render(&scene, Budget::Unlimited, &mut frame)
                .converged
            {}
            engine.render(&scene, Budget::Unlimited, &mut frame);
        }
        let scene = scene.clone();
        let render = move || engine.render(&scene, Budget::Unlimited, &mut frame);
        let stats = while_the_pool_is_busy(&pool, render).expect("no thread of the pool is needed");
        let want = if is_tiny {
            Outcome::Complete
        } else {
            Outcome::Unchanged
        };
        assert_eq!(stats.outcome, want, "{method} {size:?}");
    }
}
