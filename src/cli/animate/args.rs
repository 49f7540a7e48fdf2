//! What can be said to `specula animate`.

use crate::cli::args::{Machine, milliseconds, time};
use clap::Args;
use specula::frame::Method;
use specula::output::FrameRate;
use specula::output::sequence::Shard;
use specula::output::timing::MAX_DURATION_S;
use std::path::PathBuf;

/// `specula animate`.
#[derive(Debug, Args)]
#[command(after_help = "\
What moves, for how long, and the frame rate are in the scene file: `animation`, `orbit` and `spin`.
In a scene in which nothing moves the camera goes around its target once.

The name of the output says what is written:
  film.apng, film.png    an animated PNG file, which browsers show; it repeats for ever
  film.y4m               raw video (YUV4MPEG2, 4:4:4, limited range), for players and encoders
  -                      the same on standard output
  frames/####.png        numbered PNG files, the first with 0001; frame-%04d.png works too,
                         and frames/ alone means frames/####.png. Missing folders are made.

Numbered frames that are there already are kept, whatever they show, so that an interrupted film is
continued; --overwrite renders them anew. Files get their names when they are complete.

Without --budget and --work every frame refines until it equals per-pixel Phong shading. Then, and
with --work, a frame is the same whichever others are rendered before it.

With --error, flicker is the root mean square change of the error from a frame to the next, in codes,
over the pixels that the scene covers in both: an error that stays does not flicker. The references
put threads to sleep, so frame times are longer than without.

Examples:
  A film for a web page:
    specula animate scenes/turntable.ron -o turntable.apng --size 480x270 --fps 15
  Frames of at most 4 ms each, to an encoder:
    specula animate scenes/turntable.ron -o - --budget 4 | ffmpeg -i - turntable.mp4
  One of 8 parts on a cluster, in a job array numbered from 1 to 8:
    specula animate scenes/turntable.ron -o frames/####.png --shard $SLURM_ARRAY_TASK_ID/8
  Does the error flicker at 4 ms a frame?
    specula animate scenes/turntable.ron -o film.apng --budget 4 --size 640x360 --error
  Frame times for a script:
    specula animate scenes/turntable.ron -o film.apng --budget 4 --json | jq .frame_ms")]
pub(in crate::cli) struct Animate {
    /// Scene file (.ron), or a mesh (.obj), which gets a camera, lights and a material
    pub(super) scene: PathBuf,

    /// What to write: a .apng, .png or .y4m file, numbered files such as frames/####.png, or - for Y4M on standard
    /// output
    #[arg(short, long, value_name = "OUT")]
    pub(super) output: PathBuf,

    /// Frames a second, such as 30, 29.97 or 30000/1001; the scene's own rate, or 30, if not given
    #[arg(long, value_name = "RATE", allow_negative_numbers = true)]
    pub(super) fps: Option<FrameRate>,

    /// Seconds to film from time 0; the scene's own duration, or 6, if not given
    #[arg(long, value_name = "S", value_parser = duration, allow_negative_numbers = true)]
    pub(super) duration: Option<f64>,

    /// Wall-clock milliseconds for each frame; 0 buys the Gouraud-shaded image only
    #[arg(long, value_name = "MS", value_parser = milliseconds, allow_negative_numbers = true)]
    pub(super) budget: Option<f64>,

    /// Work units (nominal nanoseconds of refinement) for each frame: the result does not depend on the machine's
    /// speed or the number of threads
    #[arg(long, value_name = "UNITS", conflicts_with = "budget")]
    pub(super) work: Option<u64>,

    /// How to shade: flat, gouraud, phong, adaptive, phong-area, phong-tiles, phong-half, regular, highlight or hybrid
    #[arg(long, default_value_t)]
    pub(super) method: Method,

    /// Render every N-th frame, starting with frame I, which is from 1 to N: one of N parts of a numbered sequence
    #[arg(long, value_name = "I/N")]
    pub(super) shard: Option<Shard>,

    /// Render numbered frames anew that are there already
    #[arg(long)]
    pub(super) overwrite: bool,

    /// Compare every frame with its Phong reference (which takes a while), and measure the flicker of the error
    #[arg(long)]
    pub(super) error: bool,

    /// Print one JSON object per frame; the summary then goes to standard error
    #[arg(long)]
    pub(super) json: bool,

    #[command(flatten)]
    pub(super) machine: Machine,
}

fn duration(text: &str) -> Result<f64, String> {
    time(text)
        .ok()
        .filter(|&seconds| seconds > 0.0)
        .ok_or_else(|| format!("a duration is a number of seconds above 0, up to {MAX_DURATION_S}"))
}
