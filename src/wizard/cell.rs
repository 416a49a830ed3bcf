//! What the operator states about the cell, in every step that can use it.

use super::intent::{Intent, IntentInfo};
use super::notice::Notice;
use super::step::Action;
use crate::profile::CellText;
use crate::session::journal::Entry;
use crate::session::set_up::Step;
use crate::session::state::Session;

/// Cells that are known without a journal.
#[derive(Clone, Debug, Default)]
pub(super) struct KnownCells {
    /// That of an earlier session.
    pub(super) earlier: CellText,
    /// The last one typed, if it could not be used: to be corrected.
    tried: Option<CellText>,
}

impl KnownCells {
    /// The offer to describe the cell, with what is known of it.
    pub(super) fn offer(&self, step: Step, session: &Session) -> Option<IntentInfo> {
        let robot = session.robot.as_ref()?;
        let label = match step {
            Step::Instrument | Step::Target | Step::Plan => "cell: accuracy, limits, boxes",
            Step::Verify => "acceptance limits",
            Step::Profile | Step::Capture | Step::Identify | Step::Deliver => return None,
        };
        let joints: Vec<&str> = robot.profile.chain().joints().iter().map(|joint| joint.name.as_str()).collect();
        let cell = match &self.tried {
            Some(tried) => tried.clone(),
            // What is stated in this session, else in the last one, else in the profile.
            None if session.cell.is_empty() => self.earlier.or(&CellText::of(&robot.profile), &joints),
            None => session.cell.or(&CellText::of(&robot.profile), &joints),
        };
        Some(IntentInfo::new(Intent::DescribeCell(Box::new(cell)), label))
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
