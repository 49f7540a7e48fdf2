//! The `specula` program.
fn main() {}
