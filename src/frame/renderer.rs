//! The frame loop.

use super::Method;
use super::base::BaseImage;
use super::refine_first::RefineFirst;
use super::refinement::Refinement;
use super::stats::{FrameStats, Outcome, StageTimes};
use super::tiles::Tiles;
use crate::backend::Backend;
use crate::geometry::screen::MAX_IMAGE_SIDE;
use crate::output::{Encoding, Stamp, Target};
use crate::parallel::Exec;
use crate::scene::{GeometryChange, Placement, Scene, View, World};
use crate::schedule::{Allowance, Budget, LearnedRate, cost};
use std::collections::VecDeque;

/// Buffers older than this many frames are written anew: nobody queues more.
const MOST_AGE: usize = 16;

/// An image that takes one thread less time than this, by nominal costs, is not shared among threads: waking them takes 10
/// microseconds while they are busy, and 80 after they have slept.
const LEAST_NS_TO_SHARE: f32 = 100_000.0;

/// Refinement ends so much before it has to: what comes after it does not always take the same time.
const MARGIN_MS: f64 = 0.03;

/// A frame of fewer pixels handed over does not tell how long one takes.
const LEAST_PIXELS_TO_LEARN_FROM: u64 = 1 << 15;

/// Everything of an engine that a frame changes.
#[derive(Debug)]
pub(super) struct Renderer {
    pub(super) method: Method,
    pub(super) encoding: Encoding,
    pub(super) placement: Placement,
    pub(super) world: World,
    pub(super) backend: Box<dyn Backend>,
    /// The view for which the backend knows who owns which pixel, if it does for any.
    pub(super) seen: Option<View>,
    /// Whether the image of that view has its colours, as far as it has been refined.
    pub(super) is_lit: bool,
    pub(super) base: BaseImage,
    pub(super) refinement: Refinement,
    /// For a backend that cannot repaint.
    pub(super) refine_first: RefineFirst,
    /// For [`Method::PhongTiles`].
    pub(super) tiles: Tiles,
    /// Time per pixel handed over to the caller.
    pub(super) presenting: LearnedRate,
    pub(super) frames: u64,
    /// Which images the last frames handed over, the latest first.
    pub(super) handed_over: VecDeque<Option<Stamp>>,
}

impl Renderer {
    /// Makes everything ready for `scene`.
    pub(super) fn new(
        scene: &Scene,
        backend: Box<dyn Backend>,
        method: Method,
        encoding: Encoding,
    ) -> Self {
        let (placement, world) = Placement::new(scene);
        Self {
            method,
            encoding,
            placement,
            base: BaseImage::new(&world),
            world,
            backend,
            seen: None,
            is_lit: false,
            refinement: Refinement::default(),
            refine_first: RefineFirst::default(),
            tiles: Tiles::default(),
            presenting: LearnedRate::new(cost::PRESENT_PIXEL_NS, LEAST_PIXELS_TO_LEARN_FROM),
            frames: 0,
            handed_over: VecDeque::with_capacity(MOST_AGE),
        }
    }

    /// One frame: draw the first image if there is none, refine it while the budget lasts, hand it over.
    pub(super) fn render(
        &mut self,
        exec: Exec,
        scene: &Scene,
        budget: Budget,
        mut allowance: Allowance<'_>,
        target: &mut Target<'_>,
    ) -> FrameStats {
        let mut stages = StageTimes::default();
        self.adopt(exec, scene);
        stages.cull += allowance.elapsed_ms();
        let view = self.view(scene, target);

        let is_seen = self.seen == Some(view);
        if !is_seen {
            self.look(exec, &view, &allowance, &mut stages);
        }
        let is_new = !self.is_lit;
        if is_new {
            self.light(exec, &view, &allowance, &mut stages);
        }

        let refining_since = allowance.elapsed_ms();
        let mut drawing_ms = None;
        if self.method.is_progressive() {
            drawing_ms = self.refine(exec, &view, &mut allowance, target);
        }
        let presenting_since = allowance.elapsed_ms();
        let drawing = drawing_ms.unwrap_or(0.0);
        stages.refine += presenting_since - refining_since - drawing;
        stages.resolve += drawing;

        let pixels_written = self.backend.present(exec, target);
        self.handed_over.truncate(MOST_AGE - 1);
        self.handed_over.push_front(target.stamp());
        let frame_ms = allowance.elapsed_ms();
        stages.present += frame_ms - presenting_since;
        self.presenting
            .learn(pixels_written, frame_ms - presenting_since);

        let converged = self.has_converged();
        let mut stats = FrameStats {
            frame: self.frames + 1,
            frame_ms,
            outcome: match (is_new, allowance.spent_units(), converged) {
                (false, 0, _) if drawing_ms.is_none() => Outcome::Unchanged,
                (_, _, true) => Outcome::Complete,
                (true, 0, false) => Outcome::BaseOnly,
                (_, _, false) => Outcome::Refined,
            },
            converged,
            triangles: self.world.triangles.len() as u64,
            work_units: allowance.spent_units(),
            pixels_written,
            stage_ms: stages,
            ..FrameStats::empty(budget)
        };
        self.base.report(&mut stats);
        self.refinement.report(self.method, &mut stats);
        if self.method == Method::PhongTiles {
            self.tiles.report(&mut stats);
        }
        if is_seen {
            stats.skipped.visibility_pixels = stats.covered_pixels;
        }
        let pixels = u64::from(target.width()) * u64::from(target.height());
        stats.skipped.pixels_unchanged = pixels.saturating_sub(pixels_written);
        self.frames += 1;
        stats
    }

