//! The identity of a recording.

use jiff::Timestamp;
use rerun::external::re_log_types::{StoreId, StoreKind};

use super::{latin, names};
use crate::session::journal::{Entry, Line};
use crate::session::sha256;

/// Id, name and start of a recording, from the first line of its journal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Identity {
    pub(super) id: String,
    pub(super) name: String,
    pub(super) start: Timestamp,
}

impl Identity {
    /// Derives the identity from the first line of a journal.
    pub(super) fn of(first: &Line) -> Self {
        let name = match &first.entry {
            Entry::Opened { name, .. } => name.as_str(),
            _ => "session",
        };
        Self::named(name, first.time)
    }

    /// Derives the identity from a name and a start.
    pub(super) fn named(name: &str, start: Timestamp) -> Self {
        let id = sha256(format!("{name} {start}").as_bytes()).chars().take(32).collect();
        Self { id, name: latin::plain(name), start }
    }

    /// Returns a builder of streams of this recording. Its properties are rows like all others, so the stream sends none.
    #[cfg(feature = "live")]
    pub(super) fn stream_builder(&self) -> rerun::RecordingStreamBuilder {
        rerun::RecordingStreamBuilder::from_store_id(&self.recording()).send_properties(false)
    }

    /// Returns the id of the recording.
    pub(super) fn recording(&self) -> StoreId {
        StoreId::new(StoreKind::Recording, names::APPLICATION, self.id.clone())
    }

    /// Returns the id of the layout that line number `line` led to.
    pub(super) fn layout(&self, line: u64) -> StoreId {
        StoreId::new(StoreKind::Blueprint, names::APPLICATION, format!("{}-{line}", self.id))
    }
}
