//! Irradiance that is singular along a line: what a disc reads of it, in closed form up to quadrature, and what photons say.
//!
//! Irradiance depends on x alone, E(x) = x₊^s, or is 1 on a surface that ends at x = 0. A disc of radius r at x reads
//! G(x, r) = ∫ k(v) E(x − r v) dv with k(v) = (2/π) √(1 − v²) on [−1, 1]; with m photons over an emitted power Z it has the variance
//! (Z G/(π r²) − G²)/m.

use super::super::radius::law::{binomial, integral};
use crate::numeric::rng::Stream;
use crate::render::photon::radius::Schedule;
use crate::scene::options::Rule;
use std::f64::consts::{FRAC_PI_2, PI};

/// What the light does at x = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Edge {
    /// E = x₊^s, seen from both sides; s a multiple of ½ from 0 to 3/2.
    Power(f64),
    /// E = 1, on a surface that begins at x = 0: no receivers before it.
    Corner,
}

impl Edge {
    /// s of the singularity.
    pub(super) fn exponent(self) -> f64 {
        match self {
            Self::Power(s) => s,
            Self::Corner => 0.0,
        }
    }

    /// Irradiance.
    fn at(self, x: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        match self {
            Self::Corner => 1.0,
            Self::Power(s) => half_power(x, s),
        }
    }

    /// Whether a receiver can be there.
    fn receives(self, x: f64) -> bool {
        self != Self::Corner || x > 0.0
    }

    /// Whether nothing is read wrongly farther than the radius from x = 0.
    pub(super) fn is_local(self) -> bool {
        matches!(self, Self::Corner | Self::Power(0.0 | 1.0))
    }

    /// G(x, r).
    fn read(self, x: f64, r: f64) -> f64 {
        let u = x / r;
        if u <= -1.0 {
            return 0.0;
        }
        let s = self.exponent();
        if u > SERIES {
            // E + (r²/8) E″ + (r⁴/192) E⁗.
            let second = s * (s - 1.0);
            let fourth = second * (s - 2.0) * (s - 3.0);
            return self.at(x) * (1.0 + (second / 8.0 + fourth / (192.0 * u * u)) / (u * u));
        }
        // v = sin t; at the far end of the lit part t = end − width y², so that (u − v)^s is smooth in y.
        let end = libm::asin(u.min(1.0));
        let width = end + FRAC_PI_2;
        let lit = |y: f64| {
            let t = end - width * y * y;
            let cosine = libm::cos(t);
            2.0 * width * y * cosine * cosine * self.at(u - libm::sin(t))
        };
        let smooth = 0.5 * (integral(|z| lit(0.5 * z)) + integral(|z| lit(0.5 + 0.5 * z)));
        half_power(r, s) * smooth / FRAC_PI_2
    }
}

/// x^s for multiples of ½ up to 3/2 (and any other s).
fn half_power(x: f64, s: f64) -> f64 {
    if s == 0.0 {
        1.0
    } else if s == 0.5 {
        x.sqrt()
    } else if s == 1.0 {
        x
    } else if s == 1.5 {
        x * x.sqrt()
    } else {
        libm::pow(x, s)
    }
}

/// Distance over radius from which on two terms of the series have four digits of the bias.
const SERIES: f64 = 8.0;

/// Points of a window, or samples of a pixel, in a replicate.
const SAMPLES: usize = 48;

/// Where the light is gathered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Receivers {
    /// At points: the square error is averaged over them.
    Points,
    /// Over square pixels of a width, turned by an angle against the edge; a pixel's error is the mean over it, and its square is
    /// averaged over pixels.
    Pixels {
        /// Width.
        width: f64,
        /// Tangent of the angle; 0 is aligned.
        slant: f64,
    },
}

/// Radii of passes with the share of the passes that have about this one.
pub(super) type Radii = Vec<(f64, f64)>;

/// The radii of `passes` passes of the global rule. From pass 16 on, a sixteenth of the way is taken for one radius: to some parts in 10⁴.
pub(super) fn radii(alpha: f64, first: f64, passes: u64) -> Radii {
    let mut radii = Radii::new();
    let mut schedule = Schedule::new(Rule::Global, alpha);
    let mut from = 0;
    while from < passes {
        let to = (from + 1 + from / 16).min(passes);
        let middle = schedule.shrink(from + (to - from) / 2);
        radii.push((first * middle.sqrt(), (to - from) as f64 / passes as f64));
        from = to;
    }
    radii
}

