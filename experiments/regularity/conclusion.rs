//! What the table of `regularity` says: claims and plots.

use super::{ALPHAS, EDGES, EXPERIMENT, FIRST_RADII, LONG_RUN, PASSES, best_alpha};
use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{Conclusion, Effort, Table};
use crate::lab::plot::{Axis, Plot, Series};
use crate::numeric::statistics::fit_line;
use serde::Deserialize;

/// A row of the table.
#[derive(Deserialize)]
struct Row {
    receivers: String,
    edge: String,
    width: f64,
    alpha: f64,
    r1: f64,
    passes: f64,
    s: f64,
    replicates: f64,
    bias2: f64,
    bias2_error: f64,
    predicted_bias2: f64,
    variance: f64,
    variance_error: f64,
    predicted_variance: f64,
    mse: f64,
    predicted_mse: f64,
}

impl Row {
    fn is_still(&self, receivers: &str, edge: &str) -> bool {
        self.passes == 1.0 && self.receivers == receivers && self.edge == edge
    }

    fn is_measured(&self) -> bool {
        self.replicates > 0.0
    }
}

pub(super) fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let rows: Vec<Row> = table.read();
    let mut claims = pooled_claims(&rows, effort);
    for (edge, precision) in [("step", 0.1), ("corner", 0.1), ("root", 0.2), ("kink", 0.4)] {
        claims.push(exponent(&rows, "points", edge, effort, precision));
    }
    for (receivers, edge) in [
        ("aligned", "step"),
        ("slanted", "step"),
        ("aligned", "corner"),
        ("slanted", "corner"),
    ] {
        claims.push(exponent(&rows, receivers, edge, effort, 0.5));
    }
    let best: Vec<(f64, f64)> = EDGES
        .iter()
        .map(|(edge, kind)| (kind.exponent(), crossing(&rows, edge)))
        .collect();
    for ((edge, _), &(s, found)) in EDGES.iter().zip(&best) {
        claims.push(best_claim(edge, s, found, effort));
    }
    claims.push(logarithm(&rows, effort));
    let mut plots = vec![points_plot(&rows)];
    plots.extend(["step", "kink", "corner"].map(|edge| collapse_plot(&rows, edge)));
    plots.extend(["step", "root", "kink"].map(|edge| budget_plot(&rows, edge)));
    plots.push(best_plot(&best));
    Conclusion {
        claims,
        plots,
        ..Conclusion::default()
    }
}

/// The coefficient c of measured = c × predicted, by weights 1/error².
fn coefficient<'a>(
    rows: impl Iterator<Item = &'a Row>,
    value: impl Fn(&Row) -> (f64, f64, f64),
) -> Estimate {
    let (mut weights, mut sum, mut n) = (0.0, 0.0, 0.0);
    for row in rows {
        let (measured, predicted, error) = value(row);
        weights += predicted * predicted / (error * error);
        sum += measured * predicted / (error * error);
        n += row.replicates;
    }
    Estimate::known(sum / weights, weights.sqrt().recip(), n as u64)
}

fn pooled_claims(rows: &[Row], effort: Effort) -> Vec<Claim> {
    let measured = || rows.iter().filter(|row| row.is_measured());
    let points = || measured().filter(|row| row.receivers == "points");
    let bias2 = |row: &Row| (row.bias2, row.predicted_bias2, row.bias2_error);
    let about = |name, statement, at| EXPERIMENT.subject(name, statement, at, effort);
    let standard = Effort::Standard;
    vec![
        Claim::law(
            about(
                "squared bias at points",
                "over all edges, radii, α and passes photons give the squared bias of the quadrature (ratio to it)",
                Effort::Smoke,
            ),
            coefficient(points(), bias2),
            1.0,
            0.05,
        ),
        Claim::law(
            about(
                "squared bias of pixels",
                "the same for means over pixels, aligned and slanted",
                standard,
            ),
            coefficient(measured().filter(|row| row.receivers != "points"), bias2),
            1.0,
            0.05,
        ),
        Claim::law(
            about(
                "variance",
                "over all edges, α, first radii and passes the variance at points is that of the quadrature (ratio to it)",
                standard,
            ),
            coefficient(points(), |row| {
                (row.variance, row.predicted_variance, row.variance_error)
            }),
            1.0,
            0.02,
        ),
    ]
}

