//! Handing the image shown over to the caller's target: pixels as they are, enlarged, or the background while there is no image.
//!
//! Pixels that are right are not written again; the others are known as rectangles, for window systems that want to know the damage.

use super::load;
use super::picture::Picture;
use crate::backend::new_writer;
use crate::output::enlarge::enlarge;
use crate::output::{ChannelOrder, Encoding, Frame, Rect, Stamp, Target};
use crate::parallel::Exec;
use crate::schedule::{CostModel, Kind};
use std::collections::VecDeque;

/// Buffers older than this many frames are written anew: nobody queues more.
const MOST_AGE: usize = 16;

/// A frame of fewer pixels handed over does not tell how long one takes.
const LEAST_PIXELS_TO_LEARN_FROM: u64 = 1 << 15;

/// Hands images over, and remembers which.
#[derive(Debug)]
pub(super) struct Handover {
    /// For images that no backend wrote as they are.
    writer: u64,
    /// Counts enlarged images and backgrounds.
    serial: u64,
    /// What the stamp of the writer's latest serial stands for.
    latest: Option<Own>,
    /// The image to be enlarged.
    small: Frame,
    small_order: ChannelOrder,
    /// Which images the last frames handed over, the latest first.
    handed_over: VecDeque<Option<Stamp>>,
    /// What the last frame changed.
    changed: Vec<Rect>,
}

/// An image that no backend wrote as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Own {
    /// One enlarged by this divisor, from what a backend marked with this stamp.
    Enlarged(u32, Option<Stamp>),
    /// The background, in the target's order of bytes.
    Background([u8; 4]),
}

impl Handover {
    pub(super) fn new() -> Self {
        Self {
            writer: new_writer(),
            serial: 0,
            latest: None,
            small: Frame::new(0, 0),
            small_order: ChannelOrder::default(),
            handed_over: VecDeque::with_capacity(MOST_AGE),
            changed: Vec::new(),
        }
    }

    /// The image that was handed over `age` frames ago, 1 being the last one.
    pub(super) fn stamp(&self, age: u32) -> Option<Stamp> {
        *self.handed_over.get((age as usize).checked_sub(1)?)?
    }

    /// Forgets what was handed over to whom.
    pub(super) fn forget(&mut self) {
        self.handed_over.clear();
    }

    /// The rectangles of pixels that the last frame changed.
    pub(super) fn changed(&self) -> &[Rect] {
        &self.changed
    }

    /// Pixels that handing over would write: of an enlarged image, or the background, all or none.
    pub(super) fn pending_pixels(&mut self, shown: Option<&Picture>, target: &Target<'_>) -> u64 {
        let is_there_already = match shown {
            Some(picture) if picture.divisor == 1 => return picture.backend.pending_pixels(target),
            Some(picture) => {
                let pending = |small: &mut Target<'_>| picture.backend.pending_pixels(small);
                let own = Own::Enlarged(picture.divisor, self.small.stamp());
                self.is_written_already(own, target)
                    && self.small.write_in_order(self.small_order, pending) == 0
            }
            None => {
                let is_background = matches!(self.latest, Some(Own::Background(_)));
                is_background && target.serial_by(self.writer) == Some(self.serial)
            }
        };
        if is_there_already {
            0
        } else {
            u64::from(target.width()) * u64::from(target.height())
        }
    }

    /// Notes what was handed over into `target`.
    pub(super) fn note(&mut self, target: &Target<'_>) {
        self.handed_over.truncate(MOST_AGE - 1);
        self.handed_over.push_front(target.stamp());
    }

    /// Leaves `target` as it is.
    pub(super) fn leave_alone(&mut self, target: &Target<'_>) {
        self.changed.clear();
        self.note(target);
    }

    /// Brings `target` up to the image of `picture`. Returns the number of pixels written.
    pub(super) fn present(
        &mut self,
        exec: Exec,
        picture: &mut Picture,
        target: &mut Target<'_>,
    ) -> u64 {
        self.changed.clear();
        if picture.divisor == 1 {
            picture.backend.changes(target, &mut self.changed);
            return picture.backend.present(exec, target);
        }
        let Some([width, height]) = picture.size() else {
            return 0;
        };
        if [self.small.width(), self.small.height()] != [width, height] {
            self.small = Frame::new(width, height);
        }
        if self.small_order != target.order() {
            self.small_order = target.order();
            self.small.pixels_mut();
        }
        let order = target.order();
        self.small
            .write_in_order(order, |small| picture.backend.present(exec, small));
        let own = Own::Enlarged(picture.divisor, self.small.stamp());
        if self.is_written_already(own, target) {
            return 0;
        }
        enlarge(exec, self.small.pixels(), width, picture.divisor, target);
        self.mark(own, target)
    }

    /// Fills `target` with the background. Returns the number of pixels written.
    pub(super) fn fill(
        &mut self,
        exec: Exec,
        background: [f32; 3],
        encoding: Encoding,
        target: &mut Target<'_>,
    ) -> u64 {
        self.changed.clear();
        let [r, g, b] = background.map(|light| encoding.encode_u8(f64::from(light)));
        let colour = match target.order() {
            ChannelOrder::Rgba => [r, g, b, 255],
            ChannelOrder::Bgra => [b, g, r, 255],
        };
        let own = Own::Background(colour);
        if self.is_written_already(own, target) {
            return 0;
        }
        target.fill(exec, colour);
        self.mark(own, target)
    }

    /// Milliseconds that handing over what is shown now will probably not exceed.
    pub(super) fn predict_ms(
        &mut self,
        costs: &CostModel,
        shown: Option<&Picture>,
        target: &Target<'_>,
    ) -> f64 {
        let pixels = self.pending_pixels(shown, target);
        let divisor = shown.map_or(1, |picture| picture.divisor);
        load::pixels_ms(costs, pixels, divisor)
    }

    fn is_written_already(&self, own: Own, target: &Target<'_>) -> bool {
        self.latest == Some(own) && target.serial_by(self.writer) == Some(self.serial)
    }

    fn mark(&mut self, own: Own, target: &mut Target<'_>) -> u64 {
        if self.latest != Some(own) {
            self.latest = Some(own);
            self.serial += 1;
        }
        target.mark(Some(Stamp {
            writer: self.writer,
            serial: self.serial,
        }));
        self.changed.extend(target.rect());
        u64::from(target.width()) * u64::from(target.height())
    }

    /// Learns from handing over `pixels` pixels of an image of `divisor`. Returns the milliseconds that were predicted.
    pub(super) fn learn(costs: &mut CostModel, divisor: u32, pixels: u64, ms: f64) -> f64 {
        let (kind, load) = if divisor == 1 {
            (Kind::Present, load::present(pixels))
        } else {
            (Kind::Enlarge, load::enlarge(pixels as f64))
        };
        let predicted = costs.predict_ms(kind, load);
        if pixels >= LEAST_PIXELS_TO_LEARN_FROM {
            costs.learn(kind, load, ms);
        }
        predicted
    }
}
