//! How far from the surface must the next ray start, and how far may it?

mod departure;
mod picture;

use crate::geometry::hit::OFFSET_IN_ERRORS;
use crate::geometry::profile::Profile;
use crate::geometry::ray::Ray;
use crate::geometry::revolution::newton::NewtonSettings;
use crate::geometry::revolution::{Placement, Revolution, Solver};
use crate::lab::claim::Claim;
use crate::lab::experiment::{
    Conclusion, Effort, Experiment, Outcome, Run, Table, Timing, grid, values,
};
use crate::lab::plot::{Axis, Plot, Series};
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::work::Work;
use departure::departure;
use glam::DVec3;
use picture::Start;
use serde::Deserialize;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "eps",
    question: "How far off the surface must a ray start so that it does not meet the sheet it leaves, and when does it jump a wall?",
    prediction: "With a point on the surface and a residual accepted at max |F| <= tolerance, a false hit lies within √3 \
                 tolerances of the sheet: none at an offset of 2, most rays at 0. A point left where the ray says \
                 has the same error again. Walls are jumped from about the thickness of the rim and the base (.04 to .2) on. A picture shows acne below the \
                 cliff, leaks above the walls' thickness, and between them does not depend on the offset; the certified start is \
                 one point there.",
    method: "Random rays hit the cup; a ray leaves each hit on a random side of it, uniform in the cosine (0.05 to 1) to the \
             normal. A self-hit is a crossing of the same piece nearer than eight tolerances over the cosine; a leak is a start \
             on the far side of another sheet (Wächter and Binder 2019 on both). `point` says whether the hit was put on the \
             surface or left where the ray's t says. `picture`: the cup of glass before a smooth sky, one path a pixel, with the \
             same choices along it at every offset; a pixel is changed if it differs by 1/256 from the picture of the `bernstein` \
             solver with certified starts.",
    columns: &[
        "solver",
        "point",
        "tolerance",
        "offset",
        "offset_over_tolerance",
        "rays",
        "self_hits",
        "leaks",
        "pixels",
        "pixels_changed",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [4.5, 90.0, 2400.0],
    plan,
    execute,
    conclude,
};

/// Relative tolerances of the Newton solver.
const TOLERANCES: [f64; 3] = [1e-6, 1e-8, 1e-10];
/// Offsets in tolerances.
const RATIOS: [f64; 9] = [0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 4.0, 10.0, 100.0];
/// Offsets in world units, for walls.
const OFFSETS: [f64; 8] = [1e-6, 1e-4, 1e-3, 1e-2, 0.03, 0.1, 0.2, 0.3];
/// Tolerances and offsets in tolerances of Newton's pictures.
const TOLERANCES_SHOWN: [f64; 2] = [1e-6, 1e-10];
const RATIOS_SHOWN: [f64; 5] = [0.0, 0.5, 1.0, 2.0, 4.0];
/// Offsets of Bernstein's pictures: in error bounds up to the standard one, then in world units.
const ERRORS_SHOWN: [f64; 6] = [0.0, 0.003, 0.01, 0.1, 1.0, OFFSET_IN_ERRORS];
/// Share of pixels that an offset in the right range may change: paths that an edge or the critical angle splits.
const FEW: (f64, f64) = (0.0, 2e-3);
/// Offset below which nothing of the cup is thin enough to be jumped.
const SAFE_OFFSET: f64 = 1e-3;
/// Offset that jumps the rim (0.2 thick) and the base.
const JUMPING_OFFSET: f64 = 0.3;
/// Rays that leave at a smaller cosine to the normal may truly meet the same sheet soon.
const LEAST_COSINE: f64 = 0.05;
/// Share of self-hits at no offset: every start ends with an error of its own, and one t > 0 among them is enough.
const MOST: (f64, f64) = (0.5, 0.95);
/// A start this near to the sheet it leaves is still on it, for the search of jumped walls.
const ON_THE_SHEET: f64 = 1e-9;

fn plan(_effort: Effort) -> Vec<Run> {
    let runs = |solver: &str, points: &[&str], tolerances: &[f64]| {
        grid([
            ("solver", values([solver])),
            ("point", values(points.iter().copied())),
            ("tolerance", values(tolerances.iter().copied())),
        ])
    };
    let bernstein = runs("bernstein", &["leave", "surface"], &[0.0]);
    let newton = runs("newton", &["surface", "ray"], &TOLERANCES);
    let pictures = [
        runs("bernstein", &["picture"], &[0.0]),
        runs("newton", &["picture"], &TOLERANCES_SHOWN),
    ];
    // The longest first, so that no other waits for it at the end.
    [pictures.concat(), bernstein, newton].concat()
}

