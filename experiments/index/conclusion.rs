//! Claims and plots.

use super::{EQUAL, EXPERIMENT, OVER_POINTS};
use crate::lab::claim::Claim;
use crate::lab::experiment::{Conclusion, Effort, Table};
use crate::lab::plot::{Axis, Plot, Series};
use serde::Deserialize;

#[derive(Clone, Debug, Deserialize)]
struct Row {
    index: String,
    over: String,
    points: f64,
    radii: String,
    results: f64,
    ns_per_result: f64,
    build_ms: f64,
    visits: f64,
}

/// The fast one.
const WIDE: &str = "wide";
const LIBRARY: &str = "kiddo";
/// Best times of rounds in turns agree within this factor from run to run.
const TIMING: f64 = 1.25;
/// How many times as fast as the library's better way the fast index is at least, at a million points, all included.
const RATIO: f64 = 5.0;
/// Growth of the cost of a result over two decades of points: slope in log-log at most. Twice the cost is .15; caches that end
/// in between add to the tree's own.
const GROWTH: f64 = 0.3;

pub(super) fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let rows: Vec<Row> = table.read();
    let subject = |claim, statement, least| EXPERIMENT.subject(claim, statement, least, effort);
    let (missing, expected) = disagreements(&rows);
    let ratio = ["equal", "log"]
        .map(|radii| ratio(&rows, radii))
        .map(libm::log10);
    let ratio = least(ratio);
    let slack = libm::log10(TIMING);
    let growth = growth(&rows, |row| row.ns_per_result);
    let visits = growth_of_visits(&rows);
    let claims = vec![
        Claim::exact(
            subject(
                "the same results",
                "At every hit point each index counts the photons that the exact predicate gives.",
                Effort::Smoke,
            ),
            missing,
            expected,
        ),
        Claim::in_range(
            subject(
                "the trees grow slowly",
                "From 10⁴ points on, nodes visited by a photon grow with a power of the points below .5 in every tree (a scan has 1).",
                Effort::Smoke,
            ),
            visits,
            (visits, visits),
            1,
            (-0.5, 0.5),
        ),
        Claim::in_range(
            subject(
                "faster than a library",
                "At a million points a result costs at most a fifth of what it costs by kiddo's better way, sorting included (log10 of the ratio).",
                Effort::Standard,
            ),
            ratio,
            (ratio - slack, ratio + slack),
            1,
            (libm::log10(RATIO), 3.0),
        ),
        Claim::in_range(
            subject(
                "a result costs little more among more points",
                "From 10⁴ to 10⁶ points the time of a result grows with a power below .3.",
                Effort::Standard,
            ),
            growth,
            (growth - 0.5 * slack, growth + 0.5 * slack),
            1,
            (-0.2, GROWTH),
        ),
    ];
    let mut plots: Vec<Plot> = [("equal", "equal radii"), ("log", "radii over a factor 30")]
        .into_iter()
        .map(|(radii, words)| costs(&rows, radii, words))
        .collect();
    plots.push(builds(&rows));
    Conclusion {
        claims,
        plots,
        ..Conclusion::default()
    }
}

/// Results at hit points where an index of ours differs, and how many there should be.
fn disagreements(rows: &[Row]) -> (u64, u64) {
    let references = rows.iter().filter(|row| row.index == "linear");
    references.fold((0, 0), |(missing, expected), reference| {
        let same = |row: &&Row| row.points == reference.points && row.radii == reference.radii;
        let ours = rows.iter().filter(same).filter(|row| row.index != LIBRARY);
        ours.fold((missing, expected), |(missing, expected), row| {
            let off = (row.results - reference.results).abs();
            (missing + off as u64, expected + reference.results as u64)
        })
    })
}

/// The lesser, or NaN if either is: comparisons must not keep it from the claim.
fn least([a, b]: [f64; 2]) -> f64 {
    if a < b || a.is_nan() { a } else { b }
}

/// Time of a result by the library's better way over that of the fast index, at the most points.
fn ratio(rows: &[Row], radii: &str) -> f64 {
    let most = rows.iter().map(|row| row.points).fold(0.0, f64::max);
    let best = |index: &str| {
        let times = rows
            .iter()
            .filter(|row| row.index == index && row.points == most && row.radii == radii);
        let of = |row: &Row| row.ns_per_result;
        let over_points = index != WIDE;
        times
            .filter(|row| over_points || row.over == OVER_POINTS)
            .map(of)
            .reduce(|a, b| least([a, b]))
            .unwrap_or(f64::NAN)
    };
    best(LIBRARY) / best(WIDE)
}

/// Slope of a quantity of the fast index between the fewest and the most points, in log-log, equal radii.
fn growth(rows: &[Row], quantity: fn(&Row) -> f64) -> f64 {
    slope(rows, WIDE, quantity)
}

