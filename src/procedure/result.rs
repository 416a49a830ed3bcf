//! Warnings about the result of an identification, and whether it is usable.

use crate::identification::plausibility::{Weakness, weaknesses};
use crate::identification::tested::{JointDoubt, joint_doubts};
use crate::identification::{Identification, Prior, Problem, Settings, TerminationReason, Unmodelled};
use crate::kinematics::{Joint, JointType};
use crate::profile::Level;
use crate::report::number;
use crate::session::advice::Advice;
use crate::session::summary::{Warning, WarningCode};
use crate::text::counted;
use crate::units::{MICROMETRE, MILLIMETRE, to_mm};

/// A parameter further from nominal than this many expected deviations gets a warning.
const RAN_AWAY: f64 = 5.0;
/// A parameter further from nominal than this many expected deviations, in spite of the prior, belongs to another robot.
const FAR_AWAY: f64 = 10.0;
/// Residuals up to this many times the expected effect of the fixed constants are attributed to them.
const FIXED_CONSTANTS: f64 = 6.0;
/// Residuals that exceed the stated sigma by this factor get a warning.
const SIGMA_EXCESS: f64 = 1.5;
/// Residuals up to this many times the stated sigma always fit.
const FAR_BEYOND_SIGMA: f64 = 10.0;
/// An identification that leaves more than this part of the nominal arm's error explains hardly anything.
const HARDLY_BETTER: f64 = 0.7;
/// Residuals up to this part of what the expected deviations cause are small, however good the nominal arm is.
const SMALL_PART: f64 = 0.05;
/// A larger share of rejected samples means that there is no consistent majority to trust.
const MANY_REJECTED: f64 = 0.2;

/// Knowledge about a problem besides its data.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Context {
    /// What is identified.
    pub(crate) level: Level,
    /// Root mean square residual (m) that the expected deviations of all link constants explain; only known for points.
    pub(crate) expected: Option<f64>,
    /// Root mean square error of the nominal arm at the accepted samples (m).
    pub(crate) nominal: Option<f64>,
    /// Whether the error over the workspace can be predicted.
    pub(crate) is_workspace_known: bool,
}

impl Context {
    /// Whether a `residual` per coordinate (m) is far more than the stated sigma, and either more than the expected deviations cause
    /// altogether, or no small part of it and hardly less than the nominal arm's error.
    fn does_not_fit(&self, residual: f64, found: &Identification) -> bool {
        let nominal = self.nominal.map_or(f64::INFINITY, per_coordinate);
        let all = self.expected.map_or(f64::INFINITY, per_coordinate);
        self.is_large(residual, found) && (residual > all || residual > HARDLY_BETTER * nominal)
    }

    /// Whether a `residual` per coordinate (m) is far more than the stated sigma, and no small part of what the expected deviations
    /// cause.
    fn is_large(&self, residual: f64, found: &Identification) -> bool {
        let small = self.expected.map_or(MILLIMETRE, |expected| SMALL_PART * per_coordinate(expected));
        residual > small && residual > FAR_BEYOND_SIGMA * found.sigma.instrument.unwrap_or(0.0)
    }
}

fn per_coordinate(rms: f64) -> f64 {
    rms / 3.0_f64.sqrt()
}

