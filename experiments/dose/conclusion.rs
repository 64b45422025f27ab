//! What the table of `dose` says.

use super::method::Family;
use super::pictures::contrasts;
use super::plots::{bias_plot, depth_plot, dose_plot, error_plot, flat_plot};
use super::{EXPERIMENT, REPLICATES};
use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{Conclusion, Effort};
use crate::lab::table::Table;
use crate::numeric::statistics::{Moments, fit_line};
use serde::Deserialize;

/// A row of the table.
#[derive(Clone, Deserialize)]
struct Row {
    method: String,
    parameter: f64,
    replicate: f64,
    depth: String,
    paths: f64,
    queries: f64,
    miss: f64,
    phantom: f64,
    wrong: f64,
    flips: f64,
    truth: f64,
    bias: f64,
    drift: f64,
}

/// A method at one dose: the sums over some rows.
#[derive(Clone, Copy, Default)]
pub(super) struct Dose {
    pub(super) parameter: f64,
    pub(super) paths: f64,
    pub(super) queries: f64,
    pub(super) faults: f64,
    /// Paths with other steps.
    pub(super) flips: f64,
    light: f64,
    pub(super) by_depth: [f64; 4],
    /// Sums of the radiance of all true paths, and of all differences.
    truth: f64,
    difference: f64,
    drift: f64,
}

/// Specular events before a flip, as the table names them.
pub(super) const DEPTHS: [&str; 4] = ["0", "1", "2", "3+"];

impl Dose {
    fn add(&mut self, row: &Row) {
        self.parameter = row.parameter;
        self.queries += row.queries;
        self.faults += row.miss + row.phantom + row.wrong;
        self.difference += row.bias * row.paths;
        self.drift = self.drift.max(row.drift);
        match DEPTHS.iter().position(|&depth| depth == row.depth) {
            Some(depth) => {
                self.flips += row.flips;
                self.by_depth[depth] += row.flips;
            }
            None => self.light += row.flips,
        }
        // Every run has one row of each depth.
        if row.depth == "none" {
            self.paths += row.paths;
            self.truth += row.truth * row.paths;
        }
    }

    pub(super) fn fault_rate(&self) -> f64 {
        self.faults / self.queries
    }

    pub(super) fn flip_share(&self) -> f64 {
        self.flips / self.paths
    }
}

/// The rows of a family, summed for each parameter: over all replicates, or over one.
pub(super) struct Doses {
    rows: Vec<Row>,
    parameters: &'static [f64],
}

impl Doses {
    fn of(rows: &[Row], family: Family) -> Self {
        let mine = rows.iter().filter(|row| row.method == family.name());
        Self {
            rows: mine.cloned().collect(),
            parameters: family.parameters(),
        }
    }

    fn sums(&self, pass: impl Fn(&Row) -> bool) -> Vec<Dose> {
        let sum = |&parameter: &f64| {
            let mut dose = Dose::default();
            for row in &self.rows {
                if row.parameter == parameter && pass(row) {
                    dose.add(row);
                }
            }
            dose
        };
        self.parameters.iter().map(sum).collect()
    }

    pub(super) fn all(&self) -> Vec<Dose> {
        self.sums(|_| true)
    }

    /// A statistic of each replicate, with Student's interval.
    pub(super) fn over_replicates(&self, statistic: impl Fn(&[Dose]) -> f64) -> Estimate {
        let one = |replicate: u64| statistic(&self.sums(|row| row.replicate == replicate as f64));
        Estimate::of(&Moments::of((0..REPLICATES).map(one)))
    }
}

/// Bias of the doses together, relative to the picture's mean.
pub(super) fn relative_bias(doses: &[Dose]) -> f64 {
    let sum = |pick: fn(&Dose) -> f64| doses.iter().map(pick).sum::<f64>();
    sum(|dose| dose.difference) / sum(|dose| dose.truth)
}

