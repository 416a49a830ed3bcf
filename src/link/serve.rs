//! Servers for simulated instruments, on a TCP port of this machine or behind a pseudo-terminal.

use std::io::{self, Read as _, Write as _};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream, UdpSocket};
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

/// Interval at which a server polls its connection.
const POLL_INTERVAL: Duration = Duration::from_millis(2);
/// The server closes the connection of a peer that does not read for this long.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);
/// Duration of a move of the simulated robot.
const MOVE_DURATION: Duration = Duration::from_secs(2);
/// Number of different shots at one pose; after them the shots repeat.
const DISTINCT_SHOTS: u32 = 256;

/// Endpoint at which a simulator listens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Endpoint {
    /// A free TCP port of this machine.
    Loopback,
    /// This TCP address, such as `127.0.0.1:7000`.
    Tcp(String),
    PseudoTerminal,
}

/// Factor by which the clock of a simulated instrument runs faster than real time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Speedup(pub(super) u32);

/// Clock of a simulator.
#[derive(Clone, Copy, Debug)]
struct ScaledClock {
    real: Stopwatch,
    speedup: Speedup,
}

impl ScaledClock {
    fn start(speedup: Speedup) -> Self {
        Self { real: Stopwatch::start(), speedup }
    }

    fn now(self) -> Duration {
        self.real.now() * self.speedup.0
    }
}

/// Serves the simulator of a protocol until `stop` is set and returns its address, such as `emscon:tcp:127.0.0.1:40123`.
/// `faults` are given by their names.
///
/// # Errors
/// [`LinkError::SetUp`]: an unknown fault, or a port, pseudo-terminal or thread that is not available.
pub(super) fn serve(
    protocol: WireProtocol,
    faults: &[String],
    endpoint: &Endpoint,
    source: impl PointSource + 'static,
    speedup: Speedup,
    stop: &Arc<AtomicBool>,
) -> Result<String, LinkError> {
    let simulator = build::simulator(protocol, faults).map_err(LinkError::SetUp)?;
    if protocol == WireProtocol::Yaskawa {
        let answered = answer(endpoint, simulator, source, speedup, Arc::clone(stop));
        return answered
            .map(|address| format!("{protocol}:udp:{address}"))
            .map_err(|error| LinkError::SetUp(format!("the simulated {protocol} cannot listen: {error}")));
    }
    listen(endpoint, simulator, source, speedup, Arc::clone(stop))
        .map(|rest| format!("{protocol}:{rest}"))
        .map_err(|error| LinkError::SetUp(format!("the simulated {protocol} cannot listen: {error}")))
}

/// Serves a simulator that answers datagrams, and returns its address.
fn answer(
    endpoint: &Endpoint,
    simulator: Box<dyn Simulator>,
    source: impl PointSource + 'static,
    speedup: Speedup,
    stop: Arc<AtomicBool>,
) -> io::Result<SocketAddr> {
    let socket = match endpoint {
        Endpoint::Tcp(address) => UdpSocket::bind(address.as_str())?,
        Endpoint::Loopback | Endpoint::PseudoTerminal => UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?,
    };
    let address = socket.local_addr()?;
    spawn(move || serve_datagrams(&socket, simulator, source, speedup, &stop))?;
    Ok(address)
}

