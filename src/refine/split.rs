//! Splitting leaves along marked edges: planned, illuminated, then committed if it helps.

use super::estimate::{SAMPLES_AT_ONCE, deviations, mean_square};
use super::forest::{Forest, LeafError, LeafId, LeafState, NONE, Seedling};
use crate::geometry::bary::blend;
use crate::geometry::{Bary, Vec3s};
use crate::output::{Encoding, Interpolation};
use crate::parallel::Exec;
use crate::scene::World;
use std::ops::Range;

/// Where the six points of a leaf are, as weights of its corners: the corners, then the middle of edge k at 3 + k.
const POINTS: [[f32; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.5, 0.5, 0.0],
    [0.0, 0.5, 0.5],
    [0.5, 0.0, 0.5],
];

/// Children that are planned together, as a rule at most: what fits into a piece of work.
pub(super) const CHILDREN_AT_ONCE: usize = 512;

/// The outcome of asking for a split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlanOutcome {
    /// Planned; [`Forest::conclude_splits`] will tell whether it helped.
    Planned,
    /// Something it needs takes part in another plan, or has just been planted: ask again after the next
    /// [`Forest::conclude_splits`].
    Later,
    /// No marked edge can be split, or the forest is full.
    Never,
}

/// What has become of a planned split.
#[derive(Clone, Debug, PartialEq)]
pub enum SplitOutcome {
    /// The children have taken the parents' place.
    Committed {
        /// For [`Forest::split_parent`].
        parents: Range<usize>,
        /// The new leaves. Their pixels are an estimate until they have been painted.
        children: Range<LeafId>,
    },
    /// It would not have helped.
    Rejected {
        /// The leaf that asked for it.
        leaf: LeafId,
        /// What the leaf's error was found to be on the way.
        error: f32,
    },
}

/// What planting the roots on the other side of some edges has come to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Neighbours {
    /// There is nothing to plant.
    Ready,
    /// Some were: their midpoints have to be illuminated first.
    Planted,
    /// The forest is full. An edge that not all sides can follow must not be split.
    NoRoom,
}

/// A child of a planned split.
#[derive(Clone, Debug)]
struct PlannedChild {
    parent: LeafId,
    /// Its corners among the six points of the parent.
    points: [usize; 3],
    seedling: Seedling,
    /// Its estimated error once it exists.
    error: LeafError,
    /// The parent's estimated error inside of it, at the same points.
    parent_error: f32,
}

/// One planned split: the leaves it replaces, and the children that would replace them.
#[derive(Clone, Debug)]
struct PlannedSplit {
    initiator: LeafId,
    parents: Range<usize>,
    children: Range<usize>,
}

/// The splits being planned, and scratch space.
#[derive(Clone, Debug, Default)]
pub(super) struct Planner {
    splits: Vec<PlannedSplit>,
    parents: Vec<(LeafId, u8)>,
    children: Vec<PlannedChild>,
    /// Parents of the splits committed last.
    concluded: Vec<LeafId>,
    /// True and parent-interpolated colours at the points where a child is compared with its parent.
    check_colours: Vec3s,
    check_interpolated: Vec3s,
    check_deviation: Vec3s,
}

impl Planner {
    pub(super) fn clear(&mut self) {
        self.splits.clear();
        self.parents.clear();
        self.children.clear();
    }

    /// Makes room for what is planned together as a rule.
    pub(super) fn make_room(&mut self) {
        self.splits.reserve(CHILDREN_AT_ONCE);
        self.parents.reserve(CHILDREN_AT_ONCE);
        self.children.reserve(CHILDREN_AT_ONCE);
        self.concluded.clear();
        self.concluded.reserve(CHILDREN_AT_ONCE);
        for array in [
            &mut self.check_colours,
            &mut self.check_interpolated,
            &mut self.check_deviation,
        ] {
            array.clear();
            array.reserve(SAMPLES_AT_ONCE);
        }
    }

    /// Leaves that will be added if every planned split is committed.
    pub(super) fn planned_leaves(&self) -> usize {
        self.children.len()
    }
}

