//! Comparison of calibrations: what has changed between them, over the workspace and by cause.
//!
//! Two calibrations of one unchanged arm differ by noise, and, where their poses see different things, by how the prior fills the gaps.
//! Both are known: with the information G of the poses and the prior Σ an estimate is `A x + noise`, `A = (G + Σ⁻¹)⁻¹ G`, so the
//! covariance of a difference is that of both noises and `(A₁ − A₂) Σ (A₁ − A₂)ᵀ`. Combinations that no pose sees differ by nothing
//! and count for nothing. Differences are judged as positions over the workspace, where only what moves the arm counts.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use thiserror::Error;

use super::known::{Known, KnownError, workspace_places};
use crate::geometry::register;
use crate::identification::change::{Differences, excess};
use crate::identification::predicted::{jacobian, motions};
use crate::identification::verification::ErrorStatistics;
use crate::kinematics::{Arm, JointTerm, KinematicChain, ParameterId, Place};
use crate::procedure::health::Mounting;
use crate::session::comparison::{CauseSummary, CurveDifference, DifferenceSummary, PairSummary};
use crate::session::summary::JointErrorSummary;
use crate::units::{MICROMETRE, to_mm};

/// A difference this many standard deviations above chance is a change.
const CHANGED: f64 = 3.0;
/// Parameters are listed from this many standard deviations on.
const LISTED: f64 = 3.0;
/// Causes whose square sums differ by less than this explain a difference equally well.
const AS_GOOD: f64 = 1.0;
/// Most causes that are looked for.
const MOST_CAUSES: usize = 4;
/// Rounding of files and what a linear model leaves (m, rms over the workspace per direction).
const ROUNDING: f64 = 0.5 * MICROMETRE;
/// Directions with less effect than this part of the largest have none.
const NO_EFFECT: f64 = 1e-12;

/// Calibrations that cannot be compared.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// One of them does not tell enough.
    #[error(transparent)]
    Known(#[from] KnownError),
    /// Arms of different build.
    #[error("the calibrations are of robots with different joints, or of different profiles")]
    OtherRobot,
    /// Numbers without a covariance.
    #[error("the difference has no covariance")]
    Singular,
}

/// How an estimate follows the truth, over common parameters.
struct Response {
    /// `A`.
    follows: DMatrix<f64>,
    /// Covariance of its noise.
    noise: DMatrix<f64>,
}

impl Response {
    /// Of an estimate of some of the parameters `ids`.
    fn new(known: &Known, ids: &[ParameterId]) -> Option<Self> {
        let own = known.ids();
        let place: Vec<usize> = own.iter().filter_map(|id| ids.iter().position(|other| other == id)).collect();
        // What the poses tell about all parameters, and about its own.
        let all = if own == ids { known.information.clone() } else { known.information_of(ids) };
        let rows = all.select_rows(&place);
        let gram = rows.select_columns(&place);
        let covariance = &known.covariance;
        let follows = covariance * &rows;
        let noise = covariance * gram * covariance;
        let n = ids.len();
        let mut complete = Self { follows: DMatrix::zeros(n, n), noise: DMatrix::zeros(n, n) };
        for (i, &row) in place.iter().enumerate() {
            complete.follows.row_mut(row).copy_from(&follows.row(i));
            for (j, &column) in place.iter().enumerate() {
                complete.noise[(row, column)] = noise[(i, j)];
            }
        }
        complete.follows.iter().all(|value| value.is_finite()).then_some(complete)
    }
}

/// The common parameters of two calibrations with their expected deviations.
fn common(one: &Known, other: &Known) -> Vec<(ParameterId, f64)> {
    let mut all: Vec<(ParameterId, f64)> = one.parameters.iter().map(|p| (p.id, p.expected)).collect();
    for parameter in &other.parameters {
        match all.iter_mut().find(|(id, _)| *id == parameter.id) {
            Some((_, expected)) => *expected = expected.max(parameter.expected),
            None => all.push((parameter.id, parameter.expected)),
        }
    }
    all
}

