//! POV-Ray on the same scene, where it is installed.

use crate::image::exr;
use crate::lab::experiment::{Outcome, values};
use crate::numeric::work::Work;
use anyhow::{Context as _, ensure};
use std::path::Path;
use std::process::{Command, Stdio};

const SCENE: &str = include_str!("still.pov");

/// Its methods: supersampling at a threshold, without and with recursion. Nine samples a pixel at most.
const METHODS: [(u32, &[f64]); 2] = [(1, &[0.3, 0.1, 0.03, 0.0]), (2, &[0.3, 0.1, 0.03, 0.01])];

/// Rows of its pictures, `side` pixels along a side, against its own of 9 × 9 samples; none where it is not installed.
pub(super) fn rows(name: &str, side: u32) -> anyhow::Result<Outcome> {
    let installed = Command::new("povray")
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    if !installed.is_ok_and(|status| status.success()) {
        return Ok(Outcome::default());
    }
    let folder = tempfile::tempdir().context("cannot make a folder for POV-Ray")?;
    std::fs::write(folder.path().join("still.pov"), SCENE)?;
    let aa = |method: u32, threshold: f64, depth: u32| {
        vec![
            "Antialias=on".to_owned(),
            format!("Sampling_Method={method}"),
            format!("Antialias_Threshold={threshold}"),
            format!("Antialias_Depth={depth}"),
        ]
    };
    let truth = draw(folder.path(), side, &aa(1, 0.0, 9))?;
    let mut rows = Vec::new();
    let mut add = |words: [String; 3], arguments: &[String]| {
        let drawn = draw(folder.path(), side, arguments)?;
        let nothing = [f64::NAN; 5];
        let picture = [
            values(words),
            values([name]),
            values([drawn.rays]),
            values([drawn.rmse(&truth)]),
            values(nothing),
            values([drawn.seconds]),
        ];
        rows.push(picture.concat());
        anyhow::Ok(())
    };
    add(
        ["none".to_owned(), String::new(), String::new()],
        &["Antialias=off".to_owned()],
    )?;
    for (method, thresholds) in METHODS {
        for &threshold in thresholds {
            let words = [
                format!("POV-Ray {method} at {threshold}"),
                String::new(),
                "3x3".to_owned(),
            ];
            add(words, &aa(method, threshold, 3))?;
        }
    }
    Ok(Outcome {
        rows,
        work: Work::default(),
    })
}

struct Drawn {
    pixels: Vec<[f32; 3]>,
    rays: i64,
    seconds: f64,
}

impl Drawn {
    fn rmse(&self, truth: &Self) -> f64 {
        let squares = self.pixels.iter().zip(&truth.pixels).map(|(a, b)| {
            let square = |channel: usize| {
                let off = f64::from(a[channel]) - f64::from(b[channel]);
                off * off
            };
            (square(0) + square(1) + square(2)) / 3.0
        });
        (squares.sum::<f64>() / truth.pixels.len() as f64).sqrt()
    }
}

fn draw(folder: &Path, side: u32, arguments: &[String]) -> anyhow::Result<Drawn> {
    let output = Command::new("povray")
        .current_dir(folder)
        .args([
            "Input_File_Name=still.pov",
            "Output_File_Name=still.exr",
            "Output_File_Type=E",
            "Display=off",
            "Jitter=off",
            "Work_Threads=1",
        ])
        .args([format!("Width={side}"), format!("Height={side}")])
        .args(arguments)
        .output()
        .context("cannot run povray")?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "povray failed: {said}");
    let number = |label: &str| -> anyhow::Result<f64> {
        let place = said
            .find(label)
            .with_context(|| format!("povray tells no {label}"))?;
        let rest = said[place + label.len()..].trim_start();
        let digits = rest
            .split(|c: char| !(c.is_ascii_digit() || c == '.'))
            .next();
        Ok(digits.unwrap_or_default().parse()?)
    };
    let picture = exr::read(&folder.join("still.exr"))?;
    let seconds = said
        .rfind("thread(s) with ")
        .and_then(|place| said[place + 15..].split(' ').next()?.parse().ok());
    Ok(Drawn {
        pixels: picture.rgb.clone(),
        rays: (number("Rays:")? + number("Shadow Ray Tests:")?) as i64,
        seconds: seconds.unwrap_or(f64::NAN),
    })
}
