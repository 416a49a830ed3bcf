//! Errors of programs.

use thiserror::Error;

use super::{Dialect, MAX_DWELL, MAX_SPEED};

/// A program that cannot be written.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ProgramError {
    #[error("the plan has no poses")]
    EmptyPlan,
    /// A pose of another robot.
    #[error(
        "pose '{pose}' has {joints} joint values, but the robot has {robot_joints} joints; use the profile of the plan"
    )]
    PoseJoints {
        pose: String,
        /// Number of its joint values.
        joints: usize,
        /// Number of joints of the robot.
        robot_joints: usize,
    },
    /// A joint value that is not finite.
    #[error("pose '{pose}' has a joint value that is not a finite number")]
    NotFinite { pose: String },
    /// A speed out of range.
    #[error(
        "the speed must be above 0 and at most {:.0} % of full speed, not {:.1} %: the SMR must not be thrown off",
        100.0 * MAX_SPEED, 100.0 * speed
    )]
    Speed {
        /// Fraction of full speed.
        speed: f64,
    },
    /// A waiting time out of range.
    #[error("the dwell must be above 0 and at most {MAX_DWELL:.0} s, not {dwell} s")]
    Dwell {
        /// Requested time (s).
        dwell: f64,
    },
    /// An arm with too many or too few joints.
    #[error(
        "{} programs are written for arms with {}, and this one has {joints}; choose the dialect of its controller",
        dialect.language().title, joint_range(*least, *most)
    )]
    JointCount {
        dialect: Dialect,
        /// Number of joints of the arm.
        joints: usize,
        least: usize,
        most: usize,
    },
    /// A sliding joint in a dialect that does not support it.
    #[error("{} programs are written for arms whose joints all turn, and '{joint}' slides", dialect.language().title)]
    SlidingJoint { dialect: Dialect, joint: String },
    /// Pulses per degree are unknown.
    #[error(
        "INFORM programs count pulses, and the profile has no 'pulses_per_degree' for {}; add it: \
         compare the pulse and the degree display of the pendant in two positions of the joint",
        quoted(joints)
    )]
    PulsesPerDegree { joints: Vec<String> },
    /// A coupled joint in a dialect with pulses.
    #[error(
        "joint '{joint}' is coupled to another one, and it is not documented whether its pulse count includes the coupling; \
         INFORM programs are written for uncoupled arms only"
    )]
    CoupledPulses { joint: String },
    /// More pulses than a job can store.
    #[error("joint '{joint}' would need {pulses:.0} pulses in pose '{pose}'; check 'pulses_per_degree'")]
    TooManyPulses { joint: String, pose: String, pulses: f64 },
    /// The highest speed is unknown, so times cannot be computed.
    #[error("a ROS trajectory needs times, and the profile has no highest speed for {}; add it", quoted(joints))]
    MaxSpeed { joints: Vec<String> },
    /// A wait for the operator in a dialect that has none.
    #[error("a ROS trajectory cannot wait for the operator; use a dwell that is long enough to measure")]
    NoOperator,
    /// The program is not plain text.
    #[error("the program contains zero bytes, so it is binary or UTF-16; export it as plain text")]
    NotText,
    /// The program is compressed.
    #[error("the program is compressed, and its content cannot be unpacked: it is damaged or no gzip file")]
    Compressed,
    /// The trajectory is for other joints.
    #[error("the trajectory has the joints {}; the arm has {}; name the joints of the trajectory in the order from base to flange", found.join(", "), expected.join(", "))]
    JointNames {
        /// Joint names in the trajectory.
        found: Vec<String>,
        /// Joint names of the arm.
        expected: Vec<String>,
    },
}

fn quoted(names: &[String]) -> String {
    names.iter().map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ")
}

fn joint_range(least: usize, most: usize) -> String {
    if least == most { format!("{least} joints") } else { format!("{least} to {most} joints") }
}