/// A Newton ray costs about 50 µs an offset, a Bernstein one 1 µs.
fn rays(solver: &str, effort: Effort) -> u64 {
    effort.of(match solver {
        "bernstein" => [100_000, 3_000_000, 30_000_000],
        _ => [700, 20_000, 1_000_000],
    })
}

/// One line of the table.
#[derive(Clone, Copy, Default)]
struct Count {
    offset: f64,
    ratio: f64,
    rays: u64,
    self_hits: u64,
    leaks: u64,
    pixels: u64,
    pixels_changed: u64,
}

/// What a run is about.
struct Setting {
    name: String,
    point: String,
    solver: Solver,
    /// Error that is allowed for in a crossing, world units: the accepted residual, or the certified bound of the hit.
    tolerance: f64,
}

impl Setting {
    fn new(run: &Run, surface: &Revolution) -> Self {
        let relative = run.number("tolerance");
        let name = run.text("solver");
        let newton = NewtonSettings {
            tolerance: relative,
            ..NewtonSettings::default()
        };
        let (radius, height) = surface.profile().control_size();
        let (solver, tolerance) = if name == "newton" {
            (Solver::Newton(newton), relative * (radius + height))
        } else {
            (Solver::Bernstein, certified_error(surface))
        };
        Self {
            point: run.text("point"),
            name,
            solver,
            tolerance,
        }
    }

    fn counts(&self) -> Vec<Count> {
        let count = |offset: f64, ratio: f64| Count {
            offset,
            ratio,
            ..Count::default()
        };
        let in_tolerances = |ratio: f64| count(ratio * self.tolerance, ratio);
        match (self.name.as_str(), self.point.as_str()) {
            ("newton", "picture") => RATIOS_SHOWN.map(in_tolerances).to_vec(),
            ("newton", _) => RATIOS.map(in_tolerances).to_vec(),
            (_, "leave") => vec![in_tolerances(OFFSET_IN_ERRORS)],
            (_, "picture") => {
                let errors = ERRORS_SHOWN.map(in_tolerances);
                let units = OFFSETS.map(|offset| count(offset, offset / self.tolerance));
                [&errors[..], &units].concat()
            }
            _ => OFFSETS
                .map(|offset| count(offset, offset / self.tolerance))
                .to_vec(),
        }
    }
}

/// The bound of the hit's error: one number for the whole surface.
fn certified_error(surface: &Revolution) -> f64 {
    let down = Ray::new(10.0 * DVec3::Y, DVec3::NEG_Y);
    let crossing = surface.nearest(&down, &Solver::Bernstein, &mut Work::default());
    crossing.map_or(f64::NAN, |crossing| surface.hit(&down, crossing).error)
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let surface = Revolution::new(Profile::cup(), Placement::identity());
    let setting = Setting::new(run, &surface);
    let reach = 8.0 * setting.tolerance.max(ON_THE_SHEET);
    let mut work = Work::default();
    let mut counts = setting.counts();
    if setting.point == "picture" {
        compare_pictures(&surface, &setting, &mut counts, effort, seed, &mut work);
        return Ok(outcome(&setting, &counts, work));
    }
    for index in 0..rays(&setting.name, effort) {
        let mut stream = Stream::new(seed, Purpose::Experiment, index);
        let Some(departure) = departure(&surface, &setting, &mut stream, &mut work) else {
            continue;
        };
        for count in &mut counts {
            let ray = match setting.point.as_str() {
                "leave" => departure.certified(&surface, &mut work),
                _ => departure.leave(count.offset),
            };
            count.rays += 1;
            let met = departure.meets_itself(&ray, reach, &surface, &setting.solver, &mut work);
            count.self_hits += u64::from(met);
            let jumped = departure.jumps_a_wall(count.offset, &surface, &mut work);
            count.leaks += u64::from(jumped);
        }
    }
    Ok(outcome(&setting, &counts, work))
}

/// Pictures at every offset against the certified one of the same size.
fn compare_pictures(
    cup: &Revolution,
    setting: &Setting,
    counts: &mut [Count],
    effort: Effort,
    seed: u64,
    work: &mut Work,
) {
    let width = effort.of(match setting.solver {
        Solver::Newton(_) => [20, 96, 256],
        _ => [96, 272, 1024],
    });
    let mut trace = |solver, start| picture::trace(cup, solver, start, width, seed, work);
    let reference = trace(&Solver::Bernstein, Start::Certified);
    for count in counts {
        let picture = trace(&setting.solver, Start::Offset(count.offset));
        count.rays = picture.rays;
        count.pixels = picture.pixels();
        count.pixels_changed = picture.changed(&reference);
    }
}

fn outcome(setting: &Setting, counts: &[Count], work: Work) -> Outcome {
    let row = |count: &Count| {
        let names = values([setting.name.as_str(), &setting.point]);
        let numbers = values([setting.tolerance, count.offset, count.ratio]);
        let met = values([count.rays, count.self_hits, count.leaks]);
        let seen = values([count.pixels, count.pixels_changed]);
        [names, numbers, met, seen].concat()
    };
    Outcome {
        rows: counts.iter().map(row).collect(),
        work,
    }
}

