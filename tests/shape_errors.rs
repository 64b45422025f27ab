//! Spheres of all sizes, and error bounds of hits on flat shapes, in exact numbers.

use glam::DVec3;
use photolathe::geometry::planar::Quad;
use photolathe::geometry::ray::Ray;
use photolathe::geometry::sphere::Sphere;
use photolathe::numeric::exact::Dyadic;
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::scene::sampling::uniform_sphere;

#[test]
fn spheres_of_all_sizes_are_met_from_all_distances() {
    for (radius, far) in [
        (0.5, 1e17),
        (1e-170, 1e-169),
        (1e-155, 3e-155),
        (1e160, 1e161),
        (1e300, 1e301),
    ] {
        let sphere = Sphere {
            center: DVec3::ZERO,
            radius,
        };
        for outward in [DVec3::X, DVec3::new(0.6, 0.0, -0.8)] {
            let from = Ray::new(far * outward, -outward);
            let crossing = sphere.nearest(&from).expect("through the centre");
            let expected = far - radius;
            assert!((crossing.t - expected).abs() <= 1e-15 * far, "{radius}");
            let hit = sphere.hit(&from, crossing);
            assert!(
                (hit.normal - outward).length() < 1e-15,
                "{radius}: {}",
                hit.normal
            );
            let off = (hit.point / radius - outward).length() * radius;
            assert!(off <= hit.error.max(f64::MIN_POSITIVE), "{radius}: {off}");
        }
    }
}

/// The distance of a hit's point from the plane of two edges at any angle, in exact products, is within its bound.
#[test]
fn the_error_of_a_point_on_a_skew_quad_is_bounded() {
    let exact = |v: DVec3| v.to_array().map(Dyadic::from_f64);
    let mut tried = 0;
    for index in 0..4000 {
        let s = &mut Stream::new(98, Purpose::Test, index);
        let [u, w, d] = [(); 3].map(|()| uniform_sphere(s.uniform2()));
        let v = s.range(0.3, 3.0) * u + libm::exp10(s.range(-6.0, 0.0)) * w;
        let quad = Quad::new(DVec3::ZERO, u, v);
        let target = s.uniform() * u + s.uniform() * v;
        let ray = Ray::new(target - 3.0 * d, d);
        let Some(crossing) = quad.nearest(&ray) else {
            continue;
        };
        tried += 1;
        let hit = quad.hit(&ray, crossing);
        let [[px, py, pz], [ux, uy, uz], [vx, vy, vz]] = [hit.point, u, v].map(exact);
        let minus =
            |a: &Dyadic, b: &Dyadic, c: &Dyadic, d: &Dyadic| a.times(b).plus(&c.times(d).negated());
        let volume = (px.times(&minus(&uy, &vz, &uz, &vy)))
            .plus(&py.times(&minus(&uz, &vx, &ux, &vz)))
            .plus(&pz.times(&minus(&ux, &vy, &uy, &vx)));
        let off = volume.to_f64().abs() / u.cross(v).length();
        assert!(off <= hit.error, "{u} {v}: {off} {}", hit.error);
    }
    assert!(tried > 2000, "{tried}");
}
