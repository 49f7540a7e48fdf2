//! Does the engine keep its deadlines? Many frames under many budgets, before a camera that never stands still, each
//! beside a frame of an engine that does nothing but wait.
//!
//! **Overshoot** is the time from call to return, by the engine's clock, less the budget. A machine that does other things as
//! well makes any program late now and then. So every frame has a companion: a [`NullEngine`] of as many threads in a pool of
//! the same kind is given the same budget, just before or just after it, in turns. The difference between the two
//! is ours.
//!
//! Budgets come in shuffled rounds, each of them once in a round: fractions of the way from Gouraud to Phong shading
//! ([`FRACTIONS`]), and absolute ones ([`MILLIS`]), some of which the first image does not fit in. What happens then is
//! another question than what happens otherwise, so each row says whether its budget was a *tight* one: shorter than the median
//! time of a first image.
//!
//! **Work done**: a deadline is easily kept by giving up early. For one in so many frames a second engine finds out how many
//! work units a frame of the same view completes in the same time if no clock stops it.

mod null;
mod plan;
mod summary;
mod work;

pub use null::NullEngine;
pub use plan::{FRACTIONS, MILLIS};
pub use summary::{LateFrames, OvershootMs, SoakSummary, Verdicts, WorkDone};

use super::sweep::SweepBudget;
use crate::backend::BackendKind;
use crate::clock::{Clock, SystemClock};
use crate::frame::{Engine, EngineError, EngineOptions, FrameStats, Method, StageTimes};
use crate::output::Frame;
use crate::scene::{Camera, Scene};
use crate::schedule::Budget;
use crate::simd::SimdLevel;
use plan::Plan;
use serde::Serialize;
use std::ops::ControlFlow;
use std::sync::Arc;

/// What a soak measures, and how.
#[derive(Clone, Debug)]
pub struct SoakOptions {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Frames of each method that budgets are scaled by; zero counts as one.
    pub calibration_frames: u32,
    /// The work done is compared at one in so many frames; zero for none.
    pub work_every: u32,
    /// Threads; `None` for as many as the machine has processors.
    pub threads: Option<usize>,
    /// What draws.
    pub backend: BackendKind,
    /// SIMD level; `None` for the machine's strongest.
    pub simd: Option<SimdLevel>,
    /// Where time comes from. It has to move on by itself, or waiting never ends.
    pub clock: Arc<dyn Clock>,
}

impl Default for SoakOptions {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            calibration_frames: 30,
            work_every: 50,
            threads: None,
            backend: BackendKind::default(),
            simd: None,
            clock: Arc::new(SystemClock::new()),
        }
    }
}

/// The times that a scene's budgets are made from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SoakCalibration {
    /// Median time of a Gouraud-shaded frame.
    pub gouraud_ms: f64,
    /// Median time of a Phong-shaded frame.
    pub phong_ms: f64,
    /// Median time of a first image of adaptive shading, with everything that refinement needs to begin.
    pub first_image_ms: f64,
}

impl SoakCalibration {
    /// The budget at a fraction of the way from Gouraud to Phong shading.
    fn budget(&self, fraction: f64) -> SweepBudget {
        let extra = (self.phong_ms - self.gouraud_ms).max(0.0);
        SweepBudget {
            millis: self.gouraud_ms + fraction * extra,
            fraction: Some(fraction),
        }
    }
}

/// What was measured of one frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SoakRow {
    /// What the scene is called.
    pub scene: String,
    /// Number of the frame in the scene, counted from 1.
    pub frame: u64,
    /// The budget in milliseconds.
    pub budget_ms: f64,
    /// The fraction it was made from.
    pub fraction: Option<f64>,
    /// Whether the budget is shorter than a first image.
    pub is_tight: bool,
    /// Whether the null engine came first.
    pub null_first: bool,
    /// Milliseconds from call to return.
    pub frame_ms: f64,
    /// The same of the null engine.
    pub null_ms: f64,
    /// How far the frame came: [`Outcome::name`](crate::frame::Outcome::name).
    pub outcome: &'static str,
    /// Whether the image is final.
    pub converged: bool,
    /// Nominal nanoseconds of refinement.
    pub work_units: u64,
    /// How many of them a frame does in the same time without a clock; `None` where it was not tried.
    pub unhurried_units: Option<u64>,
    /// Milliseconds by stage; what is missing to `frame_ms` was spent on the way to the engine's threads and back.
    pub stage_ms: StageTimes,
}

