//! After warm-up a frame allocates nothing: for a still view, a moving one, and where light and objects change.
//!
//! Allocations are counted over all threads of the process, so this is one test: between two, the harness allocates too.
//! The engines run on the test's thread, inside a pool, and called from outside a pool. All but the first share one pool,
//! which outlives them, because threads that end allocate as well.
//!
//! What is counted is exact and repeatable: budgets are in work units.

use glam::{DMat4, DVec3};
use rayon::ThreadPool;
use specula::scene::{Camera, Light, Material};
use specula::{Budget, Engine, EngineOptions, Frame, FrameStats, Method, Scene};
use std::fmt;
use std::path::Path;
use std::sync::Arc;

const WIDTH: u32 = 320;
const HEIGHT: u32 = 180;

/// Views around the scene, and frames of each: one that draws it, one that goes on refining it.
const VIEWS: u32 = 6;
const FRAMES_PER_VIEW: u32 = 2;
const FRAMES_PER_LAP: u64 = (VIEWS * FRAMES_PER_VIEW) as u64;

/// Enough for some hundred splits a frame, too little to converge at once.
const WORK: Budget = Budget::Work(300_000);

/// Jobs in a block of the queue through which a rayon pool is called from outside (`crossbeam_deque::Injector`). It
/// allocates block by block.
const JOBS_PER_BLOCK: u64 = 63;

/// The only unsafe code of the package: an allocator that counts.
mod counting {
    #![allow(
        unsafe_code,
        reason = "an allocator cannot be written without; it hands everything on to the system's"
    )]

    use std::alloc::{GlobalAlloc, Layout, System};
    use std::sync::atomic::{AtomicU64, Ordering};

    #[global_allocator]
    static ALLOCATOR: Counting = Counting;

    static COUNT: AtomicU64 = AtomicU64::new(0);

    /// Memory asked for so far, by all threads: blocks made and blocks resized.
    pub(super) fn allocations() -> u64 {
        COUNT.load(Ordering::SeqCst)
    }

    struct Counting;

    // SAFETY: every call goes on to the system's allocator as it is, which keeps the contract; counting neither allocates
    // nor unwinds.
    unsafe impl GlobalAlloc for Counting {
        unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
            COUNT.fetch_add(1, Ordering::SeqCst);
            // SAFETY: the caller keeps the contract of `alloc`.
            unsafe { System.alloc(layout) }
        }

        unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
            COUNT.fetch_add(1, Ordering::SeqCst);
            // SAFETY: the caller keeps the contract of `alloc_zeroed`.
            unsafe { System.alloc_zeroed(layout) }
        }

        unsafe fn realloc(&self, block: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
            COUNT.fetch_add(1, Ordering::SeqCst);
            // SAFETY: the caller keeps the contract of `realloc`, and all blocks are the system allocator's.
            unsafe { System.realloc(block, layout, new_size) }
        }

        unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
            // SAFETY: the caller keeps the contract of `dealloc`, and all blocks are the system allocator's.
            unsafe { System.dealloc(block, layout) }
        }
    }
}

/// Where an engine is called from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Caller {
    /// A thread, the engine using no other.
    OneThread,
    /// A thread of the pool that the engine runs in.
    Inside,
    /// A thread outside of the pool that the engine runs in.
    Outside,
}

/// An engine with its scene, what was in it at first, and its frame.
struct Show {
    scene: Scene,
    camera: Camera,
    light: Light,
    /// Where the first object is, if it may turn.
    place: Option<DMat4>,
    engine: Engine,
    frame: Frame,
}

impl Show {
    fn new(scene: Scene, method: Method, pool: Option<&Arc<ThreadPool>>) -> Self {
        let options = EngineOptions {
            method,
            threads: Some(1),
            pool: pool.cloned(),
            ..EngineOptions::default()
        };
        Self {
            engine: Engine::with_options(&scene, options).expect("an engine"),
            camera: *scene.camera(),
            light: scene.lights()[0],
            place: None,
            frame: Frame::new(WIDTH, HEIGHT),
            scene,
        }
    }

    fn render(&mut self) -> FrameStats {
        self.engine.render(&self.scene, WORK, &mut self.frame)
    }

    /// Goes once around the scene, starting `offset` of a step from where its camera stands. Says how many allocations
    /// there were.
    fn lap(&mut self, offset: f64) -> u64 {
        let before = counting::allocations();
        for view in 0..VIEWS {
            let turn = (f64::from(view) + offset) / f64::from(VIEWS);
            self.scene.set_camera(turned(&self.camera, turn));
            for _ in 0..FRAMES_PER_VIEW {
                self.render();
            }
        }
        counting::allocations() - before
    }

