//! Robot programs for a plan: text in the controller's own language.
//!
//! Every program uses slow joint moves (never linear ones) to exact stops, waits at the measured poses, and passes through the
//! others. The header of every program tells the operator to run it in manual mode up to the first pose, and states its joint
//! convention. This module never sends or starts a program.
//!
//! **Joint convention.** A configuration is the pendant joint vector, so controllers get it unchanged, including FANUC's J3 with
//! its coupling to J2. The exception is ROS: each joint of a URDF turns a link relative to the previous one, so a coupled joint
//! gets its own value plus the coupled ones (FANUC: J3 + J2), in the direction of the pendant. INFORM uses motor pulses, whose
//! meaning for coupled axes is not documented publicly, so such arms are refused.
//!
//! **Digits.** Values are written with the digits that the controller stores. The plan's grid
//! ([`on_grid`](crate::planning::candidates::on_grid)) fits all of them except pulses. [`Program::largest_rounding`] is the
//! largest difference between the text and the plan.
//!
//! **Line ends.** CR LF for controllers whose own tools write it (ABB, KUKA, FANUC, Yaskawa, Stäubli), LF for URScript and YAML.
//! All text is ASCII; other characters in names are replaced.

pub mod configuration;
mod error;
mod fanuc;
mod findings;
pub mod gzip;
mod inform;
pub mod insert;
mod krl;
mod lexer;
pub mod motion;
mod names;
mod orientation;
mod rapid;
mod remark;
pub mod rewrite;
mod ros;
mod urscript;
mod val3;
mod xml;

use jiff::civil::DateTime;

pub use error::ProgramError;
pub use names::MAX_NAME;
pub use remark::with_remark;

use crate::kinematics::{JointType, KinematicChain};
use crate::session::plan::{PlannedPose, PoseKind};
use crate::text::{decimal, names, wrapped};

/// A robot programming language.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Dialect {
    /// ABB RAPID module.
    Rapid,
    /// KUKA KRL source.
    Krl,
    /// FANUC TP program as ASCII (`.LS`).
    Fanuc,
    /// Universal Robots script.
    Urscript,
    /// Stäubli VAL3 program and data.
    Val3,
    /// Yaskawa INFORM job.
    Inform,
    /// ROS 2 `trajectory_msgs/JointTrajectory` as YAML.
    Ros,
}

names!(Dialect {
    Rapid = "rapid",
    Krl = "krl",
    Fanuc = "fanuc",
    Urscript = "urscript",
    Val3 = "val3",
    Inform = "inform",
    Ros = "ros",
});

impl Dialect {
    /// The language of the controller of a robot, by the maker in its name or title.
    pub fn of_robot(name: &str) -> Option<Self> {
        let name = name.to_lowercase();
        let makers: [(&[&str], Self); 6] = [
            (&["abb", "irb"], Self::Rapid),
            (&["kuka", "iiwa"], Self::Krl),
            (&["fanuc", "lrmate"], Self::Fanuc),
            (&["universal robots", "ur3", "ur5", "ur10", "ur16", "ur20", "ur30"], Self::Urscript),
            (&["staubli", "stäubli"], Self::Val3),
            (&["yaskawa", "motoman"], Self::Inform),
        ];
        makers
            .into_iter()
            .find(|(makers, _)| makers.iter().any(|maker| name.contains(maker)))
            .map(|(_, dialect)| dialect)
    }

    /// The language that the ending of a file name tells.
    pub fn of_file(name: &str) -> Option<Self> {
        let ending = name.rsplit_once('.')?.1.to_ascii_lowercase();
        match ending.as_str() {
            "mod" | "modx" | "prg" | "sys" => Some(Self::Rapid),
            "src" | "dat" | "sub" => Some(Self::Krl),
            "ls" => Some(Self::Fanuc),
            "script" | "urp" => Some(Self::Urscript),
            "dtx" | "pgx" => Some(Self::Val3),
            "jbi" => Some(Self::Inform),
            "yaml" | "yml" | "json" => Some(Self::Ros),
            _ => None,
        }
    }

    /// The table of languages.
    const fn language(self) -> &'static Language {
        match self {
            Self::Rapid => &rapid::LANGUAGE,
            Self::Krl => &krl::LANGUAGE,
            Self::Fanuc => &fanuc::LANGUAGE,
            Self::Urscript => &urscript::LANGUAGE,
            Self::Val3 => &val3::LANGUAGE,
            Self::Inform => &inform::LANGUAGE,
            Self::Ros => &ros::LANGUAGE,
        }
    }
}

