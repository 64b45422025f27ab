//! Rays by which camera paths leave a surface.

use super::aim::pick;
use crate::geometry::ray::Ray;
use crate::numeric::rng::Stream;
use crate::numeric::work::Work;
use crate::render::scatter::{Lobes, reflect};
use crate::scene::Scene;
use crate::scene::sampling::cosine_hemisphere;
use glam::DVec2;

/// Camera paths tried for one that meets the object and goes on.
const PATHS: usize = 4096;
/// Rays of a path that are followed.
const EVENTS: usize = 12;

/// A ray that leaves the object with this index, picked from those of a random camera path.
pub(super) fn ray(scene: &Scene, object: usize, s: &mut Stream) -> Option<Ray> {
    for _ in 0..PATHS {
        let leaving = path(scene, object, s);
        if !leaving.is_empty() {
            return Some(leaving[pick(leaving.len(), s.uniform())]);
        }
    }
    None
}

fn path(scene: &Scene, object: usize, s: &mut Stream) -> Vec<Ray> {
    let mut work = Work::default();
    let size = DVec2::new(f64::from(scene.film.width), f64::from(scene.film.height));
    let place = size * DVec2::new(s.uniform(), s.uniform());
    let mut ray = scene.camera.ray(place, size, s.uniform2());
    let mut leaving = Vec::new();
    for _ in 0..EVENTS {
        let Some(hit) = scene.intersect(&ray, &mut work) else {
            break;
        };
        let lobes = Lobes::at(scene, &hit, ray.direction);
        let (choice, place) = (s.uniform(), s.uniform2());
        let normal = hit.normal_on(lobes.side);
        let mirrored = reflect(ray.direction, normal);
        let (diffuse, mirror) = (lobes.diffuse.max_element(), lobes.mirror.max_element());
        let same = lobes.side;
        let (side, next) = match lobes.interface {
            // Half and half, so that faint reflections are among the rays too.
            Some(interface) => match interface.refracted {
                Some(refracted) if choice < 0.5 => (same.other(), refracted),
                _ => (same, mirrored),
            },
            None if diffuse + mirror <= 0.0 => break,
            None if choice * (diffuse + mirror) < mirror => (same, mirrored),
            None => (same, cosine_hemisphere(normal, place)),
        };
        ray = scene.leave(&hit, side, next, &mut work);
        if hit.object == object {
            leaving.push(ray);
        }
    }
    leaving
}
