//! What the table of `solvers` says: claims and plots.

use super::EXPERIMENT;
use super::roster::{
    BATCH, BATCH_PORTABLE, BATCH_UNBOUNDED, BERNSTEIN, CHECKED, EXACT, LIBRARY, NEWTON, PORTABLE,
};
use crate::lab::claim::Claim;
use crate::lab::experiment::{Conclusion, Effort};
use crate::lab::plot::{Axis, Plot, Series};
use crate::lab::table::Table;
use crate::numeric::statistics::zero_failures_bound;
use serde::Deserialize;

/// A row of the table.
#[derive(Deserialize)]
struct Row {
    solver: String,
    starts: f64,
    profile: String,
    family: String,
    rays: f64,
    true_hits: f64,
    miss: f64,
    phantom: f64,
    wrong: f64,
    ns_per_ray: f64,
    max_ulps: f64,
    bounded: f64,
    bounds_broken: f64,
    bound_ulps: f64,
}

impl Row {
    fn failures(&self) -> f64 {
        self.miss + self.phantom + self.wrong
    }
}

/// Families on which the methods compared are known to do well.
const EASY: [&str; 2] = ["random", "inside"];
/// Rays with d_y = 0.
const LEVEL: [&str; 2] = ["horizontal", "horizontal-joints"];
/// Profiles of rendered scenes, on which speed is compared.
const SCENES: [&str; 2] = ["cup", "hourglass"];
/// Greatest error of a hit, in ε s/|n · d|, s the size of the coordinates.
const MOST_ULPS: f64 = 16.0;
/// Greatest median bound of an error, in the same unit.
const TYPICAL_ULPS: f64 = 64.0;
/// Families told by name as the slowest.
const SLOWEST: usize = 12;
/// Medians of CPU time a ray, taken in turns on the same rays, agree within a quarter from run to run.
const TIMING: f64 = 1.25;

pub(super) fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let rows: Vec<Row> = table.read();
    let of = |name: &str| -> Vec<&Row> { rows.iter().filter(|row| row.solver == name).collect() };
    let (batch, newton, library) = (of(BATCH), of(NEWTON), of(LIBRARY));
    let ablated = [PORTABLE, BATCH_PORTABLE, BATCH_UNBOUNDED].map(of).concat();
    let checked = of(CHECKED);
    let alone = of(BERNSTEIN);
    let bernstein = [alone.clone(), of(BATCH), ablated].concat();
    let subject = |claim, statement| EXPERIMENT.subject(claim, statement, Effort::Smoke, effort);
    let at_standard =
        |claim, statement| EXPERIMENT.subject(claim, statement, Effort::Standard, effort);
    let sum =
        |rows: &[&Row], value: fn(&Row) -> f64| rows.iter().map(|row| value(row)).sum::<f64>();
    let level: Vec<&Row> = (newton.iter().copied())
        .filter(|row| LEVEL.contains(&row.family.as_str()))
        .collect();
    let thirty: Vec<&Row> = newton
        .iter()
        .copied()
        .filter(|row| row.starts == 30.0)
        .collect();
    let never = "Bernstein isolation, one ray at a time and in batches, returns the nearest crossing of every ray of every family, and none \
                 where there is none.";
    let checked_too = "Nor does it fail on many more rays, by Bezier clipping and, where that differs, the oracle.";
    let sharp = "Its t is within 16 ε s/|n · d| in every family (families that exceed it, of all).";
    let nothing =
        "Newton's method finds no crossing of any ray with d_y = 0 (hits found, of all true ones).";
    let certain =
        "Where it bounds its errors of t, u and the normal, the oracle finds none beyond.";
    let narrow = "On random rays at cup and hourglass the median bound of the error of t is at most 64 ε s/|n · d|.";
    let claims = vec![
        Claim::exact(
            subject("bernstein never fails", never),
            sum(&bernstein, Row::failures) as u64,
            sum(&bernstein, |row| row.rays) as u64,
        ),
        Claim::exact(
            subject("bernstein never fails on more rays", checked_too),
            sum(&checked, Row::failures) as u64,
            sum(&checked, |row| row.rays) as u64,
        ),
        Claim::exact(
            at_standard("hits are sharp", sharp),
            bernstein
                .iter()
                .filter(|row| row.max_ulps > MOST_ULPS)
                .count() as u64,
            bernstein.len() as u64,
        ),
        Claim::exact(
            subject("newton cannot do level rays", nothing),
            sum(&level, |row| row.true_hits - row.miss) as u64,
            sum(&level, |row| row.true_hits) as u64,
        ),
        Claim::exact(
            subject("bounds hold", certain),
            sum(&alone, |row| row.bounds_broken) as u64,
            sum(&alone, |row| row.bounded) as u64,
        ),
        typical_bound(subject("bounds are narrow", narrow), &alone),
        faster(
            at_standard(
                "faster than thirty starts",
                "On random rays at cup and hourglass Bernstein isolation in batches is at least 100 times as fast as 30 starts of Newton's \
                 method (log10).",
            ),
            &batch,
            &thirty,
            100.0,
        ),
        faster(
            at_standard(
                "faster than a library",
                "On the same rays it is at least 10 times as fast as polycool at 1e-14 (log10).",
            ),
            &batch,
            &library,
            10.0,
        ),
    ];
    Conclusion {
        claims,
        plots: vec![
            front("Random rays: failures against time", &rows, true),
            front(
                "Hard families together: failures against time",
                &rows,
                false,
            ),
            ingredients(&rows),
            slowest(&batch),
        ],
        ..Conclusion::default()
    }
}

