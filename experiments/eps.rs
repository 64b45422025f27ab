//! How far from the surface must the next ray start, and how far may it?

use super::cup::random_ray;
use crate::geometry::hit::{Hit, OFFSET_IN_ERRORS};
use crate::geometry::profile::Profile;
use crate::geometry::ray::Ray;
use crate::geometry::revolution::newton::NewtonSettings;
use crate::geometry::revolution::{Placement, Revolution, Solver};
use crate::lab::claim::Claim;
use crate::lab::experiment::{Conclusion, Effort, Experiment, Outcome, Run, Table, grid, values};
use crate::lab::plot::{Axis, Plot, Series};
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::work::Work;
use glam::DVec3;
use serde::Deserialize;
use std::f64::consts::TAU;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "eps",
    question: "How far off the surface must a ray start so that it does not meet the sheet it leaves, and when does it jump a wall?",
    prediction: "With a point on the surface and a residual accepted at max |F| <= tolerance, a false hit lies within √3 \
                 tolerances of the sheet: none at an offset of 2, most rays at 0. A point left where the ray says \
                 has the same error again. Walls are jumped from about the thickness of the rim and the base (.04 to .2) on.",
    method: "Random rays hit the cup; a ray leaves each hit on a random side of it, uniform in the cosine (0.05 to 1) to the \
             normal. A self-hit is a crossing of the same piece nearer than eight tolerances over the cosine; a leak is a start \
             on the far side of another sheet (Wächter and Binder 2019 on both). `point` says whether the hit was put on the \
             surface or left where the ray's t says.",
    columns: &[
        "solver",
        "point",
        "tolerance",
        "offset",
        "offset_over_tolerance",
        "rays",
        "self_hits",
        "leaks",
    ],
    timed: false,
    cpu_seconds: [2.0, 75.0, 1900.0],
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
    [bernstein, newton].concat()
}

/// A Newton ray costs about 50 µs an offset, a Bernstein one 1 µs.
fn rays(solver: &str, effort: Effort) -> u64 {
    effort.of(match solver {
        "bernstein" => [100_000, 3_000_000, 30_000_000],
        _ => [700, 30_000, 1_000_000],
    })
}

/// A point of the cup from which a ray leaves.
struct Departure {
    hit: Hit,
    /// The point that the start is off from.
    point: DVec3,
    /// Unit normal on the side of the ray.
    normal: DVec3,
    direction: DVec3,
    cosine: f64,
}

/// Hits of random rays, each with a random direction on a random side; rays that miss give none.
fn departure(
    surface: &Revolution,
    setting: &Setting,
    stream: &mut Stream,
    work: &mut Work,
) -> Option<Departure> {
    let ray = random_ray(stream);
    let hit = surface.hit(&ray, surface.nearest(&ray, &setting.solver, work)?);
    let normal = if stream.uniform() < 0.5 {
        hit.normal
    } else {
        -hit.normal
    };
    let cosine = stream.range(LEAST_COSINE, 1.0);
    let (sin, cos) = libm::sincos(TAU * stream.uniform());
    let (tangent, other) = normal.any_orthonormal_pair();
    let across = (1.0 - cosine * cosine).sqrt();
    Some(Departure {
        hit,
        point: if setting.point == "ray" {
            ray.at(hit.t)
        } else {
            hit.point
        },
        normal,
        direction: cosine * normal + across * (cos * tangent + sin * other),
        cosine,
    })
}

impl Departure {
    /// The certified start.
    fn certified(&self, surface: &Revolution, work: &mut Work) -> Ray {
        let side = self.hit.side_met(-self.direction);
        surface.leave(&self.hit, side, self.direction, work)
    }

    fn leave(&self, offset: f64) -> Ray {
        Ray::new(self.point + offset * self.normal, self.direction)
    }

    /// Whether the ray meets the piece it leaves within `reach` of the tangent plane.
    fn meets_itself(
        &self,
        ray: &Ray,
        reach: f64,
        surface: &Revolution,
        solver: &Solver,
        work: &mut Work,
    ) -> bool {
        let near = ray.until(reach / self.cosine);
        let crossing = surface.nearest(&near, solver, work);
        crossing.is_some_and(|c| c.piece == self.hit.piece)
    }

    /// Whether another sheet lies between the surface's point and a start at this offset.
    fn jumps_a_wall(&self, offset: f64, surface: &Revolution, work: &mut Work) -> bool {
        let mut path = Ray::new(self.hit.point, self.normal);
        path.t_min = ON_THE_SHEET;
        path.t_max = offset;
        surface.nearest(&path, &Solver::Bernstein, work).is_some()
    }
}

/// One line of the table.
#[derive(Clone, Copy, Default)]
struct Count {
    offset: f64,
    ratio: f64,
    rays: u64,
    self_hits: u64,
    leaks: u64,
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
            ("newton", _) => RATIOS.map(in_tolerances).to_vec(),
            (_, "leave") => vec![in_tolerances(OFFSET_IN_ERRORS)],
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
    let row = |count: &Count| {
        let names = values([setting.name.as_str(), &setting.point]);
        let numbers = values([setting.tolerance, count.offset, count.ratio]);
        let counts = values([count.rays, count.self_hits, count.leaks]);
        [names, numbers, counts].concat()
    };
    Ok(Outcome {
        rows: counts.iter().map(row).collect(),
        work,
    })
}

/// A row of the table.
#[derive(Deserialize)]
struct Row {
    offset: f64,
    offset_over_tolerance: f64,
    rays: f64,
    self_hits: f64,
    leaks: f64,
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

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let newton = rows(table, "newton", "surface");
    let leave = rows(table, "bernstein", "leave");
    let walls = rows(table, "bernstein", "surface");
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
        ],
        plots: vec![cliff_plot(table), leak_plot(&walls)],
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
    use super::*;

    fn table(self_hits_at_two: u64, leaks_at_leave: u64) -> Table {
        let row = |solver: &str, point: &str, [offset, ratio]: [f64; 2], counts: [u64; 2]| {
            let names = values([solver, point]);
            let numbers = values([1.0, offset, ratio, 1000.0]);
            [names, numbers, values(counts)].concat()
        };
        EXPERIMENT.table(vec![
            row("newton", "surface", [0.0, 0.0], [700, 0]),
            row("newton", "surface", [2e-6, 2.0], [self_hits_at_two, 0]),
            row("bernstein", "leave", [1e-13, 4.0], [0, leaks_at_leave]),
            row("bernstein", "surface", [1e-6, 1e7], [0, 0]),
            row("bernstein", "surface", [0.3, 1e13], [0, 400]),
        ])
    }

    #[test]
    fn a_self_hit_or_a_leak_where_none_may_be_fails_its_claim() {
        let failed = |table: &Table| -> Vec<bool> {
            let claims = conclude(table, Effort::Smoke).claims;
            claims.iter().map(Claim::fails_the_run).collect()
        };
        assert_eq!(failed(&table(0, 0)), [false; 5]);
        assert_eq!(failed(&table(1, 0)), [true, false, false, false, false]);
        assert_eq!(failed(&table(0, 1)), [false, false, true, false, false]);
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
