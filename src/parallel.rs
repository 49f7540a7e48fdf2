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

    /// The same on the caller's thread alone.
    #[must_use]
    pub fn on_one_thread(self) -> Self {
        Self { threads: 1, ..self }
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

    /// As [`for_each_chunk`](Self::for_each_chunk), over two lists of the same length at once.
    pub fn for_each_chunk2<A: Send, B: Send>(
        &self,
        a: &mut [A],
        b: &mut [B],
        size: usize,
        f: impl Fn(usize, &mut [A], &mut [B]) + Send + Sync,
    ) {
        use rayon::prelude::*;
        if self.threads > 1 && a.len() > size {
            a.par_chunks_mut(size)
                .zip(b.par_chunks_mut(size))
                .enumerate()
                .for_each(|(index, (a, b))| f(index, a, b));
        } else {
            let chunks = a.chunks_mut(size).zip(b.chunks_mut(size));
            for (index, (a, b)) in chunks.enumerate() {
                f(index, a, b);
            }
        }
    }

    /// As [`for_each_chunk`](Self::for_each_chunk), over three lists of the same length at once.
    pub fn for_each_chunk3<T: Send>(
        &self,
        [a, b, c]: [&mut [T]; 3],
        size: usize,
        f: impl Fn(usize, [&mut [T]; 3]) + Send + Sync,
    ) {
        use rayon::prelude::*;
        if self.threads > 1 && a.len() > size {
            let others = b.par_chunks_mut(size).zip(c.par_chunks_mut(size));
            a.par_chunks_mut(size)
                .zip(others)
                .enumerate()
                .for_each(|(index, (a, (b, c)))| f(index, [a, b, c]));
        } else {
            let others = b.chunks_mut(size).zip(c.chunks_mut(size));
            for (index, (a, (b, c))) in a.chunks_mut(size).zip(others).enumerate() {
                f(index, [a, b, c]);
            }
        }
    }

    /// As [`for_each_chunk2`](Self::for_each_chunk2), with a workspace for each chunk.
    pub fn for_each_chunk_with<W: Send, A: Send, B: Send>(
        &self,
        workspaces: &mut [W],
        a: &mut [A],
        b: &mut [B],
        size: usize,
        f: impl Fn(&mut W, &mut [A], &mut [B]) + Send + Sync,
    ) {
        use rayon::prelude::*;
        debug_assert!(
            a.len().div_ceil(size) <= workspaces.len(),
            "there are not enough workspaces"
        );
        if self.threads > 1 && a.len() > size {
            let chunks = a.par_chunks_mut(size).zip(b.par_chunks_mut(size));
            workspaces
                .par_iter_mut()
                .zip(chunks)
                .for_each(|(own, (a, b))| f(own, a, b));
        } else {
            let chunks = a.chunks_mut(size).zip(b.chunks_mut(size));
            for (own, (a, b)) in workspaces.iter_mut().zip(chunks) {
                f(own, a, b);
            }
        }
    }

    /// Runs `f(index)` for every index below `count`, in parallel if there are threads for it.
    pub fn for_each_index(&self, count: usize, f: impl Fn(usize) + Send + Sync) {
        use rayon::prelude::*;
        if self.threads > 1 && count > 1 {
            (0..count).into_par_iter().for_each(f);
        } else {
            (0..count).for_each(f);
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
