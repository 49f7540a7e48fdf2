//! Fill rules, in the manner of the Vulkan conformance suite (additive grey triangles): every triangle of a mesh is drawn **by
//! itself**, and at each pixel we count the triangles that took it.
//!
//! Drawn together, triangles hide each other's faults: a pixel that two neighbours both claim looks like any other, and a hole
//! shows what is behind. Counted, a mesh that tiles an area must reach exactly 1 inside of it and 0 outside. What is inside
//! is decided without any triangle, in one of two ways:
//!
//! * for meshes that are not clipped, by the even-odd rule for the mesh's snapped *outline*, in integers (`outline_covers`);
//! * for planes that the near or far plane cuts, by where a pixel's ray meets the plane, leaving out what is within a
//!   twentieth of a pixel of the border, where only "at most once" is demanded.
//!
//! All of it at every SIMD level, on one thread and on two, and with every triangle turned round as well, which leaves nothing.

mod support;

use glam::{DMat3, DVec3};
use specula::scene::{View, World};
use support::exact::SUB;
use support::tiling::*;
use support::*;

#[test]
fn a_quad_of_two_triangles_at_any_subpixel_offset() {
    // Counter-clockwise as seen, in pixels: along the rows, on its tip, and neither.
    let shapes = [
        [[2, 2], [2, 9], [12, 9], [12, 2]],
        [[9, 1], [2, 8], [9, 15], [16, 8]],
        [[1, 3], [4, 14], [17, 10], [13, 2]],
    ];
    let offsets = [0, 1, 127, 128, 129, 255];
    let view = flat(19, 17);
    for (shape, dx) in shapes.iter().flat_map(|s| offsets.map(|dx| (s, dx))) {
        for (dy, diagonal) in offsets.iter().flat_map(|dy| [(dy, 0), (dy, 1)]) {
            let mut corners = shape.map(|[x, y]| at(x * SUB + dx, y * SUB + dy));
            corners.rotate_left(diagonal);
            let mesh = Mesh::fan(corners[0], &corners[1..]);
            let what = format!("{shape:?} moved by {dx}, {dy}, diagonal {diagonal}");
            assert!(assert_tiles(&mesh, &view, &what) > 60, "{what}");
        }
    }
}

#[test]
fn fans_around_a_vertex() {
    let mut random = Random(101);
    let view = flat(80, 80);
    let centre = 40 * SUB + SUB / 2;
    let hubs = [
        [centre; 2],
        [40 * SUB; 2],
        [centre, 40 * SUB],
        [centre + 1, centre - 1],
        [10_303, 10_111],
    ];
    // The grid that the rim lies on: anything, and pixel centres only.
    for (hub, step) in hubs.iter().flat_map(|hub| [(hub, 1), (hub, SUB)]) {
        for spokes in [3, 4, 8, 16, 64] {
            let mut rim: Vec<_> = (0..spokes)
                .map(|i| {
                    let turn = (i as f32 + random.range(-0.2, 0.2)) / spokes as f32;
                    let (sin, cos) = (turn * std::f32::consts::TAU).sin_cos();
                    let reach = random.range(30.0, 36.0) * SUB as f32;
                    let on_grid = |v: f32| (v as i32).div_euclid(step) * step + step / 2;
                    at(
                        on_grid(hub[0] as f32 + cos * reach),
                        on_grid(hub[1] as f32 - sin * reach),
                    )
                })
                .collect();
            rim.push(rim[0]);
            let mesh = Mesh::fan(at(hub[0], hub[1]), &rim);
            let what = format!("{spokes} spokes around {hub:?}, rim in steps of {step}");
            assert!(assert_tiles(&mesh, &view, &what) > 900, "{what}");
        }
    }
}

#[test]
fn strips() {
    let mut random = Random(102);
    let view = flat(100, 40);
    // From slivers of a sub-pixel to rows of pixels; the rails along pixel centres, between them, and sloping.
    for height in [1, 3, 20, SUB, 5 * SUB] {
        for (start, slope) in [(128, 0), (0, 0), (77, 3), (128, 256), (131, 301)] {
            let mesh = Mesh::grid(&mut random, [30, 1], |random, column, row| {
                let x = column as i32 * 4 * SUB - 5 * SUB + random.below(512) as i32;
                let y = 8 * SUB + start + x * slope / 1024 + row as i32 * height;
                at(x, y)
            });
            let what = format!("{height} high from {start} with slope {slope}");
            assert_tiles(&mesh, &view, &what);
        }
    }
}

