//! Joins the records of shards, perhaps of several directories and machines, into complete tables.
//!
//! Records are joined only if one program made them at one effort, with one seed, from the same scenes. The table has the order of
//! the plan, so that it has the same bytes, times aside, as that of an unbroken run.

use super::experiment::{Effort, Experiment, Run};
use super::machine::Machine;
use super::record::{self, Record};
use super::runner::{Finished, SECOND, checked_plan, second_seed};
use super::table::same_row;
use anyhow::{bail, ensure};
use std::collections::HashMap;
use std::path::PathBuf;

/// Which records to join, where there are several kinds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Choice {
    /// Only of this effort.
    pub effort: Option<Effort>,
    /// Only of this seed.
    pub seed: Option<u64>,
}

/// What all joined records share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Effort.
    pub effort: Effort,
    /// Seed of the experiment.
    pub seed: u64,
    /// Fingerprint of the program.
    pub source: String,
    /// Fingerprint of the scenes and textures.
    pub inputs: String,
}

impl Origin {
    fn of(record: &Record) -> Self {
        Self {
            effort: record.key.effort,
            seed: record.key.seed,
            source: record.key.source.clone(),
            inputs: record.key.inputs.clone(),
        }
    }
}

impl std::fmt::Display for Origin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            effort,
            seed,
            source,
            inputs,
        } = self;
        write!(
            f,
            "effort {effort}, seed {seed}, program {source}, scenes {inputs}"
        )
    }
}

/// One experiment, joined.
#[derive(Debug)]
pub struct Joined<'a> {
    /// The experiment.
    pub experiment: &'a Experiment,
    /// Its table and, if no run is missing, its conclusion.
    pub finished: Finished,
    /// Names of the runs of the plan that no directory has.
    pub missing: Vec<String>,
}

/// All experiments of some directories.
#[derive(Debug)]
pub struct Side<'a> {
    /// Where it comes from.
    pub directories: Vec<PathBuf>,
    /// What the records share.
    pub origin: Origin,
    /// The machines that made them, each once.
    pub machines: Vec<Machine>,
    /// Experiments with at least one record.
    pub joined: Vec<Joined<'a>>,
}

/// Joins the records below `directories`.
///
/// # Errors
/// If there are none, if they differ in what must be shared, if two directories hold different results of one run, or if the
/// records are not of this program's form of an experiment.
pub fn join<'a>(
    directories: &[PathBuf],
    experiments: &[&'a Experiment],
    choice: Choice,
) -> anyhow::Result<Side<'a>> {
    let mut origins: Vec<Origin> = Vec::new();
    let mut machines: Vec<Machine> = Vec::new();
    let mut found = Vec::new();
    for &experiment in experiments {
        let records = records(directories, experiment, choice)?;
        for record in &records {
            let origin = Origin::of(record);
            if !origins.contains(&origin) {
                origins.push(origin);
            }
            if !machines.contains(&record.machine) {
                machines.push(record.machine.clone());
            }
        }
        found.push((experiment, records));
    }
    let names: Vec<String> = directories
        .iter()
        .map(|d| d.display().to_string())
        .collect();
    let names = names.join(", ");
    let origin = match origins.as_slice() {
        [] => bail!("{names}: no finished runs of any experiment"),
        [origin] => origin.clone(),
        several => {
            let lines: Vec<String> = several.iter().map(Origin::to_string).collect();
            bail!(
                "{names}: runs that do not belong together; choose with --effort, --seed, --only:\n  {}",
                lines.join("\n  ")
            );
        }
    };
    found.retain(|(_, records)| !records.is_empty());
    let joined: anyhow::Result<Vec<Joined>> = found
        .into_iter()
        .map(|(experiment, records)| {
            let mut joined = one(experiment, origin.effort, records)?;
            if joined.finished.in_doubt() {
                second_look(&mut joined, directories, &origin)?;
            }
            Ok(joined)
        })
        .collect();
    Ok(Side {
        directories: directories.to_owned(),
        origin,
        machines,
        joined: joined?,
    })
}

