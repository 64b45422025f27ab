//! The linear scan: every query against every ball. The oracle of the other indices.

use super::{Answers, BallIndex, Balls, IndexError, scan};
use crate::numeric::work::Work;
use glam::DVec3;

/// Balls without any structure.
#[derive(Clone, Debug)]
pub struct Linear {
    balls: Balls,
}

impl Linear {
    /// An index over the balls.
    pub fn new(balls: Balls) -> Self {
        Self { balls }
    }

    /// Gives the balls new squared radii.
    ///
    /// # Errors
    /// As [`Balls::new`].
    pub fn set_radii_squared(&mut self, radii_squared: &[f64]) -> Result<(), IndexError> {
        self.balls.set_radii_squared(radii_squared)
    }
}

impl BallIndex for Linear {
    fn visit(&self, query: DVec3, work: &mut Work, found: &mut dyn FnMut(usize)) {
        scan(&self.balls, query, work, found);
    }

    fn answers<T: Copy + Default + Send>(&self) -> Answers<'_, T> {
        Answers::blank(self.balls.len())
    }

    fn join_onto<T, G>(
        &self,
        answers: &mut Answers<'_, T>,
        queries: &[DVec3],
        gather: &G,
        work: &mut Work,
    ) where
        T: Copy + Default + Send + Sync,
        G: Fn(usize, &[u32], &mut T) + Sync,
    {
        work.index_visits += queries.len() as u64;
        work.index_tests += (self.balls.len() * queries.len()) as u64;
        let mut covered: Vec<u32> = Vec::new();
        for (item, answer) in answers.values[..self.balls.len()].iter_mut().enumerate() {
            covered.clear();
            covered.extend(
                (0..queries.len() as u32)
                    .filter(|&query| self.balls.covers(item, queries[query as usize])),
            );
            if !covered.is_empty() {
                gather(item, &covered, answer);
            }
        }
    }
}
