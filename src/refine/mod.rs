//! refine.
