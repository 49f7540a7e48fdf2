//! Error against time: methods and budgets, every measurement from a cold engine.
//!
//! **Cold** means that the engine has been told to forget its image, while memory has been touched and the pool is
//! awake: some frames under the same budget are rendered and thrown away just before. (After one, frame times on a shared virtual machine were two
//! thirds of their median apart; after some more, a twentieth.)
//!
//! Budgets that mean something on any machine are written `G + f (P - G)`, with `G` and `P` the times of a Gouraud and a
//! Phong frame in the same run: `f = 0` buys Gouraud shading, `f = 1` Phong shading everywhere. Both are
//! [medians](Calibration) of frames that alternate, so that a change of the machine's speed meets both. They are measured again
//! during and after the sweep: the difference tells whether the machine was too [noisy](Noise).
//!
//! The paper's methods have no budgets but thresholds: at each budget they take the next finer one.
//!
//! Of several repetitions the row with the median frame time is kept whole, so that time and error belong together (of
//! an even number, the faster of the two in the middle).

mod calibration;
mod curve;
mod row;
mod thresholds;

pub use calibration::{Calibration, Noise};
pub use curve::{Curve, CurveArea, CurvePoint};
pub use row::SweepRow;

use super::{ErrorReport, ReferenceImage};
use crate::backend::BackendKind;
use crate::clock::{Clock, SystemClock};
use crate::frame::{Engine, EngineError, EngineOptions, FrameStats, Method, Overrun};
use crate::output::{Encoding, Frame};
use crate::scene::Scene;
use crate::schedule::{Budget, CostModel};
use crate::simd::SimdLevel;
use calibration::Calibrator;
use std::ops::ControlFlow;
use std::sync::Arc;

/// What a sweep measures, and how.
#[derive(Clone, Debug)]
pub struct SweepOptions {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Methods, each measured at every budget.
    pub methods: Vec<Method>,
    /// Consecutive frames of the still view at each budget; zero counts as one.
    pub frames: u32,
    /// How often each of them is measured; zero counts as one.
    pub repeats: u32,
    /// Frames of each method that [`Sweep::calibrate`] takes the median of; zero counts as one.
    pub calibration_frames: u32,
    /// Threads; `None` for as many as the machine has processors.
    pub threads: Option<usize>,
    /// What draws.
    pub backend: BackendKind,
    /// How images store light; errors are measured in its codes.
    pub encoding: Encoding,
    /// SIMD level; `None` for the machine's strongest.
    pub simd: Option<SimdLevel>,
    /// Where time comes from.
    pub clock: Arc<dyn Clock>,
    /// What is known about costs; see [`EngineOptions::costs`].
    pub costs: Option<CostModel>,
}

impl Default for SweepOptions {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            methods: vec![Method::Adaptive, Method::PhongArea],
            frames: 1,
            repeats: 1,
            calibration_frames: 30,
            threads: None,
            backend: BackendKind::default(),
            encoding: Encoding::default(),
            simd: None,
            clock: Arc::new(SystemClock::new()),
            costs: None,
        }
    }
}

impl SweepOptions {
    fn engine(&self, scene: &Scene, method: Method) -> Result<Engine, EngineError> {
        Engine::with_options(
            scene,
            EngineOptions {
                method,
                backend: self.backend,
                encoding: self.encoding,
                threads: self.threads,
                simd: self.simd,
                clock: Arc::clone(&self.clock),
                overrun: Overrun::BeLate,
                costs: self.costs.clone(),
                ..EngineOptions::default()
            },
        )
    }
}

/// One budget of a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweepBudget {
    /// Wall-clock milliseconds per frame.
    pub millis: f64,
    /// The `f` of [`Calibration::budget`] that it was made from.
    pub fraction: Option<f64>,
}

impl SweepBudget {
    /// An absolute budget in milliseconds.
    #[must_use]
    pub fn from_millis(millis: f64) -> Self {
        Self {
            millis,
            fraction: None,
        }
    }
}

/// Sweeps one view of a scene, from the scene's own camera.
#[derive(Debug)]
pub struct Sweep<'a> {
    name: String,
    scene: &'a Scene,
    options: SweepOptions,
    /// One for each method, in order.
    engines: Vec<Engine>,
    /// Of each of them, if it has one.
    thresholds: Vec<Option<f64>>,
    reference: ReferenceImage,
    frame: Frame,
    calibrator: Option<Calibrator>,
}

