//! FANUC TP program as ASCII (`.LS`): joint positions, `J` moves in percent, `FINE`.
//!
//! J3 is the pendant's, coupled to J2. Loading ASCII needs the option for it, or the manufacturer's conversion tool. Names have
//! at most eight characters for old controllers, remarks at most 32. `UF` and `UT` are required by the format but have no effect
//! on joint positions.

mod reader;

use super::names::{ascii, identifier};
use super::remark::Remark;
use super::{AS_ON_PENDANT, CRLF, Digits, Job, Language, ProgramError, ProgramFile};
use crate::kinematics::JointType;

pub(super) const LANGUAGE: Language = Language {
    title: "FANUC TP",
    advice: None,
    convention: [
        AS_ON_PENDANT[0],
        "Joint values as on the pendant, in degrees: J3 is the slope of the forearm, coupled to J2.",
    ],
    write,
    read: reader::read,
    digits: Digits { joint: 3, length: 3, turn: 3, are_fixed: true },
    remark: Remark { after: " ;", longest: 32, may_be_first: false, ..Remark::new("    :  !", &["/MN"]) },
};

/// Decimals of a TP position.
const DECIMALS: usize = 3;

/// Longest remark (characters).
const REMARK: usize = 32;

fn write(job: &mut Job<'_>) -> Result<Vec<ProgramFile>, ProgramError> {
    job.require_joints(4..=6, true)?;
    let name = identifier(&job.options.name, 8).to_uppercase();
    let mut body: Vec<String> = job.header(REMARK).iter().map(|line| format!("!{line}")).collect();
    let mut positions = Vec::new();
    for (number, pose) in (1..).zip(job.poses) {
        let label: String = Job::label(pose).chars().take(REMARK).collect();
        body.push(format!("!{label}"));
        body.push(format!("J P[{number}] {}% FINE", job.percent()));
        if pose.kind.is_measured() {
            match job.dwell() {
                Some(dwell) => body.push(format!("  WAIT {dwell:>6}(sec)")),
                None => body.extend(["!measure, then cycle start".to_owned(), "  PAUSE".to_owned()]),
            }
        }
        positions.extend(position(job, number, pose));
    }
    let mut lines = attributes(&name, job, body.len());
    lines.push("/MN".to_owned());
    lines.extend((1..).zip(&body).map(|(number, text)| format!("{number:>4}:{text} ;")));
    lines.push("/POS".to_owned());
    lines.extend(positions);
    lines.push("/END".to_owned());
    Ok(vec![Job::file(&name, "LS", &lines, CRLF)])
}

fn attributes(name: &str, job: &Job<'_>, line_count: usize) -> Vec<String> {
    let date = job.options.created.strftime("DATE %y-%m-%d  TIME %H:%M:%S");
    let comment: String = ascii(job.robot.profile).chars().take(16).collect();
    [
        format!("/PROG  {name}"),
        "/ATTR".to_owned(),
        "OWNER\t\t= MNEDITOR;".to_owned(),
        format!("COMMENT\t\t= \"{comment}\";"),
        "PROG_SIZE\t= 0;".to_owned(),
        format!("CREATE\t\t= {date};"),
        format!("MODIFIED\t= {date};"),
        "FILE_NAME\t= ;".to_owned(),
        "VERSION\t\t= 0;".to_owned(),
        format!("LINE_COUNT\t= {line_count};"),
        "MEMORY_SIZE\t= 0;".to_owned(),
        "PROTECT\t\t= READ_WRITE;".to_owned(),
        "TCD:  STACK_SIZE\t= 0,".to_owned(),
        "      TASK_PRIORITY\t= 50,".to_owned(),
        "      TIME_SLICE\t= 0,".to_owned(),
        "      BUSY_LAMP_OFF\t= 0,".to_owned(),
        "      ABORT_REQUEST\t= 0,".to_owned(),
        "      PAUSE_REQUEST\t= 0;".to_owned(),
        "DEFAULT_GROUP\t= 1,*,*,*,*;".to_owned(),
        "CONTROL_CODE\t= 00000000 00000000;".to_owned(),
    ]
    .to_vec()
}

fn position(job: &mut Job<'_>, number: usize, pose: &crate::session::plan::PlannedPose) -> Vec<String> {
    let values = job.edge_values(pose, DECIMALS);
    let joints = job.robot.chain.joints().iter().zip(&values).zip(1..);
    let written: Vec<String> = joints
        .map(|((joint, value), axis)| {
            let unit = match joint.joint_type {
                JointType::Revolute => "deg",
                JointType::Prismatic => " mm",
            };
            format!("J{axis}= {value:>9} {unit}")
        })
        .collect();
    let mut lines = vec![format!("P[{number}]{{"), "   GP1:".to_owned(), "\tUF : 0, UT : 1,".to_owned()];
    let rows: Vec<String> = written.chunks(3).map(|row| format!("\t{}", row.join(",\t"))).collect();
    lines.extend(rows.join(",\n").split('\n').map(str::to_owned));
    lines.push("};".to_owned());
    lines
}
