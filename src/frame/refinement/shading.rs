//! Shading pixels of a root by the illumination equation: which terms, what instead of the others, and in how many steps.
//!
//! What the root's [bounds](highlight::light_masks) prove to be linear enough is interpolated between its corners. Of the rest most is smooth: it
//! is the **rough** terms, highlights and the diffuse light of lights that set on the triangle, that nothing simple follows. So
//! shading comes in two steps where the first one is much cheaper and the error worth it:
//!
//! 1. Rough terms are evaluated at every pixel. All others together are a [`Quadratic`] through their values at the corners
//!    and the middles of the edges; a few more points tell how wrong it is. A highlight of one light out of a hundred costs one
//!    light, and what is left is of third order in the triangle's size.
//! 2. Later, when nothing is worth more, the pixels are **polished**: all terms are evaluated that are not proved to be linear.
//!
//! Where the bounds would cost more than they can save, all terms are evaluated at once.

use super::certificate::RIGHT;
use super::parts::SAMPLE_WEIGHTS;
use super::{
    Candidate, NONE, Owner, PROVED, Paint, Progress, Refinement, Root, Stage, ranking, runs,
};
use crate::backend::{Fill, Patch};
use crate::geometry::bary::{blend, middles};
use crate::geometry::{Bary, Quadratic};
use crate::highlight::{self, Claim, TriangleLights, Verdict};
use crate::illumination::{ActiveLights, ShadingKit, shade_few};
use crate::refine::LeafId;
use crate::refine::estimate::squared_codes;
use crate::schedule::cost;
use std::ops::Range;

/// Pixels with a mean squared error below this, in squared codes, are shaded in a single step.
const ERROR_FOR_STEPS: f64 = 0.25;

/// The first step is left out unless the second costs so many times as much.
const STEPS_FROM: f32 = 1.2;

/// Where the quadratic is found: corners, middles of edges, and the points where it is tested.
const POINTS: usize = 6 + SAMPLE_WEIGHTS.len();

/// Which terms have to be evaluated at the pixels of a root.
#[expect(
    clippy::large_enum_variant,
    reason = "most roots that anything is known of are shaded"
)]
#[derive(Clone, Copy, Debug)]
pub(super) enum Shading {
    /// None: interpolation is proved to be right.
    Proved,
    /// Some.
    PerPixel(PixelShading),
}

/// How the pixels of a root are shaded.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelShading {
    /// All terms that need evaluation.
    exact: ActiveLights,
    /// The others, at the corners.
    linear: [[f32; 3]; 3],
    /// The first step, if it is worth one.
    first: Option<FirstStep>,
}

/// The rough terms at every pixel, and the others as a quadratic.
#[derive(Clone, Copy, Debug)]
struct FirstStep {
    rough: ActiveLights,
    rest: Quadratic,
    /// Mean squared error that it leaves, in squared codes.
    error: f32,
}

impl PixelShading {
    /// Everything of the first so many lights at once.
    fn all(lights: usize) -> Self {
        Self {
            exact: ActiveLights::all(lights),
            linear: [[0.0; 3]; 3],
            first: None,
        }
    }

    /// How many lights the first step evaluates.
    pub(super) fn lights(&self) -> usize {
        self.first
            .map_or(self.exact, |first| first.rough)
            .diffuse
            .len()
    }
}

/// What is known of a root that is shaded per pixel, or that bounds have been found for.
#[derive(Clone, Copy, Debug)]
pub(super) struct RootShading {
    pub(super) shading: Shading,
    pub(super) claim: Claim,
    /// How the root is shaded as a whole, if it is.
    pub(super) shade: Shade,
}

impl Default for RootShading {
    fn default() -> Self {
        RIGHT_AS_IT_IS
    }
}

impl RootShading {
    /// Of a root that was shaded, all terms of so many lights, as it got its first colours.
    pub(super) fn lit(lights: usize) -> Self {
        Self {
            shading: Shading::PerPixel(PixelShading::all(lights)),
            ..RIGHT_AS_IT_IS
        }
    }
}

