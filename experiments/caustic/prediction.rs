//! The light that a glass ball in a parallel beam throws on a plane behind it, in closed form.
//!
//! A ray at distance b from the axis of a ball of radius 1 and index n enters at θ = asin b and goes on inside at θ' = asin(b/n). After k
//! inner reflections it has turned by δ = 2 (θ − θ') + k (π − 2 θ'), and as a ball treats all its points alike, its line still passes
//! the centre at distance b. So it meets the plane a distance z behind the centre at ρ(b) = (b − z sin δ)/cos δ from the axis, if
//! cos δ > 0. Its share of the light is (1 − F)² Fᵏ with Fresnel's F(θ). The light that the outside reflects, share F, turns by 2 θ − π
//! the other way. Beside the ball the beam goes straight on.

use crate::render::scatter::fresnel;
use std::f64::consts::PI;

/// A ball of radius 1 at the origin, in parallel light of irradiance 1 along the axis, within a radius > 1 of the axis.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// Index of refraction.
    pub ior: f64,
    /// Radius of the beam.
    pub beam: f64,
    /// Distance of the plane behind the centre, > 1.
    pub plane: f64,
}

/// How light comes to the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Beside the ball.
    Beside,
    /// Reflected by the outside of the ball.
    Outside,
    /// Through the ball, with so many inner reflections.
    Through(u32),
}

/// Inner reflections that are followed: what has more is below 10⁻⁴ of the light.
const MOST_REFLECTIONS: u32 = 6;

impl Way {
    /// All ways that matter.
    pub fn all() -> Vec<Self> {
        let through = (0..=MOST_REFLECTIONS).map(Self::Through);
        [Self::Beside, Self::Outside]
            .into_iter()
            .chain(through)
            .collect()
    }

    /// Scattering events on this way.
    pub fn events(self) -> u32 {
        match self {
            Self::Beside => 0,
            Self::Outside => 1,
            Self::Through(reflections) => reflections + 2,
        }
    }
}

/// Where light comes to the plane, and how much of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Distance from the axis, negative across it.
    pub distance: f64,
    /// Share of the light that takes this way.
    pub share: f64,
}

impl Ball {
    /// Where the light at `b` from the axis comes to on a way; `None` if it does not.
    pub fn arrival(&self, way: Way, b: f64) -> Option<Arrival> {
        if way == Way::Beside {
            return (b > 1.0 && b <= self.beam).then_some(Arrival {
                distance: b,
                share: 1.0,
            });
        }
        if b >= 1.0 {
            return None;
        }
        let (outer, inner) = (libm::asin(b), libm::asin(b / self.ior));
        let (reflectance, _) = fresnel((1.0 - b * b).sqrt(), self.ior);
        let (turn, share) = match way {
            Way::Through(k) => (
                2.0 * (outer - inner) + f64::from(k) * (PI - 2.0 * inner),
                (1.0 - reflectance) * (1.0 - reflectance) * libm::pow(reflectance, f64::from(k)),
            ),
            Way::Outside | Way::Beside => (2.0 * outer - PI, reflectance),
        };
        let cos = libm::cos(turn);
        (cos > 0.0).then(|| Arrival {
            distance: (b - self.plane * libm::sin(turn)) / cos,
            share,
        })
    }

    /// The share of the light within the ball's disc that comes to the plane between two distances on one way.
    pub fn share_between(&self, way: Way, low: f64, high: f64) -> f64 {
        let n = 400_000;
        let of = |i: u32| {
            let b = ((f64::from(i) + 0.5) / f64::from(n)).sqrt();
            let arrival = self.arrival(way, b)?;
            (low..high)
                .contains(&arrival.distance.abs())
                .then_some(arrival.share)
        };
        (0..n).filter_map(of).sum::<f64>() / f64::from(n)
    }
}

/// Parts of 0 ≤ b ≤ 1 in which a crossing of ρ(b) is looked for.
const PARTS: u32 = 2000;

/// Irradiance of the plane: the sum of b share/(ρ |dρ/db|) over all b and ways that lead to ρ. Infinite at a fold (dρ/db = 0) and, if
/// rays cross there, on the axis.
#[derive(Clone, Debug)]
pub struct Exact {
    ball: Ball,
    /// Of every way through or from the ball, ρ at the ends of the parts.
    ends: Vec<(Way, Vec<Option<f64>>)>,
}

impl Exact {
    /// The light of a ball on its plane.
    pub fn new(ball: &Ball) -> Self {
        let distance = |way, i| Some(ball.arrival(way, part(i))?.distance);
        let along = |way| (way, (0..=PARTS).map(|i| distance(way, i)).collect());
        let ways = Way::all().into_iter().filter(|&way| way != Way::Beside);
        Self {
            ball: *ball,
            ends: ways.map(along).collect(),
        }
    }

    /// Irradiance at a distance from the axis.
    pub fn irradiance(&self, distance: f64) -> f64 {
        let beside = f64::from(u8::from(distance > 1.0 && distance <= self.ball.beam));
        let mut sum = beside;
        for (way, ends) in &self.ends {
            for (i, pair) in (0..).zip(ends.windows(2)) {
                let (Some(low), Some(high)) = (pair[0], pair[1]) else {
                    continue;
                };
                for target in [-distance, distance] {
                    if (low > target) != (high > target) {
                        sum += self.light_between(*way, target, part(i), part(i + 1));
                    }
                }
            }
        }
        sum
    }

