//! Whether the bounds that the default solver states of its errors hold, and how wide they are.

use crate::geometry::hit::Crossing;
use crate::geometry::ray::Ray;
use crate::geometry::revolution::bernstein::Certainty;
use crate::geometry::revolution::{Revolution, Solver};
use crate::lab::grade::Asked;
use crate::numeric::work::Work;

/// Stated bounds against the oracle.
#[derive(Default)]
pub(super) struct Bounds {
    /// Crossings that have a bound.
    pub(super) stated: u64,
    /// Those of them for which the error of t, u or the normal exceeds it.
    pub(super) broken: u64,
    /// Bounds of the error of t, in ε s/|n · d|.
    ulps: Vec<f64>,
}

/// Rounding of the oracle's own u, and of two computed unit normals.
const U_ROUNDING: f64 = f64::EPSILON;
const NORMAL_ROUNDING: f64 = 8.0 * f64::EPSILON;

impl Bounds {
    /// Looks at the crossings of some rays, whose true ones are known.
    pub(super) fn add(
        &mut self,
        surface: &Revolution,
        rays: &[Ray],
        truths: &[(Asked, Vec<Crossing>)],
    ) {
        for (ray, (asked, truths)) in rays.iter().zip(truths) {
            let found = surface.nearest(ray, &Solver::Bernstein, &mut Work::default());
            // Misses and phantoms are counted elsewhere.
            let Some(found) = found.filter(|_| !truths.is_empty()) else {
                continue;
            };
            let bound = surface.certainty(ray, &found);
            if bound.t == f64::INFINITY {
                continue;
            }
            // Where sheets meet, the crossing may be that of any of them.
            let holds = truths
                .iter()
                .any(|truth| within(&bound, surface, ray, found, *truth));
            self.stated += 1;
            self.broken += u64::from(!holds);
            let cosine = asked.nearest.map_or(1.0, |(_, cosine)| cosine);
            self.ulps
                .push(bound.t * asked.speed * cosine / (f64::EPSILON * asked.scale));
        }
    }

    /// The median bound.
    pub(super) fn typical_ulps(&mut self) -> f64 {
        self.ulps.sort_by(f64::total_cmp);
        self.ulps.get(self.ulps.len() / 2).copied().unwrap_or(0.0)
    }
}

/// Whether a crossing is that true one, to its bounds.
fn within(
    bound: &Certainty,
    surface: &Revolution,
    ray: &Ray,
    found: Crossing,
    truth: Crossing,
) -> bool {
    if (found.t - truth.t).abs() > bound.t {
        return false;
    }
    let normals = [found, truth].map(|crossing| surface.hit(ray, crossing).normal);
    let turned = (normals[0] - normals[1]).length();
    apart(surface, found, truth) <= bound.u + U_ROUNDING && turned <= bound.normal + NORMAL_ROUNDING
}

/// How far apart two crossings are in u, counted on through the joint between neighbours; infinite for others.
fn apart(surface: &Revolution, a: Crossing, b: Crossing) -> f64 {
    let pieces = surface.profile().pieces().len() as u32;
    let onward = |from: Crossing, to: Crossing| {
        let next = (from.piece + 1) % pieces == to.piece;
        let way = (1.0 - from.u) + to.u;
        if next { way } else { f64::INFINITY }
    };
    let within = (a.u - b.u).abs();
    let same = if a.piece == b.piece {
        within
    } else {
        f64::INFINITY
    };
    same.min(onward(a, b)).min(onward(b, a))
}
