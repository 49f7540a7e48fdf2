//! Which triangles may be seen: culling of whole clusters.

mod block;
mod bound;
mod cull;
mod facing;
mod halfspace;
mod hierarchy;
mod order;
mod runs;

pub use cull::{CullCounts, Culler};
