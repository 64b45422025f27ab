//! Straight lines by weighted least squares.

use super::interval::student_quantile;

/// A fitted line y = intercept + slope · x, with standard errors from the scatter about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Slope.
    pub slope: f64,
    /// Value at x = 0.
    pub intercept: f64,
    /// Standard error of the slope.
    pub slope_error: f64,
    /// Standard error of the intercept.
    pub intercept_error: f64,
    /// Degrees of freedom: points − 2.
    pub freedom: f64,
}

impl Fit {
    /// Student's t interval of the slope.
    pub fn slope_interval(&self, confidence: f64) -> (f64, f64) {
        let t = student_quantile(0.5 + 0.5 * confidence, self.freedom);
        (
            self.slope - t * self.slope_error,
            self.slope + t * self.slope_error,
        )
    }
}

/// Fits a line to points (x, y, weight); a weight is proportional to 1/variance of its y, and only ratios of weights count.
///
/// `None` with fewer than three points, without two different x, or with a weight or value that is not finite or a weight that
/// is not positive. Points must be independent: levels nested in one run are not.
pub fn fit_line(points: &[(f64, f64, f64)]) -> Option<Fit> {
    let usable = |&(x, y, w): &(f64, f64, f64)| [x, y, w].iter().all(|v| v.is_finite()) && w > 0.0;
    if points.len() < 3 || !points.iter().all(usable) {
        return None;
    }
    let sum = |f: fn(f64, f64) -> f64| points.iter().map(|&(x, y, w)| w * f(x, y)).sum::<f64>();
    let total = sum(|_, _| 1.0);
    let (x0, y0) = (sum(|x, _| x) / total, sum(|_, y| y) / total);
    let moment = |f: &dyn Fn(f64, f64) -> f64| {
        points
            .iter()
            .map(|&(x, y, w)| w * f(x - x0, y - y0))
            .sum::<f64>()
    };
    let spread = moment(&|x, _| x * x);
    if spread <= 0.0 {
        return None;
    }
    let slope = moment(&|x, y| x * y) / spread;
    let residual = moment(&|x, y| (y - slope * x) * (y - slope * x));
    let freedom = points.len() as f64 - 2.0;
    let scatter = residual / freedom;
    Some(Fit {
        slope,
        intercept: y0 - slope * x0,
        slope_error: (scatter / spread).sqrt(),
        intercept_error: (scatter * (1.0 / total + x0 * x0 / spread)).sqrt(),
        freedom,
    })
}
