//! `trupose compensate`: joint values to command so that the real arm reaches its targets.

mod between;
mod correct;
mod picture;
mod program;
mod report;
mod settings;
mod stream;
mod targets;
mod uncertainty;

use std::io::Write;
use std::path::Path;

use nalgebra::{Isometry3, Translation3};

use super::{Console, export, payload_of};
use crate::cli::compensate::CompensateArgs;
use crate::compensation::{Compensated, Compensator, Settings, Status, ToolArm};
use crate::error::{ExitStatus, Failure};
use crate::kinematics::{Arm, Joint};
use crate::model::CalibratedArm;
use crate::text::{listed, printable};
use crate::units::{from_mm, to_deg, to_mm};
use uncertainty::Uncertainty;

/// Targets that a message lists one by one.
const SHOWN: usize = 20;

pub(super) fn run<O: Write, E: Write>(
    args: &CompensateArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let mut sources = args.targets.iter().chain(&args.program);
    if let Some(out) = &args.out
        && sources.any(|source| is_same_file(out, source))
    {
        let message = format!("'{}' is the file to compensate", out.display());
        return Err(Failure::new(ExitStatus::Usage, message)
            .hint("write to another file: corrected targets must not be corrected a second time"));
    }
    let (calibration, mut arm) = export::calibration(&args.calibration, args.edited, console)?;
    if let Some(payload) = payload_of(&args.payload, &arm.profile)? {
        arm.identified = arm.identified.with_payload(payload.mass());
        if !arm.identified.chain.is_loaded() {
            console.remark("note: this calibration has no compliance: another payload changes nothing");
        }
    }
    if !args.position_only && args.target.is_none() && !arm.untold.is_empty() {
        let names: Vec<&str> = arm.profile.targets().iter().map(|target| target.name.as_str()).collect();
        console.remark(&format!(
            "note: the measured points determine these constants only in combination with others (standard deviations): {}. Orientations, and \
             tool points away from the measured target, are as uncertain; '--target {}' compensates the measured point",
            arm.untold.join(", "),
            names.first().unwrap_or(&"NAME")
        ));
    }
    let (nominal, identified) = tool_arms(&arm, args.target.as_deref())?;
    let limits: Vec<_> = arm.profile.joints().iter().map(|range| range.limits).collect();
    let settings = Settings { position_only: args.position_only, ..Settings::default() };
    let job = Job {
        arm: &arm,
        compensator: Compensator::new(&nominal, &identified, &limits, settings),
        tools: [nominal.flange_from_tool, identified.flange_from_tool],
        uncertainty: Uncertainty::new(&calibration, &arm),
        largest_uncertainty: from_mm(args.largest_uncertainty_mm),
        position_only: args.position_only,
    };
    match (args.dialect, &args.targets) {
        (Some(dialect), _) if !args.program.is_empty() => program::run(args, &job, dialect, console),
        (_, Some(path)) => targets::run(args, &job, path, console),
        _ if args.stream => stream::run(&job, console),
        _ => Err(Failure::new(ExitStatus::Usage, "nothing to compensate")
            .hint("give '--targets', '--program' or '--stream'")),
    }
}

/// Whether two paths lead to one file that exists.
fn is_same_file(one: &Path, other: &Path) -> bool {
    matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
}

/// A calibrated arm, ready to compensate.
#[derive(Debug)]
struct Job<'a> {
    arm: &'a CalibratedArm,
    compensator: Compensator<'a>,
    /// The point to bring to the targets, in the flange of the nominal and of the identified arm.
    tools: [Isometry3<f64>; 2],
    /// None where the calibration has no samples that tell it.
    uncertainty: Option<Uncertainty>,
    /// Beyond it nothing is corrected (m).
    largest_uncertainty: f64,
    position_only: bool,
}

