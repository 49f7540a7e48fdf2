//! The software rasterizer against the raster rules: coverage, depth and ids are exactly those of the slow reference, at every
//! SIMD level, for any number of threads and any order of triangles.

mod support;

use specula::backend::software::{NO_TRIANGLE, SoftwareBackend};
use specula::backend::{Backend, BasePaint};
use specula::geometry::curved::{node_count, node_index, part_index, part_nodes, through};
use specula::geometry::{CurvedTriangles, TriangleSet, Vec3s};
use specula::illumination::reference::shade;
use specula::output::Frame;
use specula::output::encode::{encode, encode_u8};
use specula::scene::{View, World};
use support::*;

#[test]
fn soups_are_drawn_exactly_as_the_reference_does_at_every_level() {
    let mut random = Random(1);
    let mut backend = SoftwareBackend::new();
    let mut clipped = 0;
    for (width, height) in [(200, 150), (64, 64), (1, 1), (77, 3), (129, 65), (320, 200)] {
        for count in [1, 2, 7, 60, 100, 250, 400] {
            let world = soup(&mut random, count);
            let view = perspective(width, height, f64::from(width) * 0.6, 0.1, 50.0);
            let want = reference(&world, &view, 0..count as u32);
            for exec in levels() {
                let counts = rasterize(&mut backend, exec, &world, &view);
                let what = format!("{width} x {height}, {count} triangles, {exec:?}");
                Visibility::of(&backend).assert_same(&want, width, &what);
                let covered = want.ids.iter().filter(|&&id| id != NO_TRIANGLE).count();
                assert_eq!(counts.covered_pixels, covered as u64);
                assert_eq!(counts.submitted, count as u64);
                assert_eq!(
                    counts.submitted,
                    counts.back_facing + counts.off_screen + counts.drawn
                );
                clipped += counts.clipped;
            }
            let two = with_two_threads(|exec| rasterize(&mut backend, exec, &world, &view));
            assert_eq!(two.submitted, count as u64);
            Visibility::of(&backend).assert_same(&want, width, "two threads");
        }
    }
    assert!(clipped > 100, "the soups must exercise clipping");
}

#[test]
fn many_small_triangles_are_drawn_the_same_by_one_thread_and_by_two() {
    // Enough for several shares.
    let mut random = Random(2);
    let mut world = empty_world();
    for _ in 0..5000 {
        let (x, y) = (random.range(-5.0, 305.0), random.range(-5.0, 205.0));
        let mut corner = || {
            [
                x + random.range(-6.0, 6.0),
                y + random.range(-6.0, 6.0),
                random.range(0.0, 1.0),
            ]
        };
        let corners = [corner(), corner(), corner()];
        add_both_sides(&mut world, corners, [[0.0, 0.0, 1.0]; 3]);
    }
    let view = flat(300, 200);
    let want = reference(&world, &view, 0..10_000);
    let mut backend = SoftwareBackend::new();
    rasterize(&mut backend, best(), &world, &view);
    Visibility::of(&backend).assert_same(&want, 300, "one thread");
    let mut backend = SoftwareBackend::new();
    with_two_threads(|exec| rasterize(&mut backend, exec, &world, &view));
    Visibility::of(&backend).assert_same(&want, 300, "two threads");
}

#[test]
fn only_visible_ranges_are_drawn() {
    let mut random = Random(3);
    let world = soup(&mut random, 90);
    let view = perspective(120, 90, 70.0, 0.1, 50.0);
    let mut backend = SoftwareBackend::new();
    let ranges = [2..10, 10..11, 40..77];
    backend.rasterize(best(), geometry(&world, &view, &ranges));
    let want = reference(&world, &view, ranges.iter().cloned().flatten());
    Visibility::of(&backend).assert_same(&want, 120, "ranges");
    let counts = backend.rasterize(best(), geometry(&world, &view, &[]));
    assert_eq!(counts.background_tiles, 4);
    assert!(backend.visible_triangles().is_empty());
    assert!(
        Visibility::of(&backend)
            .ids
            .iter()
            .all(|&id| id == NO_TRIANGLE)
    );
}

