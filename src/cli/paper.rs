//! `specula paper`: the experiment of Cho, Neumann and Woo, section 4, and its tables beside ours.

use super::Failure;
use super::args::{Paper, Size, count, size};
use super::console::{Output, Progress};
use clap::Args;
use serde::Serialize;
use serde_json::json;
use specula::frame::Method;
use specula::measure::{BenchOptions, BenchPhase, BenchReport, bench};
use specula::scene::Scene;
use specula::schedule::Budget;

/// The scene: a teapot of 896 triangles and four lights at finite distance.
const SCENE: &str = include_str!("../../scenes/teapot.ron");

/// The sizes of the paper.
const SIZES: [Size; 2] = [
    Size {
        width: 256,
        height: 256,
    },
    Size {
        width: 512,
        height: 512,
    },
];

/// `specula paper`.
#[derive(Debug, Args)]
#[command(after_help = "\
The teapot of 896 triangles under four lights at finite distance is rendered from --views sides
around it by each method. Times are medians, and their ratios to Gouraud shading's are what can be
compared with the paper, which was written for a SPARCstation 20 in 1996; it does not say where its
lights and its viewer were. Triangles are means over the views: those subdivided, and all there are
after that; only triangles that own a pixel are subdivided here, and all of them in the paper.
'adaptive' refines until it equals Phong shading, or has the time that 'regular' took.

The errors, which the paper could not give, are against per-pixel Phong shading, over the pixels that
the teapot covers, of --error views.

Examples:
  The whole experiment:
    specula paper
  A quick look:
    specula paper --views 6 --size 256x256")]
pub(super) struct Experiment {
    /// Views around the teapot
    #[arg(long, value_name = "N", default_value = "60", value_parser = views)]
    views: u32,

    /// Image sizes in pixels, separated by commas [default: those of the paper, 256x256,512x512]
    #[arg(long = "size", value_name = "WxH", value_delimiter = ',', value_parser = size)]
    sizes: Vec<Size>,

    /// How many of the views, evenly spaced, to compare with Phong shading
    #[arg(long, value_name = "N", default_value = "12", value_parser = count)]
    error: u32,

    /// Threads to use; the paper's machine had one processor
    #[arg(long, value_name = "N", default_value = "1", value_parser = threads)]
    threads: usize,

    /// Print one JSON object
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    paper: Paper,
}

fn views(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(views @ 1..=3600) => Ok(views),
        _ => Err("it must be a whole number from 1 to 3600".to_owned()),
    }
}

fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count @ 1..=1024) => Ok(count),
        _ => Err("it must be a whole number from 1 to 1024".to_owned()),
    }
}

/// What the paper found for a method, at both sizes.
struct Published {
    method: Method,
    /// Milliseconds with its software renderer (table 1).
    software_ms: [f64; 2],
    /// Triangles subdivided, and all there were after that (table 2).
    triangles: Option<[[f64; 2]; 2]>,
}

const PUBLISHED: [Published; 5] = [
    Published {
        method: Method::Gouraud,
        software_ms: [480.0, 957.0],
        triangles: Some([[0.0, 896.0], [0.0, 896.0]]),
    },
    Published {
        method: Method::Highlight,
        software_ms: [881.0, 1408.0],
        triangles: Some([[74.5, 1538.0], [74.5, 1538.0]]),
    },
    Published {
        method: Method::Regular,
        software_ms: [664.0, 1632.0],
        triangles: Some([[288.4, 1075.5], [288.4, 1955.6]]),
    },
    Published {
        method: Method::Hybrid,
        software_ms: [1104.0, 3436.0],
        triangles: None,
    },
    Published {
        method: Method::Phong,
        software_ms: [3763.0, 14630.0],
        triangles: None,
    },
];

/// Images of each size: those methods, then ours twice.
const BENCHES: u64 = PUBLISHED.len() as u64 + 2;

/// A line of the tables.
#[derive(Debug, Serialize)]
struct Row {
    method: &'static str,
    /// The budget of a frame, if it had one.
    budget_ms: Option<f64>,
    width: u32,
    height: u32,
    frame_ms_median: f64,
    time_to_gouraud: f64,
    triangles_subdivided: f64,
    triangles_final: f64,
    rmse: Option<f64>,
    psnr_db: Option<f64>,
    paper_time_to_gouraud: Option<f64>,
    paper_triangles_subdivided: Option<f64>,
    paper_triangles_final: Option<f64>,
}

pub(super) fn run(args: &Experiment) -> Result<(), Failure> {
    let scene = Scene::parse(SCENE, "teapot.ron")?;
    let sizes = if args.sizes.is_empty() {
        &SIZES[..]
    } else {
        &args.sizes[..]
    };
    let progress = Progress::new(args.steps() * BENCHES * sizes.len() as u64);
    let mut rows = Vec::new();
    for &size in sizes {
        args.measure(&scene, size, &progress, &mut rows)?;
    }
    drop(progress);
    let mut output = Output::new();
    if args.json {
        let document = json!({
            "scene": "teapot",
            "triangles": scene.triangle_count(),
            "lights": scene.lights().len(),
            "views": args.views,
            "threads": args.threads,
            "rows": rows,
        });
        return output.line(&document.to_string());
    }
    for &size in sizes {
        print(&rows, size, &mut output)?;
    }
    output.line("paper: Cho, Neumann and Woo (1996), tables 1 (software renderer) and 2")
}

