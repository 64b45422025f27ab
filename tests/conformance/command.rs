//! `photolathe rays` and `photolathe grade` from the outside.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const CUP: &str = "scenes/hard/cup.toml";

fn photolathe(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_photolathe"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("the program starts")
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn file(&self, name: &str) -> String {
        self.0.path().join(name).display().to_string()
    }

    fn write(&self, name: &str, text: &str) -> String {
        std::fs::write(self.file(name), text).expect("the file is written");
        self.file(name)
    }
}

fn suite(folder: &Folder, name: &str, family: &str, count: &str, more: &[&str]) -> String {
    let path = folder.file(name);
    let base = [
        "rays", CUP, "--family", family, "--count", count, "--seed", "3", "-o", &path,
    ];
    let done = photolathe(&[&base[..], more].concat());
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    path
}

fn records(path: impl AsRef<Path>) -> Vec<csv::StringRecord> {
    let mut reader = csv::Reader::from_path(path).expect("a CSV file");
    reader
        .records()
        .map(|record| record.expect("a row"))
        .collect()
}

/// (true_hit, true_t, second_t) of each ray.
fn truths(path: &str) -> Vec<(bool, String, String)> {
    let rows = records(path);
    rows.iter()
        .map(|row| (&row[10] == "1", row[11].to_owned(), row[19].to_owned()))
        .collect()
}

fn grade(folder: &Folder, rays: &str, theirs: &str) -> (Option<i32>, Value) {
    let json = folder.file("grade.json");
    let done = photolathe(&["grade", rays, theirs, "--json", &json]);
    let text = std::fs::read_to_string(&json).expect("the JSON is written");
    (
        done.status.code(),
        serde_json::from_str(&text).expect("JSON"),
    )
}

#[test]
fn planted_answers_are_graded_exactly() {
    let folder = Folder::new();
    let rays = suite(&folder, "rays.csv", "random", "60", &[]);
    let truths = truths(&rays);
    let (mut missed, mut wrong, mut phantom) = (0, 0, 0);
    let answer = |(hit, t, second): &(bool, String, String)| match (*hit, second.is_empty()) {
        (true, false) if wrong < 3 => {
            wrong += 1;
            format!("1,{second}")
        }
        (true, _) if missed < 2 => {
            missed += 1;
            "0,".to_owned()
        }
        (false, _) if phantom < 4 => {
            phantom += 1;
            "1,5.5".to_owned()
        }
        (true, _) => format!("1,{t}"),
        (false, _) => "0,".to_owned(),
    };
    let answers: Vec<String> = truths.iter().map(answer).collect();
    let in_order = folder.write("a.csv", &format!("hit,t\n{}\n", answers.join("\n")));
    // The same by number: backwards, without the misses, with a farther hit beside each.
    let numbered = answers
        .iter()
        .enumerate()
        .rev()
        .filter(|(_, a)| a.starts_with('1'));
    let rows: Vec<String> = numbered
        .map(|(i, a)| format!("x,{i},{a}\nx,{i},1,1e9"))
        .collect();
    let by_number = folder.write("b.csv", &format!("note,ray,hit,t\n{}\n", rows.join("\n")));
    for theirs in [in_order, by_number] {
        let (code, json) = grade(&folder, &rays, &theirs);
        let family = &json["families"][0];
        assert_eq!(code, Some(1));
        assert_eq!(
            (&family["family"], &family["rays"]),
            (&"random".into(), &60.into())
        );
        assert_eq!(
            (&family["miss"], &family["wrong"], &family["phantom"]),
            (&2.into(), &3.into(), &4.into())
        );
        assert_eq!(
            (&family["right"], &family["ambiguous"], &json["failures"]),
            (&51.into(), &0.into(), &9.into())
        );
        assert_eq!(family["t_error"]["max"], 0.0);
        let examples = family["examples"].as_array().expect("a list");
        assert_eq!(examples.len(), 5);
    }
}

