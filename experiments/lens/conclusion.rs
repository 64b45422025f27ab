//! Claims and plots.

use super::optics::{FOCUS, blur, share};
use super::{DEPTHS, EXPERIMENT, Row, SAMPLERS, noise};
use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{Conclusion, Effort};
use crate::lab::plot::{Axis, Plot, Series};
use crate::numeric::statistics::{Moments, fit_line};

/// What the radius of blur and the width of an edge may deviate, as a share: what each effort can prove.
fn margin(effort: Effort) -> f64 {
    effort.of([0.02, 0.005, 0.005])
}

pub(super) fn conclude(rows: &[Row], effort: Effort) -> Conclusion {
    let mut claims = blurs(rows, effort);
    claims.extend(edge(rows, effort));
    claims.extend(focus(rows, effort));
    claims.extend(slopes(rows, effort));
    claims.push(mean(rows, effort));
    Conclusion {
        claims,
        plots: vec![blur_plot(rows), edge_plot(rows), noise_plot(rows, effort)],
        ..Conclusion::default()
    }
}

/// The rows of a part of the experiment and its subject.
fn of<'a>(rows: &'a [Row], part: &str, subject: &str) -> Vec<&'a Row> {
    let same = |row: &&Row| row.part == part && row.subject == subject;
    rows.iter().filter(same).collect()
}

/// Measured over predicted radius at a depth.
fn ratios_at(rows: &[Row], depth: f64) -> Moments {
    let of = of(rows, "blur", "thin lens");
    let at = of.iter().filter(|row| row.depth == depth);
    Moments::of(at.map(|row| row.measured / row.predicted))
}

/// One claim for each side of the plane of focus: about the depth there whose radius is furthest off.
fn blurs(rows: &[Row], effort: Effort) -> Vec<Claim> {
    let claim = |name, statement, side: &dyn Fn(f64) -> bool| {
        let ratios = DEPTHS.into_iter().filter(|&depth| side(depth));
        let ratios = ratios.map(|depth| ratios_at(rows, depth));
        let off = |ratios: &Moments| (ratios.mean() - 1.0).abs();
        let worst = ratios.max_by(|a, b| off(a).total_cmp(&off(b)));
        let subject = EXPERIMENT.subject(name, statement, Effort::Smoke, effort);
        let estimate = Estimate::of(&worst.unwrap_or_default());
        Claim::equivalent(subject, estimate, 1.0, margin(effort))
    };
    vec![
        claim(
            "blur before the focus",
            "At four depths before the plane of focus the radius of blur is a |s − s_f|/s, within 2 % (smoke) and .5 %: that of the \
             four which is furthest off.",
            &|depth| depth < FOCUS,
        ),
        claim(
            "blur behind the focus",
            "At four depths behind it, up to ten times as far, the radius of blur is that too: the one furthest off.",
            &|depth| depth > FOCUS,
        ),
    ]
}

/// The pictures of the edge, one a replicate.
fn pictures<'a>(rows: &[&'a Row]) -> Vec<Vec<&'a Row>> {
    let last = rows.iter().map(|row| row.replicate + 1).max().unwrap_or(0);
    let picture = |replicate| {
        let same = rows.iter().filter(|row| row.replicate == replicate);
        same.copied().collect()
    };
    (0..last).map(picture).collect()
}

/// Mean over the pixels of (k − n p)²/(n p (1 − p)), k of n samples on the edge's side: 1 if the counts are binomial. Pixels in which fewer
/// than five are expected on a side are left out.
fn chi_square(picture: &[&Row]) -> f64 {
    let mut moments = Moments::default();
    for row in picture {
        let (n, p) = (row.samples, row.predicted);
        if n * p.min(1.0 - p) >= 5.0 {
            let off = row.measured - p;
            moments.add(n * off * off / (p * (1.0 - p)));
        }
    }
    moments.mean()
}

/// Σ x (step − profile): proportional to c².
fn first_moment(picture: &[&Row], profile: fn(&Row) -> f64) -> f64 {
    let step = |row: &Row| f64::from(u8::from(row.place > 0.0));
    let terms = picture.iter();
    terms
        .map(|row| row.place * (step(row) - profile(row)))
        .sum()
}

