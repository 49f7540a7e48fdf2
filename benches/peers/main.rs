//! Our Gouraud and Phong frames beside those of Mesa's llvmpipe and of the crate `euc`, measured in turns on the same machine.
//!
//! ```sh
//! benches/peers/setup.sh DIR                # builds the peers into DIR: 2 GB, a few minutes; Debian, as root
//! cargo bench --bench peers -- --peers DIR  # the whole table, about fifteen minutes; --help tells how to have less
//! ```
//!
//! The scene is the one that the head of `gl_peer.c` states, drawn by [`specula::Engine`] as any program would draw it. A
//! cell of the table is a mesh at an image size under some lights. In each round all programs draw a turn of 60 views, one
//! after the other: A B A B. A figure is the median over the rounds of a round's median or p99; a ratio is the median of
//! the rounds' ratios.
//!
//! What is timed: from the call to the finished image, clearing and encoding included. Reading it back is excluded on both
//! sides (`glReadPixels` there, `stage_ms.present` here; `with present` includes it); so is the compilation of shaders there. Colours
//! are stored as linear light on both sides, so that the work is the same and images can be compared: `psnr` says how
//! alike they are. `srgb` is our time when they are encoded as sRGB, which is what we do by default and the peers do not.
//!
//! `--engine` measures what a comparison with others does not show: one thread against two, a frame in which nothing has changed,
//! and ten times as many triangles that are off the screen or face away.

mod arguments;
mod engine;
mod programs;
mod scene;

use arguments::{Arguments, Shading};
use programs::{Cell, Euc, Llvmpipe, Ours, Times};
use scene::Model;
use specula::output::Encoding;
use std::error::Error;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

/// The view whose images are compared.
const COMPARED_VIEW: u32 = 7;

