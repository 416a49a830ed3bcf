//! A protocol on its wire: one named thread that connects, reads, answers deadlines, and connects again after a loss.
//!
//! After a loss the whole set-up is done again; a measurement under way has failed, and is never resumed.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use super::protocol::rtde::Stillness;
use super::protocol::{Failure, Identity, JointState, Protocol, ProtocolEvent, Shot, Status};
use super::transport::{self, Stopwatch, Transport};
use crate::session::wire::{Route, WireAddress, WireProtocol};

/// A read waits this long at most, so that commands are seen.
const READ: Duration = Duration::from_millis(20);
/// First and longest wait before connecting again.
const BACK_OFF: (Duration, Duration) = (Duration::from_millis(500), Duration::from_secs(10));
/// Events that wait for whoever measures. Points that nobody asked for are not among them.
const WAITING: usize = 256;
/// Bytes read at once.
const CHUNK: usize = 16 * 1024;

/// What has happened on the wire. What is only of interest now is in [`Latest`].
#[derive(Clone, Debug, PartialEq)]
pub(super) enum WireEvent {
    /// The set-up is complete.
    Up(Identity),
    /// The connection is lost, or was never there; it is tried again.
    Down(Failure),
    /// The shot that was asked for.
    Shot(Shot),
    /// It did not come.
    Failed(Failure),
    /// A measurement that somebody started at the instrument.
    Offered(Shot),
    /// Something to know.
    Status(Status),
}

/// What came last, with its time since the start of the wire.
#[derive(Clone, Debug, Default)]
pub(super) struct Latest {
    /// When the other end was heard last, or was connected to.
    pub(super) heard: Option<Duration>,
    /// Point that nobody asked for.
    pub(super) live: Option<(Duration, Shot)>,
    /// Joints of the robot.
    pub(super) joints: Option<(Duration, JointState)>,
    /// Whether the robot is at rest.
    pub(super) is_still: bool,
}

enum Command {
    Trigger,
    Cancel,
}

/// A wire with its thread. The thread ends with it; nobody waits for it.
#[derive(Debug)]
pub(super) struct Wire {
    commands: SyncSender<Command>,
    pub(super) events: Receiver<WireEvent>,
    latest: Arc<Mutex<Latest>>,
    stop: Arc<AtomicBool>,
    clock: Stopwatch,
    shows_live: bool,
}

/// A look at what came last, by whoever wants while the wire is in use.
#[derive(Clone, Debug)]
pub(super) struct Eye {
    latest: Arc<Mutex<Latest>>,
    clock: Stopwatch,
    /// Whether points are shown between shots.
    pub(super) shows_live: bool,
}

impl Eye {
    /// What came last.
    pub(super) fn latest(&self) -> Latest {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Time since the start of the wire.
    pub(super) fn now(&self) -> Duration {
        self.clock.now()
    }
}

impl Wire {
    /// Starts to connect. `log` takes every byte that comes and goes.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub(super) fn start(address: WireAddress, protocol: Box<dyn Protocol>, log: Option<RawLog>) -> io::Result<Self> {
        let (commands, received) = sync_channel(4);
        let (sender, events) = sync_channel(WAITING);
        let latest = Arc::new(Mutex::new(Latest::default()));
        let stop = Arc::new(AtomicBool::new(false));
        let clock = Stopwatch::start();
        let name = format!("link-{}", address.protocol);
        let shows_live = protocol.shows_live();
        let mut worker = Worker {
            address,
            protocol,
            received,
            sender,
            latest: Arc::clone(&latest),
            stop: Arc::clone(&stop),
            clock,
            log,
            stillness: Stillness::default(),
            has_answered: false,
        };
        thread::Builder::new().name(name).spawn(move || worker.run())?;
        Ok(Self { commands, events, latest, stop, clock, shows_live })
    }

    /// Asks for a shot; `false` if the thread is gone or does not listen.
    pub(super) fn trigger(&self) -> bool {
        self.commands.try_send(Command::Trigger).is_ok()
    }

    /// Gives the shot under way up.
    pub(super) fn cancel(&self) {
        let _nothing_under_way = self.commands.try_send(Command::Cancel);
    }

    /// What came last.
    pub(super) fn latest(&self) -> Latest {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The same for somebody else.
    pub(super) fn eye(&self) -> Eye {
        Eye { latest: Arc::clone(&self.latest), clock: self.clock, shows_live: self.shows_live }
    }

    /// Time since the start.
    pub(super) fn now(&self) -> Duration {
        self.clock.now()
    }
}

impl Drop for Wire {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Takes all bytes of a wire, as they are.
#[derive(Clone, Debug)]
pub struct RawLog(Arc<Mutex<std::fs::File>>);

impl RawLog {
    /// Writes to `file`.
    pub fn new(file: std::fs::File) -> Self {
        Self(Arc::new(Mutex::new(file)))
    }

