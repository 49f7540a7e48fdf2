//! An image in the making: who owns which pixel, colours, and what refinement has come to.
//!
//! The **base pass** draws the first image. Its stages follow each other, and all but the last may be interrupted and gone
//! on with in a later frame, as long as the world stays as it is:
//!
//! | [`Pass`] | what comes next | may be interrupted |
//! |---|---|---|
//! | `Empty` | cull clusters, then rasterize | no |
//! | `Rasterizing` | find the owner of every pixel | yes |
//! | `Lighting` | illuminate the vertices of triangles that own a pixel | yes |
//! | `Colouring` | [compose](composing) the image, then give every pixel its colour | yes |
//! | `Coloured` | show it | |
//! | `Done` | refine it | yes |
//!
//! Colours of the image before stay until `Colouring` begins, so it can be handed over until then. Where it is the image shown, colouring is
//! not interrupted, lest a part of either is shown.

mod composing;
mod refining;

pub(super) use composing::Composition;
pub(super) use refining::Easel;

use super::Method;
use super::base::BaseImage;
use super::baseline::Baseline;
use super::load::{self, ImageLoad, MARGIN_MS};
use super::motion::Motion;
use super::refine_first::RefineFirst;
use super::refinement::Refinement;
use super::stats::{FrameStats, StageTimes};
use super::tiles::Tiles;
use crate::backend::Backend;
use crate::output::Target;
use crate::parallel::{Exec, GoOn, Turn};
use crate::refine::paper::PaperRule;
use crate::scene::{View, World};
use crate::schedule::{Allowance, CostModel, Kind, Load};
use crate::visibility::Culler;
use std::ops::Range;

/// How far the base pass has come; see the [module](self).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Pass {
    Empty,
    Rasterizing,
    Lighting,
    Colouring,
    Coloured,
    Done,
}

/// An image and everything that is known about it.
#[derive(Debug)]
pub(super) struct Picture {
    pub(super) backend: Box<dyn Backend>,
    pub(super) base: BaseImage,
    pub(super) refinement: Refinement,
    /// For a backend that cannot repaint.
    pub(super) refine_first: RefineFirst,
    /// For [`Method::PhongTiles`].
    tiles: Tiles,
    /// For the paper's methods.
    pub(super) baseline: Baseline,
    /// What it shows, or will when it is done.
    view: Option<View>,
    /// One pixel stands for `divisor` by `divisor` pixels of the target.
    pub(super) divisor: u32,
    pass: Pass,
    /// Whether its first image has been begun, and neither completed nor given up.
    is_begun: bool,
    /// What of the image before may be kept.
    motion: Motion,
    /// How its first image is composed.
    composition: Composition,
    /// Whether that was under a deadline.
    is_composed_in_time: bool,
    /// Whether some triangles of the image published last got other colours than interpolated ones.
    is_mixed: bool,
    /// Whether refinement has begun with its first image before that is complete.
    is_planned: bool,
    /// Whether the stage in hand is yet to be begun.
    is_fresh: bool,
    /// What the stage in hand has taken in earlier frames, and in this one so far.
    stage_ms: f64,
    /// The last frame whose scene and camera the image is of; `None` before it is begun.
    right_in: Option<u64>,
}

/// What drawing needs besides the picture itself.
#[derive(Debug)]
pub(super) struct Studio<'a> {
    pub(super) exec: Exec,
    pub(super) method: Method,
    pub(super) paper: PaperRule,
    pub(super) world: &'a World,
    pub(super) culler: &'a mut Culler,
    pub(super) costs: &'a mut CostModel,
    /// What the image probably consists of.
    pub(super) load: &'a mut ImageLoad,
    pub(super) stages: &'a mut StageTimes,
    /// What the stages that ended in this frame were predicted to take.
    pub(super) predicted: &'a mut StageTimes,
}

