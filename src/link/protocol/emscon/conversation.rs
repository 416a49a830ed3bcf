//! The conversation with a tracker: at most one command is in progress at any time, and answers are matched by command, not by
//! order.

use std::time::Duration;

use nalgebra::Point3;

use super::super::excerpt::excerpt;
use super::super::outbox::Outbox;
use super::super::{Failure, Moment, ProtocolEvent, Severity};
use super::EmsconOptions;
use super::command::Command;
use super::exchange::{Due, Exchange, FIRST, time_limit};
use super::packet::{Framer, Packet, Reply, SingleResult};
use super::setup::{Outcome, SetUp, WARM_UP_PAUSE};
use super::shot::{position_of, shot_of};
use super::status::{CommandId, PacketType, ResultStatus, SystemEvent, TrackerStatus};
use super::step::reading_of;

/// Consecutive re-checks that found another change; beyond this another program must be changing the settings.
const MAX_RECHECKS: u32 = 5;

/// Bytes of a foreign protocol that are quoted in a message.
const QUOTED_BYTES: usize = 16;

/// State of the link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Not connected, or lost.
    Off,
    /// Setting up or re-checking.
    Settling,
    /// Ready for a shot. A command in progress is a keep-alive.
    Idle,
    /// Shot: asking whether the tracker is ready.
    Asking,
    /// Shot: waiting for the acceptance.
    Starting,
    /// Shot: waiting for the result.
    Waiting { since: Moment, until: Moment },
    /// Turning to where it was sent.
    Turning,
    /// The shot was cancelled; its results are discarded until the stop command is answered.
    Stopping,
}

#[derive(Clone, Debug)]
pub(super) struct Conversation {
    options: EmsconOptions,
    pub outbox: Outbox,
    framer: Framer,
    phase: Phase,
    exchange: Option<Exchange>,
    set_up: SetUp,
    /// Whether [`ProtocolEvent::Ready`] was sent.
    is_announced: bool,
    /// Whether a setting that points depend on changed since it was read.
    is_dirty: bool,
    rechecks: u32,
    was_not_ready: bool,
    face: Option<u8>,
    last_heard: Moment,
    /// Time of the first packet of this connection, which shows that the other end is a tracker.
    known_since: Option<Moment>,
}

impl Conversation {
    pub(super) fn new(options: EmsconOptions) -> Self {
        Self {
            options,
            outbox: Outbox::default(),
            framer: Framer::default(),
            phase: Phase::Off,
            exchange: None,
            set_up: SetUp::whole(options),
            is_announced: false,
            is_dirty: false,
            rechecks: 0,
            was_not_ready: false,
            face: None,
            last_heard: Moment::ZERO,
            known_since: None,
        }
    }

    /// Whether positions of the reflector arrive between shots.
    pub(super) const fn shows_live(&self) -> bool {
        self.options.reflector_positions
    }

    /// Starts the set-up on a new connection.
    pub(super) fn start(&mut self, now: Moment) {
        *self = Self::new(self.options);
        self.last_heard = now;
        self.phase = Phase::Settling;
        self.next_step(now);
    }

    /// Takes bytes from the tracker.
    pub(super) fn feed(&mut self, bytes: &[u8], now: Moment) {
        if self.phase == Phase::Off {
            return;
        }
        self.last_heard = now;
        self.framer.feed(bytes);
        while self.phase != Phase::Off {
            if self.known_since.is_none() && self.framer.announces_unknown() {
                // No packet was understood so far, so the other end is not a tracker.
                let start = excerpt(&String::from_utf8_lossy(self.framer.start(QUOTED_BYTES)));
                self.lose(Failure::Foreign(format!("it does not use emScon; its data begin with `{start}`")));
                return;
            }
            match self.framer.next_packet() {
                Ok(Some(packet)) => {
                    self.known_since.get_or_insert(now);
                    self.take(&packet, now);
                }
                Ok(None) => return,
                Err(error) => self.lose(Failure::Garbled(error.to_string())),
            }
        }
    }

