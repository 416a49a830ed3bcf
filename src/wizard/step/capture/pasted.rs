//! Points that were pasted together. They are taken one after the other, each with all its checks; a question stops them until it is
//! answered.

use std::collections::VecDeque;

use nalgebra::Point3;

use super::CaptureStep;
use crate::session::journal::Entry;
use crate::text::counted;
use crate::wizard::notice::Notice;
use crate::wizard::reading;
use crate::wizard::step::{Action, Cx};

impl CaptureStep {
    /// Takes the points of a text: the first one now, the others when it is saved.
    pub(super) fn paste(&mut self, text: &str, cx: &Cx<'_>) -> Vec<Action> {
        let points = match reading::parse_all(text, Self::manual_unit(cx).unwrap_or_default()) {
            Ok(points) => points,
            Err(message) => return vec![Action::Say(Notice::error(message))],
        };
        self.pasted = VecDeque::from(points);
        // Typing a reading remeasures the questioned sample.
        self.show_questioned(cx.session);
        self.next_pasted(cx)
    }

    /// Takes the next pasted point, if there is one.
    fn next_pasted(&mut self, cx: &Cx<'_>) -> Vec<Action> {
        match self.pasted.pop_front() {
            Some(point) if self.row.is_some() => self.take(&reading::typed(point), cx),
            Some(_) => self.drop_pasted(1, "no pose is left for"),
            None => Vec::new(),
        }
    }

    /// Continues with the pasted points after an entry.
    pub(super) fn continue_pasted(&mut self, entry: &Entry, cx: &Cx<'_>) -> Vec<Action> {
        if self.pasted.is_empty() {
            return Vec::new();
        }
        match entry {
            _ if self.questioned.is_some() || self.held.is_some() => Vec::new(),
            Entry::Sample(_) | Entry::Decision { .. } | Entry::Correction(_) => self.next_pasted(cx),
            // Which pose the next point belongs to is not certain any longer.
            Entry::Refused { .. } | Entry::Row(_) | Entry::Skipped { .. } => self.drop_pasted(0, "not taken:"),
            _ => Vec::new(),
        }
    }

    /// Forgets the pasted points that were not taken, and says so.
    fn drop_pasted(&mut self, taken_out: usize, why: &str) -> Vec<Action> {
        let left = self.pasted.len() + taken_out;
        self.pasted.clear();
        vec![Action::Say(
            Notice::attention(format!("{why} {} of those pasted", counted(left, "point")))
                .hint("paste them again from the pose shown"),
        )]
    }
}

/// Pasted points that wait.
pub(super) type Pasted = VecDeque<Point3<f64>>;
