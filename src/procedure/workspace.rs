//! The error that is predicted where nothing was measured: over the range of the joints in which the arm has to be accurate.

use nalgebra::{DVector, Matrix3, SymmetricEigen};

use crate::geometry::register;
use crate::identification::plausibility::weak_combinations;
use crate::identification::predicted::Predictor;
use crate::identification::verification::ErrorStatistics;
use crate::identification::{Estimate, Identification, LengthEnd, Problem, WithTerms};
use crate::kinematics::{Arm, Place};
use crate::planning::{JointBox, random};
use crate::profile::{Acceptance, Profile};
use crate::report::number;
use crate::session::summary::{VerificationSummary, Warning, WarningCode, WorkspaceSummary};
use crate::text::{self, counted};
use crate::units::{MICROMETRE, to_mm};

/// Configurations that the error is predicted at.
const CONFIGURATIONS: usize = 400;
/// Their seed: the same for every arm, so that figures can be compared.
const SEED: u64 = 0x5eed;
/// Measured poses from which a joint is taken over its range, and the values that it takes.
const POSES_OF_A_JOINT: usize = 10;
const VALUES_OF_A_JOINT: usize = 16;
/// Mean of the norm of three normal numbers per root mean square, and what 95 % of them stay below.
const MEAN_PER_RMS: f64 = 0.921;
const LARGEST_PER_RMS: f64 = 1.614;
/// A combination of parameters that costs less than this part of the noise need not be named.
const WORTH_NAMING: f64 = 0.5;
/// Most parameters of a combination that are named, and the least part of the largest that any of them has.
const NAMED: usize = 4;
const HAS_A_SAY: f64 = 0.2;

/// The prediction over the workspace.
#[derive(Clone, Debug)]
pub(super) struct Workspace<'a> {
    pub(super) summary: WorkspaceSummary,
    predictor: Predictor<'a>,
    found: &'a Identification,
    /// Random configurations over the ranges.
    places: Vec<Place>,
    /// Places that define the frame.
    measured: Vec<&'a Place>,
    /// Ranges of the joints ((rad) or (m)).
    ranges: Vec<(f64, f64)>,
    /// Root mean square error of the nominal arm where it was measured (m).
    nominal: Option<f64>,
}

/// The joint whose range the samples leave open most.
#[derive(Clone, Debug)]
struct WorstJoint {
    joint: usize,
    /// Where it was measured ((rad) or (m)).
    measured: (f64, f64),
    /// Largest error predicted where it alone leaves the measured poses (m).
    largest: f64,
    /// Its value there ((rad) or (m)).
    at: f64,
}

/// The ranges of the pendant joints in which the arm has to be accurate ((rad) or (m)): what is planned, but not more than a turn.
pub(super) fn ranges(profile: &Profile) -> Option<Vec<(f64, f64)>> {
    use std::f64::consts::PI;
    let joints = profile.chain().joints().iter().zip(profile.joints());
    joints
        .map(|(joint, range)| {
            let stated = range.planning_limits.or(range.limits);
            match joint.joint_type {
                crate::kinematics::JointType::Prismatic => stated,
                crate::kinematics::JointType::Revolute => {
                    let (low, high) = stated.unwrap_or((-PI, PI));
                    Some(if high - low > 2.0 * PI { (-PI, PI) } else { (low, high) })
                }
            }
        })
        .collect()
}

impl<'a> Workspace<'a> {
    /// Predicts from the samples of `problem` that `with_terms` accepted; `None` where they define no frame or the profile no range.
    pub(super) fn new(
        profile: &Profile,
        problem: &Problem<'a>,
        with_terms: &'a WithTerms,
        nominal: Option<f64>,
    ) -> Option<Self> {
        let found = &with_terms.found;
        let measured = frame_places(problem, found);
        let predictor = Predictor::new(found, &measured)?;
        let ranges = ranges(profile)?;
        let targets = problem.arm.targets.len().max(1);
        let joint_box = JointBox::new(ranges.clone()).ok()?;
        let places: Vec<Place> = random(&joint_box, SEED)
            .take(CONFIGURATIONS)
            .enumerate()
            .map(|(index, configuration)| Place { configuration, target: index % targets })
            .collect();
        let all: Vec<&Place> = places.iter().collect();
        let errors = predicted(&predictor, found, &all);
        let statistics = ErrorStatistics::new(errors)?;
        let beside_geometry = (!with_terms.selection.terms().is_geometry())
            .then(|| difference(&with_terms.geometric.arm, &found.arm, &measured, &all))
            .flatten();
        let summary = WorkspaceSummary {
            configurations: all.len(),
            rms_mm: to_mm(statistics.rms),
            p95_mm: to_mm(statistics.p95),
            max_mm: to_mm(statistics.max),
            beside_geometry_rms_mm: beside_geometry.map(to_mm),
        };
        Some(Self { summary, predictor, found, places, measured, ranges, nominal })
    }

