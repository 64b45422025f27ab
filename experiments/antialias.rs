//! Which antialiasing comes nearest to the truth for its rays, and what do hashes, thresholds and patterns miss?

mod closed;
mod conclusion;
mod povray;
mod rivalry;
mod truth;

use crate::lab::experiment::{
    Conclusion, Effort, Experiment, Outcome, Run, Table, Timing, Value, grid, values,
};
use crate::lab::rendering::on_one_thread;
use crate::numeric::clock::ThreadClock;
use crate::numeric::work::Work;
use crate::render::film::Film;
use crate::render::settings::Settings;
use crate::render::whitted::Whitted;
use crate::scene::options::{Antialias, Hash, Integrator, RenderTable, Resampling};
use crate::scene::{Scene, file};
use clap::ValueEnum;
use serde::Deserialize;
use std::path::Path;
use truth::{Edges, Truth};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "antialias",
    question: "Which antialiasing has the least error for its rays, and which edges does it miss?",
    prediction: "The course project's hash finds no edge of matte things; a hash of all hits finds silhouettes and reflections, with \
                 lights shadows too, with texels everything. At equal rays the full hash has a lower error than uniform supersampling, \
                 and than thresholds of contrast and variance (refuted for contrast, see the claims); with a threshold of contrast of its own, than \
                 all of them. Closed forms: a straight edge costs RMS 1/(n √12) with n × n samples, \
                 a disc of radius ρ pixels is found with probability πρ².",
    method: "Still lives with one point light and no lamp of extent, so that chance has next to no part. The truth of a pixel is its \
             mean over a grid of n × n (16 at smoke, 32 at standard, 64 at full effort); its edges are what 8 × 8 fingerprints in it disagree about, \
             each pixel put down to the first of silhouette, reflection, shadow, texture. Rays are all rays: camera, scattered, shadow, \
             and those that the hash itself asks for. A recall is the share of such pixels that are resampled, precision the share of \
             resampled pixels that hold an edge. Contrast is Whitted's (1980), as method 1 of POV-Ray; POV-Ray itself runs on the same \
             scene where it is installed, from standard effort on, against its own picture of 81 samples a pixel.",
    columns: &[
        "method",
        "hash",
        "pattern",
        "scene",
        "rays",
        "rmse",
        "recall_silhouette",
        "recall_shadow",
        "recall_texture",
        "recall_reflection",
        "precision",
        "seconds",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [4.0, 85.0, 650.0],
    plan,
    execute,
    conclude,
};

const STILL: &str = include_str!("antialias/still.toml");
const MATTE: &str = include_str!("antialias/matte.toml");

/// A way to spend rays.
#[derive(Clone, Copy)]
struct Method {
    aa: Antialias,
    /// Of the path hash.
    hash: Option<Hash>,
    pattern: Resampling,
    threshold: Option<f64>,
}

const THRESHOLDS: [f64; 4] = [0.3, 0.1, 0.03, 0.01];
const HASHES: [Hash; 4] = [Hash::Original, Hash::Objects, Hash::Shadow, Hash::Texture];
const PATTERNS: [Resampling; 4] = [
    Resampling::Two,
    Resampling::Three,
    Resampling::Four,
    Resampling::Adaptive,
];

fn methods() -> Vec<Method> {
    let method = |aa, hash, pattern, threshold| Method {
        aa,
        hash,
        pattern,
        threshold,
    };
    let mut methods = vec![method(Antialias::None, None, Resampling::Three, None)];
    for pattern in [Resampling::Two, Resampling::Three, Resampling::Four] {
        methods.push(method(Antialias::Uniform, None, pattern, None));
    }
    for hash in HASHES {
        for pattern in PATTERNS {
            methods.push(method(Antialias::PathHash, Some(hash), pattern, None));
        }
    }
    for pattern in [Resampling::Three, Resampling::Four] {
        for threshold in THRESHOLDS {
            let hash = Some(Hash::Texture);
            methods.push(method(Antialias::PathHash, hash, pattern, Some(threshold)));
        }
    }
    for aa in [Antialias::Contrast, Antialias::Variance] {
        for pattern in [Resampling::Three, Resampling::Four] {
            for threshold in THRESHOLDS {
                methods.push(method(aa, None, pattern, Some(threshold)));
            }
        }
    }
    methods
}

impl Method {
    /// As the table says it.
    fn words(&self) -> [String; 3] {
        let aa = word(&self.aa);
        let name = match self.threshold {
            Some(threshold) => format!("{aa} {threshold}"),
            None => aa,
        };
        let hash = self.hash.as_ref().map_or(String::new(), word);
        let pattern = match self.aa {
            Antialias::None => String::new(),
            _ => word(&self.pattern),
        };
        [name, hash, pattern]
    }

