//! A protocol on its wire: one named thread that connects, reads, handles deadlines and reconnects after a loss.
//!
//! After a loss the whole set-up runs again. A measurement in progress has failed and is never resumed.

use std::collections::VecDeque;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use nalgebra::Point3;

use super::protocol::rest::RestDetector;
use super::protocol::{Failure, Identity, JointState, Protocol, ProtocolEvent, Shot, Status};
use super::transport::{self, Stopwatch, Transport};
use crate::session::wire::{Route, WireAddress, WireProtocol};

/// Longest wait for a read, so that commands are handled in time.
const READ_TIMEOUT: Duration = Duration::from_millis(20);
/// First pause before reconnecting; each following one is twice as long.
const FIRST_BACK_OFF: Duration = Duration::from_millis(500);
/// Longest pause before reconnecting.
const LONGEST_BACK_OFF: Duration = Duration::from_secs(10);
/// Longest wait for the port at which a conversation continues, and the pause between attempts.
const REDIRECTION: Duration = Duration::from_secs(4);
const REDIRECTION_PAUSE: Duration = Duration::from_millis(100);
/// Most events that wait for the owner of the wire. Live points are not among them.
const EVENT_BACKLOG: usize = 256;
/// Most joint states that wait for the owner of the wire: those of 40 s at the highest frequency.
const JOINT_BACKLOG: usize = 1024;
/// Most bytes per read.
const CHUNK: usize = 16 * 1024;

/// Events of a wire. Values of which only the current one matters are in [`Latest`].
#[derive(Clone, Debug, PartialEq)]
pub(super) enum WireEvent {
    Up(Identity),
    /// The connection was lost or could not be made; it will be retried.
    Down(Failure),
    /// The requested shot.
    Shot(Shot),
    /// The requested shot failed.
    Failed(Failure),
    /// The instrument has turned to where it was sent.
    Pointed,
    /// A measurement that was started at the instrument itself.
    Offered(Shot),
    /// A message for the operator.
    Status(Status),
}

/// Latest values, each with its time since the start of the wire.
#[derive(Clone, Debug, Default)]
pub(super) struct Latest {
    /// Last time at which the other end sent something or the connection was made.
    pub(super) heard: Option<Duration>,
    /// Latest live point.
    pub(super) live: Option<(Duration, Shot)>,
    /// Latest joint values of the robot.
    pub(super) joints: Option<(Duration, JointState)>,
    pub(super) is_still: bool,
}

enum Command {
    Trigger,
    Point(Point3<f64>),
    Cancel,
}

/// A wire with its thread. The thread ends after the wire is dropped; dropping does not wait for it.
#[derive(Debug)]
pub(super) struct Wire {
    commands: SyncSender<Command>,
    pub(super) events: Receiver<WireEvent>,
    pub(super) monitor: WireMonitor,
    joints: JointQueue,
    stop: Arc<AtomicBool>,
}

/// Joint states of the robot with the time of their arrival since the start of the wire, oldest first.
type JointQueue = Arc<Mutex<VecDeque<(Duration, JointState)>>>;

/// Read access to the latest values of a wire, also while the wire is in use elsewhere.
#[derive(Clone, Debug)]
pub(super) struct WireMonitor {
    latest: Arc<Mutex<Latest>>,
    clock: Stopwatch,
    /// Whether points arrive between shots.
    pub(super) shows_live: bool,
}

impl WireMonitor {
    pub(super) fn latest(&self) -> Latest {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Time since the start of the wire.
    pub(super) fn now(&self) -> Duration {
        self.clock.now()
    }
}

impl Wire {
    /// Starts to connect. `log` records every byte in both directions.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub(super) fn start(address: WireAddress, protocol: Box<dyn Protocol>, log: Option<RawLog>) -> io::Result<Self> {
        let (commands, received) = sync_channel(4);
        let (sender, events) = sync_channel(EVENT_BACKLOG);
        let latest = Arc::new(Mutex::new(Latest::default()));
        let joints = JointQueue::default();
        let stop = Arc::new(AtomicBool::new(false));
        let clock = Stopwatch::start();
        let name = format!("link-{}", address.protocol);
        let monitor = WireMonitor { latest: Arc::clone(&latest), clock, shows_live: protocol.shows_live() };
        let mut worker = Worker {
            address,
            protocol,
            received,
            sender,
            latest,
            joints: Arc::clone(&joints),
            stop: Arc::clone(&stop),
            clock,
            log,
            rest_detector: RestDetector::default(),
            has_answered: false,
        };
        thread::Builder::new().name(name).spawn(move || worker.run())?;
        Ok(Self { commands, events, monitor, joints, stop })
    }

    /// Requests a shot; `false` if the thread has ended or its command queue is full.
    pub(super) fn trigger(&self) -> bool {
        self.commands.try_send(Command::Trigger).is_ok()
    }

    /// Turns the instrument to a place in its frame (m); `false` if the thread has ended or its command queue is full.
    pub(super) fn point(&self, at: Point3<f64>) -> bool {
        self.commands.try_send(Command::Point(at)).is_ok()
    }

