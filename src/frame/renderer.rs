//! The frame loop. How first images are drawn is in [`first_image`].

mod first_image;

use super::Method;
use super::handover::Handover;
use super::load::ImageLoad;
use super::picture::{Easel, Picture};
use super::shelf::Shelf;
use super::stats::{FrameStats, Outcome, StageTimes};
use crate::backend::Backend;
use crate::geometry::screen::MAX_IMAGE_SIDE;
use crate::output::{Encoding, Target};
use crate::parallel::Exec;
use crate::refine::paper::PaperRule;
use crate::scene::{GeometryChange, Placement, Scene, View, World};
use crate::schedule::{Allowance, Budget, CostModel, Ladder, cost};
use crate::visibility::Culler;

/// An image that takes one thread less time than this, by nominal costs, is not shared among threads: waking them takes 10
/// microseconds while they are busy, and 80 after they have slept.
const LEAST_NS_TO_SHARE: f32 = 100_000.0;

/// Everything of an engine that a frame changes.
#[derive(Debug)]
pub(super) struct Renderer {
    pub(super) method: Method,
    pub(super) paper: PaperRule,
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
            paper: PaperRule::default(),
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

    /// Forgets all images, so that the next frame starts cold.
    pub(super) fn forget(&mut self) {
        self.shelf.forget();
        self.last_view = None;
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

    /// Whether a frame has enough to do to share it among threads. Not so where nothing has changed and nothing is left to be
    /// refined or handed over, nor where a single image is drawn sooner than threads can be woken.
    pub(super) fn needs_threads(&mut self, scene: &Scene, target: &Target<'_>) -> bool {
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
        let divisor = shown.as_ref().map(|picture| picture.divisor);
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
        // Filling says nothing about what copying takes.
        if let Some(divisor) = divisor {
            work.predicted.present += Handover::learn(&mut self.costs, divisor, pixels, ms);
        }
        pixels
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
                if is_current && picture.divisor == 1 {
                    picture.certify(self.method, &mut stats);
                }
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
