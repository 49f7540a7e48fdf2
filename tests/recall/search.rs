//! Where on a triangle a light's terms are farthest from what is interpolated: samples, and climbing from the best of them.
//!
//! At an exponent of 100,000 a highlight is a thousandth of a triangle wide, and samples would miss it. But its base,
//! `r.v` or `n.h`, is as smooth as ever: climbing that leads to the highlight, and climbing the deviation from there to the worst point.

use super::cases::{Case, blend};
use specula::illumination::ActiveLights;
use specula::illumination::reference::factors;
use specula::output::Encoding;
use specula::scene::{ShadingLight, ShadingMaterial};

/// How much is done.
#[derive(Clone, Copy)]
pub(crate) struct Effort {
    /// Parts of an edge between samples.
    parts: usize,
    /// Most evaluations of a climb.
    climb: usize,
}

/// For one triangle among a million.
pub(crate) const THOROUGH: Effort = Effort {
    parts: 6,
    climb: 60,
};

/// For one of a hundred lights on each triangle of a scene.
pub(crate) const QUICK: Effort = Effort {
    parts: 4,
    climb: 30,
};

/// The last step of a climb, in barycentric coordinates.
const LAST_STEP: f64 = 1e-4;

/// A point and what is there.
#[derive(Clone, Copy)]
struct Point {
    w: [f64; 3],
    /// `r.v` or `n.h` where that is positive and the light is in front.
    base: f64,
    /// Diffuse and specular factor.
    values: [f64; 2],
    /// What they differ from the interpolated ones.
    off: [f64; 2],
}

/// What was found.
pub(crate) struct Worst {
    /// Least and greatest diffuse factor.
    pub(crate) diffuse: [f64; 2],
    /// Least and greatest specular factor.
    pub(crate) specular: [f64; 2],
    /// Greatest differences from interpolation: diffuse, specular.
    pub(crate) deviation: [f64; 2],
    /// The points of these, and where both together are greatest.
    points: [Point; 3],
}

impl Worst {
    /// Factors and their differences from interpolation at the worst points.
    pub(crate) fn points(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
        self.points.iter().map(|point| (point.values, point.off))
    }
}

struct Search<'a> {
    case: &'a Case,
    light: &'a ShadingLight,
    /// With the exponent 1, for which the specular factor is the base.
    linear: ShadingMaterial,
    corners: [[f64; 2]; 3],
    /// Diffuse and specular coefficient, roughly.
    weights: [f64; 2],
    found: Worst,
}

const CORNERS: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Looks for the worst points.
pub(crate) fn worst(case: &Case, light: &ShadingLight, effort: Effort) -> Worst {
    let nowhere = Point {
        w: CORNERS[0],
        base: 0.0,
        values: [0.0; 2],
        off: [0.0; 2],
    };
    let mean = |k: [f32; 3]| f64::from(k[0] + k[1] + k[2]);
    let mut search = Search {
        case,
        light,
        linear: ShadingMaterial {
            shininess: 1.0,
            ..case.material
        },
        corners: [[0.0; 2]; 3],
        weights: [mean(case.material.diffuse), mean(case.material.specular)],
        found: Worst {
            diffuse: [f64::INFINITY, f64::NEG_INFINITY],
            specular: [f64::INFINITY, f64::NEG_INFINITY],
            deviation: [0.0; 2],
            points: [nowhere; 3],
        },
    };
    search.corners = CORNERS.map(|w| search.factors(w).1);
    let mut brightest = nowhere;
    for w in lattice(effort.parts) {
        let point = search.visit(w);
        if point.base > brightest.base {
            brightest = point;
        }
    }
    let step = 0.5 / effort.parts as f64;
    let [diffuse, specular, both] = search.found.points;
    search.climb(diffuse, step, effort.climb, |p| p.off[0].abs());
    if brightest.base > 0.0 {
        let top = search.climb(brightest, step, effort.climb, |p| p.base);
        search.climb(top, step, effort.climb, |p| p.off[1].abs());
        search.climb(specular, step, effort.climb, |p| p.off[1].abs());
        let [kd, ks] = search.weights;
        search.climb(both, step, effort.climb, |p| {
            (kd * p.off[0] + ks * p.off[1]).abs()
        });
    }
    search.found
}