impl<'a> Sweep<'a> {
    /// Makes the engines and renders the Phong reference. `name` is what rows call the scene.
    ///
    /// # Errors
    /// When an engine cannot be made.
    pub fn new(
        name: impl Into<String>,
        scene: &'a Scene,
        options: SweepOptions,
    ) -> Result<Self, EngineError> {
        let engines = options
            .methods
            .iter()
            .map(|&method| options.engine(scene, method))
            .collect::<Result<Vec<_>, _>>()?;
        // The world does not depend on the method, but there may be no method.
        let gouraud = options.engine(scene, Method::Gouraud)?;
        let world = gouraud.world();
        let view = world
            .view(scene.camera(), options.width, options.height)
            .with_encoding(options.encoding);
        Ok(Self {
            name: name.into(),
            scene,
            reference: ReferenceImage::render(world, &view, gouraud.threads()),
            frame: Frame::new(options.width, options.height),
            thresholds: vec![None; engines.len()],
            engines,
            options,
            calibrator: None,
        })
    }

    /// The image that all others are compared with.
    #[must_use]
    pub fn reference(&self) -> &ReferenceImage {
        &self.reference
    }

    /// How many rows [`run`](Self::run) makes of `budgets` budgets.
    #[must_use]
    pub fn rows(&self, budgets: usize) -> u64 {
        self.engines.len() as u64 * budgets as u64 * u64::from(self.options.frames.max(1))
    }

    /// Measures the Gouraud and the Phong frame time, cold frames of both alternating.
    ///
    /// # Errors
    /// When an engine cannot be made.
    pub fn calibrate(&mut self) -> Result<Calibration, EngineError> {
        let mut calibrator = Calibrator::new(&self.options, self.scene)?;
        calibrator.render_gouraud(self.scene, &mut self.frame);
        calibrator.gouraud_rmse = ErrorReport::of_same_kind(&self.frame, &self.reference).rmse;
        calibrator.measure(self.calibration_rounds(), self.scene, &mut self.frame);
        let calibration = calibrator.take();
        self.calibrator = Some(calibrator);
        Ok(calibration)
    }

    /// What [`calibrate`](Self::calibrate) would have found during [`run`](Self::run), which measures a Gouraud and a Phong
    /// frame after each budget, and since then; `None` if there was no calibration before.
    pub fn recalibrate(&mut self) -> Option<Calibration> {
        let rounds = self.calibration_rounds();
        let calibrator = self.calibrator.as_mut()?;
        let missing = rounds.saturating_sub(calibrator.rounds());
        calibrator.measure(missing, self.scene, &mut self.frame);
        Some(calibrator.take())
    }

    fn calibration_rounds(&self) -> usize {
        self.options.calibration_frames.max(1) as usize
    }

    /// Measures every method at every budget and hands over each row as soon as it is measured, until `on_row` breaks.
    /// All methods take their turn at one budget before the next one, so that they meet the same machine.
    pub fn run(
        &mut self,
        budgets: &[SweepBudget],
        mut on_row: impl FnMut(SweepRow) -> ControlFlow<()>,
    ) {
        for method in 0..self.engines.len() {
            self.warm_up(method);
        }
        for (step, &budget) in budgets.iter().enumerate() {
            for method in 0..self.engines.len() {
                self.set_threshold(method, step, budgets.len());
                for row in self.measure(method, budget) {
                    if on_row(row).is_break() {
                        return;
                    }
                }
            }
            if let Some(calibrator) = &mut self.calibrator {
                calibrator.measure(1, self.scene, &mut self.frame);
            }
        }
    }

    /// Measures the first frame of every method at one budget, and hands over each row with its image as soon as it is
    /// measured.
    pub fn run_with_images(
        &mut self,
        budget: SweepBudget,
        mut on_image: impl FnMut(SweepRow, Frame),
    ) {
        for method in 0..self.engines.len() {
            self.warm_up(method);
        }
        for method in 0..self.engines.len() {
            self.set_threshold(method, 0, 1);
            let mut images: Vec<(SweepRow, Frame)> = (0..self.options.repeats.max(1))
                .map(|_| {
                    self.lead_in(method, budget);
                    let stats = self.render(method, budget, Start::Cold);
                    let row = self.row(method, budget, 1, &stats);
                    (row, self.frame.clone())
                })
                .collect();
            let middle = median_index(&images, |(row, _)| row.frame_ms);
            let (row, frame) = images.swap_remove(middle);
            on_image(row, frame);
        }
    }

