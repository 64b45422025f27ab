//! Claims, plots and maps of `agreement`.

use super::{BLOCKS, EXPERIMENT, METHODS, Method, PATH, SCENES, Subjected, grey, reference};
use crate::image::picture::Picture;
use crate::lab::claim::{Claim, Comparison, Estimate};
use crate::lab::contrast::Contrast;
use crate::lab::experiment::{Conclusion, Effort, Table};
use crate::lab::plot::{Axis, Plot, Series};
use crate::numeric::statistics::Moments;

/// One block of one scene by one method, over the replicates.
struct BlockResult {
    difference: f64,
    standard_error: f64,
    freedom: f64,
    reference: f64,
    /// What differences are relative to: the block's mean or, where that is less, the picture's.
    unit: f64,
}

impl BlockResult {
    /// Welch's test (Welch 1947, Satterthwaite's degrees of freedom) of replicates against a reference whose standard error is
    /// known. `least` is what our standard error is at least, known too.
    fn of(replicates: &Moments, reference: f64, error: f64, least: f64, picture: f64) -> Self {
        let own = replicates.standard_error();
        let standard_error = libm::hypot(own.max(least), error);
        let share = own / standard_error;
        let freedom = (replicates.count() as f64 - 1.0) / share.powi(4);
        Self {
            difference: replicates.mean() - reference,
            standard_error,
            freedom: if own > least { freedom } else { f64::INFINITY },
            reference,
            unit: reference.max(picture),
        }
    }

    /// The relative difference, of which this share of the block's mean is known.
    fn comparison(&self, relative_error: f64) -> Comparison {
        Comparison {
            difference: Estimate {
                value: self.difference / self.unit,
                standard_error: self.standard_error / self.unit,
                freedom: self.freedom,
                n: 1,
            },
            allowed: relative_error * self.reference / self.unit,
        }
    }
}

/// Our standard errors are at least this many times the reference's: of `path` as many as its samples are fewer. Where light comes by
/// rare paths (the small lamp through the hourglass), replicates without one underestimate their own; the reference has met them.
fn least_error(scene: &Subjected, method: &Method, effort: Effort) -> f64 {
    if method.name != PATH.name {
        return 0.0;
    }
    let samples = f64::from(effort.of(scene.path_samples)) * method.replicates as f64;
    reference(scene.letter).map_or(f64::NAN, |truth| (truth.spp / samples).sqrt())
}

fn block_results(part: &Table, least: f64) -> Vec<BlockResult> {
    let columns = ["mean", "reference", "reference_se"];
    let [means, references, errors] = columns.map(|name| part.numbers(name));
    let picture = references.iter().take(BLOCKS * BLOCKS).sum::<f64>() / (BLOCKS * BLOCKS) as f64;
    let result = |block: usize| {
        let replicates = means.chunks(BLOCKS * BLOCKS).map(|picture| picture[block]);
        let (truth, error) = (references[block], errors[block]);
        BlockResult::of(
            &Moments::of(replicates),
            truth,
            error,
            least * error,
            picture,
        )
    };
    (0..BLOCKS * BLOCKS).map(result).collect()
}

pub(super) fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let mut conclusion = Conclusion::default();
    let mut series = Vec::new();
    let mut matrix = METHODS.map(|method| Series::scattered(method.name, []));
    for (row, scene) in (1..).zip(&SCENES) {
        for (column, method) in METHODS.iter().enumerate() {
            let part = table
                .filter("scene", &scene.name.into())
                .filter("integrator", &method.name.into());
            let results = block_results(&part, least_error(scene, method, effort));
            let mean = mean_claim(scene, method, &part, effort);
            // Side by side, so that neither hides the other.
            let at = f64::from(row) + 0.1 * column as f64;
            matrix[column].points.push((at, 100.0 * mean.measured));
            let interval = (100.0 * mean.ci_low, 100.0 * mean.ci_high);
            matrix[column].intervals.push(interval);
            let blocks = blocks_claim(scene, method, &results, effort);
            conclusion.claims.extend([mean, blocks]);
            if method.name == PATH.name {
                let claim = equivalence_claim(scene, &results, effort);
                conclusion.claims.push(claim);
            }
            conclusion.pictures.push(contrast(scene, method, &results));
            let percent = |block: &BlockResult| 100.0 * (block.difference / block.unit).abs();
            series.push(Series::scattered(
                format!("{}, {}", scene.name, method.name),
                results
                    .iter()
                    .map(|block| (block.reference, percent(block))),
            ));
        }
    }
    conclusion.plots = vec![
        Plot::new(
            "Difference of the picture's mean from the reference (bars: 95 %)",
            Axis::linear("scene: 1 box, 2 hourglass"),
            Axis::linear("relative difference (%)"),
            matrix,
        ),
        Plot::new(
            "Difference of block means from the reference",
            Axis::log("radiance of the block (W/(m² sr))"),
            Axis::log("relative difference (%)"),
            series,
        ),
    ];
    conclusion
}

/// The blocks as pixels, and the map of their difference.
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

/// The mean of the picture, relative to the reference's.
fn mean_claim(scene: &Subjected, method: &Method, part: &Table, effort: Effort) -> Claim {
    let per_picture = (BLOCKS * BLOCKS) as f64;
    let means = part.numbers("mean");
    let pictures = means.chunks(BLOCKS * BLOCKS);
    let (truth, error) = reference(scene.letter).map_or((f64::NAN, f64::NAN), |truth| {
        (grey(truth.image_mean), grey(truth.image_mean_se))
    });
    let relative = |picture: &[f64]| picture.iter().sum::<f64>() / per_picture / truth - 1.0;
    let ours = Estimate::of(&Moments::of(pictures.map(relative)));
    let estimate = Estimate {
        standard_error: libm::hypot(ours.standard_error, error / truth),
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
    Claim::equivalent(subject, estimate, 0.0, margin)
}

/// No block of the picture differs.
fn blocks_claim(
    scene: &Subjected,
    method: &Method,
    results: &[BlockResult],
    effort: Effort,
) -> Claim {
    let relative = scene.reference_error + method.block_bias;
    let comparisons: Vec<Comparison> = results
        .iter()
        .map(|block| block.comparison(relative))
        .collect();
    let name = format!("{}_{}_blocks", scene.name, method.name);
    let statement = format!(
        "no 16 × 16 block of the {} by {} differs from the reference by more than noise and {:.2} % (shown: the most suspect)",
        scene.name,
        method.name,
        100.0 * relative
    );
    let subject = EXPERIMENT.subject(&name, &statement, Effort::Smoke, effort);
    Claim::family(subject, &comparisons, effort.of(method.needed))
}

/// Every block of `path` is the reference's within a margin. Proving the worst proves all: each test has the level of the whole
/// (an intersection of unions, Berger 1982).
fn equivalence_claim(scene: &Subjected, results: &[BlockResult], effort: Effort) -> Claim {
    let margin = scene.block_margin;
    let differences = results.iter().map(|block| block.comparison(0.0).difference);
    let worst = differences.max_by(|a, b| a.proven_bound().total_cmp(&b.proven_bound()));
    let worst = worst.unwrap_or(Estimate::known(f64::NAN, f64::NAN, 0));
    let name = format!("{}_path_blocks_equivalent", scene.name);
    let statement = format!(
        "every 16 × 16 block of the {} by path is the reference's within {:.0} % (shown: the worst)",
        scene.name,
        100.0 * margin
    );
    let subject = EXPERIMENT.subject(&name, &statement, Effort::Standard, effort);
    let n = results.len() as u64;
    Claim::equivalent(subject, Estimate { n, ..worst }, 0.0, margin)
}