fn edge(rows: &[Row], effort: Effort) -> Vec<Claim> {
    let pictures = pictures(&of(rows, "edge", "thin lens"));
    let subject = |name, statement| EXPERIMENT.subject(name, statement, Effort::Smoke, effort);
    let chi = Moments::of(pictures.iter().map(|picture| chi_square(picture)));
    let width = Moments::of(pictures.iter().map(|picture| {
        let measured = first_moment(picture, |row| row.measured);
        (measured / first_moment(picture, |row| row.predicted)).sqrt()
    }));
    vec![
        Claim::null(
            subject(
                "profile of an edge",
                "The counts of all pixels over an edge out of focus are binomial about its closed form: mean chi-square of a pixel 1.",
            ),
            Estimate::of(&chi),
            1.0,
            0.5,
        ),
        Claim::equivalent(
            subject(
                "width of an edge",
                "Its width, by the first moment of its profile, is the radius of blur, within 2 % (smoke) and .5 %.",
            ),
            Estimate::of(&width),
            1.0,
            margin(effort),
        ),
    ]
}

/// Film points whose rays do not meet within rounding.
fn unsharp(rows: &[&Row]) -> u64 {
    let unsharp = |row: &&&Row| row.measured.is_nan() || row.measured > row.predicted;
    rows.iter().filter(unsharp).count() as u64
}

fn focus(rows: &[Row], effort: Effort) -> Vec<Claim> {
    let (ours, theirs) = (
        of(rows, "focus", "thin lens"),
        of(rows, "focus", "original"),
    );
    let subject = |name, statement| EXPERIMENT.subject(name, statement, Effort::Smoke, effort);
    let n = theirs.len() as u64;
    vec![
        Claim::exact(
            subject(
                "the plane of focus is sharp",
                "At no film point, up to the corners, do two rays cross the plane of focus further apart than rounding.",
            ),
            unsharp(&ours),
            ours.len() as u64,
        ),
        Claim::exact(
            subject(
                "the original's lens is rejected",
                "The same measurement finds the lens on a sphere's shell sharp at no film point: a negative control.",
            ),
            n - unsharp(&theirs),
            n,
        ),
    ]
}

/// How the error falls with the samples of the lens: a scene and a sampler.
struct Law {
    subject: &'static str,
    sampler: &'static str,
}

const LAWS: [Law; 6] = {
    const fn law(subject: &'static str, sampler: &'static str) -> Law {
        Law { subject, sampler }
    }
    [
        law("edge", SAMPLERS[0]),
        law("edge", SAMPLERS[1]),
        law("edge", SAMPLERS[2]),
        law("smooth", SAMPLERS[0]),
        law("smooth", SAMPLERS[1]),
        law("smooth", SAMPLERS[2]),
    ]
};

/// What the fitted slope of a law must be known to.
const PRECISION: f64 = 0.03;

