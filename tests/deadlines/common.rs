//! Scenes, clocks, and images to compare with.

use specula::clock::Clock;
use specula::glam::DMat3;
use specula::schedule::{CancelToken, CostModel, FrameRecord, Kind, Load};
use specula::{Budget, Engine, EngineOptions, Frame, FrameStats, Method, Scene};
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

pub(crate) const SIZE: [u32; 2] = [256, 144];

pub(crate) type Pixels = Vec<[u8; 4]>;

const MIXED: &str = r##"(
    camera: Perspective(position: (3.0, -9.0, 4.5), target: (0.0, 0.0, 1.0), fov_degrees: 38.0),
    background: (0.1, 0.2, 0.4),
    lights: [
        Point(position: (5.0, -6.0, 7.0), intensity: 0.8),
        Directional(direction: (-0.3, 0.6, -1.0), intensity: 0.4),
    ],
    materials: {
        "red": (diffuse: (0.6, 0.2, 0.1), specular: (0.7, 0.7, 0.7), shininess: 60.0),
        "blinn": (diffuse: (0.2, 0.3, 0.5), specular: (0.5, 0.5, 0.5), shininess: 120.0, model: BlinnPhong),
    },
    objects: [
        (shape: Teapot(tessellation: 4), material: "red"),
        (shape: Sphere(slices: 12, stacks: 8), material: "blinn", position: (-2.0, -3.0, 0.8)),
        (shape: Plane(width: 14.0, depth: 14.0, columns: 3, rows: 3), material: "blinn", position: (0.0, 0.0, -0.3)),
    ],
)"##;

pub(crate) fn mixed() -> Scene {
    Scene::parse(MIXED, "mixed.ron").expect("the scene is valid")
}

/// The scene with its camera turned about the target by `step` fortieths of a turn.
pub(crate) fn turned(scene: &Scene, step: u64) -> Scene {
    let mut scene = scene.clone();
    let mut camera = *scene.camera();
    let turn = DMat3::from_rotation_z(std::f64::consts::TAU * step as f64 / 40.0);
    camera.position = camera.target + turn * (camera.position - camera.target);
    scene.set_camera(camera);
    scene
}

/// A clock that says `time(n)` milliseconds when it is read for the `n`-th time, from zero.
pub(crate) struct CountingClock {
    readings: AtomicU64,
    time: Box<dyn Fn(u64) -> f64 + Send + Sync>,
}

impl CountingClock {
    pub(crate) fn new(time: impl Fn(u64) -> f64 + Send + Sync + 'static) -> Arc<Self> {
        Arc::new(Self {
            readings: AtomicU64::new(0),
            time: Box::new(time),
        })
    }

    /// A reading takes `us` microseconds.
    pub(crate) fn stepping(us: f64) -> Arc<Self> {
        Self::new(move |n| n as f64 * us * 1e-3)
    }

    /// The same, and the `at`-th reading cancels the token.
    pub(crate) fn cancelling(us: f64, at: u64, token: CancelToken) -> Arc<Self> {
        Self::new(move |n| {
            if n == at {
                token.cancel();
            }
            n as f64 * us * 1e-3
        })
    }

    /// How often it has been read.
    pub(crate) fn readings(&self) -> u64 {
        self.readings.load(Ordering::Relaxed)
    }
}

impl fmt::Debug for CountingClock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "CountingClock({})", self.readings())
    }
}

impl Clock for CountingClock {
    fn now_ms(&self) -> f64 {
        (self.time)(self.readings.fetch_add(1, Ordering::Relaxed))
    }
}

/// Nothing is measured when the engine is made, so readings are counted from the first frame on.
pub(crate) fn options(method: Method, threads: usize, clock: Arc<CountingClock>) -> EngineOptions {
    EngineOptions {
        method,
        threads: Some(threads),
        clock,
        costs: Some(CostModel::default()),
        ..EngineOptions::default()
    }
}

/// What work takes on a machine that seems to take so many times as long as nominal to light pixels of a first image.
pub(crate) fn lighting_takes(times: f64) -> CostModel {
    let mut costs = CostModel::default();
    costs.learn(Kind::Light, Load::of_pixels(1e6), times);
    costs
}

/// Options of an engine that will therefore not light anything, but refine images.
pub(crate) fn refining_options(threads: usize, clock: Arc<CountingClock>) -> EngineOptions {
    EngineOptions {
        costs: Some(lighting_takes(1e3)),
        ..options(Method::Adaptive, threads, clock)
    }
}

pub(crate) fn engine(scene: &Scene, options: EngineOptions) -> Engine {
    Engine::with_options(scene, options).expect("the options are valid")
}

pub(crate) fn timeless(scene: &Scene, method: Method) -> Engine {
    engine(scene, options(method, 1, CountingClock::stepping(0.0)))
}

/// Draws one first image of so many times less width and height.
pub(crate) fn first_image_at(divisor: u32) -> Budget {
    Budget::Replay(FrameRecord {
        divisor,
        images: 1,
        ..FrameRecord::default()
    })
}

/// The first image of a new engine.
pub(crate) fn fresh(
    scene: &Scene,
    method: Method,
    [width, height]: [u32; 2],
    divisor: u32,
) -> Pixels {
    let mut frame = Frame::new(width, height);
    timeless(scene, method).render(scene, first_image_at(divisor), &mut frame);
    frame.pixels().to_vec()
}

/// The final image of a new engine.
pub(crate) fn converged(scene: &Scene, method: Method) -> Pixels {
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    let stats = timeless(scene, method).render(scene, Budget::Unlimited, &mut frame);
    assert!(stats.converged, "{stats:?}");
    frame.pixels().to_vec()
}

/// An image of nothing but the background.
pub(crate) fn background(scene: &Scene, size: [u32; 2]) -> Pixels {
    let mut empty = scene.clone();
    empty.set_objects(Vec::new());
    fresh(&empty, Method::Gouraud, size, 1)
}

/// Renders until the image is final, at most so many frames.
pub(crate) fn finish(
    engine: &mut Engine,
    scene: &Scene,
    budget: Budget,
    frame: &mut Frame,
) -> FrameStats {
    for _ in 0..4000 {
        let stats = engine.render(scene, budget, frame);
        if stats.converged {
            return stats;
        }
    }
    panic!("the image does not become final under {budget:?}");
}

/// Where two images differ most, and by how many codes.
pub(crate) fn largest_difference(a: &[[u8; 4]], b: &[[u8; 4]]) -> u8 {
    assert_eq!(a.len(), b.len());
    let bytes = a.as_flattened().iter().zip(b.as_flattened());
    bytes.map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
}
