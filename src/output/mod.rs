//! Framebuffers, encodings and image files.

pub mod frame;

pub use frame::Frame;
