//! Exact arithmetic: dyadic rationals, and the real roots in [0, 1] of polynomials with whole coefficients.
//!
//! Every finite f64 is a whole number times a power of two, so what is computed from f64 by +, − and × is exact here. Roots are
//! isolated by Descartes' rule in Bernstein form with bisection (Collins and Akritas 1976; Lane and Riesenfeld 1981), multiple
//! roots are split off by Yun's square-free decomposition (1976), and isolating intervals are narrowed by quadratic interval
//! refinement (Abbott 2006). All this is first tried in 128 bits with bounds of what they round away, which tell most roots, signs
//! and values for certain; whole numbers of any length decide the rest. Pairs of roots of w² = a s that a small a brings as near together as 10⁻³⁰⁰ are told apart by the
//! sign of w instead of by bisection ([`Branches`]). All answers are certain.
//!
//! A second route to the same counts, Sturm's theorem with Tarski's queries ([`Sturm`]), shares no root finding with the first;
//! tests hold the two against each other.

mod branches;
mod dyadic;
mod fixed;
mod isolate;
mod modular;
mod polynomial;
mod root;
mod row;
mod sturm;

pub use branches::Branches;
pub use dyadic::Dyadic;
use num_bigint::{BigInt, Sign};
pub use polynomial::Polynomial;
pub use root::Root;
pub use sturm::Sturm;

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
