//! Does a ray ever pass through the surface unseen, or meet the sheet that it leaves?

mod inside;
mod parity;
mod paths;

use crate::geometry::profile::Profile;
use crate::geometry::revolution::{Placement, Revolution};
use crate::geometry::specimens::Specimen;
use crate::lab::claim::Claim;
use crate::lab::experiment::{
    Conclusion, Effort, Experiment, Outcome, Run, Table, Timing, grid, values,
};
use crate::numeric::clock::ThreadClock;
use crate::numeric::work::Work;
use glam::DVec3;
use serde::Deserialize;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "watertight",
    question: "Does a ray ever pass through the surface unseen, or meet the sheet that it leaves?",
    prediction: "Never: starts are proven to lie on their side, and every hit or miss is decided.",
    method: "Every check is by exact membership of points (`geometry::revolution::membership`), which shares no code with the \
             solvers. `paths`: random paths that reflect or refract, half and half, at every hit on glass (n = 1.5), aimed \
             at random, at joints, caps and folds, and past the surface. Each start, and at least two of three points of each straight part \
             longer than 1e-6 sizes (in a graze one may round to the other side), must be on the path's side; a ray inside must hit; a hit is met from the path's side. A hit from the wrong side within 64 \
             error bounds of the start is a self-hit, everything else wrong is a leak. `inside`: rays from points inside \
             (uniform, 1e-12 to 1e-3 sizes from the wall, at joints' heights, on the axis), in any direction, level, upright, \
             tangent, at a joint, must hit and leave. `parity`: the number of all crossings before a random point of the ray is \
             odd or even as the point's side tells; where not, the exact solver decides, and crossings that it does not have \
             count as self-hits, missing ones as missed escapes, others as leaks. A start that cannot be separated is counted and \
             ends its path.",
    columns: &[
        "campaign",
        "surface",
        "rays",
        "bounces",
        "self_hits",
        "leaks",
        "escapes_missed",
        "unseparated",
        "ns_per_ray",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [4.5, 60.0, 9000.0],
    plan,
    execute,
    conclude,
};

/// Closed solids whose outline does not cross itself.
const SOLIDS: [&str; 7] = [
    "cup",
    "cup-far",
    "hourglass",
    "thin-wall-1e-3",
    "thin-wall-1e-6",
    "thin-wall-1e-9",
    "thin-wall-1e-9-far",
];

/// Closed surfaces, crossing themselves or not; `random` is a new chain of random pieces for every thousand rays.
const CLOSED: [&str; 5] = ["cup", "cup-far", "hourglass", "loop", "random"];

/// Surfaces without a place that rounding cannot separate.
const ORDINARY: [&str; 3] = ["cup", "cup-far", "hourglass"];

fn plan(_effort: Effort) -> Vec<Run> {
    let runs = |campaign: &str, surfaces: &[&str]| {
        grid([
            ("campaign", values([campaign])),
            ("surface", values(surfaces.iter().copied())),
        ])
    };
    [
        runs("paths", &SOLIDS),
        runs("inside", &SOLIDS),
        runs("parity", &CLOSED),
    ]
    .concat()
}

/// The cup gets the numbers that the claims speak of; the other surfaces a share.
fn rays(campaign: &str, surface: &str, effort: Effort) -> u64 {
    let of_cup = effort.of(match campaign {
        // Five bounces each.
        "paths" => [15_000, 500_000, 25_000_000],
        "inside" => [120_000, 4_000_000, 1_000_000_000],
        _ => [400_000, 10_000_000, 1_000_000_000],
    });
    if surface == "cup" {
        of_cup
    } else {
        of_cup / 16
    }
}

/// Far away, turned, and smaller: coordinates round to 1e-10.
fn far(profile: Profile, scale: f64) -> Revolution {
    let there = DVec3::new(1e6, -2e6, 1.5e6);
    Revolution::new(profile, Placement::new(there, DVec3::ONE, 70.0, scale))
}

/// A surface by its name.
fn surface(name: &str) -> Revolution {
    let here = |specimen: Specimen| Revolution::new(specimen.profile(), Placement::identity());
    match name {
        "hourglass" => here(Specimen::Hourglass),
        "thin-wall-1e-3" => here(Specimen::ThinWall(1e-3)),
        "thin-wall-1e-6" => here(Specimen::ThinWall(1e-6)),
        "thin-wall-1e-9" => here(Specimen::ThinWall(1e-9)),
        "thin-wall-1e-9-far" => far(Specimen::ThinWall(1e-9).profile(), 1.0),
        "loop" => here(Specimen::Loop),
        "cup-far" => far(Profile::cup(), 0.45),
        _ => here(Specimen::Cup),
    }
}

