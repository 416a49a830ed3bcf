//! What each candidate configuration tells: its predicted point and the Jacobian that its measurement would have, on the
//! directions that distances can identify.
//!
//! Parameters are taken in units of their expected deviation (`z = S⁻¹ x`) and reduced to an orthonormal basis V of the
//! identifiable directions (from a clear gap in the singular values of the whole pool). The information of a pose about
//! parameters and instrument frame together is `GᵀG` with
//!
//! `G = [ B S V | 1 mm · I | 1 mm · (r ↦ ω × r) ]`, 3 × m, m = rank + 6,
//!
//! r the point less the middle of the pool, so that one unit of a frame parameter is 1 mm or 1 mrad. Only their ratio to each
//! other depends on those units, never a predicted error or a condition number.

use nalgebra::{DMatrix, DMatrixView, DVector, Point3};

use super::filling::Filling;
use super::{JointBox, PlanningError};
use crate::identification::{Observability, Observations, PointSample, Problem};
use crate::kinematics::{Arm, FreeParameter, IdentificationJacobian, Place};
use crate::units::MILLIMETRE;

/// Parameters of the instrument frame: three translations, three rotations.
pub(super) const FRAME: usize = 6;

/// Fewer fresh poses than this do not stand for the workspace (and three are needed to check them).
const FEWEST_FRESH: usize = 3;

/// A singular value of the pool (less the rigid motion) below this share of its Jacobians' norm is a rounding error.
const ROUNDING: f64 = 1e-11;

/// A pool of candidates with everything that choosing and scoring need.
#[derive(Clone, Debug)]
pub struct Information {
    parameters: Vec<FreeParameter>,
    observability: Observability,
    /// `S V`: from reduced to real parameters, n × rank ((m) or (rad)).
    basis: DMatrix<f64>,
    points: Vec<Point3<f64>>,
    /// The middle of the points.
    middle: Point3<f64>,
    /// G of every candidate, row by row: x, y, z of m numbers each (m).
    rows: Vec<f64>,
    /// G of the fresh poses, in the same way.
    fresh_rows: Vec<f64>,
    /// W: mean of `GᵀG` over the fresh poses, m × m (m²).
    fresh: DMatrix<f64>,
    /// The joint angles of the candidates in their ranges.
    filling: Option<Filling>,
}

/// Fewest poses M that can determine so many combinations of parameters, and the frame: `3 M ≥ rank + 6`.
pub const fn fewest_poses(rank: usize) -> usize {
    (rank + FRAME).div_ceil(3)
}

/// Number of combinations of `parameters` that distances can find by measuring at all of `places`; `None` if it is not clear, or
/// the sizes do not fit.
pub fn findable(arm: &Arm, parameters: &[FreeParameter], places: &[Place]) -> Option<usize> {
    check(arm, parameters, places).ok()?;
    observe(arm, parameters, places).rank
}

