//! How good is the choice of what to refine next? The engine beside a greedy that knows the future.
//!
//! ```text
//! cargo bench --bench clairvoyant -- [SCENE...] [--size WxH] [--csv FILE] [--test]
//! ```
//!
//! Every visible triangle of a view can be in one of several **states**: Gouraud-shaded as it is; divided into `4^k` equal
//! parts, `k` from 1 to [`MOST_LEVELS`](states::MOST_LEVELS), each interpolated between true colours at its corners; or shaded per pixel. The
//! **clairvoyant** knows what the summed squared error of each state is, by the `f64` reference, and pays its nominal cost. It moves
//! triangles along the lower convex hulls of their states, always where most error is taken away per cost. That
//! is the best that can be done with these states, but for the last step that does not fit.
//!
//! It pays for what it ends up with: no estimates, no levels on the way, no samples, no bounds. On the other hand it does not
//! know what the engine does: division that adapts inside a triangle, pixels shaded part by part, light masks. So
//! the engine could win.
//!
//! What is compared is the **area** under RMSE (8-bit codes, over covered pixels) by work, from no work to `W`, the nominal cost of
//! shading every covered pixel, divided by `W`; so it is a mean RMSE.

mod curve;
mod states;

use curve::{Point, area, share_at};
use specula::geometry::screen::{TrianglePlanes, normalized_weights};
use specula::math::PixelPoint;
use specula::measure::{ErrorReport, ReferenceImage};
use specula::scene::{Scene, View, World};
use specula::schedule::cost;
use specula::{Budget, Engine, EngineOptions, Frame};
use states::{Grid, State, division_cost, lower_hull};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// The engine's smallest budget in work units, and the factor from each to the next.
const FIRST_UNITS: f64 = 10_000.0;
const BUDGET_STEP: f64 = 1.2;

/// What is reached at which share of `W`.
const PSNR_DB: [f64; 4] = [35.0, 40.0, 45.0, 50.0];

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments = Arguments::parse(std::env::args().skip(1))?;
    let mut csv = "scene,curve,work_units,share,rmse\n".to_owned();
    let decibels = PSNR_DB.map(|db| format!("{db}")).join(", ");
    println!(
        "{:<10} {:>7} {:>10} {:>8} | area: {:>8} {:>8} {:>6} | share of W at {decibels} dB (clairvoyant / engine)",
        "scene", "visible", "W", "gouraud", "clairv.", "engine", "ratio"
    );
    for name in &arguments.scenes {
        let path = format!("{}/scenes/{name}.ron", env!("CARGO_MANIFEST_DIR"));
        let comparison = Comparison::new(&Scene::load(Path::new(&path))?, arguments.size)?;
        println!("{name:<10} {}", comparison.row());
        comparison.write_csv(name, &mut csv)?;
    }
    if let Some(path) = &arguments.csv {
        std::fs::write(path, csv)?;
    }
    Ok(())
}

/// Both curves of a view.
struct Comparison {
    visible: usize,
    /// Nominal cost of shading all covered pixels.
    all_phong: f64,
    clairvoyant: Vec<Point>,
    engine: Vec<Point>,
}

impl Comparison {
    fn new(scene: &Scene, size: (u32, u32)) -> Result<Self, Failure> {
        let subject = Subject::new(scene, size)?;
        let comparison = Self {
            visible: subject.owned.len(),
            all_phong: subject.phong_cost(),
            clairvoyant: subject.clairvoyant(),
            engine: subject.engine(scene)?,
        };
        let [expected, found] =
            [&comparison.clairvoyant, &comparison.engine].map(|points| points[0].rmse);
        if (expected - found).abs() > 0.02 * expected {
            let message = format!("the first image has an RMSE of {found}, not {expected}");
            return Err(message.into());
        }
        Ok(comparison)
    }

    /// A line of the table.
    fn row(&self) -> String {
        let [best, ours] = [&self.clairvoyant, &self.engine];
        let [best_area, our_area] = [best, ours].map(|points| area(points, self.all_phong));
        let shares = PSNR_DB.map(|db| {
            let [best, ours] = [best, ours].map(|points| share_at(points, db, self.all_phong));
            format!("{best} / {ours}")
        });
        format!(
            "{:>7} {:>10.0} {:>8.3} |       {best_area:>8.4} {our_area:>8.4} {:>6.3} | {}",
            self.visible,
            self.all_phong,
            best[0].rmse,
            our_area / best_area,
            shares.join(",  ")
        )
    }

    fn write_csv(&self, name: &str, csv: &mut String) -> std::fmt::Result {
        for (curve, points) in [("clairvoyant", &self.clairvoyant), ("engine", &self.engine)] {
            for Point { units, rmse } in points {
                let share = units / self.all_phong;
                writeln!(csv, "{name},{curve},{units:.0},{share:.6},{rmse:.5}")?;
            }
        }
        Ok(())
    }
}

/// What was asked for.
struct Arguments {
    scenes: Vec<String>,
    size: (u32, u32),
    csv: Option<String>,
}

impl Arguments {
    fn parse(mut words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut arguments = Self {
            scenes: Vec::new(),
            size: (1280, 720),
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
                    arguments.size = sides.ok_or("a size is like 1280x720")?;
                }
                "--csv" => arguments.csv = Some(value()?),
                "--test" => is_test = true,
                // What cargo says to every benchmark.
                "--bench" => {}
                name => arguments.scenes.push(name.to_owned()),
            }
        }
        if is_test {
            arguments.size = (96, 54);
        }
        if arguments.scenes.is_empty() {
            let names = ["teapot", "closeup", "walls", "lights16"];
            let count = if is_test { 1 } else { names.len() };
            arguments.scenes = names[..count].iter().map(|&name| name.to_owned()).collect();
        }
        Ok(arguments)
    }
}

