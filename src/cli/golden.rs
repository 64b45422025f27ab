//! `photolathe golden`: pictures that must not change unnoticed.

use super::table::aligned;
use crate::image::exr;
use crate::image::file::write_atomically;
use crate::lab::golden::page::Checked;
use crate::lab::golden::{self, GoldenVerdict, LEVEL, Outcome, REPLICATES};
use crate::lab::page::ascii_number;
use crate::lab::progress::Progress;
use crate::lab::report::duration;
use anyhow::{Context as _, bail};
use clap::{Args, Subcommand};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Check or accept golden pictures.
#[derive(Debug, Args)]
pub struct GoldenArgs {
    #[command(subcommand)]
    command: GoldenCommand,
}

#[derive(Debug, Subcommand)]
enum GoldenCommand {
    /// Render the goldens anew: identical, equivalent or different.
    Check {
        /// Only this one.
        name: Option<String>,
        /// Directory with reference/ and regression/.
        #[arg(long, default_value = "golden")]
        dir: PathBuf,
        /// Where to put the page and the new pictures of goldens that are different.
        #[arg(long, short, default_value = "out/golden")]
        out: PathBuf,
    },
    /// Render a regression golden anew and keep that as the golden.
    Accept {
        /// The golden, or `all`.
        name: String,
        /// Why the picture changed.
        #[arg(long)]
        reason: String,
        /// Directory with reference/ and regression/.
        #[arg(long, default_value = "golden")]
        dir: PathBuf,
    },
}

/// The two kinds of goldens.
const KINDS: [&str; 2] = ["reference", "regression"];

/// Runs `golden`.
pub fn run(args: &GoldenArgs) -> anyhow::Result<ExitCode> {
    match &args.command {
        GoldenCommand::Check { name, dir, out } => check(name.as_deref(), dir, out),
        GoldenCommand::Accept { name, reason, dir } => accept(name, reason, dir),
    }
}

fn check(name: Option<&str>, dir: &Path, out: &Path) -> anyhow::Result<ExitCode> {
    let found = |kind: &&str| {
        let directory = dir.join(kind);
        golden::names(&directory)
            .into_iter()
            .map(move |name| (directory.clone(), name))
    };
    let mut todo: Vec<(PathBuf, String)> = KINDS.iter().flat_map(&found).collect();
    todo.retain(|(_, found)| name.is_none_or(|name| name == found));
    if todo.is_empty() {
        bail!(
            "no golden{} in {}",
            name.map(|n| format!(" {n}")).unwrap_or_default(),
            dir.display()
        );
    }
    let progress = Progress::start("goldens");
    let mut outcomes = Vec::new();
    for (index, (directory, name)) in todo.iter().enumerate() {
        progress.tell(index, todo.len());
        outcomes.push(Checked {
            directory: directory.clone(),
            outcome: golden::check(directory, name),
        });
    }
    progress.end(&format!("{} checked", todo.len()));
    outcomes.sort_by_key(|checked| checked.urgency());
    let rows: Vec<Vec<String>> = outcomes.iter().map(|c| row(&c.outcome)).collect();
    let header = [
        "verdict",
        "golden",
        "component",
        "n",
        "p",
        "seen: mean",
        "any block",
        "largest difference",
        "time",
    ];
    write!(std::io::stdout(), "{}", aligned(&header, &rows))?;
    writeln!(std::io::stdout(), "{}", legend())?;
    for checked in &outcomes {
        explain(checked, out)?;
    }
    let page = out.join("index.html");
    write_atomically(&page, golden::page::html(&outcomes)?.as_bytes())
        .with_context(|| page.display().to_string())?;
    writeln!(std::io::stdout(), "\n{}", page.display())?;
    Ok(exit_code(outcomes.iter().map(|checked| &checked.outcome)))
}

/// What the numbers of the table mean.
fn legend() -> String {
    format!(
        "n: replicates compared in pairs where bits differ (0: the bits decide); different where p < {}; seen: smallest change, as a \
         share of the mean, that is called different with 90 % probability",
        ascii_number(LEVEL)
    )
}

fn row(outcome: &Outcome) -> Vec<String> {
    let percent = |share: f64| format!("{} %", ascii_number(100.0 * share));
    let (verdict, found) = match &outcome.check {
        Ok(check) => (
            check.verdict.word(),
            [
                check.replicates.to_string(),
                ascii_number(check.p),
                percent(check.detectable),
                percent(check.detectable_block),
                ascii_number(check.max),
            ],
        ),
        Err(_) => ("broken", ["-"; 5].map(str::to_owned)),
    };
    let mut row = vec![
        verdict.to_owned(),
        outcome.name.clone(),
        outcome.component.clone(),
    ];
    row.extend(found);
    row.push(duration(outcome.seconds));
    row
}

/// Says what to do about a golden that is not right, and puts the new picture where it can be looked at.
fn explain(checked: &Checked, out: &Path) -> anyhow::Result<()> {
    let (name, outcome) = (&checked.outcome.name, &checked.outcome);
    match (&outcome.check, &outcome.picture) {
        (Err(error), _) => eprintln!("{name}: {error:#}"),
        (Ok(check), Some(picture)) if check.verdict == GoldenVerdict::Different => {
            let new = out.join(format!("{name}.exr"));
            exr::write(picture, &new)?;
            let html = out.join(format!("{name}.html"));
            eprintln!(
                "{name}: look with   photolathe compare {} {} --html {}",
                new.display(),
                checked.directory.join(format!("{name}.exr")).display(),
                html.display(),
            );
            match checked.accept_command() {
                Some(command) => eprintln!("{name}: if the new one is right   {command}"),
                None => eprintln!("{name}: {}", golden::page::INDEPENDENT),
            }
        }
        _ => {}
    }
    Ok(())
}

/// 2 if a golden could not be checked, 1 if one is different, 0 otherwise.
fn exit_code<'a>(outcomes: impl Iterator<Item = &'a Outcome>) -> ExitCode {
    let code = |outcome: &Outcome| match &outcome.check {
        Err(_) => super::TROUBLE,
        Ok(check) => u8::from(check.verdict == GoldenVerdict::Different),
    };
    ExitCode::from(outcomes.map(code).max().unwrap_or(0))
}

fn accept(name: &str, reason: &str, dir: &Path) -> anyhow::Result<ExitCode> {
    let in_kind = |kind: &str| golden::names(&dir.join(kind));
    let names = match name {
        "all" => in_kind("regression"),
        name => vec![name.to_owned()],
    };
    for name in names {
        let known = |kind: &&&str| in_kind(kind).contains(&name);
        let Some(kind) = KINDS.iter().find(known) else {
            bail!(
                "no golden {name} in {}: write {name}.toml first",
                dir.display()
            );
        };
        let accepted = golden::accept(&dir.join(kind), &name, reason)?;
        let replicates = match accepted.replicates {
            Some(_) => format!("{REPLICATES} replicates"),
            None => "nothing in it is random".to_owned(),
        };
        let digest = accepted.digest.unwrap_or_default();
        writeln!(std::io::stdout(), "{name}  {digest}  {replicates}")?;
    }
    Ok(ExitCode::SUCCESS)
}
