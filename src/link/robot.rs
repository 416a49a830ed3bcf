//! A robot's controller on a wire without an instrument beside it: to look whether it tells its joint angles.

use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use super::protocol::{CONTROLLER, Failure, Identity};
use super::wire::{RawLog, Wire, WireEvent};
use super::{LinkError, LinkNews, build};
use crate::session::reading::LiveReading;
use crate::session::wire::WireAddress;

/// Longest time until it tells its joints.
const SET_UP: Duration = Duration::from_secs(15);
/// A wait looks so often whether it is still wanted.
const LOOK: Duration = Duration::from_millis(50);
/// What is older than this is not now.
const FRESH: Duration = Duration::from_secs(1);
/// Events taken at once.
const AT_ONCE: usize = 1024;

/// A robot's controller on a wire.
#[derive(Debug)]
pub struct WiredRobot {
    wire: Wire,
    identity: Option<Identity>,
    down: Option<Failure>,
    /// Why it does not move on, as told last.
    stopped: Option<String>,
}

impl WiredRobot {
    /// The controller at an address. `log` takes every byte.
    ///
    /// # Errors
    /// [`LinkError::SetUp`]: no address of a robot, an option that cannot be, no thread.
    pub fn new(address: &WireAddress, options: Option<&str>, log: Option<&RawLog>) -> Result<Self, LinkError> {
        if !address.protocol.is_robot() {
            return Err(LinkError::SetUp(format!("'{address}' is no robot; 'rtde:HOST' is one")));
        }
        let protocol = build::protocol(address, options).map_err(LinkError::SetUp)?;
        let wire = Wire::start(address.clone(), protocol, log.cloned())
            .map_err(|error| LinkError::SetUp(format!("the link cannot be started: {error}")))?;
        Ok(Self { wire, identity: None, down: None, stopped: None })
    }

    /// Waits until it tells its joints, while it is wanted.
    ///
    /// # Errors
    /// [`LinkError::Controller`]: it does not, and why; [`LinkError::Cancelled`].
    pub fn connect_while(
        &mut self,
        keep_going: &dyn Fn() -> bool,
        told: &mut dyn FnMut(LinkNews),
    ) -> Result<Identity, LinkError> {
        let until = self.wire.now() + SET_UP;
        loop {
            let (live, news) = self.watch(LOOK);
            news.into_iter().filter(|one| matches!(one, LinkNews::Status(_))).for_each(&mut *told);
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
                let what = "joint angles were awaited".to_owned();
                return Err(LinkError::Controller(Failure::Silent { what, seconds: SET_UP.as_secs_f64() }));
            }
        }
    }

    /// Its joints now, and what has happened; takes up to `wait`.
    pub fn watch(&mut self, wait: Duration) -> (LiveReading, Vec<LinkNews>) {
        let mut news = Vec::new();
        let until = self.wire.now() + wait;
        for _ in 0..AT_ONCE {
            match self.wire.events.recv_timeout(until.saturating_sub(self.wire.now())) {
                Ok(WireEvent::Up(identity)) => {
                    self.down = None;
                    news.push(LinkNews::Up(identity.name.clone()));
                    self.identity = Some(identity);
                }
                Ok(WireEvent::Down(failure)) => {
                    news.push(LinkNews::Down(failure.words(CONTROLLER)));
                    self.down = Some(failure);
                }
                Ok(WireEvent::Status(status)) => news.push(LinkNews::Status(status.text)),
                Ok(WireEvent::Shot(_) | WireEvent::Failed(_) | WireEvent::Offered(_)) => {}
                Err(RecvTimeoutError::Timeout) => break,
                Err(RecvTimeoutError::Disconnected) => {
                    self.down = Some(Failure::Disconnected("the link has ended".to_owned()));
                    break;
                }
            }
        }
        let (latest, now) = (self.wire.latest(), self.wire.now());
        let fresh = latest.joints.filter(|(at, _)| now.saturating_sub(*at) <= FRESH).map(|(_, state)| state);
        let stopped = fresh.as_ref().and_then(|state| state.stopped.clone());
        if stopped != self.stopped {
            news.extend(stopped.clone().map(|why| LinkNews::Status(format!("it does not move on: {why}"))));
            self.stopped = stopped;
        }
        let live = LiveReading {
            seconds: now.as_secs_f64(),
            point: None,
            is_blind: true,
            silent: None,
            is_still: Some(latest.is_still && fresh.is_some()),
            joints: fresh.map(|state| state.positions),
            down: self.down.as_ref().map(|failure| failure.words(CONTROLLER)),
        };
        (live, news)
    }
}
