//! `photolathe verify`: every experiment, a table of claims, a page.

use super::experiment::{exit_code, limit_threads, threads};
use crate::experiments;
use crate::image::file::write_atomically;
use crate::lab::claim::{Claim, Subject};
use crate::lab::contrast::Contrast;
use crate::lab::experiment::{Effort, Experiment};
use crate::lab::golden::{self, GoldenVerdict};
use crate::lab::machine::Machine;
use crate::lab::progress::Progress;
use crate::lab::record::Records;
use crate::lab::report::{Report, Section, duration};
use crate::lab::runner::{RunOptions, Shard, checked_plan, claims_json, run_experiment};
use crate::lab::showcase::{self, SHOWPIECES};
use anyhow::bail;
use clap::Args;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Run the experiments and show what was predicted and what was measured.
#[derive(Debug, Args)]
#[command(after_help = "\
Writes DIR/index.html (one file, no network), DIR/claims.json, a CSV for every experiment, and the pictures.
Finished runs are kept in DIR and not run again. Exit codes: 0 fine, 1 a claim failed or stayed inconclusive at the effort that
should decide it, 2 trouble.")]
pub struct VerifyArgs {
    /// How much work to spend: smoke takes at most 2 minutes on 2 cores, standard about 30, full hours. Runs that measure time share the
    /// machine only where that does not disturb their clock: never more than one a core, or none beside them.
    #[arg(long, value_enum, default_value = "smoke")]
    effort: Effort,
    /// Only this experiment; may be repeated.
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Directory of the page and the results.
    #[arg(long, short, value_name = "DIR", default_value = "out/verify")]
    out: PathBuf,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Threads (default: all cores); never changes a result.
    #[arg(long, value_parser = threads)]
    threads: Option<usize>,
}

/// Runs `verify`.
pub fn run(args: &VerifyArgs) -> anyhow::Result<ExitCode> {
    let start = Instant::now();
    let chosen = chosen(&args.only)?;
    limit_threads(args.threads)?;
    if args.effort == Effort::Full {
        eprint!("{}", estimate(&chosen, args)?);
    }
    let whole = args.only.is_empty();
    let pictures = if whole {
        pictures(args)
    } else {
        Ok(Vec::new())
    };
    let other_claims = if whole {
        goldens(args.effort)
    } else {
        Vec::new()
    };
    let sections = chosen
        .into_iter()
        .map(|experiment| section(experiment, args))
        .collect();
    let mut trouble: Vec<String> = pictures
        .as_ref()
        .err()
        .map(|error| format!("{error:#}"))
        .into_iter()
        .collect();
    let report = Report {
        effort: args.effort,
        seed: args.seed,
        command: command(args),
        seconds: start.elapsed().as_secs_f64(),
        machines: vec![Machine::here()],
        other_claims,
        pictures: pictures.unwrap_or_default(),
        sections,
        against: None,
    };
    trouble.extend(
        report
            .sections
            .iter()
            .filter_map(|section| section.result.as_ref().err().cloned()),
    );
    finish(args, &report, &trouble)
}

fn finish(args: &VerifyArgs, report: &Report, trouble: &[String]) -> anyhow::Result<ExitCode> {
    let page = args.out.join("index.html");
    let plain = write_page(report, &page)?;
    let mut stdout = std::io::stdout().lock();
    writeln!(
        stdout,
        "\n{} {}\n{}",
        report.summary(),
        duration(report.seconds),
        page.display()
    )?;
    for line in trouble {
        eprintln!("photolathe: {line}");
    }
    if trouble.is_empty() {
        Ok(exit_code(&plain))
    } else {
        Ok(ExitCode::from(super::TROUBLE))
    }
}

/// Prints the claims, writes the page and claims.json beside it, and gives the claims.
pub(super) fn write_page(report: &Report, page: &Path) -> anyhow::Result<Vec<Claim>> {
    let claims = report.claims();
    write!(std::io::stdout(), "{}", super::table::claims(&claims))?;
    write_atomically(page, report.html()?.as_bytes())?;
    let plain: Vec<Claim> = claims.into_iter().map(|(claim, _)| claim.clone()).collect();
    write_atomically(&page.with_file_name("claims.json"), &claims_json(&plain)?)?;
    Ok(plain)
}

pub(super) fn chosen(only: &[String]) -> anyhow::Result<Vec<&'static Experiment>> {
    let known = || experiments::ALL.iter();
    for name in only {
        if !known().any(|experiment| experiment.name == name) {
            let names: Vec<&str> = known().map(|experiment| experiment.name).collect();
            bail!("no experiment {name:?}; there are {}", names.join(", "));
        }
    }
    Ok(known()
        .filter(|e| only.is_empty() || only.iter().any(|name| name == e.name))
        .collect())
}

fn options(args: &VerifyArgs) -> RunOptions {
    RunOptions {
        effort: args.effort,
        seed: args.seed,
        threads: args.threads,
        out: args.out.clone(),
        shard: Shard::WHOLE,
    }
}

