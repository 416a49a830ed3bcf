//! A simulated Leica emScon tracker: the other end of [`crate::link::protocol::emscon`].
//!
//! It keeps its settings between connections, and its initial settings all differ from those that a set-up asks for. It
//! measures in right-handed and spherical coordinates, in every unit of length and angle; other coordinate types are refused
//! as not implemented. It follows public descriptions of the interface and was never compared with a real tracker.

mod fault;
mod result;
#[cfg(test)]
mod tests;
mod tracker;
mod wire;

use std::time::Duration;

pub use fault::EmsconFault;

use nalgebra::Point3;

use self::tracker::Tracker;
use self::wire::PacketWriter;
use super::fault::{FaultPlan, Planned};
use super::writes::Writes;
use super::{Output, PointSource, Simulator};
use crate::link::protocol::Moment;
use crate::link::protocol::emscon::f64_at;
use crate::link::protocol::emscon::{
    CommandId, CoordinateType, Framer, LaserStatus, ProcessorStatus, ResultStatus, SystemEvent, TrackerStatus, i32_at,
};

/// Interval of the reflector positions.
const POSITION_INTERVAL: Duration = Duration::from_millis(300);

/// Radius in which a turned tracker finds the reflector (m).
const SEARCH: f64 = 0.3;

/// Duration of the initialisation.
const INITIALIZATION: Duration = Duration::from_secs(20);

/// A task that takes time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Work {
    Initialize,
    Measure,
}

/// A simulated tracker.
#[derive(Clone, Debug)]
pub struct EmsconSimulator {
    faults: FaultPlan<EmsconFault>,
    tracker: Tracker,
    framer: Framer,
    writes: Writes,
    work: Option<(Work, Moment)>,
    next_position: Moment,
    is_connected: bool,
    is_mute: bool,
    is_instant: bool,
}

impl EmsconSimulator {
    /// A tracker with planned faults.
    pub fn new(faults: Vec<Planned<EmsconFault>>) -> Self {
        Self {
            faults: FaultPlan::new(faults),
            tracker: Tracker::default(),
            framer: Framer::default(),
            writes: Writes::default(),
            work: None,
            next_position: Moment::ZERO,
            is_connected: false,
            is_mute: false,
            is_instant: false,
        }
    }

    fn send(&mut self, packet: Vec<u8>) {
        self.writes.send(packet);
    }

    /// Sends an event, if unsolicited messages are on.
    fn announce(&mut self, event: SystemEvent) {
        if self.tracker.sends_events() {
            self.send(PacketWriter::event(event).finish());
        }
    }

    fn hang_up(&mut self) {
        self.is_connected = false;
        self.work = None;
        self.framer.clear();
        self.writes.close();
    }

    fn execute(&mut self, request: &[u8], source: &mut dyn PointSource, now: Moment) {
        let (Some(0), Some(number)) = (i32_at(request, 4), i32_at(request, 8)) else { return };
        let command = CommandId::from_number(number);
        if self.is_mute || self.is_refused(command) {
            return;
        }
        if let Some(answers) = self.tracker.answer(command, request) {
            self.misapply(command);
            for answer in answers {
                self.send(answer);
            }
            return;
        }
        match command {
            CommandId::GetSystemStatus => self.system_status(),
            CommandId::GetTrackerStatus => {
                let status = self.tracker_status(source);
                self.send(PacketWriter::reply(command, ResultStatus::AllOk).i32(status.number()).finish());
            }
            CommandId::Initialize => self.work = Some((Work::Initialize, now + INITIALIZATION)),
            CommandId::StartMeasurement => self.start(source, now),
            CommandId::GoPosition => self.go(request, source),
            CommandId::StopMeasurement => {
                self.work = self.work.filter(|(work, _)| *work != Work::Measure);
                self.send(PacketWriter::reply(command, ResultStatus::AllOk).finish());
            }
            other => self.send(PacketWriter::reply(other, ResultStatus::NotImplemented).finish()),
        }
    }

