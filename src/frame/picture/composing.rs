//! Composing a first image: how each of its triangles gets its colours, decided when nothing but colours is missing.
//!
//! To shade a pixel while it gets its first colour takes a third of what it takes to paint it over afterwards (nominally 3 nanoseconds
//! against 8 under four lights), and to [curve](curves) a triangle less still. So what the budget leaves beside the first image is spent, as far as that can
//! be foretold, before it is drawn:
//!
//! 1. If there is time to **light** all of it, to evaluate the illumination equation at every pixel, that is done: the image is final.
//! 2. Else triangles are curved, as finely as their pixels pay for and the budget allows.
//! 3. Then triangles are lit, those first that look worst, as many as there is time for. (Not under very many lights, where evaluating those
//!    that matter is worth more; unless at least half of the image can be lit.)
//!
//! Only deadlines have images lit: under work units a first image costs nothing, and a final image depends on nothing that came before.
//! What time decided is part of the [record](crate::schedule::FrameRecord).

use super::{Pass, Picture, Studio};
use crate::frame::Method;
use crate::frame::curves::{self, Curves};
use crate::frame::refinement::{LitTriangles, MostLit, Stage, usual_lights};
use crate::scene::{View, World};
use crate::schedule::{Allowance, FrameRecord, Kind, Load, cost};

/// Time that is left over when an image has been composed, in milliseconds: whether there is enough of it to draw the image is asked once
/// more.
const SLACK_MS: f64 = 0.02;

/// Triangles are lit if that costs at most so many times as much as to evaluate those lights that matter, as a rule, later on.
const MOST_LIT_COST: f32 = 1.5;

/// Or if at least this share of the image can be.
const LARGE_SHARE: f64 = 0.5;

/// How a first image is composed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::frame) struct Composition {
    curves: Curves,
    lit: LitTriangles,
}

impl Composition {
    /// Books it, once its image is complete: what else a frame begins, the next one may do again.
    pub(in crate::frame) fn book(&self, allowance: &mut Allowance<'_>, lights: usize) {
        self.curves.book(allowance);
        allowance.spend(self.lit_ns(lights) as u64);
        allowance.note_lit(self.lit.triangles);
    }

    /// Whether all of it is interpolated between vertices.
    pub(in crate::frame) fn is_plain(&self) -> bool {
        *self == Self::default()
    }

    fn lit_ns(&self, lights: usize) -> f64 {
        self.lit.pixels as f64 * f64::from(cost::lit_pixel(lights))
    }
}

impl Studio<'_> {
    /// Milliseconds that giving the image of `view` its colours will probably not exceed.
    pub(in crate::frame) fn colouring_ms(&self, view: &View, composition: &Composition) -> f64 {
        let loads = self.colouring_loads(view, composition);
        let ms = loads.map(|(kind, load)| self.costs.predict_at_most_ms(kind, load));
        ms.iter().sum()
    }

    /// What giving the image its colours takes: interpolation, and lighting.
    pub(super) fn colouring_loads(
        &self,
        view: &View,
        composition: &Composition,
    ) -> [(Kind, Load); 2] {
        let lights = self.world.lights.len();
        let mut load = self.load.resolve(self.method, lights, view);
        load.pixels_ns += composition.curves.load.pixels_ns;
        let lit = Load::of_pixels(composition.lit_ns(lights));
        [(Kind::Resolve, load), (Kind::Light, lit)]
    }
}

