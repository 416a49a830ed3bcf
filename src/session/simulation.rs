//! Settings of the simulated cell: which robot is hidden in it, how its instrument scatters, and what goes wrong when.
//!
//! A fault is written `NAME@FIRST[-LAST][:SIZE]`: `wrong-pose@12`, `target-bumped@20:5mm`, `joint-sign@1:j3`, `beam-break@7-9`.
//! FIRST and LAST are numbers of measurements in the session, counted from 1. Faults of the set-up (unit, sign, bump, drift) last
//! from FIRST on unless LAST is given; slips (wrong pose, typing, outlier, motion, beam) happen once, or from FIRST to LAST.
//! Swapped rows are FIRST and the one after it; they have no LAST.

mod text;

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::set_up::PayloadText;
use super::wire::WireProtocol;
use crate::text::printable;
use crate::units::Quantity;
pub use text::FaultError;

/// A robot, an instrument and an operator that exist in the program only.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Simulation {
    /// Seed of everything that is random.
    #[serde(default = "first_seed")]
    pub seed: u64,
    /// How the robot really is.
    #[serde(default)]
    pub truth: Truth,
    /// Errors of its joints beyond the geometry; none: its joints are exact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_errors: Option<JointErrorSizes>,
    /// What it really carries; none: what the profile says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub payload: Option<PayloadText>,
    /// Standard deviation of a coordinate (mm); none: that of the profile's instrument, else 0.01 mm.
    #[serde(default)]
    pub noise_mm: Option<f64>,
    /// What goes wrong.
    #[serde(default)]
    pub faults: Vec<Fault>,
    /// Wires that instrument and robot are spoken to over; none: not over a wire.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wires: Vec<SimulatedWire>,
}

/// A wire of a rehearsal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SimulatedWire {
    /// Over TCP on this machine.
    Tcp(WireProtocol),
    /// Over a pseudo-terminal, as a serial line.
    Serial(WireProtocol),
}

impl SimulatedWire {
    /// What is spoken.
    pub const fn protocol(self) -> WireProtocol {
        match self {
            Self::Tcp(protocol) | Self::Serial(protocol) => protocol,
        }
    }

    /// Whether it is a serial line.
    pub const fn is_serial(self) -> bool {
        matches!(self, Self::Serial(_))
    }
}

const fn first_seed() -> u64 {
    1
}

impl Default for Simulation {
    fn default() -> Self {
        Self {
            seed: first_seed(),
            truth: Truth::default(),
            joint_errors: None,
            payload: None,
            noise_mm: None,
            faults: Vec::new(),
            wires: Vec::new(),
        }
    }
}

/// Sizes of the errors of the joints of a simulated robot (µrad), drawn by seed: standard deviations of the coefficients, but for
/// the curves, whose size is their rms. What gravity does bends the arm downwards: those coefficients are not negative.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JointErrorSizes {
    /// Joint curves: harmonics from the third on, with the spectrum that identification expects.
    pub curves_urad: f64,
    /// Turn of a joint at its largest gravity torque.
    pub compliance_urad: f64,
    /// Tilt of a bearing at the largest gravity moment of the arm.
    pub tilt_urad: f64,
    /// Each coefficient of the first two harmonics of a joint.
    pub harmonics_urad: f64,
}

impl JointErrorSizes {
    /// The sizes with their names.
    pub const fn named(&self) -> [(&'static str, f64); 4] {
        [
            ("curves", self.curves_urad),
            ("compliance", self.compliance_urad),
            ("tilt", self.tilt_urad),
            ("harmonics", self.harmonics_urad),
        ]
    }
}

/// `curves=100,compliance=500`; what is not named is zero.
impl FromStr for JointErrorSizes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            let names = Self::default().named().map(|(name, _)| name);
            format!(
                "'{}' does not give sizes; write for example 'curves=100,compliance=500' ({})",
                printable(text),
                names.join(", ")
            )
        };
        let mut sizes = Self::default();
        for part in text.split(',') {
            let (name, size) = part.split_once('=').ok_or_else(wrong)?;
            let size = size.trim().parse().map_err(|_not_a_number: std::num::ParseFloatError| wrong())?;
            match name.trim() {
                "curves" => sizes.curves_urad = size,
                "compliance" => sizes.compliance_urad = size,
                "tilt" => sizes.tilt_urad = size,
                "harmonics" => sizes.harmonics_urad = size,
                _ => return Err(wrong()),
            }
        }
        Ok(sizes)
    }
}

