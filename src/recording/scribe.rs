//! Turns the journal into the picture, line by line: the same lines always draw the same.

mod cell;
mod document;
mod measured;
mod plan;
mod result;
mod tracker;

use jiff::Timestamp;
use rerun::{RecordingStream, TextDocument, TextLog};

use super::blueprint::{self, Contents, Purpose};
use super::canvas::{Canvas, Moment};
use super::names;
use crate::kinematics::{ForwardKinematics, KinematicChain};
use crate::profile::Profile;
use crate::session::journal::{Entry, Line, Sum, encode};
use crate::session::state::Session;
use nalgebra::{Isometry3, Point3};
use tracker::Station;

/// Draws a session.
#[derive(Debug)]
pub(super) struct Scribe {
    canvas: Canvas,
    purpose: Purpose,
    session: Session,
    station: Station,
    /// The tracker has to be drawn anew.
    has_moved: bool,
    sum: Sum,
    /// Results so far.
    runs: usize,
    /// A sample has a temperature.
    has_temperatures: bool,
    /// Whether a line did not fit: nothing after it can be drawn.
    is_lost: bool,
}

impl Scribe {
    /// Draws on `stream` a session whose first lines are drawn elsewhere already.
    pub(super) fn new(stream: RecordingStream, purpose: Purpose, before: &[Line]) -> Self {
        let mut scribe = Self {
            canvas: Canvas::new(stream),
            purpose,
            session: Session::default(),
            station: Station::default(),
            has_moved: false,
            sum: Sum::default(),
            runs: 0,
            has_temperatures: false,
            is_lost: false,
        };
        for line in before {
            scribe.follow(line);
        }
        scribe
    }

    /// Where it draws.
    pub(super) const fn stream(&self) -> &RecordingStream {
        self.canvas.stream()
    }

    /// Draws a line of the journal.
    pub(super) fn take(&mut self, line: &Line) {
        let before = self.sum.clone();
        let had_temperatures = self.has_temperatures;
        let follows = self.follow(line);
        if let Ok((text, _)) = encode(line, &before) {
            let number = i64::try_from(line.number).unwrap_or(i64::MAX);
            let moment = Moment { entry: Some(number), ..Moment::default() };
            self.canvas.draw(moment, names::JOURNAL, &TextDocument::new(text));
        }
        self.log(line);
        if !follows {
            return;
        }
        if std::mem::take(&mut self.has_moved) {
            let taken = if let Entry::Sample(noted) = &line.entry { Some(noted.number) } else { None };
            self.station.draw_all(&self.canvas, &self.session, taken);
        }
        match &line.entry {
            Entry::Opened { program, name, .. } => document::opening(&self.canvas, program, name, line.time),
            Entry::Profile { .. } => {
                self.cell();
                self.layout();
            }
            Entry::Target(_) => self.cell(),
            Entry::Plan(plan) | Entry::PlanExtended(plan) => {
                plan::search(&self.canvas, &plan.search);
                self.points();
            }
            Entry::Sample(noted) => {
                measured::sample(&self.canvas, &self.session, &self.station, noted, line.time);
                plan::points(&self.canvas, &self.session, false);
                if self.has_temperatures != had_temperatures {
                    self.layout();
                }
            }
            Entry::Correction(_) => {
                // It may have changed where the robot stood, or the unit, at any of them.
                for sample in &self.session.samples {
                    measured::sample(&self.canvas, &self.session, &self.station, &sample.noted, sample.time);
                }
                self.points();
            }
            Entry::Decision { .. } | Entry::Row(_) | Entry::Skipped { .. } => self.points(),
            Entry::Identified(identified) => {
                if self.runs == 1 {
                    self.layout();
                }
                result::draw(&self.canvas, &self.session, &self.station, identified, self.runs, line.time);
            }
            _ => {}
        }
    }

    /// Takes note of a line without drawing it; `false` if it does not fit.
    fn follow(&mut self, line: &Line) -> bool {
        if let Ok((_, sum)) = encode(line, &self.sum) {
            self.sum = sum;
        }
        match &line.entry {
            Entry::Identified(_) => self.runs += 1,
            Entry::Sample(noted) => self.has_temperatures |= noted.temperature_degc.is_some(),
            _ => {}
        }
        self.is_lost = self.is_lost || self.session.apply(line).is_err();
        self.has_moved = !self.is_lost && self.station.follow(&self.session, &line.entry);
        !self.is_lost
    }

    /// The cell as soon as the robot is known.
    fn cell(&self) {
        if let Some(profile) = self.session.mounted_profile() {
            cell::draw(&self.canvas, &profile, &self.station);
        }
    }

    /// What a viewer arranges from now on.
    fn layout(&self) {
        let purpose = match self.purpose {
            Purpose::Capture if self.runs > 0 => Purpose::Result,
            purpose => purpose,
        };
        let contents = Contents { purpose, has_temperatures: self.has_temperatures };
        if let Some(profile) = self.session.mounted_profile() {
            blueprint::send(&self.canvas, &profile, contents);
        }
    }

    fn points(&self) {
        plan::poses(&self.canvas, &self.session);
        plan::points(&self.canvas, &self.session, true);
    }

    /// What happened in words.
    fn log(&self, line: &Line) {
        let level = match &line.entry {
            Entry::Sample(noted) if !noted.findings.is_empty() => "WARN",
            Entry::Refused { .. } => "WARN",
            Entry::Row(_) | Entry::Step(_) => "DEBUG",
            _ => "INFO",
        };
        let text = TextLog::new(super::read::plain(&line.entry.describe())).with_level(level);
        let pose = i64::try_from(self.session.measurements).unwrap_or(i64::MAX);
        self.canvas.draw(Moment { pose: Some(pose), time: Some(line.time), ..Moment::default() }, names::LOG, &text);
    }
}

/// When a measurement was made.
fn pose_moment(number: u64, time: Timestamp) -> Moment {
    Moment { time: Some(time), ..Moment::pose(number) }
}

/// An arm at a configuration: its frames and the points that a line through it visits, the reflector last.
pub(super) struct Posture {
    frames: Vec<Isometry3<f64>>,
    pub(super) line: Vec<Point3<f64>>,
    reflector: Point3<f64>,
}

impl Posture {
    /// `q` are pendant values ((rad) or (m)); missing ones are zero.
    fn new(chain: &KinematicChain, target: &Point3<f64>, q: &[f64]) -> Self {
        let mut q = q.to_vec();
        q.resize(chain.dof(), 0.0);
        let forward = ForwardKinematics::new(chain);
        let frames = forward.base_from_links(&q);
        let reflector = forward.point_in_base(&q, target);
        let mut line = vec![Point3::origin()];
        line.extend(frames.iter().map(|frame| Point3::from(frame.translation.vector)));
        line.push(reflector);
        line.dedup_by(|one, other| (*one - *other).norm() < 1e-6);
        Self { frames, line, reflector }
    }

    /// The nominal arm of `profile` with its first target.
    pub(super) fn nominal(profile: &Profile, q: &[f64]) -> Self {
        let target = profile.targets().first().map_or_else(Point3::origin, |target| target.position_in_flange);
        Self::new(profile.chain(), &target, q)
    }
}

/// Length of the arm stretched out (m), for sizes in the picture.
fn reach(profile: &Profile) -> f64 {
    profile.chain().length().max(0.1)
}