impl Information {
    /// Of `candidates` for identifying `parameters` of `arm`, judged by the error at `fresh` poses.
    ///
    /// # Errors
    /// Sizes that do not fit, no free parameter, no fresh pose, or a pool from which the rank is not clear.
    pub fn new(
        arm: &Arm,
        parameters: &[FreeParameter],
        candidates: &[Place],
        fresh: &[Place],
    ) -> Result<Self, PlanningError> {
        if parameters.is_empty() {
            return Err(PlanningError::NoParameters);
        }
        if fresh.len() < FEWEST_FRESH {
            return Err(PlanningError::FreshPoses { given: fresh.len(), needed: FEWEST_FRESH });
        }
        check(arm, parameters, fresh)?;
        check(arm, parameters, candidates)?;
        let observability = observe(arm, parameters, candidates);
        let rank = observability.rank.ok_or(PlanningError::RankUnclear { gap: observability.gap })?;
        if rank == 0 {
            return Err(PlanningError::NothingIdentifiable { parameters: parameters.len() });
        }
        let scale = DVector::from_iterator(parameters.len(), parameters.iter().map(|parameter| parameter.expected));
        let visible = complement(&observability.blind, rank);
        let basis = DMatrix::from_diagonal(&scale) * visible;
        let reduction = Reduction { arm, parameters, basis: &basis };
        let (points, jacobians) = reduction.jacobians(candidates);
        // The rank is relative to the largest singular value: where that one is a rounding error, nothing was seen at all.
        let seen = observability.singular_values.first().map_or(0.0, |value| value * MILLIMETRE);
        if seen < ROUNDING * jacobians.norm() {
            return Err(PlanningError::NothingIdentifiable { parameters: parameters.len() });
        }
        let middle = points.iter().fold(nalgebra::Vector3::zeros(), |sum, point| sum + point.coords)
            / points.len().max(1) as f64;
        let middle = Point3::from(middle);
        let rows = with_frame(&points, &jacobians, rank, &middle);
        let (fresh_points, fresh_jacobians) = reduction.jacobians(fresh);
        let fresh_rows = with_frame(&fresh_points, &fresh_jacobians, rank, &middle);
        let columns = DMatrixView::from_slice(&fresh_rows, rank + FRAME, 3 * fresh.len());
        let fresh = columns * columns.transpose() / fresh.len() as f64;
        let parameters = parameters.to_vec();
        Ok(Self { parameters, observability, basis, points, middle, rows, fresh_rows, fresh, filling: None })
    }

    /// With sets that fill these ranges of the joints, see [`super::Objective::Balanced`]. The arguments are those of [`Self::new`].
    #[must_use]
    pub fn filling(mut self, ranges: &JointBox, arm: &Arm, candidates: &[Place]) -> Self {
        self.filling = Filling::new(&arm.chain, ranges, candidates);
        self
    }

    /// Number of candidates.
    pub const fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no candidate.
    pub const fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The parameters to identify, in order.
    pub fn parameters(&self) -> &[FreeParameter] {
        &self.parameters
    }

    /// What all candidates together could tell: rank, blind directions in words.
    pub const fn observability(&self) -> &Observability {
        &self.observability
    }

    /// Number of combinations of parameters that distances can find.
    pub fn rank(&self) -> usize {
        self.basis.ncols()
    }

    /// Fewest poses that can determine them: see [`fewest_poses`].
    pub fn fewest_poses(&self) -> usize {
        fewest_poses(self.rank())
    }

    /// Predicted position of a candidate in the base (m).
    pub fn point(&self, candidate: usize) -> &Point3<f64> {
        &self.points[candidate]
    }

    /// Predicted RMS position error at fresh poses per unit of σ with the candidates `set`, prior not counted; `None` if they
    /// do not determine what the pool can. The same as [`Score::predicted_error`](super::Score), and much cheaper.
    pub fn predicted_error(&self, set: &[usize]) -> Option<f64> {
        if set.len() < self.fewest_poses() || set.iter().any(|candidate| *candidate >= self.len()) {
            return None;
        }
        let covariance = self.sum(set).cholesky()?.inverse();
        Some(covariance.dot(&self.fresh).max(0.0).sqrt()).filter(|error| error.is_finite())
    }

    /// Numbers per row of G.
    pub(super) fn width(&self) -> usize {
        self.rank() + FRAME
    }

    /// G of a candidate: three rows of [`Self::width`] numbers, the reduced parameters first.
    pub(super) fn rows(&self, candidate: usize) -> &[f64] {
        let size = 3 * self.width();
        &self.rows[size * candidate..size * (candidate + 1)]
    }

    /// `S V`, n × rank.
    pub(super) const fn basis(&self) -> &DMatrix<f64> {
        &self.basis
    }

    /// Point and G of a place outside the pool, see [`Self::rows`]. `arm` is that of [`Self::new`].
    pub(super) fn rows_at(&self, arm: &Arm, place: &Place) -> (Point3<f64>, Vec<f64>) {
        let reduction = Reduction { arm, parameters: &self.parameters, basis: &self.basis };
        let (points, jacobians) = reduction.jacobians(std::slice::from_ref(place));
        let rows = with_frame(&points, &jacobians, self.rank(), &self.middle);
        (points.first().copied().unwrap_or_default(), rows)
    }

