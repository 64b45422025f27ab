//! What does a solver answer, and at what price, where a ray all but touches the surface?

mod conclusion;
mod rays;

use crate::geometry::hit::Crossing;
use crate::geometry::ray::Ray;
use crate::geometry::revolution::clipping::ClippingSettings;
use crate::geometry::revolution::newton::NewtonSettings;
use crate::geometry::revolution::{Revolution, Solver, exact};
use crate::lab::experiment::{Effort, Experiment, Outcome, Run, Timing, grid, values};
use crate::lab::table::Value;
use crate::numeric::clock::ThreadClock;
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::work::Work;
use rays::{Family, Graze, surface};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "grazing",
    question: "What do solvers answer, and at what price, where a ray all but touches the surface?",
    prediction: "After a tilt δ from tangency the two crossings lie 2 tan δ/κ apart, after a shift d inward 2 √(2 d/κ). A residual of \
                 tolerance times size leaves t wrong by tolerance/δ or tolerance/√d, and never by more than about √(tolerance). \
                 Bernstein isolation makes no mistake. It asks exact arithmetic where the dip between two roots drowns in rounding: a \
                 step, at d about 1e-13 and δ about √(2κd) = 4e-7. (Found: the step is softer and ten times higher, d about 1e-12 and δ \
                 about 1e-6, as rays near the horizontal need more; a share ~ 1/δ, also thought of, does not hold. And the \
                 slopes are those of the worst percent of the hits: the median was expected to follow them too, but falls faster, as \
                 Newton's last step overshoots the tolerance where the surface is steep.)",
    method: "Tangents at random points of the cup and the hourglass in random directions along which the surface bends away with normal \
             curvature κ (.2 to 5, Euler's formula); the ray starts .1 to 1 before the point and nothing stands between. `tilt` turns \
             it about the point by δ, `inward` and `outward` move it by d; at 0 only the rounding of the ray is left. Truth is the \
             exact oracle. `wrong` is a t further off than 8 √(2 tolerance size/κ), which is another crossing (tolerance 1e-15 for \
             solvers without one); t-errors are those of the other hits.  Slopes have a constant for each surface.",
    columns: &[
        "solver",
        "surface",
        "family",
        "tilt",
        "rays",
        "true_hits",
        "miss",
        "phantom",
        "wrong",
        "chord_over_predicted",
        "median_t_error",
        "p99_t_error",
        "max_t_error",
        "fallbacks",
        "ns_per_ray",
    ],
    timing: Timing::OwnThread,
    cpu_seconds: [2.4, 50.0, 1000.0],
    plan,
    execute,
    conclude: conclusion::conclude,
};

const SURFACES: [&str; 2] = ["cup", "hourglass"];
/// Relative tolerances of Newton's method.
const TOLERANCES: [f64; 4] = [1e-6, 1e-8, 1e-10, 1e-12];
/// Tilts in radians, or distances in world units: 1e-1 to 1e-16, and tangency itself up to the rounding of the ray.
const DECADES: i64 = 16;

fn tilts() -> impl Iterator<Item = f64> {
    (1..=DECADES).map(|k| libm::exp10(-k as f64)).chain([0.0])
}

fn plan(_: Effort) -> Vec<Run> {
    grid([
        ("surface", values(SURFACES)),
        ("family", values(Family::ALL.map(Family::name))),
        ("tilt", values(tilts())),
    ])
}

/// Exact arithmetic costs about 200 µs a ray, four Newton solvers as much again.
fn rays(effort: Effort) -> u64 {
    effort.of([40, 1_000, 20_000])
}

/// A solver under test, with the relative residual that it accepts (of clipping: the width in u of a root).
struct Entry {
    name: String,
    solver: Solver,
    tolerance: f64,
}

/// What rounding leaves of a residual where a solver decides by bounds of its rounding.
const ROUNDING: f64 = 1e-15;
/// An error above so many times the blur at tangency is another crossing, not an inaccurate one.
const SAME_CROSSING: f64 = 8.0;

