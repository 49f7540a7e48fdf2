//! Refinement of a picture: steps of it while the budget lasts.

use super::{Picture, Studio};
use crate::frame::Method;
use crate::frame::baseline::Canvas;
use crate::frame::load;
use crate::frame::refinement::Stage;
use crate::frame::stats::StageTimes;
use crate::output::Target;
use crate::parallel::Exec;
use crate::scene::{View, World};
use crate::schedule::{Allowance, CostModel, Kind, Load};

/// What refining needs besides the picture itself.
pub(in crate::frame) struct Easel<'a, 'b> {
    pub(in crate::frame) exec: Exec,
    pub(in crate::frame) method: Method,
    pub(in crate::frame) world: &'a World,
    pub(in crate::frame) costs: &'a mut CostModel,
    pub(in crate::frame) stages: &'a mut StageTimes,
    /// What was done in this frame was predicted to take.
    pub(in crate::frame) predicted: &'a mut StageTimes,
    /// Where the image will go; nowhere in spare time.
    pub(in crate::frame) target: Option<&'a Target<'b>>,
}

impl Easel<'_, '_> {
    /// Books a step of refinement that took `ms` milliseconds.
    fn book(&mut self, kind: Kind, load: Load, ms: f64) {
        let (spent, predicted) = match kind {
            Kind::Collect => (&mut self.stages.classify, &mut self.predicted.classify),
            _ => (&mut self.stages.refine, &mut self.predicted.refine),
        };
        *spent += ms;
        *predicted += self.costs.predict_ms(kind, load);
        self.costs.learn(kind, load, ms);
    }
}

impl Picture {
    /// Refines the image while the budget lasts, less what handing it over will take. Returns the milliseconds that
    /// drawing took, where that comes after refinement and was done.
    pub(in crate::frame) fn refine(
        &mut self,
        easel: &mut Easel<'_, '_>,
        allowance: &mut Allowance<'_>,
    ) -> Option<f64> {
        let view = *self.view()?;
        let refines_first = self.refines_first(easel.method);
        let mut stage = Stage {
            exec: easel.exec,
            world: easel.world,
            view: &view,
            base: &self.base,
            backend: &mut *self.backend,
        };
        let refinement = &mut self.refinement;
        if refines_first {
            let presenting_ms =
                load::pending_ms(easel.costs, stage.backend, self.divisor, easel.target, true);
            let since = allowance.elapsed_ms();
            let drawing_ms =
                self.refine_first
                    .frame(refinement, &mut stage, allowance, presenting_ms);
            let drawing = drawing_ms.unwrap_or(0.0);
            easel.stages.refine += allowance.elapsed_ms() - since - drawing;
            easel.stages.resolve += drawing;
            return drawing_ms;
        }
        let mut since = allowance.elapsed_ms();
        let has_frame_to_itself = allowance.record().images == 0;
        // The error of squares is not estimated.
        while easel.method == Method::PhongTiles || !refinement.satisfies(allowance) {
            let presenting_ms = load::pending_ms(
                easel.costs,
                stage.backend,
                self.divisor,
                easel.target,
                false,
            );
            let slowness = easel.stages.slowness(easel.predicted);
            allowance.reserve_ms(presenting_ms * slowness);
            let kind = match easel.method {
                Method::PhongTiles => Kind::Paint,
                _ => refinement.next_kind(),
            };
            let ms_per_unit = easel.costs.predict_at_most_ms(kind, Load::of_items(1.0));
            allowance.set_ms_per_unit(ms_per_unit);
            let done_ns = allowance.nominal_ns();
            let is_done = match easel.method {
                Method::PhongTiles => self.tiles.step(&mut stage, allowance),
                _ => refinement.step(&mut stage, allowance),
            };
            let load = Load::of_items((allowance.nominal_ns() - done_ns) as f64);
            let now = allowance.elapsed_ms();
            easel.book(kind, load, now - since);
            since = now;
            if !is_done {
                let is_finished = match easel.method {
                    Method::PhongTiles => self.tiles.is_finished(),
                    _ => refinement.is_finished(),
                };
                let is_idle = has_frame_to_itself && allowance.nominal_ns() == 0;
                if is_idle && !is_finished && allowance.is_before_deadline() {
                    easel.costs.doubt(kind);
                }
                break;
            }
        }
        None
    }

    /// Begins the refinement of a first image that has got its colours.
    pub(in crate::frame) fn begin_refinement(
        &mut self,
        studio: &mut Studio<'_>,
        allowance: &Allowance<'_>,
    ) {
        let Some(view) = self.view else {
            return;
        };
        if studio.method.is_of_the_paper() {
            self.refinement.clear();
            return self.draw_baseline(studio, allowance, &view);
        }
        // It may have begun when the image was composed.
        if std::mem::take(&mut self.is_planned) {
            return self.refinement.note_image();
        }
        let since = allowance.elapsed_ms();
        if studio.method == Method::PhongTiles {
            self.tiles.begin(&view, &*self.backend);
        }
        if studio.method.refines_triangles() {
            self.refinement.set_remembering(allowance.is_timed());
            let (exec, method, world) = (studio.exec, studio.method, studio.world);
            self.refinement
                .begin(exec, method, world, &view, &self.base, &*self.backend);
        } else {
            self.refinement.clear();
        }
        self.refinement.note_image();
        studio.stages.classify += allowance.elapsed_ms() - since;
    }

    /// Does what the paper's methods do after Gouraud shading.
    fn draw_baseline(&mut self, studio: &mut Studio<'_>, allowance: &Allowance<'_>, view: &View) {
        let begin_ms = allowance.elapsed_ms();
        let mut canvas = Canvas {
            exec: studio.exec,
            world: studio.world,
            view,
            base: &self.base,
            backend: &mut *self.backend,
        };
        self.baseline
            .classify(studio.method, &studio.paper, &canvas);
        let classified_ms = allowance.elapsed_ms();
        self.baseline
            .draw(studio.method, &studio.paper, &mut canvas);
        studio.stages.classify += classified_ms - begin_ms;
        studio.stages.refine += allowance.elapsed_ms() - classified_ms;
    }
}
