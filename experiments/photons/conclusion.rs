//! What the table of `photons` says: claims and plots.

use super::{ALPHA, EXPERIMENT, RADIUS};
use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{Conclusion, Effort, Table};
use crate::lab::plot::{Axis, Plot, Series};
use crate::numeric::statistics::{Moments, fit_line};
use serde::Deserialize;

/// A row of the table.
#[derive(Deserialize)]
struct Row {
    scene: String,
    rule: String,
    alpha: f64,
    photons: f64,
    passes: f64,
    radius: f64,
    replicates: f64,
    truth: f64,
    mean: f64,
    predicted: f64,
    variance: f64,
    predicted_variance: f64,
    rmse: f64,
    cpu_s: f64,
}

pub(super) fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let rows: Vec<Row> = table.read();
    let of = |scene: &str, rule: &str| -> Vec<&Row> {
        let same = |row: &&Row| row.scene == scene && row.rule == rule;
        rows.iter().filter(same).collect()
    };
    let nothing_biased = [
        (
            "constant_mean",
            "nadir",
            "constant",
            "With a constant radius the mean reading over the kernel's exact mean is 1",
        ),
        (
            "global_mean",
            "nadir",
            "global",
            "Under the global rule the mean reading over the kernel's mean along the radii is 1",
        ),
        (
            "local_residual",
            "nadir",
            "local",
            "Under the local rule no pass is biased against its kernel at the radius it had: the mean reading over the mean so predicted is 1",
        ),
        (
            "sphere_mean",
            "sphere",
            "constant",
            "In the integrating sphere the mean reading over the truth is 1 at any radius",
        ),
    ];
    let mut claims: Vec<Claim> = nothing_biased
        .map(|(name, scene, rule, statement)| {
            let subject = EXPERIMENT.subject(name, statement, Effort::Smoke, effort);
            Claim::null(subject, pooled_mean(&of(scene, rule)), 1.0, 0.05)
        })
        .to_vec();
    let as_scattered = [
        (
            "binomial_variance",
            ["constant", "global", "local"].as_slice(),
            "nadir",
            "The variance over that of the binomial count is 1",
        ),
        (
            "sphere_variance",
            ["constant"].as_slice(),
            "sphere",
            "In the sphere, where hits share paths, the variance over that with var M / mean M = 1 + q(2ρ − 1)/(1 − ρ) is 1",
        ),
    ];
    claims.extend(as_scattered.map(|(name, rules, scene, statement)| {
        let rows: Vec<&Row> = rules.iter().flat_map(|rule| of(scene, rule)).collect();
        let subject = EXPERIMENT.subject(name, statement, Effort::Standard, effort);
        Claim::null(subject, pooled_variance(&rows), 1.0, 0.25)
    }));
    let photon_sweep: Vec<&Row> = of("nadir", "constant")
        .into_iter()
        .filter(|row| row.radius == RADIUS)
        .collect();
    let pass_sweep: Vec<&Row> = of("nadir", "global")
        .into_iter()
        .filter(|row| row.alpha == ALPHA)
        .collect();
    let laws = [
        (
            "slope_photons",
            &photon_sweep,
            (|row: &Row| row.photons) as fn(&Row) -> f64,
            "Log-log slope of the variance against photons per pass",
        ),
        (
            "slope_passes",
            &pass_sweep,
            |row: &Row| row.passes,
            "Log-log slope of the variance against passes under the global rule, α = 2/3, at the finite numbers of passes",
        ),
    ];
    for (name, sweep, x, statement) in laws {
        let (estimate, predicted) = slopes(sweep, x);
        let subject = EXPERIMENT.subject(name, statement, Effort::Standard, effort);
        claims.push(Claim::law(subject, estimate, predicted, 0.05));
    }
    let local = of("nadir", "local");
    let local: Vec<&Row> = local.into_iter().filter(|r| r.alpha == ALPHA).collect();
    Conclusion {
        claims,
        plots: vec![
            error_plot(&photon_sweep, &pass_sweep, &local),
            bias_plot(&pass_sweep, &photon_sweep),
            cost_plot(&photon_sweep, &pass_sweep, &local),
        ],
        ..Conclusion::default()
    }
}

