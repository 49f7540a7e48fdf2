//! What the program says of timed frames: logs and their replays, errors to stop at, older and smaller images, costs.

mod program;

use program::text;
use serde_json::Value;
use specula::schedule::CostModel;
use std::fs;
use std::path::Path;
use std::process::Output;

/// Runs the program in `directory`; words are separated by spaces.
fn specula(directory: &Path, arguments: &str) -> Output {
    let words: Vec<_> = arguments.split_whitespace().collect();
    program::specula(directory, &words)
}

/// Renders with options that all runs here share.
fn render(directory: &Path, rest: &str) -> Output {
    specula(directory, &format!("render teapot.ron {rest}"))
}

/// A directory with two scenes in it.
fn workplace() -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    let write = |name: &str, text: &str| {
        fs::write(directory.path().join(name), text).expect("writable");
    };
    write("teapot.ron", "(objects: [(shape: Teapot())])\n");
    write("box.ron", "(objects: [(shape: Box())])\n");
    directory
}

#[track_caller]
fn assert_success(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
}

/// Exit status, and a message of one line that contains `part`.
#[track_caller]
fn assert_failure(output: &Output, status: i32, part: &str) {
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{part}: {message}");
    let errors = message.lines().filter(|line| line.starts_with("error: "));
    assert_eq!(errors.count(), 1, "{message}");
    assert!(message.contains(part), "no '{part}' in: {message}");
}

fn json_lines(output: &Output) -> Vec<Value> {
    assert_success(output);
    let lines = text(&output.stdout).lines();
    let parsed = lines.map(|line| serde_json::from_str(line).expect("an object per line"));
    parsed.collect()
}

fn read_log(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).expect("readable")).expect("JSON")
}

fn names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).expect("readable");
    let names = entries.map(|entry| entry.expect("readable").file_name().into_string());
    let mut names: Vec<String> = names.map(|name| name.expect("UTF-8")).collect();
    names.sort();
    names
}

#[test]
fn a_recorded_run_is_repeated_bit_for_bit_on_any_number_of_threads() {
    let directory = workplace();
    let place = directory.path();
    for method in [
        "adaptive",
        "phong-area",
        "phong-tiles",
        "phong-half",
        "gouraud",
    ] {
        for budget in ["0.000001", "0.2", "2", "0"] {
            let recorded = format!(
                "-o a.png --size 320x180 --method {method} --budget {budget} --frames 5 --threads 2 --record run.json"
            );
            let output = render(place, &recorded);
            assert_success(&output);
            assert!(text(&output.stderr).contains("wrote run.json"));
            for threads in 1..=2 {
                let output = render(
                    place,
                    &format!("-o b.png --replay run.json --threads {threads}"),
                );
                assert_success(&output);
                let message = text(&output.stderr);
                assert!(
                    message.contains("all 5 images are the recorded ones"),
                    "{message}"
                );
                assert_eq!(
                    text(&output.stdout).matches("frame ").count(),
                    5,
                    "{method}"
                );
                let [a, b] =
                    ["a.png", "b.png"].map(|name| fs::read(place.join(name)).expect("written"));
                assert!(a == b, "{method}, {budget} ms, {threads} threads");
            }
        }
    }
}

#[test]
fn a_log_keeps_what_the_image_depends_on() {
    let directory = workplace();
    let place = directory.path();
    let recorded =
        "-o a.png --size 97x61 --budget 1 --encoding linear --time 0.5 --record run.json";
    assert_success(&render(place, recorded));
    assert_success(&render(place, "-o b.png --replay run.json"));
    let [a, b] = ["a.png", "b.png"].map(|name| fs::read(place.join(name)).expect("written"));
    assert!(a == b);
    let log = read_log(&place.join("run.json"));
    assert_eq!((&log["width"], &log["height"]), (&97.into(), &61.into()));
    assert_eq!(
        (&log["encoding"], &log["time_s"]),
        (&"linear".into(), &0.5.into())
    );
}