/// Slope of log y against log x, weighted by the flips that y rests on; doses without any say nothing.
fn slope(doses: &[Dose], point: impl Fn(&Dose) -> (f64, f64, f64)) -> f64 {
    let points = doses.iter().map(point);
    let logs: Vec<(f64, f64, f64)> = points
        .filter(|&(x, y, weight)| x > 0.0 && y > 0.0 && weight > 0.0)
        .map(|(x, y, weight)| (libm::log(x), libm::log(y), weight))
        .collect();
    fit_line(&logs).map_or(f64::NAN, |fit| fit.slope)
}

/// Doses of a family between two parameters.
pub(super) fn between(doses: &[Dose], low: f64, high: f64) -> Vec<Dose> {
    let inside = |dose: &&Dose| low <= dose.parameter && dose.parameter <= high;
    doses.iter().filter(inside).copied().collect()
}

pub(super) fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let rows: Vec<Row> = table.read();
    let of = |family| Doses::of(&rows, family);
    let [starts, tolerance, offset, flat] = [
        Family::Starts,
        Family::Tolerance,
        Family::Offset,
        Family::Flat,
    ]
    .map(of);
    let mut claims = certain(&of(Family::Bernstein).all(), effort).to_vec();
    claims.extend(fault_laws(&starts, effort));
    claims.extend(error_laws(&tolerance, &offset, &flat, effort));
    let plots = vec![
        dose_plot(&starts, &tolerance, &offset),
        depth_plot(&starts.all()),
        bias_plot(&[
            ("newton, starts", &starts),
            ("newton, tolerance", &tolerance),
        ]),
        bias_plot(&[("offset", &offset), ("straight pieces", &flat)]),
        error_plot(&tolerance, &offset),
        flat_plot(&flat),
    ];
    Conclusion {
        claims,
        plots,
        pictures: contrasts(table),
    }
}

/// A path whose radiance moved more than this, relatively, without a flip: more than long paths make of the last bits.
const STEADY: f64 = 1e-3;

fn certain(bernstein: &[Dose], effort: Effort) -> [Claim; 4] {
    let total = |pick: fn(&Dose) -> f64| bernstein.iter().map(pick).sum::<f64>() as u64;
    let exact = |name, statement, failures, n| {
        let subject = EXPERIMENT.subject(name, statement, Effort::Smoke, effort);
        Claim::exact(subject, failures, n)
    };
    let paths = total(|dose| dose.paths);
    let long = "After three and more specular events the last bits, amplified, flip fewer than 5 in 10 000 paths.";
    let moved = bernstein.iter().filter(|dose| dose.drift > STEADY).count() as u64;
    [
        exact(
            "bernstein makes no fault",
            "Along true camera paths the Bernstein solver answers every query as exact arithmetic does.",
            total(|dose| dose.faults),
            total(|dose| dose.queries),
        ),
        exact(
            "bernstein flips no short path",
            "Before its third specular event no camera path by the Bernstein solver has other events than by exact arithmetic.",
            total(|dose| dose.flips - dose.by_depth[3]),
            paths,
        ),
        Claim::share_in_range(
            EXPERIMENT.subject(
                "bernstein flips few long paths",
                long,
                Effort::Standard,
                effort,
            ),
            total(|dose| dose.by_depth[3]),
            paths,
            (0.0, 5e-4),
        ),
        exact(
            "unflipped paths keep their light",
            "No path that takes the same steps by the Bernstein solver and by exact arithmetic differs in radiance by more than 1e-3 of \
             it.",
            moved,
            paths,
        ),
    ]
}

