//! What can be wrong with a scene file, said in one sentence that names the place.

use ron::error::Error as Ron;
use std::io;
use std::path::PathBuf;

/// Why a scene could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file could not be read at all.
    #[error("cannot read scene '{}': {}", path.display(), reason(source))]
    Io {
        /// The file asked for.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is larger than [`MAX_FILE_BYTES`](super::limits::MAX_FILE_BYTES), or a mesh file larger than
    /// [`MAX_MESH_BYTES`](super::limits::MAX_MESH_BYTES).
    #[error("scene '{}' is larger than {} MiB", path.display(), limit >> 20)]
    TooLarge {
        /// The file asked for.
        path: PathBuf,
        /// Most bytes it may have.
        limit: u64,
    },
    /// The contents are not a valid scene.
    #[error("{file}:{line}:{column}: {message}")]
    Invalid {
        /// The file's name as it was given.
        file: String,
        /// Line, counted from 1.
        line: usize,
        /// Column in characters, counted from 1.
        column: usize,
        /// What is wrong, one sentence without a full stop.
        message: String,
    },
}

impl SceneError {
    /// True when the file could not be read, false when what it says is wrong.
    #[must_use]
    pub fn is_io(&self) -> bool {
        matches!(self, Self::Io { .. })
    }
}

/// The system's reason in plain words, where it has a common one.
pub(super) fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".to_owned(),
        io::ErrorKind::IsADirectory => "it is a directory".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        _ => error.to_string(),
    }
}

/// Where in the span that RON reports for an error the fault lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// At its start: a whole word is wrong.
    Start,
    /// At its end: what comes next is wrong.
    End,
}

/// RON's complaint in plain words, and where in its span the fault lies.
pub(super) fn describe(error: &Ron) -> (String, Place) {
    let (message, place) = match error {
        Ron::NoSuchStructField {
            expected,
            found,
            outer,
        } => (
            format!(
                "unknown field `{found}`{}; {}",
                within(outer.as_deref()),
                choices("field", expected)
            ),
            Place::Start,
        ),
        Ron::NoSuchEnumVariant {
            expected, found, ..
        } => (
            format!("unknown kind `{found}`; {}", choices("kind", expected)),
            Place::Start,
        ),
        Ron::MissingStructField { field, outer } => (
            format!("the field `{field}`{} is missing", within(outer.as_deref())),
            Place::End,
        ),
        Ron::DuplicateStructField { field, outer } => (
            format!(
                "the field `{field}`{} appears twice",
                within(outer.as_deref())
            ),
            Place::Start,
        ),
        Ron::Eof => (
            "the file ends too early; a bracket or quote is not closed".to_owned(),
            Place::End,
        ),
        Ron::ExpectedComma => (
            "a comma or a closing bracket is missing here".to_owned(),
            Place::End,
        ),
        Ron::ExpectedMapColon => ("a colon is missing after the name".to_owned(), Place::End),
        Ron::ExpectedStructLikeEnd | Ron::ExpectedOptionEnd => {
            ("a closing `)` is missing here".to_owned(), Place::End)
        }
        Ron::ExpectedArrayEnd => ("a closing `]` is missing here".to_owned(), Place::End),
        Ron::ExpectedMapEnd => ("a closing `}` is missing here".to_owned(), Place::End),
        Ron::ExpectedArray => ("a list `[..]` is needed here".to_owned(), Place::End),
        Ron::ExpectedMap => (
            "a map `{\"name\": (..)}` is needed here".to_owned(),
            Place::End,
        ),
        Ron::ExpectedStructLike | Ron::ExpectedNamedStructLike(_) => (
            "fields in parentheses `(name: value, ..)` are needed here".to_owned(),
            Place::End,
        ),
        Ron::ExpectedDifferentStructName { found, .. } => (
            format!(
                "`{found}` is not expected here; fields in parentheses `(name: value, ..)` are needed"
            ),
            Place::Start,
        ),
        Ron::ExpectedIdentifier => ("a name is needed here".to_owned(), Place::End),
        Ron::ExpectedBoolean => ("`true` or `false` is needed here".to_owned(), Place::End),
        Ron::ExpectedStringEnd => ("a string is not closed".to_owned(), Place::Start),
        Ron::UnclosedBlockComment => ("a block comment is not closed".to_owned(), Place::End),
        Ron::UnexpectedChar(c) => (
            format!("the character {c:?} is not expected here"),
            Place::End,
        ),
        Ron::TrailingCharacters => (
            "nothing may follow the scene's closing `)`".to_owned(),
            Place::End,
        ),
        Ron::ExceededRecursionLimit => ("brackets are nested too deeply".to_owned(), Place::End),
        Ron::InvalidEscape(_) => (
            "a string holds an unknown escape sequence".to_owned(),
            Place::End,
        ),
        Ron::Message(message) => (message.clone(), Place::Start),
        other => (lower_first(&other.to_string()), Place::End),
    };
    (message, place)
}

fn within(outer: Option<&str>) -> String {
    outer.map_or_else(String::new, |name| format!(" of `{name}`"))
}

/// "the fields are `a`, `b` and `c`".
fn choices(noun: &str, names: &[&str]) -> String {
    let quoted: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
    match quoted.as_slice() {
        [] => format!("there are no {noun}s"),
        [only] => format!("the only {noun} is {only}"),
        [first @ .., last] => format!("the {noun}s are {} and {last}", first.join(", ")),
    }
}

fn lower_first(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |first| {
        first.to_lowercase().chain(chars).collect()
    })
}