#[test]
fn what_is_no_log_of_this_scene_is_refused_in_a_sentence() {
    let directory = workplace();
    let place = directory.path();
    assert_success(&render(
        place,
        "-o a.png --size 64x48 --budget 1 --frames 2 --record run.json",
    ));
    let good = read_log(&place.join("run.json"));
    let before = names(place);
    let replay = |change: &dyn Fn(&mut Value)| {
        let mut log = good.clone();
        change(&mut log);
        let bad = place.join("bad.json");
        fs::write(&bad, serde_json::to_string_pretty(&log).expect("JSON")).expect("writable");
        let output = render(place, "-o b.png --replay bad.json");
        fs::remove_file(bad).expect("it was there");
        output
    };
    let set = |key: &'static str, value: Value| move |log: &mut Value| log[key] = value.clone();

    assert_failure(
        &replay(&set("frames", Value::Array(Vec::new()))),
        2,
        "bad.json: a log without frames",
    );
    assert_failure(&replay(&set("specula_log", 7.into())), 2, "version 7");
    assert_failure(
        &replay(&set("width", 0.into())),
        2,
        "bad.json: size: an image needs at least one pixel",
    );
    assert_failure(
        &replay(&set("width", 70_000.into())),
        2,
        "bad.json: size: no side",
    );
    assert_failure(
        &replay(&set("method", "magic".into())),
        2,
        "bad.json: method",
    );
    assert_failure(
        &replay(&set("backend", "gpu".into())),
        2,
        "bad.json: backend",
    );
    assert_failure(
        &replay(&set("encoding", "gamma".into())),
        2,
        "bad.json: encoding",
    );
    assert_failure(
        &replay(&set("time_s", (-1.0).into())),
        2,
        "bad.json: time_s",
    );
    // The line is the one of the wrong value, the columns are that of its end.
    let recorded = fs::read_to_string(place.join("run.json")).expect("readable");
    let tall = recorded.replace("\"height\": 48", "\"height\": \"tall\"");
    fs::write(place.join("bad.json"), tall).expect("writable");
    assert_failure(
        &render(place, "-o b.png --replay bad.json"),
        2,
        "error: bad.json:5:18: this is no log of a run: ",
    );
    fs::remove_file(place.join("bad.json")).expect("it was there");
    assert_failure(
        &replay(&|log| log["frames"][0]["record"]["steps"] = (-1).into()),
        2,
        "bad.json:",
    );
    assert_failure(
        &replay(&|log| log["colour"] = 3.into()),
        2,
        "unknown field `colour`",
    );
    // What another image would come of.
    let other = |log: &mut Value| log["frames"][1]["image"] = "0123456789abcdef".into();
    assert_failure(&replay(&other), 1, "frame 2 is not the recorded one");
    let divisor =
        |log: &mut Value| log["frames"][0]["record"]["divisor"] = 4_000_000_000_u32.into();
    assert_failure(&replay(&divisor), 1, "frame 1 is not the recorded one");

    fs::write(
        place.join("bad.json"),
        "{\n  \"specula_log\": 1,\n  oops\n}",
    )
    .expect("writable");
    assert_failure(
        &render(place, "-o b.png --replay bad.json"),
        2,
        "error: bad.json:3:3: this is no log",
    );
    fs::write(place.join("bad.json"), "").expect("writable");
    assert_failure(
        &render(place, "-o b.png --replay bad.json"),
        2,
        "bad.json:1:0",
    );
    let huge = fs::File::create(place.join("bad.json")).expect("writable");
    huge.set_len((1 << 26) + 1).expect("a sparse file");
    assert_failure(
        &render(place, "-o b.png --replay bad.json"),
        2,
        "bad.json: a log has at most 67108864 bytes",
    );
    fs::remove_file(place.join("bad.json")).expect("it was there");
    assert_failure(
        &render(place, "-o b.png --replay none.json"),
        1,
        "cannot read 'none.json'",
    );

    let output = specula(place, "render box.ron -o b.png --replay run.json");
    assert_failure(&output, 1, "frame 1 is not the recorded one");
    assert!(text(&output.stderr).contains("the log is of the scene 'teapot', not of 'box'"));
    assert_eq!(names(place), before, "nothing is written");
}