fn fault_laws(starts: &Doses, effort: Effort) -> Vec<Claim> {
    let claim = |name, statement, estimate, predicted, margin| {
        let subject = EXPERIMENT.subject(name, statement, Effort::Standard, effort);
        Claim::equivalent(subject, estimate, predicted, margin)
    };
    let rare = |doses: &[Dose]| between(doses, 10.0, 100.0);
    vec![
        claim(
            "a fault is a flip",
            "With 10 starts and more (fault rates below 1 %) flips per path are queries per path times faults per query within 25 %.",
            starts.over_replicates(|doses| {
                let sum = |pick: fn(&Dose) -> f64| rare(doses).iter().map(pick).sum::<f64>();
                sum(|dose| dose.flips) / sum(|dose| dose.faults)
            }),
            1.0,
            0.25,
        ),
        claim(
            "flips are linear in faults",
            "From 3 starts on, the share of flipped paths goes as the fault rate (slope 1 within .15).",
            starts.over_replicates(|doses| {
                slope(&between(doses, 3.0, 100.0), |dose| {
                    let weight = 1.0 / (1.0 / dose.flips + 1.0 / dose.faults);
                    (dose.fault_rate(), dose.flip_share(), weight)
                })
            }),
            1.0,
            0.15,
        ),
        claim(
            "a flip does not cost its light",
            "The picture's relative bias is smaller than the share of flipped paths.",
            starts.over_replicates(|doses| {
                let flips = doses.iter().map(|dose| dose.flips).sum::<f64>();
                let paths = doses.iter().map(|dose| dose.paths).sum::<f64>();
                relative_bias(doses) * paths / flips
            }),
            0.0,
            1.0,
        ),
        claim(
            "30 starts show no bias",
            "With 30 starts (a fault in some thousand queries) the picture's mean is right within 2 %.",
            starts.over_replicates(|doses| relative_bias(&between(doses, 30.0, 30.0))),
            0.0,
            0.02,
        ),
    ]
}

/// Offsets and tolerances of the law: above, rays jump the gap of .001 between cup and floor; below, flips fall more slowly.
const LAW: (f64, f64) = (1e-6, 1e-3);
/// Offset below which rays start on the wrong side.
const TOO_SMALL: f64 = 1e-16;

