//! What a reader finds in a robot program: targets that can be corrected, places that stay, and the moves that use them.

use std::fmt;
use std::ops::Range;

use nalgebra::Isometry3;

use super::configuration::Configuration;
use super::insert::Spot;
use super::orientation::Orientation;
use crate::text::counted;

/// Targets and moves of a program.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scan {
    /// Targets in the order of the text.
    pub targets: Vec<Target>,
    /// Places that stay as they are, by line.
    pub left: Vec<LeftAlone>,
    /// Signs that the points were taught or computed.
    pub hints: Vec<Hint>,
    /// Moves in the order of the text; those of companion files follow.
    pub moves: Vec<Move>,
}

/// A motion target whose numbers can be replaced.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Line, from 1.
    pub line: usize,
    /// Name of the variable or number of the position.
    pub name: Option<String>,
    pub goal: Goal,
    pub(super) slots: Vec<Slot>,
    pub(super) form: Form,
}

/// What a target asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// Pendant configuration (rad), sliding joints (m).
    Joints(Vec<f64>),
    Pose(PoseTarget),
}

/// A Cartesian target.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseTarget {
    pub frame_from_tool: Isometry3<f64>,
    pub configuration: Configuration,
    /// Tool in the flange frame of the controller.
    pub tool: Setting,
    /// Frame in the world frame of the controller.
    pub frame: Setting,
}

/// Where a tool or a frame comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Setting {
    /// The flange itself, or the world of the controller.
    Identity,
    /// Stated by the program or a companion file.
    Known { name: String, pose: Box<Isometry3<f64>> },
    /// Not in the files: the caller must know it.
    Named(String),
}

impl Setting {
    /// Name for messages and for the option that resolves it.
    pub fn name(&self) -> &str {
        match self {
            Self::Identity => "",
            Self::Known { name, .. } | Self::Named(name) => name,
        }
    }
}

/// A motion instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Move {
    /// Line, from 1, in the program or in the companion.
    pub line: usize,
    /// Index of the companion file that contains the move; `None`: the program itself.
    pub companion: Option<usize>,
    pub kind: MoveKind,
    /// Index of its target in [`Scan::targets`]; `None` if it is left alone or in another file.
    pub target: Option<usize>,
    /// A move and the linear and circular moves that follow it share a number.
    pub path: usize,
    /// The first of its routine: nothing is known of where the arm comes from.
    pub is_first: bool,
    pub(super) spot: Option<Box<Spot>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MoveKind {
    Joint,
    Linear,
    /// Through a point, whose index in [`Scan::targets`] is `via`.
    Circular {
        via: Option<usize>,
    },
}

/// A place that is not changed.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LeftAlone {
    /// Line, from 1.
    pub line: usize,
    pub name: Option<String>,
    pub reason: Reason,
}

/// Why a place is not changed.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// A difference, not a position.
    Relative,
    /// A position plus an offset that the program states.
    Offset,
    /// Only offsets use it.
    OffsetBase,
    /// The program computes it while it runs.
    Computed,
    /// A single component is assigned.
    Component,
    /// Some axes or coordinates are missing and keep their value.
    Incomplete,
    /// It is in another of the given files.
    InFile(String),
    /// It is in none of the given files.
    Elsewhere,
    /// No motion of the given files uses it.
    NotMovedTo,
    /// It is handed to a routine, whose use of it is unknown.
    PassedTo(String),
    /// It is a variable of the controller, such as a limit, a home or a frame.
    SystemVariable,
    /// Numbers cannot be read.
    Unreadable,
    /// Another number of joints.
    JointCount { found: usize, joints: usize },
    /// The position was never taught.
    Untaught,
    /// Moves use it with several tools or frames.
    SeveralSettings,
    /// The tool is fixed in the cell and the robot holds the workpiece.
    StationaryTool,
    /// A mechanical unit moves the frame.
    MovingFrame,
    /// External axes are not at zero, and may carry the arm or the workpiece.
    ExternalAxes,
    /// An axis beside those of the arm: of a track or a positioner, or axis 7 of another arm.
    SeventhAxis,
    /// The arm angle of a seven-axis arm.
    ArmAngle,
    /// Of another group of axes.
    OtherGroup,
    /// A register that other programs use as well.
    Register,
    /// Of other joints than those of the arm.
    OtherJoints,
    /// The notation of the configuration is unknown.
    UnknownConfiguration,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Self::Relative => "a relative move",
            Self::Offset => "a position with an offset",
            Self::OffsetBase => "used only as the base of offsets",
            Self::Computed => "computed while the program runs",
            Self::Component => "a single component of a position",
            Self::Incomplete => "some axes or coordinates are missing",
            Self::InFile(file) => return write!(f, "its values are in '{file}'"),
            Self::Elsewhere => "its values are in none of the given files",
            Self::NotMovedTo => "no motion of the given files uses it",
            Self::PassedTo(routine) => return write!(f, "passed to '{routine}', whose use of it is unknown"),
            Self::SystemVariable => "a setting of the controller, not a motion target",
            Self::Unreadable => "not a list of plain numbers",
            Self::JointCount { found, joints } => {
                return write!(f, "{}, and the arm has {}", counted(*found, "joint value"), counted(*joints, "joint"));
            }
            Self::Untaught => "a position without values",
            Self::SeveralSettings => "used with several tools or frames",
            Self::StationaryTool => "the tool is fixed in the cell",
            Self::MovingFrame => "its frame moves with a mechanical unit",
            Self::ExternalAxes => "external axes are not at zero",
            Self::SeventhAxis => "it states a seventh axis: an external one, or that of a seven-axis arm",
            Self::ArmAngle => {
                "its arm angle counts from a direction that is set in the controller and not stated in the program"
            }
            Self::OtherGroup => "a position of another group of axes",
            Self::Register => "a position register, whose value is outside the program",
            Self::OtherJoints => "values of other joints",
            Self::UnknownConfiguration => "the configuration cannot be read",
        };
        f.write_str(text)
    }
}

