//! What the table of `grazing` says.

use super::rays::Family;
use super::{CLIPPING, EXPERIMENT, SURFACES, TOLERANCES, newton_name};
use crate::lab::claim::{Claim, Estimate, Subject};
use crate::lab::experiment::{Conclusion, Effort};
use crate::lab::plot::{Axis, Plot, Series};
use crate::lab::table::Table;
use crate::numeric::statistics::{Fit, Moments, fit_line};
use serde::Deserialize;

/// A solver's cell.
#[derive(Clone, Copy, Deserialize)]
struct Cell {
    tilt: f64,
    rays: f64,
    miss: f64,
    phantom: f64,
    wrong: f64,
    chord_over_predicted: f64,
    median_t_error: f64,
    p99_t_error: f64,
    fallbacks: f64,
    ns_per_ray: f64,
}

fn cells(table: &Table, solver: &str, surface: &str, family: Family) -> Vec<Cell> {
    (table.filter("solver", &solver.into()))
        .filter("surface", &surface.into())
        .filter("family", &family.name().into())
        .read()
}

/// The cells of both surfaces and all families.
fn everywhere(table: &Table, solver: &str) -> Vec<Cell> {
    let places = SURFACES
        .into_iter()
        .flat_map(|surface| Family::ALL.map(|family| (surface, family)));
    places
        .flat_map(|(surface, family)| cells(table, solver, surface, family))
        .collect()
}

/// From here down the surface between two crossings bends as it does at the point of tangency.
const NEAR: f64 = 1e-4;
/// Tilts and shifts below owe as much to the ray's rounding (1e-16, so a chord of 3e-8).
const BLURRED: [(Family, f64); 2] = [(Family::Tilt, 1e-6), (Family::Inward, 1e-13)];
/// From here down the ray's own rounding tilts it as much, and f64 solvers see a tangency.
const TOUCHING: f64 = 1e-9;
/// From here up no chord is short.
const STEEP: f64 = 1e-4;

pub(super) fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let subject = |claim, statement| EXPERIMENT.subject(claim, statement, Effort::Smoke, effort);
    let mut claims = vec![no_failure(table, &subject)];
    claims.extend(laws(table, &subject, effort));
    claims.extend(phantoms(table, &subject));
    claims.extend(price(table, &subject));
    let plots = vec![
        error_plot(table, Family::Tilt),
        error_plot(table, Family::Inward),
        fallback_plot(table),
        cost_plot(table),
    ];
    Conclusion {
        claims,
        plots,
        ..Conclusion::default()
    }
}

/// Names a claim and its statement.
type Named<'a> = dyn Fn(&'static str, &'static str) -> Subject<'static> + 'a;

fn no_failure(table: &Table, subject: &Named) -> Claim {
    let all = everywhere(table, "bernstein");
    let failures: f64 = all.iter().map(|c| c.miss + c.phantom + c.wrong).sum();
    let rays: f64 = all.iter().map(|c| c.rays).sum();
    let statement = "The Bernstein solver answers as exact arithmetic does at every tilt and distance from tangency, 0 included.";
    let subject = subject("bernstein is right at tangency", statement);
    Claim::exact(subject, failures as u64, rays as u64)
}

/// Slope of log y against log x, each surface with a constant of its own.
fn slope(points: impl Fn(&str) -> Vec<(f64, f64)>) -> Option<Fit> {
    let mut all = Vec::new();
    for surface in SURFACES {
        let usable = points(surface).into_iter();
        let logs: Vec<(f64, f64)> = usable
            .filter(|&(x, y)| x > 0.0 && y > 0.0)
            .map(|(x, y)| (libm::log10(x), libm::log10(y)))
            .collect();
        let n = logs.len() as f64;
        let mean = |pick: fn(&(f64, f64)) -> f64| logs.iter().map(pick).sum::<f64>() / n;
        let (x0, y0) = (mean(|p| p.0), mean(|p| p.1));
        all.extend(logs.iter().map(|p| (p.0 - x0, p.1 - y0, 1.0)));
    }
    fit_line(&all)
}

