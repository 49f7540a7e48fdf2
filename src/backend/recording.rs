//! A backend that writes down what it is told, for tests of an engine.
//!
//! It passes everything on to another backend, so that the engine sees real images and counts, and keeps a [`Log`] that
//! a test reads through a handle of its own, while the engine owns the backend:
//!
//! ```
//! use specula::backend::recording::{Call, RecordingBackend};
//! use specula::{BackendKind, Budget, Engine, EngineOptions, Frame, Scene};
//!
//! let scene = Scene::parse("(objects: [(shape: Teapot())])", "teapot.ron")?;
//! let (backend, log) = RecordingBackend::new(BackendKind::Software.create());
//! let mut engine = Engine::with_backend(&scene, EngineOptions::default(), Box::new(backend))?;
//! let mut frame = Frame::new(64, 36);
//! engine.render(&scene, Budget::Unlimited, &mut frame);
//! log.take();
//! // The image is final: there is nothing to draw, and nothing to hand over.
//! engine.render(&scene, Budget::Unlimited, &mut frame);
//! assert_eq!(log.take(), [Call::Present { pixels: 0 }]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use super::{Backend, BasePaint, Capabilities, Geometry, Patch, RasterCounts, RefinedPart};
use crate::output::{Rect, Target};
use crate::parallel::{Exec, Turn};
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

/// One call of a method that changes something; of several [turns](Turn) of the same work, the one that completes it.
#[derive(Clone, Debug, PartialEq)]
pub enum Call {
    /// [`Backend::rasterize`], [`Backend::rasterize_while`] or [`Backend::rasterize_moved`].
    Rasterize {
        /// Image width and height in pixels.
        size: [u32; 2],
        /// What it counted.
        counts: RasterCounts,
        /// Triangles that were found to be visible.
        visible: Vec<u32>,
    },
    /// [`Backend::resolve`], [`Backend::resolve_while`] or [`Backend::resolve_moved`].
    Resolve(Paint),
    /// [`Backend::repaint`].
    Repaint {
        /// How many patches.
        patches: usize,
        /// Pixels painted, as counted.
        pixels: u64,
    },
    /// [`Backend::shade_squares`].
    ShadeSquares {
        /// Which.
        squares: Vec<u32>,
    },
    /// [`Backend::present`].
    Present {
        /// Pixels written.
        pixels: u64,
    },
}

/// A [`BasePaint`] without its colours.
#[derive(Clone, Debug, PartialEq)]
pub enum Paint {
    /// [`BasePaint::Gouraud`].
    Gouraud,
    /// [`BasePaint::Mixed`].
    Mixed,
    /// [`BasePaint::Flat`].
    Flat,
    /// [`BasePaint::Phong`].
    Phong,
    /// [`BasePaint::Refined`], with its parts.
    Refined(Vec<RefinedPart>),
}

/// The calls so far. Clones read the same log.
#[derive(Clone, Debug, Default)]
pub struct Log {
    calls: Arc<Mutex<Vec<Call>>>,
}

impl Log {
    /// All calls since the last time, in order; they are removed.
    pub fn take(&self) -> Vec<Call> {
        std::mem::take(&mut *self.lock())
    }

    fn push(&self, call: Call) {
        self.lock().push(call);
    }

