//! Points of several poses that are shown with their checks before any of them is taken.

use nalgebra::Point3;

use super::pasted::Waiting;
use super::{CaptureStep, checks, row_of_pose};
use crate::session::journal::{Decision, Entry, Line, from_xyz_mm};
use crate::session::measurements::NamedPoint;
use crate::session::state::Session;
use crate::text::{counted, counted_as};
use crate::units::to_mm;
use crate::wizard::intent::{Intent, IntentInfo};
use crate::wizard::notice::Notice;
use crate::wizard::reading;
use crate::wizard::step::{Action, Cx, offer, require, with_default};
use crate::wizard::view::{ProposedPointView, ProposedState, ProposedView};

/// Findings about earlier points that are resolved before a point is judged.
const MOST_RESOLVED: usize = 4;

/// Points that are shown before they are taken.
#[derive(Clone, Debug)]
pub(super) struct Proposal {
    /// Where they come from, in words.
    source: String,
    points: Vec<Proposed>,
}

/// A point with its pose and what the checks say about it.
#[derive(Clone, Debug)]
struct Proposed {
    /// Name that the point has where it comes from.
    name: Option<String>,
    /// Row of the plan; none if no pose is left.
    row: Option<usize>,
    point: Point3<f64>,
    state: ProposedState,
    /// What the checks say, if it does not simply fit.
    message: Option<String>,
    /// Number of its measurement in the trial.
    number: u64,
}

impl Proposal {
    fn count(&self, state: ProposedState) -> usize {
        self.points.iter().filter(|point| point.state == state).count()
    }

    /// The decisions about the points.
    pub(super) fn intents(&self) -> Vec<IntentInfo> {
        let fitting = self.count(ProposedState::Fits);
        let questioned = self.count(ProposedState::InQuestion);
        let label = match (fitting, questioned) {
            (_, 0) => format!("take {}", counted(fitting, "point")),
            _ => format!("take the {} that fit", counted(fitting, "point")),
        };
        let all = counted(fitting + questioned, "point");
        let next = if fitting > 0 { Intent::TakePoints } else { Intent::DropPoints };
        with_default(
            vec![
                offer(Intent::TakePoints, &label, [require(fitting > 0, "no point fits")]),
                offer(
                    Intent::TakeAllPoints,
                    &format!("take {all}, and ask about those in question"),
                    [require(questioned > 0, "no point is in question")],
                ),
                offer(Intent::DropPoints, "take none", []),
            ],
            &next,
        )
    }

    pub(super) fn view(&self, session: &Session) -> ProposedView {
        let point = |proposed: &Proposed| ProposedPointView {
            name: proposed.name.clone(),
            pose: proposed.row.map(|row| session.row_name(row)),
            xyz_mm: [proposed.point.x, proposed.point.y, proposed.point.z].map(to_mm),
            state: proposed.state,
            message: proposed.message.clone(),
        };
        ProposedView { source: self.source.clone(), points: self.points.iter().map(point).collect() }
    }
}

/// The rows that points belong to: by their names, if all of them are poses of the plan, and otherwise in the order of the plan
/// from the row shown.
fn rows_of(points: &[NamedPoint], shown: Option<usize>, session: &Session) -> (Vec<Option<usize>>, bool) {
    let named: Option<Vec<Option<usize>>> =
        points.iter().map(|point| row_of_pose(point.name.as_deref()?, session).map(Some)).collect();
    let is_distinct = |rows: &Vec<Option<usize>>| {
        let mut sorted = rows.clone();
        sorted.sort_unstable();
        sorted.dedup();
        sorted.len() == rows.len()
    };
    if let Some(rows) = named.filter(is_distinct) {
        return (rows, true);
    }
    let first = shown.unwrap_or(0);
    let mut open = session.open_rows().filter(|row| *row >= first);
    (points.iter().map(|_| open.next()).collect(), false)
}

impl CaptureStep {
    /// Shows the points of a pasted text, one per line.
    pub(super) fn propose_pasted(&mut self, text: &str, cx: &Cx<'_>) -> Vec<Action> {
        match reading::parse_named(text, Self::manual_unit(cx).unwrap_or_default()) {
            Ok(points) => self.propose("the text pasted".to_owned(), &points, cx),
            Err(message) => vec![Action::Say(Notice::error(message))],
        }
    }

