//! The frame of an experiment: a plan of runs, a run, a conclusion. Everything else is the lab's.

use super::claim::Claim;
use super::plot::Plot;
use crate::numeric::work::Work;
use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// How much work an experiment may spend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Effort {
    /// Seconds: shows that all works, decides the coarse claims.
    Smoke,
    /// Minutes: decides every claim of daily use.
    Standard,
    /// Hours.
    Full,
}

/// A value of a table or a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// Whole number.
    Integer(i64),
    /// Number.
    Number(f64),
    /// Text.
    Text(String),
}

/// One run of a sweep: a named point of the grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The parameters, in the order of the plan; together they name the run.
    pub parameters: Vec<(String, Value)>,
}

/// What a run gives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Rows of the experiment's table, each in the order of its columns.
    pub rows: Vec<Vec<Value>>,
    /// Work done.
    pub work: Work,
}

/// What the experiment says about a complete table.
#[derive(Clone, Debug, Default)]
pub struct Conclusion {
    /// Claims.
    pub claims: Vec<Claim>,
    /// Plots.
    pub plots: Vec<Plot>,
}

/// The rows of all runs, in the order of the plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Column names.
    pub columns: Vec<String>,
    /// Rows.
    pub rows: Vec<Vec<Value>>,
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
    /// Columns of the table; those that end in `_s`, `_ms`, `_ns` or start with `ns_per_` hold times.
    pub columns: &'static [&'static str],
    /// Whether runs measure time and so must have the machine to themselves.
    pub timed: bool,
    /// The runs at an effort.
    pub plan: fn(Effort) -> Vec<Run>,
    /// One run; must depend on its arguments only. `seed` is already keyed with the run's name.
    pub execute: fn(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome>,
    /// Verdicts and plots from the complete table.
    pub conclude: fn(table: &Table, effort: Effort) -> Conclusion,
}
