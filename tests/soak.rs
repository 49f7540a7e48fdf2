//! `specula soak` as its users call it.

mod program;

use program::text;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;

const SCENE: &str = "(objects: [(shape: Teapot())])\n";

fn specula(directory: &Path, arguments: &str) -> Output {
    let words: Vec<_> = arguments.split_whitespace().collect();
    program::specula(directory, &words)
}

fn workplace() -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    fs::write(directory.path().join("teapot.ron"), SCENE).expect("writable");
    directory
}

#[test]
fn what_makes_no_sense_is_refused_in_a_sentence() {
    let directory = workplace();
    for (arguments, status, message) in [
        ("soak --frames 0", 2, "from 1 to 10000000"),
        ("soak --work-every -1", 2, "-1"),
        ("soak --size 0x5", 2, "at least one pixel"),
        ("soak none.ron", 1, "error: cannot read scene 'none.ron'"),
        (
            "soak teapot.ron --backend skia",
            2,
            "needs a backend that shades",
        ),
        (
            "soak teapot.ron --csv none/a.csv",
            1,
            "cannot write none/a.csv",
        ),
    ] {
        let output = specula(directory.path(), arguments);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{arguments}: {error}");
        assert!(error.contains(message), "{arguments}: {error}");
        assert!(output.stdout.is_empty(), "{arguments}");
    }
}

#[test]
fn each_scene_has_its_summary_and_each_frame_its_row() {
    let directory = workplace();
    let output = specula(
        directory.path(),
        "soak teapot.ron teapot.ron --frames 25 --size 96x64 --threads 1 --work-every 5 --csv a.csv --json",
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let reports: Vec<Value> = text(&output.stdout)
        .lines()
        .map(|line| serde_json::from_str(line).expect("a JSON object"))
        .collect();
    let names: Vec<_> = reports.iter().map(|report| &report["scene"]).collect();
    assert_eq!(names, ["teapot", "teapot", "all scenes"]);
    for (report, frames) in reports.iter().zip([12, 13, 25]) {
        let all = &report["all"];
        assert_eq!(all["frames"], frames);
        for key in ["p50", "p95", "p99", "p99_9", "max"] {
            for group in ["overshoot_ms", "null_overshoot_ms", "excess_ms"] {
                assert!(all[group][key].is_f64(), "{group}.{key} in {all}");
            }
        }
        let outcomes = all["outcomes"].as_object().expect("an object");
        let counted: u64 = outcomes.values().filter_map(|o| o["frames"].as_u64()).sum();
        assert_eq!(counted, frames);
        assert!(all["verdicts"]["p99_9"].is_boolean());
    }
    assert!(reports[0]["calibration"]["phong_ms"].is_f64());
    assert!(reports[0]["calibration"]["first_image_ms"].is_f64());

    let csv = fs::read_to_string(directory.path().join("a.csv")).expect("readable");
    let mut lines = csv.lines().skip_while(|line| line.starts_with('#'));
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 25);
    assert!(rows.iter().all(|row| row.len() == header.len()));
    let column = |name: &str| header.iter().position(|&h| h == name).expect("a column");
    let number = |row: &[&str], name: &str| row[column(name)].parse::<f64>().expect("a number");
    for row in &rows {
        let overshoot = number(row, "frame_ms") - number(row, "budget_ms");
        assert!((overshoot - number(row, "overshoot_ms")).abs() < 2e-4);
        // The clock is never read before the deadline for the last time.
        assert!(number(row, "null_overshoot_ms") >= 0.0);
    }
}

#[test]
fn the_shipped_scenes_are_soaked_if_none_is_given() {
    let directory = workplace();
    let output = specula(
        directory.path(),
        "soak --frames 6 --size 64x48 --threads 1 --work-every 0",
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let report = text(&output.stdout);
    for expected in ["walls: Gouraud", "lights16: Gouraud", "closeup: Gouraud"] {
        assert!(report.contains(expected), "{report}");
    }
    assert!(report.contains("all scenes:\n"), "{report}");
    assert!(report.contains("targets    p50"), "{report}");
    assert!(!report.contains("without a clock"), "{report}");
}
