//! Protocols and simulators from their names and options.

use std::ops::RangeInclusive;
use std::str::FromStr;
use std::time::Duration;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::protocol::Protocol;
use super::protocol::abb::{Abb, AbbOptions};
use super::protocol::ascii::{AsciiOptions, AsciiProtocol, Checksum, Column, Layout, Mode, Preset};
use super::protocol::emscon::{Emscon, EmsconOptions};
use super::protocol::fanuc::{Fanuc, FanucOptions};
use super::protocol::geocom::{GeocomOptions, GeocomProtocol};
use super::protocol::joints::JointLines;
use super::protocol::kuka::Kuka;
use super::protocol::ndi::{NdiOptions, NdiProtocol};
use super::protocol::rtde::{Rtde, RtdeOptions};
use super::protocol::yaskawa::{Yaskawa, YaskawaOptions};
use super::simulator::Simulator;
use super::simulator::abb::AbbSimulator;
use super::simulator::ascii::AsciiSimulator;
use super::simulator::emscon::EmsconSimulator;
use super::simulator::fanuc::FanucSimulator;
use super::simulator::geocom::GeocomSimulator;
use super::simulator::joints::JointsSimulator;
use super::simulator::kuka::KukaSimulator;
use super::simulator::ndi::NdiSimulator;
use super::simulator::rtde::RtdeSimulator;
use super::simulator::yaskawa::{PULSES_PER_DEGREE, YaskawaSimulator};
use crate::profile::Profile;
use crate::session::wire::{Route, WireAddress, WireProtocol};

/// Allowed duration of a stationary measurement (ms).
const MEASURE_MS: RangeInclusive<i32> = 50..=60_000;

/// Interval at which a tracker that sends no positions is asked for its status, to tell a broken beam from a lost connection.
const KEEP_ALIVE: Duration = Duration::from_millis(700);

/// Options of emScon, as a profile states them.
#[derive(Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct EmsconSettings {
    measure_ms: i32,
    use_adm: bool,
    reflector: Option<i32>,
    initialize: bool,
}

impl Default for EmsconSettings {
    fn default() -> Self {
        let EmsconOptions { measure_ms, use_adm, reflector, initialize, .. } = EmsconOptions::default();
        Self { measure_ms, use_adm, reflector, initialize }
    }
}

/// Options of RTDE, as a profile states them.
#[derive(Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct RtdeSettings {
    frequency_hz: f64,
}

impl Default for RtdeSettings {
    fn default() -> Self {
        Self { frequency_hz: RtdeOptions::default().frequency }
    }
}

/// Options from their text; the defaults without one.
fn read<T: DeserializeOwned + Default>(options: Option<&str>) -> Result<T, String> {
    let Some(text) = options else { return Ok(T::default()) };
    ron::Options::default()
        .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
        .from_str(text)
        .map_err(|error| format!("the options '{}' of the link: {error}", crate::text::printable(text)))
}

/// The protocol of an address. `options` is the name of a preset or a RON struct of the options that differ from the defaults.
///
/// # Errors
/// An unknown option or an invalid value.
pub(super) fn protocol(address: &WireAddress, options: Option<&str>) -> Result<Box<dyn Protocol>, String> {
    let options = options.map(str::trim).filter(|options| !options.is_empty());
    match address.protocol {
        WireProtocol::Emscon => {
            let EmsconSettings { measure_ms, use_adm, reflector, initialize } = read(options)?;
            if !MEASURE_MS.contains(&measure_ms) {
                let (shortest, longest) = (MEASURE_MS.start(), MEASURE_MS.end());
                return Err(format!("measure_ms is {measure_ms}: use {shortest} to {longest}"));
            }
            let options = EmsconOptions {
                measure_ms,
                use_adm,
                reflector,
                initialize,
                // For the live view.
                reflector_positions: true,
                keep_alive: KEEP_ALIVE,
                ..EmsconOptions::default()
            };
            Ok(Box::new(Emscon::new(options)))
        }
        WireProtocol::Rtde => {
            let RtdeSettings { frequency_hz } = read(options)?;
            Ok(Box::new(Rtde::new(RtdeOptions { frequency: frequency_hz, ..RtdeOptions::default() })))
        }
        WireProtocol::Joints => without_options(address, options).map(|()| Box::<JointLines>::default() as _),
        WireProtocol::Abb => {
            let options: AbbOptions = read(options)?;
            Ok(Box::new(Abb::new(options)?))
        }
        WireProtocol::Kuka => without_options(address, options).map(|()| Box::<Kuka>::default() as _),
        WireProtocol::Fanuc => {
            let options: FanucOptions = read(options)?;
            Ok(Box::new(Fanuc::new(options)))
        }
        WireProtocol::Yaskawa => {
            let options: YaskawaOptions = read(options)?;
            Ok(Box::new(Yaskawa::new(options)?))
        }
        WireProtocol::Ascii => {
            let preset = options.and_then(|name| name.parse::<Preset>().ok());
            let mut options: AsciiOptions = match preset {
                Some(preset) => preset.options(),
                None => read(options)?,
            };
            options.datagrams |= matches!(address.route, Route::Udp { .. });
            Ok(Box::new(AsciiProtocol::new(options)?))
        }
        WireProtocol::Geocom => {
            let options: GeocomOptions = read(options)?;
            Ok(Box::new(GeocomProtocol::new(options)?))
        }
        WireProtocol::Ndi => {
            let options: NdiOptions = read(options)?;
            let protocol = NdiProtocol::new(options)?;
            Ok(Box::new(match address.route {
                Route::Serial { speed, .. } => protocol.on_serial_line(speed),
                Route::Tcp { .. } | Route::Listen { .. } | Route::Udp { .. } | Route::Ask { .. } => protocol,
            }))
        }
    }
}

