//! Planning pieces: what to do with the best candidates.

use super::parts;
use super::ranking::{self, Action};
use super::shading::usual_lights;
use super::{Candidate, Owner, Paint, Progress, Refinement, Stage};
use crate::backend::{Fill, Patch};
use crate::refine::{LeafId, LeafState, PlanOutcome, SplitOutcome};
use crate::schedule::{Allowance, cost};

/// Nominal nanoseconds of the first planning pieces, the painting they ask for included. Patches are painted in list order, so what is
/// planned first keeps everything found later waiting.
const FIRST_PLANS: u64 = 20_000;

/// The same of the longest, which keep all threads busy.
const LONGEST_PLANS: u64 = 400_000;

/// In between, a piece is this part of all that was planned before it.
const PLANS_SHARE: u64 = 16;

impl Refinement {
    /// Takes up the best candidates. False when there are none, or the budget does not admit the next one.
    pub(super) fn plan_piece(
        &mut self,
        stage: &mut Stage<'_>,
        allowance: &mut Allowance<'_>,
    ) -> bool {
        let mut units = 0;
        let limit = (self.planned_units / PLANS_SHARE).clamp(FIRST_PLANS, LONGEST_PLANS);
        let mut to_paint = 0.0;
        while units + to_paint as u64 <= limit {
            let Some(candidate) = self.next_candidate() else {
                break;
            };
            let Some(action) = self.decide(stage, candidate) else {
                continue;
            };
            if let Candidate::Leaf(leaf) = candidate
                && self.forest.is_in_plan(leaf)
            {
                // Something was planned in this piece, so this does not go on for ever.
                self.deferred.push(candidate);
                continue;
            }
            let more = self.planning_cost(stage, candidate, action);
            let bounds = self.bounds_cost(stage, candidate);
            if !allowance.admit(units + more + bounds) {
                // It stays the next one: a refusal must not change the order.
                self.held = Some(candidate);
                break;
            }
            to_paint += self.painting_cost(stage, candidate, action);
            self.plan(stage, candidate, action);
            units += more + std::mem::take(&mut self.units_for_bounds);
        }
        self.conclude_plans(stage);
        allowance.spend(units);
        self.planned_units += units + to_paint as u64;
        let mut deferred = std::mem::take(&mut self.deferred);
        for candidate in deferred.drain(..) {
            self.offer(stage, candidate);
        }
        self.deferred = deferred;
        units > 0
    }

    /// Takes the candidate that was refused last, or the best one; among equals those come first that were collected.
    fn next_candidate(&mut self) -> Option<Candidate> {
        if self.held.is_some() {
            return self.held.take();
        }
        if self.ranked_roots.best() >= self.queue.best() {
            self.ranked_roots.pop().map(Candidate::Root)
        } else {
            self.queue.pop()
        }
    }

    /// What to do with a candidate; `None` when it has become void.
    fn decide(&self, stage: &Stage<'_>, candidate: Candidate) -> Option<Action> {
        match candidate {
            Candidate::Root(index) => {
                let root = self.roots[index as usize];
                // It may have been planted in this very piece, as the neighbour of another.
                let is_waiting =
                    root.progress == Progress::Waiting && !self.forest.is_planted(root.triangle);
                is_waiting.then(|| self.root_ranking(stage.world.lights.len()).choose(&root).1)
            }
            Candidate::Leaf(leaf) => {
                let is_open = self.forest.leaf(leaf).state == LeafState::Open;
                is_open.then(|| self.choose(stage, leaf).1)
            }
            Candidate::Part(_) | Candidate::Polish(_) => Some(Action::Shade),
        }
    }

    fn planning_cost(&self, stage: &Stage<'_>, candidate: Candidate, action: Action) -> u64 {
        let lights = stage.world.lights.len();
        let units = match (candidate, action) {
            (Candidate::Root(_), Action::Look) => cost::LOOK_NS,
            (Candidate::Root(_), Action::Shade) | (Candidate::Polish(_), _) => cost::LIST_NS,
            (Candidate::Root(index), Action::Split(_)) => {
                let pixels = self.roots[index as usize].pixels;
                self.root_ranking(lights).planting_cost(pixels)
            }
            (Candidate::Leaf(leaf), Action::Shade | Action::Look) => {
                ranking::cutting_cost(self.forest.leaf(leaf).pixels as f32, lights)
            }
            (Candidate::Leaf(leaf), Action::Split(marks)) => {
                self.splitting_cost(stage, leaf, marks)
            }
            (Candidate::Part(part), _) => {
                ranking::cutting_cost(self.parts[part as usize].pixels, lights)
            }
        };
        units as u64
    }