/// Barycentric coordinates in steps of a part of an edge.
fn lattice(parts: usize) -> impl Iterator<Item = [f64; 3]> {
    (0..=parts).flat_map(move |i| {
        (0..=parts - i).map(move |j| [i, j, parts - i - j].map(|part| part as f64 / parts as f64))
    })
}

impl Search<'_> {
    /// The base, and both factors.
    fn factors(&self, w: [f64; 3]) -> (f64, [f64; 2]) {
        let case = self.case;
        let (point, normal) = (blend(&case.positions, w), blend(&case.normals, w));
        let found = factors(point, normal, &case.eye, &self.linear, self.light);
        // A cosine; rounding must not be raised to the power.
        let base = found.specular.min(1.0);
        let specular = if base > 0.0 {
            base.powf(f64::from(case.material.shininess))
        } else {
            0.0
        };
        (base, [found.diffuse, specular])
    }

    fn visit(&mut self, w: [f64; 3]) -> Point {
        let (base, values) = self.factors(w);
        let off = [0, 1].map(|term| {
            let interpolated: f64 = (0..3).map(|i| w[i] * self.corners[i][term]).sum();
            values[term] - interpolated
        });
        let point = Point {
            w,
            base,
            values,
            off,
        };
        let found = &mut self.found;
        for (range, value) in [&mut found.diffuse, &mut found.specular]
            .into_iter()
            .zip(values)
        {
            *range = [range[0].min(value), range[1].max(value)];
        }
        for (term, off) in off.into_iter().enumerate() {
            if off.abs() > found.deviation[term] {
                found.deviation[term] = off.abs();
                found.points[term] = point;
            }
        }
        let sum = |p: &Point| self.weights[0] * p.off[0] + self.weights[1] * p.off[1];
        if sum(&point).abs() > sum(&found.points[2]).abs() {
            found.points[2] = point;
        }
        point
    }

    /// Goes wherever `height` is greater, along lines parallel to the edges, in ever smaller steps.
    fn climb(
        &mut self,
        from: Point,
        first_step: f64,
        effort: usize,
        height: impl Fn(&Point) -> f64,
    ) -> Point {
        let (mut best, mut step, mut left) = (from, first_step, effort);
        while step > LAST_STEP && left > 6 {
            let start = best;
            for (up, down) in [(0, 1), (1, 0), (1, 2), (2, 1), (2, 0), (0, 2)] {
                let length = step.min(start.w[down]);
                if length > 0.0 {
                    let mut w = start.w;
                    w[up] += length;
                    w[down] -= length;
                    left -= 1;
                    let point = self.visit(w);
                    if height(&point) > height(&best) {
                        best = point;
                    }
                }
            }
            if best.w == start.w {
                step *= 0.4;
            }
        }
        best
    }
}

/// How many codes any of many points is off when terms that are not active are interpolated.
pub(crate) fn codes_off(case: &Case, active: &ActiveLights, encoding: Encoding) -> f64 {
    let colours = |w: [f64; 3]| {
        let (point, normal) = (blend(&case.positions, w), blend(&case.normals, w));
        let mut full = case.material.ambient.map(f64::from);
        let mut part = full;
        for (index, light) in case.lights.iter().enumerate() {
            let found = factors(point, normal, &case.eye, &case.material, light);
            for c in 0..3 {
                let radiance = f64::from(light.radiance[c]);
                let diffuse = radiance * f64::from(case.material.diffuse[c]) * found.diffuse;
                let specular = radiance * f64::from(case.material.specular[c]) * found.specular;
                full[c] += diffuse + specular;
                if active.diffuse.contains(index) {
                    part[c] += diffuse;
                }
                if active.specular.contains(index) {
                    part[c] += specular;
                }
            }
        }
        (full, part)
    };
    let corners = CORNERS.map(colours);
    let mut most = 0.0_f64;
    for w in lattice(6) {
        let (full, part) = colours(w);
        for c in 0..3 {
            let rest: f64 = (0..3)
                .map(|i| w[i] * (corners[i].0[c] - corners[i].1[c]))
                .sum();
            most = most.max((encoding.encode(part[c] + rest) - encoding.encode(full[c])).abs());
        }
    }
    most
}
