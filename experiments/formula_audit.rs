//! Which formulas of the original and its relatives are wrong, by how much, where does it not show, and what exposes them?
//!
//! Each fault is a function beside ours of the same type. A *property* is a function over such an implementation: it must accept
//! ours and reject the wrong one, else it proves nothing. Numbers 2.1 to 2.13 are those of the formulas in the original's report,
//! M1 to M32 those of faults found in the code of the original and of programs like it.
//!
//! Without a row, because no value of a function differs: the report's slips of wording (2.2, 2.5, 2.8, 2.12), the missing `break`
//! that lets every level of the kd-tree split along z (M11: slower, never wrong), and sums that threads make without order (M27).

mod curve;
mod geometry;
mod hash;
mod lens;
mod light;
mod newton;
mod photons;

use crate::lab::claim::Claim;
use crate::lab::experiment::{Conclusion, Effort, Experiment, Outcome, Run, Timing};
use crate::lab::table::{Table, Value};
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::work::Work;
use anyhow::Context as _;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "formula_audit",
    question: "Which formulas of the original and its relatives are wrong, by how much, where does it not show, and what exposes them?",
    prediction: "Every wrong formula is right somewhere: at an end point, on the axis, at the first pass, with α = 1. A property that \
                 holds everywhere rejects it there or elsewhere, and accepts ours.",
    method: "A wrong formula and ours are functions of one type. One quantity is measured with both where the fault shows, one where \
             it hides; and a property, itself a function over such a function, judges both. Random inputs are keyed; properties of \
             random samples allow six standard errors. Slips of wording and faults that change no value have no row.",
    columns: &[
        "fault",
        "number",
        "component",
        "quantity",
        "right",
        "wrong",
        "wrong_by",
        "hides_where",
        "wrong_by_there",
        "property",
        "rejected",
        "accepted",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [0.5, 8.5, 90.0],
    plan,
    execute,
    conclude,
};

/// A fault whose quantity is off by less than this share of the greater value is not shown.
const VISIBLE: f64 = 0.01;
/// A fault that is off by more than this where it should hide does not hide. All quantities are of the order of 1.
const HIDDEN: f64 = 1e-3;

/// A wrong formula, and how it is examined.
struct Fault {
    /// What is wrong.
    name: &'static str,
    /// Its numbers in the catalogues.
    number: &'static str,
    component: &'static str,
    /// The quantity that shows it.
    quantity: &'static str,
    /// Where the wrong formula gives the right value.
    hides_where: &'static str,
    /// What rejects it.
    property: &'static str,
    examine: fn(&Trial) -> Finding,
}

/// What an examination may draw from.
struct Trial {
    seed: u64,
    /// Random samples of a cheap kind.
    samples: u64,
}

impl Trial {
    fn stream(&self, index: u64) -> Stream {
        Stream::new(self.seed, Purpose::Experiment, index)
    }
}

/// What an examination found.
struct Finding {
    right: f64,
    wrong: f64,
    /// Difference where the fault hides.
    hidden: f64,
    rejected: bool,
    accepted: bool,
}

/// Measures a quantity with ours and the wrong implementation, another one where the fault hides, and lets a property judge both.
fn compare<I: Copy>(
    ours: I,
    wrong: I,
    shown: impl Fn(I) -> f64,
    hidden: impl Fn(I) -> f64,
    holds: impl Fn(I) -> bool,
) -> Finding {
    Finding {
        right: shown(ours),
        wrong: shown(wrong),
        hidden: (hidden(wrong) - hidden(ours)).abs(),
        rejected: !holds(wrong),
        accepted: holds(ours),
    }
}

fn faults() -> impl Iterator<Item = &'static Fault> {
    [
        curve::FAULTS,
        newton::FAULTS,
        geometry::FAULTS,
        hash::FAULTS,
        lens::FAULTS,
        light::FAULTS,
        photons::FAULTS,
    ]
    .into_iter()
    .flatten()
}

fn plan(_: Effort) -> Vec<Run> {
    faults()
        .map(|fault| Run::new([("fault", fault.name.into())]))
        .collect()
}

