//! Newton's method in (t, u, θ) from many starts: the original's solver, an object of study.
//!
//! A crossing is a zero of F(t, u, θ) = C(t) − S(u, θ), with C the ray and S the revolved piece. Newton's step is
//! x ← x − λ DF⁻¹ F with the Jacobian DF = [D, −S_u, −S_θ] and the damping λ. DF is singular on the axis, where the curve
//! stands still, and where the ray lies in the tangent plane: det DF = −r (h′ (sin θ D_x + cos θ D_z) − r′ D_y).
//!
//! Not promised: that every crossing is found, or the nearest one. How often it is not is the question of experiment
//! `newton_seeds`. A ray exactly perpendicular to the axis (d_y = 0) has no start at all and is never met.

use crate::geometry::bounds::cubic_range;
use crate::geometry::hit::Crossing;
use crate::geometry::profile::{Piece, Profile};
use crate::geometry::ray::Ray;
use crate::numeric::polynomial::{cubic, cubic_extrema};
use crate::numeric::rng::{Purpose, Stream, mix};
use crate::numeric::work::Work;
use glam::{DMat3, DVec3};
use std::f64::consts::TAU;

/// Parameters of the Newton solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonSettings {
    /// Number of starts per piece.
    pub starts: u32,
    /// Where the starts lie.
    pub policy: StartPolicy,
    /// Most steps from one start.
    pub iterations: u32,
    /// Length of a step as a share of Newton's, in (0, 1].
    pub damping: f64,
    /// A root is accepted when max |F| is at most this times the size of the problem.
    pub tolerance: f64,
    /// Seed of the starts.
    pub seed: u64,
}

/// How a start is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartPolicy {
    /// The report's: a random height in the bounding cylinder gives t and θ where the ray meets the disc there; u is random.
    RandomU,
    /// A random height as above, and u a solution of h(u) = height.
    SolveHeight,
    /// Heights and u stratified over the starts.
    Stratified,
    /// As the original is coded, a negative control: a random height *above* the piece, (1 + x)(max − min) + min, by a slip for
    /// min + x (max − min); θ at random instead of the ray's; u at random but for the first two starts, 0 and 1.
    Original,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self {
            starts: 30,
            policy: StartPolicy::RandomU,
            iterations: 20,
            damping: 1.0,
            tolerance: 1e-10,
            seed: 0,
        }
    }
}

impl NewtonSettings {
    /// The original program as coded: 35 starts of [`StartPolicy::Original`], 20 steps, damping 0.7, tolerance 10⁻⁷ (there
    /// absolute, here in sizes of the problem).
    pub fn original() -> Self {
        Self {
            starts: 35,
            policy: StartPolicy::Original,
            iterations: 20,
            damping: 0.7,
            tolerance: 1e-7,
            seed: 0,
        }
    }
}

/// A start is given up when u leaves [−½, 1½], as in the original: from there the extended cubic leads back too seldom.
const ABANDON: f64 = 0.5;

/// Steps of the additive recurrence that fills the unit square evenly, with every prefix even too: powers of 1/g, where
/// g³ = g + 1 (Roberts 2018).
const EVEN: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3];

/// The equations of one ray and one piece. Unknowns are vectors x = (t, u, θ).
#[derive(Clone, Copy, Debug)]
pub struct System<'a> {
    /// The piece.
    pub piece: &'a Piece,
    /// The ray's origin.
    pub origin: DVec3,
    /// The ray's direction.
    pub direction: DVec3,
}

