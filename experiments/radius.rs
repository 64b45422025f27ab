//! Which radius rule, kernel, first radius and α give the least error, and is it the one that theory predicts?
//!
//! The receiver is smooth and has no edges: the point straight below an isotropic lamp at height 1 over a plane (`radius/law.rs`). There the law
//! of the photons found by a pass is known, so mean and variance of every rule that does not look at photons are known to all digits, at
//! any number of passes. Under the local rule each pass less its mean at the radius it had is a martingale difference.
//!
//! Most runs draw the photons that a pass finds from their law, and give them to the program's own rules (`Schedule`, `Statistics`,
//! `Rule::divisor`) and kernels: millions of passes, at no cost for photons that miss (`by` = law). Some trace every photon
//! by `PhotonMapper` (`by` = render); that these follow the same law is what the experiment `photons` checks too.

mod conclusion;
pub(crate) mod law;
mod plots;

use crate::lab::experiment::{Effort, Experiment, Outcome, Run, Timing, Value, grid, values};
use crate::numeric::rng::{Purpose, Stream, mix};
use crate::numeric::statistics::Moments;
use crate::numeric::work::Work;
use crate::render::film::Film;
use crate::render::photon::{Phases, PhotonMapper};
use crate::render::settings::Settings;
use crate::scene::options::{Integrator, Kernel, RenderTable, Rule};
use crate::scene::{Scene, file};
use anyhow::bail;
use clap::ValueEnum as _;
use law::{Estimated, Method, Reading};
use std::path::Path;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "radius",
    question: "Which radius rule, kernel, first radius and α give the least error, and is it what theory predicts?",
    prediction: "Over n passes of pppm the variance falls as Γ(1+α)/(n²(2−α)) (Γ(n+2)/Γ(n+α) − 1/Γ(α)) and the bias as the mean r², \
                 so α = 2/3 is best in the long run, but the first radius decides at a fixed budget. A fourth-order kernel has a \
                 bias ~ r⁴. By the original's geometric rule the error rises again; as it was coded, the picture dims.",
    method: "The point below a lamp over a plane, where the law of the photons is known; independent replicates at every point of the \
             sweep; closed forms for finite n (Knaus and Zwicker 2011), not their limits; slopes by least squares over independent levels.",
    columns: &[
        "rule",
        "kernel",
        "alpha",
        "r1",
        "passes",
        "variance",
        "bias",
        "mse",
        "r2",
        "by",
        "replicates",
        "variance_error",
        "bias_error",
        "predicted_variance",
        "predicted_bias",
        "predicted_mse",
        "predicted_r2",
        "residual",
        "residual_error",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [2.5, 79.0, 630.0],
    plan,
    execute,
    conclude: conclusion::conclude,
};

/// A lamp of intensity π at height 1 over a plane of reflectance ½, seen straight below, where its radiance is ½.
const SCENE: &str = include_str!("photons/nadir.toml");
const TRUTH: f64 = 0.5;

const FIRST: f64 = 0.3;
/// Photons of a pass: ten within the first radius.
const PHOTONS: u64 = 500;
const LEVELS: [u64; 6] = [2, 8, 32, 128, 512, 2048];
/// Passes at which the error of the geometric rule falls, is least, and rises.
const GEOMETRIC_LEVELS: [u64; 4] = [4, 16, 40, 64];
const ALPHAS: [f64; 5] = [0.5, 2.0 / 3.0, 0.7, 0.75, 1.0];
/// The budget of the search for the best first radius and α.
const BUDGET: u64 = 64;
const FIRST_RADII: [f64; 5] = [0.1, 0.2, 0.4, 0.6, 0.9];
/// Passes of the runs that trace every photon.
const RENDERED: u64 = 12;

fn sweep(
    rules: &[&str],
    kernels: &[&str],
    alphas: &[f64],
    firsts: &[f64],
    passes: &[u64],
) -> Vec<Run> {
    grid([
        ("rule", values(rules.iter().copied())),
        ("kernel", values(kernels.iter().copied())),
        ("alpha", values(alphas.iter().copied())),
        ("r1", values(firsts.iter().copied())),
        ("passes", values(passes.iter().copied())),
        ("by", values(["law"])),
    ])
}

fn plan(_: Effort) -> Vec<Run> {
    let mut runs = sweep(&["pppm", "sppm"], &["disc"], &ALPHAS, &[FIRST], &LEVELS);
    let shaped = ["epanechnikov", "fourth-order"];
    runs.extend(sweep(
        &["pppm"],
        &shaped,
        &[2.0 / 3.0, 0.8],
        &[FIRST],
        &LEVELS,
    ));
    let geometric = ["geometric", "geometric-as-coded"];
    runs.extend(sweep(
        &geometric,
        &["disc"],
        &[1.0],
        &[FIRST],
        &GEOMETRIC_LEVELS,
    ));
    // The order of each kernel's bias.
    let all = ["disc", "epanechnikov", "fourth-order"];
    runs.extend(sweep(
        &["constant"],
        &all,
        &[1.0],
        &[0.4, 0.5, 0.6, 0.7, 0.85, 1.0],
        &[64],
    ));
    let best = ["disc", "fourth-order"];
    runs.extend(sweep(&["pppm"], &best, &ALPHAS, &FIRST_RADII, &[BUDGET]));
    for (rule, kernel) in [
        ("pppm", "disc"),
        ("pppm", "epanechnikov"),
        ("constant", "fourth-order"),
        ("geometric-as-coded", "disc"),
        ("sppm", "disc"),
    ] {
        let mut rendered = sweep(&[rule], &[kernel], &[2.0 / 3.0], &[0.6], &[RENDERED]);
        rendered[0].parameters[5].1 = "render".into();
        runs.append(&mut rendered);
    }
    runs
}

