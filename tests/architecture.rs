//! The layers: who may know whom, what the pure parts must not touch, and that every module says what it is for.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::root;

/// Modules with the crate modules that they may use, lowest layer first; every one may use `text`.
const LAYERS: &[(&str, &[&str])] = &[
    ("text", &[]),
    ("units", &[]),
    ("checksum", &[]),
    ("geometry", &["units"]),
    ("kinematics", &["units", "geometry"]),
    ("identification", &["units", "geometry", "kinematics"]),
    ("planning", &["units", "geometry", "kinematics", "identification"]),
    ("inverse", &["units", "kinematics"]),
    ("compensation", &["units", "kinematics", "inverse"]),
    ("iso9283", &[]),
    ("profile", &["checksum", "units", "geometry", "kinematics"]),
    ("session", &["checksum", "units", "geometry", "kinematics", "identification", "planning", "profile"]),
    ("program", &["units", "kinematics", "inverse", "session"]),
    ("model", &["checksum", "units", "kinematics", "profile", "session"]),
    (
        "correction",
        &["units", "kinematics", "identification", "inverse", "compensation", "profile", "session", "program", "model"],
    ),
    ("search", &["planning"]),
    ("link", &["units", "geometry", "kinematics", "planning", "profile", "session"]),
    ("store", &["units", "geometry", "profile", "session"]),
    ("report", &["units", "geometry", "kinematics", "identification", "planning", "profile", "session"]),
    ("recording", &["units", "geometry", "kinematics", "identification", "planning", "profile", "session", "store"]),
    ("error", &[]),
    (
        "procedure",
        &[
            "checksum",
            "units",
            "geometry",
            "kinematics",
            "identification",
            "planning",
            "inverse",
            "iso9283",
            "profile",
            "session",
            "search",
            "model",
            "correction",
            "program",
            "report",
        ],
    ),
    (
        "wizard",
        &[
            "units",
            "geometry",
            "kinematics",
            "identification",
            "planning",
            "profile",
            "program",
            "session",
            "procedure",
        ],
    ),
    ("runtime", &["checksum", "profile", "program", "session", "procedure", "link", "store", "recording", "wizard"]),
    ("script", &["session", "wizard", "runtime"]),
    (
        "tui",
        &["units", "geometry", "kinematics", "identification", "planning", "profile", "session", "wizard", "runtime"],
    ),
    (
        "cli",
        &[
            "units",
            "kinematics",
            "identification",
            "planning",
            "procedure",
            "profile",
            "session",
            "program",
            "model",
            "correction",
            "iso9283",
        ],
    ),
    (
        "app",
        &[
            "checksum",
            "cli",
            "compensation",
            "correction",
            "error",
            "geometry",
            "identification",
            "inverse",
            "kinematics",
            "link",
            "model",
            "planning",
            "procedure",
            "profile",
            "program",
            "recording",
            "report",
            "runtime",
            "script",
            "session",
            "store",
            "tui",
            "units",
            "wizard",
        ],
    ),
];

/// Modules that read no file, no clock, no environment and print nothing.
const PURE: &[&str] = &[
    "text",
    "units",
    "geometry",
    "kinematics",
    "identification",
    "planning",
    "inverse",
    "compensation",
    "iso9283",
    "profile",
    "session",
    "program",
    "model",
    "correction",
    "procedure",
    "wizard",
];