impl Forest {
    /// Plans to split the marked edges (bit k: from corner k to corner k + 1) of an open leaf, for every leaf that shares
    /// them. `visible_pixels` tells a triangle's; neighbours without any are left alone, nobody sees their side.
    pub fn plan_split(
        &mut self,
        world: &World,
        base_colours: &Vec3s,
        leaf: LeafId,
        marks: u8,
        visible_pixels: impl Fn(u32) -> u32,
    ) -> PlanOutcome {
        if self.leaves[leaf as usize].busy {
            return PlanOutcome::Later;
        }
        match self.plant_neighbours(world, base_colours, leaf, marks, visible_pixels) {
            Neighbours::Ready => {}
            Neighbours::Planted => return PlanOutcome::Later,
            Neighbours::NoRoom => return PlanOutcome::Never,
        }
        let first_parent = self.planner.parents.len();
        let verdict = self.gather_parents(world, leaf, marks, first_parent);
        let leaves_needed = 4 * (self.planner.parents.len() - first_parent);
        let verdict = match verdict {
            PlanOutcome::Planned if !self.has_room(leaves_needed) => PlanOutcome::Never,
            other => other,
        };
        if verdict != PlanOutcome::Planned {
            self.planner.parents.truncate(first_parent);
            return verdict;
        }
        let first_child = self.planner.children.len();
        for index in first_parent..self.planner.parents.len() {
            let (parent, marks) = self.planner.parents[index];
            self.leaves[parent as usize].busy = true;
            self.plan_children(world, base_colours, parent, marks);
        }
        self.planner.splits.push(PlannedSplit {
            initiator: leaf,
            parents: first_parent..self.planner.parents.len(),
            children: first_child..self.planner.children.len(),
        });
        PlanOutcome::Planned
    }

    /// Commits every planned split whose children are estimated to be better than their parents at the same points, and
    /// drops the others. Appends what became of each to `outcomes`, in the order of planning.
    pub fn conclude_splits(&mut self, world: &World, outcomes: &mut Vec<SplitOutcome>) {
        let mut planner = std::mem::take(&mut self.planner);
        planner.concluded.clear();
        for split in &planner.splits {
            let children = &planner.children[split.children.clone()];
            let parents = &planner.parents[split.parents.clone()];
            for &(parent, _) in parents {
                self.leaves[parent as usize].busy = false;
            }
            let total = |error: fn(&PlannedChild) -> f32| {
                children
                    .iter()
                    .map(|child| child.seedling.pixels * error(child))
                    .sum::<f32>()
            };
            let helps = total(|child| child.error.mean_square) < total(|child| child.parent_error);
            // Who asks again for what did not help means it: there is nothing else to be done about the leaf.
            if !helps && self.leaves[split.initiator as usize].splittable {
                outcomes.push(SplitOutcome::Rejected {
                    leaf: split.initiator,
                    error: error_found(split.initiator, children),
                });
                continue;
            }
            let first_parent = planner.concluded.len();
            for &(parent, _) in parents {
                self.retire(world, parent, LeafState::Split);
                planner.concluded.push(parent);
            }
            let first_child = self.leaves.len() as LeafId;
            for child in children {
                self.insert(world, &child.seedling, child.error);
            }
            outcomes.push(SplitOutcome::Committed {
                parents: first_parent..planner.concluded.len(),
                children: first_child..self.leaves.len() as LeafId,
            });
        }
        planner.clear();
        self.planner = planner;
    }

    /// A leaf that was split by the last [`conclude_splits`](Self::conclude_splits).
    ///
    /// # Panics
    /// When `index` is in none of its outcomes.
    #[must_use]
    pub fn split_parent(&self, index: usize) -> LeafId {
        self.planner.concluded[index]
    }

    /// Plants the visible roots on the other side of the marked edges, as far as those are edges of the root.
    fn plant_neighbours(
        &mut self,
        world: &World,
        base_colours: &Vec3s,
        leaf: LeafId,
        marks: u8,
        visible_pixels: impl Fn(u32) -> u32,
    ) -> Neighbours {
        let (triangle, corners) = {
            let leaf = self.leaf(leaf);
            (leaf.triangle, leaf.corners)
        };
        let mut neighbours = Neighbours::Ready;
        for k in (0..3).filter(|k| marks >> k & 1 == 1) {
            let ends = [corners[k], corners[(k + 1) % 3]];
            let Some(side) = (0..3).find(|&i| ends == [Bary::ROOT[i], Bary::ROOT[(i + 1) % 3]])
            else {
                continue;
            };
            for half_edge in world.topology.ring(triangle * 3 + side as u32) {
                let neighbour = half_edge / 3;
                let pixels = visible_pixels(neighbour);
                if pixels == 0 || self.is_planted(neighbour) {
                    continue;
                }
                if self.plant(world, base_colours, neighbour, pixels).is_none() {
                    return Neighbours::NoRoom;
                }
                neighbours = Neighbours::Planted;
            }
        }
        neighbours
    }

