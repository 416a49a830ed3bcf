//! Turns the lines of a journal into a film, rows of a recording. Equal lines give equal rows.

mod cell;
mod charts;
mod document;
mod plan;
mod result;
mod sample;
mod station;

use jiff::Timestamp;
use rerun::{AsComponents, LineStrips3D, RecordingInfo, TextLog, components};

use super::arm::{self, Posture};
use super::blueprint::{self, Contents, Purpose};
use super::canvas::{Canvas, Film, Layout, Moment, nanoseconds};
use super::identity::Identity;
use super::latin::plain;
use super::{names, style};
use crate::profile::Profile;
use crate::session::journal::{Entry, Line, MeasuredText};
use crate::session::plan_summary::PlanSummary;
use crate::session::state::Session;
use station::Station;

pub(super) use charts::{legend, legend_region, pairs_region};
pub(super) use document::significant;
pub(super) use result::Magnified;

/// Length of the drive from pose to pose, however many there are (s).
const DRIVE: f64 = 14.0;
/// Shortest and longest step from one pose to the next (s).
const STEP: (f64, f64) = (0.014, 0.4);
/// Pictures of the arm during the whole drive, and the most from one pose to the next.
const PICTURES: usize = 160;
const MOST_PICTURES: usize = 5;

/// Draws a session, line by line.
#[derive(Debug)]
pub(super) struct Renderer {
    canvas: Canvas,
    purpose: Purpose,
    session: Session,
    film: Film,
    station: Station,
    /// The configuration that the arm is drawn at.
    q: Vec<f64>,
    /// Every picture of the arm so far.
    pictures: Vec<(Moment, Vec<f64>)>,
    /// When each sample was taken.
    moments: Vec<(u64, Moment)>,
    /// Series that have a row, and with it their looks.
    series: Vec<&'static str>,
    /// How many times larger the errors of the identified arm are drawn in a view of their own; none without a result.
    magnified: Option<Magnified>,
    /// A line did not fit the session, so nothing after it can be drawn.
    is_lost: bool,
}

impl Renderer {
    /// Starts the recording `identity`, of which no line is drawn yet.
    pub(super) fn new(identity: &Identity, purpose: Purpose) -> Self {
        let mut canvas = Canvas::default();
        let start = components::Timestamp::from(nanoseconds(identity.start));
        let info = RecordingInfo::new().with_name(identity.name.as_str()).with_start_time(start);
        canvas.draw_static(names::PROPERTIES, &info);
        Self {
            canvas,
            purpose,
            session: Session::default(),
            film: Film::begin(identity.start),
            station: Station::default(),
            q: Vec::new(),
            pictures: Vec::new(),
            moments: Vec::new(),
            series: Vec::new(),
            magnified: None,
            is_lost: false,
        }
    }

    /// Returns everything that was drawn since the last call.
    pub(super) fn take_drawn(&mut self) -> Canvas {
        std::mem::take(&mut self.canvas)
    }

    /// Draws what the lines of a journal do not say about a plan.
    pub(super) fn plan_report(&mut self, plan: &PlanSummary) {
        document::plan_report(&mut self.canvas, plan);
    }

    /// Draws a line of the journal.
    pub(super) fn draw(&mut self, line: &Line) {
        self.is_lost = self.is_lost || self.session.apply(line).is_err();
        if !self.is_lost {
            self.entry(line);
        }
        self.log(line);
    }

    fn entry(&mut self, line: &Line) {
        if self.station.update(&self.session, &line.entry)
            && let Some(profile) = self.session.mounted_profile()
        {
            self.station.draw(&mut self.canvas, &profile, self.film.now());
        }
        match &line.entry {
            Entry::Opened { program, name, .. } => document::opening(&mut self.canvas, program, name, line.time),
            Entry::Profile { .. } => self.open(line),
            Entry::Plan(plan) | Entry::PlanExtended(plan) => self.plan(plan.rows.len(), line),
            Entry::Sample(noted) => self.sample(noted, line),
            Entry::Identified(identified) => {
                result::draw(self, identified, line.time);
                self.layout(line.number);
            }
            Entry::Correction(_) | Entry::Undone { .. } | Entry::Redone { .. } => {
                // It may have changed the configuration or the unit of any sample.
                for (number, moment) in self.moments.clone() {
                    self.corrected(number, moment);
                }
                plan::points(&mut self.canvas, &self.session, self.film.now());
            }
            Entry::Decision { .. } | Entry::Row(_) | Entry::Skipped { .. } => {
                plan::points(&mut self.canvas, &self.session, self.film.now());
            }
            _ => {}
        }
    }

    /// Draws the cell as soon as the robot is known.
    fn open(&mut self, line: &Line) {
        let Some(profile) = self.session.mounted_profile() else { return };
        let now = self.film.now();
        cell::draw(&mut self.canvas, &profile, now);
        cell::arm(&mut self.canvas, &profile, names::NOMINAL, style::NOMINAL, now);
        self.station.draw(&mut self.canvas, &profile, now);
        self.q = arm::rest(&profile);
        self.arm(&profile, now);
        document::headline(&mut self.canvas, &document::waiting(&self.session));
        document::caption(&mut self.canvas, now, "The cell", profile.title());
        self.layout(line.number);
    }

