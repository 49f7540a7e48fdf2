//! Our Gouraud and Phong frames beside those of Mesa's llvmpipe, measured in turns on the same machine.
//!
//! ```sh
//! benches/peers/setup.sh DIR                # builds the peers into DIR, about two minutes; Debian, as root
//! cargo bench --bench peers -- --peers DIR  # the whole table, about fifteen minutes
//! ```
//!
//! The scene is the one that the head of `gl_peer.c` states, drawn by [`specula::Engine`] as any program would draw it. A
//! cell of the table is a mesh at an image size under some lights. In each round both programs draw a turn of 60 views, one
//! after the other: A B A B. A figure is the median over the rounds of a round's median or p99; a ratio is the median of
//! the rounds' ratios.
//!
//! What is timed: from the call to the finished image, clearing and encoding included. Reading it back is excluded on both
//! sides (`glReadPixels` there, `stage_ms.present` here); so is the compilation of shaders there. Colours are stored as linear light
//! on both sides, so that images can be compared, which is done, too.

mod arguments;
mod programs;
mod scene;

use arguments::{Arguments, Shading};
use programs::{Cell, Llvmpipe, Ours};
use scene::Model;
use std::error::Error;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = match Arguments::parse() {
        Ok(arguments) => arguments,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    if arguments.is_test {
        let cell = Cell {
            mesh: 4,
            size: [64, 64],
            shading: Shading {
                is_phong: true,
                lights: 4,
            },
        };
        let (times, _) =
            Ours::new(&Model::teapot(), cell, arguments.threads, arguments.simd)?.turn();
        println!("ours {:.3} ms", times.median);
        return Ok(());
    }
    let peers = arguments.peers.as_deref().unwrap_or(Path::new("."));
    let llvmpipe = arguments
        .peers
        .as_ref()
        .filter(|_| !arguments.is_alone)
        .map(|peers| Llvmpipe {
            peers,
            threads: arguments.threads,
        });
    let mut csv = arguments
        .csv
        .as_ref()
        .map(std::fs::File::create)
        .transpose()?;
    for &mesh in &arguments.meshes {
        let model = Model::load(&peers.join(format!("teapot{mesh}.mesh")))?;
        for &size in &arguments.sizes {
            for &shading in &arguments.shadings {
                let cell = Cell {
                    mesh,
                    size,
                    shading,
                };
                let row = measure(arguments, &model, cell, llvmpipe.as_ref())?;
                println!("{row}");
                if let Some(csv) = &mut csv {
                    writeln!(csv, "{row}")?;
                }
            }
        }
    }
    Ok(())
}

fn measure(
    arguments: &Arguments,
    model: &Model,
    cell: Cell,
    llvmpipe: Option<&Llvmpipe<'_>>,
) -> Result<String, Box<dyn Error>> {
    let mut ours = Ours::new(model, cell, arguments.threads, arguments.simd)?;
    let mut rounds = Vec::new();
    let mut stages = Vec::new();
    for _ in 0..arguments.rounds {
        let (a, s) = ours.turn();
        stages.push(s);
        let b = llvmpipe.map(|l| l.turn(cell)).transpose()?;
        rounds.push((a, b));
    }
    let med = |f: &dyn Fn(usize) -> f64| {
        let mut v: Vec<f64> = (0..rounds.len()).map(f).collect();
        v.sort_unstable_by(f64::total_cmp);
        v[v.len() / 2]
    };
    let [w, h] = cell.size;
    let mut row = format!(
        "{:>7} {w}x{h} {}{}  min {:.3} ours {:.3} p99 {:.3}",
        56 * cell.mesh * cell.mesh,
        cell.shading.mode(),
        cell.shading.lights,
        med(&|i| rounds[i].0.min),
        med(&|i| rounds[i].0.median),
        med(&|i| rounds[i].0.p99)
    );
    if llvmpipe.is_some() {
        let b = |i: usize| rounds[i].1.as_ref().map_or(0.0, |b| b.0.median);
        let bp = |i: usize| rounds[i].1.as_ref().map_or(0.0, |b| b.0.p99);
        row += &format!(
            "  llvmpipe {:.3} p99 {:.3}  ratio {:.2}  p99 ratio {:.2}",
            med(&b),
            med(&bp),
            med(&|i| b(i) / rounds[i].0.median),
            med(&|i| bp(i) / rounds[i].0.p99)
        );
    }
    row += "  |";
    for k in 0..stages[0].len() {
        row += &format!(" {} {:.3}", stages[0][k].0, med(&|i| stages[i][k].1));
    }
    Ok(row)
}
