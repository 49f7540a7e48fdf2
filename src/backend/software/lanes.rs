//! Barycentric coordinates in lanes, and what is interpolated with them; shared by [`resolve`](super::resolve) and
//! [`repaint`](super::repaint), so that both give a pixel the same bits.
//!
//! The lane form of [`Interpolator::at_pixel`]: `e_i = max(0, a_i dx + b_i dy + c_i)`, `w_i = e_i / (e_0 + e_1 + e_2)`. Where no
//! edge plane is positive (a triangle seen edge-on; not a number) the weights are a third each. A sum below
//! [`LEAST_SUM`] counts as zero, since its reciprocal might overflow; the coefficients are scaled to a largest of 1.

use crate::geometry::Vec3s;
use crate::geometry::curved::PartColours;
use crate::geometry::screen::Interpolator;
use crate::simd::Simd;
use fearless_simd::{Select, SimdBase, SimdFloat, SimdInt, SimdMask};

/// Sums of edge planes below this count as zero.
const LEAST_SUM: f32 = 1e-30;

/// Three values in lanes: a point, a vector, a colour or weights.
pub(super) type Lanes3<S> = [<S as Simd>::f32s; 3];

/// Three values of the three corners of a triangle.
pub(super) type Corners3 = [[f32; 3]; 3];

/// The corners' values of a vertex attribute.
#[inline(always)]
pub(super) fn gather(attribute: &Vec3s, triangle: [u32; 3]) -> Corners3 {
    [
        attribute.get(triangle[0] as usize),
        attribute.get(triangle[1] as usize),
        attribute.get(triangle[2] as usize),
    ]
}

/// The same three values in all lanes.
#[inline(always)]
pub(super) fn splat3<S: Simd>(simd: S, v: [f32; 3]) -> Lanes3<S> {
    [
        S::f32s::splat(simd, v[0]),
        S::f32s::splat(simd, v[1]),
        S::f32s::splat(simd, v[2]),
    ]
}

/// `mask ? a : b`.
#[inline(always)]
pub(super) fn select3<S: Simd>(mask: S::mask32s, a: Lanes3<S>, b: Lanes3<S>) -> Lanes3<S> {
    [
        mask.select(a[0], b[0]),
        mask.select(a[1], b[1]),
        mask.select(a[2], b[2]),
    ]
}

/// The weights of a triangle's corners at any pixels, given as whole numbers of pixels to the right of the anchor and down.
#[inline(always)]
pub(super) fn weights_at<S: Simd>(
    simd: S,
    planes: &Interpolator,
    dx: S::f32s,
    dy: S::f32s,
) -> Lanes3<S> {
    let zero = S::f32s::splat(simd, 0.0);
    let mut e = [zero; 3];
    for (i, e) in e.iter_mut().enumerate() {
        let [a, b, c] = splat3(simd, [planes.a[i], planes.b[i], planes.c[i]]);
        // What is not a number becomes zero, or else makes the sum none.
        *e = a.mul_add(dx, b.mul_add(dy, c)).max(zero);
    }
    let sum = e[0] + e[1] + e[2];
    let usable = sum.simd_gt(S::f32s::splat(simd, LEAST_SUM));
    let scale = S::f32s::splat(simd, 1.0) / sum;
    let weights = [e[0] * scale, e[1] * scale, e[2] * scale];
    if usable.all_true() {
        return weights;
    }
    let third = S::f32s::splat(simd, 1.0 / 3.0);
    select3::<S>(usable, weights, [third; 3])
}

/// The corners' values weighted.
#[inline(always)]
pub(super) fn interpolate<S: Simd>(simd: S, w: Lanes3<S>, corners: &Corners3) -> Lanes3<S> {
    let mut out = w;
    for (i, out) in out.iter_mut().enumerate() {
        let [a, b, c] = splat3(simd, [corners[0][i], corners[1][i], corners[2][i]]);
        *out = w[2].mul_add(c, w[1].mul_add(b, w[0] * a));
    }
    out
}

/// A part of a triangle, in which the next pixels lie as a rule.
#[derive(Clone, Copy, Debug)]
pub(super) struct PartHint {
    number: usize,
    /// Row and column.
    at: [f32; 2],
    is_upright: bool,
}

impl PartHint {
    /// The first part.
    pub(super) const FIRST: Self = Self {
        number: 0,
        at: [0.0; 2],
        is_upright: true,
    };
}

