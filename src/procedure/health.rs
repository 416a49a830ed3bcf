//! Health check: whether a calibration still holds, from a few poses with the tracker anywhere.
//!
//! What the poses should show if nothing has changed has a covariance: the scatter of readings and poses, what the calibration
//! leaves open, the unknown place of the tracker, and that of the SMR if it was mounted again. The zero of each joint is a cause that
//! would add its own pattern. The verdict is sequential: limits for few poses are higher, so that looking after every pose does not
//! raise false alarms (O'Brien and Fleming 1979).

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Point3, Vector3};
use thiserror::Error;

use super::identify::NamedSample;
use super::known::{Known, KnownError, zero_of};
use super::plan::PlanRequest;
use crate::identification::change::{Differences, Explanation, excess};
use crate::identification::predicted::{free_jacobian, jacobian, motions};
use crate::identification::verification::fit_setup;
use crate::identification::{IdentificationError, Observations, Places, PointSample};
use crate::kinematics::{Arm, FreeParameter, Joint, ParameterId, Place};
use crate::planning::Objective;
use crate::profile::{Level, Profile, Target};
use crate::session::health::{ForecastSummary, HealthStep, HealthSummary, HealthVerdict, SCHEMA, ZeroSummary};
use crate::session::summary::{Provenance, Warning};
use crate::units::{DEGREE, MILLIMETRE, to_mm};

/// Poses of a check.
pub const POSES: usize = 12;
/// Fewest poses that are judged.
const FEWEST: usize = 5;
/// Fewest poses that show that nothing has changed.
const FEWEST_VALID: usize = 8;
/// A zero has moved if it did by this many standard deviations, after [`POSES`] poses: one false alarm in a hundred checks of five
/// joints.
const MOVED: f64 = 3.1;
/// Residuals are too large if they are by this many standard deviations.
pub(super) const EXCESS: f64 = 3.3;
/// Two explanations whose square sums differ by less than this are equally good.
const AS_GOOD: f64 = 1.0;
/// One bad pose must explain this much more than one zero: it has three coordinates.
const BAD_POSE: f64 = 8.0;
/// Uncertainty of the frame about its fit (m and rad), and of a remounted target (m).
const FRAME: f64 = 0.05;
const REMOUNTED: f64 = 50.0 * MILLIMETRE;
/// A zero that the poses show no better than this (rad; m) is not seen.
const UNSEEN_ANGLE: f64 = 0.1 * DEGREE;
const UNSEEN_LENGTH: f64 = 2.0 * MILLIMETRE;
/// How far a zero that was found to have moved may have (rad or m).
const FREED: f64 = 0.03;
/// How far zeros may have moved, for what could stay hidden (rad or m).
const PLAUSIBLE_MOVE: f64 = 5e-3;
/// Standard deviations of a change that is found in nine of ten checks.
const FOUND: f64 = MOVED + 1.28;

/// Why there is no verdict.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum HealthError {
    /// The calibration does not tell enough.
    #[error(transparent)]
    Known(#[from] KnownError),
    /// The points cannot be registered.
    #[error(transparent)]
    Setup(#[from] IdentificationError),
    /// Too few poses.
    #[error("{found} different poses cannot show anything; a check has {POSES}, and at least {FEWEST}")]
    FewPoses { found: usize },
    /// A covariance that is none.
    #[error("the points leave no covariance to judge by")]
    Singular,
}

/// Which target was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mounting {
    /// Still where it was at the calibration.
    Same,
    /// Mounted again, or another one: its place is found along.
    New,
}

/// A request for a verdict.
#[derive(Clone, Debug)]
pub struct HealthRequest<'a> {
    /// The calibrated arm.
    pub known: &'a Known,
    /// When it was calibrated.
    pub calibrated: String,
    /// The points, in the order in which they were measured.
    pub samples: Vec<NamedSample>,
    /// Which target.
    pub mounting: Mounting,
    /// Standard deviation of a coordinate (m) instead of that of the calibration.
    pub sigma: Option<f64>,
    /// Limit of the position error (m).
    pub limit: Option<f64>,
    /// Origin of the numbers.
    pub provenance: Provenance,
    /// Warnings from reading the points.
    pub warnings: Vec<Warning>,
}

