//! Every bounding volume: conservative, without influence on the hits, and as tight as its kind can be.

use super::aim;
use super::profiles::random_profile;
use super::{in_place, reversed};
use glam::DVec3;
use photolathe::geometry::bounds::{Bounding, Cylinder, Volume};
use photolathe::geometry::profile::Profile;
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::newton::NewtonSettings;
use photolathe::geometry::revolution::{Placement, Revolution, Solver, exact};
use photolathe::lab::families::Family;
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::numeric::work::Work;

/// An implementation of the volume test for one kind.
type Interval = fn(Bounding, &Profile, &Ray) -> Option<(f64, f64)>;

fn ours(kind: Bounding, profile: &Profile, ray: &Ray) -> Option<(f64, f64)> {
    Volume::new(kind, profile).interval(ray)
}

/// A ray that touches the cylinder of the profile: tangent to its wall, along its wall, or in the plane of a cap; `index` says
/// which, and whether by an ulp inside or outside.
fn touching(profile: &Profile, index: u64) -> Ray {
    let mut s = Stream::new(23, Purpose::Test, index);
    let cylinder = Cylinder::of(profile);
    let ends: Vec<[f64; 2]> = profile.pieces().iter().map(|p| p.point(3)).collect();
    let [r, h] = ends[index as usize % ends.len()];
    let mut radius = if s.uniform() < 0.5 {
        cylinder.radius
    } else {
        r
    };
    if s.uniform() < 0.5 {
        radius = if s.uniform() < 0.5 {
            radius.next_up()
        } else {
            radius.next_down()
        };
    }
    let height = s.range(cylinder.bottom, cylinder.top);
    let far = 4.0 * (cylinder.radius + height.abs() + 1.0);
    match index % 3 {
        0 => Ray::new(
            DVec3::new(radius, height, -far),
            DVec3::new(0.0, s.range(-0.2, 0.2), 1.0),
        ),
        1 => Ray::new(DVec3::new(0.0, far, radius), DVec3::NEG_Y),
        _ => Ray::new(DVec3::new(-far, h, 0.1 * r), DVec3::X),
    }
}

/// Rays of every family and touching rays, `count` of each.
fn all_rays(profile: &Profile, count: u64) -> impl Iterator<Item = Ray> {
    let families = aim::all_rays(&in_place(profile), count).into_iter();
    let families = families.map(|(_, ray)| ray);
    families.chain((0..count).map(|index| touching(profile, index)))
}

/// Rays of which the implementation culls an exact crossing or leaves it outside its interval.
fn lost(interval: Interval, kind: Bounding, profile: &Profile, count: u64) -> usize {
    let is_lost = |ray: &Ray| {
        let crossings = exact::crossings(profile, ray);
        match interval(kind, profile, ray) {
            Some((low, high)) => crossings.iter().any(|c| c.t < low || high < c.t),
            None => !crossings.is_empty(),
        }
    };
    all_rays(profile, count).filter(is_lost).count()
}

#[test]
fn no_volume_loses_a_crossing_of_the_oracle() {
    let known = [Profile::cup(), Profile::hourglass(), reversed()];
    let random = (0..12).map(random_profile);
    for (index, profile) in known.into_iter().chain(random).enumerate() {
        for kind in Bounding::ALL {
            assert_eq!(lost(ours, kind, &profile, 6), 0, "{kind:?} profile {index}");
        }
    }
}

/// A ball through the ends of the pieces: curves bulge out of it.
fn ball_of_the_ends(_: Bounding, profile: &Profile, ray: &Ray) -> Option<(f64, f64)> {
    let bound = Cylinder::of(profile);
    let middle = 0.5 * (bound.bottom + bound.top);
    let ends = profile.pieces().iter().map(|p| p.point(3));
    let radius = ends
        .map(|[r, h]| libm::hypot(r, h - middle))
        .fold(0.0, f64::max);
    Volume::Ball { middle, radius }.interval(ray)
}

/// A box test that drops rays along its faces, as `0 * inf` does.
fn box_without_flat_rays(_: Bounding, profile: &Profile, ray: &Ray) -> Option<(f64, f64)> {
    let flat = ray.direction.abs().min_element() == 0.0;
    ours(Bounding::Box, profile, ray).filter(|_| !flat)
}

#[test]
fn the_test_sees_known_wrong_volumes() {
    assert!(lost(ball_of_the_ends, Bounding::Sphere, &reversed(), 20) > 0);
    assert!(lost(box_without_flat_rays, Bounding::Box, &Profile::cup(), 5) > 0);
}