/// An edge, what sees it, and how it is gathered.
#[derive(Clone, Debug)]
pub(super) struct Setting {
    pub(super) edge: Edge,
    pub(super) receivers: Receivers,
    pub(super) alpha: f64,
    pub(super) first: f64,
    pub(super) passes: u64,
    /// Photons that would fall into the first disc where E = 1.
    pub(super) found: f64,
}

/// ∫ of the squared bias over the window, and the mean variance in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Errors {
    pub(super) bias2: f64,
    pub(super) variance: f64,
}

impl Setting {
    /// Ends of the window that receivers (or the middles of pixels) are in.
    pub(super) fn window(&self) -> (f64, f64) {
        let reach = match self.receivers {
            Receivers::Points => self.first,
            Receivers::Pixels { width, slant } => self.first + 0.5 * extent(width, slant),
        };
        let start = if self.edge == Edge::Corner && self.receivers == Receivers::Points {
            0.0
        } else {
            -reach
        };
        (start, if self.edge.is_local() { reach } else { 1.0 })
    }

    /// End of the light, so far that no receiver sees it, and the power up to there.
    fn light(&self) -> (f64, f64) {
        let more = match self.receivers {
            Receivers::Points => 0.0,
            Receivers::Pixels { width, slant } => 0.5 * extent(width, slant),
        };
        let end = self.window().1 + more + self.first;
        let s = self.edge.exponent();
        (end, libm::pow(end, s + 1.0) / (s + 1.0))
    }

    /// Photons of a pass.
    pub(super) fn photons(&self) -> u64 {
        let density = self.found / (PI * self.first * self.first);
        (density * self.light().1).round() as u64
    }

    /// By quadrature.
    pub(super) fn predicted(&self) -> Errors {
        let radii = radii(self.alpha, self.first, self.passes);
        let least = radii
            .iter()
            .fold(f64::INFINITY, |least, one| least.min(one.0));
        let mean = |x: f64| {
            radii
                .iter()
                .map(|&(r, share)| share * self.edge.read(x, r))
                .sum::<f64>()
        };
        let bias = |x: f64| mean(x) - self.edge.at(x);
        let (start, end) = self.window();
        let (photons, power) = (self.photons() as f64, self.light().1);
        match self.receivers {
            Receivers::Points => {
                let variance = |x: f64| {
                    let of = |&(r, share): &(f64, f64)| {
                        let read = self.edge.read(x, r);
                        share * (power * read / (PI * r * r) - read * read)
                    };
                    radii.iter().map(of).sum::<f64>() / (photons * self.passes as f64)
                };
                let bias2 = |x: f64| bias(x) * bias(x);
                Errors {
                    bias2: graded(start, end, least, &bias2),
                    variance: graded(start, end, least, &variance) / (end - start),
                }
            }
            Receivers::Pixels { width, slant } => {
                let tent = Trapezoid::new(width, slant);
                let of_pixel = |middle: f64| {
                    let seen = |x: f64| {
                        if self.edge.receives(x) {
                            tent.at(x - middle) * bias(x)
                        } else {
                            0.0
                        }
                    };
                    let half = 0.5 * extent(width, slant);
                    // Wrong only near the edge, where the edge is local.
                    let reach = if self.edge.is_local() {
                        self.first
                    } else {
                        f64::INFINITY
                    };
                    let (from, to) = ((middle - half).max(-self.first), (middle + half).min(reach));
                    pieces(
                        from,
                        to,
                        &[0.0, middle - tent.flat, middle + tent.flat],
                        &seen,
                    )
                };
                let square = |middle: f64| {
                    let error = of_pixel(middle);
                    error * error
                };
                let half = 0.5 * extent(width, slant);
                let corners = [-half, half, -tent.flat, tent.flat];
                let mut breaks: Vec<f64> = corners
                    .iter()
                    .flat_map(|corner| [corner - self.first, *corner, corner + self.first])
                    .collect();
                breaks.push(0.0);
                Errors {
                    bias2: pieces(start, end, &breaks, &square),
                    variance: f64::NAN,
                }
            }
        }
    }