impl SoakRow {
    /// Names of the columns of [`to_csv`](Self::to_csv).
    #[must_use]
    pub fn csv_header() -> String {
        let stages = StageTimes::default()
            .entries()
            .map(|(name, _)| format!("{name}_ms"));
        "scene,frame,budget_ms,fraction,is_tight,null_first,frame_ms,overshoot_ms,null_overshoot_ms,outcome,converged,\
         work_units,unhurried_units,"
            .to_owned()
            + &stages.join(",")
    }

    /// The row as a line of comma-separated values, without a line end; what is not there is empty.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let stages = self.stage_ms.entries().map(|(_, ms)| format!("{ms:.4}"));
        format!(
            "{},{},{:.4},{},{},{},{:.4},{:.4},{:.4},{},{},{},{},{}",
            super::csv::quoted(&self.scene),
            self.frame,
            self.budget_ms,
            self.fraction.map_or_else(String::new, |f| f.to_string()),
            self.is_tight,
            self.null_first,
            self.frame_ms,
            self.overshoot_ms(),
            self.null_overshoot_ms(),
            self.outcome,
            self.converged,
            self.work_units,
            self.unhurried_units
                .map_or_else(String::new, |units| units.to_string()),
            stages.join(",")
        )
    }

    /// Milliseconds past the deadline; negative when the frame was early.
    #[must_use]
    pub fn overshoot_ms(&self) -> f64 {
        self.frame_ms - self.budget_ms
    }

    /// The same of the null engine.
    #[must_use]
    pub fn null_overshoot_ms(&self) -> f64 {
        self.null_ms - self.budget_ms
    }
}

/// A scene, an engine that renders it, and all that it is compared with.
#[derive(Debug)]
pub struct Soak {
    name: String,
    options: SoakOptions,
    calibration: SoakCalibration,
    plan: Plan,
    ours: Subject,
    null: NullEngine,
    /// Renders for the comparison of work.
    second: Subject,
}

impl Soak {
    /// Makes the engines, and measures what budgets are made from. `name` is what rows call the scene.
    ///
    /// # Errors
    /// When an engine cannot be made.
    pub fn new(
        name: impl Into<String>,
        scene: &Scene,
        options: SoakOptions,
    ) -> Result<Self, EngineError> {
        let calibration = calibrate(scene, &options)?;
        let ours = Subject::new(scene, &options, Method::Adaptive)?;
        Ok(Self {
            name: name.into(),
            calibration,
            plan: Plan::new(&calibration),
            null: NullEngine::new(ours.engine.threads())?,
            second: Subject::new(scene, &options, Method::Adaptive)?,
            ours,
            options,
        })
    }

    /// The times that budgets are made from.
    #[must_use]
    pub fn calibration(&self) -> &SoakCalibration {
        &self.calibration
    }

