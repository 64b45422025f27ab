//! How does the error of photon mapping fall with the number of photons, where every answer is known?
//!
//! Scene `nadir`: an isotropic point light of intensity I at height 1 over a plane of reflectance ρ, and one hit point straight
//! below. With the radius r of a pass given, m photons put M of them into the disc, M ~ Binomial(m, p), p = ½(1 − 1/√(1 + r²)).
//! The pass reads (ρ/π) 4πI M/(π r² m), so its mean and variance are known to all digits, and so are those of the mean over
//! passes: a radius depends on earlier passes only. Where it depends on no photons (constant, global) these are the mean and the
//! variance of the picture; under the local rule, each pass less its mean at the radius it had is a martingale difference.
//!
//! Scene `sphere`: a point light at the centre of a closed diffuse sphere. Photons within a chord r lie on exactly π r² of it, so
//! no radius has a bias. Hits share paths: var M / mean M = 1 + q (2ρ − 1)/(1 − ρ), q = r²/4.

mod conclusion;

use crate::lab::experiment::{Effort, Experiment, Outcome, Run, Timing, values};
use crate::lab::rendering::on_one_thread;
use crate::numeric::rng::mix;
use crate::numeric::statistics::Moments;
use crate::numeric::work::Work;
use crate::render::film::Film;
use crate::render::photon::{Phases, PhotonMapper};
use crate::render::settings::Settings;
use crate::scene::options::{Integrator, RenderTable, Rule};
use crate::scene::{Scene, file};
use std::path::Path;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "photons",
    question: "How does the error of photon mapping fall with photons, passes and radius?",
    prediction: "The mean is that of the kernel at the radii in force, to all digits; the variance is the binomial one: 1/photons, \
                 and Γ(1+α)/(n²(2−α)) (Γ(n+2)/Γ(n+α) − 1/Γ(α)) over n passes of the global rule. More photons never cure a bias.",
    method: "One hit point under a point light over a plane, and one inside an integrating sphere; independent replicates at every \
             point of the sweep; closed forms as in verification of progressive photon mapping (Hachisuka 2008, Knaus and Zwicker 2011).",
    columns: &[
        "scene",
        "rule",
        "alpha",
        "photons",
        "passes",
        "radius",
        "replicates",
        "truth",
        "mean",
        "predicted",
        "bias",
        "variance",
        "predicted_variance",
        "rmse",
        "cpu_s",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [3.6, 100.0, 1200.0],
    plan,
    execute,
    conclude: conclusion::conclude,
};

const NADIR: &str = include_str!("photons/nadir.toml");
/// ρ of the nadir scene; I = π makes L = ρ below the light.
const NADIR_REFLECTANCE: f64 = 0.5;

const SPHERE: &str = include_str!("photons/sphere.toml");
/// ρ of the sphere; I = π/4 makes L = ρ I/(π (1 − ρ)) = 1.
const SPHERE_REFLECTANCE: f64 = 0.8;

const RADIUS: f64 = 0.3;
const ALPHA: f64 = 2.0 / 3.0;

/// One point of the sweep.
fn run(scene: &str, rule: &str, alpha: f64, photons: u32, passes: u32, radius: f64) -> Run {
    Run::new([
        ("scene", scene.into()),
        ("rule", rule.into()),
        ("alpha", alpha.into()),
        ("photons", photons.into()),
        ("passes", passes.into()),
        ("radius", radius.into()),
    ])
}

fn plan(_: Effort) -> Vec<Run> {
    let mut runs = Vec::new();
    for level in 0..6 {
        runs.push(run("nadir", "constant", 1.0, 64 << level, 32, RADIUS));
    }
    for radius in [0.1, 1.0] {
        runs.push(run("nadir", "constant", 1.0, 512, 32, radius));
    }
    for rule in ["global", "local"] {
        for level in 0..6 {
            runs.push(run("nadir", rule, ALPHA, 512, 4 << level, RADIUS));
        }
        for alpha in [0.5, 0.75] {
            runs.push(run("nadir", rule, alpha, 512, 32, RADIUS));
        }
    }
    for radius in [0.25, 0.5, 1.0] {
        runs.push(run("sphere", "constant", 1.0, 512, 4, radius));
    }
    runs
}

/// Mean and variance of what one pass reads at a squared radius, in closed form.
type ClosedForm = fn(radius_squared: f64, photons: f64) -> (f64, f64);

fn nadir_pass(radius_squared: f64, photons: f64) -> (f64, f64) {
    let root = (1.0 + radius_squared).sqrt();
    // ½ (1 − 1/root), without cancellation.
    let p = 0.5 * radius_squared / (root * (1.0 + root));
    let per_photon = 4.0 * NADIR_REFLECTANCE / (radius_squared * photons);
    (
        per_photon * photons * p,
        per_photon * per_photon * photons * p * (1.0 - p),
    )
}

fn sphere_pass(radius_squared: f64, photons: f64) -> (f64, f64) {
    let share = radius_squared / 4.0;
    let rho = SPHERE_REFLECTANCE;
    let found = photons * share / (1.0 - rho);
    // Every photon that is found has kept its whole flux, and the mean reading is 1.
    let dispersion = 1.0 + share * (2.0 * rho - 1.0) / (1.0 - rho);
    (1.0, dispersion / found)
}

