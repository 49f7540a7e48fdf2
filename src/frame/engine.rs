//! The engine as its users see it: made for a scene, asked for frames. The frame loop is in [`renderer`](super::renderer).

use super::options::{EngineError, EngineOptions, own_pool, suits};
use super::refinement::{Leaf, for_each_leaf};
use super::renderer::Renderer;
use super::stats::FrameStats;
use crate::backend::Backend;
use crate::clock::Clock;
use crate::geometry::screen::MAX_IMAGE_SIDE;
use crate::output::{Encoding, Frame, Target};
use crate::parallel::Exec;
use crate::scene::{Scene, World};
use crate::schedule::{Allowance, Budget};
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
    renderer: Renderer,
}

/// The first frame touches memory; those after it are for threads that have just been started.
const WARM_UP_FRAMES: usize = 3;

/// Refinement of a frame that warms up, in work units.
const WARM_UP_UNITS: u64 = 1_000_000;

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
        Ok(Self {
            clock: options.clock,
            exec: Exec { level, threads },
            pool,
            renderer: Renderer::new(scene, backend, options.method, options.encoding),
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
    /// they were divided into. Nothing before the first frame, and after [`forget`](Self::forget). With
    /// [`Method::PhongTiles`](super::Method::PhongTiles) triangles are interpolated until all pixels are shaded.
    pub fn for_each_leaf(&self, f: impl FnMut(&Leaf)) {
        let r = &self.renderer;
        if r.seen.is_some() && r.is_lit {
            for_each_leaf(
                r.shown_method(),
                &r.world,
                &r.base,
                &*r.backend,
                &r.refinement,
                f,
            );
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
