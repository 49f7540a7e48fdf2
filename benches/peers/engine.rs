//! What a comparison with others does not show: threads, frames without a change, and triangles that cannot be seen.

use super::arguments::Arguments;
use super::median;
use super::programs::{Cell, Ours};
use super::scene::{Model, Unseen};
use specula::output::Encoding;
use std::error::Error;

/// Times as many triangles that are not seen.
const UNSEEN: usize = 10;

/// Prints a row for each cell.
pub(super) fn measure(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    println!(
        "triangles  size       shading    1 thread ms  {} threads ms  ratio  unchanged  share    {UNSEEN}x off screen  {UNSEEN}x facing away",
        arguments.threads
    );
    arguments.for_each_cell(|model, cell| row(arguments, model, cell))
}

fn row(arguments: &Arguments, model: &Model, cell: Cell) -> Result<(), Box<dyn Error>> {
    let ours = |model, threads| Ours::new(model, cell, Encoding::Linear, threads, arguments.simd);
    let off_screen = model.with_unseen(Unseen::OffScreen, UNSEEN);
    let facing_away = model.with_unseen(Unseen::FacingAway, UNSEEN);
    let mut one = ours(model, 1)?;
    let mut all = ours(model, arguments.threads)?;
    let mut off = ours(&off_screen, arguments.threads)?;
    let mut away = ours(&facing_away, arguments.threads)?;
    let (mut ones, mut alls, mut unchanged) = (Vec::new(), Vec::new(), Vec::new());
    let (mut scaling, mut offs, mut aways) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..arguments.rounds {
        let (a, b) = (one.turn().0.median, all.turn().0.median);
        ones.push(a);
        alls.push(b);
        scaling.push(a / b);
        unchanged.push(all.unchanged_ms());
        offs.push(off.turn().0.median / b);
        aways.push(away.turn().0.median / b);
    }
    let [width, height] = cell.size;
    let size = format!("{width}x{height}");
    let shading = format!("{} {}", cell.shading.mode(), cell.shading.lights);
    let (all, unchanged) = (median(alls), median(unchanged));
    println!(
        "{:>9}  {size:<9}  {shading:<10} {:>11.3}  {all:>12.3}  {:>5.2}  {:>6.2} us  {:>5.2} %  {:>14.3}  {:>15.3}",
        cell.triangles(),
        median(ones),
        median(scaling),
        unchanged * 1e3,
        100.0 * unchanged / all,
        median(offs),
        median(aways)
    );
    Ok(())
}
