//! Frame times over views from all around a scene: the experiment of Cho, Neumann and Woo, section 4.
//!
//! The paper renders the teapot 60 times from different viewpoints, and gives average times and numbers of triangles
//! subdivided. Here the camera turns about its target, around its up vector, in equal steps; the first view is the scene's own.
//! Every frame is **cold**: the engine has no image of the view to go on from, while memory has been touched and its threads
//! are awake, because a whole turn is rendered and thrown away first. Without a budget a frame is rendered until its method
//! has converged.
//!
//! Quantiles are by nearest rank: the p99 of times is the smallest of them that at least 99 % of them do not exceed, the
//! median that for 50 %; so each is the time of some frame. Times of stages and counts are means, as in the paper.
//!
//! The error is that of separate frames, rendered when all times have been taken, because the reference image takes a
//! thousand times longer than a frame. It is pooled over the views compared: `rmse` is the root of the mean over all
//! their pixels.

use super::metrics::ErrorHistogram;
use super::predictions::{PredictionErrors, Predictions};
use super::reference::ReferenceImage;
use crate::backend::BackendKind;
use crate::clock::{Clock, SystemClock};
use crate::frame::{Engine, EngineError, EngineOptions, FrameStats, Method, Overrun, StageTimes};
use crate::output::{Encoding, Frame};
use crate::refine::paper::PaperRule;
use crate::scene::{Camera, Scene};
use crate::schedule::{Budget, CostModel};
use crate::simd::SimdLevel;
use glam::{DMat3, DVec3};
use serde::Serialize;
use std::f64::consts::TAU;
use std::sync::Arc;

/// What a bench measures, and how.
#[derive(Clone, Debug)]
pub struct BenchOptions {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// How images are shaded.
    pub method: Method,
    /// How far the paper's methods go.
    pub paper: PaperRule,
    /// What each frame may cost.
    pub budget: Budget,
    /// Views around the scene; zero counts as one.
    pub views: u32,
    /// How often each view is timed; zero counts as one.
    pub repeats: u32,
    /// How many of the views, evenly spaced, are compared with the Phong reference; at most all.
    pub compared_views: u32,
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

impl Default for BenchOptions {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            method: Method::default(),
            paper: PaperRule::default(),
            budget: Budget::Unlimited,
            views: 60,
            repeats: 1,
            compared_views: 4,
            threads: None,
            backend: BackendKind::default(),
            encoding: Encoding::default(),
            simd: None,
            clock: Arc::new(SystemClock::new()),
            costs: None,
        }
    }
}

impl BenchOptions {
    /// How many frames [`bench()`] renders for what.
    #[must_use]
    pub fn steps(&self, phase: BenchPhase) -> u64 {
        let views = u64::from(self.views.max(1));
        match phase {
            BenchPhase::WarmingUp => views,
            BenchPhase::Timing => views * u64::from(self.repeats.max(1)),
            BenchPhase::Comparing => u64::from(self.compared_views).min(views),
        }
    }
}

/// What a bench is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BenchPhase {
    /// Rendering a turn that does not count.
    WarmingUp,
    /// Timing frames.
    Timing,
    /// Comparing frames with the Phong reference.
    Comparing,
}

impl BenchPhase {
    /// All of them, in order.
    pub const ALL: [Self; 3] = [Self::WarmingUp, Self::Timing, Self::Comparing];
}

/// What a bench has measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BenchReport {
    /// What the scene is called.
    pub scene: String,
    /// The method's name.
    pub method: &'static str,
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Threads used.
    pub threads: usize,
    /// Views around the scene.
    pub views: u32,
    /// How often each was timed.
    pub repeats: u32,
    /// Lights of the scene.
    pub lights: usize,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Wall-clock budget of a frame, if that was given.
    pub budget_ms: Option<f64>,
    /// Budget of a frame in work units, if that was given.
    pub budget_work: Option<u64>,
    /// Shortest frame.
    pub frame_ms_min: f64,
    /// Median frame.
    pub frame_ms_median: f64,
    /// Mean frame.
    pub frame_ms_mean: f64,
    /// 99 % of frames take no longer.
    pub frame_ms_p99: f64,
    /// Longest frame.
    pub frame_ms_max: f64,
    /// Mean milliseconds by stage.
    pub stage_ms: StageTimes,
    /// How far what the engine predicted that stages take was off in the median frame.
    pub prediction_error_median: PredictionErrors,
    /// 95 % of frames were off no further.
    pub prediction_error_p95: PredictionErrors,
    /// Frames that ended after their deadline; `None` without a wall-clock budget, as are the overshoots.
    pub late_frames: Option<u64>,
    /// Median milliseconds past the deadline, negative when early.
    pub overshoot_ms_median: Option<f64>,
    /// 99 % of frames end no later.
    pub overshoot_ms_p99: Option<f64>,
    /// The latest end of a frame.
    pub overshoot_ms_max: Option<f64>,
    /// Frames timed.
    pub frames: u64,
    /// Those of them whose image is final.
    pub converged_frames: u64,
    /// Mean number of triangles sent to the rasterizer's tiles.
    pub triangles_drawn: f64,
    /// Mean number of triangles that own a pixel.
    pub triangles_visible: f64,
    /// Mean number of triangles subdivided.
    pub triangles_subdivided: f64,
    /// Mean number of parts that they were divided into, as far as those are still interpolated.
    pub leaves: f64,
    /// Mean number of potentially highlighted triangles that own a pixel.
    pub pht_visible: f64,
    /// Mean number of pixels shaded by the illumination equation in refinement.
    pub phong_pixels: f64,
    /// Views compared with the Phong reference.
    pub compared_views: u32,
    /// Their root mean square error in 8-bit codes; `None` when none was compared.
    pub rmse: Option<f64>,
    /// The same in decibels; `None` also where there is no error.
    pub psnr_db: Option<f64>,
    /// What the engine knew about costs in the end.
    #[serde(skip)]
    pub costs: CostModel,
}