/// The robot as a check is planned for: with its target free if that is mounted again.
pub fn planned_profile(profile: &Profile, mounting: Mounting) -> Profile {
    match (mounting, profile.targets().first()) {
        (Mounting::New, Some(target)) => {
            profile.with_target(0, Target { uncertainty: target.uncertainty.max(REMOUNTED), ..target.clone() })
        }
        (Mounting::Same | Mounting::New, _) => profile.clone(),
    }
}

/// The request for a plan of a check: poses that show zeros best.
pub fn plan_request(created: String, poses: usize) -> PlanRequest {
    PlanRequest {
        created,
        poses,
        verification: 0,
        objective: Objective::D,
        level: Level::Offsets,
        drift_every: 0,
        ..PlanRequest::default()
    }
}

/// Readings of one pose together.
#[derive(Clone, Debug)]
struct Pose {
    name: String,
    at: Place,
    point: Point3<f64>,
    readings: f64,
    sigma: Option<f64>,
}

fn poses(samples: &[NamedSample], joints: &[Joint]) -> Vec<Pose> {
    let all: Vec<&Place> = samples.iter().map(|named| &named.sample.at).collect();
    let first = Places::new(joints, all.iter().copied()).first_of_each();
    let mut poses: BTreeMap<usize, Pose> = BTreeMap::new();
    for (named, first) in samples.iter().zip(first) {
        let sample = &named.sample;
        let pose = poses.entry(first).or_insert_with(|| Pose {
            name: named.pose.clone(),
            at: sample.at.clone(),
            point: Point3::origin(),
            readings: 0.0,
            sigma: sample.sigma,
        });
        pose.readings += 1.0;
        pose.point += (sample.point.coords - pose.point.coords) / pose.readings;
    }
    poses.into_values().collect()
}

/// The unknown set-up of a check and what is known of the arm, at some places.
struct Model<'a> {
    known: Known,
    arm: &'a Arm,
    places: Vec<&'a Place>,
    /// Zeros, one per joint.
    zeros: Vec<ParameterId>,
    /// Targets whose place is unknown.
    remounted: Vec<ParameterId>,
}

impl<'a> Model<'a> {
    fn new(known: &Known, arm: &'a Arm, places: Vec<&'a Place>, mounting: Mounting) -> Self {
        let joints = arm.chain.joints();
        let zeros = (0..joints.len()).map(|joint| zero_of(joint, joints)).collect();
        let mut targets: Vec<usize> = places.iter().map(|place| place.target).collect();
        targets.sort_unstable();
        targets.dedup();
        let (known, remounted) = match mounting {
            Mounting::Same => (known.clone(), Vec::new()),
            Mounting::New => (
                known.without(|id| id.target().is_some()),
                targets.into_iter().flat_map(ParameterId::of_target).collect(),
            ),
        };
        Self { known, arm, places, zeros, remounted }
    }

    /// Values that the frame and the target take.
    fn unknowns(&self) -> f64 {
        6.0 + self.remounted.len() as f64
    }

    /// Covariance of measured less predicted, with these variances of the points (m²).
    fn covariance(&self, variances: &[f64]) -> DMatrix<f64> {
        let rows = self.known.jacobian(self.arm, &self.places);
        let frame = motions(self.arm, &self.places) * FRAME;
        let target = jacobian(self.arm, &self.remounted, &self.places) * REMOUNTED;
        let mut covariance = &rows * &self.known.covariance * rows.transpose();
        covariance.gemm(1.0, &frame, &frame.transpose(), 1.0);
        if target.ncols() > 0 {
            covariance.gemm(1.0, &target, &target.transpose(), 1.0);
        }
        for (index, variance) in variances.iter().enumerate() {
            for axis in 0..3 {
                covariance[(3 * index + axis, 3 * index + axis)] += variance;
            }
        }
        covariance
    }

    fn patterns(&self) -> DMatrix<f64> {
        jacobian(self.arm, &self.zeros, &self.places)
    }

    fn is_seen(&self, joint: usize, sigma: f64) -> bool {
        let limit = match self.arm.chain.joints()[joint].joint_type.quantity() {
            crate::units::Quantity::Angle => UNSEEN_ANGLE,
            crate::units::Quantity::Length => UNSEEN_LENGTH,
        };
        sigma < limit
    }
}