impl System<'_> {
    /// F(x) = C(t) − S(u, θ) and its Jacobian ∂F/∂(t, u, θ) = [D, −S_u, −S_θ].
    pub fn evaluate(&self, x: DVec3) -> (DVec3, DMat3) {
        let (sin, cos) = libm::sincos(x.z);
        let station = self.piece.at(x.y);
        let (radius, slope) = (station.radius, station.radius_slope);
        let surface = DVec3::new(radius * sin, station.height, radius * cos);
        let along_u = DVec3::new(slope * sin, station.height_slope, slope * cos);
        let along_theta = DVec3::new(radius * cos, 0.0, -radius * sin);
        (
            self.origin + x.x * self.direction - surface,
            DMat3::from_cols(self.direction, -along_u, -along_theta),
        )
    }

    /// Follows Newton's method from `start` until the residual is at most `accuracy`; counts the steps in `iterations`.
    pub fn solve(
        &self,
        start: DVec3,
        settings: &NewtonSettings,
        accuracy: f64,
        iterations: &mut u64,
    ) -> Option<DVec3> {
        let mut x = start;
        for left in (0..=settings.iterations).rev() {
            let (residual, jacobian) = self.evaluate(x);
            if residual.abs().max_element() <= accuracy {
                return Some(x);
            }
            if left == 0 {
                break;
            }
            *iterations += 1;
            x -= settings.damping * step(&jacobian, residual)?;
            if !(x.is_finite() && -ABANDON <= x.y && x.y <= 1.0 + ABANDON) {
                break;
            }
        }
        None
    }
}

/// DF⁻¹ F by Cramer's rule, or `None` where DF is singular.
pub fn step(jacobian: &DMat3, residual: DVec3) -> Option<DVec3> {
    let [a, b, c] = [jacobian.x_axis, jacobian.y_axis, jacobian.z_axis];
    let normal = b.cross(c);
    let numerators = DVec3::new(
        residual.dot(normal),
        residual.dot(c.cross(a)),
        residual.dot(a.cross(b)),
    );
    let step = numerators / a.dot(normal);
    step.is_finite().then_some(step)
}

/// The azimuth at which a start is put: that of the ray's own point, θ = atan2(x, z).
pub fn start_azimuth(point: DVec3) -> f64 {
    libm::atan2(point.x, point.z)
}

/// Every crossing found inside the open range of a ray in the profile's own frame, by rising t.
///
/// A pure function of profile, settings and ray: the starts are keyed by the seed, the bits of the ray and the piece. More
/// starts begin with the same ones, so the first crossing never moves away when starts are added. Crossings of one sheet
/// nearer together than the square root of the tolerance, relative to the size of the profile, are one: at a tangency
/// a residual within the tolerance leaves them that uncertain.
pub fn crossings(
    profile: &Profile,
    settings: &NewtonSettings,
    ray: &Ray,
    work: &mut Work,
) -> Vec<Crossing> {
    let Some(search) = Search::new(profile, settings, ray) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for (index, piece) in profile.pieces().iter().enumerate() {
        search.piece(piece, index as u32, &mut found, &mut work.solver_iterations);
    }
    found.sort_by(|a, b| {
        (a.t.total_cmp(&b.t))
            .then(a.piece.cmp(&b.piece))
            .then(a.u.total_cmp(&b.u))
    });
    search.distinct(found)
}

/// A ray moved to where it passes nearest to the middle of the profile, with unit direction: then the rounding of the residual
/// does not grow with the ray's distance.
struct Search<'a> {
    settings: &'a NewtonSettings,
    ray: &'a Ray,
    origin: DVec3,
    direction: DVec3,
    /// Length of the ray's own direction.
    speed: f64,
    /// The ray's t at the moved origin.
    shift: f64,
    /// Sum of the greatest control radius and height: the size of the problem.
    size: f64,
    key: u64,
}

impl<'a> Search<'a> {
    fn new(profile: &Profile, settings: &'a NewtonSettings, ray: &'a Ray) -> Option<Self> {
        if !ray.is_valid() {
            return None;
        }
        let (radius, height) = profile.control_size();
        let size = radius + height;
        let greatest = ray.direction.abs().max_element();
        let scaled = ray.direction / greatest;
        let length = scaled.length();
        let direction = scaled / length;
        let arc = -ray.origin.dot(direction);
        let speed = greatest * length;
        let words = [ray.origin.to_array(), ray.direction.to_array()];
        let search = Self {
            settings,
            ray,
            origin: ray.origin + arc * direction,
            direction,
            speed,
            shift: arc / speed,
            size,
            key: mix(words.map(|v| mix(&v.map(f64::to_bits))).as_slice()),
        };
        (search.origin.is_finite() && search.shift.is_finite()).then_some(search)
    }

