//! What a surface does to a ray: the lobes of a material at a hit, and exact Fresnel.

use crate::geometry::hit::{Hit, Side};
use crate::scene::{Rgb, Scene};
use glam::DVec3;

/// The scattering of a material at a hit, for light or a camera ray arriving along one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobes {
    /// Side of the surface on which the light or ray arrives; what is reflected leaves there, what is refracted on the other.
    pub side: Side,
    /// Diffuse reflectance.
    pub diffuse: Rgb,
    /// Mirror reflectance.
    pub mirror: Rgb,
    /// Dielectric interface.
    pub interface: Option<Interface>,
}

/// A smooth dielectric interface met along one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// Fresnel reflectance of unpolarised light; 1 for total internal reflection.
    pub reflectance: f64,
    /// Unit direction of refraction; `None` for total internal reflection.
    pub refracted: Option<DVec3>,
    /// The dielectric object beyond the interface; `None` for the outside.
    pub beyond: Option<usize>,
    /// Factor of radiance carried against the light (camera paths) through the interface: (n_i/n_t)².
    pub radiance_scale: f64,
}

impl Lobes {
    /// The lobes at `hit` for a unit `direction` of arrival.
    pub fn at(scene: &Scene, hit: &Hit, direction: DVec3) -> Self {
        let material = scene.material(hit);
        let side = hit.side_met(direction);
        let diffuse = material
            .diffuse
            .as_ref()
            .map_or(Rgb::ZERO, |pattern| pattern.on(hit));
        let mirror = material.mirror.unwrap_or(Rgb::ZERO);
        let interface = material.dielectric.map(|dielectric| {
            let entering = side == Side::Front;
            let eta = if entering {
                dielectric.ior
            } else {
                1.0 / dielectric.ior
            };
            let normal = hit.normal_on(side);
            let (reflectance, refracted) = refract(direction, normal, eta);
            Interface {
                reflectance,
                refracted,
                beyond: entering.then_some(hit.object),
                radiance_scale: 1.0 / (eta * eta),
            }
        });
        Self {
            side,
            diffuse,
            mirror,
            interface,
        }
    }
}

/// Mirror direction of a unit `direction` at a unit `normal`.
pub fn reflect(direction: DVec3, normal: DVec3) -> DVec3 {
    (direction - 2.0 * direction.dot(normal) * normal).normalize()
}

/// Fresnel reflectance of unpolarised light at cosine of incidence `cos_i` ≥ 0 for relative index `eta` = n_t/n_i, and the
/// cosine of refraction (0 at and beyond the critical angle, where the reflectance is 1). Born and Wolf, section 1.5.
pub fn fresnel(cos_i: f64, eta: f64) -> (f64, f64) {
    let cos_i = cos_i.clamp(0.0, 1.0);
    // η² − sin²θ without cancellation near normal incidence.
    let below = (eta - 1.0) * (eta + 1.0) + cos_i * cos_i;
    if below <= 0.0 {
        return (1.0, 0.0);
    }
    let eta_cos_t = below.sqrt();
    let s = (cos_i - eta_cos_t) / (cos_i + eta_cos_t);
    let p = (eta * eta * cos_i - eta_cos_t) / (eta * eta * cos_i + eta_cos_t);
    (0.5 * (s * s + p * p), eta_cos_t / eta)
}

/// Fresnel reflectance and, below the critical angle, the unit direction of refraction for a unit `direction` that arrives
/// against the unit `normal`.
pub fn refract(direction: DVec3, normal: DVec3, eta: f64) -> (f64, Option<DVec3>) {
    let cos_i = -direction.dot(normal);
    let (reflectance, cos_t) = fresnel(cos_i, eta);
    if cos_t <= 0.0 {
        return (reflectance, None);
    }
    let refracted = direction / eta + (cos_i / eta - cos_t) * normal;
    (reflectance, Some(refracted.normalize()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fresnel_has_the_closed_values() {
        for (n, expected) in [(1.5, 0.04), (1.3, 0.017_013_232_514_177_7)] {
            assert!((fresnel(1.0, n).0 - expected).abs() < 1e-15);
            assert!((fresnel(1.0, 1.0 / n).0 - expected).abs() < 1e-15);
        }
        // Brewster's angle: the parallel part vanishes, so R = ½ R_s with R_s = cos²(2θ_B).
        let n: f64 = 1.5;
        let brewster = libm::atan(n);
        let r_s = libm::pow(libm::cos(2.0 * brewster), 2.0);
        assert!((fresnel(libm::cos(brewster), n).0 - 0.5 * r_s).abs() < 1e-15);
    }

    #[test]
    fn grazing_incidence_reflects_everything() {
        assert_eq!(fresnel(0.0, 1.5).0, 1.0);
    }

    #[test]
    fn matched_indices_change_nothing() {
        for cos in [1e-9, 0.1, 0.5, 1.0] {
            assert_eq!(fresnel(cos, 1.0).0, 0.0);
        }
        let direction = DVec3::new(0.6, -0.8, 0.0);
        let refracted = refract(direction, DVec3::Y, 1.0)
            .1
            .expect("no total reflection");
        assert!((refracted - direction).length() < 1e-15);
    }

    #[test]
    fn reflectance_is_continuous_at_the_critical_angle() {
        let eta: f64 = 1.0 / 1.5;
        let critical = (1.0 - eta * eta).sqrt();
        for cos in [critical.next_down(), critical, critical.next_up()] {
            let (reflectance, cos_t) = fresnel(cos, eta);
            assert!(
                reflectance > 1.0 - 1e-6 && reflectance <= 1.0 && cos_t.is_finite(),
                "{cos}: {reflectance}"
            );
        }
        assert_eq!(fresnel(critical - 1e-9, eta), (1.0, 0.0));
    }

    #[test]
    fn refraction_obeys_snell_and_is_reversible() {
        for (x, eta) in [(0.1, 1.5), (0.9, 1.5), (0.3, 1.0 / 1.5), (0.6, 1.3)] {
            let direction = DVec3::new(x, -(1.0_f64 - x * x).sqrt(), 0.0);
            let (r_in, refracted) = refract(direction, DVec3::Y, eta);
            let refracted = refracted.expect("below the critical angle");
            assert!((refracted.x * eta - direction.x).abs() < 1e-14);
            let (r_back, back) = refract(-refracted, -DVec3::Y, 1.0 / eta);
            assert!((back.expect("the way back is open") + direction).length() < 1e-13);
            assert!((r_in - r_back).abs() < 1e-13);
        }
    }
}