fn samples(effort: Effort) -> u64 {
    match effort {
        Effort::Smoke => 20_000,
        Effort::Standard => 400_000,
        Effort::Full => 4_000_000,
    }
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let name = run.text("fault");
    let fault = faults()
        .find(|fault| fault.name == name)
        .with_context(|| format!("no fault {name}"))?;
    let found = (fault.examine)(&Trial {
        seed,
        samples: samples(effort),
    });
    Ok(Outcome {
        rows: vec![row(fault, &found)],
        work: Work::default(),
    })
}

fn row(fault: &Fault, found: &Finding) -> Vec<Value> {
    vec![
        fault.name.into(),
        fault.number.into(),
        fault.component.into(),
        fault.quantity.into(),
        found.right.into(),
        found.wrong.into(),
        (found.wrong - found.right).abs().into(),
        fault.hides_where.into(),
        found.hidden.into(),
        fault.property.into(),
        u64::from(found.rejected).into(),
        u64::from(found.accepted).into(),
    ]
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let claim = |name: &str, statement: &str, fine: &dyn Fn(&[f64; 6]) -> bool| {
        let rows = table.select([
            "right",
            "wrong",
            "wrong_by",
            "wrong_by_there",
            "rejected",
            "accepted",
        ]);
        let subject = EXPERIMENT.subject(name, statement, Effort::Smoke, effort);
        let failures = rows.iter().filter(|row| !fine(row)).count();
        Claim::exact(subject, failures as u64, rows.len() as u64)
    };
    Conclusion {
        claims: vec![
            claim(
                "wrong formulas are rejected",
                "Every wrong formula is rejected by its property.",
                &|row| row[4] == 1.0,
            ),
            claim(
                "right formulas are accepted",
                "Every one of ours is accepted by the same property.",
                &|row| row[5] == 1.0,
            ),
            claim(
                "wrong formulas are wrong",
                "Every wrong formula is off by more than 1 % in its quantity.",
                &|row| row[2] > VISIBLE * row[0].abs().max(row[1].abs()),
            ),
            claim(
                "wrong formulas hide",
                "Every wrong formula gives the right value, within .001, in a case that a test might have taken.",
                &|row| row[3] <= HIDDEN,
            ),
        ],
        plots: vec![curve::plot()],
        ..Conclusion::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(right: f64, wrong: f64, hidden: f64, judged: [bool; 2]) -> Table {
        let found = Finding {
            right,
            wrong,
            hidden,
            rejected: judged[0],
            accepted: judged[1],
        };
        let fault = faults().next().expect("there are faults");
        EXPERIMENT.table(vec![row(fault, &found)])
    }

    #[test]
    fn each_claim_fails_at_its_own_row() {
        let failed = |table: Table| -> Vec<bool> {
            let claims = conclude(&table, Effort::Smoke).claims;
            claims.iter().map(Claim::fails_the_run).collect()
        };
        let good = [true, true];
        assert_eq!(failed(table(1.0, 2.0, 0.0, good)), [false; 4]);
        assert_eq!(
            failed(table(1.0, 2.0, 0.0, [false, true])),
            [true, false, false, false]
        );
        assert_eq!(
            failed(table(1.0, 2.0, 0.0, [true, false])),
            [false, true, false, false]
        );
        assert_eq!(
            failed(table(1.0, 1.0, 0.0, good)),
            [false, false, true, false]
        );
        assert_eq!(
            failed(table(1.0, 2.0, f64::NAN, good)),
            [false, false, false, true]
        );
    }

    #[test]
    fn every_property_rejects_the_wrong_formula_and_accepts_ours() {
        for fault in faults() {
            let found = (fault.examine)(&Trial {
                seed: 1,
                samples: samples(Effort::Smoke),
            });
            assert!(found.rejected, "{}: the wrong one passes", fault.name);
            assert!(found.accepted, "{}: ours does not pass", fault.name);
        }
    }

    #[test]
    fn every_fault_of_the_catalogues_that_changes_a_value_has_a_row() {
        let numbers: Vec<&str> = faults()
            .flat_map(|fault| fault.number.split(", "))
            .collect();
        for number in (1..=32).filter(|number| ![11, 27].contains(number)) {
            assert!(
                numbers.contains(&format!("M{number}").as_str()),
                "M{number}"
            );
        }
        for number in [1, 3, 4, 6, 7, 9, 10, 11, 13] {
            assert!(
                numbers.contains(&format!("2.{number}").as_str()),
                "2.{number}"
            );
        }
    }
}
