//! Imports point down only: a module may use the modules of lower layers and itself, nothing else.
//!
//! The sources are read as text: comments and literals are taken out, then every path that starts at the crate's
//! root (`crate::`, or enough `super::`) is held against the layers. Tests inside modules are held to the same rule.

use std::fs;
use std::path::{Path, PathBuf};

/// The layers from the bottom up; modules of one layer never use each other.
const LAYERS: &[&[&str]] = &[
    &["math", "clock", "simd"],
    &["parallel"],
    &["output"],
    &["geometry"],
    &["scene"],
    &["illumination"],
    &["visibility", "highlight", "refine", "schedule", "backend"],
    &["frame"],
    &["measure"],
];

/// Files of the program: they may use all of the library.
const PROGRAM: &[&str] = &["cli", "main"];

/// The crate's root, which declares and re-exports.
const ROOT: &str = "lib";

fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|layer| layer.contains(&module))
}

/// Blanks out comments, strings and character literals, so that only code is left.
fn strip(source: &str) -> String {
    let chars: Vec<char> = source.chars().collect();
    let mut code = String::with_capacity(source.len());
    let mut at = 0;
    while at < chars.len() {
        let rest = &chars[at..];
        let skipped = match rest {
            ['/', '/', ..] => rest.iter().take_while(|&&c| c != '\n').count(),
            ['/', '*', ..] => block_comment_len(rest),
            ['r', '"' | '#', ..] if !code.ends_with(|c: char| c.is_alphanumeric() || c == '_') => {
                raw_string_len(rest)
            }
            ['"', ..] => quoted_len(rest, '"'),
            // A character literal, not a lifetime.
            ['\'', '\\', ..] | ['\'', _, '\'', ..] => quoted_len(rest, '\''),
            _ => 0,
        };
        if skipped == 0 {
            code.push(chars[at]);
            at += 1;
        } else {
            code.push(' ');
            at += skipped;
        }
    }
    code
}

fn block_comment_len(text: &[char]) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < text.len() {
        match text[at..] {
            ['/', '*', ..] => (depth, at) = (depth + 1, at + 2),
            ['*', '/', ..] => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
        if depth == 0 {
            break;
        }
    }
    at
}

/// The length of a raw string at the start of `text`, or 0 when it is something else (a raw identifier).
fn raw_string_len(text: &[char]) -> usize {
    let hashes = text[1..].iter().take_while(|&&c| c == '#').count();
    if text.get(1 + hashes) != Some(&'"') {
        return 0;
    }
    let mut at = 2 + hashes;
    while at < text.len() {
        let closed = text[at] == '"'
            && text[at + 1..]
                .iter()
                .take(hashes)
                .filter(|&&c| c == '#')
                .count()
                == hashes;
        at += 1;
        if closed {
            return at + hashes;
        }
    }
    at
}

fn quoted_len(text: &[char], quote: char) -> usize {
    let mut at = 1;
    while at < text.len() && text[at] != quote {
        at += if text[at] == '\\' { 2 } else { 1 };
    }
    (at + 1).min(text.len())
}

/// Words, `::`, and every other visible character by itself.
fn tokens(code: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = code.trim_start();
    while let Some(first) = rest.chars().next() {
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let len = if is_word(first) {
            rest.find(|c| !is_word(c)).unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            first.len_utf8()
        };
        tokens.push(&rest[..len]);
        rest = rest[len..].trim_start();
    }
    tokens
}

/// The names that follow the crate's root in all paths of `code`, the file being a module `depth` below the root.
fn root_names(code: &str, depth: usize) -> Vec<&str> {
    let tokens = tokens(code);
    let mut names = Vec::new();
    // For each open brace, whether it opened an inline module: `super` counts from there.
    let mut braces: Vec<bool> = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let start = at;
        at += 1;
        let starts_path = start == 0 || tokens[start - 1] != "::";
        let mut above = match tokens[start] {
            "{" => {
                braces.push(start >= 2 && tokens[start - 2] == "mod");
                continue;
            }
            "}" => {
                braces.pop();
                continue;
            }
            "crate" if starts_path => usize::MAX,
            "super" if starts_path => 1,
            _ => continue,
        };
        while tokens.get(at) == Some(&"::") && tokens.get(at + 1) == Some(&"super") {
            above += 1;
            at += 2;
        }
        let inline = braces.iter().filter(|&&is_module| is_module).count();
        if above >= depth + inline && tokens.get(at) == Some(&"::") {
            match tokens.get(at + 1) {
                Some(&"{") => names.extend(group_heads(&tokens[at + 2..])),
                Some(name) => names.push(name),
                None => {}
            }
        }
    }
    names
}

