use super::plan::{Plan, SWING_FRAMES, swung_camera};
use super::work::{Trial, most_units};
use super::*;
use crate::clock::ManualClock;

fn scene() -> Scene {
    Scene::parse("(objects: [(shape: Teapot())])", "teapot.ron").expect("a valid scene")
}

/// On a clock that moves on by ten microseconds per reading.
fn options() -> SoakOptions {
    SoakOptions {
        width: 64,
        height: 48,
        calibration_frames: 3,
        work_every: 5,
        threads: Some(1),
        clock: Arc::new(ManualClock::with_step_ns(10_000)),
        ..SoakOptions::default()
    }
}

fn run(frames: u64) -> (Vec<SoakRow>, SoakCalibration) {
    let mut soak = Soak::new("teapot", &scene(), options()).expect("one thread");
    let mut rows = Vec::new();
    soak.run(frames, |row| {
        rows.push(row);
        ControlFlow::Continue(())
    });
    (rows, *soak.calibration())
}

#[test]
fn a_soak_measures_every_frame_beside_the_null_engine() {
    let (rows, calibration) = run(36);
    assert_eq!(rows.len(), 36);
    for (row, number) in rows.iter().zip(1..) {
        assert_eq!((row.frame, row.scene.as_str()), (number, "teapot"));
        assert_eq!(row.null_first, number % 2 == 0);
        assert_eq!(row.is_tight, row.budget_ms < calibration.first_image_ms);
        // One step to see that the deadline has come, one for the last reading.
        assert!((0.0..0.03).contains(&row.null_overshoot_ms()), "{row:?}");
        assert_eq!(
            row.unhurried_units.is_some(),
            number % 5 == 0 && !row.is_tight
        );
        assert!(row.frame_ms > 0.0);
    }
    assert!(rows.iter().any(|row| row.unhurried_units.is_some()));
    for ms in MILLIS {
        let count = rows.iter().filter(|row| row.budget_ms == ms).count();
        assert_eq!(count, 3, "{ms} ms in each of three rounds");
    }
    for f in FRACTIONS {
        let found: Vec<_> = rows.iter().filter(|r| r.fraction == Some(f)).collect();
        let budget = calibration.budget(f).millis;
        assert_eq!(found.len(), 3);
        assert!(found.iter().all(|row| row.budget_ms == budget));
    }
    assert_eq!(
        rows,
        run(36).0,
        "on a clock that counts readings all repeats"
    );
}

#[test]
fn a_soak_ends_when_nobody_takes_its_rows_and_can_go_on() {
    let mut soak = Soak::new("teapot", &scene(), options()).expect("one thread");
    let mut frames = Vec::new();
    for count in [9, 2] {
        soak.run(count, |row| {
            frames.push(row.frame);
            match row.frame {
                4 => ControlFlow::Break(()),
                _ => ControlFlow::Continue(()),
            }
        });
    }
    assert_eq!(frames, [1, 2, 3, 4, 5, 6]);
}

#[test]
fn the_null_engine_waits_on_all_its_threads() {
    for threads in [1, 3] {
        let null = NullEngine::new(threads).expect("threads start");
        let clock = ManualClock::with_step_ns(1_000);
        let ms = null.frame(&clock, 2.0);
        // Each thread may read the clock once after the deadline.
        let most = 2.0 + 1e-3 * (threads as f64 + 2.0);
        assert!((2.0..most).contains(&ms), "{ms} ms by {threads} threads");
        // It takes two readings to see that there is no time.
        assert!(null.frame(&clock, 0.0) <= 1e-3 * (threads as f64 + 2.0));
    }
}

#[test]
fn rounds_are_shuffled_and_repeatable() {
    let calibration = SoakCalibration {
        gouraud_ms: 1.5,
        phong_ms: 9.5,
        first_image_ms: 1.6,
    };
    let rounds = || {
        let mut plan = Plan::new(&calibration);
        let all: Vec<f64> = (0..36).map(|_| plan.next_budget().millis).collect();
        all
    };
    let all = rounds();
    assert_eq!(all, rounds());
    let (first, second) = (&all[..12], &all[12..24]);
    assert_ne!(first, second);
    let sorted = |round: &[f64]| {
        let mut round = round.to_vec();
        round.sort_by(f64::total_cmp);
        round
    };
    let expected = [1.0, 2.0, 2.3, 3.1, 4.0, 4.7, 6.3, 7.9, 8.0, 9.5, 16.0, 33.0];
    for round in all.chunks(12) {
        let found = sorted(round);
        assert!(
            found
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-9),
            "{found:?}"
        );
    }
}

#[test]
fn the_camera_never_stands_still_and_stays_in_front() {
    let camera = *scene().camera();
    let distance = camera.position.distance(camera.target);
    let resting = camera.position - camera.target;
    assert_eq!(swung_camera(&camera, 0), camera);
    let mut widest = 0.0_f64;
    for frame in 0..2 * SWING_FRAMES {
        let (here, next) = (
            swung_camera(&camera, frame),
            swung_camera(&camera, frame + 1),
        );
        assert_ne!(here.position, next.position, "frame {frame}");
        assert!((here.position.distance(camera.target) - distance).abs() < 1e-9);
        let angle = resting.angle_between(here.position - here.target);
        widest = widest.max(angle.to_degrees());
    }
    assert!((3.0..=10.0).contains(&widest), "{widest} degrees");
}

