//! Plots as data; the report draws them as SVG.

use crate::numeric::statistics::binomial_interval;

/// Confidence of the bars of shares.
const CONFIDENCE: f64 = 0.95;

/// Scale of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Linear.
    Linear,
    /// Logarithmic (values must be > 0; others are left out).
    Log,
}

impl Scale {
    /// Whether the scale has a place for a value.
    pub fn shows(self, value: f64) -> bool {
        value.is_finite() && (self == Self::Linear || value > 0.0)
    }
}

/// An axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Label with unit.
    pub label: String,
    /// Scale.
    pub scale: Scale,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: &str) -> Self {
        Self {
            label: label.to_owned(),
            scale: Scale::Linear,
        }
    }

    /// A logarithmic axis.
    pub fn log(label: &str) -> Self {
        Self {
            label: label.to_owned(),
            scale: Scale::Log,
        }
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Marks joined by a line, in the order of the points.
    Line,
    /// Marks alone: points without an order.
    Marks,
    /// A dashed line without marks: a prediction.
    Prediction,
}

/// One line or set of marks.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y).
    pub points: Vec<(f64, f64)>,
    /// Intervals (low, high) of y, one per point, or empty.
    pub intervals: Vec<(f64, f64)>,
    /// Short texts beside the points, one per point, or empty.
    pub labels: Vec<String>,
    /// How it is drawn.
    pub style: Style,
}

impl Series {
    /// Measured points, joined by a line.
    pub fn measured(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            name: name.into(),
            points: points.into_iter().collect(),
            intervals: Vec::new(),
            labels: Vec::new(),
            style: Style::Line,
        }
    }

    /// Shares: of `n` trials `hits`, at each x, with exact 95 % intervals.
    pub fn shares(
        name: impl Into<String>,
        counts: impl IntoIterator<Item = (f64, u64, u64)>,
    ) -> Self {
        let counts: Vec<(f64, u64, u64)> = counts.into_iter().collect();
        let share = |&(x, hits, n): &(f64, u64, u64)| (x, hits as f64 / n as f64);
        let interval = |&(_, hits, n): &(f64, u64, u64)| binomial_interval(hits, n, CONFIDENCE);
        Self::measured(name, counts.iter().map(share)).with_intervals(counts.iter().map(interval))
    }

    /// Predicted points.
    pub fn predicted(
        name: impl Into<String>,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        Self {
            style: Style::Prediction,
            ..Self::measured(name, points)
        }
    }

    /// Measured points without an order.
    pub fn scattered(
        name: impl Into<String>,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        Self {
            style: Style::Marks,
            ..Self::measured(name, points)
        }
    }

    /// The same with an interval (low, high) of y for every point.
    #[must_use]
    pub fn with_intervals(self, intervals: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            intervals: intervals.into_iter().collect(),
            ..self
        }
    }

    /// The same with a text beside every point.
    #[must_use]
    pub fn with_labels(self, labels: impl IntoIterator<Item = impl ToString>) -> Self {
        Self {
            labels: labels.into_iter().map(|label| label.to_string()).collect(),
            ..self
        }
    }
}

/// A plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Title: what one should see.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Series.
    pub series: Vec<Series>,
    /// Whether the Pareto front of the measured points is marked.
    pub front: bool,
}

impl Plot {
    /// Series on two axes.
    pub fn new(title: &str, x: Axis, y: Axis, series: impl IntoIterator<Item = Series>) -> Self {
        Self {
            title: title.to_owned(),
            x,
            y,
            series: series.into_iter().collect(),
            front: false,
        }
    }

    /// Speed against error, log-log, with the Pareto front marked: a series for each method, a point for each of its settings
    /// (named by the series' labels), `time` and `error` with their units. A method without any error has no place on a
    /// logarithmic scale: give the bound that its measurement proves.
    pub fn speed_error(
        title: &str,
        time: &str,
        error: &str,
        methods: impl IntoIterator<Item = Series>,
    ) -> Self {
        Self {
            front: true,
            ..Self::new(title, Axis::log(time), Axis::log(error), methods)
        }
    }

