//! An engine that only waits: what the machine itself does to deadlines.

use crate::clock::Clock;
use crate::frame::EngineError;

/// Threads that look at the clock until the deadline, and return.
#[derive(Debug)]
pub struct NullEngine {
    /// None for one thread, as in [`Engine`](crate::frame::Engine): the caller's.
    pool: Option<rayon::ThreadPool>,
}

impl NullEngine {
    /// Starts the threads.
    ///
    /// # Errors
    /// When they cannot be started.
    pub fn new(threads: usize) -> Result<Self, EngineError> {
        let start = || {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .thread_name(|index| format!("specula null {index}"))
                .build()
                .map_err(|source| EngineError::ThreadPool { threads, source })
        };
        Ok(Self {
            pool: (threads > 1).then(start).transpose()?,
        })
    }

    /// Keeps all threads busy for `budget_ms` milliseconds. Returns the milliseconds from call to return. It never returns
    /// if the clock stands still.
    pub fn frame(&self, clock: &dyn Clock, budget_ms: f64) -> f64 {
        let start = clock.now_ms();
        let wait = || {
            while clock.now_ms() - start < budget_ms {
                std::hint::spin_loop();
            }
        };
        match &self.pool {
            Some(pool) => {
                pool.broadcast(|_| wait());
            }
            None => wait(),
        }
        clock.now_ms() - start
    }
}