/// What the squared bias goes as in the limit of small radii.
fn limit(receivers: &str, edge: &str, s: f64) -> f64 {
    match (receivers, edge) {
        ("points", _) => 2.0 * s + 1.0,
        (_, "corner") => 2.0,
        ("aligned", "step") => 3.0,
        _ => 4.0,
    }
}

/// The slope of the squared bias against the radius of single passes: for pixels, of radii up to half their width.
fn exponent(rows: &[Row], receivers: &str, edge: &str, effort: Effort, precision: f64) -> Claim {
    let small = |row: &&Row| receivers == "points" || row.r1 <= 0.5 * row.width;
    let still = rows
        .iter()
        .filter(|row| row.is_still(receivers, edge) && row.is_measured());
    let still: Vec<&Row> = still.filter(small).collect();
    // A logarithm of a noisy square would be biased: first order about the quadrature's values. Widths of pixels are scaled away.
    let points = |value: fn(&Row) -> f64| -> Vec<(f64, f64, f64)> {
        let of = |row: &&Row| {
            let relative = row.bias2_error / row.predicted_bias2;
            let log = libm::log(row.predicted_bias2) + value(row) / row.predicted_bias2 - 1.0;
            let width = if receivers == "points" {
                1.0
            } else {
                row.width
            };
            let (x, y) = (
                libm::log(row.r1 / width),
                log - (2.0 * row.s + 1.0) * libm::log(width),
            );
            (x, y, 1.0 / (relative * relative))
        };
        still.iter().map(of).collect()
    };
    let slope = |value| fit_line(&points(value)).map_or(f64::NAN, |fit| fit.slope);
    let weighted = points(|row| row.bias2);
    let total: f64 = weighted.iter().map(|point| point.2).sum();
    let middle = weighted.iter().map(|point| point.2 * point.0).sum::<f64>() / total;
    let spread: f64 = weighted
        .iter()
        .map(|point| point.2 * (point.0 - middle) * (point.0 - middle))
        .sum();
    let n = still.iter().map(|row| row.replicates as u64).sum();
    let estimate = Estimate::known(slope(|row| row.bias2), spread.sqrt().recip(), n);
    let s = still.first().map_or(f64::NAN, |row| row.s);
    let k = limit(receivers, edge, s);
    Claim::law(
        EXPERIMENT.subject(
            &format!("{edge}, {receivers}"),
            &format!("squared bias grows with the radius with the slope of the quadrature at these radii (for small ones {k})"),
            Effort::Standard,
            effort,
        ),
        estimate,
        slope(|row| row.predicted_bias2),
        precision,
    )
}

/// The α at which, in the long run, squared bias and variance fall alike by the quadrature: between slopes at three α.
fn crossing(rows: &[Row], edge: &str) -> f64 {
    let long = |passes: u64| -> Vec<&Row> {
        let found = rows
            .iter()
            .filter(|row| row.receivers == "points" && row.edge == edge);
        found.filter(|row| row.passes == passes as f64).collect()
    };
    let excess: Vec<(f64, f64)> = (long(LONG_RUN[0]).iter().zip(long(LONG_RUN[1])))
        .map(|(early, late)| {
            let bias2 = libm::log(late.predicted_bias2 / early.predicted_bias2);
            let variance = libm::log(late.predicted_variance / early.predicted_variance);
            (early.alpha, bias2 - variance)
        })
        .collect();
    let crossed = excess
        .windows(2)
        .find(|pair| pair[0].1 < 0.0 && pair[1].1 >= 0.0);
    crossed.map_or(f64::NAN, |pair| {
        let (a, b) = (pair[0], pair[1]);
        a.0 - a.1 * (b.0 - a.0) / (b.1 - a.1)
    })
}