    /// The light at `target` (signed) from b between `low` and `high`, between which ρ(b) crosses it once.
    fn light_between(&self, way: Way, target: f64, mut low: f64, mut high: f64) -> f64 {
        let beyond = |b: f64| {
            let arrival = self.ball.arrival(way, b);
            arrival.is_some_and(|arrival| arrival.distance > target)
        };
        let first = beyond(low);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if beyond(middle) == first {
                low = middle;
            } else {
                high = middle;
            }
        }
        let step = 1e-6;
        let [before, here, after] =
            [low - step, low, low + step].map(|b| self.ball.arrival(way, b));
        let (Some(before), Some(here), Some(after)) = (before, here, after) else {
            return 0.0;
        };
        let slope = (after.distance - before.distance) / (2.0 * step);
        here.share * low / (target * slope).abs()
    }
}

fn part(i: u32) -> f64 {
    f64::from(i) / f64::from(PARTS)
}

/// Rings of equal area that the beam is cut into.
const RINGS: u32 = 30_000;

/// What a gather over a disc reads in the mean: the light by its distance from the axis, ready to be asked.
#[derive(Clone, Debug)]
pub struct Blurred {
    /// Distances from the axis, rising, with the flux there.
    rings: Vec<(f64, f64)>,
}

impl Blurred {
    /// The light of a ball on its plane.
    pub fn new(ball: &Ball) -> Self {
        let ring = PI * ball.beam * ball.beam / f64::from(RINGS);
        let of = |i: u32, way| {
            let b = ball.beam * ((f64::from(i) + 0.5) / f64::from(RINGS)).sqrt();
            let Arrival { distance, share } = ball.arrival(way, b)?;
            (share > 1e-9).then(|| (distance.abs(), share * ring))
        };
        let ways = Way::all();
        let all = (0..RINGS).flat_map(|i| ways.iter().filter_map(move |&way| of(i, way)));
        let mut rings: Vec<(f64, f64)> = all.collect();
        rings.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { rings }
    }

    /// Mean irradiance over a disc of this radius, `distance` from the axis: of every ring, the share of its arc within the disc.
    pub fn irradiance(&self, distance: f64, radius: f64) -> f64 {
        let from = self
            .rings
            .partition_point(|ring| ring.0 < distance - radius);
        let to = self
            .rings
            .partition_point(|ring| ring.0 <= distance + radius);
        let within = |&(ring, flux): &(f64, f64)| {
            let cos =
                (ring * ring + distance * distance - radius * radius) / (2.0 * ring * distance);
            flux * libm::acos(cos.clamp(-1.0, 1.0)) / PI
        };
        self.rings[from..to].iter().map(within).sum::<f64>() / (PI * radius * radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(plane: f64) -> Ball {
        Ball {
            ior: 1.5,
            beam: 1.5,
            plane,
        }
    }

    /// z(b) = b/sin δ from the centre: 1.5 paraxial, 1.3916 at b = ½.
    #[test]
    fn rays_through_the_ball_cross_the_axis_where_they_should() {
        for (b, crossing) in [(1e-4, 1.5), (0.5, 1.3916)] {
            let at = |plane| {
                ball(plane)
                    .arrival(Way::Through(0), b)
                    .expect("it arrives")
                    .distance
            };
            assert!(at(crossing).abs() < 1e-4 * b.max(0.1));
            assert!(at(1.2) > 0.0 && at(2.0) < 0.0);
        }
    }

    /// On every way: light at the rim of the ball reflected outside goes straight on, as does that beside.
    #[test]
    fn ways_join_at_the_rim_and_shares_are_those_of_fresnel() {
        let rim = ball(2.0)
            .arrival(Way::Outside, 1.0 - 1e-12)
            .expect("it arrives");
        assert!((rim.distance - 1.0).abs() < 1e-4 && (rim.share - 1.0).abs() < 1e-4);
        let middle = ball(2.0)
            .arrival(Way::Through(0), 1e-6)
            .expect("it arrives");
        assert!((middle.share - 0.96 * 0.96).abs() < 1e-9);
        assert_eq!(ball(2.0).arrival(Way::Through(1), 0.1), None);
        let twice = ball(2.0)
            .arrival(Way::Through(2), 1e-6)
            .expect("it arrives");
        assert!((twice.share - (0.96 * 0.96 * 0.04 * 0.04)).abs() < 1e-9);
    }

    /// In the middle behind the focus: E = (1 − F)² (b/ρ)² = .9216 · 9 and the twice reflected light.
    #[test]
    fn small_discs_read_the_irradiance_and_large_ones_all_the_light() {
        for plane in [1.1, 2.0] {
            let (ball, blurred) = (ball(plane), Blurred::new(&ball(plane)));
            let closed = Exact::new(&ball);
            for distance in [0.1, 0.2, 0.4, 0.7, 1.2, 1.4] {
                // Where the light spreads, the rings of the beam are far apart.
                let radius = if distance < 0.3 { 0.004 } else { 0.02 };
                let (exact, read) = (
                    closed.irradiance(distance),
                    blurred.irradiance(distance, radius),
                );
                assert!(
                    (read / exact - 1.0).abs() < 0.02,
                    "{plane} {distance}: {read} {exact}"
                );
            }
            let whole = blurred.irradiance(1e-9, 1.5) * PI * 2.25;
            let by_way = |way| PI * ball.share_between(way, 0.0, 1.5);
            let beside = PI * (2.25 - 1.0);
            let sum = beside + Way::all()[1..].iter().map(|&way| by_way(way)).sum::<f64>();
            assert!((whole / sum - 1.0).abs() < 1e-3, "{whole} {sum}");
        }
        // Near the axis, but not at it: there, light reflected thrice or more inside crosses it, and adds a little over ρ.
        let middle = Exact::new(&ball(2.0)).irradiance(5e-3);
        let expected = 0.9216 * 9.0;
        assert!((middle / expected - 1.0).abs() < 5e-3, "{middle}");
    }
}