#[test]
fn the_most_work_in_a_time_is_found_from_any_guess() {
    // 2 ms, and 1 ms for every 700,000 units, of which there are ten million.
    let frame = |units: u64| {
        let units = units.min(10_000_000);
        Trial {
            ms: 2.0 + units as f64 / 700_000.0,
            units,
            converged: units == 10_000_000,
        }
    };
    for guess in [0, 1_000, 1_900_000, 2_100_000, 2_300_000, 9_000_000] {
        let found = most_units(5.0, guess, frame);
        assert!(
            (2_050_000..=2_100_000).contains(&found),
            "{found} from {guess}"
        );
    }
    assert_eq!(
        most_units(100.0, 5_000_000, frame),
        10_000_000,
        "all there is"
    );
    assert_eq!(most_units(1.0, 5_000_000, frame), 0, "nothing fits");
}

#[test]
fn an_outlier_does_not_move_the_most_work() {
    let mut calls = 0;
    let found = most_units(5.0, 2_000_000, |units| {
        calls += 1;
        let hiccup = if calls % 3 == 0 { 50.0 } else { 0.0 };
        Trial {
            ms: 2.0 + units as f64 / 700_000.0 + hiccup,
            units,
            converged: false,
        }
    });
    assert!((2_050_000..=2_100_000).contains(&found), "{found}");
}

/// A frame of 10 ms that overshoots so, beside a null engine that does.
fn row(overshoot: f64, null: f64) -> SoakRow {
    SoakRow {
        scene: "a, \"b\"".to_owned(),
        frame: 1,
        budget_ms: 10.0,
        fraction: Some(0.4),
        is_tight: false,
        null_first: true,
        frame_ms: 10.0 + overshoot,
        null_ms: 10.0 + null,
        outcome: "refined",
        converged: false,
        work_units: 80,
        unhurried_units: None,
        stage_ms: StageTimes {
            refine: 6.0,
            resolve: 3.0,
            ..StageTimes::default()
        },
    }
}

#[test]
fn a_summary_counts_and_takes_quantiles_by_nearest_rank() {
    // Overshoots of 1 to 2,000 microseconds less 500, in another order.
    let mut rows: Vec<SoakRow> = (0..2000_u32)
        .map(|i| row(f64::from((i * 7) % 2000) * 1e-3 - 0.499, 0.25))
        .collect();
    rows[0].outcome = "base_only";
    rows[1].stage_ms.raster = 7.0;
    rows[1].frame_ms = 10.5;
    let summary = SoakSummary::of(&rows).expect("there are rows");
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a}, not {b}");
    let o = summary.overshoot_ms;
    near(o.p95, 1.4);
    near(o.p99, 1.48);
    near(o.p99_9, 1.498);
    near(o.max, 1.5);
    near(summary.null_overshoot_ms.p99, 0.25);
    near(summary.excess_ms.p99, 1.23);
    assert_eq!(summary.null_late, 2000);
    let late = rows.iter().filter(|row| row.frame_ms > 10.0).count() as u64;
    assert_eq!((summary.frames.frames, summary.frames.late), (2000, late));
    assert!(summary.frames.later_than_null < late);
    assert_eq!(summary.outcomes["base_only"].frames, 1);
    assert_eq!(summary.outcomes["refined"].frames, 1999);
    assert_eq!(summary.late_in["raster"], 1);
    assert_eq!(summary.late_in["refine"], late - 1);
    assert_eq!(SoakSummary::of(&[]), None);
}

#[test]
fn verdicts_are_relative_to_the_null_engine() {
    let verdicts = |overshoot: f64, null: f64| {
        let rows = vec![row(overshoot, null); 10];
        SoakSummary::of(&rows).expect("rows").verdicts
    };
    let good = verdicts(1.019, 1.0);
    assert!(good.p50 && good.p95 && good.p99 && good.p99_9);
    let fair = verdicts(1.03, 1.0);
    assert!(!fair.p50 && !fair.p95 && !fair.p99 && fair.p99_9);
    assert!(!verdicts(1.11, 1.0).p99_9);
    assert_eq!(good.work, None);

    // Each tail by itself: two of a thousand frames are late.
    let mut rows = vec![row(-1.0, 0.0); 1000];
    rows[..2].fill(row(5.0, 0.0));
    let rare = SoakSummary::of(&rows).expect("rows").verdicts;
    assert!(rare.p50 && rare.p95 && rare.p99 && !rare.p99_9);
}

#[test]
fn work_is_compared_where_the_image_is_not_final() {
    let compared = |work_units, unhurried, converged| SoakRow {
        work_units,
        unhurried_units: Some(unhurried),
        converged,
        ..row(0.0, 0.0)
    };
    let rows = [
        compared(80, 100, false),
        compared(100, 100, false),
        compared(10, 1000, true),
        row(0.0, 0.0),
    ];
    let summary = SoakSummary::of(&rows).expect("rows");
    let work = summary.work.expect("two frames were compared");
    assert_eq!(
        (work.frames, work.units, work.unhurried_units),
        (2, 180, 200)
    );
    assert_eq!((work.share, summary.verdicts.work), (0.9, Some(true)));
    let summary = SoakSummary::of(&rows[..1]).expect("rows");
    assert_eq!(summary.verdicts.work, Some(false));
}

#[test]
fn csv_has_a_field_for_each_column() {
    let line = row(0.5, 0.25).to_csv();
    assert!(line.starts_with("\"a, \"\"b\"\"\",1,10.0000,0.4,false,true,10.5000,0.5000,0.2500,"));
    // One comma of the line is inside of the quotes.
    let columns = SoakRow::csv_header().split(',').count();
    assert_eq!(line.split(',').count(), columns + 1);
}
