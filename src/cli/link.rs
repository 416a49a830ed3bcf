//! Arguments of `trupose link` and `trupose simulate`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::PayloadArgs;
use crate::session::simulation::{JointErrorSizes, SimulatedWire};
use crate::session::wire::WireProtocol;

/// Subcommands of `link`.
#[derive(Debug, Subcommand)]
pub enum LinkCommand {
    /// Connect to an instrument, check its settings, show its live view, take a few shots, and report problems
    Test(LinkTestArgs),
}

/// Arguments of `link test`.
#[derive(Args, Clone, Debug)]
pub struct LinkTestArgs {
    /// Address of the instrument, such as 'emscon:192.168.0.2', 'geocom:serial:/dev/ttyUSB0:9600' or 'ascii:listen:0.0.0.0:5000'
    #[arg(value_name = "ADDRESS")]
    pub address: String,
    /// Options of the protocol: the name of a preset, or the options that differ from the defaults, such as '(measure_ms: 2000)'
    #[arg(long, value_name = "TEXT")]
    pub options: Option<String>,
    /// Address of the robot's controller, such as 'rtde:192.168.0.10', 'kuka:192.168.0.10' or 'ascii:listen:0.0.0.0:5001'
    #[arg(long, value_name = "ADDRESS")]
    pub robot: Option<String>,
    /// Options of the controller's protocol, such as '(pulses_per_degree: [1000.0, ...])' of a Yaskawa
    #[arg(long, value_name = "TEXT", requires = "robot")]
    pub robot_options: Option<String>,
    /// Robot profile, a file or the name of a shipped one: checks that the controller can report its joints, and provides the pulses per degree of a Yaskawa
    #[arg(long, value_name = "NAME|FILE")]
    pub profile: Option<String>,
    /// Number of shots; 0 for none
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub shots: u32,
    /// How long to watch before the shots (s)
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds)]
    pub seconds: f64,
    /// Log every byte to and from instruments on a wire to this file
    #[arg(long, value_name = "FILE")]
    pub raw_log: Option<PathBuf>,
}

/// Arguments of `simulate`.
#[derive(Args, Clone, Debug)]
pub struct SimulateArgs {
    /// Protocol
    #[arg(value_name = "PROTOCOL", value_enum)]
    pub protocol: WireProtocol,
    /// TCP address to listen on, such as '127.0.0.1:7000'; port 0 for any free one
    #[arg(long, value_name = "HOST:PORT", required_unless_present = "pty", conflicts_with = "pty")]
    pub listen: Option<String>,
    /// Listen on a pseudo-terminal, as on a serial line
    #[arg(long)]
    pub pty: bool,
    /// Report the joints of the simulated robot at this TCP address, by RTDE or by the protocol in front of it, such as 'kuka:127.0.0.1:7000'
    #[arg(long, value_name = "[PROTOCOL:]HOST:PORT")]
    pub robot: Option<String>,
    /// Robot profile: a file, or the name of a shipped one ('trupose profile list')
    #[arg(long, value_name = "NAME|FILE", default_value = "soochow")]
    pub profile: String,
    /// Seed of the hidden deviations and of the noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Sizes of hidden errors of the joints (urad), such as 'curves=100,compliance=500,tilt=100,harmonics=50'
    #[arg(long, value_name = "SIZES")]
    pub joint_errors: Option<JointErrorSizes>,
    /// What the robot carries.
    #[command(flatten)]
    pub payload: PayloadArgs,
    /// Fault of the instrument, such as 'cut-20@3' for the third occasion or 'drip@1x5'; may be repeated
    #[arg(long = "fault", value_name = "NAME")]
    pub faults: Vec<String>,
    /// Poses that the robot visits; without a plan it stays in the middle of its joint ranges
    #[arg(long, value_name = "CSV")]
    pub plan: Option<PathBuf>,
    /// Move to the next pose after this many shots and a second without another one; 0 to wait for 'next'
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub shots: usize,
}

/// Value of `--over`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wires(pub Vec<SimulatedWire>);

/// Parses the value of `--over`.
pub(super) fn wires(text: &str) -> Result<Wires, String> {
    let wire = |text: &str| match text.trim().strip_prefix("serial:") {
        Some(protocol) => protocol.parse().map(SimulatedWire::Serial),
        None => text.trim().parse().map(SimulatedWire::Tcp),
    };
    text.split(',').map(wire).collect::<Result<_, _>>().map(Wires)
}

/// Parses a time of at least 0 (s).
fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=86_400.0).contains(&value) => Ok(value),
        _ => Err(format!("'{text}' is not a time from 0 to 86400 s")),
    }
}