fn estimate(fit: Option<Fit>) -> Estimate {
    let nothing = Estimate {
        value: f64::NAN,
        standard_error: f64::NAN,
        freedom: 1.0,
        n: 0,
    };
    fit.map_or(nothing, |fit| Estimate {
        value: fit.slope,
        standard_error: fit.slope_error,
        // One more constant was fitted: that of the second surface.
        freedom: fit.freedom - 1.0,
        n: fit.freedom as u64 + 2,
    })
}

fn laws(table: &Table, subject: &Named, effort: Effort) -> Vec<Claim> {
    let chord = |(family, blurred)| {
        let all = SURFACES.map(|surface| cells(table, "exact", surface, family));
        let clear = |c: &&Cell| blurred <= c.tilt && c.tilt <= NEAR;
        let ratios = all.iter().flatten().filter(clear);
        Estimate::of(&Moments::of(ratios.map(|c| c.chord_over_predicted)))
    };
    // Errors of all tolerances ε on one curve: e/√ε against δ/√ε, or d/ε.
    let error = |family, scale: fn(f64) -> f64, from: f64| {
        estimate(slope(|surface| {
            let scaled = |tolerance: f64| {
                let cells = cells(table, &newton_name(tolerance), surface, family);
                let point =
                    move |c: &Cell| (c.tilt / scale(tolerance), c.p99_t_error / tolerance.sqrt());
                let points: Vec<(f64, f64)> = cells.iter().map(point).collect();
                points.into_iter().filter(move |&(x, _)| x >= from)
            };
            TOLERANCES.into_iter().flat_map(scaled).collect()
        }))
    };
    let saturated = estimate(slope(|surface| {
        let level = |tolerance: f64| {
            let cells = cells(table, &newton_name(tolerance), surface, Family::Tilt).into_iter();
            let touching = cells.filter(|c| c.tilt <= TOUCHING);
            touching.map(move |c| (tolerance, c.median_t_error))
        };
        TOLERANCES.into_iter().flat_map(level).collect()
    }));
    // The 99th percentile of a few rays is their worst: at smoke effort slopes scatter by .03.
    let error_margin = effort.of([0.15, 0.1, 0.1]);
    let law = |claim, statement, estimate, predicted, margin| {
        Claim::equivalent(subject(claim, statement), estimate, predicted, margin)
    };
    vec![
        law(
            "chord after a tilt",
            "The two crossings of a ray turned by δ from tangency lie 2 tan δ/κ apart (median, within 1 %).",
            chord(BLURRED[0]),
            1.0,
            0.01,
        ),
        law(
            "chord after a shift",
            "The two crossings of a ray moved inward by d from tangency lie 2 √(2 d/κ) apart (median, within 1 %).",
            chord(BLURRED[1]),
            1.0,
            0.01,
        ),
        law(
            "newton's error against tilt",
            "Before it saturates, the t-error of all but 1 % of Newton's hits grows as tolerance/δ (slope -1 within .1; .15 at smoke effort).",
            error(Family::Tilt, f64::sqrt, 30.0),
            -1.0,
            error_margin,
        ),
        law(
            "newton's error against shift",
            "Before it saturates, the t-error of all but 1 % of Newton's hits grows as tolerance/√d (slope -1/2 within .1; .15 at smoke effort).",
            error(Family::Inward, |tolerance| tolerance, 1000.0),
            -0.5,
            error_margin,
        ),
        law(
            "newton's error at tangency",
            "At tangency the median t-error of Newton's method is ~ √tolerance (slope 1/2 within .03).",
            saturated,
            0.5,
            0.03,
        ),
    ]
}

/// Rays that pass the surface by less than a tenth of the residual that is accepted, or more than a hundred times as far.
fn phantoms(table: &Table, subject: &Named) -> [Claim; 2] {
    let (mut near, mut far) = ((0.0, 0.0), (0.0, 0.0));
    for tolerance in TOLERANCES {
        for surface in SURFACES {
            for c in cells(table, &newton_name(tolerance), surface, Family::Outward) {
                // Nearer than 1e-14 the ray's rounding may put it inside.
                if 1e-14 <= c.tilt && c.tilt <= 0.1001 * tolerance {
                    near = (near.0 + c.phantom + c.wrong, near.1 + c.rays);
                } else if c.tilt >= 99.0 * tolerance {
                    far = (far.0 + c.phantom, far.1 + c.rays);
                }
            }
        }
    }
    let band = "Newton's method hits what a ray passes by less than a tenth of its tolerance: at least 97 % of those rays.";
    let beyond =
        "Newton's method invents no crossing for rays that pass by more than a hundred tolerances.";
    [
        Claim::share_in_range(
            subject("newton has a graze band", band),
            near.0 as u64,
            near.1 as u64,
            (0.97, 1.0),
        ),
        Claim::exact(
            subject("the graze band ends", beyond),
            far.0 as u64,
            far.1 as u64,
        ),
    ]
}

