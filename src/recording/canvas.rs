//! The rows of a recording, collected until they are written or shown.

use jiff::Timestamp;
use rerun::external::re_log_types::EntityPath;
use rerun::{AsComponents, SerializedComponentBatch, TimeCell, TimePoint};

use super::names;

/// A place on the timelines.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moment {
    /// Number of the measurement.
    pub(super) pose: Option<i64>,
    /// Number of the journal line.
    pub(super) entry: Option<i64>,
    /// Sweep of the pose search.
    pub(super) plan_iteration: Option<i64>,
    /// Step of the solver.
    pub(super) solver_iteration: Option<i64>,
    pub(super) time: Option<Timestamp>,
}

impl Moment {
    /// Returns the moment of a sweep of the pose search.
    pub(super) fn search(step: usize) -> Self {
        Self { plan_iteration: Some(index(step)), ..Self::default() }
    }

    /// Returns the moment of a step of the solver.
    pub(super) fn solver(step: usize) -> Self {
        Self { solver_iteration: Some(index(step)), ..Self::default() }
    }

    /// Returns the moment of a pose, without a clock time.
    pub(super) fn pose(number: u64) -> Self {
        Self { pose: Some(i64::try_from(number).unwrap_or(i64::MAX)), ..Self::default() }
    }

    fn time_point(self) -> TimePoint {
        let sequences = [
            (names::POSE, self.pose),
            (names::ENTRY, self.entry),
            (names::PLAN_ITERATION, self.plan_iteration),
            (names::SOLVER_ITERATION, self.solver_iteration),
        ];
        let mut point = TimePoint::default();
        for (timeline, value) in sequences {
            if let Some(value) = value {
                point.insert_cell(timeline, TimeCell::from_sequence(value));
            }
        }
        if let Some(time) = self.time {
            point.insert_cell(names::TIME, TimeCell::from_timestamp_nanos_since_epoch(nanoseconds(time)));
        }
        point
    }
}

/// Returns an index of a timeline.
fn index(value: usize) -> i64 {
    i64::try_from(value).unwrap_or(i64::MAX)
}

/// Returns the nanoseconds since 1970.
pub(super) fn nanoseconds(time: Timestamp) -> i64 {
    i64::try_from(time.as_nanosecond()).unwrap_or(i64::MAX)
}

/// The values of an entity from a time on, or for all times.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub(super) entity: EntityPath,
    /// Empty for all times: the library calls that static.
    pub(super) time: TimePoint,
    pub(super) components: Vec<SerializedComponentBatch>,
}

impl Row {
    pub(super) fn new(path: &str, time: TimePoint, what: &dyn AsComponents) -> Self {
        Self { entity: path.into(), time, components: what.as_serialized_batches() }
    }
}

/// The layout that a viewer opens with.
#[derive(Debug)]
pub(super) struct Layout {
    /// Number of the journal line that led to it.
    pub(super) line: u64,
    pub(super) rows: Vec<Row>,
}

/// Collects rows.
#[derive(Debug, Default)]
pub(super) struct Canvas {
    pub(super) rows: Vec<Row>,
    /// The latest layout.
    pub(super) layout: Option<Layout>,
}

impl Canvas {
    /// Draws something that is visible from `moment` on.
    pub(super) fn draw(&mut self, moment: Moment, path: &str, what: &dyn AsComponents) {
        self.rows.push(Row::new(path, moment.time_point(), what));
    }

    /// Draws something that is visible at all times, and replaces what was drawn like that before.
    pub(super) fn draw_static(&mut self, path: &str, what: &dyn AsComponents) {
        self.rows.push(Row::new(path, TimePoint::default(), what));
    }
}
