//! Instruments on a wire: what the wizard asks for, in the words of a protocol, with the gates that every point passes.

use std::collections::VecDeque;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use nalgebra::{Point3, Vector3};

use super::cell_view::check_joints;
use super::protocol::{CONTROLLER, Failure, Identity, JointState, Severity, Shot, known_sigma};
use super::wire::{Eye, Latest, RawLog, Wire, WireEvent};
use super::{Link, LinkError, LinkNews, build};
use crate::profile::Profile;
use crate::session::reading::{LiveReading, MeasureRequest, Reading};
use crate::session::wire::{LinkChoice, WireAddress};
use crate::units::to_mm;

/// Longest time of a set-up: trackers initialise for more than a minute.
const SET_UP: Duration = Duration::from_mins(2);
/// Longest time for a shot; protocols answer earlier by their own limits.
const SHOT: Duration = Duration::from_mins(2);
/// A reading that was not steady is tried so often in all, with this pause between.
const TRIES: (u32, Duration) = (3, Duration::from_secs(2));
/// The same pause where the instrument is a simulated one.
const SIMULATED_PAUSE: Duration = Duration::from_millis(100);
/// The robot comes to rest within this.
const REST: Duration = Duration::from_secs(20);
/// A simulated one within this.
const SIMULATED_REST: Duration = Duration::from_secs(2);
/// What is older than this is not now.
const FRESH: Duration = Duration::from_secs(1);
/// A wait looks so often whether it is still wanted.
const LOOK: Duration = Duration::from_millis(50);
/// So often for the joints of the robot.
const LOOK_AT_JOINTS: Duration = Duration::from_millis(5);
/// Events taken at once: the rest waits for the next look.
const AT_ONCE: usize = 1024;
/// A shot is not steady if it states so many times the usual standard deviation, and more than this (m), once there are so many
/// shots to tell what is usual.
const UNSTEADY: (f64, f64, usize) = (3.0, 0.05e-3, 5);
/// So many shots tell what is usual.
const USUAL: usize = 256;
/// No instrument measures nearer or farther (m).
const RANGE: (f64, f64) = (0.05, 100.0);

/// An instrument on a wire, and the robot's controller on another if it tells its joint angles.
pub struct Wired {
    instrument: Wire,
    address: String,
    robot: Option<Wire>,
    identity: Option<Identity>,
    /// Why the instrument cannot be asked.
    down: Option<Failure>,
    robot_down: Option<Failure>,
    news: Vec<LinkNews>,
    /// Standard deviations that the instrument has stated for the shots so far (m), the newest last.
    sigmas: VecDeque<f64>,
    /// The shot before this one: an instrument that is stuck gives the same again.
    before: Option<Point3<f64>>,
    /// For a simulated instrument: told before every shot.
    before_shot: Option<BeforeShot>,
    /// For a simulated robot: what it told before this is of the place before (s, its own clock).
    robot_since: f64,
}

