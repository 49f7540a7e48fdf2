//! How to run a pass: on which SIMD level, and on one thread or inside the engine's pool.

use crate::simd::Level;

/// How the engine's passes run. *What* they compute never depends on it.
#[derive(Clone, Copy, Debug)]
pub struct Exec {
    /// SIMD dispatch token.
    pub level: Level,
    /// Threads that may be used. Above 1, the caller runs inside a rayon pool (`ThreadPool::install`), so
    /// that rayon's global pool is never touched.
    pub threads: usize,
}

impl Exec {
    /// On the caller's thread, without special instructions: for what is prepared once.
    #[must_use]
    pub fn sequential() -> Self {
        Self {
            level: Level::fallback(),
            threads: 1,
        }
    }

    /// Runs `f(index, chunk)` for every chunk of `size` elements, in parallel if there are threads for it.
    pub fn for_each_chunk<T: Send>(
        &self,
        data: &mut [T],
        size: usize,
        f: impl Fn(usize, &mut [T]) + Send + Sync,
    ) {
        use rayon::prelude::*;
        if self.threads > 1 && data.len() > size {
            data.par_chunks_mut(size)
                .enumerate()
                .for_each(|(index, chunk)| f(index, chunk));
        } else {
            for (index, chunk) in data.chunks_mut(size).enumerate() {
                f(index, chunk);
            }
        }
    }

    /// Runs both closures, in parallel if there are threads for it.
    pub fn join<A: Send, B: Send>(
        &self,
        a: impl FnOnce() -> A + Send,
        b: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        if self.threads > 1 {
            rayon::join(a, b)
        } else {
            (a(), b())
        }
    }
}
