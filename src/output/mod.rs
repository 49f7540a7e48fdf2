//! Framebuffers, encodings and image files.

pub mod encode;
pub mod frame;
pub mod png;

pub use frame::Frame;
pub use png::SaveError;
