//! Printing results, and progress beside them.

use super::Failure;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt;
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
        Self::with_style(steps, ProgressStyle::with_template(template).ok())
    }

    /// For the frames of a film: with frames per second and the time that remains. Nothing runs in the background.
    pub(super) fn frames(count: u64) -> Self {
        let template = "{wide_bar} frame {pos}/{len}, {rate} a second, {eta} to go";
        let style = ProgressStyle::with_template(template).map(|style| {
            style.with_key(
                "rate",
                |state: &ProgressState, text: &mut dyn fmt::Write| {
                    let _ = write!(text, "{:.1}", state.per_sec());
                },
            )
        });
        Self::with_style(count, style.ok())
    }

    fn with_style(steps: u64, style: Option<ProgressStyle>) -> Self {
        let bar = if io::stderr().is_terminal() {
            ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr())
        } else {
            ProgressBar::hidden()
        };
        if let Some(style) = style {
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
