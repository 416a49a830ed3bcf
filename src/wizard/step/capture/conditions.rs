//! Conditions for the intents of the capture step.

use super::{CaptureStep, Cx};
use crate::session::state::{Sample, SampleState};
use crate::wizard::step::{Condition, require};

/// Conditions for the intents of the capture step, each with the reason if it is not met.
pub(super) struct Conditions<'a> {
    pub(super) step: &'a CaptureStep,
    pub(super) cx: &'a Cx<'a>,
}

impl Conditions<'_> {
    pub(super) fn at_a_pose(&self) -> Condition {
        require(self.step.row.is_some(), "all poses of the plan have been measured")
    }

    pub(super) fn connected(&self) -> Condition {
        require(self.cx.connection.is_some(), "the instrument is not responding; go back to the instrument step")
    }

    /// The link works. A key pressed now must not trigger a measurement later.
    pub(super) fn online(&self) -> Condition {
        self.cx.down.map_or(Ok(()), |cause| Err(format!("the link is down: {cause}; reconnecting")))
    }

    /// The instrument supplies the coordinates.
    pub(super) fn automatic(&self) -> Condition {
        require(CaptureStep::manual_unit(self.cx).is_none(), "the coordinates are typed in")
    }

    /// The operator types the coordinates.
    pub(super) fn typed(&self) -> Condition {
        require(CaptureStep::manual_unit(self.cx).is_some(), "the instrument supplies the coordinates")
    }

    pub(super) fn questioned(&self) -> Condition {
        require(self.step.doubt(self.cx.session).is_some(), "no sample is in question")
    }

    /// No sample is questioned.
    pub(super) fn resolved(&self) -> Condition {
        require(
            self.step.doubt(self.cx.session).is_none(),
            "resolve the questioned sample first: keep it, remeasure it or exclude it",
        )
    }

    pub(super) fn at_a_pose_or_questioned(&self) -> Condition {
        self.questioned().or_else(|_| self.at_a_pose())
    }

    /// The finding about the questioned sample proposes a correction.
    pub(super) fn correctable(&self) -> Condition {
        let doubt = self.step.doubt(self.cx.session);
        require(doubt.is_some_and(|(_, finding)| finding.remedy.is_some()), "no correction is proposed")
    }

    /// A stop lies on the way to the pose.
    pub(super) fn on_the_way(&self) -> Condition {
        require(!self.step.stops().is_empty(), "there is no stop on the way to this pose")
    }

    /// The way can be changed to one through home.
    pub(super) fn homeward(&self) -> Condition {
        require(self.step.way.can_go_home, "the way goes through home already, or there is no home")
    }

    pub(super) fn held(&self) -> Condition {
        require(self.step.held.is_some(), "no reading is held back")
    }

    /// Something was done that can be undone.
    pub(super) fn undoable(&self) -> Condition {
        require(self.cx.session.undoable().is_some(), "there is nothing to undo")
    }

    /// Something was undone that can be redone.
    pub(super) fn redoable(&self) -> Condition {
        require(self.cx.session.redoable().is_some(), "there is nothing to redo")
    }

    /// A sample is excluded.
    pub(super) fn excluded(&self) -> Condition {
        let is_excluded = |sample: &Sample| sample.state == SampleState::LeftOut;
        require(self.cx.session.samples.iter().any(is_excluded), "no pose is excluded")
    }

    /// At least one sample counts.
    pub(super) fn sampled(&self) -> Condition {
        require(self.cx.session.counted().next().is_some(), "nothing has been measured yet")
    }
}
