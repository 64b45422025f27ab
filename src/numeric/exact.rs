//! Exact arithmetic: dyadic rationals, and the real roots in [0, 1] of polynomials with whole coefficients.
//!
//! Every finite f64 is a whole number times a power of two, so what is computed from f64 by +, − and × is exact here. Roots are
//! isolated by Descartes' rule in Bernstein form with bisection (Collins and Akritas 1976; Lane and Riesenfeld 1981), multiple
//! roots are split off by Yun's square-free decomposition (1976), and isolating intervals are narrowed by quadratic interval
//! refinement (Abbott 2006). All answers are certain; time grows with the exponent range of the input.

mod dyadic;
mod polynomial;
mod root;

pub use dyadic::Dyadic;
use num_bigint::{BigInt, Sign};
pub use polynomial::Polynomial;
pub use root::Root;

/// Sign of a whole number: −1, 0 or 1.
pub fn sign(value: &BigInt) -> i32 {
    match value.sign() {
        Sign::Minus => -1,
        Sign::NoSign => 0,
        Sign::Plus => 1,
    }
}

/// The numbers between which a real t lies: neighbours, or twice the same where t is an f64.
///
/// `near` is within a few roundings of t, and `sign_above` gives the sign of t − limit.
pub fn bracket(near: f64, mut sign_above: impl FnMut(&Dyadic) -> i32) -> [f64; 2] {
    let mut at = near;
    let mut side = sign_above(&Dyadic::from_f64(at));
    loop {
        let next = match side {
            0 => return [at, at],
            s if s > 0 => at.next_up(),
            _ => at.next_down(),
        };
        if !next.is_finite() {
            return [at.min(next), at.max(next)];
        }
        let beyond = sign_above(&Dyadic::from_f64(next));
        if beyond != side {
            return match beyond {
                0 => [next, next],
                _ => [at.min(next), at.max(next)],
            };
        }
        (at, side) = (next, beyond);
    }
}
