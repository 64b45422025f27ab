//! Do the path tracer and the photon mapper draw what an independent renderer draws?

use crate::image::metrics::blocks;
use crate::image::picture::Picture;
use crate::lab::claim::{Claim, Estimate};
use crate::lab::contrast::Contrast;
use crate::lab::experiment::{Conclusion, Effort, Experiment, Outcome, Run, Table, grid, values};
use crate::lab::plot::{Axis, Plot, Series};
use crate::lab::rendering::render;
use crate::numeric::statistics::{Moments, student_quantile};
use serde::Deserialize;

/// Block means by an independent renderer; see golden/reference/README.md.
const REFERENCE: &str = include_str!("../golden/reference/blocks.json");

/// Blocks per side of a picture.
const BLOCKS: usize = 16;
/// First radius of the methods whose pictures are smaller than the reference: about three of the reference's pixels.
const RADIUS: f64 = 0.035;

/// Chance of a false alarm over all blocks of one picture.
const LEVEL: f64 = 1e-7;

/// A scene that the reference holds.
struct Subjected {
    name: &'static str,
    /// Its letter in the reference.
    letter: &'static str,
    /// Known relative error of the reference's blocks: float32, the mesh.
    reference_error: f64,
}

const SCENES: [Subjected; 2] = [
    Subjected {
        name: "box",
        letter: "a",
        reference_error: 0.0005,
    },
    Subjected {
        name: "hourglass",
        letter: "b",
        reference_error: 0.004,
    },
];

/// An integrator with its own known error.
struct Method {
    name: &'static str,
    replicates: i64,
    /// Side of the picture in pixels: a block of the reference is a sixteenth of it, whatever it is.
    side: u32,
    /// Photons of a pass, and passes for each of the budget.
    photons: u32,
    passes: u32,
    /// Bias of a block's mean, relative to it: nothing for path; for photon maps what the first radius leaves at corners and
    /// edges, where the kernel reaches past the surface.
    block_bias: f64,
    /// Bias of the picture's mean.
    image_bias: f64,
}

const METHODS: [Method; 4] = [
    Method {
        name: "path",
        replicates: 8,
        side: 256,
        photons: 0,
        passes: 1,
        block_bias: 0.0,
        image_bias: 0.0,
    },
    Method {
        name: "ppm",
        replicates: 5,
        side: 256,
        photons: 100_000,
        passes: 1,
        block_bias: 0.06,
        image_bias: 0.005,
    },
    Method {
        name: "sppm",
        replicates: 5,
        side: 64,
        photons: 20_000,
        passes: 3,
        block_bias: 0.06,
        image_bias: 0.005,
    },
    Method {
        name: "pppm",
        replicates: 5,
        side: 64,
        photons: 20_000,
        passes: 3,
        block_bias: 0.06,
        image_bias: 0.005,
    },
];

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "agreement",
    question: "Do path tracing and photon mapping draw what an independent renderer draws?",
    prediction: "Every 16 × 16-pixel block has the reference's mean, within noise and the reference's own known error (float32, a mesh in \
                 place of the profile); for photon maps also within the bias that the gather radius leaves at corners.",
    method: "Independent renders of the box and the hourglass, at the reference's size or a quarter of it; Student's interval over replicates, the reference's \
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
    cpu_seconds: [33.0, 520.0, 8000.0],
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

/// Mean radiance of the blocks of the reference of this letter, row by row from the top.
pub(super) fn block_means(letter: &str) -> anyhow::Result<Vec<f64>> {
    let blocks = reference(letter)?.mean;
    Ok(blocks.into_iter().flatten().map(grey).collect())
}

fn plan(_: Effort) -> Vec<Run> {
    let of = |scene: &Subjected, method: &Method| {
        grid([
            ("scene", values([scene.name])),
            ("integrator", values([method.name])),
            ("replicate", values(0..method.replicates)),
        ])
    };
    let scenes = SCENES.iter();
    scenes
        .flat_map(|scene| METHODS.iter().flat_map(move |method| of(scene, method)))
        .collect()
}

