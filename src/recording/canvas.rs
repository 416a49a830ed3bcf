//! Rows of a recording, collected until they are written or shown.

use jiff::Timestamp;
use rerun::external::re_log_types::EntityPath;
use rerun::{AsComponents, SerializedComponentBatch, TimeCell, TimePoint};

use super::names;

/// When something is shown.
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
    /// Clock time.
    pub(super) time: Option<Timestamp>,
}

impl Moment {
    /// At a sweep of the pose search.
    pub(super) fn search(step: usize) -> Self {
        Self { plan_iteration: Some(index(step)), ..Self::default() }
    }

    /// At a step of the solver.
    pub(super) fn solver(step: usize) -> Self {
        Self { solver_iteration: Some(index(step)), ..Self::default() }
    }

    /// At a pose, without a clock time.
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

/// An index of a timeline.
fn index(value: usize) -> i64 {
    i64::try_from(value).unwrap_or(i64::MAX)
}

/// Nanoseconds since 1970.
pub(super) fn nanoseconds(time: Timestamp) -> i64 {
    i64::try_from(time.as_nanosecond()).unwrap_or(i64::MAX)
}

/// What an entity shows from a time on, or always.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub(super) entity: EntityPath,
    /// Empty: always.
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
    /// Number of the journal line that asked for it.
    pub(super) line: u64,
    pub(super) rows: Vec<Row>,
}

/// Collects what is drawn.
#[derive(Debug, Default)]
pub(super) struct Canvas {
    /// Rows in the order in which they were drawn.
    pub(super) rows: Vec<Row>,
    /// The last layout.
    pub(super) layout: Option<Layout>,
}

impl Canvas {
    /// Shows something from `moment` on.
    pub(super) fn draw(&mut self, moment: Moment, path: &str, what: &dyn AsComponents) {
        self.rows.push(Row::new(path, moment.time_point(), what));
    }

    /// Shows something always, in place of what was always shown there.
    pub(super) fn fix(&mut self, path: &str, what: &dyn AsComponents) {
        self.rows.push(Row::new(path, TimePoint::default(), what));
    }
}
