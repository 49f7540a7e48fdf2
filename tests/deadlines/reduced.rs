//! Images of lower resolution.

use crate::common::*;
use specula::backend::software::SoftwareBackend;
use specula::backend::{Backend, BasePaint, Capabilities, Geometry, RasterCounts};
use specula::frame::Outcome;
use specula::geometry::Vec3s;
use specula::illumination::VertexSet;
use specula::output::{ChannelOrder, Target};
use specula::parallel::Exec;
use specula::{Budget, Engine, Frame, Method, Scene};

/// The first image of a new engine at `divisor`, drawn as an image of its own and enlarged by the definition.
fn enlarged(scene: &Scene, [width, height]: [u32; 2], divisor: u32) -> Vec<[f64; 4]> {
    let size = [width, height].map(|side| side.div_ceil(divisor));
    let world = specula::scene::World::new(scene);
    let view = world.view(scene.camera(), width, height).reduced(divisor);
    let small = first_image(&world, &view);
    let place = |x: u32, len: u32| {
        let at = (f64::from(x) + 0.5) / f64::from(divisor) - 0.5;
        at.clamp(0.0, f64::from(len - 1))
    };
    let mut pixels = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let (u, v) = (place(x, size[0]), place(y, size[1]));
            pixels.push(std::array::from_fn(|channel| {
                let at = |x: usize, y: usize| {
                    let (x, y) = (x.min(size[0] as usize - 1), y.min(size[1] as usize - 1));
                    f64::from(small[y * size[0] as usize + x][channel])
                };
                let (i, j) = (u as usize, v as usize);
                let row = |j| at(i, j) * (1.0 - u.fract()) + at(i + 1, j) * u.fract();
                row(j) * (1.0 - v.fract()) + row(j + 1) * v.fract()
            }));
        }
    }
    pixels
}

/// Draws a view with Gouraud shading, without an engine.
fn first_image(world: &specula::scene::World, view: &specula::scene::View) -> Pixels {
    let exec = Exec::sequential();
    let all = 0..world.triangles.len() as u32;
    let geometry = Geometry {
        world,
        view,
        visible: std::slice::from_ref(&all),
    };
    let mut backend = SoftwareBackend::new();
    backend.rasterize(exec, geometry);
    let (mut set, mut colours) = (VertexSet::default(), Vec3s::default());
    set.illuminate(
        exec,
        world,
        view.eye,
        backend.visible_triangles(),
        &mut colours,
    );
    backend.resolve(exec, geometry, BasePaint::Gouraud(&colours));
    let mut frame = Frame::new(view.width, view.height);
    frame.write(|target| backend.present(exec, target));
    frame.pixels().to_vec()
}

#[track_caller]
fn assert_near(got: &[[u8; 4]], want: &[[f64; 4]], what: &str) {
    assert_eq!(got.len(), want.len(), "{what}");
    for (i, (got, want)) in got.iter().zip(want).enumerate() {
        for channel in 0..4 {
            let difference = (f64::from(got[channel]) - want[channel]).abs();
            // Rounded twice, weights to 256ths.
            assert!(difference <= 2.0, "{what}: {got:?} for {want:?} at {i}");
        }
    }
}

#[test]
fn a_reduced_image_is_the_smaller_one_enlarged() {
    let scene = mixed();
    for size in [SIZE, [257, 131], [3, 1], [1, 1]] {
        for divisor in 2..=4 {
            let mut engine = timeless(&scene, Method::Adaptive);
            let mut frame = Frame::new(size[0], size[1]);
            let stats = engine.render(&scene, first_image_at(divisor), &mut frame);
            assert_eq!((stats.outcome, stats.divisor), (Outcome::Reduced, divisor));
            assert!(!stats.converged, "{stats:?}");
            let what = format!("{size:?} by {divisor}");
            assert_near(frame.pixels(), &enlarged(&scene, size, divisor), &what);
        }
    }
}