#[test]
fn logs_and_limits_of_error_go_with_some_options_only() {
    let directory = workplace();
    let place = directory.path();
    let before = names(place);
    for (rest, status, message) in [
        ("--replay run.json --budget 2", 2, "cannot be used with"),
        ("--replay run.json --work 2", 2, "cannot be used with"),
        ("--replay run.json --frames 2", 2, "cannot be used with"),
        (
            "--replay run.json --record b.json",
            2,
            "cannot be used with",
        ),
        ("--until-error 1 --budget 2", 2, "cannot be used with"),
        ("--until-error 1 --work 2", 2, "cannot be used with"),
        ("--until-error -1", 2, "number of 8-bit codes"),
        ("--until-error nan", 2, "number of 8-bit codes"),
        ("--until-error inf", 2, "number of 8-bit codes"),
        ("--until-error", 2, "--until-error"),
        ("--record none/run.json --budget 1", 1, "none/run.json"),
        ("--record . --budget 1", 1, "cannot write .: is a directory"),
        ("--costs none.ron", 1, "cannot read costs 'none.ron'"),
    ] {
        let output = render(place, &format!("-o a.png --size 32x18 {rest}"));
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{rest}: {stderr}");
        assert!(stderr.contains(message), "{rest}: {stderr}");
        assert_eq!(names(place), before, "{rest}");
    }
}

#[test]
fn refinement_ends_at_an_estimated_error() {
    let directory = workplace();
    let run = |rest: &str| {
        let output = render(
            directory.path(),
            &format!("-o a.png --size 256x144 --json {rest}"),
        );
        json_lines(&output).remove(0)
    };
    let number = |frame: &Value, key: &str| frame[key].as_f64().expect("a number");
    let (rough, fine) = (run("--until-error 2"), run("--until-error 0.2"));
    for (frame, target) in [(&rough, 2.0), (&fine, 0.2)] {
        assert!(number(frame, "estimated_error") <= target, "{frame}");
        assert!(frame["budget_ms"].is_null() && frame["budget_work"].is_null());
    }
    assert!(number(&rough, "work_units") < number(&fine, "work_units"));
    assert_eq!(run("--until-error 0")["estimated_error"], 0.0);
    let output = render(directory.path(), "-o a.png --size 64x36 --until-error 0.5");
    assert!(text(&output.stdout).contains("until about 0.5 codes of error"));
}

#[test]
fn older_and_smaller_images_are_said_to_be_so() {
    let directory = workplace();
    let place = directory.path();
    // A nanosecond is over before anything can begin.
    let run = "-o a.png --size 256x144 --budget 0.000001 --frames 2";
    for frame in json_lines(&render(place, &format!("{run} --json"))) {
        assert_eq!(frame["outcome"], "stale", "{frame}");
        assert!(frame["age"].is_null(), "{frame}");
        assert_eq!(
            (&frame["divisor"], &frame["converged"]),
            (&1.into(), &false.into())
        );
    }
    let output = render(place, run);
    assert!(
        text(&output.stdout).contains("frame 1: no image yet in "),
        "{}",
        text(&output.stdout)
    );

    // Costs that are a thousand times too high, learned from so many frames that some more do not count.
    let costs = ron::to_string(&CostModel::default()).expect("RON");
    let high = "(items:1.0,pixels:1000.0,spread:0.1,seen:1000)";
    let plain = "(items:1.0,pixels:1.0,spread:0.1,seen:0)";
    assert!(costs.contains(plain), "{costs}");
    let slow = costs.replace(&format!("raster:{plain}"), &format!("raster:{high}"));
    assert_ne!(slow, costs);
    fs::write(place.join("slow.ron"), slow).expect("writable");
    // The camera turns: the first frame's view is the one that the engine warmed up with, the others are new.
    let film = "animate teapot.ron -o a.apng --size 640x360 --duration 0.2 --fps 20 --budget 20 --json --costs slow.ron";
    let frames = json_lines(&specula(place, film));
    assert_eq!(frames.len(), 4);
    let frame = &frames[1];
    assert_eq!(frame["outcome"], "reduced", "{frame}");
    assert!(
        (2..=4).contains(&frame["divisor"].as_u64().expect("a number")),
        "{frame}"
    );
    assert_eq!(
        (&frame["age"], &frame["converged"]),
        (&0.into(), &false.into())
    );
}

