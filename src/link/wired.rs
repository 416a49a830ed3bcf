//! Instruments on a wire: measurements by way of a protocol, with the checks that every point must pass.

use std::collections::VecDeque;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use nalgebra::{Point3, Vector3};

use super::cell_view::check_joints;
use super::protocol::rest::{JointMean, JointWatch, Unrest};
use super::protocol::{CONTROLLER, Failure, Identity, Severity, Shot, Status, known_sigma};
use super::wire::{Latest, RawLog, Wire, WireEvent, WireMonitor};
use super::{Link, LinkError, LinkEvent, build};
use crate::profile::Profile;
use crate::session::reading::{JointScatter, LiveReading, MeasureRequest, Reading, Remark};
use crate::session::wire::{LinkChoice, WireAddress};
use crate::units::to_mm;

/// Longest duration of a set-up: trackers take more than a minute to initialise.
const SET_UP_TIMEOUT: Duration = Duration::from_mins(2);
/// Longest duration of a shot; protocols fail earlier by their own limits.
const SHOT_TIMEOUT: Duration = Duration::from_mins(2);
/// Attempts per shot; only a transient failure is retried.
const SHOT_ATTEMPTS: u32 = 3;
/// Pause before a retry.
const RETRY_PAUSE: Duration = Duration::from_secs(2);
/// Pause before a retry with a simulated instrument.
const SIMULATED_RETRY_PAUSE: Duration = Duration::from_millis(100);
/// Longest wait until the instrument has turned to a place and has searched there.
const TURN_TIMEOUT: Duration = Duration::from_secs(90);
/// Longest wait until the robot is at rest.
const REST_TIMEOUT: Duration = Duration::from_secs(20);
/// Longest wait until a simulated robot is at rest.
const SIMULATED_REST_TIMEOUT: Duration = Duration::from_secs(2);
/// Longest wait for a joint state after the last shot; slow controllers report once per second.
const NEWER_JOINTS_TIMEOUT: Duration = Duration::from_secs(3);
/// Age up to which a value counts as current.
const MAX_AGE: Duration = Duration::from_secs(1);
/// Interval at which a wait checks whether it was cancelled.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Interval at which the joint values are polled.
const JOINT_POLL_INTERVAL: Duration = Duration::from_millis(5);
/// Most events handled per poll; the rest waits for the next one.
const MAX_EVENTS_PER_POLL: usize = 1024;
/// A shot is unstable if its stated standard deviation exceeds the usual one by this factor and also [`UNSTABLE_SIGMA`].
const UNSTABLE_FACTOR: f64 = 3.0;
/// A stated standard deviation below this is never unstable (m).
const UNSTABLE_SIGMA: f64 = 0.05e-3;
/// Fewest shots from which the usual standard deviation is known.
const FEWEST_SIGMAS: usize = 5;
/// Number of latest shots from which the usual standard deviation is taken.
const SIGMA_HISTORY: usize = 256;
/// Shortest distance that any instrument measures (m).
const NEAREST: f64 = 0.05;
/// Longest distance that any instrument measures (m).
const FARTHEST: f64 = 100.0;

/// An instrument on a wire, and the robot's controller on another wire if it reports joint angles.
pub struct Wired {
    instrument: Wire,
    address: String,
    robot: Option<Wire>,
    identity: Option<Identity>,
    /// Why the link to the instrument is down.
    down: Option<Failure>,
    robot_down: Option<Failure>,
    events: Vec<LinkEvent>,
    /// Standard deviations stated for the latest shots (m), newest last.
    sigmas: VecDeque<f64>,
    /// The previous point with its number, if it has one: an instrument that is stuck repeats it.
    previous_point: Option<(Point3<f64>, Option<u32>)>,
    /// Set for a simulated instrument.
    before_shot: Option<BeforeShot>,
    joints: JointRecord,
    /// Whether the instrument has turned to where it was sent last.
    has_pointed: bool,
}

/// Joint values of the measurement in progress.
#[derive(Debug, Default)]
struct JointRecord {
    watch: JointWatch,
    /// Start of the measurement, by the clock of the robot's wire.
    since: Duration,
    /// Arrival of the latest state of the measurement, by the same clock.
    latest: Option<Duration>,
}