    /// From photons: the product of the errors of two independent estimates, whose mean is the squared bias, and half the square
    /// of their difference, whose mean is the variance. Photons are drawn in each pass. The two share their points, but not their
    /// places within a pixel: its bias is the mean over it.
    pub(super) fn replicate(&self, stream: &mut Stream) -> Errors {
        let (start, end) = self.window();
        let n = SAMPLES as f64;
        match self.receivers {
            Receivers::Points => {
                let points: Vec<f64> = (0..SAMPLES)
                    .map(|i| start + (end - start) * (i as f64 + stream.uniform()) / n)
                    .collect();
                let (a, b) = (self.errors(&points, stream), self.errors(&points, stream));
                let pairs = a.iter().zip(&b);
                Errors {
                    bias2: (end - start) * pairs.clone().map(|(a, b)| a * b).sum::<f64>() / n,
                    variance: pairs.map(|(a, b)| 0.5 * (a - b) * (a - b)).sum::<f64>() / n,
                }
            }
            Receivers::Pixels { width, slant } => {
                let middle = stream.range(start, end);
                let side = width / (1.0 + slant * slant).sqrt();
                let mut mean = || {
                    let mut places: Vec<f64> = (0..SAMPLES)
                        .map(|i| {
                            let across = (i as f64 + stream.uniform()) / n - 0.5;
                            middle + side * (across + slant * (stream.uniform() - 0.5))
                        })
                        .collect();
                    places.sort_unstable_by(f64::total_cmp);
                    self.errors(&places, stream).iter().sum::<f64>() / n
                };
                let (a, b) = (mean(), mean());
                Errors {
                    bias2: (end - start) * a * b,
                    variance: 0.5 * (a - b) * (a - b),
                }
            }
        }
    }

    /// The error of an estimate at each of these places, from left to right; 0 where there is no surface.
    fn errors(&self, receivers: &[f64], stream: &mut Stream) -> Vec<f64> {
        let (end, power) = self.light();
        let photons = self.photons();
        let mut schedule = Schedule::new(Rule::Global, self.alpha);
        // What begins to count at a receiver, and ceases to.
        let mut steps = vec![0.0; receivers.len() + 1];
        let root = 1.0 / (self.edge.exponent() + 1.0);
        for pass in 0..self.passes {
            let squared = self.first * self.first * schedule.shrink(pass);
            let radius = squared.sqrt();
            let worth = power / (PI * squared * photons as f64 * self.passes as f64);
            // Receivers are on the line y = 0, the light is on |y| < ½: these photons are near enough in y.
            for _ in 0..binomial(photons, 2.0 * radius, stream) {
                let u = stream.uniform();
                let x = end * if root == 1.0 { u } else { libm::pow(u, root) };
                let y = radius * (2.0 * stream.uniform() - 1.0);
                let half = (squared - y * y).max(0.0).sqrt();
                let from = receivers.partition_point(|&at| at < x - half);
                let to = receivers.partition_point(|&at| at <= x + half);
                steps[from] += worth;
                steps[to] -= worth;
            }
        }
        let mut read = 0.0;
        let each = receivers.iter().zip(&steps);
        each.map(|(&x, step)| {
            read += step;
            if self.edge.receives(x) {
                read - self.edge.at(x)
            } else {
                0.0
            }
        })
        .collect()
    }
}

/// Width of a turned pixel across the edge.
fn extent(width: f64, slant: f64) -> f64 {
    width * (1.0 + slant) / (1.0 + slant * slant).sqrt()
}

/// Density of a pixel's points across the edge: that of the sum of two uniform numbers.
struct Trapezoid {
    /// Half the width of the top, and of the foot.
    flat: f64,
    foot: f64,
}

impl Trapezoid {
    fn new(width: f64, slant: f64) -> Self {
        let norm = 0.5 * width / (1.0 + slant * slant).sqrt();
        Self {
            flat: norm * (1.0 - slant).abs(),
            foot: norm * (1.0 + slant),
        }
    }

    fn at(&self, x: f64) -> f64 {
        let height = 1.0 / (self.flat + self.foot);
        if x.abs() <= self.flat {
            height
        } else {
            height * ((self.foot - x.abs()) / (self.foot - self.flat)).max(0.0)
        }
    }
}

/// ∫ f from `from` to `to`, in pieces between the breaks.
fn pieces(from: f64, to: f64, breaks: &[f64], f: &dyn Fn(f64) -> f64) -> f64 {
    let mut ends: Vec<f64> = breaks
        .iter()
        .copied()
        .filter(|&x| x > from && x < to)
        .collect();
    if to <= from {
        return 0.0;
    }
    ends.extend([from, to]);
    ends.sort_unstable_by(f64::total_cmp);
    let piece =
        |pair: &[f64]| (pair[1] - pair[0]) * integral(|z| f(pair[0] + (pair[1] - pair[0]) * z));
    ends.windows(2).map(piece).sum()
}

