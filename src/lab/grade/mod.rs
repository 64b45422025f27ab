//! Grades a program's answers to a suite of rays (see [`crate::lab::suite`]).

mod dots;
mod page;
mod read;

pub use page::html;
pub use read::{read_answers, read_suite};

use serde::Serialize;

/// A ray of a suite, with what is true of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// Number of the ray.
    pub number: u64,
    /// Name of its family.
    pub family: String,
    /// |o|.
    pub distance: f64,
    /// |d|.
    pub speed: f64,
    /// t and |n · d|/|d| of the nearest crossing.
    pub nearest: Option<(f64, f64)>,
    /// Size of the coordinates that enter the answer.
    pub scale: f64,
    /// The least displacement of the ray that changes the answer.
    pub margin: f64,
}

/// The verdict on one answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// A miss for a miss, or a hit whose t is equal within the tolerance.
    Right,
    /// No hit, where there is one.
    Miss,
    /// A hit, where there is none.
    Phantom,
    /// A hit, but not the nearest one.
    Wrong,
    /// Not right, but moving the ray by the tolerance changes the certified answer.
    Ambiguous,
}

/// A verdict with the error of a right hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// The verdict.
    pub verdict: Verdict,
    /// Error of a right hit.
    pub error: Option<HitError>,
}

/// How far the t of a hit is from the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HitError {
    /// Distance along the ray, |Δt| |d|, world units.
    pub distance: f64,
    /// In units of ε (|o| + t |d|)/|n · d|, with ε = 2⁻⁵² and unit d: what rounding the coordinates once costs.
    pub ulps: f64,
}

/// Judges one answer: `None` for a miss, or t.
///
/// With T the `tolerance` and S the ray's scale, t is *equal* where |Δt| |d| ≤ S min(2 T/cosine, 4 √T): the surface moved by T S,
/// with the square-root law of tangencies as the limit. What is not right is *ambiguous* where the margin is at most T S.
pub fn judge(asked: &Asked, answer: Option<f64>, tolerance: f64) -> Judged {
    let failure = match (asked.nearest, answer) {
        (None, None) => None,
        (Some(_), None) => Some(Verdict::Miss),
        (None, Some(_)) => Some(Verdict::Phantom),
        (Some((true_t, cosine)), Some(t)) => {
            let distance = (t - true_t).abs() * asked.speed;
            let permitted = (2.0 * tolerance / cosine).min(4.0 * tolerance.sqrt());
            if distance <= asked.scale * permitted {
                return Judged {
                    verdict: Verdict::Right,
                    error: Some(error_of(asked, distance, true_t, cosine)),
                };
            }
            Some(Verdict::Wrong)
        }
    };
    let excused = asked.margin <= tolerance * asked.scale;
    let verdict = match failure {
        None => Verdict::Right,
        Some(_) if excused => Verdict::Ambiguous,
        Some(failure) => failure,
    };
    Judged {
        verdict,
        error: None,
    }
}

fn error_of(asked: &Asked, distance: f64, true_t: f64, cosine: f64) -> HitError {
    let coordinates = asked.distance + true_t.abs() * asked.speed;
    let ulps = distance * cosine / (f64::EPSILON * coordinates);
    HitError {
        distance,
        // 0/0: a hit at the origin, answered exactly.
        ulps: if distance == 0.0 { 0.0 } else { ulps },
    }
}

/// Median, 99th percentile and maximum; absent where there are no values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Median (the lower of two).
    pub median: Option<f64>,
    /// The least value that 99 % do not exceed.
    pub p99: Option<f64>,
    /// Maximum.
    pub max: Option<f64>,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let rank = |percent: usize| (values.len() * percent).div_ceil(100).max(1) - 1;
        Self {
            median: values.get(rank(50)).copied(),
            p99: values.get(rank(99)).copied(),
            max: values.last().copied(),
        }
    }
}

/// A failed ray, for someone to look at.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Example {
    /// Number of the ray.
    pub ray: u64,
    /// What is wrong.
    pub verdict: Verdict,
    /// True t; absent for a phantom.
    pub true_t: Option<f64>,
    /// Answered t; absent for a miss.
    pub t: Option<f64>,
}

/// Failed rays that are told for each family.
const EXAMPLES: usize = 5;

/// The grade of one family.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FamilyGrade {
    /// Name.
    pub family: String,
    /// Rays.
    pub rays: u64,
    /// Rays with a hit, in truth.
    pub true_hits: u64,
    /// Right answers.
    pub right: u64,
    /// Hits missed.
    pub miss: u64,
    /// Hits invented.
    pub phantom: u64,
    /// Hits that are not the nearest.
    pub wrong: u64,
    /// Answers that differ, but would be right for a ray within the tolerance.
    pub ambiguous: u64,
    /// |Δt| |d| of right hits, world units.
    pub t_error: Spread,
    /// The same in units of ε (|o| + t |d|)/|n · d|.
    pub ulps: Spread,
    /// The first failures.
    pub examples: Vec<Example>,
}

impl FamilyGrade {
    /// Misses, phantoms and wrong hits.
    pub fn failures(&self) -> u64 {
        self.miss + self.phantom + self.wrong
    }

