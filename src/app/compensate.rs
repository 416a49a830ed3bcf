//! `trupose compensate`: joint values to command so that the real arm reaches its targets.

mod program;

use std::io::Write;
use std::path::Path;

use nalgebra::{Isometry3, Point3, Translation3};

use super::{Console, export, payload_of};
use crate::cli::compensate::CompensateArgs;
use crate::compensation::{Compensated, Compensator, Goal, Settings, Status, ToolArm};
use crate::error::{ExitStatus, Failure};
use crate::kinematics::{Arm, Joint};
use crate::model::{CalibratedArm, from_roll_pitch_yaw};
use crate::procedure::joint_types;
use crate::session::targets::{TargetGoal, quoted, read};
use crate::store;
use crate::text::{decimal, printable};
use crate::units::{to_deg, to_mm};

/// Targets that a message lists one by one.
const SHOWN: usize = 20;

pub(super) fn run<O: Write, E: Write>(
    args: &CompensateArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    if let (Some(out), Some(source)) = (&args.out, args.targets.as_ref().or(args.program.as_ref()))
        && is_same_file(out, source)
    {
        let message = format!("'{}' is the file to compensate", out.display());
        return Err(Failure::new(ExitStatus::Usage, message)
            .hint("write to another file: corrected targets must not be corrected a second time"));
    }
    let mut arm = export::calibrated_arm(&args.calibration, console)?;
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
    match (&args.program, args.dialect, &args.targets) {
        (Some(path), Some(dialect), _) => program::run(args, &arm, path, dialect, console),
        (_, _, Some(path)) => table(args, &arm, path, console),
        _ => Err(Failure::new(ExitStatus::Usage, "nothing to compensate").hint("give '--targets' or '--program'")),
    }
}

/// Whether two paths lead to one file that exists.
fn is_same_file(one: &Path, other: &Path) -> bool {
    matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
}

/// A table of targets becomes a table of commands.
fn table<O: Write, E: Write>(
    args: &CompensateArgs,
    arm: &CalibratedArm,
    path: &Path,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let bytes = store::read(path).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    let rows = read(&bytes, &path.display().to_string(), &joint_types(&arm.profile))
        .map_err(|errors| Failure::new(ExitStatus::Usage, errors.to_string()))?;
    let (nominal, identified) = tool_arms(arm, args.target.as_deref())?;
    let limits: Vec<_> = arm.profile.joints().iter().map(|range| range.limits).collect();
    let settings = Settings { position_only: args.position_only, ..Settings::default() };
    let compensator = Compensator::new(&nominal, &identified, &limits, settings);
    let joints = arm.identified.chain.joints();
    let mut lines = vec![header(joints)];
    let mut failed = 0;
    let mut orientation_left = 0;
    for row in &rows {
        let done = compensator.solve(&goal(&row.goal));
        failed += usize::from(!done.status.is_usable());
        orientation_left += usize::from(done.status == Status::PositionOnly);
        if done.status != Status::Reached && failed + orientation_left <= SHOWN {
            console.remark(&format!("pose {} (line {}): {}", row.pose, row.line, reason(&done, joints)));
        }
        lines.push(line(&row.pose, &done, joints));
    }
    if failed + orientation_left > SHOWN {
        let more = failed + orientation_left - SHOWN;
        console.remark(&format!("and {more} more; the column 'status' has all of them"));
    }
    let text = lines.join("\n") + "\n";
    match &args.out {
        Some(path) => {
            store::replace(path, &text).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
            console.print(&format!("written: {}\n", path.display()))?;
        }
        None => console.print(&text)?,
    }
    let position_only =
        if orientation_left > 0 { format!(", {orientation_left} of them in position only") } else { String::new() };
    console.remark(&format!("{} of {} targets reached{position_only}", rows.len() - failed, rows.len()));
    Ok(if failed == 0 { ExitStatus::Accepted } else { ExitStatus::NotAccepted })
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

fn goal(goal: &TargetGoal) -> Goal {
    match goal {
        TargetGoal::Configuration(q) => Goal::Configuration(q.clone()),
        TargetGoal::Cartesian { position, roll_pitch_yaw: Some(angles), near } => {
            Goal::Pose { base_from_tool: from_roll_pitch_yaw(*position, *angles), near: near.clone() }
        }
        TargetGoal::Cartesian { position, roll_pitch_yaw: None, near } => {
            Goal::Position { point_in_base: Point3::from(*position), near: near.clone() }
        }
    }
}

/// `pose,status,q1_deg,…,left_mm,left_deg`: the last two are what the calculation leaves, not errors of the arm.
fn header(joints: &[Joint]) -> String {
    let names = joints.iter().enumerate();
    let names = names.map(|(index, joint)| format!("q{}_{}", index + 1, joint.joint_type.quantity().unit()));
    format!("pose,status,{},left_mm,left_deg", names.collect::<Vec<_>>().join(","))
}

/// Joint values to command; none for a target that is not reached.
fn line(pose: &str, done: &Compensated, joints: &[Joint]) -> String {
    let usable = done.status.is_usable();
    let value = |(joint, q): (&Joint, &f64)| {
        if usable { decimal(joint.joint_type.quantity().to_edge(*q), 6) } else { String::new() }
    };
    let error = |value: f64| if value.is_finite() { decimal(value, 6) } else { String::new() };
    let mut cells = vec![quoted(pose), done.status.name().to_owned()];
    cells.extend(joints.iter().zip(&done.command).map(value));
    cells.extend([error(to_mm(done.position_error)), error(to_deg(done.angle_error))]);
    cells.join(",")
}

fn reason(done: &Compensated, joints: &[Joint]) -> String {
    let names = |held: &[usize]| {
        let names = held.iter().filter_map(|index| joints.get(*index)).map(|joint| joint.name.as_str());
        names.collect::<Vec<_>>().join(", ")
    };
    let left = format!("{:.3} mm and {:.4} deg are left", to_mm(done.position_error), to_deg(done.angle_error));
    match &done.status {
        Status::Reached => "reached".to_owned(),
        Status::PositionOnly => {
            format!(
                "near a singularity only the position is reached; the orientation is off by {:.4} deg",
                to_deg(done.angle_error)
            )
        }
        Status::AtLimit(held) => format!("not reached: {} would have to pass its limit; {left}", names(held)),
        Status::Singular => format!("not reached: near a singularity the corrections become too large; {left}"),
        Status::OutOfReach => "not reached: it is out of reach of this arm".to_owned(),
        Status::BeyondLimit(held) => format!("not reached: {} has a target beyond its limit", names(held)),
        Status::NotInConfiguration => {
            "not reached: the arm does not reach it in the configuration that is stated".to_owned()
        }
        Status::Ambiguous => "its configuration is not stated, and several reach it".to_owned(),
        Status::OtherConfiguration => "the corrected target would be in another configuration".to_owned(),
    }
}