impl Picture {
    /// Composes the image, if it lacks only its colours, so that there will be time to give it those and to hand it over, which takes
    /// `handing_over_ms`. `is_asked_for` says that it is of the scene and the camera as they are.
    pub(in crate::frame) fn compose(
        &mut self,
        studio: &mut Studio<'_>,
        allowance: &Allowance<'_>,
        handing_over_ms: f64,
        is_asked_for: bool,
    ) {
        // Under a budget of another kind it is composed in another way, and so it is in a replay of this frame.
        let depends_on_it = self.is_planned || !self.composition.is_plain();
        let is_stale = depends_on_it && self.is_composed_in_time != allowance.is_timed();
        if is_stale && (self.pass == Pass::Coloured || self.pass == Pass::Colouring) {
            self.enter(Pass::Colouring);
        }
        let is_due = self.pass == Pass::Colouring && self.is_fresh;
        let Some(view) = self.view.filter(|_| is_due) else {
            return;
        };
        self.is_composed_in_time = allowance.is_timed();
        // In a replay it may have been asked for in a frame before, in which it was begun.
        let may_be_lit = is_asked_for || allowance.replayed_lit().is_some();
        self.decompose(studio.world);
        if studio.method != Method::Adaptive
            || self.divisor != 1
            || !self.backend.capabilities().refines_in_place()
        {
            return;
        }
        let mut timing = Timing {
            handing_over_ms,
            allowance,
            now_ms: allowance.elapsed_ms(),
        };
        if timing.is_over() || may_be_lit && self.light_everything(studio, &view, &timing) {
            return;
        }
        // Tiles can be kept of an image that is interpolated as a whole, or lit as a whole, when this one is, too.
        if self.motion.has_its_light && !self.is_mixed {
            return;
        }
        let may_be_lit_only = may_be_lit
            && timing.pixels_to_spare(studio, &view, &Composition::default(), 0.0)
                >= LARGE_SHARE * self.base.covered_pixels() as f64;
        self.curve(studio, &view, &mut timing, may_be_lit_only);
        if may_be_lit {
            self.light_some(studio, &view, &mut timing);
        }
    }

    /// Has all of the image interpolated between vertices.
    pub(in crate::frame) fn decompose(&mut self, world: &World) {
        self.base.unmix(world.triangles.len());
        self.composition = Composition::default();
        self.is_planned = false;
    }

    /// How the image is composed.
    pub(in crate::frame) fn composition(&self) -> Composition {
        self.composition
    }

    /// Has all pixels lit, if there is time. Whether there is.
    fn light_everything(
        &mut self,
        studio: &mut Studio<'_>,
        view: &View,
        timing: &Timing<'_>,
    ) -> bool {
        let lit = Composition {
            lit: LitTriangles {
                triangles: FrameRecord::EVERYTHING,
                pixels: self.base.covered_pixels(),
            },
            ..Composition::default()
        };
        let is_chosen = match timing.allowance.replayed_lit() {
            Some(triangles) => triangles == FrameRecord::EVERYTHING,
            None => timing.ms_to_spare(studio, view, &lit) >= 0.0,
        };
        if is_chosen {
            self.base.light_everything();
            self.composition = lit;
            self.refinement.begin_final(studio.world, &self.base);
            self.is_planned = true;
        }
        is_chosen
    }

    /// Divides large triangles, as far as there is time. What is for the most part of smaller ones, and may be lit for the most part, is lit
    /// only.
    fn curve(
        &mut self,
        studio: &mut Studio<'_>,
        view: &View,
        timing: &mut Timing<'_>,
        may_be_lit_only: bool,
    ) {
        let ending_ms = timing.ending_ms(studio, view, &Composition::default());
        let curves = curves::curve(
            &mut self.base,
            studio.exec,
            studio.world,
            view,
            &*self.backend,
            studio.costs,
            timing.allowance,
            ending_ms,
            may_be_lit_only,
        );
        let ms = timing.look();
        let load = Load::of_items(curves.load.nodes_ns);
        studio.stages.refine += ms;
        studio.predicted.refine += studio.costs.predict_ms(Kind::Curve, load);
        studio.costs.learn(Kind::Curve, load, ms);
        self.composition.curves = curves;
    }