/// Called before each triggered shot.
type BeforeShot = Box<dyn FnMut() + Send>;

impl std::fmt::Debug for Wired {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Wired")
            .field("address", &self.address)
            .field("identity", &self.identity)
            .finish_non_exhaustive()
    }
}

impl Wired {
    /// The instrument of a choice. `log` records every byte.
    ///
    /// # Errors
    /// [`LinkError::SetUp`]: an invalid address or option, or a thread that cannot be started.
    pub fn new(choice: &LinkChoice, log: Option<&RawLog>) -> Result<Self, LinkError> {
        let address: WireAddress = choice.address.parse().map_err(LinkError::SetUp)?;
        if address.protocol.is_robot() {
            let message = format!("'{address}' is a robot controller: it reports joint angles, not SMR positions");
            return Err(LinkError::SetUp(message));
        }
        let robot = choice.robot.as_deref().map(WireAddress::of_robot).transpose().map_err(LinkError::SetUp)?;
        let start = |address: WireAddress, options: Option<&str>| {
            let protocol = build::protocol(&address, options).map_err(LinkError::SetUp)?;
            Wire::start(address, protocol, log.cloned())
                .map_err(|error| LinkError::SetUp(format!("cannot start the link: {error}")))
        };
        let name = address.to_string();
        let instrument = start(address, choice.options.as_deref())?;
        Ok(Self::over(name, instrument, robot.map(|robot| start(robot, choice.robot_options.as_deref())).transpose()?))
    }

    /// The instrument of a choice in front of an arm: what the profile knows about its controller is added to the options.
    ///
    /// # Errors
    /// As [`Self::new`], and an arm that the controller cannot report.
    pub fn for_arm(profile: &Profile, choice: &LinkChoice, log: Option<&RawLog>) -> Result<Self, LinkError> {
        Self::check_arm(profile, choice)?;
        let robot = choice.robot.as_deref().map(WireAddress::of_robot).transpose().map_err(LinkError::SetUp)?;
        let robot_options =
            robot.and_then(|robot| build::robot_options(profile, robot.protocol, choice.robot_options.as_deref()));
        Self::new(&LinkChoice { robot_options, ..choice.clone() }, log)
    }

    /// Checks that the robot's controller of a choice, if any, can report the joints of this arm.
    ///
    /// # Errors
    /// [`LinkError::SetUp`]: the numbers of joints differ.
    pub fn check_arm(profile: &Profile, choice: &LinkChoice) -> Result<(), LinkError> {
        match &choice.robot {
            None => Ok(()),
            Some(robot) => {
                let address = WireAddress::of_robot(robot).map_err(LinkError::SetUp)?;
                check_joints(profile, address.protocol)
            }
        }
    }

    /// An instrument on a wire that was started already.
    pub(super) fn over(address: String, instrument: Wire, robot: Option<Wire>) -> Self {
        Self {
            instrument,
            address,
            robot,
            identity: None,
            down: None,
            robot_down: None,
            events: Vec::new(),
            sigmas: VecDeque::new(),
            previous_point: None,
            before_shot: None,
            joints: JointRecord::default(),
            has_pointed: false,
        }
    }

    /// Marks the instrument as simulated: nothing has to settle, and `before_shot` is called before each triggered shot.
    #[must_use]
    pub(super) fn simulated(mut self, before_shot: BeforeShot) -> Self {
        self.before_shot = Some(before_shot);
        self
    }

    /// Identity of the instrument, once it is connected.
    pub const fn identity(&self) -> Option<&Identity> {
        self.identity.as_ref()
    }

    /// Warnings of the instrument's set-up.
    pub fn warnings(&self) -> Vec<String> {
        self.identity.as_ref().map(|identity| identity.warnings.clone()).unwrap_or_default()
    }