/// Renders `scene`, which the report calls `name`, from all around. `on_frame` is told of every frame finished.
///
/// # Errors
/// When the engine cannot be made.
pub fn bench(
    name: impl Into<String>,
    scene: &Scene,
    options: &BenchOptions,
    mut on_frame: impl FnMut(BenchPhase),
) -> Result<BenchReport, EngineError> {
    let engine = Engine::with_options(
        scene,
        EngineOptions {
            method: options.method,
            paper: options.paper,
            threads: options.threads,
            backend: options.backend,
            encoding: options.encoding,
            simd: options.simd,
            clock: Arc::clone(&options.clock),
            overrun: Overrun::BeLate,
            costs: options.costs.clone(),
            ..EngineOptions::default()
        },
    )?;
    let mut turntable = Turntable {
        engine,
        scene: scene.clone(),
        camera: *scene.camera(),
        views: options.views.max(1),
        budget: options.budget,
        frame: Frame::new(options.width, options.height),
    };
    for view in 0..turntable.views {
        turntable.render(view);
        on_frame(BenchPhase::WarmingUp);
    }
    let mut totals = Totals::default();
    for _ in 0..options.repeats.max(1) {
        for view in 0..turntable.views {
            totals.add(&turntable.render(view));
            on_frame(BenchPhase::Timing);
        }
    }
    let compared = options.compared_views.min(turntable.views);
    let mut errors = ErrorHistogram::default();
    for index in 0..compared {
        let view = (u64::from(index) * u64::from(turntable.views) / u64::from(compared)) as u32;
        turntable.compare(view, &mut errors);
        on_frame(BenchPhase::Comparing);
    }

    let error = (compared > 0).then(|| errors.report());
    Ok(BenchReport {
        scene: name.into(),
        compared_views: compared,
        rmse: error.map(|error| error.rmse),
        psnr_db: error
            .map(|error| error.psnr_db)
            .filter(|psnr| psnr.is_finite()),
        ..totals.report(options, &turntable)
    })
}

/// The camera as view number `view` of `views` has it: turned about its target, around its up vector. A camera that looks
/// along that vector, or defines none, stays.
#[must_use]
pub fn camera_around(camera: &Camera, view: u32, views: u32) -> Camera {
    let Some(axis) = axis(camera.up) else {
        return *camera;
    };
    let turn = DMat3::from_axis_angle(axis, TAU * f64::from(view) / f64::from(views.max(1)));
    Camera {
        position: camera.target + turn * (camera.position - camera.target),
        ..*camera
    }
}

/// A vector's direction, also if it is so long or short that its square is not a number to work with.
fn axis(v: DVec3) -> Option<DVec3> {
    (v / v.abs().max_element()).try_normalize()
}

/// An engine, and a scene that turns before it.
#[derive(Debug)]
struct Turntable {
    engine: Engine,
    scene: Scene,
    /// The scene's own.
    camera: Camera,
    views: u32,
    budget: Budget,
    frame: Frame,
}

impl Turntable {
    /// Renders a view from cold.
    fn render(&mut self, view: u32) -> FrameStats {
        self.scene
            .set_camera(camera_around(&self.camera, view, self.views));
        self.engine.forget();
        self.engine
            .render(&self.scene, self.budget, &mut self.frame)
    }

