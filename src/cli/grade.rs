//! `photolathe grade`: any program's answers against certified truth.

use super::table::aligned;
use crate::image::file::write_atomically;
use crate::lab::grade::{FamilyGrade, Grade, grade, html, read_answers, read_suite};
use crate::lab::page::ascii_number;
use anyhow::Context as _;
use clap::Args;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Grade a program's answers to a suite of rays.
#[derive(Debug, Args)]
#[command(after_help = "\
THEIRS has a header with the columns hit (0 or 1) and t (blank on a miss), others are ignored, and a row for each ray in order: what
`photolathe intersect` writes. With a column `ray` (the ray's number) rows may come in any order; of several rows of a ray the
least t counts, and a ray without a row is a miss.

Verdicts, with T the tolerance and S the ray's scale (|o| + t|d|, at least the reach of the scene):
  right      a miss for a miss, or |t - true_t| |d| <= S min(2 T/cosine, 4 sqrt(T)): right for a surface moved by T S
  miss       no hit where there is one
  phantom    a hit where there is none
  wrong      a hit that is not the nearest
  ambiguous  not right, but moving the ray by T S or less changes the true answer (`margin`); not a failure
Errors are those of right hits: as a distance along the ray, and in units of eps (|o| + t|d|)/|n.d|, eps = 2^-52, which is what
rounding the coordinates once costs.

T says what the program claims: 4e-15 (sixteen roundings) for this one's solvers, 1e-9 for careful double precision, 1e-5 for
single precision. Exit code 0 without failures, 1 with, 2 for bad input.")]
pub struct GradeArgs {
    /// Suite of rays, written by `photolathe rays`.
    pub rays: PathBuf,
    /// The program's answers.
    pub theirs: PathBuf,
    /// T: positions are compared to within T times the ray's scale.
    #[arg(long, default_value_t = 1e-9, value_parser = parse_tolerance)]
    pub tolerance: f64,
    /// Writes a page with table, plots and the first failed rays.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Writes the grade as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

fn parse_tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(tolerance) if (1e-15..=1e-2).contains(&tolerance) => Ok(tolerance),
        _ => Err("expected a number from 1e-15 to 1e-2".to_owned()),
    }
}

/// Runs `grade`.
pub fn run(args: &GradeArgs) -> anyhow::Result<ExitCode> {
    let (suite, asked) = read_suite(&args.rays)?;
    let answers = read_answers(&args.theirs, asked.len())?;
    let grade = grade(&suite, &asked, &answers, args.tolerance);
    if let Some(path) = &args.json {
        let json = serde_json::to_string_pretty(&grade)? + "\n";
        write_atomically(path, json.as_bytes()).with_context(|| path.display().to_string())?;
    }
    if let Some(path) = &args.html {
        let program = args.theirs.display().to_string();
        let command = format!(
            "photolathe grade {} {program} --tolerance {:?}",
            args.rays.display(),
            args.tolerance
        );
        let page = html(&program, &grade, &command)?;
        write_atomically(path, page.as_bytes()).with_context(|| path.display().to_string())?;
    }
    write!(std::io::stdout(), "{}", table(&grade))?;
    Ok(ExitCode::from(u8::from(grade.failures > 0)))
}

fn table(grade: &Grade) -> String {
    let row = |one: &FamilyGrade| {
        let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), ascii_number);
        let counts = [
            one.rays,
            one.true_hits,
            one.right,
            one.miss,
            one.phantom,
            one.wrong,
            one.ambiguous,
        ];
        let (error, ulps) = (one.t_error, one.ulps);
        let spreads = [
            error.median,
            error.p99,
            error.max,
            ulps.median,
            ulps.p99,
            ulps.max,
        ];
        let name = std::iter::once(one.family.clone());
        name.chain(counts.map(|count| count.to_string()))
            .chain(spreads.map(shown))
            .collect()
    };
    let rows: Vec<Vec<String>> = grade.families.iter().map(row).collect();
    let header = [
        "family",
        "rays",
        "hits",
        "right",
        "miss",
        "phantom",
        "wrong",
        "ambiguous",
        "error p50",
        "p99",
        "max",
        "ulps p50",
        "p99",
        "max",
    ];
    let summary = format!(
        "{} failures in {} rays, {} ambiguous, at tolerance {}\n",
        grade.failures,
        grade.rays,
        grade.ambiguous,
        ascii_number(grade.tolerance)
    );
    aligned(&header, &rows) + &summary
}