impl Picture {
    pub(super) fn new(backend: Box<dyn Backend>) -> Self {
        Self {
            backend,
            base: BaseImage::default(),
            refinement: Refinement::default(),
            refine_first: RefineFirst::default(),
            tiles: Tiles::default(),
            baseline: Baseline::default(),
            view: None,
            divisor: 1,
            pass: Pass::Empty,
            is_begun: false,
            motion: Motion::default(),
            composition: Composition::default(),
            is_composed_in_time: false,
            is_mixed: false,
            is_planned: false,
            is_fresh: true,
            stage_ms: 0.0,
            right_in: None,
        }
    }

    /// Makes it a picture of another world, of which nothing is known.
    pub(super) fn replace_world(&mut self) {
        self.base = BaseImage::default();
        self.refinement.forget();
        self.forget();
    }

    /// Forgets who owns which pixel.
    pub(super) fn forget(&mut self) {
        self.enter(Pass::Empty);
        self.is_begun = false;
        self.motion.forget();
        self.right_in = None;
    }

    /// Forgets who owns the pixels that objects which have moved touch. `moved` are their triangles, ascending.
    pub(super) fn move_objects(&mut self, moved: &[Range<u32>]) {
        self.enter(Pass::Empty);
        self.is_begun = false;
        self.motion.add(moved);
        self.right_in = None;
    }

    /// Forgets colours, as after lights have changed.
    pub(super) fn forget_colours(&mut self) {
        self.motion.has_its_light = false;
        self.is_begun = false;
        if self.pass > Pass::Lighting {
            self.enter(Pass::Lighting);
        }
        self.right_in = None;
    }

    /// Whether the first image of `view` is complete.
    pub(super) fn shows(&self, view: &View) -> bool {
        self.pass == Pass::Done && self.view.as_ref() == Some(view)
    }

    /// Whether the owners of pixels of `view` are known.
    pub(super) fn knows_owners(&self, view: &View) -> bool {
        self.pass >= Pass::Lighting && self.view.as_ref() == Some(view)
    }

    /// The view whose first image has been begun and not completed.
    pub(super) fn in_hand(&self) -> Option<View> {
        self.view.filter(|_| self.is_in_hand())
    }

    pub(super) fn is_in_hand(&self) -> bool {
        self.is_begun
    }

    /// The view of its image, once that has been published.
    pub(super) fn view(&self) -> Option<&View> {
        self.view.as_ref().filter(|_| self.pass == Pass::Done)
    }

    /// How far the first image has come.
    pub(super) fn pass(&self) -> Pass {
        self.pass
    }

    /// The size of its image in pixels.
    pub(super) fn size(&self) -> Option<[u32; 2]> {
        self.view.map(|view| [view.width, view.height])
    }

    /// Notes that its image is the one to be shown and refined from now on.
    pub(super) fn publish(&mut self) {
        self.is_begun = false;
        self.is_mixed = self.base.is_mixed();
        self.enter(Pass::Done);
    }

    /// Whether the image is final, once its first one is complete.
    pub(super) fn has_converged(&self, method: Method) -> bool {
        if method == Method::PhongTiles {
            return self.tiles.is_finished();
        }
        !method.is_progressive()
            || (self.refinement.is_finished()
                && (!self.refines_first(method)
                    || self.refine_first.is_up_to_date(&self.refinement)))
    }

    /// How it is shaded by now, as far as whole triangles are concerned.
    pub(super) fn shown_method(&self, method: Method) -> Method {
        match method {
            Method::PhongTiles if self.tiles.is_finished() => Method::Phong,
            Method::Adaptive if self.base.is_lit() => Method::Phong,
            method => method,
        }
    }

    /// Fills in what the image consists of, and how far it has come.
    pub(super) fn report(&self, method: Method, stats: &mut FrameStats) {
        self.base.report(stats);
        self.refinement.report(method, stats);
        if method == Method::PhongTiles {
            self.tiles.report(stats);
        }
        if method.is_of_the_paper() {
            self.baseline.report(stats);
        }
    }

