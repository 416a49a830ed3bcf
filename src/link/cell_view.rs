//! The simulated cell as seen by an instrument and a robot's controller: one robot pose, observed over several wires.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use nalgebra::Point3;

use super::protocol::{JointState, Shot};
use super::simulator::PointSource;
use super::transport::Stopwatch;
use super::{LinkError, SimulatedCell};
use crate::profile::Profile;
use crate::session::reading::MeasureRequest;
use crate::session::wire::WireProtocol;

/// Checks that a controller can report the joints of this arm.
///
/// # Errors
/// [`LinkError::SetUp`]: the numbers of joints differ.
pub(super) fn check_joints(profile: &Profile, protocol: WireProtocol) -> Result<(), LinkError> {
    let joints = profile.chain().dof();
    let Some(reported) = protocol.reported_joints().filter(|reported| *reported != joints) else { return Ok(()) };
    Err(LinkError::SetUp(format!(
        "'{}' has {joints} joints, but {protocol} reports {reported}: \
         choose the instrument without the robot, or the profile of that robot",
        profile.name()
    )))
}

/// When the view advances to the next shot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Advance {
    /// At each call of [`CellView::advance`], so that the shots are the same as without wires.
    OnRequest,
    /// At each shot.
    EveryShot,
}

/// A move of the robot in progress.
#[derive(Clone, Debug)]
struct Motion {
    from: Vec<f64>,
    since: Duration,
    takes: Duration,
}

/// The cell with its robot at one pose.
#[derive(Debug)]
pub(super) struct CellView {
    pub(super) cell: SimulatedCell,
    advance: Advance,
    /// The current measurement.
    request: Option<MeasureRequest>,
    /// Shots of the current measurement; empty if the beam is broken.
    shots: Vec<Shot>,
    /// Number of shots taken so far.
    taken: usize,
    motion: Option<Motion>,
    clock: Stopwatch,
}

impl CellView {
    pub(super) fn new(cell: SimulatedCell, advance: Advance) -> Self {
        Self { cell, advance, request: None, shots: Vec::new(), taken: 0, motion: None, clock: Stopwatch::start() }
    }

    /// Moves the robot to another pose at once and starts its measurement.
    ///
    /// # Errors
    /// The request does not fit this cell.
    pub(super) fn move_to(&mut self, request: &MeasureRequest) -> Result<(), LinkError> {
        self.shots = match self.cell.shots(request) {
            Ok(shots) => shots,
            Err(LinkError::BeamBroken) => Vec::new(),
            Err(error) => return Err(error),
        };
        self.taken = 0;
        self.motion = None;
        self.request = Some(request.clone());
        Ok(())
    }

    /// Starts a move to another pose that takes this long.
    ///
    /// # Errors
    /// As [`Self::move_to`].
    pub(super) fn start_move(&mut self, request: &MeasureRequest, takes: Duration) -> Result<(), LinkError> {
        let from = self.request.as_ref().map(|before| before.configuration.clone());
        self.move_to(request)?;
        self.motion = from.map(|from| Motion { from, since: self.clock.now(), takes });
        Ok(())
    }

    /// Advances to the next shot.
    pub(super) fn advance(&mut self) {
        self.taken += 1;
    }

    /// Shots taken since the last move.
    pub(super) const fn taken(&self) -> usize {
        self.taken
    }

    /// Completed fraction of the move in progress.
    fn progress(&self) -> Option<f64> {
        let motion = self.motion.as_ref()?;
        let passed = self.clock.now().saturating_sub(motion.since).as_secs_f64() / motion.takes.as_secs_f64().max(1e-3);
        (passed < 1.0).then_some(passed)
    }

    /// Request for a measurement at the robot's current pose.
    fn current_request(&self) -> Option<MeasureRequest> {
        let mut current = self.request.clone()?;
        if let (Some(part), Some(motion)) = (self.progress(), &self.motion) {
            for (to, from) in current.configuration.iter_mut().zip(&motion.from) {
                *to = from + (*to - from) * part;
            }
            current.shots = 1;
        }
        Some(current)
    }

    /// The current shot. While the robot is at rest it stays the same until the view advances.
    fn current_shot(&mut self) -> Option<Shot> {
        if self.progress().is_some() {
            let request = self.current_request()?;
            return self.cell.shots(&request).ok()?.into_iter().next();
        }
        let index = self.taken.saturating_sub(1).checked_rem(self.shots.len())?;
        self.shots.get(index).cloned()
    }

    fn joints(&self) -> JointState {
        let at_zero = || vec![0.0; self.cell.truth().arm.chain.dof()];
        let positions = self.current_request().map_or_else(at_zero, |request| self.cell.actual_joints(&request));
        JointState { controller_time: self.clock.now().as_secs_f64(), ..JointState::at(positions) }
    }
}

/// A view that is shared by several threads.
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
        view.current_shot()
    }

    fn position(&mut self) -> Option<Shot> {
        self.lock().current_shot()
    }

    fn joints(&mut self) -> JointState {
        self.lock().joints()
    }
}

impl SimulatedCell {
    /// The single shots of a measurement, as an instrument returns them.
    ///
    /// # Errors
    /// As [`super::Link::measure`] of this cell.
    fn shots(&mut self, request: &MeasureRequest) -> Result<Vec<Shot>, LinkError> {
        let (points, sigma) = self.single_shots(request)?;
        let sigma = (sigma > 0.0).then_some([sigma; 3]);
        Ok(points.into_iter().map(|point| Shot { sigma, ..Shot::bare(Point3::from(point)) }).collect())
    }
}