    /// A warning that blocks acceptance where the prediction is beyond a limit, or beyond the nominal arm's own error.
    pub(super) fn warning(&self, profile: &Profile, verification: Option<&VerificationSummary>) -> Option<Warning> {
        let nominal = verification.and_then(|verification| Some(verification.nominal.position_mm?.rms));
        let beyond = self.beyond(profile.acceptance(), nominal.or_else(|| self.nominal.map(to_mm)))?;
        let WorkspaceSummary { rms_mm, p95_mm, .. } = self.summary;
        let joint = self.worst_joint().map_or_else(String::new, |worst| worst.words(profile));
        let message = format!(
            "over the whole range of the joints the predicted error is {} mm rms and {} mm at 95 % of the configurations, more than {beyond}: where the samples do not take the arm, nothing is known about it.{joint} Add poses there, or narrow the planning limits to where the arm works",
            number(rms_mm, 2),
            number(p95_mm, 2),
        );
        Some(Warning::new(WarningCode::Workspace, message, true))
    }

    /// A warning about combinations of parameters that rest on the expected deviations more than on the data. It blocks acceptance
    /// where they cost more than a limit, or more than the nominal arm's own error.
    pub(super) fn weak_combinations(&self, profile: &Profile) -> Option<Warning> {
        let combinations = weak_combinations(self.found);
        if combinations.ncols() == 0 {
            return None;
        }
        let places: Vec<&Place> = self.places.iter().collect();
        let spread = SymmetricEigen::new(self.predictor.effects(&places, &combinations));
        let costs: Vec<f64> = spread.eigenvalues.iter().map(|square| to_mm(square.max(0.0).sqrt())).collect();
        let worth_naming = |cost: &&f64| **cost > WORTH_NAMING * to_mm(self.found.sigma.used.max(MICROMETRE));
        let weak = costs.iter().filter(worth_naming).count();
        let worst = costs.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)?;
        if weak == 0 {
            return None;
        }
        let total = costs.iter().map(|cost| cost * cost).sum::<f64>().sqrt();
        let beyond = limit_below(profile.acceptance(), total, LARGEST_PER_RMS * total, self.nominal.map(to_mm));
        let direction = combinations * spread.eigenvectors.column(worst);
        let message = format!(
            "poor excitation: {} of parameters {} on the expected deviations more than on the data, which leaves {} mm rms over the workspace{}; what matters most is the change {}. Spread the poses over the joint ranges, or use a planned pose set",
            counted(weak, "combination"),
            if weak == 1 { "rests" } else { "rest" },
            number(total, 3),
            beyond.as_ref().map_or_else(String::new, |limit| format!(", more than {limit}")),
            self.combination(&direction)
        );
        Some(Warning::new(WarningCode::PoorData, message, beyond.is_some()))
    }

    /// The parameters that have most of the say in a change of them.
    fn combination(&self, direction: &DVector<f64>) -> String {
        let mut parts: Vec<(f64, &Estimate, f64)> = self
            .found
            .estimates
            .iter()
            .zip(direction.iter())
            .map(|(estimate, change)| ((change / estimate.expected).abs(), estimate, *change))
            .collect();
        parts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let largest = parts.first().map_or(0.0, |part| part.0);
        let named: Vec<String> = parts
            .iter()
            .take(NAMED)
            .filter(|(share, ..)| *share > HAS_A_SAY * largest)
            .map(|(_, estimate, change)| {
                let unit = estimate.id.unit();
                let change = unit.to_edge(*change);
                let sign = if change < 0.0 { "" } else { "+" };
                format!("{} by {sign}{} {unit}", estimate.id, number(change, 3))
            })
            .collect();
        text::listed(&named)
    }

    /// The limit that the prediction exceeds, in words.
    fn beyond(&self, acceptance: &Acceptance, nominal_mm: Option<f64>) -> Option<String> {
        let WorkspaceSummary { rms_mm, p95_mm, .. } = self.summary;
        limit_below(acceptance, rms_mm, p95_mm, nominal_mm)
    }

    /// The joint that leaves the measured poses with the largest predicted error.
    fn worst_joint(&self) -> Option<WorstJoint> {
        let measured = &self.measured;
        let poses = measured.len().min(POSES_OF_A_JOINT);
        let picked: Vec<&Place> = (0..poses).map(|index| measured[index * measured.len() / poses]).collect();
        (0..self.ranges.len())
            .map(|joint| {
                let (low, high) = self.ranges[joint];
                let value = |index: usize| low + (high - low) * index as f64 / (VALUES_OF_A_JOINT - 1) as f64;
                let places: Vec<Place> = (0..VALUES_OF_A_JOINT)
                    .flat_map(|index| picked.iter().map(move |place| (index, place)))
                    .map(|(index, place)| {
                        let mut moved = (*place).clone();
                        moved.configuration[joint] = value(index);
                        moved
                    })
                    .collect();
                let errors = predicted(&self.predictor, self.found, &places.iter().collect::<Vec<_>>());
                let (largest, index) = errors
                    .iter()
                    .zip(0..)
                    .fold((0.0, 0), |best, (error, index)| if *error > best.0 { (*error, index) } else { best });
                let values = measured.iter().map(|place| place.configuration[joint]);
                let range =
                    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), value| (a.min(value), b.max(value)));
                let at = value(index / poses.max(1));
                WorstJoint { joint, measured: range, largest, at }
            })
            .max_by(|a, b| a.largest.total_cmp(&b.largest))
    }
}

