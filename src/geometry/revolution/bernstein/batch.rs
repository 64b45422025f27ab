//! Many rays against all pieces.
//!
//! Eight rays at a time are scaled, and the signs of their coefficients on every piece looked at, each ray in a lane of the vector
//! registers. The brackets found wait in a queue for each piece; whenever eight are there, they are refined together. A lane
//! computes what a ray alone would, so the answers are the same to the bit. Rays that are nearly level, and those with any doubt,
//! are done alone.

use super::isolate::{ALL, Bracket, Sight, changes_once, isolate_each, sight};
use super::line::{Line, Times, holds};
use super::queue::{Flush, Queue, Seeker};
use super::solve::count;
use super::{Padded, Prepared, Slope, Undecided};
use crate::geometry::hit::Crossing;
use crate::geometry::ray::Ray;
use crate::numeric::simd::{Kernel, Lanes};
use crate::numeric::work::Work;
use glam::DVec3;

/// Numbers of 64 bits in the widest vector register.
pub(super) const LANES: usize = 8;

/// One number for each lane.
pub(super) type Vector = [f64; LANES];

/// Rays whose brackets wait together: enough to fill the queues, few enough for the nearest cache.
pub(super) const BLOCK: usize = 256;

/// More pieces than this are not looked at in lanes.
const MOST_PIECES: usize = 64;

/// See [`Prepared::nearest_many`].
pub(super) struct Many<'a> {
    pub(super) prepared: &'a Prepared,
    pub(super) rays: &'a [Ray],
    pub(super) found: &'a mut [Option<Crossing>],
    pub(super) undecided: &'a mut Vec<usize>,
    pub(super) work: &'a mut Work,
}

impl Kernel for Many<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self {
            prepared,
            rays,
            found,
            undecided,
            work,
        } = self;
        let mut queues = vec![Queue::EMPTY; prepared.pieces.len()];
        let mut views = vec![View::NONE; prepared.pieces.len()];
        let mut seekers = [Seeker::new(Times::NONE); BLOCK];
        let blocks = rays.chunks(BLOCK).zip(found.chunks_mut(BLOCK));
        for (block, (rays, found)) in blocks.enumerate() {
            for (group, rays) in rays.chunks(LANES).enumerate() {
                let lines = Lines::new(prepared, rays);
                let waiting = lines.look(prepared, &mut views);
                for (lane, &waiting) in waiting.iter().enumerate().take(rays.len()) {
                    let number = group * LANES + lane;
                    seekers[number] = Seeker::new(lines.times(lane));
                    if lines.kind[lane] == ODD || prepared.pieces.len() > MOST_PIECES {
                        seekers[number].alone = true;
                        continue;
                    }
                    if count(lines.kind[lane] == MISSING, work) {
                        continue;
                    }
                    let asker = Asker {
                        lanes,
                        prepared,
                        lines: &lines,
                        views: &views,
                        lane,
                        number,
                    };
                    let asked = asker.ask(waiting, &mut queues, &mut seekers, work);
                    seekers[number].alone |= asked.is_err();
                }
            }
            for (queue, piece) in queues.iter_mut().zip(&prepared.pieces) {
                prepared.vectors.run(Flush {
                    queue,
                    piece,
                    seekers: &mut seekers,
                    work,
                });
            }
            for (number, (ray, found)) in rays.iter().zip(found).enumerate() {
                let answer = seekers[number].answer().or_else(|Undecided| {
                    let valid = ray.is_valid();
                    if valid {
                        prepared.nearest(ray, work)
                    } else {
                        Ok(None)
                    }
                });
                if answer.is_err() {
                    undecided.push(block * BLOCK + number);
                }
                *found = answer.unwrap_or(None);
            }
        }
    }
}

/// Eight rays, one in each lane.
#[repr(C, align(64))]
struct Lines {
    o: [Vector; 3],
    d: [Vector; 3],
    along: Vector,
    across: Vector,
    twice_b: Vector,
    k: Vector,
    error: Vector,
    slack: Vector,
    heights: [Vector; 2],
    unit: [Vector; 2],
    range: [Vector; 2],
    kind: [u64; LANES],
    climbs: [u64; LANES],
}

/// The ray is solved in lanes.
const ORDINARY: u64 = 0;
/// The ray passes the profile.
const MISSING: u64 = 1;
/// The ray is to be done alone.
const ODD: u64 = 2;

