//! Exact arithmetic: dyadic rationals, and the real roots in [0, 1] of polynomials with whole coefficients.
//!
//! Every finite f64 is a whole number times a power of two, so what is computed from f64 by +, − and × is exact here. Roots are
//! isolated by Descartes' rule in Bernstein form with bisection (Collins and Akritas 1976; Lane and Riesenfeld 1981), multiple
//! roots are split off by Yun's square-free decomposition (1976), and isolating intervals are narrowed by quadratic interval
//! refinement (Abbott 2006). Pairs of roots of w² = a s that a small a brings as near together as 10⁻³⁰⁰ are told apart by the
//! sign of w instead of by bisection ([`Branches`]). All answers are certain.
//!
//! A second route to the same counts, Sturm's theorem with Tarski's queries ([`Sturm`]), shares no root finding with the first;
//! tests hold the two against each other.

mod branches;
mod dyadic;
mod isolate;
mod modular;
mod polynomial;
mod root;
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
