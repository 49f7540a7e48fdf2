//! The grammar of the command line, and who carries a command out.

use super::Failure;
use super::animate::{self, Animate};
use super::bench::{self, Bench};
use super::compare::{self, Compare};
use super::inspect::{self, Inspect};
use super::paper::{self, Experiment};
use super::render::{self, Render};
use super::soak::{self, Soak};
use super::sweep::{self, Sweep};
use clap::{Parser, Subcommand};

/// Renders scenes with specular highlights on the CPU, inside a millisecond budget per frame.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100, subcommand_required = true)]
#[command(after_help = "\
Examples:
  specula render scenes/teapot.ron -o teapot.png
  specula render scenes/teapot.ron -o teapot.png --budget 2 --frames 8
  specula animate scenes/turntable.ron -o turntable.apng --budget 4
  specula sweep scenes/teapot.ron --methods all --repeat 9 --svg teapot.svg
  specula compare scenes/closeup.ron -o sheet.png
  specula bench scenes/teapot.ron --budget 4
  specula paper
  specula soak --frames 3000 --csv soak.csv
  specula inspect scenes/teapot.ron --budget 2 --overlay overlay.png

Exit status: 0 done, 1 failed (also: a file cannot be read or written), 2 bad usage or bad input.")]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
enum Command {
    /// Render frames of a still view under a budget, and write the last one
    Render(Render),
    /// Render the scene's animation, each frame under a budget, as APNG, Y4M or numbered PNG files
    Animate(Animate),
    /// Measure error against time: methods x budgets, every row from a cold engine
    Sweep(Sweep),
    /// Show all methods at the same time side by side, with maps of their errors, on one sheet
    Compare(Compare),
    /// Measure frame times over views from all around a scene
    Bench(Bench),
    /// Repeat the experiment of the paper that this builds on, and print its tables beside ours
    Paper(Experiment),
    /// Count late frames: many budgets before a moving camera, beside an engine that only waits
    Soak(Soak),
    /// Say what a view consists of, and draw it over the image
    Inspect(Inspect),
}

impl Arguments {
    /// Does what was asked for.
    pub(super) fn run(&self) -> Result<(), Failure> {
        match &self.command {
            Command::Render(args) => render::run(args),
            Command::Animate(args) => animate::run(args),
            Command::Sweep(args) => sweep::run(args),
            Command::Compare(args) => compare::run(args),
            Command::Bench(args) => bench::run(args),
            Command::Paper(args) => paper::run(args),
            Command::Soak(args) => soak::run(args),
            Command::Inspect(args) => inspect::run(args),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_grammar_is_consistent() {
        Arguments::command().debug_assert();
    }
}
