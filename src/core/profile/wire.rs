//! Addresses of instruments and robots on a wire, as text:
//!
//! ```text
//! emscon:192.168.0.2              protocol and host; the port is the protocol's own
//! emscon:tcp:192.168.0.2:700      the same in full
//! geocom:serial:/dev/ttyUSB0:9600 serial port and speed
//! ascii:listen:0.0.0.0:5000       a client that connects here
//! ascii:udp:0.0.0.0:5000          datagrams that arrive here
//! rtde:192.168.1.10               a robot
//! joints:listen:0.0.0.0:5001      lines of joint values; `ascii:` means the same where an address of a robot is expected
//! ```

use std::fmt;
use std::str::FromStr;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use crate::text::printable;

/// Protocol on a wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, ValueEnum)]
pub enum WireProtocol {
    /// Leica emScon, binary.
    Emscon,
    /// Lines of text with coordinates.
    Ascii,
    /// Leica GeoCOM.
    Geocom,
    /// NDI combined API.
    Ndi,
    /// Universal Robots RTDE: joint angles of the robot.
    Rtde,
    /// Lines of text with the joint values of a robot.
    Joints,
    /// KUKA controller with KUKAVARPROXY or C3 Bridge: joint angles of the robot.
    Kuka,
    /// ABB controller with Robot Web Services of RobotWare 6: joint angles of the robot.
    Abb,
    /// FANUC controller with the Remote Motion Interface: joint angles of the robot.
    Fanuc,
    /// Yaskawa controller with the High-Speed Ethernet Server: pulses of the robot's axes.
    Yaskawa,
}

impl WireProtocol {
    /// All protocols.
    pub const ALL: [Self; 10] = [
        Self::Emscon,
        Self::Ascii,
        Self::Geocom,
        Self::Ndi,
        Self::Rtde,
        Self::Joints,
        Self::Kuka,
        Self::Abb,
        Self::Fanuc,
        Self::Yaskawa,
    ];

    /// Name in addresses.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Emscon => "emscon",
            Self::Ascii => "ascii",
            Self::Geocom => "geocom",
            Self::Ndi => "ndi",
            Self::Rtde => "rtde",
            Self::Joints => "joints",
            Self::Kuka => "kuka",
            Self::Abb => "abb",
            Self::Fanuc => "fanuc",
            Self::Yaskawa => "yaskawa",
        }
    }

    /// Default TCP port of the other end.
    pub const fn usual_port(self) -> Option<u16> {
        match self {
            Self::Emscon => Some(700),
            Self::Ndi => Some(8765),
            Self::Rtde => Some(30004),
            Self::Kuka => Some(7000),
            Self::Abb => Some(80),
            Self::Fanuc => Some(16001),
            Self::Yaskawa => Some(10040),
            Self::Ascii | Self::Geocom | Self::Joints => None,
        }
    }

    /// Whether this protocol is used on serial lines.
    pub const fn has_serial_lines(self) -> bool {
        self.usual_speed().is_some()
    }

    /// Default speed of a serial line (baud).
    const fn usual_speed(self) -> Option<u32> {
        match self {
            Self::Ascii | Self::Geocom | Self::Ndi | Self::Joints => Some(9600),
            Self::Emscon | Self::Rtde | Self::Kuka | Self::Abb | Self::Fanuc | Self::Yaskawa => None,
        }
    }

    /// Form of the address of a robot's controller, for hints.
    pub const ROBOT_ADDRESS: &str = "rtde:HOST, abb:HOST, kuka:HOST, fanuc:HOST, yaskawa:HOST or ascii:tcp:HOST:PORT";

    /// Whether this is the protocol of a robot's controller, which reports joint angles and not SMR positions.
    pub const fn is_robot(self) -> bool {
        match self {
            Self::Rtde | Self::Joints | Self::Kuka | Self::Abb | Self::Fanuc | Self::Yaskawa => true,
            Self::Emscon | Self::Ascii | Self::Geocom | Self::Ndi => false,
        }
    }

    /// Whether the instrument can be turned to a place by this protocol.
    pub const fn can_be_turned(self) -> bool {
        matches!(self, Self::Emscon | Self::Geocom)
    }

    /// Number of joints that the controller reports, whatever the arm; `None` if it reports those of the arm.
    pub const fn reported_joints(self) -> Option<usize> {
        match self {
            Self::Rtde | Self::Kuka | Self::Abb | Self::Fanuc => Some(6),
            // As many as pulses per degree are stated.
            Self::Yaskawa | Self::Joints | Self::Emscon | Self::Ascii | Self::Geocom | Self::Ndi => None,
        }
    }
}

