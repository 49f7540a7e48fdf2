//! Refinement: what could be done next, what it is worth, and doing it piece by piece.
//!
//! Work comes in three kinds of pieces, each about [`PIECE_UNITS`] long (those shared by several threads longer while the deadline
//! is far away), and none is begun that the budget does not admit:
//!
//! * A **collecting** piece makes the next visible triangles of a new image candidates. Planning begins when all are.
//! * A **planning** piece takes the best candidates off the queue. A triangle not looked at yet becomes the root of a
//!   subdivision, its error estimated from samples; a leaf is split further, or is to be shaded per pixel, whichever
//!   takes away more error per nominal cost. All new vertices of the piece are illuminated together. What comes out is
//!   a list of patches to paint.
//! * A **painting** piece paints patches off that list, in order. Large areas have been cut into patches that each take
//!   a fraction of a piece. The list survives the end of a frame; planning goes on when it is empty.
//!
//! What is shaded while the first image gets its colours is done before any of that begins: see [`lighting`]. A backend that cannot repaint has no
//! painting pieces: see [`drawn_once`].
//!
//! Plans depend on nominal costs and estimates only, and patches are painted in list order until the budget ends, so
//! that a budget in work units gives the same image for any number of threads.

mod certificate;
mod collecting;
mod drawn_once;
mod leaves;
mod lighting;
mod memory;
mod painting;
mod parts;
mod places;
mod planning;
mod ranking;
mod runs;
mod shading;

use super::Method;
use super::base::BaseImage;
use super::stats::FrameStats;
use crate::backend::{Backend, Patch};
use crate::parallel::Exec;
use crate::refine::estimate::{SAMPLES_AT_ONCE, Samples};
use crate::refine::{FIRST_LEAVES, Forest, LeafId, SplitOutcome};
use crate::scene::{View, World};
use crate::schedule::{Allowance, Kind, RankedList, RankedQueue};
use certificate::Certificate;
use collecting::Collector;
pub(super) use drawn_once::DrawnLeaves;
pub(super) use leaves::for_each_leaf;
pub use leaves::{Leaf, LeafKind};
pub(super) use lighting::{LitTriangles, MostLit};
use memory::Memory;
use parts::Part;
use places::Places;
use runs::Runs;
pub(super) use shading::usual_lights;
use shading::{Polish, RootShading, Shade};
use std::collections::VecDeque;

/// Nominal nanoseconds of a piece.
const PIECE_UNITS: u64 = 50_000;

/// Patches, leaves or candidates in a piece, as a rule at most.
const ENTRIES_AT_ONCE: usize = 512;

/// Triangles that there is room for, from the start, to know how they are shaded.
const FIRST_SHADINGS: usize = 1 << 11;

/// No place in [`Refinement::shadings`].
const NONE: u32 = u32::MAX;

/// In place of one for roots that are right as they are.
const PROVED: u32 = u32::MAX - 1;

/// And for roots that were shaded as they got their first colours.
const LIT: u32 = u32::MAX - 2;

/// How much more error an image has than the sum of its estimates says, halfway: what looks worst is refined first, so what is
/// left was underestimated as a rule. Fitted to the example scenes, like the guesses in [`ranking`].
const OPTIMISM: f64 = 1.13;

/// What the stages of refinement work on.
pub(super) struct Stage<'a> {
    pub(super) exec: Exec,
    pub(super) world: &'a World,
    pub(super) view: &'a View,
    pub(super) base: &'a BaseImage,
    pub(super) backend: &'a mut dyn Backend,
}

/// Something that could be refined.
#[derive(Clone, Copy, Debug)]
enum Candidate {
    /// A visible triangle, by its place in [`Refinement::roots`].
    Root(u32),
    /// A leaf of the forest.
    Leaf(LeafId),
    /// A part of a leaf, by its place in [`Refinement::parts`].
    Part(u32),
    /// The second step of shading, by its place in [`Refinement::polishes`].
    Polish(u32),
}

