//! The state of a session: the fold of its journal, and nothing else.
//!
//! A sample is never removed: it is superseded by a later measurement of the same row, excluded or undone, and stays to be
//! seen. What was measured stays as it was noted; corrections are applied when samples are used ([`Session::point_of`] and the
//! configuration).

mod correction;
mod history;
mod sample;

use std::collections::BTreeSet;

use jiff::Timestamp;
use nalgebra::Point3;
use serde::{Serialize, Serializer};
use thiserror::Error;

use super::about::About;
use super::calibration::{MountedText, mounted_on};
use super::corrected::CorrectedText;
use super::journal::{
    Decision, Entry, FindingText, IdentifiedText, JointPointText, Journal, Line, MeasuredText, PlanText, PlannedText,
    RobotProgramText, from_edge, from_xyz_mm, to_xyz_mm,
};
use super::plan::{PlannedPose, PoseKind};
use super::set_up::{InstrumentChoice, PayloadText, Step, TargetChoice};
use crate::kinematics::JointType;
use crate::profile::{CellText, Profile};
use crate::units::from_mm;
pub use correction::Corrected;
use correction::is_factor;
use history::History;
pub use history::Undoable;
pub use sample::{Sample, SampleState, Stop};

/// A longer time between two entries (s) is a break, or a clock that was set.
const LONGEST_STEP: f64 = 3600.0;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Session {
    pub name: String,
    /// Program that opened it.
    pub program: String,
    /// Time of opening.
    pub opened: Option<Timestamp>,
    /// Time of the latest entry (clocks may jump back: this is the largest).
    pub latest: Option<Timestamp>,
    /// Time of the last entry, by its own clock.
    pub last: Option<Timestamp>,
    /// Time of work (s): from entry to entry, without pauses between program runs and without jumps of the clock.
    pub worked: f64,
    /// Entries so far.
    pub lines: u64,
    pub robot: Option<Robot>,
    /// Choice of the instrument.
    pub instrument: Option<InstrumentChoice>,
    /// Position of the SMR on the flange.
    pub target: Option<TargetChoice>,
    /// What the flange carries, if not what the profile says.
    pub payload: Option<PayloadText>,
    /// What was stated about the cell, if anything.
    pub cell: CellText,
    /// When the acceptance limits were set, if not by the profile.
    pub limits_set: Option<LimitsSet>,
    /// Points of the circle-point analysis.
    pub circle_points: Vec<JointPointText<usize>>,
    /// Points of the joint check.
    pub joint_check: Vec<JointPointText<Option<usize>>>,
    /// All rows of all plans, in the order of the programs.
    pub rows: Vec<Row>,
    /// Plans that were accepted, without their rows.
    pub plan: Option<PlanText>,
    /// The robot program of the plan, if one was written.
    pub robot_program: Option<RobotProgramText>,
    /// Row of the plan that was measured, skipped or gone to last.
    pub shown: Option<usize>,
    /// The last stop of the arm that is known.
    pub last_stop: Option<Stop>,
    /// Whether the program has run since that stop. In a break the arm may have been moved.
    pub is_stop_certain: bool,
    /// Row of the plan to which the operator goes through home.
    pub through_home: Option<usize>,
    /// Everything that was measured.
    pub samples: Vec<Sample>,
    /// Measurements that gave no sample.
    pub refused: Vec<Refused>,
    /// Identities of the connected instruments, in the order of their appearance.
    pub identities: Vec<String>,
    /// Number of the last measurement.
    pub measurements: u64,
    /// First row of the plan from which on no row was ever measured.
    rows_measured: usize,
    /// Corrections in force, oldest first.
    pub corrections: Vec<Corrected>,
    pub notes: Vec<Note>,
    /// Serial number, operator and place.
    pub about: About,
    /// Current step of the wizard.
    pub step: Step,
    pub identified: Option<Box<IdentifiedText>>,
    /// Whether there ever was a result.
    has_result: bool,
    pub delivered: Vec<String>,
    /// Their check sums, in the same order; none where an earlier version wrote them.
    pub delivered_sums: Vec<String>,
    /// Models that were left out of them, with the reason.
    pub left_out: Vec<String>,
    /// Robot programs that were corrected with the result, the latest of each file.
    pub corrected: Vec<CorrectedText>,
    /// Number of times it was resumed.
    pub resumed: usize,
    /// Whether it ended normally.
    pub closed: bool,
    /// What can be undone and redone.
    history: History,
}

