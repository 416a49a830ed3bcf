//! Step Capture: pose by pose, every point checked against all earlier ones.

mod checks;
mod conditions;
mod messages;
mod pasted;
mod prediction;
mod proposed;
mod show;
mod way;

use super::plan::{PLAN_FILE, measuring_pace, plan_not_saved, plan_request, plan_text, write_plan};
use super::{Action, Condition, Cx, StepMachine, offer, require, with_default};
use crate::session::journal::{
    Decision, Entry, FindingCause, FindingText, Line, MeasuredText, from_xyz_mm, to_edge, to_xyz_mm,
};
use crate::session::plan::PoseKind;
use crate::session::reading::{MeasureRequest, Reading};
use crate::session::set_up::{CoordinateUnit, InstrumentChoice, Step};
use crate::session::state::{Row, Sample, SampleState, Session, Undoable};
use crate::text::printable;
use crate::units::{from_mm, to_mm};
use crate::wizard::effect::{Answer, Request};
use crate::wizard::intent::{Danger, Intent, IntentInfo, PlanSettings};
use crate::wizard::notice::{Notice, Problem};
use crate::wizard::reading;
use crate::wizard::view::{Content, MoveCheck};
use conditions::Conditions;
use messages::{bounded, corrected, not_as_planned, other_unit, refused, remarked};
use prediction::Prediction;
pub(super) use prediction::fewest_samples;
use way::{Way, Waypoint};

/// Number of poses that are suggested at a time.
const SUGGESTED: usize = 5;

#[derive(Clone, Debug)]
pub(in crate::wizard) struct CaptureStep {
    /// Row of the plan that is shown.
    row: Option<usize>,
    /// The way to that row.
    way: Way,
    /// Row at which something was measured although stops were still ahead: the arm is there.
    reached: Option<usize>,
    /// A reading that the checks hold back.
    held: Option<HeldReading>,
    /// Measurement number of the questioned sample, about which the operator has to decide.
    questioned: Option<u64>,
    /// Whether a measurement is running. Only then is a failed request a refused measurement.
    measuring: bool,
    /// Fewest identification samples, if known. Neither robot nor SMR change during this step.
    fewest: Option<usize>,
    /// Prediction from the samples so far.
    prediction: Prediction,
    /// Number of the measurement that is being written and that the prediction already includes.
    expected: Option<u64>,
    /// Points that were pasted or read from a file and wait for their turn.
    pasted: pasted::Pasted,
    /// Points that are shown to be looked at before they are taken.
    proposal: Option<proposed::Proposal>,
}

/// A reading that counts only if the operator accepts it.
#[derive(Clone, Debug)]
struct HeldReading {
    noted: MeasuredText,
    reason: String,
}

/// Whether there are enough identification samples, if it takes `fewest`.
pub(super) fn has_enough(session: &Session, fewest: Option<usize>) -> Condition {
    let measured = session.counted_of(PoseKind::Identification).count();
    match fewest {
        Some(fewest) if measured < fewest => {
            Err(format!("{measured} of at least {fewest} identification poses have been measured"))
        }
        Some(_) | None => Ok(()),
    }
}

impl CaptureStep {
    /// Row of the plan that is shown.
    pub(super) const fn shown_row(&self) -> Option<usize> {
        self.row
    }

    /// Enters the step at the row that was shown last, or at the next one that is open.
    pub(super) fn enter(session: &Session) -> Self {
        let last = session.shown.unwrap_or(0);
        let fewest = fewest_samples(session);
        let mut step = Self {
            row: session.open_rows().find(|row| *row >= last).or_else(|| session.open_rows().next()),
            way: Way::default(),
            reached: None,
            held: None,
            questioned: None,
            measuring: false,
            fewest,
            prediction: Prediction::of(session, fewest),
            expected: None,
            pasted: pasted::Pasted::new(),
            proposal: None,
        };
        step.question_last_doubt(session);
        step.find_way(session);
        step
    }