/// The slopes of the logarithm of the error over that of the samples.
fn slopes(rows: &[Row], effort: Effort) -> Vec<Claim> {
    let subject = |name, statement| EXPERIMENT.subject(name, statement, Effort::Standard, effort);
    let [
        edge,
        edge_stratified,
        edge_sobol,
        smooth,
        smooth_stratified,
        smooth_sobol,
    ] = LAWS.map(|law| law.slopes(rows));
    let mut independent = edge;
    independent.join(&smooth);
    let law = |subject, slopes: &Moments, slope| {
        Claim::law(subject, Estimate::of(slopes), slope, PRECISION)
    };
    // Far wider than any chance of the replicates.
    let half = 6.0 * smooth_sobol.standard_error();
    let interval = (smooth_sobol.mean() - half, smooth_sobol.mean() + half);
    vec![
        law(
            subject(
                "slope of independent samples",
                "The error of independent samples of the lens falls as n^−1/2, at an edge and where light is smooth.",
            ),
            &independent,
            -0.5,
        ),
        law(
            subject(
                "slope of strata at an edge",
                "At an edge the error of stratified samples falls as n^−3/4.",
            ),
            &edge_stratified,
            -0.75,
        ),
        law(
            subject(
                "slope of Sobol's points at an edge",
                "At an edge the error of scrambled Sobol points falls as n^−3/4.",
            ),
            &edge_sobol,
            -0.75,
        ),
        Claim::equivalent(
            subject(
                "slope of strata where light is smooth",
                "Where light is smooth the error of stratified samples falls as n^−1, within .03 (a grid of four is no limit yet).",
            ),
            Estimate::of(&smooth_stratified),
            -1.0,
            PRECISION,
        ),
        Claim::in_range(
            subject(
                "slope of Sobol's points where light is smooth",
                "Where light is smooth the error of scrambled Sobol points falls faster than n^−1.1, but no faster than n^−3/2.",
            ),
            smooth_sobol.mean(),
            interval,
            smooth_sobol.count(),
            (-1.5, -1.1),
        ),
    ]
}

impl Law {
    /// The slope of each replicate. Its levels are independent pictures.
    fn slopes(&self, rows: &[Row]) -> Moments {
        let of = of(rows, "noise", self.subject);
        let of: Vec<&Row> = of
            .into_iter()
            .filter(|row| row.sampler == self.sampler)
            .collect();
        let slope = |picture: &Vec<&Row>| {
            let points: Vec<_> = picture
                .iter()
                .map(|row| (libm::log(row.samples), libm::log(row.measured), 1.0))
                .collect();
            fit_line(&points).map_or(f64::NAN, |fit| fit.slope)
        };
        Moments::of(pictures(&of).iter().map(slope))
    }
}

/// Means of seven samples are unbiased.
fn mean(rows: &[Row], effort: Effort) -> Claim {
    let of = of(rows, "mean", "edge").into_iter();
    let of = of.filter(|row| row.sampler != SAMPLERS[0]);
    let off = Moments::of(of.map(|row| row.measured - row.predicted));
    let statement = format!(
        "The mean of {n} stratified or Sobol samples of an edge has no bias, though {n} is no power of two, nor a grid.",
        n = noise::ODD
    );
    let subject = EXPERIMENT.subject("mean of seven samples", &statement, Effort::Smoke, effort);
    Claim::null(subject, Estimate::of(&off), 0.0, 0.05)
}

fn blur_plot(rows: &[Row]) -> Plot {
    let ours = DEPTHS.map(|depth| {
        let ratios = ratios_at(rows, depth);
        (depth, ratios.mean() * blur(depth))
    });
    let theirs = of(rows, "blur", "original").into_iter();
    // Evenly on the logarithmic axis.
    let along = (0..=200).map(|step| 1.2 * libm::pow(60.0, f64::from(step) / 200.0));
    Plot::new(
        "Blur against depth: the thin lens is sharp at its distance of focus, the original's nowhere",
        Axis::log("distance from the lens (focus at 6)"),
        Axis::linear("radius of blur on the plane of focus (lens radius .25)"),
        [
            Series::scattered("thin lens", ours),
            Series::predicted("a |s − s_f|/s", along.map(|depth| (depth, blur(depth)))),
            Series::scattered(
                "the original's",
                theirs.map(|row| (row.depth, row.measured)),
            ),
        ],
    )
}

fn edge_plot(rows: &[Row]) -> Plot {
    let pictures = pictures(&of(rows, "edge", "thin lens"));
    let pixels = pictures.first().map_or(0, Vec::len);
    let mean = |pixel: usize| {
        let values = pictures.iter().map(|picture| picture[pixel].measured);
        (pictures[0][pixel].place, Moments::of(values).mean())
    };
    let along = (-110..=110).map(|step| 0.01 * f64::from(step));
    Plot::new(
        "Profile of a straight edge out of focus",
        Axis::linear("distance from the edge (radii of blur)"),
        Axis::linear("share of the lens that sees it"),
        [
            Series::scattered("measured", (0..pixels).map(mean)),
            Series::predicted("½ + (x √(1 − x²) + asin x)/π", along.map(|x| (x, share(x)))),
        ],
    )
}

