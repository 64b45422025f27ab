//! Which of two crossings comes first, where rounding alone cannot tell; and that many rays are answered as one.

use super::compare::{all, ours, revolve, truth};
use glam::DVec3;
use photolathe::geometry::hit::{Crossing, Side};
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::exact::{certified, crossings};
use photolathe::geometry::revolution::{Placement, Revolution, Solver};
use photolathe::geometry::specimens::{Specimen, line, piece};
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::numeric::work::Work;

fn many(shape: &Revolution, ray: &Ray) -> Option<Crossing> {
    let mut found = [None];
    let mut work = Work::default();
    shape.nearest_many(&[*ray], &Solver::Bernstein, &mut found, &mut work);
    found[0]
}

/// Asserts that the nearest crossing is on the piece on which the exact solver has it, to the bit the same among many rays; and all
/// crossings in its order.
#[track_caller]
fn in_order(shape: &Revolution, ray: &Ray) {
    let (found, expected) = (ours(shape, ray), truth(shape, ray));
    let piece = |crossing: &Crossing| crossing.piece;
    let first = expected.first();
    assert_eq!(found.as_ref().map(piece), first.map(piece), "{ray:?}");
    let bits = |found: Option<Crossing>| found.map(|c| (c.piece, c.t.to_bits(), c.u.to_bits()));
    assert_eq!(bits(many(shape, ray)), bits(found), "{ray:?}");
    let pieces = |list: &[Crossing]| list.iter().map(piece).collect::<Vec<_>>();
    assert_eq!(pieces(&all(shape, ray)), pieces(&expected), "{ray:?}");
}

/// A disc within rounding of the point where a ray meets a curved piece, above or below it: heights and t of roots are compared with
/// their tolerances, not as they stand.
#[test]
fn a_disc_within_rounding_of_another_crossing_comes_in_its_order() {
    for index in 0..6000 {
        let s = &mut Stream::new(97, Purpose::Test, index);
        let curved = piece(
            [(); 4].map(|()| s.range(0.1, 1.8)),
            [-1.0, s.range(-1.0, 0.9), s.range(-0.9, 1.0), 1.0],
        );
        let coordinate = |s: &mut Stream| s.range(-1.0, 1.0);
        let o = DVec3::new(coordinate(s), coordinate(s), coordinate(s));
        let d = DVec3::new(coordinate(s), coordinate(s), coordinate(s));
        let ray = Ray::new(o, d);
        let alone = Profile::new(vec![curved]).expect("a piece is a profile");
        let Some(first) = crossings(&alone, &ray).first().copied() else {
            continue;
        };
        let at = ray.at(first.t);
        let (radius, off) = (libm::hypot(at.x, at.z), libm::exp10(s.range(-17.5, -8.0)));
        let height = at.y + if s.uniform() < 0.5 { off } else { -off };
        let disc = [[radius + 0.05, height], [radius - 0.05, height]];
        let end = [curved.radius[3], curved.height[3]];
        let shape = revolve(vec![curved, line(end, disc[0]), line(disc[0], disc[1])]);
        in_order(&shape, &ray);
    }
}

/// Both found by rays aimed at heights that a root was thought to have, and at roots whose tolerances overlap.
#[test]
fn two_rays_that_met_the_wrong_piece_first_meet_the_right_one() {
    let shape = revolve(vec![
        piece(
            [
                1.0960365354198072,
                0.9526227833758717,
                1.646198190376686,
                0.5723476139304062,
            ],
            [-1.0, -0.6663962818192775, 0.5629842792626643, 1.0],
        ),
        piece(
            [
                0.5723476139304062,
                0.7867961280004386,
                1.001244642070471,
                1.2156931561405033,
            ],
            [
                1.0,
                0.5907691148984766,
                0.1815382297969531,
                -0.22769265530457045,
            ],
        ),
        piece(
            [
                1.2156931561405033,
                1.18235982280717,
                1.1490264894738367,
                1.1156931561405032,
            ],
            [-0.22769265530457045; 4],
        ),
    ]);
    let ray = Ray::new(
        DVec3::new(
            -0.8717831993054134,
            -0.5090363514525181,
            -0.8511736859265688,
        ),
        DVec3::new(-0.3222927969898288, 0.4401184253996104, 0.6368968968559947),
    );
    in_order(&shape, &ray);
    assert_eq!(ours(&shape, &ray).map(|c| c.piece), Some(2));
    let shape = revolve(vec![
        piece(
            [
                0.23962146348837035,
                0.26638798151951537,
                0.5682198710144328,
                0.8558856720757702,
            ],
            [-1.0, 0.05459443699666208, 0.9028341693904385, 1.0],
        ),
        piece(
            [
                0.8558856720757702,
                0.7647197889362658,
                0.6735539057967614,
                0.5823880226572571,
            ],
            [
                1.0,
                0.8604981816760686,
                0.7209963633521372,
                0.581494545028206,
            ],
        ),
        piece(
            [
                0.5823880226572571,
                0.5490546893239238,
                0.5157213559905904,
                0.48238802265725705,
            ],
            [0.581494545028206; 4],
        ),
    ]);
    let ray = Ray::new(
        DVec3::new(-0.530812003709717, 0.3662570176623088, -0.6273943004127414),
        DVec3::new(0.004006321257080425, 0.25415109144428943, 0.826510888531887),
    );
    in_order(&shape, &ray);
    assert_eq!(ours(&shape, &ray).map(|c| c.piece), Some(0));
}