/// Told before a shot is asked for.
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
    /// The instrument of a choice. `log` takes every byte.
    ///
    /// # Errors
    /// [`LinkError::SetUp`]: an address or an option that cannot be; the system refuses a thread.
    pub fn new(choice: &LinkChoice, log: Option<&RawLog>) -> Result<Self, LinkError> {
        let address: WireAddress = choice.address.parse().map_err(LinkError::SetUp)?;
        if address.protocol.is_robot() {
            let message = format!("'{address}' is a robot: it tells where it stands, but not where the SMR is");
            return Err(LinkError::SetUp(message));
        }
        let robot = choice.robot.as_deref().map(str::parse::<WireAddress>).transpose().map_err(LinkError::SetUp)?;
        if let Some(robot) = robot.as_ref().filter(|robot| !robot.protocol.is_robot()) {
            return Err(LinkError::SetUp(format!("'{robot}' is no robot; 'rtde:HOST' is one")));
        }
        let start = |address: WireAddress, options: Option<&str>| {
            let protocol = build::protocol(&address, options).map_err(LinkError::SetUp)?;
            Wire::start(address, protocol, log.cloned())
                .map_err(|error| LinkError::SetUp(format!("the link cannot be started: {error}")))
        };
        let shown = address.to_string();
        let instrument = start(address, choice.options.as_deref())?;
        Ok(Self::over(shown, instrument, robot.map(|robot| start(robot, None)).transpose()?))
    }

    /// Whether the robot's controller of a choice, if there is one, can tell the joints of this arm.
    ///
    /// # Errors
    /// [`LinkError::SetUp`]: it tells more or fewer.
    pub fn check_arm(profile: &Profile, choice: &LinkChoice) -> Result<(), LinkError> {
        if choice.robot.is_some() { check_joints(profile) } else { Ok(()) }
    }

    /// An instrument on a wire that is there already.
    pub(super) const fn over(address: String, instrument: Wire, robot: Option<Wire>) -> Self {
        Self {
            instrument,
            address,
            robot,
            identity: None,
            down: None,
            robot_down: None,
            news: Vec::new(),
            sigmas: VecDeque::new(),
            before: None,
            before_shot: None,
            robot_since: f64::NEG_INFINITY,
        }
    }

    /// The same for a simulated instrument, where nothing has to settle and which is told of every shot.
    #[must_use]
    pub(super) fn simulated(mut self, before_shot: BeforeShot) -> Self {
        self.before_shot = Some(before_shot);
        self
    }

    /// A simulated robot stands elsewhere since then (s, its own clock).
    pub(super) const fn robot_moved(&mut self, since: f64) {
        self.robot_since = since;
    }

    /// Who answers, once it does.
    pub const fn identity(&self) -> Option<&Identity> {
        self.identity.as_ref()
    }

    /// What it warned of in its set-up.
    pub fn warnings(&self) -> Vec<String> {
        self.identity.as_ref().map(|identity| identity.warnings.clone()).unwrap_or_default()
    }

    /// Takes what has happened; an answer to a trigger is given back.
    fn drain(&mut self, wait: Duration) -> Option<Result<Shot, Failure>> {
        if let Some(robot) = &self.robot {
            while let Ok(event) = robot.events.try_recv() {
                match event {
                    WireEvent::Up(identity) => {
                        self.robot_down = None;
                        self.news.push(LinkNews::Up(format!("robot: {}", identity.name)));
                    }
                    WireEvent::Down(failure) => {
                        self.news.push(LinkNews::Down(format!("robot: {}", failure.words(CONTROLLER))));
                        self.robot_down = Some(failure);
                    }
                    WireEvent::Status(status) => self.news.push(LinkNews::Status(format!("robot: {}", status.text))),
                    WireEvent::Shot(_) | WireEvent::Failed(_) | WireEvent::Offered(_) => {}
                }
            }
        }
        let until = self.instrument.now() + wait;
        // However much comes, this ends.
        for _ in 0..AT_ONCE {
            let left = until.saturating_sub(self.instrument.now());
            let event = match self.instrument.events.recv_timeout(left) {
                Ok(event) => event,
                Err(RecvTimeoutError::Timeout) => return None,
                Err(RecvTimeoutError::Disconnected) => {
                    self.down = Some(Failure::Disconnected("the link has ended".to_owned()));
                    return Some(Err(Failure::Disconnected("the link has ended".to_owned())));
                }
            };
            match event {
                WireEvent::Up(identity) => {
                    self.down = None;
                    self.news.push(LinkNews::Up(identity.name.clone()));
                    if !identity.warnings.is_empty() {
                        // One message: of several only the last would be seen.
                        self.news.push(LinkNews::Status(identity.warnings.join("; ")));
                    }
                    self.identity = Some(identity);
                }
                WireEvent::Down(failure) => {
                    self.news.push(LinkNews::Down(failure.to_string()));
                    self.down = Some(failure.clone());
                    return Some(Err(failure));
                }
                WireEvent::Shot(shot) => return Some(Ok(shot)),
                WireEvent::Failed(failure) => return Some(Err(failure)),
                WireEvent::Offered(_) => {
                    let text = "somebody has measured at the instrument itself; the point was not taken".to_owned();
                    self.news.push(LinkNews::Status(text));
                }
                WireEvent::Status(status) if status.severity == Severity::Warning => {
                    self.news.push(LinkNews::Status(status.text));
                }
                WireEvent::Status(_) => {}
            }
        }
        None
    }

    /// Waits for `time`, or until it is not wanted any more.
    fn pause(&mut self, time: Duration, keep_going: &dyn Fn() -> bool) -> Result<(), LinkError> {
        let until = self.instrument.now() + time;
        while self.instrument.now() < until {
            if !keep_going() {
                return Err(LinkError::Cancelled);
            }
            if let Some(Err(failure)) = self.drain(LOOK.min(until.saturating_sub(self.instrument.now()))) {
                return Err(LinkError::Instrument(failure));
            }
        }
        Ok(())
    }

    /// The joints of the robot once it stands, if it tells them; as they arrived from now on.
    fn standing(&mut self, keep_going: &dyn Fn() -> bool) -> Result<Option<Vec<f64>>, LinkError> {
        if self.robot.is_none() {
            return Ok(None);
        }
        let rest = if self.before_shot.is_some() { SIMULATED_REST } else { REST };
        let until = self.instrument.now() + rest;
        let since = self.robot.as_ref().map_or(Duration::ZERO, Wire::now);
        loop {
            let Some(robot) = &self.robot else { return Ok(None) };
            let (latest, now) = (robot.latest(), robot.now());
            let is_fresh = |(at, state): &(Duration, JointState)| {
                *at >= since && now.saturating_sub(*at) <= FRESH && state.controller_time > self.robot_since
            };
            let fresh = latest.joints.filter(is_fresh);
            if let Some((_, state)) = &fresh {
                if let Some(why) = &state.stopped {
                    return Err(LinkError::Robot(format!("it does not move on: {why}")));
                }
                if latest.is_still {
                    return Ok(Some(state.positions.clone()));
                }
            }
            if !keep_going() {
                return Err(LinkError::Cancelled);
            }
            if self.instrument.now() > until {
                return Err(if fresh.is_some() {
                    LinkError::Robot(format!("it still moves after {} s", rest.as_secs()))
                } else {
                    LinkError::Controller(no_joints(rest))
                });
            }
            drop(self.drain(LOOK_AT_JOINTS));
            self.is_up()?;
        }
    }

    /// Whether both ends can be asked. Who waited for a link that is down would measure once it is back, when nobody expects
    /// it any more.
    fn is_up(&self) -> Result<(), LinkError> {
        if let Some(failure) = &self.down {
            return Err(LinkError::Instrument(failure.clone()));
        }
        self.robot_down.clone().map_or(Ok(()), |failure| Err(LinkError::Controller(failure)))
    }

    /// One shot that passes the gates; what is not steady is tried again.
    fn shot(&mut self, keep_going: &dyn Fn() -> bool) -> Result<Shot, LinkError> {
        let pause = if self.before_shot.is_some() { SIMULATED_PAUSE } else { TRIES.1 };
        for left in (0..TRIES.0).rev() {
            match self.one_shot(keep_going)? {
                Ok(shot) => return Ok(shot),
                Err(failure) if failure.is_transient() && left > 0 => self.pause(pause, keep_going)?,
                Err(failure) => return Err(LinkError::Instrument(failure)),
            }
        }
        Err(LinkError::Instrument(Failure::Unstable("tried several times".to_owned())))
    }

    fn one_shot(&mut self, keep_going: &dyn Fn() -> bool) -> Result<Result<Shot, Failure>, LinkError> {
        // Nothing that came before this is an answer to it.
        drop(self.drain(Duration::ZERO));
        if let Some(failure) = &self.down {
            return Ok(Err(failure.clone()));
        }
        if let Some(before_shot) = &mut self.before_shot {
            before_shot();
        }
        if !self.instrument.trigger() {
            return Ok(Err(Failure::Disconnected("the link does not take orders".to_owned())));
        }
        let until = self.instrument.now() + SHOT;
        loop {
            match self.drain(LOOK) {
                Some(Ok(shot)) => return Ok(self.gate(shot)),
                Some(Err(failure)) => return Ok(Err(failure)),
                None => {}
            }
            if !keep_going() {
                self.instrument.cancel();
                return Err(LinkError::Cancelled);
            }
            if self.instrument.now() > until {
                self.instrument.cancel();
                return Ok(Err(Failure::Silent { what: "measuring".to_owned(), seconds: SHOT.as_secs_f64() }));
            }
        }
    }

    /// What every point must be, whoever gave it.
    fn gate(&mut self, shot: Shot) -> Result<Shot, Failure> {
        // Whoever states 0 does not know.
        let shot = Shot { sigma: shot.sigma.and_then(known_sigma), ..shot };
        let point = shot.point;
        let distance = point.coords.norm();
        let sigma = shot.sigma.map(|[x, y, z]| (x * x + y * y + z * z).sqrt());
        if let (Some(sigma), Some(usual)) = (sigma, self.usual_sigma())
            && sigma > (UNSTEADY.0 * usual).max(UNSTEADY.1)
        {
            let [sigma, usual] = [sigma, usual].map(to_mm);
            return Err(Failure::Unstable(format!("it states a sigma of {sigma:.3} mm; usual are {usual:.3} mm")));
        }
        let reason = match () {
            () if !point.coords.iter().all(|value| value.is_finite()) => "it is not a number".to_owned(),
            () if point.coords.amax() <= f64::EPSILON => "it is 0, 0, 0".to_owned(),
            () if !(RANGE.0..=RANGE.1).contains(&distance) => {
                format!("it is {distance:.3} m away; {} to {} m can be", RANGE.0, RANGE.1)
            }
            () if self.before == Some(point) => return Err(Failure::repeated()),
            () => {
                self.before = Some(point);
                self.sigmas.extend(sigma);
                while self.sigmas.len() > USUAL {
                    self.sigmas.pop_front();
                }
                return Ok(shot);
            }
        };
        Err(Failure::Unusable(reason))
    }

    /// The middle one of the standard deviations so far (m), once there are enough.
    fn usual_sigma(&self) -> Option<f64> {
        let mut sorted: Vec<f64> = self.sigmas.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().filter(|_| sorted.len() >= UNSTEADY.2)
    }

    /// What there is to see now.
    fn live(&self) -> LiveReading {
        LiveReading { down: self.down.as_ref().map(ToString::to_string), ..self.look().reading() }
    }

    fn look(&self) -> Look {
        Look { instrument: self.instrument.eye(), robot: self.robot.as_ref().map(Wire::eye) }
    }
}

