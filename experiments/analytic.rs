//! Do the renderers agree with the scenes whose radiance is known in closed form?

mod cases;

use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{
    Conclusion, Effort, Experiment, Outcome, Run, Table, Timing, grid, values,
};
use crate::lab::page::number;
use crate::lab::plot::{Axis, Plot, Series};
use crate::lab::rendering::{Rendered, render, render_scene};
use crate::numeric::statistics::Moments;

/// A closed room at one reflectance of its wall.
struct Room {
    scene: &'static str,
    albedo: f64,
    /// Standard deviations of one path, and of one photon, over the mean, as measured: they set the numbers of both. A photon's is that
    /// of the picture's mean over [`PASSES`] passes, times the root of all photons; the fewer, the greater, so it is that of smoke effort.
    noise: [f64; 2],
}

const ROOMS: [&str; 2] = ["furnace", "integrating_sphere"];
const ALBEDOS: [f64; 2] = [0.5, 0.8];
const fn room(scene: &'static str, albedo: f64, noise: [f64; 2]) -> Room {
    Room {
        scene,
        albedo,
        noise,
    }
}
const SETTINGS: [Room; 4] = [
    room(ROOMS[0], ALBEDOS[0], [0.23, 1.1]),
    room(ROOMS[0], ALBEDOS[1], [0.67, 1.05]),
    room(ROOMS[1], ALBEDOS[0], [0.33, 1.3]),
    room(ROOMS[1], ALBEDOS[1], [0.79, 1.25]),
];
const INTEGRATORS: [&str; 2] = ["path", "ppm"];

/// Pixels a side: every pixel has the same answer, so few do.
const SIDE: u32 = 8;
const PIXELS: f64 = (SIDE * SIDE) as f64;
/// Replicates: 15 degrees of freedom for the standard error.
const REPLICATES: i64 = 16;
/// First gather radius in sphere radii: a quarter of the sphere. The kernel has no bias there at any radius.
const RADIUS: f64 = 1.0;
/// Passes of `ppm`.
const PASSES: u32 = 14;
/// Standard errors that make a margin: a proof takes 2.6 of them, as estimated, so that 7 in 10⁵ true answers are left open.
const ERRORS_IN_MARGIN: f64 = 7.0;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "analytic",
    question: "Do path tracing and photon mapping give the radiance of scenes with a closed form?",
    prediction: "In a closed sphere of emission L_e and albedo ρ (furnace) the radiance is L_e/(1 − ρ) everywhere. With a point light of intensity I \
                 at its centre instead (integrating sphere of radius R) it is ρ I/(π R² (1 − ρ)). Below a disc E = (π L/2) (1 − (h² + d² − R²)/√((h² + d² + R²)² − 4 d² R²)); \
                 below a quad Lambert's sum over its edges, cut at the horizon; between plates L₁ = (e₁ + ρ₁ e₂)/(1 − ρ₁ ρ₂); between concentric \
                 spheres the same with the shares that they see of each other; behind a slab of glass (1 − F)² τ/(1 − F² τ²); under water \
                 n² (1 − F) of the sky and F of the bed (Snell's window).",
    method: "Independent renders with seeds of their own; the mean over pixels and channels, with Student's interval over 16 renders, is \
             proved to lie within a margin of the prediction (two one-sided tests at .01): 1 % at smoke effort, .1 % above (.2 % for ppm). \
             Photons within a chord r of a point of a sphere occupy exactly π r² of it, so the photon map has no kernel bias in the closed \
             spheres; the other scenes are for path alone. Each of these is one claim over all its points, which shows the worst: as every point is proved \
             at the level of the whole, no correction is due (Berger 1982). Samples and photons are chosen from the noise of one, such \
             that a margin is 7 standard errors.",
    columns: &[
        "scene",
        "point",
        "integrator",
        "replicate",
        "predicted",
        "mean",
        "relative_error",
        "render_s",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [5.0, 410.0, 6600.0],
    plan,
    execute,
    conclude,
};

fn plan(_: Effort) -> Vec<Run> {
    let of = |scene: &str, points: Vec<String>, integrators: &[&str]| {
        grid([
            ("scene", values([scene])),
            ("point", values(points)),
            ("integrator", values(integrators.iter().copied())),
            ("replicate", values(0..REPLICATES)),
        ])
    };
    let rooms = ROOMS.map(|room| of(room, ALBEDOS.map(albedo_point).to_vec(), &INTEGRATORS));
    let cases = cases::SCENES.map(|scene| {
        let points = cases::of(scene).into_iter().map(|case| case.point);
        of(scene, points.collect(), &["path"])
    });
    rooms.into_iter().chain(cases).flatten().collect()
}

fn albedo_point(albedo: f64) -> String {
    format!("albedo {albedo}")
}

/// L_e/(1 − ρ) with L_e = 1, and ρ I/(π R² (1 − ρ)) with I = π, R = 1.
fn predicted(room: &str, albedo: f64) -> f64 {
    let numerator = if room == "furnace" { 1.0 } else { albedo };
    numerator / (1.0 - albedo)
}

fn margin(integrator: &str, effort: Effort) -> f64 {
    match (effort, integrator) {
        (Effort::Smoke, _) => 0.01,
        (_, "ppm") => 0.002,
        _ => 0.001,
    }
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let (scene, point) = (run.text("scene"), run.text("point"));
    let room = SETTINGS
        .iter()
        .find(|room| room.scene == scene && albedo_point(room.albedo) == point);
    let (rendered, truth) = match room {
        Some(room) => {
            let rendered = room.render(&run.text("integrator"), effort, seed)?;
            (rendered, predicted(&scene, room.albedo))
        }
        None => {
            let case = cases::of(&scene).into_iter().find(|c| c.point == point);
            let case = case.ok_or_else(|| anyhow::anyhow!("no point {point} of {scene}"))?;
            let spp = samples(case.noise, "path", effort) / PIXELS;
            let rendered = render_scene(&case.scene(at_least_one(spp))?, seed)?;
            (rendered, case.predicted)
        }
    };
    let mean = rendered.mean();
    let row = run.row(values([truth, mean, mean / truth - 1.0, rendered.seconds]));
    Ok(Outcome::of_row(row, rendered.work))
}