    /// Shows points with what the checks say about each, as if they were taken one after the other. A point in question is left out
    /// of the checks of those that follow.
    pub(super) fn propose(&mut self, source: String, points: &[NamedPoint], cx: &Cx<'_>) -> Vec<Action> {
        let (rows, by_name) = rows_of(points, self.row, cx.session);
        let mut trial = cx.session.clone();
        let mut proposed: Vec<Proposed> = Vec::with_capacity(points.len());
        for (point, row) in points.iter().zip(rows) {
            let next = judged(point, row, &mut trial, &mut proposed, cx);
            proposed.push(next);
        }
        let proposal = Proposal { source, points: proposed };
        let count = |state| proposal.count(state);
        let fitting = count(ProposedState::Fits);
        let not = points.len() - fitting;
        let what = format!(
            "{} read from {}; {} and {}",
            counted(points.len(), "point"),
            proposal.source,
            counted_as(fitting, "fits", "fit"),
            counted_as(not, "does not", "do not")
        );
        let order = if by_name { "by the names of the poses" } else { "in the order of the plan, from the pose shown" };
        let notice = if not == 0 { Notice::info(what) } else { Notice::attention(what) };
        self.proposal = Some(proposal);
        vec![Action::Say(notice.hint(format!("assigned {order}; nothing is taken yet")))]
    }

    /// Takes the proposed points, with those in question or without.
    pub(super) fn take_proposed(&mut self, all: bool, cx: &Cx<'_>) -> Vec<Action> {
        let Some(proposal) = self.proposal.take() else { return Vec::new() };
        let is_taken = |point: &&Proposed| match point.state {
            ProposedState::Fits => true,
            ProposedState::InQuestion => all,
            ProposedState::Impossible => false,
        };
        let waiting = proposal.points.iter().filter(is_taken);
        self.pasted = waiting.map(|point| Waiting { row: point.row, point: point.point }).collect();
        self.next_pasted(cx)
    }
}

/// A point with what the checks say about it. It is added to the trial, and findings about earlier points are passed on to them.
fn judged(
    point: &NamedPoint,
    row: Option<usize>,
    trial: &mut Session,
    earlier: &mut [Proposed],
    cx: &Cx<'_>,
) -> Proposed {
    let mut proposed = Proposed {
        name: point.name.clone(),
        row,
        point: point.point,
        state: ProposedState::Impossible,
        message: None,
        number: trial.measurements + 1,
    };
    let reading = reading::typed(point.point);
    let noted = row.and_then(|row| CaptureStep::noted(&reading, row, &Cx { session: trial, ..*cx }));
    let Some(mut noted) = noted else {
        proposed.message = Some("no pose of the plan is left for it".to_owned());
        return proposed;
    };
    let previous = trial.samples.last().map(|sample| from_xyz_mm(sample.noted.xyz_mm));
    if let Some(reason) = reading::gate(&from_xyz_mm(noted.xyz_mm), previous.as_ref()) {
        proposed.message = Some(reason);
        return proposed;
    }
    proposed.state = ProposedState::Fits;
    for _ in 0..MOST_RESOLVED {
        checks::judge(&Cx { session: trial, ..*cx }, &mut noted);
        let Some(finding) = noted.findings.first() else { break };
        let about = if finding.about == noted.number {
            Some(&mut proposed)
        } else {
            earlier.iter_mut().find(|known| known.number == finding.about)
        };
        if let Some(about) = about {
            about.state = ProposedState::InQuestion;
            about.message = Some(finding.message.clone());
        }
        if finding.about == noted.number || trial.sample(finding.about).is_none() {
            break;
        }
        // Without the earlier point in question, this one may well fit.
        apply(trial, cx, Entry::Decision { sample: finding.about, decision: Decision::LeaveOut });
    }
    let (number, is_doubtful) = (noted.number, proposed.state == ProposedState::InQuestion);
    apply(trial, cx, Entry::Sample(noted));
    if is_doubtful {
        apply(trial, cx, Entry::Decision { sample: number, decision: Decision::LeaveOut });
    }
    proposed
}

/// Applies an entry to the trial. One that does not fit changes nothing there.
fn apply(trial: &mut Session, cx: &Cx<'_>, entry: Entry) {
    let line = Line { number: trial.lines + 1, time: cx.now, entry };
    drop(trial.apply(&line));
}
