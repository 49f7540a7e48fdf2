//! The engine: the one place that knows all stages.

mod method;
mod stats;

pub use method::Method;
pub use stats::{FrameStats, Outcome, Skipped, StageTimes};
