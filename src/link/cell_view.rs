//! The simulated cell as an instrument and a robot's controller see it: one place for the robot, looked at over several wires.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use nalgebra::Point3;

use super::protocol::{JointState, Shot};
use super::simulator::PointSource;
use super::transport::Stopwatch;
use super::{LinkError, SimulatedCell};
use crate::profile::Profile;
use crate::session::reading::MeasureRequest;

/// Joints that a controller tells.
const JOINTS: usize = 6;

/// Whether a controller can tell the joints of this arm.
///
/// # Errors
/// [`LinkError::SetUp`]: it has more or fewer.
pub(super) fn check_joints(profile: &Profile) -> Result<(), LinkError> {
    let joints = profile.chain().dof();
    if joints == JOINTS {
        return Ok(());
    }
    Err(LinkError::SetUp(format!(
        "'{}' has {joints} joints, but a controller with RTDE tells {JOINTS}: \
         choose the instrument without the robot, or the profile of this robot",
        profile.name()
    )))
}

/// Who decides when the next shot is another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Advance {
    /// Whoever measures says so, shot by shot: then the shots are those of the cell without wires.
    Told,
    /// Every shot is another one.
    EveryShot,
}

/// A move of the robot under way.
#[derive(Clone, Debug)]
struct Motion {
    from: Vec<f64>,
    since: Duration,
    takes: Duration,
}

/// The cell with its robot at one place.
#[derive(Debug)]
pub(super) struct CellView {
    pub(super) cell: SimulatedCell,
    advance: Advance,
    /// What is measured now.
    request: Option<MeasureRequest>,
    /// The shots of it; none: the beam is broken.
    shots: Vec<Shot>,
    /// How many have been asked for.
    taken: usize,
    motion: Option<Motion>,
    clock: Stopwatch,
}

impl CellView {
    pub(super) fn new(cell: SimulatedCell, advance: Advance) -> Self {
        Self { cell, advance, request: None, shots: Vec::new(), taken: 0, motion: None, clock: Stopwatch::start() }
    }

    /// The robot is at another place at once; what is measured from now on belongs to this. Returns the time from which on the
    /// controller tells of it (s).
    ///
    /// # Errors
    /// The request is none for this cell.
    pub(super) fn go(&mut self, request: &MeasureRequest) -> Result<f64, LinkError> {
        self.shots = match self.cell.shots(request) {
            Ok(shots) => shots,
            Err(LinkError::BeamBroken) => Vec::new(),
            Err(error) => return Err(error),
        };
        self.taken = 0;
        self.motion = None;
        self.request = Some(request.clone());
        Ok(self.clock.now().as_secs_f64())
    }

    /// The robot begins to move to another place and takes a while.
    ///
    /// # Errors
    /// As [`Self::go`].
    pub(super) fn travel(&mut self, request: &MeasureRequest, takes: Duration) -> Result<(), LinkError> {
        let from = self.request.as_ref().map(|before| before.configuration.clone());
        self.go(request)?;
        self.motion = from.map(|from| Motion { from, since: self.clock.now(), takes });
        Ok(())
    }

    /// Another shot is asked for.
    pub(super) fn advance(&mut self) {
        self.taken += 1;
    }

    /// Shots taken since the robot stands here.
    pub(super) const fn taken(&self) -> usize {
        self.taken
    }

    /// Part of the move that is done, while the robot moves.
    fn progress(&self) -> Option<f64> {
        let motion = self.motion.as_ref()?;
        let passed = self.clock.now().saturating_sub(motion.since).as_secs_f64() / motion.takes.as_secs_f64().max(1e-3);
        (passed < 1.0).then_some(passed)
    }

    /// What is measured where the robot is now.
    fn here(&self) -> Option<MeasureRequest> {
        let mut here = self.request.clone()?;
        if let (Some(part), Some(motion)) = (self.progress(), &self.motion) {
            for (to, from) in here.configuration.iter_mut().zip(&motion.from) {
                *to = from + (*to - from) * part;
            }
            here.shots = 1;
        }
        Some(here)
    }

    /// The shot that is due: the same until somebody asks for another one, while the robot rests.
    fn shown(&mut self) -> Option<Shot> {
        if self.progress().is_some() {
            let here = self.here()?;
            return self.cell.shots(&here).ok()?.into_iter().next();
        }
        let index = self.taken.saturating_sub(1).checked_rem(self.shots.len())?;
        self.shots.get(index).cloned()
    }

    fn joints(&self) -> JointState {
        let mut positions = self.here().map_or_else(Vec::new, |here| self.cell.standing(&here));
        // A controller of six joints tells six, whatever the arm.
        positions.resize(JOINTS, 0.0);
        let mut speeds = vec![0.0; JOINTS];
        if let (Some(_), Some(motion), Some(request)) = (self.progress(), &self.motion, &self.request) {
            let seconds = motion.takes.as_secs_f64().max(1e-3);
            for ((speed, to), from) in speeds.iter_mut().zip(&request.configuration).zip(&motion.from) {
                *speed = (to - from) / seconds;
            }
        }
        JointState { positions, speeds: Some(speeds), controller_time: self.clock.now().as_secs_f64(), stopped: None }
    }
}

/// A view that several threads look through.
#[derive(Clone, Debug)]
pub(super) struct SharedView(Arc<Mutex<CellView>>);

impl SharedView {
    pub(super) fn new(view: CellView) -> Self {
        Self(Arc::new(Mutex::new(view)))
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, CellView> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl PointSource for SharedView {
    fn shot(&mut self) -> Option<Shot> {
        let mut view = self.lock();
        if view.advance == Advance::EveryShot {
            view.advance();
        }
        view.shown()
    }

    fn look(&mut self) -> Option<Shot> {
        self.lock().shown()
    }

    fn joints(&mut self) -> JointState {
        self.lock().joints()
    }
}

impl SimulatedCell {
    /// The shots of a measurement, one by one, as an instrument gives them.
    ///
    /// # Errors
    /// As [`super::Link::measure`] of this cell.
    fn shots(&mut self, request: &MeasureRequest) -> Result<Vec<Shot>, LinkError> {
        let (points, sigma) = self.single_shots(request)?;
        let sigma = (sigma > 0.0).then_some([sigma; 3]);
        Ok(points.into_iter().map(|point| Shot { sigma, ..Shot::bare(Point3::from(point)) }).collect())
    }
}