/// A visible triangle. There may be a million, few of which are ever looked at: what is known of those only is kept elsewhere.
#[derive(Clone, Copy, Debug)]
struct Root {
    triangle: u32,
    pixels: u32,
    /// Mean squared error, guessed or remembered, before anything was looked at.
    prior: f32,
    /// Where in [`Refinement::shadings`] it is said how its pixels are shaded, once that has been asked; or [`NONE`], [`PROVED`] or
    /// [`LIT`].
    shading: u32,
    is_pht: bool,
    /// Divided before the first image was drawn.
    is_curved: bool,
    progress: Progress,
    /// Subdivided.
    is_split: bool,
    /// Subdivided, or shaded per pixel in part or as a whole.
    is_refined: bool,
}

impl Root {
    /// One of which only this is known.
    fn new(triangle: u32, pixels: u32) -> Self {
        Self {
            triangle,
            pixels,
            prior: 0.0,
            shading: NONE,
            is_pht: false,
            is_curved: false,
            progress: Progress::Waiting,
            is_split: false,
            is_refined: false,
        }
    }

    /// Its share of the expected sum of squared errors while it has not been looked at.
    fn mass(&self) -> f64 {
        let error = (self.prior - ranking::ERROR_FLOOR).max(0.0);
        f64::from(self.pixels) * f64::from(ranking::rounded_error(error))
    }
}

/// How far a root has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Progress {
    /// Not looked at.
    Waiting,
    /// The forest knows about it.
    Planted,
    /// Its pixels are right.
    Done,
}

/// Who waits for a patch to be painted.
#[derive(Clone, Copy, Debug)]
enum Owner {
    /// Nobody: it is shaded then.
    Nobody,
    /// Nobody, and its pixels were shaded before.
    Polish,
    /// A leaf, which then becomes a candidate for the next step.
    Leaf(LeafId),
}

/// A patch waiting to be painted.
#[derive(Clone, Copy, Debug)]
struct Paint {
    patch: Patch,
    owner: Owner,
    /// How far its pixels may be off before and after, in codes; see [`certificate`].
    claims: [u8; 2],
    /// Nominal cost.
    units: u32,
    /// What it takes away from the sum of squared errors, by what is known; see [`error_mass`](Refinement::error_mass).
    benefit: f64,
}

/// A leaf's patches that are still to be painted, or its parts still to be shaded, and its pixels counted so far.
#[derive(Clone, Copy, Debug, Default)]
struct Progressing {
    patches: u32,
    pixels: u32,
    /// Its last patch, and what comes after it.
    shade: Shade,
    /// Its parts have taken its place.
    is_cut: bool,
}

/// All refinement of the current image.
#[derive(Debug, Default)]
pub(super) struct Refinement {
    forest: Forest,
    /// Candidates, apart from the roots that nobody has asked for yet.
    queue: RankedQueue<Candidate>,
    ranked_roots: RankedList,
    /// The candidate that the last budget refused: the next to be taken up.
    held: Option<Candidate>,
    /// How many triangles are visible: `roots` once all of them are collected.
    visible: usize,
    /// In the order of their triangles.
    roots: Vec<Root>,
    places: Places,
    memory: Memory,
    /// Whether what is remembered takes the place of guesses.
    remembers: bool,
    shadings: Vec<RootShading>,
    /// How roots are shaded that are [`LIT`].
    lit_shading: RootShading,
    /// Workspace: roots by their error.
    by_error: RankedList,
    runs: Runs,
    certificate: Certificate,
    collectors: Vec<Collector>,
    paints: VecDeque<Paint>,
    /// Nominal cost of all plans so far, and of painting what they ask for.
    planned_units: u64,
    /// How many patches were put on the list so far, which numbers them from 1.
    enqueued: u32,
    parts: Vec<Part>,
    polishes: Vec<Polish>,
    /// How many of `parts` have been ranked; the samples of the others are still to be evaluated.
    ranked_parts: usize,
    /// Triangles are shaded per pixel in the order of their area ([`Method::PhongArea`]).
    by_area: bool,
    /// There is no painting: everything is drawn after it has been refined. See [`drawn_once`].
    is_drawn_once: bool,
    /// Pixels of all visible triangles of an image that is drawn once.
    pixels_to_draw: u64,
    /// Splits committed for the current image.
    commits: u64,
    /// Visible pixels of all roots.
    pixels: u64,
    /// By leaf.
    progressing: Vec<Progressing>,
    /// Expected sum of squared errors over the pixels of all roots once everything planned has been painted, per channel, in
    /// squared codes.
    error_mass: f64,
    /// What is to be added to it as long as what is planned has not been painted: the benefit of all `paints`.
    benefit_to_paint: f64,
    counters: Counters,
    /// Nominal cost of the bounds found by the candidate being planned.
    units_for_bounds: u64,
    samples: Samples,
    // Workspaces of a piece.
    piece: Vec<Patch>,
    owners: Vec<(Owner, [u8; 2])>,
    planted: Vec<LeafId>,
    splits: Vec<SplitOutcome>,
    deferred: Vec<Candidate>,
}

