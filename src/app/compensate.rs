//! `trupose compensate`: joint values to command so that the real arm reaches its targets.

mod picture;
mod program;
mod stream;
mod targets;

use std::io::Write;
use std::path::Path;

use super::{Console, export, payload_of};
use crate::cli::compensate::CompensateArgs;
use crate::correction::{self, Corrector};
use crate::error::{ExitStatus, Failure};
use crate::model::CalibratedArm;
use crate::text::printable;
use crate::units::from_mm;

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
    let [nominal, identified] = correction::tool_arms(&arm, target(&arm, args.target.as_deref())?);
    let largest_uncertainty = from_mm(args.largest_uncertainty_mm);
    let job = Corrector::new(&calibration, &arm, [&nominal, &identified], largest_uncertainty, args.position_only);
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

/// The target of the profile with this name.
fn target(arm: &CalibratedArm, name: Option<&str>) -> Result<Option<usize>, Failure> {
    let Some(name) = name else { return Ok(None) };
    let targets = arm.profile.targets();
    let index = targets.iter().position(|target| target.name == name).ok_or_else(|| {
        let names: Vec<&str> = targets.iter().map(|target| target.name.as_str()).collect();
        Failure::new(ExitStatus::Usage, format!("the profile has no target '{}'", printable(name)))
            .hint(format!("targets: {}", names.join(", ")))
    })?;
    Ok(Some(index))
}
