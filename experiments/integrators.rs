//! Do path tracing and photon mapping draw the same picture where no closed form and no reference exists?

use crate::lab::claim::{Claim, Estimate, Subject};
use crate::lab::experiment::{Conclusion, Effort, Experiment, Outcome, Run};
use crate::lab::plot::{Axis, Plot, Scale, Series};
use crate::lab::table::{Table, Value};
use crate::numeric::statistics::Moments;
use crate::render::driver::render_unwatched;
use crate::render::settings::Settings;
use crate::scene::file::load;
use std::path::Path;
use std::time::Instant;

const NAME: &str = "integrators";

/// Scenes, each with the size of its picture and the first gather radius: glass on a tiled floor, every material and texture, a
/// thin lens. The radius is small against the objects, because the default of 3 pixels would be large in pictures as small as these.
const SCENES: [(&str, u32, u32, f64); 3] = [
    ("cup", 64, 48, 0.06),
    ("gallery", 64, 36, 0.03),
    ("lens", 64, 40, 0.05),
];
const INTEGRATORS: [&str; 2] = ["path", "ppm"];
const REPLICATES: i64 = 8;

/// What the gather radius may change of the picture's mean: kernels that reach over edges and corners.
const KERNEL_BIAS: f64 = 0.01;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: NAME,
    question: "Do path tracing and photon mapping draw the same picture of the cup, the gallery and the lens?",
    prediction: "The means of the pictures are equal, up to the share of light that the photon map's kernel loses over edges and \
                 corners (at most 1 %).",
    method: "Independent renders with seeds of their own; the difference of the mean radiances by the two integrators is proved to lie \
             within a margin (two one-sided Welch tests at .01). Path tracing finds the caustics because every lamp has an area. \
             The kernel's share is a bound from corners of a room (bias² ~ r² at one-sided boundaries).",
    columns: &["scene", "integrator", "replicate", "mean", "render_s"],
    timed: false,
    plan,
    execute,
    conclude,
};

fn plan(_: Effort) -> Vec<Run> {
    let mut runs = Vec::new();
    for (scene, ..) in SCENES {
        for integrator in INTEGRATORS {
            for replicate in 0..REPLICATES {
                runs.push(Run::new([
                    ("scene", scene.into()),
                    ("integrator", integrator.into()),
                    ("replicate", replicate.into()),
                ]));
            }
        }
    }
    runs
}

/// Camera samples a pixel of `path`; passes of 20 000 photons of `ppm`.
fn budget(effort: Effort) -> (u32, u64) {
    match effort {
        Effort::Smoke => (80, 8),
        Effort::Standard => (2_048, 100),
        Effort::Full => (16_384, 800),
    }
}

fn margin(effort: Effort) -> f64 {
    KERNEL_BIAS + if effort == Effort::Smoke { 0.05 } else { 0.005 }
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let (name, integrator) = (run.text("scene"), run.text("integrator"));
    let (_, width, height, radius) = SCENES
        .into_iter()
        .find(|(scene, ..)| *scene == name)
        .ok_or_else(|| anyhow::anyhow!("no scene {name}"))?;
    let (spp, passes) = budget(effort);
    let overrides = [
        ("film.width", width.to_string()),
        ("film.height", height.to_string()),
        ("render.integrator", format!("\"{integrator}\"")),
        (
            "render.spp",
            if integrator == "path" { spp } else { 16 }.to_string(),
        ),
        ("render.passes", passes.to_string()),
        ("render.photons", "20000".to_owned()),
        ("render.radius", format!("{radius:?}")),
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
    let mut row: Vec<Value> = run
        .parameters
        .iter()
        .map(|(_, value)| value.clone())
        .collect();
    let mean = outcome.film.mean().element_sum() / 3.0;
    row.extend([mean.into(), start.elapsed().as_secs_f64().into()]);
    Ok(Outcome {
        rows: vec![row],
        work: outcome.work,
    })
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let mut conclusion = Conclusion::default();
    let mut means = INTEGRATORS.map(|integrator| (integrator, Vec::new(), Vec::new()));
    for (place, (scene, ..)) in (1..).zip(SCENES) {
        let part = table.filter("scene", &scene.into());
        let of = |integrator: &str| {
            Moments::of(
                part.filter("integrator", &integrator.into())
                    .numbers("mean"),
            )
        };
        let truth = of("path").mean();
        for (integrator, points, intervals) in &mut means {
            let moments = of(integrator);
            let percent = |value: f64| 100.0 * (value / truth - 1.0);
            let reach = 2.0 * moments.standard_error();
            points.push((f64::from(place), percent(moments.mean())));
            intervals.push((
                percent(moments.mean() - reach),
                percent(moments.mean() + reach),
            ));
        }
        conclusion
            .claims
            .push(claim(scene, &of("path"), &of("ppm"), effort));
    }
    conclusion.plots.push(Plot {
        title: "Both integrators give the same mean (bars: two standard errors)".to_owned(),
        x: Axis {
            label: "scene: 1 cup, 2 gallery, 3 lens".to_owned(),
            scale: Scale::Linear,
        },
        y: Axis {
            label: "mean radiance against path (%)".to_owned(),
            scale: Scale::Linear,
        },
        series: means
            .into_iter()
            .map(|(name, points, intervals)| Series {
                name: name.to_owned(),
                points,
                intervals,
                predicted: false,
            })
            .collect(),
    });
    conclusion
}

/// The photon map's mean is the path tracer's.
fn claim(scene: &str, path: &Moments, ppm: &Moments, effort: Effort) -> Claim {
    let margin = margin(effort);
    let estimate = Estimate {
        value: ppm.mean(),
        standard_error: libm::hypot(ppm.standard_error(), path.standard_error()),
        // The lesser count decides: fewer degrees of freedom than Welch's, so wider.
        freedom: path.count().min(ppm.count()) as f64 - 1.0,
        n: path.count() + ppm.count(),
    };
    let subject = Subject {
        experiment: NAME,
        claim: &format!("{scene}_mean"),
        statement: &format!(
            "ppm and path give the same mean radiance of the {scene} within {:.1} %",
            100.0 * margin
        ),
        decided_at: Effort::Smoke,
        effort,
    };
    Claim::equivalent(subject, estimate, path.mean(), margin * path.mean())
}
