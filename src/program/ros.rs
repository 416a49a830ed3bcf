//! ROS 2: a `trajectory_msgs/msg/JointTrajectory` as YAML (radian, metre, second).
//!
//! Every point has zero velocities, so a controller interpolates with cubics whose peak is 1.5 times the mean speed; the times
//! allow for that. A dwell is written as the same point again, later. The trajectory starts at its first point: the arm must be
//! there, or a planner must move it there, before it is sent. `joint_names` are those of the profile; a URDF may use others.

mod reader;
mod yaml;

use super::names::{MAX_NAME, ascii, identifier};
use super::remark::Remark;
use super::{COMMENT_WIDTH, Digits, Job, LF, Language, Pause, ProgramError, ProgramFile};
use crate::text::decimal;

pub(super) const LANGUAGE: Language = Language {
    title: "ROS",
    advice: Some("The arm must be at the first point before this is sent. Enter the joint names of the URDF here."),
    convention: [
        "Joint values as on the pendant, but in radians.",
        "Joint values are those of a URDF, each link against the one before: coupled joints are NOT as on the \
         pendant. Radians.",
    ],
    write,
    read: reader::read,
    digits: Digits { joint: 8, length: 8, turn: 8, are_fixed: false },
    remark: Remark { never_in: b"{[", ..Remark::new("# ", &[]) },
};

const DECIMALS: usize = 8;

/// Ratio of the peak to the mean speed of a cubic between two stops.
const CUBIC_PEAK: f64 = 1.5;

/// Shortest time of a move (s).
const LEAST_TIME: f64 = 2.0;

fn write(job: &mut Job<'_>) -> Result<Vec<ProgramFile>, ProgramError> {
    let Pause::Dwell(dwell) = job.options.pause else { return Err(ProgramError::NoOperator) };
    let speeds = speeds(job)?;
    let name = identifier(&job.options.name, MAX_NAME).to_lowercase();
    let joints: Vec<String> =
        job.robot.chain.joints().iter().map(|joint| format!("\"{}\"", ascii(&joint.name))).collect();
    let mut lines: Vec<String> = job.header(COMMENT_WIDTH).iter().map(|line| format!("# {line}")).collect();
    lines.push(format!("joint_names: [{}]", joints.join(", ")));
    lines.push("points:".to_owned());
    let zeros = vec!["0.0"; joints.len()].join(", ");
    let mut time = 0.0;
    let mut before: Option<Vec<f64>> = None;
    for pose in job.poses {
        let q = urdf_values(job, &pose.configuration);
        let slowest = before.iter().flatten().zip(&q).zip(&speeds);
        let moving = slowest.map(|((from, to), speed)| CUBIC_PEAK * (to - from).abs() / (speed * job.options.speed));
        // The position before the first point is unknown: allow for half a turn of every joint at the requested speed.
        let first = speeds.iter().map(|speed| CUBIC_PEAK * std::f64::consts::PI / (speed * job.options.speed));
        let first = if before.is_none() { first.fold(LEAST_TIME, f64::max) } else { LEAST_TIME };
        time += moving.fold(first, f64::max);
        let positions = job.si_values(&q, DECIMALS).join(", ");
        let mut point = |time: f64| {
            lines.push(format!("  - positions: [{positions}]"));
            lines.push(format!("    velocities: [{zeros}]"));
            lines.push(format!("    time_from_start: {}", duration(time)));
        };
        point(time);
        if pose.kind.is_measured() {
            time += dwell;
            point(time);
        }
        let label = Job::label(pose);
        let index = lines.len() - if pose.kind.is_measured() { 6 } else { 3 };
        lines.insert(index, format!("  # {label}"));
        before = Some(q);
    }
    Ok(vec![Job::file(&name, "yaml", &lines, LF)])
}

/// Joint values of a URDF: couplings resolved, direction as on the pendant.
fn urdf_values(job: &Job<'_>, q: &[f64]) -> Vec<f64> {
    let joints = job.robot.chain.joints().iter().enumerate();
    joints.map(|(index, joint)| joint.direction * joint.variable(index, q)).collect()
}

/// Highest speed of each joint. A coupled joint keeps its own limit, although its pendant value changes less.
fn speeds(job: &Job<'_>) -> Result<Vec<f64>, ProgramError> {
    let joints = job.robot.chain.joints();
    let given = |index: usize| job.robot.max_speeds.get(index).copied().flatten().filter(|speed| *speed > 0.0);
    let speeds: Vec<f64> = (0..joints.len()).filter_map(given).collect();
    if speeds.len() == joints.len() {
        return Ok(speeds);
    }
    let missing = joints.iter().enumerate().filter(|(index, _)| given(*index).is_none());
    Err(ProgramError::MaxSpeed { joints: missing.map(|(_, joint)| ascii(&joint.name)).collect() })
}

/// A time as whole seconds and nanoseconds, rounded to a millisecond.
fn duration(time: f64) -> String {
    let text = decimal(time, 3);
    let (seconds, milliseconds) = text.split_once('.').unwrap_or((&text, "0"));
    let nanoseconds = milliseconds.trim_start_matches('0');
    let nanoseconds = if nanoseconds.is_empty() { "0".to_owned() } else { format!("{nanoseconds}000000") };
    format!("{{sec: {seconds}, nanosec: {nanoseconds}}}")
}
