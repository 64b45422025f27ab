//! How does the error of progressive photon mapping fall where irradiance is not smooth?
//!
//! A step, a kink, an edge of a surface: near a line irradiance goes like x₊^s. What a disc of radius r reads there is wrong by r^s times
//! a function of x/r, so the squared error at points, averaged over them, goes like r^(2s+1). With r² ~ n^(α−1) it falls slower than the
//! variance, n^(−α), unless α ≤ (2s+1)/(2s+3): less than the 2/3 of smooth light. A pixel's *mean* is wrong by much less,
//! as the error before and behind an edge cancels; at a corner, where nothing is before the edge, it does not.
//!
//! The disc reads photons drawn from their exact law, with the program's own schedule of radii; the squared bias is the mean product of
//! the errors of two independent estimates, so noise does not add to it. Beside it stands the quadrature of the same (`regularity/edge.rs`). Nothing
//! is rendered: no scene has x₊^½.

mod conclusion;
mod edge;

use crate::lab::experiment::{Effort, Experiment, Outcome, Run, Timing, Value, values};
use crate::numeric::rng::{Purpose, Stream};
use crate::numeric::statistics::Moments;
use crate::numeric::work::Work;
use edge::{Edge, Errors, Receivers, Setting};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "regularity",
    question: "How does the error of progressive photon mapping fall where irradiance is not smooth?",
    prediction: "At points near E = x₊^s the mean squared bias goes as r^(2s+1), and α* = (2s+1)/(2s+3) is best in the long run: 1/3 \
                 at a step and a corner, 1/2, 3/5 at a kink. At s = 3/2, where the law meets that of smooth light, a logarithm remains. \
                 Pixel means cross over to r³ (aligned) and r⁴ (slanted) at a step, r⁴ at a kink and r² at a corner where r falls below \
                 the pixel.",
    method: "Discs over photons drawn from their exact law near a straight edge; pairs of independent estimates; quadrature beside them. \
             The static form is textbook density estimation; the progressive one has no published source that we know.",
    columns: &[
        "receivers",
        "edge",
        "width",
        "alpha",
        "r1",
        "passes",
        "s",
        "replicates",
        "bias2",
        "bias2_error",
        "predicted_bias2",
        "variance",
        "variance_error",
        "predicted_variance",
        "mse",
        "predicted_mse",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [3.0, 69.0, 550.0],
    plan,
    execute,
    conclude: conclusion::conclude,
};

/// Tangent of the angle of slanted pixels.
const SLANT: f64 = 0.5;
const WIDTHS: [f64; 2] = [0.1, 0.2];
/// Radii of single passes at points.
const RADII: [f64; 6] = [0.4, 0.2, 0.1, 0.05, 0.025, 0.0125];
/// Radii of single passes over pixels, in units of their width.
const SHARES: [f64; 7] = [2.0, 1.0, 0.5, 0.25, 0.125, 0.0625, 0.031_25];
/// Shares below this are left to the quadrature: the bias is far below the noise.
const LEAST_SHARE: f64 = 0.1;
const ALPHAS: [f64; 6] = [0.2, 1.0 / 3.0, 0.5, 0.6, 2.0 / 3.0, 0.75];
const FIRST_RADII: [f64; 2] = [0.1, 0.3];
const PASSES: [u64; 2] = [64, 256];
/// Passes between which the quadrature takes slopes in the long run.
const LONG_RUN: [u64; 2] = [1 << 12, 1 << 16];
const LONG_RUN_FIRST: f64 = 0.2;

/// Names of edges, with s where light is seen from both sides.
const EDGES: [(&str, Edge); 5] = [
    ("step", Edge::Power(0.0)),
    ("root", Edge::Power(0.5)),
    ("kink", Edge::Power(1.0)),
    ("three halves", Edge::Power(1.5)),
    ("corner", Edge::Corner),
];

/// (2s+1)/(2s+3).
fn best_alpha(s: f64) -> f64 {
    (2.0 * s + 1.0) / (2.0 * s + 3.0)
}