/// The wider of the median bounds on the two profiles of rendered scenes.
fn typical_bound(subject: crate::lab::claim::Subject, rows: &[&Row]) -> Claim {
    let mine: Vec<&&Row> = (rows.iter())
        .filter(|row| row.family == EASY[0] && SCENES.contains(&row.profile.as_str()))
        .collect();
    let widest = mine.iter().map(|row| row.bound_ulps).fold(0.0, f64::max);
    let n = mine.iter().map(|row| row.bounded).sum::<f64>() as u64;
    Claim::in_range(subject, widest, (widest, widest), n, (0.0, TYPICAL_ULPS))
}

/// How many times as fast, at least: the worse of the two profiles, in decades.
fn faster(
    subject: crate::lab::claim::Subject,
    ours: &[&Row],
    theirs: &[&Row],
    least: f64,
) -> Claim {
    let time = |rows: &[&Row], profile: &str| {
        let row = rows
            .iter()
            .find(|row| row.profile == profile && row.family == EASY[0]);
        row.map_or(f64::NAN, |row| row.ns_per_ray)
    };
    let ratios = SCENES.map(|profile| time(theirs, profile) / time(ours, profile));
    // Comparisons keep NaN out of `min`: it must reach the claim.
    let worst = if ratios[1] < ratios[0] || ratios[1].is_nan() {
        ratios[1]
    } else {
        ratios[0]
    };
    let [decades, least, slack] = [worst, least, TIMING].map(libm::log10);
    let interval = (decades - slack, decades + slack);
    // The claim has a lower end only; a hundred thousand times would be a broken clock.
    Claim::in_range(subject, decades, interval, 1, (least, 5.0))
}

/// What the default solver costs on random rays with all its ingredients, and without one or more of them.
fn ingredients(rows: &[Row]) -> Plot {
    let names = [
        BATCH,
        BATCH_UNBOUNDED,
        BERNSTEIN,
        BATCH_PORTABLE,
        PORTABLE,
        EXACT,
    ];
    let series = SCENES.map(|profile| {
        let time = |name: &str| {
            let row = rows
                .iter()
                .find(|row| row.solver == name && row.profile == profile && row.family == EASY[0]);
            row.map(|row| (row.ns_per_ray, name.to_owned()))
        };
        let found: Vec<(f64, String)> = names.into_iter().filter_map(time).collect();
        ranked(profile, &found)
    });
    Plot::new(
        "What each ingredient buys: random rays",
        Axis::linear("without more and more"),
        Axis::log("CPU time per ray (ns)"),
        series,
    )
}

/// The families that cost most, each with the profile on which it does.
fn slowest(rows: &[&Row]) -> Plot {
    let mut worst: Vec<(f64, String)> = Vec::new();
    for row in rows {
        let others = rows.iter().filter(|other| other.family == row.family);
        if others.fold(0.0, |most: f64, other| most.max(other.ns_per_ray)) == row.ns_per_ray {
            worst.push((row.ns_per_ray, format!("{} ({})", row.family, row.profile)));
        }
    }
    worst.sort_by(|a, b| b.0.total_cmp(&a.0));
    worst.truncate(SLOWEST);
    Plot::new(
        "The slowest rays: families by their costliest profile, in batches",
        Axis::linear("rank"),
        Axis::log("CPU time per ray (ns)"),
        [ranked(BATCH, &worst)],
    )
}

/// Named times, one after the other.
fn ranked(name: &str, times: &[(f64, String)]) -> Series {
    let points = (1_u32..)
        .zip(times)
        .map(|(rank, (ns, _))| (f64::from(rank), *ns));
    Series::scattered(name, points).with_labels(times.iter().map(|(_, label)| label))
}