/// What some points say.
struct Examined {
    zeros: Vec<Explanation>,
    seen: Vec<bool>,
    /// Square sum of the differences, and the number of independent values.
    square: f64,
    values: f64,
    /// Square sum that the worst pose alone takes, with its index.
    worst_pose: (usize, f64),
    /// Position error (m, rms).
    error: f64,
    /// Covariance of the zeros that are seen, and their sizes, all together.
    together: Option<(DVector<f64>, DMatrix<f64>)>,
}

fn examine(known: &Known, poses: &[Pose], mounting: Mounting, sigma: Option<f64>) -> Result<Examined, HealthError> {
    let points: Vec<PointSample> = poses
        .iter()
        .map(|pose| PointSample { at: pose.at.clone(), station: 0, point: pose.point, sigma: None })
        .collect();
    let observations = Observations { points, ..Observations::default() };
    let places: Vec<&Place> = poses.iter().map(|pose| &pose.at).collect();
    let remounted = Model::new(known, &known.arm, places.clone(), mounting).remounted;
    let free: Vec<FreeParameter> = remounted.iter().map(|id| FreeParameter { id: *id, expected: REMOUNTED }).collect();
    let setup = fit_setup(&known.arm, &free, &observations)?;
    let model = Model::new(known, &setup.arm, places, mounting);
    let predicted = setup.arm.points_in_base(model.places.iter().copied());
    let base_from_station = setup.base_from_station.first().copied().unwrap_or_default();
    let residuals: Vec<Vector3<f64>> =
        poses.iter().zip(&predicted).map(|(pose, predicted)| base_from_station * pose.point - predicted).collect();
    let residuals =
        DVector::from_iterator(3 * poses.len(), residuals.iter().flat_map(|residual| residual.iter().copied()));
    let variances = variances(known, poses, sigma);
    let differences = Differences::new(&residuals, model.covariance(&variances)).ok_or(HealthError::Singular)?;
    let patterns = differences.whiten(&model.patterns());
    let zeros: Vec<Explanation> =
        patterns.column_iter().map(|column| differences.explained_by(&column.into_owned())).collect();
    let seen: Vec<bool> = zeros.iter().enumerate().map(|(joint, zero)| model.is_seen(joint, zero.sigma)).collect();
    let values = 3.0 * poses.len() as f64 - model.unknowns();
    let own = differences.whiten(&DMatrix::identity(residuals.len(), residuals.len()));
    let taken = (0..poses.len()).map(|pose| (pose, differences.taken_by(&own.columns(3 * pose, 3).into_owned())));
    let worst_pose = taken.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
    let visible: Vec<usize> = (0..seen.len()).filter(|joint| seen[*joint]).collect();
    let together = differences.together(&patterns.select_columns(&visible), PLAUSIBLE_MOVE);
    Ok(Examined {
        error: (3.0 * residuals.norm_squared() / values.max(1.0)).sqrt(),
        square: differences.square(),
        zeros,
        seen,
        values,
        worst_pose,
        together,
    })
}

/// Variance of each averaged point (m²): what poses scatter by, and the readings of a pose.
fn variances(known: &Known, poses: &[Pose], sigma: Option<f64>) -> Vec<f64> {
    let common = known.poses_sigma.powi(2);
    let own = |pose: &Pose| match (pose.sigma, sigma) {
        (_, Some(sigma)) | (Some(sigma), None) => sigma.powi(2),
        (None, None) => known.sigma.powi(2) - common,
    };
    poses.iter().map(|pose| (common + own(pose).max(0.0) / pose.readings).max(1e-14)).collect()
}

impl Examined {
    /// The best and the second best zero.
    fn best(&self) -> (Option<usize>, Option<usize>) {
        let mut seen: Vec<usize> = (0..self.zeros.len()).filter(|joint| self.seen[*joint]).collect();
        seen.sort_by(|a, b| self.zeros[*b].ratio().abs().total_cmp(&self.zeros[*a].ratio().abs()));
        (seen.first().copied(), seen.get(1).copied())
    }

