//! `specula` renders scenes with specular highlights on a CPU inside a millisecond budget per frame.
//!
//! It draws the whole scene with Gouraud shading first, finds the triangles that can hold a
//! highlight, ranks what deviates from per-pixel Phong shading by visible pixels and error, and
//! spends the rest of the budget refining it, frame after frame, until the image equals Phong shading.

#![forbid(unsafe_code)]
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod backend;
pub mod clock;
pub mod frame;
pub mod geometry;
pub mod highlight;
pub mod illumination;
pub mod math;
pub mod measure;
pub mod output;
pub mod parallel;
pub mod refine;
pub mod scene;
pub mod schedule;
pub mod simd;
pub mod visibility;

/// The vectors and matrices in this crate's interface.
pub use glam;

pub use backend::BackendKind;
pub use frame::{Engine, EngineError, EngineOptions, FrameStats, Method};
pub use output::Frame;
pub use scene::Scene;
pub use schedule::Budget;

/// The examples of the README, compiled and run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeExamples;
