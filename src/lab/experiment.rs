//! The frame of an experiment: a plan of runs, a run, a conclusion. Everything else is the lab's.

use super::claim::{Claim, Subject};
use super::contrast::Contrast;
use super::plot::Plot;
pub use super::table::{Table, Value};
use crate::numeric::work::Work;
use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use std::fmt;

/// How much work an experiment may spend.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, ValueEnum,
)]
#[serde(rename_all = "lowercase")]
pub enum Effort {
    /// Seconds: shows that all works, decides the coarse claims.
    Smoke,
    /// Minutes: decides every claim of daily use.
    Standard,
    /// Hours.
    Full,
}

impl Effort {
    /// The one of three that is this effort's: smoke, standard, full.
    pub fn of<T>(self, [smoke, standard, full]: [T; 3]) -> T {
        match self {
            Self::Smoke => smoke,
            Self::Standard => standard,
            Self::Full => full,
        }
    }
}

impl fmt::Display for Effort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Smoke => "smoke",
            Self::Standard => "standard",
            Self::Full => "full",
        })
    }
}

/// One run of a sweep: a named point of the grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The parameters, in the order of the plan; together they name the run.
    pub parameters: Vec<(String, Value)>,
}

impl Run {
    /// A run of named parameters.
    pub fn new<const N: usize>(parameters: [(&str, Value); N]) -> Self {
        Self {
            parameters: parameters
                .map(|(name, value)| (name.to_owned(), value))
                .to_vec(),
        }
    }

    /// Name of the run: `name=value` of every parameter, joined by spaces.
    pub fn name(&self) -> String {
        let words = self
            .parameters
            .iter()
            .map(|(name, value)| format!("{name}={}", value.to_cell()));
        words.collect::<Vec<_>>().join(" ")
    }

    /// The parameter of a name.
    ///
    /// # Panics
    /// If the plan gives none: a mistake in the experiment.
    pub fn value(&self, name: &str) -> &Value {
        let found = self.parameters.iter().find(|(known, _)| known == name);
        &found
            .unwrap_or_else(|| panic!("no parameter {name} in run {}", self.name()))
            .1
    }

    /// The whole-number parameter of a name.
    ///
    /// # Panics
    /// If there is none: a mistake in the experiment.
    pub fn integer(&self, name: &str) -> i64 {
        match self.value(name) {
            Value::Integer(integer) => *integer,
            other => panic!("parameter {name} is {other:?}, not a whole number"),
        }
    }

    /// The parameter of a name as a number.
    ///
    /// # Panics
    /// If there is none: a mistake in the experiment.
    pub fn number(&self, name: &str) -> f64 {
        self.value(name)
            .number()
            .unwrap_or_else(|| panic!("parameter {name} is text"))
    }

    /// The parameter of a name as text.
    pub fn text(&self, name: &str) -> String {
        self.value(name).to_cell()
    }

    /// A row of the table: the parameters, then these.
    pub fn row(&self, values: impl IntoIterator<Item = Value>) -> Vec<Value> {
        let parameters = self.parameters.iter().map(|(_, value)| value.clone());
        parameters.chain(values).collect()
    }
}

/// The values of a parameter.
pub fn values<T: Into<Value>>(values: impl IntoIterator<Item = T>) -> Vec<Value> {
    values.into_iter().map(Into::into).collect()
}

/// A run for every combination of these parameters; the last varies fastest.
pub fn grid<const N: usize>(parameters: [(&str, Vec<Value>); N]) -> Vec<Run> {
    let mut runs = vec![Run::new([])];
    for (name, values) in parameters {
        let with = |run: &Run, value: &Value| {
            let mut run = run.clone();
            run.parameters.push((name.to_owned(), value.clone()));
            run
        };
        runs = runs
            .iter()
            .flat_map(|run| values.iter().map(|value| with(run, value)))
            .collect();
    }
    runs
}

/// What a run gives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Rows of the experiment's table, each in the order of its columns.
    pub rows: Vec<Vec<Value>>,
    /// Work done.
    pub work: Work,
}

impl Outcome {
    /// A run that gives one row.
    pub fn of_row(row: Vec<Value>, work: Work) -> Self {
        Self {
            rows: vec![row],
            work,
        }
    }
}

/// What the times of a run are of, and so what may run beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timing {
    /// No claim rests on a time: as many runs at once as there are threads.
    Untimed,
    /// CPU time of the run's one thread (`ThreadClock`): as many runs at once as there are threads, but never more than one a core.
    /// What they share beyond cores, caches above all, remains: claims compare times of the same run, or leave room for it.
    OwnThread,
    /// CPU time of the process, or time on the wall: one run at a time.
    WholeMachine,
}

impl Timing {
    /// The most runs at once on so many threads (≥ 1) of a machine of so many cores (≥ 1).
    pub fn runs_at_once(self, threads: usize, cores: usize) -> usize {
        match self {
            Self::Untimed => threads,
            Self::OwnThread => threads.min(cores),
            Self::WholeMachine => 1,
        }
    }
}

/// What the experiment says about a complete table.
#[derive(Clone, Debug, Default)]
pub struct Conclusion {
    /// Claims.
    pub claims: Vec<Claim>,
    /// Plots.
    pub plots: Vec<Plot>,
    /// Pairs of pictures, where the table holds any.
    pub pictures: Vec<Contrast>,
}

/// An experiment: one readable file says its question, its prediction and its sweep.
#[derive(Clone, Copy, Debug)]
pub struct Experiment {
    /// Name of the experiment, its binary and its CSV.
    pub name: &'static str,
    /// The question.
    pub question: &'static str,
    /// What theory predicts.
    pub prediction: &'static str,
    /// The method, with its sources.
    pub method: &'static str,
    /// Columns of the table; those that end in `_s`, `_ms`, `_ns` or start with `ns_per_`, and `seconds`, hold times.
    pub columns: &'static [&'static str],
    /// What the times of a run are of: says what may run beside it.
    pub timing: Timing,
    /// CPU seconds of all runs at smoke, standard and full effort, on one core of some 3 GHz: what a full run's estimate rests on.
    /// The first two are measured, the last may be scaled from them by the amount of work (rays, samples, photons).
    pub cpu_seconds: [f64; 3],
    /// The runs at an effort, each with a name of its own; the table keeps their order.
    pub plan: fn(Effort) -> Vec<Run>,
    /// One run; must depend on its arguments only. `seed` is already keyed with the run's name.
    pub execute: fn(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome>,
    /// Verdicts and plots from the complete table.
    pub conclude: fn(table: &Table, effort: Effort) -> Conclusion,
}

impl Experiment {
    /// The subject of a claim of this experiment.
    pub fn subject<'a>(
        &self,
        claim: &'a str,
        statement: &'a str,
        decided_at: Effort,
        effort: Effort,
    ) -> Subject<'a> {
        Subject {
            experiment: self.name,
            claim,
            statement,
            decided_at,
            effort,
        }
    }

    /// The table of these rows.
    pub fn table(&self, rows: Vec<Vec<Value>>) -> Table {
        Table {
            columns: self.columns.iter().map(|&name| name.to_owned()).collect(),
            rows,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_is_timed_on_a_core_of_its_own_and_a_machine_by_one_run() {
        for (threads, cores) in [(1, 1), (1, 8), (8, 2), (2, 2), (3, 4)] {
            let at_once = |timing: Timing| timing.runs_at_once(threads, cores);
            assert_eq!(at_once(Timing::Untimed), threads);
            assert_eq!(at_once(Timing::OwnThread), threads.min(cores));
            assert_eq!(at_once(Timing::WholeMachine), 1);
        }
    }
}