/// A look at both wires, also while something is measured.
struct Look {
    instrument: Eye,
    robot: Option<Eye>,
}

impl Look {
    fn reading(&self) -> LiveReading {
        let now = self.instrument.now();
        let Latest { live, heard, .. } = self.instrument.latest();
        let is_fresh = |now: Duration, at: Duration| now.saturating_sub(at) <= FRESH;
        let robot = self.robot.as_ref().map(|robot| (robot.latest(), robot.now()));
        let joints = robot.as_ref().and_then(|(latest, now)| {
            let (at, state) = latest.joints.as_ref()?;
            is_fresh(*now, *at).then(|| state.positions.clone())
        });
        LiveReading {
            seconds: now.as_secs_f64(),
            point: live.filter(|(at, _)| is_fresh(now, *at)).map(|(_, shot)| shot.point),
            is_blind: !self.instrument.shows_live,
            silent: heard
                .filter(|at| self.instrument.shows_live && !is_fresh(now, *at))
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
        // Nothing that came before this is an answer to it.
        drop(self.drain(Duration::ZERO));
        self.is_up()?;
        let joints = self.standing(keep_going)?;
        if self.before_shot.is_none() {
            self.pause(Duration::try_from_secs_f64(request.settle).unwrap_or_default(), keep_going)?;
        }
        let count = request.shots.max(1);
        let shots = (0..count).map(|_| self.shot(keep_going)).collect::<Result<Vec<Shot>, _>>()?;
        if let (Some(before), Some(after)) = (&joints, self.standing(keep_going)?) {
            let moved = before.iter().zip(&after).any(|(before, after)| (before - after).abs() > STANDING);
            if moved {
                return Err(LinkError::Robot("it has moved while the point was measured".to_owned()));
            }
        }
        let reading = mean(&shots, joints, self.instrument.now().saturating_sub(began).as_secs_f64());
        Ok(reading)
    }

    fn watch(&mut self, wait: Duration) -> Option<(LiveReading, Vec<LinkNews>)> {
        // An answer without a question is one that came too late.
        drop(self.drain(wait));
        Some((self.live(), std::mem::take(&mut self.news)))
    }

    fn eye(&self) -> Option<super::Look> {
        let look = self.look();
        Some(Box::new(move || look.reading()))
    }
}

impl Wired {
    /// As [`Link::connect`], while it is wanted. What happens on the way, such as a laser that warms up, is `told`.
    ///
    /// # Errors
    /// As there; [`LinkError::Cancelled`].
    pub fn connect_while(
        &mut self,
        keep_going: &dyn Fn() -> bool,
        told: &mut dyn FnMut(LinkNews),
    ) -> Result<String, LinkError> {
        let until = self.instrument.now() + SET_UP;
        let mut last_told = None;
        while self.identity.is_none() {
            let answer = self.drain(LOOK);
            if self.identity.is_some() {
                break;
            }
            for news in self.news.drain(..) {
                if let LinkNews::Status(text) = &news {
                    last_told = Some(text.clone());
                    told(news);
                }
            }
            if let Some(Err(failure)) = answer {
                return Err(LinkError::Instrument(in_set_up(failure)));
            }
            if !keep_going() {
                return Err(LinkError::Cancelled);
            }
            if self.instrument.now() > until {
                let seconds = SET_UP.as_secs_f64();
                return Err(LinkError::Instrument(match last_told {
                    Some(text) => Failure::NotReady(format!("{text}; the set-up was given up after {seconds:.0} s")),
                    None => Failure::Silent { what: format!("'{}' was being set up", self.address), seconds },
                }));
            }
        }
        if self.robot.is_some() {
            self.standing_robot(until)?;
        }
        // What was said on the way is in the line below.
        self.news.clear();
        let identity = self.identity.clone().unwrap_or_default();
        let reflector = identity.reflector.map_or_else(String::new, |reflector| {
            format!(", reflector {} (offset {:.3} mm)", reflector.name, reflector.offset * 1e3)
        });
        let told = identity.warnings.iter().chain(&identity.notes);
        let warnings = told.fold(String::new(), |all, one| all + "; " + one);
        let robot = if self.robot.is_some() { "; the robot tells its joint angles" } else { "" };
        Ok(format!("{}{reflector}{robot}{warnings}", identity.name))
    }
}

/// Who hangs up in the middle of the set-up has perhaps not understood it.
fn in_set_up(failure: Failure) -> Failure {
    match failure {
        Failure::Disconnected(why) => Failure::Disconnected(format!(
            "{why}, in the middle of the set-up: is it this kind of instrument, and the right port?"
        )),
        other => other,
    }
}

/// A robot at rest does not move by more during a measurement (rad).
const STANDING: f64 = 1e-4;

impl Wired {
    /// Waits until the robot tells its joints.
    fn standing_robot(&mut self, until: Duration) -> Result<(), LinkError> {
        loop {
            drop(self.drain(LOOK));
            if let Some(failure) = &self.robot_down {
                return Err(LinkError::Controller(failure.clone()));
            }
            if self.robot.as_ref().is_none_or(|robot| robot.latest().joints.is_some()) {
                return Ok(());
            }
            if self.instrument.now() > until {
                return Err(LinkError::Controller(no_joints(SET_UP)));
            }
        }
    }
}

/// The controller answers, but its joint angles do not come.
fn no_joints(waited: Duration) -> Failure {
    Failure::Silent { what: "joint angles were awaited".to_owned(), seconds: waited.as_secs_f64() }
}

/// The mean of shots with its scatter, and its σ where every shot states one.
fn mean(shots: &[Shot], configuration: Option<Vec<f64>>, seconds: f64) -> Reading {
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
        configuration,
        seconds,
    }
}
