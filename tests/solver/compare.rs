//! How answers are compared.

use glam::DVec3;
use photolathe::geometry::hit::Crossing;
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::{Placement, Revolution, Solver};
use photolathe::geometry::specimens::{Specimen, piece};
use photolathe::numeric::work::Work;

/// An implementation of "the nearest crossing".
pub(crate) type Nearest = fn(&Revolution, &Ray) -> Option<Crossing>;

/// The solver under test.
pub(crate) fn ours(shape: &Revolution, ray: &Ray) -> Option<Crossing> {
    shape.nearest(ray, &Solver::Bernstein, &mut Work::default())
}

/// The oracle.
pub(crate) fn truth(shape: &Revolution, ray: &Ray) -> Vec<Crossing> {
    shape.crossings(ray, &Solver::Exact, &mut Work::default())
}

/// All crossings by the solver under test.
pub(crate) fn all(shape: &Revolution, ray: &Ray) -> Vec<Crossing> {
    shape.crossings(ray, &Solver::Bernstein, &mut Work::default())
}

/// A placed profile that joins.
pub(crate) fn revolve(pieces: Vec<Piece>) -> Revolution {
    let profile = Profile::new(pieces).expect("the pieces join");
    Revolution::new(profile, Placement::identity())
}

/// A specimen in its own frame.
pub(crate) fn specimen(specimen: Specimen) -> Revolution {
    Revolution::new(specimen.profile(), Placement::identity())
}

/// h = r² for r in [0, 3], exact: r = 3u, h = 9u².
pub(crate) fn paraboloid() -> Revolution {
    revolve(vec![piece([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 3.0, 9.0])])
}

pub(crate) fn ray(o: [f64; 3], d: [f64; 3]) -> Ray {
    Ray::new(DVec3::from_array(o), DVec3::from_array(d))
}

/// The permitted error of t: 16 ulps of the coordinates over the cosine of incidence, and its square-root law at a tangency.
pub(crate) fn tolerance(shape: &Revolution, ray: &Ray, crossing: &Crossing) -> f64 {
    let speed = ray.direction.length();
    let normal = shape.hit(ray, *crossing).normal;
    let cosine = (normal.dot(ray.direction) / speed).abs();
    let profile = shape.profile().control_size();
    let size = ray.origin.length() + crossing.t.abs() * speed + profile.0 + profile.1;
    16.0 * f64::EPSILON * size / cosine.max(1e-8) / speed
}

/// Whether both answers are the same set of crossings, to the permitted error.
pub(crate) fn same(shape: &Revolution, ray: &Ray, ours: &[Crossing], truth: &[Crossing]) -> bool {
    ours.len() == truth.len()
        && ours
            .iter()
            .zip(truth)
            .all(|(a, b)| (a.t - b.t).abs() <= tolerance(shape, ray, b))
}

/// Asserts that both solvers give these crossings, to the permitted error, and that the nearest is the first.
#[track_caller]
pub(crate) fn meets(shape: &Revolution, ray: &Ray, expected: &[f64]) {
    let (ours_all, truth_all) = (all(shape, ray), truth(shape, ray));
    let at = |crossings: &[Crossing]| crossings.iter().map(|c| c.t).collect::<Vec<_>>();
    assert_eq!(ours_all.len(), expected.len(), "{ours_all:?} {expected:?}");
    for (found, t) in ours_all.iter().zip(expected) {
        let permitted = tolerance(shape, ray, found);
        assert!((found.t - t).abs() <= permitted, "{:?}", at(&ours_all));
    }
    assert!(same(shape, ray, &ours_all, &truth_all), "{truth_all:?}");
    let nearest: Vec<Crossing> = ours(shape, ray).into_iter().collect();
    let first: Vec<Crossing> = truth_all.into_iter().take(1).collect();
    assert!(same(shape, ray, &nearest, &first), "{nearest:?} {first:?}");
    for crossing in ours_all {
        let hit = shape.hit(ray, crossing);
        assert!(hit.point.is_finite() && hit.normal.is_finite() && hit.st().is_finite());
        assert!((hit.normal.length() - 1.0).abs() < 1e-14);
        assert!((0.0..std::f64::consts::TAU).contains(&hit.theta()));
    }
}
