//! From which side rays meet sharp edges.

use super::support::{placed, polygon};
use glam::DVec3;
use photolathe::geometry::hit::Side;
use photolathe::geometry::profile::Profile;
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::membership::Membership;
use photolathe::geometry::revolution::{Revolution, Solver};
use photolathe::numeric::work::Work;

/// An L in section: convex edges, and a concave one at (1, 1).
fn stepped() -> Revolution {
    placed(polygon(&[
        [0.0, 0.0],
        [3.0, 0.0],
        [3.0, 1.0],
        [1.0, 1.0],
        [1.0, 4.0],
        [0.0, 4.0],
    ]))
}

/// Rays of few bits exactly through an edge: each is met from the side on which the ray was before.
#[test]
fn a_ray_through_a_sharp_edge_is_met_from_where_it_comes() {
    let solid = stepped();
    let edges = [[3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 4.0]];
    let parts: [f64; 7] = [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0];
    let (mut met, mut split) = (0, 0);
    for [radius, height] in edges {
        let target = DVec3::new(radius, height, 0.0);
        for x in parts {
            for (y, z) in parts.iter().flat_map(|&y| parts.map(|z| (y, z))) {
                let direction = DVec3::new(x, y, z);
                let ray = Ray::new(target - direction / 64.0, direction);
                let before = solid.membership(ray.origin);
                let crossing = solid.nearest(&ray, &Solver::Bernstein, &mut Work::default());
                let Some(crossing) = crossing.filter(|c| (c.t * 64.0 - 1.0).abs() < 1e-9) else {
                    continue;
                };
                if before == Membership::On {
                    continue;
                }
                let hit = solid.hit(&ray, crossing);
                let expected = match before {
                    Membership::Inside => Side::Back,
                    _ => Side::Front,
                };
                assert_eq!(hit.side_met(direction), expected, "{target} {direction}");
                met += 1;
                split += u32::from(hit.piece != crossing.piece);
            }
        }
    }
    // Without the choice, those given to the other piece would be met from the wrong side.
    assert!(met > 400 && split > 20, "{met} {split}");
}

/// Rays of experiment `watertight` that meet the hourglass, a thin wall and the cup within an ulp of an edge, from outside; they
/// were once taken for rays from inside.
#[test]
fn rays_that_met_an_edge_from_the_wrong_side_meet_it_from_outside() {
    let hourglass = placed(Profile::hourglass());
    let cup = placed(Profile::cup());
    for (shape, origin, direction) in [
        (
            &cup,
            [
                1.499_649_396_130_130_7,
                0.348_153_530_323_860_4,
                -0.161_491_710_007_733_9,
            ],
            [
                0.400_350_603_869_869_2,
                -0.198_153_530_323_860_43,
                0.161_491_710_007_733_9,
            ],
        ),
        (
            &cup,
            [
                0.056_017_944_745_796_48,
                0.351_151_106_682_906_6,
                -1.473_355_860_058_175_8,
            ],
            [
                -0.056_017_944_745_796_48,
                -0.201_151_106_682_906_62,
                -0.426_644_139_941_824_15,
            ],
        ),
        (
            &hourglass,
            [
                -2.582_254_016_301_265_5,
                -0.125_965_516_437_604_12,
                0.244_201_439_229_633_78,
            ],
            [
                1.782_254_016_301_265_5,
                -0.874_034_483_562_395_9,
                -0.244_201_439_229_633_78,
            ],
        ),
        (
            &hourglass,
            [
                3.494_513_464_769_287,
                1.968_882_092_412_103_5,
                -4.705_851_925_286_01,
            ],
            [
                -0.575_459_734_647_133_3,
                -0.494_813_682_068_683_9,
                0.651_157_057_734_524,
            ],
        ),
    ] {
        let ray = Ray::new(DVec3::from_array(origin), DVec3::from_array(direction));
        let crossing = shape.nearest(&ray, &Solver::Bernstein, &mut Work::default());
        let hit = shape.hit(&ray, crossing.expect("a hit"));
        assert_eq!(shape.membership(ray.origin), Membership::Outside);
        assert_eq!(hit.side_met(ray.direction), Side::Front, "{hit:?}");
    }
}

/// The wall of a hole so narrow that its far side is met within the tolerance of an edge.
#[test]
fn the_far_side_of_a_hole_is_not_taken_for_the_edge_of_its_near_side() {
    let cone = placed(polygon(&[
        [1.0, 0.0],
        [1e-11, 1.0],
        [1e-11, 0.0],
        [1.0, 0.0],
    ]));
    let ray = Ray::new(DVec3::new(1.02e-11, 1.0 - 4e-13, 0.0), DVec3::NEG_X);
    assert_eq!(cone.membership(ray.origin), Membership::Inside);
    let crossing = cone.nearest(&ray, &Solver::Bernstein, &mut Work::default());
    let crossing = crossing.expect("the wall of the hole");
    let hit = cone.hit(&ray, crossing);
    assert_eq!((crossing.piece, hit.piece), (1, 1));
    assert_eq!(hit.side_met(ray.direction), Side::Back);
}

/// A ray that clips the rim meets it twice; each crossing has its own side.
#[test]
fn both_crossings_of_a_clipped_edge_keep_their_sides() {
    let hourglass = placed(Profile::hourglass());
    for off in [1e-13, 1e-12, 1e-11] {
        let o = DVec3::new(1.3 - 2.0 * off, -2.0 * off, 0.0);
        let ray = Ray::new(o, DVec3::new(-1.0, 2.0, 0.0));
        let met = hourglass.crossings(&ray, &Solver::Bernstein, &mut Work::default());
        let sides = met.iter().map(|&crossing| {
            let hit = hourglass.hit(&ray, crossing);
            (hit.piece, hit.side_met(ray.direction))
        });
        let sides: Vec<_> = sides.take(2).collect();
        assert_eq!(sides, [(4, Side::Front), (5, Side::Back)], "{off} {met:?}");
    }
}
