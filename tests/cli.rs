//! The `specula` program from outside: exit status, messages, files and JSON.

mod program;

use program::{specula, text};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const SCENE: &str = "(objects: [(shape: Teapot())])\n";

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
    let animate = |output: &'static str, rest: &[&'static str]| {
        [&["animate", "teapot.ron", "-o", output], rest].concat()
    };
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
        (
            render(&["--encoding", "gamma"]),
            2,
            "no encoding is called 'gamma'; there are srgb, linear",
        ),
        (
            animate("a.apng", &["--encoding", "linear"]),
            2,
            "--encoding",
        ),
        (render(&["--simd", "mmx"]), 2, "scalar"),
        (render(&["--time", "-1"]), 2, "seconds"),
        (render(&["--time", "nan"]), 2, "seconds"),
        (render(&["--time", "1e9"]), 2, "86400"),
        (vec!["animate", "teapot.ron"], 2, "--output"),
        (animate("a.apng", &["--fps", "0"]), 2, "30000/1001"),
        (animate("a.apng", &["--fps", "-3"]), 2, "30000/1001"),
        (animate("a.apng", &["--fps", "1/0"]), 2, "30000/1001"),
        (animate("a.apng", &["--duration", "0"]), 2, "above 0"),
        (animate("a.apng", &["--duration", "1e6"]), 2, "86400"),
        (animate("a.apng", &["--budget", "-1"]), 2, "milliseconds"),
        (
            animate("a.apng", &["--work", "1", "--budget", "1"]),
            2,
            "cannot be used with",
        ),
        (
            animate("a.apng", &["--duration", "80000", "--fps", "100"]),
            2,
            "error: 80000 seconds at 100 frames a second are 8000000 frames; at most 1000000",
        ),
        (animate("##.png", &["--shard", "0/4"]), 2, "from 1 to N"),
        (animate("##.png", &["--shard", "5/4"]), 2, "from 1 to N"),
        (animate("##.png", &["--shard", "3"]), 2, "from 1 to N"),
        (
            animate("a.apng", &["--shard", "1/4"]),
            2,
            "error: --shard needs numbered files such as frames/####.png",
        ),
        (animate("-", &["--shard", "1/4"]), 2, "error: --shard"),
        (animate("-", &["--json"]), 2, "error: --json and the film"),
        (
            animate("a.mp4", &[]),
            2,
            "error: the output must be a .apng",
        ),
        (
            animate("##.jpg", &[]),
            2,
            "error: the output must be a .apng",
        ),
        (
            animate("##/##.png", &[]),
            2,
            "error: '##/##.png' has several",
        ),
        (
            animate("##/a.png", &[]),
            2,
            "error: '##/a.png' has the frame's",
        ),
        (
            animate("none/a.apng", &[]),
            1,
            "error: cannot write none/a.apng: No such file or directory",
        ),
        (
            animate("teapot.ron/####.png", &["--duration", "0.1"]),
            1,
            "cannot make the folder teapot.ron: ",
        ),
        (
            vec!["animate", "bad.ron", "-o", "new/####.png"],
            2,
            "error: bad.ron:2:3: ",
        ),
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
        (&["animate", "--help"], "frames/####.png"),
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
                "error_bound",
                "unproved_share",
                "pht",
                "pht_visible",
                "refined",
                "stage_ms",
                "skipped",
            ],
        );
        assert_keys(
            &frame["stage_ms"],
            &[
                "cull", "shade", "classify", "raster", "refine", "resolve", "present",
            ],
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
    let lines = text(&table.stdout).lines();
    // Below the rows, a table of areas begins with its scene as well.
    let printed = lines.take_while(|line| !line.is_empty());
    assert_eq!(
        printed.filter(|line| line.starts_with("teapot ")).count(),
        rows.len()
    );
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

const MOVING: &str = "(
    animation: (duration: 0.7, fps: 10, orbit: (degrees_per_second: 40)),
    lights: [Point(position: (-5, -8, 8), orbit: ())],
    objects: [(shape: Teapot(tessellation: 3)), (shape: Torus(), position: (3, -3, 1), spin: (axis: (1, 0, 0)))],
)";

