//! Points that were given together. They are taken one after the other, each with all its checks; a question stops them until it is
//! answered.

use std::collections::VecDeque;

use nalgebra::Point3;

use super::CaptureStep;
use crate::session::journal::Entry;
use crate::session::state::Session;
use crate::text::{counted, listed};
use crate::wizard::notice::Notice;
use crate::wizard::reading;
use crate::wizard::step::{Action, Cx};

/// Names of poses that a message lists.
const NAMED: usize = 4;

/// A point that waits for its turn.
#[derive(Clone, Debug)]
pub(super) struct Waiting {
    /// Row of the plan that it belongs to; none: the one that is shown then.
    pub(super) row: Option<usize>,
    /// In the tracker frame (m).
    pub(super) point: Point3<f64>,
}

/// Points that wait, in order.
pub(super) type Pasted = VecDeque<Waiting>;

impl CaptureStep {
    /// Takes the points of a text: the first one now, the others when it is saved.
    pub(super) fn paste(&mut self, text: &str, cx: &Cx<'_>) -> Vec<Action> {
        let points = match reading::parse_all(text, Self::manual_unit(cx).unwrap_or_default()) {
            Ok(points) => points,
            Err(message) => return vec![Action::Say(Notice::error(message))],
        };
        self.pasted = points.into_iter().map(|point| Waiting { row: None, point }).collect();
        // Typing a reading remeasures the questioned sample.
        self.show_questioned(cx.session);
        self.next_pasted(cx)
    }

    /// Takes the next point that waits, if there is one.
    pub(super) fn next_pasted(&mut self, cx: &Cx<'_>) -> Vec<Action> {
        let Some(Waiting { row, point }) = self.pasted.pop_front() else { return Vec::new() };
        self.row = row.or(self.row);
        if self.row.is_some() {
            return self.take(&reading::typed(point), cx);
        }
        let left = self.pasted.len() + 1;
        self.pasted.clear();
        let notice = Notice::attention(format!("no pose is left for {} of those given", counted(left, "point")))
            .hint("all poses of the plan are measured: add poses, or go to the pose that the points belong to");
        vec![Action::Say(notice)]
    }

    /// Continues with the points that wait after an entry.
    pub(super) fn continue_pasted(&mut self, entry: &Entry, cx: &Cx<'_>) -> Vec<Action> {
        if self.pasted.is_empty() {
            return Vec::new();
        }
        match entry {
            Entry::Refused { pose, reason, .. } => self.drop_pasted(pose, reason, cx.session),
            _ if self.questioned.is_some() || self.held.is_some() => Vec::new(),
            Entry::Sample(_) | Entry::Decision { .. } | Entry::Correction(_) => self.next_pasted(cx),
            // Which pose the next point belongs to is not certain any longer.
            Entry::Row(_) | Entry::Skipped { .. } | Entry::Undone { .. } | Entry::Redone { .. } => {
                let left = counted(self.pasted.len(), "point");
                self.pasted.clear();
                let notice = Notice::attention(format!("{left} of those given were not taken: the pose has changed"))
                    .hint("give them again from the pose shown");
                vec![Action::Say(notice)]
            }
            _ => Vec::new(),
        }
    }

    /// Forgets the points after one that was refused: which, why and what to do.
    fn drop_pasted(&mut self, pose: &str, reason: &str, session: &Session) -> Vec<Action> {
        let shown = self.row.unwrap_or(0);
        let mut open = session.open_rows().filter(|row| *row > shown);
        let rows: Vec<Option<usize>> = self.pasted.iter().map(|waiting| waiting.row.or_else(|| open.next())).collect();
        self.pasted.clear();
        let mut names: Vec<String> = rows
            .iter()
            .take(NAMED)
            .map(|row| row.map_or_else(|| "?".to_owned(), |row| session.row_name(row)))
            .collect();
        if let Some(more) = rows.len().checked_sub(NAMED).filter(|more| *more > 0) {
            names.push(format!("{more} more"));
        }
        let what = format!(
            "the point for pose {pose} was not taken: {reason}; the points after it were not taken either ({})",
            listed(&names)
        );
        let notice = Notice::error(what)
            .hint(format!("correct that point, or skip pose {pose}; then give the points again from the pose shown"));
        vec![Action::Say(notice)]
    }
}