/// Warnings about the result itself.
pub(crate) fn result_warnings(
    problem: &Problem<'_>,
    found: &Identification,
    settings: &Settings,
    context: Context,
) -> Vec<Warning> {
    let joints = problem.arm.chain.joints();
    let mut warnings: Vec<Warning> = weaknesses(problem, found)
        .iter()
        .map(|weakness| {
            let text = weakness.describe(|joint| joints[joint].name.clone(), |joint| joints[joint].joint_type);
            // What an unclear rank leaves open costs so many millimetres, which are judged, where the workspace is known.
            let is_judged = context.is_workspace_known && matches!(weakness, Weakness::RankUnclear { .. });
            Warning::new(WarningCode::PoorData, text, !is_judged)
        })
        .collect();
    let residual = found.sigma.from_residuals.unwrap_or(0.0);
    let explained = context.expected.map_or(0.0, |expected| FIXED_CONSTANTS * per_coordinate(expected));
    if context.level == Level::Offsets && context.is_large(residual, found) && residual <= explained {
        let message = format!(
            "joint offsets alone leave {} mm per coordinate, as much as the other link constants are expected to cause",
            number(to_mm(residual), 3)
        );
        warnings.push(Warning::new(WarningCode::OffsetsOnly, message, false).with_advice(Advice::IdentifyGeometry));
    } else if residual.is_nan() || context.does_not_fit(residual, found) {
        let nominal = context.nominal.map_or_else(String::new, |nominal| {
            format!(", the nominal one by {} mm", number(to_mm(per_coordinate(nominal)), 3))
        });
        let stated = found
            .sigma
            .instrument
            .map_or_else(String::new, |sigma| format!(" with a stated sigma of {} mm", number(to_mm(sigma), 4)));
        let message = format!(
            "the identified robot misses the measured points by {} mm per coordinate{nominal}{stated}: the data do not describe this robot (wrong profile, wrong joint signs, several mistakes at once?)",
            number(to_mm(residual), 3)
        );
        warnings.push(Warning::new(WarningCode::DoesNotFit, message, true));
    }
    warnings.extend(run_away(found, settings));
    warnings.extend(joint_doubts(problem, found).iter().map(|doubt| doubt_warning(joints, doubt)));
    if let Some(stated) = found.sigma.instrument.filter(|_| found.sigma.excess() > SIGMA_EXCESS) {
        let message = format!(
            "the residuals ({} mm per coordinate) are {} times the stated sigma ({} mm): something besides geometry and instrument moves the points (flexure, backlash, temperature, a moved SMR). The standard deviations below include it",
            number(to_mm(residual), 4),
            number(found.sigma.excess(), 1),
            number(to_mm(stated), if stated < 10.0 * MICROMETRE { 6 } else { 4 })
        );
        warnings.push(Warning::new(WarningCode::SigmaExcess, message, false));
    }
    let judged = problem.observations.places().count();
    let share = found.rejected.len() as f64 / judged.max(1) as f64;
    if share > MANY_REJECTED {
        let message = format!(
            "{} of {judged} samples were rejected: there is no consistent majority to trust; check for rows in the wrong order and for a moved instrument",
            found.rejected.len()
        );
        warnings.push(Warning::new(WarningCode::ManyRejected, message, true));
    }
    warnings.extend(found.unmodelled.iter().map(|unmodelled| unmodelled_warning(joints, unmodelled)));
    match found.termination {
        TerminationReason::Converged => {}
        TerminationReason::IterationLimit => {
            let message = format!("stopped after {} solver steps without having converged", found.iterations.len());
            warnings.push(Warning::new(WarningCode::NotConverged, message, true));
        }
        TerminationReason::NoImprovement | TerminationReason::NonFinite => {
            warnings.push(Warning::new(
                WarningCode::NotConverged,
                "the solver could not improve the fit any further".to_owned(),
                true,
            ));
        }
    }
    warnings
}

/// A warning about a joint that the data contradict, or show nothing of. What is behind a joint that nothing has shown may be anywhere, so
/// only the zero that the SMR's place leaves open does not block acceptance: the place of the SMR is right with it.
fn doubt_warning(joints: &[Joint], doubt: &JointDoubt) -> Warning {
    match doubt {
        JointDoubt::Reversed { joint, given, reversed } => {
            let message = format!(
                "joint {} counts the other way: with its sign reversed the points fit to {} mm per coordinate instead of {} mm; check the sign of its column, or 'direction' in the profile",
                joints[*joint].name,
                number(to_mm(*reversed), 4),
                number(to_mm(*given), 4)
            );
            Warning::new(WarningCode::ReversedJoint, message, true)
        }
        JointDoubt::Unseen { joint, lever } => {
            let joint = &joints[*joint];
            let (why, beside) = match joint.joint_type {
                JointType::Revolute => {
                    (format!("the SMR is {} mm from its axis", number(to_mm(*lever), 3)), "beside that axis")
                }
                JointType::Prismatic => ("the SMR hardly moves with it".to_owned(), "where it moves with the joint"),
            };
            let message = format!(
                "joint {} was not tested: {why}, so all points would fit as well if its sign, its zero or its scale were wrong. The figures are those of an SMR there, and say nothing about a tool elsewhere. Mount the SMR {beside}, or measure with a second place of the SMR as well",
                joint.name
            );
            Warning::new(WarningCode::UntestedJoint, message, true)
        }
        JointDoubt::Zero { joint } => {
            let joint = &joints[*joint];
            let by = match joint.joint_type {
                JointType::Revolute => "90 deg",
                JointType::Prismatic => "100 mm",
            };
            let message = format!(
                "the zero of joint {} was not tested: with {by} added to it all points would fit as well, and the SMR would only be found elsewhere on the flange. Check the joint at its mark, or state where the SMR is ('position_mm' with 'uncertainty_mm')",
                joint.name
            );
            Warning::new(WarningCode::UntestedJoint, message, false)
        }
    }
}