fn run(receivers: &str, edge: &str, width: f64, alpha: f64, first: f64, passes: u64) -> Run {
    Run::new([
        ("receivers", receivers.into()),
        ("edge", edge.into()),
        ("width", width.into()),
        ("alpha", alpha.into()),
        ("r1", first.into()),
        ("passes", passes.into()),
    ])
}

fn plan(_: Effort) -> Vec<Run> {
    let mut runs = Vec::new();
    for (name, edge) in EDGES {
        for radius in RADII {
            runs.push(run("points", name, 0.0, 1.0, radius, 1));
        }
        // Of the others, bias at a pixel far from the edge is too small to see.
        for (receivers, width) in [
            ("aligned", 0),
            ("aligned", 1),
            ("slanted", 0),
            ("slanted", 1),
        ] {
            for share in SHARES.iter().filter(|_| edge.is_local()) {
                let width = WIDTHS[width];
                runs.push(run(receivers, name, width, 1.0, share * width, 1));
            }
        }
        for alpha in ALPHAS.iter().filter(|_| edge != Edge::Power(1.5)) {
            for first in FIRST_RADII {
                for passes in PASSES {
                    runs.push(run("points", name, 0.0, *alpha, first, passes));
                }
            }
        }
        let best = best_alpha(edge.exponent());
        for alpha in [best - 0.1, best, best + 0.1] {
            for passes in LONG_RUN {
                runs.push(run("points", name, 0.0, alpha, LONG_RUN_FIRST, passes));
            }
        }
    }
    runs
}

fn setting(run: &Run) -> Setting {
    let name = run.text("edge");
    let edge = EDGES
        .iter()
        .find(|(known, _)| *known == name)
        .map_or(Edge::Corner, |edge| edge.1);
    let width = run.number("width");
    let receivers = match run.text("receivers").as_str() {
        "points" => Receivers::Points,
        "aligned" => Receivers::Pixels { width, slant: 0.0 },
        _ => Receivers::Pixels {
            width,
            slant: SLANT,
        },
    };
    let passes = run.integer("passes") as u64;
    let found = match (receivers, passes) {
        (Receivers::Points, 1) => 60.0,
        (Receivers::Points, _) => 10.0,
        // A pixel's bias is small, and noise enters its square with the square of 1/photons.
        _ => 400.0,
    };
    Setting {
        edge,
        receivers,
        alpha: run.number("alpha"),
        first: run.number("r1"),
        passes,
        found,
    }
}

/// None where the quadrature stands alone.
fn replicates(setting: &Setting, effort: Effort) -> u64 {
    match setting.receivers {
        Receivers::Pixels { width, .. } if setting.first < LEAST_SHARE * width => 0,
        Receivers::Pixels { .. } => effort.of([32, 2400, 20_000]),
        Receivers::Points if setting.passes >= LONG_RUN[0] => 0,
        Receivers::Points if setting.passes == 1 => effort.of([250, 12_000, 100_000]),
        Receivers::Points => effort.of([50, 1600, 12_000]),
    }
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let setting = setting(run);
    let count = replicates(&setting, effort);
    let (mut bias2, mut variance, mut mse) =
        (Moments::default(), Moments::default(), Moments::default());
    for replicate in 0..count {
        let mut stream = Stream::new(seed, Purpose::Experiment, replicate);
        let Errors {
            bias2: b,
            variance: v,
        } = setting.replicate(&mut stream);
        bias2.add(b);
        variance.add(v);
        mse.add(b / span(&setting) + v);
    }
    let of = |moments: &Moments| if count == 0 { f64::NAN } else { moments.mean() };
    let predicted = setting.predicted();
    let row = run.row(
        [Value::from(setting.edge.exponent()), count.into()]
            .into_iter()
            .chain(values([
                of(&bias2),
                bias2.standard_error(),
                predicted.bias2,
                of(&variance),
                variance.standard_error(),
                predicted.variance,
                of(&mse),
                predicted.bias2 / span(&setting) + predicted.variance,
            ])),
    );
    Ok(Outcome::of_row(row, Work::default()))
}

/// Length of the window over which the squared bias is an integral and the variance a mean.
fn span(setting: &Setting) -> f64 {
    let (start, end) = setting.window();
    end - start
}
