//! The colours of a patch's pixels: interpolated, or from the illumination equation.

use super::lanes::{Corners3, Lanes3, interpolate, splat3};
use crate::geometry::{Bary, Quadratic};
use crate::illumination::{ActiveLights, ShadingKit, shade_lanes};
use crate::simd::Simd;
use fearless_simd::{SimdBase, SimdFloat};

/// How a patch gets its linear colours.
pub(super) trait PatchFill {
    /// The colours at the weights of the root triangle's corners.
    fn colours<S: Simd>(&self, simd: S, w: Lanes3<S>) -> Lanes3<S>;
}

/// Corner colours, interpolated in the patch: never beyond what lies between them, however small the patch and however
/// roundly a pixel belongs to it.
pub(super) struct GouraudFill {
    /// Second and third weight of the patch's first corner.
    origin: [f32; 2],
    /// The patch's weights of its second and third corner from the root's, less the origin.
    local_from_root: [[f32; 2]; 2],
    /// The first corner's colour, and how those of the others differ.
    colours: Corners3,
}

impl GouraudFill {
    /// Needs a patch with positive area.
    #[inline(always)]
    pub(super) fn new(corners: [Bary; 3], colours: Corners3) -> Self {
        let [p, q, r] = corners.map(|c| {
            let [_, b1, b2] = c.weights();
            [b1, b2]
        });
        // Exact; what the area divides is rounded twice.
        let (u, v) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
        let unit = f64::from(Bary::UNIT);
        let scale = (unit * unit / f64::from(Bary::doubled_area(corners))) as f32;
        let [a, b, c] = colours;
        let minus = |v: [f32; 3]| [v[0] - a[0], v[1] - a[1], v[2] - a[2]];
        Self {
            origin: p,
            local_from_root: [[v[1] * scale, -v[0] * scale], [-u[1] * scale, u[0] * scale]],
            colours: [a, minus(b), minus(c)],
        }
    }
}

impl PatchFill for GouraudFill {
    #[inline(always)]
    fn colours<S: Simd>(&self, simd: S, w: Lanes3<S>) -> Lanes3<S> {
        let (u, v) = (w[1] - self.origin[0], w[2] - self.origin[1]);
        let [to_second, to_third] = self.local_from_root;
        let one = S::f32s::splat(simd, 1.0);
        let second = u.mul_add(to_second[0], v * to_second[1]).max(0.0).min(one);
        let most = one - second;
        let third = u.mul_add(to_third[0], v * to_third[1]).max(0.0).min(most);
        let [a, b, c] = self.colours;
        let mut out = [second; 3];
        for (i, out) in out.iter_mut().enumerate() {
            let in_second = second.mul_add(S::f32s::splat(simd, b[i]), S::f32s::splat(simd, a[i]));
            *out = third.mul_add(S::f32s::splat(simd, c[i]), in_second);
        }
        out
    }
}

/// The illumination equation under some lights, and the rest as a quadratic.
pub(super) struct PhongFill<'a> {
    /// Viewer, material and lights.
    pub kit: ShadingKit<'a>,
    /// The terms to evaluate.
    pub lights: ActiveLights,
    /// Of the root's corners.
    pub positions: Corners3,
    /// Of the root's corners.
    pub normals: Corners3,
    /// What to add, over the root.
    pub remainder: Quadratic,
}

/// The value of a quadratic, whose bulges are left out where there are none.
#[inline(always)]
fn quadratic<S: Simd>(simd: S, w: Lanes3<S>, q: &Quadratic) -> Lanes3<S> {
    let mut out = interpolate(simd, w, &q.corners);
    if q.is_linear() {
        return out;
    }
    let four = S::f32s::splat(simd, 4.0);
    let [a, b, c] = [w[0] * four, w[1] * four, w[2] * four];
    let bulges = [a * w[1], b * w[2], c * w[0]];
    for (i, out) in out.iter_mut().enumerate() {
        let [a, b, c] = splat3(simd, [q.surplus[0][i], q.surplus[1][i], q.surplus[2][i]]);
        *out = bulges[2].mul_add(c, bulges[1].mul_add(b, bulges[0].mul_add(a, *out)));
    }
    out
}

impl PatchFill for PhongFill<'_> {
    #[inline(always)]
    fn colours<S: Simd>(&self, simd: S, w: Lanes3<S>) -> Lanes3<S> {
        let point = interpolate(simd, w, &self.positions);
        let normal = interpolate(simd, w, &self.normals);
        let shaded = shade_lanes(simd, &self.kit, &self.lights, point, normal);
        let rest = quadratic(simd, w, &self.remainder);
        [
            shaded[0] + rest[0],
            shaded[1] + rest[1],
            shaded[2] + rest[2],
        ]
    }
}
