//! How soon is a picture right: where light must be found from the lamp, and where it must be found from the camera?

use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{
    Conclusion, Effort, Experiment, Outcome, Run, Table, Timing, Value, grid, values,
};
use crate::lab::plot::{Axis, Plot, Series};
use crate::lab::rendering::{on_one_thread, scene};
use crate::numeric::clock::ThreadClock;
use crate::numeric::statistics::Moments;
use crate::numeric::work::Work;
use crate::render::film::Film;
use crate::render::path::PathTracer;
use crate::render::photon::{Phases, PhotonMapper};
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::aim::Aim;
use crate::scene::options::{Integrator, RenderTable};
use serde::Deserialize;
use std::f64::consts::LN_10;
use std::ops::Range;

/// Pixels of the hourglass' caustic by an independent renderer; see golden/reference/README.md.
const REFERENCE: &str = include_str!("../golden/reference/caustic.json");

/// Where the glass ball focuses light on the floor: blocks 11 and 12 of row 14.
const CAUSTIC: [Range<usize>; 2] = [11 * 16..13 * 16, 14 * 16..15 * 16];

const HOURGLASS: &str = "hourglass";
const NEXT_DOOR: &str = "next_door";
const UNAIMED: &str = "sppm without aim";
const PATH: &str = "path";

/// CPU seconds at which errors are compared.
const BUDGET: f64 = 10.0;
/// Relative error of the caustic by then.
const CAUSTIC_ERROR: f64 = 0.06;
const CAUSTIC_CLAIM: &str = "sppm draws the caustic of the hourglass scene to a relative RMSE of 6 % in 10 CPU seconds, with every setting at its default.";

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "time_to_error",
    question: "How long does a caustic take until its error is small, and where does path tracing win?",
    prediction: "Photon maps with their default radius draw the caustic of the hourglass scene many times sooner than path tracing, which \
                 finds it by chance alone; where the lamp is next door and little is seen, path tracing wins.",
    method: "The error is the root mean square over pixels and channels of the difference from the truth, over the mean there, bias \
             included; the truth's own variance is taken off its square. Hourglass: the two blocks of the glass ball's caustic against \
             Mitsuba 3.9.1 (golden/reference). Lamp next door: the whole picture against path tracing of four times the samples. \
             `sppm without aim` sends all photons by the lamp's own law. Defaults throughout (first radius, α, photons a pass); at most 15 scattering events, as in the reference. CPU seconds of one thread.",
    columns: &[
        "scene",
        "integrator",
        "replicate",
        "passes",
        "relative_rmse",
        "relative_bias",
        "render_s",
    ],
    timing: Timing::OwnThread,
    cpu_seconds: [3.0, 240.0, 2000.0],
    plan,
    execute,
    conclude,
};

fn plan(effort: Effort) -> Vec<Run> {
    let runs = |scene: &'static str| {
        grid([
            ("scene", values([scene])),
            ("integrator", values(methods(scene).iter().copied())),
            ("replicate", values(0..effort.of([1, 3, 3]))),
        ])
    };
    [HOURGLASS, NEXT_DOOR].into_iter().flat_map(runs).collect()
}

/// Next door there is nothing to aim at.
fn methods(scene: &str) -> &'static [&'static str] {
    match scene {
        HOURGLASS => &["pppm", "sppm", UNAIMED, PATH],
        _ => &["pppm", "sppm", PATH],
    }
}

/// Passes of the longest render: about ten seconds of the hourglass at standard effort.
fn most_passes(scene: &str, integrator: &str, effort: Effort) -> u64 {
    match (scene, integrator) {
        (HOURGLASS, _) => effort.of([1, 96, 768]),
        (_, PATH) => effort.of([16, 512, 4096]),
        (_, _) => effort.of([1, 24, 192]),
    }
}

/// Pixels whose values are known, with the variances of these values.
struct Truth {
    pixels: Vec<usize>,
    mean: Vec<[f64; 3]>,
    variance: Vec<[f64; 3]>,
}

#[derive(Deserialize)]
struct Caustic {
    mean: Vec<[f64; 3]>,
    se: Vec<[f64; 3]>,
}

