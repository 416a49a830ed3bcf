//! Whether a robot is at rest.

use super::super::JointState;

/// Watches joint states and says when no joint has moved for some time, by the clock of the controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Stillness {
    limit: f64,
    seconds: f64,
    /// Controller time of the first and the last state of the rest under way (s).
    rest: Option<(f64, f64)>,
}

impl Default for Stillness {
    /// Below 0.001 rad/s for half a second.
    fn default() -> Self {
        Self::new(1e-3, 0.5)
    }
}

impl Stillness {
    /// At rest: every joint is slower than `limit` (rad/s) for `seconds` (s).
    pub const fn new(limit: f64, seconds: f64) -> Self {
        Self { limit, seconds, rest: None }
    }

    /// Takes the next state; true where the robot is at rest now. Without speeds, while it is stopped by its safety system, or
    /// across a gap as long as the rest itself, nobody can say so; a clock that went back begins anew.
    pub fn feed(&mut self, state: &JointState) -> bool {
        let is_slow = |speeds: &Vec<f64>| !speeds.is_empty() && speeds.iter().all(|speed| speed.abs() < self.limit);
        let time = state.controller_time;
        if state.stopped.is_some() || !time.is_finite() || !state.speeds.as_ref().is_some_and(is_slow) {
            self.rest = None;
            return false;
        }
        let first = match self.rest {
            Some((first, last)) if time >= last && time - last < self.seconds => first,
            _ => time,
        };
        self.rest = Some((first, time));
        time - first >= self.seconds
    }
}