    /// Handles the events of both wires for up to `wait`; returns early with the answer to a trigger.
    fn drain(&mut self, wait: Duration) -> Option<Result<Shot, Failure>> {
        if let Some(robot) = &self.robot {
            while let Ok(event) = robot.events.try_recv() {
                match event {
                    WireEvent::Up(identity) => {
                        self.robot_down = None;
                        self.events.push(LinkEvent::Up(format!("robot: {}", identity.name)));
                    }
                    WireEvent::Down(failure) => {
                        self.events.push(LinkEvent::Down(format!("robot: {}", failure.message(CONTROLLER))));
                        self.robot_down = Some(failure);
                    }
                    WireEvent::Status(status) => self.events.push(LinkEvent::Notice(format!("robot: {}", status.text))),
                    WireEvent::Shot(_) | WireEvent::Failed(_) | WireEvent::Offered(_) | WireEvent::Pointed => {}
                }
            }
            for (at, state) in robot.take_joints() {
                if at >= self.joints.since {
                    self.joints.latest = Some(at);
                    self.joints.watch.feed(&state);
                }
            }
        }
        let until = self.instrument.now() + wait;
        // The limit ends the loop even if events arrive faster than they are handled.
        for _ in 0..MAX_EVENTS_PER_POLL {
            let left = until.saturating_sub(self.instrument.now());
            let event = match self.instrument.events.recv_timeout(left) {
                Ok(event) => event,
                Err(RecvTimeoutError::Timeout) => return None,
                Err(RecvTimeoutError::Disconnected) => {
                    self.down = Some(link_ended());
                    return Some(Err(link_ended()));
                }
            };
            match event {
                WireEvent::Up(identity) => {
                    self.down = None;
                    self.events.push(LinkEvent::Up(identity.name.clone()));
                    if !identity.warnings.is_empty() {
                        // Of several messages the screen would show only the last.
                        self.events.push(LinkEvent::Notice(identity.warnings.join("; ")));
                    }
                    self.identity = Some(identity);
                }
                WireEvent::Down(failure) => {
                    self.events.push(LinkEvent::Down(failure.to_string()));
                    self.down = Some(failure.clone());
                    return Some(Err(failure));
                }
                WireEvent::Shot(shot) => return Some(Ok(shot)),
                WireEvent::Failed(failure) => return Some(Err(failure)),
                WireEvent::Pointed => {
                    self.has_pointed = true;
                    return None;
                }
                WireEvent::Offered(_) => {
                    let text = "a measurement triggered at the instrument itself was ignored".to_owned();
                    self.events.push(LinkEvent::Notice(text));
                }
                WireEvent::Status(status) if status.severity == Severity::Warning => {
                    self.events.push(LinkEvent::Notice(status.text));
                }
                WireEvent::Status(_) => {}
            }
        }
        None
    }

    /// Turns the instrument to a place in its own frame (m) and waits until it has found the reflector there.
    ///
    /// # Errors
    /// The instrument cannot be turned, or it has found nothing.
    fn turn(&mut self, at: Point3<f64>, keep_going: &dyn Fn() -> bool) -> Result<(), LinkError> {
        drop(self.drain(Duration::ZERO));
        self.check_up()?;
        self.has_pointed = false;
        if !self.instrument.point(at) {
            let text = "the link does not accept commands".to_owned();
            return Err(LinkError::Instrument(Failure::Disconnected(text)));
        }
        let until = self.instrument.now() + TURN_TIMEOUT;
        loop {
            if let Some(Err(failure)) = self.drain(POLL_INTERVAL) {
                return Err(LinkError::Instrument(failure));
            }
            if self.has_pointed {
                return Ok(());
            }
            if !keep_going() {
                self.instrument.cancel();
                return Err(LinkError::Cancelled);
            }
            if self.instrument.now() > until {
                self.instrument.cancel();
                let seconds = TURN_TIMEOUT.as_secs_f64();
                return Err(LinkError::Instrument(Failure::Silent { what: "turning to the SMR".to_owned(), seconds }));
            }
        }
    }

    /// Waits for `time`; fails if it is cancelled or the link is lost.
    fn pause(&mut self, time: Duration, keep_going: &dyn Fn() -> bool) -> Result<(), LinkError> {
        let until = self.instrument.now() + time;
        while self.instrument.now() < until {
            if !keep_going() {
                return Err(LinkError::Cancelled);
            }
            if let Some(Err(failure)) = self.drain(POLL_INTERVAL.min(until.saturating_sub(self.instrument.now()))) {
                return Err(LinkError::Instrument(failure));
            }
        }
        Ok(())
    }

