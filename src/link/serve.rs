//! Simulated instruments that are really listening: on a TCP port of this machine or behind a pseudo-terminal.

use std::io::{self, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use serialport::SerialPort as _;

use super::cell_view::{Advance, CellView, SharedView, check_joints};
use super::simulator::{Output, PointSource, Simulator};
use super::transport::{Stopwatch, loopback};
use super::{Link as _, LinkError, SimulatedCell, build};
use crate::profile::Profile;
use crate::session::reading::MeasureRequest;
use crate::session::simulation::Simulation;
use crate::session::wire::WireProtocol;

/// A server looks so often for what is to do.
const LOOK: Duration = Duration::from_millis(2);
/// A peer that does not read for so long is hung up on.
const WRITE: Duration = Duration::from_secs(5);
/// The simulated robot takes this long for a move.
const MOVE: Duration = Duration::from_secs(2);
/// Shots that differ at one place.
const DIFFERENT: u32 = 256;

/// Where a simulator listens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// A free TCP port of this machine.
    Loopback,
    /// This TCP address, such as `127.0.0.1:7000`.
    Tcp(String),
    /// A pseudo-terminal.
    PseudoTerminal,
}

/// How fast a simulated instrument lives: so many of its seconds in one of ours.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace(pub(super) u32);

/// The clock of a simulator.
#[derive(Clone, Copy, Debug)]
struct PacedClock(Stopwatch, Pace);

impl PacedClock {
    fn start(pace: Pace) -> Self {
        Self(Stopwatch::start(), pace)
    }

    fn now(self) -> Duration {
        self.0.now() * self.1.0
    }
}

/// Lets the other end of a protocol listen until `stop`; returns its address, such as `emscon:tcp:127.0.0.1:40123`. `faults`: by
/// their names.
///
/// # Errors
/// [`LinkError::SetUp`]: an unknown fault; the system refuses the port, the pseudo-terminal or a thread.
pub(super) fn serve(
    protocol: WireProtocol,
    faults: &[String],
    place: &Place,
    source: impl PointSource + 'static,
    pace: Pace,
    stop: &Arc<AtomicBool>,
) -> Result<String, LinkError> {
    let simulator = build::simulator(protocol, faults).map_err(LinkError::SetUp)?;
    listen(place, simulator, source, pace, Arc::clone(stop))
        .map(|rest| format!("{protocol}:{rest}"))
        .map_err(|error| LinkError::SetUp(format!("the simulated {protocol} cannot listen: {error}")))
}

/// The same for a simulator; returns the address without its protocol.
fn listen(
    place: &Place,
    simulator: Box<dyn Simulator>,
    source: impl PointSource + 'static,
    pace: Pace,
    stop: Arc<AtomicBool>,
) -> io::Result<String> {
    let (listener, shown) = match place {
        Place::PseudoTerminal => {
            let (master, slave) = serialport::TTYPort::pair()?;
            let device = slave.name().ok_or_else(|| io::Error::other("the pseudo-terminal has no name"))?;
            spawn(move || {
                // The other side is opened by its name; ours stays open so that the line is not torn in between.
                let _held = slave;
                serve_serial(master, simulator, source, pace, &stop);
            })?;
            return Ok(format!("serial:{device}:115200"));
        }
        Place::Loopback => {
            let (listener, port) = loopback()?;
            (listener, format!("tcp:127.0.0.1:{port}"))
        }
        Place::Tcp(address) => {
            let listener = TcpListener::bind(address.as_str())?;
            let bound = listener.local_addr()?;
            (listener, format!("tcp:{bound}"))
        }
    };
    spawn(move || serve_tcp(&listener, simulator, source, pace, &stop))?;
    Ok(shown)
}

fn spawn(work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    thread::Builder::new().name("simulated-link".to_owned()).spawn(work).map(drop)
}

/// Answers one connection after the other.
fn serve_tcp(
    listener: &TcpListener,
    mut simulator: Box<dyn Simulator>,
    mut source: impl PointSource,
    pace: Pace,
    stop: &AtomicBool,
) {
    if listener.set_nonblocking(true).is_err() {
        return;
    }
    let clock = PacedClock::start(pace);
    while !stop.load(Ordering::Relaxed) {
        match listener.accept() {
            Ok((stream, _)) => {
                if stream.set_nonblocking(true).is_ok() && stream.set_nodelay(true).is_ok() {
                    // Whatever ends the connection, the next one is welcome.
                    let _ended = talk(stream, simulator.as_mut(), &mut source, clock, stop);
                }
            }
            Err(_error) => thread::sleep(LOOK),
        }
    }
}

/// Answers one connection until either side hangs up.
fn talk(
    mut stream: TcpStream,
    simulator: &mut dyn Simulator,
    source: &mut impl PointSource,
    clock: PacedClock,
    stop: &AtomicBool,
) -> io::Result<()> {
    let mut buffer = vec![0; 16 * 1024];
    simulator.accept(clock.now());
    while !stop.load(Ordering::Relaxed) {
        let mut is_idle = true;
        match stream.read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(count) => {
                is_idle = false;
                simulator.feed(buffer.get(..count).unwrap_or_default(), source, clock.now());
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) => return Err(error),
        }
        simulator.tick(source, clock.now());
        while let Some(output) = simulator.next_output() {
            is_idle = false;
            match output {
                Output::Bytes(bytes) => {
                    stream.set_nonblocking(false)?;
                    stream.set_write_timeout(Some(WRITE))?;
                    stream.write_all(&bytes)?;
                    stream.set_nonblocking(true)?;
                }
                Output::Close => return Ok(()),
            }
        }
        if is_idle {
            thread::sleep(LOOK);
        }
    }
    Ok(())
}