/// Serves a simulator and returns the address without the protocol.
fn listen(
    endpoint: &Endpoint,
    simulator: Box<dyn Simulator>,
    source: impl PointSource + 'static,
    speedup: Speedup,
    stop: Arc<AtomicBool>,
) -> io::Result<String> {
    let mut simulator = simulator;
    let (listener, address) = match endpoint {
        Endpoint::PseudoTerminal => {
            let (master, slave) = serialport::TTYPort::pair()?;
            let device = slave.name().ok_or_else(|| io::Error::other("the pseudo-terminal has no name"))?;
            spawn(move || {
                // The client opens the slave side by its name. Holding it open here keeps the line up between clients.
                let _held = slave;
                serve_serial(master, simulator, source, speedup, &stop);
            })?;
            return Ok(format!("serial:{device}:115200"));
        }
        Endpoint::Loopback => {
            let (listener, port) = loopback()?;
            (listener, format!("tcp:127.0.0.1:{port}"))
        }
        Endpoint::Tcp(address) => {
            let listener = TcpListener::bind(address.as_str())?;
            let bound = listener.local_addr()?;
            (listener, format!("tcp:{bound}"))
        }
    };
    let mut listeners = vec![listener];
    if simulator.wants_second_port() {
        let address = listeners.iter().find_map(|listener| listener.local_addr().ok());
        let host = address.map_or(IpAddr::V4(Ipv4Addr::LOCALHOST), |address| address.ip());
        let second = TcpListener::bind((host, 0))?;
        simulator.second_port(second.local_addr()?.port());
        listeners.push(second);
    }
    spawn(move || serve_tcp(&listeners, simulator, source, speedup, &stop))?;
    Ok(address)
}

fn spawn(work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    thread::Builder::new().name("simulated-link".to_owned()).spawn(work).map(drop)
}

/// Serves datagrams of one peer after the other.
fn serve_datagrams(
    socket: &UdpSocket,
    mut simulator: Box<dyn Simulator>,
    mut source: impl PointSource,
    speedup: Speedup,
    stop: &AtomicBool,
) {
    let clock = ScaledClock::start(speedup);
    let mut buffer = vec![0; 4096];
    let mut peer = None;
    if socket.set_read_timeout(Some(POLL_INTERVAL)).is_err() {
        return;
    }
    while !stop.load(Ordering::Relaxed) {
        if let Ok((count, from)) = socket.recv_from(&mut buffer) {
            if peer != Some(from) {
                simulator.accept(clock.now());
                peer = Some(from);
            }
            simulator.feed(buffer.get(..count).unwrap_or_default(), &mut source, clock.now());
        }
        simulator.tick(&mut source, clock.now());
        while let Some(output) = simulator.next_output() {
            if let (Output::Bytes(bytes), Some(peer)) = (output, peer) {
                // A peer that has gone is served again when it comes back.
                let _sent = socket.send_to(&bytes, peer);
            }
        }
    }
}

/// Serves one connection after the other, on any of the listeners.
fn serve_tcp(
    listeners: &[TcpListener],
    mut simulator: Box<dyn Simulator>,
    mut source: impl PointSource,
    speedup: Speedup,
    stop: &AtomicBool,
) {
    if listeners.iter().any(|listener| listener.set_nonblocking(true).is_err()) {
        return;
    }
    let clock = ScaledClock::start(speedup);
    while !stop.load(Ordering::Relaxed) {
        match listeners.iter().find_map(|listener| listener.accept().ok()) {
            Some((stream, _)) => {
                if stream.set_nonblocking(true).is_ok() && stream.set_nodelay(true).is_ok() {
                    // However the connection ends, the next one is accepted.
                    let _ended = talk(stream, simulator.as_mut(), &mut source, clock, stop);
                }
            }
            None => thread::sleep(POLL_INTERVAL),
        }
    }
}

/// Serves one connection until either side closes it.
fn talk(
    mut stream: TcpStream,
    simulator: &mut dyn Simulator,
    source: &mut impl PointSource,
    clock: ScaledClock,
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
                    stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
                    stream.write_all(&bytes)?;
                    stream.set_nonblocking(true)?;
                }
                Output::Close => return Ok(()),
            }
        }
        if is_idle {
            thread::sleep(POLL_INTERVAL);
        }
    }
    Ok(())
}