    /// Puts a place outside the pool in the place of a candidate. Rank and identifiable directions stay those of the pool.
    pub fn replace(&mut self, candidate: usize, arm: &Arm, place: &Place) {
        let (point, rows) = self.rows_at(arm, place);
        let size = 3 * self.width();
        self.points[candidate] = point;
        self.rows[size * candidate..size * (candidate + 1)].copy_from_slice(&rows);
        if let Some(filling) = &mut self.filling {
            filling.replace(candidate, place);
        }
    }

    /// G of the fresh poses as columns, m × 3F.
    pub(super) fn fresh_columns(&self) -> DMatrixView<'_, f64> {
        let width = self.width();
        DMatrixView::from_slice(&self.fresh_rows, width, self.fresh_rows.len() / width)
    }

    /// The angles of the candidates in the ranges to fill, if there are any.
    pub(super) const fn angles(&self) -> Option<&Filling> {
        self.filling.as_ref()
    }

    /// W, m × m (m²).
    pub(super) const fn fresh(&self) -> &DMatrix<f64> {
        &self.fresh
    }

    /// Sum of `GᵀG` over a set, m × m (m²).
    pub(super) fn sum(&self, set: &[usize]) -> DMatrix<f64> {
        let width = self.width();
        let mut stacked = DMatrix::zeros(width, 3 * set.len());
        for (target, &candidate) in stacked.as_mut_slice().chunks_mut(3 * width).zip(set) {
            target.copy_from_slice(self.rows(candidate));
        }
        &stacked * stacked.transpose()
    }
}

/// Checks that `places` fit the arm.
fn check(arm: &Arm, parameters: &[FreeParameter], places: &[Place]) -> Result<(), PlanningError> {
    let observations = observed_at(places, std::iter::repeat(Point3::origin()));
    problem(arm, parameters, &observations).check().map_err(PlanningError::Candidates)
}

/// What measuring at all of `places` could tell.
fn observe(arm: &Arm, parameters: &[FreeParameter], places: &[Place]) -> Observability {
    let observations = observed_at(places, arm.points_in_base(places).into_iter());
    Observability::new(&problem(arm, parameters, &observations))
}

fn problem<'a>(arm: &'a Arm, parameters: &'a [FreeParameter], observations: &'a Observations) -> Problem<'a> {
    Problem { arm, parameters, observations }
}

/// Places as if measured at `points`.
fn observed_at(places: &[Place], points: impl Iterator<Item = Point3<f64>>) -> Observations {
    let sample = |(at, point): (&Place, _)| PointSample { at: at.clone(), station: 0, point, sigma: None };
    Observations { points: places.iter().zip(points).map(sample).collect(), ..Observations::default() }
}

/// Orthonormal basis of everything orthogonal to the columns of `blind`, n × rank.
fn complement(blind: &DMatrix<f64>, rank: usize) -> DMatrix<f64> {
    let n = blind.nrows();
    if blind.ncols() == 0 {
        return DMatrix::identity(n, n);
    }
    let eigen = (DMatrix::identity(n, n) - blind * blind.transpose()).symmetric_eigen();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let columns: Vec<_> = order[..rank].iter().map(|&index| eigen.eigenvectors.column(index)).collect();
    DMatrix::from_columns(&columns)
}

/// How Jacobians are reduced to the identifiable directions.
struct Reduction<'a> {
    arm: &'a Arm,
    parameters: &'a [FreeParameter],
    basis: &'a DMatrix<f64>,
}

impl Reduction<'_> {
    /// Predicted points (m) and `B S V` of `places`: the rows x, y, z of each as columns of a rank × 3N matrix.
    fn jacobians(&self, places: &[Place]) -> (Vec<Point3<f64>>, DMatrix<f64>) {
        let n = self.parameters.len();
        let arm = self.arm.prepared();
        let ids: Vec<_> = self.parameters.iter().map(|parameter| parameter.id).collect();
        let mut jacobian = IdentificationJacobian::new(&ids);
        let mut rows = DMatrix::zeros(n, 3 * places.len());
        let points = places
            .iter()
            .zip(rows.as_mut_slice().chunks_mut(3 * n))
            .map(|(place, rows)| jacobian.at(&arm, place, rows))
            .collect();
        (points, self.basis.tr_mul(&rows))
    }
}

