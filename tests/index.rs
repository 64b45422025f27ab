//! Claims about the point indices. Every property is a function over an implementation: the tree passes, wrong ones fail.

use glam::DVec3;
use photolathe::index::grid::Grid;
use photolathe::index::kdtree::{KdTree, LEAF, Split};
use photolathe::index::linear::Linear;
use photolathe::index::wide::WideTree;
use photolathe::index::wide::swapped::Swapped;
use photolathe::index::{BallIndex, Balls, IndexError, curve};
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::numeric::simd::Vectors;
use photolathe::numeric::work::Work;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestCaseError};

fn found(index: &impl BallIndex, query: DVec3) -> Vec<usize> {
    let mut items = Vec::new();
    index.visit(query, &mut Work::default(), &mut |item| items.push(item));
    items.sort_unstable();
    items
}

fn joined(index: &impl BallIndex, queries: &[DVec3]) -> Vec<(usize, u64)> {
    // The count and a hash that depends on the order of the queries.
    let gather = |_: usize, hits: &[u32]| {
        let hash = hits.iter().fold(17_u64, |hash, &query| {
            hash.wrapping_mul(0x1_0000_01B3)
                .wrapping_add(u64::from(query))
        });
        (hits.len(), hash)
    };
    let answers = index.join(queries, &gather, &mut Work::default());
    answers.in_order()
}

fn trees(balls: &Balls) -> [KdTree; 2] {
    [Split::Cycle, Split::Widest].map(|split| {
        let tree = KdTree::new(balls, split);
        tree.check(split).expect("the structure is sound");
        tree
    })
}

/// Single queries and joins of every index equal the linear scan, with the queries as they come and along a curve.
fn agrees_with_the_scan(balls: &Balls, queries: &[DVec3]) {
    let order = curve::order(queries);
    let along: Vec<DVec3> = order.iter().map(|&i| queries[i as usize]).collect();
    for queries in [queries, &along] {
        for tree in trees(balls) {
            agree(&tree, balls, queries);
        }
        for vectors in Vectors::all() {
            agree(&WideTree::with(balls, vectors), balls, queries);
            agree(&Swapped::with(balls.clone(), vectors), balls, queries);
        }
        agree(&Grid::new(balls.clone()), balls, queries);
    }
}

fn agree(index: &impl BallIndex, balls: &Balls, queries: &[DVec3]) {
    let linear = Linear::new(balls.clone());
    for &query in queries {
        assert_eq!(found(index, query), found(&linear, query), "at {query}");
    }
    assert_eq!(joined(index, queries), joined(&linear, queries));
}

fn balls(centers: Vec<DVec3>, radius: f64) -> Balls {
    let radii_squared = vec![radius * radius; centers.len()];
    Balls::new(centers, radii_squared).expect("valid balls")
}

fn scattered(n: usize, index: u64) -> Vec<DVec3> {
    let mut stream = Stream::new(11, Purpose::Test, index);
    (0..n)
        .map(|_| DVec3::from_array(std::array::from_fn(|_| stream.uniform())))
        .collect()
}

#[test]
fn k1_none_to_three_balls_are_found_without_panic() {
    for n in 0..4 {
        agrees_with_the_scan(&balls(scattered(n, 0), 0.4), &scattered(50, 1));
    }
    assert!(found(&KdTree::new(&Balls::default(), Split::Widest), DVec3::ZERO).is_empty());
}

#[test]
fn k2_equal_centres_are_all_found_in_a_tree_of_bounded_depth() {
    let n = 100_000;
    let same = balls(vec![DVec3::new(0.1, 0.2, 0.3); n], 0.5);
    for tree in trees(&same) {
        assert!(tree.depth() <= 1 + (n / LEAF).ilog2() as usize + 1);
        assert_eq!(found(&tree, DVec3::new(0.1, 0.2, 0.8)).len(), n);
        assert!(found(&tree, DVec3::new(0.1, 0.2, 0.9)).is_empty());
    }
}

#[test]
fn k3_collinear_and_coplanar_centres_are_searched_rightly() {
    let queries = scattered(100, 2);
    let along = |direction: DVec3| (0..500).map(|i| f64::from(i) / 500.0 * direction).collect();
    agrees_with_the_scan(&balls(along(DVec3::X), 0.3), &queries);
    agrees_with_the_scan(&balls(along(DVec3::ONE), 0.3), &queries);
    let plane = scattered(500, 3)
        .into_iter()
        .map(|p| p.with_y(0.5))
        .collect();
    agrees_with_the_scan(&balls(plane, 0.3), &queries);
}