impl fmt::Display for WireProtocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for WireProtocol {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|protocol| protocol.name() == text).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|protocol| protocol.name()).collect();
            format!("unknown protocol '{}'; protocols: {}", printable(text), names.join(", "))
        })
    }
}

/// Route to the other end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Route {
    /// A serial port, 8 data bits, no parity, one stop bit.
    Serial {
        /// Path of the device.
        device: String,
        /// Speed (baud).
        speed: u32,
    },
    /// This program connects by TCP.
    Tcp {
        /// Host name or address.
        host: String,
        /// Port.
        port: u16,
    },
    /// This program listens for one TCP connection.
    Listen {
        /// Address of this machine.
        host: String,
        /// Port.
        port: u16,
    },
    /// This program sends UDP datagrams and receives the answers.
    Ask {
        /// Host name or address.
        host: String,
        /// Port.
        port: u16,
    },
    /// This program receives UDP datagrams.
    Udp {
        /// Address of this machine.
        host: String,
        /// Port.
        port: u16,
    },
}

/// Address of an instrument or a robot's controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WireAddress {
    pub protocol: WireProtocol,
    pub route: Route,
}

impl fmt::Display for WireAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.route {
            Route::Serial { device, speed } => write!(f, "{}:serial:{device}:{speed}", self.protocol),
            Route::Tcp { host, port } => write!(f, "{}:tcp:{host}:{port}", self.protocol),
            Route::Listen { host, port } => write!(f, "{}:listen:{host}:{port}", self.protocol),
            Route::Udp { host, port } | Route::Ask { host, port } => write!(f, "{}:udp:{host}:{port}", self.protocol),
        }
    }
}

impl FromStr for WireAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let (protocol, rest) = text
            .split_once(':')
            .ok_or_else(|| format!("'{}' is not an address such as 'emscon:192.168.0.2'", printable(text)))?;
        let protocol: WireProtocol = protocol.parse()?;
        let route = match rest.split_once(':') {
            // Its datagrams are asked for, whatever is written.
            parts if protocol == WireProtocol::Yaskawa => {
                let endpoint = parts.filter(|(way, _)| *way == "udp").map_or(rest, |(_, endpoint)| endpoint);
                let (host, port) = host_and_port(protocol, endpoint)?;
                Route::Ask { host, port }
            }
            Some(("serial", device)) => serial(protocol, device)?,
            Some(("tcp", endpoint)) => {
                let (host, port) = host_and_port(protocol, endpoint)?;
                Route::Tcp { host, port }
            }
            Some(("listen", endpoint)) => {
                let (host, port) = host_and_port(protocol, endpoint)?;
                Route::Listen { host, port }
            }
            Some(("udp", endpoint)) => {
                let (host, port) = host_and_port(protocol, endpoint)?;
                Route::Udp { host, port }
            }
            _ => {
                let (host, port) = host_and_port(protocol, rest)?;
                Route::Tcp { host, port }
            }
        };
        match (&route, protocol) {
            (Route::Udp { .. }, WireProtocol::Ascii | WireProtocol::Joints) => {}
            (Route::Udp { .. }, _) => return Err(format!("{protocol} does not use UDP; use tcp")),
            (Route::Serial { .. }, _) if !protocol.has_serial_lines() => {
                return Err(format!("{protocol} does not use serial lines; use tcp"));
            }
            _ => {}
        }
        Ok(Self { protocol, route })
    }
}

impl WireAddress {
    /// Reads the address of a robot's controller. Here `ascii:` means lines of joint values.
    ///
    /// # Errors
    /// The text is not an address, or one of an instrument.
    pub fn of_robot(text: &str) -> Result<Self, String> {
        let mut address: Self = text.parse()?;
        if address.protocol == WireProtocol::Ascii {
            address.protocol = WireProtocol::Joints;
        }
        if address.protocol.is_robot() {
            return Ok(address);
        }
        Err(format!("'{address}' is not a robot controller; use {}", WireProtocol::ROBOT_ADDRESS))
    }
}

fn serial(protocol: WireProtocol, text: &str) -> Result<Route, String> {
    // The name of a device may contain colons, so only a number after the last one is the speed.
    let (device, speed) = match text.rsplit_once(':').and_then(|(device, speed)| Some((device, speed.parse().ok()?))) {
        Some((device, speed)) => (device, speed),
        None => (text, protocol.usual_speed().unwrap_or(9600)),
    };
    if device.is_empty() {
        return Err("the serial port is missing, such as '/dev/ttyUSB0'".to_owned());
    }
    if !(110..=12_000_000).contains(&speed) {
        return Err(format!("{speed} baud is not a valid speed"));
    }
    Ok(Route::Serial { device: device.to_owned(), speed })
}