/// What a ray alone leaves out after several roots on a piece, it leaves out among others, and the other way round.
#[test]
fn many_rays_leave_out_what_a_ray_alone_leaves_out() {
    let shape = revolve(vec![
        piece(
            [0.16583653516617192, 0.0, 0.0, 0.0],
            [1.0000004903293742, 1.25, 0.6832119192296471, 0.0],
        ),
        piece(
            [0.0, 0.5, -0.3401933338533616, 1.8330705586692226],
            [0.0, 0.0, 0.0, -0.47692531342897215],
        ),
        piece(
            [
                1.8330705586692226,
                0.5955203523918615,
                -0.07091407648791304,
                0.0,
            ],
            [-0.47692531342897215, 1.0, 0.0, 1.4076944214227303],
        ),
        piece(
            [
                0.0,
                1.0000008594152343,
                -0.0062863546577243135,
                3.000000000000374,
            ],
            [1.4076944214227303, 0.0, 2.863101421459205e-12, 0.5],
        ),
    ]);
    for (o, d) in [
        (
            [
                0.08069980770004545,
                -0.49893124072289863,
                -0.14902209902255167,
            ],
            [
                -0.10152957182843547,
                0.6277150654652317,
                0.18748747497794382,
            ],
        ),
        (
            [-2.649709333637053, -2.3488703565351714, -0.5020135910404369],
            [0.9297952642252398, 0.8242295942301406, 0.1761589394129781],
        ),
    ] {
        in_order(
            &shape,
            &Ray::new(DVec3::from_array(o), DVec3::from_array(d)),
        );
    }
}

/// The cup's floor as a slab so thin that both its faces are met at the same f64.
#[test]
fn crossings_at_the_same_number_come_in_their_true_order() {
    let slab = |thickness: f64| {
        let outline = [
            [0.0, 0.0],
            [1.0, 0.0],
            [1.0, 1.0],
            [0.9, 1.0],
            [0.9, thickness],
            [0.0, thickness],
        ];
        revolve(
            outline
                .windows(2)
                .map(|ends| line(ends[0], ends[1]))
                .collect(),
        )
    };
    for thickness in [1e-40, 1e-20, 2e-17, 5e-17, 1e-16] {
        let shape = slab(thickness);
        for d in [[0.0, -1.0, 0.0], [0.1, -0.7, 0.05]] {
            let down = Ray::new(DVec3::new(0.3, 0.5, 0.2), DVec3::from_array(d));
            in_order(&shape, &down);
            let exact: Vec<u32> = truth(&shape, &down).iter().map(|c| c.piece).collect();
            assert_eq!(exact, [4, 0], "{thickness}");
            let proven = certified(shape.profile(), &down);
            assert_eq!(proven.iter().map(|c| c.piece).collect::<Vec<_>>(), exact);
            let hit = shape.hit(&down, ours(&shape, &down).expect("the floor"));
            assert_eq!(hit.side_met(down.direction), Side::Front);
        }
    }
    let wall = Revolution::new(Specimen::ThinWall(1e-9).profile(), Placement::identity());
    for far in [1e6, 1e8] {
        in_order(&wall, &Ray::new(DVec3::new(0.3, far, 0.2), DVec3::NEG_Y));
    }
}

/// The range is open: no crossing is at an infinite t.
#[test]
fn a_crossing_beyond_the_greatest_number_is_none() {
    let cup = Profile::cup();
    let great = |values: [f64; 4]| values.map(|x| 1e140 * x);
    let pieces = cup.pieces().iter().map(|p| Piece {
        radius: great(p.radius),
        height: great(p.height),
    });
    let shape = revolve(pieces.collect());
    let ray = Ray::new(
        DVec3::new(
            -2.6341367223838303e141,
            7.657367280705013e141,
            -5.723127251535389e141,
        ),
        DVec3::new(
            3.6394570405328544e-171,
            -9.52687792496524e-171,
            7.608072855666198e-171,
        ),
    );
    assert_eq!((ours(&shape, &ray), many(&shape, &ray)), (None, None));
    assert_eq!((truth(&shape, &ray), all(&shape, &ray)), (vec![], vec![]));
}

/// Its sheets lie in one another, so that every crossing is one of three at the same t: no order to be found, and no work for it.
#[test]
fn a_fold_needs_no_exact_arithmetic() {
    let fold = Revolution::new(Specimen::Fold.profile(), Placement::identity());
    let (mut met, mut work) = (0, Work::default());
    for index in 0..500 {
        let s = &mut Stream::new(99, Purpose::Test, index);
        let [o, d] = [(); 2].map(|()| DVec3::from_array([(); 3].map(|()| s.range(-1.0, 1.0))));
        let ray = Ray::new(o - 3.0 * d, d);
        met += u32::from(fold.nearest(&ray, &Solver::Bernstein, &mut work).is_some());
    }
    assert!(met > 100 && work.solver_fallbacks < 5, "{met} {work:?}");
}