/// Share of failures against time, a point for each method and number of starts; where none was seen, the bound that n rays prove.
fn front(title: &str, rows: &[Row], easy: bool) -> Plot {
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.solver.as_str()) {
            names.push(&row.solver);
        }
    }
    let methods = names.into_iter().map(|name| {
        let group = |row: &&Row| EASY.contains(&row.family.as_str()) == easy;
        let mine: Vec<&Row> = (rows.iter())
            .filter(|row| row.solver == name)
            .filter(group)
            .collect();
        let mut starts: Vec<f64> = mine.iter().map(|row| row.starts).collect();
        starts.sort_by(f64::total_cmp);
        starts.dedup();
        let points = starts.iter().map(|&starts| point(&mine, starts));
        let series = Series::scattered(name, points);
        let numbered = starts.iter().any(|&starts| starts > 0.0);
        if numbered {
            series.with_labels(&starts)
        } else {
            series
        }
    });
    Plot::speed_error(
        title,
        "CPU time per ray (ns)",
        "share of rays answered wrongly, or 95 % bound where none",
        methods.collect::<Vec<_>>(),
    )
}

/// Mean time and share of failures of the rows with a number of starts.
fn point(rows: &[&Row], starts: f64) -> (f64, f64) {
    let sum = |value: fn(&Row) -> f64| {
        let mine = rows.iter().filter(|row| row.starts == starts);
        mine.map(|row| value(row)).sum::<f64>()
    };
    let (rays, failed) = (sum(|row| row.rays), sum(Row::failures));
    let share = if failed > 0.0 {
        failed / rays
    } else {
        zero_failures_bound(rays as u64, 0.95)
    };
    (sum(|row| row.rays * row.ns_per_ray) / rays, share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::experiment::values;

    fn table(bernstein_misses: u64, ulps: f64, level_misses: u64, ns: f64) -> Table {
        bounded_table([bernstein_misses, 0], ulps, level_misses, ns, (0, 20.0))
    }

    fn bounded_table(
        [bernstein_misses, checked_misses]: [u64; 2],
        ulps: f64,
        level_misses: u64,
        ns: f64,
        (broken, bound): (u64, f64),
    ) -> Table {
        let row = |solver: &str, starts: u64, profile: &str, family: &str, miss: u64, ns: f64| {
            let mut row = values([solver]);
            row.extend(values([starts]));
            row.extend(values([profile, family]));
            row.extend(values([1000, 800, miss, 0, 0]));
            row.extend(values([1e-16, 1e-16, ns, 1.0, ulps]));
            row.extend(values([800, broken]));
            row.extend(values([bound]));
            row
        };
        EXPERIMENT.table(vec![
            row(BERNSTEIN, 0, "cup", "random", bernstein_misses, ns),
            row(BERNSTEIN, 0, "hourglass", "random", 0, ns),
            row(BATCH, 0, "cup", "random", 0, ns),
            row(BATCH, 0, "hourglass", "random", 0, ns),
            row(CHECKED, 0, "cup", "random", checked_misses, ns),
            row(NEWTON, 30, "cup", "random", 1, 40_000.0),
            row(NEWTON, 30, "hourglass", "random", 1, 20_000.0),
            row(NEWTON, 30, "cup", "horizontal", level_misses, 100.0),
            row(LIBRARY, 0, "cup", "random", 0, 2000.0),
            row(LIBRARY, 0, "hourglass", "random", 0, 1500.0),
        ])
    }

    #[test]
    fn each_claim_can_fail() {
        let failing = |table: &Table| -> Vec<usize> {
            let claims = conclude(table, Effort::Standard).claims;
            let failing = claims.iter().enumerate();
            let failing = failing.filter(|(_, claim)| claim.fails_the_run());
            failing.map(|(place, _)| place).collect()
        };
        assert!(failing(&table(0, 3.0, 800, 100.0)).is_empty());
        assert_eq!(failing(&table(1, 3.0, 800, 100.0)), [0]);
        let checked = bounded_table([0, 1], 3.0, 800, 100.0, (0, 20.0));
        assert_eq!(failing(&checked), [1]);
        assert_eq!(failing(&table(0, 17.0, 800, 100.0)), [2]);
        assert_eq!(failing(&table(0, 3.0, 799, 100.0)), [3]);
        let bounded = |broken, bound| bounded_table([0; 2], 3.0, 800, 100.0, (broken, bound));
        assert_eq!(failing(&bounded(1, 20.0)), [4]);
        assert_eq!(failing(&bounded(0, 65.0)), [5]);
        assert_eq!(failing(&table(0, 3.0, 800, 500.0)), [6, 7]);
        assert_eq!(failing(&table(0, 3.0, 800, f64::NAN)), [6, 7]);
    }
}
