//! Two runs side by side: of two commits, of two machines, of two seeds.

use super::claim::{CLAIM_LEVEL, Claim, SHOWN_CONFIDENCE};
use super::join::{Joined, Side};
use super::page::number;
use super::report::duration;
use super::table::same_row;
use crate::numeric::statistics::student_quantile;
use serde::Serialize;

/// Whether two measurements of a claim agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Agreement {
    /// They differ at the level of a claim.
    #[serde(rename = "different")]
    Different,
    /// One of them is absent or not finite, the predictions differ, or a single observation differs from another.
    #[serde(rename = "not comparable")]
    NotComparable,
    /// They do not differ.
    #[serde(rename = "same")]
    Same,
}

impl Agreement {
    /// The word for tables and pages.
    pub fn word(self) -> &'static str {
        match self {
            Self::Different => "different",
            Self::NotComparable => "not comparable",
            Self::Same => "same",
        }
    }
}

/// One claim in both runs.
#[derive(Clone, Debug, Serialize)]
pub struct Pair {
    /// Experiment.
    pub experiment: String,
    /// Claim.
    pub claim: String,
    /// This run's.
    pub a: Option<Claim>,
    /// The other's.
    pub b: Option<Claim>,
    /// Whether they agree.
    pub agreement: Agreement,
}

/// Compares two measurements. Each 95 % interval is widened to [`CLAIM_LEVEL`] by the quantiles of Student's law with n − 1
/// degrees of freedom; the measurements differ if their distance exceeds the root of the sum of squares of the two half-widths that
/// face each other. The runs are taken as independent: where they share random numbers this errs towards "same".
pub fn agreement(a: &Claim, b: &Claim) -> Agreement {
    let comparable = a.predicted == b.predicted && a.measured.is_finite() && b.measured.is_finite();
    if !comparable {
        return Agreement::NotComparable;
    }
    if a.measured == b.measured {
        return Agreement::Same;
    }
    if a.n < 2 || b.n < 2 {
        return Agreement::NotComparable;
    }
    let (low, high) = if a.measured < b.measured {
        (a, b)
    } else {
        (b, a)
    };
    let reach = [
        widened(low, low.ci_high - low.measured),
        widened(high, high.measured - high.ci_low),
    ];
    if reach.iter().any(|half| half.is_nan()) {
        Agreement::NotComparable
    } else if high.measured - low.measured > libm::hypot(reach[0], reach[1]) {
        Agreement::Different
    } else {
        Agreement::Same
    }
}

fn widened(claim: &Claim, half: f64) -> f64 {
    let freedom = (claim.n as f64 - 1.0).min(1e6);
    let at = |tails: f64| student_quantile(1.0 - 0.5 * tails, freedom);
    half * at(CLAIM_LEVEL) / at(1.0 - SHOWN_CONFIDENCE)
}

/// The table of two runs, for the page.
#[derive(Clone, Debug, Serialize)]
pub struct Versus {
    summary: String,
    sides: [SideView; 2],
    rows: Vec<RowView>,
    experiments: Vec<TimesView>,
}

#[derive(Clone, Debug, Serialize)]
struct SideView {
    directories: String,
    origin: String,
    machines: Vec<super::machine::Machine>,
}

#[derive(Clone, Debug, Serialize)]
struct RowView {
    class: &'static str,
    agreement: &'static str,
    experiment: String,
    claim: String,
    predicted: String,
    a: [String; 3],
    b: [String; 3],
    difference: String,
}

#[derive(Clone, Debug, Serialize)]
struct TimesView {
    name: &'static str,
    tables: String,
    a: String,
    b: String,
}

