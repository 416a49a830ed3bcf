//! The single commands of which the set-up is made.

use super::status::{CommandId, SystemEvent};

/// Something that can be set and read back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Setting {
    /// Units.
    Units,
    /// Coordinate type.
    Coordinates,
    /// System settings.
    System,
    /// Reflector.
    Reflector,
    /// Measurement mode.
    Mode,
    /// Duration of a measurement.
    Stationary,
}

/// One command of the set-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Laser, processor, serial number, version.
    SystemStatus,
    /// Readiness.
    TrackerStatus,
    /// Reads a setting; where it differs, it is written and checked.
    Read(Setting),
    /// Writes a setting.
    Write(Setting),
    /// Reads a setting; it has to be right.
    Check(Setting),
    /// Transformation of the results.
    Transformation,
    /// Orientation of the station.
    StationOrientation,
    /// Initialises; the head turns.
    Initialize,
    /// The list of reflectors.
    Reflectors,
}

impl Setting {
    /// What it is called in messages.
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

    /// The command that reads it.
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

    /// The command that writes it.
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

impl Step {
    /// Its command.
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

/// The step that reads what an event says has changed; `None`: no point depends on it.
pub(super) const fn reading_of(event: SystemEvent) -> Option<Step> {
    Some(match event {
        SystemEvent::UnitsChanged => Step::Read(Setting::Units),
        SystemEvent::ReflectorChanged => Step::Read(Setting::Reflector),
        SystemEvent::SystemSettingsChanged => Step::Read(Setting::System),
        SystemEvent::CoordinateSystemTypeChanged => Step::Read(Setting::Coordinates),
        SystemEvent::StationOrientationParamsChanged => Step::StationOrientation,
        SystemEvent::TransformationParamsChanged => Step::Transformation,
        SystemEvent::MeasurementModeChanged => Step::Read(Setting::Mode),
        SystemEvent::StationaryModeParamsChanged => Step::Read(Setting::Stationary),
        _ => return None,
    })
}