/// 0 of 100,000 rays: the rate of rays whose answer a volume changes is below 3e-5 (95 %). The oracle is the default solver behind
/// no volume at all.
#[test]
fn hits_are_the_same_behind_every_volume() {
    let mut rays_seen = 0;
    let mut hits = 0;
    for index in 0..60 {
        let profile = match index {
            0 => Profile::cup(),
            1 => Profile::hourglass(),
            _ => random_profile(index),
        };
        let bare =
            Revolution::new(profile.clone(), Placement::identity()).bounded_by(Bounding::None);
        let volumes = Bounding::ALL.map(|kind| Volume::new(kind, &profile));
        let shapes = Bounding::ALL.map(|kind| bare.clone().bounded_by(kind));
        for ray in all_rays(&profile, 120) {
            let mut work = Work::default();
            let expected = bare.nearest(&ray, &Solver::Bernstein, &mut work);
            for volume in &volumes {
                let met = volume.interval(&ray);
                assert!(
                    met.is_some() || expected.is_none(),
                    "{volume:?} {index} {ray:?}"
                );
            }
            let shape = &shapes[1 + rays_seen % 5];
            let found = shape.nearest(&ray, &Solver::Bernstein, &mut work);
            assert_eq!(found, expected, "profile {index} {ray:?}");
            hits += usize::from(expected.is_some());
            rays_seen += 1;
        }
    }
    assert!(rays_seen >= 100_000 && hits > 50_000, "{rays_seen} {hits}");
}

#[test]
fn other_solvers_see_the_same_hits_behind_every_volume() {
    let newton = Solver::Newton(NewtonSettings {
        starts: 5,
        ..NewtonSettings::default()
    });
    let cup = Revolution::new(Profile::cup(), Placement::identity());
    for solver in [newton, Solver::Exact] {
        for ray in all_rays(&Profile::cup(), 8) {
            let expected = cup.crossings(&ray, &solver, &mut Work::default());
            for kind in Bounding::ALL {
                let shape = cup.clone().bounded_by(kind);
                let found = shape.crossings(&ray, &solver, &mut Work::default());
                assert_eq!(found, expected, "{kind:?}");
            }
        }
    }
}

/// Counts of culled rays over rays aimed at three times the width of the profile: each kind within what it contains.
#[test]
fn tighter_volumes_cull_more_and_the_counters_say_how_many() {
    for profile in [Profile::cup(), reversed()] {
        let mut wide = profile.pieces().to_vec();
        for piece in &mut wide {
            piece.radius = piece.radius.map(|r| 3.0 * r);
        }
        let wide = in_place(&Profile::new(wide).expect("the pieces still join"));
        let count = 3000;
        let mut misses = 0;
        let culled = Bounding::ALL.map(|kind| {
            let shape = Revolution::new(profile.clone(), Placement::identity()).bounded_by(kind);
            let mut work = Work::default();
            misses = 0;
            for ray in aim::rays(&wide, Family::Random, count) {
                let hit = shape.nearest(&ray, &Solver::Bernstein, &mut work);
                misses += u64::from(hit.is_none());
            }
            assert_eq!(work.bounds_culled + work.solver_calls, count);
            assert_eq!(
                work.bounds_tests,
                count * Volume::new(kind, &profile).tests()
            );
            assert!(work.bounds_culled <= misses);
            work.bounds_culled
        });
        let [none, cylinder, hull, pieces, square, sphere] = culled;
        assert_eq!(none, 0);
        assert!(hull <= cylinder && cylinder <= pieces && square <= cylinder);
        assert!(
            sphere > 0 && 4 * cylinder > 3 * misses,
            "{culled:?} of {misses}"
        );
    }
}

#[test]
fn volumes_take_rays_of_any_size() {
    for kind in Bounding::ALL {
        let volume = Volume::new(kind, &Profile::cup());
        for power in (-300..=300).step_by(50) {
            let s = libm::exp10(f64::from(power));
            for d in [[1.0, 0.25, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.5]] {
                let d = DVec3::from_array(d);
                let aimed = Ray::new(DVec3::Y - 9.0 * d, d * s);
                let (low, high) = volume.interval(&aimed).expect("not culled");
                assert!(low * s <= 9.0 && high * s >= 9.0, "{kind:?} 1e{power}");
            }
        }
        let far = Ray::new(DVec3::new(1e300, 1.0, 0.0), DVec3::NEG_X);
        assert!(volume.interval(&far).is_some(), "{kind:?}");
    }
}
