//! Where rays start that leave a surface of revolution.

use super::support::{
    Places, Start, Tally, certified, everywhere, far_away, leave_sheet, leave_solid, offset_alone,
    placed, polygon, towards,
};
use glam::DVec3;
use photolathe::geometry::hit::{Crossing, Side};
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::membership::Membership;
use photolathe::geometry::revolution::{Placement, Revolution, Solver};
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::numeric::work::Work;

/// A solid cylinder with a groove whose walls meet at an angle of 14 degrees.
fn grooved() -> Profile {
    polygon(&[
        [0.0, 0.0],
        [2.0, 0.0],
        [2.0, 1.0],
        [1.0, 1.125],
        [2.0, 1.25],
        [2.0, 3.0],
        [0.0, 3.0],
    ])
}

/// The number of wrong starts with the offset alone, after a check that the certified ones are right and need no flag.
#[track_caller]
fn repaired(
    leave: fn(&Revolution, &Places, Start) -> Tally,
    shape: &Revolution,
    places: &Places,
) -> u64 {
    let ours = leave(shape, places, certified);
    assert_eq!((ours.wrong, ours.work.unseparated), (0, 0), "{ours:?}");
    leave(shape, places, offset_alone).wrong
}

#[test]
fn a_ray_leaves_a_groove_into_the_groove_and_a_rim_into_the_rim() {
    let places = everywhere(&grooved());
    for shape in [placed(grooved()), far_away(grooved())] {
        assert!(repaired(leave_solid, &shape, &places) > 20);
    }
}

#[test]
fn a_ray_leaves_the_cup_and_the_hourglass_on_its_side_up_to_the_last_bit_of_a_joint() {
    for profile in [Profile::cup(), Profile::hourglass()] {
        let places = everywhere(&profile);
        for shape in [placed(profile.clone()), far_away(profile)] {
            let ours = leave_solid(&shape, &places, certified);
            assert_eq!((ours.wrong, ours.work.unseparated), (0, 0), "{ours:?}");
        }
    }
}

fn ring(inner: f64, outer: f64) -> Profile {
    polygon(&[
        [inner, -1.0],
        [outer, -1.0],
        [outer, 1.0],
        [inner, 1.0],
        [inner, -1.0],
    ])
}

fn along_the_walls() -> Places {
    let steps = (1..100).map(|k| f64::from(k) / 100.0);
    steps.flat_map(|u| [(1, u), (3, u)]).collect()
}

#[test]
fn a_wall_of_a_billionth_at_coordinates_of_a_million_is_not_jumped() {
    let wall = far_away(ring(1.0, 1.0 + 1e-9));
    assert!(repaired(leave_solid, &wall, &along_the_walls()) > 100);
}

#[test]
fn a_wall_thinner_than_the_offset_is_not_jumped() {
    let wall = placed(ring(1.0, 1.0 + 3e-14));
    assert!(repaired(leave_solid, &wall, &along_the_walls()) > 100);
}

/// Errors and thicknesses are compared in one frame: a surface of any size is left as the same one of size 1.
#[test]
fn a_wall_thinner_than_the_offset_is_not_jumped_at_any_scale() {
    for exponent in [-20, 20] {
        let scale = libm::scalbn(1.0, exponent);
        let placement = Placement::new(DVec3::ZERO, DVec3::Y, 0.0, scale);
        let wall = Revolution::new(ring(1.0, 1.0 + 3e-14), placement);
        assert!(repaired(leave_solid, &wall, &along_the_walls()) > 100);
        let cup = Revolution::new(Profile::cup(), placement);
        let places: Places = (1..40).map(|k| (k % 6, 0.3)).collect();
        let ours = leave_solid(&cup, &places, certified);
        assert_eq!((ours.wrong, ours.work.starts_tested), (0, 0), "{ours:?}");
    }
}

/// Three walls, each of a thickness and as far from the next: behind a gap and a whole wall the parity is right again.
fn walls(thickness: f64) -> Profile {
    let edge = |k: f64| 1.0 + k * thickness;
    let points: Vec<[f64; 2]> = (0..4)
        .flat_map(|k| {
            let (low, high) = (edge(2.0 * f64::from(k)), edge(2.0 * f64::from(k) + 1.0));
            [[low, 0.0], [low, 1.0], [high, 1.0], [high, 0.0]]
        })
        .collect();
    polygon(&points)
}

#[test]
fn no_sheet_is_skipped_between_walls_as_thin_as_the_offset() {
    let fold = walls(2e-14);
    let sheets: Places = (0..15).step_by(2).map(|piece| (piece, 0.5)).collect();
    assert!(repaired(leave_sheet, &placed(fold), &sheets) > 8);
}

#[test]
fn a_wall_that_no_point_separates_is_flagged() {
    let wall = far_away(ring(1.0, 1.0 + 1e-13));
    let tally = leave_solid(&wall, &along_the_walls(), certified);
    assert_eq!(tally.silent, 0);
    assert!(tally.work.unseparated > tally.starts / 4, "{tally:?}");
}

/// A solid whose outline comes to a point of zero angle at u = ½: x = 1 + (2u − 1)², y = 2 + (2u − 1)³.
fn cusped() -> Profile {
    let cusp = Piece {
        radius: [2.0, 2.0 / 3.0, 2.0 / 3.0, 2.0],
        height: [1.0, 3.0, 1.0, 3.0],
    };
    let floor = polygon(&[[0.0, 1.0], [2.0, 1.0]]).pieces()[0];
    let lid = polygon(&[[2.0, 3.0], [0.0, 3.0]]).pieces()[0];
    Profile::new(vec![floor, cusp, lid]).unwrap()
}

