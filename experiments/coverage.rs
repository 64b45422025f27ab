//! Can the error that is shown while rendering be believed?
//!
//! The photon mapper estimates bias and noise of every pixel from its own photons ([`error`](crate::render::photon::error)). Here the
//! truth is known, so it can be counted how often it lies inside the claimed bounds.

use super::agreement::block_means;
use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{
    Conclusion, Effort, Experiment, Outcome, Run, Table, Timing, Value, grid, values,
};
use crate::lab::plot::{Axis, Plot, Series};
use crate::lab::rendering::{on_one_thread, scene};
use crate::numeric::statistics::Moments;
use crate::numeric::work::Work;
use crate::render::film::Film;
use crate::render::photon::error::{Errors, Tally};
use crate::render::photon::{Phases, PhotonMapper};
use crate::render::settings::Settings;
use crate::scene::options::{Integrator, RenderTable};
use serde::Deserialize;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "coverage",
    question: "How often does the truth lie inside the error bounds that are shown while rendering?",
    prediction: "As often as claimed, 50 % and 90 %, wherever the irradiance is smooth over the disc: on the wall of the integrating sphere, where \
                 there is no bias, and below a point light, where there is. Less often within a radius of an edge, and there bounds by \
                 noise alone are worth little.",
    method: "Scenes with a closed form, and the box by its independent reference; the share of pixels whose true radiance lies inside \
             the interval (Hachisuka, Jarosz and Jensen 2010 count the same); Student's interval over replicates, as pixels share photons. \
             The error of the whole picture, estimated over true, comes from the same runs.",
    columns: &[
        "scene",
        "integrator",
        "replicate",
        "region",
        "passes",
        "pixels",
        "inside_50",
        "inside_90",
        "by_noise_50",
        "by_noise_90",
        "estimated_square",
        "true_square",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [3.0, 37.0, 300.0],
    plan,
    execute,
    conclude,
};

/// A scene with known truth.
struct Subjected {
    name: &'static str,
    side: u32,
    radius: f64,
    photons: u64,
    /// The true radiance of every pixel, mean of the channels.
    truth: fn() -> anyhow::Result<Vec<f64>>,
}

const SCENES: [Subjected; 4] = [
    Subjected {
        name: "integrating_sphere",
        side: 12,
        radius: 0.25,
        photons: 800,
        truth: || Ok(vec![1.0; 144]),
    },
    Subjected {
        name: "point_over_plane",
        side: 12,
        radius: 0.35,
        photons: 1500,
        truth: || Ok(below_a_point_light(12)),
    },
    Subjected {
        name: "half_plane",
        side: 12,
        radius: 0.25,
        photons: 1500,
        truth: || Ok(edge(12)),
    },
    Subjected {
        name: "box",
        side: 16,
        radius: 0.12,
        photons: 1500,
        truth: || block_means("a"),
    },
];
const INTEGRATORS: [&str; 2] = ["pppm", "sppm"];

/// Passes after which the bounds are looked at.
const CHECKS: [u64; 3] = [4, 16, 64];

fn plan(effort: Effort) -> Vec<Run> {
    let replicates: i64 = effort.of([8, 100, 800]);
    grid([
        ("scene", values(SCENES.map(|scene| scene.name))),
        ("integrator", values(INTEGRATORS)),
        ("replicate", values(0..replicates)),
    ])
}

/// Of each pixel of a film over −1 … 1 below a light at height 1: the mean of ½ (1 + ρ²)^(−3/2).
fn below_a_point_light(side: u32) -> Vec<f64> {
    let cells = 8 * side;
    let at = |cell: u32| 2.0 * (f64::from(cell) + 0.5) / f64::from(cells) - 1.0;
    let radiance = |x: f64, z: f64| 0.5 * libm::pow(1.0 + x * x + z * z, -1.5);
    let pixel = |pixel: u32| {
        let (row, column) = (pixel / side, pixel % side);
        let cells = (0..64).map(|cell| radiance(at(8 * column + cell % 8), at(8 * row + cell / 8)));
        cells.sum::<f64>() / 64.0
    };
    (0..side * side).map(pixel).collect()
}

/// The half plane is the left half of the film.
fn edge(side: u32) -> Vec<f64> {
    let lit = |pixel: u32| if pixel % side < side / 2 { 0.5 } else { 0.0 };
    (0..side * side).map(lit).collect()
}

/// Where a pixel lies: within a radius of the edge of the half plane, or beyond. Pixels that see nothing are nowhere: their bounds are 0 and
/// right.
fn region(subject: &Subjected, pixel: usize, truth: f64) -> &'static str {
    if truth == 0.0 {
        return "nowhere";
    }
    let column = (pixel % subject.side as usize) as f64 + 0.5;
    let from_edge = (2.0 * column / f64::from(subject.side) - 1.0).abs();
    let half_pixel = 1.0 / f64::from(subject.side);
    if subject.name == "half_plane" && from_edge < subject.radius + half_pixel {
        "edge"
    } else {
        "smooth"
    }
}

