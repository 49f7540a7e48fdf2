//! Measuring images: the Phong reference, error metrics, and sweeps of error against time.

pub mod metrics;
pub mod reference;
pub mod sweep;

pub use metrics::{ErrorHistogram, ErrorReport, SizeMismatch};
pub use reference::ReferenceImage;
pub use sweep::{Calibration, Sweep, SweepBudget, SweepOptions, SweepRow};