/// The options of a Yaskawa controller as text.
fn yaskawa_options(pulses_per_degree: &[f64]) -> String {
    format!("(pulses_per_degree: {pulses_per_degree:?})")
}

/// The options of an arm's controller: those given, or else what the profile knows.
pub(super) fn robot_options(profile: &Profile, protocol: WireProtocol, given: Option<&str>) -> Option<String> {
    if given.is_some() || protocol != WireProtocol::Yaskawa {
        return given.map(str::to_owned);
    }
    let pulses: Option<Vec<f64>> = profile.joints().iter().map(|joint| joint.pulses_per_degree).collect();
    pulses.map(|pulses| yaskawa_options(&pulses))
}

/// Refuses options of a protocol that has none.
fn without_options(address: &WireAddress, options: Option<&str>) -> Result<(), String> {
    options.map_or(Ok(()), |_| Err(format!("{} has no options", address.protocol)))
}

/// The simulator of a protocol. `faults` are given by their names.
///
/// # Errors
/// The simulator does not have such a fault.
pub(super) fn simulator(protocol: WireProtocol, faults: &[String]) -> Result<Box<dyn Simulator>, String> {
    Ok(match protocol {
        WireProtocol::Emscon => Box::new(EmsconSimulator::new(parsed(faults)?)),
        WireProtocol::Rtde => Box::new(RtdeSimulator::new(parsed(faults)?)),
        WireProtocol::Joints => Box::new(JointsSimulator::new(parsed(faults)?)),
        WireProtocol::Abb => Box::new(AbbSimulator::new(parsed(faults)?)),
        WireProtocol::Kuka => Box::new(KukaSimulator::new(parsed(faults)?)),
        WireProtocol::Fanuc => Box::new(FanucSimulator::new(parsed(faults)?)),
        WireProtocol::Yaskawa => Box::new(YaskawaSimulator::new(parsed(faults)?)),
        WireProtocol::Ascii => Box::new(AsciiSimulator::new(rehearsal_ascii(), parsed(faults)?)?),
        WireProtocol::Geocom => Box::new(GeocomSimulator::new(parsed(faults)?)),
        WireProtocol::Ndi => Box::new(NdiSimulator::new([0.0; 3], parsed(faults)?)),
    })
}

fn parsed<F>(faults: &[String]) -> Result<Vec<F>, String>
where
    F: FromStr,
    F::Err: std::fmt::Display,
{
    faults.iter().map(|fault| fault.parse().map_err(|error: F::Err| error.to_string())).collect()
}

/// [`rehearsal_ascii`] as text: the options that differ from the defaults.
const REHEARSAL_ASCII: &str = r#"(mode: Polled(trigger: "M\\r"), layout: Columns([X, Y, Z, Sigma]), checksum: Crc16)"#;

/// Lines of a rehearsal: polled one by one, each with its standard deviation and a check sum.
fn rehearsal_ascii() -> AsciiOptions {
    AsciiOptions {
        mode: Mode::Polled { trigger: "M\\r".to_owned() },
        layout: Layout::Columns(vec![Column::X, Column::Y, Column::Z, Column::Sigma]),
        checksum: Checksum::Crc16,
        ..AsciiOptions::default()
    }
}

/// Options of the client in a rehearsal, as text.
pub(super) fn rehearsal_options(protocol: WireProtocol) -> Option<String> {
    match protocol {
        WireProtocol::Ascii => Some(REHEARSAL_ASCII.to_owned()),
        WireProtocol::Emscon => Some(format!("(measure_ms: {})", MEASURE_MS.start())),
        WireProtocol::Yaskawa => Some(yaskawa_options(&PULSES_PER_DEGREE)),
        WireProtocol::Fanuc
        | WireProtocol::Geocom
        | WireProtocol::Ndi
        | WireProtocol::Rtde
        | WireProtocol::Joints
        | WireProtocol::Kuka
        | WireProtocol::Abb => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_in_the_table_of_options_is_accepted() {
        let document = include_str!("../../docs/links.md");
        for option in ["unit", "separator", "decimal_sign", "checksum"] {
            let row = document.lines().find_map(|line| line.strip_prefix(&format!("| `{option}` | "))).unwrap();
            let values = row.split(" | ").next().unwrap().split('`').skip(1).step_by(2);
            let values: Vec<&str> = values.filter(|value| !value.starts_with('*')).collect();
            assert!(values.len() > 1, "{option}");
            for value in values {
                let options: Result<AsciiOptions, _> = read(Some(&format!("({option}: {value})")));
                assert!(options.is_ok(), "{option}: {value}: {options:?}");
            }
        }
    }

    #[test]
    fn every_form_of_text_that_is_offered_is_a_preset() {
        for form in crate::session::wire::TEXT_FORMS {
            assert!(form.parse::<Preset>().is_ok(), "{form}");
        }
    }

    #[test]
    fn the_options_of_a_rehearsal_as_text_are_those_of_its_simulator() {
        assert_eq!(read::<AsciiOptions>(Some(REHEARSAL_ASCII)), Ok(rehearsal_ascii()));
    }
}
