//! The table of hard cases in docs/CASES.md against the tests that exist.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Letters of the cases, and how many each has.
const CASES: [(&str, u32); 5] = [("N", 42), ("B", 8), ("A", 9), ("D", 7), ("G", 7)];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn sources(folder: &Path, text: &mut String) {
    let entries = fs::read_dir(folder).expect("the folder is readable");
    for path in entries.map(|entry| entry.expect("an entry").path()) {
        if path.is_dir() {
            sources(&path, text);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            text.push_str(&fs::read_to_string(path).expect("a source is text"));
        }
    }
}

/// Cells of the rows whose first cell is a case.
fn rows(table: &str) -> Vec<(String, Vec<String>)> {
    let is_case = |cell: &str| {
        let (letter, number) = cell.split_at(1);
        CASES.iter().any(|(known, _)| *known == letter) && number.parse::<u32>().is_ok()
    };
    let row = |line: &str| {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let case = cells
            .get(1)
            .filter(|cell| !cell.is_empty() && is_case(cell))?;
        let quoted = cells.get(3)?.split('`').skip(1).step_by(2);
        Some(((*case).to_owned(), quoted.map(str::to_owned).collect()))
    };
    table.lines().filter_map(row).collect()
}

#[test]
fn every_case_of_the_catalogue_is_a_test_that_exists() {
    let table = fs::read_to_string(root().join("docs/CASES.md")).expect("docs/CASES.md");
    let mut code = String::new();
    for folder in ["src", "tests", "experiments"] {
        sources(&root().join(folder), &mut code);
    }
    let rows = rows(&table);
    let named: BTreeSet<String> = rows.iter().map(|(case, _)| case.clone()).collect();
    let of =
        |(letter, count): (&'static str, u32)| (1..=count).map(move |k| format!("{letter}{k}"));
    let cases: BTreeSet<String> = CASES.into_iter().flat_map(of).collect();
    assert_eq!(named, cases);
    for (case, tests) in rows {
        assert!(!tests.is_empty(), "{case}");
        for test in tests {
            assert!(code.contains(&format!("fn {test}(")), "{case}: {test}");
        }
    }
}
