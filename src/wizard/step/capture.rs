//! Capture: pose by pose, every point checked against all earlier ones.

mod checks;
mod prediction;
mod show;

use super::plan::{plan_request, plan_text};
use super::{Action, Cx, StepMachine};
use crate::session::journal::{
    Correction, Decision, Entry, FindingCause, FindingText, Line, MeasuredText, to_edge, to_xyz_mm,
};
use crate::session::plan::PoseKind;
use crate::session::reading::{MeasureRequest, Reading};
use crate::session::set_up::{CoordinateUnit, InstrumentChoice, Step};
use crate::session::state::{Robot, Sample, SampleState, Session};
use crate::units::{from_mm, to_mm};
use crate::wizard::effect::{Answer, Request};
use crate::wizard::intent::{Danger, Intent, IntentInfo, PlanSettings};
use crate::wizard::live::AS_PLANNED;
use crate::wizard::notice::{Notice, Problem};
use crate::wizard::reading;
use crate::wizard::view::Content;
use prediction::Prediction;
pub(super) use prediction::fewest_samples;

/// Wait before the first shot (s), as in the method paper.
const SETTLE: f64 = 2.0;
/// Shots per pose.
const SHOTS: u32 = 3;
/// Poses that are proposed at a time.
const SUGGESTED: usize = 5;

/// The capture step.
#[derive(Clone, Debug)]
pub(in crate::wizard) struct CaptureStep {
    /// Row of the plan that is shown.
    row: Option<usize>,
    /// A reading that the gates hold back.
    held: Option<Held>,
    /// The sample that the operator has to look at.
    question: Option<u64>,
    /// A measurement is under way; what else fails is no refused measurement.
    measuring: bool,
    /// Fewest identification samples; neither robot nor SMR change while it is measured.
    fewest: Option<usize>,
    /// What the samples so far let expect.
    prediction: Prediction,
    /// The same with the measurement of this number, which is being written.
    expected: Option<(u64, Prediction)>,
}

/// A reading that is good enough only if the operator says so.
#[derive(Clone, Debug)]
struct Held {
    noted: MeasuredText,
    reason: String,
}

/// Why there are too few identification samples to identify from, if it takes `fewest`.
pub(super) fn too_few(session: &Session, fewest: Option<usize>) -> Option<String> {
    let fewest = fewest?;
    let measured = session.counted_of(PoseKind::Identification).count();
    (measured < fewest).then(|| format!("{measured} of at least {fewest} identification poses are measured"))
}

impl CaptureStep {
    /// Row of the plan that is shown.
    pub(super) const fn shown_row(&self) -> Option<usize> {
        self.row
    }

    /// Begins where the operator was last, or at the next row that waits to be measured.
    pub(super) fn enter(session: &Session) -> Self {
        let last = session.shown.unwrap_or(0);
        let mut step = Self {
            row: session.open_rows().find(|row| *row >= last).or_else(|| session.open_rows().next()),
            held: None,
            question: None,
            measuring: false,
            fewest: fewest_samples(session),
            prediction: Prediction::of(session),
            expected: None,
        };
        step.ask(session);
        step
    }

    /// Asks about the last sample that is in doubt, if there is one, and shows its row.
    fn ask(&mut self, session: &Session) {
        let doubt = session.doubts().map(|(sample, _)| (sample.noted.number, sample.row)).last();
        self.question = doubt.map(|(number, _)| number);
        self.row = doubt.map(|(_, row)| row).or(self.row);
    }

