//! Encodes recordings in the file format of the library. Equal lines give equal bytes.

use std::collections::BTreeMap;

use jiff::Timestamp;
use rerun::SerializedComponentBatch;
use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::external::re_log_types::external::re_tuid::Tuid;
use rerun::external::re_log_types::{BlueprintActivationCommand, SetStoreInfo, StoreId, StoreInfo, StoreSource};
use rerun::log::{Chunk, ChunkId, ChunkResult, LogMsg, RowId};

use super::blueprint::Purpose;
use super::canvas::{Canvas, Layout, Row, nanoseconds};
use super::identity::Identity;
use super::renderer::Renderer;
use super::{RecordingError, names};
use crate::session::journal::Line;
use crate::session::plan_summary::PlanSummary;

/// Returns the bytes of a recording of these lines, or of the plan in them.
pub(super) fn encode(lines: &[Line], plan: Option<&PlanSummary>) -> Result<Vec<u8>, RecordingError> {
    let (Some(first), Some(last)) = (lines.first(), lines.last()) else {
        return Err(RecordingError::library("drawing the recording", "there is nothing to record"));
    };
    let identity = Identity::of(first);
    let mut renderer = Renderer::new(&identity, if plan.is_some() { Purpose::Plan } else { Purpose::Story });
    for line in lines {
        renderer.draw(line);
    }
    if let Some(plan) = plan {
        renderer.plan_report(plan);
    }
    write(&identity, renderer.take_drawn(), Ids::after(last))
}

/// Returns the bytes of a recording of what was drawn.
pub(super) fn write(identity: &Identity, drawn: Canvas, mut ids: Ids) -> Result<Vec<u8>, RecordingError> {
    // The layout comes first, so that a viewer arranges itself before the data arrive.
    let mut messages = match drawn.layout {
        Some(layout) => layout_messages(identity, layout, &mut ids),
        None => Vec::new(),
    };
    messages.extend(store_messages(&identity.recording(), drawn.rows, &mut ids));
    encoded(messages)
}

fn encoded(messages: Vec<ChunkResult<LogMsg>>) -> Result<Vec<u8>, RecordingError> {
    let failed = |error| RecordingError::library("encoding the recording", error);
    let mut encoder =
        Encoder::new_eager(CrateVersion::LOCAL, EncodingOptions::PROTOBUF_COMPRESSED, Vec::new()).map_err(failed)?;
    // The index at the end is for files that are read in parts. It would take a third of the file, in an order drawn at random.
    encoder.do_not_emit_footer();
    for message in messages {
        encoder
            .append(&message.map_err(|error| RecordingError::library("drawing the recording", error))?)
            .map_err(failed)?;
    }
    encoder.finish().map_err(failed)?;
    encoder.into_inner().map_err(failed)
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

    /// Starts the ids of a recording without a journal.
    pub(super) fn at(time: Timestamp) -> Self {
        Self { time: nanoseconds(time).unsigned_abs(), next: 0 }
    }

    fn next(&mut self) -> Tuid {
        self.next += 1;
        Tuid::from_nanos_and_inc(self.time, self.next)
    }
}
