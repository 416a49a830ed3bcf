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
    /// Measures automatically when the SMR rests near the predicted place.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_automatic: bool,
}

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
            is_automatic: settings.is_automatic,
        }
    }
}