impl Truth {
    fn of(name: &str, subject: &Scene, effort: Effort, seed: u64) -> anyhow::Result<Self> {
        if name == HOURGLASS {
            let Caustic { mean, se } = serde_json::from_str(REFERENCE)?;
            let [columns, rows] = CAUSTIC;
            let width = subject.film.width as usize;
            let pixels = rows.flat_map(|row| columns.clone().map(move |x| row * width + x));
            return Ok(Self {
                pixels: pixels.collect(),
                mean,
                variance: se.into_iter().map(|se| se.map(|s| s * s)).collect(),
            });
        }
        let settings = settings(subject, Integrator::Path, !seed);
        let passes = 4 * most_passes(name, PATH, effort);
        let tracer = PathTracer::new(subject, &settings);
        let mut film = Film::new(subject.film);
        for pass in 0..passes {
            tracer.pass(pass, &mut film);
        }
        let pixels = film.pixels();
        Ok(Self {
            pixels: (0..pixels.len()).collect(),
            mean: pixels.iter().map(|pixel| pixel.mean().to_array()).collect(),
            variance: (pixels.iter())
                .map(|pixel| pixel.variance_of_mean().to_array())
                .collect(),
        })
    }

    /// Root mean square error and bias of the mean, both over the mean.
    fn compare(&self, film: &Film) -> [f64; 2] {
        let (mut square, mut difference, mut sum) = (0.0, 0.0, 0.0);
        let known = self.pixels.iter().zip(&self.mean).zip(&self.variance);
        for ((&pixel, mean), variance) in known {
            let ours = film.pixels()[pixel].mean().to_array();
            for channel in 0..3 {
                let error = ours[channel] - mean[channel];
                square += error * error - variance[channel];
                difference += error;
                sum += mean[channel];
            }
        }
        let n = 3.0 * self.pixels.len() as f64;
        [(square / n).max(0.0).sqrt() / (sum / n), difference / sum]
    }
}

fn settings(subject: &Scene, integrator: Integrator, seed: u64) -> Settings {
    let table = RenderTable {
        integrator: Some(integrator),
        seed: Some(seed),
        max_depth: Some(15),
        ..subject.render.clone()
    };
    Settings::resolve(&table)
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let (name, method) = (run.text("scene"), run.text("integrator"));
    let mut subject = scene(&name, &[])?;
    if method == UNAIMED {
        subject.lights = subject.lights.aimed(Aim::default());
    }
    let (truth, _) = on_one_thread(|| Truth::of(&name, &subject, effort, seed))?;
    let integrator = match method.as_str() {
        "pppm" => Integrator::Pppm,
        "sppm" => Integrator::Sppm,
        PATH => Integrator::Path,
        _ => Integrator::Sppm,
    };
    let settings = settings(&subject, integrator, seed);
    let most = most_passes(&name, &method, effort);
    let ((rows, work), _) = on_one_thread(|| errors(&subject, &settings, &truth, most))?;
    Ok(Outcome {
        rows: rows.into_iter().map(|row| run.row(row)).collect(),
        work,
    })
}

/// The errors after 1, 2, 3, 4, 6, 8, 12, … passes, and every eight from 48 on, as the budget ends there.
fn errors(
    subject: &Scene,
    settings: &Settings,
    truth: &Truth,
    most: u64,
) -> anyhow::Result<(Vec<Vec<Value>>, Work)> {
    let tracer = PathTracer::new(subject, settings);
    let mut mapper = match settings.integrator {
        Integrator::Path => None,
        _ => Some(PhotonMapper::new(subject, settings)?),
    };
    let mut film = Film::new(subject.film);
    let (mut rows, mut work, mut seconds) = (Vec::new(), Work::default(), 0.0);
    for pass in 0..most {
        let clock = ThreadClock::start();
        work += match &mut mapper {
            Some(mapper) => mapper.pass(pass, &mut film, &mut Phases::default()),
            None => tracer.pass(pass, &mut film),
        };
        seconds += clock.seconds();
        let done = pass + 1;
        let power = 1_u64 << done.ilog2();
        let often = done > 48 && done % 8 == 0;
        if done == power || 2 * done == 3 * power || often || done == most {
            let [rmse, bias] = truth.compare(&film);
            rows.push([values([done as i64]), values([rmse, bias, seconds])].concat());
        }
    }
    Ok((rows, work))
}

