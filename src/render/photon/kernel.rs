//! Kernels: what a photon at distance d from a hit point counts, within the radius r.
//!
//! A kernel is w(s)/(π r²) with s = d²/r² in [0, 1]. As the area element is π r² ds, its moments are integrals over s:
//!
//! ```text
//!                 w(s)               ∫ w = 1   ∫ s w   ∫ s² w   ∫ w²
//! disc            1                             1/2     1/3      1
//! epanechnikov    2 (1 − s)                     1/3     1/6      4/3     Epanechnikov 1969
//! fourth-order    6 (1 − s)(1 − 2 s)            0      −1/10     24/5    Gasser, Müller and Mammitzsch 1985, here over a disc
//! ```
//!
//! The mean of a smooth irradiance E over a circle of radius d is E + (d²/4) ∇²E + (d⁴/64) ∇⁴E + …, so an estimate has the bias
//! (r²/4) ∫sw ∇²E + (r⁴/64) ∫s²w ∇⁴E + …: of order r² unless the second moment vanishes. To do so, a kernel must be negative
//! somewhere. Its variance is ∫w² times that of the disc, for the same radius and small discs.

use crate::scene::options::Kernel;

impl Kernel {
    /// w(s) at s = d²/r² in [0, 1].
    pub fn weight(self, s: f64) -> f64 {
        match self {
            Self::Disc => 1.0,
            Self::Epanechnikov => 2.0 * (1.0 - s),
            Self::FourthOrder => 6.0 * (1.0 - s) * (1.0 - 2.0 * s),
        }
    }

    /// ∫ sᵏ w ds: the share of moment 2k.
    pub fn moment(self, k: u32) -> f64 {
        let power = |more: u32| 1.0 / f64::from(k + more);
        match self {
            Self::Disc => power(1),
            Self::Epanechnikov => 2.0 * (power(1) - power(2)),
            Self::FourthOrder => 6.0 * (power(1) - 3.0 * power(2) + 2.0 * power(3)),
        }
    }

    /// ∫ w² ds: the variance at a small radius over that of the disc.
    pub fn roughness(self) -> f64 {
        match self {
            Self::Disc => 1.0,
            Self::Epanechnikov => 4.0 / 3.0,
            Self::FourthOrder => 24.0 / 5.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ValueEnum as _;

    /// ∫ f over [0, 1] for polynomials up to degree 5 (Boole).
    fn integral(f: impl Fn(f64) -> f64) -> f64 {
        (7.0 * (f(0.0) + f(1.0)) + 32.0 * (f(0.25) + f(0.75)) + 12.0 * f(0.5)) / 90.0
    }

    type Weight<'a> = &'a dyn Fn(f64) -> f64;

    fn estimates_an_even_density(weight: Weight) -> bool {
        (integral(weight) - 1.0).abs() < 1e-14
    }

    fn has_no_second_moment(weight: Weight) -> bool {
        integral(|s| s * weight(s)).abs() < 1e-14
    }

    #[test]
    fn every_kernel_integrates_to_one_and_only_the_fourth_order_has_no_second_moment() {
        for kernel in Kernel::value_variants() {
            let weight = |s: f64| kernel.weight(s);
            assert!(estimates_an_even_density(&weight), "{kernel:?}");
            assert_eq!(
                has_no_second_moment(&weight),
                *kernel == Kernel::FourthOrder
            );
        }
        // Normalised as if over a line, and the kernel of the original, (1 − d/r)².
        assert!(!estimates_an_even_density(&|s| 1.5 * (1.0 - s)));
        assert!(!estimates_an_even_density(&|s| {
            let rest = 1.0 - s.sqrt();
            rest * rest
        }));
        // The fourth-order kernel of a line, 15/8 (1 − s)(1 − 7s/3)… does not do over a disc.
        assert!(!has_no_second_moment(&|s| (1.0 - s) * (1.0 - 7.0 * s / 3.0)));
    }

    #[test]
    fn moments_and_variance_factors_are_the_integrals() {
        for kernel in Kernel::value_variants() {
            for (k, power) in [(0, 0), (1, 1), (2, 2), (3, 3)] {
                let by_rule = integral(|s| s.powi(power) * kernel.weight(s));
                assert!((kernel.moment(k) - by_rule).abs() < 1e-14, "{kernel:?} {k}");
            }
            let square = integral(|s| kernel.weight(s) * kernel.weight(s));
            assert!((kernel.roughness() - square).abs() < 1e-14, "{kernel:?}");
        }
        assert_eq!(Kernel::Disc.moment(1), 0.5);
        assert!((Kernel::FourthOrder.moment(2) + 0.1).abs() < 1e-15);
    }

    #[test]
    fn kernels_but_the_disc_vanish_at_the_rim() {
        assert_eq!(Kernel::Disc.weight(1.0), 1.0);
        assert_eq!(Kernel::Epanechnikov.weight(1.0), 0.0);
        assert_eq!(Kernel::FourthOrder.weight(1.0), 0.0);
    }
}