    /// Finds the way to the row shown from where the arm is now.
    fn find_way(&mut self, session: &Session) {
        self.way = self.row.map_or_else(Way::default, |row| Way::to(row, session));
        self.reached = self.reached.filter(|row| Some(*row) == self.row);
    }

    /// Stops before the pose shown, unless something was measured there already.
    fn stops(&self) -> &[Waypoint] {
        if self.reached.is_some() && self.reached == self.row { &[] } else { &self.way.stops }
    }

    /// Check of the next move. Whoever measures before the stops that are ahead has arrived without them.
    fn move_check(&self) -> MoveCheck {
        if self.way.stops.len() > self.stops().len() { MoveCheck::Arrived } else { self.way.check.clone() }
    }

    /// The configuration to go to next: that of a stop or of the pose shown.
    pub(super) fn next_stop(&self) -> Option<&[f64]> {
        self.stops().first().map(|stop| stop.configuration.as_slice())
    }

    /// Questions the last sample that is in doubt, if there is one, and shows its row.
    fn question_last_doubt(&mut self, session: &Session) {
        let doubt = session.doubts().map(|(sample, _)| (sample.noted.number, sample.row)).last();
        self.questioned = doubt.map(|(number, _)| number);
        self.row = doubt.map(|(_, row)| row).or(self.row);
    }

    /// The next open row after the one shown, or else the first open row.
    fn following(&self, session: &Session) -> Option<usize> {
        let after = self.row.map_or(0, |row| row + 1);
        session.open_rows().find(|row| *row >= after).or_else(|| session.open_rows().find(|row| Some(*row) != self.row))
    }

    fn advance(&mut self, session: &Session) {
        self.row = self.following(session).or_else(|| session.open_rows().next());
    }

    fn measure(&mut self, cx: &Cx<'_>, row: usize) -> Vec<Action> {
        let Some(shown) = cx.session.rows.get(row) else { return Vec::new() };
        self.measuring = true;
        self.reached = Some(row);
        let pace = measuring_pace();
        let following = self.following(cx.session).and_then(|row| cx.session.rows.get(row));
        vec![Action::Ask(Request::Measure(MeasureRequest {
            number: cx.session.measurements + 1,
            pose: shown.planned.pose.clone(),
            target: 0,
            configuration: shown.planned.configuration.clone(),
            following: following.map(|row| row.planned.configuration.clone()),
            settle: pace.settle,
            shots: pace.shots,
        }))]
    }

    /// The record of a reading at a row of the plan, before any check.
    fn noted(reading: &Reading, row: usize, cx: &Cx<'_>) -> Option<MeasuredText> {
        let robot = cx.robot()?;
        let planned = &cx.session.rows.get(row)?.planned;
        let reported = reading.configuration.as_deref().map(|values| to_edge(values, &robot.joint_types));
        let scatter = reading.joint_scatter.as_ref();
        Some(MeasuredText {
            number: cx.session.measurements + 1,
            row,
            pose: planned.pose.clone(),
            kind: planned.kind,
            target: 0,
            joints: to_edge(&planned.configuration, &robot.joint_types),
            reported_joints: reported,
            reported_scatter: scatter.map(|scatter| to_edge(&scatter.sigma, &robot.joint_types)),
            reported_count: scatter.map(|scatter| scatter.count),
            xyz_mm: to_xyz_mm(&reading.point, 9),
            factor: None,
            sigma_mm: reading.sigma.filter(|sigma| sigma.is_finite() && *sigma > 0.0).map(to_mm),
            scatter_mm: reading
                .scatter
                .filter(|scatter| scatter.is_finite())
                .map(|scatter| (to_mm(scatter) * 1e6).round() / 1e6),
            shots: reading.shots,
            temperature_degc: reading.temperature,
            pressure_hpa: reading.pressure.filter(|value| value.is_finite()),
            humidity_percent: reading.humidity.filter(|value| value.is_finite()),
            seconds: reading.seconds,
            predicted_error_sigma: None,
            remarks: reading.remarks.iter().map(|remark| remark.text.clone()).collect(),
            findings: Vec::new(),
        })
    }