/// Compares an earlier with a later calibration of one arm, or those of two arms of one build. `mounting` says whether the SMR was
/// still in its place.
///
/// # Errors
/// Calibrations that do not tell enough, or of different robots.
pub fn compare(one: &Known, other: &Known, mounting: Mounting) -> Result<PairSummary, CompareError> {
    if one.arm.chain.joints().len() != other.arm.chain.joints().len() || one.profile.name() != other.profile.name() {
        return Err(CompareError::OtherRobot);
    }
    let parameters = common(one, other);
    let ids: Vec<ParameterId> = parameters.iter().map(|(id, _)| *id).collect();
    let n = ids.len();
    let value = |known: &Known, id: &ParameterId| {
        let own = known.parameters.iter().position(|parameter| parameter.id == *id);
        own.map_or(0.0, |index| known.deviations[index])
    };
    let difference = DVector::from_iterator(n, ids.iter().map(|id| value(other, id) - value(one, id)));
    let before = Response::new(one, &ids).ok_or(CompareError::Singular)?;
    let after = Response::new(other, &ids).ok_or(CompareError::Singular)?;
    let is_own = |id: &ParameterId| mounting == Mounting::New && id.target().is_some();
    let part = |own: bool| {
        let widths = parameters.iter().map(|(id, width)| if is_own(id) == own { width * width } else { 0.0 });
        DMatrix::from_diagonal(&DVector::from_iterator(n, widths))
    };
    let apart = &after.follows - &before.follows;
    let mut covariance = &before.noise + &after.noise + &apart * part(false) * apart.transpose();
    for response in [&before, &after] {
        covariance += &response.follows * part(true) * response.follows.transpose();
    }
    let space = Space::new(one, &ids, mounting)?;
    let positions = space.positions(one, other);
    let statistics = ErrorStatistics::new(positions).ok_or(CompareError::Singular)?;
    let judged = Judged::new(&space, &difference, &covariance).ok_or(CompareError::Singular)?;
    let above = excess(judged.differences.square(), judged.values);
    let has_changed = above > CHANGED;
    let (causes, is_explained) =
        if has_changed { judged.causes(&ids, &after, &one.arm.chain) } else { (Vec::new(), true) };
    let deviation = |index: usize| covariance[(index, index)].max(0.0).sqrt();
    let listed = ids.iter().enumerate().filter(|(_, id)| id.target().is_none()).filter_map(|(index, id)| {
        let (value, sigma) = (difference[index], deviation(index));
        let unit = id.unit();
        // Differences below the last digit of a file are none.
        let ratio = value / sigma.max(1e-9 * parameters[index].1);
        (has_changed && ratio.abs() > LISTED).then(|| DifferenceSummary {
            parameter: *id,
            unit,
            difference: unit.to_edge(value),
            sigma: unit.to_edge(sigma),
            ratio,
        })
    });
    Ok(PairSummary {
        from: 0,
        to: 0,
        rms_mm: to_mm(statistics.rms),
        p95_mm: to_mm(statistics.p95),
        max_mm: to_mm(statistics.max),
        sigma_mm: to_mm((&space.products * &covariance).trace().max(0.0).sqrt()),
        excess: above,
        has_changed,
        causes,
        is_explained,
        parameters: listed.collect(),
        curves: Vec::new(),
    })
}

/// Position error (m, rms over the workspace) that a calibration leaves open.
///
/// # Errors
/// Joints without limits.
pub fn open_error(known: &Known, mounting: Mounting) -> Result<f64, CompareError> {
    let space = Space::new(known, &known.ids(), mounting)?;
    Ok((&space.products * &known.covariance).trace().max(0.0).sqrt())
}

/// The workspace, without what only moves the whole arm or its tool.
pub(super) struct Space {
    places: Vec<Place>,
    /// Orthonormal columns of what means nothing.
    gauge: DMatrix<f64>,
    mounting: Mounting,
    /// Mean products of the effects of the parameters on positions (m²).
    pub(super) products: DMatrix<f64>,
}

