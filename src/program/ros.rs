//! ROS 2: a `trajectory_msgs/msg/JointTrajectory` as YAML (radian, metre, second).
//!
//! Every point has zero velocities, so a controller interpolates with cubics whose peak is 1.5 times the mean speed; the
//! times are long enough for that. A dwell is the same point again, later. The trajectory begins with its first point:
//! the arm must stand there, or be brought there by a planner, before it is sent. `joint_names` are those of the profile:
//! a URDF may call them otherwise.

use super::names::{MAX_NAME, ascii, identifier};
use super::{HEAD_WIDTH, Job, LF, Pause, ProgramError, ProgramFile};

const DECIMALS: usize = 8;

/// Peak of a cubic between two stops, in parts of its mean speed.
const CUBIC_PEAK: f64 = 1.5;

/// Shortest time of a move (s).
const LEAST_TIME: f64 = 2.0;

pub(super) fn write(job: &mut Job<'_>) -> Result<Vec<ProgramFile>, ProgramError> {
    let Pause::Dwell(dwell) = job.options.pause else { return Err(ProgramError::NoOperator) };
    let speeds = speeds(job)?;
    let name = identifier(&job.options.name, MAX_NAME).to_lowercase();
    let joints: Vec<String> =
        job.robot.chain.joints().iter().map(|joint| format!("\"{}\"", ascii(&joint.name))).collect();
    let mut lines: Vec<String> = job.head(HEAD_WIDTH).iter().map(|line| format!("# {line}")).collect();
    lines.push(format!("joint_names: [{}]", joints.join(", ")));
    lines.push("points:".to_owned());
    let zeros = vec!["0.0"; joints.len()].join(", ");
    let mut time = 0.0;
    let mut before: Option<Vec<f64>> = None;
    for pose in job.poses {
        let q = urdf_values(job, &pose.configuration);
        let slowest = before.iter().flatten().zip(&q).zip(&speeds);
        let moving = slowest.map(|((from, to), speed)| CUBIC_PEAK * (to - from).abs() / (speed * job.options.speed));
        // Nobody knows where the arm stands before the first point: half a turn of every joint, at the speed asked for.
        let first = speeds.iter().map(|speed| CUBIC_PEAK * std::f64::consts::PI / (speed * job.options.speed));
        let first = if before.is_none() { first.fold(LEAST_TIME, f64::max) } else { LEAST_TIME };
        time += moving.fold(first, f64::max);
        let positions = job.inside_values(&q, DECIMALS).join(", ");
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
        let place = lines.len() - if pose.kind.is_measured() { 6 } else { 3 };
        lines.insert(place, format!("  # {label}"));
        before = Some(q);
    }
    Ok(vec![Job::file(&name, "yaml", &lines, LF)])
}

/// Values of a URDF's joints: couplings resolved, sense as on the pendant.
fn urdf_values(job: &Job<'_>, q: &[f64]) -> Vec<f64> {
    let joints = job.robot.chain.joints().iter().enumerate();
    joints.map(|(index, joint)| joint.direction * joint.variable(index, q)).collect()
}

/// Highest speed of each joint. A coupled one is held to its own, though its pendant value moves less.
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

/// Whole seconds and nanoseconds, to a millisecond.
fn duration(time: f64) -> String {
    let text = super::decimal(time, 3);
    let (seconds, milliseconds) = text.split_once('.').unwrap_or((&text, "0"));
    let nanoseconds = milliseconds.trim_start_matches('0');
    let nanoseconds = if nanoseconds.is_empty() { "0".to_owned() } else { format!("{nanoseconds}000000") };
    format!("{{sec: {seconds}, nanosec: {nanoseconds}}}")
}
