//! Marks: a shape of its own for each of six series, so that colour is not needed to tell them apart; from the seventh on they are hollow.

use super::{Area, Drawn, Look, Place, text};
use plotters::prelude::*;

/// Draws the mark of a series.
pub(super) fn mark(area: &Area, (x, y): Place, look: Look) -> Drawn {
    let fill = if look.mark < 6 {
        look.colour.filled()
    } else {
        look.colour.stroke_width(1)
    };
    let polygon = |corners: &[Place]| {
        let corners: Vec<Place> = corners.iter().map(|c| (x + c.0, y + c.1)).collect();
        if look.mark < 6 {
            area.draw(&Polygon::new(corners, fill))
        } else {
            let closed = corners.iter().chain(corners.first()).copied();
            area.draw(&PathElement::new(closed.collect::<Vec<_>>(), fill))
        }
    };
    match look.mark % 6 {
        0 => area.draw(&Circle::new((x, y), 4, fill)),
        1 => area.draw(&Rectangle::new([(x - 4, y - 4), (x + 4, y + 4)], fill)),
        2 => polygon(&[(0, -5), (-5, 4), (5, 4)]),
        3 => polygon(&[(0, -5), (-5, 0), (0, 5), (5, 0)]),
        4 => polygon(&[(0, 5), (-5, -4), (5, -4)]),
        _ => area.draw(&Cross::new((x, y), 4, look.colour.stroke_width(3))),
    }
    .map_err(text)
}
