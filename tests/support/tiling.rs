//! Meshes that tile an area, and how many of their triangles take each pixel.

use super::exact::SUB;
use super::{Random, empty_world, geometry, on_each_exec};
use specula::backend::Backend;
use specula::backend::software::{NO_TRIANGLE, SoftwareBackend};
use specula::geometry::screen::{doubled_area, snap};
use specula::parallel::Exec;
use specula::scene::{View, World};

/// Triangles that tile an area, all of them front faces of the same view.
pub(crate) struct Mesh {
    pub(crate) world: World,
    /// The vertices around the area, in either direction.
    outline: Vec<u32>,
}

impl Mesh {
    fn new(points: &[[f32; 3]], triangles: Vec<[u32; 3]>, outline: Vec<u32>) -> Self {
        let mut world = empty_world();
        for &point in points {
            world.positions.push(point);
            world.normals.push([0.0, 0.0, -1.0]);
            world.vertex_material.push(0);
        }
        world.triangle_material = vec![0; triangles.len()];
        world.triangles = triangles;
        Self { world, outline }
    }

    /// Triangles around a hub, one for each pair of neighbours on the rim, which runs counter-clockwise as seen. A rim that
    /// ends where it began makes a full circle.
    pub(crate) fn fan(hub: [f32; 3], rim: &[[f32; 3]]) -> Self {
        let points: Vec<_> = std::iter::once(hub).chain(rim.iter().copied()).collect();
        let last = rim.len() as u32;
        let triangles = (1..last).map(|i| [0, i, i + 1]).collect();
        Self::new(&points, triangles, (0..=last).collect())
    }

    /// A grid of cells, each cut along one of its diagonals. `point(column, row)` moves to the right and down.
    pub(crate) fn grid(
        random: &mut Random,
        [columns, rows]: [u32; 2],
        mut point: impl FnMut(&mut Random, u32, u32) -> [f32; 3],
    ) -> Self {
        let at = |column: u32, row: u32| row * (columns + 1) + column;
        let mut points = Vec::new();
        for row in 0..=rows {
            points.extend((0..=columns).map(|column| point(random, column, row)));
        }
        let mut triangles = Vec::new();
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |c| (row, c))) {
            let [a, b] = [at(column, row), at(column + 1, row)];
            let [c, d] = [at(column, row + 1), at(column + 1, row + 1)];
            if random.below(2) == 0 {
                triangles.extend([[a, c, b], [b, c, d]]);
            } else {
                triangles.extend([[a, c, d], [a, d, b]]);
            }
        }
        let outline = (0..rows)
            .map(|row| at(0, row))
            .chain((0..columns).map(|column| at(column, rows)))
            .chain((1..=rows).rev().map(|row| at(columns, row)))
            .chain((1..=columns).rev().map(|column| at(column, 0)))
            .collect();
        Self::new(&points, triangles, outline)
    }

    /// The same triangles, seen from behind.
    fn turned_round(&self) -> World {
        let mut world = self.world.clone();
        for [_, b, c] in &mut world.triangles {
            std::mem::swap(b, c);
        }
        world
    }

    /// Front and back of every triangle, for views that see either.
    pub(crate) fn both_sides(&self) -> World {
        let mut world = self.turned_round();
        world.triangles.extend(&self.world.triangles);
        world.triangle_material.resize(world.triangles.len(), 0);
        world
    }

    /// A vertex on the sub-pixel grid.
    fn snapped(&self, view: &View, vertex: u32) -> [i32; 2] {
        snap(view.project(self.world.positions.get(vertex as usize)))
    }
}

/// A point of the screen given in sub-pixels: exact in `f32` when not too far away.
pub(crate) fn at(x: i32, y: i32) -> [f32; 3] {
    [x as f32 / SUB as f32, y as f32 / SUB as f32, 0.5]
}

