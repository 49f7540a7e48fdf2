//! The `specula` program from outside: exit status, messages, files and JSON.

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const SCENE: &str = "(objects: [(shape: Teapot())])\n";

/// Runs the program in `directory`.
fn specula(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_specula"))
        .args(arguments)
        .current_dir(directory)
        .output()
        .expect("the program starts")
}

/// A directory with a scene in it.
fn workplace() -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    fs::write(directory.path().join("teapot.ron"), SCENE).expect("writable");
    directory
}

fn files(directory: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(directory)
        .expect("readable")
        .map(|entry| {
            let name = entry.expect("readable").file_name();
            name.to_string_lossy().into_owned()
        })
        .collect();
    names.sort();
    names
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

/// One JSON value for each line of stdout.
fn json_lines(output: &Output) -> Vec<Value> {
    text(&output.stdout)
        .lines()
        .map(|line| serde_json::from_str(line).expect("a JSON object per line"))
        .collect()
}

#[track_caller]
fn assert_success(output: &Output) {
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{message}");
}

#[track_caller]
fn assert_keys(object: &Value, keys: &[&str]) {
    for key in keys {
        assert!(object.get(key).is_some(), "no `{key}` in {object}");
    }
}

#[test]
fn bad_usage_and_bad_input_end_with_status_2_and_failures_with_1() {
    let directory = workplace();
    let place = directory.path();
    fs::write(place.join("bad.ron"), "(\n  objectz: [],\n)").expect("writable");
    fs::create_dir(place.join("folder.png")).expect("writable");
    let before = files(place);
    let render = |rest: &[&'static str]| [&["render", "teapot.ron", "-o", "a.png"], rest].concat();
    for (arguments, status, message) in [
        (vec![], 2, "Usage"),
        (vec!["paint"], 2, "paint"),
        (vec!["render", "teapot.ron"], 2, "--output"),
        (render(&["--size", "0x100"]), 2, "at least one pixel"),
        (render(&["--size", "100x0"]), 2, "at least one pixel"),
        (render(&["--size", "100"]), 2, "1280x720"),
        (render(&["--size", "99999x10"]), 2, "16384"),
        (render(&["--size", "16384x16384"]), 2, "at most"),
        (render(&["--budget", "-1"]), 2, "milliseconds"),
        (render(&["--budget", "nan"]), 2, "milliseconds"),
        (render(&["--budget", "inf"]), 2, "milliseconds"),
        (
            render(&["--budget", "1", "--work", "5"]),
            2,
            "cannot be used with",
        ),
        (render(&["--work", "-5"]), 2, "-5"),
        (render(&["--frames", "0"]), 2, "from 1"),
        (render(&["--threads", "0"]), 2, "from 1"),
        (render(&["--threads", "100000"]), 2, "1024"),
        (render(&["--method", "magic"]), 2, "phong-area"),
        (render(&["--simd", "mmx"]), 2, "scalar"),
        (
            vec!["render", "teapot.ron", "-o", "a.jpg"],
            2,
            "error: the output must be a .png file",
        ),
        (
            vec!["render", "bad.ron", "-o", "a.png"],
            2,
            "error: bad.ron:2:3: ",
        ),
        (
            vec!["render", "none.ron", "-o", "a.png"],
            1,
            "error: cannot read scene 'none.ron'",
        ),
        (
            vec!["render", "teapot.ron", "-o", "none/a.png"],
            1,
            "error: cannot write none/a.png: No such file or directory",
        ),
        (
            vec!["render", "teapot.ron", "-o", "folder.png"],
            1,
            "error: cannot write folder.png: ",
        ),
        (vec!["sweep"], 2, "SCENE"),
        (
            vec!["sweep", "teapot.ron", "--methods", "magic"],
            2,
            "magic",
        ),
        (
            vec!["sweep", "teapot.ron", "--budgets", "1,-2"],
            2,
            "milliseconds",
        ),
        (
            vec!["sweep", "teapot.ron", "--fractions", "nan"],
            2,
            "fraction",
        ),
        (
            vec!["sweep", "teapot.ron", "--budgets", "1", "--fractions", "0"],
            2,
            "cannot be used with",
        ),
        (vec!["sweep", "teapot.ron", "--repeat", "0"], 2, "from 1"),
        (
            vec!["sweep", "teapot.ron", "bad.ron", "--csv", "a.csv"],
            2,
            "error: bad.ron:2:3: ",
        ),
        (
            vec!["sweep", "teapot.ron", "--csv", "none/a.csv"],
            1,
            "error: cannot write none/a.csv: No such file or directory",
        ),
    ] {
        let output = specula(place, &arguments);
        let stderr = text(&output.stderr);
        assert_eq!(
            output.status.code(),
            Some(status),
            "{arguments:?}: {stderr}"
        );
        assert!(stderr.contains(message), "{arguments:?}: {stderr}");
        assert!(!stderr.contains("panicked"), "{arguments:?}: {stderr}");
        assert_eq!(text(&output.stdout), "", "{arguments:?}");
        if message.starts_with("error:") {
            assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
        }
        assert_eq!(files(place), before, "{arguments:?}");
    }
}

#[test]
fn help_and_version_are_not_errors() {
    let directory = workplace();
    for (arguments, expected) in [
        (&["--help"][..], "Examples:"),
        (
            &["render", "--help"],
            "specula render scenes/teapot.ron -o teapot.png --budget 2",
        ),
        (&["sweep", "--help"], "--fractions"),
        (&["--version"], env!("CARGO_PKG_VERSION")),
    ] {
        let output = specula(directory.path(), arguments);
        assert_success(&output);
        assert!(text(&output.stdout).contains(expected), "{arguments:?}");
    }
}

#[test]
fn render_writes_the_image_and_says_what_happened() {
    let directory = workplace();
    let output = specula(
        directory.path(),
        &[
            "render",
            "teapot.ron",
            "-o",
            "a.png",
            "--size",
            "80x60",
            "--work",
            "100000",
            "--frames",
            "2",
        ],
    );
    assert_success(&output);
    let stdout = text(&output.stdout);
    for expected in [
        "frame 1: ",
        "frame 2: ",
        "stages",
        "triangles",
        "PHTs",
        "skipped",
    ] {
        assert!(stdout.contains(expected), "no '{expected}' in {stdout}");
    }
    assert_eq!(text(&output.stderr), "wrote a.png (80x60)\n");
    assert_eq!(files(directory.path()), ["a.png", "teapot.ron"]);
    let image = fs::read(directory.path().join("a.png")).expect("written");
    assert_eq!(&image[1..4], b"PNG");
}

#[test]
fn render_prints_one_json_object_per_frame() {
    let directory = workplace();
    let output = specula(
        directory.path(),
        &[
            "render",
            "teapot.ron",
            "-o",
            "a.png",
            "--size",
            "80x60",
            "--budget",
            "2",
            "--frames",
            "3",
            "--json",
            "--error",
        ],
    );
    assert_success(&output);
    let frames = json_lines(&output);
    assert_eq!(frames.len(), 3);
    for (number, frame) in (1..).zip(&frames) {
        assert_keys(
            frame,
            &[
                "frame",
                "frame_ms",
                "budget_ms",
                "outcome",
                "converged",
                "estimated_error",
                "pht",
                "pht_visible",
                "refined",
                "stage_ms",
                "skipped",
            ],
        );
        assert_keys(
            &frame["stage_ms"],
            &["cull", "shade", "classify", "raster", "refine", "resolve"],
        );
        assert_eq!(frame["frame"], number);
        assert_eq!(frame["budget_ms"], 2.0);
        assert_eq!(frame.get("error").is_some(), number == 3);
    }
    assert_keys(&frames[2]["error"], &["rmse", "psnr_db", "max", "p99"]);
}

#[test]
fn without_a_budget_the_image_converges_to_the_reference() {
    let directory = workplace();
    let output = specula(
        directory.path(),
        &[
            "render",
            "teapot.ron",
            "-o",
            "a.png",
            "--size",
            "80x60",
            "--json",
            "--error",
        ],
    );
    assert_success(&output);
    let frame = &json_lines(&output)[0];
    assert_eq!(frame["converged"], true);
    assert!(frame["budget_ms"].is_null());
    let worst = frame["error"]["max"].as_u64().expect("a number");
    assert!(worst <= 1, "off by {worst} codes");
}

#[test]
fn the_same_work_gives_the_same_file_for_any_number_of_threads() {
    let directory = workplace();
    for (name, threads) in [("one.png", "1"), ("three.png", "3")] {
        assert_success(&specula(
            directory.path(),
            &[
                "render",
                "teapot.ron",
                "-o",
                name,
                "--size",
                "80x60",
                "--work",
                "200000",
                "--threads",
                threads,
            ],
        ));
    }
    let read = |name| fs::read(directory.path().join(name)).expect("written");
    assert!(read("one.png") == read("three.png"));
}

#[test]
fn sweep_prints_a_row_for_each_method_budget_and_frame() {
    let directory = workplace();
    let common = [
        "sweep",
        "teapot.ron",
        "--size",
        "80x60",
        "--methods",
        "adaptive,gouraud,adaptive",
        "--budgets",
        "1,2",
        "--frames",
        "2",
        "--repeat",
        "2",
    ];
    let output = specula(
        directory.path(),
        &[&common[..], &["--json", "--csv", "a.csv"]].concat(),
    );
    assert_success(&output);
    let rows = json_lines(&output);
    assert_eq!(rows.len(), 8);
    for row in &rows {
        assert_keys(
            row,
            &[
                "scene",
                "method",
                "budget_ms",
                "frame",
                "frame_ms",
                "overshoot_ms",
                "rmse",
                "psnr_db",
                "max",
                "p99",
                "triangles_subdivided",
                "converged",
            ],
        );
        assert_eq!(row["scene"], "teapot");
    }
    let csv = fs::read_to_string(directory.path().join("a.csv")).expect("written");
    let (comments, lines): (Vec<&str>, Vec<&str>) =
        csv.lines().partition(|line| line.starts_with('#'));
    assert!(comments.iter().any(|line| line.contains("cpu:")));
    assert!(
        comments
            .iter()
            .any(|line| line.contains("threads:") && line.contains("simd:"))
    );
    assert_eq!(lines.len(), 1 + rows.len());
    for (line, row) in lines[1..].iter().zip(&rows) {
        let method = row["method"].as_str().expect("a name");
        assert!(line.starts_with(&format!("teapot,{method},")), "{line}");
    }

    let table = specula(directory.path(), &common);
    assert_success(&table);
    assert_eq!(text(&table.stdout).lines().count(), 1 + rows.len());
}

#[test]
fn fractions_are_scaled_by_measured_times() {
    let directory = workplace();
    let output = specula(
        directory.path(),
        &[
            "sweep",
            "teapot.ron",
            "--size",
            "40x30",
            "--methods",
            "adaptive",
            "--fractions",
            "0,1",
            "--json",
        ],
    );
    assert_success(&output);
    let rows = json_lines(&output);
    let budget = |row: usize| rows[row]["budget_ms"].as_f64().expect("a number");
    assert_eq!(rows.len(), 2);
    assert!(budget(0) > 0.0 && budget(1) >= budget(0));
    assert_eq!(rows[1]["fraction"], 1.0);
}

#[test]
fn a_closed_pipe_ends_quietly_and_the_image_is_still_written() {
    let directory = workplace();
    let mut child = Command::new(env!("CARGO_BIN_EXE_specula"))
        .args([
            "render",
            "teapot.ron",
            "-o",
            "a.png",
            "--size",
            "40x30",
            "--frames",
            "50",
        ])
        .current_dir(directory.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_success(&output);
    assert_eq!(text(&output.stderr), "wrote a.png (40x30)\n");
    assert!(directory.path().join("a.png").is_file());
}
