//! One turn of views by either program.

use super::arguments::Shading;
use super::scene::Model;
use specula::output::Encoding;
use specula::{Budget, Engine, EngineOptions, Frame, Method};
use std::error::Error;
use std::path::Path;
use std::process::Command;

/// Views of a turn.
pub const VIEWS: u32 = 60;
/// Frames before those that count.
pub const WARM_UP: u32 = 5;

/// Frame times of a turn in milliseconds.
#[derive(Clone, Copy, Debug)]
pub struct Times {
    pub min: f64,
    pub median: f64,
    pub p99: f64,
}

/// A cell of the table.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// The mesh's fineness.
    pub mesh: u32,
    pub size: [u32; 2],
    pub shading: Shading,
}

/// Our engine, with its scene.
pub struct Ours<'a> {
    cell: Cell,
    model: &'a Model,
    scene: specula::Scene,
    engine: Engine,
    frame: Frame,
}

impl<'a> Ours<'a> {
    pub fn new(
        model: &'a Model,
        cell: Cell,
        threads: usize,
        simd: Option<specula::simd::SimdLevel>,
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
            encoding: Encoding::Linear,
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

    /// Draws a view; milliseconds without handing the image over.
    fn draw(&mut self, view: u32) -> specula::FrameStats {
        self.scene
            .set_camera(self.model.camera(view % VIEWS, VIEWS, self.cell.size));
        self.engine
            .render(&self.scene, Budget::Unlimited, &mut self.frame)
    }

    /// Frame times of a turn, and the mean milliseconds of each stage.
    pub fn turn(&mut self) -> (Times, Vec<(&'static str, f64)>) {
        for view in 0..WARM_UP {
            self.draw(view);
        }
        let mut times = Vec::new();
        let mut stages: Vec<(&'static str, f64)> = Vec::new();
        for view in 0..VIEWS {
            let stats = self.draw(view);
            times.push(stats.frame_ms - stats.stage_ms.present);
            let entries = stats.stage_ms.entries();
            stages.resize(entries.len(), ("", 0.0));
            for (sum, (name, ms)) in stages.iter_mut().zip(entries) {
                *sum = (name, sum.1 + ms / f64::from(VIEWS));
            }
        }
        (times_of(times), stages)
    }

    /// A view as rows of RGB.
    pub fn image(&mut self, view: u32) -> Vec<u8> {
        self.draw(view);
        self.frame
            .pixels()
            .iter()
            .flat_map(|&[r, g, b, _]| [r, g, b])
            .collect()
    }
}

/// The median and the 99th percentile by nearest rank, as the peer has them.
fn times_of(mut times: Vec<f64>) -> Times {
    times.sort_unstable_by(f64::total_cmp);
    let n = times.len();
    Times {
        min: times[0],
        median: 0.5 * (times[(n - 1) / 2] + times[n / 2]),
        p99: times[(99 * n).div_ceil(100) - 1],
    }
}

/// Mesa's llvmpipe, in its own root directory.
pub struct Llvmpipe<'a> {
    pub peers: &'a Path,
    pub threads: usize,
}

impl Llvmpipe<'_> {
    /// Frame times of a turn, and the version that drew it.
    pub fn turn(&self, cell: Cell) -> Result<(Times, String), Box<dyn Error>> {
        let out = self.run(cell, &["--passes", "1", "--warmup", &WARM_UP.to_string()])?;
        let number = |key: &str| {
            let value = out["finish_ms"][key].as_f64();
            value.ok_or_else(|| format!("gl_peer printed no finish_ms.{key}"))
        };
        let times = Times {
            min: number("min")?,
            median: number("median")?,
            p99: number("p99")?,
        };
        Ok((
            times,
            out["version"].as_str().unwrap_or_default().to_owned(),
        ))
    }

    /// A view as rows of RGB.
    pub fn image(&self, cell: Cell, view: u32) -> Result<Vec<u8>, Box<dyn Error>> {
        let view = view.to_string();
        self.run(
            cell,
            &[
                "--passes",
                "1",
                "--warmup",
                "0",
                "--dump",
                &view,
                "--out",
                "/peers/view.ppm",
            ],
        )?;
        let bytes = std::fs::read(self.peers.join("forky/peers/view.ppm"))?;
        let pixels = cell.size[0] as usize * cell.size[1] as usize * 3;
        let start = bytes
            .len()
            .checked_sub(pixels)
            .ok_or("gl_peer wrote a short image")?;
        Ok(bytes[start..].to_vec())
    }

    fn run(&self, cell: Cell, more: &[&str]) -> Result<serde_json::Value, Box<dyn Error>> {
        let [width, height] = cell.size.map(|side| side.to_string());
        let mut command = Command::new("chroot");
        command.arg(self.peers.join("forky"));
        command.arg("/peers/gl_peer");
        command.args(["--mesh", &format!("/peers/teapot{}.mesh", cell.mesh)]);
        command.args(["--width", &width, "--height", &height]);
        command.args([
            "--mode",
            cell.shading.mode(),
            "--lights",
            &cell.shading.lights.to_string(),
        ]);
        command.args(["--views", &VIEWS.to_string(), "--tag", "peers"]);
        command.args(more);
        // 0 means that the calling thread does everything.
        let helpers = if self.threads == 1 { 0 } else { self.threads };
        command.env("LP_NUM_THREADS", helpers.to_string());
        let output = command.output()?;
        if !output.status.success() {
            let message = String::from_utf8_lossy(&output.stderr);
            return Err(format!("gl_peer failed: {}", message.trim()).into());
        }
        Ok(serde_json::from_slice(&output.stdout)?)
    }
}
