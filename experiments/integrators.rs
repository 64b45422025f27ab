//! Do path tracing and photon mapping draw the same picture where no closed form and no reference exists?

use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{
    Conclusion, Effort, Experiment, Outcome, Run, Table, Timing, grid, values,
};
use crate::lab::plot::{Axis, Plot, Series};
use crate::lab::rendering::render;
use crate::numeric::statistics::Moments;

/// A scene, drawn small.
struct Subjected {
    name: &'static str,
    size: (u32, u32),
    /// First gather radius: small against the objects, also in pictures as small as these.
    radius: f64,
    /// Replicates of each integrator above smoke effort, by their noise and their cost.
    replicates: [i64; 3],
}

/// Glass on a tiled floor, every material and texture, a thin lens.
const SCENES: [Subjected; 3] = [
    Subjected {
        name: "cup",
        size: (64, 48),
        radius: 0.06,
        replicates: [8, 16, 8],
    },
    Subjected {
        name: "gallery",
        size: (64, 36),
        radius: 0.03,
        replicates: [10, 24, 12],
    },
    Subjected {
        name: "lens",
        size: (64, 40),
        radius: 0.05,
        replicates: [8, 8, 8],
    },
];
const INTEGRATORS: [&str; 3] = ["path", "ppm", "sppm"];
/// Replicates of each at smoke effort.
const FEW: i64 = 8;

/// What the gather radius may change of the picture's mean: kernels that reach over edges and corners.
const KERNEL_BIAS: f64 = 0.01;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "integrators",
    question: "Do path tracing and photon mapping draw the same picture of the cup, the gallery and the lens?",
    prediction: "The means of the pictures are equal, up to the share of light that the photon map's kernel loses over edges and \
                 corners (at most 1 %).",
    method: "Independent renders with seeds of their own; the difference of the mean radiances of each photon mapper and of path tracing is proved to lie \
             within a margin (two one-sided Welch tests at .01, Satterthwaite's degrees of freedom): with `agreement` the matrix of integrators and scenes. Path tracing finds the caustics because every lamp has an area. \
             The kernel's share is a bound from corners of a room (bias² ~ r² at one-sided boundaries).",
    columns: &["scene", "integrator", "replicate", "mean", "render_s"],
    timing: Timing::Untimed,
    cpu_seconds: [31.0, 350.0, 2900.0],
    plan,
    execute,
    conclude,
};

fn plan(effort: Effort) -> Vec<Run> {
    let of = |scene: &Subjected, integrator: &str, replicates: i64| {
        grid([
            ("scene", values([scene.name])),
            ("integrator", values([integrator])),
            (
                "replicate",
                values(0..effort.of([FEW, replicates, replicates])),
            ),
        ])
    };
    let all = SCENES.iter().flat_map(|scene| {
        let methods = INTEGRATORS.iter().zip(scene.replicates);
        methods.flat_map(move |(integrator, replicates)| of(scene, integrator, replicates))
    });
    all.collect()
}

/// Camera samples a pixel, and passes of 20 000 photons.
fn budget(integrator: &str, effort: Effort) -> (u32, u32) {
    match integrator {
        "path" => effort.of([(80, 1), (1_024, 1), (8_192, 1)]),
        // Hit points that stay need many, and their noise outweighs that of the photons; new ones come with every pass.
        "ppm" => effort.of([(16, 8), (64, 25), (64, 200)]),
        _ => effort.of([(2, 8), (2, 50), (2, 400)]),
    }
}

fn margin(effort: Effort) -> f64 {
    KERNEL_BIAS + if effort == Effort::Smoke { 0.08 } else { 0.01 }
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let (name, integrator) = (run.text("scene"), run.text("integrator"));
    let subject = SCENES.iter().find(|scene| scene.name == name);
    let subject = subject.ok_or_else(|| anyhow::anyhow!("no scene {name}"))?;
    let (width, height) = subject.size;
    let (spp, passes) = budget(&integrator, effort);
    let sets = [
        ("film.width", width.into()),
        ("film.height", height.into()),
        ("render.integrator", integrator.into()),
        ("render.spp", spp.into()),
        ("render.passes", passes.into()),
        ("render.photons", 20_000.into()),
        ("render.radius", subject.radius.into()),
    ];
    let rendered = render(&name, &sets, seed)?;
    let row = run.row(values([rendered.mean(), rendered.seconds]));
    Ok(Outcome::of_row(row, rendered.work))
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let mut conclusion = Conclusion::default();
    let mut series = INTEGRATORS.map(|name| Series::scattered(name, []));
    let mut costs = series.clone();
    for (place, Subjected { name: scene, .. }) in (1..).zip(SCENES) {
        let part = table.filter("scene", &scene.into());
        let of = |integrator: &str, column| {
            let part = part.filter("integrator", &integrator.into());
            Moments::of(part.numbers(column))
        };
        let means = INTEGRATORS.map(|integrator| of(integrator, "mean"));
        let path = &means[0];
        for (index, moments) in means.iter().enumerate() {
            let percent = |value: f64| 100.0 * (value / path.mean() - 1.0);
            let (mean, reach) = (moments.mean(), 2.0 * moments.standard_error());
            // Side by side, so that neither hides the other.
            let at = f64::from(place) + 0.1 * index as f64;
            series[index].points.push((at, percent(mean)));
            let interval = (percent(mean - reach), percent(mean + reach));
            series[index].intervals.push(interval);
            let noise = 100.0 * moments.variance().sqrt() / mean;
            let seconds = of(INTEGRATORS[index], "render_s").mean();
            costs[index].points.push((seconds, noise));
            costs[index].labels.push(scene.to_owned());
        }
        for (integrator, moments) in INTEGRATORS.iter().zip(&means).skip(1) {
            let claim = claim(scene, integrator, path, moments, effort);
            conclusion.claims.push(claim);
        }
    }
    conclusion.plots = vec![
        Plot::new(
            "All integrators give the same mean (bars: two standard errors)",
            Axis::linear("scene: 1 cup, 2 gallery, 3 lens"),
            Axis::linear("mean radiance against path (%)"),
            series,
        ),
        Plot::new(
            "What the mean of a picture costs, and its noise",
            Axis::log("CPU time of a render (s)"),
            Axis::log("standard deviation of the mean (%)"),
            costs,
        ),
    ];
    conclusion
}

/// The photon map's mean is the path tracer's: their difference, relative to it.
fn claim(
    scene: &str,
    integrator: &str,
    path: &Moments,
    photons: &Moments,
    effort: Effort,
) -> Claim {
    let margin = margin(effort);
    let [a, b] = [photons, path].map(|moments| moments.standard_error() / path.mean());
    let standard_error = libm::hypot(a, b);
    let share = |error: f64, moments: &Moments| {
        (error / standard_error).powi(4) / (moments.count() as f64 - 1.0)
    };
    let estimate = Estimate {
        value: photons.mean() / path.mean() - 1.0,
        standard_error,
        freedom: (share(a, photons) + share(b, path)).recip(),
        n: path.count() + photons.count(),
    };
    let name = format!("{scene}_{integrator}_mean");
    let statement = format!(
        "{integrator} and path give the same mean radiance of the {scene} within {:.1} % (relative difference)",
        100.0 * margin
    );
    let subject = EXPERIMENT.subject(&name, &statement, Effort::Smoke, effort);
    Claim::equivalent(subject, estimate, 0.0, margin)
}
