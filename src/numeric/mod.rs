//! Numbers without pictures: keyed random numbers, polynomials, exact arithmetic, statistics, sums, work counters.

pub mod clock;
pub mod exact;
pub mod polynomial;
pub mod rng;
pub mod simd;
pub mod statistics;
pub mod sum;
pub mod work;
