//! One turn of views by each program.

use super::arguments::Shading;
use super::scene::Model;
use specula::output::Encoding;
use specula::simd::SimdLevel;
use specula::{Budget, Engine, EngineOptions, Frame, FrameStats, Method};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Views of a turn.
const VIEWS: u32 = 60;
/// Frames before those that count.
const WARM_UP: u32 = 5;

/// Frame times of a turn in milliseconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Times {
    pub(super) median: f64,
    pub(super) p99: f64,
}

/// A cell of the table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Quads along the side of a patch of the teapot.
    pub(super) mesh: u32,
    /// Width and height of the image.
    pub(super) size: [u32; 2],
    pub(super) shading: Shading,
}

impl Cell {
    pub(super) fn triangles(&self) -> u32 {
        56 * self.mesh * self.mesh
    }
}

/// Our engine, with its scene.
pub(super) struct Ours<'a> {
    cell: Cell,
    model: &'a Model,
    scene: specula::Scene,
    engine: Engine,
    frame: Frame,
}

impl<'a> Ours<'a> {
    pub(super) fn new(
        model: &'a Model,
        cell: Cell,
        encoding: Encoding,
        threads: usize,
        simd: Option<SimdLevel>,
    ) -> Result<Self, Box<dyn Error>> {
        let scene = model.scene(cell.shading.lights);
        let options = EngineOptions {
            method: if cell.shading.is_phong {
                Method::Phong
            } else {
                Method::Gouraud
            },
            threads: Some(threads),
            simd,
            encoding,
            ..EngineOptions::default()
        };
        let engine = Engine::with_options(&scene, options)?;
        let [width, height] = cell.size;
        Ok(Self {
            cell,
            model,
            scene,
            engine,
            frame: Frame::new(width, height),
        })
    }

    fn draw(&mut self, view: u32) -> FrameStats {
        let camera = self.model.camera(view % VIEWS, VIEWS, self.cell.size);
        self.scene.set_camera(camera);
        (self.engine).render(&self.scene, Budget::Unlimited, &mut self.frame)
    }

    /// Frame times of a turn without handing the image over, and the mean milliseconds of that.
    pub(super) fn turn(&mut self) -> (Times, f64) {
        for view in 0..WARM_UP {
            self.draw(view);
        }
        let (mut times, mut present_ms) = (Vec::new(), 0.0);
        for view in 0..VIEWS {
            let stats = self.draw(view);
            times.push(stats.frame_ms - stats.stage_ms.present);
            present_ms += stats.stage_ms.present / f64::from(VIEWS);
        }
        (times_of(times), present_ms)
    }

    /// The median time of a frame in which nothing has changed, handing over included.
    pub(super) fn unchanged_ms(&mut self) -> f64 {
        self.draw(0);
        let frame = |_| {
            let stats = (self.engine).render(&self.scene, Budget::Unlimited, &mut self.frame);
            stats.frame_ms
        };
        times_of((0..VIEWS).map(frame).collect()).median
    }

    /// A view as rows of RGB.
    pub(super) fn image(&mut self, view: u32) -> Vec<u8> {
        self.draw(view);
        let pixels = self.frame.pixels().iter();
        pixels.flat_map(|&[r, g, b, _]| [r, g, b]).collect()
    }
}

/// The median and the 99th percentile by nearest rank, as the peer has them.
fn times_of(mut times: Vec<f64>) -> Times {
    times.sort_unstable_by(f64::total_cmp);
    let n = times.len();
    Times {
        median: 0.5 * (times[(n - 1) / 2] + times[n / 2]),
        p99: times[(99 * n).div_ceil(100) - 1],
    }
}

/// Mesa's llvmpipe, in its own root directory.
pub(super) struct Llvmpipe<'a> {
    pub(super) peers: &'a Path,
    pub(super) threads: usize,
}

impl Llvmpipe<'_> {
    /// Frame times of a turn.
    pub(super) fn turn(&self, cell: Cell) -> Result<Times, Box<dyn Error>> {
        times_in(&self.run(cell, &["--warmup", &WARM_UP.to_string()])?)
    }

    /// A view as rows of RGB.
    pub(super) fn image(&self, cell: Cell, view: u32) -> Result<Vec<u8>, Box<dyn Error>> {
        let view = view.to_string();
        self.run(
            cell,
            &["--warmup", "0", "--dump", &view, "--out", "/peers/view.ppm"],
        )?;
        let bytes = std::fs::read(self.peers.join("forky/peers/view.ppm"))?;
        let pixels = cell.size[0] as usize * cell.size[1] as usize * 3;
        let start = bytes.len().checked_sub(pixels);
        Ok(bytes[start.ok_or("gl_peer wrote a short image")?..].to_vec())
    }

    fn run(&self, cell: Cell, more: &[&str]) -> Result<serde_json::Value, Box<dyn Error>> {
        let mut command = Command::new("chroot");
        command.arg(self.peers.join("forky"));
        command.arg("/peers/gl_peer");
        command.args(["--mesh", &format!("/peers/teapot{}.mesh", cell.mesh)]);
        // 0 means that the calling thread does everything.
        let helpers = if self.threads == 1 { 0 } else { self.threads };
        command.env("LP_NUM_THREADS", helpers.to_string());
        run(command, cell, more)
    }
}

/// The program that draws with `euc`, on all processors.
pub(super) struct Euc {
    program: PathBuf,
    peers: PathBuf,
}

impl Euc {
    /// `None` where it has not been built.
    pub(super) fn find(peers: Option<&Path>) -> Option<Self> {
        let peers = peers?.to_owned();
        let program = peers.join("euc/release/euc_peer");
        program.exists().then_some(Self { program, peers })
    }

    /// Frame times of a turn.
    pub(super) fn turn(&self, cell: Cell) -> Result<Times, Box<dyn Error>> {
        let mut command = Command::new(&self.program);
        let mesh = self.peers.join(format!("teapot{}.mesh", cell.mesh));
        command.arg("--mesh").arg(mesh);
        times_in(&run(command, cell, &["--warmup", "1"])?)
    }
}

/// Runs a peer, which prints one line of JSON.
fn run(
    mut command: Command,
    cell: Cell,
    more: &[&str],
) -> Result<serde_json::Value, Box<dyn Error>> {
    let [width, height] = cell.size.map(|side| side.to_string());
    command.args(["--width", &width, "--height", &height]);
    command.args(["--mode", cell.shading.mode()]);
    command.args(["--lights", &cell.shading.lights.to_string()]);
    command.args(["--views", &VIEWS.to_string(), "--passes", "1"]);
    command.args(["--tag", "peers"]);
    command.args(more);
    let name = command.get_program().to_owned();
    let fail = |what: &str| format!("{}: {what}", name.display());
    let output = command.output().map_err(|error| fail(&error.to_string()))?;
    if !output.status.success() {
        return Err(fail(String::from_utf8_lossy(&output.stderr).trim()).into());
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}

/// The frame times that a peer has printed.
fn times_in(out: &serde_json::Value) -> Result<Times, Box<dyn Error>> {
    let number = |key: &str| {
        let value = out["finish_ms"][key].as_f64();
        value.ok_or_else(|| format!("a peer printed no finish_ms.{key}"))
    };
    Ok(Times {
        median: number("median")?,
        p99: number("p99")?,
    })
}
