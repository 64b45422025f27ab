//! Claims and plots.

use super::rivalry::{Ours, RIVALRIES};
use super::{EXPERIMENT, Row, closed};
use crate::lab::claim::{Claim, Estimate};
use crate::lab::experiment::{Conclusion, Effort};
use crate::lab::plot::{Plot, Series};
use std::f64::consts::PI;

/// What the finite number of places of the edge may change of its closed form.
const EDGE_PRECISION: f64 = 1e-3;

pub(super) fn conclude(rows: &[Row], effort: Effort) -> Conclusion {
    let mut claims = vec![edge(rows, effort)];
    claims.extend(["disc .1", "disc .3", "disc .5"].map(|scene| disc(rows, scene, effort)));
    claims.push(blind(rows, effort));
    claims.extend(recalls(rows, effort));
    claims.extend(
        RIVALRIES
            .iter()
            .filter_map(|rivalry| rivalry.claim(rows, effort)),
    );
    Conclusion {
        claims,
        plots: ["still", "matte"].map(|scene| cost(rows, scene)).to_vec(),
        ..Conclusion::default()
    }
}

/// RMS 1/(n √12) for n × n samples.
fn edge(rows: &[Row], effort: Effort) -> Claim {
    let of: Vec<&Row> = rows
        .iter()
        .filter(|row| row.scene == "edge" && row.pattern != "adaptive")
        .collect();
    let wrong = |row: &&&Row| {
        let side = match row.pattern.as_str() {
            "2x2" => 2.0,
            "3x3" => 3.0,
            "4x4" => 4.0,
            _ => 1.0,
        };
        let closed = 1.0 / (side * 12.0_f64.sqrt());
        (row.rmse / closed - 1.0).abs() > EDGE_PRECISION
    };
    let subject = EXPERIMENT.subject(
        "a straight edge",
        "With n × n samples, by the hash or everywhere, a straight edge has an RMS error of 1/(n √12), to a thousandth.",
        Effort::Smoke,
        effort,
    );
    Claim::exact(
        subject,
        of.iter().filter(wrong).count() as u64,
        of.len() as u64,
    )
}

/// Found with probability πρ².
fn disc(rows: &[Row], scene: &str, effort: Effort) -> Claim {
    let radius: f64 = scene
        .trim_start_matches("disc ")
        .parse()
        .unwrap_or(f64::NAN);
    let expected = PI * radius * radius;
    let n = closed::discs(effort);
    let found = rows.iter().find(|row| row.scene == scene);
    let share = found.map_or(f64::NAN, |row| row.recall_silhouette);
    let error = (expected * (1.0 - expected) / n as f64).sqrt();
    let statement = format!("A disc of radius {radius} pixels is found with probability πρ².");
    let subject = EXPERIMENT.subject(scene, &statement, Effort::Smoke, effort);
    // Five standard errors reach from the level of the claims to a power of 95 %, and some to spare.
    Claim::null(
        subject,
        Estimate::known(share, error, n),
        expected,
        8.0 * error,
    )
}

/// Nothing of matte bodies enters the course project's hash.
fn blind(rows: &[Row], effort: Effort) -> Claim {
    let of: Vec<&Row> = rows
        .iter()
        .filter(|row| row.scene == "matte" && row.hash == "original")
        .collect();
    let sees = |row: &&&Row| row.recall_silhouette + row.recall_shadow != 0.0;
    let subject = EXPERIMENT.subject(
        "the original is blind to matte bodies",
        "The course project's hash finds no silhouette and no shadow among diffuse bodies.",
        Effort::Smoke,
        effort,
    );
    Claim::exact(
        subject,
        of.iter().filter(sees).count() as u64,
        of.len() as u64,
    )
}

