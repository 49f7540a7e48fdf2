//! Which triangles may be seen: culling of whole clusters.

mod cull;
mod facing;
mod halfspace;

pub use cull::{CullCounts, Culler};
