//! What a picture should be, and which of its pixels hold which edge.

use crate::numeric::work::Work;
use crate::render::antialias::fingerprint::Fingerprint;
use crate::render::antialias::pattern::Place;
use crate::render::film::Film;
use crate::render::whitted::Whitted;
use crate::scene::options::{Antialias, Hash};
use crate::scene::{Rgb, Scene};
use glam::DVec2;

use super::Method;

/// Fingerprints along a side of a pixel.
const PRINTS: usize = 8;
/// Above the numbers of all places of patterns.
const OWN_PLACES: u64 = 1 << 32;

/// The centres of side × side cells of a pixel.
fn centers(side: usize) -> impl Iterator<Item = DVec2> {
    let at = move |cell: usize| (cell as f64 + 0.5) / side as f64;
    (0..side * side).map(move |cell| DVec2::new(at(cell % side), at(cell / side)))
}

/// A method without antialiasing whose fingerprints take in everything.
const PLAIN: Method = Method {
    aa: Antialias::None,
    hash: Some(Hash::Texture),
    pattern: crate::scene::options::Resampling::Three,
    threshold: None,
};

/// Mean radiance of every pixel.
pub(super) struct Truth(Vec<Rgb>);

impl Truth {
    /// By side × side samples a pixel.
    pub(super) fn new(scene: &Scene, side: usize, seed: u64, work: &mut Work) -> Self {
        let settings = Method {
            hash: None,
            ..PLAIN
        }
        .settings(seed);
        let whitted = Whitted::new(scene, &settings);
        let pixels = (scene.film.width * scene.film.height) as usize;
        let mean = |index: usize, work: &mut Work| {
            let samples = (OWN_PLACES..)
                .zip(centers(side))
                .map(|(number, offset)| whitted.sample(0, index, Place { offset, number }, work));
            samples.sum::<Rgb>() / (side * side) as f64
        };
        Self((0..pixels).map(|index| mean(index, work)).collect())
    }

    /// Root of the mean square error over pixels and channels.
    pub(super) fn rmse(&self, film: &Film) -> f64 {
        let squares = film.pixels().iter().zip(&self.0).map(|(pixel, truth)| {
            let off = pixel.mean() - *truth;
            off.dot(off) / 3.0
        });
        (squares.sum::<f64>() / self.0.len() as f64).sqrt()
    }
}

/// The first kind of edge that a pixel holds, in the order of the table's columns of recall; reflections before shadows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Edge {
    Silhouette,
    Shadow,
    Texture,
    Reflection,
}

const EDGES: [Edge; 4] = [
    Edge::Silhouette,
    Edge::Shadow,
    Edge::Texture,
    Edge::Reflection,
];

/// The edge within each pixel.
pub(super) struct Edges(Vec<Option<Edge>>);

impl Edges {
    pub(super) fn new(scene: &Scene, work: &mut Work) -> Self {
        let settings = PLAIN.settings(0);
        let whitted = Whitted::new(scene, &settings);
        let pixels = (scene.film.width * scene.film.height) as usize;
        let edge = |index: usize, work: &mut Work| {
            let prints: Vec<Fingerprint> = centers(PRINTS)
                .map(|offset| whitted.fingerprint(index, offset, work))
                .collect();
            let differ = |part: &dyn Fn(&Fingerprint) -> u64| {
                prints.iter().any(|print| part(print) != part(&prints[0]))
            };
            if differ(&|print| print.first) {
                Some(Edge::Silhouette)
            } else if differ(&|print| print.value(Hash::Objects)) {
                Some(Edge::Reflection)
            } else if differ(&|print| print.shadow) {
                Some(Edge::Shadow)
            } else if differ(&|print| print.texture) {
                Some(Edge::Texture)
            } else {
                None
            }
        };
        Self((0..pixels).map(|index| edge(index, work)).collect())
    }

    /// Of each kind of edge the share of its pixels that are marked; and the share of marked pixels that hold an edge. NaN of nothing.
    pub(super) fn recalls(&self, marked: &[bool]) -> ([f64; 4], f64) {
        let share = |of: &dyn Fn(usize) -> bool, hold: &dyn Fn(usize) -> bool| {
            let all = (0..marked.len()).filter(|&index| of(index));
            let (hits, count) = all.fold((0_u32, 0_u32), |(hits, count), index| {
                (hits + u32::from(hold(index)), count + 1)
            });
            f64::from(hits) / f64::from(count)
        };
        let recalls = EDGES.map(|edge| share(&|i| self.0[i] == Some(edge), &|i| marked[i]));
        let precision = share(&|i| marked[i], &|i| self.0[i].is_some());
        (recalls, precision)
    }
}