/// The steepest slope of the visits of a tree.
fn growth_of_visits(rows: &[Row]) -> f64 {
    ["kdtree", "kdtree-cycling", WIDE]
        .map(|index| slope(rows, index, |row| row.visits))
        .into_iter()
        .reduce(|a, b| -least([-a, -b]))
        .unwrap_or(f64::NAN)
}

fn slope(rows: &[Row], index: &str, quantity: fn(&Row) -> f64) -> f64 {
    let mine = rows
        .iter()
        .filter(|row| row.index == index && row.over == OVER_POINTS && row.radii == EQUAL);
    let points: Vec<(f64, f64)> = mine.map(|row| (row.points, quantity(row))).collect();
    match points[..] {
        [first, .., last] => libm::log10(last.1 / first.1) / libm::log10(last.0 / first.0),
        _ => f64::NAN,
    }
}

/// Series of a quantity against the points, an index each.
fn series(rows: &[Row], radii: &str, quantity: fn(&Row) -> f64) -> Vec<Series> {
    let mut names: Vec<(&str, &str)> = Vec::new();
    for row in rows {
        if !names.contains(&(&row.index, &row.over)) {
            names.push((&row.index, &row.over));
        }
    }
    let one = |(index, over): (&str, &str)| {
        let mine = rows
            .iter()
            .filter(|row| row.index == index && row.over == over && row.radii == radii);
        let points = mine.map(|row| (row.points, quantity(row)));
        Series::measured(format!("{index} over {over}"), points)
    };
    names.into_iter().map(one).collect()
}

fn costs(rows: &[Row], radii: &str, words: &str) -> Plot {
    Plot::new(
        &format!("What a result costs, sorting included: {words}"),
        Axis::log("hit points"),
        Axis::log("CPU time (ns)"),
        series(rows, radii, |row| row.ns_per_result),
    )
}

fn builds(rows: &[Row]) -> Plot {
    Plot::new(
        "What a build costs (grid and wide-photons have none: they begin with a join)",
        Axis::log("hit points"),
        Axis::log("CPU time (ms)"),
        series(rows, EQUAL, |row| row.build_ms),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::experiment::values;

    /// Two sizes; every claim's numbers can be set.
    fn table(wide_results: u64, wide_visits: f64, wide_ns: f64, small_ns: f64) -> Table {
        let mut rows = Vec::new();
        for (points, growth) in [(10_000, 1.0), (1_000_000, 2.0)] {
            for radii in ["equal", "log"] {
                let mut add = |index: &str, over: &str, results: u64, ns: f64, visits: f64| {
                    let mut row = values([index, over]);
                    row.extend(values([points]));
                    row.extend(values([radii]));
                    row.extend(values([1000, results]));
                    row.extend(values([ns, 1.0, 40.0, visits]));
                    rows.push(row);
                };
                add("linear", OVER_POINTS, 20_000, 1e5, 1e4);
                add("kdtree-cycling", OVER_POINTS, 20_000, 20.0, 30.0 * growth);
                add("kdtree", OVER_POINTS, 20_000, 20.0, 30.0 * growth);
                let large = points > 10_000;
                let (results, ns) = if large {
                    (wide_results, wide_ns)
                } else {
                    (20_000, small_ns)
                };
                let visits = if large { wide_visits } else { 1.0 };
                add(WIDE, OVER_POINTS, results, ns, visits);
                // The library's own rounding is not our claim.
                add(LIBRARY, OVER_POINTS, 19_999, 40.0, f64::NAN);
                add(LIBRARY, "photons", 20_000, 30.0, f64::NAN);
            }
        }
        EXPERIMENT.table(rows)
    }

    #[test]
    fn each_claim_can_fail() {
        let failing = |table: &Table| -> Vec<usize> {
            let claims = conclude(table, Effort::Standard).claims;
            let failing = claims.iter().enumerate();
            let failing = failing.filter(|(_, claim)| claim.fails_the_run());
            failing.map(|(place, _)| place).collect()
        };
        assert!(failing(&table(20_000, 2.0, 4.0, 3.0)).is_empty());
        assert_eq!(failing(&table(19_999, 2.0, 4.0, 3.0)), [0]);
        assert_eq!(failing(&table(20_000, 100.0, 4.0, 3.0)), [1]);
        assert_eq!(failing(&table(20_000, 2.0, 8.0, 6.0)), [2]);
        assert_eq!(failing(&table(20_000, 2.0, 4.0, 0.5)), [3]);
        assert_eq!(failing(&table(20_000, 2.0, f64::NAN, 3.0)), [2, 3]);
        assert_eq!(failing(&table(20_000, f64::NAN, 4.0, 3.0)), [1]);
    }
}