    fn settings(&self, seed: u64) -> Settings {
        Settings::resolve(&RenderTable {
            integrator: Some(Integrator::Whitted),
            aa: Some(self.aa),
            hash: self.hash,
            pattern: Some(self.pattern),
            threshold: self.threshold,
            seed: Some(seed),
            ..RenderTable::default()
        })
    }
}

/// The word of an option on the command line.
fn word(option: &impl ValueEnum) -> String {
    let value = option.to_possible_value();
    value.map_or(String::new(), |value| value.get_name().to_owned())
}

fn plan(effort: Effort) -> Vec<Run> {
    let scenes = |names: &[&str]| grid([("scene", values(names.iter().copied()))]);
    let ours = scenes(&["still", "matte", "edge", "disc .1", "disc .3", "disc .5"]);
    let theirs = if effort == Effort::Smoke {
        Vec::new()
    } else {
        scenes(&["still in POV-Ray"])
    };
    [ours, theirs].concat()
}

/// Pixels along a side, samples along a side of each pixel's truth.
fn size(effort: Effort) -> (u32, usize) {
    effort.of([(64, 16), (160, 32), (256, 64)])
}

fn execute(run: &Run, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let name = run.text("scene");
    // One pool for the many small pictures: to start one takes longer than to draw them.
    let (outcome, _) = on_one_thread(|| match name.as_str() {
        "still" => still_life(&name, STILL, effort, seed),
        "matte" => still_life(&name, MATTE, effort, seed),
        "edge" => closed::edge(seed),
        "still in POV-Ray" => povray::rows(&name, size(effort).0),
        _ => closed::disc(&name, effort, seed),
    })?;
    Ok(outcome)
}

/// Every method on one scene.
fn still_life(name: &str, text: &str, effort: Effort, seed: u64) -> anyhow::Result<Outcome> {
    let (side, fine) = size(effort);
    let sets = [("film.width", side), ("film.height", side)]
        .map(|(key, value)| (key.to_owned(), value.to_string()));
    let scene = file::parse(text, name, Path::new(""), &sets)?;
    let mut work = Work::default();
    let truth = Truth::new(&scene, fine, seed, &mut work);
    let edges = Edges::new(&scene, &mut work);
    let mut rows = Vec::new();
    for method in methods() {
        let picture = render(&scene, &method, seed);
        let (recalls, precision) = edges.recalls(&picture.resampled);
        let cost = (picture.rays(), picture.seconds);
        let rmse = truth.rmse(&picture.film);
        rows.push(row(&method, name, cost, rmse, recalls, precision));
        work += picture.work;
    }
    Ok(Outcome { rows, work })
}

/// A row: rays and seconds, and the recalls of silhouette, shadow, texture, reflection.
fn row(
    method: &Method,
    scene: &str,
    (rays, seconds): (u64, f64),
    rmse: f64,
    recalls: [f64; 4],
    precision: f64,
) -> Vec<Value> {
    [
        values(method.words()),
        values([scene]),
        values([rays as i64]),
        values([rmse]),
        values(recalls),
        values([precision, seconds]),
    ]
    .concat()
}

/// A picture, and what it took.
struct Picture {
    film: Film,
    resampled: Vec<bool>,
    work: Work,
    seconds: f64,
}

impl Picture {
    fn rays(&self) -> u64 {
        self.work.camera_rays + self.work.scattered_rays + self.work.shadow_rays
    }
}

/// Its seconds are right where one thread does all the work.
fn render(scene: &Scene, method: &Method, seed: u64) -> Picture {
    let settings = method.settings(seed);
    let clock = ThreadClock::start();
    let mut film = Film::new(scene.film);
    let mut whitted = Whitted::new(scene, &settings);
    let work = whitted.pass(0, &mut film);
    let resampled = whitted.resampled().unwrap_or_default().to_vec();
    Picture {
        film,
        resampled,
        work,
        seconds: clock.seconds(),
    }
}

/// A row of the table.
#[derive(Clone, Debug, Deserialize)]
struct Row {
    method: String,
    hash: String,
    pattern: String,
    scene: String,
    rays: f64,
    rmse: f64,
    recall_silhouette: f64,
    recall_shadow: f64,
    recall_texture: f64,
    recall_reflection: f64,
}

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    conclusion::conclude(&table.read::<Row>(), effort)
}