/// A view, its reference, and who owns which pixels.
struct Subject {
    world: World,
    view: View,
    reference: ReferenceImage,
    corners: Vec<PixelPoint>,
    /// Pixels by the triangle that owns them.
    owned: BTreeMap<u32, Vec<usize>>,
    /// Pixels that are compared.
    compared: usize,
}

impl Subject {
    fn new(scene: &Scene, (width, height): (u32, u32)) -> Result<Self, specula::EngineError> {
        let engine = Engine::new(scene)?;
        let world = engine.world().clone();
        let view = world.view(scene.camera(), width, height);
        let reference = ReferenceImage::render(&world, &view, engine.threads());
        let mut owned = BTreeMap::<u32, Vec<usize>>::new();
        for (pixel, &id) in reference.ids.iter().enumerate() {
            if reference.is_covered(pixel) {
                owned.entry(id).or_default().push(pixel);
            }
        }
        let covered = 0..reference.ids.len();
        let is_compared = |&pixel: &usize| reference.is_covered(pixel) && !reference.grazing[pixel];
        Ok(Self {
            corners: (0..world.positions.len())
                .map(|vertex| view.project(world.positions.get(vertex)))
                .collect(),
            compared: covered.filter(is_compared).count(),
            world,
            view,
            reference,
            owned,
        })
    }

    fn rmse(&self, squares: f64) -> f64 {
        (squares.max(0.0) / (3.0 * self.compared.max(1) as f64)).sqrt()
    }

    /// What shading all covered pixels costs.
    fn phong_cost(&self) -> f64 {
        let lights = self.world.lights.len();
        let patches = self.owned.values();
        patches
            .map(|pixels| f64::from(cost::phong(pixels.len() as f32, lights)))
            .sum()
    }

    /// RMSE by work of the greedy that knows all.
    fn clairvoyant(&self) -> Vec<Point> {
        let hulls: Vec<Vec<State>> = self
            .owned
            .iter()
            .map(|(&triangle, pixels)| lower_hull(self.states(triangle, pixels)))
            .collect();
        let mut squares: f64 = hulls.iter().map(|hull| hull[0].squares).sum();
        let mut steps: Vec<(f64, f64)> = hulls
            .iter()
            .flat_map(|hull| hull.windows(2))
            .map(|pair| {
                (
                    pair[1].units - pair[0].units,
                    pair[0].squares - pair[1].squares,
                )
            })
            .collect();
        // Slopes fall along each hull, so no step comes before the one it stands on.
        steps.sort_by(|a, b| (b.1 / b.0).total_cmp(&(a.1 / a.0)));
        let mut units = 0.0;
        let mut points = vec![Point {
            units,
            rmse: self.rmse(squares),
        }];
        for (cost, drop) in steps {
            units += cost;
            squares -= drop;
            points.push(Point {
                units,
                rmse: self.rmse(squares),
            });
        }
        points
    }

    /// The states of a triangle that are not worse and dearer than another.
    fn states(&self, triangle: u32, pixels: &[usize]) -> Vec<State> {
        let lights = self.world.lights.len();
        let phong = State {
            units: f64::from(cost::phong(pixels.len() as f32, lights)),
            squares: 0.0,
        };
        let levels =
            (0..=states::MOST_LEVELS).map(|level| (level, division_cost(level, pixels, lights)));
        let mut states: Vec<State> = levels
            .take_while(|&(_, units)| units < phong.units)
            .map(|(level, units)| State {
                units,
                squares: self.squares(triangle, pixels, 1 << level),
            })
            .collect();
        states.push(phong);
        states
    }

    /// The summed squared error of a triangle whose edges are divided into `n`.
    fn squares(&self, triangle: u32, pixels: &[usize], n: usize) -> f64 {
        let grid = Grid::new(&self.world, &self.view, triangle, n);
        let corners = self.world.triangles[triangle as usize].map(|v| self.corners[v as usize]);
        let planes = TrianglePlanes::new(corners);
        let width = self.view.width as usize;
        let compared = pixels.iter().filter(|&&p| !self.reference.grazing[p]);
        compared
            .map(|&pixel| {
                let (x, y) = ((pixel % width) as i32, (pixel / width) as i32);
                let weights = normalized_weights(planes.edges_at_pixel(x, y).map(|e| e.max(0.0)));
                let rgb = grid.at(weights);
                let difference = |channel: usize| {
                    let shown = self.view.encoding.encode_u8(rgb[channel]);
                    f64::from(shown) - f64::from(self.reference.pixels[pixel][channel])
                };
                (0..3).map(|k| difference(k).powi(2)).sum::<f64>()
            })
            .sum()
    }

    /// RMSE by work of the engine, each point from cold.
    fn engine(&self, scene: &Scene) -> Result<Vec<Point>, Failure> {
        let options = EngineOptions {
            threads: Some(1),
            ..EngineOptions::default()
        };
        let mut engine = Engine::with_options(scene, options)?;
        let mut frame = Frame::new(self.view.width, self.view.height);
        let mut points: Vec<Point> = Vec::new();
        let mut budget = 0.0;
        loop {
            engine.forget();
            let stats = engine.render(scene, Budget::Work(budget as u64), &mut frame);
            let error = ErrorReport::compare(&frame, &self.reference)?;
            points.push(Point {
                // What did not fit is not used, but nobody else could have used it.
                units: if stats.converged {
                    stats.work_units as f64
                } else {
                    budget
                },
                rmse: error.rmse,
            });
            if stats.converged {
                return Ok(points);
            }
            budget = (budget * BUDGET_STEP).max(FIRST_UNITS);
        }
    }
}