#[test]
fn a_still_view_gets_its_full_resolution_and_ends_up_the_same() {
    let scene = mixed();
    for size in [SIZE, [257, 131], [1, 1], [0, 0], [0, 7]] {
        let mut want = Frame::new(size[0], size[1]);
        timeless(&scene, Method::Adaptive).render(&scene, Budget::Unlimited, &mut want);
        let mut engine = timeless(&scene, Method::Adaptive);
        let mut frame = Frame::new(size[0], size[1]);
        engine.render(&scene, first_image_at(3), &mut frame);
        let stats = engine.render(&scene, Budget::Unlimited, &mut frame);
        assert!(stats.converged && stats.divisor == 1, "{size:?}: {stats:?}");
        assert!(frame.pixels() == want.pixels(), "{size:?}");
    }
}

#[test]
fn pixels_that_take_too_long_are_drawn_fewer_of() {
    // A reading is short, and the costs known say that a full image takes far longer than the budget: so all depends on the ladder.
    let scene = mixed();
    let mut slow = serde_json::to_value(specula::schedule::CostModel::default()).expect("JSON");
    for kind in ["raster", "resolve"] {
        slow[kind]["pixels"] = 40.0.into();
    }
    let costs = serde_json::from_value(slow).expect("costs");
    let mut options = options(Method::Adaptive, 1, CountingClock::stepping(1.0));
    options.costs = Some(costs);
    let mut engine = engine(&scene, options);
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    let budget = Budget::Millis(2.0);
    let stats = engine.render(&scene, budget, &mut frame);
    assert_eq!(stats.outcome, Outcome::Reduced, "{stats:?}");
    assert!((2..=4).contains(&stats.divisor));
    let stats = finish(&mut engine, &scene, budget, &mut frame);
    assert_eq!((stats.outcome, stats.divisor), (Outcome::Complete, 1));
    assert!(frame.pixels() == converged(&scene, Method::Adaptive));
}

/// What a log may say, and no engine should.
#[test]
fn divisors_that_there_are_not_count_as_the_nearest_there_is() {
    let scene = mixed();
    for (odd, near) in [(0, 1), (5, 4), (1000, 4), (u32::MAX, 4)] {
        let mut frame = Frame::new(SIZE[0], SIZE[1]);
        let stats =
            timeless(&scene, Method::Gouraud).render(&scene, first_image_at(odd), &mut frame);
        assert_eq!(stats.divisor, near, "{odd}");
        assert!(
            frame.pixels() == fresh(&scene, Method::Gouraud, SIZE, near),
            "{odd}"
        );
    }
}

/// A backend of which there can be only one draws all resolutions, one after the other.
#[test]
fn a_backend_without_a_sibling_changes_its_resolution() {
    let scene = mixed();
    for method in [Method::PhongHalf, Method::Gouraud] {
        let clock = CountingClock::stepping(0.0);
        let options = options(method, 1, clock);
        let only = Box::new(Only(SoftwareBackend::new()));
        let mut engine = Engine::with_backend(&scene, options, only).expect("it can do it");
        let mut frame = Frame::new(SIZE[0], SIZE[1]);
        for divisor in [2, 1, 3, 1] {
            let now = turned(&scene, u64::from(divisor));
            let stats = engine.render(&now, first_image_at(divisor), &mut frame);
            assert!(
                !matches!(stats.outcome, Outcome::Stale { .. }),
                "{method}: {stats:?}"
            );
            let want = fresh(&now, method, SIZE, stats.divisor);
            assert!(frame.pixels() == want, "{method}, {divisor}: {stats:?}");
            let stats = engine.render(&now, Budget::Unlimited, &mut frame);
            assert!(stats.converged, "{method}, {divisor}: {stats:?}");
        }
    }
}

/// The software backend, but there can be only one.
#[derive(Debug)]
struct Only(SoftwareBackend);

