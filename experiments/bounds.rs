//! Which bounding volume saves most, and does any ever cost a hit?

mod conclusion;

use crate::geometry::bounds::{Bounding, Cylinder};
use crate::geometry::hit::Crossing;
use crate::geometry::ray::Ray;
use crate::geometry::revolution::{Placement, Revolution, Solver, exact};
use crate::geometry::specimens::Specimen;
use crate::lab::experiment::{Effort, Experiment, Outcome, Run, Timing, grid, values};
use crate::lab::families::{Family, Target};
use crate::lab::table::Value;
use crate::numeric::clock::ThreadClock;
use crate::numeric::rng::{Purpose, Stream, mix};
use crate::numeric::work::Work;
use glam::DVec3;
use std::f64::consts::TAU;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "bounds",
    question: "Which volume around a surface of revolution keeps most rays from its solver, at what price, and does any ever lose a hit?",
    prediction: "None loses or changes a hit. Of nested volumes the tighter culls at least as many rays: pieces, cylinder, hull; \
                 cylinder, box; pieces, sphere. Pieces are the tightest, but test every piece; the one tight cylinder is the \
                 fastest, or within a half of the fastest, on the profiles of rendered scenes.",
    method: "The default solver behind each volume answers the same rays; every hit must have the bits (t, piece, u) of the hit \
             without a volume, and of a part of the rays the exact oracle says whether there is a hit. Tightness is the culled \
             share of the rays that hit nothing. Families of the lab, and `wide`: past the surface, at uniform points of the ball \
             of twice the bounding sphere's radius, from four of its radii away. Times are CPU time a ray, the median over \
             chunks of rays, volumes in turns.",
    columns: &[
        "volume",
        "profile",
        "family",
        "rays",
        "true_hits",
        "culled",
        "true_misses",
        "tightness",
        "bounds_tests",
        "solver_calls",
        "checked",
        "checked_hits",
        "lost_hits",
        "differing_hits",
        "ns_per_ray",
    ],
    timing: Timing::OwnThread,
    cpu_seconds: [2.0, 65.0, 500.0],
    plan: |_| grid([("profile", values(PROFILES.map(|s| s.name())))]),
    execute,
    conclude: conclusion::conclude,
};

/// The profiles of rendered scenes, then traits that make volumes loose: waves, a crossing, a waist, flat and upright parts.
const PROFILES: [Specimen; 6] = [
    Specimen::Cup,
    Specimen::Hourglass,
    Specimen::Wave,
    Specimen::Loop,
    Specimen::Neck,
    Specimen::Degenerate,
];

/// A family of rays.
#[derive(Clone, Copy)]
enum Rays {
    /// One of the lab's.
    Family(Family),
    /// Of which most miss.
    Wide,
}

const FAMILIES: [Rays; 6] = [
    Rays::Wide,
    Rays::Family(Family::Random),
    Rays::Family(Family::Axis),
    Rays::Family(Family::Far),
    Rays::Family(Family::Joints),
    Rays::Family(Family::Grazes),
];

/// The name of [`Rays::Wide`].
const WIDE: &str = "wide";
/// Chunks of rays over which the time of a ray is a median.
const CHUNKS: u64 = 10;

impl Rays {
    fn name(self) -> String {
        match self {
            Self::Family(family) => family.name(),
            Self::Wide => WIDE.to_owned(),
        }
    }

    fn ray(
        self,
        target: &Target,
        cylinder: &Cylinder,
        seed: u64,
        index: u64,
    ) -> anyhow::Result<Ray> {
        Ok(match self {
            Self::Family(family) => target.ray(family, &mut family.stream(seed, index))?,
            Self::Wide => {
                let index = mix(&[u64::MAX, index]);
                wide(cylinder, &mut Stream::new(seed, Purpose::Experiment, index))
            }
        })
    }
}

