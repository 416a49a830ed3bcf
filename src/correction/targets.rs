//! The targets of a program, corrected: what is commanded instead, and why where nothing is.

use nalgebra::{Isometry3, Point3};

use super::between::{Ends, deviation, divided};
use super::report::{Moved, PathReport, TargetReport};
use super::settings::Settings;
use super::{Corrector, reason, status_reason};
use crate::compensation::{self, PoseGoal, Status};
use crate::inverse::Posture;
use crate::program::configuration::Configuration;
use crate::program::insert::{InsertedPoint, Insertion, has_spot};
use crate::program::motion::{Command, Goal, Move, MoveKind, PoseTarget, Scan, Target};
use crate::units::{MICROMETRE, MICRORADIAN, to_mm};

/// How the options resolve what a program only names.
#[derive(Clone, Copy, Debug)]
pub struct Resolved<'a> {
    pub tools: Settings<'a>,
    pub frames: Settings<'a>,
}

/// A target with its correction.
#[derive(Clone, Debug)]
pub struct Corrected {
    pub report: TargetReport,
    done: Option<Done>,
}

/// A correction.
#[derive(Clone, Debug)]
struct Done {
    command: Command,
    /// Configurations of the nominal arm at the target and at the command ((rad) or (m)).
    meant: Vec<f64>,
    commanded: Vec<f64>,
    flange_from_tool: Isometry3<f64>,
    base_from_frame: Isometry3<f64>,
    /// Where the tool is to be.
    base_from_tool: Isometry3<f64>,
    /// A configuration near which the controller inverts the target.
    near: Option<Vec<f64>>,
    has_orientation: bool,
}

/// Rounding of a written target that a proof accepts: what the digits of any dialect explain, but no wrong number (m, rad).
const LARGEST_ROUNDING: (f64, f64) = (5e-5, 1e-4);

/// Corrects all targets of a program. They are solved in the order in which they are moved to, because a target without a
/// configuration is reached from the one before.
pub fn corrected(corrector: &Corrector<'_>, resolved: &Resolved<'_>, scan: &Scan) -> Vec<Corrected> {
    let mut results: Vec<Option<Corrected>> = vec![None; scan.targets.len()];
    let mut before: Option<Vec<f64>> = None;
    // After a move that is not known, and at the beginning of a routine, the arm may be anywhere.
    let of_move = |step: &Move| {
        let via = match step.kind {
            MoveKind::Circular { via } => via,
            MoveKind::Joint | MoveKind::Linear => None,
        };
        let lost = step.is_first.then_some(None);
        lost.into_iter().chain(via.map(Some)).chain([step.target])
    };
    let unused = std::iter::once(None).chain((0..scan.targets.len()).map(Some));
    for index in scan.moves.iter().flat_map(of_move).chain(unused) {
        let Some((index, target)) = index.and_then(|index| Some((index, scan.targets.get(index)?))) else {
            before = None;
            continue;
        };
        let result = results[index].get_or_insert_with(|| {
            let mut report = TargetReport { line: target.line, name: target.name.clone(), ..TargetReport::default() };
            let done = match &target.goal {
                Goal::Joints(q) => of_joints(corrector, q, &mut report),
                Goal::Pose(pose) => of_pose(corrector, resolved, pose, before.as_deref(), &mut report),
            };
            Corrected { report, done }
        });
        // After a target that is not solved the arm is somewhere else.
        before = result.done.as_ref().map(|done| done.commanded.clone());
    }
    results.into_iter().flatten().collect()
}

fn of_joints(corrector: &Corrector<'_>, q: &[f64], report: &mut TargetReport) -> Option<Done> {
    let done = corrector.compensator.solve(&compensation::Goal::Configuration(q.to_vec()));
    report.status = done.status.name();
    if done.status != Status::Reached {
        report.reason = Some(reason(&done, corrector.joints()));
    }
    if !done.status.is_usable() {
        return None;
    }
    let flange_from_tool = corrector.tools[1];
    is_known(corrector, &done.command, &flange_from_tool, report)?;
    let nominal = corrector.compensator.inverse().forward();
    let tool = |q: &[f64]| nominal.base_from_flange(q) * corrector.tools[0];
    let meant = done.meant.clone()?;
    report.moved = Some(Moved::between(&tool(&meant), &tool(&done.command)));
    Some(Done {
        command: Command::Joints(done.command.clone()),
        base_from_tool: tool(&meant),
        meant,
        commanded: done.command,
        flange_from_tool,
        base_from_frame: Isometry3::identity(),
        near: None,
        has_orientation: done.status == Status::Reached && !corrector.position_only,
    })
}

