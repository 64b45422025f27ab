//! What the table of `radius` says: claims and plots.

use super::plots::{budget_plot, kernel_plot, passes_plot, rules_plot};
use super::{ALPHAS, BUDGET, EXPERIMENT, FIRST, LEVELS};
use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{Conclusion, Effort, Table};
use crate::numeric::statistics::fit_line;
use serde::Deserialize;

/// A row of the table.
#[derive(Deserialize)]
pub(super) struct Row {
    pub(super) rule: String,
    pub(super) kernel: String,
    pub(super) alpha: f64,
    pub(super) r1: f64,
    pub(super) passes: f64,
    pub(super) variance: f64,
    pub(super) bias: f64,
    pub(super) mse: f64,
    pub(super) r2: f64,
    pub(super) by: String,
    pub(super) replicates: f64,
    pub(super) variance_error: f64,
    pub(super) bias_error: f64,
    pub(super) predicted_variance: f64,
    pub(super) predicted_bias: f64,
    pub(super) predicted_mse: f64,
    pub(super) predicted_r2: f64,
    pub(super) residual: f64,
}

impl Row {
    fn is(&self, rule: &str, kernel: &str, alpha: f64) -> bool {
        self.rule == rule && self.kernel == kernel && self.alpha == alpha
    }

    /// One of the levels of passes from the first radius on.
    fn is_level(&self) -> bool {
        self.by == "law" && self.r1 == FIRST && LEVELS.iter().any(|&n| n as f64 == self.passes)
    }
}

pub(super) fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let rows: Vec<Row> = table.read();
    let levels = |rule: &str, kernel: &str, alpha: f64| -> Vec<&Row> {
        let found = rows.iter().filter(|row| row.is_level());
        found.filter(|row| row.is(rule, kernel, alpha)).collect()
    };
    let mut claims = pooled_claims(&rows, effort);
    for &alpha in &ALPHAS[..4] {
        claims.extend(slope_claims(alpha, &levels("pppm", "disc", alpha), effort));
    }
    claims.push(order_of_bias(&rows, effort));
    claims.extend(geometric_claims(&rows, effort));
    claims.push(optimum(&rows, effort));
    let global: Vec<(f64, Vec<&Row>)> = (ALPHAS.iter())
        .map(|&alpha| (alpha, levels("pppm", "disc", alpha)))
        .collect();
    Conclusion {
        claims,
        plots: vec![
            passes_plot(
                "The variance of pppm falls as its closed form",
                "relative variance",
                &global,
                |row| [row.variance, row.predicted_variance, row.variance_error],
            ),
            passes_plot(
                "The bias of pppm falls as its closed form, later than in the limit",
                "relative bias, downward",
                &global,
                |row| [-row.bias, -row.predicted_bias, row.bias_error],
            ),
            rules_plot(&rows, &levels),
            kernel_plot(&rows),
            budget_plot(&rows, "disc"),
            budget_plot(&rows, "fourth-order"),
        ],
        ..Conclusion::default()
    }
}

/// The coefficient c of measured = c × predicted, by weights 1/error².
fn coefficient(points: impl Iterator<Item = (f64, f64, f64, f64)>) -> Estimate {
    let (mut weights, mut sum, mut n) = (0.0, 0.0, 0.0);
    for (measured, predicted, error, replicates) in points {
        weights += predicted * predicted / (error * error);
        sum += measured * predicted / (error * error);
        n += replicates;
    }
    Estimate::known(sum / weights, weights.sqrt().recip(), n as u64)
}

