//! How far a ray may be moved before its answer changes.

use super::Met;
use crate::geometry::ray::Ray;
use crate::numeric::work::Work;
use crate::scene::Scene;
use glam::DVec3;

/// The box of a scene's objects that have bounds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    middle: DVec3,
    /// Half its diagonal.
    radius: f64,
}

impl Extent {
    pub(super) fn of(scene: &Scene) -> Self {
        let bounds = scene.objects.iter().filter_map(|object| object.bounds);
        let whole = bounds.reduce(|mut a, b| {
            (a.min, a.max) = (a.min.min(b.min), a.max.max(b.max));
            a
        });
        let (min, max) = whole.map_or((DVec3::ZERO, DVec3::ZERO), |whole| (whole.min, whole.max));
        Self {
            middle: 0.5 * (min + max),
            radius: 0.5 * (max - min).length(),
        }
    }

    /// Size of the coordinates that enter a ray's answer.
    pub(super) fn scale(&self, ray: &Ray, nearest: Option<&Met>) -> f64 {
        let reach = self.reach(ray, nearest);
        (ray.origin.length() + reach).max(self.middle.length() + self.radius)
    }

    /// Distance from the origin to the hit, or to the middle of the scene.
    fn reach(&self, ray: &Ray, nearest: Option<&Met>) -> f64 {
        match nearest {
            Some(met) => met.t.abs() * ray.direction.length(),
            None => ray.origin.distance(self.middle),
        }
    }
}

/// Steps of the ladder: half decades from 1e-15 to 1e-2.
const STEPS: i32 = 26;
const LEAST_EXPONENT: f64 = -15.0;

/// Moves of t beyond this many displacements over the cosine are jumps to another crossing: a smooth sheet moves t by one, and by
/// less than four within the depth of a graze (the pair of crossings is 4 depths over the cosine apart).
const JUMP: f64 = 8.0;

/// The least displacement on the ladder that changes the answer; infinite if none does.
///
/// Displacements are to eight sides, of the whole ray or of its far end alone, and along the ray. An answer changes where hit turns
/// to miss, miss to hit, or the nearest crossing jumps to another sheet. The ladder is climbed by decades from below, since a jump
/// can be told from a smooth move only while the displacement is small against it.
pub(super) fn margin(
    scene: &Scene,
    extent: &Extent,
    ray: &Ray,
    nearest: Option<&Met>,
    scale: f64,
) -> f64 {
    let step = |k: i32| scale * libm::exp10(LEAST_EXPONENT + 0.5 * f64::from(k));
    let pivot = extent.reach(ray, nearest).max(extent.radius);
    let changes = |k: &i32| changes(scene, ray, nearest, step(*k), [scale, pivot]);
    let Some(decade) = (0..=STEPS).step_by(2).find(changes) else {
        return f64::INFINITY;
    };
    let half = decade - 1;
    step(if half > 0 && changes(&half) {
        half
    } else {
        decade
    })
}

fn changes(
    scene: &Scene,
    ray: &Ray,
    nearest: Option<&Met>,
    by: f64,
    [scale, pivot]: [f64; 2],
) -> bool {
    let speed = ray.direction.length();
    let along = ray.direction / speed;
    let a = along.any_orthonormal_vector();
    let b = along.cross(a);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let sides = [a, b, half * (a + b), half * (a - b)];
    // At a tangency t moves by the square root of the displacement.
    let slant = |met: &Met| met.cosine.max((by / scale).sqrt());
    let moved = |ray: &Ray| {
        let found = scene.intersect(ray, &mut Work::default());
        match (found, nearest) {
            (None, None) => false,
            (Some(hit), Some(met)) => (hit.t - met.t).abs() * speed * slant(met) > JUMP * by,
            _ => true,
        }
    };
    let shifted = |v: DVec3| Ray {
        origin: ray.origin + by * v,
        ..*ray
    };
    let tilted = |v: DVec3| Ray {
        direction: ray.direction + by / pivot * speed * v,
        ..*ray
    };
    let both_ways = |v: DVec3| [v, -v];
    (sides.into_iter().flat_map(both_ways)).any(|v| moved(&shifted(v)) || moved(&tilted(v)))
        || both_ways(along).into_iter().any(|v| moved(&shifted(v)))
}
