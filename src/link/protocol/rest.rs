//! Rest of a robot, judged by its joint values, and the mean of these values while it lasts.
//!
//! A robot at rest is recognised by the spread of its joint values, not by a word of its controller: encoders at rest are noisy
//! (17 to 29 µrad per joint with steps up to 127 µrad on two real controllers), reported speeds even more so, and a controller
//! that reports a safeguard stop or a reduced mode is usually one whose robot stands perfectly still.

use std::collections::VecDeque;

use super::JointState;

/// Duration over which the joint values are compared (s).
const DURATION: f64 = 0.5;

/// Fewest states that are compared, however slowly they arrive.
const FEWEST_STATES: usize = 4;

/// Longest time between two states of one rest (s).
const LONGEST_GAP: f64 = 2.0;

/// Largest range of a joint at rest (rad). The noise of encoders stays within a third of it.
const RANGE: f64 = 4e-4;

/// Largest difference between the means of the earlier and the later half (rad), six times that of noisy encoders. A joint that
/// turns at 0.0004 rad/s exceeds it.
const CREEP: f64 = 1e-4;

/// Detects from joint states that no joint has moved for some time, by the controller's clock.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RestDetector {
    /// Controller time (s) and joint values of the latest states, oldest first.
    states: VecDeque<(f64, Vec<f64>)>,
}

impl RestDetector {
    /// Takes the next state and returns whether the robot is at rest now. It does not count as at rest while the state cannot be
    /// used for a measurement, or across a gap. A clock that goes back restarts the wait.
    pub fn feed(&mut self, state: &JointState) -> bool {
        let time = state.controller_time;
        if state.stopped.is_some() || !time.is_finite() || state.positions.is_empty() {
            self.states.clear();
            return false;
        }
        let follows = |(before, positions): &(f64, Vec<f64>)| {
            (0.0..=LONGEST_GAP).contains(&(time - before)) && positions.len() == state.positions.len()
        };
        if !self.states.back().is_some_and(follows) {
            self.states.clear();
        }
        self.states.push_back((time, state.positions.clone()));
        while self.states.len() > FEWEST_STATES
            && self.states.get(1).is_some_and(|(second, _)| time - second >= DURATION)
        {
            self.states.pop_front();
        }
        self.is_at_rest()
    }

    /// The joint values that were compared, oldest first.
    pub fn compared(&self) -> impl Iterator<Item = &[f64]> {
        self.states.iter().map(|(_, positions)| positions.as_slice())
    }

    fn is_at_rest(&self) -> bool {
        let (Some((first, positions)), Some((last, _))) = (self.states.front(), self.states.back()) else {
            return false;
        };
        self.states.len() >= FEWEST_STATES
            && last - first >= DURATION
            && (0..positions.len()).all(|joint| self.is_joint_at_rest(joint))
    }

    fn is_joint_at_rest(&self, joint: usize) -> bool {
        let values: Vec<f64> = self.compared().filter_map(|positions| positions.get(joint).copied()).collect();
        let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (earlier, later) = values.split_at(values.len() / 2);
        let mean = |half: &[f64]| half.iter().sum::<f64>() / half.len().max(1) as f64;
        highest - lowest <= RANGE && (mean(later) - mean(earlier)).abs() <= CREEP
    }
}

/// Joint values of one measurement: from the rest before the first shot to the last shot.
#[derive(Clone, Debug, Default)]
pub struct JointWatch {
    detector: RestDetector,
    /// Mean over the states in which rest was detected first.
    at_first: Option<JointMean>,
    /// Mean over all states since then.
    all: JointMean,
    has_moved: bool,
    stopped: Option<String>,
    remarks: Vec<String>,
}

/// Why the joint values of a measurement cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unrest {
    /// The robot has not come to rest.
    NotYetAtRest,
    /// The robot moved after it had come to rest.
    Moved,
    /// The controller reports a state in which nothing is measured.
    Stopped(String),
}

