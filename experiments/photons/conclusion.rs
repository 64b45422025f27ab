//! What the table of `photons` says: claims and plots.

use super::{ALPHA, EXPERIMENT, RADIUS};
use crate::lab::claim::{Claim, Estimate, Subject};
use crate::lab::experiment::{Conclusion, Effort};
use crate::lab::plot::{Axis, Plot, Scale, Series};
use crate::lab::table::{Table, Value};
use crate::numeric::statistics::{Moments, fit_line};

/// A row of the table, by name.
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
}

fn rows(table: &Table) -> Vec<Row> {
    let number = |row: &[Value], name| row[table.column(name)].number().unwrap_or(f64::NAN);
    table
        .rows
        .iter()
        .map(|row| Row {
            scene: row[table.column("scene")].to_cell(),
            rule: row[table.column("rule")].to_cell(),
            alpha: number(row, "alpha"),
            photons: number(row, "photons"),
            passes: number(row, "passes"),
            radius: number(row, "radius"),
            replicates: number(row, "replicates"),
            truth: number(row, "truth"),
            mean: number(row, "mean"),
            predicted: number(row, "predicted"),
            variance: number(row, "variance"),
            predicted_variance: number(row, "predicted_variance"),
            rmse: number(row, "rmse"),
        })
        .collect()
}

pub(super) fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let rows = rows(table);
    let of = |scene: &str, rule: &str| -> Vec<&Row> {
        rows.iter()
            .filter(|row| row.scene == scene && row.rule == rule)
            .collect()
    };
    let subject = |claim, statement, decided_at| Subject {
        experiment: EXPERIMENT.name,
        claim,
        statement,
        decided_at,
        effort,
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
            let estimate = pooled_mean(&of(scene, rule));
            Claim::null(subject(name, statement, Effort::Smoke), estimate, 1.0, 0.05)
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
        Claim::null(
            subject(name, statement, Effort::Standard),
            pooled_variance(&rows),
            1.0,
            0.25,
        )
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
        claims.push(Claim::law(
            subject(name, statement, Effort::Standard),
            estimate,
            predicted,
            0.05,
        ));
    }
    Conclusion {
        claims,
        plots: vec![
            error_plot(&photon_sweep, &pass_sweep, &of("nadir", "local")),
            bias_plot(&pass_sweep, &photon_sweep),
        ],
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
    Estimate {
        value: sum / weights,
        standard_error: weights.sqrt().recip(),
        freedom: f64::INFINITY,
        n: n as u64,
    }
}

/// Sample variance over its prediction, pooled. A reading is a sum of many photons and so nearly normal: Var(s²)/σ⁴ = 2/(R − 1).
fn pooled_variance(rows: &[&Row]) -> Estimate {
    let (mut freedom, mut sum, mut n) = (0.0, 0.0, 0.0);
    for row in rows {
        freedom += row.replicates - 1.0;
        sum += (row.replicates - 1.0) * row.variance / row.predicted_variance;
        n += row.replicates;
    }
    Estimate {
        value: sum / freedom,
        standard_error: (2.0 / freedom).sqrt(),
        freedom: f64::INFINITY,
        n: n as u64,
    }
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
    let estimate = Estimate {
        value: slope(|row| row.variance),
        standard_error: (2.0 / (replicates - 1.0) / spread).sqrt(),
        freedom: f64::INFINITY,
        n: rows.iter().map(|row| row.replicates as u64).sum(),
    };
    (estimate, slope(|row| row.predicted_variance))
}

fn log_axis(label: &str) -> Axis {
    Axis {
        label: label.into(),
        scale: Scale::Log,
    }
}

fn error_plot(constant: &[&Row], global: &[&Row], local: &[&Row]) -> Plot {
    let measured = |name: &str, rows: &[&Row]| Series {
        name: name.into(),
        points: rows
            .iter()
            .map(|row| (row.photons * row.passes, row.rmse / row.truth))
            .collect(),
        intervals: Vec::new(),
        predicted: false,
    };
    let predicted = |name: &str, rows: &[&Row]| Series {
        name: name.into(),
        points: rows
            .iter()
            .map(|row| {
                let bias = row.predicted - row.truth;
                let error = (bias * bias + row.predicted_variance).sqrt();
                (row.photons * row.passes, error / row.truth)
            })
            .collect(),
        intervals: Vec::new(),
        predicted: true,
    };
    let local: Vec<&Row> = local
        .iter()
        .copied()
        .filter(|row| row.alpha == ALPHA)
        .collect();
    Plot {
        title: "Error falls with photons, with a constant radius only down to its bias".into(),
        x: log_axis("photons in all"),
        y: log_axis("relative RMSE"),
        series: vec![
            measured("constant radius", constant),
            predicted("constant, predicted", constant),
            measured("global, α = 2/3", global),
            predicted("global, predicted", global),
            measured("local, α = 2/3", &local),
        ],
    }
}

fn bias_plot(global: &[&Row], constant: &[&Row]) -> Plot {
    let relative = |row: &Row, value: f64| 1.0 - value / row.truth;
    // Of the constant rule, one level: its bias is the same at all passes.
    let level = constant
        .last()
        .map_or(f64::NAN, |row| relative(row, row.predicted));
    Plot {
        title: "The bias falls with the radius, as the closed form says".into(),
        x: log_axis("passes"),
        y: log_axis("relative bias, downward"),
        series: vec![
            Series {
                name: "global, α = 2/3".into(),
                points: global
                    .iter()
                    .map(|row| (row.passes, relative(row, row.mean)))
                    .collect(),
                intervals: global
                    .iter()
                    .map(|row| {
                        let half = 1.96 * (row.predicted_variance / row.replicates).sqrt();
                        (
                            relative(row, row.mean + half),
                            relative(row, row.mean - half),
                        )
                    })
                    .collect(),
                predicted: false,
            },
            Series {
                name: "global, predicted".into(),
                points: global
                    .iter()
                    .map(|row| (row.passes, relative(row, row.predicted)))
                    .collect(),
                intervals: Vec::new(),
                predicted: true,
            },
            Series {
                name: "constant, predicted".into(),
                points: global.iter().map(|row| (row.passes, level)).collect(),
                intervals: Vec::new(),
                predicted: true,
            },
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::super::{execute, plan};
    use super::*;
    use crate::lab::claim::Verdict;
    use crate::lab::experiment::Run;

    fn table(effort: Effort, keep: impl Fn(&Run) -> bool) -> Table {
        let mut rows = Vec::new();
        for (index, run) in plan(effort).iter().enumerate().filter(|(_, run)| keep(run)) {
            rows.extend(execute(run, effort, index as u64).expect("a run").rows);
        }
        Table {
            columns: EXPERIMENT.columns.iter().map(ToString::to_string).collect(),
            rows,
        }
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