    /// Stays where the camera stands until the image has converged, and for three frames more. Says how many allocations
    /// and frames there were.
    fn stay(&mut self) -> (u64, u64) {
        self.scene.set_camera(self.camera);
        self.engine.forget();
        let before = counting::allocations();
        let mut frames = 3;
        while !self.render().converged {
            frames += 1;
            assert!(frames < 1000, "it does not converge");
        }
        for _ in 0..3 {
            self.render();
        }
        (counting::allocations() - before, frames + 1)
    }

    /// Stays where it is while a light fades and the first object, if it may, turns a little. Says how many allocations there were.
    fn change(&mut self) -> u64 {
        let (light, place) = (self.light, self.place);
        let before = counting::allocations();
        for frame in 0..FRAMES_PER_LAP as u32 {
            let share = f64::from(frame) / FRAMES_PER_LAP as f64;
            let radiance = light.radiance.map(|c| c * share);
            self.scene.set_light(0, Light { radiance, ..light });
            let turn = DMat4::from_rotation_z(0.02 * share);
            if let Some(place) = place {
                self.scene.set_transform(0, place * turn);
            }
            self.render();
        }
        counting::allocations() - before
    }

    /// Tries everything out, and complains as `case` when there are too many allocations.
    fn run(&mut self, caller: Caller, case: &dyn fmt::Display) {
        // One for each block begun, if frames go through the queue at all.
        let from_queue = |frames: u64| match caller {
            Caller::OneThread | Caller::Inside => 0,
            Caller::Outside => frames.div_ceil(JOBS_PER_BLOCK),
        };

        let before = counting::allocations();
        self.render();
        let first = counting::allocations() - before;
        assert!(first > 0, "{case}: the allocator does not count");

        // Views that need more room than any before may take some, once; that is rare, for lists get room for more.
        let warm_up = self.lap(0.0);
        assert!(
            warm_up <= from_queue(FRAMES_PER_LAP) + 2 * FRAMES_PER_LAP,
            "{case}: views seen for the first time take {warm_up} allocations"
        );
        let again = self.lap(0.0);
        assert!(
            again <= from_queue(FRAMES_PER_LAP),
            "{case}: going around again takes {again} allocations"
        );

        self.stay();
        let (allocations, frames) = self.stay();
        assert!(
            allocations <= from_queue(frames),
            "{case}: a still view takes {allocations} allocations in {frames} frames"
        );

        let between = self.lap(0.5);
        assert!(
            between <= from_queue(FRAMES_PER_LAP) + FRAMES_PER_LAP / 2,
            "{case}: views between those seen take {between} allocations"
        );
        let again = self.lap(0.5);
        assert!(
            again <= from_queue(FRAMES_PER_LAP),
            "{case}: going around between takes {again} allocations"
        );

        self.change();
        let again = self.change();
        assert!(
            again <= from_queue(FRAMES_PER_LAP),
            "{case}: changing the scene again takes {again} allocations"
        );
    }
}

/// The camera, gone around its target by some turns.
fn turned(camera: &Camera, turns: f64) -> Camera {
    let (sin, cos) = (turns * std::f64::consts::TAU).sin_cos();
    let from = camera.position - camera.target;
    let around = DVec3::new(
        cos * from.x - sin * from.y,
        sin * from.x + cos * from.y,
        from.z,
    );
    Camera {
        position: camera.target + around,
        ..*camera
    }
}

/// Scenes that load the stages in different ways; `heavy` with a quarter of its triangles, and `minimal` with backs as well.
fn scenes() -> impl Iterator<Item = (&'static str, Scene)> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let read = move |name: &str| {
        let text = std::fs::read_to_string(directory.join(name).with_extension("ron"));
        let text = text
            .expect(name)
            .replace("tessellation: 32", "tessellation: 16");
        Scene::parse(&text, name).expect(name)
    };
    let mut with_backs = read("minimal");
    let material = Material {
        two_sided: true,
        ..with_backs.materials()[0]
    };
    with_backs.set_material(0, material);
    ["teapot", "walls", "lights16", "minimal", "closeup", "heavy"]
        .into_iter()
        .map(move |name| (name, read(name)))
        .chain(std::iter::once(("minimal with backs", with_backs)))
}

#[test]
fn frames_allocate_nothing_after_warm_up() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
    let pool = Arc::new(pool.expect("a pool"));
    // A thread allocates when it starts, which is not before it does something.
    pool.broadcast(|_| ());
    for (name, scene) in scenes() {
        for method in Method::ALL {
            for caller in [Caller::OneThread, Caller::Inside, Caller::Outside] {
                let scene = scene.clone();
                let used = (caller != Caller::OneThread).then_some(&pool);
                let mut show = Show::new(scene, method, used);
                // Walls that meet no longer do when one turns; which triangles are neighbours is then found out anew.
                show.place = (name != "walls").then(|| show.scene.objects()[0].author_from_mesh);
                let case = format!("{name}, {method}, {caller:?}");
                match caller {
                    Caller::Inside => pool.install(|| show.run(caller, &case)),
                    _ => show.run(caller, &case),
                }
            }
        }
    }
}