/// The robot of a session.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// Name or path that was given.
    pub source: String,
    /// SHA-256 of the profile's text.
    pub sha256: String,
    pub text: String,
    /// The parsed profile.
    pub profile: Profile,
    pub joint_types: Vec<JointType>,
}

/// When acceptance limits were set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LimitsSet {
    pub time: Timestamp,
    /// Whether a result had been seen before.
    pub after_result: bool,
}

/// A row of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The planned pose.
    pub planned: PlannedPose,
    /// Whether it belongs to the current plan; a row of an earlier plan is done or dropped.
    pub active: bool,
    /// Whether the operator skipped it.
    pub skipped: bool,
}

impl Row {
    /// Whether it is to be measured, unless it already was.
    const fn is_planned(&self) -> bool {
        self.active && !self.skipped && self.planned.kind.is_measured()
    }
}

/// A measurement that gave no sample, or whose sample does not count, with the reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Refused {
    /// Number of the measurement.
    pub number: u64,
    pub pose: String,
    pub reason: String,
}

/// A remark.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Note {
    /// Written in RFC 3339, UTC.
    #[serde(serialize_with = "as_text")]
    pub time: Timestamp,
    /// Name of the pose it is about.
    pub pose: Option<String>,
    pub text: String,
}

fn as_text<S: Serializer>(time: &Timestamp, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(time)
}

/// A journal whose entries do not fit together.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum FoldError {
    /// The profile in the journal cannot be read by this program.
    #[error("line {line}: the profile in the journal cannot be used: {message}")]
    Profile {
        /// Line, from 1.
        line: u64,
        message: String,
    },
    /// An entry refers to something that is not there.
    #[error("line {line}: {what}; the journal was not written by this program")]
    Misfit {
        /// Line, from 1.
        line: u64,
        /// Description of the mismatch.
        what: String,
    },
}

impl Session {
    /// The session of a journal.
    ///
    /// # Errors
    /// Entries that do not fit together.
    pub fn of(journal: &Journal) -> Result<Self, FoldError> {
        let mut session = Self::default();
        for line in &journal.lines {
            session.apply(line)?;
        }
        Ok(session)
    }

    /// Applies the next line.
    ///
    /// # Errors
    /// The entry does not fit; the session is then unchanged.
    pub fn apply(&mut self, line: &Line) -> Result<(), FoldError> {
        if let Entry::Undone { line: undone, .. } = &line.entry {
            return self.undo(line, *undone);
        }
        if let Entry::Redone { line: redone, .. } = &line.entry {
            return self.redo(line, *redone);
        }
        self.apply_once(line)?;
        self.remember(line);
        Ok(())
    }

