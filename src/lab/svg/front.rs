//! The Pareto front of a plot, and the texts beside its points.

use super::{Area, Drawn, INK, Place, Plane, Plot, has_place, local, text, write};
use plotters::prelude::*;

/// The front's name in the legend.
pub(super) const FRONT: &str = "Pareto front";

const RING: i32 = 8;
const LABEL: i32 = 14;
/// Width of a letter of a label, at most.
const LETTER: i32 = 8;

/// Marks the front, if the plot asks for it, and writes the labels of the points.
pub(super) fn draw(plane: &Plane, plot: &Plot) -> Drawn {
    let flat = plane.strip_coord_spec();
    let front = match plot.front {
        true => plot.pareto_front(),
        false => Vec::new(),
    };
    let place = |(series, point): (usize, usize)| local(plane, plot.series[series].points[point]);
    let places: Vec<Place> = front.iter().map(|&at| place(at)).collect();
    staircase(&flat, &places)?;
    for &place in &places {
        ring(&flat, place)?;
    }
    let all = (0..plot.series.len())
        .flat_map(|series| (0..plot.series[series].labels.len()).map(move |point| (series, point)));
    let mut order: Vec<(usize, usize)> = all
        .filter(|&(series, point)| {
            let at = plot.series[series].points.get(point);
            at.is_some_and(|at| has_place(plot, at))
        })
        .collect();
    // Where there is no room for all, those of the front come first.
    order.sort_by_key(|at| !front.contains(at));
    let marks: Vec<Place> = order.iter().map(|&at| place(at)).collect();
    let mut taken: Vec<Frame> = marks.iter().map(|&at| Frame::about(at)).collect();
    let (width, height) = flat.dim_in_pixel();
    let page = Frame([0, 0, width as i32, height as i32]);
    for (&(series, point), &place) in order.iter().zip(&marks) {
        let label = &plot.series[series].labels[point];
        let size = (LETTER * label.chars().count() as i32, LABEL);
        let own = Frame::about(place);
        let free = Frame::beside(place, size).into_iter().find(|frame| {
            page.holds(frame)
                && !taken
                    .iter()
                    .any(|other| *other != own && other.meets(frame))
        });
        if let Some(frame) = free {
            write(&flat, label, (frame.0[0], frame.0[1]), LABEL)?;
            taken.push(frame);
        }
    }
    Ok(())
}

/// What the legend shows of the front.
pub(super) fn sample(area: &Area, (x, y): Place) -> Drawn {
    staircase(area, &[(x - 15, y - 4), (x + 15, y + 4)])?;
    ring(area, (x, y))
}

fn ring(area: &Area, place: Place) -> Drawn {
    area.draw(&Circle::new(place, RING, INK.stroke_width(1)))
        .map_err(text)
}

/// What lies to the right of and above the steps is beaten.
fn staircase(area: &Area, places: &[Place]) -> Drawn {
    let steps = places
        .windows(2)
        .flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]);
    let steps: Vec<Place> = steps.chain(places.last().copied()).collect();
    area.draw(&PathElement::new(steps, INK.stroke_width(1)))
        .map_err(text)
}

/// A rectangle: left, top, right, bottom.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Frame([i32; 4]);

impl Frame {
    /// The room of a mark.
    fn about((x, y): Place) -> Self {
        Self([x - 5, y - 5, x + 5, y + 5])
    }

    /// Places for a text of this size beside a mark, best first.
    fn beside((x, y): Place, (width, height): (i32, i32)) -> [Self; 4] {
        let at = |left: i32, top: i32| Self([left, top, left + width, top + height]);
        let (right, left) = (x + RING, x - RING - width);
        let (above, below) = (y - RING - height + 2, y + RING - 2);
        [
            at(right, above),
            at(left, below),
            at(right, below),
            at(left, above),
        ]
    }

    fn meets(&self, other: &Self) -> bool {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
        a < g && e < c && b < h && f < d
    }

    fn holds(&self, other: &Self) -> bool {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
        a <= e && b <= f && g <= c && h <= d
    }
}