    /// Collects the leaf and all others at its marked edges, with their marks.
    fn gather_parents(
        &mut self,
        world: &World,
        leaf: LeafId,
        marks: u8,
        first: usize,
    ) -> PlanOutcome {
        let mut parents = std::mem::take(&mut self.planner.parents);
        let mut mark = |id: LeafId, k: usize| match parents[first..].iter_mut().find(|p| p.0 == id)
        {
            Some(parent) => parent.1 |= 1 << k,
            None => parents.push((id, 1 << k)),
        };
        let mut verdict = PlanOutcome::Never;
        for k in (0..3).filter(|k| marks >> k & 1 == 1) {
            let can_split = self
                .half_edges(world, leaf, k)
                .all(|(id, edge)| self.leaves[id as usize].midpoints[edge] != NONE);
            if can_split {
                verdict = PlanOutcome::Planned;
                mark(leaf, k);
                for (id, edge) in self.half_edges(world, leaf, k) {
                    mark(id, edge);
                }
            }
        }
        if parents[first..]
            .iter()
            .any(|&(id, _)| self.leaves[id as usize].busy)
        {
            verdict = PlanOutcome::Later;
        }
        self.planner.parents = parents;
        verdict
    }

    fn plan_children(&mut self, world: &World, base_colours: &Vec3s, parent: LeafId, marks: u8) {
        let leaf = self.leaf(parent).clone();
        let vertex = |point: usize| match point {
            0..3 => leaf.vertices[point],
            _ => leaf.midpoints[point - 3],
        };
        let corner = |point: usize| match point {
            0..3 => leaf.corners[point],
            // A marked edge has a midpoint on the grid, or it would not be marked.
            _ => Bary::midpoint(leaf.corners[point - 3], leaf.corners[(point - 2) % 3])
                .unwrap_or(leaf.corners[point - 3]),
        };
        let distance = |a: usize, b: usize| {
            let p = self.vertices.position(world, vertex(a));
            let q = self.vertices.position(world, vertex(b));
            (0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum::<f32>()
        };
        let whole = Bary::doubled_area(leaf.corners) as f32;
        for points in template(marks, distance).into_iter().flatten() {
            let corners = points.map(corner);
            let vertices = points.map(vertex);
            let pixels = match &self.shown {
                Some(shown) => shown.pixels(vertices.map(|v| self.vertices.position(world, v))),
                None => leaf.pixels as f32 * (Bary::doubled_area(corners) as f32 / whole),
            };
            let mut seedling = Seedling {
                triangle: leaf.triangle,
                corners,
                vertices,
                midpoints: [NONE; 3],
                pixels,
                samples: 0..0,
            };
            self.prepare(world, base_colours, &mut seedling);
            self.planner.children.push(PlannedChild {
                parent,
                points,
                seedling,
                error: LeafError::NONE,
                parent_error: 0.0,
            });
        }
    }

    /// Estimates the errors of all planned children, and of their parents at the same points.
    pub(super) fn estimate_planned(
        &mut self,
        exec: Exec,
        world: &World,
        encoding: Encoding,
        base_colours: &Vec3s,
    ) {
        let mut planner = std::mem::take(&mut self.planner);
        planner.check_colours.clear();
        planner.check_interpolated.clear();
        for child in &planner.children {
            let parent_colours = self.shown_colours(base_colours, self.leaf(child.parent).vertices);
            let parent_corners = self.positions(world, child.parent);
            let corners = child.points.map(|point| POINTS[point]);
            let mut check = |weights: [f32; 3], colour: [f32; 3]| {
                planner.check_colours.push(colour);
                let in_parent = blend(weights, corners);
                planner.check_interpolated.push(self.shown_blend(
                    in_parent,
                    parent_corners,
                    parent_colours,
                ));
            };
            for k in 0..3 {
                let vertex = child.seedling.midpoints[k];
                let true_colour = if vertex == NONE {
                    let ends = [0, 1].map(|i| child.seedling.vertices[(k + i) % 3]);
                    let [a, b] = ends.map(|v| self.vertices.colour(base_colours, v));
                    std::array::from_fn(|c| (a[c] + b[c]) * 0.5)
                } else {
                    self.vertices.colour(base_colours, vertex)
                };
                check(POINTS[3 + k], true_colour);
            }
            for (index, sample) in child.seedling.samples.clone().enumerate() {
                check(
                    super::estimate::sample_weights(index),
                    self.samples.colour(sample),
                );
            }
        }
        deviations(
            exec.level,
            encoding,
            &planner.check_colours,
            &planner.check_interpolated,
            self.shown
                .map_or_else(Interpolation::default, |shown| shown.interpolation),
            &mut planner.check_deviation,
        );
        let mut next = 0;
        for child in &mut planner.children {
            let samples = child.seedling.samples.clone();
            let deviation = |i: usize| planner.check_deviation.get(next + i);
            let parent_midpoints = self.leaf(child.parent).midpoints;
            // Zero at the parent's own corners, the known surplus in the middle of its edges.
            let corners = child.points.map(|point| match point {
                0..3 => [0.0; 3],
                _ => self.vertices.surplus(parent_midpoints[point - 3]),
            });
            let at_edges = mean_square(corners, [deviation(0), deviation(1), deviation(2)]);
            let inside = LeafError::of_samples((0..samples.len()).map(|i| deviation(3 + i)));
            child.parent_error = at_edges.max(inside.mean_square);
            child.error = self.own_error(child.seedling.midpoints, samples.clone());
            next += 3 + samples.len();
        }
        self.planner = planner;
    }
}

/// The error of a leaf by what the children of a split that did not help have shown.
fn error_found(leaf: LeafId, children: &[PlannedChild]) -> f32 {
    let own = || children.iter().filter(|child| child.parent == leaf);
    let pixels: f32 = own().map(|c| c.seedling.pixels).sum();
    let error: f32 = own().map(|c| c.seedling.pixels * c.parent_error).sum();
    if pixels > 0.0 { error / pixels } else { 0.0 }
}

/// The children of a leaf with the given marked edges, as triples of its six points, counter-clockwise like it.
///
/// Where two edges are marked, what is left of the triangle is a quadrangle; its shorter diagonal by
/// `squared_distance(point, point)` is drawn.
fn template(marks: u8, squared_distance: impl Fn(usize, usize) -> f32) -> [Option<[usize; 3]>; 4] {
    let edge = |k: usize| 3 + k % 3;
    let corner = |k: usize| k % 3;
    match marks & 7 {
        0 => [None; 4],
        7 => [
            Some([0, 3, 5]),
            Some([3, 1, 4]),
            Some([5, 4, 2]),
            Some([3, 4, 5]),
        ],
        1 | 2 | 4 => {
            let k = marks.trailing_zeros() as usize;
            let (a, b, c, m) = (corner(k), corner(k + 1), corner(k + 2), edge(k));
            [Some([a, m, c]), Some([m, b, c]), None, None]
        }
        _ => {
            // Edges k and k + 1 are marked: the corner between them is cut off.
            let unmarked = (!marks & 7).trailing_zeros() as usize;
            let k = (unmarked + 1) % 3;
            let (a, b, c) = (corner(k), corner(k + 1), corner(k + 2));
            let (m, n) = (edge(k), edge(k + 1));
            let cut_off = Some([m, b, n]);
            if squared_distance(a, n) <= squared_distance(m, c) {
                [cut_off, Some([a, m, n]), Some([a, n, c]), None]
            } else {
                [cut_off, Some([a, m, c]), Some([m, n, c]), None]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_template_partitions_the_triangle_and_uses_all_marked_midpoints() {
        let grid = |p: usize| Bary {
            b1: (POINTS[p][1] * f32::from(Bary::UNIT)) as u16,
            b2: (POINTS[p][2] * f32::from(Bary::UNIT)) as u16,
        };
        for marks in 1..8_u8 {
            for flip in [false, true] {
                let distance = |a: usize, b: usize| {
                    if flip {
                        (a + b) as f32
                    } else {
                        -((a + b) as f32)
                    }
                };
                let children: Vec<_> = template(marks, distance).into_iter().flatten().collect();
                let areas: Vec<_> = children
                    .iter()
                    .map(|points| Bary::doubled_area(points.map(grid)))
                    .collect();
                assert!(areas.iter().all(|&area| area > 0), "{marks} {areas:?}");
                assert_eq!(areas.iter().sum::<i32>(), Bary::doubled_area(Bary::ROOT));
                for k in 0..3 {
                    let used = children.iter().flatten().any(|&p| p == 3 + k);
                    assert_eq!(used, marks >> k & 1 == 1, "edge {k} of {marks}");
                }
            }
        }
    }
}