    /// Takes a reading of the row shown: refuses it, holds it back, or writes it as a sample.
    fn take(&mut self, reading: &Reading, cx: &Cx<'_>) -> Vec<Action> {
        let (Some(row), Some(robot)) = (self.row, cx.robot()) else { return Vec::new() };
        let Some(noted) = Self::noted(reading, row, cx) else { return Vec::new() };
        self.reached = Some(row);
        let previous = cx.session.samples.last().map(|sample| sample.noted.xyz_mm);
        let previous = previous.map(from_xyz_mm);
        let gate = reading::gate(&from_xyz_mm(noted.xyz_mm), previous.as_ref());
        if let Some(reason) = gate.or_else(|| reading::foreign_joints(reading, robot.joint_types.len())) {
            let notice = Notice::error(format!("pose {}: {reason}", noted.pose)).hint("measure again");
            return vec![Action::Write(vec![refused(&noted, reason)]), Action::Say(notice)];
        }
        let sigma =
            noted.sigma_mm.map(from_mm).or_else(|| robot.profile.instrument().map(|instrument| instrument.sigma));
        let limit = reading::scatter_limit(sigma);
        if let Some(scatter) = reading.scatter
            && (scatter.is_nan() || scatter > limit)
        {
            let reason = reading::scatter_message(scatter, limit);
            let entry = refused(&noted, reason.clone());
            self.held = Some(HeldReading { noted, reason: reason.clone() });
            let notice = Notice::attention(reason)
                .hint("wait until the robot is at rest and measure again, or accept the reading");
            return vec![Action::Write(vec![entry]), Action::Say(notice)];
        }
        let mut noted = noted;
        checks::judge(cx, &mut noted);
        // Of two messages only the later one would stay on the screen, and a robot at another place matters more.
        let remark = not_as_planned(&noted, robot).or_else(|| remarked(&noted.pose, reading));
        [Action::Write(vec![self.sample(noted, cx)])].into_iter().chain(remark.map(Action::Say)).collect()
    }

    /// The entry of a sample, with the error predicted for a calibration from all samples up to this one.
    fn sample(&mut self, mut noted: MeasuredText, cx: &Cx<'_>) -> Entry {
        let mut with = cx.session.clone();
        let line = Line { number: with.lines + 1, time: cx.now, entry: Entry::Sample(noted.clone()) };
        if with.apply(&line).is_ok() {
            if self.expected.replace(noted.number).is_some() {
                // The last one was never written.
                self.prediction.restart(cx.session);
            }
            self.prediction.follow(&with, noted.number);
            let in_sigma = |error: f64| (error / self.prediction.sigma * 1e6).round() / 1e6;
            noted.predicted_error_sigma = self.prediction.now().map(in_sigma);
        }
        Entry::Sample(noted)
    }