/// Each hash finds nearly all pixels with the edges that it takes in; a pixel whose edge misses every centre around may be left.
fn recalls(rows: &[Row], effort: Effort) -> Vec<Claim> {
    let claim = |name, statement, hash: &str, recall: fn(&Row) -> f64| {
        let of: Vec<f64> = rows
            .iter()
            .filter(|row| row.method == "path-hash" && row.hash == hash)
            .filter(|row| row.scene == "still" && row.pattern == "3x3")
            .map(recall)
            .collect();
        let least = of.iter().copied().fold(f64::INFINITY, f64::min);
        let subject = EXPERIMENT.subject(name, statement, Effort::Smoke, effort);
        Claim::in_range(subject, least, (least, least), of.len() as u64, (0.97, 1.0))
    };
    vec![
        claim(
            "silhouettes are found",
            "The hash of all hits marks at least 97 % of the pixels with a silhouette.",
            "objects",
            |row| row.recall_silhouette,
        ),
        claim(
            "reflected edges are found",
            "It marks at least 97 % of those where only a reflection or refraction has an edge.",
            "objects",
            |row| row.recall_reflection,
        ),
        claim(
            "shadows are found",
            "With the visible lights, it marks at least 97 % of those with the edge of a shadow.",
            "shadow",
            |row| row.recall_shadow,
        ),
        claim(
            "texture edges are found",
            "With the cells too, it marks at least 97 % of those with an edge of the checker.",
            "texture",
            |row| row.recall_texture,
        ),
    ]
}