fn section(experiment: &'static Experiment, args: &VerifyArgs) -> Section<'static> {
    let progress = Progress::start(experiment.name);
    let result = run_experiment(experiment, &options(args), &|done, all| {
        progress.tell(done, all)
    });
    match &result {
        Ok(finished) => progress.end(&format!(
            "{} claims, {} of work",
            finished.conclusion.claims.len(),
            duration(finished.seconds)
        )),
        Err(error) => progress.end(&format!("stopped: {error:#}")),
    }
    Section {
        experiment,
        result: result.map_err(|error| format!("{error:#}")),
        command: format!(
            "cargo run --release --bin {} -- --effort {} --seed {}",
            experiment.name, args.effort, args.seed
        ),
    }
}

fn pictures(args: &VerifyArgs) -> anyhow::Result<Vec<Contrast>> {
    let mut shown = Vec::new();
    for piece in &SHOWPIECES {
        let progress = Progress::start(piece.name);
        let drawn = piece.draw(args.effort, args.threads, &args.out, &|done, all| {
            progress.tell(done, all)
        });
        progress.end(if drawn.is_ok() { "rendered" } else { "failed" });
        shown.push(drawn?);
    }
    Ok(shown)
}

/// The goldens of the working directory as one exact claim.
fn goldens(effort: Effort) -> Vec<(Claim, f64)> {
    let directories = ["reference", "regression"].map(|kind| Path::new("golden").join(kind));
    if directories
        .iter()
        .all(|directory| golden::names(directory).is_empty())
    {
        return Vec::new();
    }
    let progress = Progress::start("goldens");
    let outcomes: Vec<golden::Outcome> = directories
        .iter()
        .flat_map(|directory| golden::check_all(directory))
        .collect();
    let wrong = outcomes.iter().filter(|outcome| match &outcome.check {
        Ok(check) => check.verdict == GoldenVerdict::Different,
        Err(_) => true,
    });
    let wrong = wrong.count() as u64;
    let seconds = outcomes.iter().map(|outcome| outcome.seconds).sum();
    progress.end(&format!(
        "{} of {} different or broken",
        wrong,
        outcomes.len()
    ));
    let subject = Subject {
        experiment: "golden",
        claim: "unchanged",
        statement: "Every golden picture is identical to the accepted one, or statistically equivalent (photolathe golden check).",
        decided_at: Effort::Smoke,
        effort,
    };
    vec![(Claim::exact(subject, wrong, outcomes.len() as u64), seconds)]
}

fn command(args: &VerifyArgs) -> String {
    let only: String = args
        .only
        .iter()
        .map(|name| format!(" --only {name}"))
        .collect();
    format!(
        "photolathe verify --effort {}{only} --seed {}",
        args.effort, args.seed
    )
}

/// What a run will take, by the CPU seconds that the experiments state and the runs that are not done yet.
fn estimate(chosen: &[&Experiment], args: &VerifyArgs) -> anyhow::Result<String> {
    let mut text = String::new();
    let cores = Machine::here().cores;
    let threads = args.threads.unwrap_or(cores);
    let (mut sum, mut wall) = (0.0, 0.0);
    for experiment in chosen {
        let plan = checked_plan(experiment, args.effort)?;
        let records = Records::new(&args.out, experiment, args.effort, args.seed);
        let to_do = plan
            .iter()
            .filter(|run| records.find(run).is_none())
            .count();
        let share = to_do as f64 / plan.len().max(1) as f64;
        let seconds = share * args.effort.of(experiment.cpu_seconds);
        sum += seconds;
        wall += seconds / experiment.timing.runs_at_once(threads, cores) as f64;
        let (name, all, time) = (experiment.name, plan.len(), duration(seconds));
        text += &format!("{name:14} about {time} of CPU, {to_do} of {all} runs to do\n");
    }
    if args.only.is_empty() {
        let seconds = args.effort.of(showcase::CPU_SECONDS);
        sum += seconds;
        wall += seconds / threads as f64;
        text += &format!("{:14} about {} of CPU\n", "pictures", duration(seconds));
    }
    text += &format!(
        "in all         about {} of CPU, {} on {threads} threads; within a factor of two, from the CPU seconds that each experiment\n\
         states (measured at smoke and standard, scaled from there by the amount of work at full effort)\n",
        duration(sum),
        duration(wall)
    );
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_experiment_has_an_estimate_before_its_first_run() {
        let out = tempfile::tempdir().expect("a directory");
        let mut args = VerifyArgs {
            effort: Effort::Full,
            only: Vec::new(),
            out: out.path().to_owned(),
            seed: 0,
            threads: Some(4),
        };
        let chosen = chosen(&[]).expect("all experiments");
        for experiment in &chosen {
            let [smoke, standard, full] = experiment.cpu_seconds;
            let name = experiment.name;
            assert!(
                0.0 < smoke && smoke <= standard && standard <= full,
                "{name}"
            );
        }
        let whole = estimate(&chosen, &args).expect("an estimate");
        assert_eq!(whole.matches("of CPU").count(), chosen.len() + 2, "{whole}");
        assert!(whole.contains("on 4 threads"));
        args.only = vec!["eps".to_owned()];
        let eps = experiments::eps::EXPERIMENT;
        let one = estimate(&[&eps], &args).expect("an estimate");
        let time = duration(eps.cpu_seconds[2]);
        let runs = (eps.plan)(Effort::Full).len();
        assert!(
            one.starts_with(&format!(
                "eps            about {time} of CPU, {runs} of {runs} runs"
            )),
            "{one}"
        );
        assert!(one.contains(&format!("in all         about {time} of CPU")));
    }
}
