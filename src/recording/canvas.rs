//! The rows of a recording, collected until they are written or shown, and the two timelines that place them.

use jiff::Timestamp;
use rerun::external::re_log_types::EntityPath;
use rerun::{AsComponents, SerializedComponentBatch, TimeCell, TimePoint};

use super::names;

/// Nanoseconds of a second.
const SECOND: f64 = 1e9;

/// A moment on both timelines: everything that is drawn has a place on either.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Moment {
    /// Since the story began (ns).
    story: i64,
    /// Clock time (ns since 1970).
    time: i64,
}

impl Moment {
    /// Returns the moment at a `part` of the way to a later one.
    pub(super) fn towards(self, end: Self, part: f64) -> Self {
        let between = |from: i64, to: i64| from + nanoseconds_of((to - from) as f64 / SECOND * part);
        Self { story: between(self.story, end.story), time: between(self.time, end.time) }
    }

    fn time_point(self) -> TimePoint {
        let mut point = TimePoint::default();
        point.insert_cell(names::STORY, TimeCell::from_duration_nanos(self.story));
        point.insert_cell(names::TIME, TimeCell::from_timestamp_nanos_since_epoch(self.time));
        point
    }
}

#[expect(clippy::cast_possible_truncation, reason = "no story lasts 290 years")]
fn nanoseconds_of(seconds: f64) -> i64 {
    (seconds * SECOND).round() as i64
}

/// The film so far. Its clock times never go back, even where those of the journal do.
#[derive(Debug, Default)]
pub(super) struct Film {
    now: Moment,
}

impl Film {
    /// Starts at a clock time.
    pub(super) fn begin(time: Timestamp) -> Self {
        Self { now: Moment { story: 0, time: nanoseconds(time) } }
    }

    pub(super) const fn now(&self) -> Moment {
        self.now
    }

    /// Advances the story by `seconds`, and the clock to `time` or, where that is too early, by as many seconds. Returns where the
    /// step begins and where it ends.
    pub(super) fn advance(&mut self, seconds: f64, time: Timestamp) -> [Moment; 2] {
        let step = nanoseconds_of(seconds);
        let from = self.now;
        self.now = Moment { story: from.story + step, time: nanoseconds(time).max(from.time + step) };
        [from, self.now]
    }
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
