//! Repainting parts of triangles: every owned pixel belongs to exactly one patch of any partition, and gets its colour.

mod support;

use specula::backend::software::{NO_TRIANGLE, SoftwareBackend};
use specula::backend::{Backend, BasePaint, Fill, Geometry, Patch};
use specula::geometry::{Bary, Quadratic, Vec3s};
use specula::illumination::ActiveLights;
use specula::output::Frame;
use specula::parallel::Exec;
use specula::scene::{View, World};
use specula::simd::SimdLevel;
use support::*;

/// Cuts a root triangle into pieces at random: in two at the middle of an edge or in four, over and over, without care for
/// neighbours.
fn subdivide(random: &mut Random, pieces: usize) -> Vec<[Bary; 3]> {
    let mut all = vec![Bary::ROOT];
    for _ in 0..50 * pieces {
        if all.len() >= pieces {
            break;
        }
        // The latest ones are the smallest: half of the time, go on with one of them.
        let at = if random.below(2) == 0 {
            random.below(all.len())
        } else {
            all.len() - 1
        };
        let [a, b, c] = all[at];
        let Some(ab) = Bary::midpoint(a, b) else {
            continue;
        };
        if random.below(2) == 0 {
            all[at] = [a, ab, c];
            let rest = [ab, b, c];
            // Turned, so that the next cut may be through another edge.
            all.push([rest[1], rest[2], rest[0]]);
        } else if let (Some(bc), Some(ca)) = (Bary::midpoint(b, c), Bary::midpoint(c, a)) {
            all[at] = [a, ab, ca];
            all.extend([[b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
    }
    all
}

fn gouraud(triangle: u32, corners: [Bary; 3], colours: [[f32; 3]; 3]) -> Patch {
    Patch {
        triangle,
        corners,
        fill: Fill::Gouraud(colours),
        pixels: 0,
    }
}

/// A root triangle's colours at the corners of a patch.
fn colours_at(patch: [Bary; 3], root: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
    patch.map(|corner| {
        let w = corner.weights();
        std::array::from_fn(|k| w[0] * root[0][k] + w[1] * root[1][k] + w[2] * root[2][k])
    })
}

fn image(backend: &mut SoftwareBackend, exec: Exec, view: &View) -> Vec<[u8; 4]> {
    let mut frame = Frame::new(view.width, view.height);
    frame.write(|target| backend.present(exec, target));
    frame.pixels().to_vec()
}

/// Random worlds in perspective and on the raster, with triangles through the near plane, slivers, and vertices on pixel centres.
fn worlds(random: &mut Random) -> Vec<(World, View)> {
    let mut all = vec![
        (soup(random, 40), perspective(160, 120, 100.0, 0.1, 50.0)),
        (soup(random, 150), perspective(130, 70, 60.0, 0.001, 1000.0)),
    ];
    for _ in 0..4 {
        let world = soup_of_sizes(random, 60, &[0.1, 0.5, 1.0, 2.0]);
        all.push((world, perspective(160, 120, 100.0, 0.01, 50.0)));
    }
    let mut world = empty_world();
    let on_grid: [[[f32; 3]; 3]; 4] = [
        [[0.5, 0.5, 0.9], [64.5, 0.5, 0.9], [0.5, 64.5, 0.9]],
        [[64.5, 0.5, 0.8], [64.5, 64.5, 0.8], [0.5, 64.5, 0.8]],
        [
            [-3000.0, -2000.0, 0.1],
            [700.0, 10.0, 0.2],
            [-100.0, 400.0, 0.3],
        ],
        [[70.0, 10.0, 0.9], [140.0, 10.4, 0.9], [70.0, 10.9, 0.9]],
    ];
    for corners in on_grid {
        add_both_sides(&mut world, corners, [[0.0, 0.0, 1.0]; 3]);
    }
    all.push((world, flat(150, 80)));
    all
}

fn all_triangles(world: &World) -> std::ops::Range<u32> {
    0..world.triangles.len() as u32
}

/// Draws everything black.
fn draw_black(backend: &mut SoftwareBackend, exec: Exec, geometry: Geometry<'_>) {
    let mut black = Vec3s::default();
    black.resize(geometry.world.positions.len());
    backend.rasterize(exec, geometry);
    backend.resolve(exec, geometry, BasePaint::Gouraud(&black));
}

#[test]
fn each_owned_pixel_belongs_to_exactly_one_patch_of_a_partition() {
    let mut random = Random(11);
    let white = [[1.0; 3]; 3];
    let mut painted_patches = 0;
    for (world, view) in worlds(&mut random) {
        let all = all_triangles(&world);
        let geometry = geometry(&world, &view, std::slice::from_ref(&all));
        for exec in levels() {
            let mut backend = SoftwareBackend::new();
            draw_black(&mut backend, exec, geometry);
            let mut patches = Vec::new();
            for &id in backend.visible_triangles() {
                let pieces = [1, 3, 50, 400][random.below(4)];
                let parts = subdivide(&mut random, pieces);
                patches.extend(parts.into_iter().map(|part| gouraud(id, part, white)));
            }
            // Neither the order nor the neighbours matter.
            for i in (1..patches.len()).rev() {
                patches.swap(i, random.below(i + 1));
            }
            backend.repaint(exec, geometry, &mut patches);
            for &id in backend.visible_triangles() {
                let painted: u32 = patches
                    .iter()
                    .filter(|p| p.triangle == id)
                    .map(|p| p.pixels)
                    .sum();
                assert_eq!(
                    painted,
                    backend.visible_pixels(id),
                    "triangle {id}, {exec:?}"
                );
            }
            // With the sums right, no pixel left out means that none is painted twice.
            let ids = Visibility::of(&backend).ids;
            for (id, pixel) in ids.iter().zip(image(&mut backend, exec, &view)) {
                assert!(
                    *id == NO_TRIANGLE || pixel == [255; 4],
                    "a pixel of {id} was left out"
                );
            }
            painted_patches += patches.iter().filter(|p| p.pixels > 0).count();
        }
    }
    assert!(
        painted_patches > 2000,
        "{painted_patches} patches with pixels are no test"
    );
}

/// Cuts a root triangle in four about each of some points, given as second and third weight, as deep as the grid goes.
fn subdivide_about(points: &[[f32; 2]]) -> Vec<[Bary; 3]> {
    let mut all = vec![Bary::ROOT];
    for point in points {
        let holds = |corners: &[Bary; 3]| {
            (0..3).all(|i| {
                let [p, q] = [corners[i], corners[(i + 1) % 3]].map(|c| c.weights());
                let (u, v) = (q[1] - p[1], q[2] - p[2]);
                u * (point[1] - p[2]) - v * (point[0] - p[1]) >= 0.0
            })
        };
        while let Some(at) = all.iter().position(holds) {
            let [a, b, c] = all[at];
            let middles = [(a, b), (b, c), (c, a)].map(|(p, q)| Bary::midpoint(p, q));
            let [Some(ab), Some(bc), Some(ca)] = middles else {
                break;
            };
            all[at] = [a, ab, ca];
            all.extend([[b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
    }
    all
}

#[test]
fn no_pixel_is_lost_where_patches_are_as_fine_as_the_grid() {
    // Triangles so large on the screen that a step of the barycentric grid is a good part of a pixel; the second in perspective.
    let mut random = Random(17);
    let mut world = empty_world();
    let corners = [
        [-16000.0, -15000.0, 0.5],
        [-9000.0, 16000.0, 0.5],
        [16000.0, -8000.0, 0.5],
    ];
    add_triangle(&mut world, corners, [[0.0, 0.0, 1.0]; 3]);
    let mut deep = empty_world();
    let corners = [[-0.4, -0.3, 0.011], [-90.0, 95.0, 49.0], [8.0, -1.0, 2.0]];
    add_triangle(&mut deep, corners, [[0.0, 0.0, -1.0]; 3]);
    for (world, view) in [
        (world, flat(120, 90)),
        (deep, perspective(120, 90, 90.0, 0.01, 50.0)),
    ] {
        let all = 0..1;
        let geometry = geometry(&world, &view, std::slice::from_ref(&all));
        let mut backend = SoftwareBackend::new();
        draw_black(&mut backend, best(), geometry);
        let ids = Visibility::of(&backend).ids;
        let owned: Vec<_> = (0..ids.len()).filter(|&i| ids[i] == 0).collect();
        assert!(owned.len() > 4000, "{}", owned.len());
        for _ in 0..20 {
            let points: Vec<_> = (0..200)
                .map(|_| {
                    let at = owned[random.below(owned.len())];
                    let w = scalar_weights(&world, &view, 0, (at % 120) as i32, (at / 120) as i32);
                    [w[1], w[2]]
                })
                .collect();
            let mut patches: Vec<_> = subdivide_about(&points)
                .into_iter()
                .map(|part| gouraud(0, part, [[1.0; 3]; 3]))
                .collect();
            backend.repaint(best(), geometry, &mut patches);
            let painted: u32 = patches.iter().map(|patch| patch.pixels).sum();
            assert_eq!(painted as usize, owned.len());
        }
    }
}

#[test]
fn linear_colours_on_any_partition_give_the_gouraud_image() {
    let mut random = Random(12);
    for (world, view) in worlds(&mut random) {
        let mut colours = Vec3s::default();
        (0..world.positions.len()).for_each(|_| colours.push(random.rgb()));
        let all = all_triangles(&world);
        let geometry = geometry(&world, &view, std::slice::from_ref(&all));
        for exec in levels() {
            let mut backend = SoftwareBackend::new();
            backend.rasterize(exec, geometry);
            backend.resolve(exec, geometry, BasePaint::Gouraud(&colours));
            let want = image(&mut backend, exec, &view);
            draw_black(&mut backend, exec, geometry);
            let mut patches = Vec::new();
            for &id in backend.visible_triangles() {
                let root = world.triangles[id as usize].map(|v| colours.get(v as usize));
                let parts = subdivide(&mut random, 30);
                patches.extend(
                    parts
                        .into_iter()
                        .map(|part| gouraud(id, part, colours_at(part, root))),
                );
            }
            backend.repaint(exec, geometry, &mut patches);
            for (i, (got, want)) in image(&mut backend, exec, &view)
                .iter()
                .zip(&want)
                .enumerate()
            {
                let off = (0..4).any(|k| got[k].abs_diff(want[k]) > 1);
                assert!(!off, "pixel {i}: {got:?} instead of {want:?}, {exec:?}");
            }
        }
    }
}

#[test]
fn colours_never_leave_the_range_of_a_patch_however_small() {
    let mut random = Random(13);
    let mut world = empty_world();
    let corners = [[0.0, 0.0, 0.5], [150.0, 3.0, 0.5], [5.0, 90.0, 0.5]];
    add_triangle(&mut world, corners, [[0.0, 0.0, 1.0]; 3]);
    let (view, all) = (flat(150, 90), 0..1);
    let geometry = geometry(&world, &view, std::slice::from_ref(&all));
    let mut backend = SoftwareBackend::new();
    draw_black(&mut backend, best(), geometry);
    // Mid grey to light grey, as codes.
    let (low, high) = (0.2, 0.4);
    let code = specula::output::encode::encode_u8;
    let range = code(f64::from(low)) - 1..=code(f64::from(high)) + 1;
    let mut patches: Vec<_> = subdivide(&mut random, 4000)
        .into_iter()
        .map(|part| gouraud(0, part, [[low; 3], [high; 3], [low; 3]]))
        .collect();
    backend.repaint(best(), geometry, &mut patches);
    let ids = Visibility::of(&backend).ids;
    for (id, pixel) in ids.iter().zip(image(&mut backend, best(), &view)) {
        assert!(
            *id == NO_TRIANGLE || pixel[..3].iter().all(|c| range.contains(c)),
            "{pixel:?}"
        );
    }
}

#[test]
fn phong_on_whole_triangles_is_the_phong_image_to_the_last_bit() {
    let mut random = Random(14);
    for (mut world, view) in worlds(&mut random) {
        for i in 0..world.normals.len() {
            world
                .normals
                .set(i, [random.range(-0.7, 0.7), random.range(-0.7, 0.7), -1.0]);
        }
        let all = all_triangles(&world);
        let geometry = geometry(&world, &view, std::slice::from_ref(&all));
        let fill = Fill::Phong {
            lights: ActiveLights::all(world.lights.len()),
            remainder: Quadratic::default(),
        };
        for exec in levels() {
            let mut backend = SoftwareBackend::new();
            backend.rasterize(exec, geometry);
            backend.resolve(exec, geometry, BasePaint::Phong);
            let want = image(&mut backend, exec, &view);
            draw_black(&mut backend, exec, geometry);
            let whole = |&triangle: &u32| Patch {
                triangle,
                corners: Bary::ROOT,
                fill,
                pixels: 0,
            };
            let mut patches: Vec<_> = backend.visible_triangles().iter().map(whole).collect();
            backend.repaint(exec, geometry, &mut patches);
            assert!(image(&mut backend, exec, &view) == want, "whole, {exec:?}");
            // Nor does it matter how a triangle is cut up.
            draw_black(&mut backend, exec, geometry);
            let mut patches = Vec::new();
            for &triangle in backend.visible_triangles() {
                let parts = subdivide(&mut random, 12).into_iter();
                patches.extend(parts.map(|corners| Patch {
                    triangle,
                    corners,
                    fill,
                    pixels: 0,
                }));
            }
            backend.repaint(exec, geometry, &mut patches);
            assert!(
                image(&mut backend, exec, &view) == want,
                "in parts, {exec:?}"
            );
        }
    }
}

#[test]
fn without_lights_ambient_and_the_remainder_are_left() {
    let mut world = empty_world();
    let corners = [[0.0, 0.0, 0.5], [80.0, 0.0, 0.5], [0.0, 60.0, 0.5]];
    add_triangle(&mut world, corners, [[0.0, 0.0, 1.0]; 3]);
    let (view, all) = (flat(90, 70), 0..1);
    let geometry = geometry(&world, &view, std::slice::from_ref(&all));
    let remainder = [[0.1, 0.5, 0.9], [0.8, 0.2, 0.3], [0.0, 0.4, 0.7]];
    let mut colours = Vec3s::default();
    for corner in remainder {
        colours.push(std::array::from_fn(|k| {
            corner[k] + world.materials[0].ambient[k]
        }));
    }
    let mut backend = SoftwareBackend::new();
    backend.rasterize(best(), geometry);
    backend.resolve(best(), geometry, BasePaint::Gouraud(&colours));
    let want = image(&mut backend, best(), &view);
    draw_black(&mut backend, best(), geometry);
    let fill = Fill::Phong {
        lights: ActiveLights::default(),
        remainder: Quadratic::linear(remainder),
    };
    let mut patches = [Patch {
        triangle: 0,
        corners: Bary::ROOT,
        fill,
        pixels: 0,
    }];
    backend.repaint(best(), geometry, &mut patches);
    for (got, want) in image(&mut backend, best(), &view).iter().zip(&want) {
        assert!(
            (0..3).all(|k| got[k].abs_diff(want[k]) <= 1),
            "{got:?} {want:?}"
        );
    }
}

#[test]
fn pixels_of_other_triangles_and_tiles_that_stay_the_same_are_left_alone() {
    let mut random = Random(15);
    let (world, view) = (
        soup(&mut random, 80),
        perspective(200, 150, 120.0, 0.1, 50.0),
    );
    let all = all_triangles(&world);
    let geometry = geometry(&world, &view, std::slice::from_ref(&all));
    let exec = best();
    let mut backend = SoftwareBackend::new();
    draw_black(&mut backend, exec, geometry);
    let mut frame = Frame::new(200, 150);
    frame.write(|target| backend.present(exec, target));
    let chosen = backend.visible_triangles()[backend.visible_triangles().len() / 2];
    let hidden = (0..80)
        .find(|&id| backend.visible_pixels(id) == 0)
        .expect("some are hidden");
    let part = subdivide(&mut random, 4);
    let mut patches = [
        gouraud(chosen, part[0], [[1.0; 3]; 3]),
        gouraud(hidden, Bary::ROOT, [[1.0; 3]; 3]),
        // Without area, backwards, and of no triangle.
        gouraud(chosen, [part[0][0]; 3], [[1.0; 3]; 3]),
        gouraud(chosen, [part[0][0], part[0][2], part[0][1]], [[1.0; 3]; 3]),
        gouraud(NO_TRIANGLE, Bary::ROOT, [[1.0; 3]; 3]),
    ];
    backend.repaint(exec, geometry, &mut patches);
    assert!(patches[1..].iter().all(|patch| patch.pixels == 0));
    let before = frame.clone();
    let written = frame.write(|target| backend.present(exec, target));
    let ids = Visibility::of(&backend).ids;
    let mut changed = 0;
    for ((&id, old), new) in ids.iter().zip(before.pixels()).zip(frame.pixels()) {
        if old != new {
            assert_eq!(id, chosen);
            changed += 1;
        }
    }
    assert_eq!(changed, patches[0].pixels);
    assert!(written >= u64::from(changed) && written < 200 * 150);
    // The same paint again changes nothing.
    backend.repaint(exec, geometry, &mut patches);
    assert_eq!(frame.write(|target| backend.present(exec, target)), 0);
}

#[test]
fn two_threads_paint_what_one_does() {
    let mut random = Random(16);
    for (world, view) in worlds(&mut random) {
        let all = all_triangles(&world);
        let geometry = geometry(&world, &view, std::slice::from_ref(&all));
        let mut parts = Vec::new();
        for id in all.clone() {
            for part in subdivide(&mut random, 25) {
                parts.push(gouraud(
                    id,
                    part,
                    [random.rgb(), random.rgb(), random.rgb()],
                ));
            }
        }
        let draw = |exec| {
            let mut backend = SoftwareBackend::new();
            draw_black(&mut backend, exec, geometry);
            let mut patches = parts.clone();
            backend.repaint(exec, geometry, &mut patches);
            let pixels: Vec<_> = patches.iter().map(|patch| patch.pixels).collect();
            (pixels, image(&mut backend, exec, &view))
        };
        assert!(draw(best()) == with_two_threads(draw));
    }
}

#[test]
fn levels_with_fused_multiply_add_paint_the_same() {
    let mut random = Random(18);
    let fused: Vec<_> = [SimdLevel::Avx2, SimdLevel::Avx512]
        .into_iter()
        .filter_map(SimdLevel::token)
        .map(|level| Exec { level, threads: 1 })
        .collect();
    for (mut world, view) in worlds(&mut random) {
        for i in 0..world.normals.len() {
            world
                .normals
                .set(i, [random.range(-0.7, 0.7), random.range(-0.7, 0.7), -1.0]);
        }
        let all = all_triangles(&world);
        let geometry = geometry(&world, &view, std::slice::from_ref(&all));
        let lights = ActiveLights::all(world.lights.len());
        let mut parts = Vec::new();
        for id in all.clone() {
            for part in subdivide(&mut random, 25) {
                let corners = [random.rgb(), random.rgb(), random.rgb()];
                let mut patch = gouraud(id, part, corners);
                if random.below(2) == 0 {
                    patch.fill = Fill::Phong {
                        lights,
                        remainder: Quadratic::linear(corners),
                    };
                }
                parts.push(patch);
            }
        }
        let painted: Vec<_> = fused
            .iter()
            .map(|&exec| {
                let mut backend = SoftwareBackend::new();
                draw_black(&mut backend, exec, geometry);
                let mut patches = parts.clone();
                backend.repaint(exec, geometry, &mut patches);
                let pixels: Vec<_> = patches.iter().map(|patch| patch.pixels).collect();
                (pixels, image(&mut backend, exec, &view))
            })
            .collect();
        assert!(painted.windows(2).all(|pair| pair[0] == pair[1]));
    }
}