/// Of all roots that are right as they are.
pub(super) const RIGHT_AS_IT_IS: RootShading = RootShading {
    shading: Shading::Proved,
    claim: Claim::RIGHT,
    shade: Shade {
        last_paint: 0,
        polish: 0,
    },
};

/// What was put on the list to shade something.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Shade {
    /// Number of the last patch; see [`Refinement::enqueued`].
    pub(super) last_paint: u32,
    /// Place in [`Refinement::polishes`] plus one; 0 if there is but one step.
    polish: u32,
}

/// The second step for a part of a root.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polish {
    pub(super) root: u32,
    corners: [Bary; 3],
    pub(super) pixels: f32,
    /// Mean squared error before it.
    error: f32,
    /// Number of the last patch; 0 while it is a candidate.
    last_paint: u32,
}

impl Polish {
    /// Its share of the expected sum of squared errors.
    fn mass(&self) -> f64 {
        f64::from(self.pixels) * f64::from(ranking::rounded_error(self.error))
    }
}

/// How many lights the first step evaluates at a pixel as a rule.
pub(in crate::frame) fn usual_lights(lights: usize) -> usize {
    lights.min(1 + lights / 8)
}

/// Whether finding out which lights a root needs may save more than it costs: perhaps half of them can be left out. That must depend on
/// nothing but its pixels, lest final images depend on what was guessed of it.
fn bounds_pay(pixels: u32, lights: usize) -> bool {
    cost::light_saved(pixels as f32) * lights as f32 * 0.5 >= cost::bounds(lights)
}

/// Whether anything can be found out about a root before it is shaded.
pub(super) fn is_lookable(pixels: u32, lights: usize) -> bool {
    bounds_pay(pixels, lights) || runs::pay(pixels, lights)
}

impl Refinement {
    /// Has all pixels of a root shaded.
    pub(super) fn shade_root(&mut self, stage: &Stage<'_>, index: u32) {
        let root = self.roots[index as usize];
        self.roots[index as usize].progress = Progress::Done;
        self.error_mass -= root.mass();
        let pixels = root.pixels as f32;
        let shade = self.shade_patch(stage, index, Bary::ROOT, pixels, root.mass());
        let place = self.roots[index as usize].shading as usize;
        if let Some(known) = self.shadings.get_mut(place) {
            known.shade = shade;
        }
    }

    /// Finds out which terms a root needs. If it needs none it is done, else it will be shaded later.
    pub(super) fn look_at_root(&mut self, stage: &Stage<'_>, index: u32) {
        match self.shading(stage, index) {
            Shading::Proved => self.shade_root(stage, index),
            Shading::PerPixel(_) => self.offer(stage, Candidate::Root(index)),
        }
    }

    /// Has the pixels of a leaf shaded.
    pub(super) fn shade_leaf(&mut self, stage: &Stage<'_>, id: LeafId) {
        let mass = self.leaf_mass(id);
        self.error_mass -= mass;
        self.forest.close(stage.world, id);
        let leaf = self.forest.leaf(id);
        let (corners, pixels) = (leaf.corners, leaf.pixels as f32);
        if let Some(index) = self.root_of(leaf.triangle) {
            let shade = self.shade_patch(stage, index, corners, pixels, mass);
            self.leaf_progress(id).shade = shade;
        }
    }