    /// One line per piece: time since the start of the wire (s), whose wire, direction, bytes in hexadecimal.
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
        // The log is a help for later; a full disk is no reason to stop measuring.
        let _best_effort = file.write_all(line.as_bytes());
    }
}

/// Why a connection ended.
enum End {
    /// It was lost.
    Lost(Failure),
    /// Nobody wants it any more.
    Stopped,
}

struct Worker {
    address: WireAddress,
    protocol: Box<dyn Protocol>,
    received: Receiver<Command>,
    sender: SyncSender<WireEvent>,
    latest: Arc<Mutex<Latest>>,
    stop: Arc<AtomicBool>,
    clock: Stopwatch,
    log: Option<RawLog>,
    stillness: Stillness,
    /// Something has come over this connection.
    has_answered: bool,
}

impl Worker {
    fn run(&mut self) {
        let mut back_off = BACK_OFF.0;
        while !self.is_stopped() {
            let failure = match self.connect() {
                Ok(mut transport) => match self.talk(transport.as_mut()) {
                    (End::Stopped, _) => return,
                    (End::Lost(failure), was_ready) => {
                        if was_ready {
                            back_off = BACK_OFF.0;
                        }
                        self.ended(failure)
                    }
                },
                Err(error) if error.kind() == io::ErrorKind::Interrupted => return,
                Err(error) => Failure::Unreachable(error.to_string()),
            };
            // What was last seen is not there any more.
            *self.latest.lock().unwrap_or_else(PoisonError::into_inner) = Latest::default();
            if !self.tell(WireEvent::Down(failure)) || !self.pause(back_off) {
                return;
            }
            back_off = (back_off * 2).min(BACK_OFF.1);
        }
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn connect(&self) -> io::Result<Box<dyn Transport>> {
        let stop = Arc::clone(&self.stop);
        transport::connect(&self.address.route, &move || !stop.load(Ordering::Relaxed))
    }

    /// Talks until the connection is lost; says whether it was ever ready.
    fn talk(&mut self, transport: &mut dyn Transport) -> (End, bool) {
        let mut buffer = vec![0; CHUNK];
        let mut was_ready = false;
        self.heard(self.clock.now());
        self.has_answered = false;
        self.protocol.start(self.clock.now());
        loop {
            if self.is_stopped() {
                return (End::Stopped, was_ready);
            }
            match self.turn(transport, &mut buffer, &mut was_ready) {
                Ok(()) => {}
                Err(end) => return (end, was_ready),
            }
        }
    }

    /// One round: commands, deadlines, what is to be sent, what has come, what it means.
    fn turn(&mut self, transport: &mut dyn Transport, buffer: &mut [u8], was_ready: &mut bool) -> Result<(), End> {
        while let Ok(command) = self.received.try_recv() {
            match command {
                Command::Trigger => self.protocol.trigger(self.clock.now()),
                Command::Cancel => self.protocol.cancel(self.clock.now()),
            }
        }
        let disconnected = |error: &io::Error| End::Lost(Failure::Disconnected(error.to_string()));
        while let Some(bytes) = self.protocol.next_output() {
            self.note("out", &bytes);
            transport.write(&bytes).map_err(|error| disconnected(&error))?;
        }
        let now = self.clock.now();
        let until = self.protocol.next_deadline().map_or(READ, |deadline| deadline.saturating_sub(now));
        let read = transport.read(buffer, until.min(READ)).map_err(|error| disconnected(&error));
        let now = self.clock.now();
        if let Ok(count @ 1..) = read
            && let Some(bytes) = buffer.get(..count)
        {
            self.note("in", bytes);
            self.protocol.feed(bytes, now);
            self.heard(now);
            self.has_answered = true;
        }
        self.protocol.tick(now);
        while let Some(event) = self.protocol.next_event() {
            self.pass_on(event, was_ready)?;
        }
        read.map(drop)
    }

    fn heard(&self, now: Duration) {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).heard = Some(now);
    }

    /// Who takes a connection and never says a word is perhaps somebody else.
    fn ended(&self, failure: Failure) -> Failure {
        match (failure, &self.address.route) {
            (Failure::Silent { seconds, .. }, Route::Tcp { .. }) if !self.has_answered => {
                Failure::Foreign(format!("it took the connection, but said nothing for {seconds:.0} s"))
            }
            (failure, _) => failure,
        }
    }

    fn pass_on(&mut self, event: ProtocolEvent, was_ready: &mut bool) -> Result<(), End> {
        let now = self.clock.now();
        let event = match event {
            ProtocolEvent::Ready(identity) => {
                *was_ready = true;
                WireEvent::Up(identity)
            }
            ProtocolEvent::Shot(shot) => WireEvent::Shot(shot),
            ProtocolEvent::Failed(failure) => WireEvent::Failed(failure),
            ProtocolEvent::Offered(shot) => WireEvent::Offered(shot),
            ProtocolEvent::Status(status) => WireEvent::Status(status),
            ProtocolEvent::Live(shot) => {
                self.latest.lock().unwrap_or_else(PoisonError::into_inner).live = Some((now, shot));
                return Ok(());
            }
            ProtocolEvent::Joints(state) => {
                let is_still = self.stillness.feed(&state);
                let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
                (latest.joints, latest.is_still) = (Some((now, state)), is_still);
                return Ok(());
            }
            ProtocolEvent::Lost(failure) => return Err(End::Lost(failure)),
        };
        if self.tell(event) { Ok(()) } else { Err(End::Stopped) }
    }

    /// Sends an event. Remarks are dropped when nobody listens, answers wait; `false` if the wire is not wanted any more.
    fn tell(&self, event: WireEvent) -> bool {
        const AGAIN: Duration = Duration::from_millis(5);
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
            thread::sleep(AGAIN);
        }
    }

    /// Waits before the next try; commands of the meantime have failed. `false` if the wire is not wanted any more.
    fn pause(&self, time: Duration) -> bool {
        let until = self.clock.now() + time;
        while self.clock.now() < until {
            if self.is_stopped() {
                return false;
            }
            if let Ok(Command::Trigger) = self.received.recv_timeout(READ) {
                let failure = Failure::Disconnected("it is being connected again".to_owned());
                if !self.tell(WireEvent::Failed(failure)) {
                    return false;
                }
            }
        }
        true
    }

    fn note(&self, direction: &str, bytes: &[u8]) {
        if let Some(log) = &self.log {
            log.write(self.clock.now(), self.address.protocol, direction, bytes);
        }
    }
}
