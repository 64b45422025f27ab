//! Brackets that wait to be refined, and the rays that want them.

use super::batch::{BLOCK, LANES, Vector};
use super::isolate::{Bracket, Site};
use super::line::{Aim, Times};
use super::order::Leader;
use super::refine::{Refined, STEPS, refine, refine_more};
use super::{Answer, Cubics, PreparedPiece, Root, Undecided};
use crate::numeric::simd::{Kernel, Lanes};
use crate::numeric::work::Work;
use glam::DVec3;

/// A ray of a block.
#[derive(Clone, Copy)]
pub(super) struct Seeker {
    times: Times,
    leader: Leader,
    /// To be done alone.
    pub(super) alone: bool,
}

impl Seeker {
    #[inline(always)]
    pub(super) fn new(times: Times) -> Self {
        Self {
            times,
            leader: Leader::NONE,
            alone: false,
        }
    }

    #[inline(always)]
    fn add(&mut self, piece: u32, root: &Root) {
        match self.times.has(root) {
            Err(Undecided) => self.alone = true,
            Ok(false) => {}
            Ok(true) => self.leader.add(piece, root),
        }
    }

    /// The nearest crossing, unless the ray is to be done alone.
    #[inline(always)]
    pub(super) fn answer(&self) -> Answer {
        if self.alone {
            return Err(Undecided);
        }
        self.leader.crossing(&self.times)
    }
}

/// Empties a queue.
pub(super) struct Flush<'a> {
    pub(super) queue: &'a mut Queue,
    pub(super) piece: &'a PreparedPiece,
    pub(super) seekers: &'a mut [Seeker; BLOCK],
    pub(super) work: &'a mut Work,
}

impl Kernel for Flush<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, _: L) {
        if self.queue.len > 0 {
            self.queue.flush(self.piece, self.seekers, self.work);
        }
    }
}

/// Brackets on one piece that wait to be refined together.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Queue {
    o: [Vector; 3],
    d: [Vector; 3],
    low: Vector,
    high: Vector,
    place: Vector,
    sides: [Vector; 2],
    bends: [Vector; 2],
    /// Number of the ray in the block.
    asker: [usize; LANES],
    len: usize,
}

impl Queue {
    pub(super) const EMPTY: Self = Self {
        o: [[0.0; LANES]; 3],
        d: [[0.0; LANES]; 3],
        low: [0.0; LANES],
        high: [0.0; LANES],
        place: [0.0; LANES],
        sides: [[0.0; LANES]; 2],
        bends: [[0.0; LANES]; 2],
        asker: [0; LANES],
        len: 0,
    };

    /// Adds a bracket of a ray (origin and direction); whether the queue is full now.
    #[inline(always)]
    pub(super) fn push(&mut self, ray: [DVec3; 2], bracket: &Bracket, asker: usize) -> bool {
        let lane = self.len % LANES;
        let [o, d] = ray;
        for (to, from) in self.o.iter_mut().zip(o.to_array()) {
            to[lane] = from;
        }
        for (to, from) in self.d.iter_mut().zip(d.to_array()) {
            to[lane] = from;
        }
        self.low[lane] = bracket.low;
        self.high[lane] = bracket.high;
        self.place[lane] = bracket.place;
        for i in 0..2 {
            self.sides[i][lane] = bracket.sides[i];
            self.bends[i][lane] = bracket.bends[i];
        }
        self.asker[lane] = asker;
        self.len += 1;
        self.len == LANES
    }

    /// Refines all that wait, and hands out the roots.
    #[inline(always)]
    fn flush(&mut self, piece: &PreparedPiece, seekers: &mut [Seeker; BLOCK], work: &mut Work) {
        let curve = &piece.curve;
        let zero = [0.0; LANES];
        let [mut u, mut t, mut tolerance, mut change] = [zero; 4];
        let mut sure = [0_u64; LANES];
        for lane in 0..LANES {
            let bracket = self.bracket(lane);
            let refined = refine(curve, &self.aim(lane), &bracket);
            u[lane] = refined.root.u;
            t[lane] = refined.root.t;
            tolerance[lane] = refined.root.tolerance;
            change[lane] = refined.change;
            sure[lane] = u64::from(refined.sure);
        }
        work.solver_iterations += STEPS * self.len as u64;
        for lane in 0..self.len {
            let mut root = Root {
                u: u[lane],
                t: t[lane],
                tolerance: tolerance[lane],
            };
            if sure[lane] == 0 {
                root = self.refine_more(curve, lane, root, change[lane], work);
            }
            seekers[self.asker[lane] % BLOCK].add(piece.index, &root);
        }
        self.len = 0;
    }

    #[inline(never)]
    fn refine_more(
        &self,
        curve: &Cubics,
        lane: usize,
        root: Root,
        change: f64,
        work: &mut Work,
    ) -> Root {
        let bracket = self.bracket(lane);
        let first = Refined {
            root,
            change,
            sure: false,
        };
        let steps = &mut work.solver_iterations;
        refine_more(curve, &self.aim(lane), &bracket, &first, steps)
    }

    #[inline(always)]
    fn bracket(&self, lane: usize) -> Bracket {
        Bracket {
            low: self.low[lane],
            high: self.high[lane],
            place: self.place[lane],
            sides: [self.sides[0][lane], self.sides[1][lane]],
            bends: [self.bends[0][lane], self.bends[1][lane]],
            site: Site::Inside,
        }
    }

    #[inline(always)]
    fn aim(&self, lane: usize) -> Aim {
        let [o, d] = [&self.o, &self.d].map(|v| DVec3::new(v[0][lane], v[1][lane], v[2][lane]));
        Aim::new(o, d)
    }
}
