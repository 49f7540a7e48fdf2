//! The frame loop.

use super::Method;
use super::handover::Handover;
use super::load::{self, ImageLoad, MARGIN_MS};
use super::picture::{Easel, Pass, Picture, Studio};
use super::shelf::{Shelf, Size};
use super::stats::{FrameStats, Outcome, StageTimes};
use crate::backend::Backend;
use crate::geometry::screen::MAX_IMAGE_SIDE;
use crate::output::{Encoding, Target};
use crate::parallel::Exec;
use crate::scene::{GeometryChange, Placement, Scene, View, World};
use crate::schedule::{Allowance, Budget, CostModel, Kind, Ladder, cost};
use crate::visibility::Culler;

/// An image that takes one thread less time than this, by nominal costs, is not shared among threads: waking them takes 10
/// microseconds while they are busy, and 80 after they have slept.
const LEAST_NS_TO_SHARE: f32 = 100_000.0;

/// Share of a budget that is kept at most, while a first image is drawn, for handing over the image before.
const MOST_RESERVED: f64 = 0.5;

/// Everything of an engine that a frame changes.
#[derive(Debug)]
pub(super) struct Renderer {
    pub(super) method: Method,
    pub(super) encoding: Encoding,
    placement: Placement,
    pub(super) world: World,
    culler: Culler,
    /// The images: the one shown, and perhaps another one in the making.
    pub(super) shelf: Shelf,
    /// The view asked for in the last frame; `None` when the scene has changed since.
    last_view: Option<View>,
    ladder: Ladder,
    pub(super) costs: CostModel,
    /// What the first image drawn last consisted of.
    load: ImageLoad,
    pub(super) handover: Handover,
    pub(super) frames: u64,
}

/// A frame, or spare time between frames, in hand.
pub(super) struct Work<'a> {
    pub(super) exec: Exec,
    pub(super) allowance: Allowance<'a>,
    stages: StageTimes,
    predicted: StageTimes,
    /// Whether the owners of all pixels were known from the frame before.
    knew_owners: bool,
}

impl<'a> Work<'a> {
    pub(super) fn new(exec: Exec, allowance: Allowance<'a>) -> Self {
        Self {
            exec,
            allowance,
            stages: StageTimes::default(),
            predicted: StageTimes::default(),
            knew_owners: false,
        }
    }
}

/// An image to be drawn.
struct Commission {
    size: Size,
    view: View,
    divisor: u32,
    /// Whether it is of the scene and the camera as they are, and not as they were when it was begun.
    is_asked_for: bool,
}

impl Renderer {
    /// Makes everything ready for `scene`.
    pub(super) fn new(
        scene: &Scene,
        backend: Box<dyn Backend>,
        method: Method,
        encoding: Encoding,
        costs: CostModel,
    ) -> Self {
        let (placement, world) = Placement::new(scene);
        Self {
            method,
            encoding,
            placement,
            culler: Culler::new(&world.clusters),
            shelf: Shelf::new(backend),
            last_view: None,
            ladder: Ladder::default(),
            costs,
            load: ImageLoad::guess(&world),
            handover: Handover::new(),
            world,
            frames: 0,
        }
    }

    /// One frame: draw the first image if there is none, refine it while the budget lasts, hand it over.
    pub(super) fn render(
        &mut self,
        scene: &Scene,
        budget: Budget,
        mut work: Work<'_>,
        target: &mut Target<'_>,
    ) -> FrameStats {
        let asked = self.view(scene, target);
        let is_still = self.placement.is_up_to_date(scene) && self.last_view == Some(asked);
        self.draw(scene, target, is_still, &mut work);
        let is_current = self.is_current(scene, target);
        let mut drawing_ms = None;
        if is_current {
            self.shelf.note_right(self.frames + 1);
            drawing_ms = self.refine(Some(target), &mut work);
        }
        let pixels_written = self.hand_over(&mut work, target);

        self.frames += 1;
        let is_up_to_date = self.placement.is_up_to_date(scene);
        self.last_view = is_up_to_date.then(|| self.view(scene, target));
        let mut stats = self.report(budget, &work, is_current);
        stats.outcome = self.outcome(is_current, target, &work, drawing_ms.is_some());
        stats.pixels_written = pixels_written;
        let pixels = u64::from(asked.width) * u64::from(asked.height);
        stats.skipped.pixels_unchanged = pixels.saturating_sub(pixels_written);
        if work.knew_owners {
            stats.skipped.visibility_pixels = stats.covered_pixels;
        }
        stats
    }

