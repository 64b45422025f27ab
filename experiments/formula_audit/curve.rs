//! The Bezier curve and its derivative.

use super::{Fault, Trial, compare};
use crate::geometry::profile::Profile;
use crate::lab::plot::{Axis, Plot, Series};
use crate::numeric::polynomial::{binomial, cubic};

pub(super) const FAULTS: &[Fault] = &[
    Fault {
        name: "no binomial",
        number: "2.1, M1",
        component: "Bezier curve",
        quantity: "P(½) of the constant curve 1",
        hides_where: "end points, which are still interpolated",
        property: "partition of unity: a constant curve is constant",
        examine: |_| {
            let ends = |f: Curve| f(&CONTROLS, 0.0) + 10.0 * f(&CONTROLS, 1.0);
            let shown = |f: Curve| f(&[1.0; 4], 0.5);
            compare(
                value as Curve,
                without_binomial,
                shown,
                ends,
                is_a_partition,
            )
        },
    },
    Fault {
        name: "derivative without its last point",
        number: "2.3, M3",
        component: "Bezier curve",
        quantity: "P′(½) of P = 0, 1, 2, 3",
        hides_where: "u = 0",
        property: "the derivative is that of the curve (extrapolated differences)",
        examine: |trial| slopes(trial, without_the_last_point),
    },
    Fault {
        name: "derivative with a degree too low",
        number: "2.4, M2",
        component: "Bezier curve",
        quantity: "P′(½) of P = 0, 1, 2, 3",
        hides_where: "u = 0",
        property: "the derivative is that of the curve (extrapolated differences)",
        examine: |trial| slopes(trial, with_a_degree_too_low),
    },
    Fault {
        name: "derivative as printed",
        number: "2.3, 2.4",
        component: "Bezier curve",
        quantity: "P′(½) of P = 0, 1, 2, 3",
        hides_where: "u = 0",
        property: "the derivative is that of the curve (extrapolated differences)",
        examine: |trial| slopes(trial, as_printed),
    },
];

/// A function of control values and u.
type Curve = fn(&[f64; 4], f64) -> f64;

/// P(u) = 3u.
const LINE: [f64; 4] = [0.0, 1.0, 2.0, 3.0];
/// Radii of a piece of the cup.
const CONTROLS: [f64; 4] = [0.2, -0.1, 3.8, 3.8];

fn value(c: &[f64; 4], u: f64) -> f64 {
    cubic(c, u).0
}

fn slope(c: &[f64; 4], u: f64) -> f64 {
    cubic(c, u).1
}

/// Σ Pᵢ (1−u)ⁿ⁻ⁱ uⁱ.
fn without_binomial(c: &[f64; 4], u: f64) -> f64 {
    (0..4).map(|i| c[i] * basis(3, i, u) / binomial(3, i)).sum()
}

/// B_{i,n}(u).
fn basis(n: usize, i: usize, u: f64) -> f64 {
    if i > n {
        return 0.0;
    }
    let powers = (0..n).fold(1.0, |product, k| product * if k < i { u } else { 1.0 - u });
    binomial(n, i) * powers
}

/// n Σ_{i ≤ last} Pᵢ (B_{i−1,n−1} − B_{i,degree}), with n = 3; right for last = 3 and degree = 2.
fn slope_by_sum(c: &[f64; 4], u: f64, last: usize, degree: usize) -> f64 {
    let before = |i: usize| i.checked_sub(1).map_or(0.0, |i| basis(2, i, u));
    let terms = (0..=last).map(|i| c[i] * (before(i) - basis(degree, i, u)));
    3.0 * terms.sum::<f64>()
}

fn without_the_last_point(c: &[f64; 4], u: f64) -> f64 {
    slope_by_sum(c, u, 2, 2)
}

fn with_a_degree_too_low(c: &[f64; 4], u: f64) -> f64 {
    slope_by_sum(c, u, 3, 1)
}

fn as_printed(c: &[f64; 4], u: f64) -> f64 {
    slope_by_sum(c, u, 2, 1)
}

fn is_a_partition(curve: Curve) -> bool {
    (0..=1000).all(|k| (curve(&[1.0; 4], f64::from(k) / 1000.0) - 1.0).abs() <= 4.0 * f64::EPSILON)
}

fn slopes(trial: &Trial, wrong: Curve) -> super::Finding {
    let at_start = |f: Curve| f(&CONTROLS, 0.0);
    let shown = |f: Curve| f(&LINE, 0.5);
    compare(slope as Curve, wrong, shown, at_start, |f| {
        is_the_derivative(trial, f)
    })
}

/// Central differences D(h) of a cubic have an error of c h² exactly, so (4 D(h/2) − D(h))/3 has none.
fn is_the_derivative(trial: &Trial, slope: Curve) -> bool {
    let mut stream = trial.stream(0);
    let cup = Profile::cup();
    cup.pieces().iter().all(|piece| {
        (0..100).all(|_| {
            let u = stream.uniform();
            let difference =
                |h: f64| (value(&piece.radius, u + h) - value(&piece.radius, u - h)) / (2.0 * h);
            let derivative = (4.0 * difference(0.125) - difference(0.25)) / 3.0;
            // Some ten roundings of values below 20, over h = 1/8.
            (slope(&piece.radius, u) - derivative).abs() < 1e-12
        })
    })
}

/// The derivative of P = 0, 1, 2, 3, right and wrong.
pub(super) fn plot() -> Plot {
    let along = |form: Curve| {
        let steps = (0..=20).map(|k| 0.05 * f64::from(k));
        steps.map(move |u| (u, form(&LINE, u)))
    };
    let wrong: [(&str, Curve); 3] = [
        ("without its last point", without_the_last_point),
        ("with a degree too low", with_a_degree_too_low),
        ("as printed: both", as_printed),
    ];
    let wrong = wrong.map(|(name, form)| Series::measured(name, along(form)));
    Plot::new(
        "Wrong derivatives are right at u = 0",
        Axis::linear("u"),
        Axis::linear("dP/du of the control values 0, 1, 2, 3"),
        wrong
            .into_iter()
            .chain([Series::predicted("right", along(slope))]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_with_the_right_limits_is_the_derivative_and_the_printed_one_is_as_tabulated() {
        for u in [0.0, 0.3, 1.0] {
            assert!((slope_by_sum(&CONTROLS, u, 3, 2) - slope(&CONTROLS, u)).abs() < 1e-14);
        }
        assert_eq!(
            [0.0, 0.5, 1.0].map(|u| as_printed(&LINE, u)),
            [3.0, 2.25, -3.0]
        );
        assert_eq!(without_binomial(&[1.0; 4], 0.5), 0.5);
    }
}
