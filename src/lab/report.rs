//! The page of `verify` and `report`: claims with failures on top, then each experiment with its question, plots and table.

use super::claim::{Claim, Verdict};
use super::contrast::{Contrast, ContrastView};
use super::experiment::{Effort, Experiment, Value};
use super::machine::Machine;
use super::page::{fill, number};
use super::plot::Plot;
use super::runner::Finished;
use super::svg;
use super::versus::Versus;
use serde::Serialize;

/// Rows of a table shown at once; the CSV beside the page has all.
const SHOWN_ROWS: usize = 200;
/// A table up to this long is shown open.
const SHORT_ROWS: usize = 12;

/// One experiment of the page.
#[derive(Debug)]
pub struct Section<'a> {
    /// The experiment.
    pub experiment: &'a Experiment,
    /// What it gave, or why it stopped.
    pub result: Result<Finished, String>,
    /// The command that reproduces it.
    pub command: String,
}

/// Everything the page shows.
#[derive(Debug)]
pub struct Report<'a> {
    /// Effort.
    pub effort: Effort,
    /// Seed.
    pub seed: u64,
    /// The command that made the page.
    pub command: String,
    /// Seconds of the whole.
    pub seconds: f64,
    /// The machines and the programs: more than one where shards were joined.
    pub machines: Vec<Machine>,
    /// Claims that stand beside the experiments', with their seconds.
    pub other_claims: Vec<(Claim, f64)>,
    /// Pictures.
    pub pictures: Vec<Contrast>,
    /// Experiments.
    pub sections: Vec<Section<'a>>,
    /// Another run to set beside this one.
    pub against: Option<Versus>,
}

impl Report<'_> {
    /// All claims with the seconds of their experiments, failures first.
    pub fn claims(&self) -> Vec<(&Claim, f64)> {
        let finished = self
            .sections
            .iter()
            .filter_map(|section| section.result.as_ref().ok());
        let of_experiments =
            finished.flat_map(|f| f.conclusion.claims.iter().map(|claim| (claim, f.seconds)));
        let mut all: Vec<(&Claim, f64)> = of_experiments
            .chain(self.other_claims.iter().map(|(claim, s)| (claim, *s)))
            .collect();
        all.sort_by_key(|(claim, _)| urgency(claim.verdict));
        all
    }

    /// One sentence: how many claims have which verdict.
    pub fn summary(&self) -> String {
        let claims = self.claims();
        let count = |verdict| {
            claims
                .iter()
                .filter(|(claim, _)| claim.verdict == verdict)
                .count()
        };
        let stopped = self
            .sections
            .iter()
            .filter(|section| section.result.is_err())
            .count();
        let mut text = format!(
            "{} claims: {} failed, {} inconclusive, {} passed, {} not run at {} effort.",
            claims.len(),
            count(Verdict::Fail),
            count(Verdict::Inconclusive),
            count(Verdict::Pass),
            count(Verdict::NotRun),
            self.effort,
        );
        if stopped > 0 {
            text += &format!(" {stopped} experiments stopped with an error.");
        }
        text
    }

    /// The page.
    pub fn html(&self) -> anyhow::Result<String> {
        let claims = self
            .claims()
            .into_iter()
            .map(|(claim, s)| ClaimView::of(claim, s))
            .collect();
        let experiments: anyhow::Result<Vec<_>> =
            self.sections.iter().map(SectionView::of).collect();
        let view = View {
            effort: self.effort.to_string(),
            seed: self.seed,
            command: &self.command,
            seconds: duration(self.seconds),
            machines: &self.machines,
            against: self.against.as_ref(),
            summary: self.summary(),
            claims,
            pictures: views(&self.pictures)?,
            experiments: experiments?,
        };
        Ok(fill(include_str!("templates/verify.html"), view)?)
    }
}

/// Order of verdicts: what needs a look stands on top.
pub fn urgency(verdict: Verdict) -> u8 {
    match verdict {
        Verdict::Fail => 0,
        Verdict::Inconclusive => 1,
        Verdict::Pass => 2,
        Verdict::NotRun => 3,
    }
}

/// Seconds for people.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 0.0995 => format!("{:.0} ms", s * 1000.0),
        s if s < 99.5 => format!("{s:.1} s"),
        s if s < 5970.0 => format!("{:.1} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[derive(Serialize)]
struct View<'a> {
    effort: String,
    seed: u64,
    command: &'a str,
    seconds: String,
    machines: &'a [Machine],
    against: Option<&'a Versus>,
    summary: String,
    claims: Vec<ClaimView>,
    pictures: Vec<ContrastView>,
    experiments: Vec<SectionView>,
}

