//! Isolation of the roots of a polynomial of degree 6 on [0, 1].

use super::line::clamped;
use super::{Padded, Undecided};
use crate::numeric::simd::Lanes;

/// An interval that holds exactly one root, a simple one, with a guess of it.
#[derive(Clone, Copy)]
pub(super) struct Bracket {
    pub(super) low: f64,
    pub(super) high: f64,
    /// Number of the coefficient before the sign change.
    pub(super) place: f64,
    /// The coefficients before and after it.
    pub(super) sides: [f64; 2],
    /// Second differences there.
    pub(super) bends: [f64; 2],
    pub(super) site: Site,
}

/// Where on its piece a bracket lies.
#[derive(Clone, Copy)]
pub(super) enum Site {
    Inside,
    /// It ends in the middle of a cap, where the root has a twin beyond the end.
    Tip,
    /// It ends at a joint, at this end of the piece (0 or 1): the root may truly lie on the neighbour.
    Joint(usize),
}

impl Bracket {
    /// Whether the polynomial is positive at `low`.
    #[inline(always)]
    pub(super) fn falls(&self) -> bool {
        self.sides[0] > self.sides[1]
    }

    /// Sign of the polynomial's slope at the root: 1 or −1.
    #[inline(always)]
    pub(super) fn slope(&self) -> f64 {
        if self.falls() { -1.0 } else { 1.0 }
    }

    /// The root of the control polygon P, corrected for f ≈ P + u (1 − u)/12 P″ (Voronovskaya 1932).
    ///
    /// Not the secant of the end values: where the value at one end is almost 0 (the root of the neighbour piece), it would start
    /// there and stay.
    #[inline(always)]
    pub(super) fn guess(&self) -> f64 {
        let Self {
            low,
            high,
            place,
            sides: [a, b],
            bends: [first, last],
            ..
        } = *self;
        let inverse = 1.0 / (a - b);
        let share = a * inverse;
        let u = (place + share) * (1.0 / 6.0);
        let bends = first + share * (last - first);
        let moved = u + 0.5 * (u * (1.0 - u)) * (bends * inverse);
        low + clamped(moved, 0.0, 1.0) * (high - low)
    }
}

/// The brackets of one piece, by rising parameter.
pub(super) struct Brackets {
    list: [Bracket; CAPACITY],
    len: usize,
}

/// A polynomial of degree 6 has at most six roots, two of which may be given to a neighbour.
const CAPACITY: usize = 8;

impl Brackets {
    #[inline(always)]
    pub(super) fn new() -> Self {
        let none = Bracket {
            low: 0.0,
            high: 0.0,
            place: 0.0,
            sides: [0.0; 2],
            bends: [0.0; 2],
            site: Site::Inside,
        };
        Self {
            list: [none; CAPACITY],
            len: 0,
        }
    }