/// Errors of a method on a scene over its replicates, by passes: mean CPU seconds, and the root mean squares.
fn course(table: &Table, scene: &str, integrator: &str) -> Vec<(f64, Moments)> {
    let part = table
        .filter("scene", &scene.into())
        .filter("integrator", &integrator.into());
    let at = |passes| {
        let part = part.filter("passes", &passes);
        let seconds = Moments::of(part.numbers("render_s")).mean();
        (seconds, Moments::of(part.numbers("relative_rmse")))
    };
    part.distinct("passes").into_iter().map(at).collect()
}

/// The errors of the longest renders within the budget; nothing if one pass is longer.
fn within_budget(course: &[(f64, Moments)]) -> Moments {
    let last = course.iter().rev().find(|(time, _)| *time <= BUDGET);
    last.map_or_else(Moments::default, |(_, errors)| *errors)
}

/// Estimate of the logarithm of an error over another.
fn log_ratio(a: &Moments, b: &Moments) -> Estimate {
    let relative = |m: &Moments| m.standard_error() / m.mean();
    Estimate {
        value: libm::log10(a.mean() / b.mean()),
        standard_error: libm::hypot(relative(a), relative(b)) / LN_10,
        freedom: a.count().min(b.count()) as f64 - 1.0,
        n: a.count() + b.count(),
    }
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let standard =
        |claim, statement| EXPERIMENT.subject(claim, statement, Effort::Standard, effort);
    let error = |scene: &str, integrator: &str| within_budget(&course(table, scene, integrator));
    let caustic = error(HOURGLASS, "sppm");
    let reach = 3.0 * caustic.standard_error();
    let by_path = log_ratio(&error(HOURGLASS, PATH), &caustic);
    let next_door = log_ratio(&error(NEXT_DOOR, "sppm"), &error(NEXT_DOOR, PATH));
    let far = |estimate: &Estimate| 3.0 * estimate.standard_error;
    let at_least = |subject, estimate: Estimate, least: f64| {
        let interval = (
            estimate.value - far(&estimate),
            estimate.value + far(&estimate),
        );
        Claim::in_range(
            subject,
            estimate.value,
            interval,
            estimate.n,
            (libm::log10(least), 4.0),
        )
    };
    let claims = vec![
        Claim::in_range(
            standard("caustic", CAUSTIC_CLAIM),
            caustic.mean(),
            (caustic.mean() - reach, caustic.mean() + reach),
            caustic.count(),
            (0.0, CAUSTIC_ERROR),
        ),
        at_least(
            standard(
                "path on the caustic",
                "In the same time the error of path tracing there is at least 5 times as large (log10).",
            ),
            by_path,
            5.0,
        ),
        at_least(
            standard(
                "lamp next door",
                "Where the lamp is next door and little is seen, the error of sppm is at least twice that of path tracing (log10).",
            ),
            next_door,
            2.0,
        ),
    ];
    Conclusion {
        claims,
        plots: plots(table),
        ..Conclusion::default()
    }
}

fn plots(table: &Table) -> Vec<Plot> {
    let titles = [
        (
            HOURGLASS,
            "Caustic of the hourglass scene: error against time",
        ),
        (NEXT_DOOR, "Lamp next door: error against time"),
    ];
    titles
        .map(|(scene, title)| {
            let series = methods(scene).iter().map(|&integrator| {
                let course = course(table, scene, integrator);
                let points = course
                    .iter()
                    .map(|(time, error)| (*time, 100.0 * error.mean()));
                Series::measured(integrator, points)
            });
            let [time, error] = ["CPU time (s)", "relative RMSE (%)"].map(Axis::log);
            Plot::new(title, time, error, series)
        })
        .into()
}