/// The same with pieces that double from `least` on, away from x = 0 in both directions.
fn graded(from: f64, to: f64, least: f64, f: &dyn Fn(f64) -> f64) -> f64 {
    let mut breaks = vec![0.0];
    let mut at = 0.25 * least;
    while at < to.max(-from) {
        breaks.extend([at, -at]);
        at *= 2.0;
    }
    pieces(from, to, &breaks, f)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Purpose;
    use crate::numeric::statistics::Moments;

    fn still(edge: Edge, receivers: Receivers, first: f64) -> Setting {
        Setting {
            edge,
            receivers,
            alpha: 1.0,
            first,
            passes: 1,
            found: 20.0,
        }
    }

    /// Of a step: the half-plane profile ½ + (u √(1 − u²) + asin u)/π, and its square error 0.136211 r.
    #[test]
    fn a_disc_at_a_step_reads_the_profile_of_a_half_plane() {
        for u in [-0.9_f64, -0.3, 0.0, 0.5, 0.99, 1.0, 3.0] {
            let inner = u.clamp(-1.0, 1.0);
            let profile = 0.5 + (inner * (1.0 - inner * inner).sqrt() + libm::asin(inner)) / PI;
            for edge in [Edge::Power(0.0), Edge::Corner] {
                let error = edge.read(0.1 * u, 0.1) - profile;
                assert!(error.abs() < 1e-12, "{u}: {error}");
            }
        }
        for r in [0.3, 0.01] {
            let bias2 = still(Edge::Power(0.0), Receivers::Points, r)
                .predicted()
                .bias2;
            assert!((bias2 / r - 0.136_210_7).abs() < 1e-6);
            let corner = still(Edge::Corner, Receivers::Points, r).predicted().bias2;
            assert!((corner / bias2 - 0.5).abs() < 1e-6);
        }
    }

    /// The quadrature near the edge and the series far from it meet; x₊ is read rightly farther than the radius.
    #[test]
    fn readings_far_from_the_edge_follow_the_series() {
        for s in [0.5, 1.0, 1.5] {
            let edge = Edge::Power(s);
            let bias = |u: f64| edge.read(u, 1.0) - edge.at(u);
            let (below, above) = (bias(SERIES - 1e-9), bias(SERIES + 1e-9));
            assert!(
                (below - above).abs() < 1e-4 * above.abs() + 1e-11,
                "{s}: {below} {above}"
            );
        }
        assert!((Edge::Power(1.0).read(1.2, 1.0) - 1.2).abs() < 1e-10);
    }

    #[test]
    fn radii_taken_together_keep_the_mean_of_each_pass() {
        let mut schedule = Schedule::new(Rule::Global, 0.6);
        let exact: f64 = (0..3000).map(|i| schedule.shrink(i).sqrt()).sum::<f64>() / 3000.0;
        let grouped: f64 = radii(0.6, 1.0, 3000)
            .iter()
            .map(|(r, share)| r * share)
            .sum();
        assert!((grouped / exact - 1.0).abs() < 5e-4);
        let shares: f64 = radii(0.6, 1.0, 3000).iter().map(|one| one.1).sum();
        assert!((shares - 1.0).abs() < 1e-12);
    }

    /// 3000 replicates, six errors: see 5 % for points at a step, 40 % for slanted pixels at a corner.
    #[test]
    fn photons_give_the_square_error_of_the_quadrature() {
        let slanted = Receivers::Pixels {
            width: 0.1,
            slant: 0.5,
        };
        for (edge, receivers, alpha, passes, effect) in [
            (Edge::Power(0.0), Receivers::Points, 0.5, 4, 0.05),
            (Edge::Corner, slanted, 1.0, 1, 0.4),
        ] {
            let setting = Setting {
                alpha,
                passes,
                ..still(edge, receivers, 0.1)
            };
            let errors: Vec<Errors> = (0..3000)
                .map(|index| setting.replicate(&mut Stream::new(2, Purpose::Test, index)))
                .collect();
            let bias2 = Moments::of(errors.iter().map(|one| one.bias2));
            let predicted = setting.predicted();
            let error = bias2.standard_error();
            assert!(6.0 * error < effect * predicted.bias2, "{error}");
            assert!((bias2.mean() - predicted.bias2).abs() < 6.0 * error);
            if receivers == Receivers::Points {
                let variance = Moments::of(errors.iter().map(|one| one.variance));
                assert!((variance.mean() / predicted.variance - 1.0).abs() < 0.06);
            }
        }
    }
}
