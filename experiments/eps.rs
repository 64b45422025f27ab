//! How far from the surface must the next ray start, and how far may it?

use super::cup::random_ray;
use crate::geometry::hit::{Hit, OFFSET_IN_ERRORS};
use crate::geometry::profile::Profile;
use crate::geometry::ray::Ray;
use crate::geometry::revolution::newton::NewtonSettings;
use crate::geometry::revolution::{Placement, Revolution, Solver};
use crate::lab::claim::{Claim, Subject};
use crate::lab::experiment::{Conclusion, Effort, Experiment, Outcome, Run};
use crate::lab::plot::{Axis, Plot, Series};
use crate::lab::table::{Table, Value};
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::statistics::binomial_interval;
use crate::numeric::work::Work;
use glam::DVec3;
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
             on the far side of another sheet. `point` says whether the hit was put on the surface or left where the ray's t \
             says.",
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
    let run = |solver: &str, point: &str, tolerance: f64| {
        Run::new([
            ("solver", solver.into()),
            ("point", point.into()),
            ("tolerance", tolerance.into()),
        ])
    };
    let mut runs = vec![
        run("bernstein", "leave", 0.0),
        run("bernstein", "surface", 0.0),
    ];
    for point in ["surface", "ray"] {
        for tolerance in TOLERANCES {
            runs.push(run("newton", point, tolerance));
        }
    }
    runs
}

