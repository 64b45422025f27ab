//! The scene: everything that a renderer needs, validated and immutable.

pub mod aim;
pub mod camera;
pub mod file;
pub mod light;
pub mod material;
pub mod options;
pub mod sampler;
pub mod sampling;
pub mod texture;

use crate::geometry::bounds::Aabb;
use crate::geometry::hit::{Crossing, Hit, Side};
use crate::geometry::packet::{Packet, WIDTH};
use crate::geometry::ray::Ray;
use crate::geometry::revolution::Solver;
use crate::geometry::shape::Shape;
use crate::numeric::work::Work;
use camera::Camera;
use glam::DVec3;
use light::Lights;
use material::Material;

/// Linear RGB.
pub type Rgb = DVec3;

/// Most pixels of a film: 2²⁶ (8192 × 8192), twelve gigabytes of statistics.
pub const MAX_PIXELS: u64 = 1 << 26;

/// A shape with a material.
#[derive(Clone, Debug)]
pub struct Object {
    /// Name: the scene file's, or kind and number.
    pub name: String,
    /// The shape.
    pub shape: Shape,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// World bounds; `None` for a plane.
    pub bounds: Option<Aabb>,
}

/// Size of the picture in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmSize {
    /// Width, ≥ 1.
    pub width: u32,
    /// Height, ≥ 1.
    pub height: u32,
}

/// A crossing with a shape that needs no solver.
fn unsolved(t: f64) -> Crossing {
    Crossing {
        t,
        piece: 0,
        u: 0.0,
    }
}

/// A complete scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Title.
    pub title: String,
    /// Radiance of rays that leave.
    pub background: Rgb,
    /// The camera.
    pub camera: Camera,
    /// Size of the picture.
    pub film: FilmSize,
    /// Materials.
    pub materials: Vec<Material>,
    /// Objects: revolutions, spheres, quads, planes, discs, each kind in the order of the file.
    pub objects: Vec<Object>,
    /// Lights: point lights, beams, then every emissive object in order.
    pub lights: Lights,
    /// How revolution surfaces are solved.
    pub solver: Solver,
    /// The file's `[render]` table, for the renderer to resolve.
    pub render: options::RenderTable,
    /// BLAKE3 hash of the scene text, the textures, and the overrides in force, hexadecimal.
    pub hash: String,
}

impl Scene {
    /// The nearest hit inside the ray's open range. Of hits at the same t that of an emitter which shines back along the ray wins, else that
    /// of the object listed first: a lamp let into a ceiling is seen, and the back of another does not hide it. Flat shapes in one plane
    /// along the axes are met at the same t to the bit, others to rounding.
    pub fn intersect(&self, ray: &Ray, work: &mut Work) -> Option<Hit> {
        let mut rest = *ray;
        let mut nearest: Option<(usize, Crossing)> = None;
        for (index, object) in self.objects.iter().enumerate() {
            let range = if nearest.is_some() && self.emits(object) {
                rest.until(rest.t_max.next_up())
            } else {
                rest
            };
            let Some(crossing) = object.shape.nearest(&range, &self.solver, work) else {
                continue;
            };
            let tied = nearest.filter(|_| crossing.t == rest.t_max);
            if tied.is_none_or(|(first, _)| self.wins(ray, index, first, crossing.t)) {
                rest.t_max = crossing.t;
                nearest = Some((index, crossing));
            }
        }
        let (index, crossing) = nearest?;
        Some(self.hit(ray, index, crossing))
    }

    /// As [`Scene::intersect`] for each ray, to the bit.
    pub fn intersect_many(&self, rays: &[Ray], work: &mut Work) -> Vec<Option<Hit>> {
        let hit = |(ray, nearest): (&Ray, Option<(usize, Crossing)>)| {
            nearest.map(|(object, crossing)| self.hit(ray, object, crossing))
        };
        let nearest = self.nearest_many(rays, work);
        rays.iter().zip(nearest).map(hit).collect()
    }

    /// The object that each ray meets first, and where: what [`Scene::hit`] makes the hits of [`Scene::intersect`] of. Takes several
    /// rays at a time.
    pub fn nearest_many(&self, rays: &[Ray], work: &mut Work) -> Vec<Option<(usize, Crossing)>> {
        let mut rest = rays.to_vec();
        let mut nearest = vec![None; rays.len()];
        let solved = |object: &Object| matches!(object.shape, Shape::Revolution(_));
        let mut first = 0;
        for run in self.objects.chunk_by(|a, b| !solved(a) && !solved(b)) {
            if solved(&run[0]) {
                self.meet_solved(first, &mut rest, &mut nearest, work);
            } else {
                work.surface_tests += (rays.len() * run.len()) as u64;
                self.meet_in_lanes(run, first, &mut rest, &mut nearest);
            }
            first += run.len();
        }
        nearest
    }

    fn meet_solved(
        &self,
        object: usize,
        rest: &mut [Ray],
        nearest: &mut [Option<(usize, Crossing)>],
        work: &mut Work,
    ) {
        let mut found = vec![None; rest.len()];
        let shape = &self.objects[object].shape;
        shape.nearest_many(rest, &self.solver, &mut found, work);
        for ((ray, found), nearest) in rest.iter_mut().zip(found).zip(nearest) {
            if let Some(crossing) = found {
                ray.t_max = crossing.t;
                *nearest = Some((object, crossing));
            }
        }
    }