    /// The row after the one shown that waits to be measured, or the first one.
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
        let following = self.following(cx.session).and_then(|row| cx.session.rows.get(row));
        vec![Action::Ask(Request::Measure(MeasureRequest {
            number: cx.session.measurements + 1,
            pose: shown.planned.pose.clone(),
            target: 0,
            configuration: shown.planned.configuration.clone(),
            following: following.map(|row| row.planned.configuration.clone()),
            settle: SETTLE,
            shots: SHOTS,
        }))]
    }

    /// A reading of the row shown: held back, refused, or written.
    fn take(&mut self, reading: &Reading, cx: &Cx<'_>) -> Vec<Action> {
        let (Some(row), Some(robot)) = (self.row, cx.robot()) else { return Vec::new() };
        let Some(shown) = cx.session.rows.get(row) else { return Vec::new() };
        let number = cx.session.measurements + 1;
        let planned = &shown.planned;
        let reported = reading.configuration.as_deref().map(|values| to_edge(values, &robot.joint_types));
        let noted = MeasuredText {
            number,
            row,
            pose: planned.pose.clone(),
            kind: planned.kind,
            target: 0,
            joints: to_edge(&planned.configuration, &robot.joint_types),
            reported_joints: reported,
            xyz_mm: to_xyz_mm(&reading.point, 9),
            factor: None,
            sigma_mm: reading.sigma.filter(|sigma| sigma.is_finite() && *sigma > 0.0).map(to_mm),
            scatter_mm: reading
                .scatter
                .filter(|scatter| scatter.is_finite())
                .map(|scatter| (to_mm(scatter) * 1e6).round() / 1e6),
            shots: reading.shots,
            temperature_degc: reading.temperature,
            seconds: reading.seconds,
            predicted_error_sigma: None,
            findings: Vec::new(),
        };
        let previous = cx.session.samples.last().map(|sample| sample.noted.xyz_mm);
        let previous = previous.map(crate::session::journal::from_xyz_mm);
        let gate = reading::gate(&crate::session::journal::from_xyz_mm(noted.xyz_mm), previous.as_ref());
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
            self.held = Some(Held { noted, reason: reason.clone() });
            let notice = Notice::attention(reason)
                .hint("wait until it is at rest and measure again; or take the reading as it is");
            return vec![Action::Write(vec![entry]), Action::Say(notice)];
        }
        let mut noted = noted;
        checks::judge(cx, &mut noted);
        let remark = not_as_planned(&noted, robot);
        [Action::Write(vec![self.sample(noted, cx)])].into_iter().chain(remark.map(Action::Say)).collect()
    }

    /// A sample with what a calibration from all samples up to it would be worth.
    fn sample(&mut self, mut noted: MeasuredText, cx: &Cx<'_>) -> Entry {
        let mut with = cx.session.clone();
        let line = Line { number: with.lines + 1, time: cx.now, entry: Entry::Sample(noted.clone()) };
        if with.apply(&line).is_ok() {
            let prediction = Prediction::of(&with);
            noted.predicted_error_sigma = prediction.now().map(|sigma| (sigma * 1e6).round() / 1e6);
            self.expected = Some((noted.number, prediction));
        }
        Entry::Sample(noted)
    }

    /// The sample in question with what was found about it.
    fn asked<'a>(&self, session: &'a Session) -> Option<(&'a Sample, &'a FindingText)> {
        let number = self.question?;
        session.doubts().filter(|(sample, _)| sample.noted.number == number).last()
    }

    fn decide(&self, decision: Decision) -> Vec<Action> {
        self.question.map(|sample| Action::Write(vec![Entry::Decision { sample, decision }])).into_iter().collect()
    }

    /// Shows a row by the name of its pose: one that waits, else one that is skipped, else one that is done.
    fn go_to(pose: &str, session: &Session) -> Vec<Action> {
        let named = |row: &usize| {
            session.rows.get(*row).is_some_and(|row| row.planned.pose == pose && row.planned.kind.is_measured())
        };
        let rows: Vec<usize> = (0..session.rows.len()).filter(named).collect();
        let active = |row: &&usize| session.rows.get(**row).is_some_and(|row| row.active);
        let skipped = |row: &&usize| active(row) && session.rows.get(**row).is_some_and(|row| row.skipped);
        let found = rows.iter().find(|row| session.is_open(**row)).or_else(|| rows.iter().find(skipped));
        // Of those that are done the pose itself, not its repetitions for drift.
        let found = found.or_else(|| rows.iter().find(active)).or_else(|| rows.last()).copied();
        let Some(row) = found else {
            let pose = crate::text::printable(pose);
            return vec![Action::Say(Notice::error(format!("there is no pose '{pose}' in the plan")))];
        };
        let is_skipped = session.rows.get(row).is_some_and(|row| row.skipped);
        let after_all = is_skipped.then_some(Entry::Skipped { row, skipped: false });
        vec![Action::Write(after_all.into_iter().chain([Entry::Row(row)]).collect())]
    }

    fn manual_unit(cx: &Cx<'_>) -> Option<CoordinateUnit> {
        match cx.session.instrument {
            Some(InstrumentChoice::Manual { unit }) => Some(unit),
            _ => None,
        }
    }
}