    /// Whether the image of the view last seen is final, once it is lit.
    fn has_converged(&self) -> bool {
        if self.method == Method::PhongTiles {
            return self.tiles.is_finished();
        }
        !self.method.is_progressive()
            || (self.refinement.is_finished()
                && (!self.refines_first() || self.refine_first.is_up_to_date(&self.refinement)))
    }

    /// How the image lit last is shaded by now, as far as whole triangles are concerned.
    pub(super) fn shown_method(&self) -> Method {
        match self.method {
            Method::PhongTiles if self.tiles.is_finished() => Method::Phong,
            method => method,
        }
    }

    /// Whether a frame has enough to do to share it among threads. Not so where nothing has changed and nothing is left to be
    /// refined or handed over, nor where a single image is drawn sooner than threads can be woken.
    pub(super) fn needs_threads(&self, scene: &Scene, target: &Target<'_>) -> bool {
        let lights = scene.lights().len();
        let pixels = target.width() as f32 * target.height() as f32;
        let triangles = scene.triangle_count() as f32;
        let nominal_ns = cost::first_image(triangles, pixels)
            + match self.method {
                Method::Phong => cost::phong(pixels, lights),
                _ => cost::vertices(triangles, lights),
            };
        if !self.method.is_progressive() && nominal_ns < LEAST_NS_TO_SHARE {
            return false;
        }
        let is_settled = self.placement.is_up_to_date(scene)
            && self.is_lit
            && self.seen == Some(self.view(scene, target))
            && self.has_converged()
            && self.backend.pending_pixels(target) == 0;
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
    fn adopt(&mut self, exec: Exec, scene: &Scene) {
        let changes = self.placement.update(exec, &mut self.world, scene);
        match changes.geometry {
            GeometryChange::None => {}
            GeometryChange::Moved => {
                self.base.refit(&self.world);
                self.seen = None;
            }
            GeometryChange::Replaced => {
                self.base = BaseImage::new(&self.world);
                self.seen = None;
            }
        }
        if changes.shading || changes.background {
            self.is_lit = false;
        }
    }

    /// Finds out who owns which pixel of a view.
    fn look(
        &mut self,
        exec: Exec,
        view: &View,
        allowance: &Allowance<'_>,
        stages: &mut StageTimes,
    ) {
        let since = allowance.elapsed_ms();
        // Which clusters can be seen at all?
        self.base.cull(view);
        let culled = allowance.elapsed_ms();
        stages.cull += culled - since;

        self.base
            .rasterize(exec, &self.world, view, &mut *self.backend);
        stages.raster += allowance.elapsed_ms() - culled;
        self.seen = Some(*view);
        self.is_lit = false;
    }

    /// Gives the first image of a view its colours, and makes the list of what could be refined.
    fn light(
        &mut self,
        exec: Exec,
        view: &View,
        allowance: &Allowance<'_>,
        stages: &mut StageTimes,
    ) {
        let refines_first = self.refines_first();
        let backend = &mut *self.backend;
        let mut since = allowance.elapsed_ms();
        let mut lap = |stage: &mut f64| {
            let now = allowance.elapsed_ms();
            *stage += now - since;
            since = now;
        };

        // Only vertices of triangles that own a pixel are illuminated.
        self.base
            .shade(exec, self.method, &self.world, view, backend);
        lap(&mut stages.shade);

        // On a backend that cannot repaint, refinement comes first.
        if refines_first {
            self.refine_first.begin();
        } else {
            self.base
                .resolve(exec, self.method, &self.world, view, backend);
        }
        lap(&mut stages.resolve);

        // Which triangles can hold a highlight, and what is worth refining?
        if self.method.refines_triangles() {
            self.base.classify(exec, &self.world, view, backend);
            self.refinement.collect_candidates(
                exec,
                self.method,
                &self.world,
                view,
                &self.base,
                backend,
            );
        } else {
            self.refinement.clear();
        }
        if self.method == Method::PhongTiles {
            self.tiles.begin(&super::refinement::Stage {
                exec,
                world: &self.world,
                view,
                base: &self.base,
                backend,
            });
        }
        lap(&mut stages.classify);

        self.is_lit = true;
    }

    /// Whether everything is drawn once, after refinement.
    fn refines_first(&self) -> bool {
        self.method.is_progressive() && !self.backend.capabilities().refines_in_place()
    }

    /// Spends what is left of the budget, less what handing the image over will take. Returns the milliseconds that drawing
    /// took, where that comes after refinement and was done.
    fn refine(
        &mut self,
        exec: Exec,
        view: &View,
        allowance: &mut Allowance<'_>,
        target: &Target<'_>,
    ) -> Option<f64> {
        let refines_first = self.refines_first();
        let mut stage = super::refinement::Stage {
            exec,
            world: &self.world,
            view,
            base: &self.base,
            backend: &mut *self.backend,
        };
        if refines_first {
            let pixels = u64::from(view.width) * u64::from(view.height);
            let presenting_ms = self.presenting.predict_ms(pixels) + MARGIN_MS;
            return self.refine_first.frame(
                &mut self.refinement,
                &mut stage,
                allowance,
                presenting_ms,
            );
        }
        loop {
            let pending = stage.backend.pending_pixels(target);
            allowance.reserve_ms(self.presenting.predict_ms(pending) + MARGIN_MS);
            let has_gone_on = match self.method {
                Method::PhongTiles => self.tiles.step(&mut stage, allowance),
                _ => self.refinement.step(&mut stage, allowance),
            };
            if !has_gone_on {
                return None;
            }
        }
    }
}