    /// Adds the error of a view.
    fn compare(&mut self, view: u32, errors: &mut ErrorHistogram) {
        // The reference before it has put the engine's threads to sleep, and its memory out of the caches.
        self.render(view);
        self.render(view);
        let (width, height) = (self.frame.width(), self.frame.height());
        let world = self.engine.world();
        let view = world
            .view(self.scene.camera(), width, height)
            .with_encoding(self.engine.encoding());
        let reference = ReferenceImage::render(world, &view, self.engine.threads());
        errors.add_image(&self.frame, &reference);
    }
}

/// What frames add up to.
#[derive(Debug, Default)]
struct Totals {
    frame_ms: Vec<f64>,
    stage_ms: StageTimes,
    predictions: Predictions,
    converged: u64,
    triangles_drawn: u64,
    triangles_visible: u64,
    triangles_subdivided: u64,
    leaves: u64,
    pht_visible: u64,
    phong_pixels: u64,
}

impl Totals {
    fn add(&mut self, stats: &FrameStats) {
        self.frame_ms.push(stats.frame_ms);
        self.stage_ms.add_scaled(&stats.stage_ms, 1.0);
        self.predictions.add(&stats.predicted_ms, &stats.stage_ms);
        self.converged += u64::from(stats.converged);
        self.triangles_drawn += stats.triangles_drawn;
        self.triangles_visible += stats.triangles_visible;
        self.triangles_subdivided += stats.triangles_subdivided;
        self.leaves += stats.leaves;
        self.pht_visible += stats.pht_visible;
        self.phong_pixels += stats.phong_pixels;
    }

    /// The report of a bench without a name that has compared nothing.
    fn report(mut self, options: &BenchOptions, turntable: &Turntable) -> BenchReport {
        self.frame_ms.sort_unstable_by(f64::total_cmp);
        let times = &self.frame_ms;
        let share = 1.0 / times.len().max(1) as f64;
        let mean = |count: u64| count as f64 * share;
        let (budget_ms, budget_work) = match options.budget {
            Budget::Millis(ms) => (Some(ms), None),
            Budget::Work(units) => (None, Some(units)),
            Budget::Error(_) | Budget::Unlimited | Budget::Replay(_) => (None, None),
        };
        let overshoot = |percent| budget_ms.map(|budget| quantile(times, percent) - budget);
        let mut stage_ms = StageTimes::default();
        stage_ms.add_scaled(&self.stage_ms, share);
        BenchReport {
            scene: String::new(),
            method: options.method.name(),
            width: options.width,
            height: options.height,
            threads: turntable.engine.threads(),
            views: turntable.views,
            repeats: options.repeats.max(1),
            lights: turntable.scene.lights().len(),
            triangles: turntable.scene.triangle_count(),
            budget_ms,
            budget_work,
            frame_ms_min: quantile(times, 0),
            frame_ms_median: quantile(times, 50),
            frame_ms_mean: times.iter().sum::<f64>() * share,
            frame_ms_p99: quantile(times, 99),
            frame_ms_max: quantile(times, 100),
            stage_ms,
            prediction_error_median: self.predictions.quantile(50),
            prediction_error_p95: self.predictions.quantile(95),
            late_frames: budget_ms
                .map(|budget| times.iter().filter(|&&ms| ms > budget).count() as u64),
            overshoot_ms_median: overshoot(50),
            overshoot_ms_p99: overshoot(99),
            overshoot_ms_max: overshoot(100),
            frames: times.len() as u64,
            converged_frames: self.converged,
            triangles_drawn: mean(self.triangles_drawn),
            triangles_visible: mean(self.triangles_visible),
            triangles_subdivided: mean(self.triangles_subdivided),
            leaves: mean(self.leaves),
            pht_visible: mean(self.pht_visible),
            phong_pixels: mean(self.phong_pixels),
            compared_views: 0,
            rmse: None,
            psnr_db: None,
            costs: turntable.engine.costs().clone(),
        }
    }
}

