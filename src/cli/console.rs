//! Printing results, and progress beside them.

use super::Failure;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal, Write};
use std::time::Duration;

/// Standard output, line by line. When its reader goes away (`| head`), printing stops quietly.
#[derive(Debug)]
pub(super) struct Output {
    is_open: bool,
}

impl Output {
    pub(super) fn new() -> Self {
        Self { is_open: true }
    }

    /// Whether somebody may still be reading.
    pub(super) fn is_open(&self) -> bool {
        self.is_open
    }

    /// Prints `text` and a line end.
    pub(super) fn line(&mut self, text: &str) -> Result<(), Failure> {
        if !self.is_open {
            return Ok(());
        }
        let mut stdout = io::stdout().lock();
        match writeln!(stdout, "{text}").and_then(|()| stdout.flush()) {
            Ok(()) => Ok(()),
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                self.is_open = false;
                Ok(())
            }
            Err(error) => Err(Failure::runtime(format!(
                "cannot write to standard output: {}",
                specula::output::png::plain_reason(&error)
            ))),
        }
    }
}

/// Prints a message to standard error. If nobody can read it, so be it.
pub(super) fn note(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}

/// How far a long command has come: a line on standard error, if that is a terminal.
#[derive(Debug)]
pub(super) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// `steps` of zero: as many as there will be.
    pub(super) fn new(steps: u64) -> Self {
        let template = if steps > 0 {
            "{msg} {wide_bar} {pos}/{len} {eta}"
        } else {
            "{spinner} {msg}"
        };
        Self::with_template(steps, template)
    }

    /// For the frames of a film: with frames per second and the time that remains. Nothing runs in the background.
    pub(super) fn frames(count: u64) -> Self {
        Self::with_template(
            count,
            "{wide_bar} frame {pos}/{len}, {per_sec}, {eta} to go",
        )
    }

    fn with_template(steps: u64, template: &str) -> Self {
        let bar = if io::stderr().is_terminal() {
            ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr())
        } else {
            ProgressBar::hidden()
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self { bar }
    }

    /// Shows what is being done now, with a sign of life.
    pub(super) fn doing(&self, what: impl Into<String>) {
        self.bar.set_message(what.into());
        self.bar.enable_steady_tick(Duration::from_millis(200));
    }

    /// Shows what is being measured now; nothing runs in the background.
    pub(super) fn measuring(&self, what: impl Into<String>) {
        self.bar.disable_steady_tick();
        self.bar.set_message(what.into());
    }

    /// One step is done.
    pub(super) fn step(&self) {
        self.bar.inc(1);
    }

    /// Prints through `f` without the line being in the way.
    pub(super) fn suspend<R>(&self, f: impl FnOnce() -> R) -> R {
        self.bar.suspend(f)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
