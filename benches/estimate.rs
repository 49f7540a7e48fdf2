//! How good is the estimate of the error? What the engine says beside what is measured, along refinement.
//!
//! ```text
//! cargo bench --bench estimate -- [SCENE...] [--size WxH]... [--views N] [--csv FILE] [--test]
//! ```
//!
//! Each view, turned about the target, is refined from cold under work budgets that grow from nothing until the image is final. After each
//! of them the RMSE against the `f64` reference is measured. Where that is above [`LEAST_RMSE`] a line says how far
//! `estimated / measured` strays, and what error was left when the estimate first said 4, 2 and 1 codes; the area is the mean RMSE from no
//! work to that of shading every covered pixel.

use specula::glam::DMat3;
use specula::measure::{ErrorReport, ReferenceImage};
use specula::scene::Camera;
use specula::schedule::cost;
use specula::{Budget, Engine, EngineOptions, Frame, Scene};
use std::fmt::Write as _;

/// Where less is measured the estimate need not agree: rounding to codes alone leaves up to 0.4.
const LEAST_RMSE: f64 = 0.5;

/// The smallest budget in work units, and the factor from each to the next.
const FIRST_UNITS: f64 = 20_000.0;
const BUDGET_STEP: f64 = 1.25;

/// Estimates at which somebody may want to stop.
const TARGETS: [f64; 3] = [4.0, 2.0, 1.0];

/// All scenes that come with the program.
const SCENES: [&str; 8] = [
    "teapot",
    "closeup",
    "walls",
    "lights16",
    "lights100",
    "heavy",
    "minimal",
    "turntable",
];

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments = Arguments::parse(std::env::args().skip(1))?;
    let mut csv = "scene,width,height,view,work_units,measured,estimated\n".to_owned();
    println!(
        "{:<10} {:>9} view |   first measured, ratio | ratio: least   most | left at 4, 2, 1 |   area",
        "scene", "size"
    );
    let (mut logs, mut curves) = (0.0, 0.0);
    for name in &arguments.scenes {
        let path = format!("{}/scenes/{name}.ron", env!("CARGO_MANIFEST_DIR"));
        let mut scene = Scene::load(path)?;
        let camera = *scene.camera();
        for &(width, height) in &arguments.sizes {
            for view in 0..arguments.views {
                scene.set_camera(camera_around(&camera, view, arguments.views));
                let curve = Curve::measure(&scene, width, height)?;
                println!(
                    "{name:<10} {:>9} {view:>4} | {}",
                    format!("{width}x{height}"),
                    curve.row()
                );
                if curve.points[0].measured == 0.0 {
                    continue;
                }
                (logs, curves) = (logs + curve.area().max(1e-9).ln(), curves + 1.0);
                for point in &curve.points {
                    writeln!(
                        csv,
                        "{name},{width},{height},{view},{:.0},{:.5},{:.5}",
                        point.units, point.measured, point.estimated
                    )?;
                }
            }
        }
    }
    println!(
        "geometric mean of areas {:.5}",
        f64::exp(logs / f64::max(curves, 1.0))
    );
    if let Some(path) = &arguments.csv {
        std::fs::write(path, csv)?;
    }
    Ok(())
}

/// The camera turned about its target by its share of a whole turn.
fn camera_around(camera: &Camera, view: u32, views: u32) -> Camera {
    let angle = std::f64::consts::TAU * f64::from(view) / f64::from(views);
    let turn = DMat3::from_axis_angle(camera.up.normalize(), angle);
    Camera {
        position: camera.target + turn * (camera.position - camera.target),
        ..*camera
    }
}

/// What was said and what was true after so many work units.
struct Point {
    units: f64,
    measured: f64,
    estimated: f64,
}

/// The way of a view from its first image to its last.
struct Curve {
    points: Vec<Point>,
    /// Nominal cost of shading all covered pixels.
    all_phong: f64,
}

