//! Framebuffers, encodings and image files.

pub mod apng;
pub mod encode;
mod encoding;
pub mod frame;
mod interpolation;
pub mod png;
pub mod sequence;
pub mod target;
pub mod timing;
pub mod whole_file;
pub mod y4m;

pub use encoding::Encoding;
pub use frame::Frame;
pub use interpolation::Interpolation;
pub use png::SaveError;
pub use target::{ChannelOrder, Stamp, Target, TargetError};
pub use timing::{FrameRate, Timing};
pub use whole_file::save_whole;
