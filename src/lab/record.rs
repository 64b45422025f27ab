//! Records: what one run was, and what it gave. One JSON file per run, written whole or not at all.

use super::experiment::{Effort, Experiment, Outcome, Run, Value};
use super::machine::Machine;
use crate::image::file::write_atomically;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Version of the record's form.
const SCHEMA: u32 = 1;

/// What decides the result of a run. A record is used again only if all of it is equal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Key {
    /// Version of the record's form.
    pub schema: u32,
    /// Experiment.
    pub experiment: String,
    /// Name of the run.
    pub run: String,
    /// Effort.
    pub effort: Effort,
    /// Seed of the experiment.
    pub seed: u64,
    /// Fingerprint of the program's sources and of how it was built.
    pub source: String,
    /// Fingerprint of the scenes and textures of the working directory.
    pub inputs: String,
}

/// A finished run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// What decides the result.
    pub key: Key,
    /// The parameters.
    pub parameters: Vec<(String, Value)>,
    /// The machine and the program.
    pub machine: Machine,
    /// Threads that worked on the experiment.
    pub threads: usize,
    /// Seconds of this run.
    pub seconds: f64,
    /// Work counters.
    pub counters: serde_json::Value,
    /// Rows of the table.
    pub rows: Vec<Vec<Value>>,
}

/// The records of one experiment in a directory.
#[derive(Clone, Debug)]
pub struct Records {
    directory: PathBuf,
    experiment: &'static str,
    effort: Effort,
    seed: u64,
    source: String,
    inputs: String,
}

impl Records {
    /// The records of an experiment below the directory of its results.
    pub fn new(out: &Path, experiment: &Experiment, effort: Effort, seed: u64) -> Self {
        Self {
            directory: out.join(format!("{}.records", experiment.name)),
            experiment: experiment.name,
            effort,
            seed,
            source: source(),
            inputs: inputs(&[Path::new("scenes"), Path::new("materials")]),
        }
    }

    fn key(&self, run: &Run) -> Key {
        Key {
            schema: SCHEMA,
            experiment: self.experiment.to_owned(),
            run: run.name(),
            effort: self.effort,
            seed: self.seed,
            source: self.source.clone(),
            inputs: self.inputs.clone(),
        }
    }

    fn path(&self, run: &Run) -> PathBuf {
        let name = run.name();
        let plain = |c: char| {
            if c.is_ascii_alphanumeric() || "=.-".contains(c) {
                c
            } else {
                '_'
            }
        };
        let word: String = name.chars().take(60).map(plain).collect();
        let identity = format!("{name}\0{}\0{}", self.effort, self.seed);
        let hash = blake3::hash(identity.as_bytes()).to_hex();
        self.directory.join(format!("{word}-{}.json", &hash[..16]))
    }

    /// The record of a run, if it was finished by this program with these inputs.
    pub fn find(&self, run: &Run) -> Option<Record> {
        let text = std::fs::read(self.path(run)).ok()?;
        let record: Record = serde_json::from_slice(&text).ok()?;
        (record.key == self.key(run)).then_some(record)
    }

    /// Stores what a run gave.
    pub fn store(
        &self,
        run: &Run,
        outcome: Outcome,
        machine: &Machine,
        threads: usize,
        seconds: f64,
    ) -> anyhow::Result<Record> {
        let record = Record {
            key: self.key(run),
            parameters: run.parameters.clone(),
            machine: machine.clone(),
            threads,
            seconds,
            counters: serde_json::to_value(outcome.work)?,
            rows: outcome.rows,
        };
        let mut text = serde_json::to_vec(&record)?;
        text.push(b'\n');
        write_atomically(&self.path(run), &text)?;
        Ok(record)
    }
}

/// Every record that can be read below OUT for an experiment, of whatever effort, seed and program, in the order of file names.
pub(super) fn read_all(out: &Path, experiment: &Experiment) -> Vec<Record> {
    let directory = out.join(format!("{}.records", experiment.name));
    let entries = std::fs::read_dir(directory).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "json"))
        .collect();
    files.sort();
    let read = |file: &PathBuf| serde_json::from_slice(&std::fs::read(file).ok()?).ok();
    let records = files.iter().filter_map(read);
    records
        .filter(|record: &Record| record.key.schema == SCHEMA)
        .collect()
}

/// Fingerprint of the sources, and whether the build has debug assertions (which changes times).
fn source() -> String {
    let build = if cfg!(debug_assertions) {
        "debug"
    } else {
        "release"
    };
    format!("{}-{build}", env!("PHOTOLATHE_SOURCE"))
}

/// Fingerprint of the files directly in these directories; absent ones count as empty.
fn inputs(directories: &[&Path]) -> String {
    let mut hasher = blake3::Hasher::new();
    for directory in directories {
        let entries = std::fs::read_dir(directory).into_iter().flatten().flatten();
        let mut files: Vec<PathBuf> = entries
            .map(|entry| entry.path())
            .filter(|path| path.is_file())
            .collect();
        files.sort();
        for file in files {
            hasher.update(file.to_string_lossy().as_bytes());
            hasher.update(blake3::hash(&std::fs::read(&file).unwrap_or_default()).as_bytes());
        }
    }
    hasher.finalize().to_hex()[..16].to_owned()
}