    /// Has a part of a root shaded, of about `pixels` pixels. `mass` is its share of the expected sum of squared errors, which has been
    /// taken off already.
    pub(super) fn shade_patch(
        &mut self,
        stage: &Stage<'_>,
        index: u32,
        corners: [Bary; 3],
        pixels: f32,
        mass: f64,
    ) -> Shade {
        let Shading::PerPixel(shading) = self.shading(stage, index) else {
            return Shade::default();
        };
        self.mark_refined(index, false);
        let Some(first) = shading
            .first
            .filter(|_| mass > ERROR_FOR_STEPS * f64::from(pixels))
        else {
            let claim = self.claim(index).interpolated;
            self.enqueue_shading(
                stage,
                index,
                Owner::Nobody,
                claim,
                corners,
                &shading,
                pixels,
                mass,
            );
            return Shade {
                last_paint: self.enqueued,
                polish: 0,
            };
        };
        let polish = Polish {
            root: index,
            corners,
            pixels,
            error: first.error,
            last_paint: 0,
        };
        let fill = Fill::Phong {
            lights: first.rough,
            remainder: first.rest,
        };
        let claim = self.claim(index);
        let paint = Paint {
            patch: self.patch(index, corners, fill),
            owner: Owner::Nobody,
            claims: [claim.interpolated, claim.rough_evaluated],
            units: 0,
            benefit: mass - polish.mass(),
        };
        self.enqueue(paint, pixels);
        self.polishes.push(polish);
        self.error_mass += polish.mass();
        let number = self.polishes.len() as u32;
        self.offer_polish(number - 1);
        Shade {
            last_paint: self.enqueued,
            polish: number,
        }
    }

    /// Has pixels polished.
    pub(super) fn plan_polish(&mut self, stage: &Stage<'_>, number: u32) {
        let polish = self.polishes[number as usize];
        let mass = polish.mass();
        self.error_mass -= mass;
        if let Shading::PerPixel(shading) = self.shading(stage, polish.root) {
            let (corners, pixels) = (polish.corners, polish.pixels);
            let claim = self.claim(polish.root).rough_evaluated;
            self.enqueue_shading(
                stage,
                polish.root,
                Owner::Polish,
                claim,
                corners,
                &shading,
                pixels,
                mass,
            );
        }
        self.polishes[number as usize].last_paint = self.enqueued;
    }

    /// Ranks a second step and puts it on the queue.
    pub(super) fn offer_polish(&mut self, number: u32) {
        let polish = self.polishes[number as usize];
        let root = self.roots[polish.root as usize];
        let lights = match self.root_shading(&root).map(|known| known.shading) {
            Some(Shading::PerPixel(shading)) => shading.exact.diffuse.len(),
            _ => 0,
        };
        let benefit = polish.pixels * polish.error.max(ranking::ERROR_FLOOR);
        let rank = benefit / cost::phong(polish.pixels, lights);
        self.queue.push(rank, Candidate::Polish(number));
    }

