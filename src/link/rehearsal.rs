//! A rehearsal over real wires: the simulated cell behind simulated instruments, spoken to over TCP on this machine or over a
//! pseudo-terminal, by the same code that speaks to the real ones.

use std::io::{self, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use nalgebra::Point3;

use super::protocol::{JointState, Shot};
use super::simulator::{Output, PointSource, Simulator};
use super::transport::{Stopwatch, loopback};
use super::{Link, LinkError, LinkNews, SimulatedCell, Wired, build};
use crate::profile::Profile;
use crate::session::reading::{LiveReading, MeasureRequest, Reading};
use crate::session::simulation::Simulation;
use crate::session::wire::{LinkChoice, WireProtocol};

/// A server looks so often for what is to do.
const LOOK: Duration = Duration::from_millis(2);

/// The cell as an instrument and a robot's controller see it.
#[derive(Debug)]
pub(super) struct CellView {
    cell: SimulatedCell,
    /// What is measured now.
    request: Option<MeasureRequest>,
    /// The shots of it; none: the beam is broken.
    shots: Vec<Shot>,
    /// Which of them is next.
    at: usize,
    clock: Stopwatch,
}

impl CellView {
    pub(super) fn new(cell: SimulatedCell) -> Self {
        Self { cell, request: None, shots: Vec::new(), at: 0, clock: Stopwatch::start() }
    }

    /// The robot has been moved; what is measured from now on belongs to this.
    ///
    /// # Errors
    /// The request is none for this cell.
    pub(super) fn go(&mut self, request: &MeasureRequest) -> Result<(), LinkError> {
        self.shots = match self.cell.shots(request) {
            Ok(shots) => shots,
            Err(LinkError::BeamBroken) => Vec::new(),
            Err(error) => return Err(error),
        };
        self.at = 0;
        self.request = Some(request.clone());
        Ok(())
    }

    /// Another shot is asked for.
    fn advance(&mut self) {
        self.at += 1;
    }

    /// The next shot: the same until somebody asks for another one.
    fn shown(&self) -> Option<&Shot> {
        let index = self.at.saturating_sub(1).checked_rem(self.shots.len())?;
        self.shots.get(index)
    }
}

/// A view that several threads look through.
#[derive(Clone, Debug)]
pub(super) struct SharedView(pub(super) Arc<Mutex<CellView>>);

impl SharedView {
    pub(super) fn lock(&self) -> MutexGuard<'_, CellView> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl PointSource for SharedView {
    fn shot(&mut self) -> Option<Shot> {
        self.lock().shown().cloned()
    }

    fn look(&mut self) -> Option<Shot> {
        self.lock().shown().cloned()
    }

    fn joints(&mut self) -> JointState {
        let view = self.lock();
        let positions = view.request.as_ref().map_or_else(Vec::new, |request| view.cell.standing(request));
        // A controller of six joints tells six, whatever the arm.
        let mut positions = positions;
        positions.resize(JOINTS, 0.0);
        JointState {
            speeds: Some(vec![0.0; positions.len()]),
            positions,
            controller_time: view.clock.now().as_secs_f64(),
            stopped: None,
        }
    }
}

/// Joints that RTDE tells.
const JOINTS: usize = 6;

/// A simulated cell over wires.
#[derive(Debug)]
pub struct Rehearsal {
    view: SharedView,
    wired: Wired,
    has_robot: bool,
    /// Ends the servers.
    stop: Arc<AtomicBool>,
}

impl Rehearsal {
    /// The cell of a profile behind these wires.
    ///
    /// # Errors
    /// As [`SimulatedCell::new`]; the arm cannot be shown by such a controller; the system refuses a port or a thread.
    pub fn new(profile: &Profile, simulation: &Simulation) -> Result<Self, LinkError> {
        let cell = SimulatedCell::new(profile, simulation)?;
        let view = SharedView(Arc::new(Mutex::new(CellView::new(cell))));
        let stop = Arc::new(AtomicBool::new(false));
        let mut choice = LinkChoice::default();
        let mut has_robot = false;
        for wire in &simulation.wires {
            let protocol = wire.protocol();
            if protocol.is_robot() && profile.chain().dof() != JOINTS {
                let message = format!("'{}' has {} joints; RTDE tells {JOINTS}", profile.name(), profile.chain().dof());
                return Err(LinkError::SetUp(message));
            }
            let simulator = build::simulator(protocol, &[]).map_err(LinkError::SetUp)?;
            let place = serve(wire.is_serial(), simulator, view.clone(), Arc::clone(&stop))
                .map_err(|error| LinkError::SetUp(format!("the simulated {protocol} cannot listen: {error}")))?;
            let address = format!("{protocol}:{place}");
            if protocol.is_robot() {
                has_robot = true;
                choice.robot = Some(address);
            } else {
                choice.address = address;
                choice.options = build::rehearsal_options(protocol);
            }
        }
        if choice.address.is_empty() {
            // Only the robot is on a wire: the tracker speaks the language of the method paper's.
            let simulator = build::simulator(WireProtocol::Emscon, &[]).map_err(LinkError::SetUp)?;
            let place = serve(false, simulator, view.clone(), Arc::clone(&stop))
                .map_err(|error| LinkError::SetUp(format!("the simulated tracker cannot listen: {error}")))?;
            choice.address = format!("{}:{place}", WireProtocol::Emscon);
            choice.options = build::rehearsal_options(WireProtocol::Emscon);
        }
        let before_shot = view.clone();
        let wired = Wired::new(&choice, None)?.simulated(Box::new(move || before_shot.lock().advance()));
        Ok(Self { view, wired, has_robot, stop })
    }
}

impl Drop for Rehearsal {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

impl Link for Rehearsal {
    fn connect(&mut self) -> Result<String, LinkError> {
        let cell = self.view.lock().cell.connect()?;
        Ok(format!("{cell}; over a wire: {}", self.wired.connect()?))
    }

    fn measure(&mut self, request: &MeasureRequest, keep_going: &dyn Fn() -> bool) -> Result<Reading, LinkError> {
        self.view.lock().go(request)?;
        let mut reading = self.wired.measure(request, keep_going)?;
        // Time is virtual, as without a wire.
        reading.seconds = self.view.lock().cell.time(request, reading.shots);
        if !self.has_robot {
            reading.configuration = None;
        }
        Ok(reading)
    }

    fn watch(&mut self, wait: Duration) -> Option<(LiveReading, Vec<LinkNews>)> {
        self.wired.watch(wait)
    }
}

/// Serves a simulator on this machine until `stop`; returns the rest of its address.
fn serve(
    is_serial: bool,
    simulator: Box<dyn Simulator>,
    source: SharedView,
    stop: Arc<AtomicBool>,
) -> io::Result<String> {
    if is_serial {
        let (master, slave) = serialport::TTYPort::pair()?;
        let device =
            serialport::SerialPort::name(&slave).ok_or_else(|| io::Error::other("the pseudo-terminal has no name"))?;
        spawn(move || {
            // The other side is opened by its name; ours stays open so that the line is not torn in between.
            let _held = slave;
            serve_serial(master, simulator, source, &stop);
        })?;
        return Ok(format!("serial:{device}:115200"));
    }
    let (listener, port) = loopback()?;
    spawn(move || serve_tcp(&listener, simulator, source, &stop))?;
    Ok(format!("tcp:127.0.0.1:{port}"))
}

fn spawn(work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    thread::Builder::new().name("simulated-link".to_owned()).spawn(work).map(drop)
}

/// Answers one connection after the other.
pub(super) fn serve_tcp(
    listener: &TcpListener,
    mut simulator: Box<dyn Simulator>,
    mut source: impl PointSource,
    stop: &AtomicBool,
) {
    if listener.set_nonblocking(true).is_err() {
        return;
    }
    while !stop.load(Ordering::Relaxed) {
        match listener.accept() {
            Ok((stream, _)) => {
                if stream.set_nonblocking(true).is_ok() && stream.set_nodelay(true).is_ok() {
                    // Whatever ends the connection, the next one is welcome.
                    let _ended = talk(stream, simulator.as_mut(), &mut source, stop);
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
    stop: &AtomicBool,
) -> io::Result<()> {
    let clock = Stopwatch::start();
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
                    stream.set_write_timeout(Some(Duration::from_secs(5)))?;
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
pub(super) fn serve_serial(
    mut line: serialport::TTYPort,
    mut simulator: Box<dyn Simulator>,
    mut source: impl PointSource,
    stop: &AtomicBool,
) {
    use serialport::SerialPort as _;

    let clock = Stopwatch::start();
    let mut buffer = vec![0; 4096];
    simulator.accept(clock.now());
    if line.set_timeout(LOOK).is_err() {
        return;
    }
    while !stop.load(Ordering::Relaxed) {
        if let Ok(count) = line.read(&mut buffer) {
            simulator.feed(buffer.get(..count).unwrap_or_default(), &mut source, clock.now());
        } else {
            thread::sleep(LOOK);
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

impl SimulatedCell {
    /// The shots of a measurement, one by one, as an instrument gives them.
    ///
    /// # Errors
    /// As [`Link::measure`] of this cell.
    pub(super) fn shots(&mut self, request: &MeasureRequest) -> Result<Vec<Shot>, LinkError> {
        let (points, sigma) = self.single_shots(request)?;
        let sigma = (sigma > 0.0).then_some([sigma; 3]);
        Ok(points.into_iter().map(|point| Shot { sigma, ..Shot::bare(Point3::from(point)) }).collect())
    }
}