impl Backend for Only {
    fn capabilities(&self) -> Capabilities {
        self.0.capabilities()
    }

    fn rasterize(&mut self, exec: Exec, geometry: Geometry<'_>) -> RasterCounts {
        self.0.rasterize(exec, geometry)
    }

    fn visible_triangles(&self) -> &[u32] {
        self.0.visible_triangles()
    }

    fn visible_pixels(&self, triangle: u32) -> u32 {
        self.0.visible_pixels(triangle)
    }

    fn resolve(&mut self, exec: Exec, geometry: Geometry<'_>, paint: BasePaint<'_>) {
        self.0.resolve(exec, geometry, paint);
    }

    fn pending_pixels(&self, target: &Target<'_>) -> u64 {
        self.0.pending_pixels(target)
    }

    fn present(&mut self, exec: Exec, target: &mut Target<'_>) -> u64 {
        self.0.present(exec, target)
    }
}

/// A buffer of the caller's, with gaps between rows.
struct Buffer {
    bytes: Vec<u8>,
    size: [u32; 2],
    stride: usize,
}

impl Buffer {
    fn new(size: [u32; 2]) -> Self {
        let stride = size[0] as usize * 4 + 20;
        Self {
            bytes: vec![3; stride * size[1] as usize],
            size,
            stride,
        }
    }

    fn render(&mut self, engine: &mut Engine, scene: &Scene, budget: Budget, age: u32) -> Outcome {
        let [width, height] = self.size;
        let target = Target::with_stride(&mut self.bytes, width, height, self.stride)
            .expect("it has room")
            .with_order(ChannelOrder::Bgra)
            .with_age(age);
        engine.render_into(scene, budget, target).outcome
    }

    fn rgba(&self) -> Pixels {
        let row = self.size[0] as usize * 4;
        let rows = self.bytes.chunks(self.stride);
        assert!(
            rows.clone()
                .all(|bytes| bytes[row..].iter().all(|&b| b == 3)),
            "gaps are left alone"
        );
        let pixels = rows.flat_map(|bytes| bytes[..row].as_chunks::<4>().0);
        pixels.map(|&[b, g, r, a]| [r, g, b, a]).collect()
    }
}

/// Two buffers in turn, in another order of bytes, with gaps; reduced images, full ones and old ones, and another size in between.
#[test]
fn callers_buffers_of_any_age_hold_what_a_new_frame_would() {
    let scene = mixed();
    let clock = CountingClock::stepping(100.0);
    let mut engine = engine(&scene, options(Method::Gouraud, 1, clock));
    for size in [SIZE, [97, 61], SIZE] {
        let mut buffers = [Buffer::new(size), Buffer::new(size), Buffer::new(size)];
        let mut last_written = [None; 3];
        for number in 0..40_u32 {
            // Now this, now that one, so ages from one to some frames occur.
            let i = [0, 1, 1, 2, 0, 2][number as usize % 6];
            let age = last_written[i].map_or(0, |last: u32| number - last);
            let budget = match number % 8 {
                0 => first_image_at(2),
                5 => first_image_at(1),
                _ => Budget::Millis(0.8),
            };
            let scene = turned(&scene, u64::from(number / 3));
            let outcome = buffers[i].render(&mut engine, &scene, budget, age);
            last_written[i] = Some(number);
            let got = buffers[i].rgba();
            // The same image into a buffer of which nothing is known, without a change: it is cancelled.
            engine.cancel_token().cancel();
            let mut plain = Buffer::new(size);
            plain.render(&mut engine, &scene, Budget::Millis(0.8), 0);
            engine.cancel_token().reset();
            // That was a frame, too.
            last_written = last_written.map(|last| last.map(|last| last.wrapping_sub(1)));
            assert!(
                got == plain.rgba(),
                "{size:?}, frame {number}, age {age}: {outcome:?}"
            );
        }
    }
}