    /// Draws first images until the one asked for is complete, or time is up.
    fn draw(&mut self, scene: &Scene, target: &Target<'_>, is_still: bool, work: &mut Work<'_>) {
        let divisor = self.choose_divisor(scene, target, work);
        work.allowance.note_divisor(divisor);
        let mut is_first = true;
        while let Some(image) = self.next_image(scene, target, divisor, is_still, work) {
            if !(work.allowance.begins_image()
                && self.draw_image(&image, Some(target), is_first, work))
            {
                self.ladder.note_missed();
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
            let is_asked_for = self.placement.is_up_to_date(scene)
                && view == self.view(scene, target).reduced(own_divisor);
            if is_asked_for || own_divisor == divisor {
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

        let (handing_over_ms, resolve_ms) = self.ending_ms(&view, divisor, target);
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
        if is_shown {
            let has_time = allowance.has_time_for(resolve_ms + handing_over_ms);
            if !(is_colouring_due || has_time) || !picture.colour(&mut studio, allowance, true) {
                return false;
            }
        } else {
            let is_coloured = picture.colour(&mut studio, allowance, false);
            let has_time = allowance.has_time_for(handing_over_ms);
            if !is_coloured || !(is_showing_due || has_time) {
                return false;
            }
        }
        self.shelf.publish(size);
        allowance.note_image();
        true
    }

    /// Milliseconds that handing the whole of an image over, and colouring it, will probably not exceed.
    fn ending_ms(&self, view: &View, divisor: u32, target: Option<&Target<'_>>) -> (f64, f64) {
        let load = self
            .load
            .resolve(self.method, self.world.lights.len(), view);
        let resolve_ms = self.costs.predict_at_most_ms(Kind::Resolve, load);
        let handing_over_ms = target.map_or(0.0, |target| {
            let size = [target.width(), target.height()];
            load::handing_over_ms(&self.costs, size, divisor) + MARGIN_MS
        });
        (handing_over_ms, resolve_ms)
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

    /// Whether a frame has enough to do to share it among threads. Not so where nothing has changed and nothing is left to be
    /// refined or handed over, nor where a single image is drawn sooner than threads can be woken.
    pub(super) fn needs_threads(&self, scene: &Scene, target: &Target<'_>) -> bool {
        let lights = scene.lights().len();
        let pixels = target.width() as f32 * target.height() as f32;
        let triangles = scene.triangle_count() as f32;
        let nominal_ns = cost::first_image(triangles, pixels)
            + if self.method.shades_first_image_per_pixel() {
                cost::phong(pixels, lights)
            } else {
                cost::vertices(triangles, lights)
            };
        if !self.method.is_progressive() && nominal_ns < LEAST_NS_TO_SHARE {
            return false;
        }
        let view = self.view(scene, target);
        let is_settled = self.placement.is_up_to_date(scene)
            && self.shelf.in_hand().is_none()
            && self.shelf.shown().is_some_and(|picture| {
                picture.divisor == self.method.divisor().unwrap_or(1)
                    && picture.shows(&view.reduced(picture.divisor))
                    && picture.has_converged(self.method)
            })
            && self.handover.pending_pixels(self.shelf.shown(), target) == 0;
        !is_settled
    }

    /// The view of the scene's camera in an image of the target's size.
    fn view(&self, scene: &Scene, target: &Target<'_>) -> View {
        // A larger image is none: backends leave a target alone that does not have the view's size.
        let [width, height] =
            [target.width(), target.height()].map(|side| side.min(MAX_IMAGE_SIDE));
        let view = self.world.view(scene.camera(), width, height);
        view.with_encoding(self.encoding)
    }

    /// Takes over what has changed of the scene.
    fn adopt(&mut self, scene: &Scene, work: &mut Work<'_>) {
        let since = work.allowance.elapsed_ms();
        let changes = self.placement.update(work.exec, &mut self.world, scene);
        match changes.geometry {
            GeometryChange::None => {}
            GeometryChange::Moved => {
                self.culler.refit(&self.world.clusters);
                self.shelf.move_objects(self.placement.moved());
            }
            GeometryChange::Replaced => {
                self.culler = Culler::new(&self.world.clusters);
                self.shelf.replace_world();
                self.load = ImageLoad::guess(&self.world);
            }
        }
        if changes.shading || changes.background {
            self.shelf.forget_colours();
        }
        work.stages.cull += work.allowance.elapsed_ms() - since;
    }

    /// Whether the image shown is one of the scene as it is, from its camera.
    fn is_current(&self, scene: &Scene, target: &Target<'_>) -> bool {
        self.placement.is_up_to_date(scene)
            && self.shelf.shown().is_some_and(|picture| {
                picture.shows(&self.view(scene, target).reduced(picture.divisor))
            })
    }

    /// Spends what is left of the budget on the image shown, less what handing it over will take. Returns the milliseconds that
    /// drawing took, where that comes after refinement and was done.
    fn refine(&mut self, target: Option<&Target<'_>>, work: &mut Work<'_>) -> Option<f64> {
        if !self.method.is_progressive() || self.shelf.in_hand().is_some() {
            return None;
        }
        let picture = self.shelf.shown_mut()?;
        let mut easel = Easel {
            exec: work.exec,
            method: self.method,
            world: &self.world,
            costs: &mut self.costs,
            stages: &mut work.stages,
            predicted: &mut work.predicted,
            target,
        };
        picture.refine(&mut easel, &mut work.allowance)
    }

    /// Hands the image shown over; returns the number of pixels written.
    fn hand_over(&mut self, work: &mut Work<'_>, target: &mut Target<'_>) -> u64 {
        let since = work.allowance.elapsed_ms();
        if target.width().max(target.height()) > MAX_IMAGE_SIDE {
            self.handover.leave_alone(target);
            return 0;
        }
        let shown = self
            .shelf
            .shown_mut()
            .filter(|picture| fits(picture, target));
        let divisor = shown.as_ref().map_or(1, |picture| picture.divisor);
        let pixels = match shown {
            Some(picture) => self.handover.present(work.exec, picture, target),
            None => {
                let background = self.world.background;
                self.handover
                    .fill(work.exec, background, self.encoding, target)
            }
        };
        self.handover.note(target);
        let ms = work.allowance.elapsed_ms() - since;
        work.stages.present += ms;
        work.predicted.present += Handover::learn(&mut self.costs, divisor, pixels, ms);
        pixels
    }

    /// Goes on with the images of the last frame in spare time. Whether they are final.
    pub(super) fn spend_spare_time(&mut self, work: &mut Work<'_>) -> bool {
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
    pub(super) fn is_final(&self) -> bool {
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

    fn outcome(
        &self,
        is_current: bool,
        target: &Target<'_>,
        work: &Work<'_>,
        has_drawn: bool,
    ) -> Outcome {
        let record = work.allowance.record();
        let is_new = record.images > 0;
        match self.shelf.shown() {
            None => Outcome::Stale { age: None },
            Some(picture) if !is_current => Outcome::Stale {
                age: fits(picture, target).then(|| self.shelf.age(self.frames)),
            },
            Some(picture) if picture.divisor != self.method.divisor().unwrap_or(1) => {
                Outcome::Reduced
            }
            Some(_) if !is_new && work.allowance.spent_units() == 0 && !has_drawn => {
                Outcome::Unchanged
            }
            Some(picture) if picture.has_converged(self.method) => Outcome::Complete,
            Some(_) if is_new && work.allowance.spent_units() == 0 => Outcome::BaseOnly,
            Some(_) => Outcome::Refined,
        }
    }

    /// What has been done, and what the image shown consists of.
    fn report(&self, budget: Budget, work: &Work<'_>, is_current: bool) -> FrameStats {
        let mut stats = FrameStats {
            frame: self.frames,
            frame_ms: work.allowance.elapsed_ms(),
            triangles: self.world.triangles.len() as u64,
            work_units: work.allowance.spent_units(),
            record: work.allowance.record(),
            stage_ms: work.stages,
            predicted_ms: work.predicted,
            ..FrameStats::empty(budget)
        };
        if let Some(picture) = self.shelf.shown() {
            stats.divisor = picture.divisor;
            // An image that is being drawn anew, though its colours still are the old ones, has lost what was known about it.
            if picture.view().is_some() {
                picture.report(self.method, &mut stats);
                stats.converged = is_current
                    && picture.has_converged(self.method)
                    && picture.divisor == self.method.divisor().unwrap_or(1);
            }
        }
        stats
    }
}

/// Whether the picture's image is one for a target of this size.
fn fits(picture: &Picture, target: &Target<'_>) -> bool {
    let size = [target.width(), target.height()].map(|side| side.div_ceil(picture.divisor));
    picture.size() == Some(size)
}
