//! A robot's controller on a wire without an instrument, to test whether it reports joint angles.

use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use super::cell_view::check_joints;
use super::protocol::{CONTROLLER, Failure, Identity};
use super::wire::{RawLog, Wire, WireEvent};
use super::wired::{joints_timeout, link_ended};
use super::{LinkError, LinkEvent, build};
use crate::profile::Profile;
use crate::session::reading::LiveReading;
use crate::session::wire::WireAddress;

/// Longest wait for the first joint values.
const SET_UP_TIMEOUT: Duration = Duration::from_secs(15);
/// Interval at which a wait checks whether it was cancelled.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Age up to which joint values count as current.
const MAX_AGE: Duration = Duration::from_secs(1);
/// Most events handled per poll.
const MAX_EVENTS_PER_POLL: usize = 1024;

/// A robot's controller on a wire.
#[derive(Debug)]
pub struct WiredRobot {
    wire: Wire,
    identity: Option<Identity>,
    down: Option<Failure>,
    /// Reason of the stop that was reported last.
    stopped: Option<String>,
}

impl WiredRobot {
    /// The controller at an address. `log` records every byte.
    ///
    /// # Errors
    /// [`LinkError::SetUp`]: not an address of a robot, an invalid option, or a thread that cannot be started.
    pub fn new(address: &WireAddress, options: Option<&str>, log: Option<&RawLog>) -> Result<Self, LinkError> {
        let address = &WireAddress::of_robot(&address.to_string()).map_err(LinkError::SetUp)?;
        let protocol = build::protocol(address, options).map_err(LinkError::SetUp)?;
        let wire = Wire::start(address.clone(), protocol, log.cloned())
            .map_err(|error| LinkError::SetUp(format!("cannot start the link: {error}")))?;
        Ok(Self { wire, identity: None, down: None, stopped: None })
    }

    /// The controller of an arm: what the profile knows about it is added to the options.
    ///
    /// # Errors
    /// As [`Self::new`], and an arm that the controller cannot report.
    pub fn for_arm(
        profile: &Profile,
        address: &WireAddress,
        options: Option<&str>,
        log: Option<&RawLog>,
    ) -> Result<Self, LinkError> {
        check_joints(profile, address.protocol)?;
        Self::new(address, build::robot_options(profile, address.protocol, options).as_deref(), log)
    }

    /// Waits until the controller reports joint values. Messages of the set-up go to `on_event`.
    ///
    /// # Errors
    /// [`LinkError::Controller`] if it does not, and [`LinkError::Cancelled`].
    pub fn connect_while(
        &mut self,
        keep_going: &dyn Fn() -> bool,
        on_event: &mut dyn FnMut(LinkEvent),
    ) -> Result<Identity, LinkError> {
        let until = self.wire.now() + SET_UP_TIMEOUT;
        loop {
            let (live, events) = self.watch(POLL_INTERVAL);
            events.into_iter().filter(|event| matches!(event, LinkEvent::Notice(_))).for_each(&mut *on_event);
            if let Some(failure) = &self.down {
                return Err(LinkError::Controller(failure.clone()));
            }
            if let Some(identity) = self.identity.as_ref().filter(|_| live.joints.is_some()) {
                return Ok(identity.clone());
            }
            if !keep_going() {
                return Err(LinkError::Cancelled);
            }
            if self.wire.now() > until {
                return Err(LinkError::Controller(joints_timeout(SET_UP_TIMEOUT)));
            }
        }
    }

    /// The current joint values and the events since the last call; waits up to `wait`.
    pub fn watch(&mut self, wait: Duration) -> (LiveReading, Vec<LinkEvent>) {
        let mut events = Vec::new();
        let until = self.wire.now() + wait;
        for _ in 0..MAX_EVENTS_PER_POLL {
            match self.wire.events.recv_timeout(until.saturating_sub(self.wire.now())) {
                Ok(WireEvent::Up(identity)) => {
                    self.down = None;
                    events.push(LinkEvent::Up(identity.name.clone()));
                    self.identity = Some(identity);
                }
                Ok(WireEvent::Down(failure)) => {
                    events.push(LinkEvent::Down(failure.message(CONTROLLER)));
                    self.down = Some(failure);
                }
                Ok(WireEvent::Status(status)) => events.push(LinkEvent::Notice(status.text)),
                Ok(WireEvent::Shot(_) | WireEvent::Failed(_) | WireEvent::Offered(_) | WireEvent::Pointed) => {}
                Err(RecvTimeoutError::Timeout) => break,
                Err(RecvTimeoutError::Disconnected) => {
                    self.down = Some(link_ended());
                    break;
                }
            }
        }
        let (latest, now) = (self.wire.latest(), self.wire.now());
        let current = latest.joints.filter(|(at, _)| now.saturating_sub(*at) <= MAX_AGE).map(|(_, state)| state);
        let stopped = current.as_ref().and_then(|state| state.stopped.clone());
        if stopped != self.stopped {
            events.extend(stopped.clone().map(|why| LinkEvent::Notice(format!("it is stopped: {why}"))));
            self.stopped = stopped;
        }
        let live = LiveReading {
            seconds: now.as_secs_f64(),
            point: None,
            is_blind: true,
            silent: None,
            is_still: Some(latest.is_still && current.is_some()),
            joints: current.map(|state| state.positions),
            down: self.down.as_ref().map(|failure| failure.message(CONTROLLER)),
        };
        (live, events)
    }
}
