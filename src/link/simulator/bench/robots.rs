//! What holds for the link to every robot controller.

use std::fmt::Display;

use super::{Bench, Simulator};
use crate::link::protocol::{JointState, Protocol, ProtocolEvent};

/// The joint values among `events`, in order.
pub fn joint_states(events: &[ProtocolEvent]) -> Vec<&JointState> {
    let states =
        events.iter().filter_map(|event| if let ProtocolEvent::Joints(state) = event { Some(state) } else { None });
    states.collect()
}

impl<P: Protocol, S: Simulator> Bench<P, S> {
    /// The joint values are those of the cell, within `tolerance` (rad).
    ///
    /// # Panics
    /// They are not.
    #[track_caller]
    pub fn assert_joints(&self, states: &[&JointState], tolerance: f64) {
        for state in states {
            let differences = state.positions.iter().zip(&self.cell.joints.positions).map(|(a, b)| (a - b).abs());
            assert!(differences.fold(0.0, f64::max) < tolerance, "{state:?}");
        }
    }

    /// The link is lost because of `fault`, in words that have `part`, and a new connection is good.
    ///
    /// # Panics
    /// It is not so.
    #[track_caller]
    pub fn assert_loss_is_said(&mut self, fault: &impl Display, part: &str) {
        self.settle();
        let events = self.run_until(|event| matches!(event, ProtocolEvent::Lost(_)));
        let Some(ProtocolEvent::Lost(failure)) = events.last() else { panic!("{fault}: {events:?}") };
        assert!(failure.to_string().contains(part), "{fault}: {failure}");
        assert!(matches!(self.settle().last(), Some(ProtocolEvent::Ready(_))), "{fault}");
    }
}