impl Job<'_> {
    fn joints(&self) -> &[Joint] {
        self.arm.identified.chain.joints()
    }

    /// The world of the controller, in which programs state their frames, in the base of the profile.
    const fn base_from_world(&self) -> &Isometry3<f64> {
        self.arm.profile.base_from_world()
    }

    /// The predicted error at a configuration (m).
    fn uncertainty(&self, q: &[f64], flange_from_tool: &Isometry3<f64>) -> Option<f64> {
        Some(self.uncertainty.as_ref()?.at(q, flange_from_tool))
    }

    /// The reason not to correct at a place that the calibration does not know well enough.
    fn too_uncertain(&self, uncertainty: Option<f64>) -> Option<String> {
        let uncertainty = uncertainty.filter(|uncertainty| *uncertainty > self.largest_uncertainty)?;
        Some(format!(
            "the arm is known there only within +-{:.2} mm (predicted), above the limit of {:.2} mm",
            to_mm(uncertainty),
            to_mm(self.largest_uncertainty)
        ))
    }
}

/// The nominal and the identified arm with the point to bring to the targets: the flange, or a target of the profile.
fn tool_arms(arm: &CalibratedArm, target: Option<&str>) -> Result<(ToolArm, ToolArm), Failure> {
    let index = match target {
        None => None,
        Some(name) => {
            let known = arm.profile.targets().iter().position(|target| target.name == name);
            Some(known.ok_or_else(|| {
                let names: Vec<&str> = arm.profile.targets().iter().map(|target| target.name.as_str()).collect();
                Failure::new(ExitStatus::Usage, format!("the profile has no target '{}'", printable(name)))
                    .hint(format!("targets: {}", names.join(", ")))
            })?)
        }
    };
    let with_tool = |arm: &Arm| {
        let point = index.and_then(|index| arm.targets.get(index));
        let flange_from_tool =
            point.map_or_else(Isometry3::identity, |point| Isometry3::from(Translation3::from(point.coords)));
        ToolArm { chain: arm.chain.clone(), flange_from_tool }
    };
    Ok((with_tool(&arm.profile.arm()), with_tool(&arm.identified)))
}

/// Why a target is not reached, or only in part.
fn reason(done: &Compensated, joints: &[Joint]) -> String {
    let left = format!("{:.3} mm and {:.4} deg are left", to_mm(done.position_error), to_deg(done.angle_error));
    match &done.status {
        Status::PositionOnly => {
            format!(
                "near a singularity only the position is reached; the orientation is off by {:.4} deg",
                to_deg(done.angle_error)
            )
        }
        Status::AtLimit(_) | Status::Singular => {
            format!("not reached: {}; {left}", status_reason(&done.status, joints))
        }
        Status::Reached
        | Status::OutOfReach
        | Status::BeyondLimit(_)
        | Status::NotInConfiguration
        | Status::Ambiguous
        | Status::OtherConfiguration => format!("not reached: {}", status_reason(&done.status, joints)),
    }
}

fn status_reason(status: &Status, joints: &[Joint]) -> String {
    let names = |held: &[usize]| {
        let names = held.iter().filter_map(|index| joints.get(*index)).map(|joint| joint.name.as_str());
        listed(&names.collect::<Vec<_>>())
    };
    let limits = |held: &[usize]| if held.len() == 1 { "its limit" } else { "their limits" };
    match status {
        Status::Reached => "it is reached".to_owned(),
        Status::PositionOnly => "near a singularity only the position is reached".to_owned(),
        Status::AtLimit(held) => format!("{} would have to pass {}", names(held), limits(held)),
        Status::Singular => "near a singularity the corrections become too large".to_owned(),
        Status::OutOfReach => "it is out of reach of this arm".to_owned(),
        Status::BeyondLimit(held) => {
            let have = if held.len() == 1 { "has a target" } else { "have targets" };
            format!("{} {have} beyond {}", names(held), limits(held))
        }
        Status::NotInConfiguration => "the arm does not reach it in the stated configuration".to_owned(),
        Status::Ambiguous => {
            "several configurations reach it, and what is stated does not tell which is meant".to_owned()
        }
        Status::OtherConfiguration => "the corrected target would be in another configuration".to_owned(),
    }
}
