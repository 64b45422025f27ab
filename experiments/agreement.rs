//! Do the path tracer and the photon mapper draw what an independent renderer draws?

use crate::image::metrics::blocks;
use crate::image::picture::Picture;
use crate::lab::claim::{Claim, Estimate, Subject};
use crate::lab::experiment::{Conclusion, Effort, Experiment, Outcome, Run, Table, Value};
use crate::lab::plot::{Axis, Plot, Scale, Series};
use crate::numeric::statistics::{Moments, student_quantile};
use crate::render::driver::render_unwatched;
use crate::render::settings::Settings;
use crate::scene::file::parse;
use serde::Deserialize;
use std::path::Path;
use std::time::Instant;

const NAME: &str = "agreement";

/// Block means by an independent renderer; see golden/reference/README.md.
const REFERENCE: &str = include_str!("../golden/reference/blocks.json");

/// Side of a block in pixels, and blocks per side.
const BLOCK: usize = 16;

/// Chance of a false alarm over all blocks of one picture.
const LEVEL: f64 = 1e-7;

/// A scene that the reference holds.
struct Subjected {
    name: &'static str,
    text: &'static str,
    /// Its letter in the reference.
    letter: &'static str,
    /// Known relative error of the reference's blocks: float32, the mesh.
    reference_error: f64,
}

const SCENES: [Subjected; 2] = [
    Subjected {
        name: "box",
        text: include_str!("../scenes/box.toml"),
        letter: "a",
        reference_error: 0.0005,
    },
    Subjected {
        name: "hourglass",
        text: include_str!("../scenes/hourglass.toml"),
        letter: "b",
        reference_error: 0.004,
    },
];

/// An integrator with its own known error.
struct Method {
    name: &'static str,
    replicates: i64,
    /// Bias of a block's mean, relative to it: nothing for path; for photon maps what the first radius leaves at corners and
    /// edges, where the kernel reaches past the surface.
    block_bias: f64,
    /// Bias of the picture's mean.
    image_bias: f64,
}

const METHODS: [Method; 2] = [
    Method {
        name: "path",
        replicates: 8,
        block_bias: 0.0,
        image_bias: 0.0,
    },
    Method {
        name: "ppm",
        replicates: 5,
        block_bias: 0.06,
        image_bias: 0.005,
    },
];

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: NAME,
    question: "Do path tracing and photon mapping draw what an independent renderer draws?",
    prediction: "Every 16 × 16-pixel block has the reference's mean, within noise and the reference's own known error (float32, a mesh in \
                 place of the profile); for photon maps also within the bias that the gather radius leaves at corners.",
    method: "Independent renders of the box and the hourglass at the reference's size; Student's interval over replicates, the reference's \
             standard error added, for each block mean. The reference is Mitsuba 3.9.1, path, 11392 and 23040 samples a pixel, at most 15 scattering events as here.",
    columns: &[
        "scene",
        "integrator",
        "replicate",
        "block_row",
        "block_column",
        "mean",
        "reference",
        "reference_se",
        "render_s",
    ],
    timed: false,
    plan,
    execute,
    conclude,
};

#[derive(Deserialize)]
struct Reference {
    image_mean: [f64; 3],
    image_mean_se: [f64; 3],
    mean: Vec<Vec<[f64; 3]>>,
    se: Vec<Vec<[f64; 3]>>,
}

/// Mean of the three channels; their noise is common (the same paths), so standard errors add up the same way.
fn grey(rgb: [f64; 3]) -> f64 {
    rgb.iter().sum::<f64>() / 3.0
}

fn reference(letter: &str) -> anyhow::Result<Reference> {
    let mut all: std::collections::HashMap<String, Reference> = serde_json::from_str(REFERENCE)?;
    all.remove(letter)
        .ok_or_else(|| anyhow::anyhow!("the reference has no scene {letter}"))
}

fn plan(_: Effort) -> Vec<Run> {
    let mut runs = Vec::new();
    for scene in &SCENES {
        for method in &METHODS {
            for replicate in 0..method.replicates {
                runs.push(Run::new([
                    ("scene", scene.name.into()),
                    ("integrator", method.name.into()),
                    ("replicate", replicate.into()),
                ]));
            }
        }
    }
    runs
}

/// Camera samples a pixel of `path`; passes of 100 000 photons of `ppm`.
fn budget(effort: Effort) -> (u32, u64) {
    match effort {
        Effort::Smoke => (4, 4),
        Effort::Standard => (64, 64),
        Effort::Full => (1024, 1024),
    }
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let (name, integrator) = (run.text("scene"), run.text("integrator"));
    let subject = SCENES
        .iter()
        .find(|scene| scene.name == name)
        .ok_or_else(|| anyhow::anyhow!("no scene {name}"))?;
    let (spp, passes) = budget(effort);
    let spp = if integrator == "path" { spp } else { 4 };
    let overrides = [
        ("render.integrator", format!("\"{integrator}\"")),
        ("render.spp", spp.to_string()),
        ("render.passes", passes.to_string()),
        ("render.photons", "100000".to_owned()),
        // The reference's own limit: without it the hourglass is 0.25 % brighter.
        ("render.max_depth", "15".to_owned()),
    ];
    let overrides = overrides.map(|(key, value)| (key.to_owned(), value));
    let scene = parse(subject.text, &name, Path::new("scenes"), &overrides)?;
    let settings = Settings {
        seed,
        threads: Some(1),
        ..Settings::resolve(&scene.render)
    };
    let start = Instant::now();
    let outcome = render_unwatched(&scene, &settings)?;
    let seconds = start.elapsed().as_secs_f64();
    let truth = reference(subject.letter)?;
    let picture = Picture::of_film(&outcome.film);
    let per_row = picture.width / BLOCK;
    let rows = blocks(&picture, BLOCK)
        .into_iter()
        .enumerate()
        .map(|(index, block)| {
            let (row, column) = (index / per_row, index % per_row);
            let mut values: Vec<Value> = run
                .parameters
                .iter()
                .map(|(_, value)| value.clone())
                .collect();
            values.extend([
                (row as i64).into(),
                (column as i64).into(),
                grey(block.mean).into(),
                grey(truth.mean[row][column]).into(),
                grey(truth.se[row][column]).into(),
                seconds.into(),
            ]);
            values
        });
    Ok(Outcome {
        rows: rows.collect(),
        work: outcome.work,
    })
}

