//! What an identification returns.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Point3, Vector3};

use super::feature::Feature;
use super::observability::Observability;
use super::settings::{Iteration, SigmaSource, TerminationReason};
use super::systematic::Unmodelled;
use crate::kinematics::{Arm, ParameterId};
use crate::units::{MICROMETRE, MILLIMETRE};

/// How much a coordinate of a reading scatters (standard deviations), and what of: the instrument, readings of one pose among each
/// other, and what a pose has in common. The latter, repeatability and what the model lacks, is always estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sigma {
    /// All parts together (m): what balanced data and prior.
    pub used: f64,
    /// Where the part of the instrument comes from; how the whole was found where nothing is stated.
    pub source: SigmaSource,
    /// What the residuals say (m): root mean square per coordinate, corrected for the parameters fitted; `None` without
    /// enough data.
    pub from_residuals: Option<f64>,
    /// Root mean square of the residuals in units of what the readings of a pose promise, corrected likewise; `None` where nothing
    /// is stated.
    pub normalised: Option<f64>,
    /// Part of the instrument as stated (m); with own σ per reading their root mean square.
    pub instrument: Option<f64>,
    /// Part of readings of one pose among each other, beyond the instrument (m); zero without repetitions.
    pub shots: f64,
    /// Part of what a pose has in common (m).
    pub poses: f64,
    /// Part of the variance of instrument and readings that the residuals confirm, at most 1: instruments can be better than stated.
    pub confirmed: f64,
}

impl Sigma {
    /// How much larger the residuals are than the instrument promised; 1 where they fit, or where nothing is stated.
    pub fn excess(&self) -> f64 {
        self.normalised.filter(|_| self.instrument.is_some()).map_or(1.0, |normalised| normalised.max(1.0))
    }
}

/// One identified parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Which parameter.
    pub id: ParameterId,
    /// Nominal value (m) or (rad).
    pub nominal: f64,
    /// Identified − nominal (m) or (rad).
    pub deviation: f64,
    /// Standard deviation of the deviation (m) or (rad).
    pub sigma: f64,
    /// Expected deviation (m) or (rad).
    pub expected: f64,
    /// Whether it can be found on its own; if not, a [`BlindGroup`](super::BlindGroup) says what can.
    pub identifiable: bool,
}

/// Why a sample was rejected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RejectionReason {
    /// Too far from where the rest of the data says it should be.
    Outlier,
    /// Its point fits the configuration of another rejected sample, and the reverse: two rows were swapped.
    SwappedWith(usize),
    /// A coordinate of the point lost its sign, or has one that it should not have.
    Sign {
        /// 0, 1, 2 for x, y, z.
        axis: usize,
    },
    /// One digit of a coordinate of the point is wrong.
    Digit {
        /// 0, 1, 2 for x, y, z.
        axis: usize,
        /// Given less right coordinate (m).
        by: f64,
    },
}

impl RejectionReason {
    /// A slip of the pen that leads from the `fitting` point (m) to the one that is `given`, where points scatter by `sigma` (m).
    pub(super) fn typed(given: &Point3<f64>, fitting: &Point3<f64>, sigma: f64) -> Option<Self> {
        let close = CLOSE * sigma.max(MICROMETRE);
        let off = given - fitting;
        let mut axes = (0..3).filter(|axis| off[*axis].abs() > close);
        let (axis, None) = (axes.next()?, axes.next()) else { return None };
        if (given[axis] + fitting[axis]).abs() < close {
            return Some(Self::Sign { axis });
        }
        // One to nine units of some digit; a unit must be far larger than the scatter, or any difference would do.
        let mut units = (-1..=3).map(|power| 10_f64.powi(power) * MILLIMETRE).filter(|unit| *unit > COARSE * close);
        let by = |unit: f64| {
            let count = (off[axis] / unit).round();
            let fits = (1.0..=9.0).contains(&count.abs()) && (off[axis] - count * unit).abs() < close;
            fits.then_some(count * unit)
        };
        units.find_map(by).map(|by| Self::Digit { axis, by })
    }
}

/// Points within this many standard deviations are the same, and a digit counts at least so many of those.
const CLOSE: f64 = 5.0;
const COARSE: f64 = 10.0;

/// Which sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SampleIndex {
    /// A measured point or the seat of a shared point, in the order of [`Observations::places`](super::Observations::places).
    Place(usize),
    /// A measured length.
    Length(usize),
}

/// A sample that does not count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rejected {
    /// Which one.
    pub sample: SampleIndex,
    /// Distance from the prediction of the model fitted without it (m).
    pub residual: f64,
    /// The same in units of what it should scatter by, judged by the accepted samples.
    pub ratio: f64,
    /// Likely cause.
    pub reason: RejectionReason,
}

/// The result of an identification.
#[derive(Clone, Debug)]
pub struct Identification {
    /// The identified arm and targets.
    pub arm: Arm,
    /// Every free parameter.
    pub estimates: Vec<Estimate>,
    /// Covariance of the deviations, n × n ((m) and (rad)).
    pub covariance: DMatrix<f64>,
    /// What the data can tell.
    pub observability: Observability,
    /// Measurement σ.
    pub sigma: Sigma,
    /// Samples left out, with reasons.
    pub rejected: Vec<Rejected>,
    /// Samples that did not fit and were kept, because they are the arm.
    pub unmodelled: Vec<Unmodelled>,
    /// Steps of the solver.
    pub iterations: Vec<Iteration>,
    /// Deviations of all parameters after each of them ((m) and (rad)), in the order of the estimates.
    pub path: Vec<DVector<f64>>,
    /// Why it stopped.
    pub termination: TerminationReason,
    /// Pose of each instrument station in the base of the identified arm.
    pub base_from_station: Vec<Isometry3<f64>>,
    /// Features of unknown place in the base of the identified arm; `None` for one that too few contacts show.
    pub features: Vec<Option<Feature>>,
    /// Covariance of the places of the features (m²), in their order.
    pub feature_covariances: Vec<Matrix3<f64>>,
    /// Measured − predicted in the base (m) for every place, in-sample: for finding outliers, never to be shown as accuracy.
    pub residuals: Vec<Vector3<f64>>,
}

impl Identification {
    /// Whether the place was left out.
    pub fn is_rejected(&self, place: usize) -> bool {
        self.rejected.iter().any(|rejected| rejected.sample == SampleIndex::Place(place))
    }

    /// Correlation of two parameters, −1 … 1; zero where one has no uncertainty.
    pub fn correlation(&self, i: usize, j: usize) -> f64 {
        let product = self.covariance[(i, i)] * self.covariance[(j, j)];
        if product > 0.0 { self.covariance[(i, j)] / product.sqrt() } else { 0.0 }
    }
}