fn entries() -> Vec<Entry> {
    let certain = [("bernstein", Solver::Bernstein), ("exact", Solver::Exact)];
    let certain = certain.map(|(name, solver)| Entry {
        name: name.to_owned(),
        solver,
        tolerance: ROUNDING,
    });
    let newton = TOLERANCES.map(|tolerance| Entry {
        name: newton_name(tolerance),
        solver: Solver::Newton(NewtonSettings {
            tolerance,
            ..NewtonSettings::default()
        }),
        tolerance,
    });
    let clipping = ClippingSettings::default();
    let clipping = Entry {
        name: CLIPPING.to_owned(),
        solver: Solver::Clipping(clipping),
        tolerance: clipping.tolerance,
    };
    certain
        .into_iter()
        .chain(newton)
        .chain([clipping])
        .collect()
}

/// Bezier clipping in the table.
const CLIPPING: &str = "clipping";

fn newton_name(tolerance: f64) -> String {
    format!("newton {tolerance:e}")
}

/// A ray, what is known of it, and what exact arithmetic says.
struct Case {
    graze: Graze,
    ray: Ray,
    truth: Option<f64>,
    /// Distance of the first two true crossings over the predicted one, where there is one.
    chord: Option<f64>,
}

fn cases(surface: &Revolution, family: Family, tilt: f64, count: u64, seed: u64) -> Vec<Case> {
    let case = |index| {
        let graze = Graze::random(surface, &mut Stream::new(seed, Purpose::Experiment, index));
        let ray = graze.ray(family, tilt);
        let crossings = exact::crossings(surface.profile(), &ray);
        Case {
            graze,
            ray,
            truth: crossings.first().map(|crossing| crossing.t),
            chord: (crossings.len() > 1)
                .then(|| (crossings[1].t - crossings[0].t) / graze.chord(family, tilt)),
        }
    };
    (0..count).map(case).collect()
}

/// What a solver did with the cases.
#[derive(Default)]
struct Score {
    hits: u64,
    miss: u64,
    phantom: u64,
    wrong: u64,
    errors: Vec<f64>,
}

impl Score {
    fn judge(&mut self, case: &Case, found: Option<Crossing>, accuracy: f64) {
        self.hits += u64::from(case.truth.is_some());
        match (case.truth, found) {
            (Some(_), None) => self.miss += 1,
            (None, Some(_)) => self.phantom += 1,
            (Some(truth), Some(found)) => {
                let error = (found.t - truth).abs();
                if error > SAME_CROSSING * case.graze.blur(accuracy) {
                    self.wrong += 1;
                } else {
                    self.errors.push(error);
                }
            }
            (None, None) => {}
        }
    }
}

/// The value below which this share of the sorted values lies; NaN without values.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len().saturating_sub(1) as f64;
    let place = (share * last).ceil() as usize;
    sorted.get(place).copied().unwrap_or(f64::NAN)
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let unknown = || anyhow::anyhow!("unknown run {}", run.name());
    let surface = surface(&run.text("surface")).ok_or_else(unknown)?;
    let family = Family::named(&run.text("family")).ok_or_else(unknown)?;
    let cases = cases(&surface, family, run.number("tilt"), rays(effort), seed);
    let (radius, height) = surface.profile().control_size();
    let chords = sorted(cases.iter().filter_map(|case| case.chord));
    let mut outcome = Outcome::default();
    for entry in entries() {
        let mut work = Work::default();
        let clock = ThreadClock::start();
        let found: Vec<Option<Crossing>> = (cases.iter())
            .map(|case| surface.nearest(&case.ray, &entry.solver, &mut work))
            .collect();
        let seconds = clock.seconds();
        let mut score = Score::default();
        for (case, found) in cases.iter().zip(found) {
            score.judge(case, found, entry.tolerance * (radius + height));
        }
        let errors = sorted(score.errors.into_iter());
        let mut row = vec![Value::from(entry.name)];
        row.extend(run.row([
            cases.len().into(),
            score.hits.into(),
            score.miss.into(),
            score.phantom.into(),
            score.wrong.into(),
            quantile(&chords, 0.5).into(),
            quantile(&errors, 0.5).into(),
            quantile(&errors, 0.99).into(),
            quantile(&errors, 1.0).into(),
            work.solver_fallbacks.into(),
            (seconds * 1e9 / cases.len() as f64).into(),
        ]));
        outcome.rows.push(row);
        outcome.work += work;
    }
    Ok(outcome)
}