/// Appends the six columns of the frame to the reduced Jacobians.
fn with_frame(points: &[Point3<f64>], jacobians: &DMatrix<f64>, rank: usize, middle: &Point3<f64>) -> Vec<f64> {
    let width = rank + FRAME;
    let mut rows = vec![0.0; 3 * width * points.len()];
    for (index, point) in points.iter().enumerate() {
        let r = point - middle;
        // Rows of ω ↦ ω × r.
        let turn = [[0.0, r.z, -r.y], [-r.z, 0.0, r.x], [r.y, -r.x, 0.0]];
        for axis in 0..3 {
            let start = width * (3 * index + axis);
            let row = &mut rows[start..start + width];
            row[..rank].copy_from_slice(jacobians.column(3 * index + axis).as_slice());
            row[rank + axis] = MILLIMETRE;
            for (value, turn) in row[rank + 3..].iter_mut().zip(turn[axis]) {
                *value = MILLIMETRE * turn;
            }
        }
    }
    rows
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::random;
    use super::*;
    use crate::kinematics::{LinkParameter, ParameterId};
    use crate::profile::{Level, Profile, builtin};

    fn soochow() -> (Arm, Vec<FreeParameter>, JointBox) {
        let (profile, _) = Profile::parse(builtin("soochow").unwrap(), "").unwrap();
        let joint_box = JointBox::new(profile.joints().iter().map(|j| j.planning_limits.unwrap()).collect()).unwrap();
        (profile.arm(), profile.parameters(Level::Geometric), joint_box)
    }

    fn places(joint_box: &JointBox, count: usize, seed: u64) -> Vec<Place> {
        random(joint_box, seed).take(count).map(|configuration| Place { configuration, target: 0 }).collect()
    }

    /// A pool of random candidates of the paper's robot.
    pub(in super::super) fn pool(candidates: usize) -> Information {
        let (arm, parameters, joint_box) = soochow();
        Information::new(&arm, &parameters, &places(&joint_box, candidates, 1), &places(&joint_box, 300, 2)).unwrap()
    }

    #[test]
    fn blind_directions_move_points_only_as_a_rigid_body_would() {
        let information = pool(50);
        let width = information.width();
        assert_eq!(width, information.rank() + 6);
        assert_eq!(information.parameters().len() - information.rank(), information.observability().blind.ncols());
        // Parameters and frame together are fully determined.
        let eigenvalues = information.sum(&(0..50).collect::<Vec<_>>()).symmetric_eigenvalues();
        assert!(eigenvalues.min() > 1e-10 * eigenvalues.max());
    }

    #[test]
    fn unusable_pools_are_refused() {
        let (arm, parameters, joint_box) = soochow();
        let some = places(&joint_box, 60, 1);
        let new = |parameters: &[FreeParameter], candidates: &[Place], fresh: &[Place]| {
            Information::new(&arm, parameters, candidates, fresh).unwrap_err()
        };
        assert_eq!(new(&[], &some, &some), PlanningError::NoParameters);
        assert_eq!(new(&parameters, &some, &some[..2]), PlanningError::FreshPoses { given: 2, needed: 3 });
        assert!(matches!(new(&parameters, &[], &some), PlanningError::Candidates(_)));
        let base = ParameterId::Link { joint: 0, parameter: LinkParameter::Theta };
        let blind = [FreeParameter { id: base, expected: 1e-3 }];
        assert_eq!(new(&blind, &some, &some), PlanningError::NothingIdentifiable { parameters: 1 });
        let mut short = some.clone();
        short[5].configuration.pop();
        assert!(matches!(new(&parameters, &short, &some), PlanningError::Candidates(_)));
        assert!(matches!(new(&parameters, &some, &short), PlanningError::Candidates(_)));
    }
}
