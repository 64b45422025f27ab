//! The crossings counted a second time, by Sturm's theorem: nothing of the root finding, of the branches near d_y = 0 and of the
//! way to t is shared with [`super::crossings`].

use super::line::{Curve, Line, squares_apart};
use super::{Profile, Ray, ends_in_root, is_closed};
use crate::numeric::exact::{Dyadic, Polynomial, Sturm, sign};
use num_bigint::BigInt;
use num_traits::{One, Zero};

/// Number of crossings of a ray with one piece, in the ray's range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Piece of the profile.
    pub piece: u32,
    /// Distinct crossings.
    pub crossings: u32,
    /// Crossings by multiplicity.
    pub multiplicity: u32,
}

/// Counts the crossings of every piece that has an area, by the policy of [`super::crossings`].
pub fn recount(profile: &Profile, ray: &Ray) -> Vec<Tally> {
    if !ray.is_valid() {
        return Vec::new();
    }
    let pieces = profile.pieces();
    let line = Line::new(pieces, ray);
    let mut joint_met = is_closed(pieces) && ends_in_root(&line, pieces);
    let mut tallies = Vec::new();
    for (piece, points) in (0..).zip(pieces) {
        let curve = Curve::new(&line, points);
        if curve.is_degenerate() {
            continue;
        }
        let mut tally = Tally {
            piece,
            ..Tally::default()
        };
        let equation = line.equation(&curve);
        if !equation.is_zero() {
            let stripped = Stripped::new(&equation);
            for passage in passages(&line, &curve) {
                passage.count(&stripped, joint_met, &mut tally);
            }
            joint_met = stripped.orders[1] > 0;
        } else {
            joint_met = false;
        }
        tallies.push(tally);
    }
    tallies
}

/// A polynomial without its roots at 0 and 1, and their orders.
struct Stripped {
    rest: Polynomial,
    orders: [u32; 2],
}

impl Stripped {
    fn new(polynomial: &Polynomial) -> Self {
        let mut rest = polynomial.coefficients().to_vec();
        let zeros = rest.iter().take_while(|c| c.is_zero()).count();
        rest.drain(..zeros);
        let mut ones = 0;
        while rest.len() > 1 && rest.iter().sum::<BigInt>().is_zero() {
            // Division by 1 − u: partial sums.
            let mut sum = BigInt::zero();
            for c in &mut rest {
                sum += &*c;
                c.clone_from(&sum);
            }
            rest.pop();
            ones += 1;
        }
        Self {
            rest: Polynomial::new(rest),
            orders: [zeros as u32, ones],
        }
    }
}

/// Roots in u count where every weight is positive; with `on_zero` it must be zero there.
struct Passage {
    positive: Vec<Polynomial>,
    zero: Option<Polynomial>,
    /// Multiplicity in t.
    times: u32,
}

/// The ways to pass a circle of the piece within the range.
fn passages(line: &Line, curve: &Curve) -> Vec<Passage> {
    if line.is_level() {
        return level_passages(line, curve);
    }
    let climb = BigInt::from(line.climb());
    let weight = |limit: &Option<Dyadic>, side: i32| {
        let above = line.rise_above(curve, limit.as_ref()?);
        Some(above.affine(&(&climb * side), &BigInt::zero()))
    };
    let positive = [weight(&line.low, 1), weight(&line.high, -1)];
    vec![Passage {
        positive: positive.into_iter().flatten().collect(),
        zero: None,
        times: 1,
    }]
}

/// A t = −b + σ √s against both limits.
fn level_passages(line: &Line, curve: &Curve) -> Vec<Passage> {
    let (across, along, square) = line.quadratic(curve);
    let (across, along, unit) = line.dyadic_quadratic(across, along);
    // σ √s − k, with k = A limit + b, against zero on the side `side`; `None` where it is never so.
    let beyond = |limit: &Option<Dyadic>, branch: i32, side: i32| -> Option<Vec<Polynomial>> {
        let Some(limit) = limit else {
            return Some(Vec::new());
        };
        let k = across.times(limit).plus(&along);
        let sign_of_k = sign(&k.mantissa);
        if branch == 0 {
            return (-sign_of_k == side).then(Vec::new);
        }
        if sign_of_k * branch < 0 {
            return (branch == side).then(Vec::new);
        }
        let apart = squares_apart(&square, unit, &k);
        Some(vec![
            apart.affine(&BigInt::from(branch * side), &BigInt::zero()),
        ])
    };
    let passage = |branch: i32| {
        let mut positive = beyond(&line.low, branch, 1)?;
        positive.extend(beyond(&line.high, branch, -1)?);
        let touching = branch == 0;
        if !touching {
            positive.push(square.clone());
        }
        Some(Passage {
            positive,
            zero: touching.then(|| square.clone()),
            times: if touching { 2 } else { 1 },
        })
    };
    [-1, 0, 1].into_iter().filter_map(passage).collect()
}

impl Passage {
    fn count(&self, stripped: &Stripped, joint_met: bool, tally: &mut Tally) {
        let mut rest = stripped.rest.clone();
        let mut first = true;
        while rest.degree() > 0 {
            let count = self.inside(&rest);
            tally.multiplicity += count * self.times;
            if first {
                tally.crossings += count;
                first = false;
            }
            match Sturm::new(&rest).common() {
                Some(common) => rest = common.clone(),
                None => break,
            }
        }
        for (end, order) in (0_u32..).zip(stripped.orders) {
            let shared = end == 0 && joint_met;
            if order > 0 && !shared && self.holds_at(end) {
                tally.crossings += 1;
                tally.multiplicity += order * self.times;
            }
        }
    }

    fn holds_at(&self, end: u32) -> bool {
        let sign_at = |p: &Polynomial| sign(&p.scaled_value(&BigInt::from(end), 0));
        self.positive.iter().all(|p| sign_at(p) > 0) && self.zero.iter().all(|p| sign_at(p) == 0)
    }

    /// Distinct roots of `polynomial` inside (0, 1) where the conditions hold: with signs σᵢ of the weights, the mean of
    /// Π σᵢ^eᵢ over all exponents eᵢ in {1, 2} is 1 where all are positive and 0 elsewhere; 1 − σ² is 1 where a weight is zero.
    fn inside(&self, polynomial: &Polynomial) -> u32 {
        let one = Polynomial::new(vec![BigInt::one()]);
        let reduced = |p: Polynomial| p.pseudo_remainder(polynomial).primitive();
        let mut weights = vec![one.clone()];
        for weight in &self.positive {
            let weight = reduced(weight.clone());
            let both = [weight.clone(), reduced(weight.times(&weight))];
            weights = (weights.iter())
                .flat_map(|w| both.iter().map(|b| reduced(w.times(b))))
                .collect();
        }
        let query = |weight: &Polynomial| {
            let [low, high] = [0, 1].map(|end| Dyadic::new(BigInt::from(end), 0));
            Sturm::weighted(polynomial, weight).between(&low, &high)
        };
        let sum: i64 = weights
            .iter()
            .map(|weight| {
                let elsewhere = self.zero.as_ref().map_or(0, |zero| {
                    let square = reduced(zero.times(zero));
                    query(&reduced(weight.times(&square)))
                });
                query(weight) - elsewhere
            })
            .sum();
        u32::try_from(sum).unwrap_or(0) >> self.positive.len()
    }
}