    #[inline(always)]
    pub(super) fn push(&mut self, bracket: Bracket) -> Result<(), Undecided> {
        *self.list.get_mut(self.len).ok_or(Undecided)? = bracket;
        self.len += 1;
        Ok(())
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    pub(super) fn reverse(&mut self) {
        self.list[..self.len].reverse();
    }

    pub(super) fn sort(&mut self) {
        self.list[..self.len].sort_by(|a, b| a.low.total_cmp(&b.low));
    }

    #[inline(always)]
    pub(super) fn as_slice(&self) -> &[Bracket] {
        self.list.get(..self.len).unwrap_or_default()
    }
}

/// The bits of seven coefficients, and those of the first and the last.
pub(super) const ALL: u32 = 0x7f;
const ENDS: u32 = 0x41;

/// Halvings before two roots count as one: parameters are then 2⁻⁴⁰ apart.
const DEPTH: u32 = 40;

/// What the signs of the coefficients alone say of the roots in (0, 1).
pub(super) enum Sight {
    /// There is none.
    None,
    /// There is one.
    One(Bracket),
    /// There may be several.
    Many,
    /// The value at an end is too near to 0.
    Doubtful,
}

/// Looks at the signs. `error` bounds the error of each coefficient. A NaN is doubtful.
#[inline(always)]
pub(super) fn look(lanes: impl Lanes, c: &Padded, range: [f64; 2], error: f64) -> Sight {
    let (positive, negative) = lanes.beyond(c, error);
    sight(|i| c[i], positive & ALL, negative & ALL, range)
}

/// As [`look`], from the bits of the coefficients that are certainly positive, and of those certainly negative.
#[inline(always)]
pub(super) fn sight(
    c: impl Fn(usize) -> f64,
    positive: u32,
    negative: u32,
    [low, high]: [f64; 2],
) -> Sight {
    if positive == ALL || negative == ALL {
        return Sight::None;
    }
    let changes = changes(positive.into()) as u32;
    if positive | negative == ALL && changes & (changes - 1) == 0 {
        Sight::One(bracket(c, changes.trailing_zeros(), low, high))
    } else if (positive | negative) & ENDS == ENDS {
        Sight::Many
    } else {
        Sight::Doubtful
    }
}

/// The bits of the coefficients after which the sign changes, if all signs are certain.
#[inline(always)]
fn changes(positive: u64) -> u64 {
    (positive ^ (positive >> 1)) & u64::from(ALL >> 1)
}

/// Whether the signs alone say that there is exactly one root.
#[inline(always)]
pub(super) fn changes_once(positive: u64, negative: u64) -> bool {
    let changes = changes(positive);
    (positive | negative == u64::from(ALL))
        & (changes != 0)
        & (changes & changes.wrapping_sub(1) == 0)
}

/// Whether the signs alone say that there is no root.
#[inline(always)]
pub(super) fn has_one_sign(lanes: impl Lanes, c: &Padded, error: f64) -> bool {
    let (positive, negative) = lanes.beyond(c, error);
    (positive & ALL == ALL) | (negative & ALL == ALL)
}

/// The bracket where only coefficients `place` and `place + 1` differ in sign.
#[inline(always)]
fn bracket(c: impl Fn(usize) -> f64, place: u32, low: f64, high: f64) -> Bracket {
    let i = place as usize % 6;
    let bend = |i: usize| (c(i - 1) - c(i)) - (c(i) - c(i + 1));
    Bracket {
        low,
        high,
        place: f64::from(place),
        sides: [c(i), c(i + 1)],
        bends: [bend(i.max(1)), bend((i + 1).min(5))],
        site: Site::Inside,
    }
}

/// Brackets of the roots between two parameters. `error` bounds the error of each coefficient; a polynomial whose roots such an
/// error could make or unmake is undecided.
#[inline(always)]
pub(super) fn isolate(
    lanes: impl Lanes,
    c: &Padded,
    range: [f64; 2],
    error: f64,
) -> Result<Brackets, Undecided> {
    let mut found = Brackets::new();
    isolate_more(lanes, c, range, error, &mut found)?;
    Ok(found)
}

/// As [`isolate`], adding to what was found before.
#[inline(always)]
pub(super) fn isolate_more(
    lanes: impl Lanes,
    c: &Padded,
    range: [f64; 2],
    error: f64,
    found: &mut Brackets,
) -> Result<(), Undecided> {
    isolate_each(lanes, c, range, error, false, |bracket| {
        found.push(bracket)?;
        Ok(true)
    })
}

/// Brackets one by one, by rising parameter or by falling, as long as `take` wants more.
#[inline(always)]
pub(super) fn isolate_each(
    lanes: impl Lanes,
    c: &Padded,
    [low, high]: [f64; 2],
    error: f64,
    backwards: bool,
    mut take: impl FnMut(Bracket) -> Result<bool, Undecided>,
) -> Result<(), Undecided> {
    let mut node = Node {
        c: *c,
        low,
        high,
        error,
        depth: 0,
    };
    let mut waiting = [const { None }; WAITING];
    let mut len = 0;
    loop {
        match look(lanes, &node.c, [node.low, node.high], node.error) {
            Sight::None => {}
            Sight::One(bracket) => {
                if !take(bracket)? {
                    return Ok(());
                }
            }
            Sight::Many => {
                let (left, right) = node.divide()?;
                let (first, then) = if backwards {
                    (right, left)
                } else {
                    (left, right)
                };
                if !has_one_sign(lanes, &then.c, then.error) {
                    *waiting.get_mut(len).ok_or(Undecided)? = Some(then);
                    len += 1;
                }
                node = first;
                continue;
            }
            Sight::Doubtful => return Err(Undecided),
        }
        let Some(next) = len.checked_sub(1).and_then(|last| waiting[last]) else {
            return Ok(());
        };
        len -= 1;
        node = next;
    }
}

/// Parts of a piece that may wait for their turn. Each has a sign change or a coefficient near 0, and six changes are all there are.
const WAITING: usize = 8;

#[derive(Clone, Copy)]
struct Node {
    c: Padded,
    low: f64,
    high: f64,
    error: f64,
    depth: u32,
}

impl Node {
    /// Both parts. Each of their coefficients is a mean of the node's with positive weights, each of which is the result of fewer
    /// than 20 roundings; seven products are summed: at most 28 roundings by half an ulp of the greatest coefficient.
    #[inline(always)]
    fn divide(&self) -> Result<(Self, Self), Undecided> {
        if self.depth >= DEPTH {
            return Err(Undecided);
        }
        let greater = |a: f64, b: f64| if b > a { b } else { a };
        let [a, b, c, d, e, f, g, h] = self.c.map(f64::abs);
        let size = greater(
            greater(greater(a, b), greater(c, d)),
            greater(greater(e, f), greater(g, h)),
        );
        let error = self.error + 16.0 * f64::EPSILON * size;
        let mut cut = self.cut();
        let mut left = combine(&CUTS.0[cut][0], &self.c);
        // A value near 0 at the cut would leave the ends of both halves in doubt: cut elsewhere, once.
        if left[6].abs() <= error {
            cut = if cut < 3 { cut + 1 } else { cut - 1 };
            left = combine(&CUTS.0[cut][0], &self.c);
        }
        let right = combine(&CUTS.0[cut][1], &self.c);
        let middle = self.low + share(cut) * (self.high - self.low);
        let part = |c: Padded, low: f64, high: f64| Self {
            c,
            low,
            high,
            error,
            depth: self.depth + 1,
        };
        Ok((part(left, self.low, middle), part(right, middle, self.high)))
    }

