//! Frames on a backend that cannot repaint: refine first, then draw everything once.
//!
//! Refinement plans while the budget lasts, less what drawing and handing over will take by what they took so far. Then
//! everything is drawn, unless nothing has been refined since it was drawn last; so a still view that is good enough
//! costs nothing.
//!
//! The more is refined, the longer drawing takes, until no budget is left for refining. Then a still view stays as it
//! is: it has become as good as can be drawn within the budget, which is not final if the budget is small.

use super::refinement::{DrawnLeaves, Refinement, Stage};
use crate::backend::BasePaint;
use crate::schedule::{Allowance, LearnedRate, cost};

/// Drawings of less nominal time say more about overheads than about the rate.
const LEAST_NS_TO_LEARN_FROM: u64 = 100_000;

/// Drawing takes longer than predicted from what there is to draw now.
const GROWTH: f64 = 1.1;

/// What drawing has cost so far, and which state of refinement was drawn last.
#[derive(Debug)]
pub(super) struct RefineFirst {
    leaves: DrawnLeaves,
    /// Time per nominal nanosecond of drawing.
    drawing: LearnedRate,
    /// The state of refinement that the backend's image shows; `None` before the first drawing of a view.
    drawn: Option<u64>,
}

impl Default for RefineFirst {
    fn default() -> Self {
        Self {
            leaves: DrawnLeaves::default(),
            drawing: LearnedRate::new(1.0, LEAST_NS_TO_LEARN_FROM),
            drawn: None,
        }
    }
}

impl RefineFirst {
    /// Forgets that anything was drawn.
    pub(super) fn begin(&mut self) {
        self.drawn = None;
    }

    /// Whether the backend's image shows all that has been refined.
    pub(super) fn is_up_to_date(&self, refinement: &Refinement) -> bool {
        self.drawn == Some(refinement.commits())
    }

    /// Refines within the budget, then draws if that makes a difference. `presenting_ms` is what handing the image over
    /// will take. Returns the milliseconds that drawing took, if anything was drawn.
    pub(super) fn frame(
        &mut self,
        refinement: &mut Refinement,
        stage: &mut Stage<'_>,
        allowance: &mut Allowance<'_>,
        presenting_ms: f64,
    ) -> Option<f64> {
        while !refinement.satisfies(allowance) {
            allowance.reserve_ms(self.predict_ms(refinement) + presenting_ms);
            if !refinement.step(stage, allowance) {
                break;
            }
        }
        if self.is_up_to_date(refinement) {
            return None;
        }
        let since = allowance.elapsed_ms();
        self.draw(refinement, stage);
        let ms = allowance.elapsed_ms() - since;
        self.drawing.learn(nominal_ns(refinement), ms);
        Some(ms)
    }

    /// What drawing will take, the leaves that the next piece of planning adds included.
    fn predict_ms(&self, refinement: &Refinement) -> f64 {
        self.drawing.predict_ms(nominal_ns(refinement)) * GROWTH
    }

    fn draw(&mut self, refinement: &Refinement, stage: &mut Stage<'_>) {
        let paint = BasePaint::Refined {
            colours: stage.base.colours(),
            parts: self.leaves.list(refinement, stage),
        };
        let geometry = stage.base.geometry(stage.world, stage.view);
        stage.backend.resolve(stage.exec, geometry, paint);
        self.drawn = Some(refinement.commits());
    }
}

/// Nominal cost of drawing everything.
fn nominal_ns(refinement: &Refinement) -> u64 {
    let (triangles, pixels) = refinement.drawing_load();
    cost::drawing(triangles as f32, pixels as f32) as u64
}
