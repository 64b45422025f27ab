//! Does the light behind a glass ball lie where geometrical optics puts it, and how many photons does it take to see that?
//!
//! Parallel light, a ball of radius 1 and index 1.5, a floor. Behind the paraxial focus (floor 2 below the centre) the caustic is one
//! bright spot; before it (1.1) the light has a fold, a ring beyond which it ends, and crosses the axis. Everything is known: the irradiance
//! E(ρ) as a sum over the rays that lead to ρ, what a disc of any radius reads of it in the mean, and the variance of that, as photons
//! are independent: E_est = M Φ/(π r² m), M ~ Binomial(m, E_disc π r²/Φ), Φ the power of the beam.

mod conclusion;
pub mod prediction;

use crate::lab::experiment::{Effort, Experiment, Outcome, Run, Timing, values};
use crate::lab::rendering::{on_one_thread, scene};
use crate::numeric::rng::mix;
use crate::numeric::work::Work;
use crate::render::film::Film;
use crate::render::photon::{Phases, PhotonMapper};
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::options::{Integrator, RenderTable, Rule};
use prediction::{Ball, Blurred, Exact};
use std::f64::consts::PI;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "caustic",
    question: "Does the caustic of a glass ball have the predicted profile, and how does its error fall with the photons?",
    prediction: "With b the distance of a ray from the axis: E(ρ) = Σ_b E_0 (1 − F)² b/(ρ |dρ/db|), ρ(b) = |b − z sin δ|/cos δ, \
                 δ = 2 (asin b − asin(b/n)), and as much for light that is reflected inside or outside. A gather of radius r reads its \
                 mean over the disc. With a constant radius the error ends at the bias; as the radius shrinks, it goes on to fall.",
    method: "A row of pixels from the axis outwards, one hit point each; the prediction is taken at these very points and radii \
             (quadrature over b). All orders of inner reflection that reach the floor count. The floor reflects 10⁻⁶, so that no light comes back.",
    columns: &[
        "plane",
        "rule",
        "radius",
        "photons",
        "passes",
        "replicate",
        "pixel",
        "distance",
        "truth",
        "predicted",
        "predicted_variance",
        "measured",
        "cpu_s",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [3.0, 80.0, 640.0],
    plan,
    execute,
    conclude: conclusion::conclude,
};

/// Pixels of the row.
const PIXELS: u32 = 40;
/// Reflectance of the floor.
const REFLECTANCE: f64 = 1e-6;
/// Floors below the centre of the ball, each with the length of the row: behind and before the focus.
const BEHIND: f64 = 2.0;
const BEFORE: f64 = 1.1;

fn row_length(plane: f64) -> f64 {
    if plane == BEHIND { 1.3 } else { 0.32 }
}

fn run(plane: f64, rule: &str, radius: f64, photons: u32, passes: u32) -> Run {
    Run::new([
        ("plane", plane.into()),
        ("rule", rule.into()),
        ("radius", radius.into()),
        ("photons", photons.into()),
        ("passes", passes.into()),
    ])
}

/// Radius of the sweep over photons.
const SWEEP_RADIUS: f64 = 0.12;
/// Photons a pass in that sweep.
const SWEEP_PHOTONS: u32 = 2000;

fn plan(_: Effort) -> Vec<Run> {
    let mut runs = vec![
        run(BEHIND, "constant", 0.06, 5000, 8),
        run(BEFORE, "constant", 0.02, 5000, 8),
    ];
    for rule in ["constant", "global"] {
        for passes in [1, 2, 4, 8, 16] {
            runs.push(run(BEHIND, rule, SWEEP_RADIUS, SWEEP_PHOTONS, passes));
        }
    }
    runs
}

fn replicates(effort: Effort) -> u32 {
    effort.of([8, 200, 1600])
}

fn ball(plane: f64) -> Ball {
    Ball {
        ior: 1.5,
        beam: 1.5,
        plane,
    }
}

