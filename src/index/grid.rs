//! A dense grid over the queries, asked by each ball (as Hachisuka and Jensen 2010 hash photons, but without collisions: every
//! cell has its own place).

use super::{Answers, BallIndex, Balls, IndexError, ball_box, scan, sum};
use crate::numeric::work::Work;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Balls of one task.
const CHUNK: usize = 256;
/// Most cells for each query, and along one axis.
const CELLS_PER_QUERY: f64 = 4.0;
const MOST_ALONG: f64 = 1024.0;

/// Balls that ask a grid of queries. The grid is made anew in each join, by a counting sort.
#[derive(Clone, Debug)]
pub struct Grid {
    balls: Balls,
}

/// Queries in cells.
struct Cells {
    least: DVec3,
    /// Cells per unit.
    scale: f64,
    size: [usize; 3],
    /// Where each cell begins in `items`, x fastest; one more at the end.
    starts: Vec<u32>,
    /// Queries by cell, rising in each.
    items: Vec<u32>,
}

impl Grid {
    /// Takes the balls.
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

    /// Bytes that a join with these queries holds for them.
    pub fn bytes(&self, queries: &[DVec3]) -> usize {
        let cells = Cells::new(queries, self.cell());
        size_of_val(&*cells.starts) + size_of_val(&*cells.items)
    }

    /// Twice the median radius.
    fn cell(&self) -> f64 {
        let mut squares = self.balls.radii_squared.clone();
        let middle = squares.len() / 2;
        match squares.is_empty() {
            true => 1.0,
            false => {
                2.0 * squares
                    .select_nth_unstable_by(middle, f64::total_cmp)
                    .1
                    .sqrt()
            }
        }
    }
}

impl Cells {
    fn new(queries: &[DVec3], cell: f64) -> Self {
        let finite = queries.iter().filter(|query| query.is_finite());
        let (least, most) = finite.fold(
            (DVec3::INFINITY, DVec3::NEG_INFINITY),
            |(least, most), &query| (least.min(query), most.max(query)),
        );
        let extent = (most - least).max(DVec3::ZERO);
        // No extent in cells of no width, a NaN, makes one cell.
        let along = |cells: f64| {
            if cells >= 1.0 {
                (cells.floor() + 1.0).min(MOST_ALONG)
            } else {
                1.0
            }
        };
        let mut size = (extent / cell).map(along);
        while size.element_product() > CELLS_PER_QUERY * queries.len() as f64 + 8.0 {
            size = (0.5 * size).ceil();
        }
        let scale = (size / extent).min_element();
        let mut cells = Self {
            least,
            // One cell where there is no extent, or one without bounds.
            scale: if scale < f64::INFINITY { scale } else { 0.0 },
            size: size.to_array().map(|along| along as usize),
            starts: Vec::new(),
            items: vec![0; queries.len()],
        };
        cells.deal(queries);
        cells
    }

    fn deal(&mut self, queries: &[DVec3]) {
        let mut starts = vec![0_u32; self.size.iter().product::<usize>() + 1];
        let cells: Vec<u32> = queries
            .par_iter()
            .map(|&query| self.number(self.at(query)) as u32)
            .collect();
        cells
            .iter()
            .for_each(|&cell| starts[cell as usize + 1] += 1);
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        for (query, cell) in (0..).zip(cells) {
            let place = &mut next[cell as usize];
            self.items[*place as usize] = query;
            *place += 1;
        }
        self.starts = starts;
    }

    /// The cell of a point, the nearest one for points outside. It never falls as a coordinate rises: what lies in a box lies in
    /// the cells between those of its corners.
    fn at(&self, point: DVec3) -> [usize; 3] {
        let at = ((point - self.least) * self.scale).to_array();
        // The conversion takes NaN and what is below 0 to 0.
        std::array::from_fn(|axis| (at[axis] as usize).min(self.size[axis] - 1))
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// The places of queries in the cells between two: a range for each row of cells.
    fn rows(&self, low: [usize; 3], high: [usize; 3]) -> impl Iterator<Item = Range<usize>> + '_ {
        (low[2]..=high[2]).flat_map(move |z| {
            (low[1]..=high[1]).map(move |y| {
                let first = self.starts[self.number([low[0], y, z])];
                let end = self.starts[self.number([high[0], y, z]) + 1];
                first as usize..end as usize
            })
        })
    }
}

impl BallIndex for Grid {
    /// A scan of all balls: there is no structure over them.
    fn visit(&self, query: DVec3, work: &mut Work, found: &mut dyn FnMut(usize)) {
        scan(&self.balls, query, work, found);
    }

    fn answers<T: Copy + Default + Send>(&self) -> Answers<'_, T> {
        Answers::blank(self.balls.len())
    }

    /// Cells are as wide as twice the median radius, or wider if that would make more than four for each query: a grid is at
    /// its best where radii and densities are even.
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
        let cells = Cells::new(queries, self.cell());
        let answers = &mut answers.values[..self.balls.len()];
        let chunks = answers.par_chunks_mut(CHUNK).enumerate();
        let works = chunks.map_init(Vec::new, |hits, (chunk, out)| {
            let mut work = Work::default();
            for (item, answer) in (chunk * CHUNK..).zip(out) {
                hits.clear();
                let (least, most) =
                    ball_box(self.balls.centers[item], self.balls.radii_squared[item]);
                for row in cells.rows(cells.at(least), cells.at(most)) {
                    work.index_visits += 1;
                    work.index_tests += row.len() as u64;
                    let covered = |query: &u32| self.balls.covers(item, queries[*query as usize]);
                    hits.extend(cells.items[row].iter().copied().filter(covered));
                }
                if !hits.is_empty() {
                    hits.sort_unstable();
                    gather(item, hits, answer);
                }
            }
            work
        });
        *work += works.reduce(Work::default, sum);
    }
}