/// Everything that differs between the languages.
struct Language {
    /// Name in messages.
    title: &'static str,
    /// How to load or start the program, if that is not obvious.
    advice: Option<&'static str>,
    /// How joint values are counted, for an arm without and with coupled joints.
    convention: [&'static str; 2],
    write: fn(&mut Job<'_>) -> Result<Vec<ProgramFile>, ProgramError>,
    read: fn(&findings::Source<'_>) -> Result<motion::Scan, ProgramError>,
    digits: Digits,
    remark: remark::Remark,
}

/// Decimals of corrected numbers: enough for 1 µm and 1 µrad where the controller stores them.
#[derive(Clone, Copy, Debug)]
struct Digits {
    joint: usize,
    /// Of coordinates.
    length: usize,
    /// Of angles or parts of a quaternion.
    turn: usize,
    /// The controller stores exactly these; elsewhere a number keeps the digits that it had, if they were more.
    are_fixed: bool,
}

/// The usual convention of controllers in degrees.
const AS_ON_PENDANT: [&str; 2] =
    ["Joint values as on the pendant, in degrees.", "Joint values as on the pendant, in degrees, couplings included."];

/// The arm for which the program is written.
#[derive(Clone, Copy, Debug)]
pub struct Robot<'a> {
    /// Name of the profile, for the header of the program.
    pub profile: &'a str,
    /// Joints: types, names and couplings.
    pub chain: &'a KinematicChain,
    /// Highest speed of each joint (rad/s, sliding joints m/s); only ROS and URScript use it.
    pub max_speeds: &'a [Option<f64>],
    /// Encoder pulses per degree of each joint; only INFORM needs it.
    pub pulses_per_degree: &'a [Option<f64>],
    /// Further names of each joint, such as those of common URDFs; only ROS uses them.
    pub joint_aliases: &'a [Vec<String>],
}

/// How the program waits while a pose is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pause {
    /// For a fixed time (s).
    Dwell(f64),
    /// Until the operator acknowledges.
    Acknowledge,
}

/// Options of the program.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Name of the program; shortened and cleaned for the dialect.
    pub name: String,
    /// How the program waits at measured poses.
    pub pause: Pause,
    /// Fraction of full speed, above 0 and at most [`MAX_SPEED`].
    pub speed: f64,
    /// Creation time, for headers with a date.
    pub created: DateTime,
    /// Predicted collisions, for the header.
    pub dangers: Vec<String>,
}

/// Largest fraction of full speed of a measuring program.
pub const MAX_SPEED: f64 = 0.5;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProgramFile {
    /// File name with extension, without folder.
    pub file_name: String,
    /// Content, with the line ends of the controller.
    pub text: String,
}

/// A program, in one or more files.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    pub files: Vec<ProgramFile>,
    /// Largest difference between a joint value in the text and in the plan (rad, sliding joints m).
    pub largest_rounding: f64,
}

/// Writes the program of a plan.
///
/// # Errors
/// An arm that the dialect does not support, a missing or invalid number, an empty plan, or a wait for the operator in a dialect
/// without one.
pub fn write(
    dialect: Dialect,
    robot: &Robot<'_>,
    poses: &[PlannedPose],
    options: &Options,
) -> Result<Program, ProgramError> {
    let dof = robot.chain.dof();
    if poses.is_empty() {
        return Err(ProgramError::EmptyPlan);
    }
    if let Some(pose) = poses.iter().find(|pose| pose.configuration.len() != dof) {
        let joints = pose.configuration.len();
        return Err(ProgramError::PoseJoints { pose: names::ascii(&pose.pose), joints, robot_joints: dof });
    }
    if let Some(pose) = poses.iter().find(|pose| !pose.configuration.iter().all(|value| value.is_finite())) {
        return Err(ProgramError::NotFinite { pose: names::ascii(&pose.pose) });
    }
    if !(options.speed > 0.0 && options.speed <= MAX_SPEED) {
        return Err(ProgramError::Speed { speed: options.speed });
    }
    if let Pause::Dwell(dwell) = options.pause
        && !(dwell > 0.0 && dwell <= MAX_DWELL)
    {
        return Err(ProgramError::Dwell { dwell });
    }
    let mut job = Job { dialect, robot, poses, options, largest_rounding: 0.0 };
    let files = (dialect.language().write)(&mut job)?;
    Ok(Program { files, largest_rounding: job.largest_rounding })
}

/// Longest wait at a pose (s); a longer one is probably in the wrong unit.
const MAX_DWELL: f64 = 600.0;

/// Input of a dialect's writer, and its largest rounding so far.
struct Job<'a> {
    dialect: Dialect,
    robot: &'a Robot<'a>,
    poses: &'a [PlannedPose],
    options: &'a Options,
    largest_rounding: f64,
}