/// The hidden deviations of a simulated robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Truth {
    /// Drawn from the expected deviations of the profile, by seed.
    #[default]
    Drawn,
    /// Table II of the method paper; only for the paper's arm.
    Paper,
    /// None: the robot is as its maker says.
    Nominal,
}

/// A fault with its time and size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Fault {
    /// What goes wrong.
    pub kind: FaultKind,
    /// First measurement with it, from 1.
    pub first: u64,
    /// Last one; `None`: as long as the kind lasts.
    pub last: Option<u64>,
}

impl Fault {
    /// Whether measurement `number` has this fault. For swapped rows that is the first of the two.
    pub const fn affects(&self, number: u64) -> bool {
        let last = match (self.last, self.kind.lasts()) {
            (Some(last), _) => last,
            (None, true) => u64::MAX,
            (None, false) => self.first,
        };
        self.first <= number && number <= last
    }
}

/// What can go wrong. Lengths in mm, angles in degrees; joints from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// The operator has moved to another pose than the one shown: the one that is shown next, or else one drawn by seed.
    WrongPose,
    /// The operator takes this pose and the next one in the wrong order.
    SwappedRows,
    /// The instrument counts in inches although millimetres are expected.
    Inch,
    /// The instrument counts in metres although millimetres are expected.
    Metre,
    /// A joint turns the other way than its profile says.
    JointSign { joint: usize },
    /// A joint moves this many times as far as shown: its values are in another unit than its profile says.
    JointUnit { joint: usize, factor: f64 },
    /// A joint moves with another one, which its profile does not say.
    JointCoupling {
        joint: usize,
        /// The other joint.
        with: usize,
        /// Movement per movement of the other joint.
        factor: f64,
    },
    /// A joint is elsewhere than shown, by this much (deg or mm).
    MistypedJoint {
        joint: usize,
        /// True less shown value.
        by: f64,
        /// Whether `by` is an angle (deg) or, for a sliding joint, a length (mm).
        quantity: Quantity,
    },
    /// The SMR sits elsewhere on the flange from then on, by this much (mm), in a direction drawn by seed.
    TargetBumped {
        /// How far.
        by_mm: f64,
    },
    /// The robot still moves: the reading is off and its shots scatter by this much (mm).
    NotAtRest {
        /// How far.
        by_mm: f64,
    },
    /// One reading is off by this much (mm), in a direction drawn by seed, without any scatter.
    Outlier {
        /// How far.
        by_mm: f64,
    },
    /// The beam is broken: no reading.
    BeamBreak,
    /// The tracker creeps away steadily, by this much per hour (mm).
    Drift {
        /// How fast.
        mm_per_hour: f64,
    },
}

impl FaultKind {
    /// Whether the fault stays once it is there; a slip happens once.
    pub const fn lasts(&self) -> bool {
        match self {
            Self::Inch
            | Self::Metre
            | Self::JointSign { .. }
            | Self::JointUnit { .. }
            | Self::JointCoupling { .. }
            | Self::TargetBumped { .. }
            | Self::Drift { .. } => true,
            Self::WrongPose
            | Self::SwappedRows
            | Self::MistypedJoint { .. }
            | Self::NotAtRest { .. }
            | Self::Outlier { .. }
            | Self::BeamBreak => false,
        }
    }
}
