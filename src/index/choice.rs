//! Any of the indices, by name.

use super::grid::Grid;
use super::kdtree::{KdTree, Split};
use super::linear::Linear;
use super::wide::WideTree;
use super::wide::swapped::Swapped;
use super::{Answers, BallIndex, Balls, IndexError};
use crate::numeric::work::Work;
use crate::scene::options::IndexName;
use glam::DVec3;

/// An index whose kind is chosen at run time. All give the same answers.
#[derive(Clone, Debug)]
pub enum Index {
    /// The scan.
    Linear(Linear),
    /// A kd-tree.
    KdTree(KdTree),
    /// A grid over the queries.
    Grid(Grid),
    /// The wide tree over the balls.
    Wide(WideTree),
    /// The wide tree over the queries.
    Swapped(Swapped),
}

macro_rules! each {
    ($index:expr, $kind:ident => $call:expr) => {
        match $index {
            Self::Linear($kind) => $call,
            Self::KdTree($kind) => $call,
            Self::Grid($kind) => $call,
            Self::Wide($kind) => $call,
            Self::Swapped($kind) => $call,
        }
    };
}

impl Index {
    /// Builds the index of a name.
    pub fn new(name: IndexName, balls: Balls) -> Self {
        match name {
            IndexName::Linear => Self::Linear(Linear::new(balls)),
            IndexName::Kdtree => Self::KdTree(KdTree::new(&balls, Split::Widest)),
            IndexName::KdtreeCycling => Self::KdTree(KdTree::new(&balls, Split::Cycle)),
            IndexName::Grid => Self::Grid(Grid::new(balls)),
            IndexName::Wide => Self::Wide(WideTree::new(&balls)),
            IndexName::WidePhotons => Self::Swapped(Swapped::new(balls)),
        }
    }

    /// Gives the balls new squared radii (in the order of the balls): cheaper than a new index.
    ///
    /// # Errors
    /// As [`Balls::new`].
    pub fn set_radii_squared(&mut self, radii_squared: &[f64]) -> Result<(), IndexError> {
        each!(self, index => index.set_radii_squared(radii_squared))
    }
}

impl BallIndex for Index {
    fn visit(&self, query: DVec3, work: &mut Work, found: &mut dyn FnMut(usize)) {
        each!(self, index => index.visit(query, work, found));
    }

    fn answers<T: Copy + Default + Send>(&self) -> Answers<'_, T> {
        each!(self, index => index.answers())
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
        each!(self, index => index.join_onto(answers, queries, gather, work));
    }
}