/// Error against rays.
fn cost(rows: &[Row], scene: &str) -> Plot {
    let series = |name: &str, of: &dyn Fn(&Row) -> bool, label: fn(&Row) -> String| {
        let mut points: Vec<&Row> = rows
            .iter()
            .filter(|row| row.scene == scene && of(row))
            .collect();
        points.sort_by(|a, b| a.rays.total_cmp(&b.rays));
        Series::scattered(name, points.iter().map(|row| (row.rays, row.rmse)))
            .with_labels(points.iter().map(|row| label(row)))
    };
    let hash = |name: &'static str| move |row: &Row| row.method == "path-hash" && row.hash == name;
    let pattern = |row: &Row| row.pattern.clone();
    let threshold = |row: &Row| format!("{}, {}", row.method, row.pattern);
    Plot::speed_error(
        &format!("Error against rays, {scene}"),
        "rays",
        "RMS error of radiance",
        [
            series("one sample", &|row| row.method == "none", |_| String::new()),
            series("uniform", &|row| row.method == "uniform", pattern),
            series("hash: original", &hash("original"), pattern),
            series("hash: objects", &hash("objects"), pattern),
            series("hash: shadow", &hash("shadow"), pattern),
            series("hash: texture", &hash("texture"), pattern),
            series(
                "hash: texture, threshold",
                &|row| Ours::Seen.is(row),
                threshold,
            ),
            series(
                "contrast",
                &|row| row.method.starts_with("contrast"),
                threshold,
            ),
            series(
                "variance",
                &|row| row.method.starts_with("variance"),
                threshold,
            ),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(method: &str, hash: &str, pattern: &str, scene: &str, rays: f64, rmse: f64) -> Row {
        let recall = if hash == "original" { 0.0 } else { 1.0 };
        Row {
            method: method.to_owned(),
            hash: hash.to_owned(),
            pattern: pattern.to_owned(),
            scene: scene.to_owned(),
            rays,
            rmse,
            recall_silhouette: recall,
            recall_shadow: recall,
            recall_texture: recall,
            recall_reflection: recall,
        }
    }

    fn right() -> Vec<Row> {
        let mut rows = vec![row("path-hash", "original", "3x3", "matte", 1e3, 0.1)];
        for (pattern, side) in [("", 1.0), ("2x2", 2.0), ("3x3", 3.0), ("4x4", 4.0)] {
            let rmse = 1.0 / (side * 12.0_f64.sqrt());
            rows.push(row("uniform", "", pattern, "edge", 1e4, rmse));
        }
        for radius in [0.1, 0.3, 0.5] {
            let mut disc = row("path-hash", "objects", "3x3", "", 1e3, 0.1);
            disc.scene = format!("disc {radius}").replace("0.", ".");
            disc.recall_silhouette = PI * radius * radius;
            rows.push(disc);
        }
        for scene in ["still", "matte"] {
            for hash in ["objects", "shadow", "texture"] {
                rows.push(row("path-hash", hash, "3x3", scene, 3e3, 0.02));
            }
            rows.push(row("none", "", "", scene, 1e3, 0.1));
            for method in ["uniform", "variance 0.1"] {
                rows.push(row(method, "", "3x3", scene, 9e3, 0.02));
            }
            let contrast = if scene == "still" { 0.016 } else { 0.02 };
            rows.push(row("contrast 0.1", "", "3x3", scene, 3e3, contrast));
            rows.push(row("path-hash 0.1", "texture", "3x3", scene, 3e3, 0.015));
        }
        let theirs = "still in POV-Ray";
        rows.push(row("none", "", "", theirs, 1e3, 0.1));
        rows.push(row("POV-Ray 1 at 0.1", "", "3x3", theirs, 3e3, 0.0175));
        rows
    }

    fn failing(rows: &[Row]) -> Vec<String> {
        let claims = conclude(rows, Effort::Standard).claims.into_iter();
        let failing = claims.filter(Claim::fails_the_run);
        failing.map(|claim| claim.claim).collect()
    }

    /// Of the right rows with `change` made to those that `of` picks.
    fn failing_with(of: fn(&Row) -> bool, change: fn(&mut Row)) -> Vec<String> {
        let mut rows = right();
        rows.iter_mut().filter(|row| of(row)).for_each(change);
        failing(&rows)
    }

    #[test]
    fn each_claim_can_fail() {
        assert_eq!(failing(&right()), Vec::<String>::new());
        assert_eq!(
            failing_with(|row| row.pattern == "4x4", |row| row.rmse *= 1.01),
            ["a straight edge"]
        );
        for scene in ["disc .1", "disc .3", "disc .5"] {
            let mut rows = right();
            let disc = rows.iter_mut().find(|row| row.scene == scene).expect("it");
            disc.recall_silhouette *= 1.2;
            assert_eq!(failing(&rows), [scene]);
            rows.retain(|row| row.scene != scene);
            assert_eq!(failing(&rows), [scene], "nor may it be absent");
        }
        assert_eq!(
            failing_with(
                |row| row.hash == "original",
                |row| row.recall_silhouette = 0.01
            ),
            ["the original is blind to matte bodies"]
        );
        let still = |row: &Row| row.scene == "still";
        let less = |row: &mut Row| {
            row.recall_silhouette = 0.9;
            row.recall_reflection = 0.9;
            row.recall_shadow = 0.9;
            row.recall_texture = 0.9;
        };
        assert_eq!(
            failing_with(still, less),
            [
                "silhouettes are found",
                "reflected edges are found",
                "shadows are found",
                "texture edges are found"
            ]
        );
    }

    #[test]
    fn each_rivalry_can_be_lost_and_none_may_be_absent_but_that_with_pov_ray() {
        let ours = |rmse: f64| {
            let mut rows = right();
            let hashed = rows.iter_mut().filter(|row| row.hash == "texture");
            hashed.for_each(|row| row.rmse = rmse);
            failing(&rows)
        };
        assert_eq!(ours(0.09).len(), 14, "more error than every rival");
        assert_eq!(
            ours(0.001),
            [
                "more error than contrast, with glass",
                "level with contrast, matte",
                "more error than POV-Ray"
            ]
        );
        let without = |of: fn(&Row) -> bool| {
            let mut rows = right();
            rows.retain(|row| !of(row));
            failing(&rows)
        };
        assert_eq!(without(|row| row.scene == "still in POV-Ray").len(), 0);
        assert_eq!(without(|row| row.hash == "texture").len(), 15);
    }
}
