//! First images in the frame loop: which one is drawn next, at which resolution, and drawing it while there is time.

use super::{Renderer, Work};
use crate::frame::load::MARGIN_MS;
use crate::frame::picture::{Pass, Picture, Studio};
use crate::frame::shelf::Size;
use crate::output::Target;
use crate::scene::{Scene, View};

/// Share of a budget that is kept at most, while a first image is drawn, for handing over the image before.
const MOST_RESERVED: f64 = 0.8;

/// An image to be drawn.
struct Commission {
    size: Size,
    view: View,
    divisor: u32,
    /// Whether it is of the scene and the camera as they are, and not as they were when it was begun.
    is_asked_for: bool,
}

impl Renderer {
    /// Draws first images until the one asked for is complete, or time is up.
    pub(super) fn draw(
        &mut self,
        scene: &Scene,
        target: &Target<'_>,
        is_still: bool,
        work: &mut Work<'_>,
    ) {
        let divisor = self.choose_divisor(scene, target, work);
        work.allowance.note_divisor(divisor);
        let mut is_first = true;
        while let Some(image) = self.next_image(scene, target, divisor, is_still, work) {
            if !(work.allowance.begins_image()
                && self.draw_image(&image, Some(target), is_first, work))
            {
                // That the full resolution does not follow at once says nothing about the one chosen.
                if image.divisor == divisor && !work.allowance.is_cancelled() {
                    self.ladder.note_missed();
                }
                return;
            }
            is_first = false;
        }
    }

    /// The divisor for the next image: the full resolution unless time is short.
    fn choose_divisor(&mut self, scene: &Scene, target: &Target<'_>, work: &Work<'_>) -> u32 {
        if let Some(divisor) = self.method.divisor().or(work.allowance.replayed_divisor()) {
            return divisor;
        }
        let Some(budget_ms) = work.allowance.first_image_ms() else {
            return 1;
        };
        let view = self.view(scene, target);
        if self.placement.is_up_to_date(scene)
            && let Some(size) = [Size::Full, Size::Reduced].into_iter().find(|&size| {
                let picture = self.shelf.get(size);
                picture.is_some_and(|picture| picture.shows(&view.reduced(picture.divisor)))
            })
        {
            return self.shelf.get(size).map_or(1, |picture| picture.divisor);
        }
        if !self.shelf.can_reduce() {
            return 1;
        }
        let lights = scene.lights().len();
        self.ladder.choose(budget_ms, |divisor| {
            self.load
                .forecast(&self.costs, self.method, lights, &view, divisor)
        })
    }

    /// What is to be drawn next, if the image asked for is not there yet.
    fn next_image(
        &mut self,
        scene: &Scene,
        target: &Target<'_>,
        divisor: u32,
        is_still: bool,
        work: &mut Work<'_>,
    ) -> Option<Commission> {
        // What is in hand is finished as it was begun, unless something else would be there sooner.
        if let Some((size, view, own_divisor)) = self.shelf.view_in_hand() {
            let asked = self.view(scene, target).reduced(own_divisor);
            let is_asked_for = self.placement.is_up_to_date(scene) && view == asked;
            let is_alike = [view.width, view.height] == [asked.width, asked.height];
            if is_asked_for || own_divisor == divisor && is_alike {
                return Some(Commission {
                    size,
                    view,
                    divisor: own_divisor,
                    is_asked_for,
                });
            }
            self.shelf.abandon(size);
        }
        self.adopt(scene, work);
        let full = self.view(scene, target);
        work.knew_owners |=
            work.allowance.record().images == 0 && self.shelf.full().knows_owners(&full);
        if self.shelf.show(Size::Full, &full) {
            return None;
        }
        let small = full.reduced(divisor);
        if divisor > 1 && !self.shelf.show(Size::Reduced, &small) {
            return Some(Commission {
                size: Size::Reduced,
                view: small,
                divisor,
                is_asked_for: true,
            });
        }
        // While the view stays, the full resolution follows.
        (divisor == 1 || is_still && self.method.divisor().is_none()).then_some(Commission {
            size: Size::Full,
            view: full,
            divisor: 1,
            is_asked_for: true,
        })
    }