/// Mean reading over its prediction, pooled by inverse variance; the variance is the predicted one.
fn pooled_mean(rows: &[&Row]) -> Estimate {
    let (mut weights, mut sum, mut n) = (0.0, 0.0, 0.0);
    for row in rows {
        let weight = row.predicted * row.predicted * row.replicates / row.predicted_variance;
        weights += weight;
        sum += weight * row.mean / row.predicted;
        n += row.replicates;
    }
    Estimate::known(sum / weights, weights.sqrt().recip(), n as u64)
}

/// Sample variance over its prediction, pooled. A reading is a sum of many photons and so nearly normal: Var(s²)/σ⁴ = 2/(R − 1).
fn pooled_variance(rows: &[&Row]) -> Estimate {
    let (mut freedom, mut sum, mut n) = (0.0, 0.0, 0.0);
    for row in rows {
        freedom += row.replicates - 1.0;
        sum += (row.replicates - 1.0) * row.variance / row.predicted_variance;
        n += row.replicates;
    }
    Estimate::known(sum / freedom, (2.0 / freedom).sqrt(), n as u64)
}

/// Log-log slope of the variance against `x`, measured and by the closed form at the same places. The levels are independent
/// runs; the scatter of ln s² is √(2/(R − 1)).
fn slopes(rows: &[&Row], x: fn(&Row) -> f64) -> (Estimate, f64) {
    let slope = |y: fn(&Row) -> f64| {
        let points: Vec<_> = rows
            .iter()
            .map(|row| (libm::log(x(row)), libm::log(y(row)), 1.0))
            .collect();
        fit_line(&points).map_or(f64::NAN, |fit| fit.slope)
    };
    let at = Moments::of(rows.iter().map(|row| libm::log(x(row))));
    let spread = at.variance() * (rows.len() as f64 - 1.0);
    let replicates = rows.first().map_or(f64::NAN, |row| row.replicates);
    let error = (2.0 / (replicates - 1.0) / spread).sqrt();
    let n = rows.iter().map(|row| row.replicates as u64).sum();
    let estimate = Estimate::known(slope(|row| row.variance), error, n);
    (estimate, slope(|row| row.predicted_variance))
}

const GLOBAL: &str = "global, α = 2/3";
const GLOBAL_PREDICTED: &str = "global, predicted";
const CONSTANT_PREDICTED: &str = "constant, predicted";

fn series(name: &str, rows: &[&Row], at: fn(&Row) -> (f64, f64)) -> Series {
    Series::measured(name, rows.iter().map(|row| at(row)))
}

fn error_plot(constant: &[&Row], global: &[&Row], local: &[&Row]) -> Plot {
    let measured = |row: &Row| (row.photons * row.passes, row.rmse / row.truth);
    let predicted = |name, rows: &[&Row]| {
        let error = |row: &Row| {
            let bias = row.predicted - row.truth;
            (bias * bias + row.predicted_variance).sqrt()
        };
        let at = |row: &&Row| (row.photons * row.passes, error(row) / row.truth);
        Series::predicted(name, rows.iter().map(at))
    };
    Plot::new(
        "Error falls with photons, with a constant radius only down to its bias",
        Axis::log("photons in all"),
        Axis::log("relative RMSE"),
        [
            series("constant radius", constant, measured),
            predicted(CONSTANT_PREDICTED, constant),
            series(GLOBAL, global, measured),
            predicted(GLOBAL_PREDICTED, global),
            series("local, α = 2/3", local, measured),
        ],
    )
}