    /// A thread that panicked while it held the log left it whole.
    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Call>> {
        self.calls.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Passes all calls on and writes them down.
#[derive(Debug)]
pub struct RecordingBackend {
    inner: Box<dyn Backend>,
    log: Log,
}

impl RecordingBackend {
    /// A backend that does what `inner` does, and the log of its calls.
    #[must_use]
    pub fn new(inner: Box<dyn Backend>) -> (Self, Log) {
        let log = Log::default();
        let backend = Self {
            inner,
            log: log.clone(),
        };
        (backend, log)
    }

    fn log_rasterize(&self, geometry: Geometry<'_>, counts: RasterCounts) {
        self.log.push(Call::Rasterize {
            size: [geometry.view.width, geometry.view.height],
            counts,
            visible: self.inner.visible_triangles().to_vec(),
        });
    }

    fn log_resolve(&self, paint: BasePaint<'_>) {
        self.log.push(Call::Resolve(match paint {
            BasePaint::Gouraud(_) => Paint::Gouraud,
            BasePaint::Mixed { .. } => Paint::Mixed,
            BasePaint::Flat(_) => Paint::Flat,
            BasePaint::Phong => Paint::Phong,
            BasePaint::Refined { parts, .. } => Paint::Refined(parts.to_vec()),
        }));
    }
}

impl Backend for RecordingBackend {
    fn capabilities(&self) -> Capabilities {
        self.inner.capabilities()
    }

    fn rasterize(&mut self, exec: Exec, geometry: Geometry<'_>) -> RasterCounts {
        let counts = self.inner.rasterize(exec, geometry);
        self.log_rasterize(geometry, counts);
        counts
    }

    fn rasterize_while(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        turn: Turn<'_>,
    ) -> Option<RasterCounts> {
        let counts = self.inner.rasterize_while(exec, geometry, turn)?;
        self.log_rasterize(geometry, counts);
        Some(counts)
    }

    fn rasterize_moved(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        moved: &[Range<u32>],
        turn: Turn<'_>,
    ) -> Option<RasterCounts> {
        let counts = self.inner.rasterize_moved(exec, geometry, moved, turn)?;
        self.log_rasterize(geometry, counts);
        Some(counts)
    }

    fn visible_triangles(&self) -> &[u32] {
        self.inner.visible_triangles()
    }

    fn visible_pixels(&self, triangle: u32) -> u32 {
        self.inner.visible_pixels(triangle)
    }

    fn resolve(&mut self, exec: Exec, geometry: Geometry<'_>, paint: BasePaint<'_>) {
        self.log_resolve(paint);
        self.inner.resolve(exec, geometry, paint);
    }

    fn resolve_while(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        paint: BasePaint<'_>,
        turn: Turn<'_>,
    ) -> bool {
        let is_complete = self.inner.resolve_while(exec, geometry, paint, turn);
        if is_complete {
            self.log_resolve(paint);
        }
        is_complete
    }

    fn resolve_moved(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        paint: BasePaint<'_>,
        turn: Turn<'_>,
    ) -> bool {
        let is_complete = self.inner.resolve_moved(exec, geometry, paint, turn);
        if is_complete {
            self.log_resolve(paint);
        }
        is_complete
    }

    fn repaint(&mut self, exec: Exec, geometry: Geometry<'_>, patches: &mut [Patch]) {
        self.inner.repaint(exec, geometry, patches);
        self.log.push(Call::Repaint {
            patches: patches.len(),
            pixels: patches.iter().map(|patch| u64::from(patch.pixels)).sum(),
        });
    }

    fn square_pixels(&self, square: u32) -> u32 {
        self.inner.square_pixels(square)
    }

    fn shade_squares(&mut self, exec: Exec, geometry: Geometry<'_>, squares: &[u32]) {
        self.inner.shade_squares(exec, geometry, squares);
        self.log.push(Call::ShadeSquares {
            squares: squares.to_vec(),
        });
    }

    fn pending_pixels(&self, target: &Target<'_>) -> u64 {
        self.inner.pending_pixels(target)
    }

    fn pending_after_resolve(
        &self,
        exec: Exec,
        geometry: Geometry<'_>,
        target: &Target<'_>,
    ) -> u64 {
        self.inner.pending_after_resolve(exec, geometry, target)
    }

    fn present(&mut self, exec: Exec, target: &mut Target<'_>) -> u64 {
        let pixels = self.inner.present(exec, target);
        self.log.push(Call::Present { pixels });
        pixels
    }

    /// Writes to the same log.
    fn changes(&self, target: &Target<'_>, out: &mut Vec<Rect>) {
        self.inner.changes(target, out);
    }

    fn sibling(&self) -> Option<Box<dyn Backend>> {
        Some(Box::new(Self {
            inner: self.inner.sibling()?,
            log: self.log.clone(),
        }))
    }
}