    /// Has triangles lit, those first that look worst, as many as there is time for. To know which those are, all of them have to
    /// become candidates for refinement, as they would afterwards.
    fn light_some(&mut self, studio: &mut Studio<'_>, view: &View, timing: &mut Timing<'_>) {
        let lights = studio.world.lights.len();
        let allowance = timing.allowance;
        let collecting = Load::of_items(self.refinement.collecting_ns(&*self.backend, lights));
        let collecting_ms = studio.costs.predict_at_most_ms(Kind::Collect, collecting);
        let is_worth_it = match allowance.replayed_lit() {
            Some(triangles) => triangles > 0,
            None => {
                let pixels = timing.pixels_to_spare(studio, view, &self.composition, collecting_ms);
                let later = cost::phong_pixel(usual_lights(lights));
                pixels >= 1.0
                    && (cost::lit_pixel(lights) <= MOST_LIT_COST * later
                        || pixels >= LARGE_SHARE * self.base.covered_pixels() as f64)
            }
        };
        if !is_worth_it {
            return;
        }
        self.refinement.set_remembering(allowance.is_timed());
        let (exec, method, world) = (studio.exec, studio.method, studio.world);
        self.refinement
            .begin(exec, method, world, view, &self.base, &*self.backend);
        self.is_planned = true;
        self.refinement.collect_everything(&Stage {
            exec,
            world,
            view,
            base: &self.base,
            backend: &mut *self.backend,
        });
        let ms = timing.look();
        studio.stages.classify += ms;
        studio.predicted.classify += studio.costs.predict_ms(Kind::Collect, collecting);
        studio.costs.learn(Kind::Collect, collecting, ms);
        let most = match allowance.replayed_lit() {
            Some(triangles) => MostLit::Triangles(triangles),
            None => {
                let pixels = timing.pixels_to_spare(studio, view, &self.composition, 0.0);
                MostLit::Pixels(pixels as u64)
            }
        };
        self.composition.lit = self.refinement.light(world, most, self.base.lit_mut());
    }
}

/// What decides how much can be done before an image gets its colours.
struct Timing<'a> {
    handing_over_ms: f64,
    allowance: &'a Allowance<'a>,
    /// When the clock was looked at last, in milliseconds since the frame's start.
    now_ms: f64,
}

impl Timing<'_> {
    /// Looks at the clock, and returns the milliseconds since it was looked at last.
    fn look(&mut self) -> f64 {
        let since = std::mem::replace(&mut self.now_ms, self.allowance.elapsed_ms());
        self.now_ms - since
    }

    /// Milliseconds that are left of the budget; infinitely less than any without a deadline.
    fn left_ms(&self) -> f64 {
        let deadline_ms = self.allowance.deadline_ms();
        deadline_ms.map_or(f64::NEG_INFINITY, |ms| ms - self.now_ms)
    }

    /// Whether the frame has been cancelled, or there is a deadline, and it has come.
    fn is_over(&self) -> bool {
        let has_deadline = self.allowance.deadline_ms().is_some();
        self.allowance.is_cancelled() || has_deadline && self.left_ms() <= 0.0
    }

    /// Milliseconds to be reckoned with for giving the image its colours and handing it over.
    fn ending_ms(&self, studio: &Studio<'_>, view: &View, composition: &Composition) -> f64 {
        let colouring_ms = studio.colouring_ms(view, composition);
        let slowness = studio.stages.slowness(studio.predicted);
        (colouring_ms + self.handing_over_ms) * slowness + SLACK_MS
    }

    /// Milliseconds of the budget that are left when that has been done; without a deadline there is no time to spare.
    fn ms_to_spare(&self, studio: &Studio<'_>, view: &View, composition: &Composition) -> f64 {
        self.left_ms() - self.ending_ms(studio, view, composition)
    }

    /// How many pixels can be lit beside that, and beside something that takes `other_ms`.
    fn pixels_to_spare(
        &self,
        studio: &Studio<'_>,
        view: &View,
        composition: &Composition,
        other_ms: f64,
    ) -> f64 {
        let spare_ms = self.ms_to_spare(studio, view, composition) - other_ms;
        let each = Load::of_pixels(f64::from(cost::lit_pixel(studio.world.lights.len())));
        let each_ms = studio.costs.predict_at_most_ms(Kind::Light, each)
            * studio.stages.slowness(studio.predicted);
        // Rates are positive; without a deadline there is no time to spare.
        (spare_ms / each_ms).max(0.0)
    }
}
