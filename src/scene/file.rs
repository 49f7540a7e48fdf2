//! Text files, read whole, up to a size.

use super::error::SceneError;
use super::source::line_and_column;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The file's text.
///
/// # Errors
/// When it cannot be read, has more than `limit` bytes, or is not UTF-8.
pub(super) fn read_text(path: &Path, limit: u64) -> Result<String, SceneError> {
    let bytes = read_bytes(path, limit)
        .map_err(|source| SceneError::Io {
            path: path.to_owned(),
            source,
        })?
        .ok_or_else(|| SceneError::TooLarge {
            path: path.to_owned(),
            limit,
        })?;
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let (line, column) = line_and_column(&String::from_utf8_lossy(valid));
        SceneError::Invalid {
            file: path.to_string_lossy().into_owned(),
            line,
            column,
            message: "this is not UTF-8 text".to_owned(),
        }
    })
}

/// The file's contents; `None` when there are more than `limit` bytes, no more than one of which too many is read.
fn read_bytes(path: &Path, limit: u64) -> std::io::Result<Option<Vec<u8>>> {
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    if metadata.is_dir() {
        // Not every system refuses to read from a directory with a telling error.
        return Err(std::io::ErrorKind::IsADirectory.into());
    }
    if metadata.len() > limit {
        return Ok(None);
    }
    // A pipe does not say how much will come.
    let mut bytes = Vec::with_capacity(usize::try_from(metadata.len()).unwrap_or(0));
    file.take(limit + 1).read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 <= limit).then_some(bytes))
}