    /// What shading has been planned to come to, and whether that is in the picture.
    pub(super) fn shade_shown(&self, shade: Shade) -> (ShadeKind, bool) {
        let polish = (shade.polish as usize).checked_sub(1);
        let polish = polish.and_then(|number| self.polishes.get(number));
        match polish {
            None => (ShadeKind::Exact, self.is_painted(shade.last_paint)),
            Some(polish) if polish.last_paint > 0 && self.is_painted(polish.last_paint) => {
                (ShadeKind::Exact, true)
            }
            Some(_) => (ShadeKind::FirstStep, self.is_painted(shade.last_paint)),
        }
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "what is shaded, how, and what it is worth"
    )]
    fn enqueue_shading(
        &mut self,
        stage: &Stage<'_>,
        index: u32,
        owner: Owner,
        claim: u8,
        corners: [Bary; 3],
        shading: &PixelShading,
        pixels: f32,
        mass: f64,
    ) {
        let fill = if shading.exact.diffuse.is_empty() {
            // Proved, though shown otherwise: bit by bit what the first image shows of those that are not curved.
            let triangle = self.roots[index as usize].triangle;
            let colours = stage.world.triangles[triangle as usize]
                .map(|vertex| stage.base.colours().get(vertex as usize));
            Fill::Gouraud(corners.map(|corner| blend(corner.weights(), colours)))
        } else {
            Fill::Phong {
                lights: shading.exact,
                remainder: Quadratic::linear(shading.linear),
            }
        };
        let paint = Paint {
            patch: self.patch(index, corners, fill),
            owner,
            claims: [claim, RIGHT],
            units: 0,
            benefit: mass,
        };
        self.enqueue(paint, pixels);
    }

    fn patch(&self, index: u32, corners: [Bary; 3], fill: Fill) -> Patch {
        Patch {
            triangle: self.roots[index as usize].triangle,
            corners,
            fill,
            pixels: 0,
        }
    }

    /// Which terms the pixels of a root need: by its bounds, if finding those costs less than they may save.
    pub(super) fn shading(&mut self, stage: &Stage<'_>, index: u32) -> Shading {
        let root = self.roots[index as usize];
        if let Some(known) = self.root_shading(&root) {
            return known.shading;
        }
        let (shading, claim) = self.look(stage, index);
        if matches!(shading, Shading::Proved) {
            self.note_proved(stage, index);
            return shading;
        }
        let claims = [u8::MAX, claim.interpolated];
        self.certificate.lower(claims, root.pixels);
        self.roots[index as usize].shading = self.shadings.len() as u32;
        self.shadings.push(RootShading {
            shading,
            claim,
            shade: Shade::default(),
        });
        shading
    }

    /// Notes that a root is right as it is.
    fn note_proved(&mut self, stage: &Stage<'_>, index: u32) {
        let root = &mut self.roots[index as usize];
        root.shading = PROVED;
        self.certificate.lower([u8::MAX, RIGHT], root.pixels);
        self.counters.proved += 1;
        self.counters.light_terms += 2 * stage.world.lights.len() as u64;
    }

    /// Is done with all triangles of a run that are proved right as they are, apart from the one that was asked for.
    fn conclude_run(
        &mut self,
        stage: &Stage<'_>,
        run: Range<u32>,
        lights: &TriangleLights,
        asked: u32,
    ) {
        for triangle in run.filter(|&triangle| triangle != asked) {
            let Some(index) = self.root_of(triangle) else {
                continue;
            };
            let root = self.roots[index as usize];
            let is_untouched = root.progress == Progress::Waiting && root.shading == NONE;
            if is_untouched && self.is_right_as_it_is(stage, &root, lights) {
                self.note_proved(stage, index);
                self.roots[index as usize].progress = Progress::Done;
                self.error_mass -= root.mass();
            }
        }
    }

    /// What is claimed of a root that has been looked at.
    fn claim(&self, index: u32) -> Claim {
        let known = self.root_shading(&self.roots[index as usize]);
        known.map_or(Claim::UNKNOWN, |known| known.claim)
    }

    /// Nominal cost of finding out which terms a root needs.
    pub(super) fn look_cost(&self, stage: &Stage<'_>, root: &Root) -> f32 {
        let lights = stage.world.lights.len();
        if bounds_pay(root.pixels, lights) {
            cost::bounds(lights)
        } else if runs::pay(root.pixels, lights) && self.runs.is_unknown(stage.world, root.triangle)
        {
            cost::run_bounds(lights)
        } else {
            0.0
        }
    }

    /// Finds out which terms a root needs: by bounds of its own, by those of its run, or without any.
    fn look(&mut self, stage: &Stage<'_>, index: u32) -> (Shading, Claim) {
        let root = self.roots[index as usize];
        let count = stage.world.lights.len();
        let everything = Shading::PerPixel(PixelShading::all(count));
        if self.by_area {
            return (everything, Claim::UNKNOWN);
        }
        self.units_for_bounds += self.look_cost(stage, &root) as u64;
        if bounds_pay(root.pixels, count) {
            let view = stage.view;
            let lights =
                highlight::light_masks(stage.world, &view.eye, view.encoding, root.triangle);
            if self.is_right_as_it_is(stage, &root, &lights) {
                return (Shading::Proved, Claim::RIGHT);
            }
            let evaluated = lights.active.diffuse.len() + lights.active.specular.len();
            self.counters.light_terms += (2 * count - evaluated) as u64;
            let shading = pixel_shading(stage, &root, &lights);
            return (Shading::PerPixel(shading), lights.claim);
        }
        if !runs::pay(root.pixels, count) {
            return (everything, Claim::UNKNOWN);
        }
        let (lights, run) = self.runs.lights(stage, root.triangle);
        if self.is_right_as_it_is(stage, &root, &lights) {
            self.conclude_run(stage, run, &lights, root.triangle);
            return (Shading::Proved, Claim::RIGHT);
        }
        // Else all are evaluated: to find out what instead of the others takes longer than a few pixels do.
        let shading = match lights.verdict {
            Verdict::Absent => Shading::PerPixel(PixelShading::all(0)),
            _ => everything,
        };
        (shading, lights.claim)
    }

    /// Whether a triangle is proved right, and the picture shows it as the proof has it, linear over all of it: not subdivided, nor curved, nor
    /// kept from an image in which it may have been.
    fn is_right_as_it_is(&self, stage: &Stage<'_>, root: &Root, lights: &TriangleLights) -> bool {
        let is_changed = root.is_curved || self.forest.is_planted(root.triangle);
        lights.verdict == Verdict::Absent && !is_changed && stage.base.is_whole()
    }
}

