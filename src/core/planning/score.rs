//! How good a set of poses is.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::information::Information;
use super::pairs::pair_gram;
use super::{PlanningError, check_set};
use crate::kinematics::FreeParameter;
use crate::units::MILLIMETRE;

/// A parameter whose standard deviation stays above this share of its expected deviation is weak: measuring then tells little
/// more than the maker's tolerance.
const WEAK_SHARE: f64 = 1.0 / 3.0;

/// The figures of merit of one set. σ is the standard deviation of a measured coordinate.
///
/// Serialised, it is a part of the summary of a plan: without the number of poses, which has its place there, and without what
/// is in SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Score {
    /// Number of poses.
    #[serde(skip)]
    pub poses: usize,
    /// Number of combinations of parameters that distances can find.
    pub rank: usize,
    /// Condition number of `A·S` on them, dimensionless: largest singular value over smallest.
    pub condition_number: f64,
    /// The same with parameters in rad and mm, as the method paper has it.
    pub condition_number_raw: f64,
    /// Observability indices of `A·S`.
    pub observability: ObservabilityIndices,
    /// RMS position error at fresh poses per unit of σ (a length over a length).
    #[serde(rename = "predicted_error_sigma")]
    pub predicted_error: f64,
    /// `ln det M` of parameters and frame, with expected deviations, 1 mm and 1 mrad as units and σ = 1 mm (D-criterion).
    #[serde(skip)]
    pub log_det: f64,
    /// Precision of each parameter, in order.
    #[serde(skip)]
    pub precision: Vec<ParameterPrecision>,
}

/// Observability indices of the singular values `σ_1 ≥ … ≥ σ_r` of `A·S` for M poses, r the rank; larger is better. Lengths
/// are in metres, parameters in expected deviations.
///
/// Numbering and formulas: Sun & Hollerbach, "Observability index selection for robot calibration", ICRA 2008.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ObservabilityIndices {
    /// `(σ_1 ⋯ σ_r)^(1/r) / √M` (m): the volume of the ellipsoid (Borm & Menq 1989).
    pub o1: f64,
    /// `σ_r / σ_1`: the inverse condition number (Driels & Pathre 1990).
    pub o2: f64,
    /// `σ_r` (m): the smallest singular value (Nahvi, Hollerbach & Hayward 1994).
    pub o3: f64,
    /// `σ_r² / σ_1` (m): the noise amplification index (Nahvi & Hollerbach 1996).
    pub o4: f64,
    /// `1 / (1/σ_1 + … + 1/σ_r)` (m): Sun & Hollerbach 2008.
    pub o5: f64,
}

impl ObservabilityIndices {
    /// From the eigenvalues `σ²` of the Gram matrix of the pair rows (m²), all positive, in any order, for `poses` poses.
    pub(super) fn new(eigenvalues: &[f64], poses: usize) -> Self {
        let smallest = eigenvalues.iter().copied().fold(f64::INFINITY, f64::min).sqrt();
        let largest = eigenvalues.iter().copied().fold(0.0, f64::max).sqrt();
        let mean_log = eigenvalues.iter().map(|value| value.ln()).sum::<f64>() / (2.0 * eigenvalues.len() as f64);
        Self {
            o1: mean_log.exp() / (poses as f64).sqrt(),
            o2: smallest / largest,
            o3: smallest,
            o4: smallest * smallest / largest,
            o5: 1.0 / eigenvalues.iter().map(|value| value.sqrt().recip()).sum::<f64>(),
        }
    }
}

/// How well one parameter will be known, prior not counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterPrecision {
    /// The parameter and what one expects of it.
    pub parameter: FreeParameter,
    /// Standard deviation per unit of σ, of the part that distances can find (1 or rad/m).
    pub deviation_per_sigma: f64,
    /// Whether it can be found on its own.
    pub identifiable: bool,
}

impl ParameterPrecision {
    /// Whether a measurement with `sigma` (m) leaves it more than a third of its expected deviation unknown.
    pub fn is_weak(&self, sigma: f64) -> bool {
        !self.identifiable || self.deviation_per_sigma * sigma > WEAK_SHARE * self.parameter.expected
    }
}

