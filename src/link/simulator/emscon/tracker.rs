//! Settings of the simulated tracker. They outlast a connection, as in a real one.

use nalgebra::{Point3, Vector3};

use super::wire::PacketWriter;
use crate::link::protocol::emscon::{CommandId, CoordinateType, LengthUnit, ResultStatus, f64_at, i32_at};

/// A reflector in the tracker's list.
#[derive(Clone, Copy, Debug)]
struct ListedReflector {
    id: i32,
    /// Kind of target.
    kind: i32,
    /// Distance of the centre from the surface (m).
    offset: f64,
    name: &'static str,
}

/// The list of reflectors. Their names are the only text of a tracker, so they mark it as simulated.
const REFLECTORS: [ListedReflector; 3] = [
    ListedReflector { id: 0, kind: 5, offset: 0.019_05, name: "SIMULATED RRR 1.5in" },
    ListedReflector { id: 1, kind: 6, offset: 0.006_35, name: "SIMULATED RRR 0.5in" },
    ListedReflector { id: 2, kind: 9, offset: 0.006_35, name: "SIMULATED TBR 0.5in" },
];

/// Settings of the tracker. The initial ones all differ from those that a set-up asks for.
#[derive(Clone, Debug)]
pub(super) struct Tracker {
    /// Units of length, angle, temperature, pressure and humidity.
    pub(super) units: [i32; 5],
    pub(super) coordinate_type: CoordinateType,
    pub(super) mode: i32,
    /// Duration of a measurement (ms), and use of the distance meter.
    pub(super) stationary: [i32; 2],
    pub(super) reflector: i32,
    /// In the order of the wire: weather monitor 0, transformation 1, unsolicited messages 4, positions 5, try mode 6.
    pub(super) settings: [i32; 9],
    pub(super) orientation: [f64; 6],
    /// Translation (m), rotation, scale. The rotation is reported but not applied.
    pub(super) transformation: [f64; 7],
    /// Temperature (°C), pressure (mbar) and humidity (%): nothing is computed from them.
    weather: [f64; 3],
    /// Kind of the statistics of stationary and of continuous measurements.
    statistics: [i32; 2],
    pub(super) is_initialized: bool,
}

impl Default for Tracker {
    fn default() -> Self {
        Self {
            units: [0, 1, 0, 0, 0],
            coordinate_type: CoordinateType::SphericalCounterClockwise,
            mode: 1,
            stationary: [2500, 0],
            reflector: 0,
            settings: [1, 0, 0, 1, 0, 0, 1, 0, 1],
            orientation: [0.0; 6],
            transformation: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            weather: [20.0, 1013.25, 50.0],
            statistics: [0, 0],
            is_initialized: true,
        }
    }
}

impl Tracker {
    /// Whether unsolicited messages are on.
    pub(super) const fn sends_events(&self) -> bool {
        self.settings[4] != 0
    }

    /// Whether positions of the reflector are sent.
    pub(super) const fn is_streaming(&self) -> bool {
        self.settings[5] != 0
    }

    /// Answers a command that only reads or writes settings; `None` for other commands.
    pub(super) fn answer(&mut self, command: CommandId, request: &[u8]) -> Option<Vec<Vec<u8>>> {
        let ok = || PacketWriter::reply(command, ResultStatus::AllOk);
        let answer = match command {
            CommandId::GetUnits => ok().integers(&self.units),
            CommandId::GetCoordinateSystemType => ok().i32(self.coordinate_type.number()),
            CommandId::GetMeasurementMode => ok().i32(self.mode),
            CommandId::GetStationaryModeParams => ok().integers(&self.stationary),
            CommandId::GetReflector => ok().i32(self.reflector),
            CommandId::GetSystemSettings => ok().integers(&self.settings),
            CommandId::GetStationOrientationParams => ok().numbers(&self.orientation),
            CommandId::GetTransformationParams => ok().numbers(&self.reported_transformation()),
            CommandId::GetEnvironmentParams => ok().numbers(&self.weather),
            CommandId::GetStatisticMode => ok().integers(&self.statistics),
            CommandId::GetReflectors => return Some(self.list(command)),
            CommandId::SetUnits
            | CommandId::SetCoordinateSystemType
            | CommandId::SetMeasurementMode
            | CommandId::SetStationaryModeParams
            | CommandId::SetReflector
            | CommandId::SetEnvironmentParams
            | CommandId::SetStatisticMode
            | CommandId::SetSystemSettings => {
                let status = self.set(command, request).unwrap_or(ResultStatus::InvalidInputData);
                PacketWriter::reply(command, status)
            }
            _ => return None,
        };
        Some(vec![answer.finish()])
    }

