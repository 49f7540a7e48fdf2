//! The estimate of the error agrees with what is measured, on the way and where it says that the image is good enough.

use specula::measure::{ErrorReport, ReferenceImage};
use specula::{Budget, Engine, EngineOptions, Frame, Scene};

const SIZE: (u32, u32) = (480, 270);

/// Where less is measured, rounding to codes is most of it.
const LEAST_RMSE: f64 = 0.5;

/// All scenes that come with the program.
const SCENES: [&str; 8] = [
    "teapot",
    "closeup",
    "walls",
    "lights16",
    "lights100",
    "heavy",
    "minimal",
    "turntable",
];

/// A scene, and what its image should be.
struct Subject {
    scene: Scene,
    engine: Engine,
    reference: ReferenceImage,
    frame: Frame,
}

impl Subject {
    fn new(name: &str) -> Self {
        let path = format!("{}/scenes/{name}.ron", env!("CARGO_MANIFEST_DIR"));
        let scene = Scene::load(path).expect("a shipped scene");
        let options = EngineOptions {
            threads: Some(1),
            ..EngineOptions::default()
        };
        let engine = Engine::with_options(&scene, options).expect("the options are valid");
        let view = engine.world().view(scene.camera(), SIZE.0, SIZE.1);
        let reference = ReferenceImage::render(engine.world(), &view, 2);
        Self {
            scene,
            engine,
            reference,
            frame: Frame::new(SIZE.0, SIZE.1),
        }
    }

    /// What is estimated and what is measured after a cold frame, and whether that was final.
    fn render(&mut self, budget: Budget) -> (f64, f64, bool) {
        self.engine.forget();
        let stats = self.engine.render(&self.scene, budget, &mut self.frame);
        let report = ErrorReport::compare(&self.frame, &self.reference).expect("same kind");
        (stats.estimated_error, report.rmse, stats.converged)
    }
}

#[test]
fn estimates_are_within_a_factor_of_two() {
    for name in SCENES {
        let mut subject = Subject::new(name);
        let (mut work, mut compared) = (0, 0);
        loop {
            let (estimated, measured, is_final) = subject.render(Budget::Work(work));
            let ratio = estimated / measured;
            if measured > LEAST_RMSE {
                compared += 1;
                assert!(
                    (0.5..=2.0).contains(&ratio),
                    "{name} after {work}: {estimated} estimated, {measured} measured"
                );
            }
            if is_final {
                break;
            }
            work = (work * 3 / 2).max(30_000);
        }
        assert!(compared >= 5, "{name}: {compared} budgets");
    }
}

#[test]
fn an_error_target_is_reached_and_not_passed_by_far() {
    for name in SCENES {
        let mut subject = Subject::new(name);
        let (_, first, _) = subject.render(Budget::Work(0));
        for target in [4.0, 2.0, 1.0] {
            let (estimated, measured, is_final) = subject.render(Budget::Error(target));
            assert!(estimated <= target, "{name}: {estimated} for {target}");
            assert!(measured <= 2.0 * target, "{name}: {measured} for {target}");
            if first > 2.0 * target {
                assert!(!is_final, "{name} was finished for {target}");
            }
        }
    }
}

#[test]
fn what_is_planned_and_not_painted_counts_as_wrong() {
    // A budget so small that nothing is painted buys plans, which leave the image and its error as they were.
    let mut subject = Subject::new("turntable");
    let (before, measured, _) = subject.render(Budget::Work(0));
    let (after, same, _) = subject.render(Budget::Work(1_500));
    assert_eq!(measured, same, "something was painted");
    assert!(
        (after / before - 1.0).abs() < 0.05,
        "{after} after {before}"
    );
}
