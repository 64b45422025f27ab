//! Newton's method: the Jacobian, the step, and where to start.

use super::{Fault, Finding, Trial, compare};
use crate::geometry::bounds::cubic_range;
use crate::geometry::hit::azimuth;
use crate::geometry::profile::{Piece, Profile};
use crate::geometry::revolution::newton::{StartPolicy, Starts, System, start_azimuth, step};
use crate::numeric::rng::Stream;
use glam::{DMat3, DVec3};
use std::f64::consts::{PI, TAU};

const JACOBIAN: &str = "each column is the derivative of F (extrapolated differences)";
const GAIN: &str = "error after one step from .03 off, over the error before (median)";
const ORDER_TWO: &str = "five steps from .03 off leave an error below 1e-10 in the median";
const AZIMUTH: &str = "S(u, θ) has the azimuth of the ray's point, and θ lies in one turn";

pub(super) const FAULTS: &[Fault] = &[
    Fault {
        name: "sign of the column of u",
        number: "2.6, M4",
        component: "Newton solver",
        quantity: GAIN,
        hides_where: "t of the step",
        property: JACOBIAN,
        examine: |trial| jacobians(trial, with_signs::<-1, 1>),
    },
    Fault {
        name: "sign of the column of θ",
        number: "2.7, M5",
        component: "Newton solver",
        quantity: GAIN,
        hides_where: "t of the step",
        property: JACOBIAN,
        examine: |trial| jacobians(trial, with_signs::<1, -1>),
    },
    Fault {
        name: "signs of both columns",
        number: "2.6, 2.7",
        component: "Newton solver",
        quantity: GAIN,
        hides_where: "t of the step",
        property: JACOBIAN,
        examine: |trial| jacobians(trial, with_signs::<-1, -1>),
    },
    Fault {
        name: "minimises |F|² by its gradient",
        number: "2.9",
        component: "Newton solver",
        quantity: GAIN,
        hides_where: "DF with orthogonal columns of one length",
        property: ORDER_TWO,
        examine: |trial| {
            let orthogonal = |f: Step| {
                let jacobian = DMat3::from_diagonal(DVec3::splat(2.0));
                f(&jacobian, DVec3::new(1.0, -2.0, 0.5)).map_or(f64::NAN, |s| s.dot(DVec3::ONE))
            };
            compare(
                step as Step,
                down_the_gradient,
                |f| gain(trial, jacobian, f),
                orthogonal,
                |f| {
                    median(
                        &(0..101)
                            .map(|i| errors(trial, i, jacobian, f)[5])
                            .collect::<Vec<_>>(),
                    ) < 1e-10
                },
            )
        },
    },
    Fault {
        name: "u of the start left open",
        number: "2.10",
        component: "Newton solver",
        quantity: "greatest |P_y(u) − height| of starts on a piece whose height turns back",
        hides_where: "pieces whose height is linear in u",
        property: "every start lies at its height, and every solution of P_y(u) = height is a start",
        examine: |trial| {
            let line = Piece::new([[1.0, 0.0], [2.0, 1.0], [2.0, 2.0], [1.0, 3.0]]);
            compare(
                of_solutions as Start,
                by_share_of_height,
                |f| off_height(&turning(), &f(&turning(), trial.stream(0), 200)),
                |f| off_height(&line, &f(&line, trial.stream(0), 200)),
                |f| starts_where_the_ray_is(trial, f),
            )
        },
    },
    Fault {
        name: "start above the box",
        number: "M6",
        component: "Newton solver",
        quantity: "mean height of starts in a box from 0.4 to 2",
        hides_where: "flat pieces, whose box has no height",
        property: "every start lies in the box of its piece",
        examine: |trial| {
            let wall = Profile::cup().pieces()[3];
            let disc = Piece::new([[0.0, 0.5], [1.0, 0.5], [2.0, 0.5], [3.0, 0.5]]);
            let count = trial.samples as usize / 10;
            let mean = |starts: Vec<[f64; 2]>| {
                starts.iter().map(|start| start[0]).sum::<f64>() / starts.len() as f64
            };
            compare(
                random as Start,
                above_the_box,
                |f| mean(f(&wall, trial.stream(0), count)),
                |f| mean(f(&disc, trial.stream(0), 10)),
                |f| {
                    let (low, high) = cubic_range(&wall.height);
                    let starts = f(&wall, trial.stream(1), count);
                    starts.iter().all(|s| low <= s[0] && s[0] <= high)
                },
            )
        },
    },
    Fault {
        name: "θ = atan2 of the other order",
        number: "2.11, M7",
        component: "Newton solver",
        quantity: "θ of the point (1, 0, 0)",
        hides_where: "the diagonal x = z",
        property: AZIMUTH,
        examine: |trial| {
            let diagonal = DVec3::new(1.0, 0.0, 1.0);
            azimuths(
                trial,
                |p| start_azimuth(DVec3::new(p.z, p.y, p.x)),
                DVec3::X,
                diagonal,
            )
        },
    },
    Fault {
        name: "θ < 0 wrapped to −θ + π",
        number: "M8",
        component: "Newton solver",
        quantity: "θ of the point (−1, 0, 1)",
        hides_where: "θ = −π/2, and all of x ≥ 0",
        property: AZIMUTH,
        examine: |trial| azimuths(trial, mirrored, DVec3::new(-1.0, 0.0, 1.0), -DVec3::X),
    },
];

