//! How accurate must an intersector be?

mod conclusion;
mod method;
mod pair;
mod pictures;
mod plots;

use crate::geometry::revolution::Solver;
use crate::geometry::shape::Shape;
use crate::lab::experiment::{Effort, Experiment, Outcome, Run, Timing, grid, values};
use crate::lab::rendering;
use crate::lab::table::Value;
use crate::numeric::rng::mix;
use crate::numeric::statistics::Moments;
use crate::numeric::work::Work;
use crate::render::path::PathTracer;
use crate::render::settings::Settings;
use crate::scene::{Rgb, Scene};
use method::{Family, Method};
use pair::{DEPTHS, Faults, Flip, Pair, Tracer};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "dose",
    question: "How accurate must an intersector be: how many camera paths does it send elsewhere, and how far off is the picture?",
    prediction: "A path is lost with its first fault: flips per path = queries per path × faults per query, slope 1. A lost path carries \
                 other light, not much less, so the bias is smaller than the share of flips. Bernstein isolation makes no fault and flips no short path. Errors \
                 too small to be faults (an offset ε, a tolerance ε, n straight pieces) were expected to flip paths in proportion: ~ ε, \
                 and ~ 1/n by their normals. Found instead: ~ √ε for offset and tolerance above 1e-6, slower still below, and ~ n^-.4: paths that are long inside the \
                 glass amplify any error, so that the share of flips falls much more slowly than the error. Only flips before the first \
                 specular event fall as 1/n or faster.",
    method: "Scene cup, path tracer, 8 × 6 pixels. Every camera path is traced twice with the same random numbers, which are keyed by \
             pixel, pass and seed and drawn in the path's own order, so that a flip disturbs no other path: by the true intersector (for \
             bernstein: exact arithmetic; for all others: bernstein) and by the method. A flip is the first step whose object, piece or \
             event differs; its depth is the number of specular events before it; `light` counts paths with the same steps of which one \
             sees a lamp that the other does not; `none` is all other paths, with the greatest relative change of radiance, `drift`. \
             Queries are the rays of the true path that reach the cup's bounding cylinder (shadow rays are not judged); the method's \
             answer to the same query is a fault if it is a miss, a phantom, or another crossing (other piece, other side, or .1 away). \
             `bias` is the sum of radiance differences of the row's paths over all paths, so rows add up, with its standard error \
             from the paths; intervals of claims are over replicates. Newton's rays start four accepted residuals off the surface \
             (experiment eps). Rows of `picture of METHOD` are pixels of a larger picture, numbered by `replicate` row by row. `flat` is judged on rays that do not start at the cup.",
    columns: &[
        "method",
        "parameter",
        "replicate",
        "depth",
        "paths",
        "queries",
        "miss",
        "phantom",
        "wrong",
        "flips",
        "truth",
        "bias",
        "se",
        "drift",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [4.5, 180.0, 3500.0],
    plan,
    execute,
    conclude: conclusion::conclude,
};

/// Size of the picture in pixels: the mean over it is what counts.
const FILM: (u32, u32) = (8, 6);
/// Each with random numbers of its own.
const REPLICATES: u64 = 8;

fn plan(_: Effort) -> Vec<Run> {
    let runs = Family::ALL.into_iter().flat_map(|family| {
        grid([
            ("method", values([family.name()])),
            ("parameter", values(family.parameters().iter().copied())),
        ])
    });
    runs.chain(pictures::plan()).collect()
}

/// Passes over the picture: what the method's share of CPU seconds pays for, by the measured cost of a pair of paths in µs.
fn passes(family: Family, parameter: f64, effort: Effort) -> u64 {
    let (cost, seconds) = match family {
        Family::Bernstein => (600.0, [0.2, 12.0, 240.0]),
        Family::Starts => (10.0 + 5.3 * parameter, [0.15, 12.0, 240.0]),
        Family::Tolerance => (170.0, [0.1, 4.0, 80.0]),
        // Starts on the surface are what f64 cannot decide: exact arithmetic answers.
        Family::Offset if parameter < 1e-13 => (600.0, [0.15, 3.0, 60.0]),
        Family::Offset => (10.0, [0.05, 3.0, 60.0]),
        Family::Flat => (10.0 + 0.08 * parameter, [0.06, 4.0, 80.0]),
    };
    let paths = effort.of(seconds) * 1e6 / cost;
    let paths_a_pass = f64::from(FILM.0 * FILM.1) * REPLICATES as f64;
    (paths / paths_a_pass).ceil() as u64
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    if let Some(family) = pictures::shown(&run.text("method")) {
        return pictures::execute(run, family, effort, seed);
    }
    let family = Family::named(&run.text("method"))
        .ok_or_else(|| anyhow::anyhow!("unknown run {}", run.name()))?;
    let parameter = run.number("parameter");
    let bench = Bench::new(family, parameter, FILM)?;
    let passes = passes(family, parameter, effort);
    let mut outcome = Outcome::default();
    for replicate in 0..REPLICATES {
        let seed = mix(&[seed, replicate]);
        let mut tally = Tally::default();
        let mut take = |pair| tally.add(&pair);
        tally.faults = bench.trace(seed, passes, &mut outcome.work, &mut take);
        outcome.rows.extend(tally.rows(run, replicate));
    }
    Ok(outcome)
}

/// The scene with the true intersector, and the method held against it.
struct Bench {
    scene: Scene,
    method: Method,
    /// Place of the surface of revolution among the objects.
    cup: usize,
}

impl Bench {
    fn new(family: Family, parameter: f64, film: (u32, u32)) -> anyhow::Result<Self> {
        let solver = match family {
            Family::Bernstein => Solver::Exact,
            _ => Solver::Bernstein,
        };
        let (scene, cup) = scene(solver, film)?;
        Ok(Self {
            method: Method::new(family, parameter, &scene, cup),
            scene,
            cup,
        })
    }