/// A warning about samples that did not fit and were kept, because they are the arm.
fn unmodelled_warning(joints: &[Joint], unmodelled: &Unmodelled) -> Warning {
    let (which, region) = match unmodelled {
        Unmodelled::End { joint, at, above, poses: (inside, all), .. } => {
            let joint = &joints[*joint];
            let quantity = joint.joint_type.quantity();
            let end = if *above { "above" } else { "below" };
            let region = format!("{} {end} {} {}", joint.name, number(quantity.to_edge(*at), 0), quantity.unit());
            (format!("{inside} of the {} that do not fit have {region}", counted(*all, "pose")), region)
        }
        Unmodelled::Poses { poses, .. } => {
            (format!("no SMR fits at {}", counted(*poses, "pose")), "at these poses".to_owned())
        }
    };
    let message = format!(
        "{which}: that is the arm and no bumped SMR, so the samples are kept. The model does not describe the arm there ({region}): errors of joints may explain it, a load or a cable may pull there; or narrow the planning limits to where the arm works"
    );
    Warning::new(WarningCode::RegionNotDescribed, message, false)
}

/// A warning about parameters further from nominal than on any robot of this make.
fn run_away(found: &Identification, settings: &Settings) -> Option<Warning> {
    let listed: Vec<String> = found
        .estimates
        .iter()
        .filter(|estimate| !estimate.id.is_joint_error())
        .filter(|estimate| estimate.deviation.abs() > RAN_AWAY * estimate.expected)
        .map(|estimate| {
            let unit = estimate.id.unit();
            format!(
                "{} by {}{} {} ({} times the expected deviation)",
                estimate.id,
                if estimate.deviation > 0.0 { "+" } else { "" },
                number(unit.to_edge(estimate.deviation), 3),
                unit,
                number(estimate.deviation.abs() / estimate.expected, 0)
            )
        })
        .collect();
    if listed.is_empty() {
        return None;
    }
    let list = listed.join(", ");
    let of_geometry = found.estimates.iter().filter(|estimate| !estimate.id.is_joint_error());
    let far = of_geometry.into_iter().any(|estimate| estimate.deviation.abs() > FAR_AWAY * estimate.expected);
    Some(match settings.prior {
        Prior::None => Warning::new(
            WarningCode::RanAway,
            format!(
                "parameters ran away: {list}. Without a prior, badly determined combinations take any value that lowers the residual; the robot may be worse than nominal in another part of its workspace, and a hold-out from the same series does not show it"
            ),
            true,
        )
        .with_advice(Advice::UsePrior),
        Prior::Expected => Warning::new(
            WarningCode::LargeDeviation,
            format!(
                "far from nominal: {list}. Check the profile (is it this robot?), or state larger expected deviations"
            ),
            far,
        ),
    })
}

/// Whether `found` is unusable, because the solver found no solution. A step limit that the operator asked for does not make it so, and
/// neither do data that do not describe the robot: those block the acceptance.
pub(crate) fn is_unusable(warnings: &[Warning], found: &Identification, settings: &Settings) -> bool {
    let as_asked =
        found.termination == TerminationReason::IterationLimit && settings.iterations < Settings::default().iterations;
    !as_asked && warnings.iter().any(|warning| warning.code == WarningCode::NotConverged)
}
