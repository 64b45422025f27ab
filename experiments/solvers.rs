//! Which solver is right, on which rays, and at what price?

mod bounds;
mod checked;
mod conclusion;
pub mod library;
mod roster;

use crate::geometry::hit::Crossing;
use crate::geometry::ray::Ray;
use crate::geometry::revolution::{Placement, Revolution, exact};
use crate::geometry::specimens::Specimen;
use crate::lab::experiment::{Effort, Experiment, Outcome, Run, Timing, grid, values};
use crate::lab::families::{Family, Target};
use crate::lab::grade::{Asked, Verdict, judge};
use crate::lab::table::Value;
use crate::numeric::clock::ThreadClock;
use crate::numeric::work::Work;
use bounds::Bounds;
use clap::ValueEnum;
use roster::{BERNSTEIN, Contestant, contestants};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "solvers",
    question: "Which solver finds the nearest crossing, on which rays, and what does it cost?",
    prediction: "Bernstein: no failure in any family, and t within 16 roundings of the coordinates over the cosine. Newton's method and \
                 the polynomial root finder do well on random rays and fail on the hard ones: level rays (d_y = 0) have no \
                 start for Newton, and are a double root for a polynomial. Certainty is also the fastest.",
    method: "Twelve profiles, each with the families of rays that fit it; all solvers answer the same rays. The truth is the exact oracle; \
             a hit is right if its t is that of the nearest crossing within the solver's own accuracy, and a miss only if there is \
             none: no answer is excused as a graze. Errors of right hits are relative to the size of the coordinates, s = |o| + t |d| or, if \
             greater, radius + height of the surface; `max_ulps` counts ε s/|n · d| (at an edge, with \
             the piece that the ray meets more flatly: the hit may be told as either's). `bounded` counts the default solver's hits that come \
             with a bound of their errors (`bound_ulps`: its median, in the same unit), `bounds_broken` those whose error of t, u or \
             the normal exceeds it. `bernstein-checked` answers many more rays, in batches, next to Bezier clipping; only where the two \
             differ does the oracle decide (its errors are of those rays; a fault that both share would not be seen): 10⁷ random ones at standard \
             effort and 10⁹ at full, of every other family 10⁶ and 10⁷ over all profiles, as many for random profiles (a new one \
             for every 200 rays; all families that find one), and as many by which camera paths leave the glass of the scenes. On random rays the default solver also runs without one ingredient at a time. Times are CPU time a ray, the median over chunks of rays; polycool (kurbo) and Bezier clipping \
             (Nishita, Sederberg and Kakimoto 1990) stand for what one would use instead.",
    columns: &[
        "solver",
        "starts",
        "profile",
        "family",
        "rays",
        "true_hits",
        "miss",
        "phantom",
        "wrong",
        "max_t_error",
        "p99_t_error",
        "ns_per_ray",
        "work",
        "max_ulps",
        "bounded",
        "bounds_broken",
        "bound_ulps",
    ],
    timing: Timing::OwnThread,
    cpu_seconds: [9.0, 480.0, 7000.0],
    plan,
    execute,
    conclude: conclusion::conclude,
};

/// Scenes whose camera paths give rays.
const SCENES: [&str; 3] = ["cup", "hourglass", "gallery"];
/// The run of random profiles.
const RANDOM_PROFILES: &str = "random profiles";

fn plan(_effort: Effort) -> Vec<Run> {
    let profiles = Specimen::ALL.map(|s| s.name()).into_iter();
    let scenes = SCENES.map(|name| format!("{SCENE}{name}"));
    let others = scenes.into_iter().chain([RANDOM_PROFILES.to_owned()]);
    grid([("profile", values(profiles.chain(others)))])
}

/// Before the name of a scene in the place of a profile's.
const SCENE: &str = "scene ";

