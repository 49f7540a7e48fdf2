//! The frame loop.

use super::Method;
use super::base::BaseImage;
use super::options::{EngineError, EngineOptions, own_pool, suits};
use super::refine_first::RefineFirst;
use super::refinement::{Leaf, Refinement, for_each_leaf};
use super::stats::{FrameStats, Outcome, StageTimes};
use crate::backend::Backend;
use crate::clock::Clock;
use crate::geometry::screen::MAX_IMAGE_SIDE;
use crate::output::{Encoding, Frame, Stamp, Target};
use crate::parallel::Exec;
use crate::scene::{GeometryChange, Placement, Scene, View, World};
use crate::schedule::{Allowance, Budget, LearnedRate, cost};
use crate::simd::SimdLevel;
use std::collections::VecDeque;
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
    renderer: Renderer,
}

/// Everything of an engine that a frame changes.
#[derive(Debug)]
struct Renderer {
    method: Method,
    encoding: Encoding,
    placement: Placement,
    world: World,
    backend: Box<dyn Backend>,
    /// The view for which the backend knows who owns which pixel, if it does for any.
    seen: Option<View>,
    /// Whether the image of that view has its colours, as far as it has been refined.
    is_lit: bool,
    base: BaseImage,
    refinement: Refinement,
    /// For a backend that cannot repaint.
    refine_first: RefineFirst,
    /// Time per pixel handed over to the caller.
    presenting: LearnedRate,
    frames: u64,
    /// Which images the last frames handed over, the latest first.
    handed_over: VecDeque<Option<Stamp>>,
}

/// Buffers older than this many frames are written anew: nobody queues more.
const MOST_AGE: usize = 16;

/// The first frame touches memory; those after it are for threads that have just been started.
const WARM_UP_FRAMES: usize = 3;

/// Refinement of a frame that warms up, in work units.
const WARM_UP_UNITS: u64 = 1_000_000;

/// An image that takes one thread less time than this, by nominal costs, is not shared among threads: waking them takes 10
/// microseconds while they are busy, and 80 after they have slept.
const LEAST_NS_TO_SHARE: f32 = 100_000.0;

/// Refinement ends so much before it has to: what comes after it does not always take the same time.
const MARGIN_MS: f64 = 0.03;