/// The first name of each path in a `{..}` group, given what follows the opening brace.
fn group_heads<'a>(tokens: &[&'a str]) -> Vec<&'a str> {
    let mut heads = Vec::new();
    let (mut depth, mut expects_head) = (0, true);
    for token in tokens {
        match *token {
            "{" => depth += 1,
            "}" if depth == 0 => break,
            "}" => depth -= 1,
            "," if depth == 0 => expects_head = true,
            name if expects_head => {
                heads.push(name);
                expects_head = false;
            }
            _ => {}
        }
    }
    heads
}

/// Everything in the file that breaks the rule, one sentence each.
fn violations(file: &Path, source: &str) -> Vec<String> {
    let module_path = module_path(file);
    let module = module_path.first().map_or(ROOT, String::as_str);
    if module == ROOT || PROGRAM.contains(&module) {
        return Vec::new();
    }
    let Some(own) = layer(module) else {
        return vec![format!(
            "{}: `{module}` has no layer; give it one here and in DESIGN.md",
            file.display()
        )];
    };
    root_names(&strip(source), module_path.len())
        .into_iter()
        .filter(|&name| name != module)
        .filter(|name| layer(name).is_none_or(|layer| layer >= own))
        .map(|name| {
            format!(
                "{}: `{module}` must not use `crate::{name}`",
                file.display()
            )
        })
        .collect()
}

/// The module that a file below `src/` is: `["geometry", "screen"]`.
fn module_path(file: &Path) -> Vec<String> {
    file.with_extension("")
        .iter()
        .map(|part| part.to_string_lossy().into_owned())
        .filter(|part| part != "mod" && part != ROOT)
        .collect()
}

fn rust_files(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).expect("the sources are readable") {
        let path = entry.expect("the sources are readable").path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn imports_point_down_only() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&root, &mut files);
    assert!(files.len() > 20, "only {} files below src", files.len());
    let wrong: Vec<_> = files
        .iter()
        .flat_map(|file| {
            let source = fs::read_to_string(file).expect("the sources are readable");
            violations(file.strip_prefix(&root).expect("found there"), &source)
        })
        .collect();
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn what_points_up_or_sideways_is_found() {
    let check = |file: &str, source: &str| violations(Path::new(file), source).len();
    for (file, source) in [
        ("geometry/mod.rs", "use crate::scene::World;"),
        ("highlight/cone.rs", "use crate::refine::Forest;"),
        (
            "schedule/queue.rs",
            "use crate::{math, backend::{Patch, Fill}};",
        ),
        ("simd.rs", "fn f() { crate::frame::run(); }"),
        ("refine/mod.rs", "use super::frame::Engine;"),
        (
            "backend/software/tile.rs",
            "pub(crate) use super::super::super::measure;",
        ),
        ("output/png.rs", "use crate::Frame;"),
        ("math.rs", "use crate::clock::Clock;"),
        ("frame/mod.rs", "use crate::cli::Args;"),
        ("novelty/mod.rs", ""),
        (
            "scene/mod.rs",
            "let c = '\"'; use crate::frame::X; let d = '\"';",
        ),
        ("math.rs", "mod tests { fn f() {} } use super::simd;"),
        ("math.rs", "mod tests { use super::super::simd; }"),
        (
            "scene/mod.rs",
            "#[cfg(test)] mod tests { use crate::measure::ErrorReport; }",
        ),
    ] {
        assert_eq!(check(file, source), 1, "{file}: {source}");
    }
}

#[test]
fn what_points_down_or_stays_is_allowed() {
    for (file, source) in [
        (
            "frame/mod.rs",
            "use crate::{backend::Patch, refine, highlight::{a, b}, math};",
        ),
        (
            "scene/read/mod.rs",
            "use crate::scene::Light; use super::Camera; mod tests { use super::*; use super::super::Eye; }",
        ),
        (
            "output/png.rs",
            "//! See [`World`](crate::scene::World).\n/* use crate::frame::X; /* */ */",
        ),
        (
            "simd.rs",
            "const A: &str = \"use crate::frame::X;\"; const B: &str = r#\"crate::scene::\"X\"#;",
        ),
        (
            "math.rs",
            "fn f<'a>(x: &'a str) {} pub(crate) struct A; use other::crate_name;",
        ),
        (
            "cli/mod.rs",
            "use specula::frame::Engine; use crate::cli::args;",
        ),
        ("lib.rs", "pub use crate::frame::Engine;"),
    ] {
        assert_eq!(violations(Path::new(file), source), Vec::<String>::new());
    }
}