fn wide(cylinder: &Cylinder, s: &mut Stream) -> Ray {
    let half = 0.5 * (cylinder.top - cylinder.bottom);
    let middle = DVec3::new(0.0, cylinder.bottom + half, 0.0);
    let radius = libm::hypot(cylinder.radius, half);
    let mut towards = || {
        let y = s.range(-1.0, 1.0);
        let (sin, cos) = libm::sincos(TAU * s.uniform());
        let ring = (1.0 - y * y).sqrt();
        DVec3::new(ring * sin, y, ring * cos)
    };
    let (from, to) = (towards(), towards());
    let origin = middle + 4.0 * radius * from;
    let target = middle + 2.0 * radius * libm::cbrt(s.uniform()) * to;
    Ray::new(origin, (target - origin).normalize())
}

/// Rays of a family, and how many of them the oracle answers too. On rays along the axis, at joints and at grazes the solver often
/// falls back to exact arithmetic, which no volume changes.
fn sizes(family: Rays, effort: Effort) -> (u64, u64) {
    let easy = matches!(
        family,
        Rays::Wide | Rays::Family(Family::Random | Family::Far)
    );
    effort.of(if easy {
        [(20_000, 100), (550_000, 8000), (5_500_000, 50_000)]
    } else {
        [(200, 100), (15_000, 8000), (150_000, 50_000)]
    })
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let name = run.text("profile");
    let specimen = PROFILES.into_iter().find(|s| s.name() == name);
    let specimen = specimen.ok_or_else(|| anyhow::anyhow!("no profile {name}"))?;
    let new = |kind| Revolution::new(specimen.profile(), Placement::identity()).bounded_by(kind);
    let surfaces = Bounding::ALL.map(new);
    let target = Target::new(&surfaces[0]);
    let mut outcome = Outcome::default();
    for family in FAMILIES {
        let (count, checked) = sizes(family, effort);
        let mut tallies = Bounding::ALL.map(|_| Tally::default());
        let chunk = count.div_ceil(CHUNKS);
        for (turn, start) in (0..count).step_by(chunk as usize).enumerate() {
            let indices = start..count.min(start + chunk);
            let rays = indices.map(|i| family.ray(&target, surfaces[0].cylinder(), seed, i));
            let rays: Vec<Ray> = rays.collect::<anyhow::Result<_>>()?;
            let checked = (checked / CHUNKS) as usize;
            compare(&surfaces, &rays, checked, turn, &mut tallies);
        }
        for (name, tally) in Bounding::NAMES.into_iter().zip(tallies) {
            outcome.work += tally.work;
            outcome
                .rows
                .push(tally.row(name, &specimen.name(), &family.name()));
        }
    }
    Ok(outcome)
}

/// What happened behind one volume so far.
#[derive(Default)]
struct Tally {
    rays: u64,
    /// Hits without a volume.
    true_hits: u64,
    /// Rays that the oracle answered.
    checked: u64,
    /// Of these, rays that hit.
    checked_hits: u64,
    /// Of these, rays that got no hit.
    lost_hits: u64,
    /// Rays whose answer has other bits than that without a volume.
    differing_hits: u64,
    ns: Vec<f64>,
    work: Work,
}

/// Lets the surface answer the rays behind every volume; the first has none. The oracle answers the first `checked` rays.
fn compare(
    surfaces: &[Revolution; 6],
    rays: &[Ray],
    checked: usize,
    turn: usize,
    tallies: &mut [Tally; 6],
) {
    let mut answers: [Vec<Option<Crossing>>; 6] = Default::default();
    for i in 0..surfaces.len() {
        let i = (i + turn) % surfaces.len();
        let (surface, tally) = (&surfaces[i], &mut tallies[i]);
        let clock = ThreadClock::start();
        let found = rays
            .iter()
            .map(|ray| surface.nearest(ray, &Solver::Bernstein, &mut tally.work));
        answers[i] = found.collect();
        tally.ns.push(clock.seconds() * 1e9 / rays.len() as f64);
    }
    let oracle = rays.iter().take(checked);
    let hits: Vec<bool> = oracle
        .map(|ray| !exact::crossings(surfaces[0].profile(), ray).is_empty())
        .collect();
    for (tally, found) in tallies.iter_mut().zip(&answers) {
        tally.judge(found, &answers[0], &hits);
    }
}