impl Score {
    /// Scores the candidates `set` of the pool. The order of the set does not matter.
    ///
    /// # Errors
    /// A pose that is not in the pool or twice in the set, too few poses, or poses that do not determine what the pool could.
    pub fn new(information: &Information, set: &[usize]) -> Result<Self, PlanningError> {
        check_set(information, set)?;
        let singular = || PlanningError::Singular { poses: set.len(), rank: information.rank() };
        // Sums of floating-point numbers depend on their order: the set has none.
        let mut set = set.to_vec();
        set.sort_unstable();
        let gram = pair_gram(information, &set);
        let eigenvalues = gram.symmetric_eigenvalues();
        let condition_number = condition_number(eigenvalues.as_slice()).ok_or_else(singular)?;
        let basis = information.basis();
        let raw = raw_basis(information);
        // The non-zero singular values of the raw rows `A V⁺ …` are those of the Gram matrix seen through `raw`.
        let raw_gram = &raw * &gram * raw.transpose();
        let mut raw_values: Vec<f64> = raw_gram.symmetric_eigenvalues().iter().copied().collect();
        raw_values.sort_by(|a, b| b.total_cmp(a));
        raw_values.truncate(information.rank());
        let matrix = information.sum(&set);
        let factor = matrix.clone().cholesky().ok_or_else(singular)?;
        let covariance = factor.inverse();
        let rank = information.rank();
        let of_parameters = basis * covariance.view((0, 0), (rank, rank)) * basis.transpose();
        let precision = information
            .parameters()
            .iter()
            .enumerate()
            .map(|(index, parameter)| ParameterPrecision {
                parameter: *parameter,
                deviation_per_sigma: of_parameters[(index, index)].max(0.0).sqrt(),
                identifiable: information.observability().is_identifiable(index),
            })
            .collect();
        Ok(Self {
            poses: set.len(),
            rank,
            condition_number,
            condition_number_raw: self::condition_number(&raw_values).ok_or_else(singular)?,
            observability: ObservabilityIndices::new(eigenvalues.as_slice(), set.len()),
            predicted_error: covariance.dot(information.fresh()).max(0.0).sqrt(),
            log_det: log_det(factor.l_dirty()),
            precision,
        })
    }

    /// Predicted RMS position error at fresh poses (m) for an instrument with standard deviation `sigma` (m) per coordinate.
    ///
    /// It holds what the instrument causes; what no kinematic model can express comes on top.
    pub fn predicted_rms(&self, sigma: f64) -> f64 {
        self.predicted_error * sigma
    }

    /// The parameters that stay weak when measured with `sigma` (m).
    pub fn weak(&self, sigma: f64) -> impl Iterator<Item = &ParameterPrecision> {
        self.precision.iter().filter(move |precision| precision.is_weak(sigma))
    }
}

/// Square root of the ratio of largest to smallest eigenvalue; `None` if that is not a positive number.
pub(super) fn condition_number(eigenvalues: &[f64]) -> Option<f64> {
    let smallest = eigenvalues.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = eigenvalues.iter().copied().fold(0.0, f64::max);
    (smallest > NUMERICAL_ZERO * largest).then(|| (largest / smallest).sqrt())
}

/// Eigenvalues below this share of the largest are zero with rounding errors.
const NUMERICAL_ZERO: f64 = 1e-13;

/// `ln det` of `L Lᵀ / (1 mm)²` from the diagonal of L.
pub(super) fn log_det(factor: &DMatrix<f64>) -> f64 {
    factor.diagonal().iter().map(|value| 2.0 * (value / MILLIMETRE).ln()).sum()
}

/// From reduced parameters' gradients to those by parameters in rad and mm: `U S⁻¹ V`, n × rank, U the raw units.
fn raw_basis(information: &Information) -> DMatrix<f64> {
    let parameters = information.parameters();
    let factors = DVector::from_iterator(
        parameters.len(),
        parameters.iter().map(|parameter| parameter.id.unit().of_the_paper() / parameter.expected.powi(2)),
    );
    // `basis` is S V: A·U = (A S V)(VᵀS⁻¹U) because A S vanishes outside V.
    DMatrix::from_diagonal(&factors) * information.basis()
}