fn of_pose(
    corrector: &Corrector<'_>,
    resolved: &Resolved<'_>,
    pose: &PoseTarget,
    before: Option<&[f64]>,
    report: &mut TargetReport,
) -> Option<Done> {
    let settings = (resolved.tools.pose(&pose.tool), resolved.frames.pose(&pose.frame));
    let (flange_from_tool, frame) = match settings {
        (Ok(tool), Ok(frame)) => (tool, frame),
        (Err(missing), _) | (_, Err(missing)) => {
            report.status = "unknown_setting";
            report.reason = Some(missing.to_string());
            report.missing = Some(missing);
            return None;
        }
    };
    let base_from_frame = corrector.base_from_world() * frame;
    let near = match &pose.configuration {
        Configuration::Near(near) => Some(near.clone()),
        Configuration::Rapid { .. }
        | Configuration::Krl { .. }
        | Configuration::Fanuc(_)
        | Configuration::Val3 { .. }
        | Configuration::Inform(_) => before.map(<[f64]>::to_vec),
        // The reader has followed the moves and does not know the one before.
        Configuration::Free => None,
    };
    let is_meant = |posture: Option<&Posture>, q: &[f64]| pose.configuration.matches(posture, q);
    let goal = PoseGoal {
        base_from_tool: base_from_frame * pose.frame_from_tool,
        flange_from_tool,
        is_meant: &is_meant,
        near: near.as_deref(),
    };
    let done = match corrector.compensator.solve_pose(&goal) {
        Ok(done) => done,
        Err(status) => {
            report.status = status.name();
            report.reason = Some(status_reason(&status, corrector.joints()));
            return None;
        }
    };
    report.status = Status::Reached.name();
    is_known(corrector, &done.command, &flange_from_tool, report)?;
    report.moved = Some(Moved::between(&goal.base_from_tool, &done.base_from_tool));
    Some(Done {
        command: Command::Pose(base_from_frame.inverse() * done.base_from_tool),
        base_from_tool: goal.base_from_tool,
        meant: done.meant,
        commanded: done.command,
        flange_from_tool,
        base_from_frame,
        near,
        has_orientation: true,
    })
}

/// Notes how well the arm is known there; `None`, with the reason, if not well enough.
fn is_known(
    corrector: &Corrector<'_>,
    q: &[f64],
    flange_from_tool: &Isometry3<f64>,
    report: &mut TargetReport,
) -> Option<()> {
    let uncertainty = corrector.uncertainty(q, flange_from_tool);
    report.uncertainty_mm = uncertainty.map(to_mm);
    if let Some(reason) = corrector.too_uncertain(uncertainty) {
        report.status = "uncertain";
        report.reason = Some(reason);
        return None;
    }
    Some(())
}

impl Corrected {
    pub const fn is_done(&self) -> bool {
        self.done.is_some()
    }

    pub fn command(&self) -> Option<Command> {
        self.done.as_ref().map(|done| done.command.clone())
    }

    /// The name or the line of the target.
    pub fn label(&self) -> String {
        self.report.name.clone().unwrap_or_else(|| format!("line {}", self.report.line))
    }

    /// Where the tool is meant to be, and where the nominal arm has it at the command (m).
    pub fn poses(&self, corrector: &Corrector<'_>) -> Option<[Isometry3<f64>; 2]> {
        let done = self.done.as_ref()?;
        Some([done.base_from_tool, done.commanded_pose(corrector)])
    }

    /// Largest correction of each joint so far, with this one.
    pub fn widen(&self, largest: &mut [f64]) {
        let Some(done) = &self.done else { return };
        for (largest, (command, meant)) in largest.iter_mut().zip(done.commanded.iter().zip(&done.meant)) {
            *largest = largest.max((command - meant).abs());
        }
    }
}

