//! Do the renderers agree with the scenes whose radiance is known in closed form?

use crate::lab::claim::{Claim, Estimate, Subject};
use crate::lab::experiment::{Conclusion, Effort, Experiment, Outcome, Run, Table, Value};
use crate::lab::page::number;
use crate::lab::plot::{Axis, Plot, Scale, Series};
use crate::numeric::statistics::Moments;
use crate::render::driver::render_unwatched;
use crate::render::settings::Settings;
use crate::scene::file::load;
use std::path::Path;
use std::time::Instant;

const NAME: &str = "analytic";
const SCENES: [&str; 2] = ["furnace", "integrating_sphere"];
const ALBEDOS: [f64; 2] = [0.5, 0.8];
const INTEGRATORS: [&str; 2] = ["path", "ppm"];

/// Pixels a side: every pixel has the same answer, so few do.
const SIDE: u32 = 8;
/// Replicates: 15 degrees of freedom for the standard error.
const REPLICATES: i64 = 16;
/// First gather radius in sphere radii: a quarter of the sphere. The kernel has no bias there at any radius.
const RADIUS: f64 = 1.0;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: NAME,
    question: "Do path tracing and photon mapping give the radiance of scenes with a closed form?",
    prediction: "In a closed sphere of emission L_e and albedo ρ (furnace) the radiance is L_e/(1 − ρ) everywhere. With a point light of intensity I \
                 at its centre instead (integrating sphere of radius R) it is ρ I/(π R² (1 − ρ)).",
    method: "Independent renders with seeds of their own; the mean over pixels and channels, with Student's interval over 16 renders, is \
             proved to lie within a margin of the prediction (two one-sided tests at .01): 1 % at smoke effort, .1 % above. \
             Photons within a chord r of a point of a sphere occupy exactly π r² of it, so the photon map has no kernel bias here.",
    columns: &[
        "scene",
        "albedo",
        "integrator",
        "replicate",
        "predicted",
        "mean",
        "relative_error",
        "render_s",
    ],
    timed: false,
    plan,
    execute,
    conclude,
};

fn plan(_: Effort) -> Vec<Run> {
    let mut runs = Vec::new();
    for scene in SCENES {
        for albedo in ALBEDOS {
            for integrator in INTEGRATORS {
                for replicate in 0..REPLICATES {
                    runs.push(Run::new([
                        ("scene", scene.into()),
                        ("albedo", albedo.into()),
                        ("integrator", integrator.into()),
                        ("replicate", replicate.into()),
                    ]));
                }
            }
        }
    }
    runs
}

/// L_e/(1 − ρ) with L_e = 1, and ρ I/(π R² (1 − ρ)) with I = π, R = 1.
fn predicted(scene: &str, albedo: f64) -> f64 {
    let numerator = if scene == "furnace" { 1.0 } else { albedo };
    numerator / (1.0 - albedo)
}

/// Camera samples a pixel of `path`, passes and photons a pass of `ppm`: standard errors of a tenth of the margin.
fn budget(effort: Effort) -> (u32, u64, u64) {
    match effort {
        Effort::Smoke => (1_024, 8, 16_000),
        Effort::Standard => (51_200, 80, 120_000),
        Effort::Full => (512_000, 800, 120_000),
    }
}