impl Curve {
    fn measure(scene: &Scene, width: u32, height: u32) -> Result<Self, Failure> {
        let mut engine = Engine::with_options(scene, EngineOptions::default())?;
        let view = engine.world().view(scene.camera(), width, height);
        let reference = ReferenceImage::render(engine.world(), &view, engine.threads());
        let mut frame = Frame::new(width, height);
        let mut points = Vec::new();
        let mut units = 0.0;
        loop {
            engine.forget();
            let stats = engine.render(scene, Budget::Work(units as u64), &mut frame);
            points.push(Point {
                units,
                measured: ErrorReport::compare(&frame, &reference)?.rmse,
                estimated: stats.estimated_error,
            });
            if stats.converged {
                break;
            }
            units = f64::max(FIRST_UNITS, units * BUDGET_STEP);
        }
        let pixels = reference.covered_pixels() as f32;
        Ok(Self {
            points,
            all_phong: cost::phong(pixels, scene.lights().len()).into(),
        })
    }

    /// Least and greatest ratio of what was said and what was true, where that matters.
    fn ratios(&self) -> (f64, f64) {
        let significant = self.points.iter().filter(|p| p.measured > LEAST_RMSE);
        let ratios = significant.map(|p| p.estimated / p.measured);
        ratios.fold((f64::INFINITY, 0.0), |(least, most), ratio| {
            (least.min(ratio), most.max(ratio))
        })
    }

    /// What was true when the estimate first said so little.
    fn left_at(&self, target: f64) -> f64 {
        let reached = self.points.iter().find(|p| p.estimated <= target);
        reached.map_or(f64::NAN, |p| p.measured)
    }

    /// The mean RMSE over the work it takes to shade everything.
    fn area(&self) -> f64 {
        let mut area = 0.0;
        for pair in self.points.windows(2) {
            let [from, to] = [&pair[0], &pair[1]].map(|p| p.units.min(self.all_phong));
            area += (to - from) * (pair[0].measured + pair[1].measured) / 2.0;
        }
        let last = self.points.last();
        area += last.map_or(0.0, |p| (self.all_phong - p.units).max(0.0) * p.measured);
        area / self.all_phong.max(1.0)
    }

    fn row(&self) -> String {
        let first = &self.points[0];
        let (least, most) = self.ratios();
        let left = TARGETS.map(|target| format!("{:.2}", self.left_at(target)));
        format!(
            "{:>8.3} {:>6.2} | {least:>6.2} {most:>6.2} | {} | {:.5}",
            first.measured,
            first.estimated / first.measured,
            left.join(" "),
            self.area()
        )
    }
}

/// What was asked for.
struct Arguments {
    scenes: Vec<String>,
    sizes: Vec<(u32, u32)>,
    views: u32,
    csv: Option<String>,
}

impl Arguments {
    fn parse(mut words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut arguments = Self {
            scenes: Vec::new(),
            sizes: Vec::new(),
            views: 3,
            csv: None,
        };
        let mut is_test = false;
        while let Some(word) = words.next() {
            let mut value = || words.next().ok_or(format!("{word} needs a value"));
            match word.as_str() {
                "--size" => {
                    let text = value()?;
                    let sides = text.split_once('x');
                    let sides = sides.and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
                    arguments
                        .sizes
                        .push(sides.ok_or("a size is like 1280x720")?);
                }
                "--views" => {
                    arguments.views = value()?.parse().map_err(|_| "views are a number")?;
                }
                "--csv" => arguments.csv = Some(value()?),
                "--test" => is_test = true,
                // What cargo says to every benchmark.
                "--bench" => {}
                name => arguments.scenes.push(name.to_owned()),
            }
        }
        if is_test {
            (arguments.scenes, arguments.sizes, arguments.views) =
                (vec!["minimal".into()], vec![(64, 36)], 1);
        }
        if arguments.scenes.is_empty() {
            arguments.scenes = SCENES.map(String::from).to_vec();
        }
        if arguments.sizes.is_empty() {
            arguments.sizes = vec![(640, 360), (1280, 720)];
        }
        Ok(arguments)
    }
}
