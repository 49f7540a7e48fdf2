//! `specula animate`: the scene's animation as a film, each frame under a budget.

mod args;
mod error;
mod film;
mod summary;

pub(super) use args::Animate;

use super::Failure;
use super::args::budget;
use super::console::{Output, Progress, note};
use super::report::frame_json;
use error::{Comparison, Measured};
use film::{Destination, Film};
use serde_json::json;
use specula::frame::FrameStats;
use specula::output::sequence::Shard;
use specula::output::{Encoding, Frame, Timing};
use specula::scene::{Animation, Scene};
use specula::schedule::Budget;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;
use summary::Summary;

pub(super) fn run(args: &Animate) -> Result<(), Failure> {
    let destination = Destination::of(&args.output)?;
    check_usage(args, &destination)?;
    destination.check()?;
    let mut scene = Scene::load(&args.scene)?;
    let timing = timing(&scene, args)?;
    if ensure_motion(&mut scene, timing) {
        note(&format!(
            "nothing moves in {}: the camera goes around it once",
            args.scene.display()
        ));
    }

    let numbers = args.shard.unwrap_or(Shard::WHOLE).numbers(timing.frames());
    let plan: Vec<Planned> = numbers
        .map(|number| Planned {
            number,
            keep: !args.overwrite && destination.file(number).is_some_and(|file| file.is_file()),
        })
        .collect();
    let mut job = Job {
        args,
        timing,
        scene,
        output: Output::new(),
        summary: Summary::default(),
        destination,
    };
    let started = Instant::now();
    let ended = job.render(&plan)?;
    if ended.is_break() {
        // Nobody reads the film any more, hence neither what could be said of it.
        return Ok(());
    }
    let size = [args.machine.size.width, args.machine.size.height];
    let summary = job.summary.text(size, started.elapsed());
    if args.json || job.destination == Destination::Stdout {
        note(&summary);
    } else {
        job.output.line(&summary)?;
    }
    Ok(())
}

/// Refuses options that contradict each other.
fn check_usage(args: &Animate, destination: &Destination) -> Result<(), Failure> {
    if args.shard.is_some() && !destination.is_sequence() {
        return Err(Failure::input(format!(
            "--shard needs numbered files such as frames/####.png; several parts cannot be one file, '{}'",
            args.output.display()
        )));
    }
    if args.json && *destination == Destination::Stdout {
        return Err(Failure::input(
            "--json and the film cannot both go to standard output; write the film to a file",
        ));
    }
    Ok(())
}

/// Length and frame rate: those asked for, else the scene's own.
fn timing(scene: &Scene, args: &Animate) -> Result<Timing, Failure> {
    let own = scene
        .animation()
        .map_or_else(Timing::default, |animation| *animation.timing());
    let duration_s = args.duration.unwrap_or(own.duration_s());
    Timing::new(duration_s, args.fps.unwrap_or(own.rate()))
        .map_err(|error| Failure::input(error.to_string()))
}

/// Lets the camera go around a scene in which nothing moves, once in the time given. Says whether it had to.
fn ensure_motion(scene: &mut Scene, timing: Timing) -> bool {
    let is_still = !scene.animation().is_some_and(Animation::is_moving);
    if is_still {
        let turntable = Animation::turntable(*scene.camera(), timing);
        scene.set_animation(Some(turntable));
    }
    is_still
}

/// Brings `scene` to where [`run`] would film it after `seconds`.
pub(super) fn go_to_time(scene: &mut Scene, seconds: f64) {
    let own = scene
        .animation()
        .map_or_else(Timing::default, |animation| *animation.timing());
    ensure_motion(scene, own);
    scene.set_time(seconds);
}

/// A frame to be rendered, or kept as it is.
#[derive(Clone, Copy, Debug)]
struct Planned {
    /// Counted from 1.
    number: u32,
    keep: bool,
}

/// A film being made.
struct Job<'a> {
    args: &'a Animate,
    timing: Timing,
    scene: Scene,
    destination: Destination,
    output: Output,
    summary: Summary,
}

impl Job<'_> {
    /// Renders what is not kept. Breaks off when nobody takes the film any more.
    fn render(&mut self, plan: &[Planned]) -> Result<ControlFlow<()>, Failure> {
        let args = self.args;
        let size = args.machine.size;
        let budget = budget(args.budget, args.work);
        // Made from the scene at rest, whichever frame is the first, so that all parts of a film start from the same.
        // Films are sRGB.
        let mut engine = args
            .machine
            .engine(&self.scene, args.method, Encoding::Srgb)?;
        let mut frame = Frame::new(size.width, size.height);
        if args.budget.is_some() {
            engine.warm_up(&self.scene, size.width, size.height);
        }
        let mut film = self
            .destination
            .clone()
            .create(size.width, size.height, &self.timing)?;
        let steps = plan.iter().filter(|planned| !planned.keep).count();
        let progress = Progress::frames(steps as u64);
        let mut comparison = args.error.then(Comparison::default);
        for planned in plan {
            let rendered = if planned.keep {
                self.summary.kept();
                None
            } else {
                self.scene.set_time(self.seconds(planned.number));
                if !matches!(budget, Budget::Millis(_)) {
                    // Where nothing has moved, the image of the frame before would be refined further.
                    engine.forget();
                }
                let stats = engine.render(&self.scene, budget, &mut frame);
                if film.write(planned.number, &frame)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
                self.summary
                    .rendered(stats.frame_ms, budget, stats.estimated_error);
                let measured = comparison
                    .as_mut()
                    .map(|c| c.measure(planned.number, &engine, &self.scene, &frame))
                    .transpose()?;
                if let Some(measured) = &measured {
                    self.summary.measured(measured);
                }
                progress.step();
                Some((stats, measured))
            };
            if args.json {
                let line = self.json(planned, rendered.as_ref());
                progress.suspend(|| self.output.line(&line))?;
            }
        }
        drop(progress);
        self.finish(film, steps)?;
        Ok(ControlFlow::Continue(()))
    }

    /// When a frame is shown.
    fn seconds(&self, number: u32) -> f64 {
        self.timing.rate().seconds(number.saturating_sub(1))
    }

    /// One object for a frame; one that was kept has no statistics.
    fn json(&self, planned: &Planned, rendered: Option<&(FrameStats, Option<Measured>)>) -> String {
        let mut object = match rendered {
            Some((stats, _)) => frame_json(planned.number, stats),
            None => json!({ "frame": planned.number }),
        };
        if let Some(object) = object.as_object_mut() {
            if let Some((_, Some(measured))) = rendered {
                object.insert("error".to_owned(), json!(measured.error));
                object.insert("flicker".to_owned(), json!(measured.flicker));
            }
            let file = self.destination.file(planned.number);
            object.insert("time_s".to_owned(), json!(self.seconds(planned.number)));
            object.insert("kept".to_owned(), json!(planned.keep));
            object.insert(
                "file".to_owned(),
                json!(file.as_deref().map(Path::to_string_lossy)),
            );
        }
        object.to_string()
    }

    fn finish(&self, film: Film, rendered: usize) -> Result<(), Failure> {
        film.finish()?;
        if self.destination != Destination::Stdout && rendered > 0 {
            let size = self.args.machine.size;
            note(&format!(
                "wrote {} ({}x{}, {} frames a second)",
                self.args.output.display(),
                size.width,
                size.height,
                self.timing.rate()
            ));
        }
        Ok(())
    }
}
