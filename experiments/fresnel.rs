//! Are reflection, refraction and absorption those of the closed forms, at one face and through whole bodies?

use crate::geometry::hit::Side;
use crate::geometry::ray::Ray;
use crate::lab::claim::Claim;
use crate::lab::experiment::{
    Conclusion, Effort, Experiment, Outcome, Run, Table, Timing, grid, values,
};
use crate::lab::plot::{Axis, Plot, Series};
use crate::numeric::work::Work;
use crate::render::scatter::{Lobes, reflect, refract};
use crate::scene::Scene;
use crate::scene::file;
use glam::DVec3;
use serde::Deserialize;
use std::f64::consts::PI;
use std::path::Path;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "fresnel",
    question: "Are reflection, refraction, total reflection and absorption those of the closed forms?",
    prediction: "Yes, to 1e-12 (at the ball, over the cosine of incidence): of one face against Fresnel's sines and tangents, of a slab against the geometric series of its two \
                 faces, of a ball against the weights and directions of its rainbows.",
    method: "Every index and angle, once: nothing is random. A face is asked from both sides. Slab and ball are scenes, and the tree \
             of both branches at every face is followed through them down to weights of 1e-18, with the renderer's own surfaces, \
             starts of next rays, Fresnel shares and absorption. The closed forms are computed from angles instead of cosines \
             (Born and Wolf, section 1.5): R = ½ (sin²(i − t)/sin²(i + t) + tan²(i − t)/tan²(i + t)); slab: \
             T = (1 − R)² τ/(1 − R² τ²), R + (1 − R)² R τ²/(1 − R² τ²); ball of order p: (1 − R)² R^(p − 1) τ^p towards \
             2 (i − t) + (p − 1)(π − 2 t).",
    columns: &[
        "body",
        "ior",
        "absorption",
        "angle_deg",
        "quantity",
        "measured",
        "predicted",
        "error",
    ],
    timing: Timing::Untimed,
    cpu_seconds: [0.2, 0.2, 0.2],
    plan,
    execute,
    conclude,
};

/// Largest error. At a ball it is divided by the cosine of incidence: there an error across the ray becomes one of the angle.
const TOLERANCE: f64 = 1e-12;
/// Steepest light at the slab, degrees: what is steeper comes to the rim with more than rounding's weight.
const MOST_AT_SLAB: f64 = 60.0;
/// Branches below this weight are dropped: together they are far below the tolerance.
const LEAST_WEIGHT: f64 = 1e-18;
/// Orders of the ball that are compared: the primary and secondary rainbows are 2 and 3.
const ORDERS: usize = 8;

const SLAB: &str = include_str!("fresnel/slab.toml");
const BALL: &str = include_str!("fresnel/ball.toml");
const INDICES: [f64; 5] = [1.0, 1.05, 1.3, 1.5, 2.4];

fn plan(_: Effort) -> Vec<Run> {
    let faces = grid([
        ("body", values(["face from outside", "face from inside"])),
        ("ior", values(INDICES)),
        ("absorption", values([0.0])),
    ]);
    let bodies = grid([
        ("body", values(["slab", "ball"])),
        ("ior", values(INDICES)),
        ("absorption", values([0.0, 0.4])),
    ]);
    [faces, bodies].concat()
}

/// Angles of incidence, radians: normal, nearly so, and up to a tenth of a degree from grazing.
fn angles() -> impl Iterator<Item = f64> {
    let degrees = (1..=89).map(f64::from);
    [0.0, 0.001, 0.1]
        .into_iter()
        .chain(degrees)
        .chain([89.5, 89.9])
        .map(f64::to_radians)
}

/// What was compared at an angle: quantity, measured, predicted.
type Compared = (String, f64, f64);

fn execute(run: &Run, _: Effort, _: u64) -> anyhow::Result<Outcome> {
    let (ior, absorption) = (run.number("ior"), run.number("absorption"));
    let body = run.text("body");
    let scene = |text| glass(text, ior, absorption);
    let mut work = Work::default();
    let mut rows = Vec::new();
    for angle in angles() {
        let compared = match body.as_str() {
            "face from outside" => face(ior, angle),
            "face from inside" => face(1.0 / ior, angle),
            "slab" => slab(&scene(SLAB)?, ior, absorption, angle, &mut work),
            _ => ball(&scene(BALL)?, ior, absorption, angle, &mut work),
        };
        for (quantity, measured, predicted) in compared {
            let error = (measured - predicted).abs();
            rows.push(
                run.row(
                    [
                        values([angle.to_degrees()]),
                        values([quantity]),
                        values([measured, predicted, error]),
                    ]
                    .concat(),
                ),
            );
        }
    }
    Ok(Outcome { rows, work })
}