/// The smallest of ascending values that at least `percent` of them do not exceed; zero of nothing.
pub(super) fn quantile(ascending: &[f64], percent: usize) -> f64 {
    let rank = (ascending.len() * percent).div_ceil(100).max(1);
    ascending.get(rank - 1).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::ManualClock;

    fn scene() -> Scene {
        let text = "(camera: Perspective(position: (6, -6, 5), target: (1, 0, 1)), \
            objects: [(shape: Teapot(tessellation: 3))])";
        Scene::parse(text, "bench.ron").expect("the scene is valid")
    }

    fn options(method: Method, views: u32) -> BenchOptions {
        BenchOptions {
            width: 96,
            height: 64,
            method,
            views,
            threads: Some(1),
            ..BenchOptions::default()
        }
    }

    #[test]
    fn quantiles_are_by_nearest_rank() {
        let times: Vec<f64> = (1..=200).map(f64::from).collect();
        let found = [0, 1, 50, 99, 100].map(|percent| quantile(&times, percent));
        assert_eq!(found, [1.0, 2.0, 100.0, 198.0, 200.0]);
        assert_eq!(quantile(&[1.0, 2.0, 3.0, 4.0], 50), 2.0, "the lower median");
        assert_eq!(quantile(&[1.0, 2.0, 3.0], 50), 2.0);
        assert_eq!(quantile(&[7.0], 99), 7.0);
        assert_eq!(quantile(&[], 50), 0.0);
    }

    #[test]
    fn the_camera_goes_once_around_its_target() {
        let camera = *scene().camera();
        let views = 7;
        let distance = camera.position.distance(camera.target);
        let cameras: Vec<Camera> = (0..=views)
            .map(|view| camera_around(&camera, view, views))
            .collect();
        assert_eq!(cameras[0], camera);
        assert!(cameras[7].position.distance(camera.position) < 1e-12);
        let step = cameras[0].position.distance(cameras[1].position);
        assert!(step > 1.0, "it moves");
        for pair in cameras.windows(2) {
            assert!((pair[1].position.distance(camera.target) - distance).abs() < 1e-12);
            assert!((pair[1].position.z - camera.position.z).abs() < 1e-12);
            assert!((pair[0].position.distance(pair[1].position) - step).abs() < 1e-12);
        }
        for up in [DVec3::ZERO, DVec3::NAN] {
            let lost = Camera { up, ..camera };
            let turned = camera_around(&lost, 3, 7);
            assert_eq!(turned.position, camera.position);
        }
        let tiny = Camera {
            up: DVec3::Z * 1e-200,
            ..camera
        };
        let turned = camera_around(&tiny, 3, 7);
        assert_eq!(turned.position, cameras[3].position);
    }

    #[test]
    fn means_are_those_of_the_single_views() {
        let (scene, views) = (scene(), 5);
        let options = options(Method::Adaptive, views);
        let mut phases = Vec::new();
        let report = bench("pot", &scene, &options, |phase| phases.push(phase)).expect("it runs");
        for phase in BenchPhase::ALL {
            let count = phases.iter().filter(|&&p| p == phase).count() as u64;
            assert_eq!(count, options.steps(phase), "{phase:?}");
        }
        // Each view in an engine of its own.
        let (mut drawn, mut subdivided, mut phong) = (0, 0, 0);
        for view in 0..views {
            let mut turned = scene.clone();
            turned.set_camera(camera_around(scene.camera(), view, views));
            let mut engine = Engine::new(&turned).expect("threads start");
            let mut frame = Frame::new(96, 64);
            let stats = engine.render(&turned, Budget::Unlimited, &mut frame);
            drawn += stats.triangles_drawn;
            subdivided += stats.triangles_subdivided;
            phong += stats.phong_pixels;
        }
        let mean = |sum: u64| sum as f64 / f64::from(views);
        assert!(
            (report.triangles_drawn - mean(drawn)).abs() < 1e-9,
            "{report:?}"
        );
        assert!((report.triangles_subdivided - mean(subdivided)).abs() < 1e-9);
        assert!((report.phong_pixels - mean(phong)).abs() < 1e-9);
        assert_eq!((report.frames, report.converged_frames), (5, 5));
        assert_eq!((report.compared_views, report.late_frames), (4, None));
        assert!(report.rmse.is_some_and(|rmse| rmse < 0.5), "{report:?}");
    }

    #[test]
    fn lateness_is_counted_against_the_budget() {
        // Time stands still, so every frame takes none.
        let mut options = BenchOptions {
            budget: Budget::from_millis(2.0),
            compared_views: 0,
            clock: Arc::new(ManualClock::default()),
            repeats: 3,
            ..options(Method::Gouraud, 2)
        };
        let report = bench("pot", &scene(), &options, |_| {}).expect("it runs");
        assert_eq!((report.late_frames, report.frames), (Some(0), 6));
        assert_eq!(report.overshoot_ms_max, Some(-2.0));
        assert_eq!((report.rmse, report.psnr_db), (None, None));
        options.budget = Budget::Work(5);
        let report = bench("pot", &scene(), &options, |_| {}).expect("it runs");
        assert_eq!((report.budget_work, report.late_frames), (Some(5), None));
    }

    #[test]
    fn the_error_is_that_of_the_method() {
        let rmse = |method| {
            let report = bench("pot", &scene(), &options(method, 3), |_| {}).expect("it runs");
            assert_eq!(report.compared_views, 3, "no more than there are");
            report.rmse.expect("views were compared")
        };
        let (flat, gouraud, phong) = (
            rmse(Method::Flat),
            rmse(Method::Gouraud),
            rmse(Method::Phong),
        );
        assert!(
            phong < 0.5 && phong < gouraud && gouraud < flat,
            "{phong} {gouraud} {flat}"
        );
    }
}