impl JointWatch {
    /// Takes the next state.
    pub fn feed(&mut self, state: &JointState) {
        self.stopped.clone_from(&state.stopped);
        let is_at_rest = self.detector.feed(state);
        if self.at_first.is_none() {
            if !is_at_rest {
                return;
            }
            for positions in self.detector.compared() {
                self.all.add(positions);
            }
            self.at_first = Some(self.all.clone());
        } else if is_at_rest {
            self.all.add(&state.positions);
        } else {
            self.has_moved = true;
        }
        if let Some(remark) = state.remark.as_ref().filter(|remark| !self.remarks.contains(remark)) {
            self.remarks.push(remark.clone());
        }
    }

    /// Joint values over all states since the robot came to rest.
    ///
    /// # Errors
    /// [`Unrest`]: the robot is not at rest, or was not all the time.
    pub fn joints(&self) -> Result<&JointMean, Unrest> {
        if let Some(why) = &self.stopped {
            return Err(Unrest::Stopped(why.clone()));
        }
        let at_first = self.at_first.as_ref().ok_or(Unrest::NotYetAtRest)?;
        let mut now = JointMean::default();
        for positions in self.detector.compared() {
            now.add(positions);
        }
        // Creep that no single comparison shows adds up over a long measurement.
        let has_crept = at_first.mean.iter().zip(&now.mean).any(|(first, now)| (first - now).abs() > CREEP);
        if self.has_moved || has_crept { Err(Unrest::Moved) } else { Ok(&self.all) }
    }

    /// What the controller reported during the measurement, each once.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }
}

/// Mean joint values with their scatter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointMean {
    /// Number of states.
    pub count: u32,
    /// Mean of each joint (rad, sliding joints m).
    pub mean: Vec<f64>,
    /// Sum of the squared deviations from the mean.
    squares: Vec<f64>,
}

impl JointMean {
    /// Adds the joint values of a state (Welford 1962).
    pub fn add(&mut self, positions: &[f64]) {
        self.mean.resize(positions.len(), 0.0);
        self.squares.resize(positions.len(), 0.0);
        self.count = self.count.saturating_add(1);
        for ((mean, square), value) in self.mean.iter_mut().zip(&mut self.squares).zip(positions) {
            let deviation = value - *mean;
            *mean += deviation / f64::from(self.count);
            *square += deviation * (value - *mean);
        }
    }