/// A sign that points were taught on the robot or computed by a program.
#[derive(Clone, Debug, PartialEq)]
pub enum Hint {
    /// A comment of an offline programming system.
    OfflineSystem { line: usize, name: &'static str },
    /// Points that were recorded on an arm with a compensated controller, such as KUKA's status bit 4.
    AbsoluteAccuracy { line: usize },
    /// Coordinates or joint values that are whole numbers, as people and programs choose them.
    RoundNumbers { round: usize, values: usize },
}

impl Hint {
    /// Whether the points are probably computed; `None` if the hint says nothing about it.
    pub fn is_computed(&self) -> Option<bool> {
        match self {
            Self::OfflineSystem { .. } => Some(true),
            Self::AbsoluteAccuracy { .. } => None,
            Self::RoundNumbers { round, values } => match (*values >= 12, 10 * round) {
                (true, tenfold) if tenfold >= 6 * values => Some(true),
                (true, tenfold) if tenfold <= *values => Some(false),
                _ => None,
            },
        }
    }
}

impl fmt::Display for Hint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OfflineSystem { line, name } => write!(f, "line {line}: written by {name}"),
            Self::AbsoluteAccuracy { line } => {
                write!(f, "line {line}: recorded on an arm with an absolutely accurate model")
            }
            Self::RoundNumbers { round, values } => write!(f, "{round} of {values} values are whole numbers"),
        }
    }
}

/// What a reader needs besides the program.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Joint names of a ROS trajectory, from base to flange; by default those of the profile and their aliases.
    pub joint_names: Option<Vec<String>>,
    /// Files that belong to the program: declarations of its targets, tools and frames, or the moves that use them.
    pub companions: Vec<Companion>,
    /// External axes carry neither the arm nor the workpiece, so their positions do not matter for Cartesian targets.
    pub ignores_external_axes: bool,
}

/// A file that belongs to the program; it is read, never changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Companion {
    /// Name for messages.
    pub name: String,
    pub text: Vec<u8>,
}

/// New values of a target.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Pendant configuration (rad), sliding joints (m).
    Joints(Vec<f64>),
    /// The tool in the frame of the target.
    Pose(Isometry3<f64>),
}

/// The place of a number in the text.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Slot {
    /// Bytes of the number; empty where it must be inserted.
    pub(super) place: Range<usize>,
    /// Attribute to insert in front of the number, if it is missing because it is zero.
    pub(super) attribute: Option<String>,
    /// Units of the form per unit of the text, for a number inside a conversion such as `d2r(…)`.
    pub(super) scale: f64,
}

impl Slot {
    pub(super) const fn at(place: Range<usize>) -> Self {
        Self { place, attribute: None, scale: 1.0 }
    }
}

/// How a target is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// One slot per joint of the arm.
    Joints(JointUnit),
    /// Three slots for the position and those of the orientation.
    Pose(Orientation),
}

/// Units of joint values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum JointUnit {
    /// Degrees, sliding joints mm.
    Edge,
    /// Radians, sliding joints m.
    Si,
    /// Encoder pulses.
    Pulses,
    /// Radians or m of each link relative to the one before, as in a URDF.
    Links,
}
