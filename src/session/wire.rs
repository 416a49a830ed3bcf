//! Instruments and robots on a wire, as a session chooses them. Their addresses are those of profiles.

use serde::{Deserialize, Serialize};

use crate::profile::wire::LinkSettings;
pub use crate::profile::wire::{Route, WireAddress, WireProtocol};

/// An instrument on a wire, as it is chosen.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkChoice {
    /// Address of the instrument, see [`WireAddress`].
    pub address: String,
    /// Options of its protocol: the name of a preset, or a RON struct of what differs from the usual.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub options: Option<String>,
    /// Address of the robot's controller, if it reports joint angles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// Options of the controller's protocol.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot_options: Option<String>,
    /// Measures automatically when the SMR rests near the predicted place.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_automatic: bool,
}

/// A serial port of this computer.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct SerialPortName {
    /// Path of the device for an address, persistent where the system provides one.
    pub device: String,
    /// Maker and product of the adapter, if it states them.
    pub description: String,
}

/// What this computer knows about links, so that one can be chosen from a list.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct KnownLinks {
    /// Links of earlier sessions, the latest first.
    pub recent: Vec<LinkChoice>,
    pub ports: Vec<SerialPortName>,
}

/// Names of the forms in which programs write lines with a point, as options of `ascii`.
pub const TEXT_FORMS: &[&str] =
    &["bridge, asked", "bridge", "xyz", "name,x,y,z", "name x y z", "tabs", "semicolons", "UDP xyz+time", "T2SA"];

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
const fn is_false(value: &bool) -> bool {
    !*value
}

/// What a profile says, as a choice.
impl From<&LinkSettings> for LinkChoice {
    fn from(settings: &LinkSettings) -> Self {
        Self {
            address: settings.address.to_string(),
            options: settings.options.clone(),
            robot: settings.robot.as_ref().map(WireAddress::to_string),
            robot_options: settings.robot_options.clone(),
            is_automatic: settings.is_automatic,
        }
    }
}
