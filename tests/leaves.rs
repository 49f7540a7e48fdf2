//! `Engine::for_each_leaf` says what the image consists of: held against the image itself.

#[path = "support/leaves.rs"]
mod support;

use specula::frame::LeafKind;
use specula::geometry::Bary;
use specula::output::encode::encode;
use specula::{Budget, Engine, EngineOptions, Frame, Method, Scene};
use std::collections::HashMap;
use support::{inside, leaves, pixels};

const SIZE: (u32, u32) = (480, 320);

/// Small triangles, and large ones that are shaded part by part; enough lights for subdivision to pay.
const SCENE: &str = r"(
    camera: Perspective(position: (3.0, -7.0, 4.0), target: (0.0, 0.0, 0.7), fov_degrees: 40.0),
    lights: [
        Point(position: (4.0, -5.0, 6.0), intensity: 0.6), Point(position: (-4.0, 3.0, 5.0), intensity: 0.4),
        Point(position: (3.0, -6.0, 4.0), intensity: 0.05),
        Point(position: (1.0, -5.0, 5.0), intensity: 0.05),
        Point(position: (-1.0, -4.0, 6.0), intensity: 0.05),
        Point(position: (-3.0, -3.0, 4.0), intensity: 0.05),
        Point(position: (3.0, -2.0, 5.0), intensity: 0.05),
        Point(position: (1.0, -6.0, 6.0), intensity: 0.05),
        Point(position: (-1.0, -5.0, 4.0), intensity: 0.05),
        Point(position: (-3.0, -4.0, 5.0), intensity: 0.05),
        Point(position: (3.0, -3.0, 6.0), intensity: 0.05),
        Point(position: (1.0, -2.0, 4.0), intensity: 0.05),
        Point(position: (-1.0, -6.0, 5.0), intensity: 0.05),
        Point(position: (-3.0, -5.0, 6.0), intensity: 0.05),
        Point(position: (3.0, -4.0, 4.0), intensity: 0.05),
        Point(position: (1.0, -3.0, 5.0), intensity: 0.05),
    ],
    objects: [
        (shape: Teapot(tessellation: 3)),
        (shape: Plane(width: 12.0, depth: 12.0, columns: 2, rows: 2)),
    ],
)";

fn engine(scene: &Scene, method: Method) -> Engine {
    let options = EngineOptions {
        method,
        threads: Some(1),
        ..EngineOptions::default()
    };
    Engine::with_options(scene, options).expect("the options are valid")
}