impl WorstJoint {
    fn words(&self, profile: &Profile) -> String {
        let joint = &profile.chain().joints()[self.joint];
        let quantity = joint.joint_type.quantity();
        let edge = |value: f64| number(quantity.to_edge(value), 0);
        format!(
            " Joint {} matters most: it was measured from {} to {} {unit}, and at {} {unit} the prediction is {} mm.",
            joint.name,
            edge(self.measured.0),
            edge(self.measured.1),
            edge(self.at),
            number(to_mm(self.largest), 2),
            unit = quantity.unit()
        )
    }
}

/// The accepted places that define the frame: the points of the first station, or all seats of shared points and contacts.
fn frame_places<'p>(problem: &Problem<'p>, found: &Identification) -> Vec<&'p Place> {
    let observations = problem.observations;
    let points = observations.points.iter().enumerate().filter(|(_, sample)| sample.station == 0);
    let of_points: Vec<&Place> =
        points.filter(|(index, _)| !found.is_rejected(*index)).map(|(_, sample)| &sample.at).collect();
    if !of_points.is_empty() {
        return of_points;
    }
    let seats = observations.shared.iter().flat_map(|shared| &shared.at);
    let contacts = observations.lengths.iter().filter(|length| length.feature().is_some()).flat_map(|length| {
        [&length.from, &length.to].into_iter().filter_map(|end| match end {
            LengthEnd::Target(at) => Some(at),
            LengthEnd::SharedPoint(_) | LengthEnd::Feature { .. } => None,
        })
    });
    seats.chain(contacts).collect()
}

/// Root mean square errors predicted at places (m): what the parameters leave open, and what a pose scatters by.
fn predicted(predictor: &Predictor<'_>, found: &Identification, places: &[&Place]) -> Vec<f64> {
    let own = 3.0 * found.sigma.poses.powi(2);
    let size = |covariance: &Matrix3<f64>| (covariance.trace().max(0.0) + own).sqrt();
    predictor.covariances(places).iter().map(size).collect()
}

/// Root mean square distance (m) at `places` between two arms whose bases are registered at the measured places.
fn difference(one: &Arm, other: &Arm, measured: &[&Place], places: &[&Place]) -> Option<f64> {
    let of = |arm: &Arm, places: &[&Place]| arm.points_in_base(places.iter().copied());
    let pairs = of(one, measured).into_iter().zip(of(other, measured)).map(|(from, to)| (1.0, from, to));
    let moved = register(pairs)?.to_from_from;
    let errors = of(one, places).iter().zip(of(other, places)).map(|(from, to)| (moved * from - to).norm()).collect();
    ErrorStatistics::new(errors).map(|statistics| statistics.rms)
}

/// The limit that an error of `rms_mm`, and `p95_mm` at 95 % of the configurations, exceeds, in words.
fn limit_below(acceptance: &Acceptance, rms_mm: f64, p95_mm: f64, nominal_mm: Option<f64>) -> Option<String> {
    let limits = [
        (acceptance.position_mean, MEAN_PER_RMS * rms_mm, "mean"),
        (acceptance.position_rms, rms_mm, "rms"),
        (acceptance.position_max, p95_mm, "largest"),
    ];
    let limit = limits.into_iter().find_map(|(limit, value, name)| {
        let limit = to_mm(limit?);
        (value > limit).then(|| format!("the limit of {} mm ({name})", number(limit, 3)))
    });
    limit.or_else(|| {
        let nominal = nominal_mm.filter(|nominal| rms_mm > *nominal)?;
        Some(format!("the {} mm of the nominal arm where it was measured", number(nominal, 2)))
    })
}