#[test]
fn learned_costs_are_saved_and_started_from_by_every_command() {
    let directory = workplace();
    let place = directory.path();
    let bench = "bench teapot.ron --size 96x64 --views 3 --error 0";
    let output = specula(place, &format!("{bench} --save-costs costs.ron"));
    assert_success(&output);
    assert!(text(&output.stderr).contains("wrote costs.ron"));
    let saved = fs::read_to_string(place.join("costs.ron")).expect("written");
    let costs: CostModel = ron::from_str(&saved).expect("what the library reads");
    assert!(
        costs.is_valid() && costs != CostModel::default(),
        "{costs:?}"
    );
    assert_success(&specula(
        place,
        &format!("{bench} --costs costs.ron --save-costs again.ron"),
    ));
    let again = fs::read_to_string(place.join("again.ron")).expect("written");
    assert_ne!(again, saved, "it goes on learning");

    let commands = [
        bench,
        "render teapot.ron -o a.png --size 32x18",
        "animate teapot.ron -o a.apng --size 32x18 --duration 0.1 --fps 20",
        "inspect teapot.ron --size 32x18",
        "sweep teapot.ron --size 32x18 --budgets 1",
        "compare teapot.ron -o sheet.png --size 320x180",
    ];
    for command in commands {
        assert_success(&specula(place, &format!("{command} --costs costs.ron")));
    }
    let before = names(place);
    for (bad, message) in [
        (
            saved.replace("raster:", "roster:"),
            "bad.ron:8:5: these are no costs: Unexpected field named `roster`",
        ),
        (saved.replace("items:", "items "), "bad.ron:3:"),
        (saved[..saved.len() / 2].to_owned(), "bad.ron:"),
        (String::new(), "bad.ron:1:1: these are no costs"),
        (
            saved.replacen("items: ", "items: -", 1),
            "bad.ron:2:5: the costs of 'cull' make no sense",
        ),
        (
            saved.replace("raster: (", "raster: (pixels: NaN, "),
            "bad.ron:",
        ),
        ("(".repeat(100_000), "bad.ron:1:"),
        (
            " ".repeat(1 << 19),
            "bad.ron:1:1: these are no costs: more than",
        ),
    ] {
        fs::write(place.join("bad.ron"), bad).expect("writable");
        for command in commands {
            let output = specula(place, &format!("{command} --costs bad.ron"));
            assert_failure(
                &output,
                2,
                &format!(
                    "error: {}",
                    if message.starts_with("bad") {
                        message
                    } else {
                        "bad.ron:"
                    }
                ),
            );
            assert!(
                text(&output.stderr).contains(message),
                "{message}: {}",
                text(&output.stderr)
            );
        }
    }
    fs::write(place.join("bad.ron"), [b'(', 0xff]).expect("writable");
    assert_failure(
        &specula(place, &format!("{bench} --costs bad.ron")),
        2,
        "error: bad.ron:1:1: these are no costs: invalid utf-8",
    );
    fs::remove_file(place.join("bad.ron")).expect("it was there");
    assert_failure(
        &specula(place, &format!("{bench} --save-costs none/c.ron")),
        1,
        "none/c.ron",
    );
    assert_eq!(names(place), before, "nothing is written");
}