    /// Gives a method of the paper its next threshold.
    fn set_threshold(&mut self, method: usize, step: usize, steps: usize) {
        let name = self.options.methods[method];
        let threshold = thresholds::of_step(name, step, steps);
        if name.is_of_the_paper() {
            self.engines[method].set_paper_rule(thresholds::rule(name, threshold));
        }
        self.thresholds[method] = threshold;
    }

    /// The rows of one method at one budget, one for each frame.
    fn measure(&mut self, method: usize, budget: SweepBudget) -> Vec<SweepRow> {
        let mut repeats: Vec<Vec<SweepRow>> = Vec::new();
        for _ in 0..self.options.repeats.max(1) {
            self.lead_in(method, budget);
            repeats.push(
                (1..=self.options.frames.max(1))
                    .map(|number| {
                        let start = if number == 1 {
                            Start::Cold
                        } else {
                            Start::Continued
                        };
                        let stats = self.render(method, budget, start);
                        self.row(method, budget, number, &stats)
                    })
                    .collect(),
            );
        }
        let frames = repeats.first().map_or(0, Vec::len);
        (0..frames)
            .map(|frame| {
                let middle = median_index(&repeats, |rows| rows[frame].frame_ms);
                repeats[middle][frame].clone()
            })
            .collect()
    }

    /// Touches all memory an engine will need, and lets the operating system spread its new threads over the processors,
    /// which takes it some tens of milliseconds.
    fn warm_up(&mut self, method: usize) {
        let engine = &mut self.engines[method];
        engine.render(self.scene, Budget::Unlimited, &mut self.frame);
        for _ in 0..WARM_UP_FRAMES {
            engine.forget();
            engine.render(self.scene, Budget::from_millis(0.0), &mut self.frame);
        }
    }

    /// Renders the frames before one that is measured.
    fn lead_in(&mut self, method: usize, budget: SweepBudget) {
        for _ in 0..LEAD_FRAMES {
            self.render(method, budget, Start::Cold);
        }
    }

    fn render(&mut self, method: usize, budget: SweepBudget, start: Start) -> FrameStats {
        let engine = &mut self.engines[method];
        if start == Start::Cold {
            engine.forget();
            // As in calibration, every pixel is handed over anew.
            self.frame.pixels_mut();
        }
        engine.render(
            self.scene,
            Budget::from_millis(budget.millis),
            &mut self.frame,
        )
    }

    fn row(&self, method: usize, budget: SweepBudget, number: u32, stats: &FrameStats) -> SweepRow {
        SweepRow {
            scene: self.name.clone(),
            method: self.options.methods[method].name(),
            budget_ms: budget.millis,
            fraction: budget.fraction,
            threshold: self.thresholds[method],
            frame: number,
            frame_ms: stats.frame_ms,
            overshoot_ms: stats.frame_ms - budget.millis,
            error: ErrorReport::of_same_kind(&self.frame, &self.reference),
            triangles_subdivided: stats.triangles_subdivided,
            converged: stats.converged,
        }
    }
}

/// First images that each engine draws before the first measured row.
const WARM_UP_FRAMES: usize = 20;

/// Frames before each that is measured: by then its engine's threads have the processors, and its memory the caches.
const LEAD_FRAMES: usize = 5;

/// How a frame starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Start {
    /// The engine has forgotten its image.
    Cold,
    /// It goes on with the last frame's.
    Continued,
}