    /// The questioned sample with its finding.
    fn doubt<'a>(&self, session: &'a Session) -> Option<(&'a Sample, &'a FindingText)> {
        let number = self.questioned?;
        session.doubts().filter(|(sample, _)| sample.noted.number == number).last()
    }

    /// Shows the row of the questioned sample, if there is one.
    fn show_questioned(&mut self, session: &Session) {
        let questioned = self.questioned.and_then(|number| session.sample(number));
        self.row = questioned.map(|sample| sample.row).or(self.row);
    }

    fn decide(&self, decision: Decision) -> Vec<Action> {
        self.questioned.map(|sample| Action::Write(vec![Entry::Decision { sample, decision }])).into_iter().collect()
    }

    /// Shows a row by the name of its pose. A skipped pose is no longer skipped.
    fn go_to(pose: &str, session: &Session) -> Vec<Action> {
        let Some(row) = row_of_pose(pose, session) else {
            let pose = printable(pose);
            return vec![Action::Say(Notice::error(format!("there is no pose '{pose}' in the plan")))];
        };
        let is_skipped = session.rows.get(row).is_some_and(|row| row.skipped);
        let unskip = is_skipped.then_some(Entry::Skipped { row, skipped: false });
        vec![Action::Write(unskip.into_iter().chain([Entry::Row(row)]).collect())]
    }

    /// Follows an entry that is on disk and in the session.
    fn follow(&mut self, entry: &Entry, session: &Session) -> Vec<Action> {
        match entry {
            Entry::Sample(noted) => {
                self.held = None;
                if self.expected.take() != Some(noted.number) {
                    self.prediction.restart(session);
                }
                self.question_last_doubt(session);
                match (self.questioned, noted.findings.first()) {
                    (Some(_), Some(finding)) => {
                        return vec![Action::Say(Notice::attention(finding.message.clone()))];
                    }
                    (Some(_), None) => {}
                    (None, _) => self.advance(session),
                }
                let is_again = |sample: &Sample| sample.row == noted.row && sample.state == SampleState::Superseded;
                if self.questioned.is_none() && noted.factor.is_none() && session.samples.iter().any(is_again) {
                    return vec![Action::Say(Notice::info(format!("pose {} fits now", noted.pose)))];
                }
                if let Some(factor) = noted.factor {
                    return vec![Action::Say(other_unit(noted, factor))];
                }
            }
            Entry::Decision { sample, decision } => {
                self.prediction.restart(session);
                match decision {
                    Decision::Undo => self.row = session.sample(*sample).map(|sample| sample.row),
                    // A pose that waits is still the next one.
                    Decision::Keep | Decision::LeaveOut if self.row.is_some_and(|row| session.is_open(row)) => {}
                    Decision::Keep | Decision::LeaveOut => self.advance(session),
                }
                self.question_last_doubt(session);
            }
            Entry::Correction(correction) => {
                self.prediction.restart(session);
                // The order of the plan continues from here, unless the sample turned out to be of another pose.
                if self.row.is_none_or(|row| !session.is_open(row)) {
                    self.advance(session);
                }
                self.question_last_doubt(session);
                return vec![Action::Say(Notice::info(corrected(correction)))];
            }
            Entry::Undone { what, .. } => {
                self.turned_back(session);
                if let Some(row) = session.shown.filter(|row| session.is_open(*row)) {
                    self.row = Some(row);
                }
                self.question_last_doubt(session);
                return vec![Action::Say(Notice::info(format!("undone: {what}")).hint("redo does it after all"))];
            }
            Entry::Redone { what, .. } => {
                self.turned_back(session);
                if self.row.is_none_or(|row| !session.is_open(row)) {
                    self.advance(session);
                }
                self.question_last_doubt(session);
                return vec![Action::Say(Notice::info(format!("done again: {what}")))];
            }
            Entry::Row(row) => {
                self.row = Some(*row);
                self.held = None;
            }
            Entry::Skipped { row, skipped: true } => {
                self.advance(session);
                let pose = session.rows.get(*row).map_or("?", |row| row.planned.pose.as_str());
                let notice = Notice::info(format!("pose {pose} is skipped")).hint("go to it to measure it after all");
                return vec![Action::Say(notice)];
            }
            Entry::Note { pose, .. } => {
                let about = pose.as_ref().map_or_else(String::new, |pose| format!(" to pose {pose}"));
                return vec![Action::Say(Notice::info(format!("note{about} saved")))];
            }
            Entry::PlanExtended(_) | Entry::Plan(_) => {
                self.prediction.restart(session);
                self.row = self.row.filter(|row| session.is_open(*row)).or_else(|| session.open_rows().next());
                return write_plan(session).into_iter().collect();
            }
            _ => {}
        }
        Vec::new()
    }

    /// Forgets what belongs to the state before an undo or a redo.
    fn turned_back(&mut self, session: &Session) {
        self.held = None;
        self.expected = None;
        self.prediction.restart(session);
    }

    /// Excludes a pose, or lets it count again.
    fn count_pose(pose: &str, counts: bool, session: &Session) -> Vec<Action> {
        let say = |text: String| vec![Action::Say(Notice::error(text))];
        let Some(row) = row_of_pose(pose, session) else {
            return say(format!("there is no pose '{}' in the plan", printable(pose)));
        };
        let (state, decision, reason) = if counts {
            (SampleState::LeftOut, Decision::Keep, "is not excluded")
        } else {
            (SampleState::Counts, Decision::LeaveOut, "has no sample that counts")
        };
        let sample = session.samples.iter().find(|sample| sample.row == row && sample.state == state);
        match sample {
            Some(sample) => vec![Action::Write(vec![Entry::Decision { sample: sample.noted.number, decision }])],
            None => say(format!("pose {} {reason}", session.row_name(row))),
        }
    }

    fn manual_unit(cx: &Cx<'_>) -> Option<CoordinateUnit> {
        match cx.session.instrument {
            Some(InstrumentChoice::Manual { unit }) => Some(unit),
            _ => None,
        }
    }
}

