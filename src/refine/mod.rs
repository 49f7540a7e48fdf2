//! Conforming subdivision of root triangles, adaptive and nested.
//!
//! A *root* is a triangle of the world; its *leaves* partition it. All of them form one [`Forest`]:
//!
//! * **Splits are decided per edge** and applied to every leaf that shares it, so there are no T-junctions, hence no
//!   cracks on a backend without ids and no colour seams on one with them; the paper's "subdivide the neighbours" (3.1,
//!   section 4) falls out of it. Edges are found by the *welded positions* of their ends: creases and material borders
//!   share positions, each side keeping normals and colours of its own, and a non-manifold edge splits all its
//!   triangles.
//! * **A leaf with any subset of its edges marked** has a template (two, three or four children), so a split never
//!   spreads beyond the leaves at its marked edges.
//! * **Nested**: new vertices are midpoints, `(a + b) * 0.5`, the same bits from both sides; normals are averaged and
//!   stay unnormalized until they are shaded, so that refinement interpolates what Phong shading interpolates. Every
//!   vertex is illuminated once, in SIMD batches, and going deeper reuses it.
//! * **Error is estimated from the surplus** at edge midpoints: the difference, in encoded 8-bit codes, between the
//!   colour there and the colour interpolated between the edge's ends. The midpoints of a leaf's edges are illuminated
//!   when the leaf is made; they are the vertices of its children. Large leaves are sampled inside too, because a small
//!   highlight in a large triangle may touch none of its edges. See [`estimate`].
//! * **Not every split helps** (paper, 3.1.2): a new vertex on a highlight may spread it over the whole leaf. A split
//!   is [planned](Forest::plan_split), its vertices are [illuminated](Forest::illuminate), and only if the estimated
//!   error of the children is below that of the parents *at the same points* is it
//!   [committed](Forest::conclude_splits).
//!
//! Leaves that have been shaded per pixel are [closed](Forest::close): they are right already, so their edges no longer
//! count, nor do those of triangles without a visible pixel.
//!
//! **Drawn once.** On a backend without ids there is no repainting: everything is drawn after it has been refined
//! ([`Forest::draw_once`]). Nothing is closed there, and every triangle that is drawn follows its neighbours' splits,
//! so that no T-junction can become a crack.

mod curving;
pub mod estimate;
mod forest;
pub mod paper;
mod shown;
mod split;
mod vertices;

pub use curving::{Curving, CurvingCounts, CurvingRule};
pub use forest::{FIRST_LEAVES, Forest, Leaf, LeafId, LeafState};
pub use split::{PlanOutcome, SplitOutcome};

#[cfg(test)]
mod tests;