/// What became of the rays of a run.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    rays: u64,
    bounces: u64,
    self_hits: u64,
    leaks: u64,
    escapes_missed: u64,
    unseparated: u64,
    work: Work,
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let (campaign, name) = (run.text("campaign"), run.text("surface"));
    let count = rays(&campaign, &name, effort);
    let clock = ThreadClock::start();
    let tally = match campaign.as_str() {
        "paths" => paths::run(&surface(&name), count, seed),
        "inside" => inside::run(&surface(&name), count, seed),
        _ if name == "random" => parity::run_random(count, seed),
        _ => parity::run(&surface(&name), count, seed),
    };
    let counts = [
        tally.rays,
        tally.bounces,
        tally.self_hits,
        tally.leaks,
        tally.escapes_missed,
        tally.unseparated,
    ];
    let each = 1e9 * clock.seconds() / tally.rays as f64;
    let row = run.row([values(counts), values([each])].concat());
    Ok(Outcome::of_row(row, tally.work))
}

/// A row of the table.
#[derive(Deserialize)]
struct Row {
    campaign: String,
    surface: String,
    rays: u64,
    bounces: u64,
    self_hits: u64,
    leaks: u64,
    escapes_missed: u64,
    unseparated: u64,
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let rows: Vec<Row> = table.read();
    let of = |campaign: &str| {
        let rows = rows.iter().filter(|row| row.campaign == campaign);
        rows.fold((0, 0), |(faults, n), row| {
            let found = row.self_hits + row.leaks + row.escapes_missed;
            (faults + found, n + row.rays.max(row.bounces))
        })
    };
    let ordinary = rows
        .iter()
        .filter(|row| row.campaign == "paths" && ORDINARY.contains(&row.surface.as_str()));
    let flagged = ordinary.fold((0, 0), |(flags, n), row| {
        (flags + row.unseparated, n + row.bounces)
    });
    let claim = |name, statement, (failures, n)| {
        let subject = EXPERIMENT.subject(name, statement, Effort::Smoke, effort);
        Claim::exact(subject, failures, n)
    };
    Conclusion {
        claims: vec![
            claim(
                "paths keep their side",
                "Along paths through glass no ray meets the sheet that it leaves, none passes a wall unseen, and none inside misses.",
                of("paths"),
            ),
            claim(
                "no way out unseen",
                "Every ray from inside a closed solid hits its surface from inside.",
                of("inside"),
            ),
            claim(
                "crossings are complete",
                "The crossings of a ray alternate between inside and outside, or the exact solver has the same ones.",
                of("parity"),
            ),
            claim(
                "ordinary surfaces are separated",
                "Every hit of cup and hourglass, far away too, has a start on the side that is asked for.",
                flagged,
            ),
        ],
        ..Conclusion::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_fault_of_a_campaign_fails_its_claim() {
        let row = |campaign: &str, counts: [u64; 6]| {
            [values([campaign, "cup"]), values(counts), values([1.0])].concat()
        };
        let failed = |counts: [[u64; 6]; 3]| -> Vec<bool> {
            let [paths, inside, parity] = counts;
            let table = EXPERIMENT.table(vec![
                row("paths", paths),
                row("inside", inside),
                row("parity", parity),
            ]);
            let claims = conclude(&table, Effort::Smoke).claims;
            claims.iter().map(Claim::fails_the_run).collect()
        };
        let good = [9, 20, 0, 0, 0, 0];
        assert_eq!(failed([good; 3]), [false; 4]);
        let self_hit = [9, 20, 1, 0, 0, 0];
        assert_eq!(failed([self_hit, good, good]), [true, false, false, false]);
        let missed = [9, 20, 0, 0, 1, 0];
        assert_eq!(failed([good, missed, good]), [false, true, false, false]);
        let leak = [9, 20, 0, 1, 0, 0];
        assert_eq!(failed([good, good, leak]), [false, false, true, false]);
        let flag = [9, 20, 0, 0, 0, 1];
        assert_eq!(failed([flag, flag, flag]), [false, false, false, true]);
    }

    /// No campaign may pass because its surfaces or rays are not there.
    #[test]
    fn every_campaign_sends_rays_and_finds_none_at_fault() {
        for run in plan(Effort::Smoke) {
            let (campaign, name) = (run.text("campaign"), run.text("surface"));
            let tally = match campaign.as_str() {
                "paths" => paths::run(&surface(&name), 200, 1),
                "inside" => inside::run(&surface(&name), 200, 1),
                _ if name == "random" => parity::run_random(200, 1),
                _ => parity::run(&surface(&name), 200, 1),
            };
            assert_eq!(tally.rays, 200, "{campaign} {name}");
            assert!(tally.bounces > 100, "{campaign} {name} {tally:?}");
            let faults = tally.self_hits + tally.leaks + tally.escapes_missed;
            assert_eq!(faults, 0, "{campaign} {name} {tally:?}");
        }
    }
}