    /// About what painting will cost that a candidate asks for.
    fn painting_cost(&self, stage: &Stage<'_>, candidate: Candidate, action: Action) -> f32 {
        let (pixels, is_root) = match candidate {
            Candidate::Root(index) => (self.roots[index as usize].pixels as f32, true),
            Candidate::Leaf(leaf) => (self.forest.leaf(leaf).pixels as f32, false),
            Candidate::Part(part) => (self.parts[part as usize].pixels, false),
            Candidate::Polish(number) => {
                let pixels = self.polishes[number as usize].pixels;
                return cost::phong(pixels, stage.world.lights.len());
            }
        };
        match action {
            Action::Look => 0.0,
            // It is only planted.
            Action::Split(_) if is_root => 0.0,
            Action::Shade if !is_root && parts::is_large(pixels) => 0.0,
            Action::Split(marks) => {
                let edges = marks.count_ones() as f32;
                cost::repaint(edges + 1.0, pixels * (1.0 + 0.5 * edges))
            }
            Action::Shade => cost::phong(pixels, usual_lights(stage.world.lights.len())),
        }
    }

    /// What bounding the lights on the candidate's root will cost, should it come to that.
    fn bounds_cost(&self, stage: &Stage<'_>, candidate: Candidate) -> u64 {
        if self.is_drawn_once || self.by_area {
            return 0;
        }
        let root = match candidate {
            Candidate::Root(index) => Some(index),
            Candidate::Leaf(leaf) => self.root_of(self.forest.leaf(leaf).triangle),
            Candidate::Part(part) => self.root_of_part(part),
            Candidate::Polish(_) => None,
        };
        let root = root.map(|index| self.roots[index as usize]);
        match root {
            Some(root) if self.root_shading(&root).is_none() => self.look_cost(stage, &root) as u64,
            _ => 0,
        }
    }

    /// Takes a candidate up.
    fn plan(&mut self, stage: &Stage<'_>, candidate: Candidate, action: Action) {
        match candidate {
            Candidate::Root(index) => self.plan_root(stage, index, action),
            Candidate::Leaf(leaf) => self.plan_leaf(stage, leaf, action),
            Candidate::Part(part) => self.plan_part(stage, part),
            Candidate::Polish(number) => self.plan_polish(stage, number),
        }
    }

    fn plan_root(&mut self, stage: &Stage<'_>, index: u32, action: Action) {
        let root = self.roots[index as usize];
        if action == Action::Look {
            return self.look_at_root(stage, index);
        }
        let colours = stage.base.colours();
        // Without room for another leaf it is shaded, too.
        let is_planted = action != Action::Shade
            && self
                .forest
                .plant(stage.world, colours, root.triangle, root.pixels)
                .is_some();
        if !is_planted && !self.is_drawn_once {
            self.shade_root(stage, index);
        }
    }

    fn plan_leaf(&mut self, stage: &Stage<'_>, leaf: LeafId, action: Action) {
        let marks = match action {
            // It stays as it is, and follows its neighbours.
            Action::Shade | Action::Look if self.is_drawn_once => return,
            Action::Shade | Action::Look
                if parts::is_large(self.forest.leaf(leaf).pixels as f32) =>
            {
                return self.cut_into_parts(stage, leaf);
            }
            Action::Shade | Action::Look => return self.shade_leaf(stage, leaf),
            Action::Split(marks) => marks,
        };
        let (roots, places) = (&self.roots, &self.places);
        // A neighbour that is right already, or that nobody sees, need not follow a split.
        let pixels_to_follow = |triangle: u32| {
            places
                .get(triangle)
                .map(|index| roots[index as usize])
                .filter(|root| root.progress != Progress::Done && !root.is_curved)
                .map_or(0, |root| root.pixels)
        };
        let colours = stage.base.colours();
        match self
            .forest
            .plan_split(stage.world, colours, leaf, marks, pixels_to_follow)
        {
            PlanOutcome::Planned => {}
            PlanOutcome::Later => self.deferred.push(Candidate::Leaf(leaf)),
            PlanOutcome::Never => self.plan_leaf(stage, leaf, Action::Shade),
        }
    }