/// A row of the table.
#[derive(Deserialize)]
struct Row {
    offset: f64,
    offset_over_tolerance: f64,
    rays: f64,
    self_hits: f64,
    leaks: f64,
    pixels: f64,
    pixels_changed: f64,
}

fn rows(table: &Table, solver: &str, point: &str) -> Vec<Row> {
    let part = table.filter("solver", &solver.into());
    part.filter("point", &point.into()).read()
}

/// Sum of a count, and of the rays, over the rows that pass.
fn total(rows: &[Row], pass: impl Fn(&Row) -> bool, count: impl Fn(&Row) -> f64) -> (u64, u64) {
    let passing = rows.iter().filter(|row| pass(row));
    let sums = passing.fold((0.0, 0.0), |sums, row| {
        (sums.0 + count(row), sums.1 + row.rays)
    });
    (sums.0 as u64, sums.1 as u64)
}

/// Changed pixels, and all, of the pictures that pass.
fn changed(rows: &[Row], pass: impl Fn(&Row) -> bool) -> (u64, u64) {
    let passing = rows.iter().filter(|row| pass(row));
    let sums = passing.fold((0.0, 0.0), |sums, row| {
        (sums.0 + row.pixels_changed, sums.1 + row.pixels)
    });
    (sums.0 as u64, sums.1 as u64)
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let newton = rows(table, "newton", "surface");
    let leave = rows(table, "bernstein", "leave");
    let walls = rows(table, "bernstein", "surface");
    let pictures = rows(table, "bernstein", "picture");
    let subject = |claim, statement| EXPERIMENT.subject(claim, statement, Effort::Smoke, effort);
    let none =
        |claim, statement, (failures, n)| Claim::exact(subject(claim, statement), failures, n);
    let some = |claim, statement, (hits, n), range| {
        Claim::share_in_range(subject(claim, statement), hits, n, range)
    };
    Conclusion {
        claims: vec![
            none(
                "two tolerances suffice",
                "At an offset of two tolerances or more from a point on the surface no ray meets the sheet it leaves.",
                total(
                    &newton,
                    |row| row.offset_over_tolerance >= 2.0,
                    |row| row.self_hits,
                ),
            ),
            some(
                "no offset fails",
                "Without an offset most rays meet the sheet they leave.",
                total(
                    &newton,
                    |row| row.offset_over_tolerance == 0.0,
                    |row| row.self_hits,
                ),
                MOST,
            ),
            none(
                "the certified offset suffices",
                "Rays that leave by the certified bound of the hit's error neither meet their sheet nor jump a wall.",
                total(&leave, |_| true, |row| row.self_hits + row.leaks),
            ),
            none(
                "small offsets do not leak",
                "Offsets up to 1e-3 jump no wall of the cup.",
                total(&walls, |row| row.offset <= SAFE_OFFSET, |row| row.leaks),
            ),
            some(
                "large offsets leak",
                "An offset of .3 jumps the rim and the base: the upper limit is real.",
                total(&walls, |row| row.offset >= JUMPING_OFFSET, |row| row.leaks),
                (0.1, 0.9),
            ),
            some(
                "no offset is acne",
                "Without an offset the picture of the cup is covered with acne, although the solver is certain.",
                changed(&pictures, |row| row.offset == 0.0),
                (0.05, 0.9),
            ),
            some(
                "the certified offset is in the plateau",
                "Offsets from the certified one to 1e-6 change fewer than two pixels in a thousand.",
                changed(&pictures, |row| {
                    row.offset_over_tolerance >= OFFSET_IN_ERRORS && row.offset <= 1e-6
                }),
                FEW,
            ),
            some(
                "large offsets are seen",
                "An offset of .3 changes the picture.",
                changed(&pictures, |row| row.offset >= JUMPING_OFFSET),
                (0.05, 0.9),
            ),
        ],
        plots: vec![cliff_plot(table), leak_plot(&walls), acne_plot(table)],
        ..Conclusion::default()
    }
}

/// Self-hit shares of all tolerances together, per kind of point.
fn cliff_plot(table: &Table) -> Plot {
    let points = [
        ("surface", "point put on the surface"),
        ("ray", "point left on the ray"),
    ];
    let series = points.map(|(point, name)| {
        let all = rows(table, "newton", point);
        let shown = RATIOS.into_iter().filter(|&ratio| ratio <= 4.0);
        let count = |ratio: f64| {
            let same = |row: &Row| row.offset_over_tolerance == ratio;
            let (hits, n) = total(&all, same, |row| row.self_hits);
            (ratio, hits, n)
        };
        Series::shares(name, shown.map(count))
    });
    Plot::new(
        "The eps cliff: two tolerances suffice",
        Axis::linear("offset / tolerance"),
        Axis::linear("share of rays that meet their sheet"),
        series,
    )
}

