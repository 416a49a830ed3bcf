//! Protocols from their names and options.

use super::protocol::Protocol;
use super::protocol::ascii::{AsciiOptions, AsciiProtocol, Checksum, Column, Layout, Mode, Preset};
use super::protocol::emscon::{Emscon, EmsconOptions};
use super::protocol::geocom::{GeocomOptions, GeocomProtocol};
use super::protocol::ndi::{NdiOptions, NdiProtocol};
use super::protocol::rtde::{Rtde, RtdeOptions};
use super::simulator::Simulator;
use super::simulator::ascii::AsciiSimulator;
use super::simulator::emscon::EmsconSimulator;
use super::simulator::geocom::GeocomSimulator;
use super::simulator::ndi::NdiSimulator;
use super::simulator::rtde::RtdeSimulator;
use crate::session::wire::{Route, WireAddress, WireProtocol};
use std::str::FromStr;
use std::time::Duration;

use serde::Deserialize;
use serde::de::DeserializeOwned;

/// Shortest and longest stationary measurement (ms).
const MEASURE_MS: (i32, i32) = (50, 60_000);

/// A tracker that shows no reflector is asked for its status so often: who sees nothing is told from who is not there.
const KEEP_ALIVE: Duration = Duration::from_millis(700);

/// Options of emScon.
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

/// Options of RTDE.
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

/// Options from their text; without one the usual ones.
fn read<T: DeserializeOwned + Default>(options: Option<&str>) -> Result<T, String> {
    let Some(text) = options else { return Ok(T::default()) };
    ron::Options::default()
        .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
        .from_str(text)
        .map_err(|error| format!("the options '{}' of the link: {error}", crate::text::printable(text)))
}

/// The protocol of an address. `options` is the name of a preset or a RON struct of what differs from the usual.
///
/// # Errors
/// An option that does not exist or cannot be.
pub(super) fn protocol(address: &WireAddress, options: Option<&str>) -> Result<Box<dyn Protocol>, String> {
    let options = options.map(str::trim).filter(|options| !options.is_empty());
    match address.protocol {
        WireProtocol::Emscon => {
            let EmsconSettings { measure_ms, use_adm, reflector, initialize } = read(options)?;
            if !(MEASURE_MS.0..=MEASURE_MS.1).contains(&measure_ms) {
                return Err(format!("measure_ms is {measure_ms}: use {} to {}", MEASURE_MS.0, MEASURE_MS.1));
            }
            // Its positions are what the live display shows.
            let reflector_positions = true;
            let options = EmsconOptions {
                measure_ms,
                use_adm,
                reflector,
                initialize,
                reflector_positions,
                keep_alive: KEEP_ALIVE,
                ..EmsconOptions::default()
            };
            Ok(Box::new(Emscon::new(options)))
        }
        WireProtocol::Rtde => {
            let RtdeSettings { frequency_hz } = read(options)?;
            Ok(Box::new(Rtde::new(RtdeOptions { frequency: frequency_hz, ..RtdeOptions::default() })))
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
            Ok(Box::new(NdiProtocol::new(options)?))
        }
    }
}

/// The other end of a protocol, for rehearsals; `faults` by their names, see the kinds of faults of each simulator.
///
/// # Errors
/// A fault that this simulator does not have.
pub(super) fn simulator(protocol: WireProtocol, faults: &[String]) -> Result<Box<dyn Simulator>, String> {
    Ok(match protocol {
        WireProtocol::Emscon => Box::new(EmsconSimulator::new(parsed(faults)?)),
        WireProtocol::Rtde => Box::new(RtdeSimulator::new(parsed(faults)?)),
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

/// The same as text: what differs from the usual.
const REHEARSAL_ASCII: &str = r#"(mode: Polled(trigger: "M\\r"), layout: Columns([X, Y, Z, Sigma]), checksum: Crc16)"#;

/// How lines are written in a rehearsal: asked for one by one, each with its standard deviation and a check sum.
fn rehearsal_ascii() -> AsciiOptions {
    AsciiOptions {
        mode: Mode::Polled { trigger: "M\\r".to_owned() },
        layout: Layout::Columns(vec![Column::X, Column::Y, Column::Z, Column::Sigma]),
        checksum: Checksum::Crc16,
        ..AsciiOptions::default()
    }
}

/// The options with which a rehearsal speaks to its simulator, as text.
pub(super) fn rehearsal_options(protocol: WireProtocol) -> Option<String> {
    match protocol {
        WireProtocol::Ascii => Some(REHEARSAL_ASCII.to_owned()),
        WireProtocol::Emscon => Some(format!("(measure_ms: {})", MEASURE_MS.0)),
        WireProtocol::Geocom | WireProtocol::Ndi | WireProtocol::Rtde => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_options_of_a_rehearsal_as_text_are_those_of_its_simulator() {
        assert_eq!(read::<AsciiOptions>(Some(REHEARSAL_ASCII)), Ok(rehearsal_ascii()));
    }
}