impl Job<'_> {
    /// Checks the number of joints, and that no joint slides unless that is allowed.
    fn require_joints(
        &self,
        allowed: std::ops::RangeInclusive<usize>,
        is_sliding_allowed: bool,
    ) -> Result<(), ProgramError> {
        let dialect = self.dialect;
        let joints = self.robot.chain.dof();
        if !allowed.contains(&joints) {
            return Err(ProgramError::JointCount { dialect, joints, least: *allowed.start(), most: *allowed.end() });
        }
        let mut types = self.robot.chain.joints().iter();
        match types.find(|joint| joint.joint_type == JointType::Prismatic) {
            Some(joint) if !is_sliding_allowed => {
                Err(ProgramError::SlidingJoint { dialect, joint: names::ascii(&joint.name) })
            }
            _ => Ok(()),
        }
    }

    /// Joint values in degrees (sliding joints mm) with this many decimals.
    fn edge_values(&mut self, pose: &PlannedPose, decimals: usize) -> Vec<String> {
        let joints = self.robot.chain.joints().iter().zip(&pose.configuration);
        let values: Vec<_> = joints.map(|(joint, &q)| (joint.joint_type.quantity(), q)).collect();
        values
            .into_iter()
            .map(|(quantity, q)| {
                let text = decimal(quantity.to_edge(q), decimals);
                self.note_rounding(quantity.from_edge(text.parse().unwrap_or(f64::NAN)), q);
                text
            })
            .collect()
    }

    /// Joint values in radians (sliding joints m) with this many decimals.
    fn si_values(&mut self, values: &[f64], decimals: usize) -> Vec<String> {
        let write = |&value: &f64| {
            let text = decimal(value, decimals);
            self.note_rounding(text.parse().unwrap_or(f64::NAN), value);
            text
        };
        values.iter().map(write).collect()
    }

    fn note_rounding(&mut self, written: f64, planned: f64) {
        self.largest_rounding = self.largest_rounding.max((written - planned).abs());
    }

    /// Comment at the start of every program, in lines of at most `width` characters.
    fn header(&self, width: usize) -> Vec<String> {
        let measured = self.poses.iter().filter(|pose| pose.kind.is_measured()).count();
        let mut lines = vec![
            format!("Calibration poses by trupose {}", env!("CARGO_PKG_VERSION")),
            format!("Profile: {}", names::ascii(self.robot.profile)),
            format!("{} stops, {measured} of them measured", self.poses.len()),
            "SAFETY: run it in manual mode at reduced speed up to the first pose, hand on the enabling switch. Cables, \
             fixtures and people are unknown to the planner. Check that this is the robot of the profile above."
                .to_owned(),
            self.convention().to_owned(),
            "Moves are joint moves: the active tool does not matter for the path.".to_owned(),
            match self.options.pause {
                Pause::Dwell(dwell) => format!("Each measured pose is held for {} s.", decimal(dwell, 1)),
                Pause::Acknowledge => "Each measured pose is held until the operator continues.".to_owned(),
            },
        ];
        lines.extend(self.options.dangers.iter().map(|danger| format!("DANGER: {}", names::ascii(danger))));
        lines.extend(self.dialect.language().advice.map(str::to_owned));
        lines.iter().flat_map(|line| wrapped(line, width)).collect()
    }

    fn convention(&self) -> &'static str {
        let is_coupled = self.robot.chain.joints().iter().any(|joint| joint.coupling.iter().any(|c| *c != 0.0));
        let [usual, coupled] = self.dialect.language().convention;
        if is_coupled { coupled } else { usual }
    }

    /// Label of a pose in comments, such as `pose 12, verification`.
    fn label(pose: &PlannedPose) -> String {
        match pose.kind {
            PoseKind::Home | PoseKind::Via => pose.kind.name().to_owned(),
            kind => {
                let name: String = names::ascii(&pose.pose).chars().take(MAX_NAME).collect();
                format!("pose {name}, {kind}")
            }
        }
    }

    /// A file named after the program.
    fn file(name: &str, extension: &str, lines: &[String], line_end: &str) -> ProgramFile {
        let mut text = lines.join(line_end);
        text.push_str(line_end);
        ProgramFile { file_name: format!("{name}.{extension}"), text }
    }

    /// Dwell time (s) with two decimals, unless the program waits for the operator.
    fn dwell(&self) -> Option<String> {
        match self.options.pause {
            Pause::Dwell(dwell) => Some(decimal(dwell, 2)),
            Pause::Acknowledge => None,
        }
    }

    /// Speed in percent of full speed, a whole number of at least 1.
    fn percent(&self) -> String {
        decimal((self.options.speed * 100.0).round().max(1.0), 0)
    }
}

/// Length of a comment line if the controller has no limit (characters).
const COMMENT_WIDTH: usize = 72;

const CRLF: &str = "\r\n";
const LF: &str = "\n";
