//! How an engine runs, and why one cannot be made.

use super::Method;
use crate::backend::{Backend, BackendKind};
use crate::clock::{Clock, SystemClock};
use crate::output::Encoding;
use crate::refine::paper::PaperRule;
use crate::schedule::{CancelToken, CostModel};
use crate::simd::SimdLevel;
use std::sync::Arc;

/// How an engine runs.
#[derive(Clone, Debug)]
pub struct EngineOptions {
    /// How images are shaded.
    pub method: Method,
    /// How far the paper's methods go, if it is one of them.
    pub paper: PaperRule,
    /// What draws them; [`Engine::with_backend`](super::Engine::with_backend) takes one that is not among these.
    pub backend: BackendKind,
    /// How images store light.
    pub encoding: Encoding,
    /// Threads to use; `None` for as many as the machine has processors. With one, everything happens on the caller's
    /// thread; with more, the engine owns a pool.
    pub threads: Option<usize>,
    /// A pool of the caller's to run in, with all its threads, in place of an own one; `threads` has no meaning then. A
    /// frame rendered from inside the pool hands nothing over between threads to get there.
    pub pool: Option<Arc<rayon::ThreadPool>>,
    /// SIMD level to use; `None` for the machine's strongest.
    pub simd: Option<SimdLevel>,
    /// Where time comes from.
    pub clock: Arc<dyn Clock>,
    /// What happens when a first image does not fit into a wall-clock budget.
    pub overrun: Overrun,
    /// Stops the engine from another thread.
    pub cancel: CancelToken,
    /// What is known about the time that work takes, from [`Engine::costs`](super::Engine::costs) of an earlier engine. With `None` it is
    /// found out when the engine is made, in at most 20 milliseconds; with one that makes no sense it is guessed. Either way the engine
    /// goes on learning.
    pub costs: Option<CostModel>,
}

/// What happens when a first image does not fit into a wall-clock budget.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Overrun {
    /// The deadline holds, see [`Budget`](crate::schedule::Budget): lower resolution, or an image over several frames.
    #[default]
    HoldDeadline,
    /// The frame is late: each has a first image of its own, at full resolution. For measurements of methods against each other.
    BeLate,
}

impl Default for EngineOptions {
    fn default() -> Self {
        Self {
            method: Method::default(),
            paper: PaperRule::default(),
            backend: BackendKind::default(),
            encoding: Encoding::default(),
            threads: None,
            pool: None,
            simd: None,
            clock: Arc::new(SystemClock::new()),
            overrun: Overrun::default(),
            cancel: CancelToken::new(),
            costs: None,
        }
    }
}

/// Why an engine cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EngineError {
    /// Zero threads were asked for.
    #[error("an engine needs at least one thread")]
    NoThreads,
    /// The SIMD level asked for is not one of this machine's.
    #[error("this machine does not have the SIMD level '{0}'")]
    NoSuchSimdLevel(SimdLevel),
    /// The backend cannot shade per pixel, or not after the first image, which the method needs.
    #[error(
        "the method '{method}' needs a backend that shades single pixels, which this one does not"
    )]
    NeedsPixels {
        /// The method.
        method: Method,
    },
    /// The threads could not be started.
    #[error("cannot start {threads} threads: {source}")]
    ThreadPool {
        /// How many.
        threads: usize,
        /// What the operating system says.
        source: rayon::ThreadPoolBuildError,
    },
}

/// A pool of so many threads, or of as many as the machine has processors; none if that is one.
pub(super) fn own_pool(
    threads: Option<usize>,
) -> Result<Option<Arc<rayon::ThreadPool>>, EngineError> {
    let threads = threads
        .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get));
    match threads {
        0 => Err(EngineError::NoThreads),
        1 => Ok(None),
        _ => rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|index| format!("specula-{index}"))
            .build()
            .map(|pool| Some(Arc::new(pool)))
            .map_err(|source| EngineError::ThreadPool { threads, source }),
    }
}

/// Whether the backend can do what the method needs.
pub(super) fn suits(method: Method, backend: &dyn Backend) -> bool {
    let capabilities = backend.capabilities();
    match method {
        Method::Flat | Method::Gouraud | Method::Adaptive => true,
        Method::Phong | Method::PhongHalf => capabilities.per_pixel,
        Method::PhongArea
        | Method::PhongTiles
        | Method::Regular
        | Method::Highlight
        | Method::Hybrid => capabilities.refines_in_place(),
    }
}