type Jacobian = fn(&System, DVec3) -> DMat3;
type Step = fn(&DMat3, DVec3) -> Option<DVec3>;
/// The first so many starts (height, u) of a piece.
type Start = fn(&Piece, Stream, usize) -> Vec<[f64; 2]>;
type Azimuth = fn(DVec3) -> f64;

fn jacobian(system: &System, x: DVec3) -> DMat3 {
    system.evaluate(x).1
}

/// The right Jacobian with the columns of u and θ multiplied by signs.
fn with_signs<const U: i8, const THETA: i8>(system: &System, x: DVec3) -> DMat3 {
    let right = jacobian(system, x);
    DMat3::from_cols(
        right.x_axis,
        f64::from(U) * right.y_axis,
        f64::from(THETA) * right.z_axis,
    )
}

/// Steepest descent on |F|², its length by exact line search on the linear model.
fn down_the_gradient(jacobian: &DMat3, residual: DVec3) -> Option<DVec3> {
    let gradient = jacobian.transpose() * residual;
    let along = *jacobian * gradient;
    let step = gradient.length_squared() / along.length_squared() * gradient;
    step.is_finite().then_some(step)
}

/// A system with a planted root of the cup, and the root.
fn planted(trial: &Trial, index: u64) -> (Piece, DVec3, DVec3, DVec3) {
    let mut stream = trial.stream(index);
    let piece = Profile::cup().pieces()[(index % 6) as usize];
    let root = DVec3::new(
        stream.range(1.0, 5.0),
        stream.range(0.1, 0.9),
        stream.range(0.0, TAU),
    );
    let direction = DVec3::from_array([0; 3].map(|_| stream.range(-1.0, 1.0)));
    let (sin, cos) = libm::sincos(root.z);
    let station = piece.at(root.y);
    let point = DVec3::new(station.radius * sin, station.height, station.radius * cos);
    (piece, point - root.x * direction, direction, root)
}