/// Camera samples a pixel of `path`; of the others, in units of [`Method::passes`].
fn budget(effort: Effort) -> u32 {
    effort.of([4, 64, 1024])
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let (name, integrator) = (run.text("scene"), run.text("integrator"));
    let subject = SCENES.iter().find(|scene| scene.name == name);
    let subject = subject.ok_or_else(|| anyhow::anyhow!("no scene {name}"))?;
    let method = METHODS.iter().find(|method| method.name == integrator);
    let method = method.ok_or_else(|| anyhow::anyhow!("no integrator {integrator}"))?;
    let budget = budget(effort);
    let spp = if integrator == "path" { budget } else { 4 };
    let mut sets = vec![
        ("film.width", method.side.into()),
        ("film.height", method.side.into()),
        ("render.integrator", integrator.into()),
        ("render.spp", spp.into()),
        ("render.passes", (budget * method.passes).into()),
        ("render.photons", method.photons.into()),
        // The reference's own limit: without it the hourglass is 0.25 % brighter.
        ("render.max_depth", 15.into()),
    ];
    if method.side < 256 {
        sets.push(("render.radius", RADIUS.into()));
    }
    let rendered = render(&name, &sets, seed)?;
    let truth = reference(subject.letter)?;
    let rows = blocks(&rendered.picture(), method.side as usize / BLOCKS)
        .into_iter()
        .enumerate()
        .map(|(index, block)| {
            let (row, column) = (index / BLOCKS, index % BLOCKS);
            let numbers = [
                grey(block.mean),
                grey(truth.mean[row][column]),
                grey(truth.se[row][column]),
                rendered.seconds,
            ];
            run.row([values([row, column]), values(numbers)].concat())
        });
    Ok(Outcome {
        rows: rows.collect(),
        work: rendered.work,
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
    let (means, references, errors) = (
        part.numbers("mean"),
        part.numbers("reference"),
        part.numbers("reference_se"),
    );
    let result = |block: usize| {
        let replicates = means.chunks(BLOCKS * BLOCKS).map(|picture| picture[block]);
        let moments = Moments::of(replicates);
        BlockResult {
            difference: moments.mean() - references[block],
            standard_error: libm::hypot(moments.standard_error(), errors[block]),
            freedom: moments.count() as f64 - 1.0,
            reference: references[block],
        }
    };
    (0..BLOCKS * BLOCKS).map(result).collect()
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
            conclusion.claims.extend([
                mean_claim(scene, method, &part, effort),
                blocks_claim(scene, method, &results, effort),
            ]);
            conclusion.pictures.push(contrast(scene, method, &results));
            let percent = |block: &BlockResult| 100.0 * block.difference / block.reference;
            series.push(Series::scattered(
                format!("{}, {}", scene.name, method.name),
                results
                    .iter()
                    .map(|block| (block.reference, percent(block).abs())),
            ));
        }
    }
    conclusion.plots.push(Plot::new(
        "Difference of block means from the reference",
        Axis::log("radiance of the block (W/(m² sr))"),
        Axis::log("relative difference (%)"),
        series,
    ));
    conclusion
}

/// The blocks as pixels.
fn contrast(scene: &Subjected, method: &Method, results: &[BlockResult]) -> Contrast {
    let picture = |value: fn(&BlockResult) -> f64| Picture {
        width: BLOCKS,
        height: BLOCKS,
        rgb: results
            .iter()
            .map(|block| [value(block) as f32; 3])
            .collect(),
        ..Picture::default()
    };
    Contrast {
        caption: format!("Mean radiance of the blocks of the {}", scene.name),
        a: (
            format!("photolathe, {}", method.name),
            picture(|block| block.reference + block.difference),
        ),
        b: ("the reference".to_owned(), picture(|block| block.reference)),
        commands: Vec::new(),
    }
}

/// The mean of the picture.
fn mean_claim(scene: &Subjected, method: &Method, part: &Table, effort: Effort) -> Claim {
    let per_picture = (BLOCKS * BLOCKS) as f64;
    let means = part.numbers("mean");
    let pictures = means.chunks(BLOCKS * BLOCKS);
    let moments = Moments::of(pictures.map(|picture| picture.iter().sum::<f64>() / per_picture));
    let (truth, error) = reference(scene.letter).map_or((f64::NAN, f64::NAN), |truth| {
        (grey(truth.image_mean), grey(truth.image_mean_se))
    });
    let ours = Estimate::of(&moments);
    let estimate = Estimate {
        standard_error: libm::hypot(ours.standard_error, error),
        ..ours
    };
    let noise = if effort == Effort::Smoke { 0.02 } else { 0.002 };
    let margin = noise + method.image_bias + scene.reference_error;
    let name = format!("{}_{}_mean", scene.name, method.name);
    let statement = format!(
        "{} gives the reference's mean of the {} within {:.2} %",
        method.name,
        scene.name,
        100.0 * margin
    );
    let subject = EXPERIMENT.subject(&name, &statement, Effort::Smoke, effort);
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
    let name = format!("{}_{}_blocks", scene.name, method.name);
    let statement = format!(
        "no 16 × 16 block of the {} by {} differs from the reference by more than noise and {:.2} %",
        scene.name,
        method.name,
        100.0 * relative
    );
    let subject = EXPERIMENT.subject(&name, &statement, Effort::Smoke, effort);
    Claim::exact(subject, failures, results.len() as u64)
}