fn glass(text: &str, ior: f64, absorption: f64) -> anyhow::Result<Scene> {
    let sets = [
        ("material.glass.dielectric.ior", format!("{ior:?}")),
        (
            "material.glass.dielectric.absorption",
            format!("[{absorption:?}, {absorption:?}, {absorption:?}]"),
        ),
    ]
    .map(|(key, value)| (key.to_owned(), value));
    Ok(file::parse(text, "fresnel", Path::new(""), &sets)?)
}

/// Reflectance and angle of refraction by sines and tangents; `None` beyond the critical angle.
pub(super) fn closed_face(eta: f64, incidence: f64) -> Option<(f64, f64)> {
    let sine = libm::sin(incidence) / eta;
    if sine > 1.0 {
        return None;
    }
    let refraction = libm::asin(sine);
    if incidence == 0.0 {
        let amplitude = (eta - 1.0) / (eta + 1.0);
        return Some((amplitude * amplitude, 0.0));
    }
    let (difference, sum) = (incidence - refraction, incidence + refraction);
    let s = libm::sin(difference) / libm::sin(sum);
    let p = libm::tan(difference) / libm::tan(sum);
    Some((0.5 * (s * s + p * p), refraction))
}

fn face(eta: f64, incidence: f64) -> Vec<Compared> {
    let direction = DVec3::new(libm::sin(incidence), -libm::cos(incidence), 0.0);
    let (reflectance, refracted) = refract(direction, DVec3::Y, eta);
    let closed = closed_face(eta, incidence);
    let mut compared = vec![
        (
            "reflectance".to_owned(),
            reflectance,
            closed.map_or(1.0, |(reflectance, _)| reflectance),
        ),
        (
            "total reflection".to_owned(),
            f64::from(u8::from(refracted.is_none())),
            f64::from(u8::from(closed.is_none())),
        ),
    ];
    if let (Some(refracted), Some((_, refraction))) = (refracted, closed) {
        let sine = libm::sin(refraction);
        compared.push(("sine of refraction".to_owned(), refracted.x, sine));
        let cosine = libm::cos(refraction);
        compared.push(("cosine of refraction".to_owned(), -refracted.y, cosine));
    }
    compared
}

/// A branch of light on its way.
struct Branch {
    ray: Ray,
    weight: f64,
    inside: bool,
    /// Faces met so far.
    faces: usize,
}

/// The branches that leave a scene of one body for good, and what the body absorbs.
fn tree(scene: &Scene, ray: Ray, work: &mut Work) -> (Vec<Branch>, f64) {
    let mut left = Vec::new();
    let mut absorbed = 0.0;
    let mut open = vec![Branch {
        ray,
        weight: 1.0,
        inside: false,
        faces: 0,
    }];
    while let Some(branch) = open.pop() {
        let Some(hit) = scene.intersect(&branch.ray, work) else {
            left.push(branch);
            continue;
        };
        let medium = branch.inside.then_some(hit.object);
        let weight = branch.weight * scene.transmittance(medium, hit.t).x;
        absorbed += branch.weight - weight;
        let direction = branch.ray.direction;
        let lobes = Lobes::at(scene, &hit, direction);
        let Some(interface) = lobes.interface else {
            continue;
        };
        let mut follow = |share: f64, side: Side, next: DVec3, work: &mut Work| {
            if share * weight > LEAST_WEIGHT {
                open.push(Branch {
                    ray: scene.leave(&hit, side, next, work),
                    weight: share * weight,
                    inside: side == Side::Back,
                    faces: branch.faces + 1,
                });
            }
        };
        let reflected = reflect(direction, hit.normal);
        follow(interface.reflectance, lobes.side, reflected, work);
        if let Some(refracted) = interface.refracted {
            let share = 1.0 - interface.reflectance;
            follow(share, lobes.side.other(), refracted, work);
        }
    }
    (left, absorbed)
}

