//! Detection of a robot at rest.

use super::super::JointState;

/// Detects from joint states that no joint has moved for some time, by the controller's clock.
#[derive(Clone, Debug, PartialEq)]
pub struct RestDetector {
    limit: f64,
    seconds: f64,
    /// Controller time of the first and the latest state of the current rest (s).
    rest: Option<(f64, f64)>,
}

impl Default for RestDetector {
    /// At rest below 0.001 rad/s for half a second.
    fn default() -> Self {
        Self::new(1e-3, 0.5)
    }
}

impl RestDetector {
    /// At rest once every joint has been slower than `limit` (rad/s) for `seconds` (s).
    pub const fn new(limit: f64, seconds: f64) -> Self {
        Self { limit, seconds, rest: None }
    }

    /// Takes the next state and returns whether the robot is at rest now. It does not count as at rest without speeds, during a
    /// safety stop, or across a gap as long as the required rest. A clock that goes back restarts the wait.
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
