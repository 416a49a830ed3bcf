//! Results of the simulated tracker, including faulty ones.

use super::super::PointSource;
use super::EmsconSimulator;
use super::fault::EmsconFault;
use super::wire::PacketWriter;
use crate::link::protocol::Shot;
use crate::link::protocol::emscon::{CommandId, MeasurementMode, PacketType, ResultStatus, SystemEvent};

const FLOOD: usize = 2000;

/// Fields of a result besides the point.
#[derive(Clone, Copy, Debug, Default)]
struct Marks {
    status: i32,
    mode: i32,
    try_mode: i32,
}

impl EmsconSimulator {
    /// Ends a measurement.
    pub(super) fn measure(&mut self, source: &mut dyn PointSource) {
        if self.faults.strikes(EmsconFault::Silence) {
            return;
        }
        if self.faults.strikes(EmsconFault::Closing) {
            self.announce(SystemEvent::ServerClosing);
            self.hang_up();
            return;
        }
        if self.faults.strikes(EmsconFault::LostBeam) {
            self.announce(SystemEvent::MeasStatusNotReady);
            return;
        }
        for (fault, status) in [
            (EmsconFault::LateError, ResultStatus::NoStationaryMeasurementResult),
            (EmsconFault::UnlistedError, ResultStatus::Other(4242)),
        ] {
            if self.faults.strikes(fault) {
                self.send(PacketWriter::error(CommandId::StartMeasurement, status).finish());
                return;
            }
        }
        if self.faults.strikes(EmsconFault::Flood) {
            (0..FLOOD).for_each(|_| self.send_position(source));
        }
        if self.faults.strikes(EmsconFault::UnknownType) {
            self.send(PacketWriter::new(PacketType::Other(42)).zeros(20).finish());
        }
        self.interfere();
        self.send_result(source);
    }

    /// Sends one result, or *not ready* if the beam is broken.
    pub(super) fn send_result(&mut self, source: &mut dyn PointSource) {
        let Some(shot) = source.shot() else {
            self.announce(SystemEvent::MeasStatusNotReady);
            return;
        };
        let marks = self.marks();
        let values = self.values(&shot);
        let is_extended = self.faults.strikes(EmsconFault::ExtendedResult);
        let packet = self.result(&shot, values, marks, is_extended);
        if self.faults.strikes(EmsconFault::CutAfter20) {
            self.send(packet.finish().into_iter().take(20).collect());
            self.hang_up();
            return;
        }
        self.send_sized(packet);
        self.announce(SystemEvent::MeasStatusReady);
    }

    /// Sends a result with the planned size.
    fn send_sized(&mut self, packet: PacketWriter) {
        let wrong_sizes =
            [(EmsconFault::SizeZero, 0), (EmsconFault::SizeNegative, -1), (EmsconFault::SizeHuge, i32::MAX)];
        for (fault, size) in wrong_sizes {
            if self.faults.strikes(fault) {
                self.send(packet.finish_with_size(size));
                return;
            }
        }
        let packet = if self.faults.strikes(EmsconFault::LongResult) { packet.zeros(16) } else { packet };
        if self.faults.strikes(EmsconFault::ShortResult) {
            let bytes = packet.finish_with_size(100);
            self.send(bytes.into_iter().take(100).collect());
        } else {
            self.send(packet.finish());
        }
    }

    fn marks(&mut self) -> Marks {
        let mut marks = Marks { mode: self.tracker.mode, try_mode: self.tracker.settings[6], ..Marks::default() };
        if self.faults.strikes(EmsconFault::TryMode) {
            marks.try_mode = 1;
        }
        if self.faults.strikes(EmsconFault::WrongMode) {
            marks.mode = MeasurementMode::SphereCenter.number();
        }
        if self.faults.strikes(EmsconFault::BadStatus) {
            marks.status = ResultStatus::SensorNotStable.number();
        }
        marks
    }

    fn values(&mut self, shot: &Shot) -> [f64; 3] {
        let [x, y, z] = self.tracker.coordinates(&shot.point);
        if self.faults.strikes(EmsconFault::ZeroPoint) {
            [0.0; 3]
        } else if self.faults.strikes(EmsconFault::NotFinite) {
            [x, f64::NAN, z]
        } else if self.faults.strikes(EmsconFault::SilentMetres) {
            shot.point.coords.into()
        } else {
            [x, y, z]
        }
    }

    /// Writes either kind of result: header, coordinates, standard deviations, pointing errors, a-priori values and weather.
    fn result(&self, shot: &Shot, values: [f64; 3], marks: Marks, is_extended: bool) -> PacketWriter {
        let sigma = shot.sigma.unwrap_or_default().map(|value| value * self.tracker.units_per_metre());
        let total = sigma.iter().map(|value| value * value).sum::<f64>().sqrt();
        let weather =
            [shot.temperature.unwrap_or(20.0), shot.pressure.unwrap_or(1013.25), shot.humidity.unwrap_or(50.0)];
        let kind = if is_extended { PacketType::SingleMeasResult2 } else { PacketType::SingleMeasResult };
        // Extended statistics have three covariances after each total.
        let covariances = if is_extended { 24 } else { 0 };
        PacketWriter::new(kind)
            .integers(&[marks.status, marks.mode, marks.try_mode])
            .numbers(&values)
            .numbers(&sigma)
            .numbers(&[total])
            .zeros(covariances + 24)
            .numbers(&sigma)
            .numbers(&[total])
            .zeros(covariances)
            .numbers(&weather)
    }

    /// Sends the current position of the reflector, unless the beam is broken.
    pub(super) fn send_position(&mut self, source: &mut dyn PointSource) {
        if let Some(shot) = source.position() {
            let values = self.tracker.coordinates(&shot.point);
            self.send(PacketWriter::new(PacketType::ReflectorPosResult).i32(0).numbers(&values).finish());
        }
    }
}
