//! Indices for fixed-radius search over balls: points with radii of their own.
//!
//! A query asks for every ball that covers a point. The predicate is one and the same for every index, and exact in f64: ball i
//! covers q if `(q − c_i)·(q − c_i) ≤ r_i²`, evaluated as written, the border included. So every index gives the same set, to the
//! last borderline case; the linear scan is the oracle.
//!
//! [`BallIndex::join`] asks for many queries at once and hands each ball its queries in rising order, so that a sum over them
//! does not depend on the index or the number of threads.
//!
//! There is no search for the k nearest: no estimator here asks for it.

pub mod choice;
pub mod curve;
pub mod grid;
pub mod kdtree;
pub mod linear;
pub mod wide;

use crate::numeric::work::Work;
use glam::DVec3;
use rayon::prelude::*;

/// Answers that one thread moves at least.
const LEAST: usize = 1 << 12;

/// Why balls cannot be indexed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum IndexError {
    /// A centre has a coordinate that is NaN or infinite.
    #[error("the centre of ball {0} is not finite")]
    Center(usize),
    /// A squared radius is negative or NaN (infinity is allowed: such a ball covers everything).
    #[error("the squared radius of ball {0} is negative or not a number")]
    Radius(usize),
    /// The numbers of centres and radii differ.
    #[error("{centers} centres, but {radii} radii")]
    Count {
        /// Number of centres.
        centers: usize,
        /// Number of radii.
        radii: usize,
    },
    /// Items are numbered by 32 bits.
    #[error("{0} balls are more than an index can number")]
    TooMany(usize),
}

/// Closed balls, validated: finite centres, squared radii ≥ 0 (∞ allowed), fewer than 2³² of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Balls {
    centers: Vec<DVec3>,
    radii_squared: Vec<f64>,
}

impl Balls {
    /// The balls of these centres and **squared** radii (radius rules work in squares, and squaring a root would round).
    ///
    /// # Errors
    /// A centre or radius outside the ranges above, or numbers of them that differ.
    pub fn new(centers: Vec<DVec3>, radii_squared: Vec<f64>) -> Result<Self, IndexError> {
        if centers.len() >= u32::MAX as usize {
            return Err(IndexError::TooMany(centers.len()));
        }
        if let Some(item) = centers.iter().position(|center| !center.is_finite()) {
            return Err(IndexError::Center(item));
        }
        check_radii(centers.len(), &radii_squared)?;
        Ok(Self {
            centers,
            radii_squared,
        })
    }

    /// Number of balls.
    pub fn len(&self) -> usize {
        self.centers.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.centers.is_empty()
    }

    /// Their centres.
    pub fn centers(&self) -> &[DVec3] {
        &self.centers
    }

    /// The squares of their radii.
    pub fn radii_squared(&self) -> &[f64] {
        &self.radii_squared
    }

    /// Gives the balls new squared radii.
    ///
    /// # Errors
    /// As [`Balls::new`].
    pub fn set_radii_squared(&mut self, radii_squared: &[f64]) -> Result<(), IndexError> {
        check_radii(self.len(), radii_squared)?;
        self.radii_squared.copy_from_slice(radii_squared);
        Ok(())
    }

    /// Whether ball `item` covers `query`.
    pub fn covers(&self, item: usize, query: DVec3) -> bool {
        covers(self.centers[item], self.radii_squared[item], query)
    }
}

/// The predicate of every index. A query with a NaN is covered by nothing.
fn covers(center: DVec3, radius_squared: f64, query: DVec3) -> bool {
    (query - center).length_squared() <= radius_squared
}

/// A box that contains every point that [`covers`] accepts.
///
/// `covers` rounds the difference, its square and the sums: an accepted component is at most r (1 + 4ε), or 2⁻⁵³⁶ where squares
/// underflow. The last step rounds outward.
fn ball_box(center: DVec3, radius_squared: f64) -> (DVec3, DVec3) {
    /// √(3 · 2⁻¹⁰⁷⁵) is below this: differences so small may square to 0.
    const UNDERFLOW: f64 = f64::from_bits((1023 - 536) << 52);
    let reach = radius_squared.sqrt() * (1.0 + 8.0 * f64::EPSILON) + UNDERFLOW;
    (
        (center - reach).map(f64::next_down),
        (center + reach).map(f64::next_up),
    )
}