/// What a pure module must not name.
const IMPURE: &[&str] = &[
    "std::fs",
    "std::time",
    "std::env",
    "std::net",
    "std::thread",
    "std::io",
    "println!",
    "print!",
    "dbg!",
    "rand::rng",
    "from_os_rng",
    "getrandom",
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// All source files with their top module and text; `main.rs` and `lib.rs` belong to none.
fn modules() -> Vec<(PathBuf, String, String)> {
    let root = root().join("src");
    let mut paths = Vec::new();
    sources(&root, &mut paths);
    paths
        .into_iter()
        .map(|path| {
            let inside =
                path.strip_prefix(root.join("core")).or_else(|_| path.strip_prefix(&root)).unwrap().with_extension("");
            let top = inside.components().next().unwrap().as_os_str().to_str().unwrap().to_owned();
            let text = fs::read_to_string(&path).unwrap();
            (path, top, text)
        })
        .filter(|(_, top, _)| top != "main" && top != "lib")
        .collect()
}

/// The part of a file that ships: unit tests may know more.
fn shipped(text: &str) -> &str {
    text.split("#[cfg(test)]").next().unwrap_or(text)
}

fn is_test_file(path: &Path) -> bool {
    path.components().any(|part| part.as_os_str() == "tests") || path.ends_with("tests.rs")
}

/// Names that follow `crate::` in a text, comments aside.
fn used_modules(text: &str) -> Vec<String> {
    let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    code.flat_map(|line| {
        line.match_indices("crate::").map(|(at, mark)| {
            line[at + mark.len()..].chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>()
        })
    })
    // `use crate::{a, b}` would hide its names: it has no name here and is refused below.
    .collect()
}

#[test]
fn every_module_keeps_to_its_layer() {
    let mut wrong = Vec::new();
    for (path, top, text) in modules() {
        if is_test_file(&path) {
            continue;
        }
        let Some((_, allowed)) = LAYERS.iter().find(|(name, _)| *name == top) else {
            wrong.push(format!("{}: module '{top}' has no place in the layers", path.display()));
            continue;
        };
        for used in used_modules(shipped(&text)) {
            // Macros of `text` are at the root of the library.
            let is_macro = used.is_empty() && top == "text";
            if !is_macro && used != top && used != "text" && !allowed.contains(&used.as_str()) {
                wrong.push(format!("{}: '{top}' must not know '{used}'", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn pure_modules_touch_nothing_outside() {
    let mut wrong = Vec::new();
    for (path, top, text) in modules() {
        if !PURE.contains(&top.as_str()) || is_test_file(&path) {
            continue;
        }
        for (number, line) in shipped(&text).lines().enumerate() {
            for name in IMPURE {
                if line.contains(name) && !line.trim_start().starts_with("//") {
                    wrong.push(format!("{}:{}: {name}", path.display(), number + 1));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Modules that people use directly: they name options, keys and exit codes.
const EDGES: &[&str] = &["app", "cli", "error", "script", "tui"];

/// How options, keys and exit codes begin in a message.
const EDGE_WORDS: &[&str] = &["'--", "exit code", "Ctrl", "[Esc", "[Enter", "'Esc'", "'Enter'", "ExitStatus"];

#[test]
fn only_the_edges_name_options_keys_and_exit_codes() {
    let mut wrong = Vec::new();
    for (path, top, text) in modules() {
        if EDGES.contains(&top.as_str()) || is_test_file(&path) {
            continue;
        }
        for (number, line) in shipped(&text).lines().enumerate() {
            let is_comment = line.trim_start().starts_with("//");
            if let Some(word) = EDGE_WORDS.iter().find(|word| line.contains(**word) && !is_comment) {
                wrong.push(format!("{}:{}: {word}", path.display(), number + 1));
            }
        }
    }
    assert!(wrong.is_empty(), "return a typed error or `Advice` instead:\n{}", wrong.join("\n"));
}

#[test]
fn every_module_says_what_it_is_for() {
    let silent: Vec<String> = modules()
        .iter()
        .filter(|(path, _, text)| !is_test_file(path) && !text.starts_with("//!"))
        .map(|(path, _, _)| path.display().to_string())
        .collect();
    assert!(silent.is_empty(), "no module doc: {silent:?}");
}

#[test]
fn files_stay_small() {
    let mut sizes: Vec<(usize, String)> =
        modules().iter().map(|(path, _, text)| (text.lines().count(), path.display().to_string())).collect();
    sizes.sort();
    let (largest, name) = sizes.last().unwrap();
    assert!(*largest <= 700, "{name} has {largest} lines: split it");
}
