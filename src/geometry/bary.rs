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

#[cfg(test)]
mod tests {
    use super::*;

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
