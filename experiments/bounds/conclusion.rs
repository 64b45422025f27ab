//! What the table of `bounds` says: claims and plots.

use super::{EXPERIMENT, WIDE};
use crate::geometry::bounds::Bounding;
use crate::lab::claim::{Claim, Subject};
use crate::lab::experiment::{Conclusion, Effort};
use crate::lab::plot::{Axis, Plot, Series};
use crate::lab::table::Table;
use serde::Deserialize;

/// A row of the table.
#[derive(Deserialize)]
struct Row {
    volume: String,
    profile: String,
    family: String,
    rays: f64,
    culled: f64,
    tightness: f64,
    checked_hits: f64,
    lost_hits: f64,
    differing_hits: f64,
    ns_per_ray: f64,
}

/// Pairs (inner, outer) of volumes of which the first lies within the second.
const NESTED: [(&str, &str); 5] = [
    ("pieces", "cylinder"),
    ("cylinder", "hull"),
    ("cylinder", "box"),
    ("pieces", "sphere"),
    ("sphere", "none"),
];
/// The default volume.
const DEFAULT: &str = "cylinder";
/// Profiles of rendered scenes, on which speed is compared.
const SCENES: [&str; 2] = ["cup", "hourglass"];
/// Families by which speed is compared.
const TIMED: [&str; 2] = [WIDE, "random"];
/// The default is at most this many times as slow as the fastest volume.
const NEARLY: f64 = 1.5;
/// Medians of CPU time a ray, taken in turns on the same rays, agree within a quarter from run to run.
const TIMING: f64 = 1.25;

pub(super) fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let rows: Vec<Row> = table.read();
    let subject = |claim, statement| EXPERIMENT.subject(claim, statement, Effort::Smoke, effort);
    let sum = |value: fn(&Row) -> f64| rows.iter().map(value).sum::<f64>() as u64;
    let lost = "No ray that hits by the exact oracle gets no hit, behind any volume.";
    let same = "Every answer (t, piece, u) has the bits of the answer without a volume.";
    let nested = "A volume within another culls at least as many rays, but for one in a hundred that touches both (cells of profile, family but for \
                  grazes and joints, and pair that say otherwise).";
    let nothing = "Without a volume nothing is culled, and no volume culls more rays than miss (cells that say otherwise).";
    let fastest = "Wide and random rays at cup and hourglass: the tight cylinder takes at most 1.5 times as long as the fastest volume \
                   (worst of four; log10).";
    let claims = vec![
        Claim::exact(
            subject("no hit is lost", lost),
            sum(|row| row.lost_hits),
            sum(|row| row.checked_hits),
        ),
        Claim::exact(
            subject("the same hits", same),
            sum(|row| row.differing_hits),
            sum(|row| row.rays),
        ),
        ordered(subject("the tighter culls more", nested), &rows),
        Claim::exact(
            subject("only misses are culled", nothing),
            rows.iter().filter(|row| culls_too_much(row)).count() as u64,
            rows.len() as u64,
        ),
        fast(
            EXPERIMENT.subject("the cylinder is fast", fastest, Effort::Standard, effort),
            &rows,
        ),
    ];
    Conclusion {
        claims,
        plots: SCENES.map(|profile| plot(profile, &rows)).to_vec(),
        ..Conclusion::default()
    }
}

fn culls_too_much(row: &Row) -> bool {
    row.tightness > 1.0 || (row.volume == "none" && row.culled > 0.0)
}

fn find<'a>(rows: &'a [Row], volume: &str, profile: &str, family: &str) -> Option<&'a Row> {
    let same =
        |row: &&Row| (row.volume == volume) && row.profile == profile && row.family == family;
    rows.iter().find(same)
}

/// Share of a family's rays that may touch two volumes to within rounding: the cylinder, tested in the solver's own units, has other
/// roundings, so that it may keep such a ray that another volume culls.
const TOUCHING: f64 = 0.01;

/// Families aimed at the volumes' own walls: all of their rays may.
const AT_THE_WALL: [&str; 2] = ["grazes", "joints"];

fn ordered(subject: Subject, rows: &[Row]) -> Claim {
    let (mut failures, mut n) = (0, 0);
    for (inner, outer) in NESTED {
        let settled =
            |row: &&Row| row.volume == inner && !AT_THE_WALL.contains(&row.family.as_str());
        for tight in rows.iter().filter(settled) {
            let loose = find(rows, outer, &tight.profile, &tight.family);
            n += 1;
            failures += u64::from(
                loose.is_none_or(|loose| loose.culled > tight.culled + TOUCHING * tight.rays),
            );
        }
    }
    Claim::exact(subject, failures, n)
}