/// Whether the centre of a pixel lies inside an outline by the even-odd rule.
///
/// That a centre on a left or top edge is inside, and one on a right or bottom edge is not, is to say that the centre is really
/// a little farther to the right, and less than that farther down. So an end of an edge at the height of the centre is above
/// it, and an edge through the centre is on its left.
fn outline_covers(outline: &[[i32; 2]], pixel: [i32; 2]) -> bool {
    let [cx, cy] = pixel.map(|v| i128::from(v * SUB + SUB / 2));
    let mut is_inside = false;
    for (i, p) in outline.iter().enumerate() {
        let [px, py] = p.map(i128::from);
        let [qx, qy] = outline[(i + 1) % outline.len()].map(i128::from);
        if (py <= cy) != (qy <= cy) {
            // The edge meets the row at `px + (cy - py) (qx - px) / (qy - py)`.
            let to_the_right = (cy - py) * (qx - px) - (cx - px) * (qy - py);
            is_inside ^= to_the_right * (qy - py).signum() > 0;
        }
    }
    is_inside
}

/// What is known of how many triangles take a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Taken {
    Never,
    Once,
    AtMostOnce,
}

/// The number of triangles that take each pixel, each of them drawn by itself.
fn coverage(exec: Exec, world: &World, view: &View) -> Vec<u32> {
    let mut backend = SoftwareBackend::new();
    let (mut ids, mut sum) = (Vec::new(), vec![0; (view.width * view.height) as usize]);
    for id in 0..world.triangles.len() as u32 {
        let alone = id..id + 1;
        let counts = backend.rasterize(exec, geometry(world, view, std::slice::from_ref(&alone)));
        if counts.covered_pixels > 0 {
            backend.ids(&mut ids);
            for (sum, &owner) in sum.iter_mut().zip(&ids) {
                *sum += u32::from(owner != NO_TRIANGLE);
            }
        }
    }
    sum
}

/// Each pixel is taken by as many triangles as wanted, however they are drawn.
pub(crate) fn assert_coverage(world: &World, view: &View, want: &[Taken], what: &str) {
    on_each_exec(|exec| {
        let taken = coverage(exec, world, view);
        for (i, (&times, &want)) in taken.iter().zip(want).enumerate() {
            let is_right = match want {
                Taken::Never => times == 0,
                Taken::Once => times == 1,
                Taken::AtMostOnce => times <= 1,
            };
            let pixel = [i as u32 % view.width, i as u32 / view.width];
            assert!(
                is_right,
                "{what}, {exec:?}: pixel {pixel:?} is taken {times} times, not {want:?}"
            );
        }
    });
}

/// Says of every pixel what `taken` says, row after row.
pub(crate) fn each_pixel(view: &View, taken: impl Fn([i32; 2]) -> Taken) -> Vec<Taken> {
    let (width, height) = (view.width as i32, view.height as i32);
    let rows = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    rows.map(taken).collect()
}

/// Each pixel inside the outline is taken once, any other never; and none of either is when the mesh is seen from
/// behind. All vertices have to be in front of the eye. Returns the number of pixels inside.
pub(crate) fn assert_tiles(mesh: &Mesh, view: &View, what: &str) -> usize {
    for triangle in &mesh.world.triangles {
        let corners = triangle.map(|v| mesh.snapped(view, v));
        assert!(doubled_area(corners) >= 0, "{what}: no mesh, {corners:?}");
    }
    let outline: Vec<_> = mesh
        .outline
        .iter()
        .map(|&v| mesh.snapped(view, v))
        .collect();
    let want = each_pixel(view, |pixel| match outline_covers(&outline, pixel) {
        true => Taken::Once,
        false => Taken::Never,
    });
    assert_coverage(&mesh.world, view, &want, what);
    let nothing = vec![Taken::Never; want.len()];
    assert_coverage(&mesh.turned_round(), view, &nothing, "turned round");
    want.iter().filter(|&&taken| taken == Taken::Once).count()
}

/// The mesh takes every pixel of the view.
pub(crate) fn assert_covers_all(mesh: &Mesh, view: &View, what: &str) {
    let inside = assert_tiles(mesh, view, what);
    assert_eq!(inside, (view.width * view.height) as usize, "{what}");
}
