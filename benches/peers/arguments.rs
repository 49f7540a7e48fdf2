//! The command line of the comparison.

use super::programs::Cell;
use super::scene::Model;
use std::error::Error;
use std::path::{Path, PathBuf};

pub(super) const USAGE: &str = "\
usage: cargo bench --bench peers -- [OPTIONS]

  --peers DIR         where benches/peers/setup.sh has put the peers and the meshes              [.]
  --meshes N,N        teapots of 56 N x N triangles, N being 4, 8, 32 or 128   [4,32,128]
  --sizes WxH,WxH     image sizes                                              [512x512,1920x1080,3840x2160]
  --shading S,S       gouraud or phong, and the number of lights               [gouraud4,phong4,phong16]
  --threads N         of both programs                                         [2]
  --rounds N          turns of each cell                                       [5]
  --simd LEVEL        our SIMD level                                           [the machine's strongest]
  --csv FILE          writes the rows there, as they are measured
  --alone             our own frames only
  --engine            one thread against --threads, frames without a change, triangles that are not seen
  --test              one small cell, without peers";

/// How pixels get their colours, and from how many lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shading {
    pub(super) is_phong: bool,
    pub(super) lights: usize,
}

impl Shading {
    pub(super) fn mode(self) -> &'static str {
        if self.is_phong { "phong" } else { "gouraud" }
    }
}

/// What was asked for.
#[derive(Clone, Debug)]
pub(super) struct Arguments {
    pub(super) peers: Option<PathBuf>,
    pub(super) meshes: Vec<u32>,
    pub(super) sizes: Vec<[u32; 2]>,
    pub(super) shadings: Vec<Shading>,
    pub(super) threads: usize,
    pub(super) rounds: usize,
    pub(super) simd: Option<specula::simd::SimdLevel>,
    pub(super) csv: Option<PathBuf>,
    pub(super) is_alone: bool,
    pub(super) is_engine_only: bool,
    pub(super) is_test: bool,
}

impl Arguments {
    /// Those of this process, or what is wrong with them.
    pub(super) fn parse() -> Result<Self, String> {
        let mut parsed = Self {
            peers: None,
            meshes: vec![4, 32, 128],
            sizes: vec![[512, 512], [1920, 1080], [3840, 2160]],
            shadings: vec![
                Shading {
                    is_phong: false,
                    lights: 4,
                },
                Shading {
                    is_phong: true,
                    lights: 4,
                },
                Shading {
                    is_phong: true,
                    lights: 16,
                },
            ],
            threads: 2,
            rounds: 5,
            simd: None,
            csv: None,
            is_alone: false,
            is_engine_only: false,
            is_test: false,
        };
        let mut arguments = std::env::args().skip(1);
        while let Some(name) = arguments.next() {
            // What cargo adds.
            if name == "--bench" {
                continue;
            }
            if let Some(flag) = parsed.flag(&name) {
                *flag = true;
                continue;
            }
            if name == "--help" || name == "-h" {
                return Err(USAGE.to_owned());
            }
            let value = arguments
                .next()
                .ok_or_else(|| format!("{name} is not an option, or needs a value\n\n{USAGE}"))?;
            let list = || value.split(',');
            let bad = |what: &str| format!("{name} {value}: {what}\n\n{USAGE}");
            match name.as_str() {
                "--peers" => parsed.peers = Some(value.into()),
                "--csv" => parsed.csv = Some(value.into()),
                "--simd" => parsed.simd = Some(value.parse().map_err(|error: String| bad(&error))?),
                "--threads" => {
                    parsed.threads = number(&value).ok_or_else(|| bad("not a number from 1 up"))?;
                }
                "--rounds" => {
                    parsed.rounds = number(&value).ok_or_else(|| bad("not a number from 1 up"))?;
                }
                "--meshes" => {
                    let meshes = list()
                        .map(|n| number(n).map(|n| n as u32))
                        .collect::<Option<_>>();
                    parsed.meshes = meshes.ok_or_else(|| bad("not numbers"))?;
                }
                "--sizes" => {
                    let sizes = list().map(size).collect::<Option<_>>();
                    parsed.sizes = sizes.ok_or_else(|| bad("not sizes like 1920x1080"))?;
                }
                "--shading" => {
                    let shadings = list().map(shading).collect::<Option<_>>();
                    parsed.shadings = shadings
                        .ok_or_else(|| bad("not like gouraud4 or phong16, lights from 1 to 64"))?;
                }
                _ => return Err(format!("{name} is not an option\n\n{USAGE}")),
            }
        }
        Ok(parsed)
    }

    /// Calls `f` for every cell of the table, with its mesh, until it fails.
    pub(super) fn for_each_cell(
        &self,
        mut f: impl FnMut(&Model, Cell) -> Result<(), Box<dyn Error>>,
    ) -> Result<(), Box<dyn Error>> {
        let peers = self.peers.as_deref().unwrap_or(Path::new("."));
        for &mesh in &self.meshes {
            let model = Model::load(&peers.join(format!("teapot{mesh}.mesh")))?;
            for &size in &self.sizes {
                for &shading in &self.shadings {
                    let cell = Cell {
                        mesh,
                        size,
                        shading,
                    };
                    f(&model, cell)?;
                }
            }
        }
        Ok(())
    }

    /// The option without a value that has this name.
    fn flag(&mut self, name: &str) -> Option<&mut bool> {
        match name {
            "--alone" => Some(&mut self.is_alone),
            "--engine" => Some(&mut self.is_engine_only),
            "--test" => Some(&mut self.is_test),
            _ => None,
        }
    }
}

fn number(text: &str) -> Option<usize> {
    text.parse().ok().filter(|n| *n > 0)
}

fn size(text: &str) -> Option<[u32; 2]> {
    let (width, height) = text.split_once('x')?;
    Some([number(width)? as u32, number(height)? as u32])
}

fn shading(text: &str) -> Option<Shading> {
    let (is_phong, lights) = match text.strip_prefix("phong") {
        Some(lights) => (true, lights),
        None => (false, text.strip_prefix("gouraud")?),
    };
    let lights = number(lights).filter(|lights| *lights <= 64)?;
    Some(Shading { is_phong, lights })
}
