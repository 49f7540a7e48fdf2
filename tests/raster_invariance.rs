//! What must make no difference to ids and depth: the order of triangles, where the borders of tiles and blocks fall, and what
//! was drawn before. At every SIMD level, on one thread and on two.

mod support;

use specula::backend::software::{NO_TRIANGLE, SoftwareBackend};
use specula::scene::World;
use support::exact::*;
use support::*;

#[test]
fn the_order_of_triangles_makes_no_difference() {
    let mut random = Random(213);
    let view = flat(150, 100);
    // Sloping, each in a layer of its own, so that no two are equally near anywhere.
    let count = 100;
    let layers: Vec<_> = (0..count)
        .map(|layer| {
            around(&mut random, [150.0, 100.0], 60.0)
                .map(|[x, y, z]| [x, y, (layer as f32 + 0.1 + 0.8 * z) / count as f32])
        })
        .collect();
    let draw = |exec, order: &[usize]| {
        let mut world = empty_world();
        for &layer in order {
            add_both_sides(&mut world, layers[layer], NORMALS);
        }
        let mut backend = SoftwareBackend::new();
        rasterize(&mut backend, exec, &world, &view);
        let mut image = Visibility::of(&backend);
        for id in image.ids.iter_mut().filter(|id| **id != NO_TRIANGLE) {
            // Fronts and backs of a layer are next to each other.
            *id = order[*id as usize / 2] as u32;
        }
        image
    };
    let mut orders = vec![(0..count).collect::<Vec<_>>(), (0..count).rev().collect()];
    for _ in 0..4 {
        let mut order = orders[0].clone();
        for i in (1..count).rev() {
            order.swap(i, random.below(i + 1));
        }
        orders.push(order);
    }
    let want = draw(best(), &orders[0]);
    on_each_exec(|exec| {
        for order in &orders {
            draw(exec, order).assert_same(&want, 150, &format!("{exec:?}, {order:?}"));
        }
    });
}

/// Triangles on the sub-pixel grid inside of 70 x 70 pixels, moved by whole pixels. Their depths have slopes of few bits, so that
/// it is exact wherever it is computed from.
fn exact_scene(seed: u64, moved: [i32; 2]) -> World {
    let mut random = Random(seed);
    let mut world = empty_world();
    for _ in 0..80 {
        let reach = [300, 2000, 18_000][random.below(3)];
        let [x, y] = [0; 2].map(|_| random.below(70 * SUB as usize) as i32);
        let slope = [0; 2].map(|_| random.below(9) as i32 - 4);
        let nearness = (1 << 20) + random.below(1 << 21) as i32;
        let corners = [0; 3].map(|_| {
            let [x, y] = [x, y]
                .map(|v| (v + random.below(reach) as i32 - reach as i32 / 2).clamp(0, 70 * SUB));
            let depth = nearness + slope[0] * x + slope[1] * y;
            let pixels = |v: i32, axis: usize| v as f32 / SUB as f32 + moved[axis] as f32;
            [pixels(x, 0), pixels(y, 1), depth as f32 / (1 << 22) as f32]
        });
        add_both_sides(&mut world, corners, NORMALS);
    }
    world
}

#[test]
fn where_tiles_and_blocks_end_makes_no_difference() {
    let window = flat(70, 70);
    for seed in 214..218 {
        let want = drawn(&exact_scene(seed, [0, 0]), &window);
        for moved in [
            [0, 0],
            [1, 0],
            [0, 1],
            [3, 5],
            [4, 8],
            [15, 17],
            [32, 2],
            [63, 64],
            [90, 61],
        ] {
            let world = exact_scene(seed, moved);
            let view = flat(170, 141);
            let [dx, dy] = moved.map(|v| v as usize);
            on_each_exec(|exec| {
                let mut backend = SoftwareBackend::new();
                let counts = rasterize(&mut backend, exec, &world, &view);
                let all = Visibility::of(&backend);
                let rows = (dy..dy + 70).map(|y| y * 170 + dx..y * 170 + dx + 70);
                let image = Visibility {
                    ids: rows
                        .clone()
                        .flat_map(|row| &all.ids[row])
                        .copied()
                        .collect(),
                    depths: rows.flat_map(|row| &all.depths[row]).copied().collect(),
                };
                let what = format!("seed {seed}, moved by {moved:?}, {exec:?}");
                image.assert_same(&want, 70, &what);
                let inside = image.ids.iter().filter(|&&id| id != NO_TRIANGLE).count();
                assert_eq!(counts.covered_pixels, inside as u64, "{what}: outside");
            });
        }
    }
}

#[test]
fn what_was_drawn_before_makes_no_difference() {
    let mut random = Random(219);
    let mut scene = |width, height, count, reach: Corners| {
        let view = flat(width, height);
        let world = soup_of(&mut random, count, &view, reach);
        let want = drawn(&world, &view);
        (world, view, want)
    };
    let small: Corners = |random, size| around(random, size, 2.0);
    let large: Corners = |random, size| around(random, size, 80.0);
    let scenes = [
        scene(130, 70, 150, large),
        scene(130, 70, 30, small),
        scene(130, 70, 0, small),
        scene(131, 70, 100, small),
        scene(1, 1, 20, large),
        scene(65, 140, 50, large),
        scene(130, 70, 80, small),
    ];
    on_each_exec(|exec| {
        let mut backend = SoftwareBackend::new();
        for round in [
            [0, 1, 2, 3, 4, 5, 6],
            [6, 4, 2, 0, 5, 3, 1],
            [0, 6, 1, 2, 1, 6, 6],
        ] {
            for (world, view, want) in round.map(|i| &scenes[i]) {
                let what = format!("{round:?}, {exec:?}");
                assert_drawn(&mut backend, exec, world, view, want, &what);
            }
        }
    });
}
