//! Why there is no program.

use thiserror::Error;

use super::{Dialect, MAX_DWELL, MAX_SPEED};

/// A program that cannot be written.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ProgramError {
    /// A dialect that is not known.
    #[error("there is no dialect '{text}'; dialects: {}", Dialect::ALL.map(Dialect::name).join(", "))]
    UnknownDialect {
        /// What was asked for.
        text: String,
    },
    /// Nothing to write.
    #[error("the plan has no poses")]
    EmptyPlan,
    /// A pose of another robot.
    #[error(
        "pose '{pose}' has {joints} joint values, but the robot has {robot_joints} joints; use the profile of the plan"
    )]
    PoseJoints {
        /// Name of the pose.
        pose: String,
        /// Its values.
        joints: usize,
        /// Joints of the robot.
        robot_joints: usize,
    },
    /// A joint value that is no number.
    #[error("pose '{pose}' has a joint value that is not a finite number")]
    NotFinite {
        /// Name of the pose.
        pose: String,
    },
    /// A speed out of range.
    #[error(
        "the speed must be above 0 and at most {:.0} % of full speed, not {:.1} %: the SMR must not be thrown off",
        100.0 * MAX_SPEED, 100.0 * speed
    )]
    Speed {
        /// Part of full speed.
        speed: f64,
    },
    /// A waiting time out of range.
    #[error("the dwell must be above 0 and at most {MAX_DWELL:.0} s, not {dwell} s")]
    Dwell {
        /// Time asked for (s).
        dwell: f64,
    },
    /// An arm with too many or too few joints.
    #[error(
        "{} programs are written for arms with {}, and this one has {joints}; choose the dialect of its controller",
        dialect.title(), joint_range(*least, *most)
    )]
    JointCount {
        /// The dialect.
        dialect: Dialect,
        /// Joints of the arm.
        joints: usize,
        /// Fewest.
        least: usize,
        /// Most.
        most: usize,
    },
    /// A sliding joint where all must turn.
    #[error("{} programs are written for arms whose joints all turn, and '{joint}' slides", dialect.title())]
    SlidingJoint {
        /// The dialect.
        dialect: Dialect,
        /// Name of the joint.
        joint: String,
    },
    /// Pulses without their size.
    #[error(
        "INFORM programs count pulses, and the profile has no 'pulses_per_degree' for {}; add it: \
         compare the pulse and the degree display of the pendant in two positions of the joint",
        joints.iter().map(|joint| format!("'{joint}'")).collect::<Vec<_>>().join(", ")
    )]
    PulsesPerDegree {
        /// Names of the joints.
        joints: Vec<String>,
    },
    /// Pulses of a coupled joint.
    #[error(
        "joint '{joint}' is coupled to another one, and whether its pulse count includes the coupling is not known; \
         INFORM programs are written for uncoupled arms only"
    )]
    CoupledPulses {
        /// Name of the joint.
        joint: String,
    },
    /// More pulses than a job holds.
    #[error("joint '{joint}' would need {pulses:.0} pulses in pose '{pose}'; check 'pulses_per_degree'")]
    TooManyPulses {
        /// Name of the joint.
        joint: String,
        /// Name of the pose.
        pose: String,
        /// Pulses.
        pulses: f64,
    },
    /// A time that cannot be computed.
    #[error("a ROS trajectory needs times, and the profile has no highest speed for {}; add it", joints.iter().map(|joint| format!("'{joint}'")).collect::<Vec<_>>().join(", "))]
    MaxSpeed {
        /// Names of the joints.
        joints: Vec<String>,
    },
    /// Nobody to wait for.
    #[error("a ROS trajectory cannot wait for the operator; use a dwell that is long enough to measure")]
    NoOperator,
    /// A program that is no text.
    #[error("the program has zero bytes: it is no text, or UTF-16; export it as plain text")]
    NotText,
    /// A trajectory for other joints.
    #[error("the trajectory has the joints {}; the arm has {}; name those of the arm in the order from base to flange", found.join(", "), expected.join(", "))]
    JointNames {
        /// Names in the trajectory.
        found: Vec<String>,
        /// Names of the arm.
        expected: Vec<String>,
    },
}

fn joint_range(least: usize, most: usize) -> String {
    if least == most { format!("{least} joints") } else { format!("{least} to {most} joints") }
}
