//! Polynomials in Bernstein form on [0, 1].
//!
//! A polynomial of degree n is the list of its n + 1 coefficients c₀ … cₙ:
//!
//! ```text
//! p(u) = Σ C(n,i) cᵢ (1−u)ⁿ⁻ⁱ uⁱ
//! ```
//!
//! Coefficients bound the polynomial (it lies between the least and the greatest of them), c₀ and cₙ are its end values, and the
//! number of sign changes along the list bounds the number of roots in (0, 1), with equal parity.

/// C(n, k) as a float; exact for n ≤ 20 or so, which is all that is needed here.
pub fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |value, i| value * (n - i) as f64 / (i + 1) as f64)
}

/// The value at `u`, by de Casteljau's corner cutting (stable for u in [0, 1], exact at both ends). Zero for an empty list.
pub fn evaluate(coefficients: &[f64], u: f64) -> f64 {
    let mut work = coefficients.to_vec();
    for len in (1..work.len()).rev() {
        for i in 0..len {
            work[i] = (1.0 - u) * work[i] + u * work[i + 1];
        }
    }
    work.first().copied().unwrap_or(0.0)
}

/// The product: degree is the sum of the degrees.
pub fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let (m, n) = (a.len() - 1, b.len() - 1);
    (0..=m + n)
        .map(|k| {
            let sum: f64 = (k.saturating_sub(n)..=k.min(m))
                .map(|i| binomial(m, i) * binomial(n, k - i) * a[i] * b[k - i])
                .sum();
            sum / binomial(m + n, k)
        })
        .collect()
}

/// The same polynomial with coefficients of a higher degree.
pub fn elevate(coefficients: &[f64], degree: usize) -> Vec<f64> {
    product(coefficients, &vec![1.0; degree + 2 - coefficients.len()])
}

/// The derivative: degree falls by one.
pub fn derivative(coefficients: &[f64]) -> Vec<f64> {
    let degree = (coefficients.len() - 1) as f64;
    coefficients
        .windows(2)
        .map(|pair| degree * (pair[1] - pair[0]))
        .collect()
}

/// The integral over [0, 1]: the mean of the coefficients.
pub fn integral(coefficients: &[f64]) -> f64 {
    coefficients.iter().sum::<f64>() / coefficients.len() as f64
}

/// Value and derivative of the cubic with these coefficients. Exact at u = 0 and u = 1.
#[inline]
pub fn cubic(c: &[f64; 4], u: f64) -> (f64, f64) {
    let v = 1.0 - u;
    let value = (v * c[0] + 3.0 * u * c[1]) * (v * v) + (3.0 * v * c[2] + u * c[3]) * (u * u);
    let slope = (c[1] - c[0]) * (v * v) + 2.0 * (c[2] - c[1]) * (u * v) + (c[3] - c[2]) * (u * u);
    (value, 3.0 * slope)
}

/// The two parts of a polynomial of degree 6 cut at `s`, each in Bernstein form on its own [0, 1].
#[inline]
pub fn split(c: &[f64; 7], s: f64) -> ([f64; 7], [f64; 7]) {
    let mut left = [c[0]; 7];
    let mut right = *c;
    let rest = 1.0 - s;
    for (level, left) in left.iter_mut().enumerate().skip(1) {
        for i in 0..7 - level {
            right[i] = rest * right[i] + s * right[i + 1];
        }
        *left = right[0];
    }
    // After the loop `right` holds the right part already: entry i was last written at level 6 − i.
    (left, right)
}

/// Parameters strictly inside (0, 1) where the cubic's derivative is zero, ascending.
pub fn cubic_extrema(c: &[f64; 4]) -> Vec<f64> {
    let [d0, d1, d2] = [c[1] - c[0], c[2] - c[1], c[3] - c[2]];
    // d0 v² + 2 d1 u v + d2 u² = 0 in the ratio x = u / v: d2 x² + 2 d1 x + d0 = 0.
    let scale = d0.abs().max(d1.abs()).max(d2.abs());
    if scale == 0.0 {
        return Vec::new();
    }
    let [d0, d1, d2] = [d0 / scale, d1 / scale, d2 / scale];
    let discriminant = d1 * d1 - d0 * d2;
    if discriminant < 0.0 {
        return Vec::new();
    }
    let q = -(d1 + d1.signum() * discriminant.sqrt());
    // The roots x are q / d2 and d0 / q; as u = x / (1 + x) they need no division by a small number.
    let mut roots: Vec<f64> = [(q, d2), (d0, q)]
        .into_iter()
        .map(|(top, bottom)| top / (top + bottom))
        .filter(|u| *u > 0.0 && *u < 1.0)
        .collect();
    roots.sort_by(f64::total_cmp);
    roots.dedup();
    roots
}