    /// Illuminates everything that was planned, and carries out what turns out to help.
    fn conclude_plans(&mut self, stage: &Stage<'_>) {
        let mut planted = std::mem::take(&mut self.planted);
        planted.clear();
        self.forest.illuminate(
            stage.exec,
            stage.world,
            stage.view,
            stage.base.colours(),
            &mut planted,
        );
        for &leaf in &planted {
            self.note_planted(stage, leaf);
        }
        self.planted = planted;

        let mut splits = std::mem::take(&mut self.splits);
        splits.clear();
        self.forest.conclude_splits(stage.world, &mut splits);
        for split in &splits {
            self.note_split(stage, split);
        }
        self.splits = splits;
        self.rank_parts(stage);
    }

    fn note_planted(&mut self, stage: &Stage<'_>, leaf: LeafId) {
        if let Some(index) = self.root_of(self.forest.leaf(leaf).triangle) {
            let root = &mut self.roots[index as usize];
            root.progress = Progress::Planted;
            self.memory
                .note(root.triangle, self.forest.leaf(leaf).error);
            self.error_mass -= root.mass();
            self.error_mass += self.leaf_mass(leaf);
        }
        self.offer_leaf(stage, leaf);
    }

    fn note_split(&mut self, stage: &Stage<'_>, split: &SplitOutcome) {
        let mass_before = self.error_mass;
        let children = match split {
            SplitOutcome::Rejected { leaf, error } => {
                self.error_mass -= self.leaf_mass(*leaf);
                self.forest.forbid_splitting(*leaf, *error);
                self.error_mass += self.leaf_mass(*leaf);
                return self.offer_leaf(stage, *leaf);
            }
            SplitOutcome::Committed { parents, children } => {
                self.commits += 1;
                for parent in parents.clone() {
                    let parent = self.forest.split_parent(parent);
                    self.error_mass -= self.leaf_mass(parent);
                    if let Some(index) = self.root_of(self.forest.leaf(parent).triangle) {
                        self.mark_refined(index, true);
                    }
                }
                children.clone()
            }
        };
        for child in children.clone() {
            self.error_mass += self.leaf_mass(child);
        }
        let pixels = children.clone().map(|child| self.forest.leaf(child).pixels);
        let pixels = pixels.map(f64::from).sum::<f64>().max(1.0);
        let benefit_per_pixel = (mass_before - self.error_mass) / pixels;
        for child in children {
            if self.is_drawn_once {
                self.offer_leaf(stage, child);
                continue;
            }
            let leaf = self.forest.leaf(child);
            let patch = Patch {
                triangle: leaf.triangle,
                corners: leaf.corners,
                fill: Fill::Gouraud(self.forest.colours(stage.base.colours(), child)),
                pixels: 0,
            };
            let pixels = leaf.pixels as f32;
            let benefit = benefit_per_pixel * f64::from(pixels);
            let paint = Paint {
                patch,
                owner: Owner::Leaf(child),
                claims: [0; 2],
                units: 0,
                benefit,
            };
            self.enqueue(paint, pixels);
        }
    }

    /// Ranks a candidate and puts it on the queue.
    pub(super) fn offer(&mut self, stage: &Stage<'_>, candidate: Candidate) {
        match candidate {
            Candidate::Leaf(leaf) => self.offer_leaf(stage, leaf),
            Candidate::Part(part) => self.offer_part(stage, part),
            Candidate::Polish(number) => self.offer_polish(number),
            Candidate::Root(index) => {
                let root = self.roots[index as usize];
                let (rank, _) = self.root_ranking(stage.world.lights.len()).choose(&root);
                self.queue.push(rank, candidate);
            }
        }
    }

    /// Ranks an open leaf and puts it on the queue; one without pixels is done, and so is one that is good enough to be drawn.
    pub(super) fn offer_leaf(&mut self, stage: &Stage<'_>, leaf: LeafId) {
        if self.forest.leaf(leaf).state != LeafState::Open {
            return;
        }
        if self.is_drawn_once {
            if self.is_worth_splitting(stage, leaf) {
                let rank = self.choose(stage, leaf).0;
                self.queue.push(rank, Candidate::Leaf(leaf));
            }
            return;
        }
        if self.forest.leaf(leaf).pixels == 0 {
            self.forest.close(stage.world, leaf);
            return;
        }
        let rank = self.choose(stage, leaf).0;
        self.queue.push(rank, Candidate::Leaf(leaf));
    }
}