/// What to say about a robot that stands elsewhere than shown. What it tells counts; both are kept.
fn not_as_planned(noted: &MeasuredText, robot: &Robot) -> Option<Notice> {
    let reported = noted.reported_joints.as_ref()?;
    let differences = reported.iter().zip(&noted.joints).map(|(reported, shown)| (reported - shown).abs());
    let (joint, difference) = differences.enumerate().max_by(|(_, one), (_, other)| one.total_cmp(other))?;
    let joint = robot.profile.chain().joints().get(joint)?;
    let quantity = joint.joint_type.quantity();
    (quantity.from_edge(difference) > AS_PLANNED).then(|| {
        Notice::attention(format!(
            "pose {}: the robot stands {difference:.3} {} away from the plan at joint {}",
            noted.pose,
            quantity.unit(),
            joint.name
        ))
        .hint("what the robot tells counts, the plan is kept beside it; measure again if this was not meant")
    })
}

/// A reading that is no sample.
fn refused(noted: &MeasuredText, reason: String) -> Entry {
    let xyz_mm =
        [noted.xyz_mm.0, noted.xyz_mm.1, noted.xyz_mm.2].iter().all(|value| value.is_finite()).then_some(noted.xyz_mm);
    Entry::Refused { number: noted.number, pose: noted.pose.clone(), reason, xyz_mm }
}