/// A directory with a scene in it that moves.
fn studio() -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    fs::write(directory.path().join("film.ron"), MOVING).expect("writable");
    directory
}

/// Films the moving scene, small.
fn animate(directory: &Path, arguments: &[&str]) -> Output {
    let common = ["animate", "film.ron", "--size", "64x48"];
    let output = specula(directory, &[&common[..], arguments].concat());
    assert_success(&output);
    output
}

/// The pixels of all images of a PNG file.
fn images(path: &Path) -> Vec<Vec<u8>> {
    let file = std::io::BufReader::new(fs::File::open(path).expect("written"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG file");
    let count = reader
        .info()
        .animation_control
        .map_or(1, |control| control.num_frames);
    (0..count)
        .map(|_| {
            let mut pixels = vec![0; reader.output_buffer_size().expect("small")];
            reader.next_frame(&mut pixels).expect("a frame");
            pixels
        })
        .collect()
}

#[test]
fn films_show_the_scene_at_each_point_of_time() {
    let directory = studio();
    let place = directory.path();
    for name in ["a.apng", "a.png", "a.y4m", "f-%03d.png", "new/folder/"] {
        let output = animate(place, &["-o", name]);
        let summary = text(&output.stdout);
        assert!(summary.starts_with("7 frames of 64x48 in "), "{summary}");
        assert!(summary.contains("rendering  median "), "{summary}");
        let expected = format!("wrote {name} (64x48, 10 frames a second)\n");
        assert_eq!(text(&output.stderr), expected);
    }
    let film = images(&place.join("a.apng"));
    assert_eq!(film.len(), 7);
    assert!(film == images(&place.join("a.png")));
    for (index, time) in ["0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6"]
        .iter()
        .enumerate()
    {
        let number = index + 1;
        let mut still = [
            "render",
            "film.ron",
            "-o",
            "still.png",
            "--size",
            "64x48",
            "--time",
            time,
        ];
        if index == 0 {
            // At rest.
            still[6..].copy_from_slice(&["--threads", "1"]);
        }
        assert_success(&specula(place, &still));
        let still = &images(&place.join("still.png"))[0];
        assert!(*still == film[index], "frame {number} of the APNG file");
        for name in [
            format!("f-{number:03}.png"),
            format!("new/folder/{number:04}.png"),
        ] {
            assert!(*still == images(&place.join(&name))[0], "{name}");
        }
    }
    assert!(
        film.windows(2).all(|pair| pair[0] != pair[1]),
        "nothing moves"
    );
    // Its frames are compared in `animation.rs`.
    let header = "YUV4MPEG2 W64 H48 F10:1 Ip A1:1 C444 XYSCSS=444 XCOLORRANGE=LIMITED\n";
    let y4m = fs::read(place.join("a.y4m")).expect("written");
    assert!(y4m.starts_with(header.as_bytes()));
    assert_eq!(y4m.len(), header.len() + 7 * (6 + 3 * 64 * 48));
    let piped = animate(place, &["-o", "-"]);
    assert!(piped.stdout == y4m);
    assert!(text(&piped.stderr).starts_with("7 frames of 64x48"));
}

#[test]
fn parts_of_a_film_are_the_frames_of_the_whole() {
    let directory = studio();
    let place = directory.path();
    // A film of which all frames show the same, so that one could refine what the one before has left.
    let still = MOVING.replace("degrees_per_second: 40", "degrees_per_second: 0");
    let still = still.replace("orbit: ()", "orbit: (degrees_per_second: 3600)");
    let still = still.replace("spin: (axis", "spin: (degrees_per_second: 3600, axis");
    for scene in [MOVING, &still] {
        fs::write(place.join("film.ron"), scene).expect("writable");
        for budget in [&["--work", "20000"][..], &[]] {
            let film = |output, rest: &[&str]| {
                animate(
                    place,
                    &[&["-o", output, "--overwrite"], budget, rest].concat(),
                );
            };
            film("whole/####.png", &["--threads", "2"]);
            for shard in ["1/3", "2/3", "3/3"] {
                film("parts/####.png", &["--shard", shard, "--threads", "1"]);
            }
            assert_eq!(files(&place.join("parts")), files(&place.join("whole")));
            for name in files(&place.join("whole")) {
                let read =
                    |folder: &str| fs::read(place.join(folder).join(&name)).expect("written");
                assert!(read("whole") == read("parts"), "{name} with {budget:?}");
            }
        }
    }
}

#[test]
fn finished_frames_are_kept_unless_told_otherwise() {
    let directory = studio();
    let place = directory.path();
    fs::create_dir(place.join("f")).expect("writable");
    for number in [2, 3] {
        fs::write(place.join(format!("f/{number}.png")), "older").expect("writable");
    }
    let output = animate(place, &["-o", "f/#.png", "--shard", "1/2", "--json"]);
    let frames = json_lines(&output);
    assert_eq!(
        files(&place.join("f")),
        ["1.png", "2.png", "3.png", "5.png", "7.png"]
    );
    assert!(text(&output.stderr).contains("kept       1 frame that was there already"));
    let numbers: Vec<_> = frames.iter().map(|frame| frame["frame"].as_u64()).collect();
    assert_eq!(numbers, [Some(1), Some(3), Some(5), Some(7)]);
    for frame in &frames {
        let number = frame["frame"].as_u64().expect("a number");
        assert_eq!(frame["kept"], number == 3);
        assert_eq!(frame["file"], format!("f/{number}.png"));
        assert_eq!(frame["time_s"], (number - 1) as f64 / 10.0);
        assert_eq!(frame.get("frame_ms").is_some(), number != 3);
    }

    let output = animate(place, &["-o", "f/#.png"]);
    assert!(text(&output.stdout).starts_with("2 frames of"));
    assert!(text(&output.stdout).contains("kept       5 frames that were there"));
    let output = animate(place, &["-o", "f/#.png"]);
    assert!(text(&output.stdout).starts_with("no frames to render"));
    assert_eq!(text(&output.stderr), "");
    assert_eq!(fs::read(place.join("f/2.png")).expect("there"), b"older");

    let output = animate(place, &["-o", "f/#.png", "--overwrite", "--budget", "0"]);
    assert!(text(&output.stdout).contains("budget 0.00 ms: 7 late"));
    assert_eq!(images(&place.join("f/2.png")).len(), 1);
    let beyond = animate(place, &["-o", "f/#.png", "--shard", "8/9"]);
    assert!(text(&beyond.stdout).starts_with("no frames to render"));
}

#[test]
fn a_still_scene_is_filmed_from_all_sides() {
    let directory = workplace();
    let film = [
        "animate",
        "teapot.ron",
        "-o",
        "a.apng",
        "--size",
        "40x30",
        "--duration",
        "2",
        "--fps",
        "2",
    ];
    let output = specula(directory.path(), &film);
    assert_success(&output);
    assert!(
        text(&output.stderr)
            .starts_with("nothing moves in teapot.ron: the camera goes around it once\n")
    );
    let frames = images(&directory.path().join("a.apng"));
    assert_eq!(frames.len(), 4);
    for (a, b) in [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3)] {
        assert!(frames[a] != frames[b], "frames {a} and {b}");
    }
}

#[test]
fn a_film_whose_reader_goes_away_ends_quietly() {
    let directory = studio();
    let mut child = Command::new(env!("CARGO_BIN_EXE_specula"))
        .args([
            "animate", "film.ron", "-o", "-", "--fps", "1000", "--budget", "0",
        ])
        .current_dir(directory.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_success(&output);
    assert_eq!(text(&output.stderr), "");
    assert_eq!(files(directory.path()), ["film.ron"]);
}

#[test]
fn the_backend_is_chosen_by_name() {
    let directory = workplace();
    let run = |arguments: &str| {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        specula(directory.path(), &arguments)
    };
    let output = run(
        "render teapot.ron -o skia.png --backend skia --size 96x54 --frames 2 --work 2000000 --json --error",
    );
    assert_success(&output);
    let frames = json_lines(&output);
    assert_eq!(frames[0]["phong_pixels"], 0);
    assert!(
        frames[0]["leaves"].as_u64() > Some(0),
        "it refines: {}",
        frames[0]
    );
    assert!(directory.path().join("skia.png").exists());
    let cases = [
        (
            "render teapot.ron -o x.png --backend skia --method phong",
            "error: the method 'phong' needs a backend that shades single pixels, which this one does not\n",
        ),
        (
            "sweep teapot.ron --backend skia --budgets 1",
            "error: the method 'phong-area' needs a backend that shades single pixels, which this one does not\n",
        ),
        (
            "sweep teapot.ron --backend skia --methods adaptive",
            "error: fractions are of the time of Phong shading, which the backend 'skia' cannot do: give --budgets\n",
        ),
    ];
    for (arguments, message) in cases {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments}");
        assert_eq!(text(&output.stderr), message, "{arguments}");
    }
    assert_success(&run(
        "sweep teapot.ron --backend skia --methods adaptive --budgets 1 --size 64x36",
    ));
}

#[test]
fn a_linear_image_is_tagged_and_measured_as_such() {
    let directory = workplace();
    let place = directory.path();
    let mut bytes = Vec::new();
    for encoding in ["srgb", "linear"] {
        let arguments = format!(
            "render teapot.ron -o {encoding}.png --encoding {encoding} --size 96x54 --json --error"
        );
        let output = specula(place, &arguments.split(' ').collect::<Vec<_>>());
        assert_success(&output);
        let [frame] = &json_lines(&output)[..] else {
            panic!("one frame: {}", text(&output.stdout));
        };
        let worst = frame["error"]["max"].as_u64();
        assert!(worst <= Some(1), "{encoding}: {frame}");

        let path = place.join(format!("{encoding}.png"));
        let file = std::io::BufReader::new(fs::File::open(&path).expect("written"));
        let reader = png::Decoder::new(file).read_info().expect("a PNG file");
        let info = reader.info();
        let gamma = info.gama_chunk.map(png::ScaledFloat::into_value);
        let is_linear = encoding == "linear";
        assert_eq!(info.srgb.is_none(), is_linear);
        assert_eq!(gamma == Some(1.0), is_linear, "{gamma:?}");
        bytes.push(images(&path));
    }
    // Stored linearly, all but black and white is darker.
    let (srgb, linear) = (bytes[0].concat(), bytes[1].concat());
    assert!(srgb != linear && srgb.iter().zip(&linear).all(|(s, l)| s >= l));

    // What is drawn over an image is sRGB.
    let inspect = "inspect teapot.ron --encoding linear --size 96x54 --overlay overlay.png";
    assert_success(&specula(place, &inspect.split(' ').collect::<Vec<_>>()));
    let file = std::io::BufReader::new(fs::File::open(place.join("overlay.png")).expect("written"));
    let reader = png::Decoder::new(file).read_info().expect("a PNG file");
    assert!(reader.info().srgb.is_some());

    let bench = "bench teapot.ron --encoding linear --size 64x36 --views 2 --error 2 --json";
    let output = specula(place, &bench.split(' ').collect::<Vec<_>>());
    assert_success(&output);
    let rmse = json_lines(&output)[0]["rmse"].as_f64();
    assert!(rmse < Some(0.5), "{rmse:?}");
}
