//! Files of comma-separated values.

use super::Failure;
use specula::output::png::plain_reason;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file of comma-separated values that is complete up to the last row measured, whatever happens next.
#[derive(Debug)]
pub(super) struct Csv {
    path: PathBuf,
    file: File,
}

impl Csv {
    pub(super) fn create(path: &Path) -> Result<Self, Failure> {
        match File::create(path) {
            Ok(file) => Ok(Self {
                path: path.to_owned(),
                file,
            }),
            Err(error) => Err(cannot_write(path, &error)),
        }
    }

    pub(super) fn line(&mut self, text: &str) -> Result<(), Failure> {
        // One unbuffered write for each line: nothing to flush.
        self.file
            .write_all(format!("{text}\n").as_bytes())
            .map_err(|error| cannot_write(&self.path, &error))
    }
}

fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    Failure::runtime(format!(
        "cannot write {}: {}",
        path.display(),
        plain_reason(error)
    ))
}