fn noise_plot(rows: &[Row], effort: Effort) -> Plot {
    let levels = noise::levels(effort);
    let series = |law: &Law| {
        let of = of(rows, "noise", law.subject).into_iter();
        let of: Vec<&Row> = of.filter(|row| row.sampler == law.sampler).collect();
        let at = |&n: &u32| {
            let same = of.iter().filter(|row| row.samples == f64::from(n));
            let square = Moments::of(same.map(|row| row.measured * row.measured)).mean();
            (f64::from(n), square.sqrt())
        };
        let slopes = law.slopes(rows);
        let half = 1.96 * slopes.standard_error();
        let name = format!(
            "{}, {}: slope {:.3} ± {half:.3}",
            law.subject,
            law.sampler,
            slopes.mean()
        );
        Series::measured(name, levels.iter().map(at))
    };
    Plot::new(
        "Error against samples of the lens: strata and Sobol's points gain at edges, and more where light is smooth",
        Axis::log("samples a pixel"),
        Axis::log("relative error of a pixel (root mean square)"),
        LAWS.iter().map(series),
    )
}

#[cfg(test)]
mod tests {
    use super::super::{conclude as concluded, execute, plan};
    use super::*;
    use crate::lab::experiment::{Table, Value};

    fn table() -> Table {
        let mut rows = Vec::new();
        for (index, run) in plan(Effort::Smoke).iter().enumerate() {
            let outcome = execute(run, Effort::Smoke, index as u64).expect("a run");
            rows.extend(outcome.rows);
        }
        EXPERIMENT.table(rows)
    }

    fn failing(table: &Table) -> Vec<String> {
        let claims = concluded(table, Effort::Smoke).claims.into_iter();
        let failing = claims.filter(Claim::fails_the_run);
        failing.map(|claim| claim.claim).collect()
    }

    #[test]
    fn wrong_blur_a_wrong_profile_and_a_lens_out_of_focus_fail_their_claims() {
        let right = table();
        assert_eq!(failing(&right), Vec::<String>::new());
        let measured = right.column("measured");
        let changed = |part: &str, change: &dyn Fn(&[Value], f64) -> f64| {
            let mut table = right.clone();
            for row in &mut table.rows {
                if row[0].to_cell() == part {
                    let value = row[measured].number().expect("a number");
                    row[measured] = Value::Number(change(row, value));
                }
            }
            failing(&table)
        };
        let both = ["blur before the focus", "blur behind the focus"];
        assert_eq!(changed("blur", &|_, radius| 1.05 * radius), both);
        let far = changed("blur", &|row, radius| {
            let depth = row[right.column("depth")].number();
            radius * if depth == Some(60.0) { 0.95 } else { 1.0 }
        });
        assert_eq!(far, ["blur behind the focus"]);
        let biased = changed("mean", &|_, mean| mean + 0.1);
        assert_eq!(biased, ["mean of seven samples"]);
        let blurred = changed("focus", &|_, off| 1e9 * off);
        assert!(blurred.contains(&"the plane of focus is sharp".to_owned()));
        let sharp = changed("focus", &|_, _| 0.0);
        assert_eq!(sharp, ["the original's lens is rejected"]);
        // The profile of an edge 5 % less blurred, with the noise as it is.
        let (place, predicted) = (right.column("place"), right.column("predicted"));
        let narrow = changed("edge", &|row, value| {
            let number = |column: usize| row[column].number().expect("a number");
            value + share(number(place) / 0.95) - number(predicted)
        });
        assert!(narrow.contains(&"width of an edge".to_owned()));
        // One pixel of the profile off by a twentieth.
        let notched = changed("edge", &|row, value| {
            let middle = row[place].number().expect("a number").abs() < 0.02;
            value + if middle { 0.1 } else { 0.0 }
        });
        assert!(notched.contains(&"profile of an edge".to_owned()));
    }
}
