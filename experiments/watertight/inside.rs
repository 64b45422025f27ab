//! Rays from inside a closed solid.

use super::Tally;
use crate::geometry::hit::{Crossing, Hit, Side};
use crate::geometry::ray::Ray;
use crate::geometry::revolution::membership::Membership;
use crate::geometry::revolution::{Revolution, Solver};
use crate::lab::families::{Family, Target};
use crate::numeric::rng::{Purpose, Stream};
use crate::scene::sampling::uniform_sphere;
use glam::DVec3;

/// At a smaller cosine to the normal the hit may be a tangency, which is met from inside and left inside.
const LEAST_COSINE: f64 = 1e-9;

/// Sends this many rays from points inside.
pub(super) fn run(solid: &Revolution, count: u64, seed: u64) -> Tally {
    let target = Target::new(solid);
    let mut tally = Tally::default();
    let mut index = 0;
    while tally.rays < count {
        let mut stream = Stream::new(seed, Purpose::Experiment, index);
        let wall = wall(solid, &mut stream);
        let from = place(solid, &target, &wall, index, &mut stream);
        if solid.membership(from) == Membership::Inside {
            let direction = direction(solid, &wall, from, index / 5, &mut stream);
            send(solid, &Ray::new(from, direction), &mut tally);
        }
        index += 1;
    }
    tally
}

fn send(solid: &Revolution, ray: &Ray, tally: &mut Tally) {
    tally.rays += 1;
    let Some(crossing) = solid.nearest(ray, &Solver::Bernstein, &mut tally.work) else {
        tally.escapes_missed += 1;
        return;
    };
    tally.bounces += 1;
    let hit = solid.hit(ray, crossing);
    let grazes = hit.normal.dot(ray.direction).abs() < LEAST_COSINE;
    let from_inside = hit.side_met(ray.direction) == Side::Back;
    tally.leaks += u64::from(!grazes && !from_inside);
}

/// A random point of the surface.
fn wall(solid: &Revolution, stream: &mut Stream) -> Hit {
    let pieces = solid.profile().pieces().len() as f64;
    let crossing = Crossing {
        t: 0.0,
        piece: (pieces * stream.uniform()) as u32,
        u: stream.uniform(),
    };
    let placement = solid.placement();
    let away = uniform_sphere(stream.uniform2());
    let ray = Ray::new(placement.point_to_world(away), placement.rotation * away);
    solid.hit(&ray, crossing)
}

/// A point that may be inside: uniform in the bounding cylinder (twice as often), near the wall, at the height of a joint, or on
/// the axis.
fn place(solid: &Revolution, target: &Target, wall: &Hit, kind: u64, stream: &mut Stream) -> DVec3 {
    let placement = solid.placement();
    let cylinder = solid.cylinder();
    let uniform = target
        .ray(Family::Inside, stream)
        .map_or(wall.point, |ray| ray.origin);
    let mut local = placement.ray_to_local(&Ray::new(uniform, DVec3::Y)).origin;
    match kind % 5 {
        0 => {
            let size = cylinder.radius.max(cylinder.top - cylinder.bottom);
            let depth = placement.scale * size * libm::exp10(stream.range(-12.0, -3.0));
            return wall.point - depth * wall.normal;
        }
        1 => {
            let pieces = solid.profile().pieces();
            let joint = (pieces.len() as f64 * stream.uniform()) as usize;
            local.y = pieces[joint].height[0];
        }
        2 => local = DVec3::Y * local.y,
        _ => return uniform,
    }
    placement.point_to_world(local)
}

/// Any direction (twice as often), level, upright, tangent to the wall, or towards a random point of the surface.
fn direction(solid: &Revolution, wall: &Hit, from: DVec3, kind: u64, stream: &mut Stream) -> DVec3 {
    let rotation = &solid.placement().rotation;
    let any = uniform_sphere(stream.uniform2());
    let chosen = match kind % 6 {
        0 => rotation * DVec3::new(any.x, 0.0, any.z),
        1 => rotation.y_axis * any.y.signum(),
        2 => any.cross(wall.normal),
        3 => wall.point - from,
        _ => any,
    };
    chosen.normalize_or(any)
}
