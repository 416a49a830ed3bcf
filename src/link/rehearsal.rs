//! A rehearsal over real wires: the simulated cell behind simulated instruments, reached over TCP on this machine or over a
//! pseudo-terminal by the same code as real ones.
//!
//! The clocks of the simulated instruments run [`SPEEDUP`] times faster than real ones, so that a rehearsal does not wait for
//! the motion of a telescope that does not exist.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use nalgebra::Point3;

use super::cell_view::{Advance, CellView, SharedView, check_joints};
use super::serve::{Endpoint, Speedup, serve};
use super::{Link, LinkError, LinkEvent, RawLog, SimulatedCell, Wired, build};
use crate::profile::Profile;
use crate::session::reading::{LiveReading, MeasureRequest, Reading};
use crate::session::simulation::Simulation;
use crate::session::wire::{LinkChoice, WireProtocol};

/// Speed of the simulated instruments' clocks.
const SPEEDUP: Speedup = Speedup(20);

/// A simulated cell over wires.
#[derive(Debug)]
pub struct Rehearsal {
    view: SharedView,
    wired: Wired,
    /// Stops the servers.
    stop: Arc<AtomicBool>,
}

impl Rehearsal {
    /// Serves the cell of a profile over the wires of a simulation and connects to it. `log` records every byte.
    ///
    /// # Errors
    /// As [`SimulatedCell::new`]; an arm that such a controller cannot report; a port or a thread that is not available.
    pub fn new(profile: &Profile, simulation: &Simulation, log: Option<&RawLog>) -> Result<Self, LinkError> {
        let cell = SimulatedCell::new(profile, simulation)?;
        let view = SharedView::new(CellView::new(cell, Advance::OnRequest));
        let stop = Arc::new(AtomicBool::new(false));
        let mut choice = LinkChoice::default();
        let start = |protocol: WireProtocol, is_serial: bool| {
            let endpoint = if is_serial { Endpoint::PseudoTerminal } else { Endpoint::Loopback };
            // The time stamps of the controller order its joint values and the moves of the robot, so its clock runs in real time.
            let speedup = if protocol.is_robot() { Speedup(1) } else { SPEEDUP };
            serve(protocol, &[], &endpoint, view.clone(), speedup, &stop)
        };
        for wire in &simulation.wires {
            let protocol = wire.protocol();
            if protocol.is_robot() {
                check_joints(profile, protocol)?;
            }
            if wire.is_serial() && !protocol.has_serial_lines() {
                return Err(LinkError::SetUp(format!("{protocol} does not use serial lines; use tcp")));
            }
            let address = start(protocol, wire.is_serial())?;
            let known = if protocol.is_robot() { choice.robot.is_some() } else { !choice.address.is_empty() };
            if known {
                return Err(LinkError::SetUp("a rehearsal has one instrument and at most one robot".to_owned()));
            }
            if protocol.is_robot() {
                choice.robot = Some(address);
                choice.robot_options = build::rehearsal_options(protocol);
            } else {
                choice.address = address;
                choice.options = build::rehearsal_options(protocol);
            }
        }
        if choice.address.is_empty() {
            // Only the robot's wire was given. The instrument is the kind of tracker used in the method paper.
            choice.address = start(WireProtocol::Emscon, false)?;
            choice.options = build::rehearsal_options(WireProtocol::Emscon);
        }
        let before_shot = view.clone();
        let wired = Wired::new(&choice, log)?.simulated(Box::new(move || before_shot.lock().advance()));
        Ok(Self { view, wired, stop })
    }
}

impl Rehearsal {
    /// Warnings of the simulated instrument's set-up.
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
        self.view.lock().move_to(request)?;
        let mut reading = self.wired.measure(request, keep_going)?;
        // Time is virtual, as without wires.
        reading.seconds = self.view.lock().cell.time(request, reading.shots);
        Ok(reading)
    }

    fn point(&mut self, at: Point3<f64>, keep_going: &dyn Fn() -> bool) -> Result<(), LinkError> {
        self.wired.point(at, keep_going)
    }

    fn watch(&mut self, wait: Duration) -> Option<(LiveReading, Vec<LinkEvent>)> {
        self.wired.watch(wait)
    }

    fn live_poll(&self) -> Option<super::LivePoll> {
        self.wired.live_poll()
    }
}
