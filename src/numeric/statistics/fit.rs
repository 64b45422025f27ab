//! Fits: straight lines by weighted least squares, any linear law by generalised least squares.

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

/// A linear law y = Σ βⱼ xⱼ fitted to values whose covariance is known (Aitken 1936).
#[derive(Clone, Debug, PartialEq)]
pub struct GeneralisedFit {
    /// The coefficients βⱼ.
    pub coefficients: Vec<f64>,
    /// Their standard errors, under the given covariance.
    pub errors: Vec<f64>,
    /// Weighted sum of squared residuals, χ² with `freedom` degrees if law and covariance hold and the values are normal.
    pub chi_square: f64,
    /// Values − coefficients.
    pub freedom: f64,
}

/// Fits y = X β by generalised least squares: row i of the design belongs to `values[i]`, and `covariance[i][j]` is that of values i
/// and j. A closed form is a design of one column: its coefficient is 1 if the form holds.
///
/// Levels nested in one run (a mean after 10 passes and after 20) are correlated; with their covariance this is the best linear
/// unbiased fit and its errors are right, where [`fit_line`] would claim too much.
///
/// `None` if the sizes do not agree, a value is not finite, the columns of the design are linearly dependent, or the covariance is not
/// positive definite.
pub fn fit_generalised(
    design: &[Vec<f64>],
    values: &[f64],
    covariance: &[Vec<f64>],
) -> Option<GeneralisedFit> {
    let columns = design.first()?.len();
    let rectangular = design.iter().all(|row| row.len() == columns);
    let finite = |rows: &[Vec<f64>]| rows.iter().flatten().all(|x| x.is_finite());
    let usable = finite(design) && finite(covariance) && values.iter().all(|y| y.is_finite());
    if !rectangular || !usable || design.len() != values.len() || values.len() < columns {
        return None;
    }
    // In the coordinates of the Cholesky factor the values are independent, of variance 1.
    let factor = cholesky(covariance).filter(|factor| factor.len() == values.len())?;
    let white = |column: Vec<f64>| forward(&factor, &column);
    let x: Vec<Vec<f64>> = (0..columns)
        .map(|j| white(design.iter().map(|row| row[j]).collect()))
        .collect();
    let y = white(values.to_vec());
    let normal: Vec<Vec<f64>> = (x.iter())
        .map(|a| x.iter().map(|b| dot(a, b)).collect())
        .collect();
    let root = cholesky(&normal)?;
    let right: Vec<f64> = x.iter().map(|a| dot(a, &y)).collect();
    let coefficients = backward(&root, &forward(&root, &right));
    let errors = (0..columns).map(|j| {
        let unit: Vec<f64> = (0..columns).map(|k| f64::from(u8::from(k == j))).collect();
        let part = forward(&root, &unit);
        dot(&part, &part).sqrt()
    });
    let residual: Vec<f64> = (0..y.len())
        .map(|i| y[i] - (0..columns).map(|j| coefficients[j] * x[j][i]).sum::<f64>())
        .collect();
    Some(GeneralisedFit {
        errors: errors.collect(),
        chi_square: dot(&residual, &residual),
        freedom: (values.len() - columns) as f64,
        coefficients,
    })
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A pivot below this share of its diagonal element is the rounding of a dependent row.
const DEPENDENT: f64 = 1e-12;

/// The lower triangular L with L Lᵀ the matrix; `None` if that is not square and positive definite.
fn cholesky(matrix: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let n = matrix.len();
    let mut factor: Vec<Vec<f64>> = Vec::with_capacity(n);
    for (i, row) in matrix.iter().enumerate() {
        if row.len() != n {
            return None;
        }
        let mut line = vec![0.0; n];
        for j in 0..=i {
            let above = if j < i { &factor[j] } else { &line };
            let rest = row[j] - dot(&line[..j], &above[..j]);
            line[j] = if j < i {
                rest / above[j]
            } else if rest > DEPENDENT * row[i] {
                rest.sqrt()
            } else {
                return None;
            };
        }
        factor.push(line);
    }
    Some(factor)
}

/// Solves L x = b.
fn forward(factor: &[Vec<f64>], b: &[f64]) -> Vec<f64> {
    let mut x: Vec<f64> = Vec::with_capacity(b.len());
    for (line, b) in factor.iter().zip(b) {
        let known = dot(&line[..x.len()], &x);
        x.push((b - known) / line[x.len()]);
    }
    x
}

/// Solves Lᵀ x = b.
fn backward(factor: &[Vec<f64>], b: &[f64]) -> Vec<f64> {
    let mut x = b.to_vec();
    for i in (0..x.len()).rev() {
        let known: f64 = (i + 1..x.len()).map(|k| factor[k][i] * x[k]).sum();
        x[i] = (x[i] - known) / factor[i][i];
    }
    x
}
