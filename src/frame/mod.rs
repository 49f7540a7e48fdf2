//! The engine: the one place that knows all stages.
//!
//! `renderer.rs` holds the frame loop. Read it first; it says what happens in a frame and in which order.
//!
//! | file | holds |
//! |---|---|
//! | `engine.rs` | the engine as its users see it; `options.rs`, `method.rs`, `stats.rs` what goes in and comes out |
//! | `renderer.rs` | the frame loop |
//! | `shelf.rs` | the pictures: one at full resolution, one at a lower one, and one that is still shown while that is drawn anew |
//! | `picture.rs` | an image in the making, stage by stage, each of which may be interrupted; `picture/composing.rs` how each triangle of a first image gets its colours, `picture/refining.rs` what comes after it |
//! | `motion.rs` | which triangles have moved since a picture was drawn |
//! | `base.rs`, `curves.rs` | what the stages of a first image do |
//! | `refinement/` | makes it better; `refine_first.rs` is how, where the backend cannot repaint, `tiles.rs` is a simple rival, `baseline.rs` the paper's methods |
//! | `handover.rs` | brings the caller's frame up to date |
//! | `load.rs`, `calibration.rs` | how much work a first image is, and what work takes on this machine |

mod base;
mod baseline;
mod calibration;
mod curves;
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
