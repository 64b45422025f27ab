//! One camera path twice, with the same random numbers: by the true intersector and by another.

use super::method::Method;
use crate::geometry::hit::Hit;
use crate::geometry::ray::Ray;
use crate::numeric::work::Work;
use crate::render::path::{Event, PathTracer, Step, leave_at};
use crate::scene::{Rgb, Scene};
use glam::DVec3;

/// Depths that are told apart: 0, 1, 2, and 3 or more specular events.
pub(super) const DEPTHS: usize = 4;

/// An answer further than this from the true point is another crossing even on the same piece and side, world units: half the
/// thickness of the rim, a twentieth of the height.
const FAR: f64 = 0.1;

/// How the answers of an intersector differ from the true ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Faults {
    /// Queries judged.
    pub(super) queries: u64,
    /// No crossing where there is one.
    pub(super) miss: u64,
    /// A crossing where there is none.
    pub(super) phantom: u64,
    /// Another crossing: on another piece, from the other side, or far away.
    pub(super) wrong: u64,
}

impl Faults {
    fn judge(&mut self, truth: Option<Answer>, found: Option<Answer>) {
        self.queries += 1;
        match (truth, found) {
            (Some(_), None) => self.miss += 1,
            (None, Some(_)) => self.phantom += 1,
            (Some(a), Some(b)) => self.wrong += u64::from(!a.same(&b)),
            (None, None) => {}
        }
    }
}

/// What an intersector answers, as far as a path can tell.
struct Answer {
    point: DVec3,
    piece: u32,
    entering: bool,
}

impl Answer {
    fn same(&self, other: &Self) -> bool {
        self.piece == other.piece
            && self.entering == other.entering
            && self.point.distance(other.point) <= FAR
    }
}

/// How a path by another intersector goes apart from the true one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flip {
    /// Not at all.
    None,
    /// Same events, but light that one sees is hidden from the other.
    Light,
    /// Other events, after so many specular ones; the last depth stands for more.
    Events(usize),
}

/// One path, traced twice.
pub(super) struct Pair {
    pub(super) flip: Flip,
    pub(super) truth: Rgb,
    pub(super) other: Rgb,
}

/// Traces pairs.
pub(super) struct Tracer<'a> {
    pub(super) truth: PathTracer<'a>,
    pub(super) other: PathTracer<'a>,
    pub(super) scene: &'a Scene,
    pub(super) method: &'a Method,
    /// The object whose intersector is judged.
    pub(super) cup: usize,
}

impl Tracer<'_> {
    /// Traces a pixel's sample of a pass by both, and judges the answers of the method to the queries of the true path, by
    /// their specular depth.
    pub(super) fn trace(
        &self,
        pixel: [u32; 2],
        pass: u64,
        faults: &mut [Faults; DEPTHS],
        work: &mut Work,
    ) -> Pair {
        let size = self.scene.film;
        let (mut steps, mut others) = (Vec::new(), Vec::new());
        let truth = self
            .truth
            .sample(size, pixel, pass, work, &mut |step| steps.push(*step));
        let other = self
            .other
            .sample(size, pixel, pass, work, &mut |step| others.push(*step));
        self.judge(&steps, faults);
        Pair {
            flip: self.flip(&steps, &others),
            truth,
            other,
        }
    }

    fn judge(&self, steps: &[Step], faults: &mut [Faults; DEPTHS]) {
        let mut depth = 0;
        let mut before: Option<Hit> = None;
        for step in steps {
            let mut work = Work::default();
            let truth = ask(self.scene, self.cup, &step.ray, 1, &mut work);
            let starts_here = before.is_some_and(|hit| hit.object == self.cup);
            if work.solver_calls > 0 && !(starts_here && self.method.moves_the_surface()) {
                let (scene, ray) = (&self.method.scene, self.start(step, before));
                let found = ask(scene, self.cup, &ray, self.method.fineness, &mut work);
                faults[depth].judge(truth, found);
            }
            depth = deeper(depth, step.event);
            before = step.hit;
        }
    }

    /// The ray with which the method would ask, coming from the true path's hit.
    fn start(&self, step: &Step, before: Option<Hit>) -> Ray {
        let direction = step.ray.direction;
        match before.zip(self.method.offset) {
            None => step.ray,
            // It leaves on the side on which a ray against it would arrive.
            Some((hit, offset)) => leave_at(&hit, hit.side_met(-direction), direction, offset),
        }
    }

    fn flip(&self, steps: &[Step], others: &[Step]) -> Flip {
        let mut depth = 0;
        let mut lit = false;
        let mut gathered = [Rgb::ZERO; 2];
        for (a, b) in steps.iter().zip(others) {
            if self.key(a, 1) != self.key(b, self.method.fineness) {
                return Flip::Events(depth);
            }
            let bright = [a.radiance != gathered[0], b.radiance != gathered[1]];
            lit |= bright[0] != bright[1];
            gathered = [a.radiance, b.radiance];
            depth = deeper(depth, a.event);
        }
        if steps.len() != others.len() {
            return Flip::Events(depth);
        }
        if lit { Flip::Light } else { Flip::None }
    }

    /// What a step must have in common with the true one: object, piece and event.
    fn key(&self, step: &Step, fineness: u32) -> (Option<(usize, u32)>, Event) {
        let place = step.hit.map(|hit| {
            let fineness = if hit.object == self.cup { fineness } else { 1 };
            (hit.object, hit.piece / fineness)
        });
        (place, step.event)
    }
}

/// Asks one object of a scene.
fn ask(scene: &Scene, object: usize, ray: &Ray, fineness: u32, work: &mut Work) -> Option<Answer> {
    let shape = &scene.objects[object].shape;
    let hit = shape.hit(ray, shape.nearest(ray, &scene.solver, work)?);
    Some(Answer {
        point: hit.point,
        piece: hit.piece / fineness,
        entering: hit.normal.dot(ray.direction) < 0.0,
    })
}

/// The specular depth after an event.
fn deeper(depth: usize, event: Event) -> usize {
    let specular = matches!(event, Event::Mirror | Event::Reflected | Event::Refracted);
    (depth + usize::from(specular)).min(DEPTHS - 1)
}