fn slab(
    scene: &Scene,
    ior: f64,
    absorption: f64,
    incidence: f64,
    work: &mut Work,
) -> Vec<Compared> {
    if incidence > MOST_AT_SLAB.to_radians() {
        return Vec::new();
    }
    let Some((r, refraction)) = closed_face(ior, incidence) else {
        return Vec::new();
    };
    let direction = DVec3::new(libm::sin(incidence), -libm::cos(incidence), 0.0);
    // Meets the slab's face in the origin's neighbourhood whatever the angle.
    let from = DVec3::new(0.0, 1.0, 0.0) - direction;
    let (left, absorbed) = tree(scene, Ray::new(from, direction), work);
    let sum = |down: bool| -> f64 {
        let branches = left.iter();
        let leaving = branches.filter(|branch| (branch.ray.direction.y < 0.0) == down);
        leaving.map(|branch| branch.weight).sum()
    };
    let tau = libm::exp(-absorption / libm::cos(refraction));
    let series = (1.0 - r) * (1.0 - r) * tau / (1.0 - r * r * tau * tau);
    let (transmitted, reflected) = (series, r + series * r * tau);
    vec![
        ("transmitted".to_owned(), sum(true), transmitted),
        ("reflected".to_owned(), sum(false), reflected),
        (
            "absorbed".to_owned(),
            absorbed,
            1.0 - transmitted - reflected,
        ),
    ]
}

fn ball(
    scene: &Scene,
    ior: f64,
    absorption: f64,
    incidence: f64,
    work: &mut Work,
) -> Vec<Compared> {
    let Some((r, refraction)) = closed_face(ior, incidence) else {
        return Vec::new();
    };
    let from = DVec3::new(libm::sin(incidence), 0.0, 5.0);
    let (left, _) = tree(scene, Ray::new(from, -DVec3::Z), work);
    let tau = libm::exp(-2.0 * absorption * libm::cos(refraction));
    let closed = |order: usize| {
        let p = order as f64;
        if order == 0 {
            let turn = 2.0 * incidence;
            return (r, DVec3::new(libm::sin(turn), 0.0, libm::cos(turn)));
        }
        let weight = (1.0 - r) * (1.0 - r) * libm::pow(r, p - 1.0) * libm::pow(tau, p);
        let turn = 2.0 * (incidence - refraction) + (p - 1.0) * (PI - 2.0 * refraction);
        (weight, DVec3::new(-libm::sin(turn), 0.0, -libm::cos(turn)))
    };
    // Orders of no weight (index 1: only straight on) do not come out.
    let orders = (0..ORDERS).filter(|&order| closed(order).0 > LEAST_WEIGHT);
    let mut compared = Vec::new();
    for order in orders {
        let (weight, direction) = closed(order);
        let out = left.iter().find(|branch| branch.faces == order + 1);
        let (measured, off) = out.map_or((f64::NAN, f64::NAN), |branch| {
            (branch.weight, (branch.ray.direction - direction).length())
        });
        compared.push((format!("weight of order {order}"), measured, weight));
        compared.push((format!("direction of order {order}"), off, 0.0));
    }
    compared
}

/// A row of the table.
#[derive(Deserialize)]
struct Row {
    body: String,
    ior: f64,
    absorption: f64,
    angle_deg: f64,
    quantity: String,
    measured: f64,
    predicted: f64,
    error: f64,
}

/// Body, name and statement of each claim.
const CLAIMS: [(&str, &str, &str); 4] = [
    (
        "face from outside",
        "a face from outside",
        "Reflectance and direction of refraction into glass are Fresnel's and Snell's to 1e-12.",
    ),
    (
        "face from inside",
        "a face from inside",
        "So are those out of glass, and everything beyond the critical angle is reflected.",
    ),
    (
        "slab",
        "a slab of glass",
        "Up to 60° a slab transmits, reflects and absorbs what the geometric series says, to 1e-12.",
    ),
    (
        "ball",
        "a ball of glass",
        "The first eight orders of a ball leave with the weights and in the directions of the closed form, to 1e-12 over the cosine of incidence.",
    ),
];