    /// Refuses a command, or accepts it without effect, if a fault is planned for it.
    fn is_refused(&mut self, command: CommandId) -> bool {
        if command == CommandId::SetStationaryModeParams && self.faults.strikes(EmsconFault::OwnTime) {
            self.send(PacketWriter::reply(command, ResultStatus::Other(11)).finish());
            return true;
        }
        if command == CommandId::SetStationaryModeParams && self.faults.strikes(EmsconFault::NoStationary) {
            self.send(PacketWriter::reply(command, ResultStatus::NotImplemented).finish());
            return true;
        }
        false
    }

    /// Changes an accepted setting if a fault is planned for it.
    fn misapply(&mut self, command: CommandId) {
        if command == CommandId::SetUnits && self.faults.strikes(EmsconFault::Metres) {
            self.tracker.units[0] = 0;
        }
        if command == CommandId::SetSystemSettings && self.faults.strikes(EmsconFault::TryStuck) {
            self.tracker.settings[6] = 1;
        }
    }

    fn system_status(&mut self) {
        let is_cold = self.faults.strikes(EmsconFault::WarmingUp);
        let laser = if is_cold { LaserStatus::HeatingUp } else { LaserStatus::Ready };
        let is_initialized = self.tracker.is_initialized;
        let processor = if is_initialized { ProcessorStatus::Initialized } else { ProcessorStatus::CompensationSet };
        let packet = PacketWriter::reply(CommandId::GetSystemStatus, ResultStatus::AllOk)
            .integers(&[0, processor.number(), laser.number(), 2])
            .integers(&[3, 6, 0])
            .integers(&[self.tracker.settings[0], 0, 4711]);
        self.send(packet.finish());
    }

    fn tracker_status(&self, source: &mut dyn PointSource) -> TrackerStatus {
        if self.work.is_some() {
            TrackerStatus::Busy
        } else if self.tracker.is_initialized && source.position().is_some() {
            TrackerStatus::Ready
        } else {
            TrackerStatus::NotReady
        }
    }

    fn start(&mut self, source: &mut dyn PointSource, now: Moment) {
        let command = CommandId::StartMeasurement;
        if self.faults.strikes(EmsconFault::Mute) {
            self.is_mute = true;
            return;
        }
        if self.faults.strikes(EmsconFault::Early) {
            self.send_result(source);
        }
        if self.faults.strikes(EmsconFault::Busy) || self.work.is_some() {
            self.send(PacketWriter::reply(command, ResultStatus::ServerBusy).finish());
            return;
        }
        if self.faults.strikes(EmsconFault::NotReady) || source.position().is_none() {
            self.send(PacketWriter::error(command, ResultStatus::MeasurementStatusNotReady).finish());
            return;
        }
        self.send(PacketWriter::reply(command, ResultStatus::AllOk).finish());
        self.announce(SystemEvent::MeasStatusBusy);
        let duration = Duration::from_millis(u64::try_from(self.tracker.stationary[0]).unwrap_or(0));
        self.work = Some((Work::Measure, now + duration));
        if self.is_instant {
            self.finish(Work::Measure, source);
        }
    }

    /// Turns to a place, where the reflector is found if it is near.
    fn go(&mut self, request: &[u8], source: &mut dyn PointSource) {
        let coordinate = |index: usize| f64_at(request, 12 + 8 * index) / 1000.0;
        let place = Point3::new(coordinate(0), coordinate(1), coordinate(2));
        let is_near = source.position().is_some_and(|shot| (shot.point - place).norm() < SEARCH);
        let status = if is_near { ResultStatus::AllOk } else { ResultStatus::NoDistanceSet };
        self.send(PacketWriter::reply(CommandId::GoPosition, status).finish());
    }

    fn finish(&mut self, work: Work, source: &mut dyn PointSource) {
        self.work = None;
        match work {
            Work::Measure => self.measure(source),
            Work::Initialize => {
                self.tracker.is_initialized = true;
                self.send(PacketWriter::reply(CommandId::Initialize, ResultStatus::AllOk).finish());
                for event in [
                    SystemEvent::InitializationStatusChanged,
                    SystemEvent::MeasStatusReady,
                    SystemEvent::StatisticModeChanged,
                ] {
                    self.announce(event);
                }
            }
        }
    }

