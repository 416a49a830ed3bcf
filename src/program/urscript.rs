//! Universal Robots script: `movej` in radians, each one to a stop (no blend radius).
//!
//! The file defines one function without calling it. Sent to a controller directly it runs; in a Script node it must be called.

mod polyscope;
mod reader;

use super::names::{MAX_NAME, identifier};
use super::remark::Remark;
use super::{COMMENT_WIDTH, Digits, Job, LF, Language, ProgramError, ProgramFile};
use crate::text::decimal;
use crate::units::DEGREE;

pub(super) const LANGUAGE: Language = Language {
    title: "URScript",
    advice: Some("In PolyScope: load it in a Script node, then call the function."),
    convention: ["Joint values as on the pendant, but in radians."; 2],
    write,
    read: reader::read,
    digits: Digits { joint: 8, length: 8, turn: 8, are_fixed: false },
    // A program tree of PolyScope has no remarks.
    remark: Remark { never_in: b"<", ..Remark::new("# ", &[]) },
};

const DECIMALS: usize = 8;

/// Speed of the slowest joint of the family (rad/s), for a profile that states none.
const FULL_SPEED: f64 = 120.0 * DEGREE;

/// Acceleration (rad/s²): a third of the pendant's default.
const ACCELERATION: f64 = 0.5;

fn write(job: &mut Job<'_>) -> Result<Vec<ProgramFile>, ProgramError> {
    job.require_joints(6..=6, false)?;
    let name = identifier(&job.options.name, MAX_NAME).to_lowercase();
    let slowest = job.robot.max_speeds.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    let full = if slowest.is_finite() && slowest > 0.0 { slowest } else { FULL_SPEED };
    let (a, v) = (decimal(ACCELERATION, 2), decimal(full * job.options.speed, 4));
    let mut lines = vec![format!("def {name}():")];
    lines.extend(job.header(COMMENT_WIDTH).iter().map(|line| format!("  # {line}")));
    for pose in job.poses {
        let label = Job::label(pose);
        let joints = job.si_values(&pose.configuration, DECIMALS).join(",");
        lines.push(format!("  # {label}"));
        lines.push(format!("  movej([{joints}],a={a},v={v})"));
        if pose.kind.is_measured() {
            lines.push(match job.dwell() {
                Some(dwell) => format!("  sleep({dwell})"),
                None => format!("  popup(\"{label}: measure, then continue\",title=\"trupose\",blocking=True)"),
            });
        }
    }
    lines.push("end".to_owned());
    Ok(vec![Job::file(&name, "script", &lines, LF)])
}
