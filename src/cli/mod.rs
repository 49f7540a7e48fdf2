//! The command line: it reads arguments, calls the library and prints. Results go to stdout, messages and progress to
//! stderr.
//!
//! Exit status: 0 done; 1 the program failed (input and output, machine); 2 bad usage or bad input.

mod animate;
mod args;
mod bench;
mod command;
mod compare;
mod console;
mod costs;
mod csv;
mod inspect;
mod log;
mod machine;
mod paper;
mod render;
mod report;
mod soak;
mod sweep;

use clap::Parser;
use specula::frame::EngineError;
use specula::output::SaveError;
use specula::scene::SceneError;
use std::fmt;
use std::io::Write;
use std::process::ExitCode;

/// Why a command did not do what it was asked to, in one sentence.
#[derive(Debug)]
enum Failure {
    /// What was asked for makes no sense: exit status 2.
    Input(String),
    /// It could not be done: exit status 1.
    Runtime(String),
}

impl Failure {
    fn input(message: impl Into<String>) -> Self {
        Self::Input(message.into())
    }

    fn runtime(message: impl Into<String>) -> Self {
        Self::Runtime(message.into())
    }

    fn status(&self) -> u8 {
        match self {
            Self::Runtime(_) => 1,
            Self::Input(_) => 2,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Input(message) | Self::Runtime(message)) = self;
        f.write_str(message)
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        if error.is_io() {
            Self::runtime(error.to_string())
        } else {
            Self::input(error.to_string())
        }
    }
}

impl From<SaveError> for Failure {
    fn from(error: SaveError) -> Self {
        Self::runtime(error.to_string())
    }
}

impl From<EngineError> for Failure {
    fn from(error: EngineError) -> Self {
        match error {
            EngineError::NeedsPixels { .. } => Self::input(error.to_string()),
            _ => Self::runtime(error.to_string()),
        }
    }
}

/// Runs the program with the process's arguments.
pub(crate) fn main() -> ExitCode {
    let arguments = match command::Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version come this way too. When nobody reads them there is nobody to complain to.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    match arguments.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            let _ = writeln!(std::io::stderr(), "error: {failure}");
            ExitCode::from(failure.status())
        }
    }
}
