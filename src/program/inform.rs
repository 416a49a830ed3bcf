//! Yaskawa INFORM job (`.JBI`): positions in encoder pulses, `MOVJ` in percent.
//!
//! Without `PL`, the controller's settings may round off the corner of a `MOVJ`, so `PL=0` (exact) is written. Pulses are whole
//! numbers: see
//! [`Program::largest_rounding`](super::Program::largest_rounding).

mod reader;
mod shift;

use super::names::{ascii, identifier};
use super::remark::Remark;
use super::{CRLF, Digits, Job, Language, ProgramError, ProgramFile};
use crate::text::decimal;
use crate::units::{from_deg, to_deg};

pub(super) const LANGUAGE: Language = Language {
    title: "INFORM",
    advice: None,
    convention: ["Joint values are encoder pulses; see the plan for degrees."; 2],
    write,
    read: reader::read,
    digits: Digits { joint: 4, length: 3, turn: 4, are_fixed: true },
    remark: Remark { longest: REMARK, may_be_first: false, ..Remark::new("'", &["NOP"]) },
};

/// Longest job name on old controllers (characters).
const LONGEST_NAME: usize = 8;

/// Longest comment line (characters).
const REMARK: usize = 32;

fn write(job: &mut Job<'_>) -> Result<Vec<ProgramFile>, ProgramError> {
    job.require_joints(1..=8, false)?;
    let sizes = pulses_per_degree(job)?;
    let name = identifier(&job.options.name, LONGEST_NAME).to_uppercase();
    let count = job.poses.len();
    let mut lines = vec![
        "/JOB".to_owned(),
        format!("//NAME {name}"),
        "//POS".to_owned(),
        format!("///NPOS {count},0,0,0,0,0"),
        "///TOOL 0".to_owned(),
        "///POSTYPE PULSE".to_owned(),
        "///PULSE".to_owned(),
    ];
    for (number, pose) in job.poses.iter().enumerate() {
        let pulses = pulses(job, pose, &sizes)?;
        lines.push(format!("C{number:05}={}", pulses.join(",")));
    }
    lines.push("//INST".to_owned());
    lines.push(job.options.created.strftime("///DATE %Y/%m/%d %H:%M").to_string());
    lines.extend(["///ATTR SC,RW", "///GROUP1 RB1", "NOP"].map(str::to_owned));
    lines.extend(job.header(REMARK).iter().map(|line| format!("'{line}")));
    for (number, pose) in job.poses.iter().enumerate() {
        let label: String = Job::label(pose).chars().take(REMARK).collect();
        lines.push(format!("'{label}"));
        lines.push(format!("MOVJ C{number:05} VJ={}.00 PL=0", job.percent()));
        if pose.kind.is_measured() {
            match job.dwell() {
                Some(dwell) => lines.push(format!("TIMER T={dwell}")),
                None => lines.extend(["'measure, then start".to_owned(), "PAUSE".to_owned()]),
            }
        }
    }
    lines.push("END".to_owned());
    Ok(vec![Job::file(&name, "JBI", &lines, CRLF)])
}

fn pulses_per_degree(job: &Job<'_>) -> Result<Vec<f64>, ProgramError> {
    let joints = job.robot.chain.joints();
    if let Some(joint) = joints.iter().find(|joint| joint.coupling.iter().any(|c| *c != 0.0)) {
        return Err(ProgramError::CoupledPulses { joint: ascii(&joint.name) });
    }
    let given = |index: usize| {
        let pulses = job.robot.pulses_per_degree.get(index).copied().flatten();
        pulses.filter(|pulses| pulses.is_finite() && *pulses != 0.0)
    };
    let sizes: Vec<f64> = (0..joints.len()).filter_map(given).collect();
    if sizes.len() == joints.len() {
        return Ok(sizes);
    }
    let missing = joints.iter().enumerate().filter(|(index, _)| given(*index).is_none());
    Err(ProgramError::PulsesPerDegree { joints: missing.map(|(_, joint)| ascii(&joint.name)).collect() })
}

fn pulses(
    job: &mut Job<'_>,
    pose: &crate::session::plan::PlannedPose,
    sizes: &[f64],
) -> Result<Vec<String>, ProgramError> {
    let mut written = Vec::new();
    let joints = job.robot.chain.joints();
    for ((joint, &q), &size) in joints.iter().zip(&pose.configuration).zip(sizes) {
        let pulses = (to_deg(q) * size).round() + 0.0;
        if pulses.abs() > f64::from(i32::MAX) {
            return Err(ProgramError::TooManyPulses { joint: ascii(&joint.name), pose: ascii(&pose.pose), pulses });
        }
        job.note_rounding(from_deg(pulses / size), q);
        written.push(decimal(pulses, 0));
    }
    Ok(written)
}
