//! A rehearsal over real wires: the simulated cell behind simulated instruments, spoken to over TCP on this machine or over a
//! pseudo-terminal, by the same code that speaks to the real ones.
//!
//! The simulated instruments live [`PACE`] times faster than real ones, so that nobody waits for a telescope that is not there.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::cell_view::{Advance, CellView, SharedView, check_joints};
use super::serve::{Pace, Place, serve};
use super::{Link, LinkError, LinkNews, RawLog, SimulatedCell, Wired, build};
use crate::profile::Profile;
use crate::session::reading::{LiveReading, MeasureRequest, Reading};
use crate::session::simulation::Simulation;
use crate::session::wire::{LinkChoice, WireProtocol};

/// Seconds of a simulated instrument in one of ours.
const PACE: Pace = Pace(20);

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
    /// The cell of a profile behind the wires of a simulation. `log` takes every byte that goes over them.
    ///
    /// # Errors
    /// As [`SimulatedCell::new`]; the arm cannot be shown by such a controller; the system refuses a port or a thread.
    pub fn new(profile: &Profile, simulation: &Simulation, log: Option<&RawLog>) -> Result<Self, LinkError> {
        let cell = SimulatedCell::new(profile, simulation)?;
        let view = SharedView::new(CellView::new(cell, Advance::Told));
        let stop = Arc::new(AtomicBool::new(false));
        let mut choice = LinkChoice::default();
        let mut has_robot = false;
        let start = |protocol: WireProtocol, is_serial: bool| {
            let place = if is_serial { Place::PseudoTerminal } else { Place::Loopback };
            // The controller's own clock says when the robot stood where: it is not hurried.
            let pace = if protocol.is_robot() { Pace(1) } else { PACE };
            serve(protocol, &[], &place, view.clone(), pace, &stop)
        };
        for wire in &simulation.wires {
            let protocol = wire.protocol();
            if protocol.is_robot() {
                check_joints(profile)?;
            }
            if wire.is_serial() && matches!(protocol, WireProtocol::Emscon | WireProtocol::Rtde) {
                return Err(LinkError::SetUp(format!("{protocol} is not spoken on serial lines; use tcp")));
            }
            let address = start(protocol, wire.is_serial())?;
            let known = if protocol.is_robot() { choice.robot.is_some() } else { !choice.address.is_empty() };
            if known {
                return Err(LinkError::SetUp("a rehearsal has one instrument and at most one robot".to_owned()));
            }
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
            choice.address = start(WireProtocol::Emscon, false)?;
            choice.options = build::rehearsal_options(WireProtocol::Emscon);
        }
        let before_shot = view.clone();
        let wired = Wired::new(&choice, log)?.simulated(Box::new(move || before_shot.lock().advance()));
        Ok(Self { view, wired, has_robot, stop })
    }
}

impl Rehearsal {
    /// What the simulated instrument warned of in its set-up.
    pub fn warnings(&self) -> Vec<String> {
        self.wired.warnings()
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
        let since = self.view.lock().go(request)?;
        self.wired.robot_moved(since);
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

    fn eye(&self) -> Option<super::Look> {
        self.wired.eye()
    }
}