    /// Waits until the robot is at rest, if there is one. Values received before this call do not count.
    fn await_rest(&mut self, keep_going: &dyn Fn() -> bool) -> Result<(), LinkError> {
        let Some(robot) = &self.robot else { return Ok(()) };
        self.joints = JointRecord { since: robot.now(), ..JointRecord::default() };
        let limit = if self.before_shot.is_some() { SIMULATED_REST_TIMEOUT } else { REST_TIMEOUT };
        let until = self.instrument.now() + limit;
        loop {
            match self.joints.watch.joints() {
                Ok(_) => return Ok(()),
                Err(why @ Unrest::Stopped(_)) => return Err(unrest(why)),
                Err(Unrest::NotYetAtRest | Unrest::Moved) => {}
            }
            if self.instrument.now() > until {
                return Err(match self.joints.latest {
                    Some(_) => LinkError::Robot(format!("it is still moving after {} s", limit.as_secs())),
                    None => LinkError::Controller(joints_timeout(limit)),
                });
            }
            self.await_joint_states(keep_going)?;
        }
    }

    /// Waits until a joint state has arrived that is newer than the last shot: a robot that moved during it would otherwise go
    /// unnoticed.
    fn await_newer_joints(&mut self, keep_going: &dyn Fn() -> bool) -> Result<(), LinkError> {
        let Some(robot) = &self.robot else { return Ok(()) };
        let end = robot.now();
        let until = self.instrument.now() + NEWER_JOINTS_TIMEOUT;
        while self.joints.latest.is_none_or(|latest| latest < end) {
            if self.instrument.now() > until {
                return Err(LinkError::Controller(joints_timeout(NEWER_JOINTS_TIMEOUT)));
            }
            self.await_joint_states(keep_going)?;
        }
        Ok(())
    }

    /// Waits for further joint states for a moment.
    fn await_joint_states(&mut self, keep_going: &dyn Fn() -> bool) -> Result<(), LinkError> {
        if !keep_going() {
            return Err(LinkError::Cancelled);
        }
        drop(self.drain(JOINT_POLL_INTERVAL));
        self.check_up()
    }

    /// Fails if either link is down. A measurement must not be queued meanwhile: it would fire unexpectedly after the reconnect.
    fn check_up(&self) -> Result<(), LinkError> {
        if let Some(failure) = &self.down {
            return Err(LinkError::Instrument(failure.clone()));
        }
        self.robot_down.clone().map_or(Ok(()), |failure| Err(LinkError::Controller(failure)))
    }

    /// One shot that passes all checks; transient failures are retried.
    fn shot(&mut self, keep_going: &dyn Fn() -> bool) -> Result<Shot, LinkError> {
        let pause = if self.before_shot.is_some() { SIMULATED_RETRY_PAUSE } else { RETRY_PAUSE };
        for attempts_left in (0..SHOT_ATTEMPTS).rev() {
            match self.one_shot(keep_going)? {
                Ok(shot) => return Ok(shot),
                Err(failure) if failure.is_transient() && attempts_left > 0 => self.pause(pause, keep_going)?,
                Err(failure) => return Err(LinkError::Instrument(failure)),
            }
        }
        Err(LinkError::Instrument(Failure::Unstable(format!("{SHOT_ATTEMPTS} attempts failed"))))
    }