/// What refinement has come to for the current image.
#[derive(Clone, Copy, Debug, Default)]
struct Counters {
    phts: u64,
    matte: u64,
    refined_phts: u64,
    subdivided: u64,
    phong_pixels: u64,
    proved: u64,
    light_terms: u64,
}

impl Refinement {
    /// Forgets everything and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.queue.clear();
        self.ranked_roots.clear();
        self.held = None;
        self.visible = 0;
        self.roots.clear();
        self.shadings.clear();
        self.paints.clear();
        self.enqueued = 0;
        self.planned_units = 0;
        self.progressing.clear();
        self.parts.clear();
        self.polishes.clear();
        self.samples.clear();
        self.ranked_parts = 0;
        self.commits = 0;
        self.pixels_to_draw = 0;
        self.pixels = 0;
        self.error_mass = 0.0;
        self.benefit_to_paint = 0.0;
        self.counters = Counters::default();
    }

    /// Forgets what was found out about triangles in earlier images.
    pub(super) fn forget(&mut self) {
        self.memory.forget();
    }

    /// Whether the image that begins next remembers what was found out in those before.
    pub(super) fn set_remembering(&mut self, remembers: bool) {
        self.remembers = remembers;
    }

    /// Makes room, once for an image size, for what is on the lists as a rule at most while the view moves.
    fn make_room(&mut self, view: &View) {
        let pixels = view.width as usize * view.height as usize;
        self.parts.reserve(parts::most(pixels));
        self.paints.reserve(ENTRIES_AT_ONCE + pixels / 256);
        self.samples.reserve(SAMPLES_AT_ONCE);
        self.queue.reserve(ENTRIES_AT_ONCE);
        self.shadings.reserve(FIRST_SHADINGS);
        self.polishes.reserve(FIRST_SHADINGS);
        self.progressing.reserve(FIRST_LEAVES);
        self.piece.clear();
        self.piece.reserve(ENTRIES_AT_ONCE);
        self.owners.clear();
        self.owners.reserve(ENTRIES_AT_ONCE);
        self.planted.clear();
        self.planted.reserve(ENTRIES_AT_ONCE);
        self.splits.clear();
        self.splits.reserve(ENTRIES_AT_ONCE);
        self.deferred.reserve(ENTRIES_AT_ONCE);
    }

    /// Whether there is nothing left to refine.
    pub(super) fn is_finished(&self) -> bool {
        !self.is_collecting()
            && self.held.is_none()
            && self.ranked_roots.best().is_none()
            && self.queue.is_empty()
            && self.paints.is_empty()
    }

    /// Notes that the first image is complete.
    pub(super) fn note_image(&mut self) {
        self.memory.note_image();
    }

    /// Begins with a new image, of which nothing is known yet: its visible triangles are still to be
    /// [collected](collecting).
    pub(super) fn begin(
        &mut self,
        exec: Exec,
        method: Method,
        world: &World,
        view: &View,
        base: &BaseImage,
        backend: &dyn Backend,
    ) {
        self.clear();
        self.make_room(view);
        self.forest.reset(world);
        self.places.reset(world.triangles.len());
        self.memory.next_image(world.triangles.len());
        // The rival knows areas only: no estimates, no bounds, no subdivision.
        self.by_area = method == Method::PhongArea;
        let visible = backend.visible_triangles();
        self.visible = visible.len();
        self.certificate.begin(base.covered_pixels());
        self.runs.begin(world);
        self.roots.reserve(visible.len());
        self.make_collectors(exec, world);
        self.ranked_roots.reserve(visible.len());
        self.by_error.reserve(visible.len());
        let capabilities = backend.capabilities();
        self.is_drawn_once = !capabilities.refines_in_place();
        if self.is_drawn_once {
            self.forest
                .draw_once(exec.level, view, capabilities.interpolation, base.colours());
            // That is little beside drawing them.
            let pixels = visible.iter().map(|&t| backend.visible_pixels(t));
            self.pixels_to_draw = pixels.map(u64::from).sum();
        }
    }

    /// Does one piece of work. False when there is none left, or the budget does not admit any.
    pub(super) fn step(&mut self, stage: &mut Stage<'_>, allowance: &mut Allowance<'_>) -> bool {
        if self.is_collecting() {
            self.collect_piece(stage, allowance)
        } else if self.paints.is_empty() {
            self.plan_piece(stage, allowance)
        } else {
            self.paint_piece(stage, allowance)
        }
    }

    /// The kind of work that the next step is.
    pub(super) fn next_kind(&self) -> Kind {
        if self.is_collecting() {
            Kind::Collect
        } else if self.paints.is_empty() {
            Kind::Plan
        } else {
            Kind::Paint
        }
    }

    /// Estimated root mean square error of the image in codes, as far as its triangles have been collected; NaN while nothing is
    /// known.
    pub(super) fn estimated_error(&self) -> f64 {
        if self.is_collecting() && self.roots.is_empty() {
            return f64::NAN;
        }
        let mass = self.error_mass + self.benefit_to_paint;
        OPTIMISM * (mass.max(0.0) / self.pixels.max(1) as f64).sqrt()
    }

    /// How far any pixel may be from per-pixel Phong shading, in codes, and how many may be by more than a code. `None` where
    /// nothing is shaded per pixel.
    pub(super) fn certified(&self) -> Option<(u8, u64)> {
        (!self.is_drawn_once).then(|| (self.certificate.most(), self.certificate.unproved_pixels()))
    }

    /// Whether the budget asks for no better image.
    pub(super) fn satisfies(&self, allowance: &Allowance<'_>) -> bool {
        !self.is_collecting() && allowance.is_satisfied_by(self.estimated_error())
    }

    /// Fills in how far the image has come. While triangles are still being collected, that is about those that were.
    pub(super) fn report(&self, method: Method, stats: &mut FrameStats) {
        stats.estimated_error = match method {
            Method::Flat | Method::Gouraud => f64::NAN,
            method if method.is_of_the_paper() => f64::NAN,
            _ => self.estimated_error(),
        };
        stats.pht = self.counters.phts;
        stats.pht_visible = self.counters.phts;
        stats.refined = self.counters.refined_phts;
        stats.triangles_subdivided = self.counters.subdivided;
        stats.leaves = self.forest.open_leaves() as u64;
        stats.phong_pixels = self.counters.phong_pixels;
        stats.skipped.triangles_matte = self.counters.matte;
        stats.skipped.triangles_proved = self.counters.proved;
        stats.skipped.light_terms = self.counters.light_terms;
    }

    /// A leaf's share of the expected sum of squared errors.
    fn leaf_mass(&self, leaf: LeafId) -> f64 {
        let leaf = self.forest.leaf(leaf);
        f64::from(leaf.pixels) * f64::from(ranking::rounded_error(leaf.error))
    }

    /// The place in `roots` of a visible triangle.
    fn root_of(&self, triangle: u32) -> Option<u32> {
        self.places.get(triangle)
    }

    /// How a root is shaded, if that has been asked.
    fn root_shading(&self, root: &Root) -> Option<&RootShading> {
        match root.shading {
            PROVED => Some(&shading::RIGHT_AS_IT_IS),
            LIT => Some(&self.lit_shading),
            place => self.shadings.get(place as usize),
        }
    }

    /// Notes that a root is being subdivided or shaded per pixel.
    fn mark_refined(&mut self, index: u32, by_splitting: bool) {
        let root = &mut self.roots[index as usize];
        self.counters.refined_phts += u64::from(root.is_pht && !root.is_refined);
        self.counters.subdivided += u64::from(by_splitting && !root.is_split);
        root.is_refined = true;
        root.is_split |= by_splitting;
    }
}
