//! Triangles whose colours are quadratics over parts of them.
//!
//! A triangle **divided by `n`** consists of `n^2` equal parts, between lines at `1/n`, `2/n`, ... of each barycentric coordinate. Over each part
//! colours are a quadratic. With `i = floor(n b1)`, `j = floor(n b2)` and the fractions `u`, `v` that are left, a part is *upright* where
//! `u + v <= 1`, else it is the upside-down one that completes the square, for which `u` and `v` count from its other end: `1 - u`, `1 - v`.
//! Quadratics are in these `u`, `v`.
//!
//! **Nodes**, where colours are given, are the points at multiples of `1/(2n)` of `b1` and `b2`: corners of parts, and middles of their
//! edges. A quadratic is determined by the six nodes of its part, and along an edge by the three there: so colours are
//! continuous where parts meet, and where two triangles do if their nodes on the edge agree.

/// A colour, channel by channel, as a quadratic `[1, u, v, u u, u v, v v]`.
pub type PartColours = [[f32; 6]; 3];

/// Most parts along an edge.
pub const MOST_DIVISIONS: u32 = 8;

/// How many nodes a triangle divided by `n` has.
#[must_use]
pub fn node_count(n: u32) -> usize {
    let m = 2 * n as usize;
    (m + 1) * (m + 2) / 2
}

/// How many parts it has.
#[must_use]
pub fn part_count(n: u32) -> usize {
    (n * n) as usize
}

/// The number of the node at `b1 = a / (2 n)`, `b2 = b / (2 n)`.
#[inline]
#[must_use]
pub fn node_index(n: u32, a: u32, b: u32) -> usize {
    // Row `r` has `2 n + 1 - r` nodes.
    let m = 2 * n + 1;
    (a * m - a * a.saturating_sub(1) / 2 + b) as usize
}

/// The number of the part in row `i` and column `j`.
#[inline]
#[must_use]
pub fn part_index(n: u32, i: u32, j: u32, is_upright: bool) -> usize {
    // Row `r` has `2 (n - r) - 1` parts.
    (i * (2 * n - i) + 2 * j) as usize + usize::from(!is_upright)
}

/// Multiples of `1/(2n)` of `b1` and `b2` at the nodes of a part: three corners, the first of which is where `u = v = 0`, then the middles of
/// the edges from the first to the second, from the first to the third, and from the second to the third.
#[inline]
#[must_use]
pub fn part_nodes(i: u32, j: u32, is_upright: bool) -> [[u32; 2]; 6] {
    let (a, b) = (2 * i, 2 * j);
    // An upside-down part begins at the far corner of its square, and goes backwards.
    let (a, b, step) = if is_upright {
        (a, b, 1_u32)
    } else {
        (a + 2, b + 2, u32::MAX)
    };
    let at = |across: u32, down: u32| {
        let along = |from: u32, steps: u32| from.wrapping_add(steps.wrapping_mul(step));
        [along(a, across), along(b, down)]
    };
    [at(0, 0), at(2, 0), at(0, 2), at(1, 0), at(0, 1), at(1, 1)]
}

/// The quadratic through the values of six nodes, ordered like [`part_nodes`].
#[inline]
#[must_use]
pub fn through(nodes: [[f32; 3]; 6]) -> PartColours {
    let [o, p, q, op, oq, pq] = nodes;
    std::array::from_fn(|c| {
        let (o, p, q, op, oq, pq) = (o[c], p[c], q[c], op[c], oq[c], pq[c]);
        let u = 4.0 * op - 3.0 * o - p;
        let v = 4.0 * oq - 3.0 * o - q;
        let uu = 2.0 * (o + p) - 4.0 * op;
        let vv = 2.0 * (o + q) - 4.0 * oq;
        let uv = 4.0 * (pq - o) - 2.0 * (u + v) - uu - vv;
        [o, u, v, uu, uv, vv]
    })
}

/// The colour of a part at `u`, `v`.
#[must_use]
pub fn colour_at(part: &PartColours, u: f32, v: f32) -> [f32; 3] {
    part.map(|[o, a, b, uu, uv, vv]| o + u * (a + u * uu + v * uv) + v * (b + v * vv))
}

/// In which part of a triangle divided by `n` the point with these second and third weights lies, and where in it.
#[must_use]
pub fn locate(n: u32, b1: f32, b2: f32) -> (usize, [f32; 2]) {
    let scaled = [b1, b2].map(|b| b * n as f32);
    let i = (scaled[0].max(0.0) as u32).min(n - 1);
    let j = (scaled[1].max(0.0) as u32).min(n - 1 - i);
    let (u, v) = (scaled[0] - i as f32, scaled[1] - j as f32);
    let is_upright = u + v <= 1.0 || i + j == n - 1;
    let place = if is_upright {
        [u, v]
    } else {
        [1.0 - u, 1.0 - v]
    };
    (part_index(n, i, j, is_upright), place)
}

/// Where the parts of a triangle are.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    triangle: u32,
    divisions: u32,
    first: u32,
}

/// Which triangles are curved, and where their parts are.
#[derive(Clone, Debug, Default)]
pub struct CurvedIndex {
    entries: Vec<Entry>,
    /// By triangle of the world: the place in `entries`, or anything.
    places: Vec<u32>,
}

impl CurvedIndex {
    /// The place of a triangle among those that are curved, if it is.
    #[inline]
    #[must_use]
    pub fn place(&self, triangle: u32) -> Option<usize> {
        let place = *self.places.get(triangle as usize)? as usize;
        let entry = self.entries.get(place)?;
        (entry.triangle == triangle).then_some(place)
    }

    /// By how much a triangle is divided; 0 if it is not curved.
    #[inline]
    #[must_use]
    pub fn divisions(&self, triangle: u32) -> u32 {
        self.place(triangle)
            .map_or(0, |place| self.entries[place].divisions)
    }
}

