//! `specula sweep` and `specula compare` from outside: the files they write, and what they refuse.

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const SCENE: &str = "(objects: [(shape: Teapot())])\n";

/// Runs the program in `directory`.
fn specula(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_specula"))
        .args(arguments)
        .current_dir(directory)
        .output()
        .expect("the program starts")
}

/// A directory with two scenes in it.
fn workplace() -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    for name in ["one.ron", "two.ron"] {
        fs::write(directory.path().join(name), SCENE).expect("writable");
    }
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

#[track_caller]
fn assert_success(output: &Output) {
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{message}");
}

/// Checks that tags are closed in the order in which they were opened, and counts those of that name.
fn count_tags(svg: &str, name: &str) -> usize {
    let mut open = Vec::new();
    let mut count = 0;
    let mut rest = svg;
    while let Some((_, after)) = rest.split_once('<') {
        let (tag, after) = after.split_once('>').expect("each tag ends");
        let own_name = |tag: &str| {
            let end = tag.find(|c: char| c.is_whitespace() || c == '/');
            tag[..end.unwrap_or(tag.len())].to_owned()
        };
        if let Some(closed) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(closed), "in {svg}");
        } else {
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
            count += usize::from(own_name(tag) == name);
            if !tag.ends_with('/') {
                open.push(own_name(tag));
            }
        }
        rest = after;
    }
    assert!(open.is_empty(), "{open:?}");
    count
}

#[test]
fn a_sweep_writes_charts_and_a_document_of_all_it_has_measured() {
    let directory = workplace();
    let place = directory.path();
    let output = specula(
        place,
        &[
            "sweep",
            "one.ron",
            "two.ron",
            "--methods",
            "all",
            "--size",
            "80x60",
            "--fractions",
            "0,0.5,1",
            "--svg",
            "charts/all",
            "--json-file",
            "sweep.json",
            "--csv",
            "sweep.csv",
        ],
    );
    assert_success(&output);
    assert_eq!(
        files(place),
        ["charts", "one.ron", "sweep.csv", "sweep.json", "two.ron"]
    );
    assert_eq!(files(&place.join("charts/all")), ["one.svg", "two.svg"]);

    let document = fs::read_to_string(place.join("sweep.json")).expect("written");
    let document: Value = serde_json::from_str(&document).expect("one JSON object");
    for key in ["specula", "date", "cpu", "threads", "simd", "width"] {
        assert!(document["machine"].get(key).is_some(), "no {key}");
    }
    let scenes = document["scenes"].as_array().expect("a list");
    assert_eq!(scenes.len(), 2);
    let methods = specula::Method::ALL.len();
    for scene in scenes {
        assert_eq!(scene["rows"].as_array().expect("a list").len(), 3 * methods);
        assert!(scene["too_noisy"].is_boolean());
        assert!(scene["noise"]["drift"].is_number() && scene["noise"]["spread"].is_number());
        let times = &scene["calibration"];
        let ms = |key: &str| times[key].as_f64().expect("a number");
        assert!(scene["calibration_after"]["phong_spread"].is_number());
        // In so small an image Phong shading may have been as fast as Gouraud shading; then there is nothing below a curve.
        let areas = if ms("phong_ms") > ms("gouraud_ms") {
            methods
        } else {
            0
        };
        assert_eq!(scene["areas"].as_array().expect("a list").len(), areas);
    }

    let svg = fs::read_to_string(place.join("charts/all/one.svg")).expect("written");
    assert!(svg.starts_with("<svg "), "{svg}");
    let progressive = specula::Method::ALL
        .into_iter()
        .filter(|method| method.is_progressive());
    assert_eq!(count_tags(&svg, "polyline"), progressive.count());

    // The file of comma-separated values has as many fields in each row as columns.
    let csv = fs::read_to_string(place.join("sweep.csv")).expect("written");
    let rows: Vec<Vec<&str>> = csv
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split(',').collect())
        .collect();
    assert_eq!(rows.len(), 1 + 2 * 3 * methods);
    assert!(rows.iter().all(|row| row.len() == rows[0].len()));
    for fact in [
        "# date: ",
        "# cpu: ",
        "# one: Gouraud ",
        "# one, during and after: Gouraud ",
    ] {
        assert!(csv.contains(fact), "no {fact}");
    }
}

#[test]
fn one_chart_may_be_one_file() {
    let directory = workplace();
    let output = specula(
        directory.path(),
        &[
            "sweep",
            "one.ron",
            "--size",
            "40x30",
            "--budgets",
            "1,2",
            "--svg",
            "a.svg",
            "--json",
        ],
    );
    assert_success(&output);
    let svg = fs::read_to_string(directory.path().join("a.svg")).expect("written");
    assert_eq!(count_tags(&svg, "polyline"), 2);
    // Only rows on standard output.
    for line in text(&output.stdout).lines() {
        let row: Value = serde_json::from_str(line).expect("a JSON object per line");
        assert!(row["frame_ms"].is_number(), "{line}");
    }
}

#[test]
fn what_cannot_be_done_is_said_in_a_sentence_and_leaves_no_files() {
    let directory = workplace();
    let place = directory.path();
    fs::create_dir(place.join("folder.png")).expect("writable");
    fs::write(place.join("taken"), "").expect("writable");
    let before = files(place);
    for (arguments, status, message) in [
        (
            vec!["sweep", "one.ron", "two.ron", "--svg", "a.svg"],
            2,
            "error: one file cannot hold the charts of 2 scenes",
        ),
        (
            vec!["sweep", "one.ron", "one.ron", "--svg", "charts"],
            2,
            "error: two scenes are called 'one'",
        ),
        (
            vec![
                "sweep",
                "none.ron",
                "--svg",
                "charts",
                "--json-file",
                "a.json",
            ],
            1,
            "error: cannot read scene 'none.ron'",
        ),
        (
            vec!["sweep", "one.ron", "--svg", "none/a.svg"],
            1,
            "error: cannot write none/a.svg: No such file",
        ),
        (
            vec!["sweep", "one.ron", "--svg", "taken"],
            1,
            "error: cannot make the folder taken: ",
        ),
        (
            vec![
                "sweep",
                "one.ron",
                "--json-file",
                "none/a.json",
                "--svg",
                "charts",
            ],
            1,
            "error: cannot write none/a.json: No such file",
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
        assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
        assert_eq!(text(&output.stdout), "", "{arguments:?}");
        assert_eq!(files(place), before, "{arguments:?}");
    }
}