/// Rays of a family that every solver answers; the two profiles of rendered scenes get more of them.
fn rays(specimen: Specimen, family: Family, effort: Effort) -> u64 {
    let scene = matches!(specimen, Specimen::Cup | Specimen::Hourglass);
    effort.of(match (scene, family) {
        (true, Family::Random) => [2000, 50_000, 400_000],
        (true, _) => [100, 2000, 16_000],
        (false, _) => [40, 1000, 8000],
    })
}

/// Chunks of rays over which the time of a ray is a median.
const CHUNKS: u64 = 20;

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let name = run.text("profile");
    let tallies = if let Some(specimen) = Specimen::ALL.into_iter().find(|s| s.name() == name) {
        of_profile(specimen, effort, seed)?
    } else if let Some(scene) = name.strip_prefix(SCENE) {
        checked::check_scene(scene, effort, seed)?
    } else {
        checked::check_random(effort, seed)?
    };
    let mut outcome = Outcome::default();
    for (family, tally) in tallies {
        outcome.work += tally.work;
        outcome.rows.push(tally.row(run, family));
    }
    Ok(outcome)
}

/// What all solvers did on a profile, and the default one on many more rays.
fn of_profile(
    specimen: Specimen,
    effort: Effort,
    seed: u64,
) -> anyhow::Result<Vec<(Family, Tally)>> {
    let surface = Revolution::new(specimen.profile(), Placement::identity());
    let target = Target::new(&surface);
    let mut tallies = Vec::new();
    for &family in Family::value_variants() {
        if target.fits(family).is_ok() {
            let count = rays(specimen, family, effort);
            let compared = compare(&target, &surface, family, count, seed)?;
            tallies.extend(compared.into_iter().map(|tally| (family, tally)));
            let count = checked::rays(specimen, family, effort);
            let tally = checked::check(&target, &surface, family, count, seed)?;
            tallies.push((family, tally));
        }
    }
    Ok(tallies)
}

/// Lets every solver answer the same rays.
fn compare(
    target: &Target,
    surface: &Revolution,
    family: Family,
    count: u64,
    seed: u64,
) -> anyhow::Result<Vec<Tally>> {
    let all = contestants(surface, family);
    let mut tallies: Vec<Tally> = all.into_iter().map(Tally::new).collect();
    let mut bounds = Bounds::default();
    let chunk = count.div_ceil(CHUNKS);
    for start in (0..count).step_by(chunk as usize) {
        let indices = start..count.min(start + chunk);
        let rays = indices.map(|index| target.ray(family, &mut family.stream(seed, index)));
        let rays: Vec<Ray> = rays.collect::<Result<_, _>>()?;
        let truth = |ray| {
            let truths = exact::crossings(surface.profile(), ray);
            (asked(surface, ray, &truths), truths)
        };
        let truths: Vec<_> = rays.iter().map(truth).collect();
        for tally in &mut tallies {
            tally.measure(surface, &rays, &truths);
        }
        bounds.add(surface, &rays, &truths);
    }
    for tally in &mut tallies {
        if tally.contestant.name == BERNSTEIN {
            tally.bounds = std::mem::take(&mut bounds);
        }
    }
    Ok(tallies)
}

/// What is true of a ray with these crossings. The margin is infinite: nothing is excused.
fn asked(surface: &Revolution, ray: &Ray, truths: &[Crossing]) -> Asked {
    let (radius, height) = surface.profile().control_size();
    let nearest = truths.first().map(|&crossing| {
        let cosine = |crossing| {
            let normal = surface.hit(ray, crossing).normal;
            normal.dot(ray.direction.normalize()).abs()
        };
        let edge = neighbour(surface, crossing).map_or(1.0, cosine);
        (crossing.t, cosine(crossing).min(edge))
    });
    let distance = ray.origin.length();
    let speed = ray.direction.length();
    Asked {
        number: 0,
        family: String::new(),
        distance,
        speed,
        nearest,
        scale: (distance + nearest.map_or(0.0, |(t, _)| t.abs() * speed)).max(radius + height),
        margin: f64::INFINITY,
    }
}