#[test]
fn the_default_solver_has_no_failure_and_every_page_is_whole() {
    let folder = Folder::new();
    let rays = suite(&folder, "rays.csv", "all", "8", &[]);
    let theirs = folder.file("theirs.csv");
    assert!(
        photolathe(&["intersect", CUP, "--rays", &rays, "-o", &theirs])
            .status
            .success()
    );
    let page = folder.file("grade.html");
    let done = photolathe(&[
        "grade",
        &rays,
        &theirs,
        "--tolerance",
        "4e-15",
        "--html",
        &page,
    ]);
    let table = String::from_utf8_lossy(&done.stdout).into_owned();
    assert_eq!(done.status.code(), Some(0), "{table}");
    assert!(
        table.contains("grazes") && table.contains("0 failures in 160 rays"),
        "{table}"
    );
    let html = std::fs::read_to_string(page).expect("the page is written");
    assert!(html.contains("<svg") && html.contains("grazes") && !html.contains("http"));
    // Every crossing of every ray says the same by its column `ray`.
    assert!(
        photolathe(&["intersect", CUP, "--rays", &rays, "--all", "-o", &theirs])
            .status
            .success()
    );
    assert_eq!(
        photolathe(&["grade", &rays, &theirs, "--tolerance", "4e-15"])
            .status
            .code(),
        Some(0)
    );
}

#[test]
fn a_suite_is_the_same_on_any_number_of_threads() {
    let folder = Folder::new();
    let read = |name: &str, threads: &str| {
        let path = suite(&folder, name, "leaving", "40", &["--threads", threads]);
        std::fs::read(PathBuf::from(path)).expect("the suite is written")
    };
    assert_eq!(read("one.csv", "1"), read("three.csv", "3"));
}

#[test]
fn all_skips_what_does_not_fit_and_one_family_is_refused() {
    let arguments = |family| ["rays", CUP, "--family", family, "--count", "1"];
    let done = photolathe(&arguments("all"));
    assert!(done.status.success());
    let (out, told) = (
        String::from_utf8_lossy(&done.stdout),
        String::from_utf8_lossy(&done.stderr),
    );
    assert!(
        told.contains("`loops` does not fit") && !out.contains("loops") && out.contains("folds")
    );
    for (family, word) in [
        ("loops", "does not cross itself"),
        ("nonsense", "near-horizontal"),
    ] {
        let done = photolathe(&arguments(family));
        let told = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(2));
        assert!(told.contains(word), "{told}");
    }
    let none = photolathe(&[
        "rays",
        "scenes/box.toml",
        "--family",
        "random",
        "--count",
        "1",
    ]);
    assert_eq!(none.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&none.stderr).contains("no surface of revolution"));
}

#[test]
fn bad_input_is_one_error_with_its_place() {
    let folder = Folder::new();
    let rays = suite(&folder, "rays.csv", "random", "2", &[]);
    for (text, expected) in [
        ("hit,t\n0,\n", "1 rows: expected 2"),
        ("hit,t\n0,\n0,\n0,\n", "3 rows: expected 2"),
        ("hit\n0\n0\n", "bad.csv:1: column `t` is missing"),
        (
            "hit,t\n0,\n1,NaN\n",
            "bad.csv:3: field 2 (`t`) is `NaN`: expected a finite number",
        ),
        ("hit,t\n1,inf\n0,\n", "bad.csv:2: field 2 (`t`) is `inf`"),
        ("hit,t\n1,\n0,\n", "bad.csv:2: field 2 (`t`) is ``"),
        (
            "hit,t\nyes,1\n0,\n",
            "bad.csv:2: field 1 (`hit`) is `yes`: expected 0 or 1",
        ),
        (
            "ray,hit,t\n2,0,\n",
            "bad.csv:2: field 1 (`ray`) is `2`: expected a ray from 0 to 1",
        ),
        ("", "column `hit` is missing"),
    ] {
        let theirs = folder.write("bad.csv", text);
        let done = photolathe(&["grade", &rays, &theirs]);
        let told = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{text:?}");
        assert!(
            told.contains(expected) && told.lines().count() == 1,
            "{text:?}: {told}"
        );
    }
    let good = folder.write("good.csv", "hit,t\n0,\n0,\n");
    for (suite, expected) in [
        (
            good.as_str(),
            "column `ox` is missing: expected a file written by `photolathe rays`",
        ),
        ("no/such/file.csv", "no/such/file.csv: cannot open"),
    ] {
        let done = photolathe(&["grade", suite, &good]);
        assert_eq!(done.status.code(), Some(2));
        let told = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(told.contains(expected), "{told}");
    }
    let done = photolathe(&["grade", &rays, &good, "--tolerance", "2"]);
    assert_eq!(done.status.code(), Some(2));
}

#[test]
fn help_teaches_families_and_verdicts() {
    let help =
        |command| String::from_utf8_lossy(&photolathe(&[command, "--help"]).stdout).into_owned();
    assert!(help("rays").contains("near-horizontal   |d_y| from 1e-1 to 1e-300"));
    assert!(help("grade").contains("ambiguous"));
}
