//! Which triangles can hold a highlight, and which terms of the illumination equation vary on them.
//!
//! A **potentially highlighted triangle** (PHT) is one that passes the H1 and H2 tests of Cho, Neumann and Woo,
//! *Improved Specular Highlights with Adaptive Shading*, section 2 ([`signs`]). They look for highlight *centres*; a lobe that
//! reaches a triangle from outside, or a centre that the vertices do not notice, is missed. So there is a bound as well
//! ([`bound`]), which misses nothing, and from it the set of terms that must be evaluated at every pixel ([`masks`]). Bounds
//! that hold for all triangles of a cluster at once ([`cluster`]) say the same where triangles are too small to be asked one by one.

pub mod bound;
pub mod cluster;
mod cone;
pub mod masks;
mod power;
mod quartic;
pub mod signs;

pub use bound::{FactorBound, LightBound, TriangleBound};
pub use cluster::{ClusterBound, ClusterShape};
pub use masks::{Claim, TriangleLights, Verdict, cluster_masks, light_masks, masks_of};
pub use signs::{SignBits, compute_signs};
