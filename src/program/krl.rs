//! KUKA KRL (`.src`): axis positions with `PTP`, without approximation (no `C_PTP`), so every point is an exact stop.
//!
//! `WAIT SEC` and `HALT` stop the advance run. Cells with external axes must add `E1` to `E6`: an axis that is missing in the
//! aggregate keeps its position. Arms with seven axes have another controller, which is programmed in Java.

mod aggregate;
mod reader;

use super::names::{MAX_NAME, identifier};
use super::remark::Remark;
use super::{AS_ON_PENDANT, COMMENT_WIDTH, CRLF, Digits, Job, Language, ProgramError, ProgramFile};

pub(super) const LANGUAGE: Language = Language {
    title: "KRL",
    advice: Some("With external axes: add E1 to E6 to every PTP."),
    convention: AS_ON_PENDANT,
    write,
    read: reader::read,
    digits: Digits { joint: 5, length: 4, turn: 5, are_fixed: false },
    remark: Remark::new("; ", &["DEF", "DEFFCT", "DEFDAT"]),
};

const DECIMALS: usize = 5;

fn write(job: &mut Job<'_>) -> Result<Vec<ProgramFile>, ProgramError> {
    job.require_joints(6..=6, false)?;
    let name = identifier(&job.options.name, MAX_NAME);
    let mut lines = vec![format!("DEF {name}()")];
    lines.extend(job.header(COMMENT_WIDTH).iter().map(|line| format!("  ; {line}")));
    lines.push("  BAS(#INITMOV,0)".to_owned());
    lines.push(format!("  BAS(#VEL_PTP,{})", job.percent()));
    lines.push("  BAS(#ACC_PTP,20)".to_owned());
    for pose in job.poses {
        let label = Job::label(pose);
        let values = job.edge_values(pose, DECIMALS);
        let axes: Vec<String> = values.iter().zip(1..).map(|(value, axis)| format!("A{axis} {value}")).collect();
        lines.push(format!("  ; {label}"));
        lines.push(format!("  PTP {{{}}}", axes.join(",")));
        if pose.kind.is_measured() {
            match job.dwell() {
                Some(dwell) => lines.push(format!("  WAIT SEC {dwell}")),
                None => lines.extend(["  ; measure, then press start".to_owned(), "  HALT".to_owned()]),
            }
        }
    }
    lines.push("END".to_owned());
    Ok(vec![Job::file(&name, "src", &lines, CRLF)])
}