    /// Draws the poses of a plan as they fall into place; a recording of a plan drives through them as well.
    fn plan(&mut self, rows: usize, line: &Line) {
        let Some(profile) = self.session.mounted_profile() else { return };
        let first = self.session.rows.len().saturating_sub(rows);
        plan::draw(&mut self.canvas, &mut self.film, &self.session, first, line.time);
        document::headline(&mut self.canvas, &document::waiting(&self.session));
        if self.purpose == Purpose::Plan {
            let way = self.session.rows.iter().skip(first).map(|row| row.planned.clone()).collect::<Vec<_>>();
            document::caption(&mut self.canvas, self.film.now(), "The program", "the arm drives from pose to pose");
            for (number, row) in (1..).zip(&way) {
                let before = Posture::nominal(&profile, &self.q).reflector;
                let moment = self.drive(&profile, &row.configuration, way.len(), line.time);
                plan::way(&mut self.canvas, moment, [before, Posture::nominal(&profile, &row.configuration).reflector]);
                if number == way.len() {
                    document::caption(&mut self.canvas, moment, "The plan", &document::plan_in_words(&self.session));
                }
            }
        }
        plan::points(&mut self.canvas, &self.session, self.film.now());
        self.layout(line.number);
    }

    fn sample(&mut self, noted: &MeasuredText, line: &Line) {
        let (Some(profile), Some(sample)) = (self.session.mounted_profile(), self.session.sample(noted.number)) else {
            return;
        };
        let q = self.session.configuration_of(sample);
        if self.moments.is_empty() {
            document::caption(&mut self.canvas, self.film.now(), "The measurement", "the arm drives from pose to pose");
        }
        let planned = self.session.rows.iter().filter(|row| row.planned.kind.is_measured()).count();
        let moment = self.drive(&profile, &q, planned, line.time);
        self.moments.push((noted.number, moment));
        self.measured(noted.number, moment);
        plan::points(&mut self.canvas, &self.session, moment);
        if self.session.identified.is_none() {
            document::headline(&mut self.canvas, &document::waiting(&self.session));
        }
    }

    /// Draws again a sample that may have another configuration by now.
    fn corrected(&mut self, number: u64, moment: Moment) {
        if let (Some(profile), Some(sample)) = (self.session.mounted_profile(), self.session.sample(number)) {
            let q = self.session.configuration_of(sample);
            self.canvas.draw(
                moment,
                names::NOMINAL,
                &arm_and_beam(&self.station, &profile, &Posture::nominal(&profile, &q)),
            );
            self.pictures.retain(|(of, _)| *of != moment);
            self.pictures.push((moment, q));
        }
        self.measured(number, moment);
    }

    /// Draws what belongs to a sample.
    fn measured(&mut self, number: u64, moment: Moment) {
        let Some(sample) = self.session.sample(number) else { return };
        let series = self.series.len();
        sample::draw(&mut self.canvas, &self.session, &self.station, sample, moment, &mut self.series);
        if self.series.len() != series {
            self.layout(self.session.lines);
        }
    }

    /// Moves the arm to a configuration, one of `poses`, and returns when it is there.
    fn drive(&mut self, profile: &Profile, q: &[f64], poses: usize, time: Timestamp) -> Moment {
        let poses = poses.max(1);
        let seconds = (DRIVE / poses as f64).clamp(STEP.0, STEP.1);
        let pictures = PICTURES.div_ceil(poses).min(MOST_PICTURES);
        let [from, to] = self.film.advance(seconds, time);
        let begin = std::mem::replace(&mut self.q, q.to_vec());
        for picture in 1..=pictures {
            let part = picture as f64 / pictures as f64;
            self.q = arm::between(&begin, q, part);
            self.arm(profile, from.towards(to, part));
        }
        to
    }

    /// Draws the nominal arm where it is.
    fn arm(&mut self, profile: &Profile, moment: Moment) {
        let posture = Posture::nominal(profile, &self.q);
        self.canvas.draw(moment, names::NOMINAL, &arm_and_beam(&self.station, profile, &posture));
        self.pictures.push((moment, self.q.clone()));
    }

    /// Sets the layout of the viewer for what is known by now.
    fn layout(&mut self, line: u64) {
        let Some(profile) = self.session.mounted_profile() else { return };
        let contents = Contents {
            purpose: self.purpose,
            has_report: self.purpose == Purpose::Plan || self.session.identified.is_some(),
            result: self.session.identified.as_deref().zip(self.magnified),
            has_search: self.session.plan.as_ref().is_some_and(|plan| !plan.search.is_empty()),
            series: &self.series,
            eye: blueprint::eye(&profile, &self.session, self.station.instrument(&profile)),
        };
        self.canvas.layout = Some(Layout { line, rows: blueprint::rows(&contents) });
    }

    /// Draws the line in words.
    fn log(&mut self, line: &Line) {
        let level = match &line.entry {
            Entry::Sample(noted) if !noted.findings.is_empty() => "WARN",
            Entry::Refused { .. } => "WARN",
            Entry::Row(_) | Entry::Step(_) => "DEBUG",
            _ => "INFO",
        };
        let text = TextLog::new(plain(&line.entry.describe())).with_level(level);
        self.canvas.draw(self.film.now(), names::LOG, &text);
    }
}

/// Returns an arm with the beam to its reflector.
fn arm_and_beam(station: &Station, profile: &Profile, posture: &Posture) -> Vec<Box<dyn AsComponents>> {
    let beam = LineStrips3D::update_fields().with_strips(station.beam(profile, posture));
    vec![Box::new(arm::placed(profile, posture)), Box::new(beam)]
}