/// Colours of a triangle divided by `n`, in the lanes of `mask`; in others what there was before. See [`curved`](crate::geometry::curved).
/// The hint saves time and changes nothing; it must be of the same triangle.
#[inline(always)]
pub(super) fn curved_colours<S: Simd>(
    simd: S,
    w: Lanes3<S>,
    n: u32,
    parts: &[PartColours],
    hint: &mut PartHint,
    mask: S::mask32s,
    before: Lanes3<S>,
) -> Lanes3<S> {
    if n == 1 {
        return select3::<S>(mask, part_colours(simd, &parts[0], w[1], w[2]), before);
    }
    let one = S::f32s::splat(simd, 1.0);
    let (across, down) = (w[1] * n as f32, w[2] * n as f32);

    let (u, v) = (across - hint.at[0], down - hint.at[1]);
    let (least, most) = (u.min(v), u.max(v));
    let is_upright = (u + v).simd_le(one).to_bitmask();
    let in_square = (least.simd_ge(0.0) & most.simd_lt(1.0)).to_bitmask();
    let of_kind = if hint.is_upright {
        is_upright
    } else {
        !is_upright
    };
    if mask.to_bitmask() & !(in_square & of_kind) == 0 {
        let (u, v) = if hint.is_upright {
            (u, v)
        } else {
            (one - u, one - v)
        };
        let colour = part_colours(simd, &parts[hint.number], u, v);
        return select3::<S>(mask, colour, before);
    }

    let most = n as i32 - 1;
    let i = across.to_int::<S::i32s>().min(most);
    let j = down.to_int::<S::i32s>().min(S::i32s::splat(simd, most) - i);
    let (row, column) = (i.to_float::<S::f32s>(), j.to_float::<S::f32s>());
    let (u, v) = (across - row, down - column);
    let upright = (u + v).simd_le(one) | (i + j).simd_eq(most);
    let (u, v) = (upright.select(u, one - u), upright.select(v, one - v));
    let of_row = i * (S::i32s::splat(simd, 2 * n as i32) - i);
    let (zero, upside_down) = (S::i32s::splat(simd, 0), S::i32s::splat(simd, 1));
    let part = of_row + j + j + upright.select(zero, upside_down);
    // The parts in the vector, one after the other: few as a rule.
    let (mut left, mut out) = (mask.to_bitmask(), before);
    let numbers = part.as_slice();
    while left != 0 {
        let lane = left.trailing_zeros() as usize;
        let number = numbers[lane];
        let alike = part.simd_eq(number);
        let colour = part_colours(simd, &parts[number as usize], u, v);
        out = select3::<S>(alike & mask, colour, out);
        left &= !alike.to_bitmask();
        if left == 0 {
            *hint = PartHint {
                number: number as usize,
                at: [row.as_slice()[lane], column.as_slice()[lane]],
                is_upright: upright.to_bitmask() >> lane & 1 == 1,
            };
        }
    }
    out
}

/// The quadratic of a part.
#[inline(always)]
fn part_colours<S: Simd>(simd: S, part: &PartColours, u: S::f32s, v: S::f32s) -> Lanes3<S> {
    let mut out = [u; 3];
    for (out, [o, a, b, uu, uv, vv]) in out.iter_mut().zip(part) {
        let splat = |value: &f32| S::f32s::splat(simd, *value);
        let of_u = u.mul_add(splat(uu), v.mul_add(splat(uv), splat(a)));
        let of_v = v.mul_add(splat(vv), splat(b));
        *out = u.mul_add(of_u, v.mul_add(of_v, splat(o)));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::screen::TrianglePlanes;
    use crate::simd::{SimdLevel, dispatch};

    #[inline(always)]
    fn weights_at<S: Simd>(simd: S, planes: &Interpolator, x: i32, y: i32) -> Vec<[f32; 3]> {
        let dx = S::f32s::from_fn(simd, |i| (x + i as i32 - planes.anchor[0]) as f32);
        let dy = S::f32s::splat(simd, (y - planes.anchor[1]) as f32);
        let w = super::weights_at(simd, planes, dx, dy);
        (0..S::f32s::LEN)
            .map(|i| [w[0].as_slice()[i], w[1].as_slice()[i], w[2].as_slice()[i]])
            .collect()
    }

    #[test]
    fn lanes_agree_with_the_scalar_rule() {
        let p = |x: f64, y: f64, w: f64| [x * w, y * w, 0.5 * w, w];
        let ordinary = [p(3.2, 1.7, 1.0), p(90.4, 20.1, 4.0), p(7.9, 60.6, 2.5)];
        let edge_on = [p(3.0, 3.0, 1.0), p(9.0, 9.0, 1.0), p(5.0, 5.0, 2.0)];
        let behind = [p(3.2, 1.7, 1.0), p(90.4, 20.1, -4.0), p(7.9, 60.6, 2.5)];
        let nan = Interpolator {
            a: [f32::NAN; 3],
            ..Interpolator::default()
        };
        let all = [ordinary, edge_on, behind]
            .map(|t| TrianglePlanes::new(t).interpolator([3, 2]))
            .into_iter()
            .chain([nan]);
        for planes in all {
            for level in SimdLevel::available().filter_map(SimdLevel::token) {
                for y in 0..64 {
                    let got = dispatch!(level, simd => weights_at(simd, &planes, -4, y));
                    for (x, got) in (-4..).zip(got) {
                        let want = planes.at_pixel(x, y);
                        for i in 0..3 {
                            assert!((got[i] - want[i]).abs() < 1e-5, "{got:?} {want:?}");
                        }
                    }
                }
            }
        }
    }
}