    /// Handles everything that is due.
    pub(super) fn tick(&mut self, now: Moment) {
        if let Phase::Waiting { since, until } = self.phase
            && now >= until
        {
            let seconds = now.saturating_sub(since).as_secs_f64();
            self.fail(Failure::Silent { what: "waiting for the result of the measurement".to_owned(), seconds });
            self.stop(now);
        }
        match self.exchange.as_mut().map(|exchange| exchange.due(now)) {
            Some(Due::Resend(bytes)) => self.outbox.send(bytes),
            Some(Due::TimedOut) => self.timed_out(now),
            None if self.phase == Phase::Idle && now >= self.keep_alive_at() => {
                self.send(Command::bare(CommandId::GetTrackerStatus), now);
            }
            Some(Due::Nothing) | None => {}
        }
    }

    /// Requests a shot.
    pub(super) fn trigger(&mut self, now: Moment) {
        let too_early = |text: &str| Failure::TooEarly(text.to_owned());
        match self.phase {
            Phase::Idle => {
                self.phase = Phase::Asking;
                self.send(Command::bare(CommandId::GetTrackerStatus), now);
            }
            Phase::Off => self.fail(too_early("the tracker is not connected")),
            Phase::Settling if self.is_announced => {
                let text = "its settings were changed and are being checked".to_owned();
                self.fail(Failure::NotReady(text));
            }
            Phase::Settling => self.fail(too_early("the set-up is not complete")),
            Phase::Asking | Phase::Starting | Phase::Waiting { .. } => {
                self.fail(too_early("a measurement is in progress"));
            }
            Phase::Turning => self.fail(too_early("the tracker is turning")),
            Phase::Stopping => self.fail(too_early("the previous measurement is being stopped")),
        }
    }

    /// Turns the tracker to a place (m), where it searches for the reflector.
    pub(super) fn point(&mut self, at: &Point3<f64>, now: Moment) {
        if self.phase == Phase::Idle {
            self.phase = Phase::Turning;
            self.send(Command::go_position(at, self.options.use_adm), now);
        } else {
            self.fail(Failure::TooEarly("the tracker is busy or not set up".to_owned()));
        }
    }

    /// Cancels the shot in progress.
    pub(super) fn cancel(&mut self, now: Moment) {
        match self.phase {
            Phase::Asking | Phase::Turning => self.phase = Phase::Idle,
            Phase::Starting | Phase::Waiting { .. } => self.stop(now),
            Phase::Off | Phase::Settling | Phase::Idle | Phase::Stopping => {}
        }
    }

    /// The next time at which [`Self::tick`] has something to do.
    pub(super) fn next_deadline(&self) -> Option<Moment> {
        let exchange = self.exchange.as_ref().map(Exchange::deadline);
        match self.phase {
            Phase::Off => None,
            Phase::Waiting { until, .. } => Some(exchange.map_or(until, |deadline| deadline.min(until))),
            Phase::Idle => exchange.or_else(|| Some(self.keep_alive_at())),
            Phase::Settling | Phase::Asking | Phase::Starting | Phase::Turning | Phase::Stopping => exchange,
        }
    }

    fn keep_alive_at(&self) -> Moment {
        self.last_heard.saturating_add(self.options.keep_alive)
    }

    fn take(&mut self, bytes: &[u8], now: Moment) {
        match Packet::decode(bytes) {
            Ok(Packet::Reply(reply)) => self.take_answer(reply.command(), reply.status(), Some(&reply), now),
            Ok(Packet::Error { command, status }) => self.take_error(command, status, now),
            Ok(Packet::Single(result)) => self.take_result(result, now),
            Ok(Packet::ReflectorPosition { values, raw }) => self.take_position(values, raw),
            Ok(Packet::Event(event)) => self.take_event(event, now),
            Ok(Packet::Skipped(PacketType::Other(number))) => {
                self.outbox.report(Severity::Info, format!("skipped a packet of unknown type {number}"));
            }
            Ok(Packet::Skipped(_)) => {}
            Err(error) if matches!(self.phase, Phase::Waiting { .. }) => {
                self.fail(Failure::Garbled(error.to_string()));
                self.stop(now);
            }
            Err(error) => self.outbox.report(Severity::Warning, error.to_string()),
        }
    }