#[test]
fn k4_half_of_the_centres_on_the_median_key_change_nothing() {
    let mut centers = scattered(1000, 4);
    centers.iter_mut().step_by(2).for_each(|p| p.x = 0.5);
    let mut queries = scattered(100, 5);
    queries.iter_mut().step_by(2).for_each(|p| p.x = 0.5);
    agrees_with_the_scan(&balls(centers, 0.2), &queries);
}

/// Whether a search returns the points of an integer grid at a distance of exactly 5 (3-4-5 triangles).
fn border_belongs_to_the_ball(search: impl Fn(&[DVec3], f64, DVec3) -> Vec<usize>) -> bool {
    let grid: Vec<(i32, i32)> = (-5..=5)
        .flat_map(|x| (-5..=5).map(move |z| (x, z)))
        .collect();
    let expected: Vec<usize> = (0..grid.len())
        .filter(|&i| grid[i].0 * grid[i].0 + grid[i].1 * grid[i].1 <= 25)
        .collect();
    let points: Vec<DVec3> = grid
        .iter()
        .map(|&(x, z)| DVec3::new(f64::from(x), 7.0, f64::from(z)))
        .collect();
    search(&points, 5.0, DVec3::new(0.0, 7.0, 0.0)) == expected
}

#[test]
fn k5_a_ball_covers_its_border() {
    assert!(border_belongs_to_the_ball(|points, radius, query| {
        found(&Linear::new(balls(points.to_vec(), radius)), query)
    }));
    for split in [Split::Cycle, Split::Widest] {
        assert!(border_belongs_to_the_ball(|points, radius, query| {
            found(&KdTree::new(&balls(points.to_vec(), radius), split), query)
        }));
    }
    let strict = |points: &[DVec3], radius: f64, query: DVec3| {
        (0..points.len())
            .filter(|&i| points[i].distance_squared(query) < radius * radius)
            .collect()
    };
    assert!(!border_belongs_to_the_ball(strict));
}

#[test]
fn k6_radius_zero_finds_the_point_itself_and_infinity_finds_all() {
    let centers = scattered(200, 6);
    let points = balls(centers.clone(), 0.0);
    agrees_with_the_scan(&points, &centers);
    for tree in trees(&points) {
        assert_eq!(found(&tree, centers[17]), [17]);
    }
    let everything = balls(centers.clone(), f64::INFINITY);
    for tree in trees(&everything) {
        for query in [DVec3::ZERO, DVec3::splat(1e300), DVec3::splat(-1e-300)] {
            assert_eq!(found(&tree, query).len(), centers.len());
        }
    }
    for bad in [-1.0, f64::NAN] {
        assert_eq!(
            Balls::new(vec![DVec3::ZERO; 2], vec![1.0, bad]),
            Err(IndexError::Radius(1))
        );
        let mut tree = KdTree::new(&points, Split::Widest);
        assert!(tree.set_radii_squared(&vec![bad; 200]).is_err());
    }
}

#[test]
fn k7_extreme_coordinates_are_searched_rightly_and_those_that_are_not_finite_rejected() {
    let extremes = [0.0, -0.0, 5e-324, 1e-200, 1.0, 1e300, -1e300, f64::MAX];
    let mut points = Vec::new();
    for x in extremes {
        points.extend(extremes.iter().map(|&y| DVec3::new(x, y, -x)));
    }
    for radius in [0.0, 1e-170, 1.0, 1e154, 1e300, f64::INFINITY] {
        agrees_with_the_scan(&balls(points.clone(), radius), &points);
    }
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let centers = vec![DVec3::ZERO, DVec3::new(0.0, bad, 0.0)];
        assert_eq!(
            Balls::new(centers, vec![1.0; 2]),
            Err(IndexError::Center(1))
        );
    }
    let odd = [
        DVec3::NAN,
        DVec3::INFINITY,
        DVec3::new(f64::NEG_INFINITY, 0.0, 0.0),
    ];
    agrees_with_the_scan(&balls(points, 1.0), &odd);
    assert!(Balls::new(vec![DVec3::ZERO], vec![]).is_err());
}

