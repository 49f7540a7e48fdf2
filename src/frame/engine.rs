//! The engine as its users see it: made for a scene, asked for frames. The frame loop is in [`renderer`](super::renderer).

use super::calibration::calibrate;
use super::options::{EngineError, EngineOptions, Overrun, own_pool, suits};
use super::picture::Picture;
use super::refinement::{Leaf, for_each_leaf};
use super::renderer::{Renderer, Work};
use super::stats::FrameStats;
use crate::backend::Backend;
use crate::clock::Clock;
use crate::geometry::screen::MAX_IMAGE_SIDE;
use crate::output::{Encoding, Frame, Rect, Target};
use crate::parallel::Exec;
use crate::refine::paper::PaperRule;
use crate::scene::{Scene, World};
use crate::schedule::{Allowance, Budget, CancelToken, CostModel, FrameRecord};
use crate::simd::SimdLevel;
use std::sync::Arc;

/// Renders a scene, frame after frame, each within a budget.
///
/// ```
/// use specula::{Budget, Engine, Frame, Scene};
///
/// let scene = Scene::parse("(objects: [(shape: Teapot())])", "teapot.ron")?;
/// let mut engine = Engine::new(&scene)?;
/// let mut frame = Frame::new(320, 180);
/// for _ in 0..4 {
///     let stats = engine.render(&scene, Budget::from_millis(2.0), &mut frame);
///     println!("{stats}");
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Engine {
    clock: Arc<dyn Clock>,
    exec: Exec,
    pool: Option<Arc<rayon::ThreadPool>>,
    overrun: Overrun,
    cancel: CancelToken,
    renderer: Renderer,
}

/// Rounds of frames that warm up, after the first frames, which touch memory: for threads that have just been started, and for what is
/// known of costs.
const WARM_UP_ROUNDS: usize = 4;

/// Refinement of such a frame, in work units.
const WARM_UP_UNITS: u64 = 1_000_000;

/// Triangles that are lit in others.
const WARM_UP_LIT: u32 = 1_000;

impl Engine {
    /// An engine with default options, made ready for `scene`: vertices welded, clusters and bounding volumes built.
    ///
    /// # Errors
    /// When the threads cannot be started.
    pub fn new(scene: &Scene) -> Result<Self, EngineError> {
        Self::with_options(scene, EngineOptions::default())
    }

    /// An engine with the given options.
    ///
    /// # Errors
    /// When there are to be no threads, they cannot be started, the machine lacks the SIMD level, or the backend cannot do
    /// what the method needs.
    pub fn with_options(scene: &Scene, options: EngineOptions) -> Result<Self, EngineError> {
        let backend = options.backend.create();
        Self::with_backend(scene, options, backend)
    }

    /// As [`with_options`](Self::with_options), drawing with a backend of the caller's, whatever `options.backend` says.
    ///
    /// # Errors
    /// As [`with_options`](Self::with_options).
    pub fn with_backend(
        scene: &Scene,
        options: EngineOptions,
        backend: Box<dyn Backend>,
    ) -> Result<Self, EngineError> {
        if !suits(options.method, &*backend) {
            let method = options.method;
            return Err(EngineError::NeedsPixels { method });
        }
        let simd = options.simd.unwrap_or_else(SimdLevel::detect);
        let level = simd.token().ok_or(EngineError::NoSuchSimdLevel(simd))?;
        let pool = match options.pool {
            Some(pool) => Some(pool),
            None => own_pool(options.threads)?,
        };
        let threads = pool.as_ref().map_or(1, |pool| pool.current_num_threads());
        let exec = Exec { level, threads };
        let costs = match (options.costs, backend.sibling()) {
            (Some(costs), _) if costs.is_valid() => costs,
            (None, Some(sibling)) => calibrate(exec, pool.as_deref(), &*options.clock, sibling),
            _ => CostModel::default(),
        };
        let mut renderer = Renderer::new(scene, backend, options.method, options.encoding, costs);
        renderer.paper = options.paper;
        Ok(Self {
            clock: options.clock,
            exec,
            pool,
            overrun: options.overrun,
            cancel: options.cancel,
            renderer,
        })
    }

    /// Renders the scene from its camera into `frame`, within `budget`.
    ///
    /// A still view is refined further from frame to frame, until it equals per-pixel Phong shading (on a backend that
    /// cannot shade pixels: until the estimate says half a code); then nothing is drawn any more. After a change, what depends on
    /// it is done again: with other lights or materials, the owners of all pixels stay known; with another camera or
    /// image size, the scene stays prepared; objects that move are placed anew, and others are not.
    ///
    /// It never fails: a scene is validated when it is made. A frame with a side of more than [`MAX_IMAGE_SIDE`] pixels is left
    /// as it is.
    pub fn render(&mut self, scene: &Scene, budget: Budget, frame: &mut Frame) -> FrameStats {
        if frame.width().max(frame.height()) <= MAX_IMAGE_SIDE {
            frame.set_encoding(self.renderer.encoding);
        }
        frame.write(|target| self.render_target(scene, budget, target))
    }

    /// As [`render`](Self::render), into memory of the caller; see [`Target`].
    pub fn render_into(
        &mut self,
        scene: &Scene,
        budget: Budget,
        mut target: Target<'_>,
    ) -> FrameStats {
        let stamp = self.renderer.handover.stamp(target.age());
        target.mark(stamp);
        self.render_target(scene, budget, &mut target)
    }