    /// Applies a line that neither undoes nor redoes another one.
    #[expect(clippy::too_many_lines, reason = "an arm for each kind of entry")]
    fn apply_once(&mut self, line: &Line) -> Result<(), FoldError> {
        let misfit = |what: &str| FoldError::Misfit { line: line.number, what: what.to_owned() };
        match &line.entry {
            Entry::Opened { program, name, .. } => {
                if self.opened.is_some() {
                    return Err(misfit("a second opening entry"));
                }
                self.name.clone_from(name);
                self.program.clone_from(program);
                self.opened = Some(line.time);
            }
            Entry::Profile { source, sha256, text } => {
                if self.has_measurements() {
                    return Err(misfit("another profile after measuring has begun"));
                }
                self.change_robot(robot(line.number, source, sha256, text)?);
            }
            Entry::Step(step) => self.step = *step,
            Entry::Instrument(instrument) => {
                self.instrument = Some(instrument.clone());
                self.identities.clear();
            }
            Entry::Connected { identity } => {
                self.identities.retain(|known| known != identity);
                self.identities.push(identity.clone());
            }
            Entry::Target(target) => self.target = Some(*target),
            Entry::Payload(payload) => self.payload = Some(*payload),
            Entry::Cell(cell) => self.state_cell(cell, line)?,
            Entry::CirclePoint(point) => {
                self.measurements = self.measurements.max(point.number);
                self.pass("the last circle point", &point.joints);
                self.circle_points.push(point.clone());
            }
            Entry::CirclesDiscarded => self.circle_points.clear(),
            Entry::JointCheckPoint(point) => {
                self.pass("the last point of the joint check", &point.joints)
                    .ok_or_else(|| misfit("a point of the joint check that does not fit the robot"))?;
                self.measurements = self.measurements.max(point.number);
                self.joint_check.push(point.clone());
            }
            Entry::JointCheckDiscarded => self.joint_check.clear(),
            Entry::Undone { .. } | Entry::Redone { .. } => {}
            Entry::Plan(plan) => {
                let rows = self.planned_rows(&plan.rows).ok_or_else(|| misfit("a plan that does not fit the robot"))?;
                for row in &mut self.rows {
                    row.active = false;
                }
                self.rows.extend(rows);
                self.plan = Some(plan.without_rows());
                self.robot_program = None;
            }
            Entry::PlanExtended(plan) => {
                let rows = self.planned_rows(&plan.rows).ok_or_else(|| misfit("poses that do not fit the robot"))?;
                self.rows.extend(rows);
                self.plan = Some(plan.without_rows());
                // A program of before does not drive to these poses.
                self.robot_program = None;
            }
            Entry::RobotProgram(program) => self.robot_program = Some(program.clone()),
            Entry::ProgramDriven => {
                let program = self.robot_program.as_mut().ok_or_else(|| misfit("a program that was not written"))?;
                program.was_driven = true;
            }
            Entry::Sample(noted) => self.add_sample(noted, line).map_err(misfit)?,
            Entry::Refused { number, pose, reason, .. } => {
                self.measurements = self.measurements.max(*number);
                self.refused.push(Refused { number: *number, pose: pose.clone(), reason: reason.clone() });
            }
            Entry::Decision { sample, decision } => {
                self.decide(*sample, *decision).ok_or_else(|| misfit("a decision about an unknown sample"))?;
            }
            Entry::Correction(correction) => {
                self.correct(correction, line.number).ok_or_else(|| misfit("a correction of an unknown sample"))?;
            }
            Entry::Row(row) => {
                self.rows.get(*row).ok_or_else(|| misfit("a row that is in no plan"))?;
                self.shown = Some(*row);
                self.through_home = None;
            }
            Entry::Passed { pose, joints } => {
                self.pass(pose, joints).ok_or_else(|| misfit("a stop that does not fit the robot"))?;
                self.through_home = None;
            }
            Entry::ThroughHome(row) => {
                self.rows.get(*row).ok_or_else(|| misfit("a row that is in no plan"))?;
                self.through_home = Some(*row);
            }
            Entry::Skipped { row, skipped } => {
                self.rows.get_mut(*row).ok_or_else(|| misfit("a row that is in no plan"))?.skipped = *skipped;
                self.shown = Some(*row);
            }
            Entry::Note { pose, text } => self.note(line.time, pose.clone(), text.clone()),
            Entry::About(about) => {
                self.about = about.clone();
                self.name_the_arm();
                // The report on disk says something else.
                self.delivered.clear();
            }
            Entry::Identified(result) => {
                self.identified = Some(result.clone());
                self.name_the_arm();
                self.has_result = true;
                // Files of an earlier result are not those of this one.
                self.delivered.clear();
                self.left_out.clear();
                self.corrected.clear();
            }
            Entry::Delivered { files, left_out, sums } => {
                self.delivered.clone_from(files);
                self.delivered_sums.clone_from(sums);
                self.left_out.clone_from(left_out);
            }
            Entry::Corrected(program) => {
                self.corrected.retain(|other| other.file != program.file);
                self.corrected.push(program.clone());
            }
            Entry::Resumed { .. } => {
                self.resumed += 1;
                self.closed = false;
                self.is_stop_certain = false;
            }
            Entry::Closed { .. } => self.closed = true,
        }
        self.advance(line);
        Ok(())
    }

    fn note(&mut self, time: Timestamp, pose: Option<String>, text: String) {
        self.notes.push(Note { time, pose, text });
    }

    /// Starts again with another robot, for which nothing is planned yet.
    fn change_robot(&mut self, robot: Robot) {
        self.robot = Some(robot);
        self.target = None;
        self.payload = None;
        self.cell = CellText::default();
        self.limits_set = None;
        self.rows.clear();
        self.shown = None;
        self.last_stop = None;
        self.plan = None;
        self.robot_program = None;
    }