impl Tally {
    fn judge(&mut self, found: &[Option<Crossing>], bare: &[Option<Crossing>], hits: &[bool]) {
        let count = |holds: &mut dyn Iterator<Item = bool>| holds.filter(|&x| x).count() as u64;
        self.rays += found.len() as u64;
        self.true_hits += count(&mut bare.iter().map(Option::is_some));
        self.checked += hits.len() as u64;
        self.checked_hits += count(&mut hits.iter().copied());
        let lost = hits
            .iter()
            .zip(found)
            .map(|(&hit, found)| hit && found.is_none());
        self.lost_hits += count(&mut { lost });
        let differ = found.iter().zip(bare).map(|(a, b)| bits(a) != bits(b));
        self.differing_hits += count(&mut { differ });
    }

    fn row(mut self, volume: &str, profile: &str, family: &str) -> Vec<Value> {
        self.ns.sort_by(f64::total_cmp);
        let misses = self.rays - self.true_hits;
        let work = &self.work;
        let tightness = work.bounds_culled as f64 / misses as f64;
        let mut row = values([volume, profile, family]);
        row.extend(values([
            self.rays,
            self.true_hits,
            work.bounds_culled,
            misses,
        ]));
        row.push(tightness.into());
        row.extend(values([work.bounds_tests, work.solver_calls]));
        row.extend(values([self.checked, self.checked_hits]));
        row.extend(values([self.lost_hits, self.differing_hits]));
        row.push(self.ns[self.ns.len() / 2].into());
        row
    }
}

fn bits(found: &Option<Crossing>) -> Option<(u64, u32, u64)> {
    found.map(|hit| (hit.t.to_bits(), hit.piece, hit.u.to_bits()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hit(t: f64) -> Option<Crossing> {
        Some(Crossing {
            t,
            piece: 1,
            u: 0.5,
        })
    }

    #[test]
    fn lost_and_changed_hits_are_counted() {
        let bare = [hit(1.0), hit(2.0), None, hit(4.0)];
        let mut same = Tally::default();
        same.judge(&bare, &bare, &[true, true]);
        assert_eq!((same.true_hits, same.checked_hits), (3, 2));
        assert_eq!((same.lost_hits, same.differing_hits), (0, 0));
        let mut wrong = Tally::default();
        let found = [None, hit(2.0_f64.next_up()), None, None];
        wrong.judge(&found, &bare, &[true, true, false]);
        assert_eq!((wrong.lost_hits, wrong.differing_hits), (1, 3));
    }

    /// Were the volume of another profile's, hits would be lost.
    #[test]
    fn a_volume_too_small_is_seen() {
        let surface = |profile: Specimen| Revolution::new(profile.profile(), Placement::identity());
        let cup = surface(Specimen::Cup);
        let target = Target::new(&cup);
        let small = Cylinder {
            radius: 0.9 * cup.cylinder().radius,
            ..*cup.cylinder()
        };
        let rays = (0..400).map(|i| FAMILIES[1].ray(&target, cup.cylinder(), 1, i).unwrap());
        let rays: Vec<Ray> = rays.collect();
        let nearest = |ray: &Ray| cup.nearest(ray, &Solver::Bernstein, &mut Work::default());
        let bare: Vec<_> = rays.iter().map(nearest).collect();
        let behind = |ray: &Ray| small.interval(ray).and_then(|_| nearest(ray));
        let found: Vec<_> = rays.iter().map(behind).collect();
        let hits: Vec<bool> = bare.iter().map(Option::is_some).collect();
        let mut tally = Tally::default();
        tally.judge(&found, &bare, &hits);
        assert!(tally.lost_hits > 0 && tally.differing_hits == tally.lost_hits);
    }

    #[test]
    fn most_wide_rays_miss() {
        let surface = Revolution::new(Specimen::Cup.profile(), Placement::identity());
        let target = Target::new(&surface);
        let hits = (0..500).filter(|&i| {
            let ray = Rays::Wide.ray(&target, surface.cylinder(), 1, i).unwrap();
            let found = surface.nearest(&ray, &Solver::Bernstein, &mut Work::default());
            found.is_some()
        });
        assert!((25..200).contains(&hits.count()));
    }
}