impl Room {
    fn render(&self, integrator: &str, effort: Effort, seed: u64) -> anyhow::Result<Rendered> {
        let [path, photon] = self.noise;
        let spp = match integrator {
            "path" => at_least_one(samples(path, integrator, effort) / PIXELS),
            _ => 1,
        };
        let photons = at_least_one(samples(photon, integrator, effort) / f64::from(PASSES));
        let sets = [
            ("film.width", SIDE.into()),
            ("film.height", SIDE.into()),
            (
                "material.wall.diffuse.reflectance",
                vec![self.albedo; 3].into(),
            ),
            ("render.integrator", integrator.into()),
            ("render.spp", spp.into()),
            ("render.passes", PASSES.into()),
            ("render.photons", photons.into()),
            ("render.radius", RADIUS.into()),
        ];
        render(self.scene, &sets, seed)
    }
}

/// Samples of a render for the standard error that the margin asks for; at full effort a quarter of it.
fn samples(noise: f64, integrator: &str, effort: Effort) -> f64 {
    let errors = ERRORS_IN_MARGIN * effort.of([1.0, 1.0, 4.0]);
    let root = errors * noise / margin(integrator, effort);
    root * root / REPLICATES as f64
}

fn at_least_one(count: f64) -> u32 {
    (count.ceil() as u32).max(1)
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let mut conclusion = Conclusion::default();
    let mut series = Vec::new();
    for scene in ROOMS {
        for integrator in INTEGRATORS {
            let part = table
                .filter("scene", &scene.into())
                .filter("integrator", &integrator.into());
            let claims: Vec<Claim> = ALBEDOS
                .iter()
                .map(|&albedo| room_claim(&part, scene, integrator, albedo, effort))
                .collect();
            series.push(relative_errors(&claims, &format!("{scene}, {integrator}")));
            conclusion.claims.extend(claims);
        }
    }
    let mut points = Vec::new();
    for scene in cases::SCENES {
        let part = table.filter("scene", &scene.into());
        let estimates: Vec<(String, Estimate)> = cases::of(scene)
            .into_iter()
            .map(|case| {
                let errors = part.filter("point", &case.point.as_str().into());
                let errors = Moments::of(errors.numbers("relative_error"));
                (case.point, Estimate::of(&errors))
            })
            .collect();
        conclusion
            .claims
            .push(case_claim(scene, &estimates, effort));
        points.push((scene, estimates));
    }
    conclusion.plots = vec![
        plot(series, margin("ppm", effort)),
        case_plot(&points, margin("path", effort)),
    ];
    conclusion
}

fn room_claim(part: &Table, scene: &str, integrator: &str, albedo: f64, effort: Effort) -> Claim {
    let means = part.filter("point", &albedo_point(albedo).into());
    let means = Moments::of(means.numbers("mean"));
    let truth = predicted(scene, albedo);
    let margin = margin(integrator, effort);
    let percent = 100.0 * margin;
    let name = format!("{scene}_{integrator}_{albedo}");
    let statement = format!(
        "{integrator} gives the radiance {} of the {scene} with albedo {albedo} within {percent} %",
        number(truth)
    );
    let subject = EXPERIMENT.subject(&name, &statement, Effort::Smoke, effort);
    Claim::equivalent(subject, Estimate::of(&means), truth, margin * truth)
}

/// The relative error of every point of a scene, by its worst.
fn case_claim(scene: &str, estimates: &[(String, Estimate)], effort: Effort) -> Claim {
    let bound = |(_, estimate): &&(String, Estimate)| estimate.proven_bound();
    let worst = estimates
        .iter()
        .max_by(|a, b| bound(a).total_cmp(&bound(b)));
    let (point, worst) = worst.map_or(("none", Estimate::known(f64::NAN, f64::NAN, 0)), |w| {
        (w.0.as_str(), w.1)
    });
    let name = format!("{scene}_path");
    let statement = format!(
        "path gives the closed form of the {scene} at {} points within {} % (shown: the worst, {point})",
        estimates.len(),
        100.0 * margin("path", effort)
    );
    let subject = EXPERIMENT.subject(&name, &statement, Effort::Smoke, effort);
    Claim::equivalent(subject, worst, 0.0, margin("path", effort))
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

fn case_plot(scenes: &[(&str, Vec<(String, Estimate)>)], margin: f64) -> Plot {
    let percent = |value: f64| 100.0 * value;
    let mut place = 0.0;
    let mut series = Vec::new();
    for (scene, estimates) in scenes {
        let mut of_scene = Series::scattered(*scene, []);
        for (point, estimate) in estimates {
            place += 1.0;
            let bound = 2.0 * estimate.standard_error;
            of_scene.points.push((place, percent(estimate.value)));
            of_scene.labels.push(point.clone());
            of_scene.intervals.push((
                percent(estimate.value - bound),
                percent(estimate.value + bound),
            ));
        }
        series.push(of_scene);
    }
    let bounds = [("margin", margin), ("− margin", -margin)]
        .map(|(name, bound)| Series::predicted(name, [1.0, place].map(|x| (x, percent(bound)))));
    Plot::new(
        "path at the points with a closed form (bars: two standard errors)",
        Axis::linear("point"),
        Axis::linear("relative error (%)"),
        bounds.into_iter().chain(series),
    )
}