fn conclude(table: &Table, effort: Effort) -> Conclusion {
    let rows: Vec<Row> = table.read();
    let claims = CLAIMS.map(|(body, name, statement)| {
        let of: Vec<&Row> = rows.iter().filter(|row| row.body == body).collect();
        let wrong = |row: &&&Row| {
            let scale = match body {
                "ball" => libm::cos(row.angle_deg.to_radians()),
                _ => 1.0,
            };
            row.error.is_nan() || row.error * scale > TOLERANCE
        };
        let subject = EXPERIMENT.subject(name, statement, Effort::Smoke, effort);
        Claim::exact(
            subject,
            of.iter().filter(wrong).count() as u64,
            of.len() as u64,
        )
    });
    Conclusion {
        claims: claims.to_vec(),
        plots: vec![
            curve(
                &rows,
                "What a face of glass of index 1.5 reflects",
                "reflectance",
                &["face from outside", "face from inside"]
                    .map(|body| (body, body, "reflectance", 0.0)),
            ),
            curve(
                &rows,
                "What becomes of light at a slab of index 1.5",
                "share of the light",
                &[
                    ("transmitted, clear", "slab", "transmitted", 0.0),
                    ("transmitted, absorption 0.4", "slab", "transmitted", 0.4),
                    ("reflected, absorption 0.4", "slab", "reflected", 0.4),
                    ("absorbed, absorption 0.4", "slab", "absorbed", 0.4),
                ],
            ),
            largest_errors(&rows),
        ],
        ..Conclusion::default()
    }
}

/// Measured points on the predicted lines, at index 1.5; `curves` gives name, body, quantity and absorption.
fn curve(rows: &[Row], title: &str, y: &str, curves: &[(&str, &str, &str, f64)]) -> Plot {
    let series = curves
        .iter()
        .flat_map(|&(name, body, quantity, absorption)| {
            let of = move |row: &&Row| {
                row.body == body
                    && row.ior == 1.5
                    && row.quantity == quantity
                    && row.absorption == absorption
            };
            let every_fifth = |row: &&Row| row.angle_deg % 5.0 == 0.0;
            let measured = rows.iter().filter(of).filter(every_fifth);
            let predicted = rows.iter().filter(of);
            [
                Series::scattered(name, measured.map(|row| (row.angle_deg, row.measured))),
                Series::predicted(
                    format!("{name}, closed form"),
                    predicted.map(|row| (row.angle_deg, row.predicted)),
                ),
            ]
        });
    Plot::new(
        title,
        Axis::linear("angle of incidence (degrees)"),
        Axis::linear(y),
        series,
    )
}

/// The largest error of each body at each angle.
fn largest_errors(rows: &[Row]) -> Plot {
    let series = CLAIMS.map(|(body, ..)| {
        let at = |angle: f64| {
            let there = rows.iter().filter(|row| row.body == body);
            let errors = there.filter(|row| row.angle_deg == angle);
            errors.fold(0.0, |most: f64, row| most.max(row.error))
        };
        let angles = angles().map(f64::to_degrees);
        Series::measured(body, angles.map(|angle| (angle, at(angle))))
    });
    Plot::new(
        "The largest error stays at the level of rounding",
        Axis::linear("angle of incidence (degrees)"),
        Axis::log("largest error over indices, absorptions and quantities"),
        series,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn failing(rows: Vec<Vec<crate::lab::experiment::Value>>) -> Vec<bool> {
        let claims = conclude(&EXPERIMENT.table(rows), Effort::Smoke).claims;
        claims.iter().map(Claim::fails_the_run).collect()
    }

    fn rows() -> Vec<Vec<crate::lab::experiment::Value>> {
        let run = |run: &Run| execute(run, Effort::Smoke, 0).expect("a run").rows;
        plan(Effort::Smoke).iter().flat_map(run).collect()
    }

    #[test]
    fn every_closed_form_holds_and_one_wrong_row_is_seen() {
        let mut rows = rows();
        assert!(rows.len() > 9_000, "{}", rows.len());
        assert_eq!(failing(rows.clone()), [false; 4]);
        let error = EXPERIMENT.columns.len() - 1;
        let last = rows.last_mut().expect("rows");
        last[error] = 1e-9.into();
        assert_eq!(failing(rows.clone()), [false, false, false, true]);
        let last = rows.last_mut().expect("rows");
        last[error] = f64::NAN.into();
        assert_eq!(failing(rows), [false, false, false, true]);
    }

    /// What enters a ball meets its surface from inside at the angle at which it was refracted: never beyond the critical one.
    #[test]
    fn nothing_that_enters_a_ball_is_reflected_totally() {
        let scene = glass(BALL, 1.5, 0.0).expect("a scene");
        for angle in angles() {
            let from = DVec3::new(libm::sin(angle), 0.0, 5.0);
            let (left, _) = tree(&scene, Ray::new(from, -DVec3::Z), &mut Work::default());
            // With total reflection the path would go round until its weight is dropped, and less than all would come out.
            let out: f64 = left.iter().map(|branch| branch.weight).sum();
            assert!((out - 1.0).abs() < 1e-12, "{angle}: {out}");
        }
    }
}