    /// Fills in how far pixels of the image may be from per-pixel Phong shading, if it is one at full resolution.
    pub(super) fn certify(&self, method: Method, stats: &mut FrameStats) {
        if !self.backend.capabilities().refines_in_place() {
            return;
        }
        let covered = stats.covered_pixels;
        let known = match method {
            _ if covered == 0 => Some((0, 0)),
            Method::Phong => Some((1, 0)),
            Method::Adaptive | Method::PhongArea => self.refinement.certified(),
            Method::PhongTiles if self.tiles.is_finished() => Some((1, 0)),
            Method::PhongTiles => Some((u8::MAX, covered.saturating_sub(stats.phong_pixels))),
            _ => Some((u8::MAX, covered)),
        };
        if let Some((codes, unproved)) = known {
            stats.error_bound = Some(f64::from(codes) / 255.0);
            stats.unproved_share = Some(unproved as f64 / covered.max(1) as f64);
        }
    }

    /// Whether everything is drawn once, after refinement.
    pub(super) fn refines_first(&self, method: Method) -> bool {
        method.is_progressive() && !self.backend.capabilities().refines_in_place()
    }

    /// Begins the first image of a view, or goes on with it if it is in hand. `frame` is the number of the frame whose scene and
    /// camera these are, if it is the present one. What is known about the view already is not done again.
    pub(super) fn begin(&mut self, view: View, divisor: u32, frame: Option<u64>) {
        if self.view != Some(view) {
            self.forget();
            self.view = Some(view);
            self.divisor = divisor;
        }
        self.is_begun = true;
        self.right_in = frame.or(self.right_in);
    }

    /// The last frame whose scene and camera its first image is of, as far as it was in hand then.
    pub(super) fn right_in(&self) -> Option<u64> {
        self.right_in
    }

    /// Goes on with the first image until it lacks at most its colours: then true. False when time is up before.
    pub(super) fn prepare(&mut self, studio: &mut Studio<'_>, allowance: &Allowance<'_>) -> bool {
        let Some(view) = self.view else {
            return false;
        };
        while self.pass < Pass::Colouring {
            let (is_done, next) = match self.pass {
                Pass::Empty => (self.cull(studio, allowance, &view), Pass::Rasterizing),
                Pass::Rasterizing => (self.rasterize(studio, allowance, &view), Pass::Lighting),
                _ => (self.illuminate(studio, allowance, &view), Pass::Colouring),
            };
            if is_done {
                self.enter(next);
            }
            if !is_done || !allowance.goes_on() {
                return false;
            }
        }
        true
    }

    /// Milliseconds that handing the image over, once it has got its colours, will probably not exceed, and a margin. In spare time there
    /// is no target.
    pub(super) fn handing_over_ms(&self, studio: &Studio<'_>, target: Option<&Target<'_>>) -> f64 {
        let (Some(target), Some(view)) = (target, &self.view) else {
            return MARGIN_MS;
        };
        let pixels = if self.divisor == 1 {
            let geometry = self.base.geometry(studio.world, view);
            (self.backend).pending_after_resolve(studio.exec, geometry, target)
        } else {
            // Enlarged images are written as a whole.
            u64::from(target.width()) * u64::from(target.height())
        };
        load::pixels_ms(studio.costs, pixels, self.divisor) + MARGIN_MS
    }

    /// Gives the image its colours. False when time was up before, which is never if it is to be done `at_once`.
    pub(super) fn colour(
        &mut self,
        studio: &mut Studio<'_>,
        allowance: &Allowance<'_>,
        at_once: bool,
    ) -> bool {
        let Some(view) = self.view.filter(|_| self.pass == Pass::Colouring) else {
            return self.pass > Pass::Colouring;
        };
        let loads = studio.colouring_loads(&view, &self.composition);
        let since = allowance.elapsed_ms();
        // On a backend that cannot repaint, refinement comes first.
        let is_done = if self.refines_first(studio.method) {
            self.refine_first.begin();
            true
        } else {
            let go_on = || at_once || allowance.goes_on();
            let turn = self.turn(&go_on);
            self.base.resolve(
                studio.exec,
                studio.method,
                studio.world,
                &view,
                &mut *self.backend,
                self.motion.has_its_light,
                turn,
            )
        };
        let ms = allowance.elapsed_ms() - since;
        studio.stages.resolve += ms;
        self.stage_ms += ms;
        if !is_done {
            return false;
        }
        let predicted = loads.map(|(kind, load)| studio.costs.predict_ms(kind, load));
        studio.predicted.resolve += predicted.iter().sum::<f64>();
        if self.base.is_whole() || !self.motion.has_its_light {
            studio.costs.learn_both(loads, self.stage_ms);
        }
        self.motion.has_its_light = true;
        self.enter(Pass::Coloured);
        true
    }

