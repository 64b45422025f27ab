//! The estimate of photon mapping, its radius, and its photons.

use super::{Fault, Finding, Trial, compare};
use crate::numeric::statistics::Moments;
use crate::render::film::Film;
use crate::render::photon::arrivals::{Arrival, Arrivals};
use crate::render::photon::camera::HitPoint;
use crate::render::photon::gather::{Gathered, gather, radiance};
use crate::render::photon::radius::Statistics;
use crate::render::photon::trace::trace;
use crate::render::photon::{Phases, PhotonMapper};
use crate::render::settings::Settings;
use crate::scene::options::{Integrator, RenderTable, Rule};
use crate::scene::{Rgb, Scene, file};
use glam::DVec3;
use std::f64::consts::PI;
use std::path::Path;

const DENSITY: &str = "photons in proportion to area and to those emitted leave the estimate alone, at 1/π a photon and unit of area";

pub(super) const FAULTS: &[Fault] = &[
    Fault {
        name: "flux not divided by π r²",
        number: "M22",
        component: "photon estimate",
        quantity: "estimate at radius 0.1 over that at radius 1, even density",
        hides_where: "radius 1/√π",
        property: DENSITY,
        examine: |_| {
            estimates(
                |hit, g, r2, n| radiance(hit, g, r2, n) * (PI * r2),
                |f| even(f, 0.01, 1000.0) / even(f, 1.0, 1000.0),
                |f| even(f, 1.0 / PI, 1000.0),
            )
        },
    },
    Fault {
        name: "flux divided by r² without π",
        number: "",
        component: "photon estimate",
        quantity: "estimate of the radiance 1/π",
        hides_where: "ratio of the estimates at two radii",
        property: DENSITY,
        examine: |_| {
            estimates(
                |hit, g, r2, n| radiance(hit, g, r2, n) * PI,
                |f| even(f, 1.0, 1000.0),
                |f| even(f, 0.01, 1000.0) / even(f, 1.0, 1000.0),
            )
        },
    },
    Fault {
        name: "flux not divided by the photons emitted",
        number: "M31",
        component: "photon estimate",
        quantity: "estimate with 1000 photons over that with 100",
        hides_where: "one photon emitted",
        property: DENSITY,
        examine: |_| {
            estimates(
                |hit, g, r2, n| radiance(hit, g, r2, n) * n,
                |f| even(f, 1.0, 1000.0) / even(f, 1.0, 100.0),
                |f| even(f, 1.0, 1.0),
            )
        },
    },
    Fault {
        name: "gain 1/decay of a shrinking radius",
        number: "M23",
        component: "photon estimate",
        quantity: "estimate after 80 rounds of radius × 0.95, over the truth",
        hides_where: "a radius that does not shrink",
        property: "an even density reads the same in every round",
        examine: |_| {
            compare(
                gain_of_area as Gain,
                gain_of_length,
                |f| after_rounds(f, 0.95, 80),
                |f| after_rounds(f, 1.0, 80),
                |f| (1..=80).all(|rounds| (after_rounds(f, 0.95, rounds) - 1.0).abs() < 1e-12),
            )
        },
    },
    Fault {
        name: "flux over bounces + 1",
        number: "M24",
        component: "photon tracing",
        quantity: "flux that arrives in a closed sphere of reflectance 0.8, over the light's",
        hides_where: "light that has not bounced",
        property: "1/(1 − ρ) of the light's flux arrives",
        examine: |trial| {
            let photons = trace(&scene(SPHERE), trial.seed, 0, trial.samples, None);
            let arriving = |f: Weight, most: u32| {
                let arrivals = photons
                    .arrivals
                    .iter()
                    .filter(|arrival| arrival.events <= most);
                arrivals.map(|a| f(&a).x).sum::<f64>() / photons.energy.emitted.x
            };
            let all = |f| arriving(f, u32::MAX);
            compare(
                |arrival: &Arrival| arrival.flux,
                (|arrival| arrival.flux / f64::from(arrival.events + 1)) as Weight,
                all,
                |f| arriving(f, 0),
                |f| {
                    // A geometric number of bounces has the variance ρ/(1 − ρ)².
                    let error = (0.8 / trial.samples as f64).sqrt() / 0.2;
                    (all(f) - 5.0).abs() < 6.0 * error
                },
            )
        },
    },
    Fault {
        name: "radius shrinks by photons from behind",
        number: "M25",
        component: "photon radius",
        quantity: "r² over its first value after 20 passes with light from behind only",
        hides_where: "as many photons from behind as from before, in every pass",
        property: "photons from behind leave the radius as it was",
        examine: |_| {
            compare(
                by_gathered as Shrink,
                by_all_within,
                |f| after_passes(f, 0, 10),
                |f| after_passes(f, 10, 10),
                |f| after_passes(f, 0, 10) == 1.0,
            )
        },
    },
    Fault {
        name: "N′ = N + M",
        number: "M32",
        component: "photon radius",
        quantity: "r² over its first value after 100 passes of one photon, α = 0.7",
        hides_where: "the first pass, and α = 1",
        property: "N is α times all photons found, and r² has the product's closed form",
        examine: |_| {
            let one_a_pass = |f: Update, passes: u32| {
                (0..passes).fold(Statistics::default(), |s, _| f(s, 1.0, 0.7))
            };
            compare(
                (|s, m, alpha| s.after(m, alpha)) as Update,
                |s, m, alpha| Statistics {
                    kept: s.kept + m,
                    ..s.after(m, alpha)
                },
                |f| one_a_pass(f, 100).shrink,
                |f| one_a_pass(f, 1).shrink,
                |f| {
                    let after = one_a_pass(f, 100);
                    // Π (iα + α)/(iα + 1) over i < 100.
                    let factors =
                        (0..100).map(|i| 0.7 * f64::from(i + 1) / (0.7 * f64::from(i) + 1.0));
                    let closed: f64 = factors.product();
                    (after.kept / 70.0 - 1.0).abs() < 1e-12
                        && (after.shrink / closed - 1.0).abs() < 1e-12
                },
            )
        },
    },
    Fault {
        name: "the same seed every pass",
        number: "M26",
        component: "photon passes",
        quantity: "variance of passes over that of a binomial count",
        hides_where: "the first pass",
        property: "passes vary as a binomial count does",
        examine: |trial| {
            let passes = trial.samples / 80;
            let variance = |f: Passes| {
                let values = readings(f, trial, passes);
                Moments::of(values).variance() / binomial_variance()
            };
            compare(
                (|pass| pass) as Passes,
                |_| 0,
                variance,
                |f| readings(f, trial, 1)[0],
                |f| {
                    let error = (2.0 / (passes as f64 - 1.0)).sqrt();
                    (variance(f) - 1.0).abs() < 6.0 * error
                },
            )
        },
    },
];

