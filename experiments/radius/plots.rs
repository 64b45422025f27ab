//! Plots of `radius`.

use super::conclusion::{Row, constant, of_budget};
use super::{ALPHAS, BUDGET};
use crate::lab::plot::{Axis, Plot, Series};

/// Measured values with 95 % intervals and their closed forms against passes; `value` gives both and the standard error.
pub(super) fn passes_plot(
    title: &str,
    label: &str,
    curves: &[(f64, Vec<&Row>)],
    value: fn(&Row) -> [f64; 3],
) -> Plot {
    let mut series = Vec::new();
    for (alpha, rows) in curves {
        let along = |column: usize| rows.iter().map(move |row| (row.passes, value(row)[column]));
        let interval = |row: &&Row| {
            let [measured, _, error] = value(row);
            (measured - 1.96 * error, measured + 1.96 * error)
        };
        series.push(
            Series::measured(format!("α = {alpha:.3}"), along(0))
                .with_intervals(rows.iter().map(interval)),
        );
        series.push(Series::predicted(
            format!("α = {alpha:.3}, closed form"),
            along(1),
        ));
    }
    Plot::new(title, Axis::log("passes"), Axis::log(label), series)
}

pub(super) fn rules_plot<'a>(
    rows: &'a [Row],
    levels: &impl Fn(&str, &str, f64) -> Vec<&'a Row>,
) -> Plot {
    let two_thirds = ALPHAS[1];
    let geometric = |rule: &str| -> Vec<&Row> {
        rows.iter()
            .filter(|row| row.rule == rule && row.by == "law")
            .collect()
    };
    let mut series = Vec::new();
    for (name, rows) in [
        ("pppm, disc", levels("pppm", "disc", two_thirds)),
        ("sppm, disc", levels("sppm", "disc", two_thirds)),
        (
            "pppm, fourth-order, α = .8",
            levels("pppm", "fourth-order", 0.8),
        ),
        ("constant radius", levels("pppm", "disc", 1.0)),
        ("geometric", geometric("geometric")),
        ("geometric as coded", geometric("geometric-as-coded")),
    ] {
        series.push(Series::measured(
            name,
            rows.iter().map(|row| (row.passes, row.mse.sqrt())),
        ));
        if !name.starts_with("sppm") {
            let predicted = rows
                .iter()
                .map(|row| (row.passes, row.predicted_mse.sqrt()));
            series.push(Series::predicted(format!("{name}, closed form"), predicted));
        }
    }
    Plot::new(
        "Rules and kernels from the same first radius, α = 2/3 where not said",
        Axis::log("passes"),
        Axis::log("relative RMSE"),
        series,
    )
}

pub(super) fn kernel_plot(rows: &[Row]) -> Plot {
    let mut series = Vec::new();
    for kernel in ["disc", "epanechnikov", "fourth-order"] {
        let rows = constant(rows, kernel);
        let interval = |row: &&Row| {
            (
                -row.bias - 1.96 * row.bias_error,
                -row.bias + 1.96 * row.bias_error,
            )
        };
        series.push(
            Series::measured(kernel, rows.iter().map(|row| (row.r1, -row.bias)))
                .with_intervals(rows.iter().map(interval)),
        );
        let predicted = rows.iter().map(|row| (row.r1, -row.predicted_bias));
        series.push(Series::predicted(
            format!("{kernel}, closed form"),
            predicted,
        ));
    }
    Plot::new(
        "The bias of the fourth-order kernel falls with r⁴",
        Axis::log("radius over the height of the lamp"),
        Axis::log("relative bias, downward"),
        series,
    )
}

pub(super) fn budget_plot(rows: &[Row], kernel: &str) -> Plot {
    let rows = of_budget(rows, kernel);
    let mut series = Vec::new();
    for alpha in ALPHAS {
        let of_alpha = || rows.iter().filter(move |row| row.alpha == alpha);
        series.push(Series::measured(
            format!("α = {alpha:.3}"),
            of_alpha().map(|row| (row.r1, row.mse.sqrt())),
        ));
        let predicted = of_alpha().map(|row| (row.r1, row.predicted_mse.sqrt()));
        series.push(Series::predicted(
            format!("α = {alpha:.3}, closed form"),
            predicted,
        ));
    }
    Plot::new(
        &format!("{BUDGET} passes, {kernel}: the first radius matters more than α"),
        Axis::log("first radius over the height of the lamp"),
        Axis::log("relative RMSE"),
        series,
    )
}
