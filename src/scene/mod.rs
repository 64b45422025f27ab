//! The scene: everything that a renderer needs, validated and immutable.

pub mod camera;
pub mod file;
pub mod light;
pub mod material;
pub mod options;
pub mod sampling;
pub mod texture;

use crate::geometry::bounds::Aabb;
use crate::geometry::hit::{Crossing, Hit, Side};
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

/// Most pixels of a film: 2²⁶ (8192 × 8192), about 4 GiB of statistics.
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
    /// The nearest hit inside the ray's open range. Of hits at the same t the object listed first wins.
    pub fn intersect(&self, ray: &Ray, work: &mut Work) -> Option<Hit> {
        let mut rest = *ray;
        let mut nearest = None;
        for (index, object) in self.objects.iter().enumerate() {
            if let Some(crossing) = object.shape.nearest(&rest, &self.solver, work) {
                rest.t_max = crossing.t;
                nearest = Some((index, crossing));
            }
        }
        let (index, crossing) = nearest?;
        Some(Hit {
            object: index,
            ..self.objects[index].shape.hit(ray, crossing)
        })
    }

    /// As [`Scene::intersect`] for each ray, to the bit.
    pub fn intersect_many(&self, rays: &[Ray], work: &mut Work) -> Vec<Option<Hit>> {
        let mut rest = rays.to_vec();
        let mut found = vec![None; rays.len()];
        let mut nearest = vec![None; rays.len()];
        for (index, object) in self.objects.iter().enumerate() {
            let shape = &object.shape;
            shape.nearest_many(&rest, &self.solver, &mut found, work);
            for ((rest, found), nearest) in rest.iter_mut().zip(&found).zip(&mut nearest) {
                if let Some(crossing) = *found {
                    rest.t_max = crossing.t;
                    *nearest = Some((index, crossing));
                }
            }
        }
        let hit = |(ray, nearest): (&Ray, Option<(usize, Crossing)>)| {
            let (object, crossing) = nearest?;
            let hit = self.objects[object].shape.hit(ray, crossing);
            Some(Hit { object, ..hit })
        };
        rays.iter().zip(nearest).map(hit).collect()
    }

    /// Every hit inside the ray's open range, by rising t; hits at the same t in the order of the objects.
    pub fn intersect_all(&self, ray: &Ray, work: &mut Work) -> Vec<Hit> {
        let mut hits = Vec::new();
        for (index, object) in self.objects.iter().enumerate() {
            let crossings = object.shape.crossings(ray, &self.solver, work);
            hits.extend(crossings.into_iter().map(|crossing| Hit {
                object: index,
                ..object.shape.hit(ray, crossing)
            }));
        }
        hits.sort_by(|a, b| a.t.total_cmp(&b.t));
        hits
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
