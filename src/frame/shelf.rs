//! The engine's pictures: one at full resolution, and one at a lower one for when that does not fit into a budget; and when that
//! one is to have another size, a third, so that it can still be shown until its successor is complete.
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
    /// Another lower resolution, which the image shown has while one of [`Reduced`](Self::Reduced) is drawn.
    Former,
}

/// The pictures. See the [module](self).
#[derive(Debug)]
pub(super) struct Shelf {
    full: Picture,
    /// Made when it is needed first.
    reduced: Option<Picture>,
    /// The same.
    former: Option<Picture>,
    /// Whether there can be another picture.
    can_reduce: bool,
    shown: Option<Size>,
    /// The last frame whose scene and camera the image shown is of.
    right_in: u64,
}

impl Shelf {
    pub(super) fn new(backend: Box<dyn Backend>) -> Self {
        Self {
            can_reduce: backend.sibling().is_some(),
            full: Picture::new(backend),
            reduced: None,
            former: None,
            shown: None,
            right_in: 0,
        }
    }

    pub(super) fn can_reduce(&self) -> bool {
        self.can_reduce
    }

    /// The picture at full resolution.
    pub(super) fn full(&self) -> &Picture {
        &self.full
    }

    /// The picture of that size, if there is one; the one at full resolution where there can be no other.
    pub(super) fn get(&self, size: Size) -> Option<&Picture> {
        match size {
            Size::Reduced if self.can_reduce => self.reduced.as_ref(),
            Size::Former if self.can_reduce => self.former.as_ref(),
            _ => Some(&self.full),
        }
    }

    fn get_mut(&mut self, size: Size) -> Option<&mut Picture> {
        match size {
            Size::Reduced if self.can_reduce => self.reduced.as_mut(),
            Size::Former if self.can_reduce => self.former.as_mut(),
            _ => Some(&mut self.full),
        }
    }

    /// The picture of that size, made if need be.
    pub(super) fn get_or_make(&mut self, size: Size) -> &mut Picture {
        let picture = match size {
            Size::Reduced if self.can_reduce => &mut self.reduced,
            Size::Former if self.can_reduce => &mut self.former,
            _ => return &mut self.full,
        };
        if picture.is_none() {
            *picture = self.full.backend.sibling().map(Picture::new);
        }
        picture.as_mut().unwrap_or(&mut self.full)
    }

    fn pictures(&mut self) -> impl Iterator<Item = &mut Picture> {
        std::iter::once(&mut self.full)
            .chain(&mut self.reduced)
            .chain(&mut self.former)
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
        if let Some(picture) = self.get_mut(size) {
            picture.forget();
        }
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

    /// Begins an image, or goes on with it. The one shown is lost if it was at full resolution and of another size.
    pub(super) fn begin(&mut self, size: Size, view: View, divisor: u32, frame: Option<u64>) {
        let is_shown = self.shown == Some(size);
        let is_alike = |picture: &Picture| {
            picture.divisor == divisor && picture.size() == Some([view.width, view.height])
        };
        if is_shown && !self.get(size).is_some_and(is_alike) {
            self.shown = None;
            if size == Size::Reduced && self.can_reduce {
                std::mem::swap(&mut self.reduced, &mut self.former);
                self.shown = Some(Size::Former);
            }
        }
        self.get_or_make(size).begin(view, divisor, frame);
    }

    /// Shows the picture of that size, whose first image has got its colours.
    pub(super) fn publish(&mut self, size: Size) {
        let picture = self.get_or_make(size);
        picture.publish();
        self.right_in = picture.right_in().unwrap_or(0);
        self.shown = Some(size);
    }

    /// Shows the picture of that size again if it shows `view`. Whether it does.
    pub(super) fn show(&mut self, size: Size, view: &View) -> bool {
        let does_show = self.shows(size, view);
        if does_show {
            self.shown = Some(size);
        }
        does_show
    }

    /// Takes note that the image shown is the one asked for in frame number `frame`.
    pub(super) fn note_right(&mut self, frame: u64) {
        self.right_in = frame;
    }

    /// How many frames before `frame` the scene and camera were those of the image shown.
    pub(super) fn age(&self, frame: u64) -> u64 {
        frame.saturating_sub(self.right_in)
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
        self.get_mut(self.shown?)
    }

    /// How far the first image of the picture of that size has come.
    pub(super) fn pass(&self, size: Size) -> Pass {
        self.get(size).map_or(Pass::Empty, Picture::pass)
    }
}