    fn verdict(&self, poses: &[Pose], joints: &[Joint], limit: Option<f64>, hidden: Option<f64>) -> HealthVerdict {
        // Few poses must show more.
        let caution = (POSES as f64 / poses.len() as f64).max(1.0).sqrt();
        let (best, second) = self.best();
        let square_of = |joint: Option<usize>| joint.map_or(0.0, |joint| self.zeros[joint].ratio().powi(2));
        let has_moved = square_of(best).sqrt() > MOVED * caution;
        let is_large = excess(self.square, self.values) > EXCESS * caution;
        if has_moved || is_large {
            let (pose, taken) = self.worst_pose;
            let without_pose = excess(self.square - taken, self.values - 3.0);
            if taken > square_of(best) + BAD_POSE && without_pose < EXCESS {
                return HealthVerdict::MeasureAgain { pose: poses[pose].name.clone() };
            }
            let is_explained = excess(self.square - square_of(best), self.values - 1.0) < EXCESS;
            let name = |joint: usize| joints[joint].name.clone();
            return match (best.filter(|_| has_moved && is_explained), second) {
                (Some(best), Some(second)) if square_of(Some(best)) - square_of(Some(second)) < AS_GOOD => {
                    HealthVerdict::Changed { candidates: vec![name(best), name(second)] }
                }
                (Some(best), _) => {
                    let quantity = joints[best].joint_type.quantity();
                    HealthVerdict::ZeroMoved {
                        joint: name(best),
                        by: quantity.to_edge(self.zeros[best].size),
                        sigma: quantity.to_edge(self.zeros[best].sigma),
                        unit: quantity.unit().to_owned(),
                    }
                }
                (None, _) => HealthVerdict::Changed { candidates: Vec::new() },
            };
        }
        let undecided = |reason: &str| HealthVerdict::Undecided { reason: reason.to_owned() };
        let is_beyond = |value: Option<f64>| limit.zip(value).is_some_and(|(limit, value)| value > limit);
        if poses.len() < FEWEST_VALID {
            undecided("too few poses so far")
        } else if is_beyond(Some(self.error)) {
            undecided("no change is found, but the points scatter by more than the limit")
        } else if is_beyond(hidden) {
            undecided("no change is found, but one that matters could stay hidden: measure more poses")
        } else {
            HealthVerdict::StillValid
        }
    }
}

/// The effect over the workspace (m, rms) of changes of the zeros that are seen.
struct Effects {
    /// Mean products of the effects of all zeros (m²).
    products: DMatrix<f64>,
}

impl Effects {
    fn new(known: &Known) -> Result<Self, KnownError> {
        let places = known.workspace()?;
        let places: Vec<&Place> = places.iter().collect();
        let joints = known.arm.chain.joints();
        let zeros: Vec<ParameterId> = (0..joints.len()).map(|joint| zero_of(joint, joints)).collect();
        let rows = free_jacobian(&known.arm, &zeros, &places);
        Ok(Self { products: rows.tr_mul(&rows) / places.len().max(1) as f64 })
    }

    /// Of zeros that may have moved as far as some points can tell.
    fn hidden(&self, examined: &Examined) -> Option<f64> {
        let visible: Vec<usize> = (0..examined.seen.len()).filter(|joint| examined.seen[*joint]).collect();
        let products = self.products.select_rows(&visible).select_columns(&visible);
        let (sizes, covariance) = examined.together.as_ref()?;
        let square = sizes.dot(&(&products * sizes)) + (&products * covariance).trace();
        Some(square.max(0.0).sqrt())
    }
}

/// Judges the points of a check.
///
/// # Errors
/// Too few points, or a calibration that does not tell enough.
pub fn evaluate(request: &HealthRequest<'_>) -> Result<HealthSummary, HealthError> {
    let known = request.known;
    let joints = known.arm.chain.joints();
    let poses = poses(&request.samples, joints);
    if poses.len() < FEWEST {
        return Err(HealthError::FewPoses { found: poses.len() });
    }
    let effects = Effects::new(known).ok();
    let mut steps = Vec::new();
    let mut last = None;
    for count in FEWEST..=poses.len() {
        let part = &poses[..count];
        let examined = examine(known, part, request.mounting, request.sigma)?;
        let hidden = effects.as_ref().and_then(|effects| effects.hidden(&examined));
        steps.push(HealthStep { poses: count, verdict: examined.verdict(part, joints, request.limit, hidden) });
        last = Some((examined, hidden));
    }
    let Some((examined, hidden)) = last else { return Err(HealthError::FewPoses { found: poses.len() }) };
    let verdict = steps.last().map_or(HealthVerdict::Changed { candidates: Vec::new() }, |step| step.verdict.clone());
    let same = |step: &HealthStep| std::mem::discriminant(&step.verdict) == std::mem::discriminant(&verdict);
    let decided_after = verdict
        .is_final()
        .then(|| steps.iter().rev().take_while(|step| same(step)).last().map(|step| step.poses))
        .flatten()
        .filter(|after| *after < poses.len());
    let zeros = joints.iter().zip(&examined.zeros).zip(&examined.seen).map(|((joint, zero), seen)| {
        let quantity = joint.joint_type.quantity();
        ZeroSummary {
            joint: joint.name.clone(),
            unit: quantity.unit().to_owned(),
            moved: quantity.to_edge(zero.size),
            sigma: quantity.to_edge(zero.sigma),
            ratio: zero.ratio(),
            is_visible: *seen,
        }
    });
    Ok(HealthSummary {
        schema: SCHEMA,
        provenance: request.provenance.clone(),
        warnings: request.warnings.clone(),
        calibrated: request.calibrated.clone(),
        verdict,
        poses: poses.len(),
        decided_after,
        limit_mm: request.limit.map(to_mm),
        error_mm: to_mm(examined.error),
        hidden_mm: hidden.map(to_mm),
        excess: excess(examined.square, examined.values),
        zeros: zeros.collect(),
        steps,
    })
}