    /// Lets another program change a setting, if planned. A real tracker announces changes to all clients.
    fn interfere(&mut self) {
        if self.faults.strikes(EmsconFault::UnitsChanged) {
            self.tracker.units = [0, 1, 0, 0, 0];
            self.announce(SystemEvent::UnitsChanged);
        }
        if self.faults.strikes(EmsconFault::TypeChanged) {
            self.tracker.coordinate_type = CoordinateType::SphericalCounterClockwise;
            self.announce(SystemEvent::CoordinateSystemTypeChanged);
        }
        if self.faults.strikes(EmsconFault::FrameChanged) {
            self.tracker.orientation[0] = 100.0;
            self.announce(SystemEvent::StationOrientationParamsChanged);
        }
        if self.faults.strikes(EmsconFault::ReflectorChanged) {
            self.tracker.reflector = 1;
            self.announce(SystemEvent::ReflectorChanged);
        }
    }
}

impl Simulator for EmsconSimulator {
    fn accept(&mut self, now: Moment) {
        self.framer.clear();
        self.writes = Writes::default();
        self.work = None;
        self.is_connected = true;
        self.is_mute = false;
        self.next_position = now;
        self.writes.is_dripping = self.faults.strikes(EmsconFault::Drip);
        self.is_instant = self.faults.strikes(EmsconFault::Joined);
        self.writes.is_joining = self.is_instant;
        if self.faults.strikes(EmsconFault::Scaled) {
            self.tracker.transformation[6] = 1.0001;
            self.tracker.settings[1] = 1;
        }
        if self.faults.strikes(EmsconFault::Moved) {
            self.tracker.transformation[0] = 0.5;
            self.tracker.settings[1] = 1;
        }
        if self.faults.strikes(EmsconFault::UnusedScale) {
            self.tracker.transformation[6] = 1.0001;
        }
        if self.faults.strikes(EmsconFault::InUse) {
            self.send(PacketWriter::error(CommandId::Other(0), ResultStatus::MultiConnectionsNotAllowed).finish());
            self.hang_up();
        }
    }

    fn feed(&mut self, bytes: &[u8], source: &mut dyn PointSource, now: Moment) {
        if self.is_connected {
            self.framer.feed(bytes);
        }
        while self.is_connected {
            match self.framer.next_packet() {
                Ok(Some(request)) => self.execute(&request, source, now),
                Ok(None) => break,
                Err(_) => self.hang_up(),
            }
            if self.writes.is_overfull() {
                self.hang_up();
            }
        }
        self.writes.flush();
    }

    fn tick(&mut self, source: &mut dyn PointSource, now: Moment) {
        if let Some((work, until)) = self.work
            && now >= until
        {
            self.finish(work, source);
        }
        if self.is_connected && self.tracker.is_streaming() && now >= self.next_position {
            self.next_position = now + POSITION_INTERVAL;
            self.send_position(source);
        }
        if self.is_connected && self.writes.is_overfull() {
            self.hang_up();
        }
        self.writes.flush();
    }

    fn next_output(&mut self) -> Option<Output> {
        self.writes.next()
    }

    fn next_deadline(&self) -> Option<Moment> {
        let position = (self.is_connected && self.tracker.is_streaming()).then_some(self.next_position);
        let work = self.work.map(|(_, until)| until);
        work.into_iter().chain(position).min()
    }
}

#[cfg(test)]
impl EmsconSimulator {
    /// Lets another program switch on the transformation. A real tracker announces changes to all clients.
    pub(in crate::link) fn apply_transformation(&mut self) {
        self.tracker.settings[1] = 1;
        self.announce(SystemEvent::SystemSettingsChanged);
        self.writes.flush();
    }

    /// Bytes of an incomplete request.
    pub(in crate::link) fn pending(&self) -> usize {
        self.framer.pending()
    }
}
