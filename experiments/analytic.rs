//! Do the renderers agree with the scenes whose radiance is known in closed form?

use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{Conclusion, Effort, Experiment, Outcome, Run, Table, grid, values};
use crate::lab::page::number;
use crate::lab::plot::{Axis, Plot, Series};
use crate::lab::rendering::render;
use crate::numeric::statistics::Moments;

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
    name: "analytic",
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
    cpu_seconds: [21.5, 1400.0, 14000.0],
    plan,
    execute,
    conclude,
};

fn plan(_: Effort) -> Vec<Run> {
    grid([
        ("scene", values(SCENES)),
        ("albedo", values(ALBEDOS)),
        ("integrator", values(INTEGRATORS)),
        ("replicate", values(0..REPLICATES)),
    ])
}

/// L_e/(1 − ρ) with L_e = 1, and ρ I/(π R² (1 − ρ)) with I = π, R = 1.
fn predicted(scene: &str, albedo: f64) -> f64 {
    let numerator = if scene == "furnace" { 1.0 } else { albedo };
    numerator / (1.0 - albedo)
}

/// Camera samples a pixel of `path`, passes and photons a pass of `ppm`: standard errors of a tenth of the margin.
fn budget(effort: Effort) -> [u32; 3] {
    effort.of([
        [1_024, 8, 16_000],
        [51_200, 80, 120_000],
        [512_000, 800, 120_000],
    ])
}

fn margin(effort: Effort) -> f64 {
    if effort == Effort::Smoke { 0.01 } else { 0.001 }
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let (name, albedo) = (run.text("scene"), run.number("albedo"));
    let integrator = run.text("integrator");
    let [spp, passes, photons] = budget(effort);
    let spp = if integrator == "path" { spp } else { 1 };
    let sets = [
        ("film.width", SIDE.into()),
        ("film.height", SIDE.into()),
        ("material.wall.diffuse.reflectance", vec![albedo; 3].into()),
        ("render.integrator", integrator.into()),
        ("render.spp", spp.into()),
        ("render.passes", passes.into()),
        ("render.photons", photons.into()),
        ("render.radius", RADIUS.into()),
    ];
    let rendered = render(&name, &sets, seed)?;
    let (mean, truth) = (rendered.mean(), predicted(&name, albedo));
    let row = run.row(values([truth, mean, mean / truth - 1.0, rendered.seconds]));
    Ok(Outcome::of_row(row, rendered.work))
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
    let truth = predicted(scene, albedo);
    let percent = 100.0 * margin(effort);
    let name = format!("{scene}_{integrator}_{albedo}");
    let statement = format!(
        "{integrator} gives the radiance {} of the {scene} with albedo {albedo} within {percent} %",
        number(truth)
    );
    let subject = EXPERIMENT.subject(&name, &statement, Effort::Smoke, effort);
    Claim::equivalent(subject, Estimate::of(&means), truth, margin(effort) * truth)
}

fn relative_errors(claims: &[Claim], name: &str) -> Series {
    let percent = |value: f64, claim: &Claim| 100.0 * (value / claim.predicted - 1.0);
    let points = ALBEDOS.into_iter().zip(claims);
    let intervals = claims
        .iter()
        .map(|claim| (percent(claim.ci_low, claim), percent(claim.ci_high, claim)));
    Series::measured(
        name,
        points.map(|(albedo, claim)| (albedo, percent(claim.measured, claim))),
    )
    .with_intervals(intervals)
}

fn plot(series: Vec<Series>, margin: f64) -> Plot {
    let bounds = [("margin", margin), ("− margin", -margin)].map(|(name, bound)| {
        Series::predicted(name, ALBEDOS.map(|albedo| (albedo, 100.0 * bound)))
    });
    Plot::new(
        "Measured radiance stays within the margin of the closed form",
        Axis::linear("albedo"),
        Axis::linear("relative error (%)"),
        bounds.into_iter().chain(series),
    )
}