/// How far the shading of a pixel has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ShadeKind {
    /// Everything that matters is evaluated.
    Exact,
    /// Rough terms are.
    FirstStep,
}

/// Both steps for a root, by its bounds.
fn pixel_shading(stage: &Stage<'_>, root: &Root, bounds: &TriangleLights) -> PixelShading {
    let world = stage.world;
    let vertices = world.triangles[root.triangle as usize].map(|v| v as usize);
    let material = usize::from(world.triangle_material[root.triangle as usize]);
    let kit = ShadingKit::new(stage.view.eye, &world.materials[material], &world.lights);
    let points = points_of(vertices.map(|v| world.positions.get(v)));
    let normals = points_of(vertices.map(|v| world.normals.get(v)));
    let level = stage.exec.level;
    let full = shade_few(
        level,
        &kit,
        &ActiveLights::all(world.lights.len()),
        &points,
        &normals,
    );
    let [p, q, r, ..] = points;
    let [n, m, o, ..] = normals;
    let exact = shade_few(level, &kit, &bounds.active, &[p, q, r], &[n, m, o]);
    let pixels = root.pixels as f32;
    let costs =
        [bounds.active, bounds.rough].map(|lights| cost::phong(pixels, lights.diffuse.len()));
    let first = (costs[0] > STEPS_FROM * costs[1]).then(|| {
        let rough = shade_few(level, &kit, &bounds.rough, &points, &normals);
        let rest: [[f32; 3]; POINTS] = std::array::from_fn(|i| minus(full[i], rough[i]));
        let [a, b, c, ab, bc, ca, tests @ ..] = rest;
        let rest = Quadratic::through([a, b, c], [ab, bc, ca]);
        let squares = tests.iter().enumerate().map(|(i, &test)| {
            let off = minus(rest.at(SAMPLE_WEIGHTS[i]), test);
            squared_codes(stage.view.encoding, full[6 + i], off)
        });
        FirstStep {
            rough: bounds.rough,
            error: squares.sum::<f32>() / SAMPLE_WEIGHTS.len() as f32,
            rest,
        }
    });
    PixelShading {
        exact: bounds.active,
        linear: std::array::from_fn(|i| minus(full[i], exact[i])),
        first,
    }
}

/// The points at which the quadratic is found and tested, from the corners.
fn points_of(corners: [[f32; 3]; 3]) -> [[f32; 3]; POINTS] {
    let middles = middles(corners);
    std::array::from_fn(|i| match i {
        0..3 => corners[i],
        3..6 => middles[i - 3],
        _ => blend(SAMPLE_WEIGHTS[i - 6], corners),
    })
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