#[test]
fn leaves_divide_every_visible_triangle_and_colour_its_pixels_as_they_say() {
    let scene = Scene::parse(SCENE, "leaves.ron").expect("the scene is valid");
    let (reference, points) = pixels(&scene, SIZE);
    let mut engine = engine(&scene, Method::Adaptive);
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    engine.for_each_leaf(|leaf| panic!("there is no image yet, but {leaf:?}"));
    // Beginning with Gouraud shading, then again with as much as is done before the first image is drawn.
    let from_nothing = [0, 30_000, 20_000, 100_000, 50_000, 500_000].map(|units| (units, false));
    let from_some = [(400_000, true), (200_000, false), (500_000, false)];

    let mut seen: HashMap<&str, u32> = HashMap::new();
    let mut squares: HashMap<&str, [f64; 2]> = HashMap::new();
    for (units, is_cold) in from_nothing.into_iter().chain(from_some) {
        if is_cold {
            engine.forget();
        }
        engine.render(&scene, Budget::Work(units), &mut frame);
        let all = leaves(&engine);
        for (&triangle, leaves) in &all {
            let area: i32 = leaves
                .iter()
                .map(|leaf| Bary::doubled_area(leaf.corners))
                .sum();
            assert_eq!(area, 1 << 30, "{triangle}: {leaves:?}");
        }
        let mut checked = 0;
        for (index, point) in points.iter().enumerate() {
            let Some((triangle, point)) = *point else {
                continue;
            };
            // Next to a border it may belong to either side.
            let holders = all[&triangle].iter().filter_map(|leaf| {
                let weights = inside(leaf, point);
                weights.iter().all(|&w| w > 2e-3).then_some((leaf, weights))
            });
            let holders: Vec<_> = holders.collect();
            assert!(holders.len() <= 1, "leaves overlap: {holders:?}");
            let Some(&(leaf, weights)) = holders.first() else {
                continue;
            };
            let [r, g, b, _] = frame.pixels()[index].map(f64::from);
            let expected = match (leaf.is_painted, leaf.kind) {
                (false, _) => {
                    *seen.entry("waiting").or_default() += 1;
                    continue;
                }
                (true, LeafKind::PerPixel) => {
                    *seen.entry("per pixel").or_default() += 1;
                    reference.codes[index]
                }
                // Quadratics, besides highlights evaluated at every pixel: close to what is right, and no more than that.
                (true, kind @ (LeafKind::Curved | LeafKind::Highlights)) => {
                    let name = if kind == LeafKind::Curved {
                        "curved"
                    } else {
                        "highlights"
                    };
                    *seen.entry(name).or_default() += 1;
                    let square = |codes: [f64; 3]| -> f64 {
                        let off = (0..3).map(|k| reference.codes[index][k] - codes[k]);
                        off.map(|o| o * o).sum()
                    };
                    let interpolated = std::array::from_fn(|k| {
                        let corners = leaf.colours.map(|c| f64::from(c[k]));
                        let linear: f64 = (0..3).map(|i| weights[i] * corners[i]).sum();
                        encode(linear.clamp(0.0, 1.0))
                    });
                    let sums = squares.entry(name).or_default();
                    *sums = [sums[0] + square([r, g, b]), sums[1] + square(interpolated)];
                    continue;
                }
                (true, LeafKind::Interpolated | LeafKind::Proved) => {
                    let name = if leaf.level > 0 { "finer" } else { "whole" };
                    *seen.entry(name).or_default() += 1;
                    let colours = leaf.colours.map(|c| c.map(f64::from));
                    std::array::from_fn(|k| {
                        let linear: f64 = (0..3).map(|i| weights[i] * colours[i][k]).sum();
                        encode(linear.clamp(0.0, 1.0))
                    })
                }
            };
            let off = (0..3).map(|k| (expected[k] - [r, g, b][k]).abs());
            let off = off.fold(0.0, f64::max);
            assert!(off < 2.0, "pixel {index} is off by {off} codes: {leaf:?}");
            checked += 1;
        }
        assert!(checked > 5000, "{checked} pixels checked");
    }
    for (name, [shown, interpolated]) in squares {
        assert!(shown < 0.5 * interpolated, "{name}: {shown} {interpolated}");
    }
    for name in [
        "waiting",
        "per pixel",
        "finer",
        "whole",
        "curved",
        "highlights",
    ] {
        assert!(seen.get(name).is_some_and(|&n| n > 100), "{name}: {seen:?}");
    }
}

#[test]
fn pixels_add_up_and_a_converged_image_has_none_left_to_refine() {
    let scene = Scene::parse(SCENE, "leaves.ron").expect("the scene is valid");
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    for method in Method::ALL {
        let mut engine = engine(&scene, method);
        let stats = engine.render(&scene, Budget::Unlimited, &mut frame);
        let all = leaves(&engine);
        assert_eq!(all.len() as u64, stats.triangles_visible, "{method}");
        let leaves = || all.values().flatten();
        let total: u64 = leaves().map(|leaf| u64::from(leaf.pixels)).sum();
        if method == Method::Adaptive {
            // Pixels of parts are estimated.
            let off = total.abs_diff(stats.covered_pixels);
            assert!(off < stats.covered_pixels / 20, "{total} {stats:?}");
            let phts = all.values().filter(|leaves| leaves[0].is_pht).count();
            assert_eq!(phts as u64, stats.pht_visible);
        } else {
            assert_eq!(total, stats.covered_pixels, "{method}");
        }
        assert!(leaves().all(|leaf| leaf.is_painted), "{method}");
        let open = leaves().any(|leaf| leaf.kind == LeafKind::Interpolated && leaf.pixels > 0);
        assert_eq!(
            open,
            matches!(method, Method::Flat | Method::Gouraud) || method.is_of_the_paper(),
            "{method}"
        );
    }
}