    fn piece(&self, piece: &Piece, index: u32, found: &mut Vec<Crossing>, iterations: &mut u64) {
        let system = System {
            piece,
            origin: self.origin,
            direction: self.direction,
        };
        let key = mix(&[self.key, u64::from(index)]);
        let stream = Stream::new(self.settings.seed, Purpose::Newton, key);
        let mut starts = Starts::new(piece, self.settings.policy, stream);
        let accuracy = self.settings.tolerance * self.size;
        for _ in 0..self.settings.starts {
            let [height, u] = starts.next();
            let arc = (height - self.origin.y) / self.direction.y;
            if !arc.is_finite() {
                continue;
            }
            let theta = starts.azimuth(self.origin + arc * self.direction);
            let start = DVec3::new(arc, u, theta);
            let root = system.solve(start, self.settings, accuracy, iterations);
            found.extend(root.and_then(|x| self.accept(x, index)));
        }
    }

    /// A root as a crossing, if it is one. A residual within the tolerance leaves u uncertain by about the tolerance, so u may
    /// pass its ends by that much.
    fn accept(&self, x: DVec3, piece: u32) -> Option<Crossing> {
        let t = self.shift + x.x / self.speed;
        let slack = self.settings.tolerance;
        let inside = -slack <= x.y && x.y <= 1.0 + slack && self.ray.contains(t);
        inside.then(|| Crossing {
            t,
            piece,
            u: x.y.clamp(0.0, 1.0),
        })
    }

    /// Drops what was found before; `found` is sorted by t, and the first of equal ones stays.
    fn distinct(&self, found: Vec<Crossing>) -> Vec<Crossing> {
        let resolution = self.settings.tolerance.sqrt();
        let place = |c: &Crossing| f64::from(c.piece) + c.u;
        let mut kept: Vec<Crossing> = Vec::new();
        for crossing in found {
            let equal = |other: &&Crossing| {
                (crossing.t - other.t) * self.speed <= resolution * self.size
                    && (place(&crossing) - place(other)).abs() <= resolution
            };
            if !kept.iter().rev().any(|other| equal(&other)) {
                kept.push(crossing);
            }
        }
        kept
    }
}

/// The sequence of starts (height, u) of one piece; a longer sequence begins with the shorter one.
pub(crate) struct Starts<'a> {
    piece: &'a Piece,
    policy: StartPolicy,
    stream: Stream,
    range: (f64, f64),
    /// Parameters between which the height is monotone.
    stations: Vec<f64>,
    even: [f64; 2],
    /// Starts given so far.
    given: u32,
}

impl<'a> Starts<'a> {
    /// The sequence that `stream` keys.
    pub(crate) fn new(piece: &'a Piece, policy: StartPolicy, mut stream: Stream) -> Self {
        let even = match policy {
            StartPolicy::Stratified => stream.uniform2(),
            StartPolicy::RandomU | StartPolicy::SolveHeight | StartPolicy::Original => [0.0; 2],
        };
        let mut stations = vec![0.0];
        if policy == StartPolicy::SolveHeight {
            stations.extend(cubic_extrema(&piece.height));
            stations.push(1.0);
        }
        Self {
            piece,
            policy,
            stream,
            range: cubic_range(&piece.height),
            stations,
            even,
            given: 0,
        }
    }

    /// The azimuth of the start last given, for the ray's point at its height.
    fn azimuth(&mut self, point: DVec3) -> f64 {
        match self.policy {
            StartPolicy::Original => self.stream.range(0.0, TAU),
            _ => start_azimuth(point),
        }
    }