impl Done {
    fn commanded_pose(&self, corrector: &Corrector<'_>) -> Isometry3<f64> {
        corrector.compensator.inverse().forward().base_from_flange(&self.commanded) * self.flange_from_tool
    }
}

/// Lines of moves that belong to a path of which a part only is corrected.
pub fn half_corrected(scan: &Scan, results: &[Corrected]) -> Vec<usize> {
    let is_done = |step: &Move| step.target.and_then(|index| results.get(index)).is_some_and(Corrected::is_done);
    let paths = |wanted: bool| {
        let moves = scan.moves.iter().filter(move |step| is_done(step) == wanted);
        moves.map(|step| step.path).collect::<std::collections::BTreeSet<usize>>()
    };
    let (corrected, left) = (paths(true), paths(false));
    let is_torn = |step: &&Move| corrected.contains(&step.path) && left.contains(&step.path) && !is_done(step);
    scan.moves.iter().filter(is_torn).map(|step| step.line).collect()
}

/// How far the paths of linear and circular moves deviate between corrected targets, and the points that keep linear ones within `limit`
/// (m). The second list has the lines of moves that deviate by more and cannot be divided.
pub fn between(
    corrector: &Corrector<'_>,
    scan: &Scan,
    results: &[Corrected],
    limit: Option<f64>,
) -> (Vec<PathReport>, Vec<Insertion>, Vec<usize>) {
    let done =
        |index: Option<usize>| index.and_then(|index| results.get(index)).and_then(|result| result.done.as_ref());
    let (mut reports, mut insertions, mut whole) = (Vec::new(), Vec::new(), Vec::new());
    for (index, pair) in scan.moves.windows(2).enumerate() {
        let [before, step] = pair else { continue };
        let via = match step.kind {
            MoveKind::Joint => continue,
            MoveKind::Linear => None,
            MoveKind::Circular { via } => match done(via) {
                Some(via) => Some(via),
                None => continue,
            },
        };
        if before.path != step.path || before.companion != step.companion {
            continue;
        }
        let (Some(from), Some(to)) = (done(before.target), done(step.target)) else { continue };
        // The point before is left with the tool of this move.
        let tool = to.flange_from_tool;
        let start = |q: &[f64]| corrector.compensator.inverse().forward().base_from_flange(q) * tool;
        let at = |pose: &Isometry3<f64>| Point3::from(pose.translation.vector);
        let meant =
            Ends { from: start(&from.meant), via: via.map(|via| at(&via.base_from_tool)), to: to.base_from_tool };
        let commanded = Ends {
            from: start(&from.commanded),
            via: via.map(|via| at(&via.commanded_pose(corrector))),
            to: to.commanded_pose(corrector),
        };
        let ends = [&meant, &commanded];
        let Some(report) = deviation(step.line, &corrector.compensator, &tool, ends, &from.meant) else { continue };
        let Some(limit) = limit.filter(|limit| report.corrected_mm > to_mm(*limit)) else {
            reports.push(report);
            continue;
        };
        let is_linear = step.kind == MoveKind::Linear && has_spot(scan, index + 1);
        let divided =
            is_linear.then(|| divided(step.line, &corrector.compensator, &tool, ends, &from.meant, limit)).flatten();
        if let Some((points, report)) = divided {
            let frame_from_base = to.base_from_frame.inverse();
            let points = points.into_iter().map(|point| InsertedPoint {
                frame_from_tool: frame_from_base * point.base_from_tool,
                posture: corrector.compensator.inverse().posture(&point.commanded),
                joints: point.commanded,
            });
            insertions.push(Insertion { step: index + 1, points: points.collect() });
            reports.push(report);
        } else {
            whole.push(step.line);
            reports.push(report);
        }
    }
    (reports, insertions, whole)
}