    fn count(&mut self, asked: &Asked, answer: Option<f64>, verdict: Verdict) {
        self.rays += 1;
        self.true_hits += u64::from(asked.nearest.is_some());
        match verdict {
            Verdict::Right => self.right += 1,
            Verdict::Miss => self.miss += 1,
            Verdict::Phantom => self.phantom += 1,
            Verdict::Wrong => self.wrong += 1,
            Verdict::Ambiguous => self.ambiguous += 1,
        }
        let failed = !matches!(verdict, Verdict::Right | Verdict::Ambiguous);
        if failed && self.examples.len() < EXAMPLES {
            self.examples.push(Example {
                ray: asked.number,
                verdict,
                true_t: asked.nearest.map(|(t, _)| t),
                t: answer,
            });
        }
    }
}

/// The grade of a program.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Grade {
    /// Version, scene and seed of the suite.
    pub suite: String,
    /// T: positions are compared to within T times the ray's scale.
    pub tolerance: f64,
    /// Rays in all.
    pub rays: u64,
    /// Misses, phantoms and wrong hits in all.
    pub failures: u64,
    /// Ambiguous answers in all.
    pub ambiguous: u64,
    /// By family, in the order of the suite.
    pub families: Vec<FamilyGrade>,
}

/// Grades answers, one for each ray in order.
pub fn grade(suite: &str, asked: &[Asked], answers: &[Option<f64>], tolerance: f64) -> Grade {
    let mut families: Vec<FamilyGrade> = Vec::new();
    let mut errors: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    for (asked, &answer) in asked.iter().zip(answers) {
        // Rays of a family stand together: the last one is looked at first.
        let place = families.iter().rposition(|one| one.family == asked.family);
        let place = place.unwrap_or_else(|| {
            families.push(FamilyGrade {
                family: asked.family.clone(),
                ..FamilyGrade::default()
            });
            errors.push((Vec::new(), Vec::new()));
            families.len() - 1
        });
        let judged = judge(asked, answer, tolerance);
        families[place].count(asked, answer, judged.verdict);
        if let Some(error) = judged.error {
            errors[place].0.push(error.distance);
            errors[place].1.push(error.ulps);
        }
    }
    for (family, (distances, ulps)) in families.iter_mut().zip(errors) {
        family.t_error = Spread::of(distances);
        family.ulps = Spread::of(ulps);
    }
    let sum = |of: fn(&FamilyGrade) -> u64| families.iter().map(of).sum();
    Grade {
        suite: suite.to_owned(),
        tolerance,
        rays: sum(|family| family.rays),
        failures: sum(FamilyGrade::failures),
        ambiguous: sum(|family| family.ambiguous),
        families,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(nearest: Option<(f64, f64)>, margin: f64) -> Asked {
        Asked {
            number: 0,
            family: "random".to_owned(),
            distance: 3.0,
            speed: 2.0,
            nearest,
            scale: 10.0,
            margin,
        }
    }

    #[test]
    fn the_verdicts_are_as_defined() {
        let firm = f64::INFINITY;
        let hit = asked(Some((4.0, 0.5)), firm);
        let verdict = |asked: &Asked, answer| judge(asked, answer, 1e-6).verdict;
        // |Δt| 2 ≤ 10 · 2e-6/0.5.
        assert_eq!(verdict(&hit, Some(4.000_019)), Verdict::Right);
        assert_eq!(verdict(&hit, Some(4.000_021)), Verdict::Wrong);
        assert_eq!(verdict(&hit, None), Verdict::Miss);
        let none = asked(None, firm);
        assert_eq!(verdict(&none, None), Verdict::Right);
        assert_eq!(verdict(&none, Some(1.0)), Verdict::Phantom);
        for (margin, expected) in [(0.99e-5, Verdict::Ambiguous), (1.1e-5, Verdict::Miss)] {
            assert_eq!(verdict(&asked(Some((4.0, 0.5)), margin), None), expected);
        }
    }

    #[test]
    fn a_tangency_is_equal_within_the_square_root_of_the_tolerance() {
        let touch = asked(Some((4.0, 0.0)), f64::INFINITY);
        // |Δt| 2 ≤ 10 · 4e-3.
        assert_eq!(judge(&touch, Some(4.019), 1e-6).verdict, Verdict::Right);
        assert_eq!(judge(&touch, Some(4.021), 1e-6).verdict, Verdict::Wrong);
    }

    #[test]
    fn errors_are_counted_in_roundings_of_the_coordinates() {
        let error = judge(
            &asked(Some((4.0, 0.5)), 1.0),
            Some(4.0 + 11.0 * f64::EPSILON),
            1e-9,
        );
        let error = error.error.expect("a right hit");
        // Δt = 12 ε in steps of 4 ε; 24 ε · ½ / (3 + 4 · 2).
        assert!((error.ulps - 12.0 / 11.0).abs() < 1e-12, "{error:?}");
    }

    #[test]
    fn percentiles_are_ranks() {
        let values = (1..=200).rev().map(f64::from).collect();
        let spread = Spread::of(values);
        assert_eq!(
            (spread.median, spread.p99, spread.max),
            (Some(100.0), Some(198.0), Some(200.0))
        );
        assert_eq!(Spread::of(Vec::new()), Spread::default());
    }
}