/// A frame of fewer pixels handed over does not tell how long one takes.
const LEAST_PIXELS_TO_LEARN_FROM: u64 = 1 << 15;

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
        let (placement, world) = Placement::new(scene);
        Ok(Self {
            clock: options.clock,
            exec: Exec { level, threads },
            pool,
            renderer: Renderer {
                method: options.method,
                encoding: options.encoding,
                placement,
                base: BaseImage::new(&world),
                world,
                backend,
                seen: None,
                is_lit: false,
                refinement: Refinement::default(),
                refine_first: RefineFirst::default(),
                presenting: LearnedRate::new(cost::PRESENT_PIXEL_NS, LEAST_PIXELS_TO_LEARN_FROM),
                frames: 0,
                handed_over: VecDeque::with_capacity(MOST_AGE),
            },
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
        let age = (target.age() as usize).checked_sub(1);
        let stamp = age.and_then(|age| *self.renderer.handed_over.get(age)?);
        target.mark(stamp);
        self.render_target(scene, budget, &mut target)
    }

    fn render_target(
        &mut self,
        scene: &Scene,
        budget: Budget,
        target: &mut Target<'_>,
    ) -> FrameStats {
        let allowance = Allowance::new(budget, &*self.clock, self.clock.now_ms());
        let (renderer, exec) = (&mut self.renderer, self.exec);
        // Waking threads takes longer than some frames.
        match self
            .pool
            .as_ref()
            .filter(|_| renderer.needs_threads(scene, target))
        {
            Some(pool) => pool.install(|| renderer.render(exec, scene, budget, allowance, target)),
            None => renderer.render(exec.on_one_thread(), scene, budget, allowance, target),
        }
    }

    /// Makes ready for frames of this size: touches the memory they need and wakes the threads, so that the first one is
    /// as fast as those after it. Forgets the current image.
    pub fn warm_up(&mut self, scene: &Scene, width: u32, height: u32) {
        let mut frame = Frame::new(width, height);
        let frames = self.renderer.frames;
        for _ in 0..WARM_UP_FRAMES {
            self.forget();
            self.render(scene, Budget::Work(WARM_UP_UNITS), &mut frame);
        }
        self.forget();
        // Nobody has seen these frames.
        self.renderer.frames = frames;
        self.renderer.handed_over.clear();
    }

    /// Forgets the current image, so that the next frame starts cold. Memory stays allocated and threads stay awake.
    pub fn forget(&mut self) {
        self.renderer.seen = None;
    }

    /// Calls `f` with everything that the current image consists of: visible triangles, or the leaves and parts that
    /// they were divided into. Nothing before the first frame, and after [`forget`](Self::forget).
    pub fn for_each_leaf(&self, f: impl FnMut(&Leaf)) {
        let r = &self.renderer;
        if r.seen.is_some() && r.is_lit {
            for_each_leaf(r.method, &r.world, &r.base, &*r.backend, &r.refinement, f);
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

impl Renderer {
    /// One frame: draw the first image if there is none, refine it while the budget lasts, hand it over.
    fn render(
        &mut self,
        exec: Exec,
        scene: &Scene,
        budget: Budget,
        mut allowance: Allowance<'_>,
        target: &mut Target<'_>,
    ) -> FrameStats {
        let mut stages = StageTimes::default();
        self.adopt(exec, scene);
        stages.cull += allowance.elapsed_ms();
        let view = self.view(scene, target);

        let is_seen = self.seen == Some(view);
        if !is_seen {
            self.look(exec, &view, &allowance, &mut stages);
        }
        let is_new = !self.is_lit;
        if is_new {
            self.light(exec, &view, &allowance, &mut stages);
        }

        let refining_since = allowance.elapsed_ms();
        let mut drawing_ms = None;
        if self.method.is_progressive() {
            drawing_ms = self.refine(exec, &view, &mut allowance, target);
        }
        let presenting_since = allowance.elapsed_ms();
        let drawing = drawing_ms.unwrap_or(0.0);
        stages.refine += presenting_since - refining_since - drawing;
        stages.resolve += drawing;

        let pixels_written = self.backend.present(exec, target);
        self.handed_over.truncate(MOST_AGE - 1);
        self.handed_over.push_front(target.stamp());
        let frame_ms = allowance.elapsed_ms();
        stages.present += frame_ms - presenting_since;
        self.presenting
            .learn(pixels_written, frame_ms - presenting_since);

        let converged = self.has_converged();
        let mut stats = FrameStats {
            frame: self.frames + 1,
            frame_ms,
            outcome: match (is_new, allowance.spent_units(), converged) {
                (false, 0, _) if drawing_ms.is_none() => Outcome::Unchanged,
                (_, _, true) => Outcome::Complete,
                (true, 0, false) => Outcome::BaseOnly,
                (_, _, false) => Outcome::Refined,
            },
            converged,
            triangles: self.world.triangles.len() as u64,
            work_units: allowance.spent_units(),
            pixels_written,
            stage_ms: stages,
            ..FrameStats::empty(budget)
        };
        self.base.report(&mut stats);
        self.refinement.report(self.method, &mut stats);
        if is_seen {
            stats.skipped.visibility_pixels = stats.covered_pixels;
        }
        let pixels = u64::from(target.width()) * u64::from(target.height());
        stats.skipped.pixels_unchanged = pixels.saturating_sub(pixels_written);
        self.frames += 1;
        stats
    }

    /// Whether the image of the view last seen is final, once it is lit.
    fn has_converged(&self) -> bool {
        !self.method.is_progressive()
            || (self.refinement.is_finished()
                && (!self.refines_first() || self.refine_first.is_up_to_date(&self.refinement)))
    }

    /// Whether a frame has enough to do to share it among threads. Not so where nothing has changed and nothing is left to be
    /// refined or handed over, nor where a single image is drawn sooner than threads can be woken.
    fn needs_threads(&self, scene: &Scene, target: &Target<'_>) -> bool {
        let lights = match self.method {
            Method::Phong => self.world.lights.len(),
            _ => 0,
        };
        let pixels = target.width() as f32 * target.height() as f32;
        let nominal_ns = cost::first_image(self.world.triangles.len() as f32, pixels, lights);
        if !self.method.is_progressive() && nominal_ns < LEAST_NS_TO_SHARE {
            return false;
        }
        let is_settled = self.placement.is_up_to_date(scene)
            && self.is_lit
            && self.seen == Some(self.view(scene, target))
            && self.has_converged()
            && self.backend.pending_pixels(target) == 0;
        !is_settled
    }

    /// The view of the scene's camera in an image of the target's size.
    fn view(&self, scene: &Scene, target: &Target<'_>) -> View {
        // A larger image is none: backends leave a target alone that does not have the view's size.
        let [width, height] =
            [target.width(), target.height()].map(|side| side.min(MAX_IMAGE_SIDE));
        let view = self.world.view(scene.camera(), width, height);
        view.with_encoding(self.encoding)
    }

    /// Takes over what has changed of the scene.
    fn adopt(&mut self, exec: Exec, scene: &Scene) {
        let changes = self.placement.update(exec, &mut self.world, scene);
        match changes.geometry {
            GeometryChange::None => {}
            GeometryChange::Moved => {
                self.base.refit(&self.world);
                self.seen = None;
            }
            GeometryChange::Replaced => {
                self.base = BaseImage::new(&self.world);
                self.seen = None;
            }
        }
        if changes.shading || changes.background {
            self.is_lit = false;
        }
    }

    /// Finds out who owns which pixel of a view.
    fn look(
        &mut self,
        exec: Exec,
        view: &View,
        allowance: &Allowance<'_>,
        stages: &mut StageTimes,
    ) {
        let since = allowance.elapsed_ms();
        // Which clusters can be seen at all?
        self.base.cull(view);
        let culled = allowance.elapsed_ms();
        stages.cull += culled - since;

        self.base
            .rasterize(exec, &self.world, view, &mut *self.backend);
        stages.raster += allowance.elapsed_ms() - culled;
        self.seen = Some(*view);
        self.is_lit = false;
    }

    /// Gives the first image of a view its colours, and makes the list of what could be refined.
    fn light(
        &mut self,
        exec: Exec,
        view: &View,
        allowance: &Allowance<'_>,
        stages: &mut StageTimes,
    ) {
        let refines_first = self.refines_first();
        let backend = &mut *self.backend;
        let mut since = allowance.elapsed_ms();
        let mut lap = |stage: &mut f64| {
            let now = allowance.elapsed_ms();
            *stage += now - since;
            since = now;
        };

        // Only vertices of triangles that own a pixel are illuminated.
        self.base
            .shade(exec, self.method, &self.world, view, backend);
        lap(&mut stages.shade);

        // On a backend that cannot repaint, refinement comes first.
        if refines_first {
            self.refine_first.begin();
        } else {
            self.base
                .resolve(exec, self.method, &self.world, view, backend);
        }
        lap(&mut stages.resolve);

        // Which triangles can hold a highlight, and what is worth refining?
        if self.method.is_progressive() {
            self.base.classify(exec, &self.world, view, backend);
            self.refinement.collect_candidates(
                exec,
                self.method,
                &self.world,
                view,
                &self.base,
                backend,
            );
        } else {
            self.refinement.clear();
        }
        lap(&mut stages.classify);

        self.is_lit = true;
    }

    /// Whether everything is drawn once, after refinement.
    fn refines_first(&self) -> bool {
        self.method.is_progressive() && !self.backend.capabilities().refines_in_place()
    }

    /// Spends what is left of the budget, less what handing the image over will take. Returns the milliseconds that drawing
    /// took, where that comes after refinement and was done.
    fn refine(
        &mut self,
        exec: Exec,
        view: &View,
        allowance: &mut Allowance<'_>,
        target: &Target<'_>,
    ) -> Option<f64> {
        let refines_first = self.refines_first();
        let mut stage = super::refinement::Stage {
            exec,
            world: &self.world,
            view,
            base: &self.base,
            backend: &mut *self.backend,
        };
        if refines_first {
            let pixels = u64::from(view.width) * u64::from(view.height);
            let presenting_ms = self.presenting.predict_ms(pixels) + MARGIN_MS;
            return self.refine_first.frame(
                &mut self.refinement,
                &mut stage,
                allowance,
                presenting_ms,
            );
        }
        loop {
            let pending = stage.backend.pending_pixels(target);
            allowance.reserve_ms(self.presenting.predict_ms(pending) + MARGIN_MS);
            if !self.refinement.step(&mut stage, allowance) {
                return None;
            }
        }
    }
}