    /// The next start.
    pub(crate) fn next(&mut self) -> [f64; 2] {
        let (low, high) = self.range;
        self.given += 1;
        match self.policy {
            StartPolicy::Original => {
                let height = self.stream.range(high, high + (high - low));
                let u = self.stream.uniform();
                [
                    height,
                    [0.0, 1.0]
                        .get(self.given as usize - 1)
                        .copied()
                        .unwrap_or(u),
                ]
            }
            StartPolicy::RandomU => [self.stream.range(low, high), self.stream.uniform()],
            StartPolicy::SolveHeight => {
                let height = self.stream.range(low, high);
                let choice = self.stream.uniform();
                [height, self.solve_height(height, choice)]
            }
            StartPolicy::Stratified => {
                for (value, step) in self.even.iter_mut().zip(EVEN) {
                    *value = (*value + step).fract();
                }
                [low + (high - low) * self.even[0], self.even[1]]
            }
        }
    }

    /// One of the solutions of h(u) = `height`, picked by `choice` in [0, 1), or `choice` itself where there is none (a flat
    /// piece).
    fn solve_height(&self, height: f64, choice: f64) -> f64 {
        let h = |u: f64| cubic(&self.piece.height, u).0 - height;
        let spans = self.stations.windows(2).map(|span| (span[0], span[1]));
        let mut crossed = spans.filter(|&(a, b)| h(a) * h(b) < 0.0);
        let count = crossed.clone().count();
        let Some((mut a, mut b)) = crossed.nth((choice * count as f64) as usize) else {
            return choice;
        };
        let rising = h(a) < 0.0;
        // To 2⁻¹²: a start needs no more.
        for _ in 0..12 {
            let middle = 0.5 * (a + b);
            if (h(middle) < 0.0) == rising {
                a = middle;
            } else {
                b = middle;
            }
        }
        0.5 * (a + b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn starts(piece: &Piece, policy: StartPolicy, count: usize) -> Vec<[f64; 2]> {
        let mut starts = Starts::new(piece, policy, Stream::new(3, Purpose::Test, 1));
        (0..count).map(|_| starts.next()).collect()
    }

    /// Of 1000 starts every tenth of the heights and of the parameters gets its share: 100 expected, 60 are 4.2 deviations fewer.
    #[test]
    fn starts_fill_the_heights_of_their_piece_and_those_of_the_original_lie_above() {
        for piece in Profile::cup().pieces() {
            let (low, high) = cubic_range(&piece.height);
            let tenths = |values: &[f64]| {
                let mut counts = [0; 10];
                for x in values {
                    assert!((0.0..=1.0).contains(x), "{x}");
                    counts[((10.0 * x) as usize).min(9)] += 1;
                }
                counts.into_iter().min()
            };
            for policy in [StartPolicy::RandomU, StartPolicy::Stratified] {
                let all = starts(piece, policy, 1000);
                let share = |[height, _]: &[f64; 2]| (height - low) / (high - low);
                let heights: Vec<f64> = all.iter().map(share).collect();
                let places: Vec<f64> = all.iter().map(|start| start[1]).collect();
                assert!(tenths(&heights) > Some(60) && tenths(&places) > Some(60));
            }
            for [height, u] in starts(piece, StartPolicy::SolveHeight, 200) {
                let slope = 3.0 * (high - low).max(piece.height[0].abs() + piece.height[3].abs());
                assert!((piece.at(u).height - height).abs() < 1e-3 * (1.0 + slope));
            }
            let above = starts(piece, StartPolicy::Original, 50);
            assert!(above.iter().all(|start| start[0] >= high));
            assert_eq!([above[0][1], above[1][1]], [0.0, 1.0]);
        }
    }

    #[test]
    fn a_longer_sequence_of_starts_begins_with_the_shorter_one() {
        let piece = Profile::cup().pieces()[3];
        for policy in [
            StartPolicy::RandomU,
            StartPolicy::SolveHeight,
            StartPolicy::Stratified,
            StartPolicy::Original,
        ] {
            assert_eq!(
                starts(&piece, policy, 5),
                starts(&piece, policy, 9)[..5],
                "{policy:?}"
            );
        }
    }
}