#[cfg(test)]
mod tests {
    use super::*;

    const U: [f64; 5] = [0.0, 0.125, 0.4, 0.75, 1.0];

    #[test]
    fn the_basis_is_a_partition_of_unity() {
        for degree in 1..8 {
            for u in U {
                let one = evaluate(&vec![1.0; degree + 1], u);
                assert!((one - 1.0).abs() <= 4.0 * f64::EPSILON);
            }
        }
        for u in U {
            assert!((cubic(&[1.0; 4], u).0 - 1.0).abs() <= 4.0 * f64::EPSILON);
        }
    }

    #[test]
    fn a_cubic_has_the_value_and_slope_of_its_power_form() {
        // 0, 1, 2, 3 is the identity times three: the seed's faulty derivative gave 3, 2.25, −3 at 0, ½, 1.
        for u in U {
            let (value, slope) = cubic(&[0.0, 1.0, 2.0, 3.0], u);
            assert!((value - 3.0 * u).abs() < 1e-15 && (slope - 3.0).abs() < 1e-15);
            let (value, slope) = cubic(&[0.0, 0.0, 0.0, 1.0], u);
            assert!((value - u * u * u).abs() < 1e-15 && (slope - 3.0 * u * u).abs() < 1e-15);
        }
    }

    #[test]
    fn end_values_are_exact() {
        let c = [0.1, -0.7, 0.3, 0.9];
        assert_eq!((cubic(&c, 0.0).0, cubic(&c, 1.0).0), (c[0], c[3]));
        assert_eq!((evaluate(&c, 0.0), evaluate(&c, 1.0)), (c[0], c[3]));
    }

    #[test]
    fn products_elevations_and_derivatives_agree_with_values() {
        let a = [0.3, -1.0, 2.0, 0.5];
        let b = [1.5, 0.25, -0.75];
        let (ab, up, down) = (product(&a, &b), elevate(&a, 6), derivative(&a));
        assert_eq!((ab.len(), up.len(), down.len()), (6, 7, 3));
        for u in U {
            assert!((evaluate(&ab, u) - evaluate(&a, u) * evaluate(&b, u)).abs() < 1e-14);
            assert!((evaluate(&up, u) - evaluate(&a, u)).abs() < 1e-14);
            assert!((evaluate(&down, u) - cubic(&a, u).1).abs() < 1e-14);
        }
        assert!((integral(&[0.0, 0.0, 1.0]) - 1.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn the_halves_of_a_split_are_the_polynomial() {
        let c = [1.0, -2.0, 0.5, 3.0, -1.0, 0.25, 2.0];
        for s in [0.5, 0.3] {
            let (left, right) = split(&c, s);
            assert_eq!(left[6], right[0]);
            for u in U {
                assert!((evaluate(&left, u) - evaluate(&c, s * u)).abs() < 1e-14);
                assert!((evaluate(&right, u) - evaluate(&c, s + (1.0 - s) * u)).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn extrema_are_where_the_slope_is_zero() {
        assert_eq!(cubic_extrema(&[0.0, 1.0, 1.0, 0.0]), vec![0.5]);
        assert_eq!(cubic_extrema(&[0.0, 1.0, 2.0, 3.0]), Vec::<f64>::new());
        assert_eq!(cubic_extrema(&[2.0; 4]), Vec::<f64>::new());
        let c = [0.15, 0.23, -0.2, 0.4];
        let roots = cubic_extrema(&c);
        assert_eq!(roots.len(), 2);
        for u in roots {
            assert!(cubic(&c, u).1.abs() < 1e-15);
        }
    }
}