impl StepMachine for CaptureStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let session = cx.session;
        let no_row = self.row.is_none().then(|| "all poses of the plan are measured".to_owned());
        let manual = Self::manual_unit(cx).is_some();
        let by_hand = manual.then(|| "the coordinates are typed in".to_owned());
        let not_by_hand = (!manual).then(|| "the instrument measures by itself".to_owned());
        let no_instrument = cx
            .connection
            .is_none()
            .then(|| "the instrument does not answer; go back to the instrument step".to_owned());
        // A key that is pressed now must not measure later, when nobody expects it any more.
        let is_down = cx.down.map(|cause| format!("the link is down: {cause}; it is being connected again"));
        let asked = self.asked(session);
        let no_question = asked.is_none().then(|| "no sample is in question".to_owned());
        let question = asked
            .is_some()
            .then(|| "decide first about the sample in question: keep it, measure again, or leave it out".to_owned());
        let no_remedy = asked
            .and_then(|(_, finding)| finding.remedy.as_ref())
            .is_none()
            .then(|| "there is no correction to propose".to_owned());
        let not_held = self.held.is_none().then(|| "no reading is held back".to_owned());
        let no_sample = session.counted().next().is_none().then(|| "nothing is measured yet".to_owned());
        let blocked = no_row.clone().or_else(|| no_instrument.clone());
        let pose =
            self.row.and_then(|row| session.rows.get(row)).map_or_else(String::new, |row| row.planned.pose.clone());
        let has_more = session.open_rows().next().is_some();
        let measure = IntentInfo::new(Intent::Measure, "measure").unless(
            blocked.clone().or_else(|| by_hand.clone()).or_else(|| question.clone()).or_else(|| is_down.clone()),
        );
        let skip_blocked = no_row.clone().or_else(|| question.clone());
        let type_in = IntentInfo::new(Intent::TypeReading(String::new()), "type the coordinates")
            .unless(not_by_hand.or_else(|| if asked.is_some() { no_instrument.clone() } else { blocked.clone() }));
        let again_blocked = no_question.clone().or(by_hand).or_else(|| no_instrument.clone()).or(is_down);
        let next = IntentInfo::new(Intent::Next, "go on to identify").unless(too_few(session, self.fewest));
        let mut intents = vec![
            if has_more && !manual { measure.default_action() } else { measure },
            if manual && (has_more || asked.is_some()) { type_in.default_action() } else { type_in },
            IntentInfo::new(Intent::AcceptReading, "take the reading as it is").unless(not_held),
            IntentInfo::new(Intent::MeasureAgain, "measure again").unless(again_blocked).default_action(),
            IntentInfo::new(Intent::Keep, "keep the sample").unless(no_question.clone()),
            IntentInfo::new(Intent::LeaveOut, "leave the sample out")
                .unless(no_question)
                .with_danger(Danger::DropsData),
            IntentInfo::new(Intent::ApplyRemedy, "correct it as proposed").unless(no_remedy),
            IntentInfo::new(Intent::Skip, "skip this pose").unless(skip_blocked),
            IntentInfo::new(Intent::Undo, "take the last sample back")
                .unless(no_sample.clone())
                .with_danger(Danger::DropsData),
            IntentInfo::new(Intent::GoToPose(pose), "show another pose")
                .unless(session.rows.is_empty().then(|| "there is no plan".to_owned())),
            IntentInfo::new(Intent::Note(String::new()), "write a note"),
            IntentInfo::new(Intent::SuggestPoses(SUGGESTED), "add the next best poses").unless(no_sample),
        ];
        intents.push(if has_more || asked.is_some() { next } else { next.default_action() });
        intents
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        let session = cx.session;
        match intent {
            Intent::Measure => {
                self.held = None;
                self.row.map_or_else(Vec::new, |row| self.measure(cx, row))
            }
            Intent::TypeReading(text) => match reading::parse(&text, Self::manual_unit(cx).unwrap_or_default()) {
                Ok(point) => {
                    // While a sample is in question, typing is measuring it again.
                    let asked = self.question.and_then(|number| session.sample(number)).map(|sample| sample.row);
                    self.row = asked.or(self.row);
                    self.take(&reading::typed(point), cx)
                }
                Err(message) => vec![Action::Say(Notice::error(message))],
            },
            Intent::AcceptReading => {
                let Some(Held { mut noted, reason }) = self.held.take() else { return Vec::new() };
                let number = session.measurements + 1;
                noted.number = number;
                checks::judge(cx, &mut noted);
                // Taking it as it is settles that it scatters; what its distances say is another question.
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
                let row = self.question.and_then(|number| session.sample(number)).map(|sample| sample.row);
                self.row = row.or(self.row);
                self.row.map_or_else(Vec::new, |row| self.measure(cx, row))
            }
            Intent::Keep => self.decide(Decision::Keep),
            Intent::LeaveOut => self.decide(Decision::LeaveOut),
            Intent::ApplyRemedy => {
                let remedy = self.asked(session).and_then(|(_, finding)| finding.remedy.clone());
                remedy
                    .map(|remedy| Action::Write(vec![Entry::Correction(ended(remedy, session))]))
                    .into_iter()
                    .collect()
            }
            Intent::Skip => {
                self.held = None;
                self.row.map(|row| Action::Write(vec![Entry::Skipped { row, skipped: true }])).into_iter().collect()
            }
            Intent::Undo => {
                let last = session.samples.iter().rev().find(|sample| sample.state == SampleState::Counts);
                last.map(|sample| Action::Write(undo(sample.noted.number, session))).into_iter().collect()
            }
            Intent::GoToPose(pose) => Self::go_to(&pose, session),
            Intent::Note(text) => {
                let text = crate::text::printable(text.trim());
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
            Answer::Planned { summary, rows, .. } => {
                let new: Vec<_> = rows.into_iter().filter(|row| row.kind != PoseKind::Home).collect();
                let origin = format!("{} next best poses", new.iter().filter(|row| row.kind.is_measured()).count());
                vec![Action::Write(vec![Entry::PlanExtended(plan_text(cx, summary.as_deref(), &new, origin))])]
            }
            _ => Vec::new(),
        }
    }

    fn on_failure(&mut self, problem: Problem, cx: &Cx<'_>) -> Vec<Action> {
        let was_measuring = std::mem::take(&mut self.measuring);
        let row = self.row.filter(|_| was_measuring).and_then(|row| cx.session.rows.get(row));
        let Some(row) = row else { return vec![Action::Say(problem.into())] };
        let pose = row.planned.pose.clone();
        let number = cx.session.measurements + 1;
        let entry = Entry::Refused { number, pose, reason: problem.message.clone(), xyz_mm: None };
        vec![Action::Write(vec![entry]), Action::Say(problem.into())]
    }

    fn on_applied(&mut self, entry: &Entry, cx: &Cx<'_>) -> Vec<Action> {
        let session = cx.session;
        match entry {
            Entry::Sample(noted) => {
                self.held = None;
                self.prediction = match self.expected.take() {
                    Some((number, prediction)) if number == noted.number => prediction,
                    _ => Prediction::of(session),
                };
                self.ask(session);
                match noted.findings.first() {
                    Some(finding) if self.question.is_some() => {
                        return vec![Action::Say(Notice::attention(finding.message.clone()))];
                    }
                    _ if self.question.is_none() => self.advance(session),
                    _ => {}
                }
                if let Some(factor) = noted.factor {
                    return vec![Action::Say(other_unit(noted, factor))];
                }
            }
            Entry::Decision { sample, decision } => {
                self.prediction = Prediction::of(session);
                match decision {
                    Decision::Undo => self.row = session.sample(*sample).map(|sample| sample.row),
                    Decision::Keep | Decision::LeaveOut => self.advance(session),
                }
                self.ask(session);
            }
            Entry::Correction(correction) => {
                self.prediction = Prediction::of(session);
                self.row = session.open_rows().next();
                self.ask(session);
                return vec![Action::Say(Notice::info(corrected(correction)))];
            }
            Entry::Row(row) => {
                self.row = Some(*row);
                self.held = None;
            }
            Entry::Skipped { skipped: true, .. } => self.advance(session),
            Entry::PlanExtended(_) | Entry::Plan(_) => {
                self.prediction = Prediction::of(session);
                self.row = self.row.filter(|row| session.is_open(*row)).or_else(|| session.open_rows().next());
            }
            _ => {}
        }
        Vec::new()
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        Content::Capture(Box::new(show::view(self, cx)))
    }
}