impl Experiment {
    fn options(&self, size: Size, method: Method, budget: Budget) -> BenchOptions {
        BenchOptions {
            width: size.width,
            height: size.height,
            method,
            paper: self.paper.rule(),
            budget,
            views: self.views,
            compared_views: self.error,
            threads: Some(self.threads),
            ..BenchOptions::default()
        }
    }

    /// Frames of one bench.
    fn steps(&self) -> u64 {
        let options = self.options(SIZES[0], Method::Gouraud, Budget::Unlimited);
        BenchPhase::ALL
            .map(|phase| options.steps(phase))
            .into_iter()
            .sum()
    }

    /// Measures all methods at one size.
    fn measure(
        &self,
        scene: &Scene,
        size: Size,
        progress: &Progress,
        rows: &mut Vec<Row>,
    ) -> Result<(), Failure> {
        let run = |method: Method, budget: Budget| -> Result<BenchReport, Failure> {
            progress.measuring(format!("{method}, {}x{}", size.width, size.height));
            let options = self.options(size, method, budget);
            Ok(bench("teapot", scene, &options, |_| progress.step())?)
        };
        let (mut gouraud_ms, mut regular_ms) = (f64::NAN, f64::NAN);
        for published in &PUBLISHED {
            let report = run(published.method, Budget::Unlimited)?;
            match published.method {
                Method::Gouraud => gouraud_ms = report.frame_ms_median,
                Method::Regular => regular_ms = report.frame_ms_median,
                _ => {}
            }
            rows.push(Row::new(&report, size, gouraud_ms));
        }
        for budget in [Budget::from_millis(regular_ms), Budget::Unlimited] {
            let report = run(Method::Adaptive, budget)?;
            rows.push(Row::new(&report, size, gouraud_ms));
        }
        Ok(())
    }
}

impl Row {
    fn new(report: &BenchReport, size: Size, gouraud_ms: f64) -> Self {
        let published = SIZES.iter().position(|&known| known == size);
        let published = published.and_then(|index| {
            let of_method = |p: &&Published| p.method.name() == report.method;
            let found = PUBLISHED.iter().find(of_method)?;
            let ratio = found.software_ms[index] / PUBLISHED[0].software_ms[index];
            Some((ratio, found.triangles.map(|both| both[index])))
        });
        let triangles = published.and_then(|(_, triangles)| triangles);
        Self {
            method: report.method,
            budget_ms: report.budget_ms,
            width: size.width,
            height: size.height,
            frame_ms_median: report.frame_ms_median,
            time_to_gouraud: report.frame_ms_median / gouraud_ms,
            triangles_subdivided: report.triangles_subdivided,
            triangles_final: report.triangles as f64 - report.triangles_subdivided + report.leaves,
            rmse: report.rmse,
            psnr_db: report.psnr_db,
            paper_time_to_gouraud: published.map(|(ratio, _)| ratio),
            paper_triangles_subdivided: triangles.map(|[subdivided, _]| subdivided),
            paper_triangles_final: triangles.map(|[_, all]| all),
        }
    }

    fn name(&self) -> String {
        match self.budget_ms {
            Some(ms) => format!("{} in {ms:.2} ms", self.method),
            None => self.method.to_owned(),
        }
    }
}

fn print(rows: &[Row], size: Size, output: &mut Output) -> Result<(), Failure> {
    let optional = |value: Option<f64>, digits: usize| match value {
        Some(value) => format!("{value:.digits$}"),
        None => "-".to_owned(),
    };
    let pair = |ours: f64, paper| format!("{ours:.1} ({})", optional(paper, 1));
    output.line(&format!(
        "{:<22} {:>9} {:>17} {:>19} {:>19} {:>7} {:>7}",
        format!("{}x{}", size.width, size.height),
        "frame_ms",
        "/ gouraud (paper)",
        "subdivided (paper)",
        "triangles (paper)",
        "rmse",
        "psnr_db"
    ))?;
    let is_of_size = |row: &&Row| (row.width, row.height) == (size.width, size.height);
    for row in rows.iter().filter(is_of_size) {
        output.line(&format!(
            "{:<22} {:>9.3} {:>17} {:>19} {:>19} {:>7} {:>7}",
            row.name(),
            row.frame_ms_median,
            format!(
                "{:.2} ({})",
                row.time_to_gouraud,
                optional(row.paper_time_to_gouraud, 2)
            ),
            pair(row.triangles_subdivided, row.paper_triangles_subdivided),
            pair(row.triangles_final, row.paper_triangles_final),
            optional(row.rmse, 3),
            optional(row.psnr_db, 2),
        ))?;
    }
    output.line("")
}