/// Does both, side by side if it is worth a task.
fn both<A: Send, B: Send>(
    parallel: bool,
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    if parallel {
        rayon::join(a, b)
    } else {
        (a(), b())
    }
}

fn check_radii(centers: usize, radii_squared: &[f64]) -> Result<(), IndexError> {
    if centers != radii_squared.len() {
        return Err(IndexError::Count {
            centers,
            radii: radii_squared.len(),
        });
    }
    match radii_squared
        .iter()
        .position(|square| square.is_nan() || *square < 0.0)
    {
        Some(item) => Err(IndexError::Radius(item)),
        None => Ok(()),
    }
}

/// Calls `found` with every ball that covers the query, by asking each.
fn scan(balls: &Balls, query: DVec3, work: &mut Work, found: &mut dyn FnMut(usize)) {
    work.index_visits += 1;
    work.index_tests += balls.len() as u64;
    (0..balls.len())
        .filter(|&item| balls.covers(item, query))
        .for_each(found);
}

fn sum(mut a: Work, b: Work) -> Work {
    a += b;
    a
}

/// What a join gave, ball by ball.
///
/// An index that keeps its balls in an order of its own leaves the answers in that order: they may be large and many.
#[derive(Clone, Debug)]
pub struct Answers<'a, T> {
    values: Vec<T>,
    /// Where the answer of each ball stands, if they are not in the order of the balls.
    places: Option<&'a [u32]>,
}

impl<T: Copy> Answers<'_, T> {
    /// The answer of a ball.
    #[inline]
    pub fn of(&self, ball: usize) -> T {
        self.values[self.places.map_or(ball, |places| places[ball] as usize)]
    }
}

impl<T: Copy + Send + Sync> Answers<'_, T> {
    /// The answers in the order of the balls.
    pub fn in_order(self) -> Vec<T> {
        match self.places {
            None => self.values,
            Some(places) => {
                let places = places.par_iter().with_min_len(LEAST);
                places.map(|&place| self.values[place as usize]).collect()
            }
        }
    }
}

impl<T: Copy + Default> Answers<'_, T> {
    /// Blank answers of so many balls, in their order.
    fn blank(balls: usize) -> Self {
        Self {
            values: vec![T::default(); balls],
            places: None,
        }
    }
}

/// Fixed-radius search over [`Balls`].
pub trait BallIndex {
    /// Calls `found` with every ball that covers `query`, in an order that depends on the balls and the query only.
    fn visit(&self, query: DVec3, work: &mut Work, found: &mut dyn FnMut(usize));

    /// Blank answers of all balls.
    fn answers<T: Copy + Default + Send>(&self) -> Answers<'_, T>;

    /// Calls `gather` for every ball that covers at least one query, with the ball, the indices of its queries in rising order, and
    /// what it has answered so far. At most 2³² − 1 queries.
    ///
    /// Runs on the current rayon pool; the answers do not depend on the number of threads.
    ///
    /// # Panics
    /// If there are fewer answers than balls. They must be those of [`Self::answers`].
    fn join_onto<T, G>(
        &self,
        answers: &mut Answers<'_, T>,
        queries: &[DVec3],
        gather: &G,
        work: &mut Work,
    ) where
        T: Copy + Default + Send + Sync,
        G: Fn(usize, &[u32], &mut T) + Sync;

    /// The same once: what `gather` returns is a ball's answer, `T::default()` that of balls that cover no query.
    fn join<T, G>(&self, queries: &[DVec3], gather: &G, work: &mut Work) -> Answers<'_, T>
    where
        T: Copy + Default + Send + Sync,
        G: Fn(usize, &[u32]) -> T + Sync,
    {
        let mut answers = self.answers();
        let gather = |ball: usize, found: &[u32], answer: &mut T| *answer = gather(ball, found);
        self.join_onto(&mut answers, queries, &gather, work);
        answers
    }
}