/// A correction of a unit is about what is measured, not about what will be.
fn ended(remedy: Correction, session: &Session) -> Correction {
    match remedy {
        // Proposed by an earlier version.
        Correction::Scale { since, factor, until: None } => {
            Correction::Scale { since, factor, until: Some(session.measurements) }
        }
        remedy => remedy,
    }
}

/// Takes a sample back, and the corrections that it led to.
fn undo(sample: u64, session: &Session) -> Vec<Entry> {
    let corrections = session.corrections_since(sample);
    let taken_back = corrections.map(|corrected| Entry::Correction(Correction::TakenBack { line: corrected.line }));
    taken_back.chain([Entry::Decision { sample, decision: Decision::Undo }]).collect()
}

/// What to say about a sample that is in another unit like the one before.
fn other_unit(noted: &MeasuredText, factor: f64) -> Notice {
    let what = format!("pose {}: still in the other unit; its coordinates count {factor} times", noted.pose);
    Notice::attention(what).hint("set the unit of the instrument back; a point in the right unit counts as it is")
}

fn corrected(correction: &Correction) -> String {
    match correction {
        Correction::Scale { since, factor, until } => {
            let which = match until {
                None => format!("from measurement {since} on"),
                Some(until) if until == since => format!("of measurement {since}"),
                Some(until) => format!("of measurements {since} to {until}"),
            };
            format!("coordinates {which} count {factor} times; what was noted stays in the journal")
        }
        Correction::Swap { first, second } => format!("measurements {first} and {second} changed places"),
        Correction::Row { sample, .. } => format!("measurement {sample} counts for the pose where the robot stood"),
        Correction::Joints { sample, .. } => format!("measurement {sample} counts with the corrected joint values"),
        Correction::TakenBack { .. } => {
            "the correction that the measurement led to is taken back with it; both stay in the journal".to_owned()
        }
    }
}