    /// Where to cut: between two roots, if there are two. Ends of the same sign have between them a part of the other sign, most
    /// likely near the greatest coefficient of that sign. Deeper down halving is safer.
    #[inline(always)]
    fn cut(&self) -> usize {
        if self.depth > 3 || (self.c[0] > 0.0) != (self.c[6] > 0.0) {
            return 2;
        }
        let side = if self.c[0] > 0.0 { -1.0 } else { 1.0 };
        let c = |i: usize| side * self.c[i];
        let better = |a: (f64, usize), b: (f64, usize)| if b.0 > a.0 { b } else { a };
        let two = better((c(1), 0), (c(2), 1));
        let next = better((c(3), 2), (c(4), 3));
        let (best, place) = better(better(two, next), (c(5), 4));
        if best > 0.0 { place } else { 2 }
    }
}

/// The sum of columns times coefficients.
#[inline(always)]
fn combine(columns: &[Padded; 7], c: &Padded) -> Padded {
    let mut sum = [0.0; 8];
    for (column, c) in columns.iter().zip(c) {
        for (sum, weight) in sum.iter_mut().zip(column) {
            *sum += weight * c;
        }
    }
    sum
}

/// The parameter of cut number `cut`: sixths, where the coefficients stand.
#[inline(always)]
const fn share(cut: usize) -> f64 {
    (cut + 1) as f64 / 6.0
}

/// For each cut, what each coefficient gives to the coefficients of the left and of the right part (by blossoming: the left ones
/// are the means of the first coefficients with the Bernstein polynomials of their number as weights).
static CUTS: Cuts = {
    let mut cuts = [[[[0.0; 8]; 7]; 2]; 5];
    let mut cut = 0;
    while cut < 5 {
        let mut i = 0;
        while i < 8 {
            // The last coefficient stands twice.
            let row = if i < 7 { i } else { 6 };
            let mut j = 0;
            while j <= row {
                cuts[cut][0][j][i] = weight(row, j, share(cut));
                j += 1;
            }
            let rest = 6 - row;
            let mut j = 0;
            while j <= rest {
                cuts[cut][1][row + j][i] = weight(rest, j, share(cut));
                j += 1;
            }
            i += 1;
        }
        cut += 1;
    }
    Cuts(cuts)
};

#[repr(C, align(64))]
struct Cuts([[[Padded; 7]; 2]; 5]);

/// C(n, k) sᵏ (1 − s)ⁿ⁻ᵏ.
const fn weight(n: usize, k: usize, s: f64) -> f64 {
    let mut weight = 1.0;
    let mut i = 0;
    while i < n {
        weight *= if i < k {
            s * (n - i) as f64 / (i + 1) as f64
        } else {
            1.0 - s
        };
        i += 1;
    }
    weight
}