/// Points at r (1 ± 2⁻ᵏ) of the centre of a ball for k up to 53, and some ulps around the ends of its axes: 32 for each ball.
fn around_the_borders(balls: &Balls, stream: &mut Stream) -> Vec<DVec3> {
    let mut points = Vec::new();
    for (&center, square) in balls.centers().iter().zip(balls.radii_squared()) {
        let radius = square.sqrt();
        for k in 0..16 {
            let towards: [f64; 3] = std::array::from_fn(|_| 2.0 * stream.uniform() - 1.0);
            let off = 2.0_f64.powi(-(16 + (37.0 * stream.uniform()) as i32));
            let away = radius * if k % 2 == 0 { 1.0 + off } else { 1.0 - off };
            points.push(center + away * DVec3::from_array(towards).normalize());
            let mut end = center;
            let axis = k % 3;
            end[axis] += radius;
            for _ in 0..k / 3 {
                end[axis] = if k % 2 == 0 {
                    end[axis].next_up()
                } else {
                    end[axis].next_down()
                };
            }
            points.push(end);
        }
    }
    points
}

/// From subnormal radii to those whose squares are near the largest number; balls around the origin of coordinates, a hundred radii
/// apart, and where f32 cannot tell them from each other; with one that covers everything among them, and queries that are nowhere.
#[test]
fn queries_a_hair_off_the_border_of_a_ball_are_decided_as_the_scan_does() {
    let mut stream = Stream::new(12, Purpose::Test, 0);
    for scale in [1e-310, 1e-160, 1e-30, 1e-20, 1.0, 1e17, 1e30, 1e150] {
        for apart in [0.0, 1.0, 100.0, 1e9] {
            let centers: Vec<DVec3> = scattered(40, 15)
                .iter()
                .map(|&p| scale * apart * (p - 0.5))
                .collect();
            let square = |i: usize| {
                let radius = scale * (0.5 + stream.uniform());
                if i == 33 {
                    f64::INFINITY
                } else {
                    radius * radius
                }
            };
            let squares: Vec<f64> = (0..centers.len()).map(square).collect();
            for kept in [1, 33, 40] {
                let (centers, squares) = (centers[..kept].to_vec(), squares[..kept].to_vec());
                let set = Balls::new(centers, squares).expect("valid balls");
                let mut queries = around_the_borders(&set, &mut stream);
                queries.extend([DVec3::NAN, DVec3::splat(f64::MAX), DVec3::NEG_INFINITY]);
                agrees_with_the_scan(&set, &queries);
            }
        }
    }
}

#[test]
fn k8_sorted_input_makes_no_difference() {
    let mut centers = scattered(2000, 7);
    centers.sort_by(|a, b| a.x.total_cmp(&b.x));
    agrees_with_the_scan(&balls(centers.clone(), 0.1), &scattered(50, 8));
    centers.reverse();
    agrees_with_the_scan(&balls(centers, 0.1), &scattered(50, 8));
}

#[test]
fn k9_queries_far_outside_or_on_a_split_plane_are_answered() {
    let centers: Vec<DVec3> = scattered(1000, 9)
        .iter()
        .map(|p| (*p * 8.0).floor() / 8.0)
        .collect();
    let mut queries = centers.clone();
    queries.extend([DVec3::splat(1e9), DVec3::new(-1e9, 0.5, 0.5)]);
    agrees_with_the_scan(&balls(centers, 0.125), &queries);
}

#[test]
fn new_radii_in_an_old_tree_equal_a_new_tree() {
    let centers = scattered(3000, 10);
    let mut stream = Stream::new(5, Purpose::Test, 1);
    let radii: Vec<f64> = centers.iter().map(|_| 0.01 * stream.uniform()).collect();
    let mut tree = KdTree::new(&balls(centers.clone(), 3.0), Split::Widest);
    tree.set_radii_squared(&radii).expect("valid radii");
    tree.check(Split::Widest).expect("sound after the change");
    let fresh = Linear::new(Balls::new(centers, radii).expect("valid balls"));
    let queries = scattered(500, 11);
    assert_eq!(joined(&tree, &queries), joined(&fresh, &queries));
}

#[test]
fn a_join_hands_out_the_same_lists_on_any_number_of_threads() {
    let set = balls(scattered(20_000, 12), 0.03);
    let queries = scattered(20_000, 13);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| {
            let mut work = Work::default();
            let tree = KdTree::new(&set, Split::Widest);
            let lists = tree.join(
                &queries,
                &|_, hits: &[u32]| (hits.len(), hits[0], hits[hits.len() - 1]),
                &mut work,
            );
            (lists.in_order(), work)
        })
    };
    let one = run(1);
    assert!(one.1.index_tests > 0 && one.1.index_tests < 20_000 * 20_000 / 10);
    assert_eq!(one, run(2));
    assert_eq!(one, run(3));
}