    /// Handles an error packet: it answers the command it names, and it ends a measurement whose result is awaited.
    fn take_error(&mut self, command: CommandId, status: ResultStatus, now: Moment) {
        if self.exchange.as_ref().is_some_and(|exchange| exchange.is_answered_by(command)) {
            self.take_answer(command, status, None, now);
        } else if status == ResultStatus::MultiConnectionsNotAllowed {
            self.lose(status.failure("connecting"));
        } else if matches!(self.phase, Phase::Waiting { .. }) {
            self.fail(status.measurement_failure());
            if command == CommandId::StartMeasurement { self.settle_or_idle(now) } else { self.stop(now) }
        } else if self.phase != Phase::Stopping {
            self.outbox.report(Severity::Warning, format!("{command}: {}", status.described()));
        }
    }

    fn take_answer(&mut self, command: CommandId, status: ResultStatus, reply: Option<&Reply>, now: Moment) {
        let Some(exchange) = self.exchange.as_mut().filter(|exchange| exchange.is_answered_by(command)) else { return };
        if status == ResultStatus::ServerBusy && exchange.retry(now) {
            return;
        }
        match self.phase {
            Phase::Off | Phase::Waiting { .. } => {}
            Phase::Settling => self.take_step(status, reply, now),
            Phase::Idle => {
                self.exchange = None;
                if status == ResultStatus::MultiConnectionsNotAllowed {
                    self.lose(status.failure("keep-alive"));
                }
            }
            Phase::Asking => self.take_readiness(status, reply, now),
            Phase::Starting if status == ResultStatus::AllOk && reply.is_some() => {
                self.exchange = None;
                let measuring = Duration::from_millis(u64::try_from(self.set_up.measure_ms).unwrap_or(0));
                let until = now.saturating_add(measuring).saturating_add(self.options.result_margin);
                self.phase = Phase::Waiting { since: now, until };
            }
            Phase::Starting => {
                self.fail(status.failure("starting the measurement"));
                self.settle_or_idle(now);
            }
            Phase::Turning => {
                if status == ResultStatus::AllOk {
                    self.outbox.push(ProtocolEvent::Pointed);
                } else {
                    self.fail(status.failure("turning to the SMR"));
                }
                self.settle_or_idle(now);
            }
            Phase::Stopping => self.settle_or_idle(now),
        }
    }

    /// Handles an answer in the set-up.
    fn take_step(&mut self, status: ResultStatus, reply: Option<&Reply>, now: Moment) {
        let outcome = match reply {
            Some(reply) if status.is_done() => self.set_up.answered(reply),
            _ => self.set_up.refused(status),
        };
        match outcome {
            Ok(Outcome::Done) => self.next_step(now),
            Ok(Outcome::More) => {}
            Ok(Outcome::Wait(text)) => {
                self.outbox.report(Severity::Warning, text);
                if let Some(exchange) = &mut self.exchange {
                    exchange.repeat_after(WARM_UP_PAUSE, now);
                }
            }
            Err(failure) => self.lose(failure),
        }
    }