/// The scene of the ball, with the floor and a camera close above it that looks straight down on the row.
fn subject(plane: f64) -> anyhow::Result<Scene> {
    let length = row_length(plane);
    let height = 0.5 * (plane - 1.0);
    let half_pixel = 0.5 * length / f64::from(PIXELS);
    let at = |y: f64| vec![0.5 * length, y, 0.0];
    let sets = [
        ("quad.0.corner", vec![-2.0, -plane, 2.0].into()),
        (
            "material.floor.diffuse.reflectance",
            vec![REFLECTANCE; 3].into(),
        ),
        ("camera.eye", at(height - plane).into()),
        ("camera.target", at(-plane).into()),
        ("camera.up", vec![0.0, 0.0, -1.0].into()),
        (
            "camera.vertical_fov_deg",
            (2.0 * libm::atan(half_pixel / height)).to_degrees().into(),
        ),
        ("film.width", PIXELS.into()),
        ("film.height", 1.into()),
    ];
    scene("glass_ball", &sets)
}

/// What is known of a plane.
struct Known {
    exact: Exact,
    blurred: Blurred,
    /// Power of the beam.
    power: f64,
}

/// What one pixel read, and what it should.
#[derive(Clone, Copy, Default)]
struct Reading {
    distance: f64,
    truth: f64,
    predicted: f64,
    variance: f64,
    measured: f64,
}

/// Renders once.
fn read(
    scene: &Scene,
    settings: &Settings,
    known: &Known,
    work: &mut Work,
) -> anyhow::Result<Vec<Reading>> {
    let mut mapper = PhotonMapper::new(scene, settings)?;
    let mut film = Film::new(scene.film);
    let mut readings = vec![Reading::default(); PIXELS as usize];
    let (passes, photons) = (settings.passes as f64, settings.photons as f64);
    for pass in 0..settings.passes {
        *work += mapper.pass(pass, &mut film, &mut Phases::default());
        let radii = mapper.hit_points().iter().zip(mapper.radii_squared());
        for (reading, (hit_point, square)) in readings.iter_mut().zip(radii) {
            reading.distance = libm::hypot(hit_point.point.x, hit_point.point.z);
            let mean = known.blurred.irradiance(reading.distance, square.sqrt());
            let p = mean * PI * square / known.power;
            let each = known.power / (PI * square * photons);
            reading.predicted += mean / passes;
            reading.variance += each * each * photons * p * (1.0 - p) / (passes * passes);
        }
    }
    for (reading, pixel) in readings.iter_mut().zip(film.pixels()) {
        reading.truth = known.exact.irradiance(reading.distance);
        reading.measured = pixel.mean().x * PI / REFLECTANCE;
    }
    Ok(readings)
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let plane = run.number("plane");
    let (scene, ball) = (subject(plane)?, ball(plane));
    let known = Known {
        exact: Exact::new(&ball),
        blurred: Blurred::new(&ball),
        power: PI * ball.beam * ball.beam,
    };
    let rule = match run.text("rule").as_str() {
        "global" => Rule::Global,
        _ => Rule::Constant,
    };
    let mut outcome = Outcome::default();
    for replicate in 0..replicates(effort) {
        let settings = Settings::resolve(&RenderTable {
            // Hit points that stay: one place for each pixel, at which the prediction is taken.
            integrator: Some(Integrator::Ppm),
            spp: Some(1),
            rule: Some(rule),
            photons: Some(run.integer("photons") as u64),
            passes: Some(run.integer("passes") as u64),
            radius: Some(run.number("radius")),
            seed: Some(mix(&[seed, u64::from(replicate)])),
            ..RenderTable::default()
        });
        let work = &mut outcome.work;
        let (readings, seconds) = on_one_thread(|| read(&scene, &settings, &known, work))?;
        for (pixel, reading) in (0..PIXELS).zip(readings) {
            let numbers = [
                reading.distance,
                reading.truth,
                reading.predicted,
                reading.variance,
                reading.measured,
                seconds,
            ];
            let row = [values([replicate, pixel]), values(numbers)].concat();
            outcome.rows.push(run.row(row));
        }
    }
    Ok(outcome)
}