    /// Changes a setting; `None` if the request is too short.
    fn set(&mut self, command: CommandId, request: &[u8]) -> Option<ResultStatus> {
        let first = i32_at(request, 12)?;
        match command {
            CommandId::SetUnits => self.units = integers(request)?,
            CommandId::SetMeasurementMode => self.mode = first,
            CommandId::SetStationaryModeParams => self.stationary = integers(request)?,
            CommandId::SetSystemSettings => self.settings = integers(request)?,
            CommandId::SetStatisticMode => self.statistics = integers(request)?,
            CommandId::SetEnvironmentParams => self.weather = numbers(request)?,
            CommandId::SetReflector if REFLECTORS.iter().any(|reflector| reflector.id == first) => {
                self.reflector = first;
            }
            CommandId::SetCoordinateSystemType => match CoordinateType::from_number(first) {
                kind @ (CoordinateType::RightHanded | CoordinateType::SphericalCounterClockwise) => {
                    self.coordinate_type = kind;
                }
                _ => return Some(ResultStatus::NotImplemented),
            },
            _ => return Some(ResultStatus::InvalidInputData),
        }
        Some(ResultStatus::AllOk)
    }

    /// The list of reflectors: one packet for each.
    fn list(&self, command: CommandId) -> Vec<Vec<u8>> {
        let total = i32::try_from(REFLECTORS.len()).unwrap_or(i32::MAX);
        let packet = |reflector: &ListedReflector| {
            let head =
                PacketWriter::reply(command, ResultStatus::AllOk).integers(&[total, reflector.id, reflector.kind]);
            head.numbers(&[reflector.offset * self.units_per_metre()]).name(reflector.name).finish()
        };
        REFLECTORS.iter().map(packet).collect()
    }

    /// Coordinates of a point (m) in the current type and units.
    pub(super) fn coordinates(&self, point: &Point3<f64>) -> [f64; 3] {
        let [scale, shift] =
            if self.settings[1] == 0 { [1.0, 0.0] } else { [self.transformation[6], self.transformation[0]] };
        let moved = point.coords * scale + Vector3::x() * shift;
        let [x, y, z] = (moved * self.units_per_metre()).into();
        if self.coordinate_type == CoordinateType::RightHanded {
            return [x, y, z];
        }
        let distance = x.hypot(y).hypot(z);
        let per_radian = match self.units[1] {
            1 => 180.0 / std::f64::consts::PI,
            2 => 200.0 / std::f64::consts::PI,
            _ => 1.0,
        };
        [y.atan2(x) * per_radian, (z / distance).acos() * per_radian, distance]
    }

    /// The transformation, with its translation in the current unit.
    fn reported_transformation(&self) -> [f64; 7] {
        let [x, y, z, rest @ ..] = self.transformation;
        let [x, y, z] = [x, y, z].map(|part| part * self.units_per_metre());
        let [a, b, c, scale] = rest;
        [x, y, z, a, b, c, scale]
    }

    /// Current units of length per metre.
    pub(super) const fn units_per_metre(&self) -> f64 {
        match LengthUnit::from_number(self.units[0]) {
            LengthUnit::Millimetre => 1e3,
            LengthUnit::Micrometre => 1e6,
            LengthUnit::Foot => 1.0 / 0.3048,
            LengthUnit::Yard => 1.0 / 0.9144,
            LengthUnit::Inch => 1.0 / 0.0254,
            LengthUnit::Metre | LengthUnit::Other(_) => 1.0,
        }
    }
}

/// The parameters of a request; `None` if it is too short.
fn integers<const N: usize>(request: &[u8]) -> Option<[i32; N]> {
    let mut values = [0; N];
    for (index, value) in values.iter_mut().enumerate() {
        *value = i32_at(request, 12 + 4 * index)?;
    }
    Some(values)
}

fn numbers<const N: usize>(request: &[u8]) -> Option<[f64; N]> {
    let content = request.get(12..12 + 8 * N)?;
    Some(std::array::from_fn(|index| f64_at(content, 8 * index)))
}
