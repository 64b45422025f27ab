//! Axes of plots: range, ticks and their texts, linear or logarithmic.

use super::plot::Scale;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// Room beyond the data, as a share of the axis.
const MARGIN: f64 = 0.04;

/// Up to so many decades a logarithmic axis has ticks at 1, 2 and 5 of each, beyond at powers of ten only.
const MANY_DECADES: f64 = 2.2;

/// The drawn part of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Span {
    scale: Scale,
    low: f64,
    high: f64,
}

impl Span {
    /// The span of all values that the scale can show, with some room; `None` if it can show none.
    pub(super) fn of(values: impl Iterator<Item = f64>, scale: Scale) -> Option<Self> {
        let shown = values.filter(|&v| scale.shows(v)).map(|v| flat(scale, v));
        let (low, high) = shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        if low > high {
            return None;
        }
        // A single value gets one decade, or its own size, about it.
        let room = match (high - low, scale) {
            (extent, _) if extent > 0.0 => MARGIN * extent,
            (_, Scale::Log) => 0.5,
            (_, Scale::Linear) => 0.5 * high.abs().max(1e-300),
        };
        Some(Self {
            scale,
            low: low - room,
            high: high + room,
        })
    }

    /// Positions of the ticks: decades, or 1-2-5 steps within a decade, or 1-2-5 steps of a linear axis.
    fn ticks(&self, most: usize) -> Vec<f64> {
        let most = most.max(2) as f64;
        match self.scale {
            Scale::Linear => linear_ticks(self.low, self.high, most),
            Scale::Log if self.high - self.low > MANY_DECADES => {
                let step = ((self.high - self.low) / most).ceil().max(1.0);
                let first = (self.low / step).ceil() as i64;
                let last = (self.high / step).floor() as i64;
                (first..=last)
                    .map(|k| libm::exp10(k as f64 * step))
                    .collect()
            }
            Scale::Log => {
                let decades = (self.low.floor() as i32)..=(self.high.floor() as i32);
                let all =
                    decades.flat_map(|d| [1.0, 2.0, 5.0].map(|m| m * libm::exp10(f64::from(d))));
                let kept: Vec<f64> = all
                    .filter(|&v| (self.low..=self.high).contains(&libm::log10(v)))
                    .collect();
                if kept.len() >= 2 {
                    kept
                } else {
                    linear_ticks(libm::exp10(self.low), libm::exp10(self.high), most)
                }
            }
        }
    }
}

fn flat(scale: Scale, value: f64) -> f64 {
    match scale {
        Scale::Linear => value,
        Scale::Log => libm::log10(value),
    }
}

fn linear_ticks(low: f64, high: f64, most: f64) -> Vec<f64> {
    let rough = (high - low) / most;
    let decade = libm::exp10(libm::log10(rough).floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * decade)
        .into_iter()
        .find(|&s| s >= rough)
        .unwrap_or(rough);
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

impl Ranged for Span {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let share = (flat(self.scale, *value) - self.low) / (self.high - self.low);
        let share = share.clamp(-1.0, 2.0);
        limit.0 + (share * f64::from(limit.1 - limit.0) + 0.5).floor() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        self.ticks(hint.bold_points())
    }

    fn range(&self) -> Range<f64> {
        match self.scale {
            Scale::Linear => self.low..self.high,
            Scale::Log => libm::exp10(self.low)..libm::exp10(self.high),
        }
    }
}

impl ValueFormatter<f64> for Span {
    fn format_ext(&self, value: &f64) -> String {
        tick_text(*value)
    }
}

/// A tick's text: plain digits near 1, a power of ten elsewhere.
fn tick_text(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = libm::log10(value.abs()).floor() as i32;
    if (-3..5).contains(&exponent) {
        // Twelve digits hide the rounding of multiples such as 3 · 0.1.
        let text = format!("{value:.12}");
        return text
            .trim_end_matches('0')
            .trim_end_matches('.')
            .replace('-', "−");
    }
    let power: String = exponent.to_string().chars().map(superscript).collect();
    let mantissa = format!("{:.2}", value / libm::exp10(f64::from(exponent)));
    match mantissa.trim_end_matches('0').trim_end_matches('.') {
        "1" => format!("10{power}"),
        digits => format!("{digits}·10{power}"),
    }
}

fn superscript(c: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let span = Span::of([0.0, 7.3].into_iter(), Scale::Linear).unwrap();
        assert_eq!(span.ticks(5), [0.0, 2.0, 4.0, 6.0]);
        let span = Span::of([1.0, 400.0].into_iter(), Scale::Log).unwrap();
        assert_eq!(span.ticks(6), [1.0, 10.0, 100.0]);
        let span = Span::of([3.0, 7.0].into_iter(), Scale::Log).unwrap();
        assert!(span.ticks(6).len() >= 2);
        let span = Span::of([2_000.0, 70_000.0].into_iter(), Scale::Log).unwrap();
        assert_eq!(span.ticks(6), [2e3, 5e3, 1e4, 2e4, 5e4]);
        let span = Span::of([1e-12, 1.0].into_iter(), Scale::Log).unwrap();
        assert!(span.ticks(6).len() <= 7);
    }

    #[test]
    fn what_cannot_be_shown_is_left_out() {
        assert!(Span::of([0.0, -1.0, f64::NAN].into_iter(), Scale::Log).is_none());
        let span = Span::of([0.0, 5.0, f64::INFINITY].into_iter(), Scale::Log).unwrap();
        assert!(span.range().contains(&5.0));
    }

    #[test]
    fn tick_texts_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.1 * 3.0, "0.3"),
            (-2.0, "−2"),
            (1e-6, "10⁻⁶"),
            (2e7, "2·10⁷"),
            (1000.0, "1000"),
        ] {
            assert_eq!(tick_text(value), text);
        }
    }
}