impl Space {
    pub(super) fn new(known: &Known, ids: &[ParameterId], mounting: Mounting) -> Result<Self, KnownError> {
        let places = workspace_places(&known.profile)?;
        let all: Vec<&Place> = places.iter().collect();
        let mut columns = motions(&known.arm, &all);
        if mounting == Mounting::New {
            let tool: Vec<ParameterId> = ParameterId::of_target(0).collect();
            let tool = jacobian(&known.arm, &tool, &all);
            let width = columns.ncols();
            columns = columns.insert_columns(width, tool.ncols(), 0.0);
            columns.columns_mut(width, tool.ncols()).copy_from(&tool);
        }
        let gauge = columns.qr().q();
        let mut rows = jacobian(&known.arm, ids, &all);
        let taken = gauge.tr_mul(&rows);
        rows -= &gauge * taken;
        let products = rows.tr_mul(&rows) / all.len().max(1) as f64;
        Ok(Self { places, gauge, mounting, products })
    }

    /// Distances (m) between the positions of two arms.
    fn positions(&self, one: &Known, other: &Known) -> Vec<f64> {
        let second = match self.mounting {
            Mounting::Same => other.arm.clone(),
            Mounting::New => Arm { targets: one.arm.targets.clone(), ..other.arm.clone() },
        };
        let points = [&one.arm, &second].map(|arm| arm.points_in_base(&self.places));
        let pairs = points[1].iter().zip(&points[0]).map(|(from, to)| (1.0, *from, *to));
        let Some(moved) = register(pairs) else { return Vec::new() };
        let apart = points[1].iter().zip(&points[0]).flat_map(|(from, to)| {
            let apart = moved.to_from_from * from - to;
            [apart.x, apart.y, apart.z]
        });
        let mut apart = DVector::from_iterator(3 * self.places.len(), apart);
        let taken = self.gauge.tr_mul(&apart);
        apart -= &self.gauge * taken;
        apart.as_slice().chunks_exact(3).map(|xyz| xyz.iter().map(|value| value * value).sum::<f64>().sqrt()).collect()
    }
}

/// A difference as positions, ready to be explained.
struct Judged {
    /// From parameters to independent directions of positions.
    to_positions: DMatrix<f64>,
    differences: Differences,
    /// Number of independent values.
    values: f64,
}

impl Judged {
    fn new(space: &Space, difference: &DVector<f64>, covariance: &DMatrix<f64>) -> Option<Self> {
        let eigen = SymmetricEigen::new(space.products.clone());
        let largest = eigen.eigenvalues.max();
        let kept: Vec<usize> =
            (0..difference.len()).filter(|index| eigen.eigenvalues[*index] > NO_EFFECT * largest).collect();
        let mut to_positions = eigen.eigenvectors.select_columns(&kept).transpose();
        for (row, index) in kept.iter().enumerate() {
            to_positions.row_mut(row).scale_mut(eigen.eigenvalues[*index].sqrt());
        }
        let mut spread = &to_positions * covariance * to_positions.transpose();
        spread = (&spread + spread.transpose()) * 0.5;
        let floor = ROUNDING * ROUNDING;
        let values = spread.symmetric_eigenvalues().iter().map(|value| value.max(0.0) / (value.max(0.0) + floor)).sum();
        for index in 0..spread.nrows() {
            spread[(index, index)] += floor;
        }
        let differences = Differences::new(&(&to_positions * difference), spread)?;
        Some(Self { to_positions, differences, values })
    }

