//! Measuring images: the Phong reference, error metrics, frame times around a scene, sweeps of error
//! against time, soaks that count late frames, and looking into an image.

pub mod bench;
mod csv;
pub mod error_map;
pub mod flicker;
pub mod inspection;
pub mod metrics;
pub mod overlay;
pub mod predictions;
pub mod reference;
pub mod soak;
pub mod sweep;

pub use bench::{BenchOptions, BenchPhase, BenchReport, bench};
pub use error_map::error_map;
pub use flicker::flicker;
pub use inspection::Inspection;
pub use metrics::{ErrorHistogram, ErrorReport, Mismatch};
pub use overlay::{Layer, draw_overlay};
pub use predictions::PredictionErrors;
pub use reference::ReferenceImage;
pub use soak::{Soak, SoakOptions, SoakRow, SoakSummary};
pub use sweep::{
    Calibration, Curve, CurveArea, CurvePoint, Noise, Sweep, SweepBudget, SweepOptions, SweepRow,
};