/// The time behind the default volume over the least time, the worst of all; NaN if a time is absent.
fn fast(subject: Subject, rows: &[Row]) -> Claim {
    let time = |volume: &str, profile: &str, family: &str| {
        find(rows, volume, profile, family).map_or(f64::NAN, |row| row.ns_per_ray)
    };
    let cells = SCENES
        .into_iter()
        .flat_map(|profile| TIMED.map(|family| (profile, family)));
    let ratios = cells.flat_map(|(profile, family)| {
        let default = time(DEFAULT, profile, family);
        Bounding::NAMES.map(|volume| default / time(volume, profile, family))
    });
    // NaN must reach the claim.
    let worse = |worst: f64, ratio: f64| {
        if ratio > worst || ratio.is_nan() {
            ratio
        } else {
            worst
        }
    };
    let worst = ratios.fold(0.0, worse);
    let [decades, most, slack] = [worst, NEARLY, TIMING].map(libm::log10);
    // One run's times are good to the slack: what is measured at most `NEARLY` passes, what exceeds it by both slacks fails.
    let interval = (decades - slack, decades + slack);
    Claim::in_range(subject, decades, interval, 1, (-slack, most + slack))
}

/// Time against the share of misses that reach the solver, wide and random rays.
fn plot(profile: &str, rows: &[Row]) -> Plot {
    let volumes = Bounding::NAMES.map(|volume| {
        let cells = TIMED
            .iter()
            .filter_map(|family| find(rows, volume, profile, family));
        let cells: Vec<&Row> = cells.collect();
        let point = |row: &&Row| (row.ns_per_ray, 1.0 - row.tightness);
        Series::scattered(volume, cells.iter().map(point))
            .with_labels(cells.iter().map(|row| &row.family))
    });
    let title = format!("{profile}: a tighter volume saves more, and costs more");
    Plot {
        front: true,
        ..Plot::new(
            &title,
            Axis::linear("CPU time per ray (ns)"),
            Axis::linear("share of misses that reach the solver"),
            volumes,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::claim::Verdict;
    use crate::lab::experiment::values;
    use crate::lab::table::Value;

    fn table() -> Table {
        let mut rows: Vec<Vec<Value>> = Vec::new();
        let culls = [0, 500, 400, 600, 450, 300];
        for (volume, culled) in Bounding::NAMES.into_iter().zip(culls) {
            for profile in SCENES {
                for family in TIMED {
                    let mut row = values([volume, profile, family]);
                    row.extend(values([1000, 300, culled, 700]));
                    row.push((f64::from(culled) / 700.0).into());
                    row.extend(values([1000, 1000 - culled, 100, 30, 0, 0]));
                    row.push(200.0.into());
                    rows.push(row);
                }
            }
        }
        EXPERIMENT.table(rows)
    }

    /// Verdicts with one cell of the table replaced: of the cylinder around the cup, wide rays.
    fn verdicts(column: &str, value: impl Into<Value>) -> Vec<Verdict> {
        let mut table = table();
        let column = table.column(column);
        table.rows[4][column] = value.into();
        let claims = conclude(&table, Effort::Standard).claims;
        claims.iter().map(|claim| claim.verdict).collect()
    }

    #[test]
    fn each_claim_watches_its_column() {
        use Verdict::{Fail, Pass};
        assert_eq!(verdicts("culled", 500), [Pass; 5]);
        assert_eq!(verdicts("lost_hits", 1), [Fail, Pass, Pass, Pass, Pass]);
        assert_eq!(
            verdicts("differing_hits", 1),
            [Pass, Fail, Pass, Pass, Pass]
        );
        assert_eq!(verdicts("culled", 380), [Pass, Pass, Fail, Pass, Pass]);
        assert_eq!(verdicts("culled", 620), [Pass, Pass, Fail, Pass, Pass]);
        assert_eq!(verdicts("tightness", 1.01), [Pass, Pass, Pass, Fail, Pass]);
        assert_eq!(
            verdicts("ns_per_ray", 900.0),
            [Pass, Pass, Pass, Pass, Fail]
        );
        assert_eq!(verdicts("ns_per_ray", f64::NAN)[4], Verdict::Inconclusive);
    }

    #[test]
    fn nothing_is_concluded_of_no_rays() {
        let claims = conclude(&EXPERIMENT.table(Vec::new()), Effort::Standard).claims;
        assert!(claims.iter().all(Claim::fails_the_run));
    }
}
