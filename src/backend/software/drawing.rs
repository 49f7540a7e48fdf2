//! How far the drawing of each tile is.
//!
//! A tile is drawn on the stack. When its thread is told to stop, what there is of it is copied to a block of memory
//! that waits for it, and back when another turn goes on. Tiles set aside come first then, each with the block it
//! has; so at no time are there more of them than threads, and that many blocks are enough.

use super::tile::{BlockSet, NO_DEPTH, NO_TRIANGLE, TILE_BLOCKS, TILE_PIXELS};
use crate::parallel::Watch;
use std::sync::{Mutex, PoisonError};

/// The piece to be drawn next.
#[derive(Clone, Copy, Default)]
pub(super) struct Next {
    /// In which share's bin it is.
    pub share: usize,
    /// At which place there.
    pub entry: usize,
}

/// A tile that has been set aside.
pub(super) struct Unfinished {
    /// What a canvas has of the same name.
    pub depth: [f32; TILE_PIXELS],
    /// Likewise.
    pub slot: [u32; TILE_PIXELS],
    /// Likewise.
    pub farthest: [f32; TILE_BLOCKS],
    /// Likewise.
    pub owned: BlockSet,
    pub next: Next,
}

/// How far the drawing of a tile is.
#[derive(Default)]
pub(super) enum Drawing {
    /// It has not begun.
    #[default]
    ToDo,
    /// It has been set aside.
    Unfinished(Box<Unfinished>),
    /// It is complete.
    Done,
}

impl Drawing {
    /// Sets the tile aside, and returns where what there is of it belongs.
    #[cold]
    pub(super) fn set_aside(&mut self, desk: &Desk<'_>) -> Option<&mut Unfinished> {
        if !matches!(self, Self::Unfinished(_)) {
            *self = Self::Unfinished(desk.spare.take());
        }
        match self {
            Self::Unfinished(block) => Some(block),
            _ => None,
        }
    }

    /// Notes that the tile is complete.
    pub(super) fn finish(&mut self, desk: &Desk<'_>) {
        if let Self::Unfinished(block) = std::mem::replace(self, Self::Done) {
            desk.spare.put_back(block);
        }
    }
}

/// Memory for tiles that are set aside.
#[derive(Default)]
pub(super) struct Spare(Mutex<Vec<Box<Unfinished>>>);

impl Spare {
    /// Provides memory for as many tiles as there are threads, when none is set aside.
    pub(super) fn provide(&mut self, threads: usize) {
        let spare = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        while spare.len() < threads {
            spare.push(new_block());
        }
    }

    fn take(&self) -> Box<Unfinished> {
        self.with(Vec::pop).unwrap_or_else(new_block)
    }

    /// Takes back what is no longer needed.
    pub(super) fn put_back(&self, block: Box<Unfinished>) {
        self.with(|spare| spare.push(block));
    }

    fn with<T>(&self, change: impl FnOnce(&mut Vec<Box<Unfinished>>) -> T) -> T {
        change(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

fn new_block() -> Box<Unfinished> {
    Box::new(Unfinished {
        depth: [NO_DEPTH; TILE_PIXELS],
        slot: [NO_TRIANGLE; TILE_PIXELS],
        farthest: [NO_DEPTH; TILE_BLOCKS],
        owned: BlockSet::EMPTY,
        next: Next::default(),
    })
}

/// What threads share that draw tiles.
pub(super) struct Desk<'a> {
    pub watch: &'a Watch<'a>,
    pub spare: &'a Spare,
}
