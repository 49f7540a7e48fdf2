//! Exact barycentric coordinates inside a root triangle.
//!
//! Refinement splits a root triangle at edge midpoints only, so the corners of its leaves are dyadic
//! fractions of the root. They are stored in units of 2^-15, as integers, and a pixel's barycentrics are
//! rounded to the same grid: which leaf owns a pixel is then decided in exact integer arithmetic, and every
//! pixel has exactly one.

/// A point of a root triangle: the weights of its second and third corner in units of 1/[`Bary::UNIT`]; the
/// first corner has the rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Bary {
    /// Weight of the second corner.
    pub b1: u16,
    /// Weight of the third corner.
    pub b2: u16,
}

impl Bary {
    /// The weight that stands for 1.
    pub const UNIT: u16 = 1 << 15;

    /// The corners of the root triangle itself.
    pub const ROOT: [Self; 3] = [
        Self { b1: 0, b2: 0 },
        Self {
            b1: Self::UNIT,
            b2: 0,
        },
        Self {
            b1: 0,
            b2: Self::UNIT,
        },
    ];

    /// The three weights as numbers that sum to 1.
    #[inline]
    #[must_use]
    pub fn weights(self) -> [f32; 3] {
        let unit = f32::from(Self::UNIT);
        let (b1, b2) = (f32::from(self.b1) / unit, f32::from(self.b2) / unit);
        // Exact: all three are multiples of 2^-15 in [0, 1].
        [1.0 - b1 - b2, b1, b2]
    }

    /// The point half way between two, or `None` where the grid is too coarse to hold it exactly.
    #[must_use]
    pub fn midpoint(a: Self, b: Self) -> Option<Self> {
        let half = |a: u16, b: u16| {
            let sum = u32::from(a) + u32::from(b);
            (sum % 2 == 0).then_some((sum / 2) as u16)
        };
        Some(Self {
            b1: half(a.b1, b.b1)?,
            b2: half(a.b2, b.b2)?,
        })
    }

    /// The quarters of a triangle, or `None` where the grid is too coarse for them.
    #[must_use]
    pub fn quarters(corners: [Self; 3]) -> Option<[[Self; 3]; 4]> {
        let [a, b, c] = corners;
        let middles = [
            Self::midpoint(a, b)?,
            Self::midpoint(b, c)?,
            Self::midpoint(c, a)?,
        ];
        Some(quarters(corners, middles))
    }

    /// Twice the signed area of triangle `a b c` in grid units; the root's is `UNIT * UNIT`.
    #[must_use]
    pub fn doubled_area([a, b, c]: [Self; 3]) -> i32 {
        let d = |p: Self, q: Self| {
            [
                i32::from(q.b1) - i32::from(p.b1),
                i32::from(q.b2) - i32::from(p.b2),
            ]
        };
        let (u, v) = (d(a, b), d(a, c));
        u[0] * v[1] - u[1] * v[0]
    }
}

/// The quarters of a triangle, turning like it, by its corners and the middles of its edges; middle k is between
/// corners k and k + 1.
#[must_use]
pub fn quarters<T: Copy>([a, b, c]: [T; 3], middles: [T; 3]) -> [[T; 3]; 4] {
    let [ab, bc, ca] = middles;
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// What linear interpolation between three corners gives in the middles of the edges.
#[must_use]
pub fn middles(v: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|k| (v[i][k] + v[(i + 1) % 3][k]) * 0.5))
}

/// The weighted sum of three vectors.
#[must_use]
pub fn blend(weights: [f32; 3], v: [[f32; 3]; 3]) -> [f32; 3] {
    std::array::from_fn(|k| weights[0] * v[0][k] + weights[1] * v[1][k] + weights[2] * v[2][k])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_partition_the_root_and_keep_its_sense() {
        let quarters = Bary::quarters(Bary::ROOT).expect("far above the grid");
        assert_eq!(quarters.map(Bary::doubled_area), [1 << 28; 4]);
        let weights = Bary::ROOT.map(Bary::weights);
        let by_weights = super::quarters(weights, middles(weights));
        assert_eq!(
            quarters.map(|quarter| quarter.map(Bary::weights)),
            by_weights
        );
    }

    #[test]
    fn midpoints_are_exact_until_the_grid_ends() {
        let [a, b, _] = Bary::ROOT;
        let mut q = b;
        for depth in 1..=15 {
            q = Bary::midpoint(a, q).expect("the grid has 15 bits");
            assert_eq!(q.b1, Bary::UNIT >> depth);
        }
        assert_eq!(Bary::midpoint(a, q), None);
    }

    #[test]
    fn root_area_is_the_square_of_the_unit() {
        assert_eq!(Bary::doubled_area(Bary::ROOT), 1 << 30);
        assert_eq!(Bary::ROOT[2].weights(), [0.0, 0.0, 1.0]);
    }
}