/// A zero that has moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MovedZero {
    pub(super) id: ParameterId,
    pub(super) explanation: Explanation,
}

/// The zeros that have moved, the clearest first, and by how many standard deviations the points are off once these are free. A pose
/// that contradicts all others is left out.
pub(super) fn moved_zeros(
    known: &Known,
    samples: &[NamedSample],
    mounting: Mounting,
    sigma: Option<f64>,
) -> Result<(Vec<MovedZero>, f64), HealthError> {
    let joints = known.arm.chain.joints();
    let mut poses = poses(samples, joints);
    if poses.len() < FEWEST {
        return Err(HealthError::FewPoses { found: poses.len() });
    }
    let mut known = known.clone();
    let mut moved: Vec<MovedZero> = Vec::new();
    loop {
        let examined = examine(&known, &poses, mounting, sigma)?;
        let above = excess(examined.square, examined.values - moved.len() as f64);
        let (worst, taken) = examined.worst_pose;
        let best = examined.best().0.filter(|joint| examined.zeros[*joint].ratio().abs() > MOVED);
        let of_best = best.map_or(0.0, |joint| examined.zeros[joint].ratio().powi(2));
        if above > EXCESS && taken > of_best + BAD_POSE && poses.len() > FEWEST_VALID {
            poses.remove(worst);
            continue;
        }
        let free = best.map(|joint| MovedZero { id: zero_of(joint, joints), explanation: examined.zeros[joint] });
        let new = free.filter(|zero| moved.iter().all(|moved| moved.id != zero.id));
        let Some((new, index)) = new.and_then(|new| Some((new, known.ids().iter().position(|id| *id == new.id)?)))
        else {
            return Ok((moved, above));
        };
        known.covariance[(index, index)] += FREED * FREED;
        moved.push(new);
    }
}

/// What a check at `places` will be able to see.
///
/// # Errors
/// A covariance that is none.
pub fn forecast(known: &Known, places: &[Place], mounting: Mounting) -> Result<Vec<ForecastSummary>, HealthError> {
    let model = Model::new(known, &known.arm, places.iter().collect(), mounting);
    let covariance = model.covariance(&vec![known.sigma.powi(2); places.len()]);
    let nothing = DVector::zeros(covariance.nrows());
    let differences = Differences::new(&nothing, covariance).ok_or(HealthError::Singular)?;
    let patterns = differences.whiten(&model.patterns());
    let joints = known.arm.chain.joints().iter().enumerate();
    Ok(joints
        .map(|(index, joint)| {
            let quantity = joint.joint_type.quantity();
            let sigma = differences.explained_by(&patterns.column(index).into_owned()).sigma;
            let sigma = Some(sigma).filter(|sigma| model.is_seen(index, *sigma)).map(|sigma| quantity.to_edge(sigma));
            ForecastSummary {
                joint: joint.name.clone(),
                unit: quantity.unit().to_owned(),
                sigma,
                found: sigma.map(|sigma| FOUND * sigma),
            }
        })
        .collect())
}

/// The limit of the position error that a profile states (m).
pub fn limit_of(profile: &Profile) -> Option<f64> {
    let acceptance = profile.acceptance();
    acceptance.position_rms.or(acceptance.position_mean).or(acceptance.position_max)
}