/// Splits host and port; an IPv6 host is in square brackets.
fn host_and_port(protocol: WireProtocol, text: &str) -> Result<(String, u16), String> {
    let (host, port) = match text.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        Some((host, rest)) => (host, rest.strip_prefix(':')),
        None => match text.rsplit_once(':') {
            Some((host, port)) => (host, Some(port)),
            None => (text, None),
        },
    };
    if host.is_empty() || host.contains(char::is_whitespace) {
        return Err(format!("'{}' contains no host", printable(text)));
    }
    let port = match port {
        Some(port) => {
            port.parse().ok().ok_or_else(|| format!("'{}' is not a port from 1 to 65535", printable(port)))?
        }
        None => protocol.usual_port().ok_or_else(|| {
            format!("the port is missing, as in '{protocol}:tcp:{host}:5000': {protocol} has no default port")
        })?,
    };
    Ok((host.to_owned(), port))
}

/// Link to the instrument of a cell, from its profile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkSettings {
    /// Address of the instrument.
    pub address: WireAddress,
    /// Options of its protocol: the name of a preset, or a RON struct of the options that differ from the defaults. Checked when
    /// it connects.
    pub options: Option<String>,
    /// Address of the robot's controller, if it reports joint angles.
    pub robot: Option<WireAddress>,
    /// Options of the controller's protocol, checked when it connects.
    pub robot_options: Option<String>,
    /// Measure automatically when the SMR is at rest near the predicted position.
    pub is_automatic: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full(text: &str) -> Result<String, String> {
        text.parse::<WireAddress>().map(|address| address.to_string())
    }

    #[test]
    fn addresses_are_read_as_people_write_them_and_written_in_full() {
        for (text, wanted) in [
            ("emscon:192.168.0.2", "emscon:tcp:192.168.0.2:700"),
            ("emscon:tcp:tracker.local:701", "emscon:tcp:tracker.local:701"),
            ("ndi:192.168.0.9", "ndi:tcp:192.168.0.9:8765"),
            ("rtde:10.0.0.1", "rtde:tcp:10.0.0.1:30004"),
            ("geocom:serial:/dev/ttyUSB0", "geocom:serial:/dev/ttyUSB0:9600"),
            ("ascii:serial:/dev/serial/by-id/usb-a:b:115200", "ascii:serial:/dev/serial/by-id/usb-a:b:115200"),
            ("ascii:listen:0.0.0.0:5000", "ascii:listen:0.0.0.0:5000"),
            ("ascii:udp:127.0.0.1:5000", "ascii:udp:127.0.0.1:5000"),
            ("geocom:host:1212", "geocom:tcp:host:1212"),
            ("fanuc:10.0.0.1", "fanuc:tcp:10.0.0.1:16001"),
            ("yaskawa:10.0.0.1", "yaskawa:udp:10.0.0.1:10040"),
        ] {
            assert_eq!(full(text).as_deref(), Ok(wanted), "{text}");
            assert_eq!(full(wanted).as_deref(), Ok(wanted), "{wanted}");
        }
    }

    #[test]
    fn lines_where_a_robot_is_expected_are_lines_of_joints() {
        let robot = |text: &str| WireAddress::of_robot(text).map(|address| address.to_string());
        assert_eq!(robot("ascii:listen:0.0.0.0:5001").as_deref(), Ok("joints:listen:0.0.0.0:5001"));
        assert_eq!(robot("joints:udp:0.0.0.0:5001").as_deref(), Ok("joints:udp:0.0.0.0:5001"));
        assert_eq!(robot("kuka:10.0.0.1").as_deref(), Ok("kuka:tcp:10.0.0.1:7000"));
        assert!(robot("emscon:10.0.0.1").unwrap_err().contains("is not a robot controller"));
    }

    #[test]
    fn what_is_no_address_is_refused_with_a_reason() {
        for (text, part) in [
            ("", "is not an address"),
            ("192.168.0.2", "is not an address"),
            ("leica:192.168.0.2", "unknown protocol"),
            ("emscon:serial:/dev/ttyUSB0", "does not use serial lines"),
            ("emscon:udp:0.0.0.0:1", "does not use UDP"),
            ("geocom:host", "the port is missing"),
            ("emscon:host:70000", "is not a port from 1 to 65535"),
            ("emscon:tcp::700", "contains no host"),
            ("geocom:serial:", "the serial port is missing"),
            ("geocom:serial:/dev/ttyS0:7", "7 baud is not a valid speed"),
        ] {
            let error = full(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