fn error_laws(tolerance: &Doses, offset: &Doses, flat: &Doses, effort: Effort) -> Vec<Claim> {
    let claim = |name, statement, estimate, predicted, margin| {
        let subject = EXPERIMENT.subject(name, statement, Effort::Standard, effort);
        Claim::equivalent(subject, estimate, predicted, margin)
    };
    let root = |doses: &[Dose]| {
        slope(&between(doses, LAW.0, LAW.1), |dose| {
            (dose.parameter, dose.flip_share(), dose.flips)
        })
    };
    let (lost, paths) = (offset.all().iter())
        .filter(|dose| dose.parameter <= TOO_SMALL)
        .fold((0, 0), |(lost, paths), dose| {
            (lost + dose.flips as u64, paths + dose.paths as u64)
        });
    let subject = EXPERIMENT.subject(
        "offset too small",
        "Without an offset of at least the rounding of the hit 15 to 45 % of the paths go elsewhere.",
        Effort::Smoke,
        effort,
    );
    vec![
        Claim::share_in_range(subject, lost, paths, (0.15, 0.45)),
        claim(
            "flips by offset",
            "Offsets from 1e-6 to 1e-3 flip a share of the paths that goes as their root (slope 1/2 within .1; 1 was expected).",
            offset.over_replicates(root),
            0.5,
            0.1,
        ),
        claim(
            "flips by tolerance",
            "So do Newton's tolerances from 1e-6 to 1e-3, with their offsets (slope 1/2 within .15; 1 was expected).",
            tolerance.over_replicates(root),
            0.5,
            0.15,
        ),
        claim(
            "flips by straight pieces",
            "n straight pieces for each curved one flip a share of the paths ~ n^-.4 (slope within .1; -1 was expected).",
            flat.over_replicates(|doses| {
                slope(doses, |dose| {
                    (dose.parameter, dose.flip_share(), dose.flips)
                })
            }),
            -0.4,
            0.1,
        ),
        claim(
            "first flips by straight pieces",
            "Before the first specular event it falls faster, between the -1 of normals and the -2 of outlines (slope -1.2 within .5).",
            flat.over_replicates(|doses| {
                slope(doses, |dose| {
                    (
                        dose.parameter,
                        dose.by_depth[0] / dose.paths,
                        dose.by_depth[0],
                    )
                })
            }),
            -1.2,
            0.5,
        ),
        claim(
            "usual offsets show no bias",
            "Offsets from 1e-12 to 1e-4 leave the picture's mean right within 2 %.",
            offset.over_replicates(|doses| relative_bias(&between(doses, 1e-12, 1e-4))),
            0.0,
            0.02,
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::table::Value;

    /// What a table should show.
    #[derive(Clone, Copy)]
    struct Planted {
        bernstein_flips: u64,
        /// Flips for each fault.
        flips_per_fault: f64,
        /// Radiance lost with each flip, relative to the mean.
        loss: f64,
        offset_slope: f64,
    }

    const SOUND: Planted = Planted {
        bernstein_flips: 0,
        flips_per_fault: 1.0,
        loss: 0.3,
        offset_slope: 0.5,
    };

    fn shares(planted: &Planted, family: Family, x: f64) -> (f64, f64) {
        match family {
            Family::Bernstein => (0.0, planted.bernstein_flips as f64 / 1e6),
            Family::Starts => {
                let rate = 0.1 / libm::pow(x, 1.5);
                (rate, 2.0 * rate * planted.flips_per_fault)
            }
            Family::Offset if x <= TOO_SMALL => (0.2, 0.3),
            Family::Offset => (0.0, 0.6 * libm::pow(x, planted.offset_slope)),
            Family::Tolerance => (0.0, 0.6 * x.sqrt()),
            Family::Flat => (0.0, 0.2 * libm::pow(x, -0.4)),
        }
    }

    fn table(planted: &Planted) -> Table {
        let mut rows: Vec<Vec<Value>> = Vec::new();
        for family in Family::ALL {
            for &x in family.parameters() {
                for replicate in 0..REPLICATES {
                    let wobble = 1.0 + 0.01 * (replicate as f64 - 3.5);
                    let (faults, flips) = shares(planted, family, x);
                    let first = match family {
                        Family::Flat => 0.1 / x,
                        Family::Bernstein => flips,
                        _ => 0.0,
                    };
                    for depth in DEPTHS.into_iter().chain(["light", "none"]) {
                        let mine = match depth {
                            "0" => first,
                            "3+" => (flips - first) * wobble,
                            _ => 0.0,
                        };
                        let queries = if depth == "3+" { 2_000_000_u64 } else { 0 };
                        rows.push(vec![
                            family.name().into(),
                            x.into(),
                            replicate.into(),
                            depth.into(),
                            1_000_000_u64.into(),
                            queries.into(),
                            ((faults * queries as f64) as u64).into(),
                            0_u64.into(),
                            0_u64.into(),
                            ((1e6 * mine).round() as u64).into(),
                            0.25.into(),
                            (-0.25 * planted.loss * mine).into(),
                            0.0.into(),
                            1e-9.into(),
                        ]);
                    }
                }
            }
        }
        EXPERIMENT.table(rows)
    }

    #[test]
    fn a_table_with_a_fault_fails_the_claim_about_it() {
        let failed = |planted: Planted| -> Vec<String> {
            let claims = conclude(&table(&planted), Effort::Standard).claims;
            let failing = claims.into_iter().filter(Claim::fails_the_run);
            failing.map(|claim| claim.claim).collect()
        };
        assert_eq!(failed(SOUND), [""; 0]);
        let flipping = Planted {
            bernstein_flips: 1,
            ..SOUND
        };
        assert_eq!(failed(flipping), ["bernstein flips no short path"]);
        let harmless = Planted {
            flips_per_fault: 0.5,
            ..SOUND
        };
        assert_eq!(failed(harmless), ["a fault is a flip"]);
        let dark = Planted { loss: 1.5, ..SOUND };
        assert_eq!(failed(dark), ["a flip does not cost its light"]);
        let linear = Planted {
            offset_slope: 1.0,
            ..SOUND
        };
        assert_eq!(failed(linear), ["flips by offset"]);
    }
}
