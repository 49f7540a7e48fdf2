//! The engine's pictures: one at full resolution, and one at a lower one for when that does not fit into a budget.
//!
//! At most one of them is **in hand**: its first image has been begun and not completed. At most one is **shown**: its image is the one
//! handed over, and refined. It may be in hand at the same time, as long as the colours of the image before are there.

use super::picture::{Pass, Picture};
use crate::backend::Backend;
use crate::scene::View;
use std::ops::Range;

/// Which picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Size {
    Full,
    Reduced,
}

/// The pictures. See the [module](self).
#[derive(Debug)]
pub(super) struct Shelf {
    full: Picture,
    /// Made when it is needed first.
    reduced: Option<Picture>,
    /// Whether there can be another picture.
    can_reduce: bool,
    shown: Option<Size>,
}

impl Shelf {
    pub(super) fn new(backend: Box<dyn Backend>) -> Self {
        Self {
            can_reduce: backend.sibling().is_some(),
            full: Picture::new(backend),
            reduced: None,
            shown: None,
        }
    }

    pub(super) fn can_reduce(&self) -> bool {
        self.can_reduce
    }

    /// The picture at full resolution.
    pub(super) fn full(&self) -> &Picture {
        &self.full
    }

    /// The picture of that size, if there is one.
    pub(super) fn get(&self, size: Size) -> Option<&Picture> {
        match size {
            Size::Full => Some(&self.full),
            Size::Reduced => self.reduced.as_ref(),
        }
    }

    /// The picture of that size, made if need be; the one at full resolution where there can be no other.
    pub(super) fn get_or_make(&mut self, size: Size) -> &mut Picture {
        if size == Size::Full {
            return &mut self.full;
        }
        if self.reduced.is_none() {
            let backend = self.full.backend.sibling();
            self.reduced = backend.map(Picture::new);
        }
        self.reduced.as_mut().unwrap_or(&mut self.full)
    }

    fn pictures(&mut self) -> impl Iterator<Item = &mut Picture> {
        std::iter::once(&mut self.full).chain(&mut self.reduced)
    }

    /// Takes note that the objects with these triangles, which ascend, have moved.
    pub(super) fn move_objects(&mut self, moved: &[Range<u32>]) {
        self.pictures()
            .for_each(|picture| picture.move_objects(moved));
    }

    /// Takes note that lights, materials or the background are others.
    pub(super) fn forget_colours(&mut self) {
        self.pictures().for_each(Picture::forget_colours);
    }

    /// Takes note that the world is another one.
    pub(super) fn replace_world(&mut self) {
        self.pictures().for_each(Picture::replace_world);
    }

    /// Gives the image in hand of that size up.
    pub(super) fn abandon(&mut self, size: Size) {
        let picture = match size {
            Size::Full => Some(&mut self.full),
            Size::Reduced => self.reduced.as_mut(),
        };
        picture.into_iter().for_each(Picture::forget);
    }

    /// Forgets all images, and what was found out about triangles; there is none to be shown.
    pub(super) fn forget(&mut self) {
        self.pictures().for_each(|picture| {
            picture.forget();
            picture.refinement.forget();
        });
        self.shown = None;
    }

    /// The picture in hand.
    pub(super) fn in_hand(&self) -> Option<Size> {
        [Size::Full, Size::Reduced]
            .into_iter()
            .find(|&size| self.get(size).is_some_and(Picture::is_in_hand))
    }

    /// The view of the picture in hand, and its divisor.
    pub(super) fn view_in_hand(&self) -> Option<(Size, View, u32)> {
        let size = self.in_hand()?;
        let picture = self.get(size)?;
        Some((size, picture.in_hand()?, picture.divisor))
    }

    /// Whether the picture of that size shows the first image of `view`, or a refined one.
    pub(super) fn shows(&self, size: Size, view: &View) -> bool {
        self.get(size).is_some_and(|picture| picture.shows(view))
    }

    /// Begins an image, or goes on with it. The one shown is lost if it was in the same picture and of another size.
    pub(super) fn begin(&mut self, size: Size, view: View, divisor: u32, frame: u64) {
        let picture = self.get_or_make(size);
        let is_lost = picture.size() != Some([view.width, view.height]);
        picture.begin(view, divisor, frame);
        if is_lost && self.shown == Some(size) {
            self.shown = None;
        }
    }

    /// Shows the picture of that size, whose first image has got its colours.
    pub(super) fn publish(&mut self, size: Size) {
        self.get_or_make(size).publish();
        self.shown = Some(size);
    }

    /// The size of the picture shown.
    pub(super) fn shown_size(&self) -> Option<Size> {
        self.shown
    }

    /// The picture shown.
    pub(super) fn shown(&self) -> Option<&Picture> {
        self.get(self.shown?)
    }

    /// The picture shown.
    pub(super) fn shown_mut(&mut self) -> Option<&mut Picture> {
        match self.shown? {
            Size::Full => Some(&mut self.full),
            Size::Reduced => self.reduced.as_mut(),
        }
    }

    /// How far the first image of the picture of that size has come.
    pub(super) fn pass(&self, size: Size) -> Pass {
        self.get(size).map_or(Pass::Empty, Picture::pass)
    }
}