#[test]
fn needles_from_one_corner() {
    let mut random = Random(103);
    let view = flat(150, 70);
    for hub in [[128, 128], [-3000, 40], [70 * SUB, 128]] {
        // Down the left side, which the hub may lie on, and along the bottom: many points, some next to each other.
        let mut list = |from: i32, to: i32| {
            let mut all: Vec<_> = (0..150)
                .map(|_| from + random.below((to - from) as usize) as i32)
                .collect();
            all.extend((0..20).map(|i| from + i));
            all.sort_unstable();
            all
        };
        let (bottom, right) = (65 * SUB + 128, 140 * SUB);
        let along = list(hub[0].max(0) + 1, right).into_iter();
        let up = list(hub[1] + 1, bottom).into_iter().rev();
        let rim: Vec<_> = along
            .map(|x| at(x, bottom))
            .chain(up.map(|y| at(right, y)))
            .collect();
        let mesh = Mesh::fan(at(hub[0], hub[1]), &rim);
        assert!(assert_tiles(&mesh, &view, "needles") > 2000);
    }
}

#[test]
fn grids_with_moved_vertices_over_the_whole_image() {
    let mut random = Random(104);
    // Cells of half a pixel to many, some with vertices and edges on pixel centres, moved by less than a quarter of a cell.
    for (width, height, cell) in [
        (21, 13, 128),
        (33, 20, SUB),
        (67, 66, 1111),
        (130, 90, 5000),
    ] {
        let view = flat(width, height);
        let cells = [width, height].map(|side| side * SUB as u32 / cell as u32 + 3);
        for moved in [0, cell / 16, cell / 4 - 2] {
            let mesh = Mesh::grid(&mut random, cells, |random, column, row| {
                let mut along = |i: u32| i as i32 * cell + random.below(moved as usize + 1) as i32;
                at(along(column) - cell + 128, along(row) - cell + 128)
            });
            let what = format!("{width} x {height}, cells of {cell}, moved by {moved}");
            assert_covers_all(&mesh, &view, &what);
        }
    }
}

#[test]
fn huge_triangles_across_the_guard_band() {
    let mut random = Random(105);
    let view = flat(90, 70);
    let all = vec![Taken::Once; 90 * 70];
    for reach in [1e3, 2e4, 1e6, 1e12, 1e30_f32] {
        let mut rim: Vec<_> = (0..23)
            .map(|i| {
                let turn = (i as f32 + random.range(-0.4, 0.4)) / 23.0;
                let (sin, cos) = (turn * std::f32::consts::TAU).sin_cos();
                let far = reach * random.range(0.7, 1.0);
                [45.0 + cos * far, 35.0 - sin * far, 0.5]
            })
            .collect();
        rim.push(rim[0]);
        let fan = Mesh::fan([45.5, 35.5, 0.5], &rim);
        assert_coverage(&fan.world, &view, &all, &format!("fan of {reach}"));
        // Each edge of the inner cells goes on to far away.
        let far = reach / 8.0;
        let lines = |near: f32| [-reach, -far, near, near + 20.3, far, reach];
        let (columns, rows) = (lines(30.0), lines(22.5));
        let grid = Mesh::grid(&mut random, [5, 5], |random, column, row| {
            let mut moved = |v: f32| v * random.range(0.95, 1.05);
            [
                moved(columns[column as usize]),
                moved(rows[row as usize]),
                0.5,
            ]
        });
        assert_coverage(&grid.world, &view, &all, &format!("grid of {reach}"));
    }
}

#[test]
fn meshes_across_each_side_and_beyond() {
    let mut random = Random(106);
    let view = flat(70, 66);
    for [x, y] in [[-30, 5], [40, 5], [5, -30], [5, 40], [-70, 5], [5, 80]] {
        let mesh = Mesh::grid(&mut random, [6, 6], |random, column, row| {
            let mut along = |i: u32, start: i32| {
                start * SUB + i as i32 * 10 * SUB + random.below(2 * SUB as usize) as i32
            };
            at(along(column, x), along(row, y))
        });
        assert_tiles(&mesh, &view, &format!("moved to {x}, {y}"));
    }
}

#[test]
fn depth_from_before_the_near_plane_to_beyond_the_far_plane() {
    let mut random = Random(107);
    let view = flat(100, 66);
    // Depth rises, or falls, from 0 to 1 while x goes from 20 to 70.
    for falls in [false, true] {
        let mesh = Mesh::grid(&mut random, [9, 6], |random, column, row| {
            let mut along = |i: u32| i as f32 * 17.0 - 19.0 + random.range(-4.0, 4.0);
            let (x, y) = (along(column), along(row));
            let z = (x - 20.0) / 50.0;
            [x, y, if falls { 1.0 - z } else { z }]
        });
        let want = each_pixel(&view, |[x, _]| match x {
            20..70 => Taken::Once,
            _ => Taken::Never,
        });
        assert_coverage(&mesh.world, &view, &want, &format!("falls: {falls}"));
    }
}

/// The world point that `view`, made by [`perspective`], sees at a point of the screen, at a distance.
fn unprojected(view: &View, zoom: f64, [x, y]: [f64; 2], w: f64) -> [f32; 3] {
    let (cx, cy) = (f64::from(view.width) / 2.0, f64::from(view.height) / 2.0);
    [(x - cx) / zoom * w, (y - cy) / zoom * w, w].map(|v| v as f32)
}

