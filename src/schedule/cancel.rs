//! Stopping a frame from another thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Stops an engine from another thread: clones share one state.
///
/// While it is cancelled, a wall-clock budget (but for one of zero, which buys a first image) is over: the engine returns when the piece of work in hand is done, as it does at a deadline,
/// and goes on with the image once the token is [reset](Self::reset). Other budgets end their refinement, too, but complete a first
/// image.
#[derive(Clone, Debug, Default)]
pub struct CancelToken(Arc<AtomicBool>);

impl CancelToken {
    /// A token that is not cancelled.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Stops the engine, now and until [`reset`](Self::reset).
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Lets the engine go on.
    pub fn reset(&self) {
        self.0.store(false, Ordering::Relaxed);
    }

    /// Whether the engine is to stop.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
