//! The main of every experiment binary.

use crate::experiments;
use crate::lab::claim::{Claim, Verdict};
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
    write!(stdout, "{}", claims_table(&finished.conclusion.claims))?;
    Ok(exit_code(&finished.conclusion.claims))
}

/// 1 if a claim failed, or its effort should have decided it and did not.
pub(crate) fn exit_code(claims: &[Claim]) -> ExitCode {
    ExitCode::from(u8::from(claims.iter().any(Claim::fails_the_run)))
}

/// The claims as a table for people, failures first.
pub(crate) fn claims_table(claims: &[Claim]) -> String {
    let mut text = String::new();
    let mut sorted: Vec<&Claim> = claims.iter().collect();
    sorted.sort_by_key(|claim| urgency(claim.verdict));
    for claim in sorted {
        text += &format!(
            "{:12}  {}/{}: predicted {}, measured {} [{}, {}], n {}, detectable {}\n",
            claim.verdict.word(),
            claim.experiment,
            claim.claim,
            plain(claim.predicted),
            plain(claim.measured),
            plain(claim.ci_low),
            plain(claim.ci_high),
            claim.n,
            plain(claim.detectable),
        );
    }
    text
}

/// Order of verdicts on pages: failures on top.
pub(crate) fn urgency(verdict: Verdict) -> u8 {
    match verdict {
        Verdict::Fail => 0,
        Verdict::Inconclusive => 1,
        Verdict::Pass => 2,
        Verdict::NotRun => 3,
    }
}

/// A number in ASCII.
pub(crate) fn plain(x: f64) -> String {
    crate::lab::page::number(x)
        .replace('−', "-")
        .replace('∞', "inf")
        .replace('–', "-")
}