    /// Copies the serial numbers into the result, which may be older than they are.
    fn name_the_arm(&mut self) {
        let Some(result) = &mut self.identified else { return };
        let of_calibration = result.calibration.as_mut().map(|calibration| &mut calibration.provenance);
        for provenance in of_calibration.into_iter().chain([&mut result.summary.provenance]) {
            provenance.serial.clone_from(&self.about.serial);
            provenance.instrument_serial.clone_from(&self.about.instrument_serial);
        }
    }

    /// Puts a cell into the profile. A result from before does not know it.
    fn state_cell(&mut self, cell: &CellText, line: &Line) -> Result<(), FoldError> {
        let misfit = |what: String| FoldError::Misfit { line: line.number, what };
        let known = self.robot.as_ref().ok_or_else(|| misfit("a cell without a robot".to_owned()))?;
        let text = cell.applied(&known.text).map_err(misfit)?;
        let changed = robot(line.number, &known.source, &super::sha256(text.as_bytes()), &text)?;
        if changed.profile.acceptance() != known.profile.acceptance() {
            self.limits_set = Some(LimitsSet { time: line.time, after_result: self.has_result });
        }
        self.robot = Some(changed);
        self.cell = cell.clone();
        self.identified = None;
        self.delivered.clear();
        Ok(())
    }

    /// Moves the arm to a stop; `None` if its joint values do not fit the robot.
    fn pass(&mut self, pose: &str, joints: &[f64]) -> Option<()> {
        let robot = self.robot.as_ref().filter(|_| self.fits(joints))?;
        let configuration = from_edge(joints, &robot.joint_types);
        self.last_stop = Some(Stop::Passed { pose: pose.to_owned(), configuration });
        self.is_stop_certain = true;
        Some(())
    }

    /// Moves on to the time of a line.
    fn advance(&mut self, line: &Line) {
        if let (Some(before), false) = (self.last, matches!(line.entry, Entry::Resumed { .. })) {
            let seconds = line.time.duration_since(before).as_secs_f64();
            self.worked += if (0.0..LONGEST_STEP).contains(&seconds) { seconds } else { 0.0 };
        }
        self.last = Some(line.time);
        self.lines = line.number;
        self.latest = self.latest.max(Some(line.time));
    }

    /// Position of the SMR on the flange, if it is not that of the profile.
    pub fn mounted(&self) -> Option<MountedText> {
        match self.target? {
            TargetChoice::Profile => None,
            TargetChoice::Known { xyz_mm, sigma_mm } | TargetChoice::Circles { xyz_mm, sigma_mm } => {
                Some(MountedText { xyz_mm, sigma_mm })
            }
            TargetChoice::Free { sigma_mm } => {
                let target = self.robot.as_ref()?.profile.targets().first()?;
                Some(MountedText { xyz_mm: to_xyz_mm(&target.position_in_flange, 6), sigma_mm })
            }
        }
    }

    /// The robot with the SMR where it is mounted, and with its payload.
    pub fn mounted_profile(&self) -> Option<Profile> {
        let profile = &self.robot.as_ref()?.profile;
        Some(mounted_on(profile, self.mounted().as_ref(), self.payload.as_ref()))
    }

    /// Whether nothing is really measured: in the simulated cell, or by an instrument that says that it is simulated.
    pub fn is_simulated(&self) -> bool {
        let says_so = |identity: &String| identity.to_lowercase().contains("simulated");
        matches!(self.instrument, Some(InstrumentChoice::Simulated(_))) || self.identities.iter().any(says_so)
    }

    /// Notice for everything that is made from the points of this session, if they are simulated.
    pub fn simulation(&self) -> Option<String> {
        let cause = match &self.instrument {
            Some(InstrumentChoice::Simulated(simulation)) => format!("the simulated cell (seed {})", simulation.seed),
            _ => format!("a simulated instrument ({})", self.identities.join("; ")),
        };
        let said = format!("the points come from {cause}, not from a robot; this result is for no real arm");
        self.is_simulated().then_some(said)
    }

    /// Whether anything was measured.
    pub fn has_measurements(&self) -> bool {
        !self.samples.is_empty() || !self.circle_points.is_empty() || !self.joint_check.is_empty()
    }

