//! `trupose compensate --targets`: a table of targets becomes a table of commands.

use std::io::Write;
use std::path::Path;

use nalgebra::{Isometry3, Point3, Translation3};

use super::super::{Console, to_json};
use super::{SHOWN, picture};
use crate::cli::compensate::CompensateArgs;
use crate::compensation::{Compensated, Goal, Status};
use crate::correction::report::{Moved, Report, TargetReport};
use crate::correction::{Corrector, reason};
use crate::error::{ExitStatus, Failure};
use crate::kinematics::Joint;
use crate::procedure::joint_types;
use crate::session::targets::{TargetGoal, TargetRow, quoted, read};
use crate::store;
use crate::text::decimal;
use crate::units::{to_deg, to_mm};

/// Status of a target where the arm is not known well enough.
const UNCERTAIN: &str = "uncertain";

/// A row of the table of commands.
struct Row<'t> {
    target: &'t TargetRow,
    done: Compensated,
    report: TargetReport,
    /// The tool at the target and at the command, by the nominal arm.
    poses: Option<[Isometry3<f64>; 2]>,
}

impl Row<'_> {
    fn is_usable(&self) -> bool {
        self.done.status.is_usable() && self.report.status != UNCERTAIN
    }
}

pub(super) fn run<O: Write, E: Write>(
    args: &CompensateArgs,
    job: &Corrector<'_>,
    path: &Path,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let bytes = store::read(path).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    let table = read(&bytes, &path.display().to_string(), &joint_types(&job.arm.profile))
        .map_err(|errors| Failure::new(ExitStatus::Usage, errors.to_string()))?;
    let rows: Vec<Row<'_>> = table.rows.iter().map(|target| solved(job, target)).collect();
    let is_free = |row: &&TargetRow| matches!(row.goal, TargetGoal::Cartesian { orientation: None, .. });
    if table.rows.iter().find(is_free).is_some() && !args.position_only {
        console.remark("note: the table has no orientations; only positions are reached, and the tool may turn");
    }
    let has_both = |row: &TargetRow| matches!(row.goal, TargetGoal::Cartesian { near: Some(_), .. });
    if table.rows.iter().any(has_both) {
        console.remark(
            "note: the table has joint values and coordinates; the coordinates are the targets, and the joint values only say which branch of \
             the arm is meant. To compensate the joint values, leave out the coordinates",
        );
    }
    let mut listed = 0;
    for row in rows.iter().filter(|row| row.report.status != Status::Reached.name()) {
        listed += 1;
        if let (true, Some(reason)) = (listed <= SHOWN, &row.report.reason) {
            console.remark(&format!("pose {} (line {}): {reason}", row.target.pose, row.target.line));
        }
    }
    if listed > SHOWN {
        console.remark(&format!("and {} more; the column 'status' has all of them", listed - SHOWN));
    }
    let reached = rows.iter().filter(|row| row.is_usable()).count();
    let position_only = rows.iter().filter(|row| row.is_usable() && row.done.status == Status::PositionOnly).count();
    let text = text(&rows, job.joints(), &table.extra, job.arm.edited.as_deref());
    if let Some(path) = &args.record {
        picture::write(path, rows.iter().filter_map(|row| Some((row.target.pose.clone(), row.poses?))))?;
    }
    let mut report = Report {
        targets: rows.into_iter().map(|row| row.report).collect(),
        corrected: reached,
        left: table.rows.len() - reached,
        edited: job.arm.edited.clone(),
        ..Report::default()
    };
    if let Some(path) = &args.out {
        store::replace(path, &text).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
        report.written.push(path.display().to_string());
    }
    report.written.extend(args.record.iter().map(|path| path.display().to_string()));
    match (&args.out, args.json) {
        (_, true) => console.print(&to_json(&report)?)?,
        (Some(path), false) => console.say_written(path)?,
        (None, false) => console.print(&text)?,
    }
    for line in report.lines() {
        console.remark(&line);
    }
    let in_part = if position_only > 0 { format!(", {position_only} of them in position only") } else { String::new() };
    console.remark(&format!("{reached} of {} targets reached{in_part}", table.rows.len()));
    Ok(if report.left == 0 { ExitStatus::Accepted } else { ExitStatus::NotAccepted })
}