    fn cull(&mut self, studio: &mut Studio<'_>, allowance: &Allowance<'_>, view: &View) -> bool {
        let since = allowance.elapsed_ms();
        self.base.cull(studio.culler, view);
        let ms = allowance.elapsed_ms() - since;
        studio.stages.cull += ms;
        self.stage_ms = ms;
        studio.predicted.cull += self.learn(studio.costs, Kind::Cull, studio.load.cull());
        studio.load.triangles = self.base.triangles_handed_over() as f64;
        true
    }

    fn rasterize(
        &mut self,
        studio: &mut Studio<'_>,
        allowance: &Allowance<'_>,
        view: &View,
    ) -> bool {
        let predicted = studio
            .costs
            .predict_ms(Kind::Raster, studio.load.raster(view));
        let since = allowance.elapsed_ms();
        let go_on = || allowance.goes_on();
        let turn = self.turn(&go_on);
        let is_done = self.base.rasterize(
            studio.exec,
            studio.world,
            view,
            &mut *self.backend,
            self.motion.moved(),
            turn,
        );
        let ms = allowance.elapsed_ms() - since;
        studio.stages.raster += ms;
        self.stage_ms += ms;
        if is_done {
            self.motion.begin();
            studio.load.visible = self.base.visible_triangles() as f64;
            let pixels = f64::from(view.width) * f64::from(view.height);
            studio.load.coverage = self.base.covered_pixels() as f64 / pixels.max(1.0);
            studio.predicted.raster += predicted;
            self.learn(studio.costs, Kind::Raster, studio.load.raster(view));
        }
        is_done
    }

    /// Illuminates the vertices of triangles that own a pixel, and no others.
    fn illuminate(
        &mut self,
        studio: &mut Studio<'_>,
        allowance: &Allowance<'_>,
        view: &View,
    ) -> bool {
        let load = studio.load.shade(studio.method, studio.world.lights.len());
        let since = allowance.elapsed_ms();
        let go_on = || allowance.goes_on();
        let turn = self.turn(&go_on);
        let is_done = self.base.shade(
            studio.exec,
            studio.method,
            studio.world,
            view,
            &*self.backend,
            turn,
        );
        let ms = allowance.elapsed_ms() - since;
        studio.stages.shade += ms;
        self.stage_ms += ms;
        if is_done {
            studio.predicted.shade += self.learn(studio.costs, Kind::Shade, load);
        }
        is_done
    }

    /// The next turn of the stage in hand.
    fn turn<'a>(&mut self, go_on: GoOn<'a>) -> Turn<'a> {
        Turn {
            is_first: std::mem::replace(&mut self.is_fresh, false),
            go_on,
        }
    }

    /// Learns from the stage that has ended, and returns what it had been predicted to take. What a whole image takes is not to be
    /// learned from one of which parts were kept.
    fn learn(&self, costs: &mut CostModel, kind: Kind, load: Load) -> f64 {
        let predicted = costs.predict_ms(kind, load);
        if kind != Kind::Raster || self.base.is_whole() {
            costs.learn(kind, load, self.stage_ms);
        }
        predicted
    }

    fn enter(&mut self, pass: Pass) {
        self.pass = pass;
        self.is_fresh = true;
        self.stage_ms = 0.0;
    }
}