/// Seventeen balls in a row make a root and leaves of 8 and 9; each ball's centre asks once. Every query visits all three nodes
/// and is tested against the balls of the one leaf whose box holds it; single queries and the join do the same work.
#[test]
fn the_work_of_a_search_is_counted_node_by_node() {
    let row: Vec<DVec3> = (0..17).map(|i| f64::from(i) * DVec3::X).collect();
    let outside = DVec3::new(3.0, 1.0, 0.0);
    let count = |visits, tests| Work {
        index_visits: visits,
        index_tests: tests,
        ..Work::default()
    };
    let measure = |index: &dyn Fn(&[DVec3], &mut Work)| {
        let (mut inside, mut beside) = (Work::default(), Work::default());
        index(&row, &mut inside);
        index(&[outside], &mut beside);
        (inside, beside)
    };
    let tree = KdTree::new(&balls(row.clone(), 0.25), Split::Widest);
    let linear = Linear::new(balls(row.clone(), 0.25));
    let ask = |index: &dyn Fn(DVec3, &mut Work), queries: &[DVec3], work: &mut Work| {
        queries.iter().for_each(|&query| index(query, work));
    };
    let expected = (count(17 * 3, 8 * 8 + 9 * 9), count(1, 0));
    let single = |query, work: &mut Work| tree.visit(query, work, &mut |_| ());
    assert_eq!(measure(&|q, work| ask(&single, q, work)), expected);
    let join = |queries: &[DVec3], work: &mut Work| {
        tree.join(queries, &|_, hits: &[u32]| hits.len(), work);
    };
    assert_eq!(measure(&join), expected);
    let expected = (count(17, 17 * 17), count(1, 17));
    let single = |query, work: &mut Work| linear.visit(query, work, &mut |_| ());
    assert_eq!(measure(&|q, work| ask(&single, q, work)), expected);
    let join = |queries: &[DVec3], work: &mut Work| {
        linear.join(queries, &|_, hits: &[u32]| hits.len(), work);
    };
    assert_eq!(measure(&join), expected);
}

#[test]
fn a_tree_is_as_deep_as_halving_down_to_a_leaf_takes() {
    for (n, depth) in [(0, 1), (16, 1), (17, 2), (32, 2), (33, 3), (1000, 7)] {
        let tree = KdTree::new(&balls(scattered(n, 14), 0.1), Split::Cycle);
        assert_eq!(tree.depth(), depth, "{n} balls");
    }
}

#[test]
fn a_set_of_balls_knows_whether_it_is_empty() {
    assert!(Balls::default().is_empty());
    let two = balls(vec![DVec3::ZERO, DVec3::X], 1.0);
    assert!(!two.is_empty() && two.len() == 2);
}

/// Lattice coordinates: duplicates, collinear and coplanar sets, and distances exactly equal to the radius are common.
fn lattice(extent: i32) -> impl Strategy<Value = DVec3> {
    (0..=extent, 0..=extent, 0..=extent)
        .prop_map(|(x, y, z)| DVec3::new(f64::from(x), f64::from(y), f64::from(z)))
}

fn config() -> Config {
    Config {
        cases: 200,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1),
        ..Config::default()
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn any_set_of_balls_is_searched_like_the_scan(
        centers in prop_oneof![
            prop::collection::vec(lattice(12), 0..200),
            prop::collection::vec(lattice(2), 0..200),
            prop::collection::vec(lattice(20).prop_map(|p| p.with_y(3.0)), 0..200),
            prop::collection::vec(lattice(30).prop_map(|p| DVec3::splat(p.x)), 0..200),
            prop::collection::vec(prop::array::uniform3(-1e3..1e3).prop_map(DVec3::from_array), 0..200),
        ],
        queries in prop::collection::vec(lattice(12), 1..40),
        radii in prop::collection::vec(prop_oneof![Just(0.0), Just(3.0), Just(5.0), Just(13.0), 0.0..400.0], 200),
        scale in prop_oneof![Just(1.0), Just(1e-8), Just(0.1), Just(1e8)],
    ) {
        let squares = radii[..centers.len()].iter().map(|r| (r * scale) * (r * scale)).collect();
        let centers = centers.iter().map(|&p| scale * p).collect();
        let set = Balls::new(centers, squares).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let queries: Vec<DVec3> = queries.iter().map(|&p| scale * p).collect();
        agrees_with_the_scan(&set, &queries);
    }
}
