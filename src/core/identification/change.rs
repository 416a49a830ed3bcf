//! What has changed: whether differences are more than their covariance allows, and which single cause explains them best.
//!
//! Differences are whitened with their covariance, so that unknown things of no interest (a frame, a remounted target) only need a
//! large variance there. A cause is the column that it adds to the differences; its size has a standard deviation, and what it takes of
//! the square sum says how well it explains them.

use nalgebra::{DMatrix, DVector};

use super::Factor;

/// A cause with the size that explains the differences best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Explanation {
    /// Its size, in the unit of its column.
    pub size: f64,
    /// Standard deviation of the size.
    pub sigma: f64,
}

impl Explanation {
    /// Size in standard deviations.
    pub fn ratio(&self) -> f64 {
        if self.sigma > 0.0 { self.size / self.sigma } else { 0.0 }
    }
}

/// Differences in units of their standard deviations, free of correlations.
#[derive(Clone, Debug)]
pub struct Differences {
    factor: Factor,
    whitened: DVector<f64>,
}

impl Differences {
    /// Of `values` with their covariance; `None` if that is not positive definite.
    pub fn new(values: &DVector<f64>, covariance: DMatrix<f64>) -> Option<Self> {
        let factor = Factor::new(covariance)?;
        let column = DMatrix::from_column_slice(values.len(), 1, values.as_slice());
        let whitened = factor.whiten(&column).column(0).into_owned();
        Some(Self { factor, whitened })
    }

    /// Columns of causes in the same units.
    pub fn whiten(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        self.factor.whiten(columns)
    }

    /// Square sum: about the number of independent values if nothing has changed.
    pub fn square(&self) -> f64 {
        self.whitened.norm_squared()
    }

    /// The size of a cause with this whitened column.
    pub fn explained_by(&self, whitened: &DVector<f64>) -> Explanation {
        let square = whitened.norm_squared();
        if square <= 0.0 {
            return Explanation { size: 0.0, sigma: f64::INFINITY };
        }
        Explanation { size: whitened.dot(&self.whitened) / square, sigma: 1.0 / square.sqrt() }
    }

    /// What causes with these whitened columns take of the square sum together.
    pub fn taken_by(&self, whitened: &DMatrix<f64>) -> f64 {
        let gradient = whitened.tr_mul(&self.whitened);
        let information = whitened.tr_mul(whitened);
        let scale = information.diagonal().max().max(f64::MIN_POSITIVE);
        let inverse = information.pseudo_inverse(1e-10 * scale).unwrap_or_else(|_| DMatrix::zeros(0, 0));
        if inverse.nrows() == gradient.len() { gradient.dot(&(inverse * &gradient)) } else { 0.0 }
    }

    /// The sizes of several causes together, each with a prior of standard deviation `expected`, and their covariance.
    pub fn together(&self, whitened: &DMatrix<f64>, expected: f64) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let mut information = whitened.tr_mul(whitened);
        for index in 0..information.nrows() {
            information[(index, index)] += 1.0 / (expected * expected);
        }
        let factor = Factor::new(information)?;
        Some((factor.solve(&whitened.tr_mul(&self.whitened)), factor.inverse()))
    }
}

/// How many standard deviations a square sum of `values` standard normal numbers is above what it should be: a normal number to a
/// good approximation (Wilson and Hilferty 1931).
pub fn excess(square: f64, values: f64) -> f64 {
    if values <= 0.0 {
        return 0.0;
    }
    let spread = 2.0 / (9.0 * values);
    ((square / values).cbrt() - (1.0 - spread)) / spread.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_planted_cause_is_found_with_its_size() {
        let columns = DMatrix::from_fn(8, 2, |i, j| ((i + 3 * j) as f64 * 0.9).sin());
        let covariance = DMatrix::from_fn(8, 8, |i, j| if i == j { 0.05 } else { 0.01 });
        let differences = Differences::new(&(columns.column(1) * 2.0), covariance).unwrap();
        let whitened = differences.whiten(&columns);
        let found = differences.explained_by(&whitened.column(1).into_owned());
        assert!((found.size - 2.0).abs() < 1e-9, "{found:?}");
        let taken = differences.taken_by(&whitened.columns(1, 1).into_owned());
        assert!((taken - differences.square()).abs() < 1e-6 && (found.ratio().powi(2) - taken).abs() < 1e-6);
        let (sizes, _) = differences.together(&whitened, 1e6).unwrap();
        assert!(sizes[0].abs() < 1e-6 && (sizes[1] - 2.0).abs() < 1e-6, "{sizes}");
    }

    #[test]
    fn the_excess_of_a_square_sum_is_a_normal_number() {
        // 95 % points of chi-square: 1.645 standard deviations of a normal number.
        for (values, point) in [(10.0, 18.307), (27.0, 40.113), (100.0, 124.342)] {
            assert!((excess(point, values) - 1.645).abs() < 0.02, "{values}");
        }
    }
}
