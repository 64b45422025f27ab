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
