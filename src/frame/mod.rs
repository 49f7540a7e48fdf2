//! The engine: the one place that knows all stages.
//!
//! `renderer.rs` holds the frame loop. Read it first; it says what happens in a frame and in which order. `engine.rs` is what its users
//! see. `base.rs` draws
//! the first image, `refinement/` makes it better; `refine_first.rs` is how, where the backend cannot repaint.

mod base;
mod calibration;
mod engine;
mod handover;
mod load;
mod method;
mod motion;
mod options;
mod picture;
mod refine_first;
mod refinement;
mod renderer;
mod shelf;
mod stats;
mod tiles;

pub use engine::Engine;
pub use method::Method;
pub use options::{EngineError, EngineOptions, Overrun};
pub use refinement::{Leaf, LeafKind};
pub use stats::{FrameStats, Outcome, Skipped, StageTimes};