/// One block of one scene by one method, over the replicates.
struct BlockResult {
    difference: f64,
    standard_error: f64,
    freedom: f64,
    reference: f64,
}

impl BlockResult {
    /// Whether the difference is more than noise at `level` and the stated relative error explain.
    fn differs(&self, level: f64, relative_error: f64) -> bool {
        let noise = student_quantile(1.0 - 0.5 * level, self.freedom) * self.standard_error;
        self.difference.abs() > noise + relative_error * self.reference
    }
}

fn block_results(part: &Table) -> Vec<BlockResult> {
    let per_side = 16;
    let count = part.rows.len() / (per_side * per_side);
    let (means, references, errors) = (
        part.numbers("mean"),
        part.numbers("reference"),
        part.numbers("reference_se"),
    );
    (0..per_side * per_side)
        .map(|block| {
            let replicates: Vec<f64> = (0..count)
                .map(|k| means[k * per_side * per_side + block])
                .collect();
            let moments = Moments::of(replicates);
            BlockResult {
                difference: moments.mean() - references[block],
                standard_error: libm::hypot(moments.standard_error(), errors[block]),
                freedom: moments.count() as f64 - 1.0,
                reference: references[block],
            }
        })
        .collect()
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let mut conclusion = Conclusion::default();
    let mut series = Vec::new();
    for scene in &SCENES {
        for method in &METHODS {
            let part = table
                .filter("scene", &scene.name.into())
                .filter("integrator", &method.name.into());
            let results = block_results(&part);
            conclusion
                .claims
                .push(mean_claim(scene, method, &part, effort));
            conclusion
                .claims
                .push(blocks_claim(scene, method, &results, effort));
            series.push(Series {
                name: format!("{}, {}", scene.name, method.name),
                points: results
                    .iter()
                    .map(|block| {
                        (
                            block.reference,
                            (100.0 * block.difference / block.reference).abs(),
                        )
                    })
                    .collect(),
                intervals: Vec::new(),
                predicted: false,
            });
        }
    }
    conclusion.plots.push(Plot {
        title: "Difference of block means from the reference".to_owned(),
        x: Axis {
            label: "radiance of the block (W/(m² sr))".to_owned(),
            scale: Scale::Log,
        },
        y: Axis {
            label: "relative difference (%)".to_owned(),
            scale: Scale::Log,
        },
        series,
    });
    conclusion
}

/// The mean of the picture.
fn mean_claim(scene: &Subjected, method: &Method, part: &Table, effort: Effort) -> Claim {
    let per_picture = 256;
    let means = part.numbers("mean");
    let moments = Moments::of(
        means
            .chunks(per_picture)
            .map(|picture| picture.iter().sum::<f64>() / 256.0),
    );
    let (truth, error) = reference(scene.letter).map_or((f64::NAN, f64::NAN), |truth| {
        (grey(truth.image_mean), grey(truth.image_mean_se))
    });
    let estimate = Estimate {
        value: moments.mean(),
        standard_error: libm::hypot(moments.standard_error(), error),
        freedom: moments.count() as f64 - 1.0,
        n: moments.count(),
    };
    let noise = if effort == Effort::Smoke { 0.02 } else { 0.002 };
    let margin = noise + method.image_bias + scene.reference_error;
    let subject = Subject {
        experiment: NAME,
        claim: &format!("{}_{}_mean", scene.name, method.name),
        statement: &format!(
            "{} gives the reference's mean of the {} within {:.2} %",
            method.name,
            scene.name,
            100.0 * margin
        ),
        decided_at: Effort::Smoke,
        effort,
    };
    Claim::equivalent(subject, estimate, truth, margin * truth)
}

/// Every block of the picture.
fn blocks_claim(
    scene: &Subjected,
    method: &Method,
    results: &[BlockResult],
    effort: Effort,
) -> Claim {
    let relative = scene.reference_error + method.block_bias;
    let level = LEVEL / results.len() as f64;
    let failures = results
        .iter()
        .filter(|block| block.differs(level, relative))
        .count() as u64;
    let subject = Subject {
        experiment: NAME,
        claim: &format!("{}_{}_blocks", scene.name, method.name),
        statement: &format!(
            "no 16 × 16 block of the {} by {} differs from the reference by more than noise and {:.2} %",
            scene.name,
            method.name,
            100.0 * relative
        ),
        decided_at: Effort::Smoke,
        effort,
    };
    Claim::exact(subject, failures, results.len() as u64)
}
