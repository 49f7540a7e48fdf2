//! `specula sweep` and `specula compare` from outside: the files they write, and what they refuse.

mod program;

use program::{specula, text};
use serde_json::Value;
use std::fs;
use std::io::BufReader;
use std::path::Path;
use std::process::Output;

const SCENE: &str = "(objects: [(shape: Teapot())])\n";

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
        .filter(|method| method.has_a_curve());
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

/// The size of a PNG file, and its pixels as red, green and blue.
fn png(path: &Path) -> ([u32; 2], Vec<u8>) {
    let file = BufReader::new(fs::File::open(path).expect("written"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG file");
    let mut pixels = vec![0; reader.output_buffer_size().expect("small")];
    let info = reader.next_frame(&mut pixels).expect("an image");
    assert_eq!(info.color_type, png::ColorType::Rgb);
    ([info.width, info.height], pixels)
}

#[test]
fn a_sheet_shows_all_methods_with_the_errors_of_their_pixels() {
    let directory = workplace();
    let place = directory.path();
    let common = [
        "compare", "one.ron", "--size", "160x120", "--repeat", "1", "--json",
    ];
    let run = |rest: &[&str]| {
        let output = specula(place, &[&common[..], rest].concat());
        assert_success(&output);
        let object: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        object
    };
    let all = run(&["-o", "all.png"]);
    let methods = all["methods"].as_array().expect("a list");
    assert_eq!(methods.len(), specula::Method::ALL.len());
    for method in methods {
        assert_eq!(method["budget_ms"], all["budget_ms"]);
        assert!(method["rmse"].is_number() && method["frame_ms"].is_number());
    }
    assert_eq!(all["fraction"], 0.3);
    assert!(all["calibration"]["phong_ms"].is_number() && all["noise"]["drift"].is_number());
    assert_eq!(files(place), ["all.png", "one.ron", "two.ron"]);

    // In a sheet of Gouraud shading alone, errors are bright on black; in one of Phong shading there are none.
    let brightest = |name: &str, method: &str| {
        let numbers = run(&["-o", name, "--methods", method, "--budget", "0"]);
        assert_eq!(numbers["methods"][0]["method"], method);
        let ([width, height], pixels) = png(&place.join(name));
        assert!(width > 2 * 160 && height > 2 * 120);
        // The cell of the method is the second of two; its errors are below the middle.
        let is_error = |index: &usize| {
            let [x, y] = [index % width as usize, index / width as usize];
            x > width as usize / 2 && y > height as usize * 11 / 20 && y < height as usize - 60
        };
        let triples = pixels.chunks_exact(3).enumerate();
        triples
            .filter(|(index, _)| is_error(index))
            .map(|(_, rgb)| rgb.iter().map(|&c| u32::from(c)).sum::<u32>())
            .max()
    };
    let gouraud = brightest("gouraud.png", "gouraud").expect("pixels");
    let phong = brightest("phong.png", "phong").expect("pixels");
    // Gray is what the scene does not cover; an error of a single code is dark.
    assert!(gouraud > 450 && phong < 300, "{gouraud} {phong}");
}

#[test]
fn a_film_can_be_compared_with_its_references() {
    let directory = workplace();
    let animate = |rest: &[&str]| {
        let common = [
            "animate",
            "one.ron",
            "--size",
            "64x48",
            "--duration",
            "0.4",
            "--fps",
            "10",
            "--json",
            "--error",
        ];
        let output = specula(directory.path(), &[&common[..], rest].concat());
        assert_success(&output);
        let frames: Vec<Value> = text(&output.stdout)
            .lines()
            .map(|line| serde_json::from_str(line).expect("a JSON object per line"))
            .collect();
        (frames, text(&output.stderr).to_owned())
    };
    let (frames, summary) = animate(&["-o", "film.apng", "--method", "gouraud"]);
    assert_eq!(frames.len(), 4);
    assert!(
        frames
            .iter()
            .all(|frame| frame["error"]["rmse"].as_f64() > Some(0.5))
    );
    // There is no frame before the first.
    assert!(frames[0]["flicker"].is_null());
    assert!(
        frames[1..]
            .iter()
            .all(|frame| frame["flicker"].as_f64() > Some(0.1))
    );
    assert!(summary.contains("flicker "), "{summary}");

    let (frames, _) = animate(&["-o", "film.apng", "--method", "phong"]);
    assert!(
        frames[1..]
            .iter()
            .all(|frame| frame["flicker"].as_f64() < Some(0.5))
    );
    // Every other frame has no neighbours.
    let (frames, summary) = animate(&["-o", "###.png", "--shard", "1/2"]);
    assert_eq!(frames.len(), 2);
    assert!(frames.iter().all(|frame| frame["flicker"].is_null()));
    assert!(!summary.contains("flicker "), "{summary}");
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
        (
            vec!["compare", "one.ron", "-o", "a.jpg"],
            2,
            "error: the output must be a .png file, which 'a.jpg' is not",
        ),
        (
            vec!["compare", "one.ron", "-o", "folder.png"],
            1,
            "error: cannot write folder.png: ",
        ),
        (
            vec!["compare", "one.ron", "-o", "a.png", "--backend", "skia"],
            2,
            "give --budget",
        ),
        (
            vec![
                "compare",
                "one.ron",
                "-o",
                "a.png",
                "--backend",
                "skia",
                "--budget",
                "1",
            ],
            2,
            "error: ",
        ),
        (
            vec!["compare", "none.ron", "-o", "a.png"],
            1,
            "error: cannot read scene 'none.ron'",
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
