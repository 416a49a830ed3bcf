//! Where a scribe draws.

use jiff::Timestamp;
use rerun::{AsComponents, RecordingStream};

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
    /// When it happened.
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

    /// At a pose, seen from a result: it has no time of its own.
    pub(super) fn pose(number: u64) -> Self {
        Self { pose: Some(i64::try_from(number).unwrap_or(i64::MAX)), ..Self::default() }
    }
}

/// An index of a timeline.
fn index(value: usize) -> i64 {
    i64::try_from(value).unwrap_or(i64::MAX)
}

/// One stream of the library, with time set for every single thing.
#[derive(Debug)]
pub(super) struct Canvas {
    stream: RecordingStream,
}

impl Canvas {
    /// Draws on `stream`.
    pub(super) fn new(stream: RecordingStream) -> Self {
        // Two recordings of one journal are the same: only its own times count.
        stream.set_log_time_enabled(false);
        Self { stream }
    }

    /// Shows something from `moment` on.
    pub(super) fn draw(&self, moment: Moment, path: &str, what: &dyn AsComponents) {
        self.stream.reset_time();
        let sequences = [
            (names::POSE, moment.pose),
            (names::ENTRY, moment.entry),
            (names::PLAN_ITERATION, moment.plan_iteration),
            (names::SOLVER_ITERATION, moment.solver_iteration),
        ];
        for (timeline, value) in sequences {
            if let Some(value) = value {
                self.stream.set_time_sequence(timeline, value);
            }
        }
        if let Some(time) = moment.time {
            let nanoseconds = i64::try_from(time.as_nanosecond()).unwrap_or(i64::MAX);
            self.stream.set_timestamp_nanos_since_epoch(names::TIME, nanoseconds);
        }
        // Whether it was written is asked for when the stream is flushed.
        drop(self.stream.log(path, what));
    }

    /// Shows something always; replaces what was there.
    pub(super) fn fix(&self, path: &str, what: &dyn AsComponents) {
        drop(self.stream.log_static(path, what));
    }

    /// Says something about the session as a whole.
    pub(super) fn property(&self, name: &str, what: &dyn AsComponents) {
        drop(self.stream.send_property(name, what));
    }

    /// The stream.
    pub(super) const fn stream(&self) -> &RecordingStream {
        &self.stream
    }
}
