//! `trupose compensate --program`: the joint targets of an existing robot program, corrected.

use std::io::Write;

use super::super::Console;
use super::{SHOWN, reason, tool_arms};
use crate::cli::compensate::CompensateArgs;
use crate::compensation::{Compensator, Goal, Settings, Status};
use crate::error::{ExitStatus, Failure};
use crate::model::CalibratedArm;
use crate::program::motion::{self, Command, ReadOptions};
use crate::program::{Dialect, ProgramError, Robot, rewrite};
use crate::store;

pub(super) fn run<O: Write, E: Write>(
    args: &CompensateArgs,
    arm: &CalibratedArm,
    path: &std::path::Path,
    dialect: Dialect,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let unusable = |error: ProgramError| Failure::new(ExitStatus::Usage, format!("'{}': {error}", path.display()));
    let text = store::read(path).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    let profile = &arm.profile;
    let max_speeds: Vec<Option<f64>> = profile.joints().iter().map(|joint| joint.max_speed).collect();
    let pulses: Vec<Option<f64>> = profile.joints().iter().map(|joint| joint.pulses_per_degree).collect();
    let robot = Robot {
        profile: profile.name(),
        chain: profile.chain(),
        max_speeds: &max_speeds,
        pulses_per_degree: &pulses,
        joint_aliases: profile.joint_aliases(),
    };
    let joint_names = (!args.joint_names.is_empty()).then(|| args.joint_names.clone());
    let options = ReadOptions { joint_names, ..ReadOptions::default() };
    let scan = rewrite::scan(dialect, &robot, &options, &text).map_err(unusable)?;
    let (nominal, identified) = tool_arms(arm, args.target.as_deref())?;
    let limits: Vec<_> = profile.joints().iter().map(|range| range.limits).collect();
    let settings = Settings { position_only: args.position_only, ..Settings::default() };
    let compensator = Compensator::new(&nominal, &identified, &limits, settings);
    let joints = arm.identified.chain.joints();
    let mut commands = Vec::with_capacity(scan.targets.len());
    let (mut replaced, mut position_only, mut unreached) = (0, 0, 0);
    let mut notes: Vec<(usize, String)> = Vec::new();
    let mut largest: Vec<f64> = vec![0.0; joints.len()];
    for target in &scan.targets {
        let motion::Goal::Joints(configuration) = &target.goal else {
            unreached += 1;
            notes.push((target.line, "left as it is: a Cartesian target".to_owned()));
            commands.push(None);
            continue;
        };
        let done = compensator.solve(&Goal::Configuration(configuration.clone()));
        if done.status != Status::Reached {
            let kept = if done.status.is_usable() { "" } else { "; left as it is" };
            notes.push((target.line, format!("{}{kept}", reason(&done, joints))));
        }
        if !done.status.is_usable() {
            unreached += 1;
            commands.push(None);
            continue;
        }
        replaced += 1;
        position_only += usize::from(done.status == Status::PositionOnly);
        for (largest, (command, meant)) in largest.iter_mut().zip(done.command.iter().zip(configuration)) {
            *largest = largest.max((command - meant).abs());
        }
        commands.push(Some(Command::Joints(done.command)));
    }
    let corrected = rewrite::rewrite(dialect, &robot, &text, &scan, &commands).map_err(unusable)?;
    match &args.out {
        Some(path) => {
            store::replace_bytes(path, &corrected).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
            console.print(&format!("written: {}\n", path.display()))?;
        }
        None => console.print_bytes(&corrected)?,
    }
    notes.extend(scan.left.iter().map(|left| (left.line, format!("left as it is: {}", left.reason))));
    notes.sort();
    for (line, note) in notes.iter().take(SHOWN) {
        console.remark(&format!("line {line}: {note}"));
    }
    if notes.len() > SHOWN {
        console.remark(&format!("and {} more lines", notes.len() - SHOWN));
    }
    let corrections = joints.iter().zip(&largest).map(|(joint, largest)| {
        let quantity = joint.joint_type.quantity();
        format!("{} {:.3} {}", joint.name, quantity.to_edge(*largest), quantity.unit())
    });
    let corrections: Vec<String> = corrections.collect();
    console.remark(&format!(
        "{replaced} of {} joint targets replaced ({position_only} in position only), {unreached} not reached, {} other places \
         left; largest corrections: {}",
        scan.targets.len(),
        scan.left.len(),
        corrections.join(", ")
    ));
    if scan.targets.is_empty() {
        console.remark("no joint target was found; is it this dialect?");
    }
    let is_complete = unreached == 0 && scan.left.is_empty() && !scan.targets.is_empty();
    Ok(if is_complete { ExitStatus::Accepted } else { ExitStatus::NotAccepted })
}