    /// Draws a first image, or goes on with it. False when time is up before it can be shown. `is_first` says that nothing has
    /// been done in this frame yet.
    fn draw_image(
        &mut self,
        image: &Commission,
        target: Option<&Target<'_>>,
        is_first: bool,
        work: &mut Work<'_>,
    ) -> bool {
        let Commission {
            size,
            view,
            divisor,
            is_asked_for,
        } = *image;
        // What was left over for a frame of its own is not left over again.
        let is_due = |pass| is_first && self.shelf.pass(size) == pass;
        let (is_colouring_due, is_showing_due) = (is_due(Pass::Colouring), is_due(Pass::Coloured));
        // In spare time there is no target, and what was asked for in the last frame still is.
        let frame = self.frames + u64::from(target.is_some());
        let frame = is_asked_for.then_some(frame);
        self.shelf.begin(size, view, divisor, frame);
        self.reserve_handing_over(target, work);

        let is_shown = self.shelf.shown_size() == Some(size);
        let Work {
            exec,
            allowance,
            stages,
            predicted,
            ..
        } = work;
        let picture = self.shelf.get_or_make(size);
        let mut studio = Studio {
            exec: *exec,
            method: self.method,
            paper: self.paper,
            world: &self.world,
            culler: &mut self.culler,
            costs: &mut self.costs,
            load: &mut self.load,
            stages,
            predicted,
        };
        if !picture.prepare(&mut studio, allowance) || !allowance.completes_image() {
            return false;
        }
        let handing_over_ms = picture.handing_over_ms(&studio, target);
        picture.compose(&mut studio, allowance, handing_over_ms, is_asked_for);
        if is_shown {
            let has_time = |picture: &Picture, studio: &Studio<'_>| {
                let colouring_ms = studio.colouring_ms(&view, &picture.composition());
                let slowness = studio.stages.slowness(studio.predicted);
                allowance.has_time_for((colouring_ms + handing_over_ms) * slowness)
            };
            let mut is_in_time = has_time(picture, &studio);
            // Rather a plain image than none.
            if !is_in_time && !picture.composition().is_plain() {
                picture.decompose(studio.world);
                is_in_time = has_time(picture, &studio);
            }
            let may_begin = is_colouring_due || is_in_time;
            if !may_begin || !picture.colour(&mut studio, allowance, true) {
                return false;
            }
        } else {
            let is_coloured = picture.colour(&mut studio, allowance, false);
            let slowness = studio.stages.slowness(studio.predicted);
            let has_time = allowance.has_time_for(handing_over_ms * slowness);
            if !is_coloured || !(is_showing_due || has_time) {
                return false;
            }
        }
        (picture.composition()).book(allowance, studio.world.lights.len());
        picture.begin_refinement(&mut studio, allowance);
        self.shelf.publish(size);
        allowance.note_image();
        true
    }

    /// Keeps what handing over the image shown will take.
    fn reserve_handing_over(&mut self, target: Option<&Target<'_>>, work: &mut Work<'_>) {
        let ms = target.map_or(0.0, |target| {
            self.handover
                .predict_ms(&self.costs, self.shelf.shown(), target)
        }) + MARGIN_MS;
        // Where handing over takes all of the time, an image still has to come about.
        let most_ms = work.allowance.first_image_ms().unwrap_or(f64::INFINITY) * MOST_RESERVED;
        work.allowance.reserve_ms(ms.min(most_ms));
    }

    /// Goes on with the images of the last frame in spare time. Whether they are final.
    pub(in crate::frame) fn spend_spare_time(&mut self, work: &mut Work<'_>) -> bool {
        let mut is_first = true;
        while let Some(image) = self.unfinished_image() {
            if !(work.allowance.begins_image() && self.draw_image(&image, None, is_first, work)) {
                return false;
            }
            is_first = false;
        }
        self.refine(None, work);
        self.is_final()
    }

    /// Whether there is an image, and nothing left to be done about it.
    pub(in crate::frame) fn is_final(&self) -> bool {
        let is_final =
            |picture: &Picture| picture.view().is_some() && picture.has_converged(self.method);
        self.unfinished_image().is_none() && self.shelf.shown().is_some_and(is_final)
    }

    /// The first image in hand; or that of the last frame's view, when that is not shown at full resolution.
    fn unfinished_image(&self) -> Option<Commission> {
        if let Some((size, view, divisor)) = self.shelf.view_in_hand() {
            let last = self.last_view.map(|last| last.reduced(divisor));
            return Some(Commission {
                size,
                view,
                divisor,
                is_asked_for: last == Some(view),
            });
        }
        // Nothing is shown when it has been forgotten, or there has been no time for any image so far.
        let size = self.shelf.shown_size()?;
        let (divisor, wanted) = match self.method.divisor() {
            Some(divisor) => (divisor, Size::Reduced),
            None => (1, Size::Full),
        };
        let view = self.last_view?.reduced(divisor);
        let is_there = size == wanted && self.shelf.shows(wanted, &view);
        (!is_there).then_some(Commission {
            size: wanted,
            view,
            divisor,
            is_asked_for: true,
        })
    }
}