fn main() -> ExitCode {
    let arguments = match Arguments::parse() {
        Ok(arguments) => arguments,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    let run = if arguments.is_test {
        test(&arguments)
    } else if arguments.is_engine_only {
        engine::measure(&arguments)
    } else {
        compare(&arguments)
    };
    match run {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// One small cell of a mesh of our own.
fn test(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let cell = Cell {
        mesh: 4,
        size: [64, 64],
        shading: Shading {
            is_phong: true,
            lights: 4,
        },
    };
    let model = Model::teapot();
    let mut ours = Ours::new(&model, cell, Encoding::Linear, arguments.threads, None)?;
    let (times, _) = ours.turn();
    println!("ours {:.3} ms", times.median);
    Ok(())
}

/// A row of the table.
struct Row {
    cell: Cell,
    ours: Times,
    /// The same with the image handed over to the caller, and encoded as sRGB (and not handed over).
    with_present_ms: f64,
    srgb_ms: f64,
    llvmpipe: Option<Times>,
    euc_ms: Option<f64>,
    /// How many times as fast as llvmpipe we are, by medians and by p99.
    ratio: f64,
    p99_ratio: f64,
    psnr_db: Option<f64>,
}

fn compare(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let peers = arguments.peers.as_deref().unwrap_or(Path::new("."));
    let threads = arguments.threads;
    let llvmpipe = (!arguments.is_alone).then_some(Llvmpipe { peers, threads });
    let mut csv = arguments.csv.as_ref().map(File::create).transpose()?;
    if let Some(csv) = &mut csv {
        writeln!(
            csv,
            "# specula {}, {} threads",
            env!("CARGO_PKG_VERSION"),
            threads
        )?;
        writeln!(csv, "{}", Row::CSV_HEADER)?;
    }
    println!("{}", Row::HEADER);
    let mut rows = Vec::new();
    arguments.for_each_cell(|model, cell| {
        let row = measure(arguments, model, cell, llvmpipe.as_ref())?;
        println!("{}", row.text());
        if let Some(csv) = &mut csv {
            writeln!(csv, "{}", row.csv())?;
        }
        rows.push(row);
        Ok(())
    })?;
    for is_phong in [false, true] {
        let mode: Vec<&Row> = (rows.iter())
            .filter(|row| row.cell.shading.is_phong == is_phong && row.llvmpipe.is_some())
            .collect();
        let Some(first) = mode.first() else {
            continue;
        };
        let mean = |ratio: &dyn Fn(&Row) -> f64| {
            let logs: f64 = mode.iter().map(|row| ratio(row).ln()).sum();
            (logs / mode.len() as f64).exp()
        };
        let least = mode
            .iter()
            .map(|row| row.ratio)
            .fold(f64::INFINITY, f64::min);
        println!(
            "{}: {:.2} times as fast in the geometric mean, {least:.2} at least; p99 {:.2} in the mean",
            first.cell.shading.mode(),
            mean(&|row| row.ratio),
            mean(&|row| row.p99_ratio),
        );
    }
    Ok(())
}

/// Measures a cell, round by round.
fn measure(
    arguments: &Arguments,
    model: &Model,
    cell: Cell,
    llvmpipe: Option<&Llvmpipe<'_>>,
) -> Result<Row, Box<dyn Error>> {
    let ours_with = |encoding| Ours::new(model, cell, encoding, arguments.threads, arguments.simd);
    let (mut linear, mut srgb) = (ours_with(Encoding::Linear)?, ours_with(Encoding::Srgb)?);
    let euc = Euc::find(arguments.peers.as_deref());
    let (mut ours, mut with_present, mut in_srgb) = (Vec::new(), Vec::new(), Vec::new());
    let (mut theirs, mut eucs) = (Vec::new(), Vec::new());
    for _ in 0..arguments.rounds {
        let (times, present_ms) = linear.turn();
        ours.push(times);
        with_present.push(times.median + present_ms);
        in_srgb.push(srgb.turn().0.median);
        if let Some(llvmpipe) = llvmpipe {
            theirs.push(llvmpipe.turn(cell)?);
        }
        // It takes seconds for what others do in milliseconds.
        if let Some(euc) = euc
            .as_ref()
            .filter(|_| llvmpipe.is_some() && eucs.is_empty())
        {
            eucs.push(euc.turn(cell)?);
        }
    }
    let ratio =
        |of: &dyn Fn(&Times) -> f64| median(theirs.iter().zip(&ours).map(|(b, a)| of(b) / of(a)));
    let psnr_db = match llvmpipe {
        Some(llvmpipe) => Some(psnr_db(
            &linear.image(COMPARED_VIEW),
            &llvmpipe.image(cell, COMPARED_VIEW)?,
        )),
        None => None,
    };
    Ok(Row {
        cell,
        with_present_ms: median(with_present),
        srgb_ms: median(in_srgb),
        llvmpipe: llvmpipe.map(|_| Times {
            median: median(theirs.iter().map(|t| t.median)),
            p99: median(theirs.iter().map(|t| t.p99)),
        }),
        euc_ms: eucs.first().map(|times| times.median),
        ratio: ratio(&|t| t.median),
        p99_ratio: ratio(&|t| t.p99),
        psnr_db,
        ours: Times {
            median: median(ours.iter().map(|t| t.median)),
            p99: median(ours.iter().map(|t| t.p99)),
        },
    })
}

impl Row {
    const HEADER: &str = "triangles  size       shading    ours ms (p99)      with present  srgb      llvmpipe ms (p99)   ratio (p99)    psnr dB  euc ms";
    const CSV_HEADER: &str = "triangles,width,height,mode,lights,ours_ms,ours_p99_ms,ours_with_present_ms,ours_srgb_ms,llvmpipe_ms,llvmpipe_p99_ms,ratio,p99_ratio,psnr_db,euc_ms";

    fn text(&self) -> String {
        let [width, height] = self.cell.size;
        let size = format!("{width}x{height}");
        let shading = format!("{} {}", self.cell.shading.mode(), self.cell.shading.lights);
        let mut text = format!(
            "{:>9}  {size:<9}  {shading:<10} {:>7.3} ({:>7.3})  {:>9.3}  {:>9.3}",
            self.cell.triangles(),
            self.ours.median,
            self.ours.p99,
            self.with_present_ms,
            self.srgb_ms
        );
        if let Some(theirs) = self.llvmpipe {
            text += &format!(
                "    {:>8.3} ({:>8.3})  {:>5.2} ({:>5.2})  {:>7.1}",
                theirs.median,
                theirs.p99,
                self.ratio,
                self.p99_ratio,
                self.psnr_db.unwrap_or(f64::NAN)
            );
        }
        if let Some(euc_ms) = self.euc_ms {
            text += &format!("  {euc_ms:>7.1}");
        }
        text
    }

    /// What was not measured is left out.
    fn csv(&self) -> String {
        let [width, height] = self.cell.size;
        let known = self.llvmpipe;
        let optional = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.4}"));
        [
            self.cell.triangles().to_string(),
            width.to_string(),
            height.to_string(),
            self.cell.shading.mode().to_owned(),
            self.cell.shading.lights.to_string(),
            optional(Some(self.ours.median)),
            optional(Some(self.ours.p99)),
            optional(Some(self.with_present_ms)),
            optional(Some(self.srgb_ms)),
            optional(known.map(|t| t.median)),
            optional(known.map(|t| t.p99)),
            optional(known.map(|_| self.ratio)),
            optional(known.map(|_| self.p99_ratio)),
            optional(self.psnr_db),
            optional(self.euc_ms),
        ]
        .join(",")
    }
}

/// The middle one; of an even number, the upper of the two.
fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// How alike two images are: peak signal to noise over all pixels and channels.
fn psnr_db(a: &[u8], b: &[u8]) -> f64 {
    let squares: f64 = a
        .iter()
        .zip(b)
        .map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2))
        .sum();
    10.0 * (255.0_f64.powi(2) * a.len() as f64 / squares).log10()
}
