//! A suite: rays with their certified answers, by which any program's answers can be graded.
//!
//! The answer is that of the scene as it is stored: every number a dyadic rational, changes of frame not rounded. Whether, and at
//! which t, a ray meets an object is decided in exact arithmetic. Only `cosine` and `margin`, which say how hard a ray is, are
//! computed with rounding.

mod flat;
mod margin;

use super::families::{Family, Target, Unfit};
use crate::geometry::hit::Crossing;
use crate::geometry::ray::Ray;
use crate::geometry::revolution::exact;
use crate::geometry::shape::Shape;
use crate::scene::Scene;
use flat::Time;
use margin::Extent;

/// The columns of a suite.
pub const COLUMNS: &str = "ray,family,ox,oy,oz,dx,dy,dz,tmin,tmax,true_hit,true_t,true_t_low,true_t_high,true_object,true_piece,\
                           true_u,multiplicity,cosine,second_t,scale,margin,suite";

/// A crossing that is certain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Met {
    /// The f64 nearest to the exact t, or its neighbour.
    pub t: f64,
    /// The floats next to the exact t, below and above; equal where t is one.
    pub bracket: [f64; 2],
    /// Index of the object.
    pub object: usize,
    /// Piece of the profile; 0 for other shapes.
    pub piece: u32,
    /// As [`crate::geometry::hit::Hit::u`].
    pub u: f64,
    /// 1 for a transversal crossing off the axis, 2 or more for a tangency.
    pub multiplicity: u32,
    /// |n · d|/|d|, rounded.
    pub cosine: f64,
}

/// What is true of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// The nearest crossing.
    pub nearest: Option<Met>,
    /// t of the next crossing, of any object.
    pub second_t: Option<f64>,
    /// Size of the coordinates that enter the answer: |o| + t |d| (without a hit: |o| and the distance to the scene's middle), and
    /// at least the reach of the scene's objects.
    pub scale: f64,
    /// The least tested distance, in steps of √10 from 1e-15 to 1e-2 `scale`, by which moving the ray changes the answer; infinite
    /// where none does.
    pub margin: f64,
}

/// A scene with its surfaces made ready to be aimed at.
pub struct Suite<'a> {
    scene: &'a Scene,
    targets: Vec<Target<'a>>,
    extent: Extent,
    seed: u64,
}

impl<'a> Suite<'a> {
    /// Prepares the rays of a seed; `None` where the scene has no surface of revolution.
    pub fn new(scene: &'a Scene, seed: u64) -> Option<Self> {
        let targets = Target::all_of(scene);
        (!targets.is_empty()).then(|| Self {
            scene,
            targets,
            extent: Extent::of(scene),
            seed,
        })
    }

    /// Whether each surface of revolution has rays of the family.
    ///
    /// # Errors
    /// What the first surface without them lacks.
    pub fn fits(&self, family: Family) -> Result<(), Unfit> {
        self.targets
            .iter()
            .try_for_each(|target| target.fits(family))
    }

    /// Ray `index` of a family; surfaces take turns.
    ///
    /// # Errors
    /// The family does not fit the surface.
    pub fn ray(&self, family: Family, index: u64) -> Result<Ray, Unfit> {
        let turn = (index % self.targets.len() as u64) as usize;
        self.targets[turn].ray(family, &mut family.stream(self.seed, index))
    }

    /// What is true of a ray.
    pub fn truth(&self, ray: &Ray) -> Truth {
        let mut met = all_crossings(self.scene, ray).into_iter();
        let nearest = met.next();
        let scale = self.extent.scale(ray, nearest.as_ref());
        Truth {
            nearest,
            second_t: met.next().map(|met| met.t),
            scale,
            margin: margin::margin(self.scene, &self.extent, ray, nearest.as_ref(), scale),
        }
    }

    /// The line of ray `index` of a family in a suite, its end included.
    ///
    /// # Errors
    /// The family does not fit the surface.
    pub fn line(&self, number: u64, family: Family, index: u64) -> Result<String, Unfit> {
        let ray = self.ray(family, index)?;
        let truth = self.truth(&ray);
        let (o, d) = (ray.origin, ray.direction);
        let asked = format!(
            "{number},{},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?}",
            family.name(),
            o.x,
            o.y,
            o.z,
            d.x,
            d.y,
            d.z,
            ray.t_min,
            ray.t_max
        );
        let known = match truth.nearest {
            Some(met) => format!(
                "1,{:?},{:?},{:?},{},{},{:?},{},{:?}",
                met.t,
                met.bracket[0],
                met.bracket[1],
                cell(&self.scene.objects[met.object].name),
                met.piece,
                met.u,
                met.multiplicity,
                met.cosine
            ),
            None => "0,,,,,,,,".to_owned(),
        };
        let second = truth
            .second_t
            .map_or_else(String::new, |t| format!("{t:?}"));
        let suite = format!(
            "photolathe-{}:{:.16}:{}",
            env!("CARGO_PKG_VERSION"),
            self.scene.hash,
            self.seed
        );
        Ok(format!(
            "{asked},{known},{second},{:?},{:?},{suite}\n",
            truth.scale, truth.margin
        ))
    }
}

/// A text as a cell of CSV.
pub fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// Every crossing of a scene, certain, by rising t; at the same t in the order of the objects.
pub fn all_crossings(scene: &Scene, ray: &Ray) -> Vec<Met> {
    if !ray.is_valid() {
        return Vec::new();
    }
    let mut met = Vec::new();
    for (object, of) in scene.objects.iter().enumerate() {
        for (crossing, time) in crossings(&of.shape, ray) {
            let hit = of.shape.hit(ray, crossing);
            let cosine = hit.normal.dot(ray.direction.normalize()).abs();
            met.push(Met {
                t: time.t,
                bracket: time.bracket,
                object,
                piece: hit.piece,
                u: hit.u,
                multiplicity: time.multiplicity,
                cosine,
            });
        }
    }
    // Stable, so that the order of the objects decides where brackets are the same.
    met.sort_by(|a, b| {
        (a.bracket[0].total_cmp(&b.bracket[0])).then(a.bracket[1].total_cmp(&b.bracket[1]))
    });
    met
}

fn crossings(shape: &Shape, ray: &Ray) -> Vec<(Crossing, Time)> {
    let flat = match shape {
        Shape::Revolution(shape) => {
            let all = exact::certified_placed(shape.profile(), shape.placement(), ray);
            let with_time = all.into_iter().map(|certain| {
                let time = Time {
                    t: certain.t,
                    bracket: [certain.t_low, certain.t_high],
                    multiplicity: certain.multiplicity,
                };
                let crossing = Crossing {
                    t: certain.t,
                    piece: certain.piece,
                    u: certain.u,
                };
                (crossing, time)
            });
            return with_time.collect();
        }
        Shape::Sphere(shape) => flat::sphere(shape, ray),
        Shape::Quad(shape) => flat::quad(shape, ray),
        Shape::Plane(shape) => flat::plane(shape, ray),
        Shape::Disc(shape) => flat::disc(shape, ray),
    };
    let whole = |time: Time| {
        let crossing = Crossing {
            t: time.t,
            piece: 0,
            u: 0.0,
        };
        (crossing, time)
    };
    flat.into_iter().map(whole).collect()
}
