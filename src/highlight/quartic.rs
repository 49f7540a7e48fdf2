//! The greatest `r.v` on a triangle from polynomials: second order in its size, and with regard to which way directions turn.
//!
//! Let `N`, `L` and `V` be the normal and the vectors to light and viewer, all linear in the barycentrics `w`. The reflected vector
//! `R = 2 (N.L) N - (N.N) L` has the length `|N|^2 |L|`, so
//!
//! ```text
//! r.v = num / (|N|^2 |L| |V|)     with  num = R.V = 2 (N.L)(N.V) - (N.N)(L.V),
//!     <= num / den if num >= 0    with  den = (N.N)(L.a)(V.b) <= |N|^2 |L| |V|
//! ```
//!
//! for unit vectors `a` and `b` (Cauchy and Schwarz); the cones' axes lose little. Both are homogeneous polynomials of degree four, each
//! product of two quadratic ones. Where `t >= 0` is such that every monomial's coefficient in `num` is at most `t` times that in
//! `den`, `num <= t den` for all `w >= 0`, and `r.v <= t`. The least such `t` is the greatest ratio of coefficients, as long as `den`'s
//! are positive. (They are Bernstein coefficients up to a factor that cancels out, whence the second order.)

use super::cone::Directions;
use glam::DVec3;

/// A homogeneous quadratic polynomial: coefficients of `u^2, uv, uw, v^2, vw, w^2`.
type Quadratic = [f64; 6];

/// One of degree four, in any order of monomials.
type Quartic = [f64; 15];

/// The place of the product of two monomials of degree two.
const PLACE: [[usize; 6]; 6] = [
    [0, 1, 2, 3, 4, 5],
    [1, 3, 4, 6, 7, 8],
    [2, 4, 5, 7, 8, 9],
    [3, 6, 7, 10, 11, 12],
    [4, 7, 8, 11, 12, 13],
    [5, 8, 9, 12, 13, 14],
];

/// Not less than `r.v` anywhere, but for what the directions are padded with; infinite where nothing can be said.
pub(super) fn greatest_reflection(
    to_light: &Directions,
    normal: &Directions,
    to_viewer: &Directions,
) -> f64 {
    let (l, n, v) = (to_light.vectors(), normal.vectors(), to_viewer.vectors());
    let n_n = products(&n, &n);
    let (n_l, n_v) = (products(&n, &l), products(&n, &v));
    let mut num = Quartic::default();
    add_product(&mut num, &n_l.map(|c| 2.0 * c), &n_v);
    add_product(&mut num, &n_n.map(|c| -c), &products(&l, &v));
    let mut den = Quartic::default();
    let along = |x: &[DVec3; 3], axis: DVec3| [x[0].dot(axis), x[1].dot(axis), x[2].dot(axis)];
    let (l_a, v_b) = (along(&l, to_light.axis), along(&v, to_viewer.axis));
    add_product(&mut den, &n_n, &product(l_a, v_b));
    let mut most = 0.0_f64;
    for (num, den) in num.into_iter().zip(den) {
        // False for what is not a number, too.
        if den > 0.0 {
            let ratio = num / den;
            if ratio > most {
                most = ratio;
            }
        } else {
            return f64::INFINITY;
        }
    }
    most
}

/// The scalar product of two linear vectors.
fn products(x: &[DVec3; 3], y: &[DVec3; 3]) -> Quadratic {
    let mixed = |i: usize, j: usize| x[i].dot(y[j]) + x[j].dot(y[i]);
    [
        x[0].dot(y[0]),
        mixed(0, 1),
        mixed(0, 2),
        x[1].dot(y[1]),
        mixed(1, 2),
        x[2].dot(y[2]),
    ]
}

/// The product of two linear numbers.
fn product(x: [f64; 3], y: [f64; 3]) -> Quadratic {
    let mixed = |i: usize, j: usize| x[i] * y[j] + x[j] * y[i];
    [
        x[0] * y[0],
        mixed(0, 1),
        mixed(0, 2),
        x[1] * y[1],
        mixed(1, 2),
        x[2] * y[2],
    ]
}

fn add_product(sum: &mut Quartic, x: &Quadratic, y: &Quadratic) {
    for (x, places) in x.iter().zip(&PLACE) {
        for (y, &place) in y.iter().zip(places) {
            sum[place] += x * y;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_polynomials_have_the_products_of_their_values() {
        let x = [1.0, -2.0, 3.0, 0.5, -1.5, 2.5];
        let y = [0.25, 4.0, -3.0, 1.0, 2.0, -0.5];
        let mut xy = Quartic::default();
        add_product(&mut xy, &x, &y);
        let quadratics = |[u, v, w]: [f64; 3]| [u * u, u * v, u * w, v * v, v * w, w * w];
        let dot = |c: &Quadratic, m: Quadratic| -> f64 { (0..6).map(|i| c[i] * m[i]).sum() };
        for point in [[1.0, 0.0, 0.0], [0.2, 0.3, 0.5], [2.0, -1.0, 0.7]] {
            let squares = quadratics(point);
            // Each quartic monomial by the first pair that makes it.
            let value: f64 = (0..15)
                .map(|place| {
                    let pair = (0..36).find(|k| PLACE[k / 6][k % 6] == place);
                    let pair = pair.expect("every place is some product's");
                    xy[place] * squares[pair / 6] * squares[pair % 6]
                })
                .sum();
            let expected = dot(&x, squares) * dot(&y, squares);
            assert!((value - expected).abs() < 1e-12, "{value} {expected}");
        }
    }
}