fn bias_plot(global: &[&Row], constant: &[&Row]) -> Plot {
    let relative = |row: &Row, value: f64| 1.0 - value / row.truth;
    // Of the constant rule, one level: its bias is the same at all passes.
    let level = constant
        .last()
        .map_or(f64::NAN, |row| relative(row, row.predicted));
    let interval = |row: &&Row| {
        let half = 1.96 * (row.predicted_variance / row.replicates).sqrt();
        [half, -half]
            .map(|half| relative(row, row.mean + half))
            .into()
    };
    let along = |value: fn(&Row) -> f64| {
        let passes = global.iter();
        passes.map(move |row| (row.passes, relative(row, value(row))))
    };
    Plot::new(
        "The bias falls with the radius, as the closed form says",
        Axis::log("passes"),
        Axis::log("relative bias, downward"),
        [
            Series::measured(GLOBAL, along(|row| row.mean))
                .with_intervals(global.iter().map(interval)),
            Series::predicted(GLOBAL_PREDICTED, along(|row| row.predicted)),
            Series::predicted(
                CONSTANT_PREDICTED,
                global.iter().map(|row| (row.passes, level)),
            ),
        ],
    )
}

/// Of one replicate. The bars are 95 % for a nearly normal reading, whose RMSE over R replicates is known to 1/√(2R).
fn cost_plot(constant: &[&Row], global: &[&Row], local: &[&Row]) -> Plot {
    let at = |row: &Row| (row.cpu_s / row.replicates, row.rmse / row.truth);
    let bar = |row: &&Row| {
        let half = 1.96 / (2.0 * row.replicates).sqrt();
        [1.0 - half, 1.0 + half]
            .map(|factor| factor * row.rmse / row.truth)
            .into()
    };
    let method = |name, rows: &[&Row], label: fn(&Row) -> f64| {
        series(name, rows, at)
            .with_intervals(rows.iter().map(bar))
            .with_labels(rows.iter().map(|row| label(row)))
    };
    Plot::speed_error(
        "What an answer costs (labels: photons a pass of the constant radius, passes of the others)",
        "CPU time of a replicate (s)",
        "relative RMSE",
        [
            method("constant radius, 32 passes", constant, |row| row.photons),
            method("global, 512 photons a pass", global, |row| row.passes),
            method("local, 512 photons a pass", local, |row| row.passes),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::super::{execute, plan};
    use super::*;
    use crate::lab::claim::Verdict;
    use crate::lab::experiment::{Run, Value};

    fn table(effort: Effort, keep: impl Fn(&Run) -> bool) -> Table {
        let mut rows = Vec::new();
        for (index, run) in plan(effort).iter().enumerate().filter(|(_, run)| keep(run)) {
            rows.extend(execute(run, effort, index as u64).expect("a run").rows);
        }
        EXPERIMENT.table(rows)
    }

    fn verdicts(table: &Table) -> Vec<(String, Verdict)> {
        conclude(table, Effort::Standard)
            .claims
            .into_iter()
            .map(|claim| (claim.claim, claim.verdict))
            .collect()
    }

    #[test]
    fn a_wrong_kernel_a_wrong_count_and_reseeded_passes_fail_their_claims() {
        let small = table(Effort::Smoke, |run| {
            run.integer("passes") <= 32 && run.integer("photons") <= 512
        });
        assert!(
            small
                .rows
                .iter()
                .all(|row| row.len() == small.columns.len())
        );
        for (name, verdict) in verdicts(&small) {
            assert_ne!(verdict, Verdict::Fail, "{name}");
        }
        let scaled = |column: &str, factor: f64| {
            let mut wrong = small.clone();
            let column = wrong.column(column);
            for row in &mut wrong.rows {
                row[column] = Value::Number(factor * row[column].number().expect("a number"));
            }
            verdicts(&wrong)
                .into_iter()
                .filter(|(_, v)| *v == Verdict::Fail)
                .count()
        };
        // A mean off by 20 % (four claims), and the variance of 32 passes that repeat the same photons.
        assert_eq!(scaled("mean", 1.2), 4);
        assert!(scaled("variance", 32.0) >= 1);
    }
}