/// Counts over the pixels of a region.
#[derive(Default)]
struct Count {
    pixels: u64,
    /// Truth inside the interval at 50 % and 90 %, and inside that by noise alone.
    inside: [u64; 2],
    by_noise: [u64; 2],
    estimated_square: f64,
    true_square: f64,
}

const CONFIDENCES: [f64; 2] = [0.5, 0.9];

impl Count {
    fn add(&mut self, tally: &Tally, truth: f64) {
        self.pixels += 1;
        let holds = |(low, high): (f64, f64)| u64::from(low <= truth && truth <= high);
        for (level, confidence) in CONFIDENCES.into_iter().enumerate() {
            self.inside[level] += holds(tally.interval(confidence));
            self.by_noise[level] += holds(tally.interval_by_noise(confidence));
        }
        self.estimated_square += tally.noise_squared() + tally.bias_squared();
        self.true_square += (tally.reading() - truth) * (tally.reading() - truth);
    }

    fn values(&self) -> Vec<Value> {
        let share = |count: u64| count as f64 / self.pixels as f64;
        let [inside_50, inside_90] = self.inside.map(share);
        let [by_noise_50, by_noise_90] = self.by_noise.map(share);
        let shares = [inside_50, inside_90, by_noise_50, by_noise_90];
        let squares = [self.estimated_square, self.true_square].map(|sum| sum / self.pixels as f64);
        [values([self.pixels]), values(shares), values(squares)].concat()
    }
}

fn execute(run: &Run, _: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let name = run.text("scene");
    let subject = SCENES.iter().find(|scene| scene.name == name);
    let subject = subject.ok_or_else(|| anyhow::anyhow!("no scene {name}"))?;
    let sets = [
        ("film.width", subject.side.into()),
        ("film.height", subject.side.into()),
    ];
    let (scene, truth) = (scene(&name, &sets)?, (subject.truth)()?);
    let integrator = match run.text("integrator").as_str() {
        "pppm" => Integrator::Pppm,
        _ => Integrator::Sppm,
    };
    let table = RenderTable {
        integrator: Some(integrator),
        photons: Some(subject.photons),
        radius: Some(subject.radius),
        // The reference's limit.
        max_depth: Some(15),
        seed: Some(seed),
        ..RenderTable::default()
    };
    let settings = Settings {
        estimate_errors: true,
        ..Settings::resolve(&table)
    };
    let mut outcome = Outcome::default();
    let rows = &mut outcome.rows;
    let (work, _) = on_one_thread(|| {
        let mut mapper = PhotonMapper::new(&scene, &settings)?;
        let (mut film, mut work) = (Film::new(scene.film), Work::default());
        for pass in 0..CHECKS[2] {
            work += mapper.pass(pass, &mut film, &mut Phases::default());
            if !CHECKS.contains(&(pass + 1)) {
                continue;
            }
            for place in ["smooth", "edge"] {
                let mut count = Count::default();
                let tallies = mapper.errors().map_or(&[][..], Errors::tallies);
                let tallies = tallies.iter().zip(&truth);
                for (pixel, (tally, &truth)) in tallies.enumerate() {
                    if region(subject, pixel, truth) == place {
                        count.add(tally, truth);
                    }
                }
                if count.pixels > 0 {
                    let key = [values([place]), values([pass + 1])].concat();
                    rows.push(run.row([key, count.values()].concat()));
                }
            }
        }
        Ok(work)
    })?;
    outcome.work = work;
    Ok(outcome)
}

/// A row of the table.
#[derive(Deserialize)]
struct Row {
    scene: String,
    integrator: String,
    region: String,
    passes: u64,
    inside_50: f64,
    inside_90: f64,
    by_noise_90: f64,
    estimated_square: f64,
    true_square: f64,
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let rows: Vec<Row> = table.read();
    let of = |scene: &str, integrator: &str, region: &str, passes: u64| -> Vec<&Row> {
        let same = |row: &&Row| {
            row.scene == scene
                && row.integrator == integrator
                && row.region == region
                && row.passes == passes
        };
        rows.iter().filter(same).collect()
    };
    let last = CHECKS[2];
    let mut claims = Vec::new();
    for scene in ["integrating_sphere", "point_over_plane", "box"] {
        let part = of(scene, "pppm", "smooth", last);
        claims.push(coverage_claim(scene, "pppm", 0.5, &part, effort));
        claims.push(coverage_claim(scene, "pppm", 0.9, &part, effort));
        let part = of(scene, "sppm", "smooth", last);
        claims.push(coverage_claim(scene, "sppm", 0.9, &part, effort));
    }
    for scene in ["integrating_sphere", "point_over_plane"] {
        claims.push(error_claim(
            scene,
            &of(scene, "pppm", "smooth", last),
            effort,
        ));
    }
    let edge = of("half_plane", "pppm", "edge", last);
    claims.push(noise_alone_claim(&edge, effort));
    Conclusion {
        claims,
        plots: plots(&of),
        ..Conclusion::default()
    }
}