    /// Threads of either engine.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.ours.engine.threads()
    }

    /// Measures `frames` more frames and hands over the row of each as soon as it is there, until `on_row` breaks.
    pub fn run(&mut self, frames: u64, mut on_row: impl FnMut(SoakRow) -> ControlFlow<()>) {
        for _ in 0..frames {
            let row = self.measure();
            if on_row(row).is_break() {
                return;
            }
        }
    }

    fn measure(&mut self) -> SoakRow {
        let budget = self.plan.next_budget();
        let frame = self.plan.frames();
        let null_first = frame.is_multiple_of(2);
        let clock = Arc::clone(&self.options.clock);
        let wait = |null: &NullEngine| null.frame(&*clock, budget.millis);
        let mut null_ms = 0.0;
        if null_first {
            null_ms = wait(&self.null);
        }
        let (frame_ms, stats) = self.ours.timed(frame, Budget::from_millis(budget.millis));
        if !null_first {
            null_ms = wait(&self.null);
        }
        let is_tight = budget.millis < self.calibration.first_image_ms;
        let compares_work = self.options.work_every > 0
            && frame.is_multiple_of(u64::from(self.options.work_every))
            && !is_tight;
        SoakRow {
            scene: self.name.clone(),
            frame,
            budget_ms: budget.millis,
            fraction: budget.fraction,
            is_tight,
            null_first,
            frame_ms,
            null_ms,
            outcome: stats.outcome.name(),
            converged: stats.converged,
            work_units: stats.work_units,
            unhurried_units: compares_work
                .then(|| self.unhurried_units(frame, budget.millis, stats.work_units)),
            stage_ms: stats.stage_ms,
        }
    }

    /// How many work units fit in a frame of the same view in the same time. The view before it is rendered first, as it was
    /// for the frame compared with.
    fn unhurried_units(&mut self, frame: u64, millis: f64, guess: u64) -> u64 {
        work::most_units(millis, guess, |units| {
            self.second.timed(frame - 1, Budget::Work(0));
            let (ms, stats) = self.second.timed(frame, Budget::Work(units));
            work::Trial {
                ms,
                units: stats.work_units,
                converged: stats.converged,
            }
        })
    }
}

/// An engine, and a scene that swings before it.
#[derive(Debug)]
struct Subject {
    engine: Engine,
    scene: Scene,
    /// The scene's own.
    camera: Camera,
    frame: Frame,
    clock: Arc<dyn Clock>,
}

impl Subject {
    /// Memory has been touched when it is there, and threads are awake.
    fn new(scene: &Scene, options: &SoakOptions, method: Method) -> Result<Self, EngineError> {
        let engine = Engine::with_options(
            scene,
            EngineOptions {
                method,
                backend: options.backend,
                threads: options.threads,
                simd: options.simd,
                clock: Arc::clone(&options.clock),
                ..EngineOptions::default()
            },
        )?;
        let mut subject = Self {
            engine,
            scene: scene.clone(),
            camera: *scene.camera(),
            frame: Frame::new(options.width, options.height),
            clock: Arc::clone(&options.clock),
        };
        subject.timed(0, Budget::Unlimited);
        subject
            .engine
            .warm_up(&subject.scene, options.width, options.height);
        Ok(subject)
    }

    /// Renders a frame of the swing; also says how many milliseconds that took from call to return.
    fn timed(&mut self, frame: u64, budget: Budget) -> (f64, FrameStats) {
        self.scene
            .set_camera(plan::swung_camera(&self.camera, frame));
        let since = self.clock.now_ms();
        let stats = self.engine.render(&self.scene, budget, &mut self.frame);
        (self.clock.now_ms() - since, stats)
    }
}

/// Measures frames of the first part of the swing, methods taking turns.
fn calibrate(scene: &Scene, options: &SoakOptions) -> Result<SoakCalibration, EngineError> {
    let mut subjects = [
        (Method::Gouraud, Budget::Unlimited),
        (Method::Phong, Budget::Unlimited),
        // Work budgets always complete the first image.
        (Method::Adaptive, Budget::Work(0)),
    ]
    .map(|(method, budget)| Ok((Subject::new(scene, options, method)?, budget)))
    .into_iter()
    .collect::<Result<Vec<_>, EngineError>>()?;
    let mut times = vec![Vec::new(); subjects.len()];
    let rounds = u64::from(options.calibration_frames.max(1));
    for round in 0..rounds {
        // As many views as there are rounds, from all over the swing.
        let view = 1 + round * plan::SWING_FRAMES / rounds;
        for ((subject, budget), times) in subjects.iter_mut().zip(&mut times) {
            times.push(subject.timed(view, *budget).0);
        }
    }
    let medians = times.iter_mut().map(|times| {
        times.sort_unstable_by(f64::total_cmp);
        summary::quantile(times, 500)
    });
    let medians: Vec<f64> = medians.collect();
    Ok(SoakCalibration {
        gouraud_ms: medians[0],
        phong_ms: medians[1],
        first_image_ms: medians[2],
    })
}

#[cfg(test)]
mod tests;