    /// The samples that count.
    pub fn counted(&self) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(|sample| sample.state == SampleState::Counts)
    }

    /// The samples of a kind that count.
    pub fn counted_of(&self, kind: PoseKind) -> impl Iterator<Item = &Sample> {
        self.counted().filter(move |sample| self.kind_of(sample) == kind)
    }

    /// Purpose of a sample.
    pub fn kind_of(&self, sample: &Sample) -> PoseKind {
        self.rows.get(sample.row).map_or(sample.noted.kind, |row| row.planned.kind)
    }

    /// Name of the pose of a sample.
    pub fn pose_of<'a>(&'a self, sample: &'a Sample) -> &'a str {
        self.rows.get(sample.row).map_or(&sample.noted.pose, |row| &row.planned.pose)
    }

    /// The sample of a measurement.
    pub fn sample(&self, number: u64) -> Option<&Sample> {
        // Numbers rise from sample to sample.
        let index = self.samples.binary_search_by_key(&number, |sample| sample.noted.number).ok()?;
        self.samples.get(index)
    }

    /// The sample of a row that counts.
    pub fn sample_of_row(&self, row: usize) -> Option<&Sample> {
        self.counted().find(|sample| sample.row == row)
    }

    /// Whether a row is still to be measured.
    pub fn is_open(&self, index: usize) -> bool {
        self.rows.get(index).is_some_and(Row::is_planned)
            && !self
                .samples
                .iter()
                .any(|sample| sample.row == index && matches!(sample.state, SampleState::Counts | SampleState::LeftOut))
    }

    /// Rows still to be measured, in order.
    pub fn open_rows(&self) -> impl Iterator<Item = usize> {
        let is_measured = |sample: &&Sample| matches!(sample.state, SampleState::Counts | SampleState::LeftOut);
        // Once for all rows: large tables have as many of them as samples.
        let measured: BTreeSet<usize> = self.samples.iter().filter(is_measured).map(|sample| sample.row).collect();
        let rows = self.rows.iter().enumerate();
        rows.filter(|(_, row)| row.is_planned()).map(|(index, _)| index).filter(move |index| !measured.contains(index))
    }

    /// Measured point of a sample in the tracker frame (m), corrections applied.
    pub fn point_of(&self, sample: &Sample) -> Point3<f64> {
        self.point_noted(&sample.noted)
    }

    /// As for a sample, from a record that need not be in the session yet.
    pub fn point_noted(&self, noted: &MeasuredText) -> Point3<f64> {
        from_xyz_mm(noted.xyz_mm) * self.scale_noted(noted)
    }

    /// A point of the circles in the tracker frame (m), corrections applied.
    pub fn point_of_circle(&self, point: &JointPointText<usize>) -> Point3<f64> {
        from_xyz_mm(point.xyz_mm) * self.correction_of(point.number)
    }

    /// Configuration of the robot at a sample: pendant values (rad, m).
    pub fn configuration_of(&self, sample: &Sample) -> Vec<f64> {
        self.robot.as_ref().map_or_else(Vec::new, |robot| from_edge(&sample.joints, &robot.joint_types))
    }

    /// Where the arm was last known to be: the stop in words and pendant values (rad, m). Corrections of its sample apply.
    pub fn arm(&self) -> Option<(String, Vec<f64>)> {
        match self.last_stop.as_ref()? {
            Stop::Passed { pose, configuration } => Some((pose.clone(), configuration.clone())),
            Stop::Sample(number) => {
                let sample = self.sample(*number)?;
                Some((format!("pose {}", self.pose_of(sample)), self.configuration_of(sample)))
            }
        }
    }

    /// Standard deviation of a sample (m), where the instrument stated one.
    pub fn sigma_of(&self, sample: &Sample) -> Option<f64> {
        self.sigma_noted(&sample.noted)
    }

    /// As for a sample, from a record that need not be in the session yet.
    pub fn sigma_noted(&self, noted: &MeasuredText) -> Option<f64> {
        Some(from_mm(noted.sigma_mm?) * self.scale_noted(noted)).filter(|sigma| *sigma > 0.0)
    }

    /// Open findings, oldest first, with the samples they are about: those that count and were neither kept nor corrected.
    pub fn doubts(&self) -> impl Iterator<Item = (&Sample, &FindingText)> {
        let findings = self.counted().flat_map(|holder| {
            let number = holder.noted.number;
            holder.noted.findings.iter().map(move |finding| (number, finding))
        });
        findings.filter_map(|(holder, finding)| {
            let about = self.sample(finding.about)?;
            let is_open = about.state == SampleState::Counts && !about.kept && holder > about.settled;
            is_open.then_some((about, finding))
        })
    }

    /// Numbers of the measurements that a result would be based on now.
    pub fn basis(&self) -> Vec<u64> {
        let of = |kind| self.counted_of(kind).map(|sample| sample.noted.number);
        of(PoseKind::Identification).chain(of(PoseKind::Verification)).collect()
    }

    /// Whether the last result is based on exactly the samples that count now.
    pub fn is_current(&self) -> bool {
        self.identified.as_ref().is_some_and(|result| result.samples == self.basis())
    }

    fn planned_rows(&self, rows: &[PlannedText]) -> Option<Vec<Row>> {
        let robot = self.robot.as_ref()?;
        rows.iter().all(|row| self.fits(&row.joints)).then(|| {
            let planned = rows.iter().map(|row| row.planned(&robot.joint_types));
            planned.map(|planned| Row { planned, active: true, skipped: false }).collect()
        })
    }

    /// Whether these are joint values of the robot.
    fn fits(&self, joints: &[f64]) -> bool {
        let dof = self.robot.as_ref().map(|robot| robot.joint_types.len());
        dof == Some(joints.len()) && joints.iter().all(|value| value.is_finite())
    }

    fn add_sample(&mut self, noted: &MeasuredText, line: &Line) -> Result<(), &'static str> {
        if noted.row >= self.rows.len() {
            return Err("a sample of a row that is in no plan");
        }
        if noted.number <= self.measurements {
            return Err("a measurement with a number that was already used");
        }
        if !(self.fits(&noted.joints) && noted.reported_joints.as_deref().is_none_or(|joints| self.fits(joints))) {
            return Err("a sample whose joint values do not fit the robot");
        }
        if !noted.factor.is_none_or(is_factor) {
            return Err("a sample in an impossible unit");
        }
        self.measurements = noted.number;
        self.shown = Some(noted.row);
        self.last_stop = Some(Stop::Sample(noted.number));
        self.is_stop_certain = true;
        self.through_home = None;
        // Most rows are measured once: of a large table not every sample need be looked through for every one.
        let again = if noted.row < self.rows_measured { self.samples.as_mut_slice() } else { &mut [] };
        for sample in again.iter_mut().filter(|sample| sample.row == noted.row) {
            if matches!(sample.state, SampleState::Counts | SampleState::LeftOut) {
                sample.state = SampleState::Superseded;
            }
        }
        self.rows_measured = self.rows_measured.max(noted.row + 1);
        self.samples.push(Sample {
            row: noted.row,
            joints: noted.reported_joints.clone().unwrap_or_else(|| noted.joints.clone()),
            noted: noted.clone(),
            time: line.time,
            state: SampleState::Counts,
            kept: false,
            settled: 0,
        });
        Ok(())
    }

    fn sample_mut(&mut self, number: u64) -> Option<&mut Sample> {
        self.samples.iter_mut().find(|sample| sample.noted.number == number)
    }

    fn decide(&mut self, number: u64, decision: Decision) -> Option<()> {
        let sample = self.sample_mut(number)?;
        match decision {
            Decision::Keep => {
                sample.kept = true;
                if sample.state == SampleState::LeftOut {
                    sample.state = SampleState::Counts;
                }
            }
            // One that does not count anyway stays what it is: it must not come back beside the one that counts instead.
            Decision::LeaveOut if sample.state == SampleState::Counts => sample.state = SampleState::LeftOut,
            Decision::LeaveOut => {}
            Decision::Undo => {
                sample.state = SampleState::Undone;
                self.shown = Some(sample.row);
            }
        }
        Some(())
    }
}

fn robot(line: u64, source: &str, sha256: &str, text: &str) -> Result<Robot, FoldError> {
    let error = |message: String| FoldError::Profile { line, message };
    if super::sha256(text.as_bytes()) != sha256 {
        return Err(error("its hash does not fit its text".to_owned()));
    }
    let (profile, _) = Profile::parse(text, source).map_err(|errors| error(errors.to_string()))?;
    let joint_types = profile.chain().joints().iter().map(|joint| joint.joint_type).collect();
    Ok(Robot { source: source.to_owned(), sha256: sha256.to_owned(), text: text.to_owned(), profile, joint_types })
}

#[cfg(test)]
mod tests;
