//! What the table of `caustic` says: claims and plots.

use super::prediction::Exact;
use super::{BEFORE, BEHIND, EXPERIMENT, PIXELS, SWEEP_PHOTONS, SWEEP_RADIUS, ball, row_length};
use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{Conclusion, Effort, Table};
use crate::lab::plot::{Axis, Plot, Series};
use crate::numeric::statistics::Moments;
use serde::Deserialize;

/// A row of the table.
#[derive(Deserialize)]
struct Row {
    plane: f64,
    rule: String,
    radius: f64,
    passes: f64,
    pixel: usize,
    distance: f64,
    truth: f64,
    predicted: f64,
    predicted_variance: f64,
    measured: f64,
}

/// No pixel's mean may be this many predicted standard errors from its prediction. Pixels count tens of photons and more, so their
/// tails are nearly normal: one false alarm in more than 10⁹.
const MOST_ERRORS: f64 = 7.0;

/// What the replicates of an effort can prove of the light of the row.
fn margin(effort: Effort) -> f64 {
    effort.of([0.08, 0.01, 0.01])
}

/// The rows of each replicate of a run.
type Replicates<'a> = Vec<&'a [Row]>;

pub(super) fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let rows: Vec<Row> = table.read();
    let pictures: Vec<&[Row]> = rows.chunks(PIXELS as usize).collect();
    let of = |same: &dyn Fn(&Row) -> bool| -> Replicates {
        let pictures = pictures.iter().copied();
        pictures.filter(|picture| same(&picture[0])).collect()
    };
    let profile = |plane: f64| of(&|row| row.plane == plane && row.radius != SWEEP_RADIUS);
    let sweep = |rule: &str| of(&|row| row.rule == rule && row.radius == SWEEP_RADIUS);
    let (behind, before) = (profile(BEHIND), profile(BEFORE));
    let subject = |name, statement| EXPERIMENT.subject(name, statement, Effort::Smoke, effort);
    let mut claims = Vec::new();
    for (name, pictures, statement) in [
        (
            "light_behind",
            &behind,
            "Behind the focus the light of the row is the predicted light, within 8 % (smoke) and 1 %",
        ),
        (
            "light_before",
            &before,
            "Before the focus, with the fold and the crossing of the axis, the light of the row is the predicted light, within 8 % (smoke) and 1 %",
        ),
    ] {
        let shares = light_over_predicted(pictures);
        let estimate = Estimate::of(&shares);
        claims.push(Claim::equivalent(
            subject(name, statement),
            estimate,
            1.0,
            margin(effort),
        ));
    }
    for (name, pictures, statement) in [
        (
            "profile_behind",
            &behind,
            "Behind the focus no pixel of the profile is more than 7 standard errors from its prediction",
        ),
        (
            "profile_before",
            &before,
            "Before the focus, across the fold, no pixel of the profile is more than 7 standard errors from its prediction",
        ),
    ] {
        let pixels = by_pixel(pictures).into_iter();
        let failures = pixels.filter(|pixel| pixel.errors() > MOST_ERRORS).count() as u64;
        claims.push(Claim::exact(
            subject(name, statement),
            failures,
            u64::from(PIXELS),
        ));
    }
    for (rule, statement) in [
        (
            "constant",
            "With a constant radius the squared error against the truth over the predicted one, bias² + variance, is 1",
        ),
        (
            "global",
            "Under the global rule the squared error against the truth over the predicted one, bias² + variance, is 1",
        ),
    ] {
        let name = format!("error_{rule}");
        let subject = EXPERIMENT.subject(&name, statement, Effort::Standard, effort);
        let ratios = Moments::of(sweep(rule).iter().map(|picture| {
            let (measured, predicted) = square_errors(picture);
            measured / predicted
        }));
        claims.push(Claim::null(subject, Estimate::of(&ratios), 1.0, 0.1));
    }
    Conclusion {
        claims,
        plots: vec![
            profile_plot(
                "Behind the focus: the profile, measured and predicted",
                &behind,
                BEHIND,
            ),
            profile_plot(
                "Before the focus: the light ends at the fold, 0.121 from the axis",
                &before,
                BEFORE,
            ),
            error_plot(&sweep("constant"), &sweep("global")),
        ],
        ..Conclusion::default()
    }
}

/// Of every replicate, the light of the whole row over the predicted.
fn light_over_predicted(pictures: &[&[Row]]) -> Moments {
    let sum = |picture: &[Row], of: fn(&Row) -> f64| picture.iter().map(of).sum::<f64>();
    let ratio =
        |picture: &&[Row]| sum(picture, |row| row.measured) / sum(picture, |row| row.predicted);
    Moments::of(pictures.iter().map(ratio))
}

/// A pixel over all replicates.
struct Pixel {
    distance: f64,
    measured: f64,
    predicted: f64,
    /// Predicted standard error of the mean.
    standard_error: f64,
}

impl Pixel {
    fn errors(&self) -> f64 {
        (self.measured - self.predicted).abs() / self.standard_error
    }
}