/// A crossing this near to an end of its piece may be told as one of the next piece.
const EDGE: f64 = 1e-9;

/// The same crossing on the piece next to it, for one on an edge.
fn neighbour(surface: &Revolution, crossing: Crossing) -> Option<Crossing> {
    let pieces = surface.profile().pieces().len() as u32;
    let next = |piece, u| {
        Some(Crossing {
            piece,
            u,
            ..crossing
        })
    };
    if crossing.u < EDGE {
        next((crossing.piece + pieces - 1) % pieces, 1.0)
    } else if crossing.u > 1.0 - EDGE {
        next((crossing.piece + 1) % pieces, 0.0)
    } else {
        None
    }
}

/// What a solver did so far.
struct Tally {
    contestant: Contestant,
    rays: u64,
    true_hits: u64,
    miss: u64,
    phantom: u64,
    wrong: u64,
    errors: Vec<f64>,
    max_ulps: f64,
    ns: Vec<f64>,
    work: Work,
    bounds: Bounds,
}

impl Tally {
    fn new(contestant: Contestant) -> Self {
        Self {
            contestant,
            rays: 0,
            true_hits: 0,
            miss: 0,
            phantom: 0,
            wrong: 0,
            errors: Vec::new(),
            max_ulps: 0.0,
            ns: Vec::new(),
            work: Work::default(),
            bounds: Bounds::default(),
        }
    }

    fn failures(&self) -> u64 {
        self.miss + self.phantom + self.wrong
    }

    /// The contestant's answers, timed.
    fn time(&mut self, surface: &Revolution, rays: &[Ray]) -> Vec<Option<f64>> {
        let clock = ThreadClock::start();
        let answers = self.contestant.answer(surface, rays, &mut self.work);
        self.ns.push(clock.seconds() * 1e9 / rays.len() as f64);
        self.rays += rays.len() as u64;
        answers
    }

    fn measure(&mut self, surface: &Revolution, rays: &[Ray], truths: &[(Asked, Vec<Crossing>)]) {
        let answers = self.time(surface, rays);
        for ((asked, _), answer) in truths.iter().zip(answers) {
            self.judge(asked, answer);
        }
    }

    fn judge(&mut self, asked: &Asked, answer: Option<f64>) {
        self.true_hits += u64::from(asked.nearest.is_some());
        let judged = judge(asked, answer, self.contestant.tolerance);
        match judged.verdict {
            Verdict::Right => {}
            Verdict::Miss => self.miss += 1,
            Verdict::Phantom => self.phantom += 1,
            Verdict::Wrong | Verdict::Ambiguous => self.wrong += 1,
        }
        if let Some(error) = judged.error {
            self.errors.push(error.distance / asked.scale);
            let cosine = asked.nearest.map_or(1.0, |(_, cosine)| cosine);
            let ulps = error.distance * cosine / (f64::EPSILON * asked.scale);
            self.max_ulps = self.max_ulps.max(ulps);
        }
    }

    fn row(mut self, run: &Run, family: Family) -> Vec<Value> {
        self.errors.sort_by(f64::total_cmp);
        self.ns.sort_by(f64::total_cmp);
        let rank = |values: &[f64], percent: usize| {
            let place = (values.len() * percent).div_ceil(100).max(1) - 1;
            values.get(place).copied().unwrap_or(0.0)
        };
        let mut row = vec![
            self.contestant.name.into(),
            u64::from(self.contestant.starts).into(),
            run.value("profile").clone(),
            family.name().into(),
        ];
        row.extend(values([
            self.rays,
            self.true_hits,
            self.miss,
            self.phantom,
            self.wrong,
        ]));
        row.extend(values([
            rank(&self.errors, 100),
            rank(&self.errors, 99),
            rank(&self.ns, 50),
            self.work.solver_iterations as f64 / self.rays.max(1) as f64,
            self.max_ulps,
        ]));
        row.extend(values([self.bounds.stated, self.bounds.broken]));
        row.push(self.bounds.typical_ulps().into());
        row
    }
}