/// Takes the claims in doubt from the records of a second look, if they are complete.
fn second_look(
    joined: &mut Joined,
    directories: &[PathBuf],
    origin: &Origin,
) -> anyhow::Result<()> {
    let directories: Vec<PathBuf> = directories.iter().map(|d| d.join(SECOND)).collect();
    let choice = Choice {
        effort: Some(origin.effort),
        seed: Some(second_seed(origin.seed)),
    };
    let mut records = records(&directories, joined.experiment, choice)?;
    records.retain(|r| r.key.source == origin.source && r.key.inputs == origin.inputs);
    let again = one(joined.experiment, origin.effort, records)?;
    let complete = again.missing.is_empty().then_some(&again.finished);
    joined.finished.look_again(complete);
    Ok(())
}

/// The chosen records of the runs that the plan has.
fn records(
    directories: &[PathBuf],
    experiment: &Experiment,
    choice: Choice,
) -> anyhow::Result<Vec<Record>> {
    let mut kept: Vec<Record> = Vec::new();
    for directory in directories {
        check_header(directory, experiment)?;
        kept.extend(record::read_all(directory, experiment));
    }
    kept.retain(|record| {
        choice
            .effort
            .is_none_or(|effort| effort == record.key.effort)
            && choice.seed.is_none_or(|seed| seed == record.key.seed)
    });
    let mut plans: HashMap<Effort, Vec<String>> = HashMap::new();
    for record in &kept {
        let effort = record.key.effort;
        if let std::collections::hash_map::Entry::Vacant(entry) = plans.entry(effort) {
            let plan = checked_plan(experiment, effort)?;
            entry.insert(plan.iter().map(Run::name).collect());
        }
    }
    kept.retain(|record| plans[&record.key.effort].contains(&record.key.run));
    Ok(kept)
}

/// Refuses the table of a program whose experiment had other columns.
fn check_header(directory: &std::path::Path, experiment: &Experiment) -> anyhow::Result<()> {
    let path = directory.join(format!("{}.csv", experiment.name));
    if let Ok(mut reader) = csv::Reader::from_path(&path) {
        ensure!(
            reader
                .headers()?
                .iter()
                .eq(experiment.columns.iter().copied()),
            "{}: columns of another version of {}",
            path.display(),
            experiment.name
        );
    }
    Ok(())
}

fn one(
    experiment: &Experiment,
    effort: Effort,
    records: Vec<Record>,
) -> anyhow::Result<Joined<'_>> {
    let mut by_name: HashMap<String, Record> = HashMap::new();
    for record in records {
        let name = record.key.run.clone();
        ensure!(
            record
                .rows
                .iter()
                .all(|row| row.len() == experiment.columns.len()),
            "{}, run {name:?}: a row without the {} columns of this version",
            experiment.name,
            experiment.columns.len()
        );
        if let Some(known) = by_name.get(&name) {
            let same = known.rows.len() == record.rows.len()
                && known
                    .rows
                    .iter()
                    .zip(&record.rows)
                    .all(|(a, b)| same_row(experiment.columns, a, b));
            ensure!(
                same,
                "{}, run {name:?}: two directories hold different results of the same run",
                experiment.name
            );
        } else {
            by_name.insert(name, record);
        }
    }
    let plan = checked_plan(experiment, effort)?;
    let found: Vec<Option<Record>> = plan.iter().map(|run| by_name.remove(&run.name())).collect();
    let missing = plan.iter().zip(&found).filter(|(_, found)| found.is_none());
    let missing = missing.map(|(run, _)| run.name()).collect();
    let done = found.iter().flatten().count();
    let mut finished = Finished::of(experiment, effort, found);
    finished.reused = done;
    Ok(Joined {
        experiment,
        finished,
        missing,
    })
}
