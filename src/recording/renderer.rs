//! Turns the lines of a journal into rows of a recording. Equal lines give equal rows.

mod cell;
mod document;
mod measured;
mod plan;
mod result;
mod tracker;

use jiff::Timestamp;
use rerun::components;
use rerun::{RecordingInfo, TextDocument, TextLog};

use super::blueprint::{self, Contents, Purpose};
use super::canvas::{Canvas, Layout, Moment, nanoseconds};
use super::identity::Identity;
use super::latin::plain;
use super::names;
use crate::session::journal::{Entry, Line, Sum, encode};
use crate::session::state::Session;
use tracker::Station;

/// Draws a session, line by line.
#[derive(Debug)]
pub(super) struct Renderer {
    canvas: Canvas,
    purpose: Purpose,
    session: Session,
    station: Station,
    sum: Sum,
    /// Number of results so far.
    runs: usize,
    /// Some sample has a temperature.
    has_temperatures: bool,
    /// A line did not fit the session, so nothing after it can be drawn.
    is_lost: bool,
}

impl Renderer {
    /// Starts the recording `identity`, of which no line is drawn yet.
    pub(super) fn new(identity: &Identity, purpose: Purpose) -> Self {
        let mut canvas = Canvas::default();
        let start = components::Timestamp::from(nanoseconds(identity.start));
        canvas.draw_static(
            names::PROPERTIES,
            &RecordingInfo::new().with_name(identity.name.as_str()).with_start_time(start),
        );
        Self {
            canvas,
            purpose,
            session: Session::default(),
            station: Station::default(),
            sum: Sum::default(),
            runs: 0,
            has_temperatures: false,
            is_lost: false,
        }
    }

    /// Returns everything that was drawn since the last call.
    pub(super) fn take_drawn(&mut self) -> Canvas {
        std::mem::take(&mut self.canvas)
    }

    /// Draws a line of the journal.
    pub(super) fn draw(&mut self, line: &Line) {
        if let Ok((text, sum)) = encode(line, &self.sum) {
            self.sum = sum;
            let number = i64::try_from(line.number).unwrap_or(i64::MAX);
            let moment = Moment { entry: Some(number), ..Moment::default() };
            self.canvas.draw(moment, names::JOURNAL, &TextDocument::new(text));
        }
        let had_temperatures = self.has_temperatures;
        match &line.entry {
            Entry::Identified(_) => self.runs += 1,
            Entry::Sample(noted) => self.has_temperatures |= noted.temperature_degc.is_some(),
            _ => {}
        }
        self.is_lost = self.is_lost || self.session.apply(line).is_err();
        self.log(line);
        if self.is_lost {
            return;
        }
        if self.station.update(&self.session, &line.entry) {
            let taken = if let Entry::Sample(noted) = &line.entry { Some(noted.number) } else { None };
            self.station.draw_all(&mut self.canvas, &self.session, taken);
        }
        match &line.entry {
            Entry::Opened { program, name, .. } => document::opening(&mut self.canvas, program, name, line.time),
            Entry::Profile { .. } => {
                self.cell();
                self.layout(line.number);
            }
            Entry::Target(_) => self.cell(),
            Entry::Plan(plan) | Entry::PlanExtended(plan) => {
                plan::search(&mut self.canvas, &plan.search);
                self.points();
            }
            Entry::Sample(noted) => {
                measured::sample(&mut self.canvas, &self.session, &self.station, noted, line.time);
                plan::points(&mut self.canvas, &self.session, false);
                if self.has_temperatures != had_temperatures {
                    self.layout(line.number);
                }
            }
            Entry::Correction(_) => {
                // It may have changed the configuration or the unit of any sample.
                for sample in &self.session.samples {
                    measured::sample(&mut self.canvas, &self.session, &self.station, &sample.noted, sample.time);
                }
                self.points();
            }
            Entry::Decision { .. } | Entry::Row(_) | Entry::Skipped { .. } => self.points(),
            Entry::Identified(identified) => {
                if self.runs == 1 {
                    self.layout(line.number);
                }
                result::draw(&mut self.canvas, &self.session, &self.station, identified, self.runs, line.time);
            }
            _ => {}
        }
    }

    /// Draws the cell as soon as the robot is known.
    fn cell(&mut self) {
        if let Some(profile) = self.session.mounted_profile() {
            cell::draw(&mut self.canvas, &profile, &self.station);
        }
    }

    /// Sets the layout of the viewer for what is known by now.
    fn layout(&mut self, line: u64) {
        let purpose = match self.purpose {
            Purpose::Capture if self.runs > 0 => Purpose::Result,
            purpose => purpose,
        };
        let contents = Contents { purpose, has_temperatures: self.has_temperatures };
        if let Some(profile) = self.session.mounted_profile() {
            self.canvas.layout = Some(Layout { line, rows: blueprint::rows(&profile, contents) });
        }
    }

    fn points(&mut self) {
        plan::poses(&mut self.canvas, &self.session);
        plan::points(&mut self.canvas, &self.session, true);
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
        let pose = i64::try_from(self.session.measurements).unwrap_or(i64::MAX);
        self.canvas.draw(Moment { pose: Some(pose), time: Some(line.time), ..Moment::default() }, names::LOG, &text);
    }
}

/// Returns the moment of a measurement.
fn pose_moment(number: u64, time: Timestamp) -> Moment {
    Moment { time: Some(time), ..Moment::pose(number) }
}
