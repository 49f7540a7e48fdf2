//! Running the `specula` program.

use std::path::Path;
use std::process::{Command, Output};

/// Runs the program in `directory`.
pub(crate) fn specula(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_specula"))
        .args(arguments)
        .current_dir(directory)
        .output()
        .expect("the program starts")
}

/// What the program wrote.
pub(crate) fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}