/// The triangles of an image that have curved colours.
#[derive(Clone, Debug, Default)]
pub struct CurvedTriangles {
    index: CurvedIndex,
    parts: Vec<PartColours>,
}

impl CurvedTriangles {
    /// Makes them none, of a world of so many triangles.
    pub fn clear(&mut self, triangles: usize) {
        self.index.entries.clear();
        self.index.places.resize(triangles, 0);
        self.parts.clear();
    }

    /// Makes room for so many triangles and parts.
    pub fn reserve(&mut self, triangles: usize, parts: usize) {
        self.index.entries.reserve(triangles);
        self.parts.reserve(parts);
    }

    /// True when there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.index.entries.is_empty()
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.index.entries.len()
    }

    /// Which they are.
    #[must_use]
    pub fn index(&self) -> &CurvedIndex {
        &self.index
    }

    /// Adds a triangle of the world that will be divided by `n`; its parts are black.
    ///
    /// # Panics
    /// When it is none of the world's.
    pub fn push(&mut self, triangle: u32, n: u32) {
        self.index.places[triangle as usize] = self.index.entries.len() as u32;
        let first = self.parts.len();
        self.index.entries.push(Entry {
            triangle,
            divisions: n,
            first: first as u32,
        });
        self.parts
            .resize(first + part_count(n), PartColours::default());
    }

    /// Which they are, and the parts of all of them in the order in which they were added.
    pub fn split_mut(&mut self) -> (&CurvedIndex, &mut [PartColours]) {
        (&self.index, &mut self.parts)
    }

    /// By how much a triangle is divided, and its parts; `None` if it is not curved.
    #[inline]
    #[must_use]
    pub fn get(&self, triangle: u32) -> Option<(u32, &[PartColours])> {
        let entry = self.index.entries[self.index.place(triangle)?];
        let first = entry.first as usize;
        let parts = self.parts.get(first..first + part_count(entry.divisions))?;
        Some((entry.divisions, parts))
    }

    /// The colour of a curved triangle at a point with these second and third weights.
    #[must_use]
    pub fn colour(&self, triangle: u32, b1: f32, b2: f32) -> Option<[f32; 3]> {
        let (n, parts) = self.get(triangle)?;
        let (part, [u, v]) = locate(n, b1, b2);
        Some(colour_at(&parts[part], u, v))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn function(b1: f32, b2: f32) -> [f32; 3] {
        [
            1.0 + 2.0 * b1 - 3.0 * b2 + 4.0 * b1 * b2 - b1 * b1 + 2.0 * b2 * b2,
            b1,
            0.25,
        ]
    }

    fn divided(n: u32, f: impl Fn(f32, f32) -> [f32; 3]) -> CurvedTriangles {
        let m = 2 * n;
        let mut nodes = vec![[0.0; 3]; node_count(n)];
        for (a, b) in (0..=m).flat_map(|a| (0..=m - a).map(move |b| (a, b))) {
            nodes[node_index(n, a, b)] = f(a as f32 / m as f32, b as f32 / m as f32);
        }
        let mut curved = CurvedTriangles::default();
        curved.clear(10);
        curved.push(3, 1);
        curved.push(7, n);
        for i in 0..n {
            for j in 0..n - i {
                for is_upright in [true, false] {
                    if is_upright || i + j < n - 1 {
                        let six =
                            part_nodes(i, j, is_upright).map(|[a, b]| nodes[node_index(n, a, b)]);
                        curved.split_mut().1[1 + part_index(n, i, j, is_upright)] = through(six);
                    }
                }
            }
        }
        curved
    }

    #[test]
    fn numbers_of_nodes_and_parts_are_used_once_each() {
        for n in [1, 2, 4, 8] {
            let m = 2 * n;
            let nodes = (0..=m).flat_map(|a| (0..=m - a).map(move |b| node_index(n, a, b)));
            assert!(nodes.eq(0..node_count(n)));
            let parts = (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j)));
            let parts = parts.flat_map(|(i, j)| {
                let both = [true, false].map(|upright| part_index(n, i, j, upright));
                both.into_iter().take(if i + j < n - 1 { 2 } else { 1 })
            });
            assert!(parts.eq(0..part_count(n)));
        }
    }

    #[test]
    fn quadratics_are_reproduced_and_others_are_continuous() {
        for n in [1, 2, 4, 8] {
            let curved = divided(n, function);
            let wavy = divided(n, |b1, b2| {
                [(9.0 * b1).sin(), (7.0 * b2).cos(), b1 * b2 * b2]
            });
            for i in 0..=97_u32 {
                for j in 0..=97 - i {
                    let (b1, b2) = (i as f32 / 97.0, j as f32 / 97.0);
                    let got = curved.colour(7, b1, b2).expect("it is curved");
                    for (got, want) in got.iter().zip(function(b1, b2)) {
                        assert!((got - want).abs() < 1e-5, "{n}: {got} {want} at {b1} {b2}");
                    }
                    let here = wavy.colour(7, b1, b2).expect("it is curved");
                    let near = wavy.colour(7, b1 + 1e-4, (b2 - 1e-4).max(0.0));
                    for (a, b) in here.iter().zip(near.expect("it is curved")) {
                        assert!((a - b).abs() < 4e-3, "{n}: {a} beside {b} at {b1} {b2}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_triangle_that_is_not_curved_is_not_found() {
        let mut curved = divided(2, function);
        assert!(curved.get(7).is_some() && curved.get(3).is_some());
        assert!(curved.get(0).is_none() && curved.get(4).is_none() && curved.get(99).is_none());
        curved.clear(10);
        assert!(curved.is_empty() && curved.get(7).is_none());
    }
}