/// Changed pixels against the offset in error bounds or tolerances; offset 0 has no place on a logarithmic axis.
fn acne_plot(table: &Table) -> Plot {
    let solvers = [
        ("bernstein", "bernstein, bounds of the hit's error"),
        ("newton", "newton, tolerances 1e-6 and 1e-10"),
    ];
    let series = solvers.map(|(solver, name)| {
        let shown = rows(table, solver, "picture").into_iter();
        let counts = shown.filter(|row| row.offset > 0.0).map(|row| {
            let [hits, n] = [row.pixels_changed, row.pixels].map(|x| x as u64);
            (row.offset_over_tolerance, hits, n)
        });
        Series::shares(name, counts)
    });
    Plot::new(
        "Acne on the left, leaks on the right: pixels that differ from the certified picture",
        Axis::log("offset / tolerance"),
        Axis::linear("share of pixels changed"),
        series,
    )
}

fn leak_plot(walls: &[Row]) -> Plot {
    let counts = walls
        .iter()
        .map(|row| (row.offset, row.leaks as u64, row.rays as u64));
    Plot::new(
        "The upper limit: large offsets jump walls",
        Axis::log("offset (world units)"),
        Axis::linear("share of starts behind another sheet"),
        [Series::shares("cup, rim and base .04 to .2 thick", counts)],
    )
}

#[cfg(test)]
mod tests {
    use super::departure::Departure;
    use super::*;

    fn table(self_hits_at_two: u64, leaks_at_leave: u64, changed_at_leave: u64) -> Table {
        let row = |solver: &str, point: &str, [offset, ratio]: [f64; 2], counts: [u64; 2]| {
            let names = values([solver, point]);
            let numbers = values([1.0, offset, ratio, 1000.0]);
            [names, numbers, values(counts), values([0_u64; 2])].concat()
        };
        let picture = |offset: f64, ratio: f64, changed: u64| {
            let names = values(["bernstein", "picture"]);
            let counts = values([5000_u64, 0, 0, 10_000, changed]);
            [names, values([1.0, offset, ratio]), counts].concat()
        };
        EXPERIMENT.table(vec![
            row("newton", "surface", [0.0, 0.0], [700, 0]),
            row("newton", "surface", [2e-6, 2.0], [self_hits_at_two, 0]),
            row("bernstein", "leave", [1e-13, 4.0], [0, leaks_at_leave]),
            row("bernstein", "surface", [1e-6, 1e7], [0, 0]),
            row("bernstein", "surface", [0.3, 1e13], [0, 400]),
            picture(0.0, 0.0, 3000),
            picture(1e-13, 4.0, changed_at_leave),
            picture(0.3, 1e13, 2000),
        ])
    }

    #[test]
    fn a_self_hit_or_a_leak_where_none_may_be_fails_its_claim() {
        let failed = |table: &Table| -> Vec<bool> {
            let claims = conclude(table, Effort::Smoke).claims;
            claims.iter().map(Claim::fails_the_run).collect()
        };
        let only = |claim: Option<usize>| (0..8).map(|i| Some(i) == claim).collect::<Vec<bool>>();
        assert_eq!(failed(&table(0, 0, 0)), only(None));
        assert_eq!(failed(&table(1, 0, 0)), only(Some(0)));
        assert_eq!(failed(&table(0, 1, 0)), only(Some(2)));
        assert_eq!(failed(&table(0, 0, 100)), only(Some(6)));
    }

    /// A start pushed through the floor of the cup (.04 above the base at the axis) jumps the wall; a shorter push does not.
    #[test]
    fn a_start_beyond_a_wall_is_a_leak() {
        let surface = Revolution::new(Profile::cup(), Placement::identity());
        let up = Ray::new(DVec3::new(1.0, -5.0, 0.0), DVec3::Y);
        let mut work = Work::default();
        let crossing = surface.nearest(&up, &Solver::Bernstein, &mut work).unwrap();
        let hit = surface.hit(&up, crossing);
        let departure = Departure {
            hit,
            point: hit.point,
            normal: -hit.normal,
            direction: -hit.normal,
            cosine: 1.0,
        };
        assert!(!departure.jumps_a_wall(0.01, &surface, &mut work));
        assert!(departure.jumps_a_wall(0.3, &surface, &mut work));
        let inside = departure.leave(-1e-3);
        let met = |reach| {
            let solver = Solver::Bernstein;
            departure.meets_itself(&inside, reach, &surface, &solver, &mut Work::default())
        };
        assert!(met(2e-3) && !met(0.5e-3));
    }
}