/// Radiance from what was gathered, squared radius, and photons emitted.
type Estimate = fn(&HitPoint, &Gathered, f64, f64) -> Rgb;
/// Factor of the flux of a round whose radius is this share of the one before.
type Gain = fn(f64) -> f64;
/// What an arriving photon brings.
type Weight = fn(&Arrival) -> Rgb;
/// Statistics after a pass from the photons within the radius.
type Shrink = fn(Statistics, &[Arrival]) -> Statistics;
/// Statistics after a pass that found so many photons, and α.
type Update = fn(Statistics, f64, f64) -> Statistics;
/// Number by which a pass keys its photons.
type Passes = fn(u64) -> u64;

const SPHERE: &str = include_str!("../photons/sphere.toml");
const NADIR: &str = include_str!("../photons/nadir.toml");
/// Photons of a pass over the nadir.
const PHOTONS: u64 = 256;

fn scene(text: &str) -> Scene {
    file::parse(text, "scene", Path::new(""), &[]).expect("the scene is valid")
}

const HIT_POINT: HitPoint = HitPoint {
    point: DVec3::ZERO,
    normal: DVec3::Y,
    weight: Rgb::ONE,
    first_radius_squared: 1.0,
    least_radius_squared: 0.0,
    pixel: 0,
    object: 0,
    events: 0,
};

