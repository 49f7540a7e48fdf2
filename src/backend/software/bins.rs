//! Sorting pieces by the tiles that their boxes touch.
//!
//! Bins are made for each share of triangles by itself (a counting sort by tile), and a tile looks into every share's bin in
//! turn: nothing is merged, and each bin lists its triangles in ascending order.

use super::fit;
use super::shares::{Progress, Share};
use super::tile::Grid;
use crate::parallel::{Pace, Watch};

/// Entries that are counted or filled in in one go: about 10 microseconds.
const ENTRIES_AT_ONCE: usize = 4096;

/// Empties the bins of a share whose triangles have been set up.
pub(super) fn begin(share: &mut Share, grid: Grid) {
    // Each tile's count goes one place to the right of its start, twice over: after summing up, a place holds its tile's
    // start, which filling then moves on to the end, that is, to the next tile's start.
    share.bin_starts.clear();
    share.bin_starts.resize(grid.len() + 2, 0);
    share.progress = Progress::Counting(0);
}

/// Sorts a share's pieces into its bins, or goes on with it, until it is told to stop.
pub(super) fn fill(share: &mut Share, grid: Grid, watch: &Watch<'_>) {
    if let Progress::Counting(counted) = share.progress {
        share.progress = match count_entries(share, grid, counted, watch) {
            Some(counted) => Progress::Counting(counted),
            None => {
                sum_up(share);
                Progress::Filling(0)
            }
        };
    }
    if let Progress::Filling(filled) = share.progress
        && !watch.is_over()
    {
        share.progress = match fill_in(share, grid, filled, watch) {
            Some(filled) => Progress::Filling(filled),
            None => Progress::Done,
        };
    }
}

/// Counts the entries of pieces from number `first` on. Returns where to go on when it is told to stop.
fn count_entries(share: &mut Share, grid: Grid, first: usize, watch: &Watch<'_>) -> Option<usize> {
    let mut pace = Pace::new(watch, ENTRIES_AT_ONCE);
    let starts = &mut share.bin_starts[..];
    for (index, piece) in share.pieces.iter().enumerate().skip(first) {
        let mut entries = 0;
        for tile in grid.touched(&piece.bounds) {
            starts[tile + 2] += 1;
            entries += 1;
        }
        if !pace.did(entries) {
            return Some(index + 1);
        }
    }
    None
}

/// Makes starts of counts, and room for the entries.
fn sum_up(share: &mut Share) {
    let mut end = 0;
    for start in &mut share.bin_starts {
        end += *start;
        *start = end;
    }
    fit(&mut share.bin_entries, end as usize, 0);
}

/// Fills in the entries of pieces from number `first` on. Returns where to go on when it is told to stop.
fn fill_in(share: &mut Share, grid: Grid, first: usize, watch: &Watch<'_>) -> Option<usize> {
    let mut pace = Pace::new(watch, ENTRIES_AT_ONCE);
    let starts = &mut share.bin_starts[..];
    for (index, piece) in share.pieces.iter().enumerate().skip(first) {
        let mut entries = 0;
        for tile in grid.touched(&piece.bounds) {
            let next = &mut starts[tile + 1];
            share.bin_entries[*next as usize] = index as u32;
            *next += 1;
            entries += 1;
        }
        if !pace.did(entries) {
            return Some(index + 1);
        }
    }
    None
}