/// The index of the item whose key is the (lower) median; 0 of nothing.
fn median_index<T>(items: &[T], key: impl Fn(&T) -> f64) -> usize {
    let mut order: Vec<usize> = (0..items.len()).collect();
    order.sort_by(|&a, &b| key(&items[a]).total_cmp(&key(&items[b])));
    order
        .get(items.len().saturating_sub(1) / 2)
        .copied()
        .unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::ManualClock;

    fn scene() -> Scene {
        Scene::parse("(objects: [(shape: Teapot())])", "teapot.ron").expect("a valid scene")
    }

    /// On a clock that moves on by a microsecond per reading.
    fn options() -> SweepOptions {
        SweepOptions {
            width: 64,
            height: 48,
            methods: vec![Method::Gouraud, Method::Phong],
            calibration_frames: 3,
            threads: Some(1),
            clock: Arc::new(ManualClock::with_step_ns(1_000)),
            ..SweepOptions::default()
        }
    }

    #[test]
    fn every_frame_of_every_method_and_budget_has_its_row() {
        let scene = scene();
        let options = SweepOptions {
            frames: 2,
            repeats: 3,
            ..options()
        };
        let mut sweep = Sweep::new("teapot", &scene, options).expect("one thread");
        let budgets = [0.5, 4.0].map(SweepBudget::from_millis);
        let mut rows = Vec::new();
        sweep.run(&budgets, |row| {
            rows.push(row);
            ControlFlow::Continue(())
        });
        assert_eq!(rows.len() as u64, sweep.rows(budgets.len()));
        let found: Vec<_> = rows
            .iter()
            .map(|row| (row.budget_ms, row.method, row.frame))
            .collect();
        let expected: Vec<_> = [0.5, 4.0]
            .into_iter()
            .flat_map(|ms| ["gouraud", "phong"].map(|method| (ms, method)))
            .flat_map(|(ms, method)| [1, 2].map(|frame| (ms, method, frame)))
            .collect();
        assert_eq!(found, expected);
        for row in &rows {
            assert_eq!(row.overshoot_ms, row.frame_ms - row.budget_ms);
            assert!(row.error.covered_pixels > 100);
            // Phong shading is what the reference does; Gouraud shading of 896 triangles is not.
            assert_eq!(row.error.max <= 1, row.method == "phong", "{row:?}");
        }
    }

    #[test]
    fn a_sweep_ends_when_nobody_takes_its_rows() {
        let scene = scene();
        let mut sweep = Sweep::new("teapot", &scene, options()).expect("one thread");
        let mut rows = 0;
        sweep.run(&[SweepBudget::from_millis(1.0)], |_| {
            rows += 1;
            ControlFlow::Break(())
        });
        assert_eq!(rows, 1);
    }

    #[test]
    fn calibrations_before_and_after_have_the_frames_asked_for() {
        let scene = scene();
        let mut sweep = Sweep::new("teapot", &scene, options()).expect("one thread");
        assert_eq!(sweep.recalibrate(), None);
        let before = sweep.calibrate().expect("one thread");
        assert!(before.gouraud_ms > 0.0 && before.phong_ms > 0.0);
        assert_eq!(before.frames, 3);
        // Two frames are measured while the sweep runs.
        let budgets = [1.0, 2.0].map(SweepBudget::from_millis);
        let mut gouraud_rmse = 0.0;
        sweep.run(&budgets, |row| {
            if row.method == "gouraud" {
                gouraud_rmse = row.error.rmse;
            }
            ControlFlow::Continue(())
        });
        let after = sweep.recalibrate().expect("there was one");
        assert_eq!(after.frames, 3);
        // On a clock that moves on by each reading, the same work takes the same time.
        assert!(Noise::between(&before, &after).drift < 1e-9);
        assert!(gouraud_rmse > 0.0);
        assert_eq!(before.gouraud_rmse, gouraud_rmse);
    }

    #[test]
    fn images_come_with_their_rows() {
        let scene = scene();
        let options = SweepOptions {
            repeats: 3,
            ..options()
        };
        let mut sweep = Sweep::new("teapot", &scene, options).expect("one thread");
        let mut images = Vec::new();
        sweep.run_with_images(SweepBudget::from_millis(1.0), |row, frame| {
            images.push((row, frame));
        });
        assert_eq!(images.len(), 2);
        for (row, frame) in &images {
            let error = ErrorReport::compare(frame, sweep.reference()).expect("same size");
            assert_eq!(error, row.error, "{}", row.method);
        }
    }

    #[test]
    fn the_median_is_one_of_the_items() {
        let index = |items: &[f64]| median_index(items, |&item| item);
        assert_eq!(index(&[]), 0);
        assert_eq!(index(&[5.0, 1.0, 3.0]), 2);
        assert_eq!(index(&[4.0, 1.0, 3.0, 2.0]), 3);
    }
}