/// A parsed scene, what it reads without bias, and the closed form of a pass.
fn subject(name: &str) -> anyhow::Result<(Scene, f64, ClosedForm)> {
    let (text, truth, form): (_, _, ClosedForm) = match name {
        "nadir" => (NADIR, NADIR_REFLECTANCE, nadir_pass),
        _ => (SPHERE, 1.0, sphere_pass),
    };
    let scene = file::parse(text, name, Path::new(""), &[])?;
    Ok((scene, truth, form))
}

fn rule(name: &str) -> Rule {
    match name {
        "constant" => Rule::Constant,
        "global" => Rule::Global,
        _ => Rule::Local,
    }
}

/// What a picture of one pixel reads, and what it should in the mean at the radii that it had.
struct Reading {
    value: f64,
    expected: f64,
    /// Variance of `value` about `expected`.
    variance: f64,
}

fn read(
    scene: &Scene,
    settings: &Settings,
    form: ClosedForm,
    work: &mut Work,
) -> anyhow::Result<Reading> {
    let mut mapper = PhotonMapper::new(scene, settings)?;
    let mut film = Film::new(scene.film);
    let (mut expected, mut variance) = (0.0, 0.0);
    for pass in 0..settings.passes {
        *work += mapper.pass(pass, &mut film, &mut Phases::default());
        let (mean, square) = form(mapper.radii_squared()[0], settings.photons as f64);
        expected += mean;
        variance += square;
    }
    let n = settings.passes as f64;
    Ok(Reading {
        value: film.mean().x,
        expected: expected / n,
        variance: variance / (n * n),
    })
}

/// Moments over the replicates of a run.
#[derive(Default)]
struct Tally {
    value: Moments,
    expected: Moments,
    residual: Moments,
    variance: Moments,
    square_error: Moments,
    work: Work,
}

fn replicate(run: &Run, count: u64, seed: u64) -> anyhow::Result<Tally> {
    let (scene, truth, form) = subject(&run.text("scene"))?;
    let mut tally = Tally::default();
    for replicate in 0..count {
        let settings = Settings::resolve(&RenderTable {
            integrator: Some(Integrator::Sppm),
            rule: Some(rule(&run.text("rule"))),
            alpha: Some(run.number("alpha")),
            photons: Some(run.integer("photons") as u64),
            passes: Some(run.integer("passes") as u64),
            radius: Some(run.number("radius")),
            seed: Some(mix(&[seed, replicate])),
            ..RenderTable::default()
        });
        let reading = read(&scene, &settings, form, &mut tally.work)?;
        let error = reading.value - truth;
        tally.value.add(reading.value);
        tally.expected.add(reading.expected);
        tally.residual.add(reading.value - reading.expected);
        tally.variance.add(reading.variance);
        tally.square_error.add(error * error);
    }
    Ok(tally)
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let (_, truth, _) = subject(&run.text("scene"))?;
    let count: u64 = match run.text("scene").as_str() {
        "nadir" => effort.of([32, 640, 8192]),
        _ => effort.of([32, 1024, 8192]),
    };
    let (tally, seconds) = on_one_thread(|| replicate(run, count, seed))?;
    let found = [
        truth,
        tally.value.mean(),
        tally.expected.mean(),
        tally.value.mean() - truth,
        tally.residual.variance(),
        tally.variance.mean(),
        tally.square_error.mean().sqrt(),
        seconds,
    ];
    let row = run.row([count.into()].into_iter().chain(values(found)));
    Ok(Outcome::of_row(row, tally.work))
}

#[cfg(test)]
mod tests {
    use super::*;
    use libm::tgamma;

    #[test]
    fn the_closed_forms_have_their_tabulated_values() {
        for (radius, tabulated) in [(0.1, 0.992_56), (0.3, 0.937_19), (1.0, 0.585_79)] {
            let (mean, _) = nadir_pass(radius * radius, 1000.0);
            assert!(
                (mean / NADIR_REFLECTANCE - tabulated).abs() < 5e-6,
                "{radius}"
            );
        }
        // var M / mean M = 1.75 at ρ = 0.8, r = R, where the mean count is m q/(1 − ρ) = 1.25 m.
        let (_, variance) = sphere_pass(1.0, 100.0);
        assert!((variance * 125.0 - 1.75).abs() < 1e-12);
    }

    /// The variance over n passes of the global rule at small radii, against its closed form in Γ.
    #[test]
    fn the_variance_of_the_global_rule_has_its_closed_form() {
        let first = 1e-8;
        for alpha in [0.5, ALPHA, 0.75] {
            let n = 40.0;
            let mut schedule = crate::render::photon::radius::Schedule::new(Rule::Global, alpha);
            let sum: f64 = (0..40)
                .map(|pass| nadir_pass(first * schedule.shrink(pass), 100.0).1)
                .sum();
            let (_, one) = nadir_pass(first, 100.0);
            let ratio = libm::exp(libm::lgamma(n + 2.0) - libm::lgamma(n + alpha));
            let closed =
                tgamma(1.0 + alpha) / (n * n * (2.0 - alpha)) * (ratio - 1.0 / tgamma(alpha));
            // The next term of p in r² is of relative size r².
            assert!((sum / (n * n) / one / closed - 1.0).abs() < 1e-7, "{alpha}");
        }
    }
}
