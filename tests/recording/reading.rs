//! What a recording contains, read by the library's own reader.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use nalgebra::Point3;
use rerun::external::arrow::array::Array as _;
use rerun::external::arrow::util::display::array_value_to_string;
use rerun::external::re_log_encoding::DecoderApp;
use rerun::log::{Chunk, LogMsg};
use trupose::session::journal::{Entry, IdentifiedText, Journal};

/// Positions are 32-bit floats in a recording (m).
pub(super) const SINGLE: f64 = 1e-6;

pub(super) fn messages(path: &Path) -> Vec<LogMsg> {
    DecoderApp::decode_lazy(BufReader::new(File::open(path).unwrap())).map(Result::unwrap).collect()
}

/// The chunks of the session's data, or of its layout.
pub(super) fn chunks(path: &Path, of_layout: bool) -> Vec<Chunk> {
    let data = messages(path).into_iter().filter_map(|message| match message {
        LogMsg::ArrowMsg(store, arrow) if store.is_blueprint() == of_layout => Some(arrow),
        _ => None,
    });
    data.map(|arrow| Chunk::from_arrow_msg(&arrow).unwrap()).collect()
}

/// A row of a recording: its entity, when it is, and every component as text.
pub(super) type Row = (String, BTreeMap<String, i64>, BTreeMap<String, String>);

/// All rows. Of what is shown always only the last is kept, as a viewer does.
pub(super) fn rows(path: &Path, of_layout: bool) -> Vec<Row> {
    let mut rows: Vec<Row> = rows_in_order(path, of_layout).into_iter().map(|(_, row)| row).collect();
    rows.sort();
    rows
}

/// The same in the order in which they were written, with their numbers.
pub(super) fn rows_in_order(path: &Path, of_layout: bool) -> Vec<(String, Row)> {
    let mut temporal = Vec::new();
    let mut lasting: BTreeMap<(String, String), (String, String)> = BTreeMap::new();
    for chunk in chunks(path, of_layout) {
        let entity = chunk.entity_path().to_string();
        for (row, id) in chunk.row_ids().enumerate() {
            let values: BTreeMap<String, String> = chunk
                .components()
                .iter()
                .filter(|(_, column)| !column.list_array.is_null(row))
                .map(|(name, column)| (name.to_string(), array_value_to_string(&column.list_array, row).unwrap()))
                .collect();
            if chunk.is_static() {
                for (name, value) in values {
                    let last = lasting.entry((entity.clone(), name)).or_default();
                    if id.to_string() >= last.0 {
                        *last = (id.to_string(), value);
                    }
                }
            } else {
                let times = chunk.timelines().iter();
                let times = times.map(|(name, column)| (name.to_string(), column.times_raw()[row])).collect();
                temporal.push((id.to_string(), (entity.clone(), times, values)));
            }
        }
    }
    temporal.extend(
        lasting
            .into_iter()
            .map(|((entity, name), (id, value))| (id, (entity, BTreeMap::new(), BTreeMap::from([(name, value)])))),
    );
    temporal.sort();
    temporal
}

/// The number of journal lines in a recording that is whole.
pub(super) fn whole(path: &Path) -> usize {
    rows(path, false).iter().filter(|(entity, ..)| entity == "/text/log").count()
}

/// Numbers of a component on a timeline. Of several rows at one time the last counts, as in a viewer.
pub(super) fn numbers(path: &Path, entity: &str, timeline: &str, component: &str) -> Vec<(i64, Vec<f64>)> {
    let mut found = BTreeMap::new();
    for (_, (of, times, values)) in rows_in_order(path, false) {
        if let (true, Some(time), Some(value)) = (of == entity, times.get(timeline), values.get(component)) {
            let digits = |c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.' | 'e' | 'E');
            let values = value.split(|c| !digits(c)).filter(|text| !text.is_empty());
            found.insert(*time, values.map(|text| text.parse().unwrap()).collect());
        }
    }
    found.into_iter().collect()
}

pub(super) fn assert_points(found: &[f64], expected: impl Iterator<Item = Point3<f64>>, tolerance: f64, what: &str) {
    let expected: Vec<f64> = expected.flat_map(|point| point.coords.iter().copied().collect::<Vec<_>>()).collect();
    assert_eq!(found.len(), expected.len(), "{what}");
    for (found, expected) in found.iter().zip(&expected) {
        assert!((found - expected).abs() < tolerance, "{what}: {found} instead of {expected}");
    }
}

pub(super) fn results(journal: &Journal) -> Vec<IdentifiedText> {
    let entries = journal.lines.iter();
    entries
        .filter_map(|line| match &line.entry {
            Entry::Identified(identified) => Some((**identified).clone()),
            _ => None,
        })
        .collect()
}
