//! The main of every experiment binary.

use crate::experiments;
use crate::lab::claim::Claim;
use crate::lab::experiment::{Effort, Experiment};
use crate::lab::progress::Progress;
use crate::lab::runner::{RunOptions, Shard, checked_plan, run_experiment};
use clap::Parser;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Flags of an experiment.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Writes OUT/NAME.csv, OUT/NAME.claims.json and OUT/NAME.records/. A finished run is never run again: an interrupted \
experiment continues, and shards that share OUT join. Exit codes: 0 fine, 1 a claim failed, 2 bad input or trouble."
)]
struct Arguments {
    /// How much work to spend
    #[arg(long, value_enum, default_value = "smoke")]
    effort: Effort,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Threads; all cores by default; never changes a result
    #[arg(long, value_parser = threads)]
    threads: Option<usize>,
    /// Directory of the results
    #[arg(long, short, default_value = "out/experiments")]
    out: PathBuf,
    /// Prints a line per run, and runs nothing
    #[arg(long)]
    list: bool,
    /// Runs part I of N of the plan
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    shard: Shard,
}

/// Most threads that make sense to ask for.
const MAX_THREADS: usize = 4096;

/// A number of threads.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    let count = text
        .parse()
        .ok()
        .filter(|count| (1..=MAX_THREADS).contains(count));
    count.ok_or_else(|| format!("expected a whole number from 1 to {MAX_THREADS}"))
}

/// Limits the threads of everything that does not have a pool of its own.
pub(crate) fn limit_threads(count: Option<usize>) -> anyhow::Result<()> {
    if let Some(count) = count {
        rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .build_global()?;
    }
    Ok(())
}

/// Runs the experiment of a name with the flags of the command line.
///
/// # Panics
/// If there is no experiment of that name: a mistake in its binary.
pub fn main(name: &str) -> ExitCode {
    let experiment = experiments::ALL
        .iter()
        .find(|experiment| experiment.name == name);
    let experiment = experiment.unwrap_or_else(|| panic!("no experiment {name}"));
    run(experiment, Arguments::parse()).unwrap_or_else(|error| {
        eprintln!("{name}: {error:#}");
        ExitCode::from(super::TROUBLE)
    })
}

fn run(experiment: &Experiment, arguments: Arguments) -> anyhow::Result<ExitCode> {
    let mut stdout = std::io::stdout().lock();
    if arguments.list {
        for run in checked_plan(experiment, arguments.effort)? {
            writeln!(stdout, "{}", run.name())?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let options = RunOptions {
        effort: arguments.effort,
        seed: arguments.seed,
        threads: arguments.threads,
        out: arguments.out,
        shard: arguments.shard,
    };
    limit_threads(options.threads)?;
    let progress = Progress::start(experiment.name);
    let finished = run_experiment(experiment, &options, &|done, all| progress.tell(done, all))?;
    progress.end(&format!(
        "{:.1} s of runs, {} finished before",
        finished.seconds, finished.reused
    ));
    if finished.missing > 0 {
        eprintln!(
            "{} runs of the plan are not done: no claims yet",
            finished.missing
        );
    }
    let claims: Vec<(&Claim, f64)> = finished
        .conclusion
        .claims
        .iter()
        .map(|claim| (claim, finished.seconds))
        .collect();
    write!(stdout, "{}", super::table::claims(&claims))?;
    Ok(exit_code(&finished.conclusion.claims))
}

/// 1 if a claim failed, or its effort should have decided it and did not.
pub(crate) fn exit_code(claims: &[Claim]) -> ExitCode {
    ExitCode::from(u8::from(claims.iter().any(Claim::fails_the_run)))
}
