//! `trupose program`: a plan in the language of a robot controller.

use std::io::Write;

use super::{Console, load};
use crate::cli::ProgramArgs;
use crate::error::{ExitStatus, Failure};
use crate::procedure::dangers::dangers;
use crate::procedure::joint_types;
use crate::program::{Options, Pause, Robot, write};
use crate::session::plan;
use crate::store;

pub(super) fn run<O: Write, E: Write>(args: &ProgramArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let loaded = load::profile(&args.profile)?;
    let profile = &loaded.profile;
    let bytes = store::read(&args.plan).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    let file = args.plan.display().to_string();
    let listed = plan::read(&bytes, &file, &joint_types(profile))
        .map_err(|errors| Failure::new(ExitStatus::Usage, errors.to_string()))?;
    for problem in &listed.warnings {
        console.remark(&format!("note: {problem}"));
    }
    for row in &listed.rows {
        for ((joint, range), value) in profile.chain().joints().iter().zip(profile.joints()).zip(&row.configuration) {
            if let Some((low, high)) = range.limits
                && !(low - 1e-9..=high + 1e-9).contains(value)
            {
                let quantity = joint.joint_type.quantity();
                return Err(Failure::new(
                    ExitStatus::Usage,
                    format!(
                        "pose {}: {} at {:.3} {unit} is outside its limits {:.3}..{:.3} {unit}",
                        row.pose,
                        joint.name,
                        quantity.to_edge(*value),
                        quantity.to_edge(low),
                        quantity.to_edge(high),
                        unit = quantity.unit()
                    ),
                )
                .hint("correct the plan: no program is written for a pose that the arm cannot reach"));
            }
        }
    }
    if profile.bodies().is_empty() {
        console.remark("WARNING: the profile has no bodies: collisions were not checked");
    }
    let mut found = dangers(profile, &listed.rows).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    if let Some(more) = found.last_mut().filter(|last| last.starts_with("and ")) {
        more.push_str("; see 'trupose plan --check'");
    }
    for danger in &found {
        console.remark(&format!("WARNING: {danger}"));
    }
    let max_speeds: Vec<Option<f64>> = profile.joints().iter().map(|joint| joint.max_speed).collect();
    let pulses: Vec<Option<f64>> = profile.joints().iter().map(|joint| joint.pulses_per_degree).collect();
    let robot = Robot {
        profile: profile.name(),
        chain: profile.chain(),
        max_speeds: &max_speeds,
        pulses_per_degree: &pulses,
        joint_aliases: profile.joint_aliases(),
    };
    let options = Options {
        name: args.name.clone(),
        pause: if args.acknowledge { Pause::Acknowledge } else { Pause::Dwell(args.dwell_s) },
        speed: args.speed_percent / 100.0,
        created: load::today(),
        dangers: found,
    };
    let program = write(args.dialect, &robot, &listed.rows, &options)
        .map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    if let Some(folder) = &args.out {
        let store_failure = |error: store::StoreError| Failure::from_error(ExitStatus::Store, &error);
        store::create_folder(folder).map_err(store_failure)?;
        for file in &program.files {
            let path = folder.join(&file.file_name);
            store::replace(&path, &file.text).map_err(store_failure)?;
            console.say_written(&path)?;
        }
    } else {
        let several = program.files.len() > 1;
        for file in &program.files {
            if several {
                console.remark(&format!("file {}:", file.file_name));
            }
            console.print(&file.text)?;
        }
    }
    Ok(if options.dangers.is_empty() { ExitStatus::Accepted } else { ExitStatus::NotAccepted })
}
