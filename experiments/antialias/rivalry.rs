//! The full hash against other methods at equal rays.

use super::{EXPERIMENT, Row};
use crate::lab::claim::Claim;
use crate::lab::experiment::Effort;

/// The full hash, by itself or with a threshold of contrast.
#[derive(Clone, Copy)]
pub(super) enum Ours {
    Plain,
    Seen,
}

impl Ours {
    pub(super) fn is(self, row: &Row) -> bool {
        let plain = row.method == "path-hash";
        row.hash == "texture" && plain == matches!(self, Self::Plain)
    }
}

/// A comparison of the full hash with another method at equal rays: of the frontiers of both, at the rays of ours.
pub(super) struct Rivalry {
    ours: Ours,
    rival: &'static str,
    scene: &'static str,
    name: &'static str,
    statement: &'static str,
    /// Of our error over theirs.
    range: (f64, f64),
}

pub(super) const RIVALRIES: [Rivalry; 14] = [
    Rivalry {
        ours: Ours::Plain,
        rival: "uniform",
        scene: "still",
        name: "less error than uniform",
        statement: "At equal rays the full hash has a lower error than uniform supersampling on the still life.",
        range: (0.0, 1.0),
    },
    Rivalry {
        ours: Ours::Plain,
        rival: "uniform",
        scene: "matte",
        name: "less error than uniform, matte",
        statement: "At equal rays it has a lower error than uniform supersampling on matte bodies.",
        range: (0.0, 1.0),
    },
    Rivalry {
        ours: Ours::Plain,
        rival: "variance",
        scene: "still",
        name: "less error than variance",
        statement: "At equal rays it has a lower error than sampling by variance on the still life.",
        range: (0.0, 1.0),
    },
    Rivalry {
        ours: Ours::Plain,
        rival: "variance",
        scene: "matte",
        name: "less error than variance, matte",
        statement: "At equal rays it has a lower error than sampling by variance on matte bodies.",
        range: (0.0, 1.0),
    },
    Rivalry {
        ours: Ours::Plain,
        rival: "contrast",
        scene: "still",
        name: "more error than contrast, with glass",
        statement: "At equal rays contrast has the lower error on the still life: the hash spends rays on edges within glass that no \
                    one sees. (Expected was the opposite.)",
        range: (1.0, 3.0),
    },
    Rivalry {
        ours: Ours::Plain,
        rival: "contrast",
        scene: "matte",
        name: "level with contrast, matte",
        statement: "At equal rays hash and contrast are level on matte bodies, within 10 %. (Expected was a lead of the hash.)",
        range: (0.9, 1.1),
    },
    Rivalry {
        ours: Ours::Plain,
        rival: "POV-Ray",
        scene: "still in POV-Ray",
        name: "more error than POV-Ray",
        statement: "At equal rays POV-Ray's better method has a lower error on the same scene than the full hash has, as contrast has. \
                    (Expected was the opposite.)",
        range: (1.0, 3.0),
    },
    Rivalry {
        ours: Ours::Seen,
        rival: "uniform",
        scene: "still",
        name: "with a threshold, less error than uniform",
        statement: "At equal rays the full hash that leaves what looks alike has a lower error than uniform supersampling on the still life.",
        range: (0.0, 1.0),
    },
    Rivalry {
        ours: Ours::Seen,
        rival: "contrast",
        scene: "still",
        name: "with a threshold, less error than contrast",
        statement: "At equal rays the full hash that leaves what looks alike has a lower error than contrast on the still life.",
        range: (0.0, 1.0),
    },
    Rivalry {
        ours: Ours::Seen,
        rival: "uniform",
        scene: "matte",
        name: "with a threshold, less error than uniform, matte",
        statement: "At equal rays the full hash that leaves what looks alike has a lower error than uniform supersampling on matte bodies.",
        range: (0.0, 1.0),
    },
    Rivalry {
        ours: Ours::Seen,
        rival: "contrast",
        scene: "matte",
        name: "with a threshold, less error than contrast, matte",
        statement: "At equal rays the full hash that leaves what looks alike has a lower error than contrast on matte bodies.",
        range: (0.0, 1.0),
    },
    Rivalry {
        ours: Ours::Seen,
        rival: "variance",
        scene: "still",
        name: "with a threshold, less error than variance",
        statement: "At equal rays the full hash that leaves what looks alike has a lower error than sampling by variance on the still life.",
        range: (0.0, 1.0),
    },
    Rivalry {
        ours: Ours::Seen,
        rival: "variance",
        scene: "matte",
        name: "with a threshold, less error than variance, matte",
        statement: "At equal rays the full hash that leaves what looks alike has a lower error than sampling by variance on matte bodies.",
        range: (0.0, 1.0),
    },
    Rivalry {
        ours: Ours::Seen,
        rival: "POV-Ray",
        scene: "still in POV-Ray",
        name: "with a threshold, less error than POV-Ray",
        statement: "At equal rays it has a lower error than POV-Ray's better method has on the same scene.",
        range: (0.0, 1.0),
    },
];

impl Rivalry {
    /// None where POV-Ray is not installed: it alone may be absent.
    pub(super) fn claim(&self, rows: &[Row], effort: Effort) -> Option<Claim> {
        if self.rival == "POV-Ray" && rows.iter().all(|row| row.scene != self.scene) {
            return None;
        }
        let scene = self.scene.trim_end_matches(" in POV-Ray");
        let ours = frontier(rows, |row| row.scene == scene && self.ours.is(row));
        // One sample a pixel belongs to every method.
        let theirs = frontier(rows, |row| {
            row.scene == self.scene && (row.method.starts_with(self.rival) || row.method == "none")
        });
        let ratios: Vec<f64> = (ours.into_iter())
            .filter_map(|(rays, error)| Some(libm::log(error / at_rays(&theirs, rays)?)))
            .collect();
        let count = ratios.len();
        let ratio = libm::exp(ratios.iter().sum::<f64>() / count as f64);
        let decided_at = Effort::Standard;
        let subject = EXPERIMENT.subject(self.name, self.statement, decided_at, effort);
        Some(Claim::in_range(
            subject,
            ratio,
            (ratio, ratio),
            count as u64,
            self.range,
        ))
    }
}

/// Rays and errors of those rows that no other of them beats in both, in the order of the rays.
fn frontier(rows: &[Row], of: impl Fn(&Row) -> bool) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = rows
        .iter()
        .filter(|row| of(row))
        .map(|row| (row.rays, row.rmse))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut least = f64::INFINITY;
    points.retain(|&(_, error)| {
        let better = error < least;
        least = least.min(error);
        better
    });
    points
}

/// The error of a curve at so many rays: between its points a power of the rays, beyond the last its error. None before the first.
fn at_rays(curve: &[(f64, f64)], rays: f64) -> Option<f64> {
    let after = curve.iter().position(|point| point.0 > rays);
    match after {
        Some(0) => None,
        None => curve.last().map(|point| point.1),
        Some(after) => {
            let [(x0, y0), (x1, y1)] = [curve[after - 1], curve[after]];
            let share = libm::log(rays / x0) / libm::log(x1 / x0);
            Some(y0 * libm::pow(y1 / y0, share))
        }
    }
}
