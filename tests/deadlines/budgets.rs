//! Budgets of error and of work, and what is known about costs.

use crate::common::*;
use specula::measure::{ErrorReport, ReferenceImage};
use specula::scene::World;
use specula::schedule::CostModel;
use specula::{Budget, EngineOptions, Frame, Method, Scene};

#[test]
fn refinement_ends_when_the_estimated_error_is_low_enough() {
    let scene = mixed();
    for method in [Method::Adaptive, Method::PhongArea] {
        let mut last_units = 0;
        for target in [f64::INFINITY, 4.0, 1.0, 0.25, 0.0] {
            let [one, two] = [1, 2].map(|threads| {
                let clock = CountingClock::stepping(100.0);
                let mut engine = engine(&scene, options(method, threads, clock));
                let mut frame = Frame::new(SIZE[0], SIZE[1]);
                let stats = engine.render(&scene, Budget::Error(target), &mut frame);
                (frame, stats)
            });
            assert!(one.0.pixels() == two.0.pixels(), "{method}, {target}");
            let stats = one.1;
            assert!(
                stats.estimated_error <= target || stats.converged,
                "{method}, {target}: {stats:?}"
            );
            assert!(
                stats.work_units >= last_units,
                "{method}, {target}: {stats:?}"
            );
            last_units = stats.work_units;
            // Where only areas are known, the guess stays high to the end.
            if target == 0.25 && method == Method::Adaptive {
                assert!(
                    !stats.converged,
                    "{method}: there was more to be done: {stats:?}"
                );
            }
        }
        assert!(last_units > 0);
    }
}

#[test]
fn an_error_that_is_no_number_is_never_reached() {
    let scene = mixed();
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    for target in [f64::NAN, -1.0] {
        let stats =
            timeless(&scene, Method::Adaptive).render(&scene, Budget::Error(target), &mut frame);
        assert!(stats.converged, "{target}: {stats:?}");
    }
}

/// Of each example scene, but for what is below a tenth of a code: there is nothing but rounding.
#[test]
fn twice_the_work_never_raises_the_error_by_more_than_two_percent() {
    for name in [
        "teapot",
        "closeup",
        "walls",
        "lights16",
        "lights100",
        "minimal",
        "turntable",
        "heavy",
    ] {
        let path = format!("{}/scenes/{name}.ron", env!("CARGO_MANIFEST_DIR"));
        let scene = Scene::load(path).expect("an example scene");
        let mut frame = Frame::new(160, 90);
        let world = World::new(&scene);
        let view = world.view(scene.camera(), frame.width(), frame.height());
        let reference = ReferenceImage::render(&world, &view, 2);
        let mut engine = timeless(&scene, Method::Adaptive);
        let mut last = f64::INFINITY;
        for doubling in 0..9 {
            engine.forget();
            let work = Budget::Work(20_000 << doubling);
            engine.render(&scene, work, &mut frame);
            let report = ErrorReport::compare(&frame, &reference).expect("same size");
            assert!(
                report.rmse <= (last * 1.02).max(0.1),
                "{name}, {work:?}: {} after {last}",
                report.rmse
            );
            last = report.rmse;
        }
    }
}

/// What an engine has learned from some frames.
fn learned() -> CostModel {
    let scene = mixed();
    let clock = CountingClock::stepping(3.0);
    let mut engine = engine(&scene, options(Method::Adaptive, 1, clock));
    let mut frame = Frame::new(SIZE[0], SIZE[1]);
    for step in 0..20 {
        engine.render(&turned(&scene, step / 3), Budget::Millis(2.0), &mut frame);
    }
    engine.costs().clone()
}

#[test]
fn costs_can_be_saved_and_started_from() {
    let costs = learned();
    assert_ne!(costs, CostModel::default());
    assert!(costs.is_valid(), "{costs:?}");
    let ron = ron::to_string(&costs).expect("RON");
    let from_ron: CostModel = ron::from_str(&ron).expect("what was written");
    assert_eq!(from_ron, costs);
    let json = serde_json::to_string(&costs).expect("JSON");
    let from_json: CostModel = serde_json::from_str(&json).expect("what was written");
    // Its parser may be off by the last bit.
    assert_eq!(
        serde_json::to_value(&from_json)
            .ok()
            .map(|v| v.as_object().map(|o| o.len())),
        Some(Some(11))
    );
    let scene = mixed();
    let engine = engine(
        &scene,
        EngineOptions {
            costs: Some(from_ron),
            ..options(Method::Adaptive, 1, CountingClock::stepping(0.0))
        },
    );
    assert_eq!(engine.costs(), &costs);
}

#[test]
fn costs_that_make_no_sense_are_not_used() {
    let scene = mixed();
    let good = serde_json::to_value(CostModel::default()).expect("JSON");
    for kind in good.as_object().expect("an object").keys() {
        for (part, value) in [
            ("items", -1.0),
            ("items", 0.0),
            ("pixels", 1e9),
            ("pixels", -0.0),
            ("spread", -0.1),
            ("spread", 1e300),
        ] {
            let mut bad = good.clone();
            bad[kind][part] = value.into();
            let costs: CostModel = serde_json::from_value(bad).expect("the right fields");
            assert!(!costs.is_valid(), "{kind}, {part}: {value}");
            let engine = engine(
                &scene,
                EngineOptions {
                    costs: Some(costs),
                    ..options(Method::Adaptive, 1, CountingClock::stepping(0.0))
                },
            );
            assert_eq!(
                engine.costs(),
                &CostModel::default(),
                "{kind}, {part}: {value}"
            );
        }
    }
    for number in ["NaN", "inf", "-inf"] {
        let text = ron::to_string(&CostModel::default()).expect("RON");
        let bad = text.replacen("items:1.0", &format!("items:{number}"), 1);
        assert_ne!(bad, text);
        let costs: CostModel = ron::from_str(&bad).expect("RON knows it");
        assert!(!costs.is_valid(), "{number}");
    }
}