/// Compares a program with inserted points with the one before and with these points.
///
/// # Errors
/// In words, what is not as it has to be.
pub fn prove_inserted(before: &Scan, insertions: &[Insertion], written: &Scan) -> Result<(), String> {
    let mut inserted = insertions.iter().flat_map(|insertion| &insertion.points).peekable();
    let mut old = before.targets.iter().peekable();
    for new in &written.targets {
        if old.next_if(|old| is_same_place(&old.goal, &new.goal)).is_some() {
            continue;
        }
        let is_next = |point: &&InsertedPoint| match &new.goal {
            Goal::Joints(_) => false,
            Goal::Pose(pose) => {
                let off = pose.frame_from_tool.translation.vector - point.frame_from_tool.translation.vector;
                let turned = pose.frame_from_tool.rotation.angle_to(&point.frame_from_tool.rotation);
                off.norm() <= LARGEST_ROUNDING.0 && turned <= LARGEST_ROUNDING.1
            }
        };
        if inserted.next_if(is_next).is_none() {
            return Err(format!("line {}: an inserted point is not where it has to be", new.line));
        }
    }
    match (old.next(), inserted.next()) {
        (None, None) => Ok(()),
        (Some(_), _) | (_, Some(_)) => Err("a target is missing".to_owned()),
    }
}

/// Whether two targets are at one place. A configuration that comes from the move before changes when that move is corrected.
fn is_same_place(one: &Goal, other: &Goal) -> bool {
    match (one, other) {
        (Goal::Pose(one), Goal::Pose(other)) => {
            (one.frame_from_tool, &one.tool, &one.frame) == (other.frame_from_tool, &other.tool, &other.frame)
        }
        (one, other) => one == other,
    }
}

/// Compares what a written program makes the identified arm do with what was meant.
///
/// # Errors
/// In words, the first target that is not what it has to be.
pub fn prove(corrector: &Corrector<'_>, results: &[Corrected], old: &Scan, written: &Scan) -> Result<(), String> {
    if written.targets.len() != old.targets.len() {
        return Err(format!("{} targets became {}", old.targets.len(), written.targets.len()));
    }
    for ((result, old), new) in results.iter().zip(&old.targets).zip(&written.targets) {
        let line = old.line;
        let failed = |what: String| Err(format!("line {line}: {what}"));
        let Some(done) = &result.done else {
            if !is_same_place(&new.goal, &old.goal) {
                return failed("a target that is left has changed".to_owned());
            }
            continue;
        };
        let Some((q, rounding)) = taken(corrector, done, new) else {
            return failed("the controller would not reach the written target in its configuration".to_owned());
        };
        let there = corrector.compensator.identified_pose(&q, &done.flange_from_tool);
        let position = (there.translation.vector - done.base_from_tool.translation.vector).norm();
        let angle = if done.has_orientation { there.rotation.angle_to(&done.base_from_tool.rotation) } else { 0.0 };
        let is_right = rounding.0 <= LARGEST_ROUNDING.0
            && rounding.1 <= LARGEST_ROUNDING.1
            && position <= MICROMETRE + 1.1 * rounding.0
            && angle <= MICRORADIAN + 1.1 * rounding.1;
        if !is_right {
            return failed(format!(
                "the written target is {:.3} um and {:.3} urad from what is meant",
                position / MICROMETRE,
                angle / MICRORADIAN
            ));
        }
    }
    Ok(())
}

/// The configuration that the controller takes for a written target, and by how much the digits differ from the command, as a distance
/// and an angle of the tool.
fn taken(corrector: &Corrector<'_>, done: &Done, written: &Target) -> Option<(Vec<f64>, (f64, f64))> {
    let q = match &written.goal {
        Goal::Joints(q) => q.clone(),
        Goal::Pose(pose) => {
            let is_meant = |posture: Option<&Posture>, q: &[f64]| pose.configuration.matches(posture, q);
            let goal = PoseGoal {
                base_from_tool: done.base_from_frame * pose.frame_from_tool,
                flange_from_tool: done.flange_from_tool,
                is_meant: &is_meant,
                near: done.near.as_deref(),
            };
            corrector.compensator.taken(&goal).ok()?
        }
    };
    let pose = corrector.compensator.inverse().forward().base_from_flange(&q) * done.flange_from_tool;
    let command = done.commanded_pose(corrector);
    let position = (pose.translation.vector - command.translation.vector).norm();
    Some((q, (position, pose.rotation.angle_to(&command.rotation))))
}