/// The estimate under an even density: flux in proportion to squared radius and to photons emitted.
fn even(estimate: Estimate, radius_squared: f64, emitted: f64) -> f64 {
    let gathered = Gathered {
        flux: Rgb::splat(radius_squared * emitted),
        bias_flux: Rgb::ZERO,
        photons: 1,
    };
    estimate(&HIT_POINT, &gathered, radius_squared, emitted).x
}

fn estimates(wrong: Estimate, shown: fn(Estimate) -> f64, hidden: fn(Estimate) -> f64) -> Finding {
    let holds = |f: Estimate| {
        let settings = [(1.0, 1000.0), (0.01, 1000.0), (4.0, 10.0), (1.0, 1.0)];
        let right = |&(r2, n): &(f64, f64)| (even(f, r2, n) * PI - 1.0).abs() < 1e-12;
        settings.iter().all(right)
    };
    compare(radiance as Estimate, wrong, shown, hidden, holds)
}

fn gain_of_area(decay: f64) -> f64 {
    let gathered = Gathered {
        flux: Rgb::ONE,
        bias_flux: Rgb::ZERO,
        photons: 1,
    };
    let at = |radius: f64| radiance(&HIT_POINT, &gathered, radius * radius, 1.0).x;
    at(decay) / at(1.0)
}

fn gain_of_length(decay: f64) -> f64 {
    1.0 / decay
}

/// Photons found fall with the area; each round's gain should make up for it.
fn after_rounds(gain: Gain, decay: f64, rounds: u32) -> f64 {
    (0..rounds).fold(1.0, |estimate, _| estimate * decay * decay * gain(decay))
}

fn by_gathered(statistics: Statistics, within: &[Arrival]) -> Statistics {
    let items: Vec<u32> = (0..within.len() as u32).collect();
    let arrivals: Arrivals = within.iter().copied().collect();
    let gathered = gather(
        &HIT_POINT,
        &items,
        &arrivals,
        None,
        Gathered::default(),
        |_| (1.0, None),
    );
    statistics.after(gathered.photons as f64, 0.7)
}

fn by_all_within(statistics: Statistics, within: &[Arrival]) -> Statistics {
    statistics.after(within.len() as f64, 0.7)
}

fn after_passes(shrink: Shrink, before: usize, behind: usize) -> f64 {
    let arrival = |normal| Arrival {
        flux: Rgb::ONE,
        normal,
        object: 0,
        events: 0,
    };
    let mut within = vec![arrival(DVec3::Y); before];
    within.extend(vec![arrival(DVec3::NEG_Y); behind]);
    let last = (0..20).fold(Statistics::default(), |s, _| shrink(s, &within));
    last.shrink
}

/// What each pass reads below a point light, with a disc as wide as the light is high.
fn readings(key: Passes, trial: &Trial, passes: u64) -> Vec<f64> {
    let scene = scene(NADIR);
    let settings = Settings::resolve(&RenderTable {
        integrator: Some(Integrator::Sppm),
        rule: Some(Rule::Constant),
        radius: Some(1.0),
        photons: Some(PHOTONS),
        seed: Some(trial.seed),
        ..RenderTable::default()
    });
    let mut mapper = PhotonMapper::new(&scene, &settings).expect("a scene for photons");
    let read = |pass| {
        let mut film = Film::new(scene.film);
        mapper.pass(key(pass), &mut film, &mut Phases::default());
        film.mean().x
    };
    (0..passes).map(read).collect()
}

/// Variance of (ρ/π) 4πI M/(π r² m) with M ~ Binomial(m, p), p = ½(1 − 1/√2); ρ = ½, I = π.
fn binomial_variance() -> f64 {
    let p = 0.5 * (1.0 - 0.5_f64.sqrt());
    4.0 * p * (1.0 - p) / PHOTONS as f64
}
