//! The nodes of one triangle: their colours, and the errors that coarser divisions make at them.

use super::for_each_part;
use crate::geometry::Vec3s;
use crate::geometry::curved::{self, MOST_DIVISIONS, PartColours, node_index};
use crate::output::Encoding;
use crate::refine::estimate::squared_codes;

/// Rows of nodes of the finest division.
const MOST_ROWS: usize = 2 * MOST_DIVISIONS as usize + 1;

/// Colours at the nodes of a triangle.
#[derive(Clone, Copy)]
pub(super) struct Nodes<'a> {
    colours: [&'a [f32]; 3],
    /// The triangle is divided by so much.
    finest: u32,
    /// Where its rows of nodes begin.
    rows: [u16; MOST_ROWS],
}

/// What a test point takes of each node of a part, ordered like [`part_nodes`](curved::part_nodes), and where it is, in quarters of the
/// part's edges. They are nodes of the next finer division well inside a part: three of the nine that are not its own.
const TESTS: [([f32; 6], [u32; 2]); 3] = [
    ([0.0, -0.125, -0.125, 0.5, 0.5, 0.25], [1, 1]),
    ([-0.125, 0.0, -0.125, 0.5, 0.25, 0.5], [2, 1]),
    ([-0.125, -0.125, 0.0, 0.25, 0.5, 0.5], [1, 2]),
];

impl<'a> Nodes<'a> {
    /// Nodes of a triangle divided by `finest`, the first of which is number `first`.
    pub(super) fn new(colours: &'a Vec3s, first: usize, finest: u32) -> Self {
        let range = first..first + curved::node_count(finest);
        let mut rows = [0; MOST_ROWS];
        for (row, at) in (0..=2 * finest).zip(&mut rows) {
            *at = node_index(finest, row, 0) as u16;
        }
        Self {
            colours: [&colours.x, &colours.y, &colours.z].map(|c| &c[range.clone()]),
            finest,
            rows,
        }
    }

    /// A node of the triangle divided by `n`.
    #[inline(always)]
    pub(super) fn at(&self, n: u32, [a, b]: [u32; 2]) -> [f32; 3] {
        let step = self.finest / n;
        let place = usize::from(self.rows[(a * step) as usize]) + (b * step) as usize;
        let [x, y, z] = self.colours;
        [x[place], y[place], z[place]]
    }

    /// The nodes of a part of the triangle divided by `n`.
    #[inline(always)]
    fn of_part(&self, n: u32, [i, j]: [u32; 2], is_upright: bool) -> [[f32; 3]; 6] {
        let [o, p, q, op, oq, pq] = curved::part_nodes(i, j, is_upright);
        let at = |node| self.at(n, node);
        [at(o), at(p), at(q), at(op), at(oq), at(pq)]
    }

    /// The quadratic over a part of the triangle divided by `n`.
    #[inline(always)]
    pub(super) fn part(&self, n: u32, at: [u32; 2], is_upright: bool) -> PartColours {
        curved::through(self.of_part(n, at, is_upright))
    }

    /// Mean squared error of Gouraud shading, at the middles of the edges.
    pub(super) fn linear_error(&self, encoding: Encoding) -> f32 {
        let corners = [[0, 0], [2, 0], [0, 2]].map(|node| self.at(1, node));
        let middles = [[1, 0], [1, 1], [0, 1]].map(|node| self.at(1, node));
        let mut sum = 0.0;
        for (k, middle) in middles.into_iter().enumerate() {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let off = std::array::from_fn(|c| (a[c] + b[c]) * 0.5 - middle[c]);
            sum += squared_codes(encoding, middle, off);
        }
        // A quadratic that is as large in the middles of the edges has so much of their mean square; see `estimate`.
        sum * (8.0 / 45.0 * 2.0)
    }

    /// Mean squared error of division by `n`, at nodes of the next finer one.
    pub(super) fn error_of(&self, encoding: Encoding, n: u32) -> f32 {
        let mut sum = 0.0;
        for_each_part(n, |[i, j], is_upright| {
            let six = self.of_part(n, [i, j], is_upright);
            for (shares, [p, q]) in TESTS {
                let node = if is_upright {
                    [4 * i + p, 4 * j + q]
                } else {
                    [4 * i + 4 - p, 4 * j + 4 - q]
                };
                let want = self.at(2 * n, node);
                let mut off = want.map(|value| -value);
                for (node, share) in six.iter().zip(shares) {
                    for (off, value) in off.iter_mut().zip(node) {
                        *off += value * share;
                    }
                }
                sum += squared_codes(encoding, want, off);
            }
        });
        sum / (TESTS.len() * curved::part_count(n)) as f32
    }
}
