//! `photolathe report`: joins the results of shards, and sets two runs side by side.

use super::experiment::exit_code;
use super::table::aligned;
use super::verify::{chosen, write_page};
use crate::image::file::write_atomically;
use crate::lab::experiment::Effort;
use crate::lab::join::{Choice, Joined, Origin, Side, join};
use crate::lab::page::ascii_number;
use crate::lab::report::{Report, Section};
use crate::lab::versus::{self, Agreement, Pair, Versus};
use clap::Args;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Missing runs that are named on stderr for each experiment; the page names all.
const NAMED: usize = 10;

/// Join the results of shards into one page, or set two runs side by side.
#[derive(Debug, Args)]
#[command(after_help = "\
A DIR is the --out of an experiment or of verify. Writes the page and, beside it, claims.json and a CSV and claims for every complete
experiment, with the bytes of an unbroken run, times aside; with --against also against.json. Pictures and goldens are not runs: they
are on the page of verify only. Exit codes: 0 fine, 1 a claim failed, or differs between the two runs, 2 runs are missing, or trouble.")]
pub struct ReportArgs {
    /// Directories of results, to be joined
    #[arg(value_name = "DIR", required = true)]
    directories: Vec<PathBuf>,
    /// Directory of another run to set beside; repeat it to join its shards
    #[arg(long, value_name = "DIR")]
    against: Vec<PathBuf>,
    /// Only this experiment; may be repeated
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Only runs of this effort
    #[arg(long, value_enum)]
    effort: Option<Effort>,
    /// Only runs of this seed
    #[arg(long)]
    seed: Option<u64>,
    /// Only runs of this seed of the other run, if it is not that of --seed
    #[arg(long, value_name = "SEED", requires = "against")]
    against_seed: Option<u64>,
    /// The page
    #[arg(
        long,
        short,
        value_name = "FILE.html",
        default_value = "out/report/index.html"
    )]
    out: PathBuf,
}

/// Runs `report`.
pub fn run(args: &ReportArgs) -> anyhow::Result<ExitCode> {
    let start = Instant::now();
    let experiments = chosen(&args.only)?;
    let choice = Choice {
        effort: args.effort,
        seed: args.seed,
    };
    let other_choice = Choice {
        effort: args.effort,
        seed: args.against_seed.or(args.seed),
    };
    let side = join(&args.directories, &experiments, choice)?;
    let other = match args.against.as_slice() {
        [] => None,
        against => Some(join(against, &experiments, other_choice)?),
    };
    let folder = args.out.parent().unwrap_or(Path::new("."));
    for joined in side
        .joined
        .iter()
        .filter(|joined| joined.missing.is_empty())
    {
        joined.finished.write(joined.experiment, folder)?;
    }
    let pairs = other.as_ref().map(|other| versus::pairs(&side, other));
    let against = other
        .as_ref()
        .zip(pairs.as_ref())
        .map(|(other, pairs)| Versus::new(&side, other, pairs));
    let mut incomplete = say_missing(&side);
    incomplete |= other.as_ref().is_some_and(say_missing);
    let report = Report {
        effort: side.origin.effort,
        seed: side.origin.seed,
        command: command(args),
        seconds: start.elapsed().as_secs_f64(),
        machines: side.machines,
        other_claims: Vec::new(),
        pictures: Vec::new(),
        sections: side
            .joined
            .into_iter()
            .map(|joined| section(joined, &side.origin))
            .collect(),
        against,
    };
    let claims = write_page(&report, &args.out)?;
    let mut differs = false;
    if let Some(pairs) = &pairs {
        write_pairs(pairs, folder)?;
        differs = pairs
            .iter()
            .any(|pair| pair.agreement == Agreement::Different);
    }
    writeln!(
        std::io::stdout(),
        "\n{}\n{}",
        report.summary(),
        args.out.display()
    )?;
    Ok(match (incomplete, differs) {
        (true, _) => ExitCode::from(super::TROUBLE),
        (false, true) => ExitCode::from(1),
        (false, false) => exit_code(&claims),
    })
}

/// Names the runs that are missing; whether there are any.
fn say_missing(side: &Side) -> bool {
    for joined in &side.joined {
        let name = joined.experiment.name;
        for run in joined.missing.iter().take(NAMED) {
            eprintln!("{name}: missing run: {run}");
        }
        if joined.missing.len() > NAMED {
            eprintln!("{name}: and {} more", joined.missing.len() - NAMED);
        }
    }
    side.joined.iter().any(|joined| !joined.missing.is_empty())
}

fn section<'a>(joined: Joined<'a>, origin: &Origin) -> Section<'a> {
    let command = format!(
        "cargo run --release --bin {} -- --effort {} --seed {}",
        joined.experiment.name, origin.effort, origin.seed
    );
    let result = match joined.missing.as_slice() {
        [] => Ok(joined.finished),
        missing => Err(format!(
            "incomplete, no claims: {} runs are missing: {}",
            missing.len(),
            missing.join("; ")
        )),
    };
    Section {
        experiment: joined.experiment,
        result,
        command,
    }
}

fn write_pairs(pairs: &[Pair], folder: &Path) -> anyhow::Result<()> {
    let lines: Result<Vec<String>, _> = pairs.iter().map(serde_json::to_string).collect();
    let json = format!("[\n{}\n]\n", lines?.join(",\n"));
    write_atomically(&folder.join("against.json"), json.as_bytes())?;
    let measured = |claim: &Option<crate::lab::claim::Claim>| {
        claim
            .as_ref()
            .map_or_else(|| "absent".to_owned(), |claim| ascii_number(claim.measured))
    };
    let rows: Vec<Vec<String>> = pairs
        .iter()
        .map(|pair| {
            vec![
                pair.agreement.word().to_owned(),
                format!("{}/{}", pair.experiment, pair.claim),
                measured(&pair.a),
                measured(&pair.b),
            ]
        })
        .collect();
    let header = ["two runs", "claim", "this", "other"];
    let mut stdout = std::io::stdout().lock();
    write!(
        stdout,
        "\n{}\n{}\n",
        aligned(&header, &rows),
        versus::summary(pairs)
    )?;
    Ok(())
}

fn command(args: &ReportArgs) -> String {
    let mut words = vec!["photolathe report".to_owned()];
    words.extend(args.directories.iter().map(|d| d.display().to_string()));
    words.extend(
        args.against
            .iter()
            .map(|d| format!("--against {}", d.display())),
    );
    words.extend(args.only.iter().map(|name| format!("--only {name}")));
    words.extend(args.effort.map(|effort| format!("--effort {effort}")));
    words.extend(args.seed.map(|seed| format!("--seed {seed}")));
    words.extend(
        args.against_seed
            .map(|seed| format!("--against-seed {seed}")),
    );
    words.push(format!("-o {}", args.out.display()));
    words.join(" ")
}
