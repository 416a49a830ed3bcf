//! Encodes recordings in the file format of the library. Equal lines give equal bytes up to the index, whose order the library
//! draws at random.

use std::collections::BTreeMap;

use jiff::Timestamp;
use rerun::SerializedComponentBatch;
use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::external::re_log_types::external::re_tuid::Tuid;
use rerun::external::re_log_types::{BlueprintActivationCommand, SetStoreInfo, StoreId, StoreInfo, StoreSource};
use rerun::log::{Chunk, ChunkId, ChunkResult, LogMsg, RowId};

use super::blueprint::Purpose;
use super::canvas::{Layout, Row, nanoseconds};
use super::identity::Identity;
use super::renderer::Renderer;
use super::{RecordingError, names};
use crate::session::journal::Line;

/// Returns the bytes of a recording of these lines.
pub(super) fn encode(lines: &[Line], purpose: Purpose) -> Result<Vec<u8>, RecordingError> {
    let (Some(first), Some(last)) = (lines.first(), lines.last()) else {
        return Err(RecordingError::library("drawing the recording", "there is nothing to record"));
    };
    let identity = Identity::of(first);
    let mut renderer = Renderer::new(&identity, purpose);
    for line in lines {
        renderer.draw(line);
    }
    let drawn = renderer.take_drawn();
    let mut ids = Ids::after(last);
    // The layout comes first, so that a viewer arranges itself before the data arrive.
    let mut messages = match drawn.layout {
        Some(layout) => layout_messages(&identity, layout, &mut ids),
        None => Vec::new(),
    };
    messages.extend(store_messages(&identity.recording(), drawn.rows, &mut ids));
    encoded(messages)
}

/// Returns the bytes of a recording of these rows, without a layout.
pub(super) fn encode_rows(store: &StoreId, time: Timestamp, rows: Vec<Row>) -> Result<Vec<u8>, RecordingError> {
    let mut ids = Ids { time: nanoseconds(time).unsigned_abs(), next: 0 };
    encoded(store_messages(store, rows, &mut ids))
}

fn encoded(messages: Vec<ChunkResult<LogMsg>>) -> Result<Vec<u8>, RecordingError> {
    let mut bytes = Vec::new();
    Encoder::encode_into(CrateVersion::LOCAL, EncodingOptions::PROTOBUF_COMPRESSED, messages, &mut bytes)
        .map_err(|error| RecordingError::library("encoding the recording", error))?;
    Ok(bytes)
}

/// Returns the messages of a layout with the command that activates it.
pub(super) fn layout_messages(identity: &Identity, layout: Layout, ids: &mut Ids) -> Vec<ChunkResult<LogMsg>> {
    let blueprint_id = identity.layout(layout.line);
    let mut messages = store_messages(&blueprint_id, layout.rows, ids);
    let activation = BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
    messages.push(Ok(LogMsg::BlueprintActivationCommand(activation)));
    messages
}

/// Returns the messages of a recording or of a layout.
fn store_messages(store: &StoreId, rows: Vec<Row>, ids: &mut Ids) -> Vec<ChunkResult<LogMsg>> {
    let source = StoreSource::Other(names::APPLICATION.to_owned());
    let info = SetStoreInfo { row_id: ids.next(), info: StoreInfo::new(store.clone(), source) };
    let mut messages = vec![Ok(LogMsg::SetStoreInfo(info))];
    messages.extend(chunks(rows, ids).map(|chunk| Ok(LogMsg::ArrowMsg(store.clone(), chunk?.to_arrow_msg()?))));
    messages
}

/// Returns one chunk per entity and set of timelines. Each chunk adds about 1 kB of description, however few rows it has.
fn chunks(rows: Vec<Row>, ids: &mut Ids) -> impl Iterator<Item = ChunkResult<Chunk>> {
    let mut grouped = BTreeMap::new();
    for row in rows {
        let timelines: Vec<_> = row.time.timeline_names().copied().collect();
        let id = RowId::from_tuid(ids.next());
        grouped.entry((row.entity.clone(), timelines)).or_insert_with(Vec::new).push((id, row));
    }
    grouped.into_iter().map(|((entity, timelines), rows)| {
        let rows = if timelines.is_empty() { last_values(rows) } else { rows };
        let chunk = Chunk::builder_with_id(ChunkId::from_tuid(ids.next()), entity);
        rows.into_iter()
            .fold(chunk, |chunk, (id, row)| chunk.with_serialized_batches(id, row.time, row.components))
            .build()
    })
}

/// Merges rows without a time into one with the last value of each component, which is all that a viewer shows.
fn last_values(rows: Vec<(RowId, Row)>) -> Vec<(RowId, Row)> {
    let merged = rows.into_iter().reduce(|(_, before), (id, mut row)| {
        let is_kept = |batch: &SerializedComponentBatch| {
            row.components.iter().all(|newer| newer.descriptor.component != batch.descriptor.component)
        };
        let kept: Vec<_> = before.components.into_iter().filter(is_kept).collect();
        row.components.extend(kept);
        (id, row)
    });
    merged.into_iter().collect()
}

/// Generates the ids of rows and chunks. The library would take them from the clock. Here they follow from the end of the journal:
/// equal journals give equal files, and in a viewer that has an older recording of the session open the newer rows win.
#[derive(Debug)]
pub(super) struct Ids {
    time: u64,
    next: u64,
}

impl Ids {
    /// Starts the ids of a recording that ends with `last`.
    pub(super) fn after(last: &Line) -> Self {
        Self { time: nanoseconds(last.time).unsigned_abs(), next: last.number << 32 }
    }

    fn next(&mut self) -> Tuid {
        self.next += 1;
        Tuid::from_nanos_and_inc(self.time, self.next)
    }
}