    /// Cancels the shot in progress.
    pub(super) fn cancel(&self) {
        let _not_running = self.commands.try_send(Command::Cancel);
    }

    pub(super) fn latest(&self) -> Latest {
        self.monitor.latest()
    }

    /// All joint states since the last call, with the time of their arrival.
    pub(super) fn take_joints(&self) -> VecDeque<(Duration, JointState)> {
        std::mem::take(&mut *self.joints.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Time since the start of the wire.
    pub(super) fn now(&self) -> Duration {
        self.monitor.now()
    }
}

impl Drop for Wire {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Log of all bytes on the wires.
#[derive(Clone, Debug)]
pub struct RawLog(Arc<Mutex<std::fs::File>>);

impl RawLog {
    pub fn new(file: std::fs::File) -> Self {
        Self(Arc::new(Mutex::new(file)))
    }

    /// Writes one line: time since the start of the wire (s), protocol, direction, bytes in hexadecimal.
    fn write(&self, now: Duration, wire: WireProtocol, direction: &str, bytes: &[u8]) {
        use std::fmt::Write as _;
        use std::io::Write as _;

        let mut line = format!("{:.6} {wire} {direction} ", now.as_secs_f64());
        for byte in bytes {
            // Writing to a string cannot fail.
            let _infallible = write!(line, "{byte:02x}");
        }
        line.push('\n');
        let mut file = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // The log only helps with later diagnosis; a full disk must not stop the measurement.
        let _best_effort = file.write_all(line.as_bytes());
    }
}

/// Why a connection ended.
enum End {
    /// The connection was lost.
    Lost(Failure),
    /// The wire was dropped.
    Stopped,
}

struct Worker {
    address: WireAddress,
    protocol: Box<dyn Protocol>,
    received: Receiver<Command>,
    sender: SyncSender<WireEvent>,
    latest: Arc<Mutex<Latest>>,
    joints: JointQueue,
    stop: Arc<AtomicBool>,
    clock: Stopwatch,
    log: Option<RawLog>,
    rest_detector: RestDetector,
    /// Whether anything was received over this connection.
    has_answered: bool,
}

impl Worker {
    fn run(&mut self) {
        let mut back_off = FIRST_BACK_OFF;
        while !self.is_stopped() {
            let failure = match self.connect() {
                Ok(transport) => match self.talk(transport) {
                    (End::Stopped, _) => return,
                    (End::Lost(failure), was_ready) => {
                        if was_ready {
                            back_off = FIRST_BACK_OFF;
                        }
                        self.explained(failure)
                    }
                },
                Err(error) if error.kind() == io::ErrorKind::Interrupted => return,
                Err(error) => Failure::Unreachable(error.to_string()),
            };
            // Live values of the lost connection must not be shown as current.
            *self.latest.lock().unwrap_or_else(PoisonError::into_inner) = Latest::default();
            if !self.send_event(WireEvent::Down(failure)) || !self.pause(back_off) {
                return;
            }
            back_off = (back_off * 2).min(LONGEST_BACK_OFF);
        }
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn connect(&self) -> io::Result<Box<dyn Transport>> {
        let stop = Arc::clone(&self.stop);
        transport::connect(&self.address.route, &move || !stop.load(Ordering::Relaxed))
    }

    /// Runs the protocol until the connection is lost; also returns whether it was ever ready.
    fn talk(&mut self, mut transport: Box<dyn Transport>) -> (End, bool) {
        let mut buffer = vec![0; CHUNK];
        let mut was_ready = false;
        self.mark_heard(self.clock.now());
        self.has_answered = false;
        self.protocol.start(self.clock.now());
        loop {
            if self.is_stopped() {
                return (End::Stopped, was_ready);
            }
            if let Some(port) = self.protocol.next_redirect() {
                drop(transport);
                transport = match self.redirected(port) {
                    Ok(other) => other,
                    Err(end) => return (end, was_ready),
                };
            }
            match self.poll_once(transport.as_mut(), &mut buffer, &mut was_ready) {
                Ok(()) => {}
                Err(end) => return (end, was_ready),
            }
        }
    }

    /// Connects to another port of the same host. A controller needs a moment to open it.
    fn redirected(&self, port: u16) -> Result<Box<dyn Transport>, End> {
        let route = match &self.address.route {
            Route::Tcp { host, .. } => Route::Tcp { host: host.clone(), port },
            other => other.clone(),
        };
        let until = self.clock.now() + REDIRECTION;
        loop {
            let stop = Arc::clone(&self.stop);
            match transport::connect(&route, &move || !stop.load(Ordering::Relaxed)) {
                Ok(transport) => return Ok(transport),
                Err(_) if self.is_stopped() => return Err(End::Stopped),
                Err(error) if self.clock.now() > until => {
                    return Err(End::Lost(Failure::Unreachable(error.to_string())));
                }
                Err(_not_yet_open) => thread::sleep(REDIRECTION_PAUSE),
            }
        }
    }

    /// Handles commands, outputs, received bytes, deadlines and events once.
    fn poll_once(&mut self, transport: &mut dyn Transport, buffer: &mut [u8], was_ready: &mut bool) -> Result<(), End> {
        while let Ok(command) = self.received.try_recv() {
            match command {
                Command::Trigger => self.protocol.trigger(self.clock.now()),
                Command::Point(at) => {
                    if !self.protocol.point(&at, self.clock.now()) {
                        let failure = Failure::Refused("this instrument cannot be turned from here".to_owned());
                        self.forward(ProtocolEvent::Failed(failure), was_ready)?;
                    }
                }
                Command::Cancel => self.protocol.cancel(self.clock.now()),
            }
        }
        let disconnected = |error: &io::Error| End::Lost(Failure::Disconnected(error.to_string()));
        while let Some(bytes) = self.protocol.next_output() {
            self.log_bytes("out", &bytes);
            transport.write(&bytes).map_err(|error| disconnected(&error))?;
        }
        while let Some(change) = self.protocol.next_line_change() {
            transport.change_line(change).map_err(|error| disconnected(&error))?;
        }
        let now = self.clock.now();
        let until = self.protocol.next_deadline().map_or(READ_TIMEOUT, |deadline| deadline.saturating_sub(now));
        let read = transport.read(buffer, until.min(READ_TIMEOUT)).map_err(|error| disconnected(&error));
        let now = self.clock.now();
        if let Ok(count @ 1..) = read
            && let Some(bytes) = buffer.get(..count)
        {
            self.log_bytes("in", bytes);
            self.protocol.feed(bytes, now);
            self.mark_heard(now);
            self.has_answered = true;
        }
        self.protocol.tick(now);
        while let Some(event) = self.protocol.next_event() {
            self.forward(event, was_ready)?;
        }
        read.map(drop)
    }

    fn mark_heard(&self, now: Duration) {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).heard = Some(now);
    }

    /// A peer that accepts the connection but never sends anything is probably another device.
    fn explained(&self, failure: Failure) -> Failure {
        match (failure, &self.address.route) {
            (Failure::Silent { seconds, .. }, Route::Tcp { .. }) if !self.has_answered => {
                Failure::Foreign(format!("it accepted the connection but sent nothing for {seconds:.0} s"))
            }
            (failure, _) => failure,
        }
    }

    fn forward(&mut self, event: ProtocolEvent, was_ready: &mut bool) -> Result<(), End> {
        let now = self.clock.now();
        let event = match event {
            ProtocolEvent::Ready(identity) => {
                *was_ready = true;
                WireEvent::Up(identity)
            }
            ProtocolEvent::Shot(shot) => WireEvent::Shot(shot),
            ProtocolEvent::Failed(failure) => WireEvent::Failed(failure),
            ProtocolEvent::Pointed => WireEvent::Pointed,
            ProtocolEvent::Offered(shot) => WireEvent::Offered(shot),
            ProtocolEvent::Status(status) => WireEvent::Status(status),
            ProtocolEvent::Live(shot) => {
                self.latest.lock().unwrap_or_else(PoisonError::into_inner).live = Some((now, shot));
                return Ok(());
            }
            ProtocolEvent::Joints(state) => {
                let is_still = self.rest_detector.feed(&state);
                let mut joints = self.joints.lock().unwrap_or_else(PoisonError::into_inner);
                if joints.len() == JOINT_BACKLOG {
                    joints.pop_front();
                }
                joints.push_back((now, state.clone()));
                drop(joints);
                let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
                (latest.joints, latest.is_still) = (Some((now, state)), is_still);
                return Ok(());
            }
            ProtocolEvent::Lost(failure) => return Err(End::Lost(failure)),
        };
        if self.send_event(event) { Ok(()) } else { Err(End::Stopped) }
    }

    /// Sends an event; `false` if the wire was dropped. If the queue is full, messages are dropped and answers wait.
    fn send_event(&self, event: WireEvent) -> bool {
        const RETRY_INTERVAL: Duration = Duration::from_millis(5);
        let mut event = event;
        loop {
            match self.sender.try_send(event) {
                Ok(()) | Err(TrySendError::Full(WireEvent::Status(_) | WireEvent::Offered(_))) => return true,
                Err(TrySendError::Disconnected(_)) => return false,
                Err(TrySendError::Full(back)) => event = back,
            }
            if self.is_stopped() {
                return false;
            }
            thread::sleep(RETRY_INTERVAL);
        }
    }

    /// Waits before reconnecting and rejects shots requested meanwhile; `false` if the wire was dropped.
    fn pause(&self, time: Duration) -> bool {
        let until = self.clock.now() + time;
        while self.clock.now() < until {
            if self.is_stopped() {
                return false;
            }
            if let Ok(Command::Trigger | Command::Point(_)) = self.received.recv_timeout(READ_TIMEOUT) {
                let failure = Failure::Disconnected("the link is reconnecting".to_owned());
                if !self.send_event(WireEvent::Failed(failure)) {
                    return false;
                }
            }
        }
        true
    }

    fn log_bytes(&self, direction: &str, bytes: &[u8]) {
        if let Some(log) = &self.log {
            log.write(self.clock.now(), self.address.protocol, direction, bytes);
        }
    }
}