    /// Rays against objects that need no solver, the first of which has the number `first`.
    fn meet_in_lanes(
        &self,
        objects: &[Object],
        first: usize,
        rest: &mut [Ray],
        nearest: &mut [Option<(usize, Crossing)>],
    ) {
        for (rays, nearest) in rest.chunks_mut(WIDTH).zip(nearest.chunks_mut(WIDTH)) {
            let earlier = |lane: usize| nearest[lane].map(|(object, _)| object);
            let mut packet = Packet::new(rays, earlier);
            for (number, object) in (first..).zip(objects) {
                if self.emits(object) {
                    let wins = |lane: usize, other, t| self.wins(&rays[lane], number, other, t);
                    packet.meet_or_tie(&object.shape, number, wins);
                } else {
                    packet.meet(&object.shape, number);
                }
            }
            for (lane, (ray, nearest)) in rays.iter_mut().zip(nearest).enumerate() {
                let met = packet.nearest(lane);
                if let Some((object, t)) = met.filter(|&(object, _)| object >= first) {
                    ray.t_max = t;
                    *nearest = Some((object, unsolved(t)));
                }
            }
        }
    }

    /// The full hit of a crossing with an object.
    pub fn hit(&self, ray: &Ray, object: usize, crossing: Crossing) -> Hit {
        let hit = self.objects[object].shape.hit(ray, crossing);
        Hit { object, ..hit }
    }

    /// Every hit inside the ray's open range, by rising t; of hits at the same t those of emitters that shine back along the ray first,
    /// then in the order of the objects.
    pub fn intersect_all(&self, ray: &Ray, work: &mut Work) -> Vec<Hit> {
        let mut hits = Vec::new();
        for (index, object) in self.objects.iter().enumerate() {
            let crossings = object.shape.crossings(ray, &self.solver, work);
            hits.extend(crossings.into_iter().map(|crossing| Hit {
                object: index,
                ..object.shape.hit(ray, crossing)
            }));
        }
        let dark = |hit: &Hit| !self.shines(ray, hit);
        hits.sort_by(|a, b| a.t.total_cmp(&b.t).then(dark(a).cmp(&dark(b))));
        hits
    }

    fn emits(&self, object: &Object) -> bool {
        self.materials[object.material].emission.is_some()
    }

    /// Whether a hit is of an emitter that shines back along the ray.
    fn shines(&self, ray: &Ray, hit: &Hit) -> bool {
        let emission = &self.material(hit).emission;
        let back = -ray.direction.dot(hit.normal);
        emission.is_some_and(|emission| emission.towards(back) != Rgb::ZERO)
    }

    /// Whether an emitter that is met at the same t as an object listed before it counts instead of that.
    fn wins(&self, ray: &Ray, emitter: usize, first: usize, t: f64) -> bool {
        // What emits needs no solver: see `Emitter::of`.
        let shines = |object: usize| {
            self.emits(&self.objects[object])
                && self.shines(ray, &self.hit(ray, object, unsolved(t)))
        };
        shines(emitter) && !shines(first)
    }

    /// Whether anything stands inside the ray's open range.
    pub fn occluded(&self, ray: &Ray, work: &mut Work) -> bool {
        self.objects
            .iter()
            .any(|object| object.shape.nearest(ray, &self.solver, work).is_some())
    }

    /// The ray that leaves a hit on a side of its object, along `direction`: see [`Shape::leave`].
    pub fn leave(&self, hit: &Hit, side: Side, direction: DVec3, work: &mut Work) -> Ray {
        let shape = &self.objects[hit.object].shape;
        shape.leave(hit, side, direction, work)
    }

    /// The material at a hit.
    pub fn material(&self, hit: &Hit) -> &Material {
        &self.materials[self.objects[hit.object].material]
    }

    /// Share of light left after `distance` inside the dielectric object `medium` (Beer's law); all of it outside.
    pub fn transmittance(&self, medium: Option<usize>, distance: f64) -> Rgb {
        let dielectric =
            medium.and_then(|object| self.materials[self.objects[object].material].dielectric);
        match dielectric {
            Some(dielectric) if dielectric.absorption != Rgb::ZERO => {
                (-distance * dielectric.absorption).map(libm::exp)
            }
            _ => Rgb::ONE,
        }
    }

    /// The dielectric object that contains `point`, if any: the one first left by a ray from there.
    pub fn medium_at(&self, point: DVec3, work: &mut Work) -> Option<usize> {
        // A direction without special position towards the axes and the usual scenes.
        let ray = Ray::new(point, DVec3::new(0.3, 0.9, 0.315_594_676_761_190_7));
        let around = self.objects.iter().enumerate().filter(|(_, object)| {
            self.materials[object.material].dielectric.is_some() && object.shape.contains(point)
        });
        around
            .filter_map(|(index, object)| {
                let first = object.shape.nearest(&ray, &self.solver, work)?;
                Some((first.t, index))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, index)| index)
    }
}
