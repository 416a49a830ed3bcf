//! What the operator states about the cell, in every step that can use it.

use super::intent::{Intent, IntentInfo};
use super::notice::Notice;
use super::place::{self, Place};
use super::step::Action;
use crate::profile::{BoxText, CellText};
use crate::session::journal::Entry;
use crate::session::set_up::{JointLimitsText, Step, TrackerPoints};
use crate::session::state::{Robot, Session};
use crate::units::to_mm;

/// Cells that are known without a journal.
#[derive(Clone, Debug, Default)]
pub(super) struct KnownCells {
    /// That of an earlier session.
    pub(super) earlier: CellText,
    /// The points by which the tracker was placed last.
    points: TrackerPoints,
    /// The last one typed, if it could not be used: to be corrected.
    tried: Option<CellText>,
}

impl KnownCells {
    /// The offers to describe the cell, as a whole and by its parts.
    pub(super) fn offers(&self, step: Step, session: &Session) -> Vec<IntentInfo> {
        let Some(robot) = &session.robot else { return Vec::new() };
        let label = match step {
            Step::Instrument | Step::Target | Step::Plan => "cell: accuracy, limits, boxes",
            Step::Verify => "acceptance limits",
            Step::Profile | Step::Capture | Step::Identify | Step::Deliver => return Vec::new(),
        };
        let known = self.known(robot, session);
        let mut offers = Vec::new();
        if matches!(step, Step::Instrument | Step::Plan) {
            let limits = robot.profile.chain().joints().iter().map(|joint| {
                let range = known.planning_limits.get(&joint.name).copied();
                (joint.name.clone(), range)
            });
            let number = known.keep_out.len() + 1;
            let obstacle = BoxText { name: format!("box{number}"), min_mm: (0.0, 0.0, 0.0), max_mm: (0.0, 0.0, 0.0) };
            let fixed = session.has_measurements().then(|| "points are measured: the tracker stays".to_owned());
            offers.push(
                IntentInfo::new(Intent::PlaceTracker(self.points.clone()), "tracker: three points").unless(fixed),
            );
            offers.push(IntentInfo::new(Intent::LimitJoints(JointLimitsText(limits.collect())), "joint limits"));
            offers.push(IntentInfo::new(Intent::AddBox(obstacle), "add a box"));
        }
        if step == Step::Plan && !session.samples.is_empty() {
            let reason = place::from_poses(session).err();
            offers.push(IntentInfo::new(Intent::PlaceTrackerByPoses, "tracker: by the measured poses").unless(reason));
        }
        offers.push(IntentInfo::new(Intent::DescribeCell(Box::new(known)), label));
        offers
    }

    /// What is known of the cell: what was stated in this session, else in the last one, else in the profile.
    fn known(&self, robot: &Robot, session: &Session) -> CellText {
        let joints: Vec<&str> = robot.profile.chain().joints().iter().map(|joint| joint.name.as_str()).collect();
        match &self.tried {
            Some(tried) => tried.clone(),
            None if session.cell.is_empty() => self.earlier.or(&CellText::of(&robot.profile), &joints),
            None => session.cell.or(&CellText::of(&robot.profile), &joints),
        }
    }

    /// States a part of the cell; what is known of the rest stays.
    fn change(&mut self, session: &Session, change: impl FnOnce(&mut CellText)) -> Vec<Action> {
        let Some(robot) = &session.robot else { return Vec::new() };
        let mut cell = self.known(robot, session);
        change(&mut cell);
        self.state(cell, session)
    }

    /// Takes over where the tracker is, by points.
    pub(super) fn place(&mut self, points: TrackerPoints, session: &Session) -> Vec<Action> {
        let found = place::from_points(&points);
        self.points = points;
        self.placed(found, "what was typed is kept for correction", session)
    }

    /// Takes over where the tracker is, by the poses measured so far.
    pub(super) fn place_by_poses(&self, session: &Session) -> Vec<Action> {
        match place::from_poses(session) {
            Ok(found) => {
                let Some(robot) = &session.robot else { return Vec::new() };
                let cell = found.put_into(self.known(robot, session));
                vec![Action::Write(vec![Entry::Cell(cell)]), Action::Say(placed(found))]
            }
            Err(reason) => vec![Action::Say(Notice::error(reason))],
        }
    }

    fn placed(&mut self, found: Result<Place, String>, hint: &str, session: &Session) -> Vec<Action> {
        match found {
            Ok(found) => {
                let mut actions = self.change(session, |cell| *cell = found.put_into(cell.clone()));
                actions.push(Action::Say(placed(found)));
                actions
            }
            Err(reason) => vec![Action::Say(Notice::error(reason).hint(hint.to_owned()))],
        }
    }

    /// Takes over the limits of the joints.
    pub(super) fn limit(&mut self, limits: &JointLimitsText, session: &Session) -> Vec<Action> {
        self.change(session, |cell| {
            for (joint, range) in &limits.0 {
                match range {
                    Some(range) => drop(cell.planning_limits.insert(joint.clone(), *range)),
                    None => drop(cell.planning_limits.remove(joint)),
                }
            }
        })
    }

    /// Adds a box.
    pub(super) fn add_box(&mut self, obstacle: BoxText, session: &Session) -> Vec<Action> {
        self.change(session, |cell| {
            cell.keep_out.retain(|other| other.name != obstacle.name);
            cell.keep_out.push(obstacle);
        })
    }

    /// Takes a cell over, or says why it cannot be meant.
    pub(super) fn state(&mut self, cell: CellText, session: &Session) -> Vec<Action> {
        let Some(robot) = session.robot.as_ref() else { return Vec::new() };
        let mut usable = cell.clone();
        if session.has_measurements() {
            // The points were measured from where the tracker stood, whatever is typed now.
            usable.tracker_mm = session.cell.tracker_mm;
        }
        match usable.applied(&robot.text) {
            Ok(_) => {
                self.tried = None;
                vec![Action::Write(vec![Entry::Cell(usable)])]
            }
            Err(reason) => {
                self.tried = Some(cell);
                vec![Action::Say(
                    Notice::error(format!("this cell cannot be used: {reason}"))
                        .hint("what was typed is kept for correction"),
                )]
            }
        }
    }
}

/// What is said about the place of the tracker.
fn placed(found: Place) -> Notice {
    let (x, y, z) = found.tracker_mm;
    Notice::info(format!(
        "the tracker is at ({x}, {y}, {z}) mm in the base; the points fit to {:.1} mm (RMS)",
        to_mm(found.rms)
    ))
}