impl Lines {
    #[inline(always)]
    fn new(prepared: &Prepared, rays: &[Ray]) -> Self {
        // A ray for every lane; those that stand for none are not looked at later.
        let mut numbers = [[1.0; LANES]; 8];
        for (lane, ray) in rays.iter().enumerate() {
            let Ray {
                origin: o,
                direction: d,
                t_min,
                t_max,
            } = *ray;
            let row = [o.x, o.y, o.z, d.x, d.y, d.z, t_min, t_max];
            for (to, from) in numbers.iter_mut().zip(row) {
                to[lane] = from;
            }
        }
        let zero = [0.0; LANES];
        let mut lines = Self {
            o: [zero; 3],
            d: [zero; 3],
            along: zero,
            across: zero,
            twice_b: zero,
            k: zero,
            error: zero,
            slack: zero,
            heights: [zero; 2],
            unit: [zero; 2],
            range: [zero; 2],
            kind: [ORDINARY; LANES],
            climbs: [0; LANES],
        };
        for lane in 0..LANES {
            let [ox, oy, oz, dx, dy, dz, t_min, t_max] = &numbers;
            let ray = Ray {
                origin: DVec3::new(ox[lane], oy[lane], oz[lane]),
                direction: DVec3::new(dx[lane], dy[lane], dz[lane]),
                t_min: t_min[lane],
                t_max: t_max[lane],
            };
            let (line, fine) = Line::new(prepared, &ray);
            lines.set(lane, &line, fine);
        }
        lines
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, line: &Line, fine: bool) {
        let aim = &line.aim;
        self.o[0][lane] = aim.o.x;
        self.o[1][lane] = aim.o.y;
        self.o[2][lane] = aim.o.z;
        self.d[0][lane] = aim.d.x;
        self.d[1][lane] = aim.d.y;
        self.d[2][lane] = aim.d.z;
        self.along[lane] = aim.along;
        self.across[lane] = aim.across;
        self.twice_b[lane] = line.twice_b;
        self.k[lane] = line.k;
        self.error[lane] = line.error;
        self.slack[lane] = line.slack;
        self.heights[0][lane] = line.heights[0];
        self.heights[1][lane] = line.heights[1];
        self.unit[0][lane] = line.times.unit[0];
        self.unit[1][lane] = line.times.unit[1];
        self.range[0][lane] = line.times.range[0];
        self.range[1][lane] = line.times.range[1];
        let odd = !fine | line.is_nearly_level();
        let missing = if line.outside { MISSING } else { ORDINARY };
        self.kind[lane] = if odd { ODD } else { missing };
        self.climbs[lane] = u64::from(line.climbs());
    }

    /// Coefficients and signs of all lanes on all pieces. The bits of the answer say for each lane at which places of its order
    /// there may be a root.
    #[inline(always)]
    fn look(&self, prepared: &Prepared, views: &mut [View]) -> [u64; LANES] {
        let (mut waiting, mut later) = ([0; LANES], [0_u64; LANES]);
        let pieces = prepared.pieces.iter().take(MOST_PIECES);
        for (piece, view) in pieces.zip(views) {
            let [rising, falling] = piece.ranks.map(|rank| 1_u64 << (rank % 64));
            let (mut positive, mut negative) = ([0_u64; LANES], [0_u64; LANES]);
            for i in 0..7 {
                let [r2, h2, h] = [
                    piece.radius_squared[i],
                    piece.height_squared[i],
                    piece.height_raised[i],
                ];
                let bit = 1_u64 << i;
                for lane in 0..LANES {
                    let c = self.along[lane] * r2
                        - self.across[lane] * h2
                        - self.twice_b[lane] * h
                        - self.k[lane];
                    let error = self.error[lane];
                    view.c[i][lane] = c;
                    positive[lane] |= if c > error { bit } else { 0 };
                    negative[lane] |= if c < -error { bit } else { 0 };
                }
            }
            view.positive = positive;
            view.negative = negative;
            let all = u64::from(ALL);
            for lane in 0..LANES {
                let low = piece.top < self.heights[0][lane] - self.slack[lane];
                let high = piece.bottom > self.heights[1][lane] + self.slack[lane];
                let bit = if self.climbs[lane] != 0 {
                    rising
                } else {
                    falling
                };
                let idle = (positive[lane] == all) | (negative[lane] == all) | low | high;
                waiting[lane] |= if idle { 0 } else { bit };
            }
            // What has a lower rank than this piece is left out here; the rest later, as far as it comes to that.
            if !piece.looks_back {
                continue;
            }
            let [climbing, descending] = &piece.later;
            for lane in 0..LANES {
                let once = changes_once(positive[lane], negative[lane]);
                let falls = positive[lane] & 1 != 0;
                let left_out = if self.climbs[lane] != 0 {
                    climbing.than(falls)
                } else {
                    descending.than(falls)
                };
                let holds = holds(self.heights.map(|h| h[lane]), self.slack[lane], piece);
                later[lane] |= if once & holds { left_out } else { 0 };
            }
        }
        for (waiting, later) in waiting.iter_mut().zip(later) {
            *waiting &= !later;
        }
        waiting
    }

