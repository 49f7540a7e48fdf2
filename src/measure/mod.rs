//! Measuring images: the Phong reference, error metrics, and sweeps of error against time.

pub mod metrics;
pub mod reference;

pub use metrics::{ErrorHistogram, ErrorReport, SizeMismatch};
pub use reference::ReferenceImage;