fn best_claim(edge: &str, s: f64, found: f64, effort: Effort) -> Claim {
    let best = best_alpha(s);
    // At 3/2 the law ends: with its logarithm the bias falls more slowly, and α* comes to 2/3 as slowly from below.
    let (range, more) = if s > 1.0 {
        (
            (best - 0.03, best - 0.003),
            ": below it, by the logarithm of r⁴ log(1/r)",
        )
    } else {
        ((best - 0.01, best + 0.01), "")
    };
    let statement = format!(
        "from {} to {} passes squared bias and variance fall alike, by quadrature, at α* = (2s+1)/(2s+3) = {best:.3}{more}",
        LONG_RUN[0], LONG_RUN[1]
    );
    Claim::in_range(
        EXPERIMENT.subject(
            &format!("best α, {edge}"),
            &statement,
            Effort::Smoke,
            effort,
        ),
        found,
        (found, found),
        6,
        range,
    )
}

/// At s = 3/2 the bias far from the edge is (r²/8) E″ = (3/32) r² x^(−1/2), whose square integrates to (9/1024) r⁴ ln x.
fn logarithm(rows: &[Row], effort: Effort) -> Claim {
    let still = rows
        .iter()
        .filter(|row| row.is_still("points", "three halves") && row.r1 < 0.25);
    let points: Vec<_> = still
        .map(|row| {
            (
                -libm::log(row.r1),
                row.predicted_bias2 / (row.r1 * row.r1 * row.r1 * row.r1),
                1.0,
            )
        })
        .collect();
    let slope = fit_line(&points).map_or(f64::NAN, |fit| fit.slope) * 1024.0 / 9.0;
    Claim::in_range(
        EXPERIMENT.subject(
            "logarithm at s = 3/2",
            "squared bias over r⁴ grows by 9/1024 with ln(1/r), by quadrature (ratio to that): r^(2s+1) is refuted there by a logarithm",
            Effort::Smoke,
            effort,
        ),
        slope,
        (slope, slope),
        points.len() as u64,
        (0.98, 1.02),
    )
}

fn bars(row: &&Row, scale: f64) -> (f64, f64) {
    (
        scale * (row.bias2 - 1.96 * row.bias2_error),
        scale * (row.bias2 + 1.96 * row.bias2_error),
    )
}

fn points_plot(rows: &[Row]) -> Plot {
    let mut series = Vec::new();
    for (edge, _) in EDGES {
        let still: Vec<&Row> = rows
            .iter()
            .filter(|row| row.is_still("points", edge))
            .collect();
        // Only what is clear of its noise has a place on a logarithmic axis.
        let clear = || still.iter().filter(|row| row.bias2 > 3.0 * row.bias2_error);
        series.push(
            Series::scattered(edge, clear().map(|row| (row.r1, row.bias2)))
                .with_intervals(clear().map(|row| bars(row, 1.0))),
        );
        let predicted = still.iter().map(|row| (row.r1, row.predicted_bias2));
        series.push(Series::predicted(format!("{edge}, quadrature"), predicted));
    }
    Plot::new(
        "At points the squared bias goes as r^(2s+1)",
        Axis::log("radius"),
        Axis::log("squared bias, integrated across the edge"),
        series,
    )
}

/// With both over the width of the pixel, all widths fall on one curve.
fn collapse_plot(rows: &[Row], edge: &str) -> Plot {
    let mut series = Vec::new();
    for receivers in ["aligned", "slanted"] {
        let mut still: Vec<&Row> = rows
            .iter()
            .filter(|row| row.is_still(receivers, edge))
            .collect();
        still.sort_by(|a, b| (a.r1 / a.width).total_cmp(&(b.r1 / b.width)));
        let scale = |row: &Row| libm::pow(row.r1, -2.0 * row.s - 1.0);
        let clear = || still.iter().filter(|row| row.bias2 > 3.0 * row.bias2_error);
        series.push(
            Series::scattered(
                receivers,
                clear().map(|row| (row.r1 / row.width, row.bias2 * scale(row))),
            )
            .with_intervals(clear().map(|row| bars(row, scale(row)))),
        );
        let predicted = still
            .iter()
            .map(|row| (row.r1 / row.width, row.predicted_bias2 * scale(row)));
        series.push(Series::predicted(
            format!("{receivers}, quadrature"),
            predicted,
        ));
    }
    let points = rows.iter().find(|row| row.is_still("points", edge));
    let level = points.map_or(f64::NAN, |row| {
        row.predicted_bias2 * libm::pow(row.r1, -2.0 * row.s - 1.0)
    });
    series.push(Series::predicted("points", [(0.03, level), (2.0, level)]));
    Plot::new(
        &format!(
            "{edge}: pixel means leave the law of points where the radius falls below the pixel (two widths, one curve)"
        ),
        Axis::log("radius over width of the pixel"),
        Axis::log("squared bias over r^(2s+1)"),
        series,
    )
}