/// Serves a serial line. It cannot be closed like a connection, so a simulator that hangs up starts again at once.
fn serve_serial(
    mut line: serialport::TTYPort,
    mut simulator: Box<dyn Simulator>,
    mut source: impl PointSource,
    speedup: Speedup,
    stop: &AtomicBool,
) {
    let clock = ScaledClock::start(speedup);
    let mut buffer = vec![0; 4096];
    simulator.accept(clock.now());
    if line.set_timeout(POLL_INTERVAL).is_err() {
        return;
    }
    while !stop.load(Ordering::Relaxed) {
        match line.read(&mut buffer) {
            Ok(count) => simulator.feed(buffer.get(..count).unwrap_or_default(), &mut source, clock.now()),
            Err(error) if error.kind() == io::ErrorKind::TimedOut => {}
            Err(_no_client) => thread::sleep(POLL_INTERVAL),
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

/// A simulated instrument or robot for another program; it listens until this is dropped.
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
    /// Serves the cell of a profile by a protocol, at a TCP address or, without one, behind a pseudo-terminal. `faults` are given
    /// by their names, see `docs/links.md`.
    ///
    /// # Errors
    /// [`LinkError::SetUp`]: an unknown fault, a cell that cannot be simulated, or a port that is not available.
    pub fn new(
        profile: &Profile,
        simulation: &Simulation,
        protocol: WireProtocol,
        listen: Option<&str>,
        faults: &[String],
    ) -> Result<Self, LinkError> {
        if protocol.is_robot() {
            check_joints(profile, protocol)?;
        }
        if listen.is_none() && !protocol.has_serial_lines() {
            return Err(LinkError::SetUp(format!("{protocol} does not use serial lines; it needs a TCP address")));
        }
        let mut cell = SimulatedCell::new(profile, simulation)?;
        let robot_title = cell.connect()?;
        let view = SharedView::new(CellView::new(cell, Advance::EveryShot));
        let stop = Arc::new(AtomicBool::new(false));
        let endpoint = listen.map_or(Endpoint::PseudoTerminal, |address| Endpoint::Tcp(address.to_owned()));
        let address = serve(protocol, faults, &endpoint, view.clone(), Speedup(1), &stop)?;
        Ok(Self { view, address, options: build::rehearsal_options(protocol), robot_title, number: 0, stop })
    }

    /// Serves the controller of the same robot as well, and returns its address and the options that a client needs. `listen` is a TCP address, with the protocol in front
    /// unless it is RTDE, such as `kuka:127.0.0.1:7000`.
    ///
    /// # Errors
    /// [`LinkError::SetUp`]: a robot that the protocol cannot report, or a port that is not available.
    pub fn listen_for_robot(&self, profile: &Profile, listen: &str) -> Result<(String, Option<String>), LinkError> {
        let named = WireProtocol::ALL
            .into_iter()
            .filter(|protocol| protocol.is_robot())
            .find_map(|protocol| Some((protocol, listen.strip_prefix(protocol.name())?.strip_prefix(':')?)));
        let (protocol, listen) = named.unwrap_or((WireProtocol::Rtde, listen));
        check_joints(profile, protocol)?;
        let endpoint = Endpoint::Tcp(listen.to_owned());
        let address = serve(protocol, &[], &endpoint, self.view.clone(), Speedup(1), &self.stop)?;
        Ok((address, build::rehearsal_options(protocol)))
    }

    /// Address for the client.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Options that the client needs, if the defaults do not fit.
    pub fn options(&self) -> Option<&str> {
        self.options.as_deref()
    }

    /// Description of the simulated cell, in one line.
    pub fn title(&self) -> &str {
        &self.robot_title
    }

    /// Device of the pseudo-terminal, if it uses one.
    pub fn device(&self) -> Option<PathBuf> {
        let rest = self.address.split_once(":serial:")?.1;
        rest.rsplit_once(':').map(|(device, _)| PathBuf::from(device))
    }

    /// Moves the robot to a pose. It is at the first pose at once.
    ///
    /// # Errors
    /// The configuration (pendant values, rad) does not fit the robot.
    pub fn go(&mut self, pose: &str, configuration: &[f64], following: Option<&[f64]>) -> Result<(), LinkError> {
        self.number += 1;
        let request = MeasureRequest {
            number: self.number,
            pose: pose.to_owned(),
            target: 0,
            configuration: configuration.to_vec(),
            following: following.map(<[f64]>::to_vec),
            settle: 0.0,
            shots: DISTINCT_SHOTS,
        };
        self.view.lock().start_move(&request, MOVE_DURATION)
    }

    /// Shots taken since the last move.
    pub fn taken(&self) -> usize {
        self.view.lock().taken()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}
