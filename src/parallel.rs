//! How to run a pass: on which SIMD level, on one thread or inside the engine's pool, and for how long.
//!
//! A pass that may take longer than there is time for is cut into pieces of about ten microseconds. After each of them [`GoOn`] is
//! asked; when it says no, the pass returns and keeps what it has got, and another [`Turn`] goes on from there.

use crate::simd::Level;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};

/// Bytes by which a list [grows](grow) at a time: memory that is new to the process takes about a microsecond for 8 KiB.
const GROWTH_BYTES: usize = 1 << 15;

/// Whether there is time for more work. Any thread may ask, at any time; what is drawn does not depend on the answers.
pub type GoOn<'a> = &'a (dyn Fn() -> bool + Sync);

/// One call of several that do some work together.
///
/// The first begins the work anew, whatever became of earlier work; others go on with it until it is complete. Each does at
/// least one piece of what is left, then asks whether to go on: so the work is completed by finitely many calls, even if the
/// answer is always no. The result is the same however many there were.
#[derive(Clone, Copy)]
pub struct Turn<'a> {
    /// Whether the work begins.
    pub is_first: bool,
    /// Whether this call may go on.
    pub go_on: GoOn<'a>,
}

impl fmt::Debug for Turn<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Turn")
            .field("is_first", &self.is_first)
            .finish_non_exhaustive()
    }
}

impl Turn<'static> {
    /// The only call, which does everything.
    pub const WHOLE: Self = Self {
        is_first: true,
        go_on: &|| true,
    };
}

impl<'a> Turn<'a> {
    /// The first call.
    #[must_use]
    pub fn first(go_on: GoOn<'a>) -> Self {
        Self {
            is_first: true,
            go_on,
        }
    }

    /// A later call.
    #[must_use]
    pub fn next(go_on: GoOn<'a>) -> Self {
        Self {
            is_first: false,
            go_on,
        }
    }
}

/// What the threads of one call know about its end: as soon as one of them is told to stop, all do.
pub(crate) struct Watch<'a> {
    go_on: GoOn<'a>,
    is_over: AtomicBool,
}

impl<'a> Watch<'a> {
    pub(crate) fn new(go_on: GoOn<'a>) -> Self {
        Self {
            go_on,
            is_over: AtomicBool::new(false),
        }
    }

    /// Asks whether to go on after a piece of work.
    #[inline]
    pub(crate) fn may_go_on(&self) -> bool {
        if self.is_over() {
            return false;
        }
        let answer = (self.go_on)();
        if !answer {
            self.is_over.store(true, Ordering::Relaxed);
        }
        answer
    }

    /// Whether somebody has been told to stop.
    #[inline]
    pub(crate) fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }
}

/// Asks each time that so much work has been done.
pub(crate) struct Pace<'a> {
    watch: &'a Watch<'a>,
    /// Work of a piece, in units of the caller's.
    piece: usize,
    /// What is left to do of the current one; at least 1.
    left: usize,
}

impl<'a> Pace<'a> {
    pub(crate) fn new(watch: &'a Watch<'a>, piece: usize) -> Self {
        let piece = piece.max(1);
        Self {
            watch,
            piece,
            left: piece,
        }
    }

    /// Work left until it will be asked.
    #[inline(always)]
    pub(crate) fn left(&self) -> usize {
        self.left
    }

    /// Notes work, and says whether to go on.
    #[inline(always)]
    pub(crate) fn did(&mut self, work: usize) -> bool {
        if work < self.left {
            self.left -= work;
            return true;
        }
        self.left = self.piece;
        self.watch.may_go_on()
    }

    /// Asks if there was work since it was last asked, so that many small tasks do not go on for long.
    #[inline(always)]
    pub(crate) fn finish(self) {
        if self.left < self.piece {
            self.watch.may_go_on();
        }
    }
}

/// Gives a list its length. Elements are made some at a time, and asked is after each of them; returns whether all are there. A list
/// that needs more memory loses its elements; otherwise old ones stay.
pub(crate) fn grow<T>(
    list: &mut Vec<T>,
    len: usize,
    watch: &Watch<'_>,
    mut make: impl FnMut(usize) -> T,
) -> bool {
    if list.capacity() < len {
        list.clear();
        list.reserve_exact(len);
    }
    list.truncate(len);
    let some = (GROWTH_BYTES / size_of::<T>().max(1)).max(1);
    while list.len() < len {
        if watch.is_over() {
            return false;
        }
        let first = list.len();
        list.extend((first..len.min(first + some)).map(&mut make));
        watch.may_go_on();
    }
    true
}

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