    fn one_shot(&mut self, keep_going: &dyn Fn() -> bool) -> Result<Result<Shot, Failure>, LinkError> {
        // Discard late answers to earlier triggers.
        drop(self.drain(Duration::ZERO));
        if let Some(failure) = &self.down {
            return Ok(Err(failure.clone()));
        }
        if let Some(before_shot) = &mut self.before_shot {
            before_shot();
        }
        if !self.instrument.trigger() {
            return Ok(Err(Failure::Disconnected("the link does not accept commands".to_owned())));
        }
        let until = self.instrument.now() + SHOT_TIMEOUT;
        loop {
            match self.drain(POLL_INTERVAL) {
                Some(Ok(shot)) => return Ok(self.checked(shot)),
                Some(Err(failure)) => return Ok(Err(failure)),
                None => {}
            }
            if !keep_going() {
                self.instrument.cancel();
                return Err(LinkError::Cancelled);
            }
            if self.instrument.now() > until {
                self.instrument.cancel();
                return Ok(Err(Failure::Silent { what: "measuring".to_owned(), seconds: SHOT_TIMEOUT.as_secs_f64() }));
            }
        }
    }

    /// Rejects points that no instrument can have measured, and unstable ones.
    fn checked(&mut self, shot: Shot) -> Result<Shot, Failure> {
        // Instruments state 0 for an unknown standard deviation.
        let shot = Shot { sigma: shot.sigma.and_then(known_sigma), ..shot };
        let point = shot.point;
        let sigma = shot.sigma.map(|[x, y, z]| (x * x + y * y + z * z).sqrt());
        if let (Some(sigma), Some(usual)) = (sigma, self.usual_sigma())
            && sigma > (UNSTABLE_FACTOR * usual).max(UNSTABLE_SIGMA)
        {
            let (sigma, usual) = (to_mm(sigma), to_mm(usual));
            return Err(Failure::Unstable(format!("its stated sigma is {sigma:.3} mm, usually {usual:.3} mm")));
        }
        check_possible(&point)?;
        let numbered = (point, shot.sequence);
        if self.previous_point == Some(numbered) {
            return Err(Failure::Repeated);
        }
        self.previous_point = Some(numbered);
        self.sigmas.extend(sigma);
        while self.sigmas.len() > SIGMA_HISTORY {
            self.sigmas.pop_front();
        }
        Ok(shot)
    }

    /// Median of the standard deviations stated so far (m), once there are enough.
    fn usual_sigma(&self) -> Option<f64> {
        let mut sorted: Vec<f64> = self.sigmas.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().filter(|_| sorted.len() >= FEWEST_SIGMAS)
    }

    /// The current live view.
    fn live(&self) -> LiveReading {
        LiveReading { down: self.down.as_ref().map(ToString::to_string), ..self.monitors().live() }
    }

    fn monitors(&self) -> Monitors {
        Monitors {
            instrument: self.instrument.monitor.clone(),
            robot: self.robot.as_ref().map(|robot| robot.monitor.clone()),
        }
    }
}

/// Monitors of both wires.
struct Monitors {
    instrument: WireMonitor,
    robot: Option<WireMonitor>,
}

impl Monitors {
    fn live(&self) -> LiveReading {
        let now = self.instrument.now();
        let Latest { live, heard, .. } = self.instrument.latest();
        let is_current = |now: Duration, at: Duration| now.saturating_sub(at) <= MAX_AGE;
        let robot = self.robot.as_ref().map(|robot| (robot.latest(), robot.now()));
        let joints = robot.as_ref().and_then(|(latest, now)| {
            let (at, state) = latest.joints.as_ref()?;
            is_current(*now, *at).then(|| state.positions.clone())
        });
        LiveReading {
            seconds: now.as_secs_f64(),
            point: live.filter(|(at, _)| is_current(now, *at)).map(|(_, shot)| shot.point),
            is_blind: !self.instrument.shows_live,
            silent: heard
                .filter(|at| self.instrument.shows_live && !is_current(now, *at))
                .map(|at| now.saturating_sub(at).as_secs_f64()),
            is_still: robot.as_ref().map(|(latest, _)| latest.is_still && joints.is_some()),
            joints,
            down: None,
        }
    }
}

impl Link for Wired {
    fn connect(&mut self) -> Result<String, LinkError> {
        self.connect_while(&|| true, &mut |_| ())
    }

