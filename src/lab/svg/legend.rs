//! The legend above a plot.

use super::front::FRONT;
use super::{Area, Drawn, Look, Place, Plot, Style, TEXT, WIDTH, front, line, mark, write};

const LINE: i32 = 20;
/// Characters of a name that fit half the width.
const SHORT_NAME: usize = 22;

/// What the legend says, in order: the series, and the front if the plot marks it.
pub(super) struct Legend<'a> {
    entries: Vec<(&'a str, Option<Look>)>,
    columns: usize,
}

impl<'a> Legend<'a> {
    pub(super) fn of(plot: &'a Plot, looks: &[Look]) -> Self {
        let names = plot.series.iter().map(|series| series.name.as_str());
        let mut entries: Vec<_> = names.zip(looks.iter().copied().map(Some)).collect();
        if plot.front {
            entries.push((FRONT, None));
        }
        let short = |(name, _): &(&str, Option<Look>)| name.chars().count() <= SHORT_NAME;
        // Two columns where several short names allow it.
        let columns = 1 + usize::from(entries.len() > 2 && entries.iter().all(short));
        Self { entries, columns }
    }

    /// Its height in pixels.
    pub(super) fn height(&self) -> u32 {
        LINE as u32 * self.entries.len().div_ceil(self.columns) as u32 + 6
    }

    pub(super) fn draw(&self, area: &Area) -> Drawn {
        for (index, &(name, look)) in self.entries.iter().enumerate() {
            let left = (index % self.columns) as i32 * WIDTH as i32 / self.columns as i32;
            let y = LINE * (index / self.columns) as i32 + LINE / 2 + 3;
            let middle: Place = (left + 31, y);
            match look {
                Some(look) => {
                    line(area, vec![(left + 16, y), (left + 46, y)], look)?;
                    if look.style != Style::Prediction {
                        mark(area, middle, look)?;
                    }
                }
                None => front::sample(area, middle)?,
            }
            write(area, name, (left + 54, y - TEXT / 2), TEXT)?;
        }
        Ok(())
    }
}
