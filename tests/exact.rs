//! Exact arithmetic: roots against planted ones and against a second route (Sturm) that shares no root-finding code.

use num_bigint::BigInt;
use num_traits::{Signed, Zero};
use photolathe::numeric::exact::{Dyadic, Polynomial};
use photolathe::numeric::rng::{Purpose, Stream};

/// Number of distinct roots in [0, 1] by Sturm's theorem; roots at the ends are divided out first, since the theorem asks for
/// ends that are no multiple roots.
fn sturm_count(polynomial: &Polynomial) -> usize {
    let first = polynomial.coefficients();
    let order = first.iter().take_while(|c| c.is_zero()).count();
    if order > 0 {
        return 1 + sturm_count(&Polynomial::new(first[order..].to_vec()));
    }
    let mut rest = polynomial.clone();
    while !rest.is_zero() && rest.coefficients().iter().sum::<BigInt>().is_zero() {
        rest = divided_by_one_minus_u(rest.coefficients());
    }
    if rest.degree() < polynomial.degree() {
        return 1 + sturm_count(&rest);
    }
    let slope = polynomial.derivative();
    let mut chain = vec![first.to_vec(), slope.coefficients().to_vec()];
    while chain.last().is_some_and(|p| !p.is_empty()) {
        let next = negative_remainder(&chain[chain.len() - 2], &chain[chain.len() - 1]);
        chain.push(next);
    }
    let changes = |at: &dyn Fn(&Vec<BigInt>) -> BigInt| {
        let values: Vec<BigInt> = chain.iter().map(at).filter(|v| !v.is_zero()).collect();
        let pairs = values.windows(2);
        pairs
            .filter(|w| w[0].is_negative() != w[1].is_negative())
            .count()
    };
    let at_zero = |p: &Vec<BigInt>| p.first().cloned().unwrap_or_default();
    changes(&at_zero) - changes(&|p| p.iter().sum())
}

fn divided_by_one_minus_u(p: &[BigInt]) -> Polynomial {
    let partial = p.iter().scan(BigInt::zero(), |sum, c| {
        *sum += c;
        Some(sum.clone())
    });
    Polynomial::new(partial.collect())
}

/// A positive multiple of −(a mod b).
fn negative_remainder(a: &[BigInt], b: &[BigInt]) -> Vec<BigInt> {
    let mut rest = a.to_vec();
    let lead = &b[b.len() - 1];
    while rest.len() >= b.len() {
        let top = rest[rest.len() - 1].clone();
        let offset = rest.len() - b.len();
        for c in &mut rest {
            *c *= lead.abs();
        }
        for (i, d) in b.iter().enumerate() {
            rest[offset + i] -= d * &top * lead.signum();
        }
        while rest.last().is_some_and(Zero::is_zero) {
            rest.pop();
        }
    }
    rest.into_iter().map(|c| -c).collect()
}

fn product(factors: &[Vec<i64>]) -> Polynomial {
    let mut result = vec![BigInt::from(1)];
    for factor in factors {
        let mut next = vec![BigInt::zero(); result.len() + factor.len() - 1];
        for (i, a) in result.iter().enumerate() {
            for (j, &b) in factor.iter().enumerate() {
                next[i + j] += a * b;
            }
        }
        result = next;
    }
    Polynomial::new(result)
}

/// Random products of linear factors (some repeated, some a hair apart, some outside) and of a factor without real roots.
#[test]
fn descartes_and_sturm_agree_on_random_and_clustered_polynomials() {
    for index in 0..3000 {
        let mut stream = Stream::new(8, Purpose::Test, index);
        let mut whole = |low: f64, high: f64| stream.range(low, high + 1.0).floor() as i64;
        let scale = [3, 7, 64, 1 << 20, 1_000_003][whole(0.0, 4.0) as usize];
        let mut numerators = vec![whole(-1.0, scale as f64 + 1.0)];
        for _ in 0..whole(0.0, 5.0) {
            let last = numerators[numerators.len() - 1];
            numerators.push(match whole(0.0, 3.0) {
                0 => last,
                1 => last + 1,
                _ => whole(-1.0, scale as f64 + 1.0),
            });
        }
        let mut factors: Vec<Vec<i64>> = numerators.iter().map(|n| vec![-n, scale]).collect();
        if whole(0.0, 2.0) == 0 {
            factors.push(vec![whole(1.0, 9.0), 1, 3]);
        }
        let polynomial = product(&factors);
        numerators.retain(|n| (0..=scale).contains(n));
        let total = numerators.len() as u32;
        numerators.sort_unstable();
        numerators.dedup();
        let mut roots = polynomial.roots();
        assert_eq!(roots.len(), numerators.len(), "polynomial {index}");
        assert_eq!(roots.len(), sturm_count(&polynomial), "polynomial {index}");
        assert_eq!(roots.iter().map(|r| r.multiplicity()).sum::<u32>(), total);
        let mut values: Vec<f64> = roots.iter_mut().map(|r| r.to_f64()).collect();
        values.sort_by(f64::total_cmp);
        for (value, numerator) in values.iter().zip(numerators) {
            assert!((value - numerator as f64 / scale as f64).abs() < 1e-15);
        }
    }
}

/// √½ is a root of 2u² − 1; the other polynomial has its root 10⁻⁶⁰ away.
#[test]
fn the_sign_of_a_polynomial_at_a_root_is_exact() {
    let mut root = product(&[vec![-1, 0, 2]]).roots().remove(0);
    let shared = product(&[vec![-1, 0, 2], vec![5, 1, 1]]);
    assert_eq!(root.sign_of(&shared), 0);
    let big = BigInt::from(10).pow(60);
    let near = |shift: i32| Polynomial::new(vec![-&big + shift, BigInt::zero(), &big * 2]);
    assert_eq!(root.sign_of(&near(1)), 1);
    assert_eq!(root.sign_of(&near(-1)), -1);
    assert!((root.value_of(&near(1)).to_f64() - 1.0).abs() < 1e-15);
}

#[test]
fn quotients_and_roots_of_dyadic_numbers_round_to_nearest() {
    for index in 0..5000 {
        let mut stream = Stream::new(9, Purpose::Test, index);
        let a = stream.range(-1.0, 1.0) * libm::scalbn(1.0, (index % 200) as i32 - 100);
        let b = stream.range(0.5, 1.0);
        let (x, y) = (Dyadic::from_f64(a), Dyadic::from_f64(b));
        assert_eq!(x.over(&y), a / b);
        assert_eq!(x.to_f64(), a);
        assert_eq!(x.times(&x).sqrt().to_f64(), a.abs());
        assert_eq!(x.plus(&y).to_f64(), a + b);
        assert_eq!(y.sqrt().to_f64(), b.sqrt());
    }
}
