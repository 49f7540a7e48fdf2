//! Files that appear whole or not at all.

use super::png::{SaveError, Scratch, io_error};
use std::io::Write;
use std::path::Path;

/// Writes a file that holds `bytes`, whole or not at all: an older file under that name is kept unless all went well.
///
/// # Errors
/// When the file cannot be written.
pub fn save_whole(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> Result<(), SaveError> {
    let path = path.as_ref();
    let (scratch, mut file) = Scratch::beside(path)?;
    file.write_all(bytes.as_ref())
        .map_err(|error| io_error(path, error))?;
    drop(file);
    scratch.rename_to(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_file_is_replaced_whole_or_left_alone() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("a.txt");
        save_whole(&path, "one, longer").expect("writable");
        save_whole(&path, "two").expect("writable");
        assert_eq!(fs::read_to_string(&path).expect("readable"), "two");
        assert!(save_whole(directory.path(), "three").is_err());
        assert!(save_whole(directory.path().join("none/a.txt"), "three").is_err());
        let files = fs::read_dir(directory.path()).expect("readable").count();
        assert_eq!(files, 1, "nothing half-written stays");
    }
}