fn rule(name: &str) -> Option<Rule> {
    match name {
        "pppm" => Some(Rule::Global),
        "sppm" => Some(Rule::Local),
        name => Rule::from_str(name, false).ok(),
    }
}

fn method(run: &Run) -> anyhow::Result<Method> {
    let (Some(rule), Ok(kernel)) = (
        rule(&run.text("rule")),
        Kernel::from_str(&run.text("kernel"), false),
    ) else {
        bail!("no rule or kernel of that name: {}", run.name());
    };
    Ok(Method {
        rule,
        kernel,
        alpha: run.number("alpha"),
        first: run.number("r1"),
        passes: run.integer("passes") as u64,
        photons: PHOTONS,
    })
}

/// The estimate of a render of one pixel.
fn render(method: &Method, scene: &Scene, seed: u64, work: &mut Work) -> anyhow::Result<Estimated> {
    let settings = Settings::resolve(&RenderTable {
        integrator: Some(Integrator::Sppm),
        rule: Some(method.rule),
        kernel: Some(method.kernel),
        alpha: Some(method.alpha),
        photons: Some(method.photons),
        passes: Some(method.passes),
        radius: Some(method.first),
        seed: Some(seed),
        ..RenderTable::default()
    });
    let mut mapper = PhotonMapper::new(scene, &settings)?;
    let mut film = Film::new(scene.film);
    let mut given_radii = Reading::default();
    let mut last_square = f64::NAN;
    let n = method.passes as f64;
    for pass in 0..method.passes {
        *work += mapper.pass(pass, &mut film, &mut Phases::default());
        last_square = mapper.radii_squared()[0];
        let one = law::pass(method.kernel, last_square, method.photons as f64);
        given_radii.mean += one.mean / n;
        given_radii.variance += one.variance / (n * n);
    }
    Ok(Estimated {
        value: film.mean().x / TRUTH,
        given_radii,
        last_square,
    })
}

/// Replicates of a run: fewer where each takes many passes or traces its photons.
fn replicates(run: &Run, effort: Effort) -> u64 {
    match (run.text("by").as_str(), run.integer("passes")) {
        ("render", _) => effort.of([24, 2000, 16_000]),
        (_, passes) if passes < 512 => effort.of([400, 20_000, 160_000]),
        _ => effort.of([200, 8000, 64_000]),
    }
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let method = method(run)?;
    let rendered = run.text("by") == "render";
    let scene = file::parse(SCENE, "nadir", Path::new(""), &[])?;
    let count = replicates(run, effort);
    let mut work = Work::default();
    let mut estimates = Vec::with_capacity(count as usize);
    for replicate in 0..count {
        estimates.push(if rendered {
            render(&method, &scene, mix(&[seed, replicate]), &mut work)?
        } else {
            let mut stream = Stream::new(seed, Purpose::Experiment, replicate);
            method.estimate(&mut stream)
        });
    }
    Ok(Outcome::of_row(row(run, &method, &estimates), work))
}

fn row(run: &Run, method: &Method, estimates: &[Estimated]) -> Vec<Value> {
    let of = |value: fn(&Estimated) -> f64| Moments::of(estimates.iter().map(value));
    let value = of(|one| one.value);
    let mse = of(|one| (one.value - 1.0) * (one.value - 1.0)).mean();
    let predicted = match method.rule {
        // In the mean over the radii that there were.
        Rule::Local => Reading {
            mean: of(|one| one.given_radii.mean).mean(),
            variance: of(|one| one.given_radii.variance).mean(),
        },
        _ => method.predicted(),
    };
    let residual = Moments::of(estimates.iter().map(|one| match method.rule {
        Rule::Local => one.value - one.given_radii.mean,
        _ => one.value - predicted.mean,
    }));
    let predicted_bias = predicted.mean - 1.0;
    let n = estimates.len() as f64;
    let mean = value.mean();
    let fourth = estimates.iter().map(|one| {
        let square = (one.value - mean) * (one.value - mean);
        square * square
    });
    let variance = value.variance();
    let spread = fourth.sum::<f64>() / n - variance * variance;
    let mut row: Vec<Value> = run.parameters[..5]
        .iter()
        .map(|(_, value)| value.clone())
        .collect();
    row.extend(values([
        variance,
        value.mean() - 1.0,
        mse,
        of(|one| one.last_square).mean(),
    ]));
    row.push(run.text("by").into());
    row.push(estimates.len().into());
    row.extend(values([
        (spread / n).sqrt(),
        value.standard_error(),
        predicted.variance,
        predicted_bias,
        predicted.variance + predicted_bias * predicted_bias,
        method.predicted_last_square(),
        residual.mean(),
        residual.standard_error(),
    ]));
    row
}
