//! Time enters the engine only through [`Clock`], so that deadline logic can be tested without waiting.

use std::fmt::Debug;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// A source of time in milliseconds since an arbitrary origin.
pub trait Clock: Debug + Send + Sync {
    /// Milliseconds since the clock's origin. It should not run backwards; the engine survives when it does.
    fn now_ms(&self) -> f64;
}

/// The monotonic clock of the operating system.
#[derive(Clone, Copy, Debug)]
pub struct SystemClock {
    origin: Instant,
}

impl SystemClock {
    /// A clock whose origin is now.
    #[must_use]
    pub fn new() -> Self {
        Self {
            origin: Instant::now(),
        }
    }
}

impl Default for SystemClock {
    fn default() -> Self {
        Self::new()
    }
}

impl Clock for SystemClock {
    fn now_ms(&self) -> f64 {
        self.origin.elapsed().as_secs_f64() * 1e3
    }
}

/// A clock for tests: it stands still unless told otherwise, and can advance by a fixed step at every reading.
///
/// Clones share the same time.
#[derive(Clone, Debug, Default)]
pub struct ManualClock {
    nanoseconds: Arc<AtomicU64>,
    step_ns: u64,
}

impl ManualClock {
    /// A clock at zero that moves on by `step_ns` nanoseconds after each reading.
    #[must_use]
    pub fn with_step_ns(step_ns: u64) -> Self {
        Self {
            nanoseconds: Arc::default(),
            step_ns,
        }
    }

    /// Moves the clock on by `ms` milliseconds (negative or NaN: not at all).
    pub fn advance_ms(&self, ms: f64) {
        self.nanoseconds
            .fetch_add((ms * 1e6) as u64, Ordering::Relaxed);
    }
}

impl Clock for ManualClock {
    fn now_ms(&self) -> f64 {
        self.nanoseconds.fetch_add(self.step_ns, Ordering::Relaxed) as f64 * 1e-6
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn manual_clock_moves_only_when_told() {
        let clock = ManualClock::default();
        assert_eq!(clock.now_ms(), 0.0);
        clock.advance_ms(1.5);
        assert_eq!(clock.clone().now_ms(), 1.5);
        clock.advance_ms(-1.0);
        assert_eq!(clock.now_ms(), 1.5);
        let stepping = ManualClock::with_step_ns(1_000);
        stepping.now_ms();
        assert_eq!(stepping.now_ms(), 1e-3);
    }
}
