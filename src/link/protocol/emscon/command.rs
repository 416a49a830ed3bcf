//! Commands to the tracker.

use nalgebra::Point3;

use super::status::{CommandId, CoordinateType, LengthUnit, MeasurementMode, PacketType};

/// Units of length on the wire.
const MM_PER_METRE: f64 = 1000.0;

/// Units that are set at the tracker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Units {
    /// Unit of length.
    pub length: LengthUnit,
    /// Unit of angles: 0 rad, 1 deg, 2 gon.
    pub angle: i32,
    /// Unit of temperature: 0 °C, 1 °F.
    pub temperature: i32,
    /// Unit of pressure: 0 mbar, 1 hPa, 2 kPa, 3 mmHg, 4 psi, 5 inH2O, 6 inHg.
    pub pressure: i32,
    /// Unit of humidity: 0 relative (%).
    pub humidity: i32,
}

impl Units {
    /// The units that this program sets: mm, rad, °C, mbar (the same as hPa), %.
    pub const WANTED: Self =
        Self { length: LengthUnit::Millimetre, angle: 0, temperature: 0, pressure: 0, humidity: 0 };

    /// Units from the five numbers of the wire.
    pub const fn from_numbers([length, angle, temperature, pressure, humidity]: [i32; 5]) -> Self {
        Self { length: LengthUnit::from_number(length), angle, temperature, pressure, humidity }
    }

    /// The five numbers of the wire.
    pub const fn numbers(self) -> [i32; 5] {
        [self.length.number(), self.angle, self.temperature, self.pressure, self.humidity]
    }
}

impl std::fmt::Display for Units {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = |names: &[&str], number: i32| {
            let known = usize::try_from(number).ok().and_then(|index| names.get(index).copied());
            known.map_or_else(|| format!("unit {number}"), str::to_owned)
        };
        let length = match self.length {
            LengthUnit::Other(number) => format!("unit {number}"),
            known => known.words().to_owned(),
        };
        let angle = name(&["rad", "deg", "gon"], self.angle);
        let temperature = name(&["\u{b0}C", "\u{b0}F"], self.temperature);
        let pressure = name(&["mbar", "hPa", "kPa", "mmHg", "psi", "inH2O", "inHg"], self.pressure);
        write!(f, "{length}, {angle}, {temperature}, {pressure}, {}", name(&["%RH"], self.humidity))
    }
}

/// System settings, in the order of the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SystemSettings {
    /// Weather monitor status: 0 not connected, 1 read only, 2 read and calculate the refraction.
    pub weather_monitor_status: i32,
    /// Whether the transformation is applied to results.
    pub apply_transformation_params: i32,
    /// Whether the station orientation is applied to results.
    pub apply_station_orientation_params: i32,
    /// Whether the last position is kept when the beam breaks.
    pub keep_last_position: i32,
    /// Whether status changes are sent without a request.
    pub send_unsolicited_messages: i32,
    /// Whether the position of the reflector is sent continuously.
    pub send_reflector_position_data: i32,
    /// Whether results are taken in try mode, which does not count as a measurement.
    pub try_measurement_mode: i32,
    /// Whether an inclination sensor is connected.
    pub has_nivel: i32,
    /// Whether a camera is connected.
    pub has_video_camera: i32,
}

impl SystemSettings {
    /// Settings from the nine numbers of the wire.
    pub const fn from_numbers(numbers: [i32; 9]) -> Self {
        let [
            weather_monitor_status,
            apply_transformation_params,
            apply_station_orientation_params,
            keep_last_position,
            send_unsolicited_messages,
            send_reflector_position_data,
            try_measurement_mode,
            has_nivel,
            has_video_camera,
        ] = numbers;
        Self {
            weather_monitor_status,
            apply_transformation_params,
            apply_station_orientation_params,
            keep_last_position,
            send_unsolicited_messages,
            send_reflector_position_data,
            try_measurement_mode,
            has_nivel,
            has_video_camera,
        }
    }

    /// The nine numbers of the wire.
    pub const fn numbers(self) -> [i32; 9] {
        [
            self.weather_monitor_status,
            self.apply_transformation_params,
            self.apply_station_orientation_params,
            self.keep_last_position,
            self.send_unsolicited_messages,
            self.send_reflector_position_data,
            self.try_measurement_mode,
            self.has_nivel,
            self.has_video_camera,
        ]
    }
}

impl std::fmt::Display for SystemSettings {
    /// Only the fields that matter here.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { weather_monitor_status, send_unsolicited_messages, .. } = self;
        let Self { send_reflector_position_data, try_measurement_mode, .. } = self;
        write!(f, "weather monitor {weather_monitor_status}, messages {send_unsolicited_messages}, ")?;
        write!(f, "positions {send_reflector_position_data}, try mode {try_measurement_mode}")
    }
}

/// A command with its parameters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Command {
    /// Identifier of the command.
    pub id: CommandId,
    body: Vec<u8>,
}

impl Command {
    /// A command without parameters.
    pub const fn bare(id: CommandId) -> Self {
        Self { id, body: Vec::new() }
    }

    /// A command with integer parameters.
    fn with(id: CommandId, parameters: &[i32]) -> Self {
        Self { id, body: parameters.iter().flat_map(|value| value.to_le_bytes()).collect() }
    }

    /// Sets the units.
    pub fn set_units(units: Units) -> Self {
        Self::with(CommandId::SetUnits, &units.numbers())
    }

    /// Sets the coordinate type.
    pub fn set_coordinate_type(kind: CoordinateType) -> Self {
        Self::with(CommandId::SetCoordinateSystemType, &[kind.number()])
    }

    /// Sets the measurement mode.
    pub fn set_measurement_mode(mode: MeasurementMode) -> Self {
        Self::with(CommandId::SetMeasurementMode, &[mode.number()])
    }

    /// Sets the duration of a stationary measurement (ms) and whether the absolute distance meter takes part.
    pub fn set_stationary_params(milliseconds: i32, use_adm: bool) -> Self {
        Self::with(CommandId::SetStationaryModeParams, &[milliseconds, i32::from(use_adm)])
    }

    /// Selects a reflector.
    pub fn set_reflector(id: i32) -> Self {
        Self::with(CommandId::SetReflector, &[id])
    }

    /// Sets the system settings.
    pub fn set_system_settings(settings: SystemSettings) -> Self {
        Self::with(CommandId::SetSystemSettings, &settings.numbers())
    }

    /// Turns to a place (m; the units set are mm) and searches for the reflector there.
    pub fn go_position(at: &Point3<f64>, use_adm: bool) -> Self {
        let place = at.coords.iter().flat_map(|value| (value * MM_PER_METRE).to_le_bytes());
        Self { id: CommandId::GoPosition, body: place.chain(i32::from(use_adm).to_le_bytes()).collect() }
    }

    /// The command as bytes.
    pub fn encode(&self) -> Vec<u8> {
        let size = i32::try_from(12 + self.body.len()).unwrap_or(i32::MAX);
        let head = [size, PacketType::Command.number(), self.id.number()];
        head.iter().flat_map(|value| value.to_le_bytes()).chain(self.body.iter().copied()).collect()
    }
}