/// Distances from a planted root before each of six steps from a start .03 off.
fn errors(trial: &Trial, index: u64, jacobian: Jacobian, step: Step) -> [f64; 6] {
    let (piece, origin, direction, root) = planted(trial, index);
    let system = System {
        piece: &piece,
        origin,
        direction,
    };
    let mut x = root + DVec3::new(0.02, 0.01, -0.02);
    [0; 6].map(|_| {
        let error = (x - root).length();
        x -= step(&jacobian(&system, x), system.evaluate(x).0).unwrap_or(DVec3::NAN);
        error
    })
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn gain(trial: &Trial, jacobian: Jacobian, step: Step) -> f64 {
    let gains = (0..101).map(|index| errors(trial, index, jacobian, step));
    median(&gains.map(|e| e[1] / e[0]).collect::<Vec<_>>())
}

fn jacobians(trial: &Trial, wrong: Jacobian) -> Finding {
    let t_of_steps = |f: Jacobian| {
        let t = (0..101).map(|index| {
            let (piece, origin, direction, root) = planted(trial, index);
            let system = System {
                piece: &piece,
                origin,
                direction,
            };
            let x = root + DVec3::new(0.02, 0.01, -0.02);
            step(&f(&system, x), system.evaluate(x).0).map_or(f64::NAN, |s| s.x)
        });
        median(&t.collect::<Vec<_>>())
    };
    let shown = |f| gain(trial, f, step);
    compare(jacobian as Jacobian, wrong, shown, t_of_steps, |f| {
        is_the_derivative(trial, f)
    })
}

/// (4 D(h/2) − D(h))/3 of central differences D has an error of about h⁴ times the fifth derivative: 4e-10 at h = 1/256.
fn is_the_derivative(trial: &Trial, jacobian: Jacobian) -> bool {
    (0..60).all(|index| {
        let (piece, origin, direction, x) = planted(trial, index);
        let system = System {
            piece: &piece,
            origin,
            direction,
        };
        let columns = jacobian(&system, x);
        (0..3).all(|column| {
            let difference = |h: f64| {
                let e = DVec3::AXES[column] * h;
                (system.evaluate(x + e).0 - system.evaluate(x - e).0) / (2.0 * h)
            };
            let derivative = (4.0 * difference(1.0 / 512.0) - difference(1.0 / 256.0)) / 3.0;
            (derivative - columns.col(column)).length() < 1e-7
        })
    })
}

/// A piece whose height runs 0, up, down and up again: heights near .5 have three solutions.
fn turning() -> Piece {
    Piece::new([[1.0, 0.0], [2.0, 2.0], [2.0, -1.0], [1.0, 1.0]])
}

fn starts(piece: &Piece, policy: StartPolicy, stream: Stream, count: usize) -> Vec<[f64; 2]> {
    let mut starts = Starts::new(piece, policy, stream);
    (0..count).map(|_| starts.next()).collect()
}

fn random(piece: &Piece, stream: Stream, count: usize) -> Vec<[f64; 2]> {
    starts(piece, StartPolicy::RandomU, stream, count)
}

fn of_solutions(piece: &Piece, stream: Stream, count: usize) -> Vec<[f64; 2]> {
    starts(piece, StartPolicy::SolveHeight, stream, count)
}

/// One u for each height: its share of the range, as if a height had one u.
fn by_share_of_height(piece: &Piece, stream: Stream, count: usize) -> Vec<[f64; 2]> {
    let (low, high) = cubic_range(&piece.height);
    let share = |[height, _]: [f64; 2]| [height, (height - low) / (high - low)];
    random(piece, stream, count)
        .into_iter()
        .map(share)
        .collect()
}

/// rand · (max − min) + max.
fn above_the_box(piece: &Piece, stream: Stream, count: usize) -> Vec<[f64; 2]> {
    let (low, high) = cubic_range(&piece.height);
    let raised = |[height, u]: [f64; 2]| [height + (high - low), u];
    random(piece, stream, count)
        .into_iter()
        .map(raised)
        .collect()
}

fn off_height(piece: &Piece, starts: &[[f64; 2]]) -> f64 {
    let off = |[height, u]: &[f64; 2]| (piece.at(*u).height - height).abs();
    starts.iter().map(off).fold(0.0, f64::max)
}

/// Starts lie at their heights, to the 2⁻¹² in u that a start needs, and on all three branches of a piece that turns back.
fn starts_where_the_ray_is(trial: &Trial, start: Start) -> bool {
    let starts = start(&turning(), trial.stream(1), 1000);
    // The height turns at u = ½ ± √3/6 … of a slope at most 6.
    let branches = [(0.0, 0.25), (0.4, 0.6), (0.75, 1.0)];
    let all_three = branches
        .iter()
        .all(|&(low, high)| starts.iter().any(|s| low < s[1] && s[1] < high));
    all_three && off_height(&turning(), &starts) < 6.0 / 4096.0
}

/// Wraps negative angles to −θ + π: the mirror image of the point.
fn mirrored(point: DVec3) -> f64 {
    let theta = start_azimuth(point);
    if theta < 0.0 { -theta + PI } else { theta }
}

/// The azimuth of hits, in [0, 2π).
fn in_one_turn(point: DVec3) -> f64 {
    azimuth(point.x, point.z)
}

fn azimuths(trial: &Trial, wrong: Azimuth, shown: DVec3, hidden: DVec3) -> Finding {
    let holds = |f: Azimuth| {
        let mut stream = trial.stream(0);
        (0..1000).all(|_| {
            let p = DVec3::new(stream.range(-2.0, 2.0), 0.0, stream.range(-2.0, 2.0));
            let theta = f(p);
            let (sin, cos) = libm::sincos(theta);
            let rho = libm::hypot(p.x, p.z);
            let off = DVec3::new(rho * sin, 0.0, rho * cos) - p;
            off.length() < 1e-14 && (0.0..TAU).contains(&theta)
        })
    };
    compare(
        in_one_turn as Azimuth,
        wrong,
        |f| f(shown),
        |f| f(hidden),
        holds,
    )
}