fn pooled_claims(rows: &[Row], effort: Effort) -> Vec<Claim> {
    let drawn = || rows.iter().filter(|row| row.by == "law");
    // By the geometric rules few photons carry the variance, which is then far from normal.
    let even = || drawn().filter(|row| row.rule == "pppm" || row.rule == "constant");
    let error = |row: &Row| (row.predicted_variance / row.replicates).sqrt();
    let ideal = drawn().filter(|row| row.rule != "sppm");
    let (off, n) = ideal.fold((0, 0), |(off, n), row| {
        // A thousand roundings, and those of Γ: 1e-13 each.
        let near = (row.r2 / row.predicted_r2 - 1.0).abs() < 1e-9;
        (off + u64::from(!near), n + 1)
    });
    let variance = coefficient(even().map(|row| {
        let error = row.predicted_variance * (2.0 / (row.replicates - 1.0)).sqrt();
        (row.variance, row.predicted_variance, error, row.replicates)
    }));
    let bias =
        coefficient(even().map(|row| (row.bias, row.predicted_bias, error(row), row.replicates)));
    let residual = |rule: &str, by: &str| {
        coefficient(
            rows.iter()
                .filter(|row| (rule.is_empty() || row.rule == rule) && row.by == by)
                .map(|row| {
                    let reading = 1.0 + row.predicted_bias;
                    (row.residual, reading, error(row), row.replicates)
                }),
        )
    };
    let about = |name, statement, at| EXPERIMENT.subject(name, statement, at, effort);
    let smoke = Effort::Smoke;
    vec![
        Claim::exact(
            about(
                "radii",
                "r² of the last pass is that of the closed form, to 10⁻⁹, under every rule that does not look at photons",
                smoke,
            ),
            off,
            n,
        ),
        Claim::law(
            about(
                "variance",
                "over all α, kernels and first radii, the variance is its closed form (ratio to it)",
                smoke,
            ),
            variance,
            1.0,
            0.03,
        ),
        Claim::law(
            about(
                "bias",
                "over all α, kernels and first radii, the bias is its closed form (ratio to it)",
                smoke,
            ),
            bias,
            1.0,
            0.02,
        ),
        Claim::null(
            about(
                "martingale",
                "under the local rule each pass reads in the mean what its realised radius says (relative excess)",
                smoke,
            ),
            residual("sppm", "law"),
            0.0,
            0.02,
        ),
        Claim::null(
            about(
                "renders",
                "renders that trace every photon read what the law of the photons says (relative excess)",
                smoke,
            ),
            residual("", "render"),
            0.0,
            0.2,
        ),
    ]
}

/// A measured value and its prediction.
type Value = fn(&Row) -> (f64, f64);

/// Slope of ln |value| against ln passes over independent levels whose relative errors are known, and that of the closed form
/// at the same places with the same weights.
fn slopes(
    rows: &[&Row],
    x: fn(&Row) -> f64,
    value: Value,
    error: fn(&Row) -> f64,
) -> (Estimate, f64) {
    let slope = |pick: fn((f64, f64)) -> f64| {
        let points: Vec<_> = rows
            .iter()
            .map(|row| {
                let relative = error(row) / value(row).1.abs();
                (
                    libm::log(x(row)),
                    libm::log(pick(value(row)).abs()),
                    1.0 / (relative * relative),
                )
            })
            .collect();
        let total: f64 = points.iter().map(|point| point.2).sum();
        let middle = points.iter().map(|point| point.2 * point.0).sum::<f64>() / total;
        let spread: f64 = points
            .iter()
            .map(|point| point.2 * (point.0 - middle) * (point.0 - middle))
            .sum();
        (
            fit_line(&points).map_or(f64::NAN, |fit| fit.slope),
            spread.sqrt().recip(),
        )
    };
    let (measured, error) = slope(|pair| pair.0);
    let n = rows.iter().map(|row| row.replicates as u64).sum();
    (Estimate::known(measured, error, n), slope(|pair| pair.1).0)
}

fn slope_claims(alpha: f64, rows: &[&Row], effort: Effort) -> [Claim; 2] {
    let passes = |row: &Row| row.passes;
    let (variance, predicted_variance) = slopes(
        rows,
        passes,
        |row| (row.variance, row.predicted_variance),
        |row| row.predicted_variance * (2.0 / (row.replicates - 1.0)).sqrt(),
    );
    let (bias, predicted_bias) = slopes(
        rows,
        passes,
        |row| (row.bias, row.predicted_bias),
        |row| (row.predicted_variance / row.replicates).sqrt(),
    );
    let limit = |exponent: f64| {
        format!("with the slope of its closed form at these passes (in the limit {exponent:.3})")
    };
    let name = |what: &str| format!("{what} slope, α = {alpha:.3}");
    [
        Claim::law(
            EXPERIMENT.subject(
                &name("variance"),
                &format!("the variance of pppm falls with passes {}", limit(-alpha)),
                Effort::Smoke,
                effort,
            ),
            variance,
            predicted_variance,
            0.05,
        ),
        Claim::law(
            EXPERIMENT.subject(
                &name("bias"),
                &format!("the bias of pppm falls with passes {}", limit(alpha - 1.0)),
                Effort::Standard,
                effort,
            ),
            bias,
            predicted_bias,
            0.03,
        ),
    ]
}

/// The rows of the constant rule with a kernel.
pub(super) fn constant<'a>(rows: &'a [Row], kernel: &str) -> Vec<&'a Row> {
    let found = rows
        .iter()
        .filter(|row| row.rule == "constant" && row.by == "law");
    found.filter(|row| row.kernel == kernel).collect()
}

fn order_of_bias(rows: &[Row], effort: Effort) -> Claim {
    let (slope, predicted) = slopes(
        &constant(rows, "fourth-order"),
        |row| row.r1,
        |row| (row.bias, row.predicted_bias),
        |row| (row.predicted_variance / row.replicates).sqrt(),
    );
    Claim::law(
        EXPERIMENT.subject(
            "order of the fourth-order kernel",
            "its bias grows with the radius with the slope of its closed form at these radii (4 for small ones; 2 for the others)",
            Effort::Standard,
            effort,
        ),
        slope,
        predicted,
        0.2,
    )
}

