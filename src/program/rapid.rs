//! ABB RAPID (`.mod`): joint targets with `MoveAbsJ`, `fine` points.
//!
//! RAPID has no speed in percent for a single move. Full speed is taken as 2500 mm/s and 500 deg/s at the tool, the usual limit
//! of `vmax` and the value in the predefined speeds, so that 10 % is 250 mm/s.

mod instruction;
mod reader;
mod statement;

use super::names::{MAX_NAME, identifier};
use super::remark::Remark;
use super::{AS_ON_PENDANT, COMMENT_WIDTH, CRLF, Digits, Job, Language, ProgramError, ProgramFile};
use crate::text::decimal;

pub(super) const LANGUAGE: Language = Language {
    title: "RAPID",
    advice: Some("To start: program pointer to this routine. It has its own name, not 'main'."),
    convention: AS_ON_PENDANT,
    write,
    read: reader::read,
    digits: Digits { joint: 5, length: 4, turn: 8, are_fixed: false },
    remark: Remark::new("  ! ", &["MODULE"]),
};

/// Decimals: RAPID's numbers have 23 bits.
const DECIMALS: usize = 5;

fn write(job: &mut Job<'_>) -> Result<Vec<ProgramFile>, ProgramError> {
    job.require_joints(6..=6, false)?;
    let name = identifier(&job.options.name, MAX_NAME);
    let mut lines = vec![format!("MODULE {name}")];
    lines.extend(job.header(COMMENT_WIDTH).iter().map(|line| format!("  ! {line}")));
    let speed = job.options.speed;
    let (tool, turn) = (decimal(2500.0 * speed, 0), decimal(500.0 * speed, 0));
    lines.push(format!("  LOCAL CONST speeddata vMeasure:=[{tool},{turn},{tool},{turn}];"));
    lines.push("  LOCAL VAR num nAnswer;".to_owned());
    lines.push(format!("  PROC {name}_main()"));
    for pose in job.poses {
        let label = Job::label(pose);
        let joints = job.edge_values(pose, DECIMALS).join(",");
        lines.push(format!("    ! {label}"));
        lines.push(format!("    MoveAbsJ [[{joints}],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,vMeasure,fine,tool0;"));
        if pose.kind.is_measured() {
            lines.push("    WaitRob \\ZeroSpeed;".to_owned());
            lines.push(match job.dwell() {
                Some(dwell) => format!("    WaitTime {dwell};"),
                None => format!(
                    "    TPReadFK nAnswer,\"{label}: measure, then OK\",stEmpty,stEmpty,stEmpty,stEmpty,\"OK\";"
                ),
            });
        }
    }
    lines.push("  ENDPROC".to_owned());
    lines.push("ENDMODULE".to_owned());
    Ok(vec![Job::file(&name, "mod", &lines, CRLF)])
}