    fn measure(&mut self, request: &MeasureRequest, keep_going: &dyn Fn() -> bool) -> Result<Reading, LinkError> {
        let began = self.instrument.now();
        // Discard late answers to earlier triggers.
        drop(self.drain(Duration::ZERO));
        self.check_up()?;
        self.await_rest(keep_going)?;
        if self.before_shot.is_none() {
            self.pause(Duration::try_from_secs_f64(request.settle).unwrap_or_default(), keep_going)?;
        }
        let count = request.shots.max(1);
        let shots = (0..count).map(|_| self.shot(keep_going)).collect::<Result<Vec<Shot>, _>>()?;
        self.await_newer_joints(keep_going)?;
        let joints = if self.robot.is_some() { Some(self.joints.watch.joints().map_err(unrest)?) } else { None };
        let mut reading = mean(&shots, joints, self.instrument.now().saturating_sub(began).as_secs_f64());
        let of_robot = self.joints.watch.remarks().iter().map(|text| format!("robot: {text}"));
        reading.remarks.extend(of_robot.map(|text| Remark { text, is_warning: false }));
        Ok(reading)
    }

    fn point(&mut self, at: Point3<f64>, keep_going: &dyn Fn() -> bool) -> Result<(), LinkError> {
        self.turn(at, keep_going)
    }

    fn watch(&mut self, wait: Duration) -> Option<(LiveReading, Vec<LinkEvent>)> {
        // An answer here is a late one: no shot was requested.
        drop(self.drain(wait));
        Some((self.live(), std::mem::take(&mut self.events)))
    }

    fn live_poll(&self) -> Option<super::LivePoll> {
        let monitors = self.monitors();
        Some(Box::new(move || monitors.live()))
    }
}

impl Wired {
    /// As [`Link::connect`], but can be cancelled and passes messages of the set-up, such as a laser that is warming up, to
    /// `on_event`.
    ///
    /// # Errors
    /// As [`Link::connect`], and [`LinkError::Cancelled`].
    pub fn connect_while(
        &mut self,
        keep_going: &dyn Fn() -> bool,
        on_event: &mut dyn FnMut(LinkEvent),
    ) -> Result<String, LinkError> {
        let until = self.instrument.now() + SET_UP_TIMEOUT;
        let mut last_message = None;
        while self.identity.is_none() {
            let answer = self.drain(POLL_INTERVAL);
            if self.identity.is_some() {
                break;
            }
            for event in self.events.drain(..) {
                if let LinkEvent::Notice(text) = &event {
                    last_message = Some(text.clone());
                    on_event(event);
                }
            }
            if let Some(Err(failure)) = answer {
                return Err(LinkError::Instrument(in_set_up(failure)));
            }
            if !keep_going() {
                return Err(LinkError::Cancelled);
            }
            if self.instrument.now() > until {
                let seconds = SET_UP_TIMEOUT.as_secs_f64();
                return Err(LinkError::Instrument(match last_message {
                    Some(text) => Failure::NotReady(format!("{text}; gave up after {seconds:.0} s")),
                    None => Failure::Silent { what: format!("setting up '{}'", self.address), seconds },
                }));
            }
        }
        if self.robot.is_some() {
            self.await_joints(until)?;
        }
        // The line below repeats the messages of the set-up.
        self.events.clear();
        let identity = self.identity.clone().unwrap_or_default();
        let reflector = identity.reflector.map_or_else(String::new, |reflector| {
            format!(", reflector {} (offset {:.3} mm)", reflector.name, reflector.offset * 1e3)
        });
        let robot = if self.robot.is_some() { "; the robot reports its joint angles" } else { "" };
        let mut description = format!("{}{reflector}{robot}", identity.name);
        for remark in identity.warnings.iter().chain(&identity.notes) {
            description.push_str("; ");
            description.push_str(remark);
        }
        Ok(description)
    }
}

/// A peer that hangs up during the set-up is perhaps another device.
fn in_set_up(failure: Failure) -> Failure {
    match failure {
        Failure::Disconnected(why) => {
            Failure::Disconnected(format!("{why}, during the set-up: check the kind of instrument and the port"))
        }
        other => other,
    }
}