/// The label of undo or redo, with what it would be.
fn turned(verb: &str, action: Option<Undoable>) -> String {
    action.map_or_else(|| verb.to_owned(), |action| format!("{verb}: {}", action.what))
}

/// The row of a pose by its name: an open one, else a skipped one, else one that is done.
fn row_of_pose(pose: &str, session: &Session) -> Option<usize> {
    let rows = session.rows.iter().enumerate();
    let is_named = |(index, row): &(usize, &Row)| {
        row.planned.kind.is_measured() && (row.planned.pose == pose || session.row_name(*index) == pose)
    };
    let named: Vec<(usize, &Row)> = rows.filter(is_named).collect();
    // The first active row is the pose itself; its repetitions for drift come later.
    let found = (named.iter().find(|(index, _)| session.is_open(*index)))
        .or_else(|| named.iter().find(|(_, row)| row.active && row.skipped))
        .or_else(|| named.iter().find(|(_, row)| row.active))
        .or_else(|| named.last());
    found.map(|(index, _)| *index)
}

impl StepMachine for CaptureStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        if let Some(proposal) = &self.proposal {
            return proposal.intents();
        }
        let session = cx.session;
        let is = Conditions { step: self, cx };
        let shown = self.row.and_then(|row| session.rows.get(row));
        let pose = shown.map(|row| row.planned.pose.clone()).unwrap_or_default();
        let type_in = Intent::TypeReading(String::new());
        let intents = vec![
            offer(
                Intent::Measure,
                "measure",
                [is.at_a_pose(), is.connected(), is.automatic(), is.resolved(), is.online()],
            ),
            offer(type_in.clone(), "type the coordinates", [is.typed(), is.at_a_pose_or_questioned(), is.connected()]),
            offer(Intent::AcceptReading, "accept the reading", [is.held()]),
            offer(
                Intent::MeasureAgain,
                "measure again",
                [is.questioned(), is.automatic(), is.connected(), is.online()],
            ),
            offer(Intent::Keep, "keep the sample", [is.questioned()]),
            offer(Intent::LeaveOut, "exclude this sample", [is.questioned()]).with_danger(Danger::DropsData),
            offer(Intent::ApplyRemedy, "apply the correction", [is.correctable()]),
            offer(Intent::Passed, "the arm is there", [is.at_a_pose(), is.resolved(), is.on_the_way()]),
            offer(Intent::ThroughHome, "go through home", [is.at_a_pose(), is.resolved(), is.homeward()]),
            offer(Intent::Skip, "skip this pose", [is.at_a_pose(), is.resolved()]),
            offer(Intent::Undo, &turned("undo", session.undoable()), [is.undoable()]),
            offer(Intent::Redo, &turned("redo", session.redoable()), [is.redoable()]),
            offer(Intent::Exclude(String::new()), "exclude a pose", [is.sampled()]),
            offer(Intent::Include(String::new()), "let an excluded pose count again", [is.excluded()]),
            offer(Intent::ReadPoints(String::new()), "points from a file", [is.typed(), is.at_a_pose(), is.resolved()]),
            offer(Intent::ShowPoints(String::new()), "paste points", [is.typed(), is.at_a_pose(), is.resolved()]),
            offer(
                Intent::GoToPose(pose),
                "go to another pose",
                [require(!session.rows.is_empty(), "there is no plan")],
            ),
            offer(Intent::Note(String::new()), "write a note", []),
            offer(Intent::NotePose { pose: String::new(), text: String::new() }, "write a note to a pose", []),
            offer(Intent::SuggestPoses(SUGGESTED), "add more poses", [is.sampled()]),
            offer(Intent::Next, "continue to Identify", [has_enough(session, self.fewest)]),
        ];
        let is_manual = Self::manual_unit(cx).is_some();
        // A pose that is measured already was chosen to be measured again.
        let has_open = self.row.is_some() || session.open_rows().next().is_some();
        let next = match (self.doubt(session), has_open) {
            (Some(_), _) if is_manual => type_in,
            (None, true) if is_manual && self.stops().is_empty() => type_in,
            (Some(_), _) => Intent::MeasureAgain,
            (None, true) if !self.stops().is_empty() => Intent::Passed,
            (None, true) => Intent::Measure,
            (None, false) => Intent::Next,
        };
        with_default(intents, &next)
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        let session = cx.session;
        match intent {
            Intent::Measure => {
                self.held = None;
                self.row.map_or_else(Vec::new, |row| self.measure(cx, row))
            }
            Intent::TypeReading(text) => self.paste(&text, cx),
            Intent::AcceptReading => {
                let Some(HeldReading { mut noted, reason }) = self.held.take() else { return Vec::new() };
                let number = session.measurements + 1;
                noted.number = number;
                checks::judge(cx, &mut noted);
                // Accepting settles the scatter. A finding about its distances is a separate question.
                let is_settled = noted.findings.is_empty();
                noted.findings.push(FindingText {
                    about: number,
                    cause: FindingCause::NotAtRest,
                    ratio: 0.0,
                    message: reason,
                    remedy: None,
                    worst: Vec::new(),
                });
                let keep = Entry::Decision { sample: number, decision: Decision::Keep };
                let entries = std::iter::once(self.sample(noted, cx)).chain(is_settled.then_some(keep));
                vec![Action::Write(entries.collect())]
            }
            Intent::MeasureAgain => {
                self.show_questioned(session);
                self.row.map_or_else(Vec::new, |row| self.measure(cx, row))
            }
            Intent::Keep => self.decide(Decision::Keep),
            Intent::LeaveOut => self.decide(Decision::LeaveOut),
            Intent::ApplyRemedy => {
                let remedy = self.doubt(session).and_then(|(_, finding)| finding.remedy.clone());
                let entry = remedy.map(|remedy| Entry::Correction(bounded(remedy, session)));
                entry.map(|entry| Action::Write(vec![entry])).into_iter().collect()
            }
            Intent::Passed => {
                let (Some(robot), Some(stop)) = (cx.robot(), self.stops().first()) else { return Vec::new() };
                let joints = to_edge(&stop.configuration, &robot.joint_types);
                vec![Action::Write(vec![Entry::Passed { pose: stop.name.clone(), joints }])]
            }
            Intent::ThroughHome => {
                self.row.map(|row| Action::Write(vec![Entry::ThroughHome(row)])).into_iter().collect()
            }
            Intent::Skip => {
                self.held = None;
                self.row.map(|row| Action::Write(vec![Entry::Skipped { row, skipped: true }])).into_iter().collect()
            }
            Intent::Undo => {
                let entry = session.undoable().map(|Undoable { line, what }| Entry::Undone { line, what });
                entry.map(|entry| Action::Write(vec![entry])).into_iter().collect()
            }
            Intent::Redo => {
                let entry = session.redoable().map(|Undoable { line, what }| Entry::Redone { line, what });
                entry.map(|entry| Action::Write(vec![entry])).into_iter().collect()
            }
            Intent::Exclude(pose) => Self::count_pose(&pose, false, session),
            Intent::Include(pose) => Self::count_pose(&pose, true, session),
            Intent::ReadPoints(file) => {
                let (Some(profile), Some(unit)) = (cx.profile(), Self::manual_unit(cx)) else { return Vec::new() };
                vec![Action::Ask(Request::ReadPoints { file, profile: Box::new(profile), unit })]
            }
            Intent::ShowPoints(text) => self.propose_pasted(&text, cx),
            Intent::TakePoints => self.take_proposed(false, cx),
            Intent::TakeAllPoints => self.take_proposed(true, cx),
            Intent::DropPoints => {
                self.proposal = None;
                vec![Action::Say(Notice::info("no point was taken"))]
            }
            Intent::NotePose { pose, text } => {
                let text = printable(text.trim());
                match row_of_pose(&pose, session).and_then(|row| session.rows.get(row)) {
                    Some(_) if text.is_empty() => Vec::new(),
                    Some(row) => {
                        vec![Action::Write(vec![Entry::Note { pose: Some(row.planned.pose.clone()), text }])]
                    }
                    None => {
                        let pose = printable(&pose);
                        vec![Action::Say(Notice::error(format!("there is no pose '{pose}' in the plan")))]
                    }
                }
            }
            Intent::GoToPose(pose) => Self::go_to(&pose, session),
            Intent::Note(text) => {
                let text = printable(text.trim());
                let pose = self.row.and_then(|row| session.rows.get(row)).map(|row| row.planned.pose.clone());
                let entry = (!text.is_empty()).then_some(Entry::Note { pose, text });
                entry.map(|entry| Action::Write(vec![entry])).into_iter().collect()
            }
            Intent::SuggestPoses(poses) => {
                let settings = PlanSettings { poses, verification: 0, drift_every: 0, ..PlanSettings::default() };
                plan_request(cx, &settings).map(Action::Ask).into_iter().collect()
            }
            Intent::Next => vec![Action::go(Step::Identify)],
            _ => Vec::new(),
        }
    }

    fn on_answer(&mut self, answer: Answer, cx: &Cx<'_>) -> Vec<Action> {
        let was_measuring = std::mem::take(&mut self.measuring);
        match answer {
            Answer::Measured(reading) if was_measuring => self.take(&reading, cx),
            Answer::Points { file, points } => self.propose(format!("'{file}'"), &points, cx),
            Answer::Delivered { .. } => vec![Action::Say(
                Notice::info(format!("the plan is saved as {PLAN_FILE} in the folder of the session")).hint(
                    "make the robot program from it, and drive it once by hand at reduced speed before measuring",
                ),
            )],
            Answer::Planned { summary, rows, .. } => {
                let new: Vec<_> = rows.into_iter().filter(|row| row.kind != PoseKind::Home).collect();
                let origin = format!("{} suggested poses", new.iter().filter(|row| row.kind.is_measured()).count());
                vec![Action::Write(vec![Entry::PlanExtended(plan_text(cx, summary.as_deref(), &new, origin))])]
            }
            _ => Vec::new(),
        }
    }

    fn on_failure(&mut self, problem: Problem, cx: &Cx<'_>) -> Vec<Action> {
        let was_measuring = std::mem::take(&mut self.measuring);
        if problem.is_unwritten {
            return vec![Action::Say(plan_not_saved(problem))];
        }
        let row = self.row.filter(|_| was_measuring).and_then(|row| cx.session.rows.get(row));
        let Some(row) = row else { return vec![Action::Say(problem.into())] };
        let pose = row.planned.pose.clone();
        cx.refuse(pose, problem)
    }

    fn on_applied(&mut self, entry: &Entry, cx: &Cx<'_>) -> Vec<Action> {
        let mut actions = self.follow(entry, cx.session);
        self.find_way(cx.session);
        actions.extend(self.continue_pasted(entry, cx));
        actions
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        Content::Capture(Box::new(show::view(self, cx)))
    }
}
