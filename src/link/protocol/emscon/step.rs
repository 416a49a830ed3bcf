//! Steps of the set-up: one command each.

use super::status::{CommandId, SystemEvent};

/// A setting that can be written and read back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Setting {
    Units,
    Coordinates,
    System,
    Reflector,
    Mode,
    Stationary,
}

/// A step of the set-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SetUpStep {
    /// Reads laser, processor, serial number and version.
    SystemStatus,
    /// Reads whether the tracker is ready.
    TrackerStatus,
    /// Reads a setting, and writes and checks it if it differs.
    Read(Setting),
    Write(Setting),
    /// Reads a setting, which must be right.
    Check(Setting),
    /// Reads the transformation of the results.
    Transformation,
    /// Reads the orientation of the station.
    StationOrientation,
    /// Initialises the tracker; its head turns.
    Initialize,
    /// Reads the list of reflectors.
    Reflectors,
}

impl Setting {
    /// Name in messages.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Units => "units",
            Self::Coordinates => "coordinates",
            Self::System => "system settings",
            Self::Reflector => "reflector",
            Self::Mode => "measurement mode",
            Self::Stationary => "measurement time",
        }
    }

    /// The command that reads the setting.
    pub(super) const fn read(self) -> CommandId {
        match self {
            Self::Units => CommandId::GetUnits,
            Self::Coordinates => CommandId::GetCoordinateSystemType,
            Self::System => CommandId::GetSystemSettings,
            Self::Reflector => CommandId::GetReflector,
            Self::Mode => CommandId::GetMeasurementMode,
            Self::Stationary => CommandId::GetStationaryModeParams,
        }
    }

    /// The command that writes the setting.
    pub(super) const fn write(self) -> CommandId {
        match self {
            Self::Units => CommandId::SetUnits,
            Self::Coordinates => CommandId::SetCoordinateSystemType,
            Self::System => CommandId::SetSystemSettings,
            Self::Reflector => CommandId::SetReflector,
            Self::Mode => CommandId::SetMeasurementMode,
            Self::Stationary => CommandId::SetStationaryModeParams,
        }
    }
}

impl SetUpStep {
    /// The command of the step.
    pub(super) const fn command(self) -> CommandId {
        match self {
            Self::SystemStatus => CommandId::GetSystemStatus,
            Self::TrackerStatus => CommandId::GetTrackerStatus,
            Self::Read(setting) | Self::Check(setting) => setting.read(),
            Self::Write(setting) => setting.write(),
            Self::Transformation => CommandId::GetTransformationParams,
            Self::StationOrientation => CommandId::GetStationOrientationParams,
            Self::Initialize => CommandId::Initialize,
            Self::Reflectors => CommandId::GetReflectors,
        }
    }
}

/// The step that reads the setting changed by an event; `None` if points do not depend on it.
pub(super) const fn reading_of(event: SystemEvent) -> Option<SetUpStep> {
    Some(match event {
        SystemEvent::UnitsChanged => SetUpStep::Read(Setting::Units),
        SystemEvent::ReflectorChanged => SetUpStep::Read(Setting::Reflector),
        SystemEvent::SystemSettingsChanged => SetUpStep::Read(Setting::System),
        SystemEvent::CoordinateSystemTypeChanged => SetUpStep::Read(Setting::Coordinates),
        SystemEvent::StationOrientationParamsChanged => SetUpStep::StationOrientation,
        SystemEvent::TransformationParamsChanged => SetUpStep::Transformation,
        SystemEvent::MeasurementModeChanged => SetUpStep::Read(Setting::Mode),
        SystemEvent::StationaryModeParamsChanged => SetUpStep::Read(Setting::Stationary),
        _ => return None,
    })
}