/// Answers on a serial line; hanging up there means silence.
fn serve_serial(
    mut line: serialport::TTYPort,
    mut simulator: Box<dyn Simulator>,
    mut source: impl PointSource,
    pace: Pace,
    stop: &AtomicBool,
) {
    let clock = PacedClock::start(pace);
    let mut buffer = vec![0; 4096];
    simulator.accept(clock.now());
    if line.set_timeout(LOOK).is_err() {
        return;
    }
    while !stop.load(Ordering::Relaxed) {
        match line.read(&mut buffer) {
            Ok(count) => simulator.feed(buffer.get(..count).unwrap_or_default(), &mut source, clock.now()),
            Err(error) if error.kind() == io::ErrorKind::TimedOut => {}
            Err(_nobody_there) => thread::sleep(LOOK),
        }
        simulator.tick(&mut source, clock.now());
        while let Some(output) = simulator.next_output() {
            match output {
                Output::Bytes(bytes) => {
                    if line.write_all(&bytes).is_err() {
                        return;
                    }
                }
                Output::Close => simulator.accept(clock.now()),
            }
        }
    }
}

/// A simulated instrument or robot that listens until this is dropped, for another program or another window.
#[derive(Debug)]
pub struct Served {
    view: SharedView,
    address: String,
    options: Option<String>,
    robot_title: String,
    number: u64,
    stop: Arc<AtomicBool>,
}

impl Served {
    /// The cell of a profile behind this protocol. `listen`: a TCP address; none: a pseudo-terminal. `faults`: by their names,
    /// see `docs/links.md`.
    ///
    /// # Errors
    /// [`LinkError::SetUp`]: an unknown fault, a cell that cannot be simulated, a port that the system refuses.
    pub fn new(
        profile: &Profile,
        simulation: &Simulation,
        protocol: WireProtocol,
        listen: Option<&str>,
        faults: &[String],
    ) -> Result<Self, LinkError> {
        if protocol.is_robot() {
            check_joints(profile)?;
        }
        if listen.is_none() && matches!(protocol, WireProtocol::Emscon | WireProtocol::Rtde) {
            return Err(LinkError::SetUp(format!(
                "{protocol} is not spoken on serial lines: it needs a TCP address to listen on"
            )));
        }
        let mut cell = SimulatedCell::new(profile, simulation)?;
        let robot_title = cell.connect()?;
        let view = SharedView::new(CellView::new(cell, Advance::EveryShot));
        let stop = Arc::new(AtomicBool::new(false));
        let place = listen.map_or(Place::PseudoTerminal, |address| Place::Tcp(address.to_owned()));
        let address = serve(protocol, faults, &place, view.clone(), Pace(1), &stop)?;
        Ok(Self { view, address, options: build::rehearsal_options(protocol), robot_title, number: 0, stop })
    }

    /// The controller of the same robot listens as well, at this TCP address; returns where.
    ///
    /// # Errors
    /// [`LinkError::SetUp`]: a robot that RTDE cannot tell, or a port that the system refuses.
    pub fn listen_for_robot(&self, profile: &Profile, listen: &str) -> Result<String, LinkError> {
        check_joints(profile)?;
        let place = Place::Tcp(listen.to_owned());
        serve(WireProtocol::Rtde, &[], &place, self.view.clone(), Pace(1), &self.stop)
    }

    /// The address to give to whoever connects.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// The options that go with it, where the usual ones would not do.
    pub fn options(&self) -> Option<&str> {
        self.options.as_deref()
    }

    /// What is simulated, in one line.
    pub fn title(&self) -> &str {
        &self.robot_title
    }

    /// The device, if this listens on a pseudo-terminal.
    pub fn device(&self) -> Option<PathBuf> {
        let rest = self.address.split_once(":serial:")?.1;
        rest.rsplit_once(':').map(|(device, _)| PathBuf::from(device))
    }

    /// The robot moves to a pose, except for the first one, where it is at once.
    ///
    /// # Errors
    /// The configuration (pendant values, rad) is none of this robot.
    pub fn go(&mut self, pose: &str, configuration: &[f64], following: Option<&[f64]>) -> Result<(), LinkError> {
        self.number += 1;
        let request = MeasureRequest {
            number: self.number,
            pose: pose.to_owned(),
            target: 0,
            configuration: configuration.to_vec(),
            following: following.map(<[f64]>::to_vec),
            settle: 0.0,
            shots: DIFFERENT,
        };
        self.view.lock().travel(&request, MOVE)
    }

    /// Shots taken since the robot has been sent here.
    pub fn taken(&self) -> usize {
        self.view.lock().taken()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}
