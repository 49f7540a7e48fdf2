//! Colours that vary over a triangle as quadratics.
//!
//! With barycentric coordinates `w`, and edge `k` from corner `k` to corner `k + 1`, the quadratic with given values at the corners and at the
//! middles of the edges is `sum w_i c_i + sum 4 w_k w_(k+1) s_k`: linear interpolation, and on each edge a **bulge** that is `s_k`,
//! the *surplus*, in its middle and zero on the other two edges. Along an edge it depends on the three values there alone, so it is
//! continuous where two triangles share them. (The hierarchical basis of the quadratic finite element.)

use super::bary;

/// A colour, or three other values, as a quadratic over a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quadratic {
    /// Values at the corners.
    pub corners: [[f32; 3]; 3],
    /// Of each edge, the value in its middle less the mean of its ends'.
    pub surplus: [[f32; 3]; 3],
}

impl Quadratic {
    /// Linear between the corners.
    #[must_use]
    pub fn linear(corners: [[f32; 3]; 3]) -> Self {
        Self {
            corners,
            surplus: [[0.0; 3]; 3],
        }
    }

    /// Through values at the corners and in the middle of each edge.
    #[must_use]
    pub fn through(corners: [[f32; 3]; 3], middles: [[f32; 3]; 3]) -> Self {
        let means = bary::middles(corners);
        let surplus = std::array::from_fn(|k| {
            std::array::from_fn(|channel| middles[k][channel] - means[k][channel])
        });
        Self { corners, surplus }
    }

    /// Whether no edge has a bulge.
    #[must_use]
    pub fn is_linear(&self) -> bool {
        self.surplus == [[0.0; 3]; 3]
    }

    /// The value at a point, by its barycentric coordinates.
    #[must_use]
    pub fn at(&self, w: [f32; 3]) -> [f32; 3] {
        let bulges: [f32; 3] = std::array::from_fn(|k| 4.0 * w[k] * w[(k + 1) % 3]);
        std::array::from_fn(|channel| {
            let linear: f32 = (0..3).map(|i| w[i] * self.corners[i][channel]).sum();
            let bulge: f32 = (0..3).map(|k| bulges[k] * self.surplus[k][channel]).sum();
            linear + bulge
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Any quadratic in the second and third weight.
    fn function([_, u, v]: [f32; 3]) -> [f32; 3] {
        [
            1.0 + 2.0 * u - 3.0 * v + 4.0 * u * v - u * u + 2.0 * v * v,
            u * u,
            0.25,
        ]
    }

    const MIDDLES: [[f32; 3]; 3] = [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]];
    const CORNERS: [[f32; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn quadratics_are_reproduced() {
        let quadratic = Quadratic::through(CORNERS.map(function), MIDDLES.map(function));
        for w in [[0.2, 0.3, 0.5], [0.0, 0.9, 0.1], [1.0 / 3.0; 3]] {
            let (got, want) = (quadratic.at(w), function(w));
            for channel in 0..3 {
                assert!(
                    (got[channel] - want[channel]).abs() < 1e-6,
                    "{got:?} {want:?}"
                );
            }
        }
        assert!(!quadratic.is_linear());
    }

    #[test]
    fn an_edge_depends_on_its_own_values_alone() {
        let quadratic = Quadratic::through(CORNERS.map(function), MIDDLES.map(function));
        let mut other = quadratic;
        other.corners[2] = [7.0; 3];
        other.surplus[1] = [5.0; 3];
        other.surplus[2] = [-5.0; 3];
        for i in 0..=8 {
            let w = [1.0 - i as f32 / 8.0, i as f32 / 8.0, 0.0];
            assert_eq!(quadratic.at(w), other.at(w));
        }
        assert!(Quadratic::linear(CORNERS).is_linear());
        assert_eq!(
            Quadratic::linear(CORNERS).at([0.2, 0.3, 0.5]),
            [0.2, 0.3, 0.5]
        );
    }
}
