//! Random triangles, bit for bit: ids and depth of the whole image, and the counts that go with them, are what a rasterizer
//! finds that looks at all pixels one by one ([`support::exact`]), at every SIMD level, on one thread and on two.
//!
//! The soups aim at what a fast rasterizer treats specially: triangles of less than two pixels, needles, corners on and next
//! to borders of 4, 8, 16 and 64 pixels, images that end inside a block, coordinates that are no numbers.

mod support;

use proptest::prelude::*;
use specula::backend::software::SoftwareBackend;
use specula::scene::{View, World};
use support::exact::*;
use support::*;

/// Odd ones, ones that end a pixel before or behind a border, and one of several tiles.
const SIZES: [(u32, u32); 7] = [
    (1, 1),
    (3, 200),
    (17, 15),
    (65, 63),
    (130, 64),
    (257, 129),
    (300, 5),
];

/// The world is drawn as it should be, however it is drawn.
fn assert_exact(world: &World, view: &View, what: &str) {
    let want = drawn(world, view);
    on_each_exec(|exec| {
        let what = format!("{what}, {} x {}, {exec:?}", view.width, view.height);
        assert_drawn(&mut SoftwareBackend::new(), exec, world, view, &want, &what);
    });
}

fn assert_soups_exact(seed: u64, count: usize, corners: Corners, what: &str) {
    let mut random = Random(seed);
    // Three soups of each size.
    for (width, height) in SIZES.repeat(3) {
        let view = flat(width, height);
        let world = soup_of(&mut random, count, &view, corners);
        assert_exact(&world, &view, what);
    }
}

#[test]
fn small_triangles() {
    assert_soups_exact(201, 60, |random, size| around(random, size, 1.0), "small");
}

#[test]
fn tiny_triangles_around_pixel_centres() {
    let corners: Corners = |random, size| {
        let middle = somewhere(random, size).map(|v| v.floor() + 0.5);
        [0; 3].map(|_| {
            let mut moved = |v: f32| v + (random.below(7) as f32 - 3.0) / SUB as f32;
            [moved(middle[0]), moved(middle[1]), random.range(0.0, 1.0)]
        })
    };
    assert_soups_exact(202, 60, corners, "tiny");
}

#[test]
fn triangles_of_medium_and_large_size() {
    assert_soups_exact(203, 30, |random, size| around(random, size, 30.0), "medium");
    assert_soups_exact(204, 20, |random, size| around(random, size, 700.0), "large");
    assert_soups_exact(
        205,
        20,
        |random, size| around(random, size, 50_000.0),
        "huge",
    );
}

#[test]
fn needles() {
    let corners: Corners = |random, size| {
        let ([ax, ay], [bx, by]) = (somewhere(random, size), somewhere(random, size));
        let (share, width) = (random.range(-0.2, 1.2), [1e-3, 0.01, 0.3][random.below(3)]);
        let mut beside = |a: f32, b: f32| a + (b - a) * share + random.range(-width, width);
        let third = [beside(ax, bx), beside(ay, by)];
        [[ax, ay], [bx, by], third].map(|[x, y]| [x, y, random.range(0.0, 1.0)])
    };
    assert_soups_exact(206, 60, corners, "needles");
}

#[test]
fn triangles_without_area_and_several_times_the_same() {
    let degenerate: Corners = |random, size| {
        let [a, b, c] = around(random, size, 20.0);
        // On a line of pixel centres, too.
        let middle = |v: [f32; 3]| [v[0].floor() + 0.5, v[1].floor() + 0.5, v[2]];
        let (p, q) = (middle(a), middle(b));
        let between: [f32; 3] = std::array::from_fn(|i| (p[i] + q[i]) / 2.0);
        [
            [a, b, b],
            [a, a, a],
            [p, q, between],
            [p, [q[0], p[1], 0.5], q],
            [a, b, c],
        ][random.below(5)]
    };
    assert_soups_exact(207, 40, degenerate, "degenerate");
    let mut random = Random(208);
    for (width, height) in SIZES {
        let view = flat(width, height);
        let mut world = empty_world();
        for _ in 0..8 {
            let corners = around(&mut random, [width as f32, height as f32], 40.0);
            for turn in 0..4 {
                let mut corners = corners;
                corners.rotate_left(turn % 3);
                add_both_sides(&mut world, corners, NORMALS);
            }
        }
        assert_exact(&world, &view, "coincident");
    }
}