#[test]
fn projected_with_any_distance_at_each_vertex() {
    let mut random = Random(108);
    let view = perspective(90, 75, 60.0, 0.05, 5.0);
    for cell in [1.3, 7.0, 40.0, 9000.0] {
        let cells = [90.0, 75.0].map(|side: f64| ((side / cell) as u32 + 3).next_multiple_of(2));
        let mesh = Mesh::grid(&mut random, cells, |random, column, row| {
            let mut along = |i: u32, cells: u32, middle: f64| {
                let steps = f64::from(i) - f64::from(cells) / 2.0;
                middle + (steps + f64::from(random.range(-0.2, 0.2))) * cell
            };
            let pixel = [along(column, cells[0], 45.2), along(row, cells[1], 37.3)];
            unprojected(&view, 60.0, pixel, f64::from(random.range(0.1, 4.0)))
        });
        let what = format!("cells of {cell} pixels");
        if cell < 1000.0 {
            assert_covers_all(&mesh, &view, &what);
        } else {
            // Beyond the guard band, where snapping before clipping would say nothing.
            assert_coverage(&mesh.world, &view, &vec![Taken::Once; 90 * 75], &what);
        }
    }
}

/// A part of a plane: `origin + s across + t along`, with `s` and `t` from -1 to 1.
struct Sheet {
    origin: DVec3,
    across: DVec3,
    along: DVec3,
}

impl Sheet {
    /// One that the eye is not in, nor nearly.
    fn random(random: &mut Random, size: f32) -> Self {
        loop {
            let mut vector =
                |r: f32| DVec3::from_array([0; 3].map(|_| f64::from(random.range(-r, r))));
            let origin = vector(2.0) + DVec3::Z * 2.0;
            let (across, along) = (vector(size), vector(size));
            let normal = across.cross(along);
            let is_square = normal.length() > 0.5 * across.length() * along.length();
            if is_square && normal.normalize().dot(origin).abs() > 0.5 {
                return Self {
                    origin,
                    across,
                    along,
                };
            }
        }
    }

    /// A grid of triangles with moved inner vertices, front and back.
    fn mesh(&self, random: &mut Random, cells: u32) -> World {
        let grid = Mesh::grid(random, [cells, cells], |random, column, row| {
            let mut along = |i: u32| {
                let is_inner = i > 0 && i < cells;
                let moved = if is_inner {
                    random.range(-0.2, 0.2)
                } else {
                    0.0
                };
                f64::from(2.0 * (i as f32 + moved) / cells as f32 - 1.0)
            };
            let (s, t) = (along(column), along(row));
            (self.origin + self.across * s + self.along * t)
                .to_array()
                .map(|v| v as f32)
        });
        grid.both_sides()
    }

    /// Whether the ray through a point of the screen meets it between the near and far planes.
    fn is_seen(&self, ray: DVec3, [near, far]: [f64; 2]) -> bool {
        let solution = DMat3::from_cols(self.across, self.along, -ray).inverse() * -self.origin;
        let [s, t, distance] = solution.to_array();
        s.abs() <= 1.0 && t.abs() <= 1.0 && near <= distance && distance <= far
    }
}

#[test]
fn planes_through_the_near_plane_and_behind_the_eye() {
    let mut random = Random(109);
    let (width, height, zoom) = (90, 70, 60.0);
    let mut seen = 0;
    for round in 0..40 {
        // Small near planes throw what is just beyond them far out of the guard band.
        let [near, far] = [[0.5, 20.0], [1.0, 3.0], [1e-3, 20.0], [1e-5, 20.0]][round % 4];
        let view = perspective(width, height, zoom, near, far);
        let sheet = Sheet::random(&mut random, [3.0, 12.0][round / 4 % 2]);
        let world = sheet.mesh(&mut random, [1, 3, 8][round % 3]);
        let ray = |x: f64, y: f64| {
            let [cx, cy] = [width, height].map(|side| f64::from(side) / 2.0);
            DVec3::new((x - cx) / zoom, (y - cy) / zoom, 1.0)
        };
        let want = each_pixel(&view, |pixel| {
            let [x, y] = pixel.map(|v| f64::from(v) + 0.5);
            let around = [
                (0.0, 0.0),
                (0.05, 0.0),
                (-0.05, 0.0),
                (0.0, 0.05),
                (0.0, -0.05),
            ];
            let hits = around.map(|(dx, dy)| sheet.is_seen(ray(x + dx, y + dy), [near, far]));
            match hits {
                [true, true, true, true, true] => Taken::Once,
                [false, false, false, false, false] => Taken::Never,
                _ => Taken::AtMostOnce,
            }
        });
        seen += want.iter().filter(|&&taken| taken == Taken::Once).count();
        assert_coverage(&world, &view, &want, &format!("sheet {round}"));
    }
    assert!(seen > 20_000, "{seen}");
}