    /// Handles the answer to whether a shot may start. A tracker that is only busy is asked again.
    fn take_readiness(&mut self, status: ResultStatus, reply: Option<&Reply>, now: Moment) {
        let fields = reply.filter(|_| status == ResultStatus::AllOk).map(|reply| reply.fields(20));
        let readiness = fields.map(|fields| fields.map(|fields| TrackerStatus::from_number(fields.i32(16))));
        let failure = match readiness {
            Some(Ok(TrackerStatus::Ready)) => {
                self.phase = Phase::Starting;
                self.send(Command::bare(CommandId::StartMeasurement), now);
                return;
            }
            Some(Ok(TrackerStatus::Busy)) if self.exchange.as_mut().is_some_and(|exchange| exchange.retry(now)) => {
                return;
            }
            Some(Ok(TrackerStatus::NotReady)) => Failure::NoTarget(
                "tracker status 'not ready': no reflector is locked, or the tracker is not initialised".to_owned(),
            ),
            Some(Ok(other)) => Failure::NotReady(format!("tracker status: {other}")),
            Some(Err(error)) => Failure::Garbled(error.to_string()),
            None => status.failure("reading the tracker status"),
        };
        self.fail(failure);
        self.settle_or_idle(now);
    }

    fn take_result(&mut self, result: SingleResult, now: Moment) {
        match self.phase {
            Phase::Off | Phase::Stopping => return,
            Phase::Settling => {
                self.outbox
                    .report(Severity::Warning, "ignored a point that arrived while the settings were being checked");
                return;
            }
            Phase::Idle | Phase::Asking | Phase::Starting | Phase::Turning | Phase::Waiting { .. } => {}
        }
        let is_requested = matches!(self.phase, Phase::Waiting { .. });
        let checked = shot_of(result, &self.options, self.face);
        self.is_dirty |= matches!(checked, Err(Failure::Settings(_) | Failure::Unusable(_)));
        match (checked, is_requested) {
            (Ok(shot), true) => self.outbox.push(ProtocolEvent::Shot(shot)),
            (Err(failure), true) => self.fail(failure),
            (Ok(shot), false) => self.outbox.push(ProtocolEvent::Offered(shot)),
            (Err(failure), false) => {
                self.outbox.report(Severity::Warning, format!("ignored an unrequested point: {failure}"));
            }
        }
        if is_requested || (self.is_dirty && self.phase == Phase::Idle) {
            self.settle_or_idle(now);
        }
    }

    /// Reports a live position, but only while the units are certain.
    fn take_position(&mut self, values: [f64; 3], raw: Vec<u8>) {
        let is_certain = !self.is_dirty && !matches!(self.phase, Phase::Off | Phase::Settling);
        if let Some(shot) = position_of(values, raw, self.face).filter(|_| is_certain) {
            self.outbox.push(ProtocolEvent::Live(shot));
        }
    }

    fn take_event(&mut self, event: SystemEvent, now: Moment) {
        match event {
            SystemEvent::IsFace1 => self.face = Some(1),
            SystemEvent::IsFace2 => self.face = Some(2),
            SystemEvent::TpConnectionClosing | SystemEvent::ServerClosing => {
                self.lose(Failure::Disconnected(event.to_string()));
            }
            SystemEvent::MeasStatusNotReady => self.take_not_ready(now),
            SystemEvent::MeasStatusReady if self.was_not_ready => {
                self.was_not_ready = false;
                self.outbox.report(Severity::Info, "the tracker is ready again");
            }
            SystemEvent::LaserWarmedUp
            | SystemEvent::CompensationChanged
            | SystemEvent::InitializationStatusChanged => {
                self.outbox.report(Severity::Info, event.words());
            }
            SystemEvent::SensorDisconnected | SystemEvent::BatteryStatus | SystemEvent::ExternalControlActive => {
                self.outbox.report(Severity::Warning, event.words());
            }
            _ if reading_of(event).is_some() => self.take_change(event, now),
            _ => {}
        }
    }

    /// Handles *not ready*, which during a shot means a broken beam.
    fn take_not_ready(&mut self, now: Moment) {
        match self.phase {
            Phase::Starting | Phase::Waiting { .. } => {
                self.fail(Failure::NoTarget(
                    "the tracker reported 'not ready' before the result: the beam is broken".to_owned(),
                ));
                self.stop(now);
            }
            Phase::Idle | Phase::Asking if !self.was_not_ready => {
                self.outbox.report(Severity::Warning, "the tracker is not ready: the beam may be broken");
            }
            _ => {}
        }
        self.was_not_ready = true;
    }

