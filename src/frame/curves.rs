//! Whether, and how finely, large triangles are [divided](crate::refine::Curving) before the first image gets its colours.
//!
//! It is refinement that costs a fraction of what it costs later, as no pixel is coloured twice. But it delays the first image: so only as much is done
//! as the budget surely leaves beside that image. It goes in rounds, each dividing twice as finely, and only what that is worth it for;
//! what a round costs at most is known before it begins. Under a budget of work units, what
//! it came to is booked like other refinement; how many rounds there were is part of the [record](crate::schedule::FrameRecord).

use super::base::BaseImage;
use super::refinement::usual_lights;
use crate::backend::Backend;
use crate::geometry::curved::{MOST_DIVISIONS, node_count, part_count};
use crate::parallel::Exec;
use crate::refine::{CurvingCounts, CurvingRule};
use crate::scene::{View, World};
use crate::schedule::{Allowance, CostModel, Kind, Load, cost};

/// Numbers of divisions.
const DIVISIONS: [u32; 4] = [1, 2, 4, MOST_DIVISIONS];

/// A triangle is divided if that costs at most this share of what it would cost to shade its pixels.
const SHARE: f32 = 0.7;

/// Nominal nanoseconds that curving saves at a pixel, at least: a guard against division by none.
const LEAST_SAVED_NS: f32 = 0.1;

/// Images with fewer pixels to a visible triangle than this share of the least that is divided are not looked through.
const LOOK_FROM: f32 = 0.25;

/// What has been curved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Curves {
    pub(super) load: CurvedLoad,
    /// Rounds of division, and whether the last of them was taken back.
    rounds: u32,
    taken_back: bool,
}

impl Curves {
    /// Books it, once its image is complete: what else a frame begins, the next one may do again.
    pub(super) fn book(&self, allowance: &mut Allowance<'_>) {
        allowance.spend(self.load.units());
        allowance.note_rounds(self.rounds, self.taken_back);
    }
}

/// What that takes, in nominal nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct CurvedLoad {
    /// Illuminating nodes and finding quadratics.
    pub(super) nodes_ns: f64,
    /// What the pixels of curved triangles take beyond those of others.
    pub(super) pixels_ns: f64,
}

impl CurvedLoad {
    fn of(counts: &CurvingCounts, lights: usize) -> Self {
        let [triangles, nodes, parts] =
            [counts.triangles, counts.nodes, counts.parts].map(|n| n as f32);
        let pixels = [(1, counts.curved_pixels), (2, counts.parted_pixels)];
        let pixels = pixels.map(|(n, pixels)| pixels as f64 * f64::from(cost::curved_pixel(n)));
        Self {
            nodes_ns: f64::from(cost::curved(triangles, nodes, parts, lights)),
            pixels_ns: pixels[0] + pixels[1],
        }
    }

    fn units(&self) -> u64 {
        (self.nodes_ns + self.pixels_ns) as u64
    }
}

/// What curved pixels will probably not exceed.
fn colouring_ms(costs: &CostModel, load: CurvedLoad) -> f64 {
    costs.predict_at_most_ms(Kind::Resolve, Load::of_pixels(load.pixels_ns))
}

/// Nominal cost of curving a triangle, its pixels aside.
fn triangle_ns(n: u32, lights: usize) -> f32 {
    let levels = DIVISIONS.into_iter().filter(|&level| level <= n);
    let nodes: usize = levels.map(node_count).sum();
    cost::curved(1.0, nodes as f32, part_count(n) as f32, lights)
}

/// Which triangles may be divided by how much: as much as their pixels pay for, which would be shaded later else; or under a deadline, at
/// once.
fn rule(lights: usize, is_timed: bool) -> CurvingRule {
    let later = SHARE * cost::phong_pixel(usual_lights(lights));
    let at_once = SHARE * cost::lit_pixel(lights);
    CurvingRule(DIVISIONS.map(|n| {
        let saved = match at_once - cost::curved_pixel(n) {
            saved if is_timed && saved < later => saved.max(LEAST_SAVED_NS),
            _ => later,
        };
        (triangle_ns(n, lights) / saved).ceil() as u32
    }))
}

/// Curves what the budget allows, `ending_ms` being what the first image and handing it over will take from then on. If `only_large_ones`, nothing
/// unless at least half of the image consists of triangles that can be divided most finely.
#[expect(
    clippy::too_many_arguments,
    reason = "what is curved, and under which budget"
)]
pub(super) fn curve(
    base: &mut BaseImage,
    exec: Exec,
    world: &World,
    view: &View,
    backend: &dyn Backend,
    costs: &CostModel,
    allowance: &Allowance<'_>,
    ending_ms: f64,
    only_large_ones: bool,
) -> Curves {
    let lights = world.lights.len();
    let rule = rule(lights, allowance.is_timed());
    let least = LOOK_FROM * rule.0[0] as f32 * backend.visible_triangles().len() as f32;
    if (base.covered_pixels() as f32) < least {
        return Curves::default();
    }
    base.begin_curving(backend, rule);
    if only_large_ones && base.curving().finest_pixels() * 2 < base.covered_pixels() {
        return Curves::default();
    }
    let replayed = allowance.replayed_rounds();
    let mut done = CurvedLoad::default();
    let mut rounds = 0;
    let mut taken_back = false;
    for n in DIVISIONS {
        let next = CurvedLoad::of(&base.curving().with_round(n), lights);
        if next == done {
            break;
        }
        let may_begin = match replayed {
            Some((recorded, _)) => rounds < recorded,
            None => {
                let nodes = Load::of_items(next.nodes_ns - done.nodes_ns);
                let ms = costs.predict_at_most_ms(Kind::Curve, nodes) + colouring_ms(costs, next);
                allowance.affords(next.units(), ms + ending_ms)
            }
        };
        if !may_begin {
            break;
        }
        let curving = base.curving_mut();
        curving.round(exec, world, view, n);
        rounds += 1;
        done = CurvedLoad::of(&curving.counts(), lights);
        // More pixels than expected may have turned out to be worth it.
        taken_back = match replayed {
            Some((recorded, taken_back)) => taken_back && rounds == recorded,
            None => !allowance.affords(done.units(), colouring_ms(costs, done) + ending_ms),
        };
        if taken_back {
            curving.retreat(n / 2);
            done = CurvedLoad::of(&curving.counts(), lights);
            break;
        }
    }
    if rounds == 0 {
        return Curves::default();
    }
    base.finish_curving(exec, world, backend);
    Curves {
        load: done,
        rounds,
        taken_back,
    }
}