fn by_pixel(pictures: &[&[Row]]) -> Vec<Pixel> {
    let n = pictures.len() as f64;
    let mean = |pixel: usize, of: fn(&Row) -> f64| {
        let rows = pictures.iter().map(|picture| &picture[pixel]);
        rows.inspect(|row| debug_assert_eq!(row.pixel, pixel))
            .map(of)
            .sum::<f64>()
            / n
    };
    let pixel = |pixel| Pixel {
        distance: mean(pixel, |row| row.distance),
        measured: mean(pixel, |row| row.measured),
        predicted: mean(pixel, |row| row.predicted),
        standard_error: (mean(pixel, |row| row.predicted_variance) / n).sqrt(),
    };
    (0..PIXELS as usize).map(pixel).collect()
}

/// Squared error of a picture against the truth, and what is predicted of it, summed over the pixels.
fn square_errors(picture: &[Row]) -> (f64, f64) {
    let square = |x: f64| x * x;
    picture
        .iter()
        .fold((0.0, 0.0), |(measured, predicted), row| {
            (
                measured + square(row.measured - row.truth),
                predicted + square(row.predicted - row.truth) + row.predicted_variance,
            )
        })
}

fn profile_plot(title: &str, pictures: &[&[Row]], plane: f64) -> Plot {
    let pixels = by_pixel(pictures);
    let interval = |pixel: &Pixel| {
        let half = 1.96 * pixel.standard_error;
        (pixel.measured - half, pixel.measured + half)
    };
    let exact = Exact::new(&ball(plane));
    let most = pixels
        .iter()
        .map(|pixel| pixel.predicted)
        .fold(0.0, f64::max);
    let along = (1..400).map(|i| row_length(plane) * f64::from(i) / 400.0);
    // Near a fold and the axis E is infinite: what is far above all pixels is left out.
    let truth = along
        .map(|at| (at, exact.irradiance(at)))
        .filter(|at| at.1 < 1.5 * most);
    Plot::new(
        title,
        Axis::linear("distance from the axis (radii of the ball)"),
        Axis::linear("irradiance over that of the beam"),
        [
            Series::scattered(
                "measured",
                pixels.iter().map(|pixel| (pixel.distance, pixel.measured)),
            )
            .with_intervals(pixels.iter().map(interval)),
            Series::predicted(
                "predicted, over the disc",
                pixels.iter().map(|pixel| (pixel.distance, pixel.predicted)),
            ),
            Series::predicted("predicted, exact", truth),
        ],
    )
}

fn error_plot(constant: &[&[Row]], global: &[&[Row]]) -> Plot {
    let series = |name: &str, pictures: &[&[Row]]| {
        let mut levels: Vec<f64> = pictures.iter().map(|picture| picture[0].passes).collect();
        levels.dedup();
        let at = |&passes: &f64| {
            let same = pictures
                .iter()
                .filter(|picture| picture[0].passes == passes);
            let (mut measured, mut predicted, mut light) = (0.0, 0.0, 0.0);
            for picture in same {
                let errors = square_errors(picture);
                measured += errors.0;
                predicted += errors.1;
                light += picture.iter().map(|row| row.truth * row.truth).sum::<f64>();
            }
            let photons = passes * f64::from(SWEEP_PHOTONS);
            let relative = |square: f64| (photons, (square / light).sqrt());
            (relative(measured), relative(predicted))
        };
        let (measured, predicted): (Vec<_>, Vec<_>) = levels.iter().map(at).unzip();
        [
            Series::measured(name, measured),
            Series::predicted(format!("{name}, predicted"), predicted),
        ]
    };
    Plot::new(
        "Error of the profile against photons: a constant radius ends at its bias",
        Axis::log("photons"),
        Axis::log("relative error of the row (root mean square)"),
        [
            series("constant radius", constant),
            series("global, α = 2/3", global),
        ]
        .concat(),
    )
}

#[cfg(test)]
mod tests {
    use super::super::{execute, plan};
    use super::*;
    use crate::lab::claim::Verdict;
    use crate::lab::experiment::Value;

    fn failed(table: &Table) -> Vec<String> {
        let claims = conclude(table, Effort::Standard).claims.into_iter();
        let failed = claims.filter(|claim| claim.verdict == Verdict::Fail);
        failed.map(|claim| claim.claim).collect()
    }

    #[test]
    fn a_dark_pixel_wrong_light_and_wrong_noise_fail_their_claims() {
        let mut rows = Vec::new();
        for (index, run) in plan(Effort::Smoke).iter().enumerate() {
            rows.extend(
                execute(run, Effort::Smoke, index as u64)
                    .expect("a run")
                    .rows,
            );
        }
        let right = EXPERIMENT.table(rows);
        assert!(failed(&right).is_empty());
        let column = right.column("measured");
        let changed = |change: &dyn Fn(usize, f64) -> f64| {
            let mut table = right.clone();
            for (index, row) in table.rows.iter_mut().enumerate() {
                let value = row[column].number().expect("a number");
                row[column] = Value::Number(change(index % PIXELS as usize, value));
            }
            failed(&table)
        };
        let dark = changed(&|pixel, value| if pixel == 3 { 0.5 * value } else { value });
        assert!(
            ["profile_behind", "profile_before"]
                .iter()
                .all(|&name| dark.iter().any(|x| x == name))
        );
        let bright = changed(&|_, value| 1.5 * value);
        assert!(
            ["light_behind", "error_constant"]
                .iter()
                .all(|&name| bright.iter().any(|x| x == name))
        );
    }
}
