//! The paper's three methods and its experiment: what their images have in common with Gouraud and Phong shading.

mod program;

use program::{specula, text};
use serde_json::Value;
use specula::frame::{FrameStats, LeafKind};
use specula::measure::{ErrorReport, ReferenceImage};
use specula::refine::paper::PaperRule;
use specula::scene::World;
use specula::{Budget, Engine, EngineOptions, Frame, Method, Scene};
use std::path::Path;

const SIZE: (u32, u32) = (320, 240);

const TEAPOT: &str = include_str!("../scenes/teapot.ron");

fn scene() -> Scene {
    Scene::parse(TEAPOT, "teapot.ron").expect("the scene is valid")
}

fn engine(scene: &Scene, method: Method, paper: PaperRule, threads: usize) -> Engine {
    let options = EngineOptions {
        method,
        paper,
        threads: Some(threads),
        ..EngineOptions::default()
    };
    Engine::with_options(scene, options).expect("the options are valid")
}

fn image(method: Method, paper: PaperRule, threads: usize) -> (Frame, FrameStats) {
    let scene = scene();
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    let mut engine = engine(&scene, method, paper, threads);
    let stats = engine.render(&scene, Budget::Unlimited, &mut frame);
    (frame, stats)
}

fn with_area(area_px: f32) -> PaperRule {
    PaperRule {
        area_px,
        ..PaperRule::default()
    }
}

fn with_difference(difference: f32) -> PaperRule {
    PaperRule {
        difference,
        ..PaperRule::default()
    }
}

fn rmse(frame: &Frame) -> f64 {
    let scene = scene();
    let world = World::new(&scene);
    let view = world.view(scene.camera(), SIZE.0, SIZE.1);
    let reference = ReferenceImage::render(&world, &view, 2);
    let report = ErrorReport::compare(frame, &reference).expect("of one size");
    report.rmse
}

#[test]
fn nothing_is_subdivided_above_the_largest_threshold() {
    let (gouraud, _) = image(Method::Gouraud, PaperRule::default(), 1);
    let (regular, stats) = image(Method::Regular, with_area(f32::INFINITY), 1);
    assert_eq!(regular.pixels(), gouraud.pixels());
    assert_eq!((stats.triangles_subdivided, stats.leaves), (0, 0));
    assert!(stats.pht_visible > 0);
}

#[test]
fn regular_subdivision_comes_closer_to_phong_shading_the_smaller_its_parts() {
    let (gouraud, _) = image(Method::Gouraud, PaperRule::default(), 1);
    let mut last = rmse(&gouraud);
    let mut parts = 0;
    for area in [128.0, 32.0, 8.0, 2.0] {
        let (frame, stats) = image(Method::Regular, with_area(area), 1);
        let error = rmse(&frame);
        assert!(error < last, "{area} px: {error} after {last}");
        assert!(stats.leaves > parts, "{area} px: {stats:?}");
        (last, parts) = (error, stats.leaves);
    }
    // Potentially highlighted triangles are all right by now, others are still Gouraud shaded.
    assert!(last < 0.6 * rmse(&gouraud), "{last}");
}

#[test]
fn more_rings_subdivide_more() {
    let rule = |rings| PaperRule {
        rings,
        ..with_area(4.0)
    };
    let subdivided = [0, 1, 2].map(|rings| image(Method::Regular, rule(rings), 1).1);
    let counts = subdivided.each_ref().map(|s| s.triangles_subdivided);
    assert!(counts.is_sorted_by(|a, b| a < b), "{counts:?}");
    let [none, ..] = &subdivided;
    assert!(none.triangles_subdivided <= none.pht_visible, "{none:?}");
    // All that can be reached, at once: rings end when there is nothing to add.
    let (_, all) = image(Method::Regular, rule(u32::MAX), 1);
    assert!(all.triangles_subdivided > counts[2]);
}

#[test]
fn subdivision_at_highlights_comes_closer_to_phong_shading_than_gouraud_shading() {
    let gouraud = rmse(&image(Method::Gouraud, PaperRule::default(), 1).0);
    let (frame, stats) = image(Method::Highlight, PaperRule::default(), 1);
    assert!(rmse(&frame) < 0.9 * gouraud, "{} {gouraud}", rmse(&frame));
    assert!(stats.triangles_subdivided > 10 && stats.triangles_subdivided <= stats.pht_visible);
    let (_, finer) = image(Method::Highlight, with_difference(0.03), 1);
    assert!(finer.leaves > stats.leaves, "{finer:?}");
    assert_eq!(finer.triangles_subdivided, stats.triangles_subdivided);
}