fn solved<'t>(job: &Corrector<'_>, target: &'t TargetRow) -> Row<'t> {
    let goal = goal(&target.goal);
    let done = job.compensator.solve(&goal);
    let uncertainty = job.uncertainty(&done.command, &job.tools[1]).filter(|_| done.status.is_usable());
    let mut report = TargetReport {
        line: target.line,
        name: Some(target.pose.clone()),
        status: done.status.name(),
        uncertainty_mm: uncertainty.map(to_mm),
        ..TargetReport::default()
    };
    if done.status != Status::Reached {
        report.reason = Some(reason(&done, job.joints()));
    }
    let mut poses = None;
    if let Some(reason) = job.too_uncertain(uncertainty) {
        report.status = UNCERTAIN;
        report.reason = Some(format!("not corrected: {reason}"));
    } else if done.status.is_usable() {
        poses = tool_poses(job, &goal, &done);
        report.moved = poses.as_ref().map(|[meant, commanded]| Moved::between(meant, commanded));
    }
    Row { target, done, report, poses }
}

/// The tool of the nominal arm at a target and at its command.
fn tool_poses(job: &Corrector<'_>, goal: &Goal, done: &Compensated) -> Option<[Isometry3<f64>; 2]> {
    let nominal = job.compensator.inverse().forward();
    let tool = |q: &[f64]| nominal.base_from_flange(q) * job.tools[0];
    let commanded = tool(&done.command);
    let meant = match goal {
        Goal::Configuration(_) => tool(done.meant.as_ref()?),
        Goal::Pose { base_from_tool, .. } => *base_from_tool,
        Goal::Position { point_in_base, .. } => {
            Isometry3::from_parts(Translation3::from(point_in_base.coords), commanded.rotation)
        }
    };
    Some([meant, commanded])
}

fn goal(goal: &TargetGoal) -> Goal {
    match goal {
        TargetGoal::Configuration(q) => Goal::Configuration(q.clone()),
        TargetGoal::Cartesian { position: [x, y, z], orientation: Some(rotation), near } => Goal::Pose {
            base_from_tool: Isometry3::from_parts(Translation3::new(*x, *y, *z), *rotation),
            near: near.clone(),
        },
        TargetGoal::Cartesian { position, orientation: None, near } => {
            Goal::Position { point_in_base: Point3::from(*position), near: near.clone() }
        }
    }
}

/// The table of commands, and before it that the calibration was edited.
fn text(rows: &[Row<'_>], joints: &[Joint], extra: &[String], edited: Option<&str>) -> String {
    let mut lines: Vec<String> = edited.iter().map(|said| format!("# WARNING: {said}")).collect();
    lines.push(header(joints, extra));
    lines.extend(rows.iter().map(|row| line(row, joints)));
    lines.join("\n") + "\n"
}

/// `pose,status,q1_deg,…,left_mm,left_deg,moved_mm,moved_deg` and the columns that were not read. What is left is left by the
/// calculation; it is no error of the arm.
fn header(joints: &[Joint], extra: &[String]) -> String {
    let names = joints.iter().enumerate();
    let names = names.map(|(index, joint)| format!("q{}_{}", index + 1, joint.joint_type.quantity().unit()));
    let fixed = ["left_mm", "left_deg", "moved_mm", "moved_deg"].map(str::to_owned);
    let cells: Vec<String> = ["pose", "status"]
        .map(str::to_owned)
        .into_iter()
        .chain(names)
        .chain(fixed)
        .chain(extra.iter().map(|name| quoted(name)))
        .collect();
    cells.join(",")
}

/// Joint values to command; none for a target that is not reached.
fn line(row: &Row<'_>, joints: &[Joint]) -> String {
    let usable = row.is_usable();
    let value = |(joint, q): (&Joint, &f64)| {
        if usable { decimal(joint.joint_type.quantity().to_edge(*q), 6) } else { String::new() }
    };
    let number = |value: f64| if value.is_finite() { decimal(value, 6) } else { String::new() };
    let moved = row.report.moved;
    let mut cells = vec![quoted(&row.target.pose), row.report.status.to_owned()];
    cells.extend(joints.iter().zip(&row.done.command).map(value));
    cells.extend([number(to_mm(row.done.position_error)), number(to_deg(row.done.angle_error))]);
    cells.extend([
        moved.map_or_else(String::new, |moved| number(moved.moved_mm)),
        moved.map_or_else(String::new, |moved| number(moved.moved_deg)),
    ]);
    cells.extend(row.target.extra.iter().map(|cell| quoted(cell)));
    cells.join(",")
}