    /// Standard deviation of a single value of each joint (rad, sliding joints m); `None` for fewer than two states.
    pub fn scatter(&self) -> Option<Vec<f64>> {
        let degrees = self.count.checked_sub(1).filter(|degrees| *degrees > 0)?;
        Some(self.squares.iter().map(|square| (square / f64::from(degrees)).sqrt()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A state of a robot at 25 Hz.
    fn state(number: u32, positions: Vec<f64>) -> JointState {
        JointState { controller_time: 10.0 + 0.04 * f64::from(number), ..JointState::at(positions) }
    }

    /// Deviations of an encoder at rest as recorded (rad): about 20 µrad with a step of 127 µrad.
    fn noise(number: u32) -> f64 {
        [3, -21, 24, 11, -17, 63, -64, 8, -5, 19, -26, 14, 2, -12, 27, -9, 0][(number % 17) as usize].into_micro()
    }

    trait Micro {
        fn into_micro(self) -> f64;
    }

    impl Micro for i32 {
        fn into_micro(self) -> f64 {
            f64::from(self) * 1e-6
        }
    }

    #[test]
    fn the_noise_of_encoders_is_rest_and_a_slow_creep_is_not() {
        let mut detector = RestDetector::default();
        let rests: Vec<bool> =
            (0..500).map(|n| detector.feed(&state(n, vec![1.0 + noise(n), -2.0 + noise(n + 5)]))).collect();
        assert_eq!(rests.iter().position(|rest| *rest), Some(13));
        assert!(rests[13..].iter().all(|rest| *rest));
        let mut detector = RestDetector::default();
        assert!((0..500).all(|n| !detector.feed(&state(n, vec![1.0, 5e-4 * 0.04 * f64::from(n)]))));
    }

    #[test]
    fn a_slow_source_is_judged_by_four_states_and_a_gap_starts_again() {
        let at = |time: f64| JointState { controller_time: time, ..JointState::at(vec![0.3; 6]) };
        let feed = |times: &[f64]| {
            let mut detector = RestDetector::default();
            times.iter().map(|time| detector.feed(&at(*time))).collect::<Vec<_>>()
        };
        assert_eq!(feed(&[1.0, 2.0, 3.0, 4.0, 5.0]), [false, false, false, true, true]);
        assert_eq!(feed(&[1.0, 1.25, 1.5]), [false; 3], "too few");
        assert_eq!(feed(&[1.0, 1.1, 1.2, 1.3]), [false; 4], "too short");
        assert_eq!(feed(&[1.0, 1.2, 1.4, 3.5, 3.7, 3.9]), [false; 6], "gap");
        assert_eq!(feed(&[5.0, 5.2, 5.4, 1.0, 1.2, 1.4]), [false; 6], "clock");
    }

    #[test]
    fn a_measurement_has_the_mean_of_all_states_with_their_scatter() {
        let mut watch = JointWatch::default();
        for n in 0..68 {
            watch.feed(&state(n, vec![1.0 + noise(n)]));
        }
        let joints = watch.joints().unwrap();
        assert_eq!(joints.count, 68);
        let mean = (0..17).map(noise).sum::<f64>() / 17.0;
        assert!((joints.mean[0] - 1.0 - mean).abs() < 1e-12, "{joints:?}");
        let scatter = joints.scatter().unwrap()[0];
        assert!((20e-6..35e-6).contains(&scatter), "{scatter}");
    }

    #[test]
    fn the_scatter_of_repeated_poses_goes_down_with_the_root_of_the_states() {
        let noise = |n: u32| {
            // A fixed sequence without a pattern (splitmix64).
            let mut z = u64::from(n).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let spread = |states: u32| {
            let mut means = JointMean::default();
            for pose in 0..200 {
                let mut one = JointMean::default();
                (0..states).for_each(|n| one.add(&[noise(pose * states + n)]));
                means.add(&one.mean);
            }
            means.scatter().unwrap()[0]
        };
        let ratio = spread(1) / spread(49);
        assert!((5.0..9.5).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_move_or_a_creep_after_rest_spoils_the_measurement() {
        let mut watch = JointWatch::default();
        (0..10).for_each(|n| watch.feed(&state(n, vec![1.0])));
        assert_eq!(watch.joints(), Err(Unrest::NotYetAtRest));
        (10..30).for_each(|n| watch.feed(&state(n, vec![1.0])));
        assert!(watch.joints().is_ok());
        let mut moved = watch.clone();
        (30..60).for_each(|n| moved.feed(&state(n, vec![1.001])));
        assert_eq!(moved.joints(), Err(Unrest::Moved));
        (30..3000).for_each(|n| watch.feed(&state(n, vec![1.0 + 1e-6 * f64::from(n - 30) * 0.1])));
        assert_eq!(watch.joints(), Err(Unrest::Moved));
    }

    #[test]
    fn what_the_controller_reports_is_kept_and_a_stop_is_refused() {
        let mut watch = JointWatch::default();
        for n in 0..30 {
            watch.feed(&JointState { remark: Some("reduced".to_owned()), ..state(n, vec![1.0]) });
        }
        assert_eq!((watch.remarks(), watch.joints().is_ok()), (&["reduced".to_owned()][..], true));
        watch.feed(&JointState { stopped: Some("fault".to_owned()), ..state(30, vec![1.0]) });
        assert_eq!(watch.joints(), Err(Unrest::Stopped("fault".to_owned())));
    }
}
