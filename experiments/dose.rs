//! How accurate must an intersector be?

mod method;
mod pair;

use crate::geometry::revolution::Solver;
use crate::geometry::shape::Shape;
use crate::lab::experiment::{Conclusion, Effort, Experiment, Outcome, Run};
use crate::lab::table::{Table, Value};
use crate::numeric::statistics::Moments;
use crate::numeric::work::Work;
use crate::render::path::PathTracer;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::file::load;
use method::{Family, Method};
use pair::{DEPTHS, Faults, Flip, Tracer};
use std::path::Path;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "dose",
    question: "How accurate must an intersector be: how many camera paths does a wrong answer change, and by how much the picture?",
    prediction: "",
    method: "",
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
    timed: false,
    plan,
    execute,
    conclude,
};

/// Size of the picture in pixels, and side of a block.
const FILM: (u32, u32) = (16, 12);
const REPLICATES: i64 = 8;

fn plan(_: Effort) -> Vec<Run> {
    let mut runs = Vec::new();
    for family in Family::ALL {
        for &parameter in family.parameters() {
            for replicate in 0..REPLICATES {
                runs.push(Run::new([
                    ("method", family.name().into()),
                    ("parameter", parameter.into()),
                    ("replicate", replicate.into()),
                ]));
            }
        }
    }
    runs
}

/// Passes over the picture: what a second or so of CPU time pays for, by the measured cost of a pair of paths in µs.
fn passes(family: Family, parameter: f64, _effort: Effort) -> u64 {
    let cost = match family {
        Family::Bernstein => 600.0,
        Family::Starts => 10.0 + 5.3 * parameter,
        Family::Tolerance => 160.0,
        Family::Offset => 10.0,
        Family::Flat => 10.0 + 0.08 * parameter,
    };
    let budget: f64 = std::env::var("BUD").map_or(1.0, |s| s.parse().unwrap());
    (budget * 1e6 / cost / 1536.0).round().max(1.0) as u64
}

/// What one class of paths gives.
#[derive(Clone, Copy, Default)]
struct Class {
    flips: u64,
    /// Sum of the differences of radiance, and of their squares.
    difference: f64,
    square: f64,
}

impl Class {
    fn add(&mut self, difference: f64) {
        self.flips += 1;
        self.difference += difference;
        self.square += difference * difference;
    }
}

struct Tally {
    faults: [Faults; DEPTHS],
    none: Class,
    light: Class,
    events: [Class; DEPTHS],
    truth: Moments,
    drift: f64,
}

fn scene(solver: Solver) -> anyhow::Result<(Scene, usize)> {
    let overrides = [
        ("film.width", FILM.0.to_string()),
        ("film.height", FILM.1.to_string()),
    ];
    let overrides = overrides.map(|(key, value)| (key.to_owned(), value));
    let mut scene = load(Path::new("scenes/cup.toml"), &overrides)?;
    scene.solver = solver;
    let cup = (scene.objects.iter())
        .position(|object| matches!(object.shape, Shape::Revolution(_)))
        .ok_or_else(|| anyhow::anyhow!("the scene has no surface of revolution"))?;
    Ok((scene, cup))
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let family = Family::named(&run.text("method")).ok_or_else(|| anyhow::anyhow!("no method"))?;
    let parameter = run.number("parameter");
    let solver = match family {
        Family::Bernstein => Solver::Exact,
        _ => Solver::Bernstein,
    };
    let (scene, cup) = scene(solver)?;
    let method = Method::new(family, parameter, &scene, cup);
    let settings = Settings {
        seed,
        ..Settings::resolve(&scene.render)
    };
    let other = PathTracer::new(&method.scene, &settings);
    let tracer = Tracer {
        truth: PathTracer::new(&scene, &settings),
        other: match method.offset {
            None => other,
            Some(offset) => other.leaving_at(offset),
        },
        scene: &scene,
        method: &method,
        cup,
    };
    let mut work = Work::default();
    let tally = measure(&tracer, passes(family, parameter, effort), &mut work);
    Ok(Outcome {
        rows: tally.rows(run),
        work,
    })
}

fn measure(tracer: &Tracer, passes: u64, work: &mut Work) -> Tally {
    let mut tally = Tally {
        faults: Default::default(),
        none: Class::default(),
        light: Class::default(),
        events: Default::default(),
        truth: Moments::default(),
        drift: 0.0,
    };
    for pass in 0..passes {
        for y in 0..FILM.1 {
            for x in 0..FILM.0 {
                let pair = tracer.trace([x, y], pass, &mut tally.faults, work);
                let difference = (pair.other - pair.truth).element_sum() / 3.0;
                tally.truth.add(pair.truth.element_sum() / 3.0);
                match pair.flip {
                    Flip::None => {
                        tally.none.add(difference);
                        let size = pair.truth.abs().max_element();
                        let change = (pair.other - pair.truth).abs().max_element();
                        if size > 0.0 {
                            tally.drift = tally.drift.max(change / size);
                        }
                    }
                    Flip::Light => tally.light.add(difference),
                    Flip::Events(depth) => tally.events[depth].add(difference),
                }
            }
        }
    }
    tally
}

impl Tally {
    fn rows(&self, run: &Run) -> Vec<Vec<Value>> {
        let n = self.truth.count() as f64;
        let row = |depth: &str, faults: &Faults, class: &Class, drift: f64| {
            let mut values: Vec<Value> = run.parameters.iter().map(|(_, v)| v.clone()).collect();
            let bias = class.difference / n;
            values.extend([
                depth.into(),
                self.truth.count().into(),
                faults.queries.into(),
                faults.miss.into(),
                faults.phantom.into(),
                faults.wrong.into(),
                class.flips.into(),
                self.truth.mean().into(),
                bias.into(),
                ((class.square / n - bias * bias) / n).sqrt().into(),
                drift.into(),
            ]);
            values
        };
        let nothing = Faults::default();
        let mut rows = vec![
            row("none", &nothing, &self.none, self.drift),
            row("light", &nothing, &self.light, 0.0),
        ];
        for (depth, (faults, class)) in self.faults.iter().zip(&self.events).enumerate() {
            rows.push(row(&depth.to_string(), faults, class, 0.0));
        }
        rows
    }
}

fn conclude(_table: &Table, _effort: Effort) -> Conclusion {
    Conclusion::default()
}
