//! Per-pixel shading square by square in an order that knows nothing of the image: [`Method::PhongTiles`](super::Method).
//!
//! Squares that show only background are left out, which any program would do; all others are shuffled, in the same way for every
//! image of a size. Each thread has at least a square to shade, and more while the deadline is far away. What a frame does is the
//! beginning of what an unlimited one does, for any number of threads.

use super::refinement::Stage;
use super::stats::FrameStats;
use crate::backend::{Backend, SQUARE_SIDE};
use crate::scene::View;
use crate::schedule::{Allowance, cost};

/// Most squares that are shaded before the clock is looked at again.
const MOST_AT_ONCE: usize = 64;

/// Squares that several threads share take at most this part of the time that is left: their number is the divisor.
const PART_OF_TIME: u64 = 4;

/// How far the squares of the current image have been shaded.
#[derive(Debug, Default)]
pub(super) struct Tiles {
    /// Squares and how many pixels the scene covers in each, in the order in which they are shaded.
    order: Vec<(u32, u32)>,
    /// How many of them are done.
    done: usize,
    /// Pixels that have been shaded.
    pixels: u64,
}

impl Tiles {
    /// Starts with an image of which nothing has been shaded yet.
    pub(super) fn begin(&mut self, view: &View, backend: &dyn Backend) {
        let squares = |side: u32| side.div_ceil(SQUARE_SIDE);
        let count = squares(view.width) * squares(view.height);
        self.order.clear();
        self.order.reserve(count as usize);
        self.order
            .extend((0..count).map(|square| (square, backend.square_pixels(square))));
        shuffle(&mut self.order);
        self.order.retain(|&(_, pixels)| pixels > 0);
        (self.done, self.pixels) = (0, 0);
    }

    /// Whether every pixel has been shaded.
    pub(super) fn is_finished(&self) -> bool {
        self.done == self.order.len()
    }

    /// Shades some squares. False when there is none left, or the budget does not admit any.
    pub(super) fn step(&mut self, stage: &mut Stage<'_>, allowance: &mut Allowance<'_>) -> bool {
        let lights = stage.world.lights.len();
        let mut squares = [0; MOST_AT_ONCE];
        let mut count = 0;
        let threads = stage.exec.threads.max(1);
        let most_units = (allowance.units_left() / PART_OF_TIME).saturating_mul(threads as u64);
        let mut sum = 0;
        for &(square, pixels) in self.order[self.done..].iter().take(MOST_AT_ONCE) {
            let units = cost::phong(pixels as f32, lights) as u64;
            sum += units;
            let has_enough = count >= threads && sum > most_units;
            if has_enough || !allowance.admit(units) {
                break;
            }
            allowance.spend(units);
            self.pixels += u64::from(pixels);
            squares[count] = square;
            count += 1;
        }
        if count > 0 {
            let geometry = stage.base.geometry(stage.world, stage.view);
            stage
                .backend
                .shade_squares(stage.exec, geometry, &squares[..count]);
        }
        self.done += count;
        count > 0
    }

    /// Fills in how far the image has come. Its error is not estimated.
    pub(super) fn report(&self, stats: &mut FrameStats) {
        stats.phong_pixels = self.pixels;
        stats.estimated_error = if self.is_finished() { 0.0 } else { f64::NAN };
    }
}

/// Brings a list into an order that depends on its length alone (Fisher and Yates's shuffle).
fn shuffle<T>(list: &mut [T]) {
    let mut state: u64 = 1;
    for last in (1..list.len()).rev() {
        // Knuth's linear congruential generator; its upper bits are the random ones.
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let other = (state >> 33) as usize % (last + 1);
        list.swap(last, other);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shuffle_loses_nothing_and_is_always_the_same() {
        let mut list: Vec<u32> = (0..240).collect();
        shuffle(&mut list);
        let mut again: Vec<u32> = (0..240).collect();
        shuffle(&mut again);
        assert_eq!(list, again);
        let in_place = list.iter().zip(0..).filter(|&(&a, b)| a == b).count();
        let neighbours = list.windows(2).filter(|pair| pair[1] == pair[0] + 1);
        assert!(in_place < 10 && neighbours.count() < 10, "{list:?}");
        list.sort_unstable();
        assert!(list.iter().copied().eq(0..240));
        shuffle::<u32>(&mut []);
    }
}
