//! The states of a triangle that the clairvoyant chooses from: what they cost and what they show.

use glam::DVec3;
use specula::illumination::reference::shade;
use specula::scene::{View, World};
use specula::schedule::cost;

/// Finest division: 4,096 parts.
pub(super) const MOST_LEVELS: u32 = 6;

/// What dividing a triangle into `4^level` parts and painting them costs; each new point on an edge is shared with a
/// neighbour.
pub(super) fn division_cost(level: u32, pixels: &[usize], lights: usize) -> f64 {
    if level == 0 {
        return 0.0;
    }
    let n = f64::from(1 << level);
    let parts = n * n;
    let points = (n - 1.0) * (n - 2.0) / 2.0 + 1.5 * (n - 1.0);
    let leaves = cost::leaves(parts as f32, (points / parts) as f32, lights);
    f64::from(leaves + cost::repaint(parts as f32, pixels.len() as f32))
}

/// A way to show a triangle.
#[derive(Clone, Copy)]
pub(super) struct State {
    pub(super) units: f64,
    /// Summed squared error over the pixels it owns and all channels.
    pub(super) squares: f64,
}

/// The states from the first to the last, in the order of their cost, that lie on the lower convex hull of all.
pub(super) fn lower_hull(states: Vec<State>) -> Vec<State> {
    let mut hull: Vec<State> = Vec::new();
    for state in states {
        while let [.., a, b] = hull[..] {
            let cross = (b.units - a.units) * (state.squares - a.squares)
                - (b.squares - a.squares) * (state.units - a.units);
            if cross > 0.0 {
                break;
            }
            hull.pop();
        }
        // Only the first may have no successor that is better.
        if hull.last().is_none_or(|last| state.squares < last.squares) {
            hull.push(state);
        }
    }
    hull
}

/// True colours at the corners of a triangle's equal parts.
pub(super) struct Grid {
    n: usize,
    /// By the weights of the second and third corner, in units of `1/n`.
    colours: Vec<DVec3>,
}

impl Grid {
    pub(super) fn new(world: &World, view: &View, triangle: u32, n: usize) -> Self {
        let vertices = world.triangles[triangle as usize].map(|v| v as usize);
        let material = usize::from(world.triangle_material[triangle as usize]);
        let [positions, normals] = [&world.positions, &world.normals]
            .map(|list| vertices.map(|v| DVec3::from_array(list.get(v).map(f64::from))));
        let point = |corners: [DVec3; 3], i: usize, j: usize| {
            let weights = [n.saturating_sub(i + j), i, j].map(|w| w as f64 / n as f64);
            (0..3).map(|k| weights[k] * corners[k]).sum::<DVec3>()
        };
        let side = n + 1;
        let mut colours = vec![DVec3::ZERO; side * side];
        for (i, j) in (0..side).flat_map(|i| (0..side - i).map(move |j| (i, j))) {
            let shaded = shade(
                point(positions, i, j),
                point(normals, i, j),
                &view.eye,
                &world.materials[material],
                &world.lights,
            );
            colours[i * side + j] = DVec3::from_array(shaded.rgb);
        }
        Self { n, colours }
    }

    /// The linear colour at a point of the triangle, interpolated over the part it lies in.
    pub(super) fn at(&self, [_, b1, b2]: [f64; 3]) -> DVec3 {
        let n = self.n as f64;
        let cell = |b: f64| (b * n).floor().clamp(0.0, n - 1.0);
        let (i, j) = (cell(b1), cell(b2));
        let (u, v) = (b1 * n - i, b2 * n - j);
        let colour =
            |di: usize, dj: usize| self.colours[(i as usize + di) * (self.n + 1) + j as usize + dj];
        if u + v <= 1.0 || i + j >= n - 1.0 {
            (1.0 - u - v) * colour(0, 0) + u * colour(1, 0) + v * colour(0, 1)
        } else {
            (u + v - 1.0) * colour(1, 1) + (1.0 - v) * colour(1, 0) + (1.0 - u) * colour(0, 1)
        }
    }
}
