//! Framebuffers, encodings and image files.

pub mod encode;
pub mod frame;

pub use frame::Frame;