/// Rejects coordinates that no instrument can have measured.
fn check_possible(point: &Point3<f64>) -> Result<(), Failure> {
    let unusable = |reason: String| Err(Failure::Unusable(reason));
    if !point.coords.iter().all(|value| value.is_finite()) {
        return unusable("a coordinate is not a number".to_owned());
    }
    if point.coords.amax() <= f64::EPSILON {
        return unusable("it is 0, 0, 0".to_owned());
    }
    let distance = point.coords.norm();
    if !(NEAREST..=FARTHEST).contains(&distance) {
        return unusable(format!("it is {distance:.3} m away; instruments measure from {NEAREST} to {FARTHEST} m"));
    }
    Ok(())
}

impl Wired {
    /// Waits until the robot reports joint values.
    fn await_joints(&mut self, until: Duration) -> Result<(), LinkError> {
        loop {
            drop(self.drain(POLL_INTERVAL));
            if let Some(failure) = &self.robot_down {
                return Err(LinkError::Controller(failure.clone()));
            }
            if self.robot.as_ref().is_none_or(|robot| robot.latest().joints.is_some()) {
                return Ok(());
            }
            if self.instrument.now() > until {
                return Err(LinkError::Controller(joints_timeout(SET_UP_TIMEOUT)));
            }
        }
    }
}

/// The controller answers but does not report joint angles.
pub(super) fn joints_timeout(waited: Duration) -> Failure {
    Failure::Silent { what: "waiting for joint angles".to_owned(), seconds: waited.as_secs_f64() }
}

/// The thread of the link has ended.
pub(super) fn link_ended() -> Failure {
    Failure::Disconnected("the link has ended".to_owned())
}

/// Why the joint values of a measurement cannot be used, as an error.
fn unrest(why: Unrest) -> LinkError {
    LinkError::Robot(match why {
        Unrest::NotYetAtRest => "it has not come to rest".to_owned(),
        Unrest::Moved => "it moved during the measurement".to_owned(),
        Unrest::Stopped(state) => format!("it is stopped: {state}"),
    })
}

/// The mean of shots with its scatter, and its σ where every shot states one.
fn mean(shots: &[Shot], joints: Option<&JointMean>, seconds: f64) -> Reading {
    let count = shots.len().max(1) as f64;
    let mean = shots.iter().map(|shot| shot.point.coords).sum::<Vector3<f64>>() / count;
    let square = shots.iter().map(|shot| (shot.point.coords - mean).norm_squared()).sum::<f64>() / count;
    let variances: Option<Vec<f64>> =
        shots.iter().map(|shot| shot.sigma.map(|[x, y, z]| (x * x + y * y + z * z) / 3.0)).collect();
    let sigma = variances.map(|variances| (variances.iter().sum::<f64>() / count / count).sqrt());
    Reading {
        point: Point3::from(mean),
        sigma: sigma.filter(|sigma| *sigma > 0.0),
        scatter: (shots.len() > 1).then(|| square.sqrt()),
        shots: u32::try_from(shots.len()).unwrap_or(u32::MAX),
        temperature: shots.iter().find_map(|shot| shot.temperature),
        pressure: shots.iter().find_map(|shot| shot.pressure),
        humidity: shots.iter().find_map(|shot| shot.humidity),
        configuration: joints.map(|joints| joints.mean.clone()),
        joint_scatter: joints.and_then(|joints| Some(JointScatter { sigma: joints.scatter()?, count: joints.count })),
        remarks: remarks(shots),
        seconds,
    }
}

/// The remarks on shots, each once; of some that concerns only a part of the shots, with their number.
fn remarks(shots: &[Shot]) -> Vec<Remark> {
    let mut found: Vec<(&Status, usize)> = Vec::new();
    for status in shots.iter().flat_map(|shot| &shot.remarks) {
        match found.iter_mut().find(|(known, _)| *known == status) {
            Some((_, count)) => *count += 1,
            None => found.push((status, 1)),
        }
    }
    let all = shots.len();
    let text = |status: &Status, count: usize| match count {
        count if count == all => status.text.clone(),
        count => format!("{} ({count} of {all} shots)", status.text),
    };
    let remark = |(status, count): (&Status, usize)| Remark {
        text: text(status, count),
        is_warning: status.severity == Severity::Warning,
    };
    found.into_iter().map(remark).collect()
}