    /// Traces every pixel's path of these passes twice; `take` gets the pairs, pixel after pixel and pass after pass.
    fn trace(
        &self,
        seed: u64,
        passes: u64,
        work: &mut Work,
        take: &mut impl FnMut(Pair),
    ) -> [Faults; DEPTHS] {
        let settings = Settings {
            seed,
            ..Settings::resolve(&self.scene.render)
        };
        let other = PathTracer::new(&self.method.scene, &settings);
        let tracer = Tracer {
            truth: PathTracer::new(&self.scene, &settings),
            other: match self.method.offset {
                None => other,
                Some(offset) => other.leaving_at(offset),
            },
            scene: &self.scene,
            method: &self.method,
            cup: self.cup,
        };
        let mut faults = Default::default();
        for pass in 0..passes {
            for y in 0..self.scene.film.height {
                for x in 0..self.scene.film.width {
                    take(tracer.trace([x, y], pass, &mut faults, work));
                }
            }
        }
        faults
    }
}

/// The scene, its revolution surface to be asked by `solver`, and the place of that among the objects.
fn scene(solver: Solver, (width, height): (u32, u32)) -> anyhow::Result<(Scene, usize)> {
    let size = [
        ("film.width", i64::from(width).into()),
        ("film.height", i64::from(height).into()),
    ];
    let scene = rendering::scene("cup", &size)?;
    let cup = (scene.objects.iter())
        .position(|object| matches!(object.shape, Shape::Revolution(_)))
        .ok_or_else(|| anyhow::anyhow!("the scene has no surface of revolution"))?;
    Ok((Scene { solver, ..scene }, cup))
}

fn grey(rgb: Rgb) -> f64 {
    rgb.element_sum() / 3.0
}

/// Paths that went apart in the same way.
#[derive(Clone, Copy, Default)]
struct Class {
    paths: u64,
    /// Sum of the differences of radiance, and of their squares.
    difference: f64,
    square: f64,
}

/// What the pairs of a run give.
#[derive(Default)]
struct Tally {
    faults: [Faults; DEPTHS],
    none: Class,
    light: Class,
    events: [Class; DEPTHS],
    truth: Moments,
    drift: f64,
}

impl Tally {
    fn add(&mut self, pair: &Pair) {
        self.truth.add(grey(pair.truth));
        let class = match pair.flip {
            Flip::None => {
                let size = pair.truth.abs().max_element();
                let change = (pair.other - pair.truth).abs().max_element();
                if size > 0.0 {
                    self.drift = self.drift.max(change / size);
                }
                &mut self.none
            }
            Flip::Light => &mut self.light,
            Flip::Events(depth) => &mut self.events[depth],
        };
        let difference = grey(pair.other - pair.truth);
        class.paths += 1;
        class.difference += difference;
        class.square += difference * difference;
    }

    fn rows(&self, run: &Run, replicate: u64) -> Vec<Vec<Value>> {
        let nothing = Faults::default();
        let depths = (0..).zip(self.faults.iter().zip(&self.events));
        let depths = depths.map(|(depth, (faults, class))| {
            let more = if depth + 1 == DEPTHS { "+" } else { "" };
            self.row(
                run,
                replicate,
                &format!("{depth}{more}"),
                (faults, class),
                0.0,
            )
        });
        let others = [
            self.row(run, replicate, "light", (&nothing, &self.light), 0.0),
            self.row(run, replicate, "none", (&nothing, &self.none), self.drift),
        ];
        depths.chain(others).collect()
    }

    fn row(
        &self,
        run: &Run,
        replicate: u64,
        depth: &str,
        (faults, class): (&Faults, &Class),
        drift: f64,
    ) -> Vec<Value> {
        let n = self.truth.count() as f64;
        let bias = class.difference / n;
        let flips = if depth == "none" { 0 } else { class.paths };
        run.row([
            replicate.into(),
            depth.into(),
            self.truth.count().into(),
            faults.queries.into(),
            faults.miss.into(),
            faults.phantom.into(),
            faults.wrong.into(),
            flips.into(),
            self.truth.mean().into(),
            bias.into(),
            ((class.square / n - bias * bias).max(0.0) / n)
                .sqrt()
                .into(),
            drift.into(),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(family: Family, parameter: f64, seed: u64) -> Vec<Pair> {
        let mut pairs = Vec::new();
        let mut take = |pair| pairs.push(pair);
        let bench = Bench::new(family, parameter, (12, 9)).unwrap();
        bench.trace(seed, 2, &mut Work::default(), &mut take);
        pairs
    }

    /// With one start a fifth of the paths go elsewhere; those that do not keep their radiance, which a number shifted by another
    /// path's flip would change.
    #[test]
    fn a_flip_disturbs_no_other_path() {
        let pairs = pairs(Family::Starts, 1.0, 3);
        let (kept, lost): (Vec<&Pair>, _) = pairs.iter().partition(|pair| pair.flip == Flip::None);
        assert!(lost.len() > 20 && kept.len() > 100, "{}", lost.len());
        let same = |pair: &&&Pair| {
            let size = pair.truth.abs().max_element();
            (pair.other - pair.truth).abs().max_element() <= 1e-6 * size
        };
        // Long paths amplify even the solver's own error: one in fifty may.
        let steady = kept.iter().filter(same).count();
        assert!(steady * 50 >= kept.len() * 49, "{steady} of {}", kept.len());
    }

    #[test]
    fn an_intersector_held_against_itself_flips_nothing() {
        let pairs = pairs(Family::Offset, 1e-12, 4);
        assert!(pairs.iter().all(|pair| pair.flip == Flip::None));
    }
}
