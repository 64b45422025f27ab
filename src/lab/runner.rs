//! Runs an experiment: plan, runs (beside each other as their timing allows), records, table, conclusion.
//!
//! A run's random numbers are keyed by the seed, the experiment and the run's name, and the table is put together from the
//! records in the order of the plan: threads, shards, order and interruptions change no byte of it, times aside.

use super::claim::{Claim, Doubt};
use super::experiment::{Conclusion, Effort, Experiment, Run, Table};
use super::machine::Machine;
use super::record::{Record, Records};
use crate::image::file::write_atomically;
use crate::numeric::rng::mix;
use anyhow::{Context as _, bail, ensure};
use std::collections::BTreeSet;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// A part of the plan: runs whose number leaves `index` − 1 when divided by `count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Number of this part, from 1.
    pub index: usize,
    /// Number of parts, ≥ 1.
    pub count: usize,
}

impl Shard {
    /// The whole plan.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    fn holds(self, run: usize) -> bool {
        run % self.count == self.index - 1
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (index, count) = text.split_once('/')?;
            let shard = Self {
                index: index.trim().parse().ok()?,
                count: count.trim().parse().ok()?,
            };
            (1..=shard.count).contains(&shard.index).then_some(shard)
        };
        parse().ok_or_else(|| format!("expected I/N with 1 <= I <= N, as 2/3, not {text:?}"))
    }
}

/// How to run an experiment.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Effort.
    pub effort: Effort,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Threads; all cores if `None`. Never changes a result.
    pub threads: Option<usize>,
    /// Directory of the results.
    pub out: PathBuf,
    /// Part of the plan to run.
    pub shard: Shard,
}

/// A finished experiment, or the finished part of one.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The rows of all finished runs.
    pub table: Table,
    /// Claims and plots; empty while runs are missing.
    pub conclusion: Conclusion,
    /// Runs of the plan.
    pub runs: usize,
    /// Runs of the plan without a record: other shards', not yet done.
    pub missing: usize,
    /// Runs that were finished before.
    pub reused: usize,
    /// Seconds of all runs together.
    pub seconds: f64,
}

/// Directory, below that of the results, of second looks.
pub const SECOND: &str = "second";

/// The seed of the second look at an experiment.
pub fn second_seed(seed: u64) -> u64 {
    // Any fixed word: it keeps the two looks apart.
    mix(&[seed, 0x5ec0_0d10])
}

/// Runs what is not yet done of (a shard of) an experiment and writes OUT/NAME.csv and, when all runs are there,
/// OUT/NAME.claims.json. If a claim is in doubt, all is run again with a fresh seed in OUT/second, and that decides. `watch` hears the number of runs done and to do, from any thread.
pub fn run_experiment(
    experiment: &Experiment,
    options: &RunOptions,
    watch: &(dyn Fn(usize, usize) + Sync),
) -> anyhow::Result<Finished> {
    let mut finished = run_once(experiment, options, watch)?;
    if finished.in_doubt() {
        let again = RunOptions {
            seed: second_seed(options.seed),
            out: options.out.join(SECOND),
            shard: Shard::WHOLE,
            ..options.clone()
        };
        let again = run_once(experiment, &again, watch)?;
        finished.look_again(Some(&again));
        finished.write(experiment, &options.out)?;
    }
    Ok(finished)
}

fn run_once(
    experiment: &Experiment,
    options: &RunOptions,
    watch: &(dyn Fn(usize, usize) + Sync),
) -> anyhow::Result<Finished> {
    let plan = checked_plan(experiment, options.effort)?;
    let records = Records::new(&options.out, experiment, options.effort, options.seed);
    let mine = plan
        .iter()
        .enumerate()
        .filter(|(index, _)| options.shard.holds(*index));
    let (done, to_do): (Vec<&Run>, Vec<&Run>) = mine
        .map(|(_, run)| run)
        .partition(|run| records.find(run).is_some());
    execute(experiment, options, &records, &to_do, watch)?;
    let found = plan.iter().map(|run| records.find(run)).collect();
    let mut finished = Finished::of(experiment, options.effort, found);
    finished.reused = done.len();
    finished.write(experiment, &options.out)?;
    Ok(finished)
}

impl Finished {
    /// The table of the records of a plan, in its order, and, if none is absent, what the experiment concludes.
    pub(super) fn of(experiment: &Experiment, effort: Effort, found: Vec<Option<Record>>) -> Self {
        let runs = found.len();
        let missing = found.iter().filter(|record| record.is_none()).count();
        let found: Vec<Record> = found.into_iter().flatten().collect();
        let seconds = found.iter().map(|record| record.seconds).sum();
        let table = experiment.table(found.into_iter().flat_map(|record| record.rows).collect());
        let conclusion = match missing {
            0 => (experiment.conclude)(&table, effort),
            _ => Conclusion::default(),
        };
        Self {
            table,
            conclusion,
            runs,
            missing,
            reused: 0,
            seconds,
        }
    }

