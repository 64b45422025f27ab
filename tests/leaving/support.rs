//! Surfaces, places to leave them from, and how starts are judged.

use glam::DVec3;
use photolathe::geometry::hit::{Crossing, Hit, Side};
use photolathe::geometry::profile::{Piece, Profile};
use photolathe::geometry::ray::Ray;
use photolathe::geometry::revolution::membership::Membership;
use photolathe::geometry::revolution::{Placement, Revolution, Solver};
use photolathe::numeric::rng::{Purpose, Stream};
use photolathe::numeric::work::Work;
use photolathe::scene::sampling::uniform_sphere;

/// A straight piece.
pub(crate) fn line(from: [f64; 2], to: [f64; 2]) -> Piece {
    let mix = |w: f64| [0, 1].map(|k| (1.0 - w) * from[k] + w * to[k]);
    Piece::new([from, mix(1.0 / 3.0), mix(2.0 / 3.0), to])
}

pub(crate) fn polygon(points: &[[f64; 2]]) -> Profile {
    let pieces = points.windows(2).map(|pair| line(pair[0], pair[1]));
    Profile::new(pieces.collect()).expect("the pieces join")
}

pub(crate) fn placed(profile: Profile) -> Revolution {
    Revolution::new(profile, Placement::identity())
}

pub(crate) fn far_away(profile: Profile) -> Revolution {
    let there = DVec3::new(1e6, -2e6, 1.5e6);
    Revolution::new(profile, Placement::new(there, DVec3::ONE, 70.0, 1.0))
}

/// An implementation of "where the next ray starts".
pub(crate) type Start = fn(&Revolution, &Hit, Side, DVec3, &mut Work) -> DVec3;

pub(crate) fn certified(
    shape: &Revolution,
    hit: &Hit,
    side: Side,
    direction: DVec3,
    work: &mut Work,
) -> DVec3 {
    shape.leave(hit, side, direction, work).origin
}

/// The offset alone, as if every surface were flat and alone.
pub(crate) fn offset_alone(_: &Revolution, hit: &Hit, side: Side, _: DVec3, _: &mut Work) -> DVec3 {
    hit.beside(side)
}

/// Where on a profile the next hits are: pieces and parameters.
pub(crate) type Places = Vec<(u32, f64)>;

/// Parameters that close in on an end, and the end itself.
pub(crate) fn towards(end: f64) -> impl Iterator<Item = f64> {
    let steps = (1..54)
        .step_by(2)
        .map(|k| libm::scalbn(1.0, -k))
        .chain([0.0]);
    steps.map(move |step| if end == 0.0 { step } else { 1.0 - step })
}

/// What became of the starts of many hits.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub(crate) starts: u64,
    pub(crate) wrong: u64,
    /// Wrong starts that nobody was told of.
    pub(crate) silent: u64,
    pub(crate) work: Work,
}

impl Tally {
    fn add(&mut self, right: bool, flagged: bool) {
        self.starts += 1;
        self.wrong += u64::from(!right);
        self.silent += u64::from(!right && !flagged);
    }
}

/// Leaves a closed solid at each place, at some azimuths, into some directions on both sides. A start is wrong unless it is
/// inside behind the surface and outside in front, by exact membership.
pub(crate) fn leave_solid(shape: &Revolution, places: &Places, start: Start) -> Tally {
    let mut tally = Tally::default();
    each_departure(shape, places, &mut |hit, side, direction| {
        let mut work = Work::default();
        let from = start(shape, hit, side, direction, &mut work);
        let expected = match side {
            Side::Front => Membership::Outside,
            Side::Back => Membership::Inside,
        };
        tally.add(shape.membership(from) == expected, work.unseparated > 0);
        tally.work += work;
    });
    tally
}

/// As [`leave_solid`] for any surface: a start is wrong unless a ray from there against the normal meets the hit's own piece first,
/// from the right side, by the exact solver.
pub(crate) fn leave_sheet(shape: &Revolution, places: &Places, start: Start) -> Tally {
    let mut tally = Tally::default();
    each_departure(shape, places, &mut |hit, side, direction| {
        let mut work = Work::default();
        let from = start(shape, hit, side, direction, &mut work);
        let back = Ray::new(from, -hit.normal_on(side)).until(200.0 * hit.error);
        let met = shape.nearest(&back, &Solver::Exact, &mut Work::default());
        let right = met.is_some_and(|crossing| {
            crossing.piece == hit.piece
                && shape
                    .hit(&back, crossing)
                    .normal_on(side)
                    .dot(back.direction)
                    < 0.0
        });
        tally.add(right, work.unseparated > 0);
        tally.work += work;
    });
    tally
}

pub(crate) fn each_departure(
    shape: &Revolution,
    places: &Places,
    visit: &mut dyn FnMut(&Hit, Side, DVec3),
) {
    let mut stream = Stream::new(3, Purpose::Experiment, 0);
    for &(piece, u) in places {
        for _ in 0..4 {
            let away = uniform_sphere(stream.uniform2());
            let p = shape.placement();
            let towards_point = Ray::new(p.point_to_world(away), p.rotation * away);
            let crossing = Crossing { t: 0.0, piece, u };
            let hit = shape.hit(&towards_point, crossing);
            let direction = uniform_sphere(stream.uniform2());
            visit(&hit, hit.side_met(-direction), direction);
        }
    }
}

pub(crate) fn everywhere(profile: &Profile) -> Places {
    let pieces = 0..profile.pieces().len() as u32;
    let near = |piece| towards(0.0).chain(towards(1.0)).map(move |u| (piece, u));
    pieces.flat_map(near).collect()
}