/// Coordinates on borders of blocks and tiles, or next to them, or on the centres of the pixels there.
fn at_border(random: &mut Random, side: f32) -> f32 {
    let block = [4.0, 8.0, 16.0, 64.0][random.below(4)];
    let border = block * random.below((side / block) as usize + 2) as f32;
    let step = 1.0 / SUB as f32;
    border + [0.0, step, -step, 0.5, -0.5, 0.5 + step, -0.5 - step][random.below(7)]
}

#[test]
fn corners_at_borders_of_tiles_and_blocks() {
    let corners: Corners = |random, size| {
        [0; 3].map(|_| {
            let [x, y] = size.map(|side| at_border(random, side));
            [x, y, random.range(0.0, 1.0)]
        })
    };
    assert_soups_exact(209, 40, corners, "borders");
}

#[test]
fn coordinates_that_are_no_numbers_or_beyond_any_screen() {
    let corners: Corners = |random, size| {
        let odd = [
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            f32::MIN,
            f32::MIN_POSITIVE,
            1e-42,
            -0.0,
            1e15,
            -1e9,
            16384.0,
            -16384.01,
        ];
        around(random, size, 60.0).map(|corner| {
            corner.map(|v| match random.below(6) {
                0 => odd[random.below(odd.len())],
                _ => v,
            })
        })
    };
    assert_soups_exact(210, 50, corners, "odd numbers");
}

#[test]
fn triangles_in_perspective_through_the_near_plane_and_behind_the_eye() {
    let mut random = Random(211);
    for (width, height) in SIZES {
        for near in [1e-4, 0.1, 1.5] {
            let view = perspective(width, height, f64::from(width.max(20)) * 0.6, near, 6.0);
            let world = soup(&mut random, 80);
            let want = drawn(&world, &view);
            assert_exact(&world, &view, "perspective");
            // The other slow rasterizer of these tests is right, too.
            let other = reference(&world, &view, 0..80);
            other.assert_same(&want, width, "the rules of `geometry::screen`");
        }
    }
}

#[test]
fn many_triangles_in_one_image() {
    let mut random = Random(212);
    let view = flat(200, 131);
    let world = soup_of(&mut random, 4000, &view, |random, size| {
        let reach = [0.5, 2.0, 9.0][random.below(3)];
        around(random, size, reach)
    });
    let want = reference(&world, &view, 0..8000);
    on_each_exec(|exec| {
        let what = format!("many, {exec:?}");
        assert_drawn(
            &mut SoftwareBackend::new(),
            exec,
            &world,
            &view,
            &want,
            &what,
        );
    });
}

/// A coordinate in sub-pixels: anything, a pixel's border or centre, or next to the border of a tile.
fn coordinate() -> impl Strategy<Value = i32> {
    prop_oneof![
        -500_i32..36_000,
        (-2_i32..280).prop_map(|halves| halves * SUB / 2),
        (0_i32..3, -3_i32..=3).prop_map(|(tile, beside)| tile * 64 * SUB + beside),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 1500, max_shrink_iters: 500, ..ProptestConfig::default() })]

    /// What fails here comes down to few triangles, small numbers and a small image.
    #[test]
    fn any_triangles_on_the_sub_pixel_grid(
        (width, height) in (1_u32..140, 1_u32..70),
        triangles in prop::collection::vec(
            prop::array::uniform3((coordinate(), coordinate(), 0_u8..=8)),
            1..6,
        ),
    ) {
        let mut world = empty_world();
        for corners in triangles {
            let corners = corners.map(|(x, y, z)| {
                [x as f32 / SUB as f32, y as f32 / SUB as f32, f32::from(z) / 8.0]
            });
            add_both_sides(&mut world, corners, NORMALS);
        }
        assert_exact(&world, &flat(width, height), "any");
    }
}