fn price(table: &Table, subject: &Named) -> [Claim; 3] {
    let of = |pass: &dyn Fn(&Cell) -> bool| -> Vec<Cell> {
        let tilted = SURFACES.map(|s| cells(table, "bernstein", s, Family::Tilt));
        tilted.into_iter().flatten().filter(|c| pass(c)).collect()
    };
    let share = |claim, statement, cells: &[Cell], range| {
        let sum = |pick: fn(&Cell) -> f64| cells.iter().map(pick).sum::<f64>() as u64;
        let (fallbacks, rays) = (sum(|c| c.fallbacks), sum(|c| c.rays));
        Claim::share_in_range(subject(claim, statement), fallbacks, rays, range)
    };
    // Of the cells' times the middle one: a single ray that needs exact arithmetic would double a mean.
    let time = |cells: &[Cell]| {
        let times = super::sorted(cells.iter().map(|c| c.ns_per_ray));
        super::quantile(&times, 0.5)
    };
    let (steep, touching) = (of(&|c| c.tilt >= STEEP), of(&|c| c.tilt <= TOUCHING));
    let decades = libm::log10(time(&touching) / time(&steep));
    // One timing of each: another load of the machine may change either by a factor of two.
    let decades_interval = (decades - libm::log10(2.0), decades + libm::log10(2.0));
    let rare =
        "At most 4 % of the rays tilted by 1e-4 or more from tangency go to exact arithmetic.";
    let always = "At least 98 % of the rays within 1e-9 of tangency go to exact arithmetic: f64 cannot decide them.";
    let dear =
        "A ray that goes to exact arithmetic costs 10 to 1000 times as much as one that does not.";
    [
        share(
            "steep rays need no exact arithmetic",
            rare,
            &steep,
            (0.0, 0.04),
        ),
        share("touching rays need it", always, &touching, (0.98, 1.0)),
        Claim::in_range(
            subject("price of certainty", dear),
            decades,
            decades_interval,
            1,
            (1.0, 3.0),
        ),
    ]
}

const PLOTTED: &str = SURFACES[0];
/// Size of the cup: greatest control radius and height together.
const SIZE: f64 = 6.0;

fn error_plot(table: &Table, family: Family) -> Plot {
    let measured = |solver: &str| {
        let cells = cells(table, solver, PLOTTED, family).into_iter();
        Series::measured(solver, cells.map(|c| (c.tilt, c.median_t_error)))
    };
    // At curvature 1.
    let slope = |tilt: f64| match family {
        Family::Tilt => tilt,
        Family::Inward | Family::Outward => (2.0 * tilt).sqrt(),
    };
    let predicted = |tolerance: f64| {
        let residual = tolerance * SIZE;
        let error = |tilt| (residual / slope(tilt)).min((2.0 * residual).sqrt());
        let name = format!("bound, {}", newton_name(tolerance));
        Series::predicted(name, super::tilts().map(|tilt| (tilt, error(tilt))))
    };
    let (title, label) = match family {
        Family::Tilt => (
            "Newton's t is wrong by tolerance over tilt, then by the root of the tolerance (cup, median)",
            "tilt from tangency δ (radians)",
        ),
        Family::Inward | Family::Outward => (
            "Moved inward instead: the same with the root of the distance (cup, median)",
            "distance from tangency d (world units)",
        ),
    };
    let newton = TOLERANCES.map(|tolerance| measured(&newton_name(tolerance)));
    Plot::new(
        title,
        Axis::log(label),
        Axis::log("error of t"),
        (TOLERANCES.map(predicted).into_iter())
            .chain([measured("bernstein"), measured(CLIPPING)])
            .chain(newton),
    )
}

