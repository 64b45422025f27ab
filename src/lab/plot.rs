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
    /// Drawn as a dashed line without marks: a prediction.
    pub predicted: bool,
}

impl Series {
    /// Measured points.
    pub fn measured(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            name: name.into(),
            points: points.into_iter().collect(),
            intervals: Vec::new(),
            labels: Vec::new(),
            predicted: false,
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
            predicted: true,
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
    /// (named by the series' labels), `time` and `error` with their units.
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
        let places = self.series.iter().enumerate().filter(|(_, s)| !s.predicted);
        let mut places: Vec<(usize, usize, (f64, f64))> = places
            .flat_map(|(series, one)| {
                let points = one.points.iter().enumerate();
                points.map(move |(point, &at)| (series, point, at))
            })
            .filter(|(.., at)| at.0.is_finite() && at.1.is_finite())
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