/// A Newton ray costs about 50 µs an offset, a Bernstein one 1 µs.
fn rays(solver: &str, effort: Effort) -> u64 {
    match (solver, effort) {
        ("bernstein", Effort::Smoke) => 100_000,
        ("bernstein", Effort::Standard) => 3_000_000,
        ("bernstein", Effort::Full) => 30_000_000,
        (_, Effort::Smoke) => 700,
        (_, Effort::Standard) => 30_000,
        (_, Effort::Full) => 1_000_000,
    }
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
        let start = surface.start(&self.hit, side, self.direction, work);
        Ray::new(start, self.direction)
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
#[derive(Clone, Copy)]
struct Count {
    offset: f64,
    ratio: f64,
    rays: u64,
    self_hits: u64,
    leaks: u64,
}

impl Count {
    fn new(offset: f64, ratio: f64) -> Self {
        Self {
            offset,
            ratio,
            rays: 0,
            self_hits: 0,
            leaks: 0,
        }
    }

    fn row(&self, setting: &Setting) -> Vec<Value> {
        vec![
            setting.name.as_str().into(),
            setting.point.as_str().into(),
            setting.tolerance.into(),
            self.offset.into(),
            self.ratio.into(),
            self.rays.into(),
            self.self_hits.into(),
            self.leaks.into(),
        ]
    }
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
        let in_tolerances = |ratio: f64| Count::new(ratio * self.tolerance, ratio);
        match (self.name.as_str(), self.point.as_str()) {
            ("newton", _) => RATIOS.map(in_tolerances).to_vec(),
            (_, "leave") => vec![in_tolerances(OFFSET_IN_ERRORS)],
            _ => OFFSETS
                .map(|offset| Count::new(offset, offset / self.tolerance))
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
    Ok(Outcome {
        rows: counts.iter().map(|count| count.row(&setting)).collect(),
        work,
    })
}

/// A row as numbers.
struct Row {
    offset: f64,
    ratio: f64,
    rays: f64,
    self_hits: f64,
    leaks: f64,
}

fn rows(table: &Table, solver: &str, point: &str) -> Vec<Row> {
    let part = table.filter("solver", &solver.into());
    let part = part.filter("point", &point.into());
    let names = [
        "offset",
        "offset_over_tolerance",
        "rays",
        "self_hits",
        "leaks",
    ];
    let row = |[offset, ratio, rays, self_hits, leaks]: [f64; 5]| Row {
        offset,
        ratio,
        rays,
        self_hits,
        leaks,
    };
    part.select(names).into_iter().map(row).collect()
}

/// Sum of a count, and of the rays, over the rows that pass.
fn total(rows: &[Row], pass: impl Fn(&Row) -> bool, count: impl Fn(&Row) -> f64) -> (u64, u64) {
    let passing = || rows.iter().filter(|row| pass(row));
    let sum = passing().map(&count).sum::<f64>();
    (
        sum as u64,
        passing().map(|row| row.rays).sum::<f64>() as u64,
    )
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let subject = |claim, statement| Subject {
        experiment: EXPERIMENT.name,
        claim,
        statement,
        decided_at: Effort::Smoke,
        effort,
    };
    let newton = rows(table, "newton", "surface");
    let leave = rows(table, "bernstein", "leave");
    let walls = rows(table, "bernstein", "surface");
    let (far, far_rays) = total(&newton, |row| row.ratio >= 2.0, |row| row.self_hits);
    let (near, near_rays) = total(&newton, |row| row.ratio == 0.0, |row| row.self_hits);
    let (bad, left) = total(&leave, |_| true, |row| row.self_hits + row.leaks);
    let (early, safe_rays) = total(&walls, |row| row.offset <= SAFE_OFFSET, |row| row.leaks);
    let (jumps, wide_rays) = total(&walls, |row| row.offset >= JUMPING_OFFSET, |row| row.leaks);
    let share = |hits: u64, n: u64| (hits as f64 / n as f64, binomial_interval(hits, n, 0.95));
    let (most, most_interval) = share(near, near_rays);
    let (jumped, jumped_interval) = share(jumps, wide_rays);
    let twice = "At an offset of two tolerances or more from a point on the surface no ray meets the sheet it leaves.";
    let none = "Without an offset most rays meet the sheet they leave.";
    let certified = "Rays that leave by the certified bound of the hit's error neither meet their sheet nor jump a wall.";
    let thin = "Offsets up to 1e-3 jump no wall of the cup.";
    let thick = "An offset of .3 jumps the rim and the base: the upper limit is real.";
    Conclusion {
        claims: vec![
            Claim::exact(subject("two tolerances suffice", twice), far, far_rays),
            Claim::in_range(
                subject("no offset fails", none),
                most,
                most_interval,
                near_rays,
                MOST,
            ),
            Claim::exact(
                subject("the certified offset suffices", certified),
                bad,
                left,
            ),
            Claim::exact(subject("small offsets do not leak", thin), early, safe_rays),
            Claim::in_range(
                subject("large offsets leak", thick),
                jumped,
                jumped_interval,
                wide_rays,
                (0.1, 0.9),
            ),
        ],
        plots: vec![cliff_plot(table), leak_plot(&walls)],
    }
}

/// Self-hit shares of all tolerances together, per kind of point.
fn cliff_plot(table: &Table) -> Plot {
    let series = [
        ("surface", "point put on the surface"),
        ("ray", "point left on the ray"),
    ];
    let series = series.map(|(point, name)| {
        let all = rows(table, "newton", point);
        let counts: Vec<(f64, u64, u64)> = RATIOS
            .iter()
            .filter(|&&ratio| ratio <= 4.0)
            .map(|&ratio| {
                let same = |row: &Row| row.ratio == ratio;
                let (hits, n) = total(&all, same, |row| row.self_hits);
                (ratio, hits, n)
            })
            .collect();
        let share = |&(ratio, hits, n): &(f64, u64, u64)| (ratio, hits as f64 / n as f64);
        Series {
            name: name.to_owned(),
            points: counts.iter().map(share).collect(),
            intervals: (counts.iter())
                .map(|&(_, hits, n)| binomial_interval(hits, n, 0.95))
                .collect(),
            predicted: false,
        }
    });
    Plot {
        title: "The eps cliff: two tolerances suffice".to_owned(),
        x: Axis::linear("offset / tolerance"),
        y: Axis::linear("share of rays that meet the sheet they leave"),
        series: series.to_vec(),
    }
}

fn leak_plot(walls: &[Row]) -> Plot {
    Plot {
        title: "The upper limit: large offsets jump walls".to_owned(),
        x: Axis::log("offset, world units"),
        y: Axis::linear("share of starts behind another sheet"),
        series: vec![Series {
            name: "cup, rim and base .04 to .2 thick".to_owned(),
            points: walls
                .iter()
                .map(|row| (row.offset, row.leaks / row.rays))
                .collect(),
            intervals: (walls.iter())
                .map(|row| binomial_interval(row.leaks as u64, row.rays as u64, 0.95))
                .collect(),
            predicted: false,
        }],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(self_hits_at_two: u64, leaks_at_leave: u64) -> Table {
        let row = |solver: &str, point: &str, offset: f64, ratio: f64, counts: [u64; 2]| {
            vec![
                solver.into(),
                point.into(),
                1.0.into(),
                offset.into(),
                ratio.into(),
                1000_u64.into(),
                counts[0].into(),
                counts[1].into(),
            ]
        };
        Table {
            columns: EXPERIMENT.columns.iter().map(|&c| c.to_owned()).collect(),
            rows: vec![
                row("newton", "surface", 0.0, 0.0, [700, 0]),
                row("newton", "surface", 2e-6, 2.0, [self_hits_at_two, 0]),
                row("bernstein", "leave", 1e-13, 4.0, [0, leaks_at_leave]),
                row("bernstein", "surface", 1e-6, 1e7, [0, 0]),
                row("bernstein", "surface", 0.3, 1e13, [0, 400]),
            ],
        }
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