#[test]
fn the_order_of_triangles_does_not_matter() {
    // Each triangle at a depth of its own, so that no pixel is contested by equals.
    let mut random = Random(4);
    let mut corners: Vec<[[f32; 3]; 3]> = (0..120)
        .map(|i| {
            [0; 3].map(|_| {
                [
                    random.range(-20.0, 220.0),
                    random.range(-20.0, 120.0),
                    i as f32 / 128.0,
                ]
            })
        })
        .collect();
    let view = flat(200, 100);
    let mut depths: Vec<Vec<f32>> = Vec::new();
    for _ in 0..4 {
        let mut world = empty_world();
        for &c in &corners {
            add_both_sides(&mut world, c, [[0.0, 0.0, 1.0]; 3]);
        }
        let mut backend = SoftwareBackend::new();
        rasterize(&mut backend, best(), &world, &view);
        let image = Visibility::of(&backend);
        for (id, depth) in image.ids.iter().zip(&image.depths) {
            if *id != NO_TRIANGLE {
                assert_eq!(
                    *depth,
                    corners[*id as usize / 2][0][2],
                    "the owner is the one at that depth"
                );
            }
        }
        depths.push(image.depths);
        for i in (1..corners.len()).rev() {
            corners.swap(i, random.below(i + 1));
        }
    }
    assert!(depths.windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn of_equally_near_triangles_the_smaller_id_wins() {
    let mut world = empty_world();
    let corners = [[10.0, 10.0, 0.0], [10.0, 90.0, 0.0], [90.0, 10.0, 0.0]];
    for _ in 0..3 {
        add_triangle(&mut world, corners, [[0.0, 0.0, 1.0]; 3]);
    }
    let view = flat(100, 100);
    let mut backend = SoftwareBackend::new();
    rasterize(&mut backend, best(), &world, &view);
    assert_eq!(
        backend.visible_triangles(),
        [0],
        "at the far plane, depth 0, too"
    );
    backend.rasterize(
        best(),
        geometry(&world, &view, std::slice::from_ref(&(1..3))),
    );
    assert_eq!(backend.visible_triangles(), [1]);
}

#[test]
fn visible_triangles_and_their_pixels_are_counted_exactly() {
    let mut random = Random(5);
    let mut backend = SoftwareBackend::new();
    for _ in 0..6 {
        let world = soup(&mut random, 200);
        let view = perspective(230, 140, 150.0, 0.1, 50.0);
        for exec in levels() {
            rasterize(&mut backend, exec, &world, &view);
            let image = Visibility::of(&backend);
            let mut want = vec![0; 200];
            for &id in image.ids.iter().filter(|&&id| id != NO_TRIANGLE) {
                want[id as usize] += 1;
            }
            let owners: Vec<_> = (0..200).filter(|&id| want[id as usize] > 0).collect();
            assert_eq!(backend.visible_triangles(), owners);
            let got: Vec<_> = (0..200).map(|id| backend.visible_pixels(id)).collect();
            assert_eq!(got, want);
            assert_eq!(backend.visible_pixels(4000), 0);
        }
    }
}

/// Counts, for each pixel, how many of the world's triangles cover it, each drawn alone.
fn coverage(world: &World, view: &View) -> Vec<u32> {
    let mut backend = SoftwareBackend::new();
    let (mut ids, mut sum) = (Vec::new(), vec![0; (view.width * view.height) as usize]);
    for id in 0..world.triangles.len() as u32 {
        let range = id..id + 1;
        backend.rasterize(best(), geometry(world, view, std::slice::from_ref(&range)));
        backend.ids(&mut ids);
        for (sum, &owner) in sum.iter_mut().zip(&ids) {
            *sum += u32::from(owner != NO_TRIANGLE);
        }
    }
    sum
}

#[test]
fn triangles_of_a_fan_cover_each_pixel_around_the_hub_once() {
    let mut random = Random(6);
    for hub in [[40.5, 40.5], [40.0, 40.0], [41.3, 38.7]] {
        let mut angles: Vec<f32> = (0..40)
            .map(|_| random.range(0.0, std::f32::consts::TAU))
            .collect();
        angles.extend((0..16).map(|i| i as f32 * std::f32::consts::TAU / 16.0));
        angles.sort_by(f32::total_cmp);
        let at = |angle: f32| {
            [
                hub[0] + 35.0 * angle.cos(),
                hub[1] + 35.0 * angle.sin(),
                0.5,
            ]
        };
        let mut world = empty_world();
        for i in 0..angles.len() {
            let (p, q) = (at(angles[i]), at(angles[(i + 1) % angles.len()]));
            add_triangle(
                &mut world,
                [[hub[0], hub[1], 0.5], q, p],
                [[0.0, 0.0, 1.0]; 3],
            );
        }
        let sum = coverage(&world, &flat(80, 80));
        for (i, &times) in sum.iter().enumerate() {
            let (x, y) = (
                (i % 80) as f32 + 0.5 - hub[0],
                (i / 80) as f32 + 0.5 - hub[1],
            );
            assert!(times <= 1, "pixel {i} is covered {times} times");
            if x.hypot(y) < 30.0 {
                assert_eq!(times, 1, "pixel {i} is a hole");
            }
        }
    }
}

#[test]
fn a_mesh_over_the_whole_image_covers_each_pixel_once_whichever_way_it_is_cut() {
    let mut random = Random(7);
    for jitter in [0.0, 0.5, 3.0] {
        let mut world = empty_world();
        let (columns, rows) = (11, 9);
        let points: Vec<[f32; 3]> = (0..=rows)
            .flat_map(|j| (0..=columns).map(move |i| [i, j]))
            .map(|[i, j]| {
                let mut move_by = || random.range(-jitter, jitter);
                // Some vertices on pixel centres, edges along rows and columns of them.
                [
                    i as f32 * 10.0 - 5.5 + move_by(),
                    j as f32 * 10.0 - 5.5 + move_by(),
                    0.5,
                ]
            })
            .collect();
        for j in 0..rows {
            for i in 0..columns {
                let at = |di: usize, dj: usize| points[(j + dj) * (columns + 1) + i + di];
                let [a, b, c, d] = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
                let halves = if (i + j) % 2 == 0 {
                    [[a, b, c], [b, d, c]]
                } else {
                    [[a, b, d], [a, d, c]]
                };
                for mut half in halves {
                    // With both sides the winding must not matter.
                    if random.below(2) == 0 {
                        half.swap(0, 1);
                    }
                    add_both_sides(&mut world, half, [[0.0, 0.0, 1.0]; 3]);
                }
            }
        }
        assert!(
            coverage(&world, &flat(90, 70))
                .iter()
                .all(|&times| times == 1),
            "jitter {jitter}"
        );
    }
}

#[test]
fn a_floor_through_the_near_plane_and_the_guard_band_covers_each_pixel_below_the_horizon_once() {
    let mut random = Random(10);
    for round in 0..6 {
        // A plane below the eye, cut into a grid with vertices moved about in the plane, reaching behind the eye.
        let (columns, rows) = (9, 12);
        let points: Vec<[f32; 3]> = (0..=rows)
            .flat_map(|j| (0..=columns).map(move |i| [i, j]))
            .map(|[i, j]| {
                let mut move_by = || random.range(-1.0, 1.0);
                let (x, z) = (
                    i as f32 * 6.0 - 27.0 + move_by(),
                    j as f32 * 3.0 - 9.0 + move_by(),
                );
                [x, 1.0, z]
            })
            .collect();
        let mut world = empty_world();
        for j in 0..rows {
            for i in 0..columns {
                let at = |di: usize, dj: usize| points[(j + dj) * (columns + 1) + i + di];
                let [a, b, c, d] = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
                for half in [[a, b, c], [b, d, c]] {
                    add_both_sides(&mut world, half, [[0.0, -1.0, 0.0]; 3]);
                }
            }
        }
        // In sight, or so near that what is just beyond it leaves the guard band.
        let near = [2.0, 1e-3, 1e-5][round % 3];
        let view = perspective(120, 80, 60.0, near, 100.0);
        for (i, times) in coverage(&world, &view).into_iter().enumerate() {
            let (x, y) = ((i % 120) as f64 + 0.5 - 60.0, (i / 120) as f64 + 0.5 - 40.0);
            // Where the pixel's ray meets the plane.
            let z = 60.0 / y;
            let x = x / 60.0 * z;
            assert!(times <= 1, "pixel {i} is covered {times} times");
            if z > near + 0.01 && z < 24.0 && x.abs() < 24.0 {
                assert_eq!(times, 1, "pixel {i} is a hole");
            }
        }
    }
}

#[test]
fn only_the_side_that_faces_the_viewer_is_drawn() {
    let view = flat(50, 50);
    // The y axis points down, so this turns counter-clockwise as seen.
    let front = [[10.0, 10.0, 0.5], [10.0, 40.0, 0.5], [40.0, 10.0, 0.5]];
    let back = [front[0], front[2], front[1]];
    for (corners, both, drawn, back_facing) in [
        (front, false, 1, 0),
        (back, false, 0, 1),
        (front, true, 1, 1),
        (back, true, 1, 1),
    ] {
        let mut world = empty_world();
        let add = if both { add_both_sides } else { add_triangle };
        add(&mut world, corners, [[0.0, 0.0, 1.0]; 3]);
        let counts = rasterize(&mut SoftwareBackend::new(), best(), &world, &view);
        assert_eq!((counts.drawn, counts.back_facing), (drawn, back_facing));
    }
}

#[test]
fn impossible_coordinates_draw_nothing_and_do_not_panic() {
    let view = perspective(60, 40, 40.0, 0.1, 50.0);
    for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
        let mut world = empty_world();
        add_both_sides(&mut world, [[odd; 3]; 3], [[0.0, 0.0, 1.0]; 3]);
        add_both_sides(
            &mut world,
            [[0.0, 0.0, 1.0], [odd, 1.0, 1.0], [0.0, 1.0, odd]],
            [[0.0, 0.0, 1.0]; 3],
        );
        let mut backend = SoftwareBackend::new();
        rasterize(&mut backend, best(), &world, &view);
        let all = 0..4;
        let geometry = geometry(&world, &view, std::slice::from_ref(&all));
        backend.resolve(best(), geometry, BasePaint::Phong);
        Frame::new(60, 40).write(|target| backend.present(best(), target));
    }
    let nothing = flat(0, 0);
    let counts = rasterize(
        &mut SoftwareBackend::new(),
        best(),
        &empty_world(),
        &nothing,
    );
    assert_eq!(counts.covered_pixels, 0);
}

#[test]
fn the_widest_image_is_exact_to_its_far_corner() {
    let mut world = empty_world();
    // From one guard band border to the other.
    let far = 16384.0;
    add_triangle(
        &mut world,
        [[-far, -far, 0.0], [far, 1.0, 1.0], [-far, far, 0.25]],
        [[0.0, 0.0, 1.0]; 3],
    );
    add_both_sides(
        &mut world,
        [[far, 5.0, 0.3], [3.0, 3.3, 0.9], [16300.0, 1.0, 0.5]],
        [[0.0, 0.0, 1.0]; 3],
    );
    let view = flat(16384, 5);
    let want = reference(&world, &view, 0..3);
    let mut backend = SoftwareBackend::new();
    for exec in levels() {
        rasterize(&mut backend, exec, &world, &view);
        Visibility::of(&backend).assert_same(&want, 16384, "widest");
    }
}

/// A few large triangles in perspective with colours and normals at their vertices.
fn colourful(random: &mut Random) -> (World, Vec3s) {
    let mut world = empty_world();
    let mut colours = Vec3s::default();
    for _ in 0..25 {
        let mut corner = || {
            [
                random.range(-3.0, 3.0),
                random.range(-2.0, 2.0),
                random.range(1.5, 6.0),
            ]
        };
        let corners = [corner(), corner(), corner()];
        let mut normal = || [random.range(-0.5, 0.5), random.range(-0.5, 0.5), -1.0];
        let normals = [normal(), normal(), normal()];
        // Whichever way it turns, it is seen with normals that point to the viewer.
        let ([a, b, c], [l, m, n]) = (corners, normals);
        add_triangle(&mut world, [a, b, c], [l, m, n]);
        add_triangle(&mut world, [a, c, b], [l, n, m]);
        (0..6).for_each(|_| colours.push(random.rgb()));
    }
    (world, colours)
}

/// Some triangles divided by any number, with random colours at their nodes.
fn curved_at_random(random: &mut Random, triangles: u32) -> CurvedTriangles {
    let mut curved = CurvedTriangles::default();
    curved.clear(triangles as usize);
    for triangle in (0..triangles).filter(|triangle| triangle % 4 != 0) {
        let n = [8, 1, 2, 4][triangle as usize % 7 % 4];
        // Not so steep that rounded weights would show.
        let mut node = || random.rgb().map(|c| 0.3 + 0.1 * c);
        let nodes: Vec<_> = (0..node_count(n)).map(|_| node()).collect();
        let first = curved.split_mut().1.len();
        curved.push(triangle, n);
        let parts = &mut curved.split_mut().1[first..];
        for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
            let kinds = if i + j < n - 1 {
                [true, false].as_slice()
            } else {
                &[true]
            };
            for &upright in kinds {
                let six = part_nodes(i, j, upright).map(|[a, b]| nodes[node_index(n, a, b)]);
                parts[part_index(n, i, j, upright)] = through(six);
            }
        }
    }
    curved
}

