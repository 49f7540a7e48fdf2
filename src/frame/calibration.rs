//! What work takes on this machine, found out before the first frame.
//!
//! A small scene is drawn, refined or lit, handed over and enlarged a few times, by a renderer of its own that runs as the engine will. That is
//! a start; the engine goes on learning from every frame.

use super::Method;
use super::renderer::{Renderer, Work};
use crate::backend::Backend;
use crate::clock::Clock;
use crate::output::{Encoding, Frame};
use crate::parallel::Exec;
use crate::scene::Scene;
use crate::schedule::{Allowance, Budget, CancelToken, CostModel, FrameRecord};

/// When the last round begins, at the latest: with it, and preparations, calibration takes at most 20 milliseconds.
const LAST_ROUND_MS: f64 = 10.0;

/// Rounds, however fast they are, and also on a clock that stands still.
const MOST_ROUNDS: u32 = 8;

/// Refinement of a round, in work units.
const UNITS: u64 = 400_000;

/// Triangles that are lit in another image of it.
const LIT: u32 = 300;

/// Pixels of the image: more than fit into the caches of most machines, as those of real frames.
const SIZE: [u32; 2] = [1280, 720];

/// Curved and flat surfaces, small triangles and large ones.
const SCENE: &str = "(
    camera: Perspective(position: (2.5, -6.0, 3.0), target: (0.0, 0.0, 0.7), fov_degrees: 35.0),
    lights: [Point(position: (4.0, -5.0, 6.0)), Point(position: (-4.0, -3.0, 5.0))],
    objects: [
        (shape: Teapot(tessellation: 4)),
        (shape: Plane(width: 12.0, depth: 12.0, columns: 4, rows: 4)),
    ],
)";

/// Rates of work on `backend`, which is not used for anything else.
pub(super) fn calibrate(
    exec: Exec,
    pool: Option<&rayon::ThreadPool>,
    clock: &dyn Clock,
    backend: Box<dyn Backend>,
) -> CostModel {
    let start_ms = clock.now_ms();
    let Ok(scene) = Scene::parse(SCENE, "calibration") else {
        return CostModel::default();
    };
    let mut renderer = Renderer::new(
        &scene,
        backend,
        Method::Adaptive,
        Encoding::default(),
        CostModel::default(),
    );
    match pool {
        Some(pool) => pool.install(|| rounds(&mut renderer, exec, clock, start_ms, &scene)),
        None => rounds(&mut renderer, exec, clock, start_ms, &scene),
    }
    renderer.costs
}

fn rounds(renderer: &mut Renderer, exec: Exec, clock: &dyn Clock, start_ms: f64, scene: &Scene) {
    let cancel = CancelToken::new();
    let replay = |divisor, lit| Budget::Replay(FrameRecord::of_first_image(divisor, lit));
    let budgets = [Budget::Work(UNITS), replay(1, LIT), replay(2, 0)];
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    for round in 0..MOST_ROUNDS {
        if clock.now_ms() - start_ms > LAST_ROUND_MS {
            return;
        }
        for budget in budgets {
            renderer.shelf.forget();
            // All pixels are handed over.
            frame.pixels_mut();
            let allowance = Allowance::new(budget, clock, clock.now_ms(), &cancel);
            let work = Work::new(exec, allowance);
            frame.write(|target| renderer.render(scene, budget, work, target));
        }
        // The first round touched memory and woke threads.
        if round == 0 {
            renderer.costs = CostModel::default();
        }
    }
}
