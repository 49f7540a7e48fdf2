//! The second pass: values on edges that coarser triangles share, then the quadratics.

use super::{Job, Share, for_each_part};
use crate::geometry::Vec3s;
use crate::geometry::curved::{
    self, CurvedIndex, MOST_DIVISIONS, PartColours, node_index, part_index, part_nodes,
};
use crate::parallel::Exec;
use crate::scene::World;

/// Neighbours of fewer pixels may have a step at the common edge, which is as short.
const LEAST_NEIGHBOUR: u32 = 8;

/// Nodes of the finest division.
const MOST_NODES: usize = 153;

/// What finding the quadratics takes.
pub(super) struct Fitting<'a> {
    pub(super) exec: Exec,
    pub(super) world: &'a World,
    pub(super) index: &'a CurvedIndex,
    pub(super) pixels: &'a (dyn Fn(u32) -> u32 + Sync),
}

impl Fitting<'_> {
    /// Finds the quadratics of shares, whose parts these are.
    pub(super) fn fit(&self, shares: &[Share], parts: &mut [PartColours]) {
        match shares {
            [] => {}
            [share] => self.fit_share(share, parts),
            _ => {
                let (left, right) = shares.split_at(shares.len() / 2);
                let cut = left.iter().map(|share| share.parts).sum();
                let (left_parts, right_parts) = parts.split_at_mut(cut);
                self.exec.join(
                    || self.fit(left, left_parts),
                    || self.fit(right, right_parts),
                );
            }
        }
    }

    fn fit_share(&self, share: &Share, mut parts: &mut [PartColours]) {
        for job in &share.jobs {
            let count = curved::part_count(job.divisions);
            let (own, others) = std::mem::take(&mut parts).split_at_mut(count);
            self.fit_triangle(job, &share.colours, own);
            parts = others;
        }
    }

    fn fit_triangle(&self, job: &Job, colours: &Vec3s, parts: &mut [PartColours]) {
        let n = job.divisions;
        let nodes = job.nodes(colours);
        let edges = [0, 1, 2].map(|edge| self.divisions_at(job, edge));
        if edges.iter().all(|&divisions| divisions == n) {
            for_each_part(n, |[i, j], is_upright| {
                parts[part_index(n, i, j, is_upright)] = nodes.part(n, [i, j], is_upright);
            });
            return;
        }
        let mut changed = [[0.0; 3]; MOST_NODES];
        for a in 0..=2 * n {
            for b in 0..=2 * n - a {
                changed[node_index(n, a, b)] = nodes.at(n, [a, b]);
            }
        }
        for (edge, coarser) in (0..).zip(edges) {
            if coarser < n {
                coarsen_edge(n, coarser, |q| edge_node(n, edge, q), &mut changed);
            }
        }
        for_each_part(n, |[i, j], is_upright| {
            let six = part_nodes(i, j, is_upright).map(|[a, b]| changed[node_index(n, a, b)]);
            parts[part_index(n, i, j, is_upright)] = curved::through(six);
        });
    }

    /// By how much an edge is divided: as by the coarsest triangle that has it.
    fn divisions_at(&self, job: &Job, edge: u32) -> u32 {
        let ends = |half_edge: u32| {
            let corners = self.world.triangles[half_edge as usize / 3];
            let edge = half_edge as usize % 3;
            let [a, b] = [corners[edge], corners[(edge + 1) % 3]];
            [a.min(b), a.max(b)]
        };
        let own = job.triangle * 3 + edge;
        let mut least = job.divisions;
        for other in self.world.topology.ring(own).filter(|&h| h != own) {
            let triangle = other / 3;
            if ends(other) == ends(own) && (self.pixels)(triangle) >= LEAST_NEIGHBOUR {
                least = least.min(self.index.divisions(triangle));
            }
        }
        least
    }
}

/// The node `q` steps along an edge of a triangle divided by `n`.
fn edge_node(n: u32, edge: u32, q: u32) -> usize {
    let m = 2 * n;
    match edge {
        0 => node_index(n, q, 0),
        1 => node_index(n, m - q, q),
        _ => node_index(n, 0, m - q),
    }
}

/// Gives the nodes on an edge of a triangle divided by `n` the values they have where it is divided by `coarser`.
fn coarsen_edge(n: u32, coarser: u32, at: impl Fn(u32) -> usize, nodes: &mut [[f32; 3]]) {
    let m = 2 * n;
    let steps = m.checked_div(coarser).unwrap_or(m);
    for first in (0..m).step_by(steps as usize) {
        let [a, c, b] = [first, first + steps / 2, first + steps].map(|q| nodes[at(q)]);
        for q in first + 1..first + steps {
            let x = (q - first) as f32 / steps as f32;
            let [of_a, of_c, of_b] = if coarser == 0 {
                [1.0 - x, 0.0, x]
            } else {
                [
                    (1.0 - x) * (1.0 - 2.0 * x),
                    4.0 * x * (1.0 - x),
                    x * (2.0 * x - 1.0),
                ]
            };
            nodes[at(q)] = std::array::from_fn(|k| of_a * a[k] + of_c * c[k] + of_b * b[k]);
        }
    }
}

const _: () =
    assert!(MOST_NODES == (2 * MOST_DIVISIONS as usize + 1) * (MOST_DIVISIONS as usize + 1));