/// Every third triangle or so, curved or not.
fn lit_at_random(random: &mut Random, triangles: u32) -> TriangleSet {
    let mut lit = TriangleSet::default();
    lit.clear(triangles as usize);
    (0..triangles)
        .filter(|_| random.range(0.0, 3.0) < 1.0)
        .for_each(|triangle| lit.insert(triangle));
    lit
}

#[test]
fn gouraud_mixed_flat_and_phong_pixels_are_what_the_scalar_rules_say() {
    let mut random = Random(8);
    let (world, colours) = colourful(&mut random);
    let view = perspective(150, 100, 90.0, 0.1, 50.0);
    let mut flat_colours = Vec3s::default();
    world
        .triangles
        .iter()
        .for_each(|_| flat_colours.push(random.rgb()));
    let all = 0..world.triangles.len() as u32;
    let geometry = geometry(&world, &view, std::slice::from_ref(&all));
    let curved = curved_at_random(&mut random, all.end);
    let lit = lit_at_random(&mut random, all.end);
    let mixed_paint = BasePaint::Mixed {
        colours: &colours,
        curved: &curved,
        lit: &lit,
    };
    let mut backend = SoftwareBackend::new();
    for exec in levels() {
        backend.rasterize(exec, geometry);
        let ids = Visibility::of(&backend).ids;
        for (paint, name) in [
            (BasePaint::Gouraud(&colours), "gouraud"),
            (mixed_paint, "mixed"),
            (BasePaint::Flat(&flat_colours), "flat"),
            (BasePaint::Phong, "phong"),
        ] {
            backend.resolve(exec, geometry, paint);
            let mut frame = Frame::new(150, 100);
            assert_eq!(
                frame.write(|target| backend.present(exec, target)),
                150 * 100
            );
            let mut far_off = 0;
            for (i, (&id, got)) in ids.iter().zip(frame.pixels()).enumerate() {
                let mut at_horizon = false;
                let want: [f64; 3] = if id == NO_TRIANGLE {
                    world.background.map(f64::from)
                } else {
                    let w = scalar_weights(&world, &view, id, (i % 150) as i32, (i / 150) as i32);
                    let mix = |attribute: &Vec3s| -> [f32; 3] {
                        let corners =
                            world.triangles[id as usize].map(|v| attribute.get(v as usize));
                        std::array::from_fn(|k| (0..3).map(|c| w[c] * corners[c][k]).sum())
                    };
                    let mut illuminated = || {
                        let to_f64 = |v: [f32; 3]| glam::DVec3::from_array(v.map(f64::from));
                        let shaded = shade(
                            to_f64(mix(&world.positions)),
                            to_f64(mix(&world.normals)),
                            &view.eye,
                            &world.materials[usize::from(world.triangle_material[id as usize])],
                            &world.lights,
                        );
                        at_horizon = shaded.smallest_cosine < 1e-4;
                        shaded.rgb
                    };
                    match paint {
                        BasePaint::Gouraud(colours) | BasePaint::Refined { colours, .. } => {
                            mix(colours).map(f64::from)
                        }
                        BasePaint::Mixed { lit, .. } if lit.contains(id) => illuminated(),
                        BasePaint::Mixed {
                            colours, curved, ..
                        } => curved
                            .colour(id, w[1], w[2])
                            .unwrap_or_else(|| mix(colours))
                            .map(f64::from),
                        BasePaint::Flat(colours) => colours.get(id as usize).map(f64::from),
                        BasePaint::Phong => illuminated(),
                    }
                };
                for k in 0..3 {
                    let error = (f64::from(got[k]) - encode(want[k])).abs();
                    // Slivers are beyond single precision.
                    far_off += u32::from(error > 0.75 && !at_horizon);
                }
                if id == NO_TRIANGLE {
                    assert_eq!(
                        *got,
                        [
                            encode_u8(want[0]),
                            encode_u8(want[1]),
                            encode_u8(want[2]),
                            255
                        ]
                    );
                }
            }
            assert!(far_off < 20, "{name}, {exec:?}: {far_off} values are off");
        }
    }
}