    /// Handles a change of a setting that points depend on: fails the shot in progress and reads everything again.
    fn take_change(&mut self, event: SystemEvent, now: Moment) {
        match self.phase {
            Phase::Off => return,
            Phase::Settling => {
                self.is_dirty |= !self.set_up.will_read(event);
                return;
            }
            Phase::Idle | Phase::Turning | Phase::Stopping => {}
            Phase::Asking | Phase::Starting | Phase::Waiting { .. } => {
                self.fail(Failure::Settings(format!("{} while a point was being measured", event.words())));
            }
        }
        self.is_dirty = true;
        match self.phase {
            Phase::Starting | Phase::Waiting { .. } => self.stop(now),
            Phase::Idle | Phase::Asking => self.settle_or_idle(now),
            Phase::Off | Phase::Settling | Phase::Turning | Phase::Stopping => {}
        }
    }

    /// Handles a missing answer. A tracker that does not answer a status or a stop command counts as lost.
    fn timed_out(&mut self, now: Moment) {
        let Some(exchange) = self.exchange.take() else { return };
        if self.known_since.is_none() {
            let seconds = FIRST.as_secs();
            let text = format!("it accepted the connection but did not answer the first command within {seconds} s");
            return self.lose(Failure::Foreign(text));
        }
        let seconds = time_limit(exchange.command.id).as_secs_f64();
        let failure = Failure::Silent { what: exchange.command.id.words().to_owned(), seconds };
        if self.phase == Phase::Starting {
            self.fail(failure);
            self.stop(now);
        } else {
            self.lose(failure);
        }
    }

    /// Continues the set-up, or completes it.
    fn next_step(&mut self, now: Moment) {
        if let Some(command) = self.set_up.command() {
            self.send(command, now);
            return;
        }
        if self.is_dirty {
            self.settle_or_idle(now);
            return;
        }
        self.exchange = None;
        self.phase = Phase::Idle;
        self.rechecks = 0;
        let identity = self.set_up.identity();
        if self.is_announced {
            for warning in identity.warnings {
                self.outbox.report(Severity::Warning, warning);
            }
            self.outbox.report(Severity::Info, "the settings of the tracker were checked again and are right");
        } else {
            self.is_announced = true;
            self.outbox.push(ProtocolEvent::Ready(identity));
        }
    }

    /// Ends an activity: becomes idle, or reads the settings again if they changed.
    fn settle_or_idle(&mut self, now: Moment) {
        self.exchange = None;
        if !self.is_dirty {
            self.phase = Phase::Idle;
            return;
        }
        self.rechecks += 1;
        if self.rechecks > MAX_RECHECKS {
            self.lose(Failure::Settings("another program keeps changing the settings of the tracker".to_owned()));
            return;
        }
        self.is_dirty = false;
        self.phase = Phase::Settling;
        self.set_up.recheck();
        self.next_step(now);
    }

    fn stop(&mut self, now: Moment) {
        self.phase = Phase::Stopping;
        self.send(Command::bare(CommandId::StopMeasurement), now);
    }

    fn send(&mut self, command: Command, now: Moment) {
        self.outbox.send(command.encode());
        let exchange = if self.known_since.is_some() { Exchange::new } else { Exchange::first };
        self.exchange = Some(exchange(command, now));
    }

    /// Answers the trigger with a failure.
    fn fail(&mut self, failure: Failure) {
        self.outbox.fail(failure);
    }

    fn lose(&mut self, failure: Failure) {
        if matches!(self.phase, Phase::Asking | Phase::Starting | Phase::Turning | Phase::Waiting { .. }) {
            self.fail(failure.clone());
        }
        self.phase = Phase::Off;
        self.exchange = None;
        self.framer.clear();
        self.outbox.lose(failure);
    }
}

#[cfg(test)]
impl Conversation {
    pub(super) fn pending(&self) -> usize {
        self.framer.pending()
    }
}