    #[inline(always)]
    fn times(&self, lane: usize) -> Times {
        Times {
            unit: [self.unit[0][lane], self.unit[1][lane]],
            range: [self.range[0][lane], self.range[1][lane]],
        }
    }
}

/// The coefficients of eight rays on a piece, and which of them are certainly positive or negative.
#[derive(Clone)]
#[repr(C, align(64))]
struct View {
    c: [Vector; 7],
    positive: [u64; LANES],
    negative: [u64; LANES],
}

impl View {
    const NONE: Self = Self {
        c: [[0.0; LANES]; 7],
        positive: [0; LANES],
        negative: [0; LANES],
    };

    #[inline(always)]
    fn coefficients(&self, lane: usize) -> Padded {
        let c = |i: usize| self.c[i][lane];
        [c(0), c(1), c(2), c(3), c(4), c(5), c(6), c(6)]
    }
}

/// One ray of eight.
struct Asker<'a, L> {
    lanes: L,
    prepared: &'a Prepared,
    lines: &'a Lines,
    views: &'a [View],
    lane: usize,
    number: usize,
}

impl<L: Lanes> Asker<'_, L> {
    /// Puts the brackets of the ray into the queues, until it is certain to have a crossing before the next piece.
    #[inline(always)]
    fn ask(
        &self,
        mut waiting: u64,
        queues: &mut [Queue],
        seekers: &mut [Seeker; BLOCK],
        work: &mut Work,
    ) -> Result<(), Undecided> {
        let (lines, lane) = (self.lines, self.lane);
        let climbs = lines.climbs[lane] != 0;
        let order = if climbs {
            &self.prepared.rising
        } else {
            &self.prepared.falling
        };
        let slack = lines.slack[lane];
        let heights = lines.heights.map(|h| h[lane]);
        let ray = [&lines.o, &lines.d].map(|v| DVec3::new(v[0][lane], v[1][lane], v[2][lane]));
        let direction = usize::from(!climbs);
        while waiting != 0 {
            let rank = waiting.trailing_zeros() as usize;
            waiting &= waiting - 1;
            let place = order[rank];
            let piece = &self.prepared.pieces[place];
            let certain = holds(heights, slack, piece);
            let view = &self.views[place];
            let queue = &mut queues[place];
            let (positive, negative) = (view.positive[lane] as u32, view.negative[lane] as u32);
            let later = &piece.later[direction];
            let mut left_out = later.always;
            let mut push = |bracket: &Bracket, queue: &mut Queue| {
                if queue.push(ray, bracket, self.number) {
                    self.prepared.vectors.run(Flush {
                        queue,
                        piece,
                        seekers,
                        work,
                    });
                }
            };
            match sight(|i| view.c[i][lane], positive, negative, [0.0, 1.0]) {
                Sight::None => continue,
                Sight::One(bracket) => {
                    left_out = later.than(bracket.falls());
                    push(&bracket, queue);
                }
                Sight::Many => {
                    let c = view.coefficients(lane);
                    let backwards = (piece.slope == Slope::Rises) != climbs;
                    let several = !certain || piece.slope == Slope::Turns;
                    let mut none = true;
                    isolate_each(
                        self.lanes,
                        &c,
                        [0.0, 1.0],
                        lines.error[lane],
                        backwards,
                        |bracket| {
                            push(&bracket, queue);
                            none = false;
                            Ok(several)
                        },
                    )?;
                    if none {
                        continue;
                    }
                }
                Sight::Doubtful => return Err(Undecided),
            };
            if certain {
                waiting &= !left_out;
            }
        }
        Ok(())
    }
}