#[test]
fn colours_do_not_depend_on_threads() {
    let mut random = Random(9);
    let (world, colours) = colourful(&mut random);
    let view = perspective(333, 222, 200.0, 0.1, 50.0);
    let all = 0..world.triangles.len() as u32;
    let geometry = geometry(&world, &view, std::slice::from_ref(&all));
    let curved = curved_at_random(&mut random, all.end);
    let lit = lit_at_random(&mut random, all.end);
    let mixed_paint = BasePaint::Mixed {
        colours: &colours,
        curved: &curved,
        lit: &lit,
    };
    for paint in [BasePaint::Gouraud(&colours), mixed_paint, BasePaint::Phong] {
        let draw = |exec| {
            let mut backend = SoftwareBackend::new();
            let mut frame = Frame::new(333, 222);
            backend.rasterize(exec, geometry);
            backend.resolve(exec, geometry, paint);
            frame.write(|target| backend.present(exec, target));
            frame
        };
        assert_eq!(draw(best()).as_bytes(), with_two_threads(draw).as_bytes());
    }
}

#[test]
fn frames_receive_exactly_the_tiles_that_changed() {
    let exec = best();
    let view = flat(256, 128);
    let mut world = empty_world();
    // In the first tile of eight.
    add_triangle(
        &mut world,
        [[5.0, 5.0, 0.5], [5.0, 50.0, 0.5], [50.0, 5.0, 0.5]],
        [[0.0, 0.0, 1.0]; 3],
    );
    let all = 0..1;
    let geometry = geometry(&world, &view, std::slice::from_ref(&all));
    let paint = |backend: &mut SoftwareBackend, value: f32| {
        let mut colours = Vec3s::default();
        (0..3).for_each(|_| colours.push([value; 3]));
        backend.rasterize(exec, geometry);
        backend.resolve(exec, geometry, BasePaint::Gouraud(&colours));
    };
    let mut backend = SoftwareBackend::new();
    let (mut a, mut b) = (Frame::new(256, 128), Frame::new(256, 128));
    paint(&mut backend, 0.25);
    assert_eq!(a.write(|target| backend.present(exec, target)), 256 * 128);
    assert_eq!(
        a.write(|target| backend.present(exec, target)),
        0,
        "nothing changed"
    );
    paint(&mut backend, 0.25);
    assert_eq!(
        a.write(|target| backend.present(exec, target)),
        0,
        "the same image again"
    );
    paint(&mut backend, 0.5);
    assert_eq!(a.write(|target| backend.present(exec, target)), 64 * 64);
    assert_eq!(b.write(|target| backend.present(exec, target)), 256 * 128);
    assert_eq!(a.as_bytes(), b.as_bytes());
    a.pixels_mut()[0] = [1, 2, 3, 4];
    assert_eq!(
        a.write(|target| backend.present(exec, target)),
        256 * 128,
        "somebody wrote into it"
    );
    assert_eq!(a.as_bytes(), b.as_bytes());
    assert_eq!(
        a.write(|target| SoftwareBackend::new().present(exec, target)),
        0,
        "no image of this size"
    );
    paint(&mut backend, 0.75);
    let mut other = SoftwareBackend::new();
    paint(&mut other, 0.75);
    assert_eq!(
        b.write(|target| other.present(exec, target)),
        256 * 128,
        "another writer's frame"
    );
}
