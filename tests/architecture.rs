//! Who may use whom: data flows one way, and a room uses only the rooms above it (ARCHITECTURE.md).

use std::fs;
use std::path::{Path, PathBuf};

/// The rooms from top to bottom.
const ROOMS: [&str; 9] = [
    "numeric",
    "geometry",
    "scene",
    "index",
    "render",
    "image",
    "lab",
    "experiments",
    "cli",
];

/// Longest file: what can be read in one sitting, with a little slack.
const MOST_LINES: usize = 500;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn rust_files(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder can be listed") {
        let path = entry.expect("the entry can be read").path();
        if path.is_dir() {
            rust_files(&path, into);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            into.push(path);
        }
    }
}

fn folder_of(room: &str) -> PathBuf {
    if room == "experiments" {
        root().join("experiments")
    } else {
        root().join("src").join(room)
    }
}

/// Rooms named in a source text by a path that starts at the crate.
fn rooms_used(text: &str) -> Vec<&'static str> {
    let code = text
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    let code: String = code.collect::<Vec<_>>().join("\n");
    let grouped = code.contains("use crate::{");
    let used = |room: &&str| {
        code.contains(&format!("crate::{room}::"))
            || code.contains(&format!("crate::{room};"))
            || grouped
                && code
                    .split("use crate::{")
                    .skip(1)
                    .any(|rest| rest.split(';').next().unwrap_or("").contains(room))
    };
    ROOMS.into_iter().filter(used).collect()
}

/// Uses of a lower room, as (file, room).
fn upward_uses(room: &str, text: &str) -> Vec<&'static str> {
    let level = ROOMS
        .iter()
        .position(|&name| name == room)
        .expect("a known room");
    rooms_used(text)
        .into_iter()
        .filter(|used| ROOMS.iter().position(|name| name == used) > Some(level))
        .collect()
}

#[test]
fn a_room_uses_only_the_rooms_above_it() {
    let mut seen = 0;
    for room in ROOMS {
        let mut files = Vec::new();
        rust_files(&folder_of(room), &mut files);
        for file in files {
            // The one-line mains of the experiments are binaries outside the library's rooms.
            if file.components().any(|part| part.as_os_str() == "bin") {
                continue;
            }
            seen += 1;
            let text = fs::read_to_string(&file).expect("the file is text");
            let wrong = upward_uses(room, &text);
            assert!(
                wrong.is_empty(),
                "{} uses {wrong:?}, which stand below {room}",
                file.display()
            );
        }
    }
    assert!(seen > 40, "only {seen} files were looked at");
}

#[test]
fn a_use_of_a_lower_room_would_be_seen() {
    assert_eq!(
        upward_uses("geometry", "use crate::render::film::Film;"),
        ["render"]
    );
    assert_eq!(
        upward_uses("scene", "fn f() -> crate::image::picture::Picture { }"),
        ["image"]
    );
    assert_eq!(
        upward_uses("numeric", "use crate::{geometry::ray::Ray, numeric::rng};"),
        ["geometry"]
    );
    assert!(
        upward_uses(
            "render",
            "use crate::scene::Scene;\n// crate::lab::claim is not used"
        )
        .is_empty()
    );
}

#[test]
fn every_folder_of_the_library_is_a_room() {
    for entry in fs::read_dir(root().join("src")).expect("src can be listed") {
        let path = entry.expect("the entry can be read").path();
        if path.is_dir() {
            let name = path
                .file_name()
                .and_then(|name| name.to_str())
                .unwrap_or("");
            assert!(ROOMS.contains(&name), "{name} is not in the list of rooms");
        }
    }
}

#[test]
fn files_can_be_read_in_one_sitting() {
    let mut files = Vec::new();
    for folder in ["src", "experiments", "benches", "tests"] {
        rust_files(&root().join(folder), &mut files);
    }
    for file in files {
        let lines = fs::read_to_string(&file)
            .expect("the file is text")
            .lines()
            .count();
        assert!(lines <= MOST_LINES, "{} has {lines} lines", file.display());
    }
}