fn margin(effort: Effort) -> f64 {
    if effort == Effort::Smoke { 0.01 } else { 0.001 }
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let (name, albedo, integrator) = (
        run.text("scene"),
        run.number("albedo"),
        run.text("integrator"),
    );
    let (spp, passes, photons) = budget(effort);
    let overrides = [
        ("film.width", SIDE.to_string()),
        ("film.height", SIDE.to_string()),
        (
            "material.wall.diffuse.reflectance",
            format!("[{albedo}, {albedo}, {albedo}]"),
        ),
        ("render.integrator", format!("\"{integrator}\"")),
        (
            "render.spp",
            if integrator == "path" { spp } else { 1 }.to_string(),
        ),
        ("render.passes", passes.to_string()),
        ("render.photons", photons.to_string()),
        ("render.radius", format!("{RADIUS:?}")),
    ];
    let overrides = overrides.map(|(key, value)| (key.to_owned(), value));
    let scene = load(
        &Path::new("scenes").join(format!("{name}.toml")),
        &overrides,
    )?;
    let settings = Settings {
        seed,
        threads: Some(1),
        ..Settings::resolve(&scene.render)
    };
    let start = Instant::now();
    let outcome = render_unwatched(&scene, &settings)?;
    let mean = outcome.film.mean().element_sum() / 3.0;
    let truth = predicted(&name, albedo);
    let mut row: Vec<Value> = run
        .parameters
        .iter()
        .map(|(_, value)| value.clone())
        .collect();
    row.extend([
        truth.into(),
        mean.into(),
        (mean / truth - 1.0).into(),
        start.elapsed().as_secs_f64().into(),
    ]);
    Ok(Outcome {
        rows: vec![row],
        work: outcome.work,
    })
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let mut conclusion = Conclusion::default();
    let mut series = Vec::new();
    for scene in SCENES {
        for integrator in INTEGRATORS {
            let part = table
                .filter("scene", &scene.into())
                .filter("integrator", &integrator.into());
            let claims: Vec<Claim> = ALBEDOS
                .iter()
                .map(|&albedo| claim(&part, scene, integrator, albedo, effort))
                .collect();
            series.push(relative_errors(&claims, &format!("{scene}, {integrator}")));
            conclusion.claims.extend(claims);
        }
    }
    conclusion.plots.push(plot(series, margin(effort)));
    conclusion
}

fn claim(part: &Table, scene: &str, integrator: &str, albedo: f64, effort: Effort) -> Claim {
    let means = Moments::of(part.filter("albedo", &albedo.into()).numbers("mean"));
    let estimate = Estimate {
        value: means.mean(),
        standard_error: means.standard_error(),
        freedom: means.count() as f64 - 1.0,
        n: means.count(),
    };
    let truth = predicted(scene, albedo);
    let percent = 100.0 * margin(effort);
    let subject = Subject {
        experiment: NAME,
        claim: &format!("{scene}_{integrator}_{albedo}"),
        statement: &format!(
            "{integrator} gives the radiance {} of the {scene} with albedo {albedo} within {percent} %",
            number(truth)
        ),
        decided_at: Effort::Smoke,
        effort,
    };
    Claim::equivalent(subject, estimate, truth, margin(effort) * truth)
}

fn relative_errors(claims: &[Claim], name: &str) -> Series {
    let percent = |value: f64, claim: &Claim| 100.0 * (value / claim.predicted - 1.0);
    let at = |f: fn(&Claim) -> f64, claim: &Claim| percent(f(claim), claim);
    let points = ALBEDOS
        .iter()
        .zip(claims)
        .map(|(&albedo, claim)| (albedo, at(|c| c.measured, claim)));
    Series {
        name: name.to_owned(),
        points: points.collect(),
        intervals: claims
            .iter()
            .map(|claim| (at(|c| c.ci_low, claim), at(|c| c.ci_high, claim)))
            .collect(),
        predicted: false,
    }
}

fn plot(series: Vec<Series>, margin: f64) -> Plot {
    let bound = |sign: f64, name: &str| Series {
        name: name.to_owned(),
        points: ALBEDOS
            .map(|albedo| (albedo, sign * 100.0 * margin))
            .to_vec(),
        intervals: Vec::new(),
        predicted: true,
    };
    let bounds = [bound(1.0, "margin"), bound(-1.0, "− margin")];
    Plot {
        title: "Measured radiance stays within the margin of the closed form".to_owned(),
        x: Axis {
            label: "albedo".to_owned(),
            scale: Scale::Linear,
        },
        y: Axis {
            label: "relative error (%)".to_owned(),
            scale: Scale::Linear,
        },
        series: bounds.into_iter().chain(series).collect(),
    }
}
