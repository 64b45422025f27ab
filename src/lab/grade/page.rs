//! The page of a grade.

use super::dots::{Dots, svg};
use super::{Example, FamilyGrade, Grade, Spread};
use crate::lab::page::{fill, number};
use serde::Serialize;

#[derive(Serialize)]
struct View<'a> {
    program: &'a str,
    summary: String,
    suite: &'a str,
    tolerance: String,
    command: &'a str,
    failures: String,
    errors: String,
    families: Vec<Row>,
    examples: Vec<[String; 5]>,
}

#[derive(Serialize)]
struct Row {
    class: &'static str,
    family: String,
    counts: [u64; 7],
    spreads: [String; 6],
}

/// The page of a program's grade, self-contained. `command` is what made it.
pub fn html(program: &str, grade: &Grade, command: &str) -> anyhow::Result<String> {
    let families = &grade.families;
    let names: Vec<String> = families.iter().map(|one| one.family.clone()).collect();
    let share = |name, of: fn(&FamilyGrade) -> u64| Dots {
        name,
        values: families
            .iter()
            .map(|one| Some(of(one) as f64 / one.rays as f64))
            .collect(),
    };
    let shares = [
        share("miss", |one| one.miss),
        share("phantom", |one| one.phantom),
        share("wrong", |one| one.wrong),
    ];
    let ulps = |name, of: fn(&Spread) -> Option<f64>| Dots {
        name,
        values: families.iter().map(|one| of(&one.ulps)).collect(),
    };
    let errors = [
        ulps("maximum", |spread| spread.max),
        ulps("99 %", |spread| spread.p99),
        ulps("median", |spread| spread.median),
    ];
    let view = View {
        program,
        summary: summary(grade),
        suite: &grade.suite,
        tolerance: number(grade.tolerance),
        command,
        failures: svg(
            "Failures by family",
            "share of the family's rays",
            &names,
            &shares,
        ),
        errors: svg(
            "Errors by family",
            "error of t, in roundings of the coordinates",
            &names,
            &errors,
        ),
        families: families.iter().map(row).collect(),
        examples: families.iter().flat_map(examples).collect(),
    };
    Ok(fill(include_str!("../templates/grade.html"), view)?)
}

/// One sentence: failures and ambiguous answers in all.
fn summary(grade: &Grade) -> String {
    format!(
        "{} failures in {} rays ({} misses, {} phantoms, {} wrong hits), {} ambiguous.",
        grade.failures,
        grade.rays,
        grade.families.iter().map(|one| one.miss).sum::<u64>(),
        grade.families.iter().map(|one| one.phantom).sum::<u64>(),
        grade.families.iter().map(|one| one.wrong).sum::<u64>(),
        grade.ambiguous,
    )
}

fn row(one: &FamilyGrade) -> Row {
    let shown = |value: Option<f64>| value.map_or_else(String::new, number);
    let spread = |s: &Spread| [s.median, s.p99, s.max].map(shown);
    let ([a, b, c], [d, e, f]) = (spread(&one.t_error), spread(&one.ulps));
    Row {
        class: if one.failures() > 0 { "fail" } else { "pass" },
        family: one.family.clone(),
        counts: [
            one.rays,
            one.true_hits,
            one.right,
            one.miss,
            one.phantom,
            one.wrong,
            one.ambiguous,
        ],
        spreads: [a, b, c, d, e, f],
    }
}

fn examples(one: &FamilyGrade) -> impl Iterator<Item = [String; 5]> {
    let told = |t: Option<f64>| t.map_or_else(|| "none".to_owned(), |t| format!("{t:?}"));
    let cells = move |example: &Example| {
        [
            example.ray.to_string(),
            one.family.clone(),
            format!("{:?}", example.verdict).to_lowercase(),
            told(example.true_t),
            told(example.t),
        ]
    };
    one.examples.iter().map(cells)
}
