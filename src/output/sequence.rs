//! Films as numbered image files, which may be rendered in parts, by several machines, and continued.
//!
//! The place of the number is written as programs for film do: `frames/shot-####.png` (Blender: as many digits as
//! signs) or `frames/shot-%04d.png` (`ffmpeg`). A name that is a folder stands for `####.png` in it. Numbers start at 1;
//! one that needs more digits gets them.
//!
//! A [`Shard`] is every `n`-th frame. As neighbouring frames take about as long to render, so do shards.

use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Digits of a number in a folder that is given alone, which stands for `####`.
const FOLDER_DIGITS: usize = 4;

/// Most digits that a name may ask for.
const MAX_DIGITS: usize = 20;

/// The names of the files of a sequence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SequenceName {
    folder: PathBuf,
    before: String,
    digits: usize,
    after: String,
}

/// Why a name is not that of a sequence.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SequenceError {
    /// The number appears more than once.
    #[error("'{}' has several places for the frame's number; one is needed", path.display())]
    SeveralNumbers {
        /// The name.
        path: PathBuf,
    },
    /// The number would be in a folder's name.
    #[error("'{}' has the frame's number in a folder's name; it must be in the file's", path.display())]
    NumberInFolder {
        /// The name.
        path: PathBuf,
    },
    /// Too many digits.
    #[error("'{}' asks for a frame's number of more than {MAX_DIGITS} digits", path.display())]
    TooManyDigits {
        /// The name.
        path: PathBuf,
    },
}

impl SequenceName {
    /// The sequence that `path` stands for; `None` when it has no place for a number, hence is one file.
    ///
    /// # Errors
    /// When it has several places, one among the folders, or too many digits.
    pub fn parse(path: impl AsRef<Path>) -> Result<Option<Self>, SequenceError> {
        let path = path.as_ref();
        let ends_in_separator = path
            .as_os_str()
            .to_string_lossy()
            .ends_with(std::path::is_separator);
        if ends_in_separator || path.is_dir() {
            return Ok(Some(Self {
                folder: path.to_owned(),
                before: String::new(),
                digits: FOLDER_DIGITS,
                after: ".png".to_owned(),
            }));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let in_folder = folder
            .iter()
            .any(|part| part.to_str().is_some_and(|part| place(part).is_some()));
        // A name that is not Unicode has no place that could be found; it is one file's.
        let name = path.file_name().and_then(|name| name.to_str());
        let Some((start, end, digits)) = name.and_then(place) else {
            return if in_folder {
                Err(SequenceError::NumberInFolder {
                    path: path.to_owned(),
                })
            } else {
                Ok(None)
            };
        };
        let (before, after) = name.map_or(("", ""), |name| (&name[..start], &name[end..]));
        if in_folder || place(after).is_some() {
            return Err(SequenceError::SeveralNumbers {
                path: path.to_owned(),
            });
        }
        if digits > MAX_DIGITS {
            return Err(SequenceError::TooManyDigits {
                path: path.to_owned(),
            });
        }
        Ok(Some(Self {
            folder: folder.to_owned(),
            before: before.to_owned(),
            digits,
            after: after.to_owned(),
        }))
    }

    /// The folder of the files.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The name of frame `number`.
    #[must_use]
    pub fn path(&self, number: u32) -> PathBuf {
        let Self {
            before,
            digits,
            after,
            ..
        } = self;
        self.folder
            .join(format!("{before}{number:0digits$}{after}"))
    }
}

/// Start, end and digits of the first place for a number in a file's name: a run of `#`, or `%d`, `%4d` or `%04d`.
fn place(name: &str) -> Option<(usize, usize, usize)> {
    let bytes = name.as_bytes();
    (0..bytes.len()).find_map(|start| match bytes[start] {
        b'#' => {
            let digits = bytes[start..].iter().take_while(|&&b| b == b'#').count();
            Some((start, start + digits, digits))
        }
        b'%' => {
            let width = bytes[start + 1..]
                .iter()
                .take_while(|b| b.is_ascii_digit())
                .count();
            let end = start + 1 + width;
            // A width that is no number, because it is too large, is too large.
            let digits = match &name[start + 1..end] {
                "" => 1,
                text => text.parse().unwrap_or(usize::MAX),
            };
            (bytes.get(end) == Some(&b'd')).then_some((start, end + 1, digits))
        }
        _ => None,
    })
}

/// One of several equal parts of a film: every `count`-th frame, starting with frame `index`, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u32,
    count: u32,
}

impl Shard {
    /// The whole film.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// Part `index` of `count`; `None` unless `index` is from 1 to `count`.
    #[must_use]
    pub fn new(index: u32, count: u32) -> Option<Self> {
        (1..=count)
            .contains(&index)
            .then_some(Self { index, count })
    }

    /// The numbers of the part's frames, in a film whose frames are numbered from 1 to `frames`.
    pub fn numbers(self, frames: u32) -> impl Iterator<Item = u32> {
        (self.index..=frames).step_by(self.count as usize)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.split_once('/')
            .and_then(|(index, count)| Self::new(index.parse().ok()?, count.parse().ok()?))
            .ok_or_else(|| {
                "a shard is I/N, two whole numbers with I from 1 to N, such as 2/8".to_owned()
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name_of(path: &str, number: u32) -> String {
        let name = SequenceName::parse(path).expect("a name");
        let name = name.expect("a sequence").path(number);
        name.to_string_lossy().into_owned()
    }

    #[test]
    fn names_are_those_of_other_programs() {
        for (path, first, large) in [
            ("a/####.png", "a/0001.png", "a/12345.png"),
            ("a-#.png", "a-1.png", "a-12345.png"),
            ("a/b-%04d.png", "a/b-0001.png", "a/b-12345.png"),
            ("%d.png", "1.png", "12345.png"),
            ("%6d.png", "000001.png", "012345.png"),
            ("50%-%03d.png", "50%-001.png", "50%-12345.png"),
            ("a/", "a/0001.png", "a/12345.png"),
            (".", "./0001.png", "./12345.png"),
        ] {
            assert_eq!(name_of(path, 1), first);
            assert_eq!(name_of(path, 12_345), large);
        }
        for single in ["a.png", "a/b.png", "50%.png", "%x-d.png", "%", "é%"] {
            assert_eq!(SequenceName::parse(single), Ok(None), "{single}");
        }
    }

    #[test]
    fn names_that_cannot_be_meant_are_refused() {
        for (path, part) in [
            ("#-#.png", "several places"),
            ("%d-##.png", "several places"),
            ("##/##.png", "several places"),
            ("a%02d/x.png", "in a folder's name"),
            ("%021d.png", "more than 20 digits"),
            ("%99999999999999999999999d.png", "more than 20 digits"),
        ] {
            let error = SequenceName::parse(path).expect_err(path).to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn shards_are_disjoint_and_together_all_frames() {
        for count in 1..=9 {
            let mut numbers: Vec<u32> = (1..=count)
                .filter_map(|index| Shard::new(index, count))
                .flat_map(|shard| shard.numbers(7))
                .collect();
            numbers.sort_unstable();
            assert_eq!(numbers, [1, 2, 3, 4, 5, 6, 7], "{count}");
        }
        assert_eq!(
            "2/3".parse::<Shard>().map(|s| s.numbers(7).collect()),
            Ok(vec![2, 5])
        );
        for bad in [
            "",
            "1",
            "0/4",
            "5/4",
            "1/0",
            "-1/4",
            "1/4/2",
            "a/b",
            "1/99999999999",
        ] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