    fn render_target(
        &mut self,
        scene: &Scene,
        budget: Budget,
        target: &mut Target<'_>,
    ) -> FrameStats {
        let start_ms = self.clock.now_ms();
        let mut allowance = Allowance::new(budget, &*self.clock, start_ms, &self.cancel);
        if self.overrun == Overrun::BeLate {
            allowance = allowance.with_whole_first_images();
        }
        let (renderer, exec) = (&mut self.renderer, self.exec);
        // Waking threads takes longer than some frames.
        match self
            .pool
            .as_ref()
            .filter(|_| renderer.needs_threads(scene, target))
        {
            Some(pool) => {
                let work = Work::new(exec, allowance);
                pool.install(|| renderer.render(scene, budget, work, target))
            }
            None => {
                let work = Work::new(exec.on_one_thread(), allowance);
                renderer.render(scene, budget, work, target)
            }
        }
    }

    /// Makes ready for frames of this size: touches the memory they need and wakes the threads, so that the first one is
    /// as fast as those after it. Forgets the current image.
    pub fn warm_up(&mut self, scene: &Scene, width: u32, height: u32) {
        let mut frame = Frame::new(width, height);
        let frames = self.renderer.frames;
        let replay = |divisor, lit| Budget::Replay(FrameRecord::of_first_image(divisor, lit));
        // An image of a lower resolution has memory of its own.
        let (reduced, lit) = (replay(2, 0), replay(1, WARM_UP_LIT));
        let refined = Budget::Work(WARM_UP_UNITS);
        // What touching memory takes is nothing to learn from.
        let costs = self.renderer.costs.clone();
        for budget in [reduced, refined] {
            self.forget();
            self.render(scene, budget, &mut frame);
        }
        self.renderer.costs = costs;
        for _ in 0..WARM_UP_ROUNDS {
            for budget in [refined, lit] {
                self.forget();
                // As if it were another's, all of it is handed over.
                frame.pixels_mut();
                self.render(scene, budget, &mut frame);
            }
        }
        self.forget();
        // Nobody has seen these frames.
        self.renderer.frames = frames;
        self.renderer.handover.forget();
    }

    /// Forgets the current image, and what was found out in those before, so that the next frame starts cold. Memory stays
    /// allocated and threads stay awake.
    pub fn forget(&mut self) {
        self.renderer.forget();
    }

    /// Goes on with the last frame's image in spare time, until `deadline_ms` of the engine's [clock](EngineOptions::clock), the
    /// image is final, or the [token](Self::cancel_token) is cancelled. Returns whether the image is final.
    ///
    /// The next frame of the same view starts from what has been done. That is in no [record](FrameStats::record): a program that uses spare
    /// time cannot replay its frames.
    pub fn refine_until(&mut self, deadline_ms: f64) -> bool {
        let start_ms = self.clock.now_ms();
        let budget = Budget::from_millis(deadline_ms - start_ms);
        // No time at all is not what buys a first image.
        if budget == Budget::Millis(0.0) || self.renderer.is_final() {
            return self.renderer.is_final();
        }
        let allowance = Allowance::new(budget, &*self.clock, start_ms, &self.cancel);
        let mut work = Work::new(self.exec, allowance);
        let renderer = &mut self.renderer;
        match &self.pool {
            Some(pool) => pool.install(|| renderer.spend_spare_time(&mut work)),
            None => renderer.spend_spare_time(&mut work),
        }
    }

    /// A token that stops the engine from another thread.
    #[must_use]
    pub fn cancel_token(&self) -> CancelToken {
        self.cancel.clone()
    }

    /// The engine's clock, in milliseconds since its origin: what [`refine_until`](Self::refine_until) takes.
    #[must_use]
    pub fn now_ms(&self) -> f64 {
        self.clock.now_ms()
    }

    /// The pixels of the target that the last frame changed, as rectangles that do not overlap: what window systems call damage.
    /// Nothing if the target held the image already.
    #[must_use]
    pub fn changed(&self) -> &[Rect] {
        self.renderer.handover.changed()
    }

    /// Changes how far the paper's methods go. The current image is forgotten.
    pub fn set_paper_rule(&mut self, rule: PaperRule) {
        self.renderer.paper = rule;
        self.forget();
    }

    /// What the engine has learned about the time that work takes. An engine of the same kind that
    /// [starts from it](EngineOptions::costs) need not find out again.
    #[must_use]
    pub fn costs(&self) -> &CostModel {
        &self.renderer.costs
    }

    /// Calls `f` with everything that the current image consists of: visible triangles, or the leaves and parts that
    /// they were divided into. Nothing before the first frame, and after [`forget`](Self::forget). With
    /// [`Method::PhongTiles`](super::Method::PhongTiles) triangles are interpolated until all pixels are shaded.
    pub fn for_each_leaf(&self, f: impl FnMut(&Leaf)) {
        let Renderer {
            method,
            world,
            shelf,
            ..
        } = &self.renderer;
        if let Some(picture) = shelf.shown().filter(|picture| picture.view().is_some()) {
            let Picture {
                base,
                backend,
                refinement,
                baseline,
                ..
            } = picture;
            if method.is_of_the_paper() {
                return baseline.for_each_leaf(world, base, &**backend, f);
            }
            let method = picture.shown_method(*method);
            for_each_leaf(method, world, base, &**backend, refinement, f);
        }
    }

    /// The scene as it is rendered.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.renderer.world
    }

    /// How images store light.
    #[must_use]
    pub fn encoding(&self) -> Encoding {
        self.renderer.encoding
    }

    /// Threads that the engine uses.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.exec.threads
    }
}