    /// The fewest changes that explain the difference, and whether they do.
    fn causes(&self, ids: &[ParameterId], after: &Response, chain: &KinematicChain) -> (Vec<CauseSummary>, bool) {
        let possible: Vec<usize> = (0..ids.len()).filter(|index| is_cause(ids[*index])).collect();
        let patterns = self.differences.whiten(&(&self.to_positions * after.follows.select_columns(&possible)));
        let mut found: Vec<Vec<usize>> = Vec::new();
        let columns = |found: &[Vec<usize>], last: Option<usize>| {
            let firsts: Vec<usize> = found.iter().filter_map(|group| group.first().copied()).chain(last).collect();
            patterns.select_columns(&firsts)
        };
        let mut is_explained = false;
        while found.len() < MOST_CAUSES && !is_explained {
            let taken = |index: usize| self.differences.taken_by(&columns(&found, Some(index)));
            let all: Vec<f64> = (0..possible.len()).map(taken).collect();
            let best = all.iter().copied().fold(0.0, f64::max);
            let mut group: Vec<usize> = (0..possible.len()).filter(|index| best - all[*index] < AS_GOOD).collect();
            group.sort_by(|a, b| all[*b].total_cmp(&all[*a]));
            if group.is_empty() {
                break;
            }
            found.push(group);
            let left = self.differences.square() - best;
            is_explained = excess(left, self.values - found.len() as f64) < CHANGED;
        }
        let together = self.differences.together(&columns(&found, None), 1e3);
        let causes = found.iter().enumerate().filter_map(|(index, group)| {
            let (sizes, covariance) = together.as_ref()?;
            let parameters: Vec<ParameterId> = group.iter().map(|index| ids[possible[*index]]).collect();
            let first = *parameters.first()?;
            let unit = first.unit();
            Some(CauseSummary {
                meaning: first.meaning(chain),
                unit,
                change: unit.to_edge(sizes[index]),
                sigma: unit.to_edge(covariance[(index, index)].max(0.0).sqrt()),
                parameters,
            })
        });
        (causes.collect(), is_explained)
    }
}

/// Whether a parameter can change on its own: a link, a zero, an elasticity, but no wave of a curve and no target.
const fn is_cause(id: ParameterId) -> bool {
    match id {
        ParameterId::Link { .. } => true,
        ParameterId::Joint { term, .. } => matches!(term, JointTerm::Compliance | JointTerm::Tilt(_)),
        ParameterId::Target { .. } => false,
    }
}

/// How far the curves of joints are apart, where both calibrations have them.
pub fn curves(one: &[JointErrorSummary], other: &[JointErrorSummary]) -> Vec<CurveDifference> {
    let pair = |before: &JointErrorSummary| {
        let after = other.iter().find(|after| after.joint == before.joint)?;
        let apart: Vec<(f64, f64)> = after
            .curve
            .iter()
            .filter_map(|(value, error, sigma)| {
                let (old, old_sigma) = at(&before.curve, *value)?;
                Some((error - old, sigma.hypot(old_sigma)))
            })
            .collect();
        let count = apart.len() as f64;
        // The zero of a joint is a parameter of its own.
        let mean = apart.iter().map(|(apart, _)| apart).sum::<f64>() / count;
        let square = apart.iter().map(|(apart, _)| (apart - mean).powi(2)).sum::<f64>() / count;
        let normal = apart.iter().map(|(apart, sigma)| ((apart - mean) / sigma.max(1e-3)).powi(2)).sum::<f64>() / count;
        (count > 1.0).then(|| CurveDifference {
            joint: before.joint.clone(),
            rms_urad: square.sqrt(),
            ratio: normal.sqrt(),
            before: before.curve.clone(),
            after: after.curve.clone(),
        })
    };
    one.iter().filter_map(pair).collect()
}

/// Error and standard deviation of a curve at a value of the joint, between its points.
fn at(curve: &[(f64, f64, f64)], value: f64) -> Option<(f64, f64)> {
    let after = curve.iter().position(|(at, ..)| *at >= value)?;
    let (to, error, sigma) = curve[after];
    let Some(&(from, before, _)) = after.checked_sub(1).and_then(|index| curve.get(index)) else {
        return ((to - value).abs() < 1e-9).then_some((error, sigma));
    };
    let part = if to > from { (value - from) / (to - from) } else { 1.0 };
    Some((before + part * (error - before), sigma))
}