/// How far a share may be from the claimed one: what the replicates of an effort can prove.
fn margin(effort: Effort) -> f64 {
    effort.of([0.12, 0.03, 0.03])
}

fn coverage_claim(
    scene: &str,
    integrator: &str,
    confidence: f64,
    part: &[&Row],
    effort: Effort,
) -> Claim {
    let shares = part.iter().map(|row| {
        if confidence == 0.5 {
            row.inside_50
        } else {
            row.inside_90
        }
    });
    let moments = Moments::of(shares);
    let percent = 100.0 * confidence;
    let name = format!("{scene}_{integrator}_{percent:.0}");
    let statement = format!(
        "The claimed {percent:.0} % bound of {integrator} holds for that share of the pixels of {scene}, within {:.0} %",
        100.0 * margin(effort)
    );
    let subject = EXPERIMENT.subject(&name, &statement, Effort::Smoke, effort);
    Claim::equivalent(subject, Estimate::of(&moments), confidence, margin(effort))
}

/// Root of the estimated over the true mean square error.
fn error_claim(scene: &str, part: &[&Row], effort: Effort) -> Claim {
    let truth = Moments::of(part.iter().map(|row| row.true_square)).mean();
    let excess = |row: &&Row| 0.5 * (row.estimated_square - row.true_square) / truth;
    let ratios = Moments::of(part.iter().map(|row| 1.0 + excess(row)));
    let name = format!("{scene}_pppm_error");
    let statement = format!(
        "The estimated error of pppm over the true one is 1 on {scene} (root mean squares over pixels and replicates, to first order)"
    );
    let subject = EXPERIMENT.subject(&name, &statement, Effort::Standard, effort);
    Claim::equivalent(subject, Estimate::of(&ratios), 1.0, 0.1)
}

/// The control: what bounds are worth that know nothing of the bias.
fn noise_alone_claim(part: &[&Row], effort: Effort) -> Claim {
    let moments = Moments::of(part.iter().map(|row| row.by_noise_90));
    let reach = 2.0 * moments.standard_error();
    let subject = EXPERIMENT.subject(
        "noise_alone",
        "Within a radius of an edge, 90 % bounds by noise alone hold for less than 75 % of the pixels",
        Effort::Smoke,
        effort,
    );
    let interval = (moments.mean() - reach, moments.mean() + reach);
    Claim::in_range(
        subject,
        moments.mean(),
        interval,
        moments.count(),
        (0.0, 0.75),
    )
}

fn plots<'a>(of: &dyn Fn(&str, &str, &str, u64) -> Vec<&'a Row>) -> Vec<Plot> {
    let places = [
        ("integrating_sphere", "smooth", "integrating sphere"),
        ("point_over_plane", "smooth", "below a point light"),
        ("half_plane", "smooth", "half plane, away from the edge"),
        (
            "half_plane",
            "edge",
            "half plane, within a radius of its edge",
        ),
        ("box", "smooth", "box, with its edges and corners"),
    ];
    let over_passes = |share: fn(&Row) -> f64, places: &[(&str, &str, &str)]| -> Vec<Series> {
        let series = |&(scene, region, name): &(&str, &str, &str)| {
            let at = CHECKS.map(|passes| {
                Moments::of(
                    of(scene, "pppm", region, passes)
                        .iter()
                        .map(|row| share(row)),
                )
            });
            let reach = |moments: &Moments| 2.0 * moments.standard_error();
            let intervals = at
                .iter()
                .map(|m| (m.mean() - reach(m), m.mean() + reach(m)));
            let points = CHECKS
                .iter()
                .zip(&at)
                .map(|(&passes, m)| (passes as f64, m.mean()));
            Series::measured(name, points).with_intervals(intervals)
        };
        places.iter().map(series).collect()
    };
    let level = |confidence: f64| {
        let name = format!("claimed {:.0} %", 100.0 * confidence);
        Series::predicted(name, CHECKS.map(|passes| (passes as f64, confidence)))
    };
    let plot = |title: &str, confidence: f64, series: Vec<Series>| {
        Plot::new(
            title,
            Axis::log("passes"),
            Axis::linear("share of pixels inside the bounds"),
            std::iter::once(level(confidence)).chain(series),
        )
    };
    let mut noise_alone = over_passes(|row| row.inside_90, &[places[1], places[3]]);
    noise_alone.extend(over_passes(
        |row| row.by_noise_90,
        &[
            ("point_over_plane", "smooth", "the same, by noise alone"),
            ("half_plane", "edge", "edge, by noise alone"),
        ],
    ));
    vec![
        plot(
            "Pixels inside the 90 % bounds (pppm)",
            0.9,
            over_passes(|row| row.inside_90, &places),
        ),
        plot(
            "Pixels inside the 50 % bounds (pppm)",
            0.5,
            over_passes(|row| row.inside_50, &places),
        ),
        plot(
            "Without the bias, 90 % bounds fail at an edge and below a point light (pppm)",
            0.9,
            noise_alone,
        ),
    ]
}
