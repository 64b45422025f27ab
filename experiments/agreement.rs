//! Do the path tracer and the photon mapper draw what an independent renderer draws?

mod conclusion;

use crate::image::metrics::blocks;
use crate::lab::experiment::{Effort, Experiment, Outcome, Run, Timing, grid, values};
use crate::lab::rendering::render;
use serde::Deserialize;

/// Block means by an independent renderer; see golden/reference/README.md.
const REFERENCE: &str = include_str!("../golden/reference/blocks.json");

/// Blocks per side of a picture.
const BLOCKS: usize = 16;
/// Side in pixels of the pictures of photon maps, whose cost is not that of pixels: a block is a sixteenth of it.
const SMALL: u32 = 64;
/// Their first radius: about three of the reference's pixels.
const RADIUS: f64 = 0.035;
/// Photons of a pass.
const PHOTONS: u32 = 15_000;

/// A scene that the reference holds.
struct Subjected {
    name: &'static str,
    /// Its letter in the reference.
    letter: &'static str,
    /// Known relative error of the reference's blocks: float32 and, in the hourglass, the mesh (golden/reference/README.md).
    reference_error: f64,
    /// Camera samples a pixel of a replicate of `path` at each effort.
    path_samples: [u32; 3],
    /// Those of `ppm`: hit points that stay need many where glass parts them.
    ppm_samples: [u32; 3],
    /// What every block of `path` is proved to agree within at standard effort: its noise and the reference's allow no less.
    block_margin: f64,
}

const SCENES: [Subjected; 2] = [
    Subjected {
        name: "box",
        letter: "a",
        reference_error: 0.0002,
        path_samples: [1, 10, 320],
        ppm_samples: [16, 16, 64],
        block_margin: 0.03,
    },
    Subjected {
        name: "hourglass",
        letter: "b",
        reference_error: 0.002,
        path_samples: [1, 20, 320],
        ppm_samples: [16, 64, 256],
        block_margin: 0.2,
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
    /// What the coarsest block must be able to show at each effort, relative: few paths and photons come by the mirror and through glass.
    needed: [f64; 3],
}

const fn photon_map(name: &'static str) -> Method {
    Method {
        name,
        replicates: 16,
        block_bias: 0.06,
        image_bias: 0.005,
        needed: [6.0, 2.0, 1.0],
    }
}

const PATH: Method = Method {
    name: "path",
    // Enough for Student's law to be near the normal one at the level of one block of 256.
    replicates: 32,
    block_bias: 0.0,
    image_bias: 0.0,
    needed: [2.0, 0.5, 0.2],
};

const METHODS: [Method; 4] = [
    PATH,
    photon_map("ppm"),
    photon_map("sppm"),
    photon_map("pppm"),
];

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "agreement",
    question: "Do path tracing and photon mapping draw what an independent renderer draws?",
    prediction: "The picture and each of its 256 blocks have the reference's mean, within noise and the reference's own known error (.02 % of a block in \
                 the box: float32; .2 % in the hourglass: a mesh in place of the profile); for photon maps also within the bias that the \
                 gather radius leaves at corners (6 % of a block, .5 % of the picture).",
    method: "Independent renders of the box and the hourglass, by path at the reference's size, by photon maps at a quarter of it. For each block of \
             16 × 16 of the reference's pixels Welch's t over replicates against the reference and its standard error, the known error \
             taken off the difference; over the 256 blocks Holm's correction. Differences are relative: to the block's mean or, where that is less, to \
             the picture's. Standard errors of path are taken as no less than the reference's at as many samples. For path also: two one-sided tests of every \
             block (standard effort). Matrix of integrators and scenes: difference (measured), detectable effect, verdict. \
             The reference is Mitsuba 3.9.1, path, 11392 and 23040 samples a pixel, at most 15 scattering events as here.",
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
    timing: Timing::Untimed,
    cpu_seconds: [30.0, 355.0, 8000.0],
    plan,
    execute,
    conclude: conclusion::conclude,
};

#[derive(Deserialize)]
struct Reference {
    /// Samples a pixel.
    spp: f64,
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

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let (name, integrator) = (run.text("scene"), run.text("integrator"));
    let subject = SCENES.iter().find(|scene| scene.name == name);
    let subject = subject.ok_or_else(|| anyhow::anyhow!("no scene {name}"))?;
    let (side, spp, passes) = match integrator.as_str() {
        "path" => (256, effort.of(subject.path_samples), 0),
        // The noise of hit points that stay outweighs that of the photons.
        "ppm" => (
            SMALL,
            effort.of(subject.ppm_samples),
            effort.of([8, 48, 768]),
        ),
        _ => (SMALL, 4, effort.of([8, 64, 2048])),
    };
    let mut sets = vec![
        ("film.width", side.into()),
        ("film.height", side.into()),
        ("render.integrator", integrator.as_str().into()),
        ("render.spp", spp.into()),
        // The reference's own limit: without it the hourglass is 0.25 % brighter.
        ("render.max_depth", 15.into()),
    ];
    if integrator != "path" {
        sets.extend([
            ("render.passes", passes.into()),
            ("render.photons", PHOTONS.into()),
            ("render.radius", RADIUS.into()),
        ]);
    }
    let rendered = render(&name, &sets, seed)?;
    let truth = reference(subject.letter)?;
    let rows = blocks(&rendered.picture(), side as usize / BLOCKS)
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
