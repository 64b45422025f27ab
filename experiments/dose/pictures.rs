//! What a dose looks like: a few methods beside the truth, with the same random numbers.

use super::method::Family;
use super::{Bench, EXPERIMENT, grey};
use crate::image::picture::Picture;
use crate::lab::contrast::Contrast;
use crate::lab::experiment::{Effort, Outcome, Run, grid, values};
use crate::lab::table::{Table, Value};
use serde::Deserialize;

/// Size of a picture in pixels.
const SIZE: (u32, u32) = (48, 36);

/// A method at a dose that an eye can see.
struct Shown {
    family: Family,
    parameter: f64,
    caption: &'static str,
}

const SHOWN: [Shown; 3] = [
    Shown {
        family: Family::Starts,
        parameter: 1.0,
        caption: "Newton's method with one start per piece",
    },
    Shown {
        family: Family::Offset,
        parameter: 1e-2,
        caption: "Rays start .01 off the surface: ten times the gap between cup and floor",
    },
    Shown {
        family: Family::Flat,
        parameter: 8.0,
        caption: "A profile of eight straight pieces for each curved one",
    },
];

/// Before the name of a family, the `method` of a picture's pixels.
const PREFIX: &str = "picture of ";

/// The family of which a method's name says that it is a picture.
pub(super) fn shown(method: &str) -> Option<Family> {
    Family::named(method.strip_prefix(PREFIX)?)
}

fn method(family: Family) -> String {
    format!("{PREFIX}{}", family.name())
}

/// One run for each picture.
pub(super) fn plan() -> impl Iterator<Item = Run> {
    SHOWN.iter().flat_map(|shown| {
        grid([
            ("method", values([method(shown.family)])),
            ("parameter", values([shown.parameter])),
        ])
    })
}

/// Paths of a pixel.
fn samples(effort: Effort) -> u64 {
    effort.of([8, 256, 4096])
}

pub(super) fn execute(
    run: &Run,
    family: Family,
    effort: Effort,
    seed: u64,
) -> anyhow::Result<Outcome> {
    let bench = Bench::new(family, run.number("parameter"), SIZE)?;
    let passes = samples(effort);
    let count = (SIZE.0 * SIZE.1) as usize;
    let mut pixels = vec![Pixel::default(); count];
    let mut outcome = Outcome::default();
    let mut next = 0;
    let mut take = |pair: super::Pair| {
        let pixel = &mut pixels[next % count];
        pixel.truth += grey(pair.truth);
        pixel.difference += grey(pair.other - pair.truth);
        next += 1;
    };
    bench.trace(seed, passes, &mut outcome.work, &mut take);
    let row = |(place, pixel): (usize, &Pixel)| pixel.row(run, place as u64, passes);
    outcome.rows = pixels.iter().enumerate().map(row).collect();
    Ok(outcome)
}

/// Sums of radiance over the paths of a pixel.
#[derive(Clone, Default)]
struct Pixel {
    truth: f64,
    difference: f64,
}

impl Pixel {
    fn row(&self, run: &Run, place: u64, paths: u64) -> Vec<Value> {
        let none = || Value::from(0_u64);
        let n = paths as f64;
        run.row([
            place.into(),
            "pixel".into(),
            paths.into(),
            none(),
            none(),
            none(),
            none(),
            none(),
            (self.truth / n).into(),
            (self.difference / n).into(),
            0.0.into(),
            0.0.into(),
        ])
    }
}

/// What a picture needs of its rows, which stand in the order of the pixels.
#[derive(Deserialize)]
struct Row {
    truth: f64,
    bias: f64,
}

/// Each method beside the truth; pictures that the table does not hold whole are left out.
pub(super) fn contrasts(table: &Table) -> Vec<Contrast> {
    let contrast = |shown: &Shown| {
        let rows: Vec<Row> = (table.filter("method", &method(shown.family).as_str().into())).read();
        let picture = |value: fn(&Row) -> f64| Picture {
            width: SIZE.0 as usize,
            height: SIZE.1 as usize,
            rgb: rows.iter().map(|row| [value(row) as f32; 3]).collect(),
            ..Picture::default()
        };
        let whole = rows.len() == (SIZE.0 * SIZE.1) as usize;
        let bad = format!("{} {}", shown.family.name(), shown.parameter);
        whole.then(|| Contrast {
            caption: shown.caption.to_owned(),
            a: (bad, picture(|row| row.truth + row.bias)),
            b: (
                "truth, by the same paths".to_owned(),
                picture(|row| row.truth),
            ),
            commands: vec![format!("photolathe verify --only {}", EXPERIMENT.name)],
        })
    };
    SHOWN.iter().filter_map(contrast).collect()
}