/// Pairs the claims of two runs, differences first.
pub fn pairs(a: &Side, b: &Side) -> Vec<Pair> {
    let claims = |side: &Side| -> Vec<Claim> {
        let all = side.joined.iter();
        all.flat_map(|joined| joined.finished.conclusion.claims.clone())
            .collect()
    };
    let mut others: Vec<Option<Claim>> = claims(b).into_iter().map(Some).collect();
    let mut pairs: Vec<Pair> = Vec::new();
    for claim in claims(a) {
        let same = |other: &&mut Option<Claim>| {
            other.as_ref().is_some_and(|other| {
                (&other.experiment, &other.claim) == (&claim.experiment, &claim.claim)
            })
        };
        let other = others.iter_mut().find(same).and_then(Option::take);
        pairs.push(Pair {
            experiment: claim.experiment.clone(),
            claim: claim.claim.clone(),
            agreement: other
                .as_ref()
                .map_or(Agreement::NotComparable, |other| agreement(&claim, other)),
            a: Some(claim),
            b: other,
        });
    }
    pairs.extend(others.into_iter().flatten().map(|claim| Pair {
        experiment: claim.experiment.clone(),
        claim: claim.claim.clone(),
        a: None,
        b: Some(claim),
        agreement: Agreement::NotComparable,
    }));
    pairs.sort_by_key(|pair| pair.agreement);
    pairs
}

impl Versus {
    /// The view of two runs whose claims were paired.
    pub fn new(a: &Side, b: &Side, pairs: &[Pair]) -> Self {
        let times = a.joined.iter().filter_map(|ours| {
            let theirs = b
                .joined
                .iter()
                .find(|theirs| theirs.experiment.name == ours.experiment.name)?;
            Some(TimesView {
                name: ours.experiment.name,
                tables: tables(ours, theirs),
                a: duration(ours.finished.seconds),
                b: duration(theirs.finished.seconds),
            })
        });
        Self {
            summary: summary(pairs),
            sides: [a, b].map(SideView::of),
            rows: pairs.iter().map(RowView::of).collect(),
            experiments: times.collect(),
        }
    }
}

/// One sentence: how many claims agree.
pub fn summary(pairs: &[Pair]) -> String {
    let count = |wanted| pairs.iter().filter(|pair| pair.agreement == wanted).count();
    format!(
        "{} claims in two runs: {} different, {} not comparable, {} the same.",
        pairs.len(),
        count(Agreement::Different),
        count(Agreement::NotComparable),
        count(Agreement::Same),
    )
}

fn tables(a: &Joined, b: &Joined) -> String {
    let (rows_a, rows_b) = (&a.finished.table.rows, &b.finished.table.rows);
    if rows_a.len() != rows_b.len() {
        return format!("{} rows against {}", rows_a.len(), rows_b.len());
    }
    let rows = rows_a.iter().zip(rows_b);
    let different = rows.filter(|(x, y)| !same_row(a.experiment.columns, x, y));
    match different.count() {
        0 => "same bytes, times aside".to_owned(),
        count => format!("{count} of {} rows differ", rows_a.len()),
    }
}

impl SideView {
    fn of(side: &Side) -> Self {
        let names: Vec<String> = side
            .directories
            .iter()
            .map(|d| d.display().to_string())
            .collect();
        Self {
            directories: names.join(", "),
            origin: side.origin.to_string(),
            machines: side.machines.clone(),
        }
    }
}

impl RowView {
    fn of(pair: &Pair) -> Self {
        let either = pair.a.as_ref().or(pair.b.as_ref());
        let difference = match (&pair.a, &pair.b) {
            (Some(a), Some(b)) => number(a.measured - b.measured),
            _ => "–".to_owned(),
        };
        Self {
            class: match pair.agreement {
                Agreement::Different => "fail",
                Agreement::NotComparable => "notrun",
                Agreement::Same => "pass",
            },
            agreement: pair.agreement.word(),
            experiment: pair.experiment.clone(),
            claim: pair.claim.clone(),
            predicted: either.map_or_else(String::new, |claim| number(claim.predicted)),
            a: cells(pair.a.as_ref()),
            b: cells(pair.b.as_ref()),
            difference,
        }
    }
}

fn cells(claim: Option<&Claim>) -> [String; 3] {
    let Some(claim) = claim else {
        return ["absent".to_owned(), String::new(), String::new()];
    };
    [
        number(claim.measured),
        format!("{} … {}", number(claim.ci_low), number(claim.ci_high)),
        claim.verdict.word().to_owned(),
    ]
}