    /// The measured points that no other beats: none is at most as far in both directions and nearer in one. From left to
    /// right, as (series, point); of equal points all are on the front.
    pub fn pareto_front(&self) -> Vec<(usize, usize)> {
        let places = self
            .series
            .iter()
            .enumerate()
            .filter(|(_, s)| s.style != Style::Prediction);
        let mut places: Vec<(usize, usize, (f64, f64))> = places
            .flat_map(|(series, one)| {
                let points = one.points.iter().enumerate();
                points.map(move |(point, &at)| (series, point, at))
            })
            .filter(|(.., at)| self.x.scale.shows(at.0) && self.y.scale.shows(at.1))
            .collect();
        places.sort_by(|a, b| a.2.0.total_cmp(&b.2.0).then(a.2.1.total_cmp(&b.2.1)));
        let mut last: Option<(f64, f64)> = None;
        places.retain(|&(.., at)| {
            let kept = last.is_none_or(|last| at.1 < last.1 || at == last);
            if kept {
                last = Some(at);
            }
            kept
        });
        let named = places.into_iter();
        named.map(|(series, point, _)| (series, point)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::{Purpose, Stream};

    type Front = fn(&Plot) -> Vec<(usize, usize)>;

    /// Random points of two methods, with ties, and a prediction and values without a place, which are never on the front.
    fn planted(stream: &mut Stream) -> Plot {
        let mut coordinate = || (8.0 * stream.uniform()).floor() + 1.0;
        let mut points =
            || -> Vec<(f64, f64)> { (0..12).map(|_| (coordinate(), coordinate())).collect() };
        let mut first = Series::measured("a", points());
        first
            .points
            .extend([(0.5, 0.0), (f64::NAN, 0.5), (0.1, f64::INFINITY)]);
        let series = [
            first,
            Series::predicted("theory", [(0.1, 0.1)]),
            Series::scattered("b", points()),
        ];
        Plot::speed_error("", "s", "error", series)
    }

    /// The front holds exactly the points that no other point beats, from left to right.
    fn is_the_front(front: Front, plot: &Plot) -> bool {
        let shown = |at: (f64, f64)| at.0 > 0.0 && at.1 > 0.0 && at.0 < 1e9 && at.1 < 1e9;
        let all = [0, 2].into_iter().flat_map(|series| {
            let points = plot.series[series].points.iter().enumerate();
            points.map(move |(point, &at)| (series, point, at))
        });
        let all: Vec<_> = all.filter(|&(.., at)| shown(at)).collect();
        let beaten = |at: (f64, f64)| {
            all.iter()
                .any(|&(.., other)| other.0 <= at.0 && other.1 <= at.1 && other != at)
        };
        let mut expected: Vec<(usize, usize)> = all
            .iter()
            .filter(|&&(.., at)| !beaten(at))
            .map(|&(series, point, _)| (series, point))
            .collect();
        let mut found = front(plot);
        let x = |&(series, point): &(usize, usize)| plot.series[series].points[point].0;
        let ordered = found.is_sorted_by(|a, b| x(a) <= x(b));
        expected.sort_unstable();
        found.sort_unstable();
        ordered && found == expected
    }

    #[test]
    fn the_pareto_front_is_that_of_brute_force() {
        let last_of_each: Front = |plot| {
            let series = plot.series.iter().enumerate();
            series
                .map(|(index, one)| (index, one.points.len() - 1))
                .collect()
        };
        let without_ties: Front = |plot| {
            let mut front = plot.pareto_front();
            front.dedup_by_key(|(series, point)| plot.series[*series].points[*point].0.to_bits());
            front
        };
        let mut stream = Stream::new(3, Purpose::Test, 0);
        let plots: Vec<Plot> = (0..300).map(|_| planted(&mut stream)).collect();
        let holds = |front: Front| plots.iter().all(|plot| is_the_front(front, plot));
        assert!(holds(Plot::pareto_front));
        assert!(!holds(last_of_each) && !holds(without_ties));
        let empty = Plot::speed_error("", "s", "error", [Series::measured("a", [])]);
        assert!(empty.pareto_front().is_empty());
    }

    #[test]
    fn shares_carry_their_exact_intervals() {
        let series = Series::shares("s", [(1.0, 0, 10), (2.0, 5, 10)]).with_labels([1, 2]);
        assert_eq!(series.points, [(1.0, 0.0), (2.0, 0.5)]);
        assert_eq!(series.intervals[0].0, 0.0);
        assert!(series.intervals[1].0 < 0.2 && series.intervals[1].1 > 0.8);
        assert_eq!(series.labels, ["1", "2"]);
    }
}