#[test]
fn a_ray_leaves_a_cusp_on_its_side_or_says_that_it_cannot() {
    let at = |k: i32| {
        let step = libm::scalbn(1.0, -k);
        [(1, 0.5 - step), (1, 0.5 + step)]
    };
    let cusp = placed(cusped());
    // The groove is 16 steps³ wide: 6e-14 and more, and then less than the rounding of its place.
    assert!(repaired(leave_solid, &cusp, &(2..17).flat_map(at).collect()) > 1);
    let ours = leave_solid(&cusp, &(17..50).flat_map(at).collect(), certified);
    assert_eq!(ours.silent, 0, "{ours:?}");
    assert!(ours.work.unseparated > 0, "{ours:?}");
}

#[test]
fn a_ray_leaves_the_tip_of_a_cone_on_its_side() {
    let spindle = polygon(&[[0.0, 0.0], [0.25, 3.0], [0.0, 6.0]]);
    let places = (towards(0.0).map(|u| (0, u)))
        .chain(towards(1.0).map(|u| (1, u)))
        .collect();
    let ours = leave_solid(&placed(spindle.clone()), &places, certified);
    assert_eq!(ours.silent, 0, "{ours:?}");
    assert!(ours.work.unseparated <= ours.starts / 50, "{ours:?}");
    assert!(leave_solid(&placed(spindle), &places, offset_alone).wrong > 0);
}

/// On a convex wall, a ray that leaves along the tangent plane, or a rounding below it, is free.
#[test]
fn a_ray_that_leaves_tangentially_meets_nothing() {
    let drum = placed(Profile::hourglass());
    let mut work = Work::default();
    for k in 1..200 {
        let theta = f64::from(k);
        let away = DVec3::new(libm::sin(theta), 0.0, libm::cos(theta));
        let crossing = Crossing {
            t: 0.0,
            piece: 4,
            u: 0.9 + 0.0005 * f64::from(k),
        };
        let hit = drum.hit(&Ray::new(away, away), crossing);
        let tangent = DVec3::new(away.z, 0.0, -away.x);
        for lean in [0.0, 1e-17, -1e-17] {
            let direction = (tangent + lean * hit.normal).normalize();
            let next = drum.leave(&hit, Side::Front, direction, &mut work);
            assert_eq!(drum.nearest(&next, &Solver::Exact, &mut work), None);
        }
    }
    assert_eq!(work.unseparated, 0);
}

/// An open bowl folded back at its rim: a mirror, not a solid.
#[test]
fn a_ray_leaves_an_open_sheet_on_its_side() {
    let bowl = polygon(&[[0.5, 0.0], [2.0, 0.25], [2.0, 1.0], [1.0, 0.5]]);
    let inner = everywhere(&bowl).into_iter();
    let inner = inner.filter(|&(_, u)| (1e-6..1.0 - 1e-6).contains(&u));
    let places: Places = inner.collect();
    for shape in [placed(bowl.clone()), far_away(bowl)] {
        let ours = leave_sheet(&shape, &places, certified);
        assert_eq!((ours.wrong, ours.work.unseparated), (0, 0), "{ours:?}");
    }
    let thin = polygon(&[
        [1.0, 0.0],
        [1.0, 1.0],
        [1.0 + 3e-14, 1.0],
        [1.0 + 3e-14, 0.0],
    ]);
    let places: Places = (1..100)
        .flat_map(|k| [(0, f64::from(k) / 100.0), (2, f64::from(k) / 100.0)])
        .collect();
    assert!(repaired(leave_sheet, &placed(thin), &places) > 50);
}

#[test]
fn ordinary_hits_need_no_test() {
    let mut stream = Stream::new(4, Purpose::Experiment, 0);
    for profile in [Profile::cup(), Profile::hourglass()] {
        let places: Places = (0..2000)
            .map(|_| ((6.0 * stream.uniform()) as u32, stream.uniform()))
            .collect();
        let ours = leave_solid(&placed(profile), &places, certified);
        assert_eq!((ours.wrong, ours.work.unseparated), (0, 0), "{ours:?}");
        assert!(ours.work.starts_tested < ours.starts / 100, "{ours:?}");
    }
}

/// The offset is as wide as the slab: the start on the other sheet is no start inside.
#[test]
fn a_start_does_not_lie_on_the_sheet_beyond() {
    let near = 2.842_170_943_040_481_5e-14_f64;
    for thickness in [
        near,
        near.next_down(),
        near.next_up(),
        0.25 * near,
        4.0 * near,
    ] {
        let slab = placed(polygon(&[
            [0.0, 0.0],
            [1.0, 0.0],
            [1.0, thickness],
            [0.0, thickness],
        ]));
        let up = Ray::new(DVec3::new(0.3, -1.0, 0.2), DVec3::Y);
        let crossing = slab.nearest(&up, &Solver::Bernstein, &mut Work::default());
        let hit = slab.hit(&up, crossing.expect("the slab"));
        let mut work = Work::default();
        let inside = slab.leave(&hit, Side::Back, DVec3::Y, &mut work);
        assert_eq!(work.unseparated, 0, "{thickness}");
        assert_eq!(
            slab.membership(inside.origin),
            Membership::Inside,
            "{thickness}"
        );
        let out = slab.nearest(&inside, &Solver::Bernstein, &mut Work::default());
        assert!(out.is_some(), "{thickness}");
    }
}