fn budget_plot(rows: &[Row], edge: &str) -> Plot {
    let mut series = Vec::new();
    for passes in PASSES {
        for first in FIRST_RADII {
            let found = rows.iter().filter(|row| {
                row.receivers == "points" && row.edge == edge && row.passes == passes as f64
            });
            let found: Vec<&Row> = found
                .filter(|row| row.r1 == first && ALPHAS.contains(&row.alpha))
                .collect();
            let name = format!("{passes} passes, r₁ = {first}");
            series.push(Series::measured(
                name.clone(),
                found.iter().map(|row| (row.alpha, row.mse)),
            ));
            let predicted = found.iter().map(|row| (row.alpha, row.predicted_mse));
            series.push(Series::predicted(format!("{name}, quadrature"), predicted));
        }
    }
    Plot::new(
        &format!(
            "{edge}: mean squared error at finite budgets, where the first radius moves the best α"
        ),
        Axis::linear("α"),
        Axis::log("mean squared error about the edge"),
        series,
    )
}

fn best_plot(best: &[(f64, f64)]) -> Plot {
    let law = (0..=30)
        .map(|i| 0.05 * f64::from(i))
        .map(|s| (s, best_alpha(s)));
    Plot::new(
        "The α at which squared bias and variance fall alike in the long run",
        Axis::linear("s of E = x₊^s"),
        Axis::linear("α*"),
        [
            Series::scattered("by quadrature", best.iter().copied())
                .with_labels(EDGES.iter().map(|edge| edge.0)),
            Series::predicted("(2s+1)/(2s+3)", law),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::super::{execute, plan};
    use super::*;
    use crate::lab::claim::Verdict;
    use crate::lab::experiment::{Run, Value};

    /// At smoke effort nothing fails; a squared bias that is wrong by a factor, or goes as another power, does.
    #[test]
    fn a_wrong_square_or_power_of_the_bias_fails_its_claim() {
        let keep = |run: &&Run| run.integer("passes") != 256;
        let mut rows = Vec::new();
        for (index, run) in plan(Effort::Smoke).iter().filter(keep).enumerate() {
            rows.extend(
                execute(run, Effort::Smoke, index as u64)
                    .expect("a run")
                    .rows,
            );
        }
        let right = EXPERIMENT.table(rows);
        assert!(
            right
                .rows
                .iter()
                .all(|row| row.len() == right.columns.len())
        );
        let failed = |table: &Table| -> Vec<String> {
            let claims = conclude(table, Effort::Standard).claims.into_iter();
            claims
                .filter(|claim| claim.verdict == Verdict::Fail)
                .map(|claim| claim.claim)
                .collect()
        };
        assert_eq!(failed(&right), Vec::<String>::new());
        let changed = |column: &str, change: fn(f64, f64) -> f64| {
            let mut wrong = right.clone();
            let (column, radius) = (wrong.column(column), wrong.column("r1"));
            for row in &mut wrong.rows {
                let radius = row[radius].number().expect("a radius");
                row[column] =
                    Value::Number(change(row[column].number().expect("a number"), radius));
            }
            failed(&wrong)
        };
        assert!(changed("bias2", |x, _| 1.1 * x).contains(&"squared bias at points".to_owned()));
        assert!(changed("variance", |x, _| 1.2 * x).contains(&"variance".to_owned()));
        let steeper = changed("bias2", |x, r| x * libm::pow(r / 0.1, 0.1));
        assert!(steeper.contains(&"step, points".to_owned()));
    }
}