fn geometric_claims(rows: &[Row], effort: Effort) -> Vec<Claim> {
    let of = |rule: &str, passes: f64| {
        let mut found = rows
            .iter()
            .filter(|row| row.rule == rule && row.by == "law");
        found.find(|row| row.passes == passes)
    };
    let mut claims = Vec::new();
    if let (Some(low), Some(high)) = (of("geometric", 16.0), of("geometric", 64.0)) {
        let ratio = high.variance / low.variance;
        let closed = high.predicted_variance / low.predicted_variance;
        let error = 1.96
            * ratio
            * libm::hypot(
                high.variance_error / high.variance,
                low.variance_error / low.variance,
            );
        claims.push(Claim::in_range(
            EXPERIMENT.subject(
                "geometric rises",
                "by the geometric rule the variance grows again: that at 64 passes over that at 16 is within a factor of 2 of the closed form, 10.8",
                Effort::Smoke,
                effort,
            ),
            ratio,
            (ratio - error, ratio + error),
            high.replicates as u64,
            (0.5 * closed, 2.0 * closed),
        ));
    }
    let coded = rows
        .iter()
        .filter(|row| row.rule == "geometric-as-coded" && row.by == "law");
    let dimmed = coefficient(coded.map(|row| {
        let error = (row.predicted_variance / row.replicates).sqrt();
        (
            1.0 + row.bias,
            1.0 + row.predicted_bias,
            error,
            row.replicates,
        )
    }));
    claims.push(Claim::law(
        EXPERIMENT.subject(
            "as coded the picture dims",
            "with the original's gain the picture reads the mean of .95ⁱ of what it should: .30 after 64 passes (ratio to that)",
            Effort::Smoke,
            effort,
        ),
        dimmed,
        1.0,
        0.03,
    ));
    claims
}

/// The rows of the search for the best first radius and α.
pub(super) fn of_budget<'a>(rows: &'a [Row], kernel: &str) -> Vec<&'a Row> {
    let found = rows
        .iter()
        .filter(|row| row.rule == "pppm" && row.kernel == kernel);
    found
        .filter(|row| row.passes == BUDGET as f64 && row.by == "law")
        .collect()
}

/// Of the first radius and α that were measured to be best: what they should cost, over the least that any should.
fn optimum(rows: &[Row], effort: Effort) -> Claim {
    let candidates: Vec<&Row> = ["disc", "fourth-order"]
        .iter()
        .flat_map(|kernel| of_budget(rows, kernel))
        .collect();
    let best = candidates.iter().min_by(|a, b| a.mse.total_cmp(&b.mse));
    let least = candidates
        .iter()
        .map(|row| row.predicted_mse)
        .fold(f64::INFINITY, f64::min);
    let ratio = best.map_or(f64::NAN, |row| row.predicted_mse / least);
    let found = best.map_or(String::new(), |row| {
        format!("{} with r1 = {}, α = {:.3}", row.kernel, row.r1, row.alpha)
    });
    let statement = format!(
        "the (kernel, first radius, α) measured to be best at {BUDGET} passes ({found}) is so in theory (predicted MSE over the least predicted)"
    );
    Claim::in_range(
        EXPERIMENT.subject("optimum", &statement, Effort::Smoke, effort),
        ratio,
        (ratio, ratio),
        candidates.len() as u64,
        (1.0, 1.25),
    )
}

#[cfg(test)]
mod tests {
    use super::super::{execute, plan};
    use super::*;
    use crate::lab::claim::Verdict;
    use crate::lab::experiment::Value;

    /// At smoke effort nothing fails; and a column that is wrong by a factor fails the claims that are about it.
    #[test]
    fn a_wrong_variance_bias_radius_or_residual_fails_its_claim() {
        let mut rows = Vec::new();
        for (index, run) in plan(Effort::Smoke).iter().enumerate() {
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
        let changed = |column: &str, change: fn(f64) -> f64| {
            let mut wrong = right.clone();
            let column = wrong.column(column);
            for row in &mut wrong.rows {
                row[column] = Value::Number(change(row[column].number().expect("a number")));
            }
            failed(&wrong)
        };
        assert!(changed("variance", |x| 1.1 * x).contains(&"variance".to_owned()));
        assert!(changed("bias", |x| 1.03 * x).contains(&"bias".to_owned()));
        assert_eq!(changed("r2", |x| 1.001 * x), ["radii"]);
        let residual = changed("residual", |x| x + 0.1);
        assert_eq!(residual, ["martingale", "renders"]);
    }
}
