//! Where the frames of a film go.

use crate::cli::Failure;
use specula::output::apng::ApngWriter;
use specula::output::png::{check_writable, plain_reason};
use specula::output::sequence::SequenceName;
use specula::output::y4m::{Y4mFile, Y4mWriter};
use specula::output::{Frame, Timing};
use std::fs;
use std::io::{self, IsTerminal, Stdout};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// What is to be written, as its name says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Destination {
    Apng(PathBuf),
    Y4m(PathBuf),
    /// Y4M on standard output.
    Stdout,
    /// Numbered PNG files.
    Images(SequenceName),
}

impl Destination {
    /// The destination of that name.
    pub(super) fn of(path: &Path) -> Result<Self, Failure> {
        if path == Path::new("-") {
            return Ok(Self::Stdout);
        }
        if ends_in(path, "apng") {
            return Ok(Self::Apng(path.to_owned()));
        }
        if ends_in(path, "y4m") {
            return Ok(Self::Y4m(path.to_owned()));
        }
        let images =
            SequenceName::parse(path).map_err(|error| Failure::input(error.to_string()))?;
        match images {
            Some(name) if ends_in(&name.path(1), "png") => Ok(Self::Images(name)),
            None if ends_in(path, "png") => Ok(Self::Apng(path.to_owned())),
            _ => Err(Failure::input(format!(
                "the output must be a .apng, .png or .y4m file, numbered files such as frames/####.png, or - for \
                 standard output, and '{}' is none of them",
                path.display()
            ))),
        }
    }

    /// Whether frames can be rendered one by one, in any order, by several machines.
    pub(super) fn is_sequence(&self) -> bool {
        matches!(self, Self::Images(_))
    }

    /// Finds out whether a single file can be written, before anything is rendered.
    pub(super) fn check(&self) -> Result<(), Failure> {
        match self {
            Self::Apng(path) | Self::Y4m(path) => Ok(check_writable(path)?),
            Self::Stdout if io::stdout().is_terminal() => Err(Failure::input(
                "standard output is a terminal, which shows no video; send it to a program or a file",
            )),
            Self::Stdout | Self::Images(_) => Ok(()),
        }
    }

    /// The file of a numbered frame; `None` if frames have no files of their own.
    pub(super) fn file(&self, number: u32) -> Option<PathBuf> {
        match self {
            Self::Images(name) => Some(name.path(number)),
            Self::Apng(_) | Self::Y4m(_) | Self::Stdout => None,
        }
    }

    /// Starts to write a film of frames of `width` x `height` pixels. Folders of numbered files are made.
    pub(super) fn create(self, width: u32, height: u32, timing: &Timing) -> Result<Film, Failure> {
        Ok(match self {
            Self::Apng(path) => Film::Apng(ApngWriter::create(path, width, height, timing)?),
            Self::Y4m(path) => Film::Y4m(Y4mFile::create(path, width, height, timing)?),
            Self::Stdout => match Y4mWriter::new(io::stdout(), width, height, timing) {
                Ok(stream) => Film::Stdout(stream),
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Film::Nobody,
                Err(error) => return Err(stdout_failure(&error)),
            },
            Self::Images(name) => {
                make_folder(name.folder())?;
                check_writable(name.path(1))?;
                Film::Images(name)
            }
        })
    }
}

fn ends_in(path: &Path, ending: &str) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case(ending))
}

fn make_folder(folder: &Path) -> Result<(), Failure> {
    // Empty: the current folder.
    if folder.as_os_str().is_empty() {
        return Ok(());
    }
    fs::create_dir_all(folder).map_err(|error| {
        Failure::runtime(format!(
            "cannot make the folder {}: {}",
            folder.display(),
            plain_reason(&error)
        ))
    })
}

fn stdout_failure(error: &io::Error) -> Failure {
    Failure::runtime(format!(
        "cannot write to standard output: {}",
        plain_reason(error)
    ))
}

/// A film being written. Single files get their names when they are finished.
#[derive(Debug)]
pub(super) enum Film {
    Apng(ApngWriter),
    Y4m(Y4mFile),
    Stdout(Y4mWriter<Stdout>),
    /// Standard output, whose reader has gone away.
    Nobody,
    Images(SequenceName),
}

impl Film {
    /// Adds a frame. Breaks off when nobody takes any more.
    pub(super) fn write(&mut self, number: u32, frame: &Frame) -> Result<ControlFlow<()>, Failure> {
        match self {
            Self::Apng(film) => film.write(frame)?,
            Self::Y4m(film) => film.write(frame)?,
            Self::Images(name) => frame.save_png(name.path(number))?,
            Self::Nobody => return Ok(ControlFlow::Break(())),
            Self::Stdout(film) => match film.write(frame) {
                Ok(()) => {}
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                    return Ok(ControlFlow::Break(()));
                }
                Err(error) => return Err(stdout_failure(&error)),
            },
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Completes the film.
    pub(super) fn finish(self) -> Result<(), Failure> {
        match self {
            Self::Apng(film) => Ok(film.finish()?),
            Self::Y4m(film) => Ok(film.finish()?),
            Self::Stdout(_) | Self::Nobody | Self::Images(_) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_is_written() {
        let destination = |name: &str| Destination::of(Path::new(name));
        for name in ["a.apng", "a.PNG", "b/c.png", "take#2.apng"] {
            assert!(
                matches!(destination(name), Ok(Destination::Apng(_))),
                "{name}"
            );
        }
        for name in ["a.y4m", "b/take#2.Y4M"] {
            assert!(
                matches!(destination(name), Ok(Destination::Y4m(_))),
                "{name}"
            );
        }
        for name in ["####.png", "b/x-%03d.png", "b/", "/"] {
            assert!(
                matches!(destination(name), Ok(Destination::Images(_))),
                "{name}"
            );
        }
        assert!(matches!(destination("-"), Ok(Destination::Stdout)));
        for name in ["a", "a.mp4", "a.gif", "####", "####.jpg", "", "-.jpg"] {
            let failure = destination(name).expect_err(name);
            assert_eq!(failure.status(), 2, "{name}");
        }
    }
}
