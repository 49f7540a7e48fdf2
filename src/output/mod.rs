//! Framebuffers, encodings and image files.

pub mod encode;
pub mod frame;
pub mod png;
pub mod target;

pub use frame::Frame;
pub use png::SaveError;
pub use target::{ChannelOrder, Target, TargetError};