#[derive(Serialize)]
struct ClaimView {
    class: String,
    verdict: &'static str,
    experiment: String,
    claim: String,
    statement: String,
    effort: String,
    predicted: String,
    measured: String,
    interval: String,
    n: String,
    detectable: String,
    time: String,
}

impl ClaimView {
    fn of(claim: &Claim, seconds: f64) -> Self {
        Self {
            class: claim.verdict.word().replace(' ', ""),
            verdict: claim.verdict.word(),
            experiment: claim.experiment.clone(),
            claim: claim.claim.clone(),
            statement: claim.statement.clone(),
            effort: claim.effort.to_string(),
            predicted: number(claim.predicted),
            measured: number(claim.measured),
            interval: format!("{} … {}", number(claim.ci_low), number(claim.ci_high)),
            n: claim.n.to_string(),
            detectable: number(claim.detectable),
            time: duration(seconds),
        }
    }
}

#[derive(Serialize)]
struct PlotView {
    title: String,
    svg: String,
    /// Names of the points on the Pareto front, if the plot marks it.
    front: String,
}

impl PlotView {
    fn of(plot: &Plot) -> anyhow::Result<Self> {
        Ok(Self {
            title: plot.title.clone(),
            svg: svg::draw(plot).map_err(anyhow::Error::msg)?,
            front: if plot.front {
                front(plot)
            } else {
                String::new()
            },
        })
    }
}

/// The front in words: each series with the labels of its points.
fn front(plot: &Plot) -> String {
    let front = plot.pareto_front();
    let of = |index: usize| {
        let series = &plot.series[index];
        let points = front.iter().filter(|at| at.0 == index);
        let labels: Vec<&str> = points
            .filter_map(|at| series.labels.get(at.1).map(String::as_str))
            .collect();
        match labels.as_slice() {
            [] => series.name.clone(),
            labels => format!("{} at {}", series.name, labels.join(", ")),
        }
    };
    let named = (0..plot.series.len()).filter(|index| front.iter().any(|at| at.0 == *index));
    named.map(of).collect::<Vec<_>>().join("; ")
}

fn views(pictures: &[Contrast]) -> anyhow::Result<Vec<ContrastView>> {
    pictures.iter().map(Contrast::view).collect()
}

#[derive(Serialize)]
struct SectionView {
    name: &'static str,
    question: &'static str,
    prediction: &'static str,
    method: &'static str,
    command: String,
    runs: String,
    error: Option<String>,
    plots: Vec<PlotView>,
    pictures: Vec<ContrastView>,
    columns: &'static [&'static str],
    rows: Vec<Vec<String>>,
    shown: usize,
    all: usize,
    short: bool,
}

impl SectionView {
    fn of(section: &Section) -> anyhow::Result<Self> {
        let experiment = section.experiment;
        let mut view = Self {
            name: experiment.name,
            question: experiment.question,
            prediction: experiment.prediction,
            method: experiment.method,
            command: section.command.clone(),
            runs: "none finished".to_owned(),
            error: section.result.as_ref().err().cloned(),
            plots: Vec::new(),
            pictures: Vec::new(),
            columns: experiment.columns,
            rows: Vec::new(),
            shown: 0,
            all: 0,
            short: false,
        };
        if let Ok(finished) = &section.result {
            let rows = &finished.table.rows;
            view.runs = format!(
                "{}, {} of work in all; {} of them finished before",
                finished.runs,
                duration(finished.seconds),
                finished.reused
            );
            view.rows = rows
                .iter()
                .take(SHOWN_ROWS)
                .map(|row| row.iter().map(cell).collect())
                .collect();
            view.shown = view.rows.len();
            view.all = rows.len();
            view.short = rows.len() <= SHORT_ROWS;
            let plots = finished.conclusion.plots.iter().map(PlotView::of);
            view.plots = plots.collect::<anyhow::Result<_>>()?;
            view.pictures = views(&finished.conclusion.pictures)?;
        }
        Ok(view)
    }
}

fn cell(value: &Value) -> String {
    match value {
        Value::Number(x) => number(*x),
        other => other.to_cell(),
    }
}