    /// Whether a claim asks for a second look.
    pub(super) fn in_doubt(&self) -> bool {
        let claims = &self.conclusion.claims;
        claims.iter().any(|claim| claim.doubt != Doubt::None)
    }

    /// Takes the claims in doubt from a second look, if there was one. Table and plots stay those of the first.
    pub(super) fn look_again(&mut self, again: Option<&Self>) {
        for claim in &mut self.conclusion.claims {
            if claim.doubt != Doubt::None {
                let second = again.and_then(|again| {
                    let claims = &again.conclusion.claims;
                    claims.iter().find(|other| other.claim == claim.claim)
                });
                *claim = claim.looked_at_again(second);
            }
        }
        self.seconds += again.map_or(0.0, |again| again.seconds);
    }

    /// Writes OUT/NAME.csv and, when all runs are there, OUT/NAME.claims.json.
    pub fn write(&self, experiment: &Experiment, out: &Path) -> anyhow::Result<()> {
        let path = |ending: &str| out.join(format!("{}.{ending}", experiment.name));
        write_atomically(&path("csv"), &self.table.to_csv())?;
        if self.missing == 0 {
            write_atomically(&path("claims.json"), &claims_json(&self.conclusion.claims)?)?;
        }
        Ok(())
    }
}

/// Claims as a JSON array, one per line.
pub fn claims_json(claims: &[Claim]) -> anyhow::Result<Vec<u8>> {
    let lines: Result<Vec<String>, _> = claims.iter().map(serde_json::to_string).collect();
    Ok(format!("[\n{}\n]\n", lines?.join(",\n")).into_bytes())
}

/// The plan, with run names that differ.
pub fn checked_plan(experiment: &Experiment, effort: Effort) -> anyhow::Result<Vec<Run>> {
    let plan = (experiment.plan)(effort);
    let names: BTreeSet<String> = plan.iter().map(Run::name).collect();
    ensure!(
        names.len() == plan.len(),
        "{}: two runs of the plan have the same name",
        experiment.name
    );
    Ok(plan)
}

/// The seed of a run.
fn seed_of(experiment: &Experiment, run: &Run, seed: u64) -> u64 {
    let word = |text: &str| {
        let hash = blake3::hash(text.as_bytes());
        u64::from_le_bytes(
            hash.as_bytes()[..8]
                .try_into()
                .expect("a hash has 32 bytes"),
        )
    };
    mix(&[seed, word(experiment.name), word(&run.name())])
}

fn execute(
    experiment: &Experiment,
    options: &RunOptions,
    records: &Records,
    runs: &[&Run],
    watch: &(dyn Fn(usize, usize) + Sync),
) -> anyhow::Result<()> {
    let machine = Machine::here();
    let threads = options.threads.unwrap_or(machine.cores);
    let finished = AtomicUsize::new(0);
    watch(0, runs.len());
    let one = |run: &&Run| -> anyhow::Result<()> {
        let start = Instant::now();
        let seed = seed_of(experiment, run, options.seed);
        let outcome = (experiment.execute)(run, options.effort, seed)
            .with_context(|| format!("{}, run {:?}", experiment.name, run.name()))?;
        if let Some(row) = outcome
            .rows
            .iter()
            .find(|row| row.len() != experiment.columns.len())
        {
            bail!(
                "{}, run {:?}: a row of {} values for {} columns",
                experiment.name,
                run.name(),
                row.len(),
                experiment.columns.len()
            );
        }
        records.store(
            run,
            outcome,
            &machine,
            threads,
            start.elapsed().as_secs_f64(),
        )?;
        watch(finished.fetch_add(1, Ordering::Relaxed) + 1, runs.len());
        Ok(())
    };
    let workers = experiment
        .timing
        .runs_at_once(threads, machine.cores)
        .min(runs.len());
    let next = AtomicUsize::new(0);
    // Threads of our own, not a pool's: a pool's thread that waits for a render would start other runs meanwhile, and mix their
    // times and memory. Every run is tried before the first error is told, so that one bad run does not cost the others.
    let work = || -> Vec<anyhow::Result<()>> {
        let taken = std::iter::repeat_with(|| next.fetch_add(1, Ordering::Relaxed));
        taken.map_while(|index| runs.get(index)).map(one).collect()
    };
    let results: Vec<anyhow::Result<()>> = std::thread::scope(|scope| {
        let handles: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        handles
            .into_iter()
            .flat_map(|handle| handle.join().unwrap_or_else(|panic| resume_unwind(panic)))
            .collect()
    });
    results.into_iter().collect()
}