#[test]
fn hybrid_is_phong_shading_on_highlighted_triangles_and_gouraud_shading_elsewhere() {
    let scene = scene();
    let world = World::new(&scene);
    let view = world.view(scene.camera(), SIZE.0, SIZE.1);
    let owners = ReferenceImage::render(&world, &view, 2).ids;
    let (gouraud, _) = image(Method::Gouraud, PaperRule::default(), 1);
    let (phong, _) = image(Method::Phong, PaperRule::default(), 1);
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    let mut engine = engine(&scene, Method::Hybrid, PaperRule::default(), 1);
    let stats = engine.render(&scene, Budget::Unlimited, &mut frame);
    let mut is_shaded = vec![false; world.triangles.len()];
    engine.for_each_leaf(|leaf| {
        assert_eq!(leaf.is_pht, leaf.kind == LeafKind::PerPixel, "{leaf:?}");
        is_shaded[leaf.triangle as usize] = leaf.is_pht;
    });
    let mut shaded = 0;
    for (index, &owner) in owners.iter().enumerate() {
        let of_pht = is_shaded.get(owner as usize).is_some_and(|&is| is);
        let expected = if of_pht { &phong } else { &gouraud };
        assert_eq!(frame.pixels()[index], expected.pixels()[index], "{index}");
        shaded += u64::from(of_pht);
    }
    assert_eq!(shaded, stats.phong_pixels);
    assert!(shaded > 1000, "{shaded}");
}

#[test]
fn images_are_the_same_for_any_number_of_threads_and_in_every_frame() {
    for method in [Method::Regular, Method::Highlight, Method::Hybrid] {
        let (one, _) = image(method, PaperRule::default(), 1);
        let scene = scene();
        for threads in [2, 3] {
            let mut engine = engine(&scene, method, PaperRule::default(), threads);
            let mut frame = Frame::new(SIZE.0, SIZE.1);
            for budget in [Budget::Unlimited, Budget::Unlimited, Budget::Work(0)] {
                let stats = engine.render(&scene, budget, &mut frame);
                assert_eq!(frame.pixels(), one.pixels(), "{method} {threads}");
                assert!(stats.estimated_error.is_nan(), "{method} knows no error");
            }
        }
    }
}

#[test]
fn a_rule_can_be_changed() {
    let scene = scene();
    let mut engine = engine(&scene, Method::Regular, PaperRule::default(), 1);
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    engine.render(&scene, Budget::Unlimited, &mut frame);
    engine.set_paper_rule(with_area(2.0));
    engine.render(&scene, Budget::Unlimited, &mut frame);
    let (fine, _) = image(Method::Regular, with_area(2.0), 1);
    assert_eq!(frame.pixels(), fine.pixels());
}

// ---- The program ----

#[test]
fn the_experiment_prints_the_papers_tables_beside_ours() {
    let output = specula(Path::new("."), &["paper", "--views", "2", "--error", "1"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let stdout = text(&output.stdout);
    for part in [
        "256x256",
        "512x512",
        "(1.84)",
        "(74.5)",
        "(1955.6)",
        "regular",
        "adaptive in ",
    ] {
        assert!(stdout.contains(part), "{part}: {stdout}");
    }

    let output = specula(
        Path::new("."),
        &[
            "paper", "--views", "1", "--size", "64x64", "--error", "1", "--json",
        ],
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let document: Value = serde_json::from_str(text(&output.stdout)).expect("a JSON object");
    assert_eq!(document["triangles"], 896);
    assert_eq!(document["lights"], 4);
    let rows = document["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 7);
    assert_eq!(rows[0]["time_to_gouraud"], 1.0);
    assert_eq!(rows[0]["triangles_final"], 896.0);
    // Another size is none of the paper's.
    assert!(rows[1]["paper_time_to_gouraud"].is_null());
    assert_eq!(rows[4]["rmse"].as_f64().map(|rmse| rmse < 0.5), Some(true));
}

#[test]
fn what_makes_no_sense_is_refused_in_a_sentence() {
    for (arguments, message) in [
        (
            &["paper", "--views", "0"][..],
            "it must be a whole number from 1 to 3600",
        ),
        (
            &["paper", "--threads", "x"],
            "it must be a whole number from 1 to 1024",
        ),
        (&["paper", "--size", "0x9"], "0x9"),
        (
            &["paper", "--area-threshold", "-3"],
            "a threshold is a number above 0",
        ),
        (
            &["paper", "--area-threshold", "0"],
            "a threshold is a number above 0",
        ),
        (
            &["paper", "--intensity-threshold", "nan"],
            "a threshold is a number above 0",
        ),
        (&["render", "x.ron", "-o", "x.png", "--rings", "-1"], "-1"),
    ] {
        let output = specula(Path::new("."), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(
            text(&output.stderr).contains(message),
            "{}",
            text(&output.stderr)
        );
    }
}