fn fallback_plot(table: &Table) -> Plot {
    let share = |family: Family| {
        let cells = cells(table, "bernstein", PLOTTED, family).into_iter();
        let counts = cells.map(|c| (c.tilt, c.fallbacks as u64, c.rays as u64));
        Series::shares(family.name(), counts)
    };
    Plot::new(
        "f64 decides down to a tilt of about 1e-6, or a distance of 1e-12 (cup)",
        Axis::log("tilt δ (radians) or distance d (world units) from tangency"),
        Axis::linear("share of rays that go to exact arithmetic"),
        Family::ALL.map(share),
    )
}

fn cost_plot(table: &Table) -> Plot {
    let of = |solver: &str| cells(table, solver, PLOTTED, Family::Tilt);
    let measured =
        |solver: &str| Series::measured(solver, of(solver).iter().map(|c| (c.tilt, c.ns_per_ray)));
    let (fast, exact) = (of("bernstein"), of("exact"));
    let base = fast.first().map_or(f64::NAN, |c| c.ns_per_ray);
    let mixed = fast
        .iter()
        .zip(&exact)
        .map(|(f, e)| (f.tilt, base + f.fallbacks / f.rays * e.ns_per_ray));
    Plot::new(
        "What certainty costs: exact arithmetic, but only where rays touch (cup)",
        Axis::log("tilt from tangency δ (radians)"),
        Axis::log("CPU time per ray (ns)"),
        [
            Series::predicted("base + share of fallbacks × exact", mixed),
            measured("bernstein"),
            measured("exact"),
            measured(&newton_name(1e-10)),
            measured(CLIPPING),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::table::Value;

    /// A table that follows every law, with hand-made faults.
    fn table(
        bernstein_wrong: u64,
        exponent: f64,
        far_phantoms: u64,
        steep_fallbacks: u64,
    ) -> Table {
        let mut rows: Vec<Vec<Value>> = Vec::new();
        let newton = TOLERANCES.map(|tolerance| (newton_name(tolerance), tolerance));
        let solvers = [("bernstein".to_owned(), 0.0), ("exact".to_owned(), 0.0)];
        for (solver, tolerance) in solvers.into_iter().chain(newton) {
            for surface in SURFACES {
                for family in Family::ALL {
                    for tilt in super::super::tilts() {
                        let depth = if family == Family::Tilt {
                            tilt
                        } else {
                            tilt.sqrt()
                        };
                        let error = (tolerance / libm::pow(depth, -exponent)).min(tolerance.sqrt());
                        let newton = tolerance > 0.0 && family == Family::Outward;
                        let phantom = match tilt {
                            _ if !newton => 0,
                            d if d <= tolerance => 1000,
                            _ => far_phantoms,
                        };
                        let fallbacks = if tilt < 1e-6 { 1000 } else { steep_fallbacks };
                        let bernstein = solver == "bernstein";
                        rows.push(vec![
                            solver.as_str().into(),
                            surface.into(),
                            family.name().into(),
                            tilt.into(),
                            1000_u64.into(),
                            500_u64.into(),
                            0_u64.into(),
                            phantom.into(),
                            if bernstein { bernstein_wrong } else { 0 }.into(),
                            1.0.into(),
                            error.into(),
                            error.into(),
                            error.into(),
                            if bernstein { fallbacks } else { 0 }.into(),
                            if bernstein && fallbacks < 500 {
                                1e3
                            } else {
                                2e5
                            }
                            .into(),
                        ]);
                    }
                }
            }
        }
        EXPERIMENT.table(rows)
    }

    #[test]
    fn a_table_with_a_fault_fails_the_claim_about_it() {
        let failed = |table: &Table| -> Vec<usize> {
            let claims = conclude(table, Effort::Smoke).claims.into_iter();
            let failing = claims.enumerate().filter(|(_, c)| c.fails_the_run());
            failing.map(|(index, _)| index).collect()
        };
        assert_eq!(failed(&table(0, -1.0, 0, 0)), [0_usize; 0]);
        assert_eq!(failed(&table(1, -1.0, 0, 0)), [0]);
        assert_eq!(failed(&table(0, -0.6, 0, 0)), [3, 4]);
        assert_eq!(failed(&table(0, -1.0, 1, 0)), [7]);
        assert_eq!(failed(&table(0, -1.0, 0, 100)), [8]);
    }
}
